"""Normals that are smooth on rounded surfaces and sharp at edges."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fabfold.meshes import face_normals, vector_areas

__all__ = ["corner_normals", "split_vertices"]

#: Triangles that meet at less than this angle shade as one surface, degrees.
CREASE_DEG = 30.0


def corner_normals(
    vertices: NDArray[np.floating], faces: NDArray[np.int32], crease_deg: float = CREASE_DEG
) -> NDArray[np.float64]:
    """Unit normal at each corner of each triangle.

    A corner's normal is the mean, weighted by area, of the normals of those triangles about its
    vertex that lie within `crease_deg` of its own triangle.

    Parameters
    ----------
    vertices : (v, 3) float array
        Corner coordinates, in any unit.
    faces : (f, 3) int32 array
        Three vertex indices for each triangle, counter-clockwise seen from outside.
    crease_deg : float
        Triangles that meet at less than this angle shade as one surface, degrees.

    Returns
    -------
    (f, 3, 3) float64 array
        For each triangle the outward normals at its three corners.
    """
    corners = np.asarray(vertices, dtype=np.float64)[faces]
    weighted = vector_areas(corners)
    unit, _ = face_normals(corners)
    # All ordered pairs of corners that share a vertex, made vertex by vertex.
    flat = faces.reshape(-1)
    order = np.argsort(flat, kind="stable")
    valence = np.bincount(flat, minlength=len(vertices))
    begins = np.cumsum(valence) - valence
    partners = valence[flat[order]]
    first = np.repeat(order, partners)
    offset = np.arange(len(first)) - np.repeat(np.cumsum(partners) - partners, partners)
    second = order[np.repeat(begins[flat[order]], partners) + offset]
    one, other = first // 3, second // 3
    close = np.einsum("ij,ij->i", unit[one], unit[other]) > np.cos(np.radians(crease_deg))
    total = np.empty((len(flat), 3))
    for axis in range(3):
        total[:, axis] = np.bincount(
            first[close], weights=weighted[other[close], axis], minlength=len(flat)
        )
    size = np.linalg.norm(total, axis=1, keepdims=True)
    fallback = np.repeat(unit, 3, axis=0)
    normals = np.where(size > 0, total / np.where(size > 0, size, 1.0), fallback)
    return np.asarray(normals.reshape(-1, 3, 3))


def split_vertices(
    vertices: NDArray[np.floating], faces: NDArray[np.int32], crease_deg: float = CREASE_DEG
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.int32]]:
    """Vertices doubled along creases, so that each has one normal.

    Parameters
    ----------
    vertices : (v, 3) float array
        Corner coordinates, in any unit.
    faces : (f, 3) int32 array
        Three vertex indices for each triangle, counter-clockwise seen from outside.
    crease_deg : float
        Triangles that meet at less than this angle shade as one surface, degrees.

    Returns
    -------
    points : (w, 3) float32 array
        Corner coordinates, repeated along creases.
    normals : (w, 3) float32 array
        Outward unit vector at each point.
    faces : (f, 3) int32 array
        Three indices into `points` for each triangle.
    """
    normals = corner_normals(vertices, faces, crease_deg).reshape(-1, 3)
    # Normals that differ by less than a thousandth share a vertex.
    keys = np.column_stack([faces.reshape(-1), np.rint(normals * 1000).astype(np.int64)])
    _, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    rank = np.argsort(np.argsort(first, kind="stable"), kind="stable")
    chosen = np.sort(first)
    points = np.asarray(vertices, dtype=np.float32)[faces.reshape(-1)[chosen]]
    exact = normals[chosen].astype(np.float32)
    size = np.linalg.norm(exact, axis=1, keepdims=True)
    exact = np.where(
        size > 0.5,
        exact / np.where(size > 0.5, size, 1),
        np.array([0.0, 0.0, 1.0], dtype=np.float32),
    )
    return points, exact.astype(np.float32), rank[inverse.reshape(-1)].reshape(-1, 3).astype("i4")
