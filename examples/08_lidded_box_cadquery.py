"""The lidded box of example 07, in CadQuery.

Run it with a folder to write to: ``python 08_lidded_box_cadquery.py out``.
"""

import sys
from pathlib import Path

import cadquery as cq

import hinges.cadquery  # noqa: F401 - registers hingeParent, hingeChild, singleHinge, ...
from hinges import Bracket

WIDE, DEEP, HIGH, WALL, GAP = 60.0, 40.0, 18.0, 2.4, 0.3


def tray(y: float) -> cq.Workplane:
    """A box open above, standing on z = 0."""
    return (
        cq.Workplane()
        .box(WIDE, DEEP, HIGH, centered=(True, True, False))
        .faces(">Z")
        .shell(-WALL)
        .translate((0, y, 0))
    )


def main() -> tuple[cq.Workplane, cq.Workplane]:
    # The hinge's axis is the z of the workplane; its x points from box to lid, here along +y.
    edge = cq.Plane(origin=(0, 0, HIGH + 0.5 * GAP), xDir=(0, 1, 0), normal=(1, 0, 0))
    options = {"knuckles": 5, "clearance": GAP, "leaf": Bracket(gusset=True)}

    box = cq.Workplane(edge).add(tray(-0.5 * (DEEP + GAP))).hingeParent(WIDE, **options)
    lid = cq.Workplane(edge).add(tray(0.5 * (DEEP + GAP))).hingeChild(WIDE, **options)
    return box, lid


if __name__ == "__main__":
    box, lid = main()
    closed = lid.rotate((0, 0, HIGH + 0.5 * GAP), (1, 0, HIGH + 0.5 * GAP), 180)
    print(f"closed, with {box.val().distance(closed.val()):.3f} mm between box and lid")
    if len(sys.argv) > 1:
        folder = Path(sys.argv[1])
        folder.mkdir(parents=True, exist_ok=True)
        assembly = cq.Assembly().add(box, name="box").add(lid, name="lid")
        assembly.export(str(folder / "lidded_box.step"))
