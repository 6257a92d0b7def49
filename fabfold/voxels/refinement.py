"""The search for grid placements in rounds, from many on coarse scans to few on fine ones.

Every rotation is scanned coarsely once, and all pitches and translations are read off its summed
volume table. The best grids are scanned at 20 x 20 x 20 and get their planes moved. The best of
those are tried again at pitches in between.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fabfold.lattice.template import Template
from fabfold.progress import Progress
from fabfold.solid.closed_solid import Solid
from fabfold.solid.scan import TIE, box_counts, summed_volume
from fabfold.voxels.cut import Placement, cut_voxels
from fabfold.voxels.features import box_depth
from fabfold.voxels.fine_scan import FineScan, fine_scan, grid_shape
from fabfold.voxels.grid_placement import (
    SCORE_DIGITS,
    Capacity,
    GridFit,
    RankedGrid,
    grid_fit,
    nearby_rotations,
    rank_translations,
)
from fabfold.voxels.offsets import CellEnergy, Offsets, optimise_offsets
from fabfold.voxels.refined_grid import RefinedGrid
from fabfold.voxels.voxel_model import SUBDIVISION, Voxels

__all__ = ["PITCHES", "Refinement"]

#: Subvoxels along a voxel in the first round.
_COARSE = 10
#: Most subvoxels of a coarse scan: that of a longer model is made coarser.
_COARSE_LIMIT = 3_000_000
#: Pitches of the second round, in twentieths of the pitch that the first round chose.
PITCHES = (17, 18, 19, 20, 21)
#: Pitches of the third round, as shares of the best so far.
_NEARBY = (0.962, 0.975, 0.9875, 1.0125, 1.025)
#: Taken off the score for a cell too many once the planes are moved: more than a full cell brings.
_EXCESS_COST = 2.0
#: Rotations of which small turns are tried, and the standard deviation of these turns, degrees.
_CENTRES = 10
_SPREAD_DEG = 4.0
#: Rotations that a search for fewer cells takes over from one for more.
_AGAIN = 40
#: Translations along each axis.
_STEPS = 4
#: Pitches added at most because they divide a side of the model evenly.
_MOST_FITTED = 8
#: Relative difference under which two pitches are the same.
_SAME = 1e-6
#: Grids of a rotation whose planes are moved in the first round.
_MOVED = 4


def _shift(row: int) -> NDArray[np.int64]:
    """Translation steps of a row of :func:`rank_translations`."""
    return np.array([row // _STEPS**2, row // _STEPS % _STEPS, row % _STEPS])


class Refinement:
    """Search for placements of one model's grid: rank many, refine the best.

    Parameters
    ----------
    solid : Solid
        The model as it lies in `axes`.
    axes : (3, 3) float64 array
        Orthogonal axes, one a row, in which it is looked at: model axes, or such that turn with it.
    template : Template
        The target shape, which limits the number of cells of each colour.
    rotations : (r, 3, 3) float64 array
        Matrices from these axes to lattice axes, to be tried.
    energy : CellEnergy
        What a cell costs, and which cells are dropped.
    limit : int
        Subvoxels by which a plane may move.

    Attributes
    ----------
    rotations : (r, 3, 3) float64 array
        Those given, and the small turns that :meth:`rank` adds.
    family : list of int
        For each rotation the one that it is a small turn of; the given ones are their own.
    capacity : Capacity
        What the template holds.
    volume, extent : float
        Volume of the model and its longest side, in (cubic) model units.
    """

    def __init__(
        self,
        solid: Solid,
        axes: NDArray[np.float64],
        template: Template,
        rotations: NDArray[np.float64],
        energy: CellEnergy,
        limit: int,
    ) -> None:
        self.axes = axes
        self.vertices = np.asarray(solid.vertices, dtype=np.float64)
        self.faces = np.ascontiguousarray(solid.faces, dtype=np.int32)
        self.volume = solid.volume
        self.extent = float(np.ptp(self.vertices, axis=0).max())
        self.template = template
        self.capacity = Capacity(len(template), template.colours)
        self.rotations = rotations
        self.family = list(range(len(rotations)))
        self.energy = energy
        self.limit = limit

    def with_share(self, share: float) -> Refinement:
        """The same search for a part of the template only.

        Parameters
        ----------
        share : float
            Share of the template's cells of each colour, from 0 to 1.

        Returns
        -------
        Refinement
            With the same rotations.
        """
        other = copy(self)
        even, odd = (int(share * cells) for cells in self.capacity.colours)
        other.capacity = Capacity(even + odd, (even, odd))
        return other

    def _coarse(
        self, rotation: int, side: float
    ) -> tuple[NDArray[np.int32], float, NDArray[np.float64]]:
        """Table from the model's lower corner, side of its subvoxels, and that corner."""
        vertices = self.vertices @ self.rotations[rotation].T
        low, extent = vertices.min(axis=0), np.ptp(vertices, axis=0)
        side = max(side, float(np.cbrt(np.prod(extent) / _COARSE_LIMIT)), float(extent.max()) / 512)
        table = summed_volume((vertices - low) / side, self.faces, grid_shape(extent, side))
        return table, side, low

    def pitch_range(self) -> tuple[float, float]:
        """Smallest and largest pitch that can make sense.

        The smallest has every cell of the template full; or, since a chain of n cells that touch
        face to face is at most n cells long, has the model just as long. The largest cuts the model
        into halves, or leaves one cell in twenty full.

        Returns
        -------
        low, high : float
            In model units.
        """
        full = float(np.cbrt(self.volume / self.capacity.cells))
        low = max(full, self.extent / (self.capacity.cells + 2))
        return low, max(low, 2.75 * full, self.extent / 2)

    def pilot(self, max_loss: float, rotations: int = 9) -> tuple[float | None, str]:
        """A pitch that about fills the template, from the first rotations.

        Parameters
        ----------
        max_loss : float
            Largest share of the model's volume that may be lost in dropped cells; twice as much
            may be lost here, where no plane is moved yet.
        rotations : int
            How many rotations to look at.

        Returns
        -------
        pitch : float or None
            The median over the rotations of the smallest pitch that fits, model units; None if
            none does.
        nearest : str
            The placement with the least loss, in words.
        """
        low, high = self.pitch_range()
        found = []
        nearest = (1.0, "no cell with enough material")
        for index in range(min(rotations, len(self.rotations))):
            table, side, _ = self._coarse(index, low / 6)
            best = None
            pitch = high
            while pitch >= low:
                rows = rank_translations(table, pitch / side, 2, self.energy, self.capacity)
                rows = rows[(rows[:, 2] == 0) & (rows[:, 1] > 0)]
                if len(rows):
                    row = rows[np.argmin(rows[:, 3])]
                    lost = float(row[3])
                    if lost < nearest[0]:
                        nearest = (lost, f"{row[1]:.0f} cells with {100 * lost:.0f} % lost")
                    if lost <= 2 * max_loss:
                        best = pitch
                elif best is not None:
                    break
                pitch *= 0.97
            if best is not None:
                found.append(best)
        return (float(np.median(found)) if found else None), nearest[1]

    def rank(
        self, pitches: NDArray[np.float64], nearby: int, seed: int, progress: Progress
    ) -> list[RankedGrid]:
        """Rank grids of all rotations on coarse scans.

        Parameters
        ----------
        pitches : (p,) float64 array
            Sides of a voxel to try, model units.
        nearby : int
            Small turns of the best rotations to go on with; they are added to `rotations`.
        seed : int
            Of these turns.
        progress : Progress
            Hears of every sixteenth rotation.

        Returns
        -------
        list of RankedGrid
            The best two of each rotation, best first.
        """
        ranked: list[RankedGrid] = []
        given = len(self.rotations)
        count = given + nearby
        for index in range(count):
            if index == given:
                ranked.sort(key=lambda item: -item.score)
                best = list(dict.fromkeys(item.rotation for item in ranked))[:_CENTRES]
                self._turn(best, nearby, seed, _SPREAD_DEG)
            mine = self._ranked(index, pitches)
            for pitch in self._fitted(index, pitches):
                mine.extend(self._ranked(index, np.array([pitch])))
            mine.sort(key=lambda item: -item.score)
            ranked.extend(mine[:2])
            if index % 16 == 15 or index == count - 1:
                top = max(item.score for item in ranked)
                progress.update(0.4 * (index + 1) / count, f"{index + 1} rotations, best {top:.1f}")
        ranked.sort(key=lambda item: -item.score)
        return ranked

    def _turn(self, best: Sequence[int], count: int, seed: int, spread_deg: float) -> None:
        """Add small turns of rotations, each getting one after another."""
        turned = nearby_rotations(self.rotations[list(best)], count, seed, spread_deg)
        self.rotations = np.concatenate([self.rotations, turned])
        self.family.extend(self.family[best[turn % len(best)]] for turn in range(count))

    def rank_again(
        self, rotations: Sequence[int], pitches: NDArray[np.float64]
    ) -> list[RankedGrid]:
        """Rank grids of the rotations that did best in another search.

        Parameters
        ----------
        rotations : sequence of int
            Numbers of the rotations, best first; each may come several times.
        pitches : (p,) float64 array
            Sides of a voxel to try, model units.

        Returns
        -------
        list of RankedGrid
            The best one of each rotation, best first.
        """
        best = list(dict.fromkeys(rotations))[:_AGAIN]
        found = [
            max(self._ranked(rotation, pitches), key=lambda item: item.score) for rotation in best
        ]
        return sorted(found, key=lambda item: -item.score)

    def _ranked(self, rotation: int, pitches: NDArray[np.float64]) -> list[RankedGrid]:
        """The best grids of one rotation, their planes moved, on one coarse scan."""
        table, side, low = self._coarse(rotation, float(pitches.min()) / _COARSE)
        found: list[tuple[float, float, int]] = []
        for pitch in np.sort(pitches)[::-1].tolist():
            rows = rank_translations(table, pitch / side, _STEPS, self.energy, self.capacity)
            best = np.argsort(-rows[:, 0], kind="stable")[:2].tolist()
            found.extend((float(rows[row, 0]), pitch, row) for row in best)
            if rows[:, 2].min() > self.capacity.cells / 4:
                break  # smaller cells are only more
        found.sort(key=lambda entry: -entry[0])
        return [
            self._coarsely_moved(table, side, low, rotation, pitch, row)
            for _, pitch, row in found[:_MOVED]
        ]

    def _fitted(self, rotation: int, pitches: NDArray[np.float64]) -> list[float]:
        """Pitches about as large as `pitches` that divide a side of the model evenly.

        Only for the first two rotations, own axes and principal axes, where they can mean
        something: a part that is made of equal blocks is then cut between them.
        """
        if rotation > 1 or len(pitches) < 2:
            return []
        extent = np.ptp(self.vertices @ self.rotations[rotation].T, axis=0)
        cells = np.arange(1, self.capacity.cells + 1)
        sides = (extent[:, None] / cells).ravel()
        low, high = 0.85 * float(pitches.min()), 1.05 * float(pitches.max())
        within = np.sort(sides[(sides >= low) & (sides <= high)])
        # A third of one side may be half of another, but for the last digit.
        fresh = np.diff(within, prepend=0.0) > _SAME * within
        return [float(value) for value in within[fresh][:_MOST_FITTED]]

    def _coarsely_moved(
        self,
        table: NDArray[np.int32],
        side: float,
        low: NDArray[np.float64],
        rotation: int,
        pitch: float,
        row: int,
    ) -> RankedGrid:
        """Move the planes on a coarse scan, to foresee what the fine one will come to."""
        step = pitch / side
        start = -_shift(row) / _STEPS * step
        regular = [
            np.floor(
                start[axis] + step * np.arange(-1, np.ceil(size / step - TIE) + 3) + 0.5 + TIE
            ).astype(np.int64)
            for axis, size in enumerate(table.shape)
        ]
        limit = int(self.limit / SUBDIVISION * step)
        moved = optimise_offsets(table, (regular[0], regular[1], regular[2]), limit, self.energy, 3)
        fit = self._fit(table, moved, side, pitch)
        # The first planes are half a cell before lattice 0.
        x, y, z = (low + start * side + 0.5 * pitch).tolist()
        score = fit.score - _EXCESS_COST * fit.excess
        return RankedGrid(score, rotation, pitch, (x, y, z))

    def _fit(self, table: NDArray[np.int32], moved: Offsets, side: float, pitch: float) -> GridFit:
        """How well a grid fits after its planes were moved.

        Its score pays for the moves, and for material that the samples add or miss: flat faces
        along the grid can be off by half a subvoxel each, all to the same side.
        """
        widths = [np.diff(positions).astype(float) for positions in moved.planes]
        size = widths[0][:, None, None] * widths[1][:, None] * widths[2]
        fit = grid_fit(box_counts(table, moved.planes) / size, self.energy, self.capacity)
        missed = abs(float(table[-1, -1, -1]) * side**3 - self.volume) / pitch**3
        score = fit.score - missed - moved.cost_of_moves(self.energy)
        return replace(fit, score=round(score, SCORE_DIGITS))

    def refine(
        self, item: RankedGrid, pitches: tuple[int, ...], hold_origin: bool, depth: bool = False
    ) -> list[RefinedGrid]:
        """Scan at 20 x 20 x 20 and move the planes of several grids near a ranked one.

        Parameters
        ----------
        item : RankedGrid
            The grid to start from.
        pitches : tuple of int
            Sides of a voxel to try, in twentieths of the pitch of `item`.
        hold_origin : bool
            Try no other translation; `pitches` must be ``(20,)``.
        depth : bool
            Look at the ray depths of grids that fit.

        Returns
        -------
        list of RefinedGrid
            In the order in which they were tried; empty where a scan would take too much memory.
        """
        vertices = self.vertices @ self.rotations[item.rotation].T
        scan = fine_scan(vertices, self.faces, item, depth)
        if scan is None:
            return []
        results: list[RefinedGrid] = []
        for units in pitches:
            shifts = [np.zeros(3, dtype=np.int64)] if units == SUBDIVISION else []
            if not hold_origin:
                rows = rank_translations(scan.window, units, _STEPS, self.energy, self.capacity)
                for row in np.argsort(-rows[:, 0], kind="stable")[:2]:
                    step = np.floor(_shift(int(row)) * (units / _STEPS) + 0.5).astype(np.int64)
                    if not (units == SUBDIVISION and np.array_equal(step, scan.first)):
                        shifts.append(scan.first - step)
            results.extend(self._moved(scan, units, shift) for shift in shifts)
        return results

    def _moved(self, scan: FineScan, units: int, shift: NDArray[np.int64]) -> RefinedGrid:
        """Move the planes of the grid of pitch `units` whose first planes are at `shift`."""
        table, start, side = scan.table, scan.start, scan.side
        regular = []
        for axis in range(3):
            # One empty cell on each side: the outermost planes stand still, outside the model.
            count = -(-(table.shape[axis] - 1 - int(shift[axis])) // units)
            regular.append(shift[axis] + units * np.arange(-1, count + 2, dtype=np.int64))
        limit = self.limit * units // SUBDIVISION
        moved = optimise_offsets(table, (regular[0], regular[1], regular[2]), limit, self.energy)
        pitch = units * side
        fit = self._fit(table, moved, side, pitch)
        offsets = [moved.offsets[axis] / units for axis in range(3)]
        placement = Placement(
            rotation=self.rotations[scan.rotation],
            origin=start + shift * side + 0.5 * pitch,
            pitch=pitch,
            first=np.full(3, -1, dtype=np.int64),
            offsets=(offsets[0], offsets[1], offsets[2]),
        )
        depth = None
        if scan.material is not None and fit.excess == 0:
            depth = box_depth(scan.material, moved.planes, fit.cells)
        return RefinedGrid(fit, scan.rotation, placement, depth)

    def refine_pitch(self, grid: RefinedGrid, depth: bool = False) -> list[RefinedGrid]:
        """Try pitches in between, the grid scaled about the model's middle.

        Parameters
        ----------
        grid : RefinedGrid
            The grid to scale.
        depth : bool
            As in :meth:`refine`.

        Returns
        -------
        list of RefinedGrid
            In the order in which they were tried.
        """
        placement = grid.placement
        middle = self._middle(placement.rotation)
        found = []
        for factor in _NEARBY:
            x, y, z = (middle + factor * (placement.origin - middle)).tolist()
            item = RankedGrid(0.0, grid.rotation, placement.pitch * factor, (x, y, z))
            found.extend(self.refine(item, (SUBDIVISION,), False, depth))
        return found

    def refine_turned(
        self, grids: Sequence[RefinedGrid], count: int, seed: int, spread_deg: float
    ) -> list[RefinedGrid]:
        """Try small turns of grids about the model's middle; they are added to `rotations`.

        Parameters
        ----------
        grids : sequence of RefinedGrid
            The grids to turn.
        count : int
            Number of turns; each of the grids gets one after another.
        seed : int
            Of the turns.
        spread_deg : float
            Standard deviation of a turn about each axis, degrees.

        Returns
        -------
        list of RefinedGrid
            In the order in which they were tried, with ray depths.
        """
        first = len(self.rotations)
        self._turn([grid.rotation for grid in grids], count, seed, spread_deg)
        found = []
        for turn in range(count):
            placement = grids[turn % len(grids)].placement
            middle = self._middle(self.rotations[first + turn]) - self._middle(placement.rotation)
            x, y, z = (placement.origin + middle).tolist()
            item = RankedGrid(0.0, first + turn, placement.pitch, (x, y, z))
            found.extend(self.refine(item, (SUBDIVISION,), False, depth=True))
        return found

    def _middle(self, rotation: NDArray[np.float64]) -> NDArray[np.float64]:
        """Middle of the model's bounding box along the axes of a grid."""
        vertices = self.vertices @ rotation.T
        return np.asarray((vertices.min(axis=0) + vertices.max(axis=0)) / 2)

    def placement(self, grid: RefinedGrid) -> Placement:
        """The grid for the model as it was given.

        Parameters
        ----------
        grid : RefinedGrid
            One of this search.
        """
        return grid.placement.in_axes(self.axes)

    def cut(self, grid: RefinedGrid) -> tuple[Voxels | None, int, int]:
        """Cut the model; see :func:`fabfold.voxels.cut.cut_voxels`.

        Parameters
        ----------
        grid : RefinedGrid
            Where to cut.
        """
        voxels, kept, excess = cut_voxels(
            self.vertices, self.faces, grid.placement, self.energy, self.capacity
        )
        # Cut as it was looked at, so that what is a tie there is not decided otherwise here.
        return (None if voxels is None else voxels.in_axes(self.axes)), kept, excess
