"""Keys of the stages: digests of everything that the result of each depends on."""

from __future__ import annotations

from typing import Any

from fabfold.lattice.template import Template
from fabfold.printing.profiles import Profile
from fabfold.recipe.recipe import Recipe
from fabfold.recipe.recipe_wishes import wished
from fabfold.store import stage_key
from fabfold.version import __version__

__all__ = ["check_key", "join_key", "solid_key", "voxels_key"]


def solid_key(recipe: Recipe) -> str:
    """Key of the solid: the model as it was given."""
    return stage_key(__version__, recipe.model, recipe.sha256, "paint")


def voxels_key(recipe: Recipe, template: Template) -> str:
    """Key of the voxelizations in a template, as it is filled."""
    return stage_key(
        __version__,
        recipe.sha256 or recipe.model,
        template.content,
        recipe.seed,
        [recipe.rotation, recipe.origin, recipe.pitch, recipe.drop_below],
        *([list(recipe.protect)] if recipe.protect else []),
    )


def join_key(recipe: Recipe, template: Template, profile: Profile, mark: list[Any]) -> str:
    """Key of the printed bodies.

    Parameters
    ----------
    recipe : Recipe
    template : Template
    profile : Profile
    mark : list
        What the rounds add to the recipe, see :meth:`fabfold.search.rounds.Rounds.mark`.
    """
    asked = wished(recipe)
    return stage_key(
        voxels_key(recipe, template),
        [recipe.surface_weight, recipe.single_weight, recipe.effort, recipe.rounds],
        *([["wished", *asked], ["pick", recipe.pick]] if asked or recipe.pick else []),
        recipe.voxel_mm,
        profile.model_dump(mode="json"),
        mark,
    )


def check_key(recipe: Recipe, template: Template, profile: Profile, mark: list[Any]) -> str:
    """Key of the checks; parameters as of :func:`join_key`."""
    return stage_key(join_key(recipe, template, profile, mark), "check")
