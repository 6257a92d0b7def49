"""A large move of the tree search: all leaves of a tree take their best places at once.

A leaf of a spanning tree of the placed voxels hangs on a neighbour that stays, and two leaves have
no joint with each other that the tree needs. So the leaves, and the cells that are free once they
are out, are an assignment problem: whoever fits best where, over all permutations at once. Large
moves of this kind are known as assignment neighbourhoods (Gutin 1999; Ahuja et al. 2002, "very
large-scale neighborhood search").
"""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.tree.pose_energy import label_clusters
from fabfold.tree.possible_hinges import HINGE_ROW, max_hinge_rows
from fabfold.tree.rng import random_below, random_float
from fabfold.tree.spanning_trees import energy_if_joined
from fabfold.tree.swept_cells import HingeTables
from fabfold.tree.tables import Tables

__all__ = ["assign", "reassign_leaves"]

#: Cost of a place that a voxel cannot take.
_NEVER = 1e6
#: Share of the spanning trees that grow breadth first, which have many leaves.
_BREADTH_FIRST = 0.7


@njit(cache=True)
def assign(cost: NDArray[np.float64], rows: int, columns: int, row_of: NDArray[np.int32]) -> None:
    """Give every row a column of its own at the least total cost.

    Shortest augmenting paths (Jonker and Volgenant 1987); scipy's solver cannot be called from
    a kernel.

    Parameters
    ----------
    cost : (r, c) float64 array
        Cost of each row in each column; the first `rows` and `columns` count.
    rows, columns : int
        How many there are; at least as many columns as rows.
    row_of : (c,) int32 array
        Filled with the row of each column, -1 for none.
    """
    left = np.zeros(rows + 1)
    right = np.zeros(columns + 1)
    taken_by = np.zeros(columns + 1, np.int32)
    before = np.zeros(columns + 1, np.int32)
    nearest = np.empty(columns + 1)
    used = np.empty(columns + 1, np.bool_)
    for row in range(1, rows + 1):
        taken_by[0] = row
        here = 0
        nearest[:] = np.inf
        used[:] = False
        while True:
            used[here] = True
            i = taken_by[here]
            step = np.inf
            there = 0
            for j in range(1, columns + 1):
                if used[j]:
                    continue
                reduced = cost[i - 1, j - 1] - left[i] - right[j]
                if reduced < nearest[j]:
                    nearest[j] = reduced
                    before[j] = here
                if nearest[j] < step:
                    step = nearest[j]
                    there = j
            for j in range(columns + 1):
                if used[j]:
                    left[taken_by[j]] += step
                    right[j] -= step
                else:
                    nearest[j] -= step
            here = there
            if taken_by[here] == 0:
                break
        while here != 0:
            taken_by[here] = taken_by[before[here]]
            here = before[here]
    for j in range(columns):
        row_of[j] = taken_by[j + 1] - 1


@njit(cache=True)
def _list_leaves(
    tables: Tables,
    pose: NDArray[np.int32],
    generator: NDArray[np.uint64],
    out: NDArray[np.int32],
) -> int:
    """List the leaves of a random spanning tree of the joints, in random order.

    Voxels that no cut may part from a neighbour are no leaves.
    """
    count = len(pose)
    joints = tables.child_pose.shape[2]
    seen = np.zeros(count, np.bool_)
    inner = np.zeros(count, np.bool_)
    queue = np.empty(count, np.int32)
    queue[0] = random_below(generator, count)
    seen[queue[0]] = inner[queue[0]] = True
    breadth_first = random_float(generator) < _BREADTH_FIRST
    head = 0
    end = 1
    while head < end:
        if not breadth_first:
            other = head + random_below(generator, end - head)
            queue[head], queue[other] = queue[other], queue[head]
        u = queue[head]
        head += 1
        turn = random_below(generator, 6)
        for i in range(6):
            f = (i + turn) % 6
            v = tables.neighbour[u, f]
            if v < 0 or seen[v]:
                continue
            for j in range(joints):
                if tables.allowed[u, f, j] and tables.child_pose[f, pose[u], j] == pose[v]:
                    seen[v] = inner[u] = True
                    queue[end] = v
                    end += 1
                    break
    found = 0
    has_rigid_pairs = len(tables.always_rigid) > 0
    for v in range(count):
        if inner[v] or (has_rigid_pairs and tables.always_rigid[v].any()):
            continue
        place = random_below(generator, found + 1)
        out[found] = out[place]
        out[place] = v
        found += 1
    return found


@njit(cache=True)
def _clusters_joined(
    tables: Tables, pose: NDArray[np.int32], label: NDArray[np.int32], v: int, q: int
) -> int:
    """Number of distinct rigid clusters that voxel `v` at pose `q` would join."""
    count = 0
    for f in range(6):
        u = tables.neighbour[v, f]
        if u < 0 or pose[u] < 0:
            continue
        if not (tables.allowed[u, f ^ 1, 0] and tables.child_pose[f ^ 1, pose[u], 0] == q):
            continue
        fresh = True
        for g in range(f):
            w = tables.neighbour[v, g]
            if w < 0 or pose[w] < 0 or label[w] != label[u]:
                continue
            if tables.allowed[w, g ^ 1, 0] and tables.child_pose[g ^ 1, pose[w], 0] == q:
                fresh = False
        count += fresh
    return count


