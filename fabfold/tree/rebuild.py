"""From poses to joints: rigid clusters, possible hinges, and random spanning trees of them."""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.tree.grow import clusters
from fabfold.tree.problem import Tables
from fabfold.tree.rng import random_float
from fabfold.tree.wedge import HingeTables, blocked

__all__ = ["apart", "candidates", "loose_pieces", "rooted", "spanning_tree"]


@njit(cache=True)
def relation(tables: Tables, u: int, f: int, v: int, pose: NDArray[np.int32]) -> int:
    """Joint type that carries `v`, across face `f` of `u`, to its pose; -1 for none."""
    for j in range(tables.step.shape[1]):
        if tables.allowed[u, f, j] and tables.step[f, j, pose[u]] == pose[v]:
            return j
    return -1


@njit(cache=True)
def apart(tables: Tables, pose: NDArray[np.int32]) -> int:
    """Voxels without a place, plus the pieces, less one, that the possible joints leave.

    Zero for a full set of poses that some tree joins.
    """
    count = len(pose)
    seen = np.zeros(count, np.bool_)
    stack = np.empty(count, np.int32)
    total = -1
    for first in range(count):
        if seen[first]:
            continue
        seen[first] = True
        total += 1
        if pose[first] < 0:
            continue
        stack[0] = first
        top = 1
        while top > 0:
            top -= 1
            u = stack[top]
            for f in range(6):
                v = tables.neighbour[u, f]
                if v < 0 or seen[v] or pose[v] < 0:
                    continue
                if relation(tables, u, f, v, pose) >= 0:
                    seen[v] = True
                    stack[top] = v
                    top += 1
    return total


