"""Whether something stands by itself: its centre of mass over what touches the plate."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["stands_over"]

Floats = NDArray[np.float64]

#: Share of the outline's size by which rounding moves a point.
_ROUNDING = 1e-12


def stands_over(centre: Floats, under: Floats) -> bool:
    """Whether a centre of mass is over the convex hull of what touches the plate.

    Parameters
    ----------
    centre : (3,) float64 array
        Centre of mass, z up.
    under : (n, 2) float64 array
        Points that touch the plate.

    Returns
    -------
    bool
        False too where they span no area.
    """
    from scipy.spatial import ConvexHull, QhullError

    try:
        # Its outline alone: triangles between the points of a ring take seconds.
        sides = ConvexHull(under).equations
    except (QhullError, ValueError):
        return False
    # Over a side is over it, whatever the last digits say.
    slack = _ROUNDING * float(np.ptp(under, axis=0).max())
    return bool((sides[:, :2] @ centre[:2] + sides[:, 2]).max() <= slack)
