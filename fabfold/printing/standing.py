"""Whether something stands by itself: its centre of mass over what touches the plate."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["centre_of_mass", "stands_over"]

Floats = NDArray[np.float64]


def centre_of_mass(corners: Floats) -> Floats:
    """Centre of mass of closed meshes of one density.

    Parameters
    ----------
    corners : (f, 3, 3) float64 array
        Corners of all triangles, counter-clockwise seen from outside, in any unit.

    Returns
    -------
    (3,) float64 array
        In that unit.
    """
    volumes = np.einsum("fi,fi->f", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    return np.asarray((volumes[:, None] * corners.sum(axis=1) / 4).sum(axis=0) / volumes.sum())


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
    from scipy.spatial import Delaunay, QhullError

    try:
        return bool(Delaunay(under).find_simplex(centre[:2]) >= 0)
    except (QhullError, ValueError):
        return False
