"""Where to move the planes of the grid: dynamic programming in each direction in turn.

The planes of one direction are a chain: a slab's energy depends on its two planes alone while the
other two directions stand still. The best offsets of one direction are therefore found exactly by
dynamic programming, and block coordinate descent over x, y, z, x, ... can never raise the energy.

References
----------
Zhou, Sueda, Matusik, Shamir: Boxelization, section 3, "Non-uniform voxelization".
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.solid.scan import box_counts

__all__ = [
    "CellEnergy",
    "Offsets",
    "Planes",
    "best_axis_offsets",
    "cell_energy",
    "optimise_offsets",
]

#: Ascending positions of the planes of x, y and z, in subvoxels.
Planes = tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]


@dataclass(frozen=True)
class CellEnergy:
    """What a cell costs by the share of it that is material.

    An empty cell costs nothing and a kept one ``1 - fill`` (Eq. 1 of the paper). Two terms are
    added, because Eq. 1 alone does not know that cells can be dropped or be too small for a hinge.

    Attributes
    ----------
    drop_below : float
        Cells with less material than this share are dropped.
    sliver_below : float
        Kept cells with less than this are slivers.
    sliver_cost : float
        Added for each sliver.
    loss_cost : float
        Cost of a whole cell's worth of dropped material.
    move_cost : float
        Cost of moving a plane by one subvoxel, squared: enough to decide between equal energies.
    """

    drop_below: float = 0.04
    sliver_below: float = 0.10
    sliver_cost: float = 0.5
    loss_cost: float = 8.0
    move_cost: float = 1e-4

    def arguments(self) -> tuple[float, float, float, float]:
        """All but `move_cost`, in order, for compiled functions."""
        return (self.drop_below, self.sliver_below, self.sliver_cost, self.loss_cost)


@dataclass(frozen=True)
class Offsets:
    """Result of :func:`optimise_offsets`.

    Attributes
    ----------
    planes : three int64 arrays
        Plane positions after the move, in subvoxels.
    offsets : three int64 arrays
        How far each plane was moved, in subvoxels.
    energies : tuple of float
        Energy before the first sweep and after each direction of each sweep; never increases.
    """

    planes: Planes
    offsets: Planes
    energies: tuple[float, ...]

    def cost_of_moves(self, energy: CellEnergy) -> float:
        """What the moves cost by themselves.

        Parameters
        ----------
        energy : CellEnergy
            Its `move_cost` is the price.

        Returns
        -------
        float
            To be added to the energy of the cells.
        """
        return energy.move_cost * sum(float((axis**2).sum()) for axis in self.offsets)


@njit(cache=True)
def cell_energy(fill, drop_below, sliver_below, sliver_cost, loss_cost):  # type: ignore[no-untyped-def]
    """Energy of one cell, compiled; see :class:`CellEnergy`.

    Parameters
    ----------
    fill : float
        Share of the cell that is material.
    drop_below, sliver_below, sliver_cost, loss_cost : float
        As in :class:`CellEnergy`.

    Returns
    -------
    float
        0 for an empty or a full cell.
    """
    if fill <= 0.0:
        return 0.0
    if fill < drop_below:
        return loss_cost * fill
    if fill < sliver_below:
        return 1.0 - fill + sliver_cost
    return 1.0 - fill


@njit(cache=True)
def _slab(profile, low, high, area, energy):  # type: ignore[no-untyped-def]
    """Energy of the cells between the planes `low` and `high` of one direction."""
    last = profile.shape[0] - 1
    a = min(max(low, 0), last)
    b = min(max(high, 0), last)
    total = 0.0
    thick = high - low
    for j in range(profile.shape[1]):
        for k in range(profile.shape[2]):
            count = profile[b, j, k] - profile[a, j, k]
            if count > 0:
                total += cell_energy(
                    count / (thick * area[j, k]), energy[0], energy[1], energy[2], energy[3]
                )
    return total


@njit(cache=True)
def _best_offsets(profile, planes, area, limit, energy, move_cost):  # type: ignore[no-untyped-def]
    """Offsets of the inner planes that minimise the energy, the outermost two held."""
    count = len(planes)
    width = 2 * limit + 1
    best = np.full((count, width), np.inf)
    came = np.zeros((count, width), dtype=np.int64)
    best[0, limit] = 0.0
    for i in range(1, count):
        for to in range(width):
            offset = to - limit
            if i == count - 1 and offset != 0:
                continue
            for fro in range(width):
                if best[i - 1, fro] == np.inf or abs(offset - (fro - limit)) > limit:
                    continue
                low = planes[i - 1] + fro - limit
                high = planes[i] + offset
                if high <= low:
                    continue
                value = (
                    best[i - 1, fro]
                    + _slab(profile, low, high, area, energy)
                    + move_cost * offset * offset
                )
                if value < best[i, to]:
                    best[i, to] = value
                    came[i, to] = fro
    offsets = np.zeros(count, dtype=np.int64)
    state = limit
    for i in range(count - 1, -1, -1):
        offsets[i] = state - limit
        state = came[i, state]
    return offsets, best[count - 1, limit]


@njit(cache=True)
def column_profile(table, rows, columns, axis):  # type: ignore[no-untyped-def]
    """Material below each position along a direction, in each column of cells of the other two.

    Compiled: thousands of grids are ranked by it, and NumPy's two differences of a gathered view
    take ten times as long.

    Parameters
    ----------
    table : (x, y, z) int32 array
        From :func:`fabfold.solid.scan.summed_volume`.
    rows, columns : (r,) and (c,) int64 array
        Planes of the other two directions, in subvoxels.
    axis : int
        0, 1 or 2: the direction.

    Returns
    -------
    (n, r - 1, c - 1) int32 array
        Subvoxels of material.
    """
    first = 1 if axis == 0 else 0
    second = 1 if axis == 2 else 2
    height, wide, deep = table.shape[axis], table.shape[first], table.shape[second]
    corners = np.empty((len(rows), len(columns)), table.dtype)
    profile = np.empty((height, len(rows) - 1, len(columns) - 1), table.dtype)
    for at in range(height):
        for j in range(len(rows)):
            row = min(max(rows[j], 0), wide - 1)
            for k in range(len(columns)):
                column = min(max(columns[k], 0), deep - 1)
                if axis == 0:
                    corners[j, k] = table[at, row, column]
                elif axis == 1:
                    corners[j, k] = table[row, at, column]
                else:
                    corners[j, k] = table[row, column, at]
        for j in range(len(rows) - 1):
            for k in range(len(columns) - 1):
                profile[at, j, k] = (
                    corners[j + 1, k + 1] - corners[j, k + 1] - corners[j + 1, k] + corners[j, k]
                )
    return profile


@njit(cache=True)
def _sum_of_energies(counts, sizes, energy):  # type: ignore[no-untyped-def]
    """Energy of all cells that have material."""
    total = 0.0
    for i in range(len(counts)):
        if counts[i] > 0:
            total += cell_energy(counts[i] / sizes[i], energy[0], energy[1], energy[2], energy[3])
    return total


def best_axis_offsets(
    table: NDArray[np.int32],
    regular: Planes,
    offsets: Planes,
    axis: int,
    limit: int,
    energy: CellEnergy,
) -> tuple[NDArray[np.int64], float]:
    """Best offsets of the planes of one direction, those of the other two held.

    Parameters
    ----------
    table : int32 array
        From :func:`fabfold.solid.scan.summed_volume`.
    regular : three int64 arrays
        The planes of the regular grid, in subvoxels.
    offsets : three int64 arrays
        How far each plane is moved now, in subvoxels; those of `axis` do not matter.
    axis : int
        0, 1 or 2: the direction whose planes move.
    limit : int
        Subvoxels by which a plane may move, and by which a spacing may change.
    energy : CellEnergy
        What a cell costs.

    Returns
    -------
    offsets : int64 array
        How far each plane of `axis` moves, in subvoxels; the outermost two never move.
    energy : float
        Of all cells, the cost of this direction's moves included.
    """
    moved = (regular[0] + offsets[0], regular[1] + offsets[1], regular[2] + offsets[2])
    rows, columns = (moved[other] for other in range(3) if other != axis)
    area = (rows[1:] - rows[:-1])[:, None] * (columns[1:] - columns[:-1])[None].astype(np.float64)
    found, value = _best_offsets(
        column_profile(table, rows, columns, axis),
        regular[axis],
        area,
        limit,
        energy.arguments(),
        energy.move_cost,
    )
    return np.asarray(found), float(value)


def optimise_offsets(
    table: NDArray[np.int32], regular: Planes, limit: int, energy: CellEnergy, sweeps: int = 12
) -> Offsets:
    """Move the planes of all three directions until nothing improves.

    Parameters
    ----------
    table : int32 array
        From :func:`fabfold.solid.scan.summed_volume`.
    regular : three int64 arrays
        The planes of the regular grid, in subvoxels; the outermost ones do not move.
    limit : int
        Subvoxels by which a plane may move, and by which a spacing may change; 0 moves nothing.
    energy : CellEnergy
        What a cell costs.
    sweeps : int
        Most sweeps over the three directions; 2 to 5 are enough for most models.

    Returns
    -------
    Offsets
        The moves and the energy after each of them.
    """
    offsets = [np.zeros_like(planes) for planes in regular]

    def moves(skip: int) -> float:
        return energy.move_cost * sum(
            float((offsets[axis] ** 2).sum()) for axis in range(3) if axis != skip
        )

    counts = box_counts(table, regular)
    widths = [np.diff(planes).astype(float) for planes in regular]
    size = widths[0][:, None, None] * widths[1][None, :, None] * widths[2][None, None, :]
    start = _sum_of_energies(counts.ravel(), size.ravel(), energy.arguments())
    energies = [float(start)]
    for _ in range(sweeps if limit > 0 else 0):
        before = energies[-1]
        for axis in range(3):
            found, value = best_axis_offsets(
                table, regular, (offsets[0], offsets[1], offsets[2]), axis, limit, energy
            )
            value += moves(axis)
            if value < energies[-1] - 1e-9:
                offsets[axis] = found
                energies.append(value)
            else:
                energies.append(energies[-1])
        if energies[-1] >= before - 1e-9:
            break
    final = (offsets[0], offsets[1], offsets[2])
    return Offsets(
        planes=(regular[0] + final[0], regular[1] + final[1], regular[2] + final[2]),
        offsets=final,
        energies=tuple(energies),
    )
