"""Find good placements of the voxel grid (paper section 3).

Three rounds, each on fewer placements and with more care: every rotation is scanned coarsely once,
and all pitches and translations are read off its summed volume table; the best are scanned at
20 x 20 x 20 and get their planes moved; the best of those are warped, sampled and checked.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import NoVoxelsError, RecipeError
from fabfold.lattice import Template
from fabfold.progress import Progress, SilentProgress
from fabfold.solid.model import Solid
from fabfold.voxels.cut import Placement, cut_voxels
from fabfold.voxels.model import SUBDIVISION, Voxels
from fabfold.voxels.offsets import CellEnergy, optimise_offsets
from fabfold.voxels.placement import Capacity, grid_rotations, judge, rank_translations
from fabfold.voxels.scan import box_counts, summed_volume

__all__ = ["MAX_LOSS", "voxelize"]

#: A voxelization that loses more than this share of the model's volume is no solution.
MAX_LOSS = 0.10
#: Subvoxels along a voxel in the first round.
_COARSE = 10
#: Subvoxels that a scan may hold; longer models are scanned more coarsely.
_COARSE_LIMIT = 3_000_000
_FINE_LIMIT = 40_000_000
#: Pitches tried in the second round, in subvoxels of the pitch that the first round chose.
_PITCHES = (17, 18, 19, 20, 21)


@dataclass(frozen=True)
class _Ranked:
    score: float
    rotation: int
    pitch: float
    origin: tuple[float, float, float]


def _turned(
    solid_vertices: NDArray[np.float64], rotation: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Rotated vertices, and their smallest and largest corner."""
    vertices = solid_vertices @ rotation.T
    return vertices, vertices.min(axis=0), vertices.max(axis=0)


def _grid_shape(extent: NDArray[np.float64], side: float) -> tuple[int, int, int]:
    x, y, z = np.maximum(np.ceil(extent / side).astype(int), 1).tolist()
    return (x, y, z)


