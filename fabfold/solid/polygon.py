"""Cut polygons into triangles: faces of more than three corners, and the caps of holes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

__all__ = ["triangulate_loop", "triangulate_polygons"]


def triangulate_polygons(
    vertices: NDArray[np.float64], polygons: Sequence[Sequence[int]]
) -> NDArray[np.int64]:
    """Cut polygons given by vertex indices into triangles.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        Corner coordinates, in any unit.
    polygons : sequence of sequences of int
        Three or more vertex indices each, counter-clockwise seen from outside.

    Returns
    -------
    (f, 3) int64 array
        Triangles in the order of the polygons, wound as they are.
    """
    triangles: list[tuple[int, ...]] = []
    for polygon in polygons:
        if len(polygon) == 3:
            triangles.append(tuple(polygon))
            continue
        local = triangulate_loop(vertices[np.asarray(polygon)])
        triangles.extend(tuple(polygon[int(k)] for k in row) for row in local)
    return np.array(triangles, dtype=np.int64).reshape(-1, 3)


def triangulate_loop(points: NDArray[np.float64]) -> NDArray[np.int64]:
    """Cut one closed loop in space into triangles, without new points.

    Parameters
    ----------
    points : (n, 3) float64 array
        Corners of the loop in order, in any unit; it need not be flat or convex.

    Returns
    -------
    (n - 2, 3) int64 array
        Indices into `points`, wound as the loop.

    Notes
    -----
    The loop is projected on the plane of its vector area and handed to Manifold's ear clipping,
    which always returns a triangulation that fits the loop's edges.
    """
    import manifold3d

    count = len(points)
    centred = points - points.mean(axis=0)
    area = np.cross(centred, np.roll(centred, -1, axis=0)).sum(axis=0)
    length = float(np.linalg.norm(area))
    fan = np.array([[0, k, k + 1] for k in range(1, count - 1)], dtype=np.int64)
    if length <= 1e-12 * float((centred**2).sum()):
        return fan
    normal = area / length
    axis = np.zeros(3)
    axis[int(np.abs(normal).argmin())] = 1.0
    first = np.cross(axis, normal)
    first /= np.linalg.norm(first)
    flat = np.column_stack([centred @ first, centred @ np.cross(normal, first)])
    flat /= np.abs(flat).max()
    found = np.asarray(manifold3d.triangulate([np.ascontiguousarray(flat)]), dtype=np.int64)
    return found if len(found) == count - 2 else fan
