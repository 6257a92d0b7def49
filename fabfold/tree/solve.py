"""Find joint trees that fold (paper section 4, with folding inside the search).

:func:`solve` runs one seed. Simulated annealing over sets of poses lowers the energy, each step a
large-neighbourhood move. Phase A adds a penalty for what does not fold yet, until a tree folds.
Phase B anneals among trees that fold. Threshold acceptance with an exponential random number is the
same as the Metropolis rule.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import NoFoldError, NoTreeError
from fabfold.tree.assembly import HingeChoice, SpanningTree, fold_tree, hinge_choice
from fabfold.tree.candidate import Candidate
from fabfold.tree.effort import Effort
from fabfold.tree.foldability import Foldability, PlannerEstimate
from fabfold.tree.initial_poses import grow
from fabfold.tree.large_neighbourhood import ruin_and_recreate
from fabfold.tree.pose_energy import energy_of
from fabfold.tree.problem import TreeProblem
from fabfold.tree.rng import generator
from fabfold.tree.spanning_trees import loose_pieces
from fabfold.tree.swept_cells import hinge_tables

__all__ = ["Statistics", "solve"]


@dataclass
class Statistics:
    """What one run did, in counts.

    Attributes
    ----------
    grown : int
        Full sets of poses grown.
    starts : int
        Those whose clusters hinges could join, so that phase A began.
    removals : int
        Large-neighbourhood steps.
    judged : int
        Sets of poses that were judged.
    trees : int
        Spanning trees drawn for them.
    closed : int
        Spanning trees that passed the closure test.
    planner_runs : int
        Trees that the planner was asked about.
    second_runs : int
        Those that it was asked about again, with more patience.
    folded : int
        Steps of phase B that led to a tree that folds.
    """

    grown: int = 0
    starts: int = 0
    removals: int = 0
    judged: int = 0
    trees: int = 0
    closed: int = 0
    planner_runs: int = 0
    second_runs: int = 0
    folded: int = 0


#: No voxel in particular to start a removal from.
_ANYWHERE = np.empty(0, np.int32)


@dataclass(frozen=True)
class _State:
    """Full poses, their hinges, and what the objective says of them.

    Attributes
    ----------
    pose : (n,) int32 array
        ``24 * template cell + rotation`` of each voxel.
    energy : float
        Weighted energy of the poses.
    tree : SpanningTree or None
        The best of the spanning trees drawn.
    penalty : float
        For what does not fold of that tree; 0 when it folds.
    focus : (k,) int32 array
        Voxels on hinges in trouble.
    guide : (g, 5) int32 array or None
        Steps that the planner found for the tree.
    """

    pose: NDArray[np.int32]
    energy: float
    tree: SpanningTree | None
    penalty: float
    focus: NDArray[np.int32] = field(default_factory=lambda: _ANYWHERE)
    guide: NDArray[np.int32] | None = None


@dataclass(frozen=True)
class _FoldingObjective:
    """Weights and temperatures of phase A, which depend on the size of the problem.

    Attributes
    ----------
    stuck_hinge : float
        Penalty for a hinge that cannot move.
    energy : float
        Factor on the energy of the poses.
    joint : float
        Energy of a single hinge in phase A.
    hot, cold : float
        First and last temperature.
    """

    stuck_hinge: float
    energy: float
    joint: float
    hot: float
    cold: float


#: Share of steps of phase A that start from the hinges in trouble.
_FOCUSED = 0.5
#: Share of steps of phase A that draw other trees for the same poses.
_SAME_POSES = 0.05
#: Energy of a piece that no hinge joins, while poses are made joinable and after.
_PIECE_WHILE_JOINING, _PIECE = 2.0, 10.0


def _folding_objective(voxels: int) -> _FoldingObjective:
    # A hinge that cannot move must cost about as much as the energy a few joints bring; large
    # problems need the penalty to rule, or the energy freezes before anything folds.
    if voxels <= 72:
        return _FoldingObjective(stuck_hinge=0.15, energy=1.0, joint=0.1, hot=0.15, cold=0.02)
    return _FoldingObjective(stuck_hinge=1.0, energy=0.2, joint=0.1, hot=0.1, cold=0.01)


class _Search:
    """One run; holds the random state and the best results."""

    def __init__(
        self,
        problem: TreeProblem,
        seed: int,
        foldability: Foldability,
        effort: Effort,
        statistics: Statistics,
        report: Callable[[Candidate], None] | None = None,
        stop: Callable[[], bool] | None = None,
    ) -> None:
        self.problem = problem
        self.seed = seed
        self.judge = foldability
        self.effort = effort
        self.statistics = statistics
        self.report = report
        self.stopped = stop or (lambda: False)
        self.rng = np.random.default_rng(np.random.SeedSequence([seed, 2]))
        self.generator = generator(int(self.rng.integers(2**62)))
        self.objective = _folding_objective(len(problem))
        # Phase A has a joint weight of its own; double hinges keep their ratio to single ones.
        single, double = problem.weights.single, problem.weights.double
        weight = np.full(len(problem.joints), self.objective.joint)
        weight[problem.tables.last_single + 1 :] *= double / single if single > 0 else 1.0
        weight[0] = 0.0
        self.phase_a_tables = self.tables = problem.tables._replace(joint_weight=weight)
        self.results: list[_State] = []

    # --- moves -----------------------------------------------------------------------------

    def neighbour(
        self,
        pose: NDArray[np.int32],
        threshold: float,
        tries: int,
        piece_penalty: float,
        focus: NDArray[np.int32] = _ANYWHERE,
    ) -> tuple[NDArray[np.int32], float, int] | None:
        """Other poses with energy, and penalty for loose pieces, of at most `threshold`.

        Returns
        -------
        (pose, energy, loose pieces) or None
            None where no removal led to such poses.
        """
        effort = self.effort
        out = np.empty(len(pose), np.int32)
        used, energy, left = ruin_and_recreate(
            self.tables, pose, self.problem.empty_face, hinge_tables(), piece_penalty, threshold,
            focus, tries, effort.min_removed, min(effort.max_removed, len(pose)),
            effort.repair_beam_width, 0.05, 1.0, self.generator, out,
        )  # fmt: skip
        self.statistics.removals += used
        return None if math.isinf(energy) else (out, energy, left)

    def make_joinable(self, pose: NDArray[np.int32]) -> _State | None:
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
        return None if left else _State(pose, value, None, 0.0)

    def trees(
        self, choice: HingeChoice, kept_pairs: set[tuple[int, int]], count: int
    ) -> Iterator[SpanningTree]:
        """Different random spanning trees; the first ones keep most hinges of `kept_pairs`."""
        seen: set[frozenset[tuple[int, int]]] = set()
        kept = choice.preference(kept_pairs, 1.0)
        for k in range(count):
            bonus = (2.0, 0.7, 0.0)[min(k, 2)]
            for _ in range(8):
                # Hinges on one lattice edge exclude each other, so a random choice may not span.
                tree = choice.tree(bonus * kept, self.generator)
                if tree is not None:
                    break
            else:
                continue
            pairs = frozenset(tree.hinged_pairs)
            if pairs not in seen:
                seen.add(pairs)
                self.statistics.trees += 1
                yield tree

    # --- judging ---------------------------------------------------------------------------

    def planner_estimate(
        self, tree: SpanningTree, guide: NDArray[np.int32] | None, polishing: bool
    ) -> PlannerEstimate:
        """What the planner leaves of a tree; it runs again where that is little.

        A tree that folds is changed a little at a time, so a long run along its steps finds most
        that there is to find. Before anything folds, a run without them does more.
        """
        effort = self.effort
        self.statistics.planner_runs += 1
        found = self.judge.estimate(tree.system, effort.short_patience, guide)
        left = found.unresolved.sum()
        if 0 < left <= effort.near_miss * 2 * len(found.unresolved):
            self.statistics.second_runs += 1
            if polishing:
                other = self.judge.estimate(tree.system, effort.polish_patience, guide)
            else:
                other = self.judge.estimate(tree.system, effort.long_patience)
            if other.unresolved.sum() < left:
                return other
        return found

    def judged(
        self, pose: NDArray[np.int32], energy: float, before: _State | None, bound: float
    ) -> _State | None:
        """The best spanning tree for these poses, or None where its penalty exceeds `bound`.

        Hinges and steps are kept from the state `before` where that is possible.
        """
        choice = hinge_choice(self.problem, pose)
        self.statistics.judged += 1
        best: _State | None = None
        kept: set[tuple[int, int]] = set()
        guide = None
        if before is not None and before.tree is not None:
            kept, guide = before.tree.hinged_pairs, before.guide
        for tree in self.trees(choice, kept, self.effort.spanning_trees):
            stuck = self.judge.stuck_hinges(tree.system)
            penalty = self.objective.stuck_hinge * float(stuck.sum())
            trouble = stuck.any(axis=0)
            steps = guide
            if penalty == 0:
                self.statistics.closed += 1
                found = self.planner_estimate(tree, guide, bound == 0.0)
                trouble = found.unresolved > 0
                left = float(found.unresolved.sum())
                penalty = self.objective.stuck_hinge * left / max(1, 2 * len(trouble))
                steps = found.guide
            if best is None or penalty < best.penalty:
                focus = np.unique(tree.joints[trouble, :2]).astype(np.int32)
                best = _State(pose, energy, tree, penalty, focus, steps)
            if penalty == 0:
                break
        if best is None or best.penalty > bound:
            return None
        return best

    # --- phases ----------------------------------------------------------------------------

    def fold(self, start: _State) -> _State | None:
        """Phase A: trade energy for foldability until a tree folds."""
        objective, count = self.objective, len(self.problem)
        now = self.judged(start.pose, start.energy, None, math.inf)
        if now is None:
            return None
        # Closure tests cost little each, runs of the planner cost much: each has its own budget.
        most_tests, most_runs = self.effort.closure_tests * count, self.effort.planner_runs * count
        runs = tests = 0
        while tests < most_tests and runs < most_runs and not self.stopped():
            if now.penalty == 0:
                return now
            done = max(tests / most_tests, runs / most_runs)
            heat = objective.hot * (objective.cold / objective.hot) ** done
            value = objective.energy * now.energy + now.penalty + heat * self.rng.exponential()
            assert now.tree is not None
            if self.rng.random() < _SAME_POSES:
                pose, energy = now.pose, now.energy
            else:
                focus = now.focus if self.rng.random() < _FOCUSED else _ANYWHERE
                found = self.neighbour(now.pose, value / objective.energy, 20, _PIECE, focus)
                if found is None:
                    tests += 1
                    continue
                pose, energy, _ = found
            before = self.statistics.planner_runs
            fresh = self.judged(pose, energy, now, value - objective.energy * energy)
            new_runs = self.statistics.planner_runs - before
            runs += new_runs
            tests += new_runs == 0
            if fresh is not None:
                now = fresh
        return now if now.penalty == 0 else None

    def polish(self, start: _State, steps: int, hot: float, cold: float) -> _State:
        """Phase B: anneal the energy among trees that the planner folds; returns the best."""
        now = best = start
        for step in range(steps):
            if self.stopped():
                break
            heat = hot * (cold / hot) ** (step / steps)
            value = now.energy + heat * self.rng.exponential()
            found = self.neighbour(now.pose, value, 20, _PIECE)
            if found is None:
                continue
            fresh = self.judged(found[0], found[1], now, 0.0)
            if fresh is None:
                continue
            now = fresh
            self.statistics.folded += 1
            if now.energy < best.energy + 0.1:
                self.keep(now)
            if now.energy < best.energy:
                best = now
        return best

    def keep(self, state: _State) -> None:
        """Remember a state that folds; tell of it where it is the best so far."""
        if self.report is not None and all(state.energy < other.energy for other in self.results):
            candidate = self.candidate(state)
            if candidate is not None:
                self.report(candidate)
        self.results.append(state)

    def candidate(self, state: _State) -> Candidate | None:
        """The tree and path of a state; None where the long path search fails."""
        assert state.tree is not None
        path = self.judge.path(state.tree.system, state.guide)
        if path is None:
            return None
        return Candidate(fold_tree(self.problem, state.pose, state.tree), path, self.seed)

    def folding_states(self) -> list[_State]:
        """Trees that fold, from several starts, each polished for a moment."""
        effort, statistics = self.effort, self.statistics
        found: list[_State] = []
        for pose in grow(
            self.problem,
            self.seed,
            beam_width=effort.beam_width,
            root_poses=effort.root_poses,
            stop=self.stopped,
        ):
            statistics.grown += 1
            self.tables = self.phase_a_tables
            start = self.make_joinable(pose)
            if start is not None:
                statistics.starts += 1
                folded = self.fold(start)
                if folded is not None:
                    self.tables = self.problem.tables
                    energy, _ = energy_of(self.tables, folded.pose, self.problem.empty_face)
                    folded = replace(folded, energy=energy)
                    self.keep(folded)
                    found.append(self.polish(folded, effort.polish_each, 0.1, 0.02))
            enough = effort.starts if found else effort.restarts
            if statistics.starts >= enough or self.stopped():
                break
        return found

    def run(self) -> list[Candidate]:
        """All the phases."""
        effort = self.effort
        found = self.folding_states()
        if found:
            self.tables = self.problem.tables
            self.polish(min(found, key=lambda s: s.energy), effort.polish_best, 0.05, 0.005)
        if self.statistics.grown == 0:
            raise NoTreeError(
                f"no tree found for {len(self.problem)} voxels in template "
                f"{self.problem.template.name!r} from {effort.root_poses} root poses (seed "
                f"{self.seed}): try other seeds, another voxelization or a larger template"
            )
        candidates = self.finished()
        if not candidates:
            raise NoFoldError(
                f"trees fit template {self.problem.template.name!r}, but none of "
                f"{self.statistics.judged} could be folded (seed {self.seed}): try other seeds, "
                "more effort or another voxelization"
            )
        return candidates

    def finished(self) -> list[Candidate]:
        """The best results that differ in at least two hinges, with their paths."""
        chosen: list[_State] = []
        out: list[Candidate] = []
        for state in sorted(self.results, key=lambda s: s.energy):
            assert state.tree is not None
            if any(
                len(state.tree.hinged_pairs ^ other.tree.hinged_pairs) < 4
                for other in chosen
                if other.tree
            ):
                continue
            candidate = self.candidate(state)
            if candidate is None:
                continue
            chosen.append(state)
            out.append(candidate)
            if len(out) == self.effort.max_candidates:
                break
        return out


def solve(
    problem: TreeProblem,
    seed: int,
    foldability: Foldability,
    effort: Effort | None = None,
    statistics: Statistics | None = None,
    report: Callable[[Candidate], None] | None = None,
    stop: Callable[[], bool] | None = None,
) -> list[Candidate]:
    """Trees of rigid joints and hinges that fold, best first.

    Deterministic for the same problem, seed and effort. Phase A lowers the energy plus a penalty
    for hinges that cannot move and for what the planner leaves unresolved, until a tree folds;
    phase B anneals the energy among trees that fold.

    Parameters
    ----------
    problem : TreeProblem
        Voxels, joints and template.
    seed : int
        Seed of every random choice; not negative.
    foldability : Foldability
        Judges which trees fold.
    effort : Effort, optional
        Budgets of the run; by default the normal ones.
    statistics : Statistics, optional
        Counts what was done.
    report : callable, optional
        Called with each candidate that is better than all before.
    stop : callable, optional
        Asked at every step; the search ends with what it has once it says True. The result
        then depends on when it does.

    Returns
    -------
    list of Candidate
        One or more, by ascending energy.

    Raises
    ------
    NoTreeError
        If the colours rule every tree out, or none was found.
    NoFoldError
        If trees were found but none folds.
    """
    search = _Search(
        problem,
        seed,
        foldability,
        effort or Effort(),
        statistics or Statistics(),
        report,
        stop,
    )
    return search.run()
