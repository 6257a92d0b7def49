"""Poses to start from, and steps from poses to others: everything before anything is judged.

A step is of one of three kinds: two voxels swap places (:mod:`fabfold.tree.cell_swaps`), leaves of
a spanning tree move to their best places (:mod:`fabfold.tree.leaf_assignment`), or a part is taken
out and put back (:mod:`fabfold.tree.large_neighbourhood`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fabfold.tree.assembly import hinge_choice
from fabfold.tree.bound import phase_bounds
from fabfold.tree.cell_swaps import anneal_swaps
from fabfold.tree.effort import Effort
from fabfold.tree.initial_poses import grow
from fabfold.tree.large_neighbourhood import ruin_and_recreate
from fabfold.tree.leaf_assignment import reassign_leaves
from fabfold.tree.phases import phase_labels, phase_of, phase_rotations
from fabfold.tree.pose_energy import energy_of
from fabfold.tree.problem import TreeProblem
from fabfold.tree.search_state import ANYWHERE, SearchState, Statistics
from fabfold.tree.spanning_trees import loose_pieces
from fabfold.tree.swept_cells import hinge_tables
from fabfold.tree.tables import Tables

__all__ = ["PIECE", "PoseMoves"]

#: Share of steps that swap two voxels, and how many swaps are drawn for one.
_SWAP_STEPS, _SWAP_TRIES = 0.5, 1000
#: Share of the other steps that move leaves to their best places, and how many at most.
_LEAF_STEPS, _MOST_LEAVES, _LEAF_TRIES = 0.35, 12, 20
#: Energy of a piece that no hinge joins, while poses are made joinable and after.
_PIECE_WHILE_JOINING, PIECE = 2.0, 10.0
#: Energy of a piece while poses are annealed by swaps.
_PIECE_WHILE_SWAPPING = 0.22
#: Share of an annealing after which only hinges that can turn count.
_THEN_TURNING = 0.7
#: What is left in pieces is annealed again, at most so often, for a shorter time: share of the
#: steps, first temperature, energy of a piece.
_MENDS, _MEND_SHARE, _MEND_HOT, _MEND_PIECE = 3, 0.35, 0.15, 0.6
#: Phases are drawn by their bound: one that is higher by so much energy, e times more seldom. What
#: annealing makes of them differs by a little more than their bounds do, and in one phase by this.
_PHASE_SCALE = 0.2
#: Annealings in a row that end in pieces after which poses are grown instead.
_PATIENCE = 4


class PoseMoves:
    """Starts and steps of one run.

    Parameters
    ----------
    problem : TreeProblem
        Voxels, joints and template.
    effort : Effort
        Budgets and settings.
    rng : numpy.random.Generator
        Decides which kind of step is made.
    state : (1,) uint64 array
        Random state of the kernels, advanced.
    statistics : Statistics
        Counts what is done.
    stopped : callable
        Polled; once it returns True nothing new is begun.

    Attributes
    ----------
    tables : Tables
        What steps are priced by; phase A has joint weights of its own.
    """

    def __init__(
        self,
        problem: TreeProblem,
        effort: Effort,
        rng: np.random.Generator,
        state: NDArray[np.uint64],
        statistics: Statistics,
        stopped: Callable[[], bool],
    ) -> None:
        self.problem = problem
        self.effort = effort
        self.rng = rng
        self.generator = state
        self.statistics = statistics
        self.stopped = stopped
        self.tables: Tables = problem.tables
        self._labels = phase_labels(problem.joints)
        self._turns = phase_rotations(self._labels, problem.source, problem.template.cells)

    def neighbour(
        self,
        pose: NDArray[np.int32],
        threshold: float,
        tries: int,
        piece_penalty: float,
        focus: NDArray[np.int32] = ANYWHERE,
        heat: float = 0.0,
    ) -> tuple[NDArray[np.int32], float, int] | None:
        """Other poses with energy, and penalty for loose pieces, of at most `threshold`.

        At a temperature `heat` above 0, some steps swap voxels or move leaves to their best places.

        Returns
        -------
        (pose, energy, loose pieces) or None
            None where no step led to such poses.
        """
        effort, problem = self.effort, self.problem
        out = np.empty(len(pose), np.int32)
        small = heat > 0 and self.tables.max_shared == 0
        if small and self.rng.random() < _SWAP_STEPS:
            cell, turn = problem.template.cells[pose[0] // 24], int(pose[0] % 24)
            turns = self._turns[phase_of(self._labels, problem.source[0], cell, turn)]
            used, energy, left = anneal_swaps(
                self.tables, pose, turns, problem.empty_face, hinge_tables(), piece_penalty,
                threshold, focus, _SWAP_TRIES, 0.0, 0.0, 0.0, self.generator, out,
            )  # fmt: skip
            self.statistics.swaps += used
        elif small and self.rng.random() < _LEAF_STEPS:
            used, energy, left = reassign_leaves(
                self.tables, pose, problem.empty_face, hinge_tables(), piece_penalty, threshold,
                _LEAF_TRIES, _MOST_LEAVES, heat, self.generator, out,
            )  # fmt: skip
            self.statistics.assignments += used
        else:
            used, energy, left = ruin_and_recreate(
                self.tables, pose, problem.empty_face, hinge_tables(), piece_penalty, threshold,
                focus, tries, effort.min_removed, min(effort.max_removed, len(pose)),
                effort.repair_beam_width, 0.05, 1.0, self.generator, out,
            )  # fmt: skip
            self.statistics.removals += used
        return None if math.isinf(energy) else (out, energy, left)

    def starts(self, seed: int) -> Iterator[tuple[SearchState, bool]]:
        """Joinable poses to start from: of each `choices` that were made the best.

        Parameters
        ----------
        seed : int
            Of growing.

        Yields
        ------
        (SearchState, bool)
            Poses, and whether they were annealed: then little is to be had by heat.
        """
        # Where voxels share cells, or some must come to lie in given places, poses are grown.
        if self.effort.swaps and not self.tables.max_shared and self.problem.roots is None:
            for state in self._best_of(self._annealed()):
                yield state, True
        for state in self._best_of(self._grown(seed)):
            yield state, False

    def _best_of(self, states: Iterator[SearchState]) -> Iterator[SearchState]:
        """Of each `choices` the one of least energy."""
        best: SearchState | None = None
        for tried, state in enumerate(states, 1):
            if best is None or state.energy < best.energy:
                best = state
            if tried % self.effort.choices == 0:
                yield best
                best = None
        if best is not None:
            yield best

    def _annealed(self) -> Iterator[SearchState]:
        """Joinable poses by swaps, in phases whose bounds are low."""
        problem, tables = self.problem, self.tables
        bounds = phase_bounds(problem, with_wishes=True)
        # Rounded, so that what is equal but for the order of a sum is equal.
        energies = np.unique([round(bound.energy, 5) for bound in bounds])
        odds = np.exp((energies[:1] - energies) / _PHASE_SCALE)
        steps = self.effort.swaps * len(problem)
        hot, cold = self.effort.swap_heats
        in_pieces = 0
        while bounds and in_pieces < _PATIENCE and not self.stopped():
            energy = self.rng.choice(energies, p=odds / odds.sum())
            alike = [bound for bound in bounds if round(bound.energy, 5) == energy]
            phase = alike[int(self.rng.integers(len(alike)))]
            pose = np.empty(len(problem), np.int32)
            _, energy, left = anneal_swaps(
                tables, phase.pose, phase.turns, problem.empty_face, hinge_tables(),
                _PIECE_WHILE_SWAPPING, math.inf, ANYWHERE, steps, hot, cold, _THEN_TURNING,
                self.generator, pose,
            )  # fmt: skip
            for _ in range(_MENDS):
                if left == 0 or self.stopped():
                    break
                _, energy, left = anneal_swaps(
                    tables, pose.copy(), phase.turns, problem.empty_face, hinge_tables(),
                    _MEND_PIECE, math.inf, ANYWHERE, int(_MEND_SHARE * steps), _MEND_HOT, cold,
                    0.0, self.generator, pose,
                )  # fmt: skip
            in_pieces = in_pieces + 1 if left else 0
            if left == 0:
                self.statistics.annealed += 1
                yield SearchState(pose, energy, None, 0.0)

    def _grown(self, seed: int) -> Iterator[SearchState]:
        """Joinable poses that a beam grows from random roots."""
        for pose in grow(
            self.problem,
            seed,
            beam_width=self.effort.beam_width,
            root_poses=self.effort.root_poses,
            stop=self.stopped,
        ):
            self.statistics.grown += 1
            start = self._made_joinable(pose)
            if start is not None:
                energy, _ = energy_of(self.tables, start.pose, self.problem.empty_face)
                yield replace(start, energy=energy)

    def _made_joinable(self, pose: NDArray[np.int32]) -> SearchState | None:
        """Anneal grown poses until hinges that can turn join all the clusters."""
        choice = hinge_choice(self.problem, pose)
        left = int(loose_pieces(choice.rows, choice.clusters, 8, self.generator))
        value, _ = energy_of(self.tables, pose, self.problem.empty_face)
        value += _PIECE_WHILE_JOINING * left
        last = self.statistics.removals + self.effort.removals
        while left > 0 and self.statistics.removals < last and not self.stopped():
            threshold = value + 0.3 * self.rng.exponential()
            found = self.neighbour(pose, threshold, 100, _PIECE_WHILE_JOINING)
            if found is not None:
                pose, value, left = found
        return None if left else SearchState(pose, value, None, 0.0)
