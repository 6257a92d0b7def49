"""Cells that a unit cube sweeps while it turns 90° about an edge of the lattice.

A cube that turns about a lattice edge keeps its layer along the axis, so the question is a plane
one: which unit squares does a unit square sweep (open interiors) while it turns a quarter about
a lattice point? Take the point as origin and let square ``(a, b)`` be ``[a, a + 1] x [b, b + 1]``.

Every square lies in one quadrant, and a circle about the origin meets it in one arc. A square that
starts in the first quadrant and turns counter-clockwise sweeps, on the circle of radius ``r``, all
angles from the start of its arc to the end of its arc plus 90°. So it hits a square of the first
quadrant where, at some radius they share, that square's arc ends after its own begins; it hits a
square of the second quadrant where, at some radius they share, its own arc ends after that
square's arc, turned back by 90°, begins. All other quarters and the other sense are mirror images.

The arcs' ends are compared through ``r²``, and every threshold is an integer: looking once between
each two neighbouring integers decides the question exactly.
"""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["SweepTable", "arcs_overlap", "sweep_table"]


@njit(cache=True)
def arcs_overlap(a: int, b: int, c: int, d: int) -> bool:
    """Whether, at some radius, the arc of square (c, d) ends after the arc of (a, b) begins.

    All four numbers are at least 0: both squares lie in the first quadrant.
    """
    low = max(a * a + b * b, c * c + d * d)
    high = min((a + 1) ** 2 + (b + 1) ** 2, (c + 1) ** 2 + (d + 1) ** 2)
    for square in range(low, high):
        # r² is square + 1/2. The arc of (a, b) begins on its bottom side (y = b) or, beyond the
        # lower right corner, on its right side (x = a + 1); the arc of (c, d) ends on its left
        # side (x = c) or, beyond the upper left corner, on its top side (y = d + 1).
        begin_x = (a + 1) ** 2 + b * b <= square
        end_y = c * c + (d + 1) ** 2 <= square
        if begin_x:
            # At x = a + 1; the end must lie left of it, or higher than it.
            hit = (d + 1) ** 2 + (a + 1) ** 2 > square if end_y else c < a + 1
        else:
            # At y = b; the end must lie above it.
            hit = d + 1 > b if end_y else c * c + b * b <= square
        if hit:
            return True
    return False


class SweepTable(NamedTuple):
    """Squares swept by squares of the first quadrant in a counter-clockwise quarter turn.

    Attributes
    ----------
    side : int
        Squares ``(a, b)`` with ``0 <= a, b < side`` are in the table.
    start : (side * side + 1,) int32 array
        ``cells[start[a * side + b] : start[a * side + b + 1]]`` belongs to square ``(a, b)``.
    cells : (k, 2) int16 array
        The squares swept, without the square itself.
    """

    side: int
    start: NDArray[np.int32]
    cells: NDArray[np.int16]


@njit(cache=True)
def _fill(side: int, start: NDArray[np.int32], cells: NDArray[np.int16], write: bool) -> None:
    count = 0
    for a in range(side):
        for b in range(side):
            inner = a * a + b * b
            outer = (a + 1) ** 2 + (b + 1) ** 2
            # First quadrant, then second, by falling x: about the order of the turn.
            for c in range(a + b + 1, -1, -1):
                for d in range(a + b + 2):
                    if c * c + d * d >= outer or (c + 1) ** 2 + (d + 1) ** 2 <= inner:
                        continue
                    if (c != a or d != b) and arcs_overlap(a, b, c, d):
                        if write:
                            cells[count, 0] = c
                            cells[count, 1] = d
                        count += 1
            for d in range(a + b + 1, -1, -1):
                for c in range(a + b + 2):
                    # Square (c, d) of the first quadrant stands for (-d - 1, c) of the second.
                    if c * c + d * d >= outer or (c + 1) ** 2 + (d + 1) ** 2 <= inner:
                        continue
                    if arcs_overlap(c, d, a, b):
                        if write:
                            cells[count, 0] = -d - 1
                            cells[count, 1] = c
                        count += 1
            start[a * side + b + 1] = count


@cache
def _table(side: int) -> SweepTable:
    start = np.zeros(side * side + 1, dtype=np.int32)
    _fill(side, start, np.zeros((0, 2), dtype=np.int16), False)
    cells = np.zeros((int(start[-1]), 2), dtype=np.int16)
    _fill(side, start, cells, True)
    return SweepTable(side, start, cells)


def sweep_table(reach: int) -> SweepTable:
    """Table for all squares up to `reach` from the axis; made once for each power of two."""
    side = 16
    while side < reach:
        side *= 2
    return _table(side)
