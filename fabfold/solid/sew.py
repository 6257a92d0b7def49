"""Sew cracks: join rim vertices over small gaps, split rim edges at vertices that lie on them."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from fabfold.meshes import drop_collapsed
from fabfold.solid.topology import Edges, Faces, Points

__all__ = ["sew", "split_rims", "weld_rims"]

#: Rims of neighbouring faces are joined over gaps of at most these shares of the longest side.
TOLERANCES = (1e-7, 1e-6, 1e-5, 1e-4)
#: Rims with more edges than this are not searched for vertices that lie on them.
SPLIT_LIMIT = 20_000


def sew(vertices: Points, faces: Faces) -> tuple[Faces, float]:
    """Close cracks between neighbouring faces, with the smallest tolerance that closes most.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        Corner coordinates; the longest side is about 1.
    faces : (f, 3) int64 array
        Three vertex indices for each triangle, of a welded mesh.

    Returns
    -------
    faces : (g, 3) int64 array
        Over the same vertices; the faces as they were where nothing is gained.
    tolerance : float
        The largest gap that was closed, 0 if the faces are as they were.
    """
    best, fewest, needed = faces, Edges.of(faces).odd, 0.0
    for tolerance in TOLERANCES:
        if fewest == 0:
            break
        joined = weld_rims(vertices, faces, tolerance)
        for candidate in (joined, split_rims(vertices, joined, tolerance)):
            if len(candidate) and (odd := Edges.of(candidate).odd) < fewest:
                best, fewest, needed = candidate, odd, tolerance
    return best, needed


def _rim(faces: Faces) -> NDArray[np.bool_]:
    """Sides (of shape (f, 3)) that no other face touches."""
    edges = Edges.of(faces)
    single: NDArray[np.bool_] = edges.count[edges.of_side] == 1
    return single


def weld_rims(vertices: Points, faces: Faces, tolerance: float) -> Faces:
    """Join vertices on open edges that lie within `tolerance` of each other.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        Corner coordinates; the longest side is about 1.
    faces : (f, 3) int64 array
        Three vertex indices for each triangle.
    tolerance : float
        Largest distance of two vertices that are joined, in the unit of `vertices`.

    Returns
    -------
    (g, 3) int64 array
        Triangles over the same vertices, without those that collapsed.
    """
    single = _rim(faces)
    rim = np.union1d(faces[single], np.roll(faces, -1, axis=1)[single])
    if len(rim) == 0:
        return faces
    pairs = cKDTree(vertices[rim]).query_pairs(tolerance, output_type="ndarray")
    if len(pairs) == 0:
        return faces
    graph = coo_matrix((np.ones(len(pairs)), pairs.T), shape=(len(rim), len(rim)))
    _, label = connected_components(graph, directed=False)
    _, first = np.unique(label, return_index=True)
    number = np.arange(len(vertices), dtype=np.int64)
    number[rim] = rim[first[label]]
    return drop_collapsed(number[faces])


def split_rims(vertices: Points, faces: Faces, tolerance: float) -> Faces:
    """Split faces along open edges at the rim vertices that lie on these edges.

    A face is split along one of its edges in a pass, so three passes reach all.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        Corner coordinates; the longest side is about 1.
    faces : (f, 3) int64 array
        Three vertex indices for each triangle.
    tolerance : float
        Largest distance of a vertex from an edge that it splits, in the unit of `vertices`.

    Returns
    -------
    (g, 3) int64 array
        Triangles over the same vertices; `faces` itself where the rims have too many edges.
    """
    for _ in range(3):
        single = _rim(faces)
        if not 0 < single.sum() <= SPLIT_LIMIT:
            return faces
        rim = np.union1d(faces[single], np.roll(faces, -1, axis=1)[single])
        tree = cKDTree(vertices[rim])
        fresh: list[tuple[int, int, int]] = []
        gone: set[int] = set()
        for face, side in np.argwhere(single).tolist():
            if face in gone:
                continue
            a, b, c = np.roll(faces[face], -side).tolist()
            between = _on_edge(vertices, rim, tree, a, b, tolerance)
            if between:
                gone.add(face)
                stops = [a, *between, b]
                fresh += [(p, q, c) for p, q in itertools.pairwise(stops)]
        if not gone:
            return faces
        kept = np.ones(len(faces), dtype=bool)
        kept[sorted(gone)] = False
        faces = drop_collapsed(np.concatenate([faces[kept], np.array(fresh, dtype=np.int64)]))
    return faces


def _on_edge(
    vertices: Points, rim: NDArray[np.int64], tree: cKDTree, a: int, b: int, tolerance: float
) -> list[int]:
    """Rim vertices strictly within the edge from `a` to `b`, in order."""
    start, along = vertices[a], vertices[b] - vertices[a]
    length = float(np.linalg.norm(along))
    near = tree.query_ball_point(start + along / 2, length / 2 + tolerance)
    if length <= 4 * tolerance or not near:
        return []
    candidates = rim[np.sort(near)]
    share = (vertices[candidates] - start) @ along / length**2
    distance = np.linalg.norm(vertices[candidates] - start - share[:, None] * along, axis=1)
    margin = 2 * tolerance / length
    inside = (distance <= tolerance) & (share > margin) & (share < 1 - margin)
    found: list[int] = candidates[inside][np.argsort(share[inside], kind="stable")].tolist()
    return found
