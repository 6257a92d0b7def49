"""Whether two segments of a plane come near each other while one of them turns a quarter."""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

import numpy as np
from numba import njit

__all__ = ["INSET", "LEAST", "point_distance", "segments_meet"]

#: How far a barrel's inner axis stands back from each end of its lattice edge, and how near two
#: inner axes may come, in voxel sides: for a barrel radius of 1/8 of the voxel and a clearance of
#: 1/67 (2.5 and 0.3 mm at 20 mm).
INSET = LEAST = 0.265


@njit(cache=True)
def point_distance(px: float, py: float, ax: float, ay: float, bx: float, by: float) -> float:
    """Distance of a point from a segment."""
    dx = bx - ax
    dy = by - ay
    length = dx * dx + dy * dy
    share = 0.0
    if length > 0.0:
        share = min(1.0, max(0.0, ((px - ax) * dx + (py - ay) * dy) / length))
    return np.hypot(px - ax - share * dx, py - ay - share * dy)


@njit(cache=True)
def segments_meet(
    x: int, y: int, half: float, c: int, d: int, other_half: float, least: float
) -> bool:
    """Whether a segment comes nearer than `least` to another while it turns by +90° about 0.

    Parameters
    ----------
    x, y : int
        Twice the middle of the turning segment: it runs along x where x is odd, along y where y
        is odd, and is a point where both are even.
    half : float
        Half its length.
    c, d, other_half
        The same of the segment that stays.
    least : float
    """
    mx = half if x % 2 != 0 else 0.0
    my = half if y % 2 != 0 else 0.0
    sx = other_half if c % 2 != 0 else 0.0
    sy = other_half if d % 2 != 0 else 0.0
    lever = 0.5 * np.hypot(x, y) + half
    px = 0.5 * c - sx
    py = 0.5 * d - sy
    qx = 0.5 * c + sx
    qy = 0.5 * d + sy
    angle = 0.0
    while True:
        cosine = np.cos(angle)
        sine = np.sin(angle)
        ax = (0.5 * x - mx) * cosine - (0.5 * y - my) * sine
        ay = (0.5 * x - mx) * sine + (0.5 * y - my) * cosine
        bx = (0.5 * x + mx) * cosine - (0.5 * y + my) * sine
        by = (0.5 * x + mx) * sine + (0.5 * y + my) * cosine
        away = min(
            point_distance(ax, ay, px, py, qx, qy),
            point_distance(bx, by, px, py, qx, qy),
            point_distance(px, py, ax, ay, bx, by),
            point_distance(qx, qy, ax, ay, bx, by),
        )
        if away < least:  # segments that cross have been near before
            return True
        if angle >= 0.5 * np.pi:
            return False
        angle = min(0.5 * np.pi, angle + max(1e-3, (away - 0.9 * least) / lever))
