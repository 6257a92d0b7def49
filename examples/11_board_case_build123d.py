"""A case for a credit-card computer: walls of 2 mm, and a lid that stops upright.

Case and lid print in one piece, the lid open, without support: a gusset carries the bracket that is
deeper than the wall. Run it with a folder to write to: ``python 11_board_case_build123d.py out``.
"""

import sys
from pathlib import Path

from build123d import Align, Axis, Box, Cylinder, Part, Pos

from hinges import Bracket, SingleHinge, hinge_location, write_3mf

WIDE, DEEP, HIGH, WALL, GAP = 90.0, 62.0, 22.0, 2.0, 0.3
BOARD = (85.0, 56.0)
HOLES = (58.0, 49.0)  # between the board's holes
STANDING = (Align.CENTER, Align.CENTER, Align.MIN)
OPEN = 110.0


def shell(high: float) -> Part:
    """A box open above, standing on z = 0."""
    hollow = Box(WIDE - 2 * WALL, DEEP - 2 * WALL, high, align=STANDING)
    return Box(WIDE, DEEP, high, align=STANDING) - Pos(0, 0, WALL) * hollow


def case() -> Part:
    """The case, with posts for the board and openings for its plugs."""
    made = shell(HIGH)
    west = -0.5 * BOARD[0] + 3.5
    for x in (west, west + HOLES[0]):
        for y in (-0.5 * HOLES[1], 0.5 * HOLES[1]):
            made += Pos(x, y, WALL) * Cylinder(3.0, 3.0, align=STANDING)
            made -= Pos(x, y, WALL) * Cylinder(1.1, 4.0, align=STANDING)
    made -= Pos(0.5 * WIDE, 0, WALL + 4.0) * Box(10, 50, 16, align=STANDING)
    return made - Pos(-14, -0.5 * DEEP, WALL + 4.0) * Box(40, 10, 8, align=STANDING)


def main() -> tuple[Part, Part]:
    box = Pos(0, -0.5 * (DEEP + GAP), 0) * case()
    lid = Pos(0, 0.5 * (DEEP + GAP), HIGH - 8.0) * shell(8.0)

    # The lid lies on the case at 180°, and opens by 110° from there; it is printed half open.
    hinge = SingleHinge(
        WIDE,
        knuckles=5,
        clearance=GAP,
        opens=OPEN,
        closed=180,
        angle=90,
        leaf=Bracket(gusset=True),
    )
    place = hinge_location((0, 0, HIGH + 0.5 * GAP), along=(1, 0, 0), outwards=(0, 0, 1))
    lid = lid.rotate(Axis(place.position, (1, 0, 0)), hinge.spec.angle)
    box, lid = hinge.fit(box, lid, place)

    box.label, lid.label = "case", "lid"
    return box, lid


if __name__ == "__main__":
    box, lid = main()
    if len(sys.argv) > 1:
        folder = Path(sys.argv[1])
        folder.mkdir(parents=True, exist_ok=True)
        write_3mf([box, lid], folder / "board_case.3mf")
    box.joints["hinge"].connect_to(lid.joints["hinge"], angle=180)
    gap = box.solid().shells()[0].distance_to(lid.solid().shells()[0])
    print(f"closed, with {gap:.3f} mm between case and lid; opens by {OPEN:g}°")
