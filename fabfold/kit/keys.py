"""Keys of the stages: digests of everything that the result of each depends on."""

from __future__ import annotations

from dataclasses import astuple
from typing import Any

from fabfold.lattice.template import Template
from fabfold.printing.print_mode import PrintMode
from fabfold.recipe.recipe import Recipe
from fabfold.recipe.recipe_wishes import wished
from fabfold.store import stage_key
from fabfold.version import __version__

__all__ = ["check_key", "fold_key", "join_key", "solid_key", "voxels_key"]


def solid_key(recipe: Recipe) -> str:
    """Key of the solid: the model as it was given."""
    return stage_key(__version__, recipe.model, recipe.sha256, recipe.object, "dialects")


def voxels_key(recipe: Recipe, template: Template) -> str:
    """Key of the voxelizations in a template, as it is filled."""
    return stage_key(
        __version__,
        recipe.sha256 or recipe.model,
        recipe.object,
        template.content,
        recipe.seed,
        [recipe.rotation, recipe.origin, recipe.pitch, recipe.drop_below],
        ["thicken", "off" if recipe.thicken == "off" else recipe.thickness],
        ["closing", recipe.first_joints, recipe.share, recipe.surface_weight > 0],
        *([list(recipe.protect)] if recipe.protect else []),
    )


def fold_key(recipe: Recipe, template: Template, mark: list[Any]) -> str:
    """Key of the best tree and its path.

    Parameters
    ----------
    recipe : Recipe
        Every choice that the kit depends on.
    template : Template
        The target shape, as it is filled.
    mark : list
        What the rounds add to the recipe, see :meth:`fabfold.search.rounds.Rounds.mark`.
    """
    asked = wished(recipe)
    return stage_key(
        voxels_key(recipe, template),
        [recipe.surface_weight, recipe.single_weight, recipe.effort, recipe.rounds],
        *([["wished", *asked], ["pick", recipe.pick]] if asked or recipe.pick else []),
        *([] if recipe.closed is None else [["closed", recipe.closed]]),
        *([["forces", recipe.actions_sha256]] if recipe.method == "physics" else []),
        mark,
    )


def join_key(recipe: Recipe, template: Template, mode: PrintMode, mark: list[Any]) -> str:
    """Key of the printed bodies.

    Parameters
    ----------
    recipe, template, mark
        As of :func:`fold_key`.
    mode : PrintMode
        How the kit is printed, with the clearance that the recipe asks for.
    """
    return stage_key(
        fold_key(recipe, template, mark),
        recipe.voxel_mm,
        mode.profile.model_dump(mode="json"),
        [
            mode.name,
            *([mode.pin] if mode.apart else []),
            *astuple(mode.hold),
            mode.blocks,
            # Plates that would keep powder in are left out.
            mode.fill and "unshut",
        ],
        "walls",
    )


def check_key(recipe: Recipe, template: Template, mode: PrintMode, mark: list[Any]) -> str:
    """Key of the checks; parameters as of :func:`join_key`."""
    pose = [] if mode.apart or mode.pose == "a" else [["pose", mode.pose]]
    return stage_key(
        join_key(recipe, template, mode, mark), "check", "weighed, each second degree", *pose
    )
