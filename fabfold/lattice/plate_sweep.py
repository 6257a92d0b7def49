"""What the link plate of a double hinge meets in a quarter turn about a lattice edge.

The planner of the folding stage needs it for trees with double hinges. A plate is a face of the
lattice, 1/10 of a voxel thick. Where the axis of the turn lies along it, the plate is a unit
segment in the plane of the turn and sweeps cells; the rule for squares in
:mod:`fabfold.lattice.sweep` holds, with an arc of no width. Where the axis stands upright on it,
the plate turns in its own plane between two layers of cells and sweeps none. Bodies that it only
grazes or that it comes to rest on are let in for it, so a plate may lie on any face.

Two plates may not pass through each other, nor a plate and a barrel: nothing can be carved there. A
plate stands back from its edges without a barrel, so that another hinge's barrel fits there.
"""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.lattice.segments import INSET, segment_distance, segments_meet

__all__ = [
    "BARREL_HALF",
    "NO_PLATES",
    "PLATE_CORE",
    "PLATE_HALF",
    "PLATE_LEAST",
    "POST_LEAST",
    "PlateTable",
    "plate_table",
]

#: Half the thickness of a plate, of the voxel: 2 mm at 20 mm.
_THICK = 0.05
#: A barrel's radius and its clearance together, of the voxel.
_BARREL_RADIUS = 0.14
#: Half the side of a plate, which leaves space for a barrel at both ends.
PLATE_HALF = 0.5 - _BARREL_RADIUS
#: Two plates may not come nearer than this: their thickness and the clearance.
PLATE_LEAST = 2 * _THICK + 0.015 - 1e-3
#: The same for the middle of a plate and the axis of a barrel: a ball about any point of this
#: part of the plate, as wide as the plate is thick, lies inside the plate.
PLATE_CORE = PLATE_HALF - _THICK
POST_LEAST = _BARREL_RADIUS + _THICK - 1e-3
#: Half the length of a barrel's inner axis.
BARREL_HALF = 0.5 - INSET

I16 = NDArray[np.int16]
I32 = NDArray[np.int32]


class PlateTable(NamedTuple):
    """What plates of the first quadrant meet in a counter-clockwise quarter turn.

    Everything is relative to the axis. A plate that the axis lies along has its middle at
    ``(x, y) / 2``, x > 0 and y >= 0, one of them odd, and the entry ``i = x * 2 * side + y``. A
    plate across the axis is the square ``(a, b)`` with the entry ``i = a * side + b``.

    Attributes
    ----------
    cell_start : (4 * side * side + 1,) int32 array
        Where the squares of each plate along the axis begin in `cells`.
    cells : (k, 2) int16 array
        ``cells[cell_start[i] : cell_start[i + 1]]``: squares that a plate along the axis sweeps.
    post_start : (4 * side * side + 1,) int32 array
        Where the barrels of each plate along the axis begin in `posts`.
    posts : (k, 2) int16 array
        Twice the places of barrels along the axis that a plate along the axis meets.
    plate_start : (4 * side * side + 1,) int32 array
        Where the plates of each plate along the axis begin in `plates`.
    plates : (k, 2) int16 array
        Twice the middles of other plates along the axis that it meets.
    sheet_start : (side * side + 1,) int32 array
        Where the squares of each plate across the axis begin in `sheets`.
    sheets : (k, 2) int16 array
        Squares that a plate across the axis sweeps.
    edge_start : (side * side + 1,) int32 array
        Where the barrels of each plate across the axis begin in `edges`.
    edges : (k, 2) int16 array
        Twice the middles of barrels across the axis that a plate across the axis meets.
    """

    cell_start: I32
    cells: I16
    post_start: I32
    posts: I16
    plate_start: I32
    plates: I16
    sheet_start: I32
    sheets: I16
    edge_start: I32
    edges: I16


_NONE = np.zeros(1, dtype=np.int32), np.zeros((0, 2), dtype=np.int16)
#: For systems without plates.
NO_PLATES = PlateTable(*_NONE, *_NONE, *_NONE, *_NONE, *_NONE)


@njit(cache=True)
def _angle(x: int, y: int, square: float) -> float:
    """Angle at which the segment with middle (x, y) / 2 crosses the circle of radius² `square`."""
    if y % 2 == 0:
        level = 0.5 * y
        return np.arctan2(level, np.sqrt(square - level * level))
    level = 0.5 * x
    return np.arctan2(np.sqrt(square - level * level), level)


