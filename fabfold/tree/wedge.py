"""Which cells a half turn about a lattice edge sweeps, as a cheap filter on hinges.

Two bodies that a hinge joins directly move against each other in one way only, so a hinge is
useless when the child's half turn would run through its parent, whatever else moves.
"""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.lattice import FACES
from fabfold.tree.catalogue import edge_sides

__all__ = ["REACH", "HingeTables", "blocked", "half_turn_table", "hinge_tables"]

#: Cells up to this far from the axis are tested; what lies beyond is left to the planner.
REACH = 12
#: Half the side of the turning cubes: a little under 1/2, since bodies stand apart by a gap.
HALF_SIDE = 0.49


def _overlap(
    moving: NDArray[np.float64], angle: float, still: NDArray[np.float64]
) -> NDArray[np.bool_]:
    # Separating axes of two unit squares, one of them turned.
    cosine, sine = np.cos(angle), np.sin(angle)
    turned = moving @ np.array([[cosine, sine], [-sine, cosine]])
    apart = still - turned
    half = HALF_SIDE * (1.0 + abs(cosine) + abs(sine))
    along = np.abs(apart).max(axis=1)
    across = np.maximum(
        np.abs(apart @ np.array([cosine, sine])), np.abs(apart @ np.array([-sine, cosine]))
    )
    return np.asarray((along < half) & (across < half))


@cache
def half_turn_table() -> NDArray[np.bool_]:
    """Cells swept by a cell that turns by +180 degrees about the origin of the plane.

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
    following = quarter[::-1].transpose(1, 0, 2, 3)
    return np.ascontiguousarray(quarter | following)


class HingeTables(NamedTuple):
    """What kernels must know of single hinges.

    Attributes
    ----------
    faces : (6, 3) int32 array
        ``FACES``.
    sides : (6, 4) int32 array
        ``FACES`` index of each edge of each face.
    swept : bool array
        :func:`half_turn_table`.
    """

    faces: NDArray[np.int32]
    sides: NDArray[np.int32]
    swept: NDArray[np.bool_]


@cache
def hinge_tables() -> HingeTables:
    """The tables of half-turn hinges."""
    sides = np.array([edge_sides(face) for face in range(6)], dtype=np.int32)
    return HingeTables(np.ascontiguousarray(FACES), sides, half_turn_table())


@njit(cache=True)
def blocked(
    source: NDArray[np.int32],
    parent_cells: NDArray[np.int32],
    child_cells: NDArray[np.int32],
    at: NDArray[np.int32],
    d: NDArray[np.int32],
    n: NDArray[np.int32],
    table: NDArray[np.bool_],
) -> bool:
    """Whether the child body runs into its parent body on a half turn.

    Parameters
    ----------
    source : (n, 3) int32 array
    parent_cells, child_cells : (a,), (b,) int32 arrays
        Voxels of the two bodies.
    at : (3,) int32 array
        Cell of the parent voxel that carries the hinge.
    d, n : (3,) int32 arrays
        Direction to the child voxel, and side of the hinge.
    table : bool array
        :func:`half_turn_table`.
    """
    reach = table.shape[0] // 2
    d_axis = 0 if d[0] != 0 else (1 if d[1] != 0 else 2)
    n_axis = 0 if n[0] != 0 else (1 if n[1] != 0 else 2)
    along = 3 - d_axis - n_axis
    for i in range(len(child_cells)):
        c = source[child_cells[i]]
        # In the plane (d, n) with the axis at the origin, the turn goes from d to n.
        a = (c[d_axis] - at[d_axis]) * d[d_axis] - 1 + reach
        b = (c[n_axis] - at[n_axis]) * n[n_axis] - 1 + reach
        if a < 0 or b < 0 or a >= 2 * reach or b >= 2 * reach:
            continue
        for k in range(len(parent_cells)):
            p = source[parent_cells[k]]
            if p[along] != c[along]:
                continue
            x = (p[d_axis] - at[d_axis]) * d[d_axis] - 1 + reach
            y = (p[n_axis] - at[n_axis]) * n[n_axis] - 1 + reach
            if x < 0 or y < 0 or x >= 2 * reach or y >= 2 * reach:
                continue
            if table[a, b, x, y]:
                return True
    return False
