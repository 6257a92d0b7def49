"""Grids with their planes moved, and which of them are unlike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fabfold.voxels.cut import Placement
from fabfold.voxels.grid_placement import GridFit

__all__ = ["RefinedGrid", "unlike"]

#: Two voxelizations whose sorted fills differ by less than this on average are the same.
_SAME_FILL = 0.012


@dataclass(frozen=True)
class RefinedGrid:
    """A grid with its planes moved on a fine scan, and how it fits.

    Attributes
    ----------
    fit : GridFit
        How well its cells fit the model and the template.
    rotation : int
        Index into :attr:`fabfold.voxels.refinement.Refinement.rotations`.
    placement : Placement
        The grid, its planes moved.
    depth : (kept, 6) float64 array or None
        Ray depths of the cells that stay, see :func:`fabfold.voxels.features.box_depth`; None
        where they were not asked for, or the cells do not fit.
    """

    fit: GridFit
    rotation: int
    placement: Placement
    depth: NDArray[np.float64] | None = field(default=None, repr=False, compare=False)

    @property
    def sort_key(self) -> tuple[int, float]:
        """Orders grids: those that fit come first, by score; then the others, by excess cells."""
        if self.fit.excess == 0:
            return (0, -self.fit.score)
        return (1, float(self.fit.excess))


def unlike(
    found: Sequence[RefinedGrid], before: Sequence[RefinedGrid], count: int
) -> list[RefinedGrid]:
    """The first grids that fit, unlike each other and unlike others.

    Parameters
    ----------
    found : sequence of RefinedGrid
        Grids in any order.
    before : sequence of RefinedGrid
        What none shall be like.
    count : int
        How many at most.

    Returns
    -------
    list of RefinedGrid
        In their order.
    """
    chosen: list[RefinedGrid] = []
    by_size: dict[int, list[NDArray[np.float64]]] = {}
    for grid in before:
        by_size.setdefault(grid.fit.kept, []).append(grid.fit.fills)
    for grid in found:
        if len(chosen) == count:
            break
        if grid.fit.excess > 0 or grid.fit.kept == 0:
            continue
        others = by_size.setdefault(grid.fit.kept, [])
        if others and np.abs(np.array(others) - grid.fit.fills).mean(axis=1).min() < _SAME_FILL:
            continue
        others.append(grid.fit.fills)
        chosen.append(grid)
    return chosen
