"""Edges, winding and shells of a triangle mesh, found by sorting and connected components.

A surface is *closed* when every edge is passed as often one way as the other. This holds for
ordinary edges of two faces, and also where two closed bodies meet in an edge of four.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from fabfold.meshes import triple_products

__all__ = [
    "Edges",
    "Faces",
    "Points",
    "orient",
    "patches",
    "shells",
]

#: Three vertex indices for each triangle, shape (f, 3).
Faces = NDArray[np.int64]
#: Coordinates, shape (v, 3).
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
        """Find the edges of a mesh.

        Parameters
        ----------
        faces : (f, 3) int64 array
            Three vertex indices for each triangle.

        Returns
        -------
        Edges
            In the order of their smaller, then their larger vertex.
        """
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


def _pairs_of_faces(edges: Edges) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Faces joined by an edge of exactly two, shape (p, 2), and whether they are wound alike."""
    found = np.flatnonzero(edges.count[edges.of_side.ravel()] == 2)
    sides = found[np.argsort(edges.of_side.ravel()[found], kind="stable")].reshape(-1, 2)
    signs = edges.sign.ravel()[sides]
    return sides // 3, signs[:, 0] != signs[:, 1]


def patches(faces: Faces, edges: Edges | None = None) -> NDArray[np.int64]:
    """Faces that hang together over ordinary edges, those of exactly two faces.

    Parameters
    ----------
    faces : (f, 3) int64 array
        Three vertex indices for each triangle.
    edges : Edges, optional
        The edges of `faces`, where they are known already.

    Returns
    -------
    (f,) int64 array
        Number of the patch of each face, from 0.
    """
    pairs, _ = _pairs_of_faces(edges or Edges.of(faces))
    return _components(len(faces), pairs)


def _components(count: int, pairs: NDArray[np.int64]) -> NDArray[np.int64]:
    graph = coo_matrix((np.ones(len(pairs), dtype=np.int8), pairs.T), shape=(count, count))
    label: NDArray[np.int64] = connected_components(graph, directed=False)[1].astype(np.int64)
    return label


def orient(vertices: Points, faces: Faces) -> tuple[Faces, int, int]:
    """Wind the faces of every patch alike, and outwards.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        Corner coordinates, in any unit.
    faces : (f, 3) int64 array
        Three vertex indices for each triangle, wound either way.

    Returns
    -------
    faces : (f, 3) int64 array
        The same triangles in the same order, some with their corners in reverse.
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
    volume = triple_products(corners)
    total = np.bincount(patch, weights=np.where(flip, -volume, volume))
    flip ^= total[patch] < 0
    one_sided = int((kept == turned).sum())
    return np.where(flip[:, None], faces[:, ::-1], faces), int(flip.sum()), one_sided


def shells(faces: Faces) -> NDArray[np.int64]:
    """Sets of faces that are closed by themselves, as far as possible.

    Patches are taken as they are where they are closed; patches that only close together, at
    edges of more than two faces, are joined.

    Parameters
    ----------
    faces : (f, 3) int64 array
        Three vertex indices for each triangle.

    Returns
    -------
    (f,) int64 array
        Number of the shell of each face.
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
