"""Beam search that places voxels into the template (paper section 4).

The beam takes a partial set of poses and gives every other voxel a pose beside a placed neighbour,
such that a joint carries one to the other. Growing from one root pose uses it, and so does putting
voxels back that a removal took out. The most constrained voxel goes first: the one with the fewest
free places, decided anew for every state.
"""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.tree.cell_occupancy import (
    close_taken_cells,
    conflicts,
    counted_twice_in_cell,
    occupy,
)
from fabfold.tree.pose_energy import label_clusters
from fabfold.tree.rng import mix, random_float
from fabfold.tree.tables import Tables

__all__ = ["fill_beam"]

#: Energy added for a double hinge while growing. A voxel can hold one only, so where they are taken
#: freely too many pieces are left that no hinge can join.
_DOUBLE_HINGE_PRICE = 0.1


@njit(cache=True)
def _keeps_rigid(tables: Tables, pose: NDArray[np.int32], v: int, q: int) -> bool:
    """Whether voxel `v` at pose `q` stays rigid with the placed voxels it must not be cut from."""
    for f in range(6):
        if tables.always_rigid[v, f]:
            parent = pose[tables.neighbour[v, f]]
            if parent >= 0 and tables.child_pose[f ^ 1, parent, 0] != q:
                return False
    return True