@njit(cache=True)
def _price_places(
    tables: Tables,
    pose: NDArray[np.int32],
    label: NDArray[np.int32],
    voxels: NDArray[np.int32],
    column: NDArray[np.int32],
    empty_cost: NDArray[np.float64],
    noise: float,
    generator: NDArray[np.uint64],
    cost: NDArray[np.float64],
    best_pose: NDArray[np.int32],
) -> None:
    """Fill `cost` and `best_pose` for each of `voxels` in each cell that has a `column`."""
    joints = tables.child_pose.shape[2]
    cost[: len(voxels)] = _NEVER
    for i in range(len(voxels)):
        v = voxels[i]
        for f in range(6):
            u = tables.neighbour[v, f]
            if u < 0 or pose[u] < 0:
                continue
            for j in range(joints):
                if not tables.allowed[u, f ^ 1, j]:
                    continue
                q = tables.child_pose[f ^ 1, pose[u], j]
                if q < 0 or column[q // 24] < 0:
                    continue
                value = np.float64(tables.cost[v, q]) - empty_cost[q // 24]
                value -= tables.joint_weight[1] * _clusters_joined(tables, pose, label, v, q)
                value += noise * random_float(generator)
                if value < cost[i, column[q // 24]]:
                    cost[i, column[q // 24]] = value
                    best_pose[i, column[q // 24]] = q


@njit(cache=True)
def reassign_leaves(
    tables: Tables,
    pose: NDArray[np.int32],
    empty_face: float,
    hinges: HingeTables,
    piece_penalty: float,
    threshold: float,
    tries: int,
    most: int,
    noise: float,
    generator: NDArray[np.uint64],
    out: NDArray[np.int32],
) -> tuple[int, float, int]:
    """Look for other poses of some leaves whose energy is at most `threshold`.

    Parameters
    ----------
    tables : Tables
        Tables of a problem in which no two voxels share a cell.
    pose : (n,) int32 array
        Full set of poses to start from.
    empty_face : float
        Weighted energy of one boundary face of an empty template cell.
    hinges : HingeTables
        From :func:`fabfold.tree.swept_cells.hinge_tables`.
    piece_penalty : float
        Energy added for each piece, after the first, into which hinges that can turn leave the
        whole.
    threshold : float
        Greatest energy, with the penalty, of a result.
    tries : int
        Most sets of leaves tried.
    most : int
        Most leaves taken out at a time; two at least are.
    noise : float
        Amplitude of the random part of the price of a place, weighted energy.
    generator : (1,) uint64 array
        Random state, advanced.
    out : (n,) int32 array
        Filled with the new poses.

    Returns
    -------
    used : int
        Sets of leaves tried.
    energy : float
        Of `out`, with the penalty; infinite when nothing was found.
    left : int
        Pieces of `out`, less one, as counted by the penalty.
    """
    count, cells = len(pose), len(tables.cells)
    leaves = np.empty(count, np.int32)
    label = np.empty(count, np.int32)
    kept = np.empty(count, np.int32)
    hinge_rows = np.empty(max_hinge_rows(tables), HINGE_ROW)
    cost = np.empty((most, cells))
    best_pose = np.empty((most, cells), np.int32)
    row_of = np.empty(cells, np.int32)
    column = np.empty(cells, np.int32)
    empty_cost = np.zeros(cells)
    for cell in range(cells):
        for f in range(6):
            if tables.cell_neighbour[cell, f] < 0:
                empty_cost[cell] += empty_face
    for attempt in range(tries):
        found = _list_leaves(tables, pose, generator, leaves)
        size = min(found, 2 + random_below(generator, max(1, most - 1)), most)
        voxels = leaves[:size]
        kept[:] = pose
        for v in voxels:
            kept[v] = -1
        column[:] = 0
        for v in range(count):
            if kept[v] >= 0:
                column[kept[v] // 24] = -1
        columns = 0
        for cell in range(cells):
            if column[cell] == 0:
                column[cell] = columns
                columns += 1
        label_clusters(tables, kept, label)
        _price_places(
            tables, kept, label, voxels, column, empty_cost, noise, generator, cost, best_pose
        )
        assign(cost, size, columns, row_of)
        changed = False
        possible = size > 0
        out[:] = kept
        for c in range(columns):
            i = row_of[c]
            if i >= 0:
                possible = possible and cost[i, c] < _NEVER / 2
                out[voxels[i]] = best_pose[i, c]
                changed = changed or best_pose[i, c] != pose[voxels[i]]
        if not possible or not changed:
            continue
        energy, left = energy_if_joined(
            tables, out, empty_face, hinges, piece_penalty, threshold, np.inf, generator, label,
            hinge_rows,
        )  # fmt: skip
        if energy < np.inf:
            return attempt + 1, energy, left
    return tries, np.inf, 0
