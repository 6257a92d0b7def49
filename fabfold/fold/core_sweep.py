"""Cells that the core of a cell sweeps in a quarter turn: what carving always leaves of it.

A cell that loses its corners to carving still has its core, the concentric cube of half the side
:data:`CORE_HALF_SIDE`. Cores pass each other where whole cells clash, so a planner that looks at
cores finds the paths that carving can make free. It has to look at the sweeps of whole cells as
well, to carve as little as it can.
"""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

from functools import cache

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.lattice.sweep import SweepTable, sweep_table

__all__ = ["CORE_HALF_SIDE", "core_arcs_overlap", "core_sweep_table"]

#: Half the side of a cell's core. A core beside the axis turns past the one next to it, its
#: corner at 0.825 √2 = 1.167 and the other's near face at 1.175; and 0.65³, 27 % of a cell, stay
#: in the middle when all its edges and corners are gone.
CORE_HALF_SIDE = 0.325


@njit(cache=True)
def core_arcs_overlap(a: int, b: int, c: int, d: int, margin: float) -> bool:
    """Whether, at some radius, the arc of core (c, d) ends after the arc of core (a, b) begins.

    As :func:`fabfold.lattice.sweep.arcs_overlap`, for squares less a margin on all sides.

    Parameters
    ----------
    a, b : int
        Lower corner of the first cell's square, at least 0, lattice units from the axis.
    c, d : int
        Lower corner of the second cell's square, likewise.
    margin : float
        How far a core stays from the sides of its cell, lattice units.

    Returns
    -------
    bool
        True where the first core, turning, runs into the second.
    """
    a0, a1, b0 = a + margin, a + 1.0 - margin, b + margin
    c0, d0, c1, d1 = c + margin, d + margin, c + 1.0 - margin, d + 1.0 - margin
    b1 = b + 1.0 - margin
    low = max(a0 * a0 + b0 * b0, c0 * c0 + d0 * d0)
    high = min(a1 * a1 + b1 * b1, c1 * c1 + d1 * d1)
    if high <= low + 1e-12:
        return False
    # The begin leaves the bottom side for the right one, the end the left side for the top one,
    # and they can change places, only at these squared radii: one look between each two.
    bounds = np.array(
        [
            low,
            high,
            a1 * a1 + b0 * b0,
            c0 * c0 + d1 * d1,
            c0 * c0 + b0 * b0,
            a1 * a1 + d1 * d1,
        ]
    )
    bounds.sort()
    for i in range(len(bounds) - 1):
        square = 0.5 * (bounds[i] + bounds[i + 1])
        if square <= low or square >= high or bounds[i + 1] - bounds[i] < 1e-12:
            continue
        radius = np.sqrt(square)
        begin = np.arccos(a1 / radius) if a1 * a1 + b0 * b0 <= square else np.arcsin(b0 / radius)
        end = np.arcsin(d1 / radius) if c0 * c0 + d1 * d1 <= square else np.arccos(c0 / radius)
        if end > begin + 1e-12:
            return True
    return False


@njit(cache=True)
def _kept(
    side: int, start: NDArray[np.int32], cells: NDArray[np.int16], margin: float
) -> NDArray[np.bool_]:
    """Which entries of a table of whole cells hold for cores as well."""
    kept = np.zeros(len(cells), np.bool_)
    for a in range(side):
        for b in range(side):
            for i in range(start[a * side + b], start[a * side + b + 1]):
                c, d = cells[i, 0], cells[i, 1]
                if c >= 0:
                    kept[i] = core_arcs_overlap(a, b, c, d, margin)
                else:  # the second quadrant, turned back by 90°
                    kept[i] = core_arcs_overlap(d, -c - 1, a, b, margin)
    return kept


@cache
def core_sweep_table(reach: int, half_side: float = CORE_HALF_SIDE) -> SweepTable:
    """As :func:`fabfold.lattice.sweep.sweep_table`, for the cores of whole cells.

    Parameters
    ----------
    reach : int
        Distance from the axis up to which the table must say what is swept, lattice units.
    half_side : float
        Half the side of a core in lattice units, above 0 and at most 0.5.

    Returns
    -------
    SweepTable
        Of the same form; that of barrels and link plates does not change.

    Raises
    ------
    ValueError
        If `half_side` is no such number.
    """
    if not 0.0 < half_side <= 0.5:
        raise ValueError(f"half_side: above 0 and at most 0.5, found {half_side}")
    whole = sweep_table(reach)
    kept = _kept(whole.side, whole.start, whole.cells, 0.5 - half_side)
    before = np.concatenate([[0], np.cumsum(kept)])
    return whole._replace(
        start=before[whole.start].astype(np.int32), cells=np.ascontiguousarray(whole.cells[kept])
    )
