"""How near two segments of a plane come while one of them turns a quarter.

Axes of hinge barrels and link plates are such segments: :mod:`fabfold.lattice.sweep` and
:mod:`fabfold.lattice.plate_sweep` look for what meets in a turn about a lattice edge.
"""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

import numpy as np
from numba import njit

__all__ = ["INSET", "LEAST", "segment_distance", "segments_meet"]

#: How far a barrel's inner axis stands back from each end of its lattice edge, and how near two
#: inner axes may come, in voxel sides: for a barrel radius of 1/8 of the voxel and a clearance of
#: 1/67 (2.5 and 0.3 mm at 20 mm).
INSET = LEAST = 0.265


@njit(cache=True)
def _point_distance(px: float, py: float, ax: float, ay: float, bx: float, by: float) -> float:
    """Distance of the point p from the segment from a to b."""
    dx = bx - ax
    dy = by - ay
    length = dx * dx + dy * dy
    share = 0.0
    if length > 0.0:
        share = min(1.0, max(0.0, ((px - ax) * dx + (py - ay) * dy) / length))
    return np.hypot(px - ax - share * dx, py - ay - share * dy)


@njit(cache=True)
def segment_distance(
    ax: float, ay: float, bx: float, by: float, px: float, py: float, qx: float, qy: float
) -> float:
    """Distance of two segments that do not cross.

    Parameters
    ----------
    ax, ay, bx, by : float
        Ends a and b of one segment.
    px, py, qx, qy : float
        Ends p and q of the other.

    Returns
    -------
    float
        In the unit of the ends.
    """
    return min(
        _point_distance(ax, ay, px, py, qx, qy),
        _point_distance(bx, by, px, py, qx, qy),
        _point_distance(px, py, ax, ay, bx, by),
        _point_distance(qx, qy, ax, ay, bx, by),
    )


@njit(cache=True)
def segments_meet(
    x: int, y: int, half: float, c: int, d: int, other_half: float, least: float
) -> bool:
    """Whether a segment comes nearer than `least` to another while it turns by +90° about 0.

    Parameters
    ----------
    x, y : int
        Twice the middle of the turning segment, voxel sides: it runs along x where x is odd, along
        y where y is odd, and is a point where both are even.
    half : float
        Half its length, voxel sides.
    c, d : int
        Twice the middle of the segment that stays, read in the same way.
    other_half : float
        Half its length, voxel sides.
    least : float
        Distance that counts as near, voxel sides.

    Returns
    -------
    bool
        True where they come nearer at some angle.
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
        away = segment_distance(ax, ay, bx, by, px, py, qx, qy)
        if away < least:  # segments that cross have been near before
            return True
        if angle >= 0.5 * np.pi:
            return False
        angle = min(0.5 * np.pi, angle + max(1e-3, (away - 0.9 * least) / lever))
