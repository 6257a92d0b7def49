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
from fabfold.fold.open_list import (
    Front,
    begin,
    distance,
    grown,
    joined,
    new_front,
    pop,
    push,
    retarget,
    slot_of,
)
from fabfold.fold.turns import Work, obstacles, workspace, world_turn
from fabfold.lattice.sweep import SweepTable

__all__ = ["plan"]


class Terms(NamedTuple):
    """What a state's key counts beside its distance from the target, with room to work it out.

    Attributes
    ----------
    repulsion : float
        Weight of the sum of 1/r over pairs of bodies.
    middle : (b,) int32 array
        Cell that stands for each body in that sum, -1 for a body without cells.
    inverse : float64 array
        1/r by r².
    price : float
        Of a pair of whole cells that a turn drives into each other; with 0 nobody looks.
    whole : SweepTable
        Sweeps of whole cells, where the planner's own table has those of their cores.
    cuts, work : Work
    """

    repulsion: float
    middle: NDArray[np.int32]
    inverse: NDArray[np.float64]
    price: float
    whole: SweepTable
    cuts: Work
    work: Work


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
def _force_change(mech: Mechanism, at: Scene, terms: Terms, k: int, way: int) -> float:
    """Change of the sum of 1/r over pairs of bodies when hinge `k` makes a step."""
    middle, inverse = terms.middle, terms.inverse
    pivot = terms.work.pivot
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
def _reach(
    mech: Mechanism,
    at: Scene,
    terms: Terms,
    front: Front,
    node: int,
    k: int,
    way: int,
    q: NDArray[np.int8],
    slot: int,
    target: NDArray[np.int8],
) -> int:
    """Add the state `q` that a step from `node` leads to; the scene still stands at `node`."""
    new = front.tally[0]
    front.tally[0] += 1
    front.slots[slot] = new
    front.state[new] = q
    front.before[new] = node
    front.move[new, 0] = k
    front.move[new, 1] = way
    front.force[new] = front.force[node]
    if terms.repulsion > 0:
        front.force[new] += terms.repulsion * _force_change(mech, at, terms, k, way)
    if terms.price > 0:
        front.force[new] += terms.price * obstacles(mech, at, terms.whole, k, way, terms.cuts)
    far = distance(q, target)
    front.key[new] = far + front.force[new]
    push(front, 2 * new)
    if far < distance(front.state[front.tally[3]], target):
        front.tally[3] = new
    return int(new)


@njit(cache=True)
def _expand(
    mech: Mechanism,
    at: Scene,
    table: SweepTable,
    terms: Terms,
    front: Front,
    other: Front,
    target: NDArray[np.int8],
) -> int:
    """Expand the best entry of a front; returns a node that the other front has too, or -1."""
    entry = pop(front)
    node = entry >> 1
    others = entry & 1
    front.tally[2] += 1
    q = front.state[node].copy()
    pose_scene(mech, at, q)
    met = -1
    for k in range(len(mech.up)):
        for way in (1, -1):
            step = q[k] + way
            nearer = way * (target[k] - q[k]) > 0
            if step < 0 or step > mech.steps[k] or nearer == (others > 0):
                continue
            q[k] = step
            slot = slot_of(front, q)
            if front.slots[slot] < 0 and obstacles(mech, at, table, k, way, terms.work) == 0:
                new = _reach(mech, at, terms, front, node, k, way, q, slot, target)
                if met < 0 and other.slots[slot_of(other, q)] >= 0:
                    met = new
            q[k] -= way
    clear_scene(mech, at)
    if others == 0:
        push(front, entry + 1)
    return met


@njit(cache=True)
def _steps_of(mech: Mechanism, guide: NDArray[np.int16], way: int) -> NDArray[np.int16]:
    """The guide's steps as one side makes them, after those that the guide leaves out.

    What is new goes best at once: put last, it is mostly locked in by then.
    """
    missing = mech.steps.copy()
    for i in range(len(guide)):
        missing[guide[i, 0]] -= guide[i, 1]
    more = 0
    for k in range(len(missing)):
        more += max(0, missing[k])
    known = len(guide)
    out = np.empty((known + more, 2), np.int16)
    for i in range(known):
        out[more + i, 0] = guide[i, 0] if way > 0 else guide[known - 1 - i, 0]
        out[more + i, 1] = guide[i, 1] if way > 0 else -guide[known - 1 - i, 1]
    at = 0
    for k in range(len(missing)):
        for _ in range(max(0, missing[k])):
            out[at, 0] = k
            out[at, 1] = way
            at += 1
    return out


