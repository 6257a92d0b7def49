"""From the words of a recipe to wishes and weights of the tree search."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fabfold.attempt import Attempt
from fabfold.errors import RecipeError
from fabfold.joinery.model import Joinery
from fabfold.recipe import Recipe
from fabfold.solid.model import Solid
from fabfold.tree.problem import Weights
from fabfold.tree.wishes import Keep, Wishes
from fabfold.voxels.model import Voxels
from fabfold.voxels.regions import (
    area_of,
    owners,
    parse_keep,
    parse_shape,
    region_of,
    to_lattice,
)

__all__ = ["granted", "make_wishes", "printed_share", "weights_of", "wished"]

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
        keeps.append(Keep(text, area_of(solid, what), side))
    seen: dict[str, str] = {}
    for text in recipe.keep:
        part, _, there = text.strip().rpartition(":")
        if seen.setdefault(part, there) != there:
            raise RecipeError(
                f"--keep: {part} cannot be seen on {seen[part]} and on {there} of the box at once"
            )
    regions = [
        region_of(solid, parse_shape(text, "--protect"), "--protect") for text in recipe.protect
    ]
    return Wishes(
        keeps=tuple(keeps),
        keep_weight=recipe.keep_weight,
        regions=tuple(regions),
        void=recipe.void,
    )


def printed_share(points: NDArray[np.float64], voxels: Voxels, joinery: Joinery) -> float:
    """Share of points of the model (k, 3) that lie in printed material.

    Hinge barrels that pass by on the folding path need grooves, and bodies stand apart by a gap:
    both can take a little even of a protected region.
    """
    from fabfold.voxels.scan import occupancy

    holder = owners(voxels, points)
    held = points[holder >= 0]
    if not len(held):
        return 0.0
    at = np.array(joinery.origin_mm) + joinery.voxel_mm * to_lattice(voxels, held)
    step = joinery.voxel_mm / 80
    low = at.min(axis=0) - step
    size = np.ceil((at.max(axis=0) - low) / step).astype(int) + 1
    step *= max(1.0, float(np.cbrt(np.prod(size.astype(float)) / 20_000_000)))
    x, y, z = (np.ceil((at.max(axis=0) - low) / step).astype(int) + 1).tolist()
    index = tuple(np.floor((at - low) / step).astype(int).T)
    inside = np.zeros(len(at), dtype=bool)
    for body in joinery.bodies:
        apart = (body.vertices.min(axis=0) > at.max(axis=0)) | (
            body.vertices.max(axis=0) < at.min(axis=0)
        )
        if not apart.any():
            grid = occupancy((body.vertices - low) / step, body.faces, (x, y, z))
            inside |= np.asarray(grid)[index]
    return float(inside.mean())


def granted(
    wishes: Wishes, attempt: Attempt, joinery: Joinery | None = None
) -> list[dict[str, Any]]:
    """What became of each wish in a tree and its bodies: figures and a line of text."""
    found = wishes.report(attempt.voxels, attempt.tree)
    if joinery is not None:
        entries = {entry["wish"]: entry for entry in found}
        for region in wishes.regions:
            points = np.concatenate(region.pieces)
            share = printed_share(points, attempt.voxels, joinery)
            entry = entries[f"protect {region.text}"]
            entry["printed"] = round(share, 4)
            entry["text"] += f"; grooves and gaps leave {share:.1%} of it"
    return found


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
