"""Voxelizations by most fill and by how far they could close the box: benchmarks/voxel_choice.md.

    python benchmarks/voxel_choice.py [NAME ...] [--models DIR]

Each model is cut twice in one process: once as the voxelizations of most fill come, once with those
rated that close the box further. Names as in ``energies.py``; models that are not there are left
out. The page is written where all are measured.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from energies import MODELS, SHARED

from fabfold.kit.box_closure import closing_rate
from fabfold.kit.kit import Kit
from fabfold.voxels.voxelize import voxelize

PAGE = Path(__file__).resolve().parent / "voxel_choice.md"
NAMES = ("sample car", "sample duck", "sample rabbit", "bunny", "kitten", "dragon", "car")


def row(name: str, models: Path) -> str:
    """Bounds of the two largest sizes before and after, and processor seconds."""
    source, template_name = MODELS[name]
    path = source if source.startswith("sample:") else str(models / source)
    kit = Kit.from_model(path, template=template_name)
    solid, template = kit.solid(), kit.template
    rate = closing_rate(kit.recipe, template)
    least = 0.86 * len(template)
    cells, seconds = [], []
    voxelize(solid, template, seed=1, placements=2, shortlist=1, results=1)  # compiles
    for judge in (None, rate):
        start = time.process_time()
        found = voxelize(solid, template, seed=1, rate=judge)
        seconds.append(time.process_time() - start)
        sizes = sorted({len(v) for v in found if len(v) >= least}, reverse=True)
        best = {n: max(rate(v) for v in found if len(v) == n) for n in sizes}
        cells.append(", ".join(f"{n}: {best[n]:.3f}" for n in sizes))
    return f"| {name} | {cells[0]} | {cells[1]} | {seconds[0]:.1f} | {seconds[1]:.1f} |"


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", default=NAMES)
    parser.add_argument("--models", type=Path, default=SHARED)
    options = parser.parse_args()
    lines = [
        "# Which voxelizations are searched",
        "",
        "Written by `python benchmarks/voxel_choice.py`: number of voxels and the share to which",
        "they could close the box at most, by single hinges; of each size the best. Left: of those",
        "of most fill. Right: of up to 20 that are cut. Processor seconds of cutting.",
        "",
        "| model | most fill | rated | s | s, rated |",
        "|---|---|---|--:|--:|",
    ]
    for name in options.names:
        source = MODELS[name][0]
        if source.startswith("sample:") or (options.models / source).is_file():
            lines.append(row(name, options.models))
            print(lines[-1], flush=True)
    if tuple(options.names) == NAMES:
        PAGE.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
