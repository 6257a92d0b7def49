"""Meshes that stay closed when a file format rounds them and a reader welds them.

STL and 3MF hold single-precision or decimal coordinates, and most readers join corners that
round to the same point. Short edges then collapse, and two sheets that pass close to each other
can meet in an edge of four triangles. :func:`printable_mesh` finds the mildest simplification
whose rounded and welded mesh is still a closed two-manifold.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import GeometryError
from fabfold.joinery.bodies import BodyMesh
from fabfold.meshes import mesh_volume

__all__ = ["is_closed", "printable_mesh", "weld"]

#: Edges shorter than these are collapsed, in mm, until the rounded mesh is closed.
_TOLERANCES_MM = (0.0, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2)


def weld(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], decimals: int | None = None
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Round corners, join those that fall together, and drop the triangles that collapse.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        In mm.
    faces : (f, 3) int32 array
    decimals : int, optional
        Round to so many decimals before single precision, for a format that holds decimals.

    Returns
    -------
    vertices : (w, 3) float32 array
        Distinct points, in order of first use.
    faces : (g, 3) int32 array
        Triangles with three different corners, in the order of `faces`.
    """
    exact = np.asarray(vertices, dtype=np.float64)
    rounded = (exact if decimals is None else np.round(exact, decimals)).astype(np.float32)
    rounded += np.float32(0.0)  # -0.0 and 0.0 are one point
    corners = rounded[faces.reshape(-1)]
    _, first, inverse = np.unique(corners, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")
    rank = np.empty(len(order), dtype=np.int32)
    rank[order] = np.arange(len(order), dtype=np.int32)
    points = corners[first[order]]
    welded = rank[inverse.reshape(-1)].reshape(-1, 3)
    a, b, c = welded.T
    welded = welded[(a != b) & (b != c) & (c != a)]
    used, compact = np.unique(welded.reshape(-1), return_inverse=True)
    return points[used], compact.reshape(-1, 3).astype(np.int32)


def is_closed(faces: NDArray[np.int32]) -> bool:
    """Whether each edge has exactly two triangles, which run along it in opposite directions.

    Parameters
    ----------
    faces : (f, 3) int32 array
        Corner indices of a welded mesh.
    """
    if len(faces) == 0:
        return False
    start = faces.reshape(-1).astype(np.int64)
    end = np.roll(faces, -1, axis=1).reshape(-1).astype(np.int64)
    count = int(faces.max()) + 1
    forward = np.sort(start * count + end)
    backward = np.sort(end * count + start)
    return bool((forward[1:] != forward[:-1]).all() and (forward == backward).all())


def printable_mesh(
    body: BodyMesh, decimals: int | None = None
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """A body's mesh as files hold it: rounded, welded, closed and oriented outwards.

    Parameters
    ----------
    body : BodyMesh
    decimals : int, optional
        See :func:`weld`.

    Returns
    -------
    vertices : (v, 3) float32 array
        In mm, shape A.
    faces : (f, 3) int32 array

    Raises
    ------
    GeometryError
        If no simplification up to 0.02 mm closes the rounded mesh.
    """
    wanted = mesh_volume(body.vertices, body.faces)
    for tolerance in _TOLERANCES_MM:
        vertices, faces = _simplified(body, tolerance) if tolerance else (body.vertices, body.faces)
        points, triangles = weld(vertices, faces, decimals)
        if is_closed(triangles):
            volume = mesh_volume(points.astype(np.float64), triangles)
            if abs(volume - wanted) <= 1e-3 * abs(wanted) and volume > 0:
                return points, triangles
    raise GeometryError(
        f"{body.name}: the mesh ({len(body.faces)} triangles, {wanted:.1f} mm³) does not stay "
        f"closed when its corners are rounded to single precision, even after edges up to "
        f"{_TOLERANCES_MM[-1]:g} mm are collapsed; make the kit with larger voxels or another seed"
    )


def _simplified(body: BodyMesh, tolerance: float) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    import manifold3d

    solid = manifold3d.Manifold(
        manifold3d.Mesh64(
            np.ascontiguousarray(body.vertices, dtype=np.float64),
            np.ascontiguousarray(body.faces, dtype=np.uint64),
        )
    ).simplify(tolerance)
    mesh = solid.to_mesh64()
    return (
        np.asarray(mesh.vert_properties, dtype=np.float64)[:, :3],
        np.asarray(mesh.tri_verts, dtype=np.int32),
    )
