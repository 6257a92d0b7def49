"""Which hinges can turn at all: cells swept by a turn about a lattice edge, as a cheap filter.

Two bodies that a hinge joins directly move against each other in one way only, so a hinge is
useless when the child's turn would run through its parent, whatever else moves. With a link plate
between them there are at most 16 states of the two axes, and the hinge is useless when no order of
quarter turns leads from the first to the last.
"""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.lattice.rotations import FACES
from fabfold.tree.catalogue import edge_sides

__all__ = [
    "REACH",
    "HingeTables",
    "double_blocked",
    "half_turn_table",
    "hinge_tables",
    "quarter_turn_table",
    "single_blocked",
]

#: Cells up to this far from the axis are tested; what lies beyond is left to the planner.
REACH = 12
#: Half the side of the turning cubes: a little under 1/2, since bodies stand apart by a gap.
HALF_SIDE = 0.49


def _overlap(
    moving: NDArray[np.float64], angle: float, still: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Whether the square about `moving`, turned by `angle` (radians), overlaps each of `still`."""
    # Separating axes of two unit squares, one of them turned.
    cosine, sine = np.cos(angle), np.sin(angle)
    turned = moving @ np.array([[cosine, sine], [-sine, cosine]])
    offset = still - turned
    half = HALF_SIDE * (1.0 + abs(cosine) + abs(sine))
    along = np.abs(offset).max(axis=1)
    across = np.maximum(
        np.abs(offset @ np.array([cosine, sine])), np.abs(offset @ np.array([-sine, cosine]))
    )
    return np.asarray((along < half) & (across < half))


@cache
def quarter_turn_table() -> NDArray[np.bool_]:
    """Cells swept by a cell that turns by +90 degrees about the origin of the plane.

    Returns
    -------
    (2 R, 2 R, 2 R, 2 R) bool array, R = :data:`REACH`
        ``[a, b, c, d]``: whether the unit square about ``(a - R + 0.5, b - R + 0.5)`` passes over
        the one about ``(c - R + 0.5, d - R + 0.5)``. Sampled every 2 degrees.
    """
    size = 2 * REACH
    middles = np.arange(size) - REACH + 0.5
    still = np.stack(np.meshgrid(middles, middles, indexing="ij"), axis=-1).reshape(-1, 2)
    quarter = np.zeros((size, size, size, size), dtype=bool)
    angles = np.radians(np.arange(1, 90, 2))
    for a in range(REACH, size):
        for b in range(REACH, size):
            middle = np.array([middles[a], middles[b]])
            radius = np.linalg.norm(middle)
            near = np.abs(np.linalg.norm(still, axis=1) - radius) < 1.5
            swept = np.zeros(len(still), dtype=bool)
            for angle in angles:
                swept[near] |= _overlap(middle, angle, still[near])
            quarter[a, b] = swept.reshape(size, size)
    # The other quadrants are this one turned: (x, y) -> (-y, x) in the plane.
    for _ in range(3):
        turned = quarter[:, ::-1, :, ::-1].transpose(1, 0, 3, 2)
        quarter = quarter | turned
    return np.ascontiguousarray(quarter)


@cache
def half_turn_table() -> NDArray[np.bool_]:
    """Cells swept by a cell that turns by +180 degrees about the origin of the plane.

    Returns
    -------
    (2 R, 2 R, 2 R, 2 R) bool array, R = :data:`REACH`
        Indexed as :func:`quarter_turn_table`.
    """
    quarter = quarter_turn_table()
    following = quarter[::-1].transpose(1, 0, 2, 3)
    return np.ascontiguousarray(quarter | following)


class HingeTables(NamedTuple):
    """What kernels must know of hinges on lattice edges.

    Attributes
    ----------
    faces : (6, 3) int32 array
        The face normals, :data:`fabfold.lattice.rotations.FACES`.
    sides : (6, 4) int32 array
        ``FACES`` index of each edge of each face.
    half_turn : (2 R, 2 R, 2 R, 2 R) bool array
        :func:`half_turn_table`.
    quarter_turn : (2 R, 2 R, 2 R, 2 R) bool array
        :func:`quarter_turn_table`.
    """

    faces: NDArray[np.int32]
    sides: NDArray[np.int32]
    half_turn: NDArray[np.bool_]
    quarter_turn: NDArray[np.bool_]


@cache
def hinge_tables() -> HingeTables:
    """The tables of hinges, made once.

    Returns
    -------
    HingeTables
        The same object at every call.
    """
    sides = np.array([edge_sides(face) for face in range(6)], dtype=np.int32)
    return HingeTables(np.ascontiguousarray(FACES), sides, half_turn_table(), quarter_turn_table())


@njit(cache=True)
def single_blocked(
    source: NDArray[np.int32],
    parent_cells: NDArray[np.int32],
    child_cells: NDArray[np.int32],
    at: NDArray[np.int32],
    d: NDArray[np.int32],
    n: NDArray[np.int32],
    table: NDArray[np.bool_],
) -> bool:
    """Whether the child body runs into its parent body on its turn about a single hinge.

    Parameters
    ----------
    source : (n, 3) int32 array
        Cell of each voxel in shape A.
    parent_cells, child_cells : (a,), (b,) int32 arrays
        Voxels of the two bodies, by number.
    at : (3,) int32 array
        Cell of the parent voxel that carries the hinge.
    d, n : (3,) int32 arrays
        Direction to the child voxel, and side of the hinge.
    table : (2 R, 2 R, 2 R, 2 R) bool array
        :func:`half_turn_table` or :func:`quarter_turn_table`.

    Returns
    -------
    bool
        True where the hinge cannot turn.
    """
    reach = table.shape[0] // 2
    d_axis = 0 if d[0] != 0 else (1 if d[1] != 0 else 2)
    n_axis = 0 if n[0] != 0 else (1 if n[1] != 0 else 2)
    along = 3 - d_axis - n_axis
    for i in range(len(child_cells)):
        c = child_cells[i]
        # In the plane (d, n) with the axis at the origin, the turn goes from d to n.
        a = (source[c, d_axis] - at[d_axis]) * d[d_axis] - 1 + reach
        b = (source[c, n_axis] - at[n_axis]) * n[n_axis] - 1 + reach
        if a < 0 or b < 0 or a >= 2 * reach or b >= 2 * reach:
            continue
        for k in range(len(parent_cells)):
            p = parent_cells[k]
            if source[p, along] != source[c, along]:
                continue
            x = (source[p, d_axis] - at[d_axis]) * d[d_axis] - 1 + reach
            y = (source[p, n_axis] - at[n_axis]) * n[n_axis] - 1 + reach
            if x < 0 or y < 0 or x >= 2 * reach or y >= 2 * reach:
                continue
            if table[a, b, x, y]:
                return True
    return False


@njit(cache=True)
def _turned(
    cell: NDArray[np.int32],
    at: NDArray[np.int32],
    d: NDArray[np.int32],
    n: NDArray[np.int32],
    quarters: int,
    out: NDArray[np.int32],
) -> None:
    """Turn a cell from d to n by quarters about the edge of cell `at`."""
    cosine = (1, 0, -1, 0)[quarters & 3]
    sine = (0, 1, 0, -1)[quarters & 3]
    # Twice the distances from the axis.
    along = -1
    across = -1
    for x in range(3):
        along += 2 * (cell[x] - at[x]) * d[x]
        across += 2 * (cell[x] - at[x]) * n[x]
    u = cosine * along - sine * across
    v = sine * along + cosine * across
    for x in range(3):
        out[x] = cell[x] + ((u - along) >> 1) * d[x] + ((v - across) >> 1) * n[x]


@njit(cache=True)
def _holds(source: NDArray[np.int32], cells: NDArray[np.int32], place: NDArray[np.int32]) -> bool:
    """Whether one of the voxels `cells` is at `place`."""
    for v in cells:
        if source[v, 0] == place[0] and source[v, 1] == place[1] and source[v, 2] == place[2]:
            return True
    return False


@njit(cache=True)
def double_blocked(
    source: NDArray[np.int32],
    parent_cells: NDArray[np.int32],
    child_cells: NDArray[np.int32],
    at: NDArray[np.int32],
    d: NDArray[np.int32],
    n1: NDArray[np.int32],
    q1: int,
    n2: NDArray[np.int32],
    q2: int,
    table: NDArray[np.bool_],
) -> bool:
    """Whether no order of quarter turns brings a double hinge from its first to its last state.

    Only the two bodies and the plate between them are looked at, so a hinge that passes may still
    be stuck.

    Parameters
    ----------
    source : (n, 3) int32 array
        Cell of each voxel in shape A.
    parent_cells, child_cells : (a,), (b,) int32 arrays
        Voxels of the two bodies, by number.
    at : (3,) int32 array
        Cell of the parent voxel that carries the hinge.
    d : (3,) int32 array
        Direction to the child voxel.
    n1, n2 : (3,) int32 arrays
        Sides of the parent's and of the child's axis.
    q1, q2 : int
        Their quarter turns, 1 to 3.
    table : (2 R, 2 R, 2 R, 2 R) bool array
        :func:`quarter_turn_table`.

    Returns
    -------
    bool
        True where the hinge cannot turn.
    """
    ahead = at + d
    # Cells that the plate sweeps, quarter by quarter: against the parent, against the child.
    swept1 = (ahead, ahead + n1, at + n1)
    swept2 = (at, at + n2, ahead + n2)
    for q in range(q1):
        if _holds(source, parent_cells, swept1[q]):
            return True
    for q in range(q2):
        if _holds(source, child_cells, swept2[q]):
            return True
    # The child turned by its own axis, the parent turned back by its own: seen from the link.
    parents, children = len(parent_cells), len(child_cells)
    row = np.arange((q1 + 1) * parents + (q2 + 1) * children).astype(np.int32)
    parent = row[: (q1 + 1) * parents].reshape(q1 + 1, parents)
    child = row[(q1 + 1) * parents :].reshape(q2 + 1, children)
    cells = np.empty((len(row), 3), np.int32)
    for i in range(q1 + 1):
        for v in range(parents):
            _turned(source[parent_cells[v]], at, d, n1, -i, cells[parent[i, v]])
    for j in range(q2 + 1):
        for v in range(children):
            _turned(source[child_cells[v]], at, d, n2, j, cells[child[j, v]])
    seen = np.zeros((q1 + 1, q2 + 1), np.bool_)
    seen[0, 0] = True
    stack = np.empty((16, 2), np.int32)
    stack[0] = 0
    top = 1
    while top > 0:
        top -= 1
        i, j = stack[top, 0], stack[top, 1]
        if i == q1 and j == q2:
            return False
        for move in range(4):
            a = i + (1, 0, -1, 0)[move]
            b = j + (0, 1, 0, -1)[move]
            if a < 0 or b < 0 or a > q1 or b > q2 or seen[a, b]:
                continue
            # A step back is the step forth from where it leads.
            x = min(i, a)
            y = min(j, b)
            if a != i:
                hit = single_blocked(cells, parent[x], child[j], at, d, n1, table)
            else:
                hit = single_blocked(cells, parent[i], child[y], at, d, n2, table)
            if not hit:
                seen[a, b] = True
                stack[top, 0] = a
                stack[top, 1] = b
                top += 1
    return True
