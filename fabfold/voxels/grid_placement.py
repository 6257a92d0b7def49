"""Placements of the grid: rotations to try, and how well the cells of a grid fit a template."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.solid.scan import TIE, box_counts_kernel
from fabfold.voxels.offsets import CellEnergy

__all__ = [
    "SCORE_DIGITS",
    "SURPLUS_DROP_BELOW",
    "Capacity",
    "GridFit",
    "RankedGrid",
    "grid_fit",
    "grid_rotations",
    "nearby_rotations",
    "rank_translations",
]

#: Cells under this share of material may be dropped where a template has no room for their colour.
SURPLUS_DROP_BELOW = 0.15


#: Digits after the point of a score, so that rounding does not order two grids that are as good.
SCORE_DIGITS = 9
#: Two principal axes are not told apart where the model spreads along them alike, to this share.
_ALIKE = 1e-6


@dataclass(frozen=True)
class Capacity:
    """How many cells a template holds.

    Attributes
    ----------
    cells : int
        All of them.
    colours : (int, int)
        Those of checkerboard colour 0 and of colour 1.
    """

    cells: int
    colours: tuple[int, int]


@dataclass(frozen=True)
class GridFit:
    """How well the cells of a grid fit the model and the template.

    Attributes
    ----------
    score : float
        Total fill of the kept cells, less 0.5 a sliver and `CellEnergy.loss_cost` for each cell's
        worth of lost material; higher is better.
    kept : int
        Cells kept.
    fill : float
        Their material, in cells.
    slivers : int
        Kept cells under `CellEnergy.sliver_below`.
    lost : float
        Material in dropped cells, in cells.
    excess : int
        Kept cells for which the template has no cell of their colour.
    fills : (kept,) float64 array
        Share of each kept cell that is material, ascending.
    cells : (kept, 3) int64 array
        Which cells of the grid are kept.
    """

    score: float
    kept: int
    fill: float
    slivers: int
    lost: float
    excess: int
    fills: NDArray[np.float64] = field(repr=False, compare=False)
    cells: NDArray[np.int64] = field(repr=False, compare=False)


@dataclass(frozen=True)
class RankedGrid:
    """A regular grid, and its score on a coarse scan once its planes are moved there.

    Attributes
    ----------
    score : float
        That of `GridFit`, less a price for each excess cell;
        higher is better.
    rotation : int
        Index into :attr:`fabfold.voxels.refinement.Refinement.rotations`.
    pitch : float
        Side of a voxel, model units.
    origin : three floats
        The centre of a cell: lattice axes, model units.
    """

    score: float
    rotation: int
    pitch: float
    origin: tuple[float, float, float]


def _from_quaternion(quaternion: NDArray[np.float64]) -> NDArray[np.float64]:
    w, x, y, z = (quaternion / np.linalg.norm(quaternion)).tolist()
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def grid_rotations(count: int, seed: int, vertices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotations of the model's own axes against the grid.

    Parameters
    ----------
    count : int
        Number of rotations, at least 1.
    seed : int
        Of the random rotations.
    vertices : (v, 3) float64 array
        The model in its own axes, for its principal axes; any unit.

    Returns
    -------
    (count, 3, 3) float64 array
        Matrices from own axes to lattice axes: the identity, the model's principal axes (where it
        has them), then seeded random ones. Every third of these turns about one of the own axes,
        the others are uniform over all rotations.
    """
    rng = np.random.default_rng([seed, 3])
    spread = vertices - vertices.mean(axis=0)
    spread /= max(float(np.abs(spread).max()), 1e-300)
    # einsum, since a matrix product may sum in an order that depends on the number of threads.
    lengths, axes = np.linalg.eigh(np.einsum("ij,ik->jk", spread, spread))
    axes = axes.T[::-1]
    # eigh leaves the signs open: largest entry of each axis positive, and right-handed.
    axes = axes * np.sign(np.take_along_axis(axes, np.abs(axes).argmax(1)[:, None], 1))
    axes[2] *= np.sign(np.linalg.det(axes))
    # Of a model that spreads alike along two axes, it leaves these open too.
    distinct = np.diff(lengths).min() > _ALIKE * lengths.max()
    rotations = [np.eye(3), *([axes] if distinct else [])]
    for index in range(max(0, count - len(rotations))):
        if index % 3 == 0:
            half = rng.uniform(0.0, math.pi / 4)
            about = np.array([math.cos(half), 0.0, 0.0, 0.0])
            about[3 - index // 3 % 3] = math.sin(half)
            rotations.append(_from_quaternion(about))
        else:
            rotations.append(_from_quaternion(rng.normal(size=4)))
    return np.array(rotations[:count])


def nearby_rotations(
    rotations: NDArray[np.float64], count: int, seed: int, spread_deg: float
) -> NDArray[np.float64]:
    """Small random turns of given rotations.

    Parameters
    ----------
    rotations : (r, 3, 3) float64 array
        Matrices from model axes to lattice axes.
    count : int
        Number of turns; each of the rotations gets one after another.
    seed : int
        Of the random turns.
    spread_deg : float
        Standard deviation of the turn about each axis, degrees.

    Returns
    -------
    (count, 3, 3) float64 array
        Matrices from model axes to lattice axes.
    """
    rng = np.random.default_rng([seed, 4])
    found = []
    for index in range(count):
        half = np.radians(rng.normal(size=3) * spread_deg) / 2
        small = _from_quaternion(np.concatenate([[1.0], half]))
        found.append(small @ rotations[index % len(rotations)])
    return np.array(found).reshape(-1, 3, 3)


_HALF = 0.5 + TIE


@njit(cache=True)
def _keep_largest(keep, fills, stack, labels):  # type: ignore[no-untyped-def]
    """Clear `keep` outside the face-connected group of cells with the most material."""
    nx, ny, nz = keep.shape
    labels[:] = 0
    group = 0
    best_group = 0
    best_fill = -1.0
    for start in range(nx * ny * nz):
        i, j, k = start // (ny * nz), (start // nz) % ny, start % nz
        if not keep[i, j, k] or labels[i, j, k] != 0:
            continue
        group += 1
        labels[i, j, k] = group
        stack[0] = start
        top = 1
        total = 0.0
        while top > 0:
            top -= 1
            cell = stack[top]
            i, j, k = cell // (ny * nz), (cell // nz) % ny, cell % nz
            total += fills[i, j, k]
            for face in range(6):
                a, b, c = i, j, k
                step = 1 if face % 2 == 0 else -1
                if face < 2:
                    a += step
                elif face < 4:
                    b += step
                else:
                    c += step
                if a < 0 or b < 0 or c < 0 or a >= nx or b >= ny or c >= nz:
                    continue
                if keep[a, b, c] and labels[a, b, c] == 0:
                    labels[a, b, c] = group
                    stack[top] = (a * ny + b) * nz + c
                    top += 1
        if total > best_fill:
            best_fill = total
            best_group = group
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                keep[i, j, k] = keep[i, j, k] and labels[i, j, k] == best_group


@njit(cache=True)
def _overfull(keep, colour0, colour1):  # type: ignore[no-untyped-def]
    """Surplus cells of each colour, the colours given the better way, and the number of cells."""
    nx, ny, nz = keep.shape
    even = 0
    odd = 0
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                if keep[i, j, k]:
                    if (i + j + k) % 2 == 0:
                        even += 1
                    else:
                        odd += 1
    e0, o0 = max(0, even - colour0), max(0, odd - colour1)
    e1, o1 = max(0, even - colour1), max(0, odd - colour0)
    if e0 + o0 <= e1 + o1:
        return e0, o0, even + odd
    return e1, o1, even + odd


@njit(cache=True)
def _drop_surplus(keep, fills, colour, surplus, below):  # type: ignore[no-untyped-def]
    """Drop up to `surplus` of the smallest cells of one colour; whether there was one."""
    nx, ny, nz = fills.shape
    dropped = False
    for _ in range(surplus):
        low = below
        a = b = c = -1
        for i in range(nx):
            for j in range(ny):
                for k in range((colour + i + j) % 2, nz, 2):
                    if keep[i, j, k] and fills[i, j, k] < low:
                        low = fills[i, j, k]
                        a, b, c = i, j, k
        if a < 0:
            break
        keep[a, b, c] = False
        dropped = True
    return dropped


@njit(cache=True)
def _grid_fit(fills, energy, capacity, drop_surplus_below, keep, stack, labels):  # type: ignore[no-untyped-def]
    """Decide which cells stay; (score, kept, fill, slivers, lost, excess)."""
    share = fills.reshape(-1)
    kept_share = keep.reshape(-1)
    total = 0.0
    count = 0
    for cell in range(share.size):
        total += share[cell]
        kept_share[cell] = share[cell] >= energy[0] and share[cell] > 0.0
        count += kept_share[cell]
    if count > 1.5 * capacity[0] + 4:
        return -1e9, count, total, 0, 0.0, count - capacity[0]
    for _ in range(4):
        _keep_largest(keep, fills, stack, labels)
        even, odd, _kept = _overfull(keep, capacity[1], capacity[2])
        if even + odd == 0 or even + odd > 4 + capacity[0] // 16:
            break  # it fits, or is too far from it for dropping small cells to help
        dropped = _drop_surplus(keep, fills, 0, even, drop_surplus_below)
        dropped = _drop_surplus(keep, fills, 1, odd, drop_surplus_below) or dropped
        if not dropped:
            break
    _keep_largest(keep, fills, stack, labels)
    even, odd, kept = _overfull(keep, capacity[1], capacity[2])
    filled = 0.0
    slivers = 0
    for cell in range(share.size):
        if kept_share[cell]:
            filled += share[cell]
            slivers += share[cell] < energy[1]
    lost = total - filled
    score = filled - energy[2] * slivers - energy[3] * lost
    return score, kept, filled, slivers, lost, even + odd


@njit(cache=True)
def _rank_translations(table, pitch, steps, energy, capacity, drop_surplus_below, excess_cost):  # type: ignore[no-untyped-def]
    """Fit of every translation of a grid of `pitch` subvoxels; (steps**3, 4)."""
    size = np.array([table.shape[0] - 1, table.shape[1] - 1, table.shape[2] - 1])
    cells = np.zeros(3, dtype=np.int64)
    for axis in range(3):
        cells[axis] = math.ceil(size[axis] / pitch - TIE) + 1
    most = cells[0] * cells[1] * cells[2]
    result = np.zeros((steps**3, 4))
    keep = np.zeros((cells[0], cells[1], cells[2]), dtype=np.bool_)
    labels = np.zeros((cells[0], cells[1], cells[2]), dtype=np.int32)
    stack = np.zeros(most, dtype=np.int64)
    volume = pitch**3
    for row in range(steps**3):
        shift = (row // (steps * steps), (row // steps) % steps, row % steps)
        xs = np.zeros(cells[0] + 1, dtype=np.int64)
        ys = np.zeros(cells[1] + 1, dtype=np.int64)
        zs = np.zeros(cells[2] + 1, dtype=np.int64)
        for i in range(cells[0] + 1):
            xs[i] = math.floor((i - shift[0] / steps) * pitch + _HALF)
        for i in range(cells[1] + 1):
            ys[i] = math.floor((i - shift[1] / steps) * pitch + _HALF)
        for i in range(cells[2] + 1):
            zs[i] = math.floor((i - shift[2] / steps) * pitch + _HALF)
        fills = box_counts_kernel(table, xs, ys, zs) / volume
        fit = _grid_fit(fills, energy, capacity, drop_surplus_below, keep, stack, labels)
        result[row, 0] = fit[0] - excess_cost * fit[5]
        result[row, 1] = fit[1]
        result[row, 2] = fit[5]
        result[row, 3] = fit[4] / max(fit[2] + fit[4], 1e-300)
    return result


def grid_fit(fills: NDArray[np.float64], energy: CellEnergy, capacity: Capacity) -> GridFit:
    """Drop what is too small, keep one connected group, and fit the template's colours.

    Parameters
    ----------
    fills : (a, b, c) float64 array
        Share of each cell that is material.
    energy : CellEnergy
        Which cells are dropped, and what slivers and lost material cost.
    capacity : Capacity
        What the template holds.

    Returns
    -------
    GridFit
        Cells under `SURPLUS_DROP_BELOW` are dropped where their colour is over-full; what is still
        too much is `excess`.
    """
    keep = np.zeros(fills.shape, dtype=bool)
    found = _grid_fit(
        np.ascontiguousarray(fills, dtype=np.float64),
        energy.arguments(),
        (capacity.cells, *capacity.colours),
        SURPLUS_DROP_BELOW,
        keep,
        np.zeros(fills.size, dtype=np.int64),
        np.zeros(fills.shape, dtype=np.int32),
    )
    score, kept, fill, slivers, lost, excess = found
    return GridFit(
        score=float(score),
        kept=int(kept),
        fill=float(fill),
        slivers=int(slivers),
        lost=float(lost),
        excess=int(excess),
        fills=np.sort(fills[keep]),
        cells=np.argwhere(keep),
    )


def rank_translations(
    table: NDArray[np.int32],
    pitch: float,
    steps: int,
    energy: CellEnergy,
    capacity: Capacity,
    excess_cost: float = 1.2,
) -> NDArray[np.float64]:
    """Score every translation of a regular grid, without moving planes.

    Parameters
    ----------
    table : int32 array
        From :func:`fabfold.solid.scan.summed_volume`; the model begins at its lower corner.
    pitch : float
        Side of a cell in subvoxels.
    steps : int
        Translations along each axis: row ``(a * steps + b) * steps + c`` puts the first planes at
        ``-(a, b, c) / steps`` of a cell.
    energy : CellEnergy
        Which cells are dropped, and what slivers and lost material cost.
    capacity : Capacity
        What the template holds.
    excess_cost : float
        Taken off the score for each cell too many. It is mild, because moving the planes afterwards
        empties many small cells.

    Returns
    -------
    (steps**3, 4) float64 array
        Score, cells kept, cells too many, and the share of the material that is lost.
    """
    rows = _rank_translations(
        table,
        float(pitch),
        steps,
        energy.arguments(),
        (capacity.cells, *capacity.colours),
        SURPLUS_DROP_BELOW,
        float(excess_cost),
    )
    return np.asarray(rows.round(SCORE_DIGITS))
