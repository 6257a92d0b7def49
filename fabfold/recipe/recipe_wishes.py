"""From the words of a recipe to wishes and weights of the tree search."""

from __future__ import annotations

from typing import Any

from fabfold.errors import RecipeError
from fabfold.recipe.recipe import Recipe
from fabfold.solid.closed_solid import Solid
from fabfold.solid.regions import parse_keep, parse_region, sample_region, sample_surface
from fabfold.tree.problem import Weights
from fabfold.wishes.terms import Keep, Wishes

__all__ = ["make_wishes", "weights_of", "wished"]

#: How far the knob between hinges and surface reaches: at its ends one weight is this many times
#: greater, and the other as many times smaller.
REACH = 4.0


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


def wished(recipe: Recipe) -> list[Any]:
    """All of a recipe that its wishes come from (JSON-ready); empty where there is none."""
    fields = {
        "keep": list(recipe.keep),
        "keep_weight": recipe.keep_weight if recipe.keep else 0.0,
        "protect": list(recipe.protect),
        "joints": recipe.joints,
        "double_weight": recipe.double_weight,
        "joints_inside": recipe.joints_inside,
        "void": recipe.void,
        "prefer": recipe.prefer,
        "share": recipe.share,
    }
    idle = {"keep": [], "keep_weight": 0.0, "protect": [], "joints_inside": False, "void": 0.0}
    usual = {**idle, "prefer": 0.5, "joints": "S", "double_weight": 0.12, "share": False}
    return [[name, value] for name, value in fields.items() if value != usual[name]]
