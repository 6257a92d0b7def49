"""What the tree search asks of the folding stage, without importing it.

The search prefers trees that fold. Whoever can tell which do implements :class:`Foldability`; the
product's is :class:`fabfold.fold.lattice_foldability.LatticeFoldability`.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from fabfold.tree.system import HingeSystem

__all__ = ["Foldability", "PlannerEstimate"]


class PlannerEstimate(NamedTuple):
    """How far the planner folds a system within a limited number of expansions.

    Attributes
    ----------
    unresolved : (h,) int32 array
        Quarter turns of each hinge that the planner could not resolve; all zero when it folds.
    guide : (g, 5) int32 array
        The steps found, complete or not: twice the middle of the hinge's lattice edge in A, its
        axis (0, 1 or 2), and 1 or -1 for a quarter turn forth or back.
    """

    unresolved: NDArray[np.int32]
    guide: NDArray[np.int32]


class Foldability(Protocol):
    """Judge of hinge systems; every answer is deterministic for the same arguments."""

    def stuck_hinges(self, system: HingeSystem) -> NDArray[np.bool_]:
        """Which hinges the closure test cannot move: where to change the tree.

        A hinge is movable when every pair of bodies that blocks its first turn has an already
        movable hinge on its tree path; the test repeats until nothing changes. It costs about
        0.1 ms and is necessary, not sufficient.

        Parameters
        ----------
        system : HingeSystem
            The tree's bodies and hinges.

        Returns
        -------
        (2, h) bool array
            Hinges that are not movable from shape A, and from shape B.
        """

    def estimate(
        self, system: HingeSystem, expansions: int, guide: NDArray[np.int32] | None = None
    ) -> PlannerEstimate:
        """What the planner could not resolve, and the steps that it found.

        Parameters
        ----------
        system : HingeSystem
            The tree's bodies and hinges.
        expansions : int
            The planner gives up after this many expansions without progress.
        guide : (g, 5) int32 array, optional
            Steps found for a similar system, to be tried first.

        Returns
        -------
        PlannerEstimate
            Quarter turns that are left, and steps.
        """

    def path(
        self, system: HingeSystem, guide: NDArray[np.int32] | None = None
    ) -> NDArray[np.int32] | None:
        """Folding path after shortcutting, or None where the planner finds none.

        Parameters
        ----------
        system : HingeSystem
            The tree's bodies and hinges.
        guide : (g, 5) int32 array, optional
            Steps that :meth:`estimate` found for the system, to be tried first.

        Returns
        -------
        (m, 2) int32 array or None
            One row a move, A to B: hinge index and signed quarter turns about its positive axis.
        """
