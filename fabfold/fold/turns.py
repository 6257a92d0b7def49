"""Whether a hinge may make its next quarter turn, and which bodies stand in its way."""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.fold.mechanism import Mechanism, Scene, clear_scene, edge_slot, pose_scene
from fabfold.lattice.rotations import ROTATIONS
from fabfold.lattice.sweep import SweepTable

__all__ = [
    "Work",
    "count_stuck",
    "movable_hinges",
    "obstacles",
    "workspace",
    "world_turn",
]


class Work(NamedTuple):
    """Room for :func:`obstacles`, made once.

    Attributes
    ----------
    pivot, middle : (3,) int64 arrays
    found : (m, 2) int32 array
        Pairs (moving body, body in its way), with repetitions.
    """

    pivot: NDArray[np.int64]
    middle: NDArray[np.int64]
    found: NDArray[np.int32]


@njit(cache=True)
def workspace(room: int) -> Work:
    """Room for `room` pairs; with none, :func:`obstacles` stops at the first one."""
    return Work(np.empty(3, np.int64), np.empty(3, np.int64), np.empty((room, 2), np.int32))


@njit(cache=True)
def world_turn(
    mech: Mechanism, at: Scene, k: int, way: int, pivot: NDArray[np.int64]
) -> tuple[int, int]:
    """World axis and sense of a step of hinge `k`; `pivot` gets twice its point."""
    b = mech.up[k]
    r = at.rotation[b]
    axis = 0
    sense = way * mech.sign[k]
    for i in range(3):
        pivot[i] = 2 * (at.shift[b, i] + mech.reach) + (
            ROTATIONS[r, i, 0] * mech.pivot[k, 0]
            + ROTATIONS[r, i, 1] * mech.pivot[k, 1]
            + ROTATIONS[r, i, 2] * mech.pivot[k, 2]
        )
        entry = ROTATIONS[r, i, mech.axis[k]]
        if entry != 0:
            axis = i
            sense *= entry
    return axis, sense


@njit(cache=True)
def _noted(found: NDArray[np.int32], count: int, moving: int, still: int) -> int:
    if count < len(found):
        found[count, 0] = moving
        found[count, 1] = still
    return count + 1


@njit(cache=True)
def _barrel_pair(
    mech: Mechanism, k: int, g: int, body: int, moving: bool, found: NDArray[np.int32], count: int
) -> int:
    """Note a plate and a barrel of which one moves; of the barrel's bodies, the nearer one."""
    if g == k or (k < g and g + 1 < mech.end[k]) == moving:
        return count
    if not moving:
        return _noted(found, count, mech.up[g], body)
    inside = g + 1 <= k + 1 < mech.end[g]
    return _noted(found, count, body, g + 1 if inside else mech.up[g])


@njit(cache=True)
def _to_first_quadrant(x: int, y: int) -> tuple[int, int, int, int, int, int]:
    """A point turned by quarters into x > 0, y >= 0, and the rows of the turn back.

    What the table says of the turned point stands at ``(c, d)``; in place that is
    ``(c * ux + d * uy, c * vx + d * vy)``.
    """
    if x > 0 and y >= 0:
        return x, y, 1, 0, 0, 1
    if y > 0:
        return y, -x, 0, -1, 1, 0
    if x < 0:
        return -x, -y, -1, 0, 0, -1
    return -y, x, 0, 1, -1, 0


@njit(cache=True)
def _inside(side: int, at: NDArray[np.int64]) -> bool:
    return min(at[0], at[1], at[2]) >= 0 and max(at[0], at[1], at[2]) < 2 * side