@njit(cache=True)
def _lead(
    mech: Mechanism,
    at: Scene,
    table: SweepTable,
    terms: Terms,
    front: Front,
    other: Front,
    target: NDArray[np.int8],
    steps: NDArray[np.int16],
) -> tuple[Front, int]:
    """Make a side's first states by following steps in order, each as soon as it is free.

    Returns
    -------
    front : Front
        The same, or its copy with more room.
    met : int
        A node that the other front has too, or -1.
    """
    done = np.zeros(len(steps), np.bool_)
    q = front.state[0].copy()
    node = 0
    i = 0
    pose_scene(mech, at, q)
    while i < len(steps):
        k = int(steps[i, 0])
        way = int(steps[i, 1])
        step = q[k] + way
        if (
            done[i]
            or step < 0
            or step > mech.steps[k]
            or obstacles(mech, at, table, k, way, terms.work) > 0
        ):
            i += 1
            continue
        done[i] = True
        i = 0
        q[k] = step
        if front.tally[0] == len(front.state):
            front = grown(front)
        slot = slot_of(front, q)
        if front.slots[slot] >= 0:
            node = int(front.slots[slot])
        else:
            node = _reach(mech, at, terms, front, node, k, way, q, slot, target)
        clear_scene(mech, at)
        if other.slots[slot_of(other, q)] >= 0:
            return front, node
        pose_scene(mech, at, q)
    clear_scene(mech, at)
    return front, -1


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
    guide: NDArray[np.int16],
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
    guide : (g, 2) int16 array
        Hinge and way of steps from A to B, tried first: in this order, each as soon as it is
        free, and backwards from B. Mostly the path of a similar mechanism; may be empty.

    Returns
    -------
    levels : int
        Steps by which the two best states still differ; 0 means that a path was found.
    expansions : int
    path : (m, 2) int16 array
        Hinge of the mechanism and way (+1, -1) of each step from A. Unless `levels` is 0, it
        leads to the best state of one side, and goes on from that of the other side to B.
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

    # Softened, so that bodies whose middles coincide do not count for everything.
    inverse = 1.0 / np.sqrt(0.25 + np.arange(12 * mech.reach * mech.reach + 1))
    terms = Terms(weight, _middles(mech), inverse, price, whole, workspace(32), workspace(0))
    mine = new_front(hinges, 1024)
    other = new_front(hinges, 1024)
    begin(mine, start, finish)
    begin(other, finish, start)
    forward = True
    used = 0
    met = -1
    if len(guide) > 0:
        steps = _steps_of(mech, guide, -1)
        other, _ = _lead(mech, at, table, terms, other, mine, start, steps)
        steps = _steps_of(mech, guide, 1)
        mine, met = _lead(mech, at, table, terms, mine, other, finish, steps)
    target = other.state[other.tally[3]].copy()
    retarget(mine, target)
    levels = distance(mine.state[mine.tally[3]], target)
    apart = np.abs(mine.state[mine.tally[3]] - target)
    stalled = 0
    idle = 0
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
            retarget(mine, target)
            far = distance(mine.state[mine.tally[3]], target)
            if far < levels:
                levels = far
                apart = np.abs(mine.state[mine.tally[3]] - target)
                stalled = 0
            idle = 0
            continue
        while mine.tally[0] + 2 * hinges > len(mine.state):
            mine = grown(mine)
        met = _expand(mech, at, table, terms, mine, other, target)
        used += 1
        idle += 1
        far = distance(mine.state[mine.tally[3]], target)
        if far < levels:
            levels = far
            apart = np.abs(mine.state[mine.tally[3]] - target)
            idle = 0
            stalled = 0
    if met < 0:
        path = joined(mine, mine.tally[3], other, other.tally[3], forward)
        return max(1, levels), used, path, apart
    there = other.slots[slot_of(other, mine.state[met])]
    path = joined(mine, met, other, there, forward)
    return 0, used, path, start
