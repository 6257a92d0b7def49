"""Whether a hinge may make its next quarter turn, and which bodies stand in its way.

What a turn sweeps is read from a table (:mod:`fabfold.lattice.sweep`), and who stands there from
the occupancy grids of a scene (:mod:`fabfold.fold.scene`).
"""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.fold.mechanism import Mechanism
from fabfold.fold.scene import Scene, edge_index
from fabfold.lattice.rotations import ROTATIONS
from fabfold.lattice.sweep import SweepTable

__all__ = ["TurnBuffers", "obstacles", "turn_buffers", "world_turn"]


class TurnBuffers(NamedTuple):
    """Arrays that :func:`obstacles` writes to, made once and used again.

    Attributes
    ----------
    pivot : (3,) int64 array
        Twice a point of the turn's axis in the scene, lattice units.
    middle : (3,) int64 array
        Twice the middle of the place that is looked at, lattice units.
    pairs : (m, 2) int32 array
        Pairs (moving body, body in its way), with repetitions.
    """

    pivot: NDArray[np.int64]
    middle: NDArray[np.int64]
    pairs: NDArray[np.int32]


@njit(cache=True)
def turn_buffers(room: int) -> TurnBuffers:
    """Make buffers for :func:`obstacles`.

    Parameters
    ----------
    room : int
        Pairs that can be listed; with 0, :func:`obstacles` stops at the first one.

    Returns
    -------
    TurnBuffers
        Their content means nothing yet.
    """
    return TurnBuffers(np.empty(3, np.int64), np.empty(3, np.int64), np.empty((room, 2), np.int32))


