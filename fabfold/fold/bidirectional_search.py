"""Bidirectional best-first search for a folding path on the lattice, from A and from B at once.

Two searches grow one hinge step at a time, one from A and one from B. Each wants to come close to
the best state of the other: its key is the number of steps in which the two states differ, plus a
small repulsion (the sum of 1/r over pairs of bodies, between their middle cells). So of two states
equally far along the more open one goes first (section 5 of the paper opens both shapes by such a
force). When a side has made no progress for a while, the other side takes over and aims at the best
state found, so the distance of the two best states never grows. These are the steps that *remain*;
the path is found when none does.
"""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.fold.mechanism import Mechanism
from fabfold.fold.open_list import (
    BEST,
    EXPANDED,
    NODES,
    QUEUED,
    OpenList,
    enlarged,
    hash_slot,
    insert_start,
    join_paths,
    new_open_list,
    pop,
    push,
    set_target,
    step_distance,
)
from fabfold.fold.scene import Scene, clear_scene, pose_scene
from fabfold.fold.turn_obstacles import TurnBuffers, obstacles, turn_buffers, world_turn
from fabfold.lattice.sweep import SweepTable

__all__ = ["bidirectional_search"]


class CostTerms(NamedTuple):
    """What the key of a state counts beside its distance from the target.

    Attributes
    ----------
    repulsion : float
        Weight of the sum of 1/r over pairs of bodies, in steps.
    middle : (b,) int32 array
        Cell that stands for each body in that sum, -1 for a body without cells.
    inverse : float64 array
        1/r for every squared distance in lattice units, an integer.
    price : float
        Steps that a pair of whole cells costs which a turn drives into each other; with 0 nobody
        looks.
    whole : SweepTable
        Sweeps of whole cells, where the search's own table has those of their cores.
    clashing : TurnBuffers
        Room to list the pairs of whole cells that clash.
    blocked : TurnBuffers
        Without room, to ask only whether a turn is blocked.
    """

    repulsion: float
    middle: NDArray[np.int32]
    inverse: NDArray[np.float64]
    price: float
    whole: SweepTable
    clashing: TurnBuffers
    blocked: TurnBuffers


@njit(cache=True)
def _middle_cells(mech: Mechanism) -> NDArray[np.int32]:
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
def _repulsion_change(mech: Mechanism, scene: Scene, terms: CostTerms, k: int, way: int) -> float:
    """Change of the sum of 1/r over pairs of bodies when hinge `k` makes a step."""
    middle, inverse = terms.middle, terms.inverse
    pivot = terms.blocked.pivot
    axis, sense = world_turn(mech, scene, k, way, pivot)
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
        xw, xu, xv = scene.cell[c, axis], scene.cell[c, u], scene.cell[c, v]
        # A quarter turn: u goes to v, v to -u.
        yu = plus - xv
        yv = minus + xu
        for j in range(len(middle)):
            d = middle[j]
            if d < 0 or k < j < end:
                continue
            dw = (scene.cell[d, axis] - xw) ** 2
            du, dv = scene.cell[d, u], scene.cell[d, v]
            total += inverse[dw + (du - yu) ** 2 + (dv - yv) ** 2]
            total -= inverse[dw + (du - xu) ** 2 + (dv - xv) ** 2]
    return total


@njit(cache=True)
def _add_state(
    mech: Mechanism,
    scene: Scene,
    terms: CostTerms,
    open_list: OpenList,
    node: int,
    k: int,
    way: int,
    q: NDArray[np.int8],
    slot: int,
    target: NDArray[np.int8],
) -> int:
    """Add the state `q` that a step from `node` leads to; the scene still shows `node`."""
    new = open_list.counts[NODES]
    open_list.counts[NODES] += 1
    open_list.slots[slot] = new
    open_list.state[new] = q
    open_list.parent[new] = node
    open_list.move[new, 0] = k
    open_list.move[new, 1] = way
    open_list.penalty[new] = open_list.penalty[node]
    if terms.repulsion > 0:
        open_list.penalty[new] += terms.repulsion * _repulsion_change(mech, scene, terms, k, way)
    if terms.price > 0:
        open_list.penalty[new] += terms.price * obstacles(
            mech, scene, terms.whole, k, way, terms.clashing
        )
    far = step_distance(q, target)
    open_list.key[new] = far + open_list.penalty[new]
    push(open_list, 2 * new)
    if far < step_distance(open_list.state[open_list.counts[BEST]], target):
        open_list.counts[BEST] = new
    return int(new)


