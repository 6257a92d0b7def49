"""Best-first search for a folding path on the lattice, from both shapes at once.

Two searches grow one hinge step at a time, one from A and one from B. Each wants to come close to
the best state of the other: its key is the number of steps in which the two states differ, plus a
small repulsion (the sum of 1/r over pairs of bodies, between their middle cells), so that of two
states equally far along the more open one goes first (the paper opens both shapes by such a force).
When a side has made no progress for a while the other side takes over, aiming at the best state
found; so the distance between the two best states never grows. It is the number of *levels* that
are still unresolved, and the path is found when it is 0.
"""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.fold.mechanism import Mechanism, Scene, clear_scene, pose_scene
from fabfold.fold.sweep import SweepTable
from fabfold.fold.turns import Work, obstacles, workspace, world_turn

__all__ = ["Front", "plan"]


class Front(NamedTuple):
    """The states that one side has reached.

    Attributes
    ----------
    tally : (4,) int64 array
        Nodes, heap entries, expansions, best node.
    state : (c, h) int8 array
    before : (c,) int32 array
        Node that this one came from, -1 at the start.
    move : (c, 2) int16 array
        Hinge and way (+1, -1) of the step that led here.
    force : (c,) float64 array
        Repulsion term of the key.
    slots : (s,) int32 array
        Open-addressing hash table of nodes, -1 where empty.
    heap : (c,) int32 array
        Nodes to expand, a binary heap by `key`, then by node.
    key : (c,) float64 array
    """

    tally: NDArray[np.int64]
    state: NDArray[np.int8]
    before: NDArray[np.int32]
    move: NDArray[np.int16]
    force: NDArray[np.float64]
    slots: NDArray[np.int32]
    heap: NDArray[np.int32]
    key: NDArray[np.float64]


@njit(cache=True)
def _hash(state: NDArray[np.int8]) -> np.uint64:
    value = np.uint64(14695981039346656037)
    for i in range(len(state)):
        value = (value ^ np.uint64(state[i] + 1)) * np.uint64(1099511628211)
        value ^= value >> np.uint64(29)
    return value


@njit(cache=True)
def _front(hinges: int, room: int) -> Front:
    slots = 64
    while slots < 4 * room:
        slots *= 2
    return Front(
        np.zeros(4, np.int64),
        np.zeros((room, hinges), np.int8),
        np.full(room, -1, np.int32),
        np.zeros((room, 2), np.int16),
        np.zeros(room, np.float64),
        np.full(slots, -1, np.int32),
        np.zeros(room, np.int32),
        np.zeros(room, np.float64),
    )


@njit(cache=True)
def _grown(front: Front) -> Front:
    """Copy of a front with room for twice as many nodes."""
    old = len(front.state)
    new = _front(front.state.shape[1], 2 * old)
    new.tally[:] = front.tally
    new.state[:old] = front.state
    new.before[:old] = front.before
    new.move[:old] = front.move
    new.force[:old] = front.force
    new.heap[:old] = front.heap
    new.key[:old] = front.key
    for node in range(front.tally[0]):
        new.slots[_slot(new, front.state[node])] = node
    return new


@njit(cache=True)
def _slot(front: Front, state: NDArray[np.int8]) -> int:
    """Place of a state in the hash table: where it is, or the empty place where it belongs."""
    mask = len(front.slots) - 1
    slot = np.int64(_hash(state)) & mask
    while True:
        node = front.slots[slot]
        if node < 0:
            return int(slot)
        same = True
        for i in range(len(state)):
            if front.state[node, i] != state[i]:
                same = False
                break
        if same:
            return int(slot)
        slot = (slot + 1) & mask


@njit(cache=True)
def _before(front: Front, a: int, b: int) -> bool:
    return front.key[a] < front.key[b] or (front.key[a] == front.key[b] and a < b)


@njit(cache=True)
def _sift(front: Front, place: int) -> None:
    size = front.tally[1]
    heap = front.heap
    node = heap[place]
    while True:
        child = 2 * place + 1
        if child >= size:
            break
        if child + 1 < size and _before(front, heap[child + 1], heap[child]):
            child += 1
        if not _before(front, heap[child], node):
            break
        heap[place] = heap[child]
        place = child
    heap[place] = node


@njit(cache=True)
def _push(front: Front, node: int) -> None:
    place = front.tally[1]
    front.tally[1] += 1
    heap = front.heap
    while place > 0:
        above = (place - 1) // 2
        if not _before(front, node, heap[above]):
            break
        heap[place] = heap[above]
        place = above
    heap[place] = node


@njit(cache=True)
def _pop(front: Front) -> int:
    node = front.heap[0]
    front.tally[1] -= 1
    size = front.tally[1]
    if size > 0:
        front.heap[0] = front.heap[size]
        _sift(front, 0)
    return int(node)


