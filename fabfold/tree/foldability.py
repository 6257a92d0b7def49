"""What the tree search asks of the folding stage, without importing it."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from fabfold.tree.system import HingeSystem

__all__ = ["Foldability", "Outlook"]


class Outlook(NamedTuple):
    """How far a system folds.

    Attributes
    ----------
    left : (h,) int32 array
        Quarter turns of each hinge that could not be resolved; all zero when it folds.
    guide : (g, 5) int32 array
        The steps found, complete or not: twice the middle of the hinge's edge in A, its
        axis, and 1 or -1 for a quarter turn forth or back.
    """

    left: NDArray[np.int32]
    guide: NDArray[np.int32]


class Foldability(Protocol):
    """Judge of hinge systems; every answer is deterministic for the same arguments."""

    def stuck(self, system: HingeSystem) -> tuple[int, int]:
        """Count hinges that the closure test cannot move.

        A hinge is movable when every pair of bodies that blocks its first turn has an already
        movable hinge on its tree path; the test repeats until nothing changes. It costs about
        0.1 ms and is necessary, not sufficient.

        Returns
        -------
        (int, int)
            Hinges not movable from shape A, and from shape B.
        """

    def stuck_hinges(self, system: HingeSystem) -> NDArray[np.bool_]:
        """Which hinges the closure test cannot move: where to change the tree.

        Returns
        -------
        (2, h) bool array
            From shape A and from shape B.
        """

    def outlook(
        self, system: HingeSystem, expansions: int, guide: NDArray[np.int32] | None = None
    ) -> Outlook:
        """What the planner could not resolve, and the steps that it found.

        Parameters
        ----------
        system : HingeSystem
        expansions : int
            The planner gives up after this many expansions without progress.
        guide : (g, 5) int32 array, optional
            Steps found for a similar system, to be tried first.
        """

    def unresolved(self, system: HingeSystem, expansions: int) -> float:
        """Share of the path that the planner could not find.

        Parameters
        ----------
        system : HingeSystem
        expansions : int
            The planner gives up after this many expansions without progress.

        Returns
        -------
        float
            0.0 when it folds, up to 1.0 when nothing moves.
        """

    def path(
        self, system: HingeSystem, guide: NDArray[np.int32] | None = None
    ) -> NDArray[np.int32] | None:
        """Folding path after shortcutting, or None where the planner finds none.

        Parameters
        ----------
        system : HingeSystem
        guide : (g, 5) int32 array, optional
            Steps that :meth:`outlook` found for the system, to be tried first.

        Returns
        -------
        (m, 2) int32 array or None
            One row a move, A to B: hinge index and signed quarter turns about its positive axis.
        """
