"""Find a folding path by forces: alone, or as a person's recorded actions say."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import NoFoldError
from fabfold.physics.actions import Action, Carve, Match, Unfold
from fabfold.physics.lattice_path import lattice_path
from fabfold.physics.unfolding import Unfolding
from fabfold.progress import Progress, SilentProgress
from fabfold.tree.fold_tree import FoldTree

__all__ = ["PhysicsPath", "path_of", "physics_path"]

#: Time steps of unfolding and of matching.
_UNFOLD, _MATCH = 3000, 2000
#: Attempts, each with two more voxels carved, where nobody helps.
_ATTEMPTS = 12


@dataclass(frozen=True)
class PhysicsPath:
    """A path that forces found.

    Attributes
    ----------
    path : (m, 2) int32 array
        One row a move: hinge, and signed quarter turns about its positive axis.
    actions : tuple of Action
        What was done to find it; the same actions find it again.
    carved : tuple of int
        Voxels that were carved on the way.
    attempts : int
        How often it began.
    """

    path: NDArray[np.int32]
    actions: tuple[Action, ...]
    carved: tuple[int, ...]
    attempts: int = 1


def physics_path(
    tree: FoldTree, actions: Sequence[Action] = (), progress: Progress | None = None
) -> PhysicsPath:
    """Unfold A and B by forces until they meet, and make a path of quarter turns of it.

    Without actions, the shapes are unfolded and matched; where that fails, the two voxels that
    press on each other hardest are carved, and it starts over.

    Parameters
    ----------
    tree : FoldTree
        What is to fold.
    actions : sequence of Action, optional
        What a person did; nothing else is done then.
    progress : Progress, optional
        Hears of attempts, and of how far A and B are apart.

    Returns
    -------
    PhysicsPath
        The same for the same arguments.

    Raises
    ------
    NoFoldError
        If the shapes do not meet, or the motion leaves turns that one hinge at a time cannot make.
    RecipeError
        If an action names a voxel that the tree has not.
    """
    progress = progress or SilentProgress()
    if actions:
        unfolding = Unfolding(tree)
        for number, action in enumerate(actions):
            progress.update(number / len(actions), f"action {number + 1}: {action.do}")
            unfolding.do(action)
        return path_of(unfolding)
    carved: list[int] = []
    reason = ""
    for attempt in range(_ATTEMPTS):
        unfolding = Unfolding(tree)
        told = f"attempt {attempt + 1}, {len(carved)} voxels carved"
        plan: list[Action] = [Carve(voxel=voxel) for voxel in carved]
        for action in (*plan, Unfold(steps=_UNFOLD), Match(steps=_MATCH)):
            progress.update(attempt / _ATTEMPTS, f"{told}: {action.do}")
            unfolding.do(action)
        try:
            found = path_of(unfolding)
        except NoFoldError as error:
            reason = str(error)
            carved += _in_the_way(unfolding)
            continue
        progress.update(1.0, f"{len(found.path)} moves, {told}")
        return replace(found, attempts=attempt + 1)
    raise NoFoldError(
        f"forces alone do not fold this tree in {_ATTEMPTS} attempts; the last one: {reason}. "
        "Help it with pins, pushes and carving (fabfold studio), or leave out --method physics"
    )


def _in_the_way(unfolding: Unfolding) -> list[int]:
    """Two more voxels to carve: the whole ones of the pair that presses hardest."""
    for _, one, other in unfolding.pressed():
        whole = [voxel for voxel in (one, other) if voxel not in unfolding.carved]
        if whole:
            return whole
    rest = [v for v in range(len(unfolding.tree.source)) if v not in unfolding.carved]
    return rest[:2]


def path_of(unfolding: Unfolding) -> PhysicsPath:
    """The path where A and B have met.

    Raises
    ------
    NoFoldError
        If they have not, or the motion leaves turns that one hinge at a time cannot make.
    """
    if not unfolding.met:
        raise NoFoldError(
            f"A and B do not meet: a hinge stands {unfolding.difference_deg:.0f}° apart in them"
        )
    path, left = lattice_path(unfolding.tree, unfolding.way_deg("A"), unfolding.way_deg("B"))
    if path is None:
        raise NoFoldError(
            f"A and B meet, but {left} of the turns cannot be made one hinge at a time"
        )
    return PhysicsPath(path, tuple(unfolding.actions), tuple(sorted(unfolding.carved)))
