"""An elephant with a curled trunk."""

from __future__ import annotations

from typing import Any

from fabfold.samples.round_shapes import both_sides, ellipsoid, fuse, limb

__all__ = ["draw"]


def draw() -> Any:
    """Draw the elephant: about 13 mm a voxel, looking along +x."""
    from build123d import Box, Pos

    body = ellipsoid((-2, 0, 38), (29, 23, 23), (0, -6, 0))
    head = ellipsoid((28, 0, 51), (17, 17, 18), (0, 10, 0))
    trunk = limb(
        [(36, 0, 48), (45, 0, 36), (47, 0, 22), (52, 0, 11), (60, 0, 13)],
        [11, 9.0, 7.6, 6.6, 5.8],
    )
    tail = limb([(-28, 0, 44), (-34, 0, 33), (-34.5, 0, 24)], [3.2, 2.6, 3.6])
    parts = [body, head, trunk, tail]
    for x in (-17.5, 14.0):
        parts += both_sides(limb([(x, 11.5, 4), (x, 11.0, 32)], [9.6, 9.6]))
        parts += both_sides(ellipsoid((x + 1.8, 11.5, 2.6), (11.2, 11.2, 5.4)))
    parts += both_sides(ellipsoid((16, 21, 50), (17, 5, 17), (0, 0, -32)))
    parts += both_sides(limb([(36, 9.5, 40), (45, 12.5, 33.5), (54, 12.5, 36)], [4.0, 3.4, 2.0]))
    parts += both_sides(ellipsoid((40.5, 10.2, 56), (2.8, 2.8, 2.8)))
    # The feet stand flat.
    return fuse([fuse(parts) - Pos(0, 0, -20) * Box(400, 400, 40)])
