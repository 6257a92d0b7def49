"""Boxes that a model could close further than the one it was given."""

from __future__ import annotations

from dataclasses import dataclass

from fabfold.errors import NoVoxelsError
from fabfold.kit.box_closure import closing_rate
from fabfold.lattice.shipped import load_template
from fabfold.lattice.template import Template
from fabfold.recipe.recipe import Recipe
from fabfold.solid.closed_solid import Solid
from fabfold.voxels.voxelize import voxelize

__all__ = ["BoxAdvice", "advised_box"]

#: Boxes that are looked at, by their sides in cells: of 27 to 125 cells, and nearly cubes.
_BOXES = ((3, 3, 3), (3, 3, 4), (3, 4, 4), (3, 4, 5), (4, 4, 4), (4, 4, 5), (4, 5, 5), (5, 5, 5))
#: Boxes of fewer or more cells than this share of those of the one given are left out.
_LEAST, _MOST = 0.5, 1.3
#: Below this share that the box can be closed to, another one is looked for.
_ENOUGH = 0.85
#: How much further another box must close, as a share, to be named.
_BETTER = 0.03
#: A short look at each: rotations, and grids whose planes are moved.
_PLACEMENTS, _SHORTLIST = 24, 4


@dataclass(frozen=True)
class BoxAdvice:
    """A box that could be closed further.

    Attributes
    ----------
    template : str
        Its name.
    at_most : float
        Share from 0 to 1 to which some voxels of the model could close it, whatever the joints.
    """

    template: str
    at_most: float

    def __str__(self) -> str:
        return f"{self.template} could close to {100 * self.at_most:.0f} %"


def advised_box(
    solid: Solid, recipe: Recipe, template: Template, at_most: float
) -> BoxAdvice | None:
    """Look shortly at other boxes, where a model cannot close its own.

    Parameters
    ----------
    solid : Solid
        The model as it is cut.
    recipe : Recipe
        Joints, weights and seed of the search.
    template : Template
        The box that the model was given.
    at_most : float
        Share to which it can be closed, from :class:`fabfold.kit.box_closure.BoxClosure`.

    Returns
    -------
    BoxAdvice or None
        The box with the best bound; None where none is better by more than a little, where the
        bound is good enough, and where the recipe says where the grid goes.
    """
    by_hand = (recipe.rotation, recipe.origin, recipe.pitch) != (None, None, None)
    if at_most >= _ENOUGH or by_hand or not template.name.startswith("box-"):
        return None
    best = None
    for sides in _BOXES:
        cells = sides[0] * sides[1] * sides[2]
        box = load_template("box-{}x{}x{}".format(*sides))
        if box.name == template.name or not _LEAST <= cells / len(template) <= _MOST:
            continue
        try:
            (voxels, *_) = voxelize(
                solid,
                box,
                seed=recipe.seed,
                placements=_PLACEMENTS,
                shortlist=_SHORTLIST,
                results=1,
                drop_below=recipe.drop_below,
            )
        except NoVoxelsError:
            continue
        found = BoxAdvice(box.name, closing_rate(recipe, box)(voxels))
        if found.at_most > (at_most + _BETTER if best is None else best.at_most):
            best = found
    return best
