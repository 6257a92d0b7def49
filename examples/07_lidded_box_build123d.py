"""A lidded box that prints in one piece, in build123d.

Box and lid stand open, side by side on the bed. Run it with a folder to write to:
``python 07_lidded_box_build123d.py out``.
"""

import sys
from pathlib import Path

from build123d import Align, Box, Compound, Part, Pos, export_step

from hinges import Bracket, SingleHinge, hinge_location

WIDE, DEEP, HIGH, WALL, GAP = 60.0, 40.0, 18.0, 2.4, 0.3
STANDING = (Align.CENTER, Align.CENTER, Align.MIN)


def tray() -> Part:
    """A box open above, standing on z = 0."""
    outside = Box(WIDE, DEEP, HIGH, align=STANDING)
    return outside - Pos(0, 0, WALL) * Box(WIDE - 2 * WALL, DEEP - 2 * WALL, HIGH, align=STANDING)


def main() -> tuple[Part, Part]:
    box = Pos(0, -0.5 * (DEEP + GAP), 0) * tray()
    lid = Pos(0, 0.5 * (DEEP + GAP), 0) * tray()

    # The three lines: a hinge, where it lies, and both halves let in.
    hinge = SingleHinge(WIDE, knuckles=5, clearance=GAP, leaf=Bracket(gusset=True))
    place = hinge_location((0, 0, HIGH + 0.5 * GAP), along=(1, 0, 0), outwards=(0, 0, 1))
    box, lid = hinge.fit(box, lid, place)

    box.label, lid.label = "box", "lid"
    return box, lid


if __name__ == "__main__":
    box, lid = main()
    if len(sys.argv) > 1:
        folder = Path(sys.argv[1])
        folder.mkdir(parents=True, exist_ok=True)
        export_step(Compound(children=[box, lid]), folder / "lidded_box.step")
    box.joints["hinge"].connect_to(lid.joints["hinge"], angle=180)
    gap = box.solid().shells()[0].distance_to(lid.solid().shells()[0])
    print(f"closed, with {gap:.3f} mm between box and lid")
