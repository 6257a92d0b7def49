"""How open a box of voxels is likely to stay, said before they are cut, and grids of less.

A box is closed by what its voxels have at their faces, and how near a search comes to that depends
on how full the voxels are (Eq. 1 of the paper). The energy of trees goes up about as much with one
face that must stay open as with one cell's worth of space among the voxels, and the sum explains
most of it (``benchmarks/voxel_choice.py``).

References
----------
Zhou, Sueda, Matusik, Shamir: Boxelization, Eq. 1 and Eq. 8.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from fabfold.voxels.refined_grid import RefinedGrid, unlike
from fabfold.voxels.refinement import Refinement

__all__ = ["OpenFaces", "Openness", "grids_of_less_openness", "two_of_a_family"]

#: Takes the (n, 3) cells of voxels and their (n, 6) ray depths; faces of the box that stay open.
OpenFaces = Callable[[NDArray[np.int32], NDArray[np.float64]], float]
#: What a cell's worth of lost material counts in an openness, in open faces: nothing shall be left
#: out of a model just to close its box.
_LOSS_PRICE = 4.0
#: Digits of an openness: more than these depend on rounding, and so on how the model lies.
_DIGITS = 2
#: Grids of the least openness that are turned a little, turns of all of them together, standard
#: deviation of a turn in degrees and its change from round to round, rounds.
_TURNED, _TURNS, _SPREAD_DEG, _NARROWER, _ROUNDS = 4, 24, 3.0, 0.6, 3
#: Grids that such a round goes on with.
_POOL = 64
#: An openness that needs to be no better: not one face is open.
_CLOSED = 1.0


class Openness:
    """Faces of the box that must stay open, and cells' worth of space among the voxels.

    Parameters
    ----------
    open_faces : callable
        What the voxels could do for the box at most.
    """

    def __init__(self, open_faces: OpenFaces) -> None:
        self._open_faces = open_faces
        self._known: dict[int, tuple[RefinedGrid, float]] = {}

    def __call__(self, grid: RefinedGrid) -> float:
        """Openness of a grid that has ray depths, the lower the better."""
        if id(grid) not in self._known:
            fit = grid.fit
            assert grid.depth is not None
            least = self._open_faces(fit.cells.astype(np.int32), grid.depth)
            value = least + fit.kept - fit.fill + _LOSS_PRICE * fit.lost
            self._known[id(grid)] = grid, round(value, _DIGITS)
        return self._known[id(grid)][1]


def grids_of_less_openness(
    refinement: Refinement, grids: Sequence[RefinedGrid], openness: Openness, seed: int
) -> list[RefinedGrid]:
    """Turn the grids of the least openness a little, again and again.

    Parameters
    ----------
    refinement : Refinement
        Their search.
    grids : sequence of RefinedGrid
        Grids that fit, with ray depths, unlike each other.
    openness : Openness
        What is looked for.
    seed : int
        Of the turns.

    Returns
    -------
    list of RefinedGrid
        Those that fit of all that were tried, best first.
    """
    pool = sorted(grids, key=openness)
    found: list[RefinedGrid] = []
    for number in range(_ROUNDS):
        if not pool or openness(pool[0]) < _CLOSED:
            break
        best = two_of_a_family(refinement, pool)[:_TURNED]
        spread = _SPREAD_DEG * _NARROWER**number
        tried = refinement.refine_turned(best, _TURNS, seed + number, spread)
        fitting = [grid for grid in tried if grid.fit.excess == 0]
        found += fitting
        pool = unlike(sorted([*pool, *fitting], key=openness), [], _POOL)
    return sorted(found, key=openness)


def two_of_a_family(refinement: Refinement, grids: Sequence[RefinedGrid]) -> list[RefinedGrid]:
    """The first two of each family of rotations.

    Parameters
    ----------
    refinement : Refinement
        The search that knows the families.
    grids : sequence of RefinedGrid
        Grids in any order.

    Returns
    -------
    list of RefinedGrid
        In their order.
    """
    used: dict[int, int] = {}
    chosen = []
    for grid in grids:
        family = refinement.family[grid.rotation]
        used[family] = used.get(family, 0) + 1
        if used[family] <= 2:
            chosen.append(grid)
    return chosen