@njit(cache=True)
def _expand(
    mech: Mechanism,
    scene: Scene,
    table: SweepTable,
    terms: CostTerms,
    open_list: OpenList,
    other: OpenList,
    target: NDArray[np.int8],
) -> int:
    """Expand the best entry of one side; returns a node that the other side has too, or -1."""
    entry = pop(open_list)
    node = entry >> 1
    others = entry & 1
    open_list.counts[EXPANDED] += 1
    q = open_list.state[node].copy()
    pose_scene(mech, scene, q)
    met = -1
    for k in range(len(mech.up)):
        for way in (1, -1):
            step = q[k] + way
            nearer = way * (target[k] - q[k]) > 0
            if step < 0 or step > mech.steps[k] or nearer == (others > 0):
                continue
            q[k] = step
            slot = hash_slot(open_list, q)
            if (
                open_list.slots[slot] < 0
                and obstacles(mech, scene, table, k, way, terms.blocked) == 0
            ):
                new = _add_state(mech, scene, terms, open_list, node, k, way, q, slot, target)
                if met < 0 and other.slots[hash_slot(other, q)] >= 0:
                    met = new
            q[k] -= way
    clear_scene(mech, scene)
    if others == 0:
        push(open_list, entry + 1)
    return met


@njit(cache=True)
def _guide_steps(mech: Mechanism, guide: NDArray[np.int16], way: int) -> NDArray[np.int16]:
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
    place = 0
    for k in range(len(missing)):
        for _ in range(max(0, missing[k])):
            out[place, 0] = k
            out[place, 1] = way
            place += 1
    return out


@njit(cache=True)
def _follow_guide(
    mech: Mechanism,
    scene: Scene,
    table: SweepTable,
    terms: CostTerms,
    open_list: OpenList,
    other: OpenList,
    target: NDArray[np.int8],
    steps: NDArray[np.int16],
) -> tuple[OpenList, int]:
    """Make a side's first states by following steps in order, each as soon as it is free.

    Returns
    -------
    open_list : OpenList
        The same, or its copy with more room.
    met : int
        Node that the other side has too, or -1.
    """
    done = np.zeros(len(steps), np.bool_)
    q = open_list.state[0].copy()
    node = 0
    i = 0
    pose_scene(mech, scene, q)
    while i < len(steps):
        k = int(steps[i, 0])
        way = int(steps[i, 1])
        step = q[k] + way
        if (
            done[i]
            or step < 0
            or step > mech.steps[k]
            or obstacles(mech, scene, table, k, way, terms.blocked) > 0
        ):
            i += 1
            continue
        done[i] = True
        i = 0
        q[k] = step
        if open_list.counts[NODES] == len(open_list.state):
            open_list = enlarged(open_list)
        slot = hash_slot(open_list, q)
        if open_list.slots[slot] >= 0:
            node = int(open_list.slots[slot])
        else:
            node = _add_state(mech, scene, terms, open_list, node, k, way, q, slot, target)
        clear_scene(mech, scene)
        if other.slots[hash_slot(other, q)] >= 0:
            return open_list, node
        pose_scene(mech, scene, q)
    clear_scene(mech, scene)
    return open_list, -1