@njit(cache=True)
def world_turn(
    mech: Mechanism, scene: Scene, k: int, way: int, pivot: NDArray[np.int64]
) -> tuple[int, int]:
    """Axis and sense of a step of a hinge where it is in the scene.

    Parameters
    ----------
    mech : Mechanism
        That of the scene.
    scene : Scene
        Posed in some state.
    k : int
        Hinge that turns.
    way : int
        1 for its next step forward, -1 for one back.
    pivot : (3,) int64 array
        Out: twice the middle of the hinge's edge in the scene, lattice units.

    Returns
    -------
    axis : int
        Lattice axis that the hinge turns about: 0, 1 or 2.
    sense : int
        1 for a turn counter-clockwise about the positive axis, -1 for one clockwise.
    """
    b = mech.up[k]
    r = scene.rotation[b]
    axis = 0
    sense = way * mech.sign[k]
    for i in range(3):
        pivot[i] = 2 * (scene.shift[b, i] + mech.reach) + (
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
def _noted(pairs: NDArray[np.int32], count: int, moving: int, still: int) -> int:
    """List a pair of bodies where there is room; returns the new count."""
    if count < len(pairs):
        pairs[count, 0] = moving
        pairs[count, 1] = still
    return count + 1


@njit(cache=True)
def _barrel_pair(
    mech: Mechanism, k: int, g: int, body: int, moving: bool, pairs: NDArray[np.int32], count: int
) -> int:
    """Note a plate and a barrel of which one moves; of the barrel's bodies, the nearer one."""
    if g == k or (k < g and g + 1 < mech.end[k]) == moving:
        return count
    if not moving:
        return _noted(pairs, count, mech.up[g], body)
    inside = g + 1 <= k + 1 < mech.end[g]
    return _noted(pairs, count, body, g + 1 if inside else mech.up[g])


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
def _inside(side: int, middle: NDArray[np.int64]) -> bool:
    """Whether a place, given by its doubled middle, lies in the grid."""
    return (
        min(middle[0], middle[1], middle[2]) >= 0
        and max(middle[0], middle[1], middle[2]) < 2 * side
    )


@njit(cache=True)
def _plate_obstacles(  # noqa: PLR0911, PLR0912, PLR0915 - one plate, met by thing after thing
    mech: Mechanism,
    scene: Scene,
    table: SweepTable,
    k: int,
    p: int,
    axis: int,
    u: int,
    v: int,
    buffers: TurnBuffers,
    count: int,
) -> int:
    """Add to `buffers.pairs` what plate `p` meets while hinge `k` turns from axis u to axis v.

    A plate that stays is seen from what moves: it turns the other way.
    """
    plates = table.plates
    pivot, middle, pairs = buffers.pivot, buffers.middle, buffers.pairs
    limit = max(1, len(pairs))
    side = 2 * mech.reach + 1
    low = k + 1
    high = mech.end[k]
    body = mech.plate[p, 0]
    moving = low <= body < high
    if not moving:
        u, v = v, u
    x = scene.plate[p, 1 + u] - pivot[u]
    y = scene.plate[p, 1 + v] - pivot[v]
    x, y, ux, uy, vx, vy = _to_first_quadrant(x, y)
    if x * x + y * y >= 4 * table.side * table.side:
        return count  # farther out than anything that moves
    middle[axis] = scene.plate[p, 1 + axis]
    if scene.plate[p, 0] != axis:
        entry = x * 2 * table.side + y
        for i in range(plates.cell_start[entry], plates.cell_start[entry + 1]):
            c = 2 * plates.cells[i, 0] + 1
            d = 2 * plates.cells[i, 1] + 1
            middle[u] = pivot[u] + c * ux + d * uy
            middle[v] = pivot[v] + c * vx + d * vy
            if not _inside(side, middle):
                continue
            owner = scene.cell_owner[
                ((middle[0] >> 1) * side + (middle[1] >> 1)) * side + (middle[2] >> 1)
            ]
            if owner != 0 and (low <= owner - 1 < high) != moving:
                count = _noted(
                    pairs, count, body if moving else owner - 1, owner - 1 if moving else body
                )
                if count >= limit:
                    return count
        for i in range(plates.post_start[entry], plates.post_start[entry + 1]):
            c, d = plates.posts[i, 0], plates.posts[i, 1]
            middle[u] = pivot[u] + c * ux + d * uy
            middle[v] = pivot[v] + c * vx + d * vy
            if not _inside(side, middle):
                continue
            g = scene.edge_owner[edge_index(side, axis, middle[0], middle[1], middle[2])] - 1
            if g >= 0:
                count = _barrel_pair(mech, k, g, body, moving, pairs, count)
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
            owner = scene.face_owner[edge_index(side, normal, middle[0], middle[1], middle[2])]
            if owner != 0 and not low <= owner - 1 < high:
                count = _noted(pairs, count, body, owner - 1)
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
        g = scene.edge_owner[edge_index(side, along, middle[0], middle[1], middle[2])] - 1
        if g >= 0:
            count = _barrel_pair(mech, k, g, body, moving, pairs, count)
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
        owner = scene.face_owner[edge_index(side, axis, middle[0], middle[1], middle[2])]
        if owner != 0 and not low <= owner - 1 < high:
            count = _noted(pairs, count, body, owner - 1)
            if count >= limit:
                return count
    return count


@njit(cache=True)
def obstacles(  # noqa: PLR0912, PLR0915 - one pass, kept whole for speed
    mech: Mechanism,
    scene: Scene,
    table: SweepTable,
    k: int,
    way: int,
    buffers: TurnBuffers,
) -> int:
    """What hinders hinge `k` in its next step.

    Parameters
    ----------
    mech : Mechanism
        That of the scene.
    scene : Scene
        Posed in the state before the step.
    table : SweepTable
        Sweeps up to the span of the mechanism, see :func:`fabfold.lattice.sweep.sweep_table`.
    k : int
        Hinge that turns.
    way : int
        1 for its next step forward, -1 for one back.
    buffers : TurnBuffers
        In and out: its `pairs` get the pairs of bodies that run into each other.

    Returns
    -------
    int
        Number of pairs; counting stops when `pairs` is full, and at one if it has no room.
    """
    pivot, middle, pairs = buffers.pivot, buffers.middle, buffers.pairs
    axis, sense = world_turn(mech, scene, k, way, pivot)
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
    limit = max(1, len(pairs))
    count = 0
    for body in range(low, high):
        for c in range(mech.first[body], mech.first[body + 1]):
            du = scene.cell[c, u] - cu
            dv = scene.cell[c, v] - cv
            base = scene.cell[c, axis] * stride[axis] + cu * su + cv * sv
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
                owner = scene.cell_owner[base + table.cells[i, 0] * sa + table.cells[i, 1] * sb]
                if owner != 0 and (owner - 1 < low or owner - 1 >= high):
                    count = _noted(pairs, count, body, owner - 1)
                    if count >= limit:
                        return count
    for e in range(len(scene.barrel)):
        g = mech.barrel[e, 0]
        if g <= k or g + 1 >= high:
            continue
        x = scene.barrel[e, 1 + u] - pivot[u]
        y = scene.barrel[e, 1 + v] - pivot[v]
        x, y, ux, uy, vx, vy = _to_first_quadrant(x, y)
        entry = x * 2 * table.side + y
        middle[axis] = scene.barrel[e, 1 + axis]
        for i in range(table.edge_start[entry], table.edge_start[entry + 1]):
            c = table.edges[i, 0]
            d = table.edges[i, 1]
            c, d = c * ux + d * uy, c * vx + d * vy
            middle[u] = pivot[u] + c
            middle[v] = pivot[v] + d
            along = axis
            if scene.barrel[e, 0] != axis:
                along = u if c % 2 != 0 else v
            other = scene.edge_owner[edge_index(side, along, middle[0], middle[1], middle[2])] - 1
            if other >= 0 and (other < k or other + 1 >= high):
                inside = other + 1 <= low < mech.end[other]
                met = other + 1 if inside else mech.up[other]
                count = _noted(pairs, count, mech.up[g], met)
                if count >= limit:
                    return count
    for p in range(len(scene.plate)):
        count = _plate_obstacles(mech, scene, table, k, p, axis, u, v, buffers, count)
        if count >= limit:
            return count
    return count
