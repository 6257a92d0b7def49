"""How closed the box of a kit is, and how closed it could be with its voxels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import NoTreeError
from fabfold.kit.stages import PlannedTree
from fabfold.lattice.template import Template
from fabfold.recipe.recipe import Recipe
from fabfold.recipe.recipe_wishes import weights_of
from fabfold.tree.bound import ClosingBound, closed_at_most, closed_share
from fabfold.tree.problem import from_features
from fabfold.voxels.features import features
from fabfold.voxels.voxel_model import Voxels

__all__ = ["BoxClosure", "box_closure", "closing_rate", "open_faces"]


@dataclass(frozen=True)
class BoxClosure:
    """Shares from 0 to 1, see :mod:`fabfold.tree.bound`.

    Attributes
    ----------
    closed : float
        Share to which the box is closed: 1 less the mean depth behind a visible face.
    at_most : float
        Share to which these voxels could close it, whatever the joints.
    """

    closed: float
    at_most: float

    def __str__(self) -> str:
        return (
            f"the box is closed to {100 * self.closed:.0f} % "
            f"(at most {100 * self.at_most:.0f} % with these voxels)"
        )


def open_faces(
    recipe: Recipe, template: Template
) -> Callable[[NDArray[np.int32], NDArray[np.float64]], float]:
    """What voxels of a model are judged by before they are cut.

    Parameters
    ----------
    recipe : Recipe
        Joints.
    template : Template
        The target shape, as it is filled.

    Returns
    -------
    callable
        Takes cells and ray depths and returns the least number of faces of the box that stay open,
        see :meth:`fabfold.tree.bound.ClosingBound.open_faces`; 0 where voxels share cells, for
        which the bound does not hold.
    """
    if recipe.share:
        return lambda cells, depth: 0.0
    return ClosingBound(template, recipe.first_joints).open_faces


def closing_rate(recipe: Recipe, template: Template) -> Callable[[Voxels], float]:
    """How far voxelizations of a model could close the box.

    Parameters
    ----------
    recipe : Recipe
        Weights and joints.
    template : Template
        The target shape, as it is filled.

    Returns
    -------
    callable
        Takes voxels and returns the share of :func:`fabfold.tree.bound.closed_at_most`; 0 where no
        tree can join them.
    """

    def rate(voxels: Voxels) -> float:
        try:
            problem = from_features(
                voxels,
                features(voxels),
                template,
                weights_of(recipe),
                joints=recipe.every_joint,
                share=recipe.share,
            )
        except NoTreeError:
            return 0.0
        return closed_at_most(problem)

    return rate


def box_closure(recipe: Recipe, template: Template, planned: PlannedTree) -> BoxClosure | None:
    """How closed the box of a tree is.

    Parameters
    ----------
    recipe : Recipe
        Joints and weights of the search.
    template : Template
        The target shape, as it is filled.
    planned : PlannedTree
        The tree and its voxels.

    Returns
    -------
    BoxClosure or None
        None for a template that folds once more, whose visible faces are others in the end, where
        voxels share cells, for which the bound does not hold, and for blocks of full cells.
    """
    if template.creases or recipe.share or recipe.skin == "lattice":
        return None
    at_most = closing_rate(recipe, template)(planned.voxels)
    return BoxClosure(closed_share(planned.tree), at_most)