@njit(cache=True)
def _distance(a: NDArray[np.int8], b: NDArray[np.int8]) -> int:
    total = 0
    for i in range(len(a)):
        total += abs(int(a[i]) - int(b[i]))
    return total


@njit(cache=True)
def _retarget(front: Front, target: NDArray[np.int8]) -> None:
    """Make new keys for a new target, and find the node nearest to it."""
    best = -1
    least = 1 << 30
    for node in range(front.tally[0]):
        far = _distance(front.state[node], target)
        front.key[node] = far + front.force[node]
        if far < least:
            least = far
            best = node
    front.tally[3] = best
    for place in range(front.tally[1] // 2 - 1, -1, -1):
        _sift(front, place)


@njit(cache=True)
def _middles(mech: Mechanism) -> NDArray[np.int32]:
    """The cell of each body nearest to the middle of its cells; -1 for a body without cells."""
    bodies = len(mech.up) + 1
    out = np.full(bodies, -1, np.int32)
    for b in range(bodies):
        count = mech.first[b + 1] - mech.first[b]
        least = np.int64(1) << 62
        for v in range(mech.first[b], mech.first[b + 1]):
            far = np.int64(0)
            for i in range(3):
                total = np.int64(0)
                for w in range(mech.first[b], mech.first[b + 1]):
                    total += mech.cell[w, i]
                far += (np.int64(count) * mech.cell[v, i] - total) ** 2
            if far < least:
                least = far
                out[b] = v
    return out


@njit(cache=True)
def _force_change(
    mech: Mechanism,
    at: Scene,
    middle: NDArray[np.int32],
    inverse: NDArray[np.float64],
    k: int,
    way: int,
    work: Work,
) -> float:
    """Change of the sum of 1/r over pairs of bodies when hinge `k` makes a step."""
    pivot = work.pivot
    axis, sense = world_turn(mech, at, k, way, pivot)
    u = (axis + 1) % 3
    v = (axis + 2) % 3
    if sense < 0:
        u, v = v, u
    plus = (pivot[u] + pivot[v]) >> 1
    minus = (pivot[v] - pivot[u]) >> 1
    end = mech.end[k]
    total = 0.0
    for i in range(k + 1, end):
        c = middle[i]
        if c < 0:
            continue
        xw, xu, xv = at.world[c, axis], at.world[c, u], at.world[c, v]
        # A quarter turn: u goes to v, v to -u.
        yu = plus - xv
        yv = minus + xu
        for j in range(len(middle)):
            d = middle[j]
            if d < 0 or k < j < end:
                continue
            dw = (at.world[d, axis] - xw) ** 2
            du, dv = at.world[d, u], at.world[d, v]
            total += inverse[dw + (du - yu) ** 2 + (dv - yv) ** 2]
            total -= inverse[dw + (du - xu) ** 2 + (dv - xv) ** 2]
    return total


@njit(cache=True)
def _start(front: Front, state: NDArray[np.int8], target: NDArray[np.int8]) -> None:
    front.state[0] = state
    front.slots[_slot(front, state)] = 0
    front.tally[0] = 1
    front.key[0] = _distance(state, target)
    _push(front, 0)


@njit(cache=True)
def _trace(front: Front, node: int, out: NDArray[np.int16]) -> int:
    """Steps from the start of a front to `node`, in order; returns how many."""
    size = 0
    at = node
    while front.before[at] >= 0:
        size += 1
        at = front.before[at]
    at = node
    place = size
    while front.before[at] >= 0:
        place -= 1
        out[place] = front.move[at]
        at = front.before[at]
    return size


@njit(cache=True)
def _expand(
    mech: Mechanism,
    at: Scene,
    table: SweepTable,
    front: Front,
    other: Front,
    target: NDArray[np.int8],
    weight: float,
    middle: NDArray[np.int32],
    inverse: NDArray[np.float64],
    work: Work,
    whole: SweepTable,
    price: float,
    cuts: Work,
) -> int:
    """Expand the best node of a front; returns a node that the other front has too, or -1."""
    hinges = len(mech.up)
    node = _pop(front)
    front.tally[2] += 1
    q = front.state[node].copy()
    pose_scene(mech, at, q)
    met = -1
    for k in range(hinges):
        for way in (1, -1):
            step = q[k] + way
            if step < 0 or step > mech.steps[k]:
                continue
            q[k] = step
            slot = _slot(front, q)
            if front.slots[slot] < 0 and obstacles(mech, at, table, k, way, work) == 0:
                new = front.tally[0]
                front.tally[0] += 1
                front.slots[slot] = new
                front.state[new] = q
                front.before[new] = node
                front.move[new, 0] = k
                front.move[new, 1] = way
                front.force[new] = front.force[node]
                if weight > 0:
                    front.force[new] += weight * _force_change(
                        mech, at, middle, inverse, k, way, work
                    )
                if price > 0:
                    front.force[new] += price * obstacles(mech, at, whole, k, way, cuts)
                far = _distance(q, target)
                front.key[new] = far + front.force[new]
                _push(front, new)
                if far < _distance(front.state[front.tally[3]], target):
                    front.tally[3] = new
                if met < 0 and other.slots[_slot(other, q)] >= 0:
                    met = new
            q[k] -= way
    clear_scene(mech, at)
    return met


@njit(cache=True)
def plan(  # noqa: PLR0915 - the loop that trades sides, kept whole
    mech: Mechanism,
    at: Scene,
    table: SweepTable,
    limit: int,
    patience: int,
    weight: float,
    whole: SweepTable,
    price: float,
) -> tuple[int, int, NDArray[np.int16], NDArray[np.int8]]:
    """Search a path from A to B.

    Parameters
    ----------
    mech, at, table
        The mechanism, its empty scene, and sweeps up to its reach.
    limit : int
        Expansions allowed, both sides together.
    patience : int
        Expansions without progress after which a side gives way to the other; the search ends
        when both have given way in turn.
    weight : float
        Of the repulsion against one step.
    whole : SweepTable
        Sweeps of whole cells, where `table` has those of their cores: turns that are free by
        `table` only need carving.
    price : float
        Of a cell that has to be carved, against one step; with 0 `whole` is not looked at.

    Returns
    -------
    levels : int
        Steps by which the two best states still differ; 0 means that a path was found.
    expansions : int
    path : (m, 2) int16 array
        Hinge of the mechanism and way (+1, -1) of each step; empty unless `levels` is 0.
    apart : (h,) int8 array
        Steps of each hinge by which the two best states differ; they add up to `levels`.
    """
    hinges = len(mech.up)
    start = np.zeros(hinges, np.int8)
    finish = mech.steps.astype(np.int8)
    total = int(mech.steps.sum())
    empty = np.empty((0, 2), np.int16)
    good = pose_scene(mech, at, start)
    clear_scene(mech, at)
    good = pose_scene(mech, at, finish) and good
    clear_scene(mech, at)
    if not good:
        return max(1, total), 0, empty, finish
    if total == 0:
        return 0, 0, empty, start

    middle = _middles(mech)
    # Softened, so that bodies whose middles coincide do not count for everything.
    inverse = 1.0 / np.sqrt(0.25 + np.arange(12 * mech.reach * mech.reach + 1))
    work = workspace(0)
    cuts = workspace(32)
    mine = _front(hinges, 1024)
    other = _front(hinges, 1024)
    _start(mine, start, finish)
    _start(other, finish, start)
    forward = True
    target = finish.copy()
    levels = total
    apart = finish.copy()
    stalled = 0
    idle = 0
    used = 0
    met = -1
    while used < limit and met < 0:
        if mine.tally[1] == 0 or idle >= patience:
            stalled += 1
            if stalled == 2 and (idle >= patience or other.tally[1] == 0):
                # Both sides have tried in turn and neither came nearer.
                break
            if mine.tally[1] == 0 and other.tally[1] == 0:
                break
            target = mine.state[mine.tally[3]].copy()
            mine, other = other, mine
            forward = not forward
            _retarget(mine, target)
            far = _distance(mine.state[mine.tally[3]], target)
            if far < levels:
                levels = far
                apart = np.abs(mine.state[mine.tally[3]] - target)
                stalled = 0
            idle = 0
            continue
        while mine.tally[0] + 2 * hinges > len(mine.state):
            mine = _grown(mine)
        met = _expand(
            mech, at, table, mine, other, target, weight, middle, inverse, work,
            whole, price, cuts,
        )  # fmt: skip
        used += 1
        idle += 1
        far = _distance(mine.state[mine.tally[3]], target)
        if far < levels:
            levels = far
            apart = np.abs(mine.state[mine.tally[3]] - target)
            idle = 0
            stalled = 0
    if met < 0:
        return levels, used, empty, apart

    there = other.slots[_slot(other, mine.state[met])]
    if not forward:
        mine, other = other, mine
        met, there = there, met
    steps = np.empty((mine.tally[0] + other.tally[0], 2), np.int16)
    size = _trace(mine, met, steps)
    rest = _trace(other, there, steps[size:])
    path = steps[: size + rest].copy()
    for i in range(rest):
        path[size + i, 0] = steps[size + rest - 1 - i, 0]
        path[size + i, 1] = -steps[size + rest - 1 - i, 1]
    return 0, used, path, start