@njit(cache=True)
def _most_constrained(
    tables: Tables,
    pose: NDArray[np.int32],
    taken: NDArray[np.uint8],
    unplaced: NDArray[np.int32],
    priority: NDArray[np.float64],
    seen_pose: NDArray[np.int32],
    stamp: NDArray[np.int32],
    reached: NDArray[np.int32],
    flood: bool,
    allow_partial: bool,
) -> int:
    """The unplaced voxel with the fewest free places beside its placed neighbours.

    Places to which a double hinge leads count only for a voxel that has no others: they are so many
    that counting all of them takes longer than placing the voxels, and whoever is short of the
    others is to be placed first.

    A state is dead when a voxel has no place left, or when the free cells that the frontier can
    reach are fewer than the voxels left that need a whole cell.

    Parameters
    ----------
    tables : Tables
        Tables of the problem.
    pose : (n,) int32 array
        Poses of the state, -1 for none.
    taken : (m,) uint8 array
        Mask of the octants taken in each template cell.
    unplaced : (k,) int32 array
        Voxels that the beam shall place; those with a pose are passed over.
    priority : (n,) float64 array
        From 0 to 0.9 for each voxel; the smaller one wins among voxels with as many places.
    seen_pose : (24 m,) int32 array
        Last stamp at which each pose was counted; saves clearing a set for every voxel.
    stamp : (2,) int32 array
        Stamps in use for `seen_pose` and for `reached`, advanced.
    reached : (2 m + 1,) int32 array
        Last stamp at which the flood came to each cell, and after these the queue of the flood.
    flood : bool
        Whether the free cells in reach are counted.
    allow_partial : bool
        Overlook that the state is dead, as long as anything can be placed.

    Returns
    -------
    int
        Number of the voxel; -1 for a dead state, or where nothing can be placed.
    """
    best = -1
    best_key = 1e18
    octant_mask = tables.octant_mask
    has_rigid_pairs = len(tables.always_rigid) > 0
    joints = tables.child_pose.shape[2]
    doubles = joints > tables.last_single + 1
    left = 0
    seeds = 0
    stamp[1] += 1
    for k in range(len(unplaced)):
        v = unplaced[k]
        if pose[v] >= 0:
            continue
        if octant_mask[v, 0] == 255:
            left += 1
        stamp[0] += 1
        found = 0
        placed = 0
        waiting = 0
        bound = False
        for by_double in range(2 if doubles else 1):
            if by_double and (found > 0 or placed == 0):
                break
            first = tables.last_single + 1 if by_double else 0
            last = joints if by_double else tables.last_single + 1
            placed = waiting = 0
            for f in range(6):
                u = tables.neighbour[v, f]
                if u < 0:
                    continue
                parent = pose[u]
                if parent < 0:
                    waiting += 1
                    continue
                placed += 1
                bound = bound or (has_rigid_pairs and tables.always_rigid[v, f])
                g = f ^ 1
                for j in range(first, last):
                    if not tables.allowed[u, g, j]:
                        continue
                    q = tables.child_pose[g, parent, j]
                    if (
                        q < 0
                        or seen_pose[q] == stamp[0]
                        or conflicts(taken[q // 24], octant_mask, v, q)
                    ):
                        continue
                    seen_pose[q] = stamp[0]
                    if has_rigid_pairs and not _keeps_rigid(tables, pose, v, q):
                        continue
                    found += 1
                    if not flood and found >= best_key:
                        break
                    if flood and reached[q // 24] != stamp[1]:
                        reached[q // 24] = stamp[1]
                        reached[len(taken) + seeds] = q // 24
                        seeds += 1
                if not flood and found >= best_key:
                    break  # another voxel has fewer places
        if placed == 0:
            continue
        if found == 0:
            if (waiting == 0 or bound) and not allow_partial:
                return -1
            continue
        key = found + priority[v]
        if key < best_key:
            best_key = key
            best = v
    if flood and best >= 0:
        head = 0
        while head < seeds < left:
            cell = reached[len(taken) + head]
            head += 1
            for f in range(6):
                other = tables.cell_neighbour[cell, f]
                if other >= 0 and taken[other] != 255 and reached[other] != stamp[1]:
                    reached[other] = stamp[1]
                    reached[len(taken) + seeds] = other
                    seeds += 1
        if seeds < left:
            return -1
    return best


@njit(cache=True)
def _joined_clusters(
    tables: Tables,
    pose: NDArray[np.int32],
    label: NDArray[np.int32],
    v: int,
    q: int,
    joined: NDArray[np.int32],
) -> int:
    """List the rigid clusters that voxel `v` at pose `q` would join.

    Parameters
    ----------
    tables : Tables
        Tables of the problem.
    pose : (n,) int32 array
        Poses of the state, -1 for none.
    label : (n,) int32 array
        Cluster of each placed voxel.
    v, q : int
        The voxel, and the pose that it would take.
    joined : (6,) int32 array
        Filled with the labels of the distinct clusters.

    Returns
    -------
    int
        Number of distinct clusters.
    """
    count = 0
    for f in range(6):
        u = tables.neighbour[v, f]
        if u < 0 or pose[u] < 0:
            continue
        g = f ^ 1
        if tables.allowed[u, g, 0] and tables.child_pose[g, pose[u], 0] == q:
            known = False
            for i in range(count):
                if joined[i] == label[u]:
                    known = True
            if not known:
                joined[count] = label[u]
                count += 1
    return count


@njit(cache=True)
def _merge_labels(label: NDArray[np.int32], v: int, joined: NDArray[np.int32]) -> None:
    """Give voxel `v` and the clusters `joined` that it joins one label, in place."""
    count = len(label)
    # A voxel's own index plus the number of voxels is a label nobody else has.
    label[v] = joined[0] if len(joined) > 0 else count + v
    for i in range(1, len(joined)):
        for w in range(count):
            if label[w] == joined[i]:
                label[w] = joined[0]


@njit(cache=True)
def fill_beam(
    tables: Tables,
    start: NDArray[np.int32],
    unplaced: NDArray[np.int32],
    beam_width: int,
    noise: float,
    joint_factor: float,
    allow_partial: bool,
    generator: NDArray[np.uint64],
    out: NDArray[np.int32],
) -> tuple[int, int]:
    """Place the voxels of `unplaced` beside those already placed.

    Parameters
    ----------
    tables : Tables
        Tables of the problem.
    start : (n,) int32 array
        Pose of every voxel, -1 for those of `unplaced`.
    unplaced : (k,) int32 array
        Voxels to place.
    beam_width : int
        Most states kept from one voxel to the next.
    noise : float
        Amplitude of the random part of a state's score, weighted energy.
    joint_factor : float
        Factor on the joint weights while growing (less than 1 grows more, smaller clusters).
    allow_partial : bool
        Give back the states with the most voxels placed where none is complete.
    generator : (1,) uint64 array
        Random state, advanced.
    out : (beam_width, n) int32 array
        Filled with sets of poses, best score first.

    Returns
    -------
    found : int
        Number of rows of `out` that hold a result.
    expansions : int
        States expanded.
    """
    count = len(start)
    cell_count = len(tables.cells)
    joints = tables.child_pose.shape[2]
    doubles = joints > tables.last_single + 1
    has_rigid_pairs = len(tables.always_rigid) > 0
    # Two generations of states: `now` is expanded into `after`.
    pose = np.empty((2, beam_width, count), np.int32)
    label = np.empty((2, beam_width, count), np.int32)
    octant_mask = tables.octant_mask
    taken = np.zeros((2, beam_width, cell_count), np.uint8)
    shared = np.zeros((2, beam_width), np.int32)
    score = np.zeros((2, beam_width))
    key = np.zeros((2, beam_width), np.uint64)
    next_voxel = np.empty((2, beam_width), np.int32)
    seen_pose = np.zeros(24 * cell_count, np.int32)
    stamp = np.zeros(2, np.int32)
    reached = np.zeros(2 * cell_count + 1, np.int32)
    joined = np.empty(6, np.int32)
    priority = np.zeros(count)
    for v in unplaced:
        priority[v] = 0.9 * random_float(generator)
    # Options of one generation, best first: a state, and the pose that its next voxel takes. Only
    # so many are kept: to sort all that double hinges offer would take longer than to find them.
    most = 6 * beam_width
    from_state = np.empty(most, np.int32)
    to_pose = np.empty(most, np.int32)
    noisy_score = np.empty(most)
    new_score = np.empty(most)
    new_key = np.empty(most, np.uint64)

    pose[0, 0] = start
    label_clusters(tables, start, label[0, 0])
    for v in range(count):
        if start[v] >= 0:
            shared[0, 0] += occupy(taken[0, 0], octant_mask, v, start[v])
    if shared[0, 0] >= tables.max_shared:
        close_taken_cells(taken[0, 0])
    # A double hinge leads past its neighbours to cells that no free ones lead to.
    flood = len(unplaced) > 8 and not allow_partial and not doubles
    next_voxel[0, 0] = _most_constrained(
        tables,
        pose[0, 0],
        taken[0, 0],
        unplaced,
        priority,
        seen_pose,
        stamp,
        reached,
        flood,
        allow_partial,
    )
    if next_voxel[0, 0] < 0:
        out[0] = start
        return (1 if allow_partial else 0), 1
    states = 1
    expansions = 0
    now = 0
    for level in range(len(unplaced)):
        options = 0
        for b in range(states):
            v = next_voxel[now, b]
            if v < 0:
                continue
            expansions += 1
            here = pose[now, b]
            stamp[0] += 1
            # Single hinges first: a place that they reach needs no double one.
            for f in range(12 if doubles else 6):
                u = tables.neighbour[v, f % 6]
                if u < 0 or here[u] < 0:
                    continue
                g = (f % 6) ^ 1
                first = 0 if f < 6 else tables.last_single + 1
                for j in range(first, joints if f >= 6 else tables.last_single + 1):
                    if not tables.allowed[u, g, j]:
                        continue
                    q = tables.child_pose[g, here[u], j]
                    if q < 0 or seen_pose[q] == stamp[0]:
                        continue
                    if conflicts(taken[now, b, q // 24], octant_mask, v, q):
                        continue
                    seen_pose[q] = stamp[0]
                    if has_rigid_pairs and not _keeps_rigid(tables, here, v, q):
                        continue
                    merged = 0
                    if f < 6:
                        merged = _joined_clusters(tables, here, label[now, b], v, q, joined)
                    delta = np.float64(tables.cost[v, q])
                    delta -= np.float64(tables.expected_cost[v, q // 24])
                    delta += joint_factor * tables.joint_weight[1] * (1 - merged)
                    if f >= 6:
                        delta += _DOUBLE_HINGE_PRICE
                    if taken[now, b, q // 24] != 0:
                        delta -= counted_twice_in_cell(tables, here, v, q)
                    fresh = score[now, b] + delta
                    noisy = fresh + noise * random_float(generator)
                    if options == most and noisy >= noisy_score[most - 1]:
                        continue
                    place = min(options, most - 1)
                    options = min(options + 1, most)
                    while place > 0 and noisy_score[place - 1] > noisy:
                        from_state[place] = from_state[place - 1]
                        to_pose[place] = to_pose[place - 1]
                        noisy_score[place] = noisy_score[place - 1]
                        new_score[place] = new_score[place - 1]
                        new_key[place] = new_key[place - 1]
                        place -= 1
                    from_state[place] = b
                    to_pose[place] = q
                    new_score[place] = fresh
                    noisy_score[place] = noisy
                    new_key[place] = key[now, b] ^ mix(
                        np.uint64(v) * np.uint64(24 * cell_count) + np.uint64(q)
                    )
        after = 1 - now
        kept = 0
        last = level == len(unplaced) - 1
        tried = 0
        for place in range(options):
            if kept == beam_width or tried == 4 * beam_width:
                break
            # States with the same poses have the same Zobrist hash.
            duplicate = False
            for i in range(kept):
                if key[after, i] == new_key[place]:
                    duplicate = True
                    break
            if duplicate:
                continue
            tried += 1
            b = from_state[place]
            v = next_voxel[now, b]
            q = to_pose[place]
            pose[after, kept] = pose[now, b]
            taken[after, kept] = taken[now, b]
            pose[after, kept, v] = q
            shared[after, kept] = shared[now, b]
            if occupy(taken[after, kept], octant_mask, v, q) != 0:
                shared[after, kept] += 1
                if shared[after, kept] == tables.max_shared:
                    close_taken_cells(taken[after, kept])
            elif shared[after, kept] == tables.max_shared:
                taken[after, kept, q // 24] = 255
            if not last:
                next_voxel[after, kept] = _most_constrained(
                    tables,
                    pose[after, kept],
                    taken[after, kept],
                    unplaced,
                    priority,
                    seen_pose,
                    stamp,
                    reached,
                    flood,
                    allow_partial,
                )
                if next_voxel[after, kept] < 0 and not allow_partial:
                    continue
                label[after, kept] = label[now, b]
                merged = _joined_clusters(tables, pose[now, b], label[now, b], v, q, joined)
                _merge_labels(label[after, kept], v, joined[:merged])
            score[after, kept] = new_score[place]
            key[after, kept] = new_key[place]
            kept += 1
        if kept == 0:
            if not allow_partial:
                return 0, expansions
            break
        states = kept
        now = after
    for b in range(states):
        out[b] = pose[now, b]
    return states, expansions
