"""Find joint trees that fold (paper section 4, with folding inside the search).

:func:`solve` runs one seed. Simulated annealing over sets of poses lowers the energy, each step a
large-neighbourhood move. Of several sets of poses that were grown the best is the start. It settles
first: energy and hinges that cannot move go down together, judged by the closure test alone, which
costs little. Phase A asks the planner too, with a penalty for what does not fold yet, until a tree
folds. Phase B anneals among trees that fold. Threshold acceptance with an exponential random number is the
same as the Metropolis rule.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import NoFoldError, NoTreeError
from fabfold.lattice.rotations import rotation_index
from fabfold.tree.assembly import HingeChoice, SpanningTree, fold_tree, hinge_choice
from fabfold.tree.candidate import Candidate
from fabfold.tree.effort import Effort
from fabfold.tree.fold_tree import FoldTree
from fabfold.tree.foldability import Foldability, PlannerEstimate
from fabfold.tree.initial_poses import grow
from fabfold.tree.large_neighbourhood import ruin_and_recreate
from fabfold.tree.leaf_assignment import reassign_leaves
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
    assignments : int
        Sets of leaves that took their best places at once.
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
    assignments: int = 0
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
#: Share of steps that move leaves to their best places, and how many at most. The others take a
#: part out and put it back.
_LEAF_STEPS, _MOST_LEAVES, _LEAF_TRIES = 0.35, 12, 20
#: First and last temperature while poses settle; the first one after a kick.
_SETTLE_HOT, _SETTLE_COLD, _KICK_HOT = 0.5, 0.12, 0.2
#: Energy by which a tree must be better to count as better.
_GAIN = 1e-6
#: First and last temperature of phase B: of each tree that folds, and of the best.
_POLISH_EACH, _POLISH_BEST = (0.1, 0.02), (0.05, 0.005)
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


def _steps_of_path(tree: FoldTree, path: NDArray[np.int32]) -> NDArray[np.int32]:
    """The moves of a path as steps that guide the planner, (g, 5)."""
    steps: list[tuple[int, int, int, int, int]] = []
    for number, quarters in path.tolist():
        hinge = tree.hinges[number]
        x, y, z = (round(2 * value) for value in hinge.point)
        way = 1 if quarters * hinge.angle_deg > 0 else -1
        steps += [(x, y, z, int(np.flatnonzero(hinge.direction)[0]), way)] * abs(quarters)
    return np.array(steps, np.int32).reshape(-1, 5)


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
        heat: float = 0.0,
    ) -> tuple[NDArray[np.int32], float, int] | None:
        """Other poses with energy, and penalty for loose pieces, of at most `threshold`.

        At a temperature `heat` above 0, some steps move leaves to their best places.

        Returns
        -------
        (pose, energy, loose pieces) or None
            None where no step led to such poses.
        """
        effort = self.effort
        out = np.empty(len(pose), np.int32)
        if heat > 0 and self.tables.max_shared == 0 and self.rng.random() < _LEAF_STEPS:
            used, energy, left = reassign_leaves(
                self.tables, pose, self.problem.empty_face, hinge_tables(), piece_penalty,
                threshold, _LEAF_TRIES, _MOST_LEAVES, heat, self.generator, out,
            )  # fmt: skip
            self.statistics.assignments += used
            return None if math.isinf(energy) else (out, energy, left)
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
        before: _State | None,
        bound: float,
        plan: bool = True,
    ) -> _State | None:
        """The best spanning tree for these poses, or None where its penalty exceeds `bound`.

        Hinges and steps are kept from the state `before` where that is possible. Without `plan`
        the closure test judges alone.
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
            self.statistics.closed += penalty == 0
            if penalty == 0 and plan:
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

    def starts(self) -> Iterator[_State]:
        """Joinable poses to start from: of each `choices` that were grown the best."""
        effort, statistics = self.effort, self.statistics
        best: _State | None = None
        tried = 0
        for pose in grow(
            self.problem,
            self.seed,
            beam_width=effort.beam_width,
            root_poses=effort.root_poses,
            stop=self.stopped,
        ):
            statistics.grown += 1
            tried += 1
            self.tables = self.phase_a_tables
            start = self.make_joinable(pose)
            if start is not None:
                energy, _ = energy_of(self.tables, start.pose, self.problem.empty_face)
                if best is None or energy < best.energy:
                    best = replace(start, energy=energy)
            if best is not None and tried >= effort.choices:
                yield best
                best, tried = None, 0
        if best is not None:
            yield best

    def settle(self, start: _State, steps: int, hot: float) -> _State | None:
        """Lower energy and stuck hinges together, by the closure test alone."""
        weight = self.objective.energy
        now = self.judged(start.pose, start.energy, None, math.inf, plan=False)
        if now is None:
            return None
        for step in range(steps):
            if self.stopped():
                break
            heat = hot * (_SETTLE_COLD / hot) ** (step / steps)
            value = weight * now.energy + now.penalty + heat * self.rng.exponential()
            stuck = len(now.focus) > 0 and self.rng.random() < _FOCUSED
            focus = now.focus if stuck else _ANYWHERE
            found = self.neighbour(now.pose, value / weight, 20, _PIECE, focus, heat)
            if found is not None:
                bound = value - weight * found[1]
                now = self.judged(found[0], found[1], now, bound, plan=False) or now
        return now

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
                found = self.neighbour(now.pose, value / objective.energy, 20, _PIECE, focus, heat)
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
            found = self.neighbour(now.pose, value, 20, _PIECE, heat=heat)
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

    def settled_and_folded(self, start: _State, steps: int, hot: float) -> _State | None:
        """A tree that folds, settled from a start and polished for a moment; None for none."""
        self.tables = self.phase_a_tables
        settled = self.settle(start, steps, hot) if steps else start
        folded = None if settled is None else self.fold(settled)
        self.tables = self.problem.tables
        if folded is None:
            return None
        energy, _ = energy_of(self.tables, folded.pose, self.problem.empty_face)
        folded = replace(folded, energy=energy)
        self.keep(folded)
        return self.polish(folded, self.effort.polish_each, *_POLISH_EACH)

    def improve(self, state: _State) -> None:
        """Polish a tree that folds; then shake, settle and fold it again until that no longer pays.

        An iterated local search (Lourenço, Martin and Stützle 2003).
        """
        effort = self.effort
        now = self.polish(state, effort.polish_best, *_POLISH_BEST)
        idle = 0
        for _ in range(effort.kicks):
            if idle >= effort.kick_patience or self.stopped():
                break
            found = self.settled_and_folded(now, effort.kick_steps, _KICK_HOT)
            idle += 1
            if found is not None and found.energy < now.energy - _GAIN:
                now, idle = found, 0

    def folding_states(self) -> list[_State]:
        """Trees that fold, from several starts, each polished for a moment."""
        effort, statistics = self.effort, self.statistics
        found: list[_State] = []
        for start in self.starts():
            statistics.starts += 1
            folded = self.settled_and_folded(start, effort.settling, _SETTLE_HOT)
            if folded is not None:
                found.append(folded)
            enough = effort.starts if found else effort.restarts
            if statistics.starts >= enough or self.stopped():
                break
        return found

    def state_of(self, candidate: Candidate) -> _State | None:
        """A tree that folds as a state; None where the planner does not fold it again."""
        tree, problem = candidate.tree, self.problem
        number = {tuple(cell): k for k, cell in enumerate(problem.template.cells.tolist())}
        cells = np.array([number[tuple(cell)] for cell in tree.target.tolist()], np.int32)
        turns = np.array([rotation_index(matrix) for matrix in tree.orientation], np.int32)
        pose = 24 * cells + turns
        energy, _ = energy_of(self.tables, pose, problem.empty_face)
        choice = hinge_choice(problem, pose)
        hinged = {(edge.parent, edge.child) for edge in tree.edges if edge.kind != "R"}
        guide = _steps_of_path(tree, candidate.path)
        for drawn in self.trees(choice, {(min(pair), max(pair)) for pair in hinged}, 3):
            found = self.judge.estimate(drawn.system, self.effort.long_patience, guide)
            if not found.unresolved.any():
                return _State(pose, energy, drawn, 0.0, guide=found.guide)
        return None

    def go_on(self, start: Candidate) -> list[Candidate]:
        """Phase B alone, from a tree that folds; that tree is among the results."""
        self.tables = self.problem.tables
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
            self.tables = self.problem.tables
            self.improve(min(found, key=lambda s: s.energy))
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
        Budgets of the run; by default the normal ones.
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
