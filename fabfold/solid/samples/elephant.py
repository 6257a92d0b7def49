"""An elephant with a lifted trunk."""

from __future__ import annotations

from typing import Any

from fabfold.solid.samples.shapes import both_sides, ellipsoid, fuse, limb

__all__ = ["draw"]


def draw() -> Any:
    """Draw the elephant: 10 mm a voxel, looking along +x."""
    from build123d import Cylinder, Pos

    body = ellipsoid((-4, 0, 33), (29, 21, 20))
    head = ellipsoid((27, 0, 43), (16, 15, 16.5))
    trunk = limb(
        [(38, 0, 40), (48, 0, 28), (53, 0, 15), (61, 0, 8), (69, 0, 13)],
        [10, 8.0, 6.8, 6.0, 5.4],
    )
    tail = limb([(-31, 0, 38), (-37, 0, 28), (-37.5, 0, 18)], [3.0, 2.4, 3.6])
    parts = [body, head, trunk, tail]
    for x in (-19, 13):
        leg = Pos(x, 11.5, 14) * Cylinder(9.2, 28)
        parts += both_sides(leg)
        parts += both_sides(ellipsoid((x + 1.5, 11.5, 3.2), (10.8, 10.2, 5.0)))
    parts += both_sides(ellipsoid((20, 20, 44), (5.4, 14, 17), (0, 0, 24)))
    parts += both_sides(limb([(37, 8, 34), (45, 10, 27), (54, 10, 27)], [3.6, 3.0, 1.6]))
    parts += both_sides(ellipsoid((38.5, 9.5, 48), (2.6, 2.4, 2.8)))
    whole = fuse(parts)
    # Feet stand flat.
    return fuse([whole - Pos(0, 0, -20) * _floor()])


def _floor() -> Any:
    from build123d import Box

    return Box(400, 400, 40)
