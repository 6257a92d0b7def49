"""The solid about many points, as few triangles: a level set of their distance.

References
----------
Garland, Heckbert: Surface simplification using quadric error metrics (1997), for thinning.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.solid.convert import from_mesh_set, to_manifold, to_mesh, to_mesh_set
from fabfold.solid.crossing import crossing_triangles

if TYPE_CHECKING:
    import manifold3d

__all__ = ["round_solid"]

Floats = NDArray[np.float64]

#: Spacing of the grid for the new surface, in wanted half thicknesses, as long as it has at most so
#: many points.
_GRID = 0.3
_MOST_POINTS = 450_000
#: How the surface is thinned: it is simplified within so many radii, and then thinned to this share
#: of its triangles, whose corners lie where they fit the others best.
_WAYS = ((0.01, 0.14), (0.04, 0.14), (0.0, 0.14), (0.04, 0.11))
#: Distances from the wanted surface, in radii, at which it may lie as well.
_LEVELS = (0.0, -0.02, 0.02)


def round_solid(centres: Floats, radius: float) -> manifold3d.Manifold:
    """All that is within a radius of one of many centres.

    Parameters
    ----------
    centres : (n, 3) float64 array
        Model units; near each other, so that what is about them is one piece with few holes.
    radius : float
        In the same unit.

    Returns
    -------
    manifold3d.Manifold
        Its surface is off by some hundredths of the radius.
    """
    import manifold3d
    from scipy.spatial import cKDTree

    low, high = centres.min(axis=0) - 1.5 * radius, centres.max(axis=0) + 1.5 * radius
    step = max(_GRID * radius, float(np.cbrt(np.prod(high - low) / _MOST_POINTS)))
    shape = np.ceil((high - low) / step).astype(int) + 2
    axes = [low[axis] + step * np.arange(shape[axis]) for axis in range(3)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    reach = radius + 2 * step
    gap, _ = cKDTree(centres).query(grid, distance_upper_bound=reach)
    field = (radius - np.minimum(gap, reach)).reshape(shape)
    table = field.tolist()
    x0, y0, z0 = low.tolist()
    inverse = 1.0 / step

    def depth(x: float, y: float, z: float) -> float:
        x, y, z = (x - x0) * inverse, (y - y0) * inverse, (z - z0) * inverse
        i, j, k = int(x), int(y), int(z)
        x, y, z = x - i, y - j, z - k
        one, other = table[i], table[i + 1]
        a, b, c, d = one[j], one[j + 1], other[j], other[j + 1]
        one_low = a[k] + z * (a[k + 1] - a[k])
        one_high = b[k] + z * (b[k + 1] - b[k])
        other_low = c[k] + z * (c[k + 1] - c[k])
        other_high = d[k] + z * (d[k + 1] - d[k])
        near = one_low + y * (one_high - one_low)
        return float(near + x * (other_low + y * (other_high - other_low) - near))

    inner = [*(low + 0.2 * step), *(high - 0.2 * step)]
    skins = (
        manifold3d.Manifold.level_set(depth, inner, 1.2 * step, level * radius) for level in _LEVELS
    )
    return _best_thinned(skin.scale((1 / radius,) * 3) for skin in skins).scale((radius,) * 3)


def _best_thinned(skins: Iterable[manifold3d.Manifold]) -> manifold3d.Manifold:
    """The first of many thinner surfaces of which no triangles cross, or fewest do.

    In slits that are narrower than the grid both sides of a level set move to the same points of
    the grid, and past each other. Most ways to thin it leave nothing of that, or another level
    does.
    """
    best, fewest = None, math.inf
    for skin in skins:
        for tolerance, share in _WAYS:
            thin = _thinned(skin, tolerance, share)
            crossing = math.inf if thin.is_empty() else len(crossing_triangles(*to_mesh(thin)))
            if crossing == 0:
                return thin
            if best is None or crossing < fewest:
                best, fewest = (skin if thin.is_empty() else thin), crossing
    assert best is not None
    return best


def _thinned(skin: manifold3d.Manifold, tolerance: float, share: float) -> manifold3d.Manifold:
    """A surface simplified and thinned to a share of its triangles; empty where it opens."""
    meshes = to_mesh_set(*to_mesh(skin.simplify(tolerance) if tolerance else skin))
    meshes.meshing_decimation_quadric_edge_collapse(
        targetfacenum=round(share * skin.num_tri()),
        qualitythr=0.3,
        preservenormal=True,
        preservetopology=True,
    )
    return to_manifold(*from_mesh_set(meshes))
