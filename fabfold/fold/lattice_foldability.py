"""Whether a tree folds: the answer of the lattice planner to the tree search.

The tree search asks through a protocol (:mod:`fabfold.tree.foldability`); this implements it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.tree.foldability import PlannerEstimate
from fabfold.tree.system import HingeSystem

if TYPE_CHECKING:
    from fabfold.fold.lattice_planner import PlannerResult

__all__ = ["LatticeFoldability", "octants_of"]

#: Cores are worth a look where the planner leaves no more than this with whole cells: quarter
#: turns, or share of all quarter turns.
_FEW_TURNS, _FEW_SHARE = 4, 0.3


def octants_of(subvoxels: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which eighths of each cell hold any material.

    Parameters
    ----------
    subvoxels : (n, s, s, s) bool array
        Material in each cell, s even.

    Returns
    -------
    (n, 2, 2, 2) bool array
        By the halves along x, y and z, the lower half first.
    """
    count, size = subvoxels.shape[:2]
    half = size // 2
    parts = subvoxels.reshape(count, 2, half, 2, half, 2, half)
    return np.asarray(parts.any(axis=(2, 4, 6)))


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
    octants : (n, 2, 2, 2) bool array, optional
        Eighths of the voxels' cells in shape A that count as material, for trees that fold only
        because cells are not full; see :func:`octants_of`. Without it whole cells count. It
        costs several times as much, and what passes by it is less sure to survive the proof on
        the bodies.
    carve : float, optional
        For trees that fold only once cells lose corners: half the side of the core that is to be
        left of a cell, :data:`fabfold.fold.core_sweep.CORE_HALF_SIDE`, lattice units. The closure
        test then looks at cores; the planner looks at whole cells first, and at cores where it
        leaves little. Not together with `octants`. A system whose voxels share cells brings its
        own octants and is not carved.
    material : (n, s, s, s) bool array, optional
        With `carve`: material of the cells in shape A. Paths that cannot be carved without
        cutting a hinge then do not count, and of several the one that costs least is taken.
    """

    expansions: int = 2500
    patience: int = 400
    octants: NDArray[np.bool_] | None = field(default=None, compare=False)
    carve: float | None = None
    material: NDArray[np.bool_] | None = field(default=None, compare=False)

    def _seen(self, system: HingeSystem) -> HingeSystem:
        """The system as the planner sees it: on half cells where octants count."""
        from fabfold.fold.lattice_planner import refined

        return system if self.octants is None else refined(system, self.octants)

    def stuck_hinges(self, system: HingeSystem) -> NDArray[np.bool_]:
        """Which hinges the closure test cannot move.

        Parameters
        ----------
        system : HingeSystem
            What is to fold.

        Returns
        -------
        (2, h) bool array
            From shape A, and from shape B.
        """
        from fabfold.fold.lattice_planner import stuck_hinges

        return stuck_hinges(self._seen(system), carve=self.carve)

    def estimate(
        self, system: HingeSystem, expansions: int, guide: NDArray[np.int32] | None = None
    ) -> PlannerEstimate:
        """What the planner could not resolve, and the steps that it found.

        Parameters
        ----------
        system : HingeSystem
            What is to fold.
        expansions : int
            The planner gives up after this many expansions without progress.
        guide : (g, 5) int32 array, optional
            Steps found for a similar system, to be tried first.

        Returns
        -------
        PlannerEstimate
            Quarter turns of each hinge that are left, and the steps found.
        """
        found = self._plan(system, expansions, guide)
        return PlannerEstimate(found.apart, found.guide)

    def _plan(
        self, system: HingeSystem, expansions: int, guide: NDArray[np.int32] | None = None
    ) -> PlannerResult:
        """Plan once, with whole cells first and then with cores if it is worth it."""
        from fabfold.fold.lattice_planner import find_path

        patience = min(expansions, self.patience)
        seen = self._seen(system)
        found = find_path(seen, self.expansions, patience, short=False, guide=guide)
        if self.carve is None or system.octants is not None:
            return found
        if not 0 < found.remaining <= max(_FEW_TURNS, _FEW_SHARE * found.total):
            return found
        cored = self._plan_with_cores(system, patience, found.guide)
        return cored if cored.remaining < found.remaining else found

    def _plan_with_cores(
        self, system: HingeSystem, patience: int, guide: NDArray[np.int32]
    ) -> PlannerResult:
        """Plan with cores; hinges that carving would cut count as not resolved."""
        from fabfold.fold.lattice_planner import find_path

        sparing = self.material is not None
        found = find_path(
            system, self.expansions, patience, short=sparing, carve=self.carve, guide=guide
        )
        if found.path is None or self.material is None:
            return found
        from fabfold.fold.carving_plan import plan_carving

        jammed = list(plan_carving(system, found.path, self.material, improve=False).jammed)
        if not jammed:
            return found
        apart = found.apart.copy()
        apart[jammed] = 1
        return found._replace(remaining=len(jammed), path=None, apart=apart)

    def path(
        self, system: HingeSystem, guide: NDArray[np.int32] | None = None
    ) -> NDArray[np.int32] | None:
        """Folding path after shortcutting, or None where the planner finds none.

        A short look may meet by luck where a long one, which trades sides later, does not; so
        shorter patience is tried as well.

        Parameters
        ----------
        system : HingeSystem
            What is to fold.
        guide : (g, 5) int32 array, optional
            Steps that :meth:`estimate` found for the system, to be tried first.

        Returns
        -------
        (m, 2) int32 array or None
            One row a move from A to B: hinge, and signed quarter turns about its positive axis.
        """
        from fabfold.fold.lattice_planner import find_path

        seen = self._seen(system)
        looks = (self.patience, self.patience // 4, self.patience // 10)
        for hint in (guide, None):
            for patience in looks:
                found = find_path(seen, self.expansions, patience, guide=hint).path
                if found is not None:
                    return found
            if guide is None:
                break
        if self.carve is None or system.octants is not None:
            return None
        if self.material is not None:
            from fabfold.fold.carving_plan import carved_path

            best = carved_path(
                system, self.material, self.expansions, self.patience, carve=self.carve
            )
            return None if best is None else best[0]
        for patience in looks:
            found = find_path(system, self.expansions, patience, carve=self.carve).path
            if found is not None:
                return found
        return None
