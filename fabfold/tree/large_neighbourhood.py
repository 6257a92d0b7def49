"""Large-neighbourhood search: take some voxels out and put them back with the beam.

Ruin and repair are the two halves of every step of a large-neighbourhood search (Shaw 1998;
Schrimpf et al. 2000, "ruin and recreate"): *ruin* takes a part of a solution away, *repair* makes
it whole again in another way. Here a solution is a set of poses. :func:`ruin_and_recreate` changes
full poses; :func:`repair` also places voxels for which growing found no free cell.
"""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.tree.beam import fill_beam
from fabfold.tree.cell_occupancy import list_occupants, random_occupant
from fabfold.tree.pose_energy import count_defects, label_clusters
from fabfold.tree.possible_hinges import HINGE_ROW, max_hinge_rows
from fabfold.tree.rng import random_below, random_float
from fabfold.tree.spanning_trees import energy_if_joined
from fabfold.tree.swept_cells import HingeTables
from fabfold.tree.tables import Tables

__all__ = ["repair", "ruin", "ruin_and_recreate"]

#: Share of removals that make way for a rigid cluster to grow.
_AROUND_CLUSTER = 0.65
#: Of the other removals, those with a greater draw take a patch of the template, not of the source.
_IN_TEMPLATE = 0.82


