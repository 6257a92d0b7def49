"""Large-neighbourhood search: take some voxels out and put them back with the beam."""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.tree.cell_occupancy import holders, one_of
from fabfold.tree.grow import clusters, energy_of, fill_beam
from fabfold.tree.problem import Tables
from fabfold.tree.rebuild import COLUMNS, apart, candidates, hinge_rows, loose_pieces
from fabfold.tree.rng import random_below, random_float
from fabfold.tree.swept_cells import HingeTables

__all__ = ["propose", "repair", "ruin"]


@njit(cache=True)
def ruin(
    tables: Tables,
    pose: NDArray[np.int32],
    label: NDArray[np.int32],
    holder: NDArray[np.int32],
    focus: NDArray[np.int32],
    least: int,
    most: int,
    generator: NDArray[np.uint64],
    out: NDArray[np.bool_],
) -> int:
    """Choose the voxels to take out.

    Mostly the source neighbours of one rigid cluster and whatever sits in the cells that they
    would take if they were rigid with it, which lets the cluster grow; else a connected patch of
    the source, or of the template.

    Parameters
    ----------
    label : (n,) int32 array
        Rigid cluster of each voxel.
    holder : (m, 2) int32 array
        Voxels in each template cell, -1 for none.
    focus : (k,) int32 array
        Voxels to start from; empty for all.
    least, most : int
        Number of voxels wanted.
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
    want = least + random_below(generator, most - least + 1)
    first = random_below(generator, count)
    if len(focus) > 0:
        first = focus[random_below(generator, len(focus))]
    how = random_float(generator)
    if how < 0.65:
        here = label[first]
        shift = random_below(generator, count)
        for k in range(count):
            u = (k + shift) % count
            if label[u] != here:
                continue
            turn = random_below(generator, 6)
            for i in range(6):
                f = (i + turn) % 6
                v = tables.neighbour[u, f]
                if v < 0 or label[v] == here or out[v] or not tables.allowed[u, f, 0]:
                    continue
                q = tables.step[f, 0, pose[u]]
                if q < 0:
                    continue
                sitting = holder[q // 24]
                if sitting[0] >= 0 and label[sitting[0]] == here:
                    continue
                if sitting[1] >= 0 and label[sitting[1]] == here:
                    continue
                out[v] = True
                chosen += 1
                for w in sitting:
                    if w >= 0 and not out[w]:
                        out[w] = True
                        chosen += 1
                if chosen >= want:
                    return chosen
        # The rest comes from the edges of what is already out.
        if chosen >= least:
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
    in_template = how > 0.82
    patience = 20 * count
    while chosen < want and patience > 0:
        patience -= 1
        u = edge[random_below(generator, size)]
        f = random_below(generator, 6)
        if in_template:
            cell = tables.around[pose[u] // 24, f]
            v = one_of(holder, cell, generator) if cell >= 0 else -1
        else:
            v = tables.neighbour[u, f]
        if v >= 0 and not out[v]:
            out[v] = True
            edge[size] = v
            size += 1
            chosen += 1
    return chosen


@njit(cache=True)
def _whole_groups(tables: Tables, pose: NDArray[np.int32], out: NDArray[np.bool_]) -> int:
    """Take the rest of every stiff group out too: one voxel alone could only go back.

    Returns
    -------
    int
        Number of voxels added.
    """
    if len(tables.stiff) == 0:
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
            if tables.stiff[u, f]:
                v = tables.neighbour[u, f]
                if not out[v] and pose[v] >= 0:
                    out[v] = True
                    added += 1
                    stack[top] = v
                    top += 1
    return added


@njit(cache=True)
def propose(
    tables: Tables,
    pose: NDArray[np.int32],
    empty_face: float,
    hinges: HingeTables,
    loose: float,
    threshold: float,
    focus: NDArray[np.int32],
    tries: int,
    least: int,
    most: int,
    width: int,
    noise: float,
    joint_share: float,
    generator: NDArray[np.uint64],
    out: NDArray[np.int32],
) -> tuple[int, float, int]:
    """Look for other poses whose energy is at most `threshold`.

    Parameters
    ----------
    pose : (n,) int32 array
        Full set of poses to start from.
    empty_face : float
        Weighted energy of one boundary face of an empty template cell.
    hinges : HingeTables
    loose : float
        Penalty for each piece, after the first, into which hinges that can turn leave the whole.
    threshold : float
    focus : (k,) int32 array
        Voxels to start removals from; empty for all.
    tries : int
        Most removals tried.
    least, most : int
        Number of voxels taken out at a time.
    width, noise, joint_share
        Of the beam, see :func:`fabfold.tree.grow.fill_beam`.
    generator : (1,) uint64 array
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
    clusters(tables, pose, label)
    holder = np.empty((len(tables.cells), 2), np.int32)
    holders(tables, pose, holder)
    gone = np.empty(count, np.bool_)
    hinge = np.empty((hinge_rows(tables), COLUMNS), np.int32)
    new_label = np.empty(count, np.int32)
    results = np.empty((width, count), np.int32)
    start = np.empty(count, np.int32)
    for attempt in range(tries):
        chosen = ruin(tables, pose, label, holder, focus, least, most, generator, gone)
        chosen += _whole_groups(tables, pose, gone)
        if chosen >= count:
            gone[random_below(generator, count)] = False
            chosen -= 1
        todo = np.empty(chosen, np.int32)
        k = 0
        for v in range(count):
            start[v] = pose[v]
            if gone[v]:
                start[v] = -1
                todo[k] = v
                k += 1
        rows, _ = fill_beam(
            tables, start, todo, width, noise, joint_share, False, generator, results
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
            energy, _ = energy_of(tables, results[r], empty_face)
            if energy > threshold or energy >= best or apart(tables, results[r]) > 0:
                continue
            total, rows_found = candidates(tables, results[r], hinges, new_label, hinge)
            left = loose_pieces(hinge, rows_found, total, 4, generator)
            energy += loose * left
            if energy <= threshold and energy < best:
                best = energy
                best_row = r
                best_left = left
        if best_row >= 0:
            out[:] = results[best_row]
            return attempt + 1, best, best_left
    return tries, np.inf, 0


@njit(cache=True)
def _patch(
    tables: Tables,
    pose: NDArray[np.int32],
    holder: NDArray[np.int32],
    most: int,
    generator: NDArray[np.uint64],
    out: NDArray[np.bool_],
) -> None:
    """Choose voxels around one that has no place and around a cell that is empty."""
    count = len(pose)
    edge = np.empty(2 * count, np.int32)
    size = 0
    out[:] = False
    homeless = np.flatnonzero(pose < 0)
    if len(homeless) > 0:
        edge[0] = homeless[random_below(generator, len(homeless))]
        size = 1
    empty = np.flatnonzero(holder[:, 0] < 0)
    if len(empty) > 0:
        cell = empty[random_below(generator, len(empty))]
        for f in range(6):
            other = tables.around[cell, f]
            if other >= 0 and holder[other, 0] >= 0 and random_float(generator) < 0.6:
                v = one_of(holder, other, generator)
                if not out[v]:
                    out[v] = True
                    edge[size] = v
                    size += 1
    if size == 0:
        edge[0] = random_below(generator, count)
        size = 1
    want = 2 + random_below(generator, most - 1)
    for _ in range(4 * want):
        if size >= want:
            break
        u = edge[random_below(generator, size)]
        f = random_below(generator, 6)
        v = tables.neighbour[u, f]
        if pose[u] >= 0 and random_float(generator) < 0.5:
            cell = tables.around[pose[u] // 24, f]
            v = one_of(holder, cell, generator) if cell >= 0 else -1
        if v >= 0 and not out[v] and pose[v] >= 0:
            out[v] = True
            edge[size] = v
            size += 1


@njit(cache=True)
def repair(
    tables: Tables,
    pose: NDArray[np.int32],
    tries: int,
    most: int,
    width: int,
    generator: NDArray[np.uint64],
) -> tuple[int, int]:
    """Place the voxels for which growing found no room, by moving others out of the way.

    Parameters
    ----------
    pose : (n,) int32 array
        Poses, -1 for voxels without a place; improved in place.
    tries : int
        Most removals tried.
    most : int
        Most voxels moved at a time.
    width : int
        Of the beam.
    generator : (1,) uint64 array

    Returns
    -------
    left : int
        Voxels without a place, plus the pieces (less one) into which the joints leave the rest.
    used : int
        Removals tried.
    """
    count = len(pose)
    holder = np.empty((len(tables.cells), 2), np.int32)
    holders(tables, pose, holder)
    gone = np.empty(count, np.bool_)
    results = np.empty((width, count), np.int32)
    start = np.empty(count, np.int32)
    left = apart(tables, pose)
    used = 0
    while left > 0 and used < tries:
        used += 1
        _patch(tables, pose, holder, most, generator, gone)
        _whole_groups(tables, pose, gone)
        placed = 0
        for v in range(count):
            start[v] = -1 if gone[v] else pose[v]
            if start[v] >= 0:
                placed += 1
        if placed == 0:
            continue
        todo = np.flatnonzero(start < 0).astype(np.int32)
        rows, _ = fill_beam(tables, start, todo, width, 1.0, 0.0, True, generator, results)
        best = count
        best_row = -1
        for r in range(rows):
            missing = apart(tables, results[r])
            if missing < best:
                best = missing
                best_row = r
        if best_row >= 0 and (best <= left or random_float(generator) < 0.002):
            left = best
            pose[:] = results[best_row]
            holders(tables, pose, holder)
    return left, used