class _Search:
    """One run: the inputs, and the rounds in order."""

    def __init__(
        self,
        solid: Solid,
        template: Template,
        energy: CellEnergy,
        rotations: NDArray[np.float64],
        limit: int,
    ) -> None:
        self.vertices = np.asarray(solid.vertices, dtype=np.float64)
        self.faces = np.ascontiguousarray(solid.faces, dtype=np.int32)
        self.volume = solid.volume
        self.template = template
        self.energy = energy
        self.capacity = Capacity(len(template), template.colours)
        self.rotations = rotations
        self.limit = limit

    def _coarse_table(self, rotation: int, side: float) -> tuple[NDArray[np.int32], float]:
        """Summed volume table from the model's lower corner, and the side of its subvoxels."""
        vertices, low, high = _turned(self.vertices, self.rotations[rotation])
        extent = high - low
        side = max(side, float(np.cbrt(np.prod(extent) / _COARSE_LIMIT)), float(extent.max()) / 512)
        shape = _grid_shape(extent, side)
        return summed_volume((vertices - low) / side, self.faces, shape), side

    def pitch_range(self) -> tuple[float, float]:
        """Smallest and largest pitch worth a look: all cells full, and 1 in 20 of them full."""
        full = float(np.cbrt(self.volume / len(self.template)))
        extent = max(float(np.ptp(self.vertices, axis=0).max()), 1e-300)
        # A chain of n cells that touch face to face spans n cells in all, over the three axes.
        return max(full, extent / (len(self.template) + 2)), 2.75 * full

    def pilot_pitch(self, rotations: int = 9) -> float | None:
        """A pitch that about fills the template: the median over the first rotations."""
        low, high = self.pitch_range()
        found = []
        for index in range(min(rotations, len(self.rotations))):
            table, side = self._coarse_table(index, low / 6)
            pitch = max(high, low)
            best = None
            for _ in range(64):
                rows = rank_translations(table, pitch / side, 2, self.energy, self.capacity)
                fits = rows[rows[:, 2] == 0]
                if len(fits) and fits[:, 0].max() > 0:
                    best = pitch
                if pitch < low or (best is not None and not len(fits)):
                    break
                pitch *= 0.97
            if best is not None:
                found.append(best)
        return float(np.median(found)) if found else None

    def first_round(
        self,
        pitches: NDArray[np.float64],
        origin: NDArray[np.float64] | None,
        progress: Progress,
        steps: int = 4,
    ) -> list[_Ranked]:
        """Rank placements by regular grids; the best two of each rotation."""
        ranked: list[_Ranked] = []
        for index, rotation in enumerate(self.rotations):
            if origin is not None:
                ranked.extend(
                    _Ranked(0.0, index, float(p), (origin[0], origin[1], origin[2]))
                    for p in pitches
                )
                continue
            table, side = self._coarse_table(index, float(pitches.min()) / _COARSE)
            low = (self.vertices @ rotation.T).min(axis=0)
            mine = []
            for pitch in pitches:
                rows = rank_translations(table, pitch / side, steps, self.energy, self.capacity)
                for row in np.argsort(-rows[:, 0], kind="stable")[:2]:
                    shift = np.array([row // steps**2, row // steps % steps, row % steps]) / steps
                    # The first planes are at low - shift * pitch, half a cell before lattice 0.
                    x, y, z = (low + (0.5 - shift) * pitch).tolist()
                    mine.append(_Ranked(float(rows[row, 0]), index, float(pitch), (x, y, z)))
            mine.sort(key=lambda item: -item.score)
            ranked.extend(mine[:2])
            if index % 16 == 15:
                best = max(item.score for item in ranked)
                progress.update(
                    0.4 * (index + 1) / len(self.rotations),
                    f"{index + 1} rotations of the grid; best score {best:.1f}",
                )
        ranked.sort(key=lambda item: -item.score)
        return ranked

    def second_round(
        self, item: _Ranked, pitches: tuple[int, ...], fixed_origin: bool
    ) -> list[tuple[float, int, Placement]]:
        """Scan one placement finely and move its planes; (score, excess, placement) for each."""
        rotation = self.rotations[item.rotation]
        vertices, low, high = _turned(self.vertices, rotation)
        side = item.pitch / SUBDIVISION
        # The table begins on a plane of the grid, so that planes are at whole subvoxels.
        corner = np.array(item.origin) - 0.5 * item.pitch
        start = corner + np.floor((low - corner) / item.pitch - 1e-9) * item.pitch
        shape = _grid_shape(high - start, side)
        if int(np.prod(shape)) > _FINE_LIMIT:
            return []
        table = summed_volume((vertices - start) / side, self.faces, shape)
        inside = np.floor((low - start) / side).astype(np.int64)
        size = np.array(shape) - inside
        results = []
        for units in pitches:
            shifts: list[NDArray[np.int64]] = []
            if units == SUBDIVISION:
                shifts.append(np.zeros(3, dtype=np.int64))
            if not fixed_origin:
                window = np.ascontiguousarray(table[inside[0] :, inside[1] :, inside[2] :])
                rows = rank_translations(window, float(units), 4, self.energy, self.capacity)
                for row in np.argsort(-rows[:, 0], kind="stable")[:2]:
                    step = np.array([row // 16, row // 4 % 4, row % 4])
                    shifts.append(inside - np.floor(step * units / 4 + 0.5).astype(np.int64))
            for shift in shifts:
                regular = []
                for axis in range(3):
                    count = -(-int(inside[axis] + size[axis] - shift[axis]) // units)
                    planes = shift[axis] + units * np.arange(-1, count + 2)
                    regular.append(planes.astype(np.int64))
                limit = self.limit * units // SUBDIVISION
                moved = optimise_offsets(
                    table, (regular[0], regular[1], regular[2]), limit, self.energy
                )
                widths = [np.diff(planes).astype(float) for planes in moved.planes]
                cell = widths[0][:, None, None] * widths[1][None, :, None] * widths[2]
                verdict = judge(box_counts(table, moved.planes) / cell, self.energy, self.capacity)
                pitch = units * side
                first = np.array([-1, -1, -1], dtype=np.int64)
                offsets = tuple(moved.offsets[axis] / units for axis in range(3))
                results.append(
                    (
                        verdict.score,
                        verdict.excess,
                        Placement(
                            rotation=rotation,
                            origin=start + shift * side + 0.5 * pitch,
                            pitch=pitch,
                            first=first,
                            offsets=(offsets[0], offsets[1], offsets[2]),
                        ),
                    )
                )
        return results


def _checked_rotation(rotation: NDArray[np.float64]) -> NDArray[np.float64]:
    matrix = np.asarray(rotation, dtype=np.float64)
    if (
        matrix.shape != (3, 3)
        or not np.allclose(matrix @ matrix.T, np.eye(3), atol=1e-6)
        or np.linalg.det(matrix) < 0
    ):
        raise RecipeError(
            "the grid's rotation must be a 3 by 3 rotation matrix (orthonormal, determinant +1)"
        )
    return matrix


def voxelize(
    solid: Solid,
    template: Template,
    *,
    seed: int = 0,
    rotation: NDArray[np.float64] | None = None,
    origin: NDArray[np.float64] | None = None,
    pitch: float | None = None,
    placements: int = 200,
    shortlist: int = 30,
    results: int = 8,
    drop_below: float = 0.04,
    max_offset: int = 4,
    max_loss: float = MAX_LOSS,
    progress: Progress | None = None,
) -> list[Voxels]:
    """Cut a solid into voxels that the template can hold.

    Parameters
    ----------
    solid : Solid
    template : Template
    seed : int
        Of the random rotations.
    rotation : (3, 3) array, optional
        From model axes to lattice axes, instead of searching.
    origin : (3,) array, optional
        Point that is the centre of a cell: lattice axes, model units.
    pitch : float, optional
        Side of a voxel in model units.
    placements : int
        Rotations to try.
    shortlist : int
        Placements that get the full treatment.
    results : int
        Most voxelizations to return.
    drop_below : float
        Cells with less material than this share are dropped.
    max_offset : int
        Subvoxels by which a plane may move, and a spacing change; 0 to 4.
    max_loss : float
        Largest share of the volume that may be lost in dropped cells.
    progress : Progress, optional

    Returns
    -------
    list of Voxels
        Different ones, best first: most total fill, less 0.5 a sliver, less lost material.

    Raises
    ------
    RecipeError
        If a parameter cannot be used.
    NoVoxelsError
        If no placement fits the template.

    References
    ----------
    Zhou, Sueda, Matusik, Shamir: Boxelization, section 3.
    """
    progress = progress or SilentProgress()
    if placements < 1 or shortlist < 1 or results < 1:
        raise RecipeError("placements, shortlist and results must be at least 1")
    if not 0.0 <= drop_below < 0.5:
        raise RecipeError(f"drop_below must be from 0 to 0.5 of a cell, not {drop_below}")
    if not 0 <= max_offset <= 4:
        raise RecipeError(f"max_offset must be 0 to 4 subvoxels, not {max_offset}")
    if pitch is not None and not (np.isfinite(pitch) and pitch > 0):
        raise RecipeError(f"the grid's pitch must be greater than 0, not {pitch}")
    if rotation is not None:
        rotations = _checked_rotation(rotation)[None]
    elif origin is not None:
        rotations = np.eye(3)[None]
    else:
        rotations = grid_rotations(placements, seed, np.asarray(solid.vertices))
    energy = CellEnergy(drop_below=drop_below)
    search = _Search(solid, template, energy, rotations, max_offset)
    pitches = _pitches(search, pitch)
    ranked = search.first_round(
        pitches, None if origin is None else np.asarray(origin, dtype=float), progress
    )

    found: list[tuple[float, int, Placement]] = []
    units = (SUBDIVISION,) if pitch is not None else _PITCHES
    chosen = ranked if origin is not None else ranked[:shortlist]
    for index, item in enumerate(chosen):
        found.extend(search.second_round(item, units, origin is not None))
        progress.update(
            0.4 + 0.4 * (index + 1) / len(chosen), f"{index + 1} placements with planes moved"
        )
    found.sort(key=lambda entry: (entry[1] > 0, -entry[0]))
    return _finish(search, found, results, max_loss, progress)


def _pitches(search: _Search, pitch: float | None) -> NDArray[np.float64]:
    if pitch is not None:
        return np.array([float(pitch)])
    low, high = search.pitch_range()
    if search.volume / low**3 < 1.0:
        raise NoVoxelsError(
            f"the model is too thin: cut into {len(search.template)} voxels, all of its material "
            f"fills {search.volume / low**3:.2g} of a single voxel; thicken the model"
        )
    pilot = search.pilot_pitch()
    if pilot is None:
        raise NoVoxelsError(
            f"no voxel size from {low:.4g} to {max(low, high):.4g} model units gives cells with "
            f"enough material that fit template {search.template.name} "
            f"({len(search.template)} cells): its parts are too thin; thicken the model, "
            "lower drop_below, or use a larger template"
        )
    return np.asarray(pilot * 1.03 ** np.arange(-5, 3))


def _finish(
    search: _Search,
    found: list[tuple[float, int, Placement]],
    results: int,
    max_loss: float,
    progress: Progress,
) -> list[Voxels]:
    """Cut the best placements, check them, and keep different ones."""
    done: list[Voxels] = []
    tried = 0
    nearest: str = ""
    for _score, _excess, placement in found:
        if len(done) >= results or tried >= 3 * results:
            break
        same = [v for v in done if np.array_equal(v.rotation, placement.rotation)]
        if len(same) >= 2 or any(abs(v.pitch / placement.pitch - 1) < 0.02 for v in same):
            continue
        tried += 1
        voxels, excess = cut_voxels(
            search.vertices, search.faces, placement, search.energy, search.capacity
        )
        if voxels is None:
            nearest = nearest or f"{excess} cells too many for its colours"
        elif voxels.lost_volume > max_loss:
            nearest = nearest or (
                f"{len(voxels)} cells, with {100 * voxels.lost_volume:.0f} % of the volume lost "
                f"(allowed: {100 * max_loss:.0f} %)"
            )
        else:
            done.append(voxels)
            progress.update(0.8 + 0.2 * len(done) / results, f"{len(voxels)} voxels")
    if not done:
        even, odd = search.capacity.colours
        raise NoVoxelsError(
            f"no placement of the grid fits template {search.template.name} "
            f"({even} + {odd} cells by checkerboard colour); the best had "
            f"{nearest or 'no cell with enough material'}: try another seed, more placements, "
            "a larger pitch or template, or a thicker model"
        )
    done.sort(key=lambda voxels: -voxels.energy["score"])
    return done
