"""What the manual and the page of kits come to: moves, steps, pages, seconds, sizes.

    python benchmarks/guide.py KIT ...

KIT is the folder of a kit that was exported. Writes benchmarks/guide.md.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

from fabfold.guide.manual import plan_steps
from fabfold.guide.manual_pdf import page_count
from fabfold.guide.step_views import step_views
from fabfold.kit.guide_files import write_guide
from fabfold.kit.kit import open_kit
from fabfold.progress import SilentProgress

HERE = Path(__file__).resolve().parent


def main() -> None:
    rows = []
    for name in sys.argv[1:]:
        kit = open_kit(name)
        built, mode = kit.join(), kit.print_mode()
        tree, motion = built.planned.tree, built.planned.motion
        plan = plan_steps(built.joinery, tree, motion, built.planned.voxels.rotation.T)
        step_views(built.joinery, tree, plan.steps[:1])  # What is compiled once is not counted.
        turns = sum(view.turned for view in plan.group_views)
        with tempfile.TemporaryDirectory() as folder:
            start = time.process_time()
            write_guide(Path(folder), kit.recipe, mode, built, SilentProgress())
            seconds = time.process_time() - start
            sizes = {path.name: path.stat().st_size / 1e6 for path in Path(folder).iterdir()}
            pages = page_count((Path(folder) / "manual.pdf").read_bytes())
        rows.append(
            f"| {kit.recipe.name} | {len(tree.bodies)} | {len(motion.moves) - 1} "
            f"| {len(plan.groups)} | {turns} | {pages} | {sizes['manual.pdf']:.2f} "
            f"| {sizes['manual.html']:.2f} | {sizes['fold.html']:.2f} | {seconds:.1f} |"
        )
        print(rows[-1], flush=True)
    lines = [
        "# Manuals and pages of kits",
        "",
        "Written by `python benchmarks/guide.py KIT ...`. Turned: how often the reader is asked to",
        "turn the whole. Sizes in MB; processor seconds for all of it, `fold.png` included.",
        "",
        "| kit | bodies | moves | steps | turned | pages | manual.pdf | manual.html | fold.html "
        "| s |",
        "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|",
        *rows,
    ]
    (HERE / "guide.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
