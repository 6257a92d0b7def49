"""Beam search that places voxels into the template (paper section 4)."""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.tree.cell_occupancy import clash, close, occupy, saved, seen_twice
from fabfold.tree.problem import Tables
from fabfold.tree.rng import mix, random_float

__all__ = ["clusters", "doubles_needed", "energy_of", "fill_beam", "pieces"]


#: Price of a double hinge while growing. A voxel can hold one only, so where they are taken freely
#: too many pieces are left that no hinge can join.
SCARCE = 0.1


@njit(cache=True)
def pieces(tables: Tables, pose: NDArray[np.int32], last: int, label: NDArray[np.int32]) -> int:
    """Label what the joint types 0 to `last` join of the placed voxels; -1 for the others.

    Returns
    -------
    int
        Number of pieces.
    """
    count = len(pose)
    stack = np.empty(count, np.int32)
    label[:] = -1
    found = 0
    for first in range(count):
        if pose[first] < 0 or label[first] >= 0:
            continue
        label[first] = found
        stack[0] = first
        top = 1
        while top > 0:
            top -= 1
            u = stack[top]
            for f in range(6):
                v = tables.neighbour[u, f]
                if v < 0 or pose[v] < 0 or label[v] >= 0:
                    continue
                for j in range(last + 1):
                    if tables.allowed[u, f, j] and tables.step[f, j, pose[u]] == pose[v]:
                        label[v] = found
                        stack[top] = v
                        top += 1
                        break
        found += 1
    return found


@njit(cache=True)
def clusters(tables: Tables, pose: NDArray[np.int32], label: NDArray[np.int32]) -> int:
    """Label the rigid clusters of the placed voxels, and return their number; see `pieces`."""
    return pieces(tables, pose, 0, label)


@njit(cache=True)
def keeps_whole(tables: Tables, pose: NDArray[np.int32], v: int, q: int) -> bool:
    """Whether voxel `v` at pose `q` stays rigid with the placed voxels it must not be cut from."""
    for f in range(6):
        if tables.stiff[v, f]:
            parent = pose[tables.neighbour[v, f]]
            if parent >= 0 and tables.step[f ^ 1, 0, parent] != q:
                return False
    return True


@njit(cache=True)
def doubles_needed(tables: Tables, pose: NDArray[np.int32]) -> int:
    """Fewest double hinges: the pieces, less one, that rigid joints and single hinges leave."""
    if tables.single + 1 >= tables.step.shape[1]:
        return 0
    return max(0, pieces(tables, pose, tables.single, np.empty(len(pose), np.int32)) - 1)


