"""The folding stage's answer to the tree search, whether a tree folds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fabfold.tree.system import HingeSystem

__all__ = ["LatticeFoldability"]


@dataclass(frozen=True)
class LatticeFoldability:
    """Implements :class:`fabfold.tree.foldability.Foldability` by the lattice planner.

    Attributes
    ----------
    expansions : int
        States that the planner may expand in all for one system.
    patience : int
        Expansions without progress that one side of the search may make at most; a longer look
        is shared between the two sides.
    """

    expansions: int = 2500
    patience: int = 400

    def stuck(self, system: HingeSystem) -> tuple[int, int]:
        """Hinges that the closure test cannot move, from A and from B."""
        from fabfold.fold.lattice import closure

        return closure(system)

    def unresolved(self, system: HingeSystem, expansions: int) -> float:
        """Share of the quarter turns that the planner could not resolve.

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
        from fabfold.fold.lattice import find_path

        patience = min(expansions, self.patience)
        found = find_path(system, self.expansions, patience, short=False)
        return found.levels / found.total if found.total else float(found.levels > 0)

    def path(self, system: HingeSystem) -> NDArray[np.int32] | None:
        """Folding path after shortcutting, or None where the planner finds none.

        Returns
        -------
        (m, 2) int32 array or None
            One row a move from A to B: hinge, and signed quarter turns about its positive axis.
        """
        from fabfold.fold.lattice import find_path

        return find_path(system, self.expansions, self.patience).path