@njit(cache=True)
def _ruin_around_cluster(
    tables: Tables,
    pose: NDArray[np.int32],
    label: NDArray[np.int32],
    occupants: NDArray[np.int32],
    cluster: int,
    wanted: int,
    generator: NDArray[np.uint64],
    out: NDArray[np.bool_],
) -> int:
    """Choose what keeps a rigid cluster from growing, up to `wanted` voxels.

    That is the source neighbours of the cluster, and whatever sits in the cells that they would
    take if they were rigid with it.

    Returns
    -------
    int
        Number of voxels chosen.
    """
    count = len(pose)
    chosen = 0
    shift = random_below(generator, count)
    for k in range(count):
        u = (k + shift) % count
        if label[u] != cluster:
            continue
        turn = random_below(generator, 6)
        for i in range(6):
            f = (i + turn) % 6
            v = tables.neighbour[u, f]
            if v < 0 or label[v] == cluster or out[v] or not tables.allowed[u, f, 0]:
                continue
            q = tables.child_pose[f, pose[u], 0]
            if q < 0:
                continue
            held = occupants[q // 24]
            if held[0] >= 0 and label[held[0]] == cluster:
                continue
            if held[1] >= 0 and label[held[1]] == cluster:
                continue
            out[v] = True
            chosen += 1
            for w in held:
                if w >= 0 and not out[w]:
                    out[w] = True
                    chosen += 1
            if chosen >= wanted:
                return chosen
    return chosen


@njit(cache=True)
def ruin(
    tables: Tables,
    pose: NDArray[np.int32],
    label: NDArray[np.int32],
    occupants: NDArray[np.int32],
    focus: NDArray[np.int32],
    min_removed: int,
    max_removed: int,
    generator: NDArray[np.uint64],
    out: NDArray[np.bool_],
) -> int:
    """Choose the voxels to take out.

    Mostly what keeps one rigid cluster from growing; else a connected patch of the source, or of
    the template.

    Parameters
    ----------
    tables : Tables
        Tables of the problem.
    pose : (n,) int32 array
        Full set of poses.
    label : (n,) int32 array
        Rigid cluster of each voxel.
    occupants : (m, 2) int32 array
        Voxels in each template cell, -1 for none.
    focus : (k,) int32 array
        Voxels to start from; empty for all.
    min_removed, max_removed : int
        Least and greatest number of voxels wanted. Whoever sits in a cell that is needed comes on
        top.
    generator : (1,) uint64 array
        Random state, advanced.
    out : (n,) bool array
        Filled with the choice.

    Returns
    -------
    int
        Number of voxels chosen.
    """
    count = len(pose)
    out[:] = False
    chosen = 0
    wanted = min_removed + random_below(generator, max_removed - min_removed + 1)
    first = random_below(generator, count)
    if len(focus) > 0:
        first = focus[random_below(generator, len(focus))]
    draw = random_float(generator)
    if draw < _AROUND_CLUSTER:
        chosen = _ruin_around_cluster(
            tables, pose, label, occupants, label[first], wanted, generator, out
        )
        # The rest comes from the edges of what is already out.
        if chosen >= min_removed:
            return chosen
    if not out[first]:
        out[first] = True
        chosen += 1
    edge = np.empty(count, np.int32)
    size = 0
    for v in range(count):
        if out[v]:
            edge[size] = v
            size += 1
    in_template = draw > _IN_TEMPLATE
    patience = 20 * count
    while chosen < wanted and patience > 0:
        patience -= 1
        u = edge[random_below(generator, size)]
        f = random_below(generator, 6)
        if in_template:
            cell = tables.cell_neighbour[pose[u] // 24, f]
            v = random_occupant(occupants, cell, generator) if cell >= 0 else -1
        else:
            v = tables.neighbour[u, f]
        if v >= 0 and not out[v]:
            out[v] = True
            edge[size] = v
            size += 1
            chosen += 1
    return chosen


@njit(cache=True)
def _complete_rigid_groups(tables: Tables, pose: NDArray[np.int32], out: NDArray[np.bool_]) -> int:
    """Take out the rest of every group that must stay rigid: one voxel alone could only go back.

    Parameters
    ----------
    tables : Tables
        Tables of the problem.
    pose : (n,) int32 array
        Pose of each voxel, -1 for none.
    out : (n,) bool array
        Voxels that are taken out; more are added.

    Returns
    -------
    int
        Number of voxels added.
    """
    if len(tables.always_rigid) == 0:
        return 0
    count = len(pose)
    stack = np.empty(count, np.int32)
    top = 0
    for v in range(count):
        if out[v]:
            stack[top] = v
            top += 1
    added = 0
    while top > 0:
        top -= 1
        u = stack[top]
        for f in range(6):
            if tables.always_rigid[u, f]:
                v = tables.neighbour[u, f]
                if not out[v] and pose[v] >= 0:
                    out[v] = True
                    added += 1
                    stack[top] = v
                    top += 1
    return added


@njit(cache=True)
def ruin_and_recreate(
    tables: Tables,
    pose: NDArray[np.int32],
    empty_face: float,
    hinges: HingeTables,
    piece_penalty: float,
    threshold: float,
    focus: NDArray[np.int32],
    tries: int,
    min_removed: int,
    max_removed: int,
    beam_width: int,
    noise: float,
    joint_factor: float,
    generator: NDArray[np.uint64],
    out: NDArray[np.int32],
) -> tuple[int, float, int]:
    """Look for other poses whose energy is at most `threshold`.

    Parameters
    ----------
    tables : Tables
        Tables of the problem.
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
    focus : (k,) int32 array
        Voxels to start removals from; empty for all.
    tries : int
        Most removals tried.
    min_removed, max_removed : int
        Least and greatest number of voxels taken out at a time.
    beam_width : int
        States that the beam keeps while voxels are put back.
    noise : float
        Amplitude of the random part of a state's score, weighted energy.
    joint_factor : float
        Factor on the joint weights while voxels are put back.
    generator : (1,) uint64 array
        Random state, advanced.
    out : (n,) int32 array
        Filled with the new poses.

    Returns
    -------
    used : int
        Removals tried; 0 is never returned.
    energy : float
        Of `out`, with the penalty; infinite when nothing was found.
    left : int
        Pieces of `out`, less one, as counted by the penalty.
    """
    count = len(pose)
    label = np.empty(count, np.int32)
    label_clusters(tables, pose, label)
    occupants = np.empty((len(tables.cells), 2), np.int32)
    list_occupants(pose, occupants)
    removed = np.empty(count, np.bool_)
    hinge_rows = np.empty(max_hinge_rows(tables), HINGE_ROW)
    new_label = np.empty(count, np.int32)
    results = np.empty((beam_width, count), np.int32)
    start = np.empty(count, np.int32)
    for attempt in range(tries):
        chosen = ruin(
            tables, pose, label, occupants, focus, min_removed, max_removed, generator, removed
        )
        chosen += _complete_rigid_groups(tables, pose, removed)
        if chosen >= count:
            removed[random_below(generator, count)] = False
            chosen -= 1
        unplaced = np.empty(chosen, np.int32)
        k = 0
        for v in range(count):
            start[v] = pose[v]
            if removed[v]:
                start[v] = -1
                unplaced[k] = v
                k += 1
        rows, _ = fill_beam(
            tables, start, unplaced, beam_width, noise, joint_factor, False, generator, results
        )
        best = np.inf
        best_row = -1
        best_left = 0
        for r in range(rows):
            same = True
            for v in range(count):
                if results[r, v] != pose[v]:
                    same = False
                    break
            if same:
                continue
            energy, left = energy_if_joined(
                tables, results[r], empty_face, hinges, piece_penalty, threshold, best, generator,
                new_label, hinge_rows,
            )  # fmt: skip
            if energy < best:
                best = energy
                best_row = r
                best_left = left
        if best_row >= 0:
            out[:] = results[best_row]
            return attempt + 1, best, best_left
    return tries, np.inf, 0


@njit(cache=True)
def _ruin_around_gaps(
    tables: Tables,
    pose: NDArray[np.int32],
    occupants: NDArray[np.int32],
    max_removed: int,
    generator: NDArray[np.uint64],
    out: NDArray[np.bool_],
) -> None:
    """Choose voxels around one that has no pose and around a cell that is empty.

    Parameters
    ----------
    tables : Tables
        Tables of the problem.
    pose : (n,) int32 array
        Pose of each voxel, -1 for none.
    occupants : (m, 2) int32 array
        Voxels in each template cell, -1 for none.
    max_removed : int
        Most voxels chosen, about.
    generator : (1,) uint64 array
        Random state, advanced.
    out : (n,) bool array
        Filled with the choice.
    """
    count = len(pose)
    edge = np.empty(2 * count, np.int32)
    size = 0
    out[:] = False
    unplaced = np.flatnonzero(pose < 0)
    if len(unplaced) > 0:
        edge[0] = unplaced[random_below(generator, len(unplaced))]
        size = 1
    empty = np.flatnonzero(occupants[:, 0] < 0)
    if len(empty) > 0:
        cell = empty[random_below(generator, len(empty))]
        for f in range(6):
            other = tables.cell_neighbour[cell, f]
            if other >= 0 and occupants[other, 0] >= 0 and random_float(generator) < 0.6:
                v = random_occupant(occupants, other, generator)
                if not out[v]:
                    out[v] = True
                    edge[size] = v
                    size += 1
    if size == 0:
        edge[0] = random_below(generator, count)
        size = 1
    wanted = 2 + random_below(generator, max_removed - 1)
    for _ in range(4 * wanted):
        if size >= wanted:
            break
        u = edge[random_below(generator, size)]
        f = random_below(generator, 6)
        v = tables.neighbour[u, f]
        if pose[u] >= 0 and random_float(generator) < 0.5:
            cell = tables.cell_neighbour[pose[u] // 24, f]
            v = random_occupant(occupants, cell, generator) if cell >= 0 else -1
        if v >= 0 and not out[v] and pose[v] >= 0:
            out[v] = True
            edge[size] = v
            size += 1


@njit(cache=True)
def repair(
    tables: Tables,
    pose: NDArray[np.int32],
    tries: int,
    max_removed: int,
    beam_width: int,
    generator: NDArray[np.uint64],
) -> tuple[int, int]:
    """Place the voxels for which growing found no free cell, by moving others out of the way.

    Parameters
    ----------
    tables : Tables
        Tables of the problem.
    pose : (n,) int32 array
        Poses, -1 for voxels without one; improved in place.
    tries : int
        Most removals tried.
    max_removed : int
        Most voxels moved at a time.
    beam_width : int
        States that the beam keeps while voxels are put back.
    generator : (1,) uint64 array
        Random state, advanced.

    Returns
    -------
    left : int
        Defects that remain, see :func:`fabfold.tree.pose_energy.count_defects`.
    used : int
        Removals tried.
    """
    count = len(pose)
    occupants = np.empty((len(tables.cells), 2), np.int32)
    list_occupants(pose, occupants)
    removed = np.empty(count, np.bool_)
    results = np.empty((beam_width, count), np.int32)
    start = np.empty(count, np.int32)
    left = count_defects(tables, pose)
    used = 0
    while left > 0 and used < tries:
        used += 1
        _ruin_around_gaps(tables, pose, occupants, max_removed, generator, removed)
        _complete_rigid_groups(tables, pose, removed)
        placed = 0
        for v in range(count):
            start[v] = -1 if removed[v] else pose[v]
            if start[v] >= 0:
                placed += 1
        if placed == 0:
            continue
        unplaced = np.flatnonzero(start < 0).astype(np.int32)
        rows, _ = fill_beam(tables, start, unplaced, beam_width, 1.0, 0.0, True, generator, results)
        best = count
        best_row = -1
        for r in range(rows):
            missing = count_defects(tables, results[r])
            if missing < best:
                best = missing
                best_row = r
        if best_row >= 0 and (best <= left or random_float(generator) < 0.002):
            left = best
            pose[:] = results[best_row]
            list_occupants(pose, occupants)
    return left, used