@njit(cache=True)
def _sweeps(x: int, y: int, c: int, d: int, second: bool) -> bool:
    """Whether a segment sweeps square (c, d), or that square turned into the second quadrant."""
    low = max(c * c + d * d, ((x - x % 2) // 2) ** 2 + ((y - y % 2) // 2) ** 2)
    high = min((c + 1) ** 2 + (d + 1) ** 2, ((x + x % 2) // 2) ** 2 + ((y + y % 2) // 2) ** 2)
    for whole in range(low, high):
        square = whole + 0.5
        radius = np.sqrt(square)
        angle = _angle(x, y, square)
        if second:
            right = (c + 1) ** 2 + d * d <= whole
            begin = np.arccos((c + 1) / radius) if right else np.arcsin(d / radius)
            if angle > begin + 1e-9:
                return True
        else:
            top = c * c + (d + 1) ** 2 <= whole
            end = np.arcsin((d + 1) / radius) if top else np.arccos(c / radius)
            if angle < end - 1e-9:
                return True
    return False


@njit(cache=True)
def _sheet_meets(a: int, b: int, c: int, d: int, core: float, half: float, least: float) -> bool:
    """Whether a turning square comes near the segment with middle (c, d) / 2."""
    # The four sides of the square, as segments that turn along.
    for side in range(4):
        x = 0.5 + a + core * (0.0, 0.0, 1.0, -1.0)[side]
        y = 0.5 + b + core * (1.0, -1.0, 0.0, 0.0)[side]
        if _side_meets(x, y, side < 2, core, c, d, half, least):
            return True
    return False


@njit(cache=True)
def _side_meets(
    x: float, y: float, flat: bool, core: float, c: int, d: int, half: float, least: float
) -> bool:
    """Whether one side of a turning square comes near the segment with middle (c, d) / 2."""
    from_x, from_y = (x - core, y) if flat else (x, y - core)
    to_x, to_y = (x + core, y) if flat else (x, y + core)
    sx = half if c % 2 != 0 else 0.0
    sy = half if d % 2 != 0 else 0.0
    lever = max(np.hypot(from_x, from_y), np.hypot(to_x, to_y))
    angle = 0.0
    while True:
        cosine = np.cos(angle)
        sine = np.sin(angle)
        away = segment_distance(
            from_x * cosine - from_y * sine,
            from_x * sine + from_y * cosine,
            to_x * cosine - to_y * sine,
            to_x * sine + to_y * cosine,
            0.5 * c - sx,
            0.5 * d - sy,
            0.5 * c + sx,
            0.5 * d + sy,
        )
        if away < least:
            return True
        if angle >= 0.5 * np.pi:
            return False
        angle = min(0.5 * np.pi, angle + max(1e-3, (away - 0.9 * least) / lever))


@njit(cache=True)
def _add(rows: I16, count: int, c: int, d: int) -> I16:
    """Write (c, d) to row `count` of `rows`, twice as long where it is full; returns the rows."""
    if count == len(rows):
        wider = np.empty((2 * count, 2), np.int16)
        wider[:count] = rows
        rows = wider
    rows[count, 0] = c
    rows[count, 1] = d
    return rows


@njit(cache=True)
def _along(  # noqa: PLR0912 - one pass over the plane
    side: int,
    core: float,
    post_least: float,
    plate_half: float,
    plate_least: float,
    cell_start: I32,
    post_start: I32,
    plate_start: I32,
) -> tuple[I16, I16, I16]:
    """Fill the starts for plates along the axis; returns what they meet."""
    cells = np.empty((4096, 2), np.int16)
    posts = np.empty((4096, 2), np.int16)
    plates = np.empty((4096, 2), np.int16)
    n_cells = n_posts = n_plates = 0
    for x in range(2 * side):
        for y in range(2 * side):
            radius = np.hypot(x, y)
            if x > 0 and (x + y) % 2 == 1 and radius < 2.0 * side:
                inner = ((x - x % 2) // 2) ** 2 + ((y - y % 2) // 2) ** 2
                outer = ((x + x % 2) // 2) ** 2 + ((y + y % 2) // 2) ** 2
                most = int(0.5 * radius) + 2
                for c in range(most, -1, -1):
                    for d in range(most):
                        if c * c + d * d >= outer or (c + 1) ** 2 + (d + 1) ** 2 <= inner:
                            continue
                        if _sweeps(x, y, c, d, False):
                            cells = _add(cells, n_cells, c, d)
                            n_cells += 1
                for d in range(most, -1, -1):
                    for c in range(most):
                        if c * c + d * d >= outer or (c + 1) ** 2 + (d + 1) ** 2 <= inner:
                            continue
                        if _sweeps(x, y, c, d, True):
                            cells = _add(cells, n_cells, -d - 1, c)
                            n_cells += 1
                near = 2.0 * (max(post_least, plate_least) + 1.0)
                low = max(0.0, radius - near) ** 2
                high = (radius + near) ** 2
                most = int(radius + near) + 1
                for c in range(-most, most + 1):
                    for d in range(-2, most + 1):
                        far = c * c + d * d
                        if far < low or far > high or (c % 2 != 0 and d % 2 != 0):
                            continue
                        if c % 2 == 0 and d % 2 == 0:
                            if far > 0 and segments_meet(x, y, core, c, d, 0.0, post_least):
                                posts = _add(posts, n_posts, c, d)
                                n_posts += 1
                        elif (c != x or d != y) and segments_meet(
                            x, y, plate_half, c, d, plate_half, plate_least
                        ):
                            plates = _add(plates, n_plates, c, d)
                            n_plates += 1
            i = x * 2 * side + y
            cell_start[i + 1] = n_cells
            post_start[i + 1] = n_posts
            plate_start[i + 1] = n_plates
    return cells[:n_cells].copy(), posts[:n_posts].copy(), plates[:n_plates].copy()


@njit(cache=True)
def _across(side: int, core: float, half: float, least: float, edge_start: I32) -> I16:
    """Fill the start for plates across the axis; returns the barrels that they meet."""
    edges = np.empty((4096, 2), np.int16)
    count = 0
    for a in range(side):
        for b in range(side):
            radius = np.hypot(2 * a + 1, 2 * b + 1)
            if radius < 2.0 * side:
                near = 2.0 * (least + 1.5)
                low = max(0.0, radius - near) ** 2
                high = (radius + near) ** 2
                most = int(radius + near) + 1
                for c in range(-most, most + 1):
                    for d in range(-2, most + 1):
                        far = c * c + d * d
                        if far < low or far > high or (c + d) % 2 == 0:
                            continue
                        if _sheet_meets(a, b, c, d, core, half, least):
                            edges = _add(edges, count, c, d)
                            count += 1
            edge_start[a * side + b + 1] = count
    return edges[:count].copy()


def plate_table(side: int, sheet_start: I32, sheets: I16, *, halves: bool) -> PlateTable:
    """Table of plates that goes with a table of cells.

    Parameters
    ----------
    side : int
        Squares along each side of the first quadrant, see
        :class:`fabfold.lattice.sweep.SweepTable`.
    sheet_start : (side * side + 1,) int32 array
        ``SweepTable.start``: a plate across the axis sweeps what a square sweeps.
    sheets : (k, 2) int16 array
        ``SweepTable.cells``.
    halves : bool
        The lattice is one of half cells, see :func:`fabfold.lattice.sweep.sweep_table`: plates and
        barrels are cut up there, and only those that really cross or coincide count as meeting.

    Returns
    -------
    PlateTable
        For plates up to `side` from the axis.
    """
    core, half = (0.25, 0.25) if halves else (PLATE_CORE, BARREL_HALF)
    post_least = 0.2 if halves else POST_LEAST
    plate_half = 0.25 if halves else PLATE_HALF
    plate_least = 0.2 if halves else PLATE_LEAST
    starts = [np.zeros(4 * side * side + 1, dtype=np.int32) for _ in range(3)]
    cells, posts, plates = _along(side, core, post_least, plate_half, plate_least, *starts)
    edge_start = np.zeros(side * side + 1, dtype=np.int32)
    edges = _across(side, core, half, post_least, edge_start)
    return PlateTable(
        starts[0],
        cells,
        starts[1],
        posts,
        starts[2],
        plates,
        sheet_start,
        sheets,
        edge_start,
        edges,
    )
