"""Initial solutions of the tree search: full sets of poses, grown from random root poses.

A root voxel gets a random pose, the beam places the others beside it, and
:func:`fabfold.tree.large_neighbourhood.repair` places what the beam leaves over.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from fabfold.lattice.rotations import parity
from fabfold.tree.beam import fill_beam
from fabfold.tree.large_neighbourhood import repair
from fabfold.tree.problem import TreeProblem
from fabfold.tree.rng import generator

__all__ = ["grow"]


def grow(
    problem: TreeProblem,
    seed: int,
    *,
    beam_width: int = 10,
    root_poses: int = 400,
    repairs: int = 2000,
    stop: Callable[[], bool] | None = None,
) -> Iterator[NDArray[np.int32]]:
    """Full sets of poses grown from random root poses.

    The beam seldom completes a template that has no cell to spare; what it leaves over is then
    placed by moving other voxels out of the way.

    Parameters
    ----------
    problem : TreeProblem
        Voxels, joints and template.
    seed : int
        Seed of every random choice; not negative.
    beam_width : int
        States that the beam keeps.
    root_poses : int
        Root poses tried.
    repairs : int
        Removals tried to complete a set of poses.
    stop : callable, optional
        Polled before each root pose; once it returns True no more are tried.

    Yields
    ------
    (n,) int32 array
        ``24 * template cell + rotation`` of each voxel.

    Raises
    ------
    NoTreeError
        If the checkerboard colours rule every tree out.
    """
    colourings = problem.colourings()
    rng = np.random.default_rng(np.random.SeedSequence([seed, 1]))
    state = generator(int(rng.integers(2**62)))
    colour = parity(problem.source)
    cells = [np.flatnonzero(parity(problem.template.cells) == c) for c in (0, 1)]
    count = len(problem)
    out = np.empty((beam_width, count), np.int32)
    for number in range(root_poses):
        if stop is not None and stop():
            return
        # Double hinges grown freely leave pieces that no tree joins; they come in later. Every
        # fourth time they may help to fill the template.
        tables = problem.tables if number % 4 == 3 else problem.single_tables
        root = int(rng.integers(count))
        wanted = cells[(colour[root] + colourings[int(rng.integers(len(colourings)))]) % 2]
        start = np.full(count, -1, np.int32)
        start[root] = 24 * wanted[rng.integers(len(wanted))] + rng.integers(24)
        if problem.roots is not None:
            start[root] = -1
            root, first = problem.roots[rng.integers(len(problem.roots))].tolist()
            start[root] = first
        unplaced = np.flatnonzero(start < 0).astype(np.int32)
        if len(unplaced):
            fill_beam(tables, start, unplaced, beam_width, 0.3, 0.5, True, state, out)
            start = out[0].copy()
        left, _ = repair(tables, start, repairs, 20, 12, state)
        if left == 0:
            yield start
