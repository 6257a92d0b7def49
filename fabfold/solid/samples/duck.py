"""A bath duck."""

from __future__ import annotations

from typing import Any

from fabfold.solid.samples.shapes import both_sides, ellipsoid, fuse, limb

__all__ = ["draw"]


def draw() -> Any:
    """Draw the duck: 10 mm a voxel, looking along +x."""
    body = ellipsoid((0, 0, 15), (27, 20, 16))
    breast = ellipsoid((12, 0, 18), (15, 16, 15))
    tail = limb([(-16, 0, 18), (-25, 0, 24), (-32, 0, 33)], [12, 8, 3.5])
    neck = ellipsoid((13, 0, 30), (11, 10.5, 10))
    head = ellipsoid((15, 0, 43), (14.5, 13.5, 13.5))
    upper = ellipsoid((31, 0, 41), (8.5, 7.5, 3.2), (0, -8, 0))
    lower = ellipsoid((29, 0, 37.5), (7, 5.5, 2.4), (0, 10, 0))
    parts = [body, breast, tail, neck, head, upper, lower]
    parts += both_sides(ellipsoid((-4, 18, 21), (15, 6.5, 8.5), (0, 18, 0)))
    parts += both_sides(ellipsoid((24.5, 8.4, 47), (2.8, 2.6, 3.2)))
    return fuse(parts)
