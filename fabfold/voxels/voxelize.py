"""Cut a solid into voxels that a template can hold (paper section 3)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fabfold.errors import NoVoxelsError, RecipeError
from fabfold.lattice.template import Template
from fabfold.progress import Progress, SilentProgress
from fabfold.solid.closed_solid import Solid
from fabfold.solid.regions import Region
from fabfold.voxels.cut import cut_voxels
from fabfold.voxels.grid_placement import grid_rotations
from fabfold.voxels.offsets import CellEnergy
from fabfold.voxels.refinement import PITCHES, Ranked, Refinement, Tried
from fabfold.voxels.region_cells import spread
from fabfold.voxels.voxel_model import SUBDIVISION, Voxels

__all__ = ["MAX_LOSS", "shares_of", "voxelize"]

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
#: Two voxelizations whose sorted fills differ by less than this on average are the same.
_SAME_FILL = 0.012
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
    placements: int = 300,
    shortlist: int = 64,
    results: int = 8,
    drop_below: float = 0.04,
    max_offset: int = 4,
    max_loss: float = MAX_LOSS,
    regions: Sequence[Region] = (),
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
    drop_below : float
        Cells with less material than this share are dropped.
    max_offset : int
        Twentieths of a voxel by which a plane may move and a spacing change, 0 to 4.
    max_loss : float
        Largest share of the model's volume that may be lost in dropped cells.
    regions : sequence of Region
        That shall lie in few cells; each cell more costs as much as a sliver.
    progress : Progress, optional

    Returns
    -------
    list of Voxels
        Different ones, best first: most total fill, less 0.5 a sliver, less lost material. The
        counts of both checkerboard colours fit the template, and the voxels hang together through
        printed contacts. Of four, three leave a part of the template free, each more than the one
        before, see :func:`shares_of`; not where `pitch` or `origin` is given.

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
    if rotation is not None:
        rotations = _checked_rotation(rotation)[None]
    elif centre is not None:
        rotations = np.eye(3)[None]
    else:
        nearby = int(_NEARBY * placements)
        rotations = grid_rotations(placements - nearby, seed, np.asarray(solid.vertices))
    rounds = Refinement(solid, template, rotations, CellEnergy(drop_below=drop_below), max_offset)
    if not rounds.volume > 0:
        raise NoVoxelsError("the model encloses no volume; repair it first")
    _refuse_thin(rounds, pitch)

    free = pitch is None and centre is None
    pitches = np.array([pitch]) if pitch is not None else _pitches(rounds, max_loss, centre)
    if centre is None:
        ranked = rounds.first(pitches, nearby, seed, progress)
    else:
        x, y, z = centre.tolist()
        ranked = [Ranked(0.0, 0, float(value), (x, y, z)) for value in pitches]
    shares = shares_of(len(template))[:results] if free else (1.0,)
    chosen: list[Tried] = []
    done: list[tuple[float, Voxels]] = []
    for place, share in enumerate(shares):
        count = len(range(place, results, len(shares)))
        here, some = rounds, ranked if centre is not None else ranked[:shortlist]
        if place > 0:
            here = rounds.with_share(share)
            some = here.again(ranked, pitches * share ** (-1 / 3))[: max(1, shortlist // _FEWER)]
        found = _tried(here, some, free, centre is not None, regions)
        done += _finish(here, found, chosen, count, max_loss, regions)
        if place == 0:
            full = found
        progress.update(0.4 + 0.6 * (place + 1) / len(shares), f"{len(done)} voxelizations")
    if not done:
        raise NoVoxelsError(_nearest(rounds, full, max_loss))
    return [voxels for _, voxels in sorted(done, key=lambda pair: pair[0])]


def shares_of(cells: int) -> tuple[float, ...]:
    """Shares of a template's cells, largest first, that voxelizations shall fill."""
    if cells < _LEAST:
        return (1.0,)
    least = max(0.5, 1.0 - _FREE * cells ** (1 / 3))
    return tuple(float(share) for share in np.linspace(1.0, least, _SIZES))


def _tried(
    rounds: Refinement,
    ranked: Sequence[Ranked],
    free: bool,
    hold_origin: bool,
    regions: Sequence[Region],
) -> list[Tried]:
    """Grids near those ranked best, with their planes moved, best first."""
    units = PITCHES if free else (SUBDIVISION,)
    found: list[Tried] = []
    for item in ranked:
        found.extend(rounds.second(item, units, hold_origin))
    found.sort(key=lambda tried: tried.order)
    if free:
        for step in _LARGER:
            if found and found[0].verdict.excess == 0:
                break
            for item in ranked[:_REFINED]:
                found.extend(rounds.second(item, step, False))
            found.sort(key=lambda tried: tried.order)
        for tried in _different(found)[:_REFINED]:
            found.extend(rounds.third(tried))
        found.sort(key=lambda tried: tried.order)
    if regions:
        price = {id(tried): spread(regions, tried.placement) for tried in found}
        found.sort(key=lambda tried: (tried.order[0], tried.order[1] + price[id(tried)]))
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