@njit(cache=True)
def _plate_obstacles(  # noqa: PLR0911, PLR0912, PLR0915 - one plate, met by thing after thing
    mech: Mechanism,
    at: Scene,
    table: SweepTable,
    k: int,
    p: int,
    axis: int,
    u: int,
    v: int,
    work: Work,
    count: int,
) -> int:
    """Add to `work.found` what plate `p` meets while hinge `k` turns from axis u to axis v.

    A plate that stays is seen from what moves: it turns the other way.
    """
    plates = table.plates
    pivot, middle, found = work.pivot, work.middle, work.found
    limit = max(1, len(found))
    side = 2 * mech.reach + 1
    low = k + 1
    high = mech.end[k]
    body = mech.plate[p, 0]
    moving = low <= body < high
    if not moving:
        u, v = v, u
    x = at.face[p, 1 + u] - pivot[u]
    y = at.face[p, 1 + v] - pivot[v]
    x, y, ux, uy, vx, vy = _to_first_quadrant(x, y)
    if x * x + y * y >= 4 * table.side * table.side:
        return count  # farther out than anything that moves
    middle[axis] = at.face[p, 1 + axis]
    if at.face[p, 0] != axis:
        entry = x * 2 * table.side + y
        for i in range(plates.cell_start[entry], plates.cell_start[entry + 1]):
            c = 2 * plates.cells[i, 0] + 1
            d = 2 * plates.cells[i, 1] + 1
            middle[u] = pivot[u] + c * ux + d * uy
            middle[v] = pivot[v] + c * vx + d * vy
            if not _inside(side, middle):
                continue
            owner = at.grid[((middle[0] >> 1) * side + (middle[1] >> 1)) * side + (middle[2] >> 1)]
            if owner != 0 and (low <= owner - 1 < high) != moving:
                count = _noted(
                    found, count, body if moving else owner - 1, owner - 1 if moving else body
                )
                if count >= limit:
                    return count
        for i in range(plates.post_start[entry], plates.post_start[entry + 1]):
            c, d = plates.posts[i, 0], plates.posts[i, 1]
            middle[u] = pivot[u] + c * ux + d * uy
            middle[v] = pivot[v] + c * vx + d * vy
            if not _inside(side, middle):
                continue
            g = at.edges[edge_slot(side, axis, middle[0], middle[1], middle[2])] - 1
            if g >= 0:
                count = _barrel_pair(mech, k, g, body, moving, found, count)
                if count >= limit:
                    return count
        if not moving:
            return count
        for i in range(plates.plate_start[entry], plates.plate_start[entry + 1]):
            c, d = plates.plates[i, 0], plates.plates[i, 1]
            c, d = c * ux + d * uy, c * vx + d * vy
            middle[u] = pivot[u] + c
            middle[v] = pivot[v] + d
            if not _inside(side, middle):
                continue
            normal = v if c % 2 != 0 else u
            owner = at.faces[edge_slot(side, normal, middle[0], middle[1], middle[2])]
            if owner != 0 and not low <= owner - 1 < high:
                count = _noted(found, count, body, owner - 1)
                if count >= limit:
                    return count
        return count
    entry = (x >> 1) * table.side + (y >> 1)
    for i in range(plates.edge_start[entry], plates.edge_start[entry + 1]):
        c, d = plates.edges[i, 0], plates.edges[i, 1]
        c, d = c * ux + d * uy, c * vx + d * vy
        middle[u] = pivot[u] + c
        middle[v] = pivot[v] + d
        if not _inside(side, middle):
            continue
        along = u if c % 2 != 0 else v
        g = at.edges[edge_slot(side, along, middle[0], middle[1], middle[2])] - 1
        if g >= 0:
            count = _barrel_pair(mech, k, g, body, moving, found, count)
            if count >= limit:
                return count
    if not moving:
        return count
    for i in range(plates.sheet_start[entry], plates.sheet_start[entry + 1]):
        c = 2 * plates.sheets[i, 0] + 1
        d = 2 * plates.sheets[i, 1] + 1
        middle[u] = pivot[u] + c * ux + d * uy
        middle[v] = pivot[v] + c * vx + d * vy
        if not _inside(side, middle):
            continue
        owner = at.faces[edge_slot(side, axis, middle[0], middle[1], middle[2])]
        if owner != 0 and not low <= owner - 1 < high:
            count = _noted(found, count, body, owner - 1)
            if count >= limit:
                return count
    return count


@njit(cache=True)
def obstacles(  # noqa: PLR0912, PLR0915 - one pass, kept whole for speed
    mech: Mechanism,
    at: Scene,
    table: SweepTable,
    k: int,
    way: int,
    work: Work,
) -> int:
    """What hinders hinge `k` in its next step forward (`way` 1) or back (-1).

    Parameters
    ----------
    mech, at
        The mechanism and its scene, posed.
    table
        Sweeps up to the reach of the mechanism, see :func:`fabfold.lattice.sweep.sweep_table`.
    work
        Its `found` gets the pairs.

    Returns
    -------
    int
        Number of pairs; counting stops when `found` is full, and at one if it has no room.
    """
    pivot, middle, found = work.pivot, work.middle, work.found
    axis, sense = world_turn(mech, at, k, way, pivot)
    side = 2 * mech.reach + 1
    stride = (side * side, side, 1)
    u = (axis + 1) % 3
    v = (axis + 2) % 3
    if sense < 0:  # seen in a mirror, a clockwise turn is a counter-clockwise one
        u, v = v, u
    su = stride[u]
    sv = stride[v]
    cu = (pivot[u] + 1) >> 1
    cv = (pivot[v] + 1) >> 1
    low = k + 1
    high = mech.end[k]
    limit = max(1, len(found))
    count = 0
    for body in range(low, high):
        for c in range(mech.first[body], mech.first[body + 1]):
            du = at.world[c, u] - cu
            dv = at.world[c, v] - cv
            base = at.world[c, axis] * stride[axis] + cu * su + cv * sv
            # Turn the cell's quadrant into the first one, and what it sweeps back again.
            if du >= 0:
                if dv >= 0:
                    a, b, sa, sb = du, dv, su, sv
                else:
                    a, b, sa, sb = -dv - 1, du, -sv, su
                    base -= sv
            elif dv >= 0:
                a, b, sa, sb = dv, -du - 1, sv, -su
                base -= su
            else:
                a, b, sa, sb = -du - 1, -dv - 1, -su, -sv
                base -= su + sv
            entry = a * table.side + b
            for i in range(table.start[entry], table.start[entry + 1]):
                owner = at.grid[base + table.cells[i, 0] * sa + table.cells[i, 1] * sb]
                if owner != 0 and (owner - 1 < low or owner - 1 >= high):
                    count = _noted(found, count, body, owner - 1)
                    if count >= limit:
                        return count
    for e in range(len(at.edge)):
        g = mech.barrel[e, 0]
        if g <= k or g + 1 >= high:
            continue
        x = at.edge[e, 1 + u] - pivot[u]
        y = at.edge[e, 1 + v] - pivot[v]
        x, y, ux, uy, vx, vy = _to_first_quadrant(x, y)
        entry = x * 2 * table.side + y
        middle[axis] = at.edge[e, 1 + axis]
        for i in range(table.edge_start[entry], table.edge_start[entry + 1]):
            c = table.edges[i, 0]
            d = table.edges[i, 1]
            c, d = c * ux + d * uy, c * vx + d * vy
            middle[u] = pivot[u] + c
            middle[v] = pivot[v] + d
            along = axis
            if at.edge[e, 0] != axis:
                along = u if c % 2 != 0 else v
            other = at.edges[edge_slot(side, along, middle[0], middle[1], middle[2])] - 1
            if other >= 0 and (other < k or other + 1 >= high):
                inside = other + 1 <= low < mech.end[other]
                met = other + 1 if inside else mech.up[other]
                count = _noted(found, count, mech.up[g], met)
                if count >= limit:
                    return count
    for p in range(len(at.face)):
        count = _plate_obstacles(mech, at, table, k, p, axis, u, v, work, count)
        if count >= limit:
            return count
    return count


