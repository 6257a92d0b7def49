"""Paths that forces find: python benchmarks/physics.py KIT ...

Each kit's tree is folded by forces without help (`fabfold fold KIT --method physics`), and the
bodies are made and certified for that path. Writes benchmarks/physics.md.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
import time
from pathlib import Path

from fabfold.errors import FabfoldError
from fabfold.fold.motion import motion_of
from fabfold.kit.kit import open_kit
from fabfold.kit.stages import PlannedTree, build
from fabfold.physics.forced_path import physics_path
from fabfold.progress import SilentProgress

HERE = Path(__file__).parent


def row_of(path: str) -> str:
    """One kit's line of the table."""
    with tempfile.TemporaryDirectory() as work:
        folder = Path(work) / "kit"
        shutil.copytree(path, folder)
        kit = open_kit(str(folder))
        planned = kit.fold()
        moves = len(planned.motion.moves) - 1
        start = time.process_time()
        tree = planned.tree
        told = f"| {kit.recipe.name} | {len(tree.source)} | {len(tree.hinges)} | {moves} |"
        try:
            found = physics_path(planned.tree)
        except FabfoldError as error:
            seconds = time.process_time() - start
            return f"{told} – | – | – | {seconds:.1f} | {error} |"
        seconds = time.process_time() - start
        motion = motion_of(planned.tree, found.path)
        forced = PlannedTree(planned.voxels, planned.tree, motion)
        try:
            built = build(forced, kit.print_mode(), kit.recipe.voxel_mm, (), SilentProgress())
            gap = f"{built.planned.motion.certificate['min_gap_mm']:.3f} mm"
        except FabfoldError as error:
            gap = str(error)
        carved = len(found.carved)
        return f"{told} {len(found.path)} | {carved} | {found.attempts} | {seconds:.1f} | {gap} |"


def main() -> None:
    """Fold the kits given, and write the table."""
    lines = [
        "# Paths that forces find",
        "",
        "`python benchmarks/physics.py KIT ...`: trees of the search, folded by forces alone.",
        "Voxels carved, and attempts, until A and B met; processor seconds of the simulation; the",
        "gap that was proven on the printed bodies along the whole path.",
        "",
        "| kit | voxels | hinges | moves planned | by forces | carved | attempts | s | proven |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for path in sys.argv[1:]:
        lines.append(row_of(path))
        print(lines[-1], flush=True)
    (HERE / "physics.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
