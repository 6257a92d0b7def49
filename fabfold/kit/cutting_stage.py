"""The stage that cuts the model into voxels, as its recipe asks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from fabfold.kit.box_closure import open_faces
from fabfold.lattice.rotations import rotation_of_degrees
from fabfold.lattice.template import Template
from fabfold.progress import Progress
from fabfold.recipe.recipe import Recipe
from fabfold.solid.closed_solid import Solid
from fabfold.solid.regions import Region
from fabfold.voxels.thickening import Cut, cut_thick
from fabfold.voxels.voxel_model import Voxels
from fabfold.voxels.voxelize import fill_shares, voxelize

__all__ = ["cut_model"]

#: What a hasty cut looks at: placements, and those of them whose planes are moved.
_HASTY = {"placements": 24, "shortlist": 8}


def cut_model(
    recipe: Recipe,
    solid: Solid,
    template: Template,
    regions: Sequence[Region],
    progress: Progress,
    *,
    hasty: bool = False,
) -> Cut:
    """Cut a model into voxels, thickened as the recipe asks.

    Parameters
    ----------
    recipe : Recipe
        Seed, grid and thickness.
    solid : Solid
        The model.
    template : Template
        The target shape, as it is filled.
    regions : sequence of Region
        Parts of the model that shall lie in few cells.
    progress : Progress
        Hears of the stages of the search.
    hasty : bool
        Two voxelizations out of few placements in a second or two, a full and a roomy one, instead
        of those that are worth a search.

    Raises
    ------
    NoVoxelsError
        If no placement of the grid fits.
    """
    looks: dict[str, Any] = {"open_faces": open_faces(recipe, template)}
    if hasty:
        shares = fill_shares(len(template))
        looks = {**_HASTY, "results": 2, "shares": (shares[0], *shares[1:][-1:])}

    def cut(model: Solid) -> list[Voxels]:
        return voxelize(
            model,
            template,
            seed=recipe.seed,
            rotation=None if recipe.rotation is None else rotation_of_degrees(recipe.rotation),
            origin=recipe.origin,
            pitch=recipe.pitch,
            drop_below=recipe.drop_below,
            regions=regions,
            progress=progress,
            **looks,
        )

    if recipe.thicken == "off":
        found = Cut(solid, cut(solid))
    else:
        found = cut_thick(
            solid,
            template,
            cut,
            thicken=recipe.thickness,
            seed=recipe.seed,
            drop_below=recipe.drop_below,
            pitch=recipe.pitch,
            progress=progress,
        )
    progress.update(1.0, ", ".join([f"{len(found.options[0])} voxels", *_told(found, recipe)]))
    return found


def _told(cut: Cut, recipe: Recipe) -> list[str]:
    return [note.partition(":")[0] for note in cut.notes(recipe.voxel_mm)]