@njit(cache=True)
def movable_hinges(  # noqa: PLR0912 - one pass
    mech: Mechanism, at: Scene, table: SweepTable, q: NDArray[np.int8], way: int
) -> NDArray[np.bool_]:
    """Closure test: hinges that something may set free, starting from state `q`.

    A hinge counts as movable when every pair of bodies that blocks its first turn has an already
    movable hinge on its path in the tree; repeated until nothing changes. A hinge that stays
    behind is hopeless: what blocks it never moves against it. The converse does not hold.

    Parameters
    ----------
    q : (h,) int8 array
        Lattice state to leave.
    way : int
        1: every hinge wants to step forward, -1: back.

    Returns
    -------
    (h,) bool array
        False for hinges that nothing can ever set free; for all of them if the state itself is
        not valid.
    """
    hinges = len(mech.up)
    words = (hinges + 63) // 64
    good = pose_scene(mech, at, q)
    if not good:
        clear_scene(mech, at)
        return np.zeros(hinges, np.bool_)
    path = np.zeros((hinges + 1, words), np.uint64)
    one = np.uint64(1)
    for k in range(hinges):
        path[k + 1] = path[mech.up[k]]
        path[k + 1, k // 64] |= one << np.uint64(k % 64)
    work = workspace(1024)
    masks = np.empty((256, words), np.uint64)
    start = np.zeros(hinges + 1, np.int32)
    seen = np.zeros((hinges + 1, hinges + 1), np.int32)
    used = 0
    for k in range(hinges):
        count = obstacles(mech, at, table, k, way, work) if mech.steps[k] > 0 else 0
        while count == len(work.found):
            work = workspace(4 * len(work.found))
            count = obstacles(mech, at, table, k, way, work)
        for i in range(count):
            a = work.found[i, 0]
            b = work.found[i, 1]
            if seen[a, b] == k + 1:
                continue
            seen[a, b] = k + 1
            if used == len(masks):
                wider = np.empty((2 * len(masks), words), np.uint64)
                wider[:used] = masks
                masks = wider
            for w in range(words):
                masks[used, w] = path[a, w] ^ path[b, w]
            used += 1
        start[k + 1] = used
    clear_scene(mech, at)

    movable = np.zeros(words, np.uint64)
    loose = np.zeros(hinges, np.bool_)
    changed = True
    while changed:
        changed = False
        for k in range(hinges):
            if loose[k]:
                continue
            free = True
            for i in range(start[k], start[k + 1]):
                hit = False
                for w in range(words):
                    if masks[i, w] & movable[w] != 0:
                        hit = True
                        break
                if not hit:
                    free = False
                    break
            if free:
                loose[k] = True
                movable[k // 64] |= one << np.uint64(k % 64)
                changed = True
    return loose


@njit(cache=True)
def count_stuck(
    mech: Mechanism, at: Scene, table: SweepTable, q: NDArray[np.int8], way: int
) -> int:
    """Number of hinges that :func:`movable_hinges` finds stuck."""
    return len(mech.up) - int(np.sum(movable_hinges(mech, at, table, q, way)))
