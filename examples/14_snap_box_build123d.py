"""A box that snaps shut: a tongue on its front wall goes into the lid on the arc of the hinge.

Box and lid print in one piece, open, side by side. Run it with a folder to write to:
``python 14_snap_box_build123d.py out``.
"""

import sys
from pathlib import Path

from build123d import Align, Box, Part, Plane, Pos

from hinges import SingleHinge, SnapDimple, SnapSpec, SnapTongue, hinge_location, write_3mf

WIDE, DEEP, HIGH, WALL, GAP = 60.0, 40.0, 20.0, 5.0, 0.3
STANDING = (Align.CENTER, Align.CENTER, Align.MIN)
FRONT = DEEP + 0.5 * GAP - 0.5 * WALL  # from the axis to the middle of the front wall
SNAP = SnapSpec(length=6, thickness=1.0, width=8, arc=FRONT, inwards=True, material="petg", gap=GAP)


def tray() -> Part:
    """A box open above, standing on z = 0."""
    hollow = Box(WIDE - 2 * WALL, DEEP - 2 * WALL, HIGH, align=STANDING)
    return Box(WIDE, DEEP, HIGH, align=STANDING) - Pos(0, 0, 2.0) * hollow


def main() -> tuple[Part, Part]:
    # The snap's frame lies in the rim of the front wall: z along the tongue, and x from the tongue
    # to its ridge, which looks to the axis. In the lid the same frame lies turned over.
    on_box = Plane((0, -FRONT, HIGH), x_dir=(0, 1, 0), z_dir=(0, 0, 1))
    in_lid = Plane((0, FRONT, HIGH + GAP), x_dir=(0, -1, 0), z_dir=(0, 0, -1))
    box = Pos(0, -0.5 * (DEEP + GAP), 0) * tray() + on_box * SnapTongue(SNAP)
    lid = Pos(0, 0.5 * (DEEP + GAP), 0) * tray() - in_lid * SnapDimple(SNAP)

    hinge = SingleHinge(WIDE, knuckles=5, clearance=GAP)
    place = hinge_location((0, 0, HIGH + 0.5 * GAP), along=(1, 0, 0), outwards=(0, 0, 1))
    box, lid = hinge.fit(box, lid, place)

    box.label, lid.label = "box", "lid"
    return box, lid


if __name__ == "__main__":
    box, lid = main()
    if len(sys.argv) > 1:
        folder = Path(sys.argv[1])
        folder.mkdir(parents=True, exist_ok=True)
        write_3mf([box, lid], folder / "snap_box.3mf")
    print(f"the tongue is bent by {SNAP.deflection:.2f} mm, {100 * SNAP.strain:.1f} % of strain")