@njit(cache=True)
def energy_of(tables: Tables, pose: NDArray[np.int32], empty_face: float) -> tuple[float, int]:
    """Weighted energy of a full set of poses and its number of rigid clusters.

    Clusters that single hinges alone would leave apart cost the weight of a double hinge. A
    visible face of a cell with two voxels counts by its nearer material, see :func:`seen_twice`.

    Parameters
    ----------
    empty_face : float
        Weighted energy of one boundary face of an empty template cell.
    """
    label = np.empty(len(pose), np.int32)
    found = clusters(tables, pose, label)
    taken = np.full(len(tables.cells), -1, np.int32)
    total = tables.weight[1] * (found - 1)
    if tables.single + 1 < len(tables.weight):
        more = tables.weight[tables.single + 1] - tables.weight[1]
        total += more * doubles_needed(tables, pose)
    for v in range(len(pose)):
        if pose[v] >= 0:
            total += np.float64(tables.cost[v, pose[v]])
            w = taken[pose[v] // 24]
            if w >= 0:
                total -= seen_twice(tables, v, pose[v], w, pose[w])
            taken[pose[v] // 24] = v
    for cell in range(len(taken)):
        if taken[cell] < 0:
            for f in range(6):
                if tables.around[cell, f] < 0:
                    total += empty_face
    return total, found


@njit(cache=True)
def _survey(
    tables: Tables,
    pose: NDArray[np.int32],
    taken: NDArray[np.uint8],
    todo: NDArray[np.int32],
    priority: NDArray[np.float64],
    mark: NDArray[np.int32],
    stamp: NDArray[np.int32],
    reach: NDArray[np.int32],
    flood: bool,
    lenient: bool,
) -> int:
    """Pick the most constrained voxel that can be placed next; -1 when the state is dead.

    A state is dead when a voxel has no place left, or when the free cells that the frontier can
    reach are fewer than the voxels left that need a whole one. A lenient survey overlooks that, and
    returns -1 only when nothing can be placed.
    """
    best = -1
    best_key = 1e18
    mask = tables.mask
    whole = len(tables.stiff) > 0
    left = 0
    seeds = 0
    stamp[1] += 1
    for k in range(len(todo)):
        v = todo[k]
        if pose[v] >= 0:
            continue
        if mask[v, 0] == 255:
            left += 1
        stamp[0] += 1
        found = 0
        placed = 0
        waiting = 0
        bound = False
        for f in range(6):
            u = tables.neighbour[v, f]
            if u < 0:
                continue
            parent = pose[u]
            if parent < 0:
                waiting += 1
                continue
            placed += 1
            bound = bound or (whole and tables.stiff[v, f])
            g = f ^ 1
            for j in range(tables.step.shape[1]):
                if not tables.allowed[u, g, j]:
                    continue
                q = tables.step[g, j, parent]
                if q < 0 or mark[q] == stamp[0] or clash(taken[q // 24], mask, v, q):
                    continue
                mark[q] = stamp[0]
                if whole and not keeps_whole(tables, pose, v, q):
                    continue
                found += 1
                if not flood and found >= best_key:
                    break
                if flood and reach[q // 24] != stamp[1]:
                    reach[q // 24] = stamp[1]
                    reach[len(taken) + seeds] = q // 24
                    seeds += 1
            if not flood and found >= best_key:
                break  # another voxel has fewer places
        if placed == 0:
            continue
        if found == 0:
            if (waiting == 0 or bound) and not lenient:
                return -1
            continue
        key = found + priority[v]
        if key < best_key:
            best_key = key
            best = v
    if flood and best >= 0:
        head = 0
        while head < seeds < left:
            cell = reach[len(taken) + head]
            head += 1
            for f in range(6):
                other = tables.around[cell, f]
                if other >= 0 and taken[other] != 255 and reach[other] != stamp[1]:
                    reach[other] = stamp[1]
                    reach[len(taken) + seeds] = other
                    seeds += 1
        if seeds < left:
            return -1
    return best


@njit(cache=True)
def _merged(
    tables: Tables,
    pose: NDArray[np.int32],
    label: NDArray[np.int32],
    v: int,
    q: int,
    joined: NDArray[np.int32],
) -> int:
    """Labels of the distinct clusters that `v` at `q` would join rigidly; returns their number."""
    count = 0
    for f in range(6):
        u = tables.neighbour[v, f]
        if u < 0 or pose[u] < 0:
            continue
        g = f ^ 1
        if tables.allowed[u, g, 0] and tables.step[g, 0, pose[u]] == q:
            known = False
            for i in range(count):
                if joined[i] == label[u]:
                    known = True
            if not known:
                joined[count] = label[u]
                count += 1
    return count


@njit(cache=True)
def fill_beam(
    tables: Tables,
    start: NDArray[np.int32],
    todo: NDArray[np.int32],
    width: int,
    noise: float,
    joint_share: float,
    lenient: bool,
    generator: NDArray[np.uint64],
    out: NDArray[np.int32],
) -> tuple[int, int]:
    """Place the voxels of `todo` beside those already placed.

    The most constrained voxel goes first, decided anew for every state of the beam: the one with
    the fewest free cells beside its placed neighbours.

    Parameters
    ----------
    tables : Tables
    start : (n,) int32 array
        Pose of every voxel, -1 for those of `todo`.
    todo : (k,) int32 array
    width : int
        Most states kept.
    noise : float
        Amplitude of the random part of a state's score.
    joint_share : float
        Factor on the joint weights while growing (less than 1 grows more, smaller clusters).
    lenient : bool
        Give back the states with the most voxels placed where none is complete.
    generator : (1,) uint64 array
        Random state, advanced.
    out : (width, n) int32 array
        Filled with complete sets of poses, best score first.

    Returns
    -------
    found : int
        Number of rows of `out` that hold a result.
    expansions : int
        States expanded.
    """
    count = len(start)
    room = len(tables.cells)
    joints = tables.step.shape[1]
    doubles = joints > tables.single + 1
    whole = len(tables.stiff) > 0
    pose = np.empty((2, width, count), np.int32)
    label = np.empty((2, width, count), np.int32)
    mask = tables.mask
    taken = np.zeros((2, width, room), np.uint8)
    shared = np.zeros((2, width), np.int32)
    score = np.zeros((2, width))
    key = np.zeros((2, width), np.uint64)
    pick = np.empty((2, width), np.int32)
    mark = np.zeros(24 * room, np.int32)
    stamp = np.zeros(2, np.int32)
    reach = np.zeros(2 * room + 1, np.int32)
    joined = np.empty(6, np.int32)
    priority = np.zeros(count)
    for v in todo:
        priority[v] = 0.9 * random_float(generator)
    most = 6 * joints * width
    from_state = np.empty(most, np.int32)
    to_pose = np.empty(most, np.int32)
    value = np.empty(most)
    plain = np.empty(most)
    zobrist = np.empty(most, np.uint64)

    pose[0, 0] = start
    clusters(tables, start, label[0, 0])
    for v in range(count):
        if start[v] >= 0:
            shared[0, 0] += occupy(taken[0, 0], mask, v, start[v])
    if shared[0, 0] >= tables.shares:
        close(taken[0, 0])
    flood = len(todo) > 8 and not lenient
    pick[0, 0] = _survey(
        tables, pose[0, 0], taken[0, 0], todo, priority, mark, stamp, reach, flood, lenient
    )
    if pick[0, 0] < 0:
        out[0] = start
        return (1 if lenient else 0), 1
    states = 1
    expansions = 0
    now = 0
    for level in range(len(todo)):
        options = 0
        for b in range(states):
            v = pick[now, b]
            if v < 0:
                continue
            expansions += 1
            here = pose[now, b]
            stamp[0] += 1
            # Single hinges first: what they reach wants no double one.
            for f in range(12 if doubles else 6):
                u = tables.neighbour[v, f % 6]
                if u < 0 or here[u] < 0:
                    continue
                g = (f % 6) ^ 1
                first = 0 if f < 6 else tables.single + 1
                for j in range(first, joints if f >= 6 else tables.single + 1):
                    if not tables.allowed[u, g, j]:
                        continue
                    q = tables.step[g, j, here[u]]
                    if q < 0 or mark[q] == stamp[0]:
                        continue
                    if clash(taken[now, b, q // 24], mask, v, q):
                        continue
                    mark[q] = stamp[0]
                    if whole and not keeps_whole(tables, here, v, q):
                        continue
                    merged = 0
                    if f < 6:
                        merged = _merged(tables, here, label[now, b], v, q, joined)
                    delta = np.float64(tables.cost[v, q])
                    delta -= np.float64(tables.centre[v, q // 24])
                    delta += joint_share * tables.weight[1] * (1 - merged)
                    if f >= 6:
                        delta += SCARCE
                    if taken[now, b, q // 24] != 0:
                        delta -= saved(tables, here, v, q)
                    from_state[options] = b
                    to_pose[options] = q
                    plain[options] = score[now, b] + delta
                    value[options] = plain[options] + noise * random_float(generator)
                    zobrist[options] = key[now, b] ^ mix(
                        np.uint64(v) * np.uint64(24 * room) + np.uint64(q)
                    )
                    options += 1
        order = np.argsort(value[:options])
        nxt = 1 - now
        kept = 0
        last = level == len(todo) - 1
        tried = 0
        for place in order:
            if kept == width or tried == 4 * width:
                break
            twin = False
            for i in range(kept):
                if key[nxt, i] == zobrist[place]:
                    twin = True
                    break
            if twin:
                continue
            tried += 1
            b = from_state[place]
            v = pick[now, b]
            q = to_pose[place]
            pose[nxt, kept] = pose[now, b]
            taken[nxt, kept] = taken[now, b]
            pose[nxt, kept, v] = q
            shared[nxt, kept] = shared[now, b]
            if occupy(taken[nxt, kept], mask, v, q) != 0:
                shared[nxt, kept] += 1
                if shared[nxt, kept] == tables.shares:
                    close(taken[nxt, kept])
            elif shared[nxt, kept] == tables.shares:
                taken[nxt, kept, q // 24] = 255
            if not last:
                pick[nxt, kept] = _survey(
                    tables,
                    pose[nxt, kept],
                    taken[nxt, kept],
                    todo,
                    priority,
                    mark,
                    stamp,
                    reach,
                    flood,
                    lenient,
                )
                if pick[nxt, kept] < 0 and not lenient:
                    continue
                label[nxt, kept] = label[now, b]
                merged = _merged(tables, pose[now, b], label[now, b], v, q, joined)
                # A voxel's own index plus the number of voxels is a label nobody else has.
                label[nxt, kept, v] = joined[0] if merged > 0 else count + v
                for i in range(1, merged):
                    for w in range(count):
                        if label[nxt, kept, w] == joined[i]:
                            label[nxt, kept, w] = joined[0]
            score[nxt, kept] = plain[place]
            key[nxt, kept] = zobrist[place]
            kept += 1
        if kept == 0:
            if not lenient:
                return 0, expansions
            break
        states = kept
        now = nxt
    for b in range(states):
        out[b] = pose[now, b]
    return states, expansions
