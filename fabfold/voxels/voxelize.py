"""Cut a solid into voxels that a template can hold (paper section 3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fabfold.errors import NoVoxelsError, RecipeError
from fabfold.lattice.template import Template
from fabfold.progress import Progress, SilentProgress
from fabfold.solid.closed_solid import Solid
from fabfold.solid.own_axes import own_axes
from fabfold.solid.regions import Region
from fabfold.voxels.grid_placement import RankedGrid, grid_rotations
from fabfold.voxels.offsets import CellEnergy
from fabfold.voxels.openness import OpenFaces, Openness, grids_of_less_openness, two_of_a_family
from fabfold.voxels.refined_grid import RefinedGrid, unlike
from fabfold.voxels.refinement import PITCHES, Refinement
from fabfold.voxels.region_cells import region_cut_cost
from fabfold.voxels.voxel_model import SUBDIVISION, Voxels

__all__ = ["LARGE", "MAX_LOSS", "fill_shares", "paying_sizes", "voxelize"]

#: A voxelization that loses more than this share of the model's volume is no solution.
MAX_LOSS = 0.10
#: Share of the rotations that are small turns of the best of the others.
_NEARBY = 0.5
#: Placements of the second round that are refined in the third.
_REFINED = 6
#: Pitches to go on with, in twentieths of the ranked ones, where none of the second round fits.
_LARGER = ((22, 23), (24, 25), (26, 28), (30, 33), (36, 40))
#: Placements of one size that are cut, until as many as wanted will do.
_TRIES = 16
#: Cells of all placements of one size together whose openness is judged, of templates of up to 64
#: cells; of larger ones fewer, for a judgement takes the longer.
_JUDGED_CELLS = 8192
#: Templates of more cells are large: what folds in them mostly leaves much of them free.
LARGE = 72
#: Sizes that are worth a search where a template is not large: emptier ones close the box less.
_PAYING = 2
#: Grids of the least openness whose rotations other sizes start from.
_PASSED_ON = 10
#: Voxelizations of different size that are looked for, and how much of a template the smallest
#: leaves free: this, times the cube root of the number of its cells. Folding into a box that is
#: full to the last cell is hard, and the harder the larger it is; with gaps, which may lie inside,
#: it is a matter of seconds.
_SIZES = 4
_FREE = 0.05
#: Templates of fewer cells have no room to leave.
_LEAST = 16
#: Placements of a roomy voxelization whose planes are moved, against those of a full one.
_FEWER = 4


def voxelize(
    solid: Solid,
    template: Template,
    *,
    seed: int = 0,
    rotation: ArrayLike | None = None,
    origin: ArrayLike | None = None,
    pitch: float | None = None,
    placements: int = 160,
    shortlist: int = 64,
    results: int = 8,
    shares: Sequence[float] | None = None,
    drop_below: float = 0.04,
    max_offset: int = 4,
    max_loss: float = MAX_LOSS,
    regions: Sequence[Region] = (),
    open_faces: OpenFaces | None = None,
    progress: Progress | None = None,
) -> list[Voxels]:
    """Cut a solid into voxels that the template can hold.

    Parameters
    ----------
    solid : Solid
        The model.
    template : Template
        The target shape, which limits the number of cells of each checkerboard colour.
    seed : int
        Of the random rotations.
    rotation : (3, 3) array, optional
        From model axes to lattice axes, instead of searching.
    origin : (3,) array, optional
        A point that is the centre of a cell: lattice axes, model units. Without `rotation`, the
        lattice axes are the model's.
    pitch : float, optional
        Side of a voxel in model units. With all three given, the grid is used as it is.
    placements : int
        Rotations to try; half of them are small turns of the best of the other half.
    shortlist : int
        Placements whose planes are moved.
    results : int
        Most voxelizations to return.
    shares : sequence of float, optional
        Shares of the template's cells that they shall fill, 1 first; by default those of
        :func:`fill_shares`, as many as there are results.
    drop_below : float
        Cells with less material than this share are dropped.
    max_offset : int
        Twentieths of a voxel by which a plane may move and a spacing change, 0 to 4.
    max_loss : float
        Largest share of the model's volume that may be lost in dropped cells.
    regions : sequence of Region
        Parts of the model that shall lie in few cells; each cell more costs as much as a sliver.
    open_faces : callable, optional
        Takes the (n, 3) cells of voxels and their (n, 6) ray depths and says how many faces of the
        box must stay open. Of the sizes that pay, those of the least openness are taken then, see
        :mod:`fabfold.voxels.openness`, and not those of most fill. Not where there are `regions`.
    progress : Progress, optional
        Hears of the stages of the search.

    Returns
    -------
    list of Voxels
        Different ones, best first: of least openness, then those of most total fill, less 0.5 a
        sliver, less lost material. The counts of both checkerboard colours fit the template, and
        the voxels hang together through printed contacts. Of four, three leave a part of the
        template free, each more than the one before, see :func:`fill_shares`; not where `pitch` or
        `origin` is given.

    Raises
    ------
    RecipeError
        If a parameter cannot be used.
    NoVoxelsError
        If no placement fits; the message has the best that was found.

    References
    ----------
    Zhou, Sueda, Matusik, Shamir: Boxelization, section 3.
    """
    progress = progress or SilentProgress()
    _check_numbers(placements, shortlist, results, drop_below, max_offset, max_loss, pitch)
    centre = None if origin is None else _checked_origin(origin)
    nearby = 0
    # A grid that is free to turn is looked for in axes that turn with the model.
    axes = np.eye(3)
    if rotation is not None:
        rotations = _checked_rotation(rotation)[None]
    elif centre is not None:
        rotations = np.eye(3)[None]
    else:
        nearby = int(_NEARBY * placements)
        axes = own_axes(solid.vertices, solid.faces)
        solid = solid.in_axes(axes)
        rotations = grid_rotations(placements - nearby, seed, solid.vertices)
    refinement = Refinement(
        solid, axes, template, rotations, CellEnergy(drop_below=drop_below), max_offset
    )
    if not refinement.volume > 0:
        raise NoVoxelsError("the model encloses no volume; repair it first")
    _refuse_thin(refinement, pitch)

    free = pitch is None and centre is None
    pitches = np.array([pitch]) if pitch is not None else _pitches(refinement, max_loss, centre)
    if centre is None:
        ranked = refinement.rank(pitches, nearby, seed, progress)
    else:
        x, y, z = centre.tolist()
        ranked = [RankedGrid(0.0, 0, float(value), (x, y, z)) for value in pitches]
    turns = [item.rotation for item in ranked]
    shares = (shares or fill_shares(len(template)))[:results] if free else (1.0,)
    openness = None if open_faces is None or regions else Openness(open_faces)
    paying = paying_sizes(len(template))
    # One of each size, and more of those that pay.
    counts = [1] * len(shares)
    for more in range(results - len(shares)):
        counts[more % min(len(paying), len(shares))] += 1
    chosen: list[RefinedGrid] = []
    done: list[_CutGrid] = []
    for place, share in enumerate(shares):
        count = counts[place]
        here, some = refinement, ranked if centre is not None else ranked[:shortlist]
        if place > 0:
            here = refinement.with_share(share)
            some = here.rank_again(turns, pitches * share ** (-1 / 3))
            some = some[: max(1, shortlist // _FEWER)]
        judge = openness if place in paying else None
        found = _refined_grids(here, some, free, centre is not None, regions, judge is not None)
        if judge and free and rotation is None and place == 0:
            better = grids_of_less_openness(here, unlike(found, [], _judged(here)), judge, seed)
            found = sorted(found + better, key=lambda grid: grid.sort_key)
            # The other sizes start from these turns too.
            turns = [grid.rotation for grid in better[:_PASSED_ON]] + turns
        done += _finish(here, found, chosen, count, max_loss, regions, judge)
        if place == 0:
            full = found
        progress.update(0.4 + 0.6 * (place + 1) / len(shares), f"{len(done)} voxelizations")
    if not done:
        raise NoVoxelsError(_nearest(refinement, full, max_loss))
    return [cut.voxels for cut in sorted(done, key=lambda cut: cut.sort_key)]


def fill_shares(cells: int) -> tuple[float, ...]:
    """Shares of a template's cells that voxelizations shall fill.

    Parameters
    ----------
    cells : int
        Number of cells of the template.

    Returns
    -------
    tuple of float
        Descending from 1, in equal steps; only 1 for a small template.
    """
    if cells < _LEAST:
        return (1.0,)
    least = max(0.5, 1.0 - _FREE * cells ** (1 / 3))
    return tuple(float(share) for share in np.linspace(1.0, least, _SIZES))


def paying_sizes(cells: int) -> range:
    """Sizes of voxelization that are searched before the others.

    Parameters
    ----------
    cells : int
        Number of cells of the template.

    Returns
    -------
    range
        Their places in :func:`fill_shares`: the fullest two, of large templates all.
    """
    return range(len(fill_shares(cells)) if cells > LARGE else _PAYING)


def _refined_grids(
    refinement: Refinement,
    ranked: Sequence[RankedGrid],
    free: bool,
    hold_origin: bool,
    regions: Sequence[Region],
    depth: bool,
) -> list[RefinedGrid]:
    """Grids near those ranked best, with their planes moved, best first."""
    units = PITCHES if free else (SUBDIVISION,)
    found: list[RefinedGrid] = []
    for item in ranked:
        found.extend(refinement.refine(item, units, hold_origin, depth))
    found.sort(key=lambda grid: grid.sort_key)
    if free:
        for step in _LARGER:
            if found and found[0].fit.excess == 0:
                break
            for item in ranked[:_REFINED]:
                found.extend(refinement.refine(item, step, False, depth))
            found.sort(key=lambda grid: grid.sort_key)
        for grid in _different(found)[:_REFINED]:
            found.extend(refinement.refine_pitch(grid, depth))
        found.sort(key=lambda grid: grid.sort_key)
    if regions:
        price = {id(grid): region_cut_cost(regions, refinement.placement(grid)) for grid in found}
        found.sort(key=lambda grid: (grid.sort_key[0], grid.sort_key[1] + price[id(grid)]))
    return found


def _check_numbers(
    placements: int,
    shortlist: int,
    results: int,
    drop_below: float,
    max_offset: int,
    max_loss: float,
    pitch: float | None,
) -> None:
    if placements < 1 or shortlist < 1 or results < 1:
        raise RecipeError("placements, shortlist and results must be at least 1")
    if not 0.0 <= drop_below < 0.5:
        raise RecipeError(f"drop_below must be from 0 to under 0.5 of a cell, not {drop_below}")
    if not 0 <= max_offset <= 4:
        raise RecipeError(f"max_offset must be 0 to 4 twentieths of a voxel, not {max_offset}")
    if not 0.0 <= max_loss <= 1.0:
        raise RecipeError(f"max_loss must be a share from 0 to 1, not {max_loss}")
    if pitch is not None and not (np.isfinite(pitch) and pitch > 0):
        raise RecipeError(f"the grid's pitch must be greater than 0, not {pitch}")


def _checked_rotation(rotation: ArrayLike) -> NDArray[np.float64]:
    matrix = np.asarray(rotation, dtype=np.float64)
    if (
        matrix.shape != (3, 3)
        or not np.allclose(matrix @ matrix.T, np.eye(3), atol=1e-6)
        or np.linalg.det(matrix) < 0
    ):
        raise RecipeError(
            "the grid's rotation must be a 3 by 3 rotation matrix: orthonormal, determinant +1"
        )
    return matrix


def _checked_origin(origin: ArrayLike) -> NDArray[np.float64]:
    point = np.asarray(origin, dtype=np.float64)
    if point.shape != (3,) or not np.isfinite(point).all():
        raise RecipeError("the grid's origin must be three finite numbers")
    return point


def _refuse_thin(refinement: Refinement, pitch: float | None) -> None:
    """End at once where all material together cannot fill one voxel."""
    low = refinement.pitch_range()[0] if pitch is None else pitch
    filled = refinement.volume / low**3
    if filled < 1.0:
        raise NoVoxelsError(
            f"with voxels of {low:.4g} model units"
            + (" (the smallest that make sense)" if pitch is None else "")
            + f", all of the model together fills {filled:.2g} of one voxel: "
            + ("the model is too thin to be folded; thicken it" if pitch is None else "lower pitch")
        )
    if refinement.extent / low > refinement.capacity.cells + 2:
        raise NoVoxelsError(
            f"with voxels of {low:.4g} model units the model is {refinement.extent / low:.0f} "
            f"voxels long, and template {refinement.template.name} has only "
            f"{refinement.capacity.cells}: raise pitch, or use a larger template"
        )


def _pitches(
    refinement: Refinement, max_loss: float, centre: NDArray[np.float64] | None
) -> NDArray[np.float64]:
    """Pitches worth trying, from a quick look at a few rotations."""
    pilot, nearest = refinement.pilot(max_loss)
    if pilot is None:
        low, high = refinement.pitch_range()
        raise NoVoxelsError(
            f"no voxel size from {low:.4g} to {high:.4g} model units suits template "
            f"{refinement.template.name} ({refinement.capacity.cells} cells): the best of a first "
            f"look is {nearest}. The model is too thin for this template: thicken it, lower "
            "drop_below, or use a larger template"
        )
    if centre is None:
        return np.asarray(pilot * 1.03 ** np.arange(-5, 3))
    return np.asarray(pilot * 1.01 ** np.arange(-18, 13))


def _different(found: list[RefinedGrid]) -> list[RefinedGrid]:
    """The best grid that fits of each rotation."""
    seen: set[int] = set()
    best = []
    for grid in found:
        if grid.fit.excess == 0 and grid.rotation not in seen:
            seen.add(grid.rotation)
            best.append(grid)
    return best


@dataclass(frozen=True)
class _CutGrid:
    """A grid that was cut: its openness and its price, the lower the better, and its voxels."""

    openness: float
    price: float
    grid: RefinedGrid
    voxels: Voxels

    @property
    def sort_key(self) -> tuple[float, float]:
        """Orders cuts, best first."""
        return (self.openness, self.price)


def _judged(refinement: Refinement) -> int:
    """How many grids of one size are judged by their openness."""
    cells = refinement.capacity.cells
    return max(_TRIES, int(_JUDGED_CELLS * min(1.0, 64 / cells)) // cells)


def _finish(
    refinement: Refinement,
    found: Sequence[RefinedGrid],
    chosen: list[RefinedGrid],
    count: int,
    max_loss: float,
    regions: Sequence[Region],
    openness: Openness | None,
) -> list[_CutGrid]:
    """Cut the best grids and check the voxels, until `count` will do.

    Grids that are taken are added to `chosen`; a grid like an earlier one is passed over.
    """
    if openness is None:
        grids = unlike(found, chosen, len(found))
    else:
        grids = sorted(unlike(found, chosen, _judged(refinement)), key=openness)
    # Sampling the warped model can still cost a cell its place, so some more than are wanted.
    grids = two_of_a_family(refinement, grids)[:_TRIES]
    done: list[_CutGrid] = []
    for grid in grids or found[:_TRIES]:
        voxels, _, _ = refinement.cut(grid)
        if voxels is None or voxels.lost_volume > max_loss:
            continue
        price = region_cut_cost(regions, refinement.placement(grid)) - voxels.energy["score"]
        judged = np.inf if openness is None or grid.depth is None else openness(grid)
        done.append(_CutGrid(judged, price, grid, voxels))
        chosen.append(grid)
        if len(done) == count:
            break
    return done


def _nearest(refinement: Refinement, found: Sequence[RefinedGrid], max_loss: float) -> str:
    """Why none of the placements will do."""
    nearest = "no cell with enough material"
    for grid in found[:1]:
        voxels, kept, excess = refinement.cut(grid)
        if voxels is None:
            nearest = f"{kept} cells, {excess} of them too many" if kept else nearest
        else:
            nearest = (
                f"{kept} cells, with {100 * voxels.lost_volume:.0f} % of the volume lost "
                f"(allowed: {100 * max_loss:.0f} %)"
            )
    even, odd = refinement.capacity.colours
    return (
        f"no placement of the grid fits template {refinement.template.name} ({even} + {odd} cells "
        f"by checkerboard colour); the best has {nearest}. "
        "Try a larger --pitch or --template, another --seed, or a thicker model"
    )
