"""Voxels of thin models: bosses for hinges first, a thicker model where these are not enough.

A model that voxelizes with room for hinges stays as it is. Where it voxelizes, but few of the faces
between voxels have material at an edge, hinges may stand on bosses. Where it does not, it is made
thicker in steps, and the first step that voxelizes is kept.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fabfold.errors import NoVoxelsError, RecipeError
from fabfold.lattice.template import Template
from fabfold.progress import Progress, SilentProgress
from fabfold.solid.closed_solid import Solid
from fabfold.solid.own_axes import own_axes
from fabfold.solid.thicken import Thickened, thickened
from fabfold.voxels.features import features
from fabfold.voxels.grid_placement import grid_rotations
from fabfold.voxels.offsets import CellEnergy
from fabfold.voxels.refinement import Refinement
from fabfold.voxels.voxel_model import BOSSES_NOTE, Voxels

__all__ = ["Cut", "cut_thick", "scarce_hinges"]

#: Least thicknesses that are tried one after another, in voxel sides.
STEPS = (0.2, 0.3, 0.4, 0.5)
#: Hinges are scarce where there are fewer edges with room for one than this for each voxel. Models
#: that fold well have 3.4 to 8; thin ones, such as a bicycle or a plate, 0 to 1.7.
_EDGES = 2.5
#: Lost shares of the volume with which a first estimate of the pitch is content.
_LOSSES = (0.1, 0.2, 0.3, 0.5)
#: Rotations that the estimate looks at.
_LOOKS = 9
#: An estimate is good where the thicker model's own is as near as this.
_SAME_PITCH = 0.1


@dataclass(frozen=True)
class Cut:
    """A model cut into voxels, and what was done to it before.

    Attributes
    ----------
    solid : Solid
        What was cut: the model, or a thicker one.
    options : list of Voxels
        As from :func:`fabfold.voxels.voxelize.voxelize`.
    wanted : float
        Least thickness that thin parts were given, in voxel sides; 0 where nothing was thickened.
    least : float
        Thickness of the thinnest parts before, in voxel sides.
    """

    solid: Solid
    options: list[Voxels]
    wanted: float = 0.0
    least: float = 0.0

    def notes(self, voxel_mm: float) -> tuple[str, ...]:
        """What was done, in a maker's words.

        Parameters
        ----------
        voxel_mm : float
            Printed side of a voxel, mm.
        """
        told = []
        if self.wanted:
            grown = (self.wanted - self.least) * voxel_mm
            told.append(
                f"thickened by {grown:.1f} mm at {voxel_mm:g} mm voxels: the model was too thin "
                f"for hinges ({self.least * voxel_mm:.1f} mm; it is at least "
                f"{self.wanted * voxel_mm:.1f} mm now)"
            )
        if any(voxels.bosses for voxels in self.options):
            told.append(BOSSES_NOTE)
        return tuple(told)


def cut_thick(
    solid: Solid,
    template: Template,
    cut: Callable[[Solid], list[Voxels]],
    *,
    thicken: float | None = None,
    seed: int = 0,
    drop_below: float = 0.04,
    pitch: float | None = None,
    progress: Progress | None = None,
) -> Cut:
    """Cut a model into voxels, thickened where it is too thin for that.

    Parameters
    ----------
    solid : Solid
        The model.
    template : Template
        The target shape.
    cut : callable
        Cuts a solid into voxels, best first; raises NoVoxelsError where it cannot.
    thicken : float, optional
        Least thickness of all parts, in voxel sides. Without it the model is thickened only where
        it cannot be cut as it is.
    seed : int
        Of the rotations that an estimate of the pitch looks at.
    drop_below : float
        Cells with less material than this share are dropped.
    pitch : float, optional
        Side of a voxel in model units, where it is given.
    progress : Progress, optional
        Hears of each step.

    Raises
    ------
    RecipeError
        If more than a whole voxel is asked for.
    NoVoxelsError
        If no thickness helps.
    """
    progress = progress or SilentProgress()
    if thicken is not None and not 0 < thicken <= 1:
        raise RecipeError(
            f"thicken: {thicken:.2g} voxel sides are asked for; it must be more than 0 and at most "
            "the side of a voxel"
        )
    refusal: NoVoxelsError | None = None
    if thicken is None:
        try:
            return Cut(solid, _with_bosses(cut(solid)))
        except NoVoxelsError as error:
            refusal = error
    scale = _PitchEstimate(template, seed, drop_below, pitch)
    for share in STEPS if thicken is None else (thicken,):
        progress.update(None, f"thickening to {share:.0%} of a voxel")
        made, side, fits = scale.thickened(solid, share)
        if not fits and refusal is not None:
            continue
        try:
            options = _with_bosses(cut(made.solid))
        except NoVoxelsError as error:
            refusal = error if thicken is not None else refusal
            continue
        if made.share == 0.0:
            return Cut(solid, options)
        side = options[0].pitch
        return Cut(made.solid, options, share, made.least / side)
    raise NoVoxelsError(
        f"{refusal}; thickened to {100 * (thicken or STEPS[-1]):.0f} % of a voxel it is no better"
    )


def scarce_hinges(voxels: Voxels) -> bool:
    """Whether few edges between the voxels have material for a hinge.

    Parameters
    ----------
    voxels : Voxels
        Cells and their material.

    Returns
    -------
    bool
        True for thin models: bars that cross the faces in their middle, walls between two planes.
    """
    found = features(replace(voxels, bosses=False))
    return bool(found.hinge.sum() < _EDGES * len(voxels))


def _with_bosses(options: Sequence[Voxels]) -> list[Voxels]:
    """The same voxels, with bosses where hinges are scarce and there is a contact to hold one."""
    return [
        replace(voxels, bosses=True) if len(voxels) > 1 and scarce_hinges(voxels) else voxels
        for voxels in options
    ]


class _PitchEstimate:
    """The pitch at which a model would fill a template, from a quick look; remembers the last."""

    def __init__(
        self, template: Template, seed: int, drop_below: float, pitch: float | None
    ) -> None:
        self.template = template
        self.seed = seed
        self.energy = CellEnergy(drop_below=drop_below)
        self.given = pitch
        self.last = pitch

    def look(self, solid: Solid) -> tuple[float, bool]:
        """Side of a voxel in model units, and whether little of the volume is lost."""
        axes = own_axes(solid.vertices, solid.faces)
        solid = solid.in_axes(axes)
        rotations = grid_rotations(_LOOKS, self.seed, solid.vertices)
        refinement = Refinement(solid, axes, self.template, rotations, self.energy, 4)
        for loss in _LOSSES:
            found, _ = refinement.pilot(loss)
            if found is not None:
                return found, loss == _LOSSES[0]
        low, high = refinement.pitch_range()
        return float(np.sqrt(low * high)), False

    def thickened(self, solid: Solid, share: float) -> tuple[Thickened, float, bool]:
        """A solid at least `share` of a voxel thick, that voxel's side, and whether it fits."""
        if self.given is not None:
            return thickened(solid, share * self.given), self.given, True
        side = self.last or self.look(solid)[0]
        for _ in range(3):
            made = thickened(solid, share * side)
            before, (side, fits) = side, self.look(made.solid)
            if abs(side / before - 1) < _SAME_PITCH:
                break
        self.last = side
        return made, side, fits
