"""A box for a gridfinity drawer, two cells by one, with a lid on a piece of filament.

Box and lid print apart or beside one another, each standing as it is used; a piece of 1.75 mm
filament is pushed through the knuckles after that. Run it with a folder to write to:
``python 12_gridfinity_box_build123d.py out``.
"""

import sys
from itertools import pairwise
from pathlib import Path

from build123d import BuildPart, BuildSketch, Part, Plane, Pos, RectangleRounded, extrude, loft

from hinges import Bracket, FilamentPin, SingleHinge, hinge_location, write_3mf

CELL, ROOM, HIGH, RIM, WALL = 42.0, 0.5, 42.0, 6.0, 1.2
WIDE, DEEP = 2 * CELL - ROOM, CELL - ROOM
GAP = 0.3
#: Height, side and corner radius of a foot, from below.
FOOT = ((0.0, 35.6, 0.8), (0.8, 37.2, 1.6), (2.6, 37.2, 1.6), (4.75, DEEP, 3.75))


def foot() -> Part:
    """What stands in one cell of the drawer's grid."""
    with BuildPart() as made:
        for pair in pairwise(FOOT):
            for height, side, radius in pair:
                with BuildSketch(Plane.XY.offset(height)):
                    RectangleRounded(side, side, radius)
            loft()
    return made.part


def tray(floor: float, high: float) -> Part:
    """A rounded box open above, from z = 0."""
    hollow = extrude(RectangleRounded(WIDE - 2 * WALL, DEEP - 2 * WALL, 3.75 - WALL), high)
    return extrude(RectangleRounded(WIDE, DEEP, 3.75), high) - Pos(0, 0, floor) * hollow


def main() -> tuple[Part, Part, Part]:
    top = FOOT[-1][0]
    box = Pos(0, 0, top) * tray(2.2, HIGH - top)
    box += [Pos(x) * foot() for x in (-0.5 * CELL, 0.5 * CELL)]
    box = Pos(0, -0.5 * (DEEP + GAP)) * box
    lid = Pos(0, 0.5 * (DEEP + GAP), HIGH - RIM) * tray(WALL, RIM)

    # The corners are round, so the hinge is shorter than the box.
    hinge = SingleHinge(
        WIDE - 12, knuckles=5, clearance=GAP, pin=FilamentPin(), leaf=Bracket(gusset=True)
    )
    place = hinge_location((0, 0, HIGH + 0.5 * GAP), along=(1, 0, 0), outwards=(0, 0, 1))
    box, lid = hinge.fit(box, lid, place)
    pin = hinge.hardware.moved(place)

    box.label, lid.label, pin.label = "box", "lid", "pin"
    return box, lid, pin


if __name__ == "__main__":
    box, lid, pin = main()
    if len(sys.argv) > 1:
        folder = Path(sys.argv[1])
        folder.mkdir(parents=True, exist_ok=True)
        write_3mf([box, lid], folder / "gridfinity_box.3mf")
    size = pin.bounding_box().size
    print(f"cut {max(size):.1f} mm of filament, {min(size):.2f} mm thick")
