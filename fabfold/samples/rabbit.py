"""A sitting rabbit."""

from __future__ import annotations

from typing import Any

from fabfold.samples.round_shapes import both_sides, ellipsoid, fuse, limb

__all__ = ["draw"]


def draw() -> Any:
    """Draw the rabbit: about 13 mm a voxel, looking along +x."""
    body = ellipsoid((-3, 0, 21), (22.5, 18, 18), (0, -20, 0))
    chest = ellipsoid((10, 0, 24), (12.5, 12.5, 18), (0, 15, 0))
    head = ellipsoid((17, 0, 45), (15.5, 13, 13), (0, 12, 0))
    nose = ellipsoid((31.8, 0, 43.6), (2.2, 3.0, 2.2))
    tail = ellipsoid((-25, 0, 15), (7.5, 7.5, 7.5))
    parts = [body, chest, head, nose, tail]
    pairs = [
        ellipsoid((-8, 13.5, 13), (13.5, 8.5, 13.5)),  # haunch
        ellipsoid((5, 15, 5.4), (14.5, 5.8, 5.8)),  # hind foot
        limb([(14, 7, 24), (20, 7.5, 6)], [6.5, 5.2]),  # front leg
        ellipsoid((23.5, 7.5, 4.9), (7.8, 5.2, 5.2)),  # front paw
        ellipsoid((25.5, 4.2, 40.2), (6.2, 6.2, 6.2)),  # cheek
        ellipsoid((25.6, 8.0, 48.5), (3.0, 3.0, 3.0)),  # eye
    ]
    for shape in pairs:
        parts += both_sides(shape)
    ear = limb([(10, 6, 52), (6, 8.5, 63), (2, 11, 75)], [5.4, 6.8, 4.2])
    hollow = limb([(16.6, 7.6, 60), (13.8, 9.4, 67), (8.6, 11.4, 75)], [2.4, 3.6, 1.8])
    parts += both_sides(ear - hollow)
    return fuse(parts)
