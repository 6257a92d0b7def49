"""A model of your own, cut where you want it.

    python examples/02_own_model.py [FOLDER]

fabfold looks for a good grid by itself. Here the model is a robot made of 10 mm cubes, so we know
where the cuts belong, and place the grid by hand: its direction, its origin and its pitch.
"""

import sys
from pathlib import Path

from build123d import Box, Part, Pos, Rot, export_step

from fabfold import Kit

CUBE = 10.0  # mm
SLANT = 30.0  # degrees that the robot looks aside, as a model from elsewhere may


def robot() -> Part:
    """Legs, feet, trunk with arms, head: 16 cubes, looking along -y."""
    blocks = [  # least corner and size, in cubes
        ((1, 0, 0), (2, 1, 2)),  # legs
        ((1, -1, 0), (2, 1, 1)),  # feet
        ((0, 0, 2), (4, 1, 2)),  # trunk and arms
        ((1, 0, 4), (2, 1, 1)),  # head
    ]
    shape = Part()
    for corner, size in blocks:
        middle = [CUBE * (least + side / 2) for least, side in zip(corner, size, strict=True)]
        shape += Pos(*middle) * Box(*(CUBE * side for side in size))
    return shape


def main(folder: str = "robot-kit") -> None:
    model = Path(folder).with_suffix(".step")
    model.parent.mkdir(parents=True, exist_ok=True)
    export_step(Rot(Z=SLANT) * robot(), model)

    kit = Kit.from_model(
        model,
        template="box-2x2x4",
        folder=folder,
        effort="quick",
        rotation=(0, 0, -SLANT),  # turns the model until its cubes lie along x, y and z
        origin=(5, 5, 5),  # the middle of a cube, after this turn, in the model's units
        pitch=CUBE,  # one voxel a cube, in the model's units
        voxel_mm=20,  # what a voxel measures in print: the robot grows to twice its size
    )
    voxels = kit.voxelize()[0]
    print(f"The robot is {len(voxels)} voxels, {voxels.fill.mean():.0%} full.")

    tree = kit.fold().tree
    print(f"It folds into {tree.template.name} on {len(tree.hinges)} hinges.")
    for body in tree.bodies:
        print(f"  {body.name}: voxels at", *(tuple(tree.source[i].tolist()) for i in body.voxels))

    kit.export()
    print(f"The kit is in {folder}.")


if __name__ == "__main__":
    main(*sys.argv[1:])
