"""A sitting rabbit."""

from __future__ import annotations

from typing import Any

from fabfold.solid.samples.shapes import both_sides, ellipsoid, fuse, limb

__all__ = ["draw"]


def draw() -> Any:
    """Draw the rabbit: 10 mm a voxel, looking along +x."""
    body = ellipsoid((-3, 0, 20), (22, 17, 19), (0, -20, 0))
    chest = ellipsoid((9, 0, 24), (12, 13, 17), (0, 15, 0))
    head = ellipsoid((17, 0, 44), (14.5, 12.5, 12.5), (0, 12, 0))
    muzzle = ellipsoid((27, 0, 40.5), (7, 7.5, 6))
    nose = ellipsoid((33, 0, 43), (2.4, 3.0, 2.0))
    tail = ellipsoid((-25, 0, 14), (7.5, 7.5, 7.5))
    parts = [body, chest, head, muzzle, nose, tail]
    pairs = [
        ellipsoid((-8, 13, 13), (14, 8.5, 13)),  # haunch
        ellipsoid((4, 15, 4.8), (14, 6, 5.2)),  # hind foot
        limb([(15, 7, 22), (18.5, 7.5, 12), (20, 7.5, 5)], [6.5, 5.5, 5]),  # front leg
        ellipsoid((23, 7.5, 4), (7.5, 5.5, 4.4)),  # front paw
        ellipsoid((23, 5.5, 39.5), (6.5, 6.5, 6)),  # cheek
        ellipsoid((25.2, 8.6, 47), (2.8, 2.2, 3.2)),  # eye
    ]
    for shape in pairs:
        parts += both_sides(shape)
    ear = limb([(11, 6, 50), (7, 8.5, 62), (3, 11, 75)], [5.2, 6.6, 3.6])
    hollow = limb([(17.5, 7.5, 58), (14.8, 9.4, 66), (9, 11.4, 75)], [2.4, 3.6, 1.6])
    parts += both_sides(ear - hollow)
    return fuse(parts)
