"""What a unit cube and a hinge barrel meet in a quarter turn about an edge of the lattice.

The planner of the folding stage looks collisions up in these tables. A cube that turns about a
lattice edge keeps its layer along the axis, so the question is a plane one: which unit squares does
a unit square sweep (open interiors) while it turns a quarter about a lattice point? Take the point
as origin and let square ``(a, b)`` be ``[a, a + 1] x [b, b + 1]``.

Every square lies in one quadrant, and a circle about the origin meets it in one arc. A square that
starts in the first quadrant and turns counter-clockwise sweeps, on the circle of radius ``r``, all
angles from the start of its arc to the end of its arc plus 90°. So it hits a square of the first
quadrant where, at some radius they share, that square's arc ends after its own begins; it hits a
square of the second quadrant where, at some radius they share, its own arc ends after that square's
arc, turned back by 90°, begins. All other quarters and the other sense are mirror images.

The arcs' ends are compared through ``r²``, and every threshold is an integer: looking once between
each two neighbouring integers decides the question exactly.

Hinge barrels lie on lattice edges and stand out of the cubes, so a barrel that is carried along may
run into one that stays. Here it is enough to know the barrels' axes, less a piece at each end, and
how near two of them may come. Axes along the hinge meet only axes along the hinge in the same
layer, and axes across it only axes across it at the same height: a plane question again.
"""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.lattice.plate_sweep import NO_PLATES, PlateTable, plate_table
from fabfold.lattice.segments import INSET, LEAST, segments_meet

__all__ = ["SweepTable", "arcs_overlap", "sweep_table", "with_plates"]


@njit(cache=True)
def arcs_overlap(a: int, b: int, c: int, d: int) -> bool:
    """Whether, at some radius, the arc of square (c, d) ends after the arc of (a, b) begins.

    Parameters
    ----------
    a, b : int
        Lower corner of a square of the first quadrant.
    c, d : int
        Lower corner of another one.

    Returns
    -------
    bool
        True where a turning square ``(c, d)`` hits ``(a, b)``, see the module's text.
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
        Where the squares that each square sweeps begin in `cells`:
        ``cells[start[a * side + b] : start[a * side + b + 1]]`` belongs to square ``(a, b)``.
    cells : (k, 2) int16 array
        The squares swept, without the square itself.
    edge_start : (4 * side * side + 1,) int32 array
        Where the barrels that each barrel meets begin in `edges`:
        ``edges[edge_start[i] : edge_start[i + 1]]`` with ``i = x * 2 * side + y`` belongs to the
        lattice edge whose middle is at ``(x, y) / 2``, x > 0 and y >= 0. Two even numbers: an edge
        along the axis; x odd: an edge along x; y odd: along y.
    edges : (m, 2) int16 array
        Twice the middles of the edges whose barrels are met.
    plates : PlateTable
        What the link plates of double hinges meet; empty without :func:`with_plates`.
    """

    side: int
    start: NDArray[np.int32]
    cells: NDArray[np.int16]
    edge_start: NDArray[np.int32]
    edges: NDArray[np.int16]
    plates: PlateTable


@njit(cache=True)
def _fill(side: int, start: NDArray[np.int32], cells: NDArray[np.int16], write: bool) -> None:
    """Fill ``SweepTable.start`` and, where `write` is set, ``SweepTable.cells``."""
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


@njit(cache=True)
def _fill_edges(
    side: int, start: NDArray[np.int32], inset: float, least: float
) -> NDArray[np.int16]:
    """Fill ``SweepTable.edge_start``; returns ``SweepTable.edges``."""
    edges = np.empty((1024, 2), np.int16)
    count = 0
    half = 0.5 - inset
    for x in range(2 * side):
        for y in range(2 * side):
            radius = np.hypot(x, y)
            valid = x > 0 and (x % 2 == 0 or y % 2 == 0) and radius < 2.0 * side
            # Edges that are too far in or out for any angle need no look.
            near = 2.0 * (least + 1.0 - 2.0 * inset)
            low = max(1.0, radius - near) ** 2
            high = (radius + near) ** 2
            most = int(radius + near) + 1 if valid else -1
            along = x % 2 == 0 and y % 2 == 0
            for c in range(-most, most + 1):
                for d in range(-1, most + 1):
                    if c * c + d * d < low or c * c + d * d > high or (c == x and d == y):
                        continue
                    if (c % 2 == 0 and d % 2 == 0) != along or (c % 2 != 0 and d % 2 != 0):
                        continue
                    if segments_meet(x, y, half, c, d, half, least):
                        if count == len(edges):
                            wider = np.empty((2 * count, 2), np.int16)
                            wider[:count] = edges
                            edges = wider
                        edges[count, 0] = c
                        edges[count, 1] = d
                        count += 1
            start[x * 2 * side + y + 1] = count
    return edges[:count].copy()


@cache
def _table(side: int, halves: bool) -> SweepTable:
    # Without the whole edge only barrels that really cross or coincide count.
    inset, least = (0.25, 0.3) if halves else (INSET, LEAST - 1e-3)
    start = np.zeros(side * side + 1, dtype=np.int32)
    _fill(side, start, np.zeros((0, 2), dtype=np.int16), False)
    cells = np.zeros((int(start[-1]), 2), dtype=np.int16)
    _fill(side, start, cells, True)
    edge_start = np.zeros(4 * side * side + 1, dtype=np.int32)
    edges = _fill_edges(side, edge_start, inset, least)
    return SweepTable(side, start, cells, edge_start, edges, NO_PLATES)


def sweep_table(reach: int, *, halves: bool = False) -> SweepTable:
    """Table for everything up to `reach` from the axis; made once for each half power of two.

    Parameters
    ----------
    reach : int
        Greatest distance from the axis along x and y, in cells.
    halves : bool
        The lattice is one of half cells: barrels are two edges long, and the two ends of an edge
        cannot be told apart, so that only barrels that really cross or coincide count as meeting.

    Returns
    -------
    SweepTable
        Without link plates, see :func:`with_plates`.
    """
    side = 16
    while side < reach:
        side = side * 3 // 2 if side % 3 else side * 4 // 3
    return _table(side, halves)


def with_plates(table: SweepTable, *, halves: bool = False) -> SweepTable:
    """The same table with what link plates meet; made once for each side as well.

    Parameters
    ----------
    table : SweepTable
        From :func:`sweep_table`.
    halves : bool
        As of :func:`sweep_table`.

    Returns
    -------
    SweepTable
        With ``plates``.
    """
    return table._replace(plates=_plates(table.side, halves))


@cache
def _plates(side: int, halves: bool) -> PlateTable:
    whole = _table(side, halves)
    return plate_table(side, whole.start, whole.cells, halves=halves)
