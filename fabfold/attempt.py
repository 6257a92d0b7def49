"""A tree on its way to being built: what the fold and join stages return."""

from __future__ import annotations

from dataclasses import dataclass

from fabfold.fold.model import Motion
from fabfold.joinery.model import Joinery
from fabfold.tree.model import FoldTree
from fabfold.voxels.model import Voxels

__all__ = ["Attempt", "Made"]


@dataclass(frozen=True)
class Attempt:
    """A tree with its path on the lattice: what the fold stage returns."""

    voxels: Voxels
    tree: FoldTree
    motion: Motion


@dataclass(frozen=True)
class Made:
    """A tree that was built and certified: what the join stage returns.

    Attributes
    ----------
    attempt : Attempt
        Voxels, tree, and the motion with its certificate on the real bodies.
    joinery : Joinery
        The printed bodies.
    refused : tuple of str
        Why each better-ranked tree was passed over.
    """

    attempt: Attempt
    joinery: Joinery
    refused: tuple[str, ...]
