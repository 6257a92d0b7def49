"""Edges and shells of a triangle mesh, all by sorting and graph components.

A surface is *closed* when every edge is passed as often one way as the other. This holds for
ordinary edges of two faces, and also where two closed bodies meet in an edge of four.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

__all__ = [
    "Edges",
    "face_areas",
    "orient",
    "patches",
    "proper",
    "shells",
    "weld",
]

Faces = NDArray[np.int64]
Points = NDArray[np.float64]


@dataclass(frozen=True)
class Edges:
    """The undirected edges of a mesh.

    Attributes
    ----------
    of_side : (f, 3) int64 array
        Edge of the sides ab, bc, ca of every face.
    sign : (f, 3) int64 array
        1 where the side runs from the smaller to the larger vertex index, else -1.
    count : (e,) int64 array
        Number of faces at the edge.
    balance : (e,) int64 array
        Sum of the signs: 0 where the surface is closed and consistently wound.
    """

    of_side: NDArray[np.int64]
    sign: NDArray[np.int64]
    count: NDArray[np.int64]
    balance: NDArray[np.int64]

    @classmethod
    def of(cls, faces: Faces) -> Edges:
        """Find the edges of `faces`, an (f, 3) int64 array."""
        start, end = faces, np.roll(faces, -1, axis=1)
        size = int(faces.max(initial=0)) + 1
        key = np.minimum(start, end) * size + np.maximum(start, end)
        _, index = np.unique(key.ravel(), return_inverse=True)
        sign = np.where(start < end, 1, -1).astype(np.int64)
        count = np.bincount(index)
        balance = np.rint(np.bincount(index, weights=sign.ravel())).astype(np.int64)
        return cls(index.reshape(-1, 3), sign, count.astype(np.int64), balance)

    @property
    def closed(self) -> bool:
        """Whether every edge is passed as often one way as the other."""
        return not self.balance.any()

    @property
    def odd(self) -> int:
        """Number of edges with an odd number of faces, however these are wound."""
        return int((self.count % 2).sum())


def weld(vertices: Points, faces: Faces) -> tuple[Points, Faces]:
    """Join vertices with exactly equal coordinates and drop faces that then repeat a vertex.

    No tolerance: a model a nanometre long must not collapse.
    """
    points = vertices + 0.0  # -0.0 becomes 0.0
    order = np.lexsort(points.T)
    ranked = points[order]
    fresh = np.ones(len(points), dtype=bool)
    fresh[1:] = (ranked[1:] != ranked[:-1]).any(axis=1)
    number = np.empty(len(points), dtype=np.int64)
    number[order] = np.cumsum(fresh) - 1
    return ranked[fresh], proper(number[faces])


def proper(faces: Faces) -> Faces:
    """The faces with three different vertices."""
    a, b, c = faces.T
    kept: Faces = faces[(a != b) & (b != c) & (c != a)]
    return kept


def face_areas(vertices: Points, faces: Faces) -> NDArray[np.float64]:
    """Area of every face, shape (f,)."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    areas: NDArray[np.float64] = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    return areas


def _pairs_of_faces(edges: Edges) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Faces joined by an edge of exactly two, shape (p, 2), and whether they are wound alike."""
    found = np.flatnonzero(edges.count[edges.of_side.ravel()] == 2)
    sides = found[np.argsort(edges.of_side.ravel()[found], kind="stable")].reshape(-1, 2)
    signs = edges.sign.ravel()[sides]
    return sides // 3, signs[:, 0] != signs[:, 1]


def patches(faces: Faces, edges: Edges | None = None) -> NDArray[np.int64]:
    """Label of every face; faces joined by an ordinary edge (of two faces) share one."""
    pairs, _ = _pairs_of_faces(edges or Edges.of(faces))
    return _components(len(faces), pairs)


def _components(count: int, pairs: NDArray[np.int64]) -> NDArray[np.int64]:
    graph = coo_matrix((np.ones(len(pairs), dtype=np.int8), pairs.T), shape=(count, count))
    label: NDArray[np.int64] = connected_components(graph, directed=False)[1].astype(np.int64)
    return label


def orient(vertices: Points, faces: Faces) -> tuple[Faces, int, int]:
    """Wind the faces of every patch alike, and outwards.

    Returns
    -------
    faces : (f, 3) int64 array
    turned : int
        Number of faces that were turned over.
    one_sided : int
        Number of faces in patches that cannot be wound consistently (Möbius strips).

    Notes
    -----
    Every face stands twice in a graph, once as it is and once turned over; faces joined by an
    edge are linked in the two ways that agree. A patch falls into two components of this graph,
    one the mirror of the other, or into one if it is one-sided. Of the two, the one with the
    positive volume about the patch's own middle faces outwards.
    """
    count = len(faces)
    pairs, alike = _pairs_of_faces(Edges.of(faces))
    first, second = pairs.T
    other = np.where(alike, second, second + count)
    mirror = np.where(alike, second + count, second)
    links = np.column_stack([np.r_[first, first + count], np.r_[other, mirror]])
    label = _components(2 * count, links)
    kept, turned = label[:count], label[count:]
    flip = kept > turned
    patch = np.minimum(kept, turned)
    corners = vertices[faces]
    middle = (
        np.column_stack(
            [np.bincount(patch, weights=corners[:, :, k].mean(axis=1)) for k in range(3)]
        )
        / np.maximum(np.bincount(patch), 1)[:, None]
    )
    corners = corners - middle[patch][:, None]
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    total = np.bincount(patch, weights=np.where(flip, -volume, volume))
    flip ^= total[patch] < 0
    one_sided = int((kept == turned).sum())
    return np.where(flip[:, None], faces[:, ::-1], faces), int(flip.sum()), one_sided


def shells(faces: Faces) -> NDArray[np.int64]:
    """Label of every face; each label is a set of faces that is closed by itself if possible.

    Patches are taken as they are where they are closed; patches that only close together, at
    edges of more than two faces, are joined.
    """
    edges = Edges.of(faces)
    label = patches(faces, edges)
    while True:
        key = edges.of_side * (int(label.max()) + 1) + label[:, None]
        _, index = np.unique(key.ravel(), return_inverse=True)
        balance = np.rint(np.bincount(index, weights=edges.sign.ravel()))
        loose = (balance[index] != 0) & (edges.count[edges.of_side.ravel()] > 2)
        if not loose.any():
            return label
        face = np.flatnonzero(loose) // 3
        edge = edges.of_side.ravel()[loose]
        order = np.argsort(edge, kind="stable")
        same = edge[order][1:] == edge[order][:-1]
        pairs = np.column_stack([label[face[order][:-1][same]], label[face[order][1:][same]]])
        merged = _components(int(label.max()) + 1, pairs)[label]
        if merged.max() == label.max():
            return label
        label = merged