def _refuse_thin(rounds: Refinement, pitch: float | None) -> None:
    """End at once where all material together cannot fill one voxel."""
    low = rounds.pitch_range()[0] if pitch is None else pitch
    filled = rounds.volume / low**3
    if filled < 1.0:
        raise NoVoxelsError(
            f"with voxels of {low:.4g} model units"
            + (" (the smallest that make sense)" if pitch is None else "")
            + f", all of the model together fills {filled:.2g} of one voxel: "
            + ("the model is too thin to be folded; thicken it" if pitch is None else "lower pitch")
        )
    if rounds.extent / low > rounds.capacity.cells + 2:
        raise NoVoxelsError(
            f"with voxels of {low:.4g} model units the model is {rounds.extent / low:.0f} voxels "
            f"long, and template {rounds.template.name} has only {rounds.capacity.cells}: "
            "raise pitch, or use a larger template"
        )


def _pitches(
    rounds: Refinement, max_loss: float, centre: NDArray[np.float64] | None
) -> NDArray[np.float64]:
    """Pitches worth trying, from a quick look at a few rotations."""
    pilot, nearest = rounds.pilot(max_loss)
    if pilot is None:
        low, high = rounds.pitch_range()
        raise NoVoxelsError(
            f"no voxel size from {low:.4g} to {high:.4g} model units suits template "
            f"{rounds.template.name} ({rounds.capacity.cells} cells): the best of a first look is "
            f"{nearest}. The model is too thin for this template: thicken it, lower drop_below, "
            "or use a larger template"
        )
    if centre is None:
        return np.asarray(pilot * 1.03 ** np.arange(-5, 3))
    return np.asarray(pilot * 1.01 ** np.arange(-18, 13))


def _different(found: list[Tried]) -> list[Tried]:
    """Those that fit, one for each rotation."""
    seen: set[int] = set()
    best = []
    for tried in found:
        if tried.verdict.excess == 0 and tried.rotation not in seen:
            seen.add(tried.rotation)
            best.append(tried)
    return best


def _shortlist(
    rounds: Refinement, found: Sequence[Tried], before: Sequence[Tried], count: int
) -> list[Tried]:
    """Up to `count` that fit, best first, different from each other and from those `before`."""
    chosen: list[Tried] = []
    used: dict[int, int] = {}
    for tried in found:
        fills = tried.verdict.fills
        family = rounds.family[tried.rotation]
        if tried.verdict.excess > 0 or used.get(family, 0) == 2:
            continue
        if any(
            len(fills) == len(other.verdict.fills)
            and np.abs(fills - other.verdict.fills).mean() < _SAME_FILL
            for other in [*before, *chosen]
        ):
            continue
        chosen.append(tried)
        used[family] = used.get(family, 0) + 1
        if len(chosen) == count:
            break
    return chosen


def _finish(
    rounds: Refinement,
    found: Sequence[Tried],
    chosen: list[Tried],
    count: int,
    max_loss: float,
    regions: Sequence[Region],
) -> list[tuple[float, Voxels]]:
    """Cut the best placements and check them: price, the lower the better, and voxels.

    What is taken is added to `chosen`; what is like an earlier one is passed over.
    """
    done: list[tuple[float, Voxels]] = []
    # Sampling the warped model can still cost a cell its place, so some more than are wanted.
    for tried in _shortlist(rounds, found, chosen, _TRIES) or found[:_TRIES]:
        voxels, _, _ = cut_voxels(
            rounds.vertices, rounds.faces, tried.placement, rounds.energy, rounds.capacity
        )
        if voxels is None or voxels.lost_volume > max_loss:
            continue
        price = spread(regions, tried.placement) - voxels.energy["score"]
        done.append((price, voxels))
        chosen.append(tried)
        if len(done) == count:
            break
    return done


def _nearest(rounds: Refinement, found: Sequence[Tried], max_loss: float) -> str:
    """Why none of the placements will do."""
    nearest = "no cell with enough material"
    for tried in found[:1]:
        voxels, kept, excess = cut_voxels(
            rounds.vertices, rounds.faces, tried.placement, rounds.energy, rounds.capacity
        )
        if voxels is None:
            nearest = f"{kept} cells, {excess} of them too many" if kept else nearest
        else:
            nearest = (
                f"{kept} cells, with {100 * voxels.lost_volume:.0f} % of the volume lost "
                f"(allowed: {100 * max_loss:.0f} %)"
            )
    even, odd = rounds.capacity.colours
    return (
        f"no placement of the grid fits template {rounds.template.name} ({even} + {odd} cells "
        f"by checkerboard colour); the best has {nearest}. "
        "Try a larger pitch or template, another seed, more placements, or a thicker model"
    )
