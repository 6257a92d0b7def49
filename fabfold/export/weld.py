"""Meshes that stay closed when a file format rounds them and a reader welds them.

STL and 3MF hold single-precision or decimal coordinates, and most readers join corners that
round to the same point. Short edges then collapse, and two sheets that pass close to each other
can meet in an edge of four triangles. :func:`printable_mesh` finds the mildest simplification
whose rounded and welded mesh is still a closed two-manifold.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import GeometryError
from fabfold.joinery.bodies import BodyMesh
from fabfold.meshes import compact, is_closed, mesh_volume, weld
from fabfold.solid.convert import to_manifold, to_mesh

__all__ = ["printable_mesh", "weld_rounded", "without_needles"]

#: Edges shorter than these are collapsed, in mm, until the rounded mesh is closed.
_TOLERANCES_MM = (0.0, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2)


def weld_rounded(
    vertices: NDArray[np.float64], faces: NDArray[np.integer[Any]], decimals: int | None = None
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Round corners, join those that fall together, and drop the triangles that collapse.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        In mm.
    faces : (f, 3) integer array
        Three vertex indices for each triangle.
    decimals : int, optional
        Round to so many decimals before single precision, for a format that holds decimals.

    Returns
    -------
    vertices : (w, 3) float32 array
        Distinct points in mm, in order of first use.
    faces : (g, 3) int32 array
        Triangles with three different corners, in the order of `faces`.
    """
    exact = np.asarray(vertices, dtype=np.float64)
    rounded = (exact if decimals is None else np.round(exact, decimals)).astype(np.float32)
    points, triangles = compact(*weld(rounded, faces, order="use"))
    return points, triangles.astype(np.int32)


def without_needles(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], shortest: float
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Join the ends of very short edges, and drop the triangles that collapse.

    Booleans in single precision leave edges of one last digit, which no CAD kernel takes.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        Of a closed mesh, in mm.
    faces : (f, 3) int32 array
        Three vertex indices for each triangle.
    shortest : float
        Shortest edge that stays, in mm.

    Returns
    -------
    vertices : (w, 3) float64 array
        In mm, in order of first use.
    faces : (g, 3) int32 array
        Triangles with three different corners; the mesh as it was given where joining would leave
        it open.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    short = ends[np.linalg.norm(vertices[ends[:, 0]] - vertices[ends[:, 1]], axis=1) < shortest]
    if len(short) == 0:
        return vertices, faces
    links = coo_array((np.ones(len(short), np.int8), short.T), shape=(len(vertices),) * 2)
    _, group = connected_components(links, directed=False)
    _, first = np.unique(group, return_index=True)
    joined, triangles = compact(*weld(vertices[first[group]], faces, order="use"))
    if not is_closed(triangles):
        return vertices, faces
    return joined, triangles.astype(np.int32)


def printable_mesh(
    body: BodyMesh, decimals: int | None = None
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """A body's mesh as files hold it: rounded, welded, closed and oriented outwards.

    Parameters
    ----------
    body : BodyMesh
        The body to write, in mm.
    decimals : int, optional
        As for :func:`weld_rounded`.

    Returns
    -------
    vertices : (v, 3) float32 array
        In mm, shape A.
    faces : (f, 3) int32 array
        Three vertex indices for each triangle, counter-clockwise seen from outside.

    Raises
    ------
    GeometryError
        If no simplification up to 0.02 mm closes the rounded mesh.
    """
    wanted = mesh_volume(body.vertices, body.faces)
    for tolerance in _TOLERANCES_MM:
        if tolerance:
            solid = to_manifold(body.vertices, body.faces).simplify(tolerance)
            points, triangles = weld_rounded(*to_mesh(solid), decimals)
        else:
            points, triangles = weld_rounded(body.vertices, body.faces, decimals)
        if is_closed(triangles):
            volume = mesh_volume(points.astype(np.float64), triangles)
            if abs(volume - wanted) <= 1e-3 * abs(wanted) and volume > 0:
                return points, triangles
    raise GeometryError(
        f"{body.name}: the mesh ({len(body.faces)} triangles, {wanted:.1f} mm³) does not stay "
        f"closed when its corners are rounded to single precision, even after edges up to "
        f"{_TOLERANCES_MM[-1]:g} mm are collapsed; make the kit with larger voxels or another seed"
    )
