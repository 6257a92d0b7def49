"""From the words of a recipe to wishes and weights of the tree search."""

from __future__ import annotations

from typing import Any

from fabfold.errors import RecipeError
from fabfold.recipe.recipe import Recipe, make_recipe
from fabfold.solid.closed_solid import Solid
from fabfold.solid.regions import parse_keep, parse_region, sample_region, sample_surface
from fabfold.tree.catalogue import JointChoice
from fabfold.tree.problem import Weights
from fabfold.wishes.keep import Keep
from fabfold.wishes.wish_list import Wishes

__all__ = ["default_weights", "make_wishes", "weights_of", "wished"]

#: How far the knob between hinges and surface reaches: at its ends one weight is this many times
#: greater, and the other as many times smaller.
REACH = 4.0


def default_weights() -> Weights:
    """Weights of a recipe that says nothing of them: those of the paper."""
    return weights_of(make_recipe(model="sample:car", template="box-3x4x4"))


def weights_of(recipe: Recipe) -> Weights:
    """Weights of the two energies, moved by the knob ``prefer``."""
    factor = REACH ** (2.0 * recipe.prefer - 1.0)
    return Weights(
        surface=recipe.surface_weight * factor,
        single=recipe.single_weight / factor,
        double=recipe.double_weight / factor,
    )


def make_wishes(recipe: Recipe, solid: Solid) -> Wishes:
    """The wishes of a recipe, sampled on its model.

    Raises
    ------
    RecipeError
        If a region does not touch the model, or a wish contradicts another.
    """
    keeps = []
    for text in recipe.keep:
        what, side = parse_keep(text, "--keep")
        keeps.append(Keep(text, sample_surface(solid, what), side))
    seen: dict[str, str] = {}
    for text in recipe.keep:
        part, _, there = text.strip().rpartition(":")
        if seen.setdefault(part, there) != there:
            raise RecipeError(
                f"--keep: {part} cannot be seen on {seen[part]} and on {there} of the box at once"
            )
    regions = [
        sample_region(solid, parse_region(text, "--protect"), "--protect")
        for text in recipe.protect
    ]
    return Wishes(
        keeps=tuple(keeps),
        keep_weight=recipe.keep_weight,
        regions=tuple(regions),
        void=recipe.void,
    )


def wished(recipe: Recipe, joints: JointChoice | None = None) -> list[Any]:
    """All of a recipe that its wishes come from (JSON-ready); empty where there is none.

    Parameters
    ----------
    recipe : Recipe
        The recipe.
    joints : str, optional
        Joints in place of the recipe's.
    """
    fields = {
        "keep": list(recipe.keep),
        "keep_weight": recipe.keep_weight if recipe.keep else 0.0,
        "protect": list(recipe.protect),
        "joints": joints or recipe.joints,
        "double_weight": recipe.double_weight,
        "joints_inside": recipe.joints_inside,
        "void": recipe.void,
        "prefer": recipe.prefer,
        "share": recipe.share,
    }
    usual = {name: Recipe.model_fields[name].default for name in fields}
    usual |= {"keep": [], "keep_weight": 0.0, "protect": []}
    return [[name, value] for name, value in fields.items() if value != usual[name]]
