"""An elephant with a curled trunk."""

from __future__ import annotations

from typing import Any

from fabfold.solid.samples.shapes import both_sides, ellipsoid, fuse, limb

__all__ = ["draw"]


def draw() -> Any:
    """Draw the elephant: 10 mm a voxel, looking along +x."""
    from build123d import Box, Cone, Pos

    body = ellipsoid((-2, 0, 38), (29, 23, 23), (0, -6, 0))
    head = ellipsoid((28, 0, 51), (17, 17, 18), (0, 10, 0))
    trunk = limb(
        [(37, 0, 48), (47, 0, 35), (49.5, 0, 20), (56, 0, 10), (64, 0, 13)],
        [11, 8.6, 7.2, 6.4, 5.6],
    )
    tail = limb([(-28, 0, 44), (-34, 0, 33), (-34.5, 0, 24)], [3.2, 2.6, 3.6])
    parts = [body, head, trunk, tail]
    for x in (-17.5, 14.0):
        parts += both_sides(Pos(x, 11.5, 16) * Cone(10.2, 8.8, 32))
        parts += both_sides(ellipsoid((x + 1.6, 11.5, 2.2), (11.0, 11.0, 5.0)))
    parts += both_sides(ellipsoid((16, 24, 49), (17, 5, 17), (0, 0, 28)))
    parts += both_sides(limb([(36, 9.5, 40), (45, 12.5, 33.5), (54, 12.5, 36)], [4.0, 3.4, 2.0]))
    parts += both_sides(ellipsoid((40.5, 10.2, 56), (2.8, 2.8, 2.8)))
    # The feet stand flat.
    return fuse([fuse(parts) - Pos(0, 0, -20) * Box(400, 400, 40)])