@njit(cache=True)
def candidates(
    tables: Tables,
    pose: NDArray[np.int32],
    hinges: HingeTables,
    label: NDArray[np.int32],
    found: NDArray[np.int32],
) -> tuple[int, int]:
    """Rigid clusters and the single hinges that could join them.

    Hinges whose half turn would run the two clusters into each other are left out.

    Parameters
    ----------
    tables, pose
        A full set of poses.
    hinges : HingeTables
    label : (n,) int32 array
        Filled with the cluster of each voxel.
    found : (3 n, 12) int32 array
        Filled with one row a hinge: voxels u and v, their clusters, face of u, joint type, twice
        the middle of its lattice edge in A (3) and in B (3).

    Returns
    -------
    number_of_clusters, number_of_hinges : int
    """
    count = len(pose)
    total = clusters(tables, pose, label)
    start = np.zeros(total + 1, np.int32)
    for v in range(count):
        start[label[v] + 1] += 1
    for c in range(total):
        start[c + 1] += start[c]
    member = np.empty(count, np.int32)
    at = start.copy()
    for v in range(count):
        member[at[label[v]]] = v
        at[label[v]] += 1
    rows = 0
    for u in range(count):
        for f in range(0, 6, 2):
            v = tables.neighbour[u, f]
            if v < 0 or label[u] == label[v]:
                continue
            j = relation(tables, u, f, v, pose)
            if j < 1:
                continue
            a, b = label[u], label[v]
            d = hinges.faces[f]
            n = hinges.faces[hinges.sides[f, j - 1]]
            if blocked(
                tables.source,
                member[start[a] : start[a + 1]],
                member[start[b] : start[b + 1]],
                tables.source[u],
                d,
                n,
                hinges.swept,
            ):
                continue
            found[rows, 0] = u
            found[rows, 1] = v
            found[rows, 2] = a
            found[rows, 3] = b
            found[rows, 4] = f
            found[rows, 5] = j
            rotation = tables.rotations[pose[u] % 24]
            cell = tables.cells[pose[u] // 24]
            for x in range(3):
                found[rows, 6 + x] = 2 * tables.source[u, x] + d[x] + n[x]
                moved = 2 * cell[x]
                for y in range(3):
                    moved += rotation[x, y] * (d[y] + n[y])
                found[rows, 9 + x] = moved
            rows += 1
    return total, rows


@njit(cache=True)
def _root(link: NDArray[np.int32], a: int) -> int:
    while link[a] != a:
        link[a] = link[link[a]]
        a = link[a]
    return a


@njit(cache=True)
def spanning_tree(
    found: NDArray[np.int32],
    rows: int,
    total: int,
    wanted: NDArray[np.float64],
    generator: NDArray[np.uint64],
    chosen: NDArray[np.int32],
) -> int:
    """Random spanning tree of the clusters.

    No two of its hinges share a lattice edge segment in A or in B (paper section 4.1, joint
    collision).

    Parameters
    ----------
    found : (k, 12) int32 array
        From :func:`candidates`; the first `rows` rows count.
    total : int
        Number of clusters.
    wanted : (k,) float64 array
        Hinges are tried by ascending ``wanted + uniform(0, 1)``.
    chosen : (total - 1,) int32 array
        Filled with rows of `found`.

    Returns
    -------
    int
        Number of pieces that remain: 1 when the tree spans.
    """
    link = np.arange(total).astype(np.int32)
    order = np.empty(rows)
    for i in range(rows):
        order[i] = wanted[i] + random_float(generator)
    kept = 0
    for row in np.argsort(order):
        if kept == total - 1:
            break
        a = _root(link, found[row, 2])
        b = _root(link, found[row, 3])
        if a == b:
            continue
        clash = False
        for i in range(kept):
            other = chosen[i]
            if (
                found[row, 6] == found[other, 6]
                and found[row, 7] == found[other, 7]
                and found[row, 8] == found[other, 8]
            ) or (
                found[row, 9] == found[other, 9]
                and found[row, 10] == found[other, 10]
                and found[row, 11] == found[other, 11]
            ):
                clash = True
                break
        if clash:
            continue
        link[a] = b
        chosen[kept] = row
        kept += 1
    return total - kept


@njit(cache=True)
def rooted(
    found: NDArray[np.int32],
    chosen: NDArray[np.int32],
    label: NDArray[np.int32],
    total: int,
    hinges: HingeTables,
    body: NDArray[np.int32],
    parent: NDArray[np.int32],
    axis: NDArray[np.int8],
    turns: NDArray[np.int8],
    row: NDArray[np.int32],
) -> None:
    """Order a spanning tree from its largest cluster outwards (ties: the lower number).

    Parameters
    ----------
    found, chosen, label, total
        From :func:`candidates` and :func:`spanning_tree`.
    body : (n,) int32 array
        Filled with the body of each voxel; body 0 is the root.
    parent, axis, turns, row : (total - 1,) arrays
        Filled for each hinge: parent body, axis 0 to 2, signed quarter turns about the positive
        axis, and its row of `found`, negative minus 1 (``~row``) where the parent is v.
    """
    size = np.zeros(total, np.int32)
    for v in range(len(label)):
        size[label[v]] += 1
    index = np.full(total, -1, np.int32)
    queue = np.empty(total, np.int32)
    first = 0
    for c in range(total):
        if size[c] > size[first]:
            first = c
    index[first] = 0
    queue[0] = first
    tail = 1
    head = 0
    while head < tail:
        here = queue[head]
        head += 1
        for i in range(total - 1):
            r = chosen[i]
            if found[r, 2] == here and index[found[r, 3]] < 0:
                other = found[r, 3]
                turned = False
            elif found[r, 3] == here and index[found[r, 2]] < 0:
                other = found[r, 2]
                turned = True
            else:
                continue
            index[other] = tail
            queue[tail] = other
            h = tail - 1
            tail += 1
            parent[h] = index[here]
            side = hinges.sides[found[r, 4], found[r, 5] - 1]
            d = hinges.faces[found[r, 4]]
            n = hinges.faces[side]
            d_axis = found[r, 4] >> 1
            n_axis = side >> 1
            axis[h] = 3 - d_axis - n_axis
            # Component of d x n along the positive axis; seen from v the same edge turns back.
            sign = d[d_axis] * n[n_axis]
            if (d_axis + 1) % 3 != n_axis:
                sign = -sign
            turns[h] = -2 * sign if turned else 2 * sign
            row[h] = ~r if turned else r
    for v in range(len(label)):
        body[v] = index[label[v]]


@njit(cache=True)
def loose_pieces(
    found: NDArray[np.int32],
    rows: int,
    total: int,
    tries: int,
    generator: NDArray[np.uint64],
) -> int:
    """Fewest pieces that a few random choices of hinges leave, less one."""
    wanted = np.zeros(rows)
    chosen = np.empty(total, np.int32)
    least = total
    for _ in range(tries):
        least = min(least, spanning_tree(found, rows, total, wanted, generator, chosen))
        if least == 1:
            break
    return least - 1
