"""Find joint trees that fold (paper section 4, with folding inside the search).

:func:`solve` runs one seed. Simulated annealing over sets of poses lowers the energy, each step a
large-neighbourhood move. Of several sets of poses that were grown the best is the start. It settles
first: energy and hinges that cannot move go down together, judged by the closure test alone, which
costs little; the planner is asked now and then whether what is there folds. Where nothing did,
phase A asks it at every step, with a penalty for what does not fold yet, until a tree folds. Phase
B anneals among trees that fold; then the best one is shaken, settles and folds again, until that
no longer pays. Threshold acceptance with an exponential random number is the same as the
Metropolis rule.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import NoFoldError, NoTreeError
from fabfold.tree.assembly import SpanningTree, fold_tree, hinge_choice
from fabfold.tree.candidate import Candidate
from fabfold.tree.effort import Effort
from fabfold.tree.foldability import Foldability, PlannerEstimate
from fabfold.tree.pose_energy import energy_of
from fabfold.tree.pose_moves import PIECE, PoseMoves
from fabfold.tree.problem import TreeProblem
from fabfold.tree.rng import generator
from fabfold.tree.search_state import (
    ANYWHERE,
    SearchState,
    Statistics,
    axes_of_tree,
    folding_objective,
    pose_of_tree,
    steps_of_path,
)

__all__ = ["Statistics", "solve"]


#: Share of steps of phase A that start from the hinges in trouble.
_FOCUSED = 0.5
#: First and last temperature while poses settle: those that were grown, and after a kick.
_GROWN, _KICKED = (0.5, 0.12), (0.12, 0.05)
#: Energy by which a tree must be better to count as better.
_GAIN = 1e-6
#: First and last temperature of phase B: of each tree that folds, and of the best.
_POLISH_EACH, _POLISH_BEST = (0.1, 0.02), (0.05, 0.005)
#: Share of steps of phase A that draw other trees for the same poses.
_SAME_POSES = 0.05


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
        self.objective = folding_objective(len(problem))
        # Phase A has a joint weight of its own; double hinges keep their ratio to single ones.
        single, double = problem.weights.single, problem.weights.double
        weight = np.full(len(problem.joints), self.objective.joint)
        weight[problem.tables.last_single + 1 :] *= double / single if single > 0 else 1.0
        weight[0] = 0.0
        self.phase_a_tables = problem.tables._replace(joint_weight=weight)
        self.moves = PoseMoves(problem, effort, self.rng, self.generator, statistics, self.stopped)
        self.results: list[SearchState] = []

    # --- judging ---------------------------------------------------------------------------

    def planner_estimate(
        self, tree: SpanningTree, guide: NDArray[np.int32] | None, polishing: bool
    ) -> PlannerEstimate:
        """What the planner leaves of a tree; before anything folds it runs again if that is little.

        A tree that folds is changed a little at a time, so one run along its steps finds most that
        there is to find. Before anything folds, a run without them does more.
        """
        effort = self.effort
        self.statistics.planner_runs += 1
        if polishing:
            return self.judge.estimate(tree.system, effort.polish_patience, guide)
        found = self.judge.estimate(tree.system, effort.short_patience, guide)
        left = found.unresolved.sum()
        if 0 < left <= effort.near_miss * 2 * len(found.unresolved):
            self.statistics.second_runs += 1
            other = self.judge.estimate(tree.system, effort.long_patience)
            if other.unresolved.sum() < left:
                return other
        return found

    def judged(
        self,
        pose: NDArray[np.int32],
        energy: float,
        before: SearchState | None,
        bound: float,
        plan: bool = True,
    ) -> SearchState | None:
        """The best spanning tree for these poses, or None where its penalty exceeds `bound`.

        Hinges and steps are kept from the state `before` where that is possible. A bound of 0 is
        for changes of trees that fold, which then keep the edges of their hinges too. Without
        `plan` the closure test judges alone.
        """
        choice = hinge_choice(self.problem, pose)
        self.statistics.judged += 1
        best: SearchState | None = None
        kept = guide = None
        if before is not None and before.tree is not None:
            kept, guide = before.tree.axes, before.guide
        # Of trees that fold, what is kept folds as it did. Before that, a hinge about another edge
        # may free what is stuck.
        exact = bound == 0.0
        for tree in choice.trees(kept, self.effort.spanning_trees, self.generator, exact=exact):
            self.statistics.trees += 1
            stuck = self.judge.stuck_hinges(tree.system)
            penalty = self.objective.stuck_hinge * float(np.count_nonzero(stuck))
            steps = guide
            self.statistics.closed += penalty == 0
            if penalty == 0 and plan:
                found = self.planner_estimate(tree, guide, exact)
                left = float(found.unresolved.sum())
                penalty = self.objective.stuck_hinge * left / max(1, 2 * len(found.unresolved))
                steps, stuck = found.guide, found.unresolved[None] > 0
            if best is None or penalty < best.penalty:
                focus = ANYWHERE
                if penalty > 0:
                    focus = np.unique(tree.joints[stuck.any(axis=0), :2]).astype(np.int32)
                best = SearchState(pose, energy, tree, penalty, focus, steps)
            if penalty == 0:
                break
        if best is None or best.penalty > bound:
            return None
        return best

    # --- phases ----------------------------------------------------------------------------

    def settle(
        self, start: SearchState, steps_each: int, heats: tuple[float, float], least: float
    ) -> tuple[SearchState | None, SearchState | None]:
        """Lower energy and stuck hinges together, by the closure test alone.

        Now and then the planner is asked of poses on the way that have no stuck hinge, where their
        energy is below `least` and below that of all that folded before.

        Returns
        -------
        settled, folded : SearchState or None
            The last poses, and those of least energy of which the planner said that they fold.
        """
        steps = steps_each * len(self.problem)
        every = max(1, steps_each // max(1, self.effort.planner_runs))
        hot, cold = heats
        weight = self.objective.energy
        now = self.judged(start.pose, start.energy, None, math.inf, plan=False)
        if now is None:
            return None, None
        folded = seen = None
        asked = -every
        for step in range(steps):
            if self.stopped():
                break
            heat = hot * (cold / hot) ** (step / steps)
            value = weight * now.energy + now.penalty + heat * self.rng.exponential()
            stuck = len(now.focus) > 0 and self.rng.random() < _FOCUSED
            focus = now.focus if stuck else ANYWHERE
            found = self.moves.neighbour(now.pose, value / weight, 20, PIECE, focus, heat)
            if found is not None:
                bound = value - weight * found[1]
                now = self.judged(found[0], found[1], now, bound, plan=False) or now
            due = step - asked >= every or step == steps - 1
            if due and now.penalty == 0 and now is not seen:
                asked = step
                energy, _ = energy_of(self.problem.tables, now.pose, self.problem.empty_face)
                if energy < least - _GAIN:
                    now, folds = self.asked_of_planner(now)
                    if folds:
                        least, folded = energy, now
                seen = now
        return now, folded

    def asked_of_planner(self, state: SearchState) -> tuple[SearchState, bool]:
        """A state without stuck hinges with the planner's steps, and whether it folds."""
        assert state.tree is not None
        if not self.effort.planner_runs:
            return state, False
        left = self.planner_estimate(state.tree, state.guide, False)
        return replace(state, guide=left.guide), not left.unresolved.any()

    def fold(self, start: SearchState) -> SearchState | None:
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
                focus = now.focus if self.rng.random() < _FOCUSED else ANYWHERE
                found = self.moves.neighbour(
                    now.pose, value / objective.energy, 20, PIECE, focus, heat
                )
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

    def polish(self, start: SearchState, steps: int, hot: float, cold: float) -> SearchState:
        """Phase B: anneal the energy among trees that the planner folds; returns the best."""
        now = best = start
        for step in range(steps):
            if self.stopped():
                break
            heat = hot * (cold / hot) ** (step / steps)
            value = now.energy + heat * self.rng.exponential()
            found = self.moves.neighbour(now.pose, value, 20, PIECE, heat=heat)
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

    def keep(self, state: SearchState) -> None:
        """Remember a state that folds; tell of it where it is the best so far."""
        if self.report is not None and all(state.energy < other.energy for other in self.results):
            candidate = self.candidate(state)
            if candidate is not None:
                self.report(candidate)
        self.results.append(state)

    def candidate(self, state: SearchState) -> Candidate | None:
        """The tree and path of a state; None where the long path search fails."""
        assert state.tree is not None
        path = self.judge.path(state.tree.system, state.guide)
        if path is None:
            return None
        return Candidate(fold_tree(self.problem, state.pose, state.tree), path, self.seed)

    def energy(self, state: SearchState) -> float:
        """Energy of the poses of a state, by the weights of the recipe."""
        energy, _ = energy_of(self.problem.tables, state.pose, self.problem.empty_face)
        return float(energy)

    def settled_and_folded(
        self,
        start: SearchState,
        steps: int,
        heats: tuple[float, float],
        least: float = math.inf,
    ) -> SearchState | None:
        """A tree that folds, settled from a start and polished for a moment; None for none.

        What has settled without becoming better than `least` is given up: folding and polishing
        it takes as long again, and seldom makes up for it.
        """
        self.moves.tables = self.phase_a_tables
        settled, folded = self.settle(start, steps, heats, least) if steps else (start, None)
        if folded is None and settled is not None and self.energy(settled) < least - _GAIN:
            folded = self.fold(settled)
        self.moves.tables = self.problem.tables
        if folded is None:
            return None
        folded = replace(folded, energy=self.energy(folded))
        self.keep(folded)
        return self.polish(folded, self.effort.polish_each, *_POLISH_EACH)

    def improve(self, state: SearchState) -> None:
        """Polish a tree that folds; then shake, settle and fold it again until that no longer pays.

        An iterated local search (Lourenço, Martin and Stützle 2003).
        """
        effort = self.effort
        now = self.polish(state, effort.polish_best, *_POLISH_BEST)
        idle = 0
        for _ in range(effort.kicks):
            if idle >= effort.kick_patience or self.stopped():
                break
            found = self.settled_and_folded(now, effort.kick_steps, _KICKED, now.energy)
            idle += 1
            if found is not None and found.energy < now.energy - _GAIN:
                now, idle = found, 0

    def folding_states(self) -> list[SearchState]:
        """Trees that fold, from several starts, each polished for a moment."""
        effort, statistics = self.effort, self.statistics
        found: list[SearchState] = []
        self.moves.tables = self.phase_a_tables
        for start, annealed in self.moves.starts(self.seed):
            statistics.starts += 1
            heats = effort.settle_heats if annealed else _GROWN
            folded = self.settled_and_folded(start, effort.settling, heats)
            self.moves.tables = self.phase_a_tables
            if folded is not None:
                found.append(folded)
            enough = effort.starts if found else effort.restarts
            if statistics.starts >= enough or self.stopped():
                break
        return found

    def state_of(self, candidate: Candidate) -> SearchState | None:
        """A tree that folds as a state; None where the planner does not fold it again."""
        tree, problem = candidate.tree, self.problem
        pose = pose_of_tree(tree)
        energy, _ = energy_of(self.moves.tables, pose, problem.empty_face)
        choice = hinge_choice(problem, pose)
        guide = steps_of_path(tree, candidate.path)
        for drawn in choice.trees(axes_of_tree(tree), 3, self.generator):
            found = self.judge.estimate(drawn.system, self.effort.long_patience, guide)
            if not found.unresolved.any():
                return SearchState(pose, energy, drawn, 0.0, guide=found.guide)
        return None

    def go_on(self, start: Candidate) -> list[Candidate]:
        """Phase B alone, from a tree that folds; that tree is among the results."""
        self.moves.tables = self.problem.tables
        state = self.state_of(start)
        if state is not None:
            self.results.append(state)
            self.improve(state)
        found = [c for c in self.finished() if c.energy["total"] < start.energy["total"] - 1e-9]
        return [*found, replace(start, seed=self.seed)][: self.effort.max_candidates]

    def run(self) -> list[Candidate]:
        """All the phases."""
        effort = self.effort
        found = self.folding_states()
        if found:
            self.moves.tables = self.problem.tables
            self.improve(min(found, key=lambda s: s.energy))
        if self.statistics.grown + self.statistics.annealed == 0:
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
        chosen: list[SearchState] = []
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
    start: Candidate | None = None,
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
        Budgets of the run; by default those of ``Effort()``.
    statistics : Statistics, optional
        Counts what was done.
    report : callable, optional
        Called with each candidate that is better than all before.
    stop : callable, optional
        Asked at every step; the search ends with what it has once it says True. The result
        then depends on when it does.
    start : Candidate, optional
        A tree of the problem that folds: it is made better, and no other is grown.

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
    return search.run() if start is None else search.go_on(start)
