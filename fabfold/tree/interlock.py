"""Which part of a tree keeps it from folding."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fabfold.tree.system import HingeSystem

__all__ = ["interlock", "part"]


def part(system: HingeSystem, hinges: NDArray[np.integer]) -> HingeSystem:
    """The bodies that some hinges join, without the others.

    Parameters
    ----------
    system : HingeSystem
    hinges : (k,) int array
        One or more hinges that hang together, ascending.

    Returns
    -------
    HingeSystem
        Its hinge ``i`` is ``hinges[i]``.
    """
    hinges = np.asarray(hinges)
    bodies = np.union1d(system.parent[hinges], hinges + 1)
    index = np.full(len(system.parent) + 1, -1, dtype=np.int32)
    index[bodies] = np.arange(len(bodies), dtype=np.int32)
    kept = index[system.body] >= 0
    return HingeSystem(
        cells=system.cells[kept],
        body=index[system.body[kept]],
        parent=index[system.parent[hinges]],
        point2=system.point2[hinges],
        axis=system.axis[hinges],
        turns=system.turns[hinges],
    )


def interlock(
    system: HingeSystem,
    locked: Callable[[HingeSystem], bool],
    rng: np.random.Generator,
) -> NDArray[np.int64]:
    """Hinges of a small part that is locked even on its own.

    Leaves are taken off the tree as long as the rest stays locked. What is locked alone is locked
    within the whole, so this is where the tree must change.

    Parameters
    ----------
    system : HingeSystem
        One that is locked.
    locked : callable
        Whether a system is locked: has hinges that are stuck, or is not folded by the planner.
    rng : numpy Generator
        Chooses among the leaves; the part is not unique.

    Returns
    -------
    (k,) int64 array
        Hinges, ascending.
    """
    ends = np.stack([system.parent, np.arange(1, len(system.parent) + 1)], axis=1)
    kept = np.ones(len(ends), dtype=bool)
    needed = np.zeros(len(ends), dtype=bool)
    while kept.sum() > 1:
        degree = np.bincount(ends[kept].ravel(), minlength=len(ends) + 1)
        leaves = np.flatnonzero(kept & ~needed & (degree[ends].min(axis=1) == 1))
        if len(leaves) == 0:
            break
        leaf = int(rng.choice(leaves))
        kept[leaf] = False
        if not locked(part(system, np.flatnonzero(kept))):
            kept[leaf] = needed[leaf] = True
    return np.flatnonzero(kept)
