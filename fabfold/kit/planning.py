"""Folding paths of the trees that a search found: the planner's, or one that forces find."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from fabfold.errors import NoFoldError
from fabfold.fold.motion import motion_of
from fabfold.kit.stages import PlannedTree
from fabfold.progress import Progress

if TYPE_CHECKING:
    from fabfold.tree.candidate import Candidate
    from fabfold.voxels.voxel_model import Voxels

__all__ = ["paths_by_forces", "planned_trees"]


def planned_trees(rounds: Iterable[list[tuple[Voxels, Candidate]]]) -> Iterator[PlannedTree]:
    """Every candidate of every round, best first, with the path that the planner found.

    Parameters
    ----------
    rounds : iterable of lists of (Voxels, Candidate)
        What each round found, best first.

    Yields
    ------
    PlannedTree
        Its path on the lattice as a motion.
    """
    for found in rounds:
        for voxels, candidate in found:
            motion = motion_of(candidate.tree, candidate.path)
            yield PlannedTree(voxels, candidate.tree, motion)


def paths_by_forces(
    trees: Iterable[PlannedTree], actions: Path | None, progress: Progress
) -> Iterator[PlannedTree]:
    """The same trees with paths that forces find (paper section 5).

    Parameters
    ----------
    trees : iterable of PlannedTree
        Best first.
    actions : Path or None
        File of what a person did; it is for the first tree alone.
    progress : Progress
        Hears of attempts.

    Yields
    ------
    PlannedTree
        Those that fold by forces.

    Raises
    ------
    NoFoldError
        If none does; it says why the last one does not.
    """
    from fabfold.physics.actions import read_actions
    from fabfold.physics.forced_path import physics_path

    done = () if actions is None else read_actions(actions)
    reason, found = "", False
    for planned in trees:
        try:
            path = physics_path(planned.tree, done, progress).path
        except NoFoldError as error:
            if done:
                raise
            reason = str(error)
            continue
        found = True
        yield PlannedTree(planned.voxels, planned.tree, motion_of(planned.tree, path))
        if done:
            return
    if not found:
        raise NoFoldError(reason)
