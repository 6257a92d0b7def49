"""A target of your own: a ruler that folds into stairs.

    python examples/03_own_template.py [FOLDER]

What a model folds into need not be a box. A template is any shape of cells, and a small text file.
"""

import sys
from pathlib import Path

import trimesh

from fabfold import Kit, load_template

# Layers from the ground up; rows along y, characters along x.
STAIRS = """\
name = "stairs"
description = "three steps, two cells wide"
layers = [
    ["###", "###"],
    ["##.", "##."],
    ["#..", "#.."],
]
"""


def main(folder: str = "stairs-kit") -> None:
    home = Path(folder)
    home.parent.mkdir(parents=True, exist_ok=True)
    template = home.with_name("stairs.toml")
    template.write_text(STAIRS, encoding="utf-8")

    stairs = load_template(str(template))
    # Half turns keep the colour of a cell, as on a chessboard, so both colours must fit.
    black = int((stairs.cells.sum(axis=1) % 2).sum())
    print(f"{stairs.name}: {len(stairs)} cells, {black} black and {len(stairs) - black} white.")

    # A ruler as long as the stairs have cells, one cell wide and high.
    ruler = home.with_name("ruler.stl")
    trimesh.creation.box((10.0 * len(stairs), 10.0, 10.0)).export(ruler)

    kit = Kit.from_model(ruler, template=str(template), folder=home, effort="quick")
    built = kit.join()
    tree, motion = built.planned.tree, built.planned.motion
    print(f"The ruler is {len(tree.source)} voxels and bends at {len(tree.hinges)} hinges.")
    for number, moving in enumerate(motion.moves[1:], start=1):
        turned = motion.angles_deg[number] - motion.angles_deg[number - 1]
        turns = (f"{motion.hinges[hinge]} by {turned[hinge]:+.0f}°" for hinge in moving)
        print(f"  move {number}: turn", ", ".join(turns))

    kit.export()
    print(f"The kit is in {folder}.")


if __name__ == "__main__":
    main(*sys.argv[1:])
