"""What the tree search finds: a tree with a path that folds it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fabfold.tree.fold_tree import FoldTree

__all__ = ["Candidate"]


@dataclass(frozen=True)
class Candidate:
    """A tree that folds.

    Attributes
    ----------
    tree : FoldTree
        The tree.
    path : (m, 2) int32 array
        One row a move, A to B: hinge index and signed quarter turns about its positive axis.
    seed : int
        Seed of the run that found it.
    """

    tree: FoldTree
    path: NDArray[np.int32]
    seed: int

    @property
    def energy(self) -> dict[str, float]:
        """The tree's energies: ``surface``, ``count`` and ``total``."""
        return self.tree.energy
