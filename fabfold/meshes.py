"""What is reckoned on every triangle mesh: joined vertices, areas and normals, the volume."""

from __future__ import annotations

from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "box_triangles",
    "centre_of_mass",
    "compact",
    "drop_collapsed",
    "face_areas",
    "face_normals",
    "is_closed",
    "mesh_volume",
    "triple_products",
    "vector_areas",
    "weld",
]

_Float = TypeVar("_Float", bound=np.floating[Any])
_Int = TypeVar("_Int", bound=np.integer[Any])


def weld(
    vertices: NDArray[_Float],
    faces: NDArray[np.integer[Any]],
    order: Literal["zyx", "xyz", "use"] = "zyx",
) -> tuple[NDArray[_Float], NDArray[np.int64]]:
    """Join vertices with exactly equal coordinates and drop triangles that then repeat a vertex.

    There is no tolerance, so a model a nanometre long does not collapse. Who wants one rounds the
    coordinates first.

    Parameters
    ----------
    vertices : (v, 3) float array
        Corner coordinates, in any unit.
    faces : (f, 3) integer array
        Three vertex indices for each triangle.
    order : {"zyx", "xyz", "use"}
        How the joined vertices are numbered: sorted by z, then y, then x; sorted by x, then y, then
        z; or as `faces` first uses them, without those that it does not use.

    Returns
    -------
    vertices : (w, 3) float array
        The distinct points, of the type of the vertices given; -0.0 has become 0.0.
    faces : (g, 3) int64 array
        Triangles with three different vertices, in the order of the faces given.
    """
    points = np.asarray(vertices + vertices.dtype.type(0.0))  # -0.0 becomes 0.0
    # lexsort goes by its last key first.
    ranking = np.lexsort(points.T[::-1] if order == "xyz" else points.T)
    ranked = points[ranking]
    fresh = np.ones(len(points), dtype=bool)
    fresh[1:] = (ranked[1:] != ranked[:-1]).any(axis=1)
    number = np.empty(len(points), dtype=np.int64)
    number[ranking] = np.cumsum(fresh) - 1
    joined, corners = ranked[fresh], number[faces]
    if order == "use":
        used, first, index = np.unique(corners, return_index=True, return_inverse=True)
        by_use = np.argsort(first, kind="stable")
        rank = np.empty(len(used), dtype=np.int64)
        rank[by_use] = np.arange(len(used))
        joined, corners = joined[used[by_use]], rank[index].reshape(-1, 3)
    return joined, drop_collapsed(corners)


def drop_collapsed(faces: NDArray[_Int]) -> NDArray[_Int]:
    """Drop the triangles that name a vertex twice.

    Parameters
    ----------
    faces : (f, 3) integer array
        Three vertex indices for each triangle.

    Returns
    -------
    (g, 3) integer array
        The triangles with three different vertices, in the same order.
    """
    a, b, c = faces.T
    return np.asarray(faces[(a != b) & (b != c) & (c != a)])


def compact(
    vertices: NDArray[_Float], faces: NDArray[np.integer[Any]]
) -> tuple[NDArray[_Float], NDArray[np.int64]]:
    """Drop the vertices that no triangle uses.

    Parameters
    ----------
    vertices : (v, 3) float array
        Corner coordinates, in any unit.
    faces : (f, 3) integer array
        Three vertex indices for each triangle.

    Returns
    -------
    vertices : (w, 3) float array
        The vertices in use, in the same order.
    faces : (f, 3) int64 array
        The same triangles over these vertices.
    """
    used, index = np.unique(faces, return_inverse=True)
    return np.asarray(vertices[used]), index.reshape(-1, 3).astype(np.int64)


def is_closed(faces: NDArray[np.integer[Any]]) -> bool:
    """Whether each edge has exactly two triangles, which run along it in opposite directions.

    Parameters
    ----------
    faces : (f, 3) integer array
        Vertex indices of a welded mesh.

    Returns
    -------
    bool
        False for a mesh without triangles.
    """
    if len(faces) == 0:
        return False
    start = faces.reshape(-1).astype(np.int64)
    end = np.roll(faces, -1, axis=1).reshape(-1).astype(np.int64)
    count = int(faces.max()) + 1
    forward = np.sort(start * count + end)
    backward = np.sort(end * count + start)
    return bool((forward[1:] != forward[:-1]).all() and (forward == backward).all())


def vector_areas(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Vector area of each triangle: along its normal, as long as its area.

    Parameters
    ----------
    corners : (f, 3, 3) float64 array
        Coordinates of the three corners of each triangle, counter-clockwise seen from outside.

    Returns
    -------
    (f, 3) float64 array
        In the square of the unit of `corners`.
    """
    return np.asarray(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2)


def face_areas(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Area of each triangle.

    Parameters
    ----------
    corners : (f, 3, 3) float64 array
        Coordinates of the three corners of each triangle.

    Returns
    -------
    (f,) float64 array
        In the square of the unit of `corners`.
    """
    return np.asarray(np.linalg.norm(vector_areas(corners), axis=1))


def face_normals(
    corners: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Unit normal and area of each triangle.

    Parameters
    ----------
    corners : (f, 3, 3) float64 array
        Coordinates of the three corners of each triangle, counter-clockwise seen from outside.

    Returns
    -------
    normals : (f, 3) float64 array
        Outward, of length 1; zero where a triangle has no area.
    areas : (f,) float64 array
        In the square of the unit of `corners`.
    """
    vectors = vector_areas(corners)
    areas = np.linalg.norm(vectors, axis=1)
    length = areas[:, None]
    normals = np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)
    return np.asarray(normals), np.asarray(areas)


def triple_products(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Scalar triple product of the corners of each triangle.

    Parameters
    ----------
    corners : (f, 3, 3) float64 array
        Coordinates of the three corners of each triangle, counter-clockwise seen from outside.

    Returns
    -------
    (f,) float64 array
        Six times the volume of the tetrahedron of a triangle and the origin, in the cube of the
        unit of `corners`; negative where the triangle faces the origin.
    """
    return np.asarray(np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])))


def mesh_volume(vertices: NDArray[np.float64], faces: NDArray[np.integer[Any]]) -> float:
    """Volume enclosed by a closed mesh, by the divergence theorem.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        Corner coordinates, in any unit.
    faces : (f, 3) integer array
        Three vertex indices for each triangle, counter-clockwise seen from outside.

    Returns
    -------
    float
        In the cube of the unit of `vertices`; negative if the mesh is inside out.
    """
    return float(triple_products(vertices[faces] - vertices.mean(axis=0)).sum() / 6)


def centre_of_mass(corners: NDArray[np.float64]) -> NDArray[np.float64]:
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


def box_triangles(
    low: NDArray[np.float64], high: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """A box as a closed mesh.

    Parameters
    ----------
    low, high : (3,) float64 array
        Two opposite corners.

    Returns
    -------
    vertices : (8, 3) float64 array
        Its corners.
    faces : (12, 3) int32 array
        Counter-clockwise seen from outside.
    """
    bits = (np.arange(8)[:, None] >> np.array([2, 1, 0])) & 1
    quads = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    faces = [(q[0], q[i], q[i + 1]) for q in quads for i in (1, 2)]
    return np.where(bits, high, low).astype(float), np.array(faces, dtype=np.int32)
