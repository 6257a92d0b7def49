"""A bath duck."""

from __future__ import annotations

from typing import Any

from fabfold.samples.round_shapes import both_sides, ellipsoid, fuse, limb

__all__ = ["draw"]


def draw() -> Any:
    """Draw the duck: about 13 mm a voxel, looking along +x."""
    from build123d import Box, Pos

    body = ellipsoid((-1, 0, 15), (27, 20, 20))
    breast = ellipsoid((11, 0, 19), (17, 17, 17))
    tail = limb([(-14, 0, 18), (-24, 0, 24), (-31, 0, 34)], [13, 9, 4.0])
    neck = limb([(12, 0, 26), (14, 0, 40)], [12.5, 10.5])
    head = ellipsoid((15, 0, 46), (14.5, 14.5, 14.5))
    upper = ellipsoid((31, 0, 44.5), (9.5, 9.5, 3.6), (0, -10, 0))
    lower = ellipsoid((28.5, 0, 40), (7.5, 7.5, 3.0), (0, 12, 0))
    parts = [body, breast, tail, neck, head, upper, lower]
    parts += both_sides(ellipsoid((-6, 17.5, 22), (16, 7.0, 7.0), (0, 22, 8)))
    parts += both_sides(ellipsoid((25.0, 8.6, 51), (3.2, 3.2, 3.2)))
    return fuse([fuse(parts) - Pos(0, 0, -20) * Box(400, 400, 40)])