@njit(cache=True)
def bidirectional_search(  # noqa: PLR0915 - the loop that trades sides, kept whole
    mech: Mechanism,
    scene: Scene,
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
    mech : Mechanism
        What is to fold.
    scene : Scene
        Its scene, empty.
    table : SweepTable
        Sweeps up to the span of the mechanism: what must be free.
    limit : int
        Expansions allowed, both sides together.
    patience : int
        Expansions without progress after which a side gives way to the other; the search ends
        when both have given way in turn.
    weight : float
        Weight of the repulsion against one step.
    whole : SweepTable
        Sweeps of whole cells, where `table` has those of their cores: turns that are free by
        `table` only need carving.
    price : float
        Steps that a pair of whole cells costs which has to be carved; with 0 `whole` is not
        looked at.
    guide : (g, 2) int16 array
        Hinge and way of steps from A to B, tried first: in this order, each as soon as it is
        free, and backwards from B. Mostly the path of a similar mechanism; may be empty.

    Returns
    -------
    remaining : int
        Steps by which the two best states still differ; 0 means that a path was found.
    expansions : int
        States expanded, both sides together.
    path : (m, 2) int16 array
        Hinge of the mechanism and way (+1, -1) of each step from A. Unless `remaining` is 0, it
        leads to the best state of one side, and goes on from that of the other side to B.
    apart : (h,) int8 array
        Steps of each hinge by which the two best states differ; they add up to `remaining`.
    """
    hinges = len(mech.up)
    start = np.zeros(hinges, np.int8)
    finish = mech.steps.astype(np.int8)
    total = int(mech.steps.sum())
    empty = np.empty((0, 2), np.int16)
    good = pose_scene(mech, scene, start)
    clear_scene(mech, scene)
    good = pose_scene(mech, scene, finish) and good
    clear_scene(mech, scene)
    if not good:
        return max(1, total), 0, empty, finish
    if total == 0:
        return 0, 0, empty, start

    # Softened, so that bodies whose middles coincide do not count for everything.
    inverse = 1.0 / np.sqrt(0.25 + np.arange(12 * mech.reach * mech.reach + 1))
    terms = CostTerms(
        weight, _middle_cells(mech), inverse, price, whole, turn_buffers(32), turn_buffers(0)
    )
    mine = new_open_list(hinges, 1024)
    other = new_open_list(hinges, 1024)
    insert_start(mine, start, finish)
    insert_start(other, finish, start)
    forward = True
    used = 0
    met = -1
    if len(guide) > 0:
        steps = _guide_steps(mech, guide, -1)
        other, _ = _follow_guide(mech, scene, table, terms, other, mine, start, steps)
        steps = _guide_steps(mech, guide, 1)
        mine, met = _follow_guide(mech, scene, table, terms, mine, other, finish, steps)
    target = other.state[other.counts[BEST]].copy()
    set_target(mine, target)
    remaining = step_distance(mine.state[mine.counts[BEST]], target)
    apart = np.abs(mine.state[mine.counts[BEST]] - target)
    stalled = 0
    idle = 0
    while used < limit and met < 0:
        if mine.counts[QUEUED] == 0 or idle >= patience:
            stalled += 1
            if stalled == 2 and (idle >= patience or other.counts[QUEUED] == 0):
                # Both sides have tried in turn and neither came nearer.
                break
            if mine.counts[QUEUED] == 0 and other.counts[QUEUED] == 0:
                break
            target = mine.state[mine.counts[BEST]].copy()
            mine, other = other, mine
            forward = not forward
            set_target(mine, target)
            far = step_distance(mine.state[mine.counts[BEST]], target)
            if far < remaining:
                remaining = far
                apart = np.abs(mine.state[mine.counts[BEST]] - target)
                stalled = 0
            idle = 0
            continue
        while mine.counts[NODES] + 2 * hinges > len(mine.state):
            mine = enlarged(mine)
        met = _expand(mech, scene, table, terms, mine, other, target)
        used += 1
        idle += 1
        far = step_distance(mine.state[mine.counts[BEST]], target)
        if far < remaining:
            remaining = far
            apart = np.abs(mine.state[mine.counts[BEST]] - target)
            idle = 0
            stalled = 0
    if met < 0:
        path = join_paths(mine, mine.counts[BEST], other, other.counts[BEST], forward)
        return max(1, remaining), used, path, apart
    there = other.slots[hash_slot(other, mine.state[met])]
    path = join_paths(mine, met, other, there, forward)
    return 0, used, path, start
