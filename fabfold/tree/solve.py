"""Find joint trees that fold (paper section 4, with folding inside the search)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import NoFoldError, NoTreeError
from fabfold.tree.assembly import HingeChoice, SpanningTree, fold_tree, hinge_choice
from fabfold.tree.effort import Effort
from fabfold.tree.fold_tree import FoldTree
from fabfold.tree.foldability import Foldability, Outlook
from fabfold.tree.grow import energy_of
from fabfold.tree.problem import TreeProblem
from fabfold.tree.rebuild import loose_pieces
from fabfold.tree.rng import generator
from fabfold.tree.ruin import propose
from fabfold.tree.starts import grow
from fabfold.tree.swept_cells import hinge_tables

__all__ = ["Candidate", "Statistics", "solve"]


@dataclass(frozen=True)
class Candidate:
    """A tree that folds.

    Attributes
    ----------
    tree : FoldTree
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


@dataclass
class Statistics:
    """What one run did, in counts."""

    grown: int = 0
    removals: int = 0
    judged: int = 0
    trees: int = 0
    closed: int = 0
    glances: int = 0
    looks: int = 0
    starts: int = 0
    folded: int = 0
    log: list[str] = field(default_factory=list)


_NOWHERE = np.empty(0, np.int32)


@dataclass(frozen=True)
class _State:
    """Full poses, their hinges, and what the objective says of them."""

    pose: NDArray[np.int32]
    energy: float
    tree: SpanningTree | None
    penalty: float
    focus: NDArray[np.int32] = field(default_factory=lambda: _NOWHERE)
    guide: NDArray[np.int32] | None = None


@dataclass(frozen=True)
class _Scale:
    """Weights of the folding phase, which depend on the size of the problem."""

    stuck: float
    cost: float
    joint: float
    hot: float
    cold: float
    focus: float = 0.5
    loose: float = 10.0


def _scale(voxels: int) -> _Scale:
    # A hinge that cannot move must cost about as much as the energy a few joints bring; large
    # problems need the penalty to rule, or the energy freezes before anything folds.
    if voxels <= 72:
        return _Scale(stuck=0.15, cost=1.0, joint=0.1, hot=0.15, cold=0.02)
    return _Scale(stuck=1.0, cost=0.2, joint=0.1, hot=0.1, cold=0.01)


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
        self.scale = _scale(len(problem))
        # Phase A has a joint weight of its own; double hinges keep their ratio to single ones.
        single, double = problem.weights.single, problem.weights.double
        weight = np.full(len(problem.joints), self.scale.joint)
        weight[problem.tables.single + 1 :] *= double / single if single > 0 else 1.0
        weight[0] = 0.0
        self.softened = self.tables = problem.tables._replace(weight=weight)
        self.results: list[_State] = []

    # --- moves -----------------------------------------------------------------------------

    def neighbour(
        self,
        pose: NDArray[np.int32],
        threshold: float,
        tries: int,
        loose: float,
        focus: NDArray[np.int32] = _NOWHERE,
    ) -> tuple[NDArray[np.int32], float, int] | None:
        """Other poses with energy, and penalty for loose pieces, of at most `threshold`.

        Returns
        -------
        (pose, energy, loose pieces) or None
        """
        effort = self.effort
        out = np.empty(len(pose), np.int32)
        used, energy, left = propose(
            self.tables, pose, self.problem.empty_face, hinge_tables(), loose, threshold,
            focus, tries, effort.least, min(effort.most, len(pose)), effort.rebeam, 0.05, 1.0,
            self.generator, out,
        )  # fmt: skip
        self.statistics.removals += used
        return None if math.isinf(energy) else (out, energy, left)

    def hang_together(self, pose: NDArray[np.int32]) -> _State | None:
        """Anneal grown poses until hinges that can turn join all the clusters."""
        loose = 2.0
        choice = hinge_choice(self.problem, pose)
        rows = choice.found
        left = int(loose_pieces(rows, len(rows), choice.clusters, 8, self.generator))
        value, _ = energy_of(self.tables, pose, self.problem.empty_face)
        value += loose * left
        last = self.statistics.removals + self.effort.removals
        while left > 0 and self.statistics.removals < last and not self.stopped():
            found = self.neighbour(pose, value + 0.3 * self.rng.exponential(), 100, loose)
            if found is not None:
                pose, value, left = found
        return None if left else _State(pose, value, None, 0.0)

    def trees(
        self, choice: HingeChoice, keys: set[tuple[int, int]], count: int
    ) -> Iterator[SpanningTree]:
        """Different random spanning trees; the first ones keep most of the hinges in `keys`."""
        seen: set[frozenset[tuple[int, int]]] = set()
        kept = choice.wanted(keys, 1.0)
        for k in range(count):
            bonus = (2.0, 0.7, 0.0)[min(k, 2)]
            for _ in range(8):
                # Hinges on one lattice edge exclude each other, so a random choice may not span.
                tree = choice.tree(bonus * kept, self.generator)
                if tree is not None:
                    break
            else:
                continue
            mark = frozenset(tree.keys)
            if mark not in seen:
                seen.add(mark)
                self.statistics.trees += 1
                yield tree

    # --- judging ---------------------------------------------------------------------------

    def outlook(self, tree: SpanningTree, guide: NDArray[np.int32] | None, strict: bool) -> Outlook:
        """What the planner leaves, with a second look where that is little.

        A tree that folds is changed a little at a time, so a long look along its steps finds most
        that there is to find. Before anything folds, a look without them does more.
        """
        self.statistics.glances += 1
        found = self.judge.outlook(tree.system, self.effort.glance, guide)
        left = found.left.sum()
        if 0 < left <= self.effort.near * 2 * len(found.left):
            self.statistics.looks += 1
            if strict:
                other = self.judge.outlook(tree.system, self.effort.strict_look, guide)
            else:
                other = self.judge.outlook(tree.system, self.effort.look)
            if other.left.sum() < left:
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
            kept, guide = before.tree.keys, before.guide
        for tree in self.trees(choice, kept, self.effort.trees):
            stuck = self.judge.stuck_hinges(tree.system)
            penalty = self.scale.stuck * float(stuck.sum())
            trouble = stuck.any(axis=0)
            steps = guide
            if penalty == 0:
                self.statistics.closed += 1
                found = self.outlook(tree, guide, bound == 0.0)
                trouble = found.left > 0
                penalty = self.scale.stuck * float(found.left.sum()) / max(1, 2 * len(trouble))
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
        scale, count = self.scale, len(self.problem)
        now = self.judged(start.pose, start.energy, None, math.inf)
        if now is None:
            return None
        # Closing (no hinge stuck for good) costs little a step; looks at the planner cost much.
        closing, looking = self.effort.closing * count, self.effort.looking * count
        glances = step = 0
        while step < closing and glances < looking and not self.stopped():
            if now.penalty == 0:
                return now
            done = max(step / closing, glances / looking)
            heat = scale.hot * (scale.cold / scale.hot) ** done
            value = scale.cost * now.energy + now.penalty + heat * self.rng.exponential()
            assert now.tree is not None
            if self.rng.random() < 0.05:
                pose, energy = now.pose, now.energy
            else:
                focus = now.focus if self.rng.random() < scale.focus else _NOWHERE
                found = self.neighbour(now.pose, value / scale.cost, 20, 10.0, focus)
                if found is None:
                    step += 1
                    continue
                pose, energy, _ = found
            before = self.statistics.glances
            fresh = self.judged(pose, energy, now, value - scale.cost * energy)
            looked = self.statistics.glances - before
            glances += looked
            step += looked == 0
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
            found = self.neighbour(now.pose, value, 20, 10.0)
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

    def gather(self) -> list[_State]:
        """Trees that fold, from several starts, each polished for a moment."""
        effort, statistics = self.effort, self.statistics
        found: list[_State] = []
        for pose in grow(
            self.problem, self.seed, beam=effort.beam, roots=effort.roots, stop=self.stopped
        ):
            statistics.grown += 1
            self.tables = self.softened
            start = self.hang_together(pose)
            if start is not None:
                statistics.starts += 1
                folded = self.fold(start)
                if folded is not None:
                    self.tables = self.problem.tables
                    energy, _ = energy_of(self.tables, folded.pose, self.problem.empty_face)
                    folded = replace(folded, energy=energy)
                    self.keep(folded)
                    found.append(self.polish(folded, effort.trying, 0.1, 0.02))
            enough = effort.gathering if found else effort.restarts
            if statistics.starts >= enough or self.stopped():
                break
        return found

    def run(self) -> list[Candidate]:
        """All the phases."""
        effort = self.effort
        found = self.gather()
        if found:
            self.tables = self.problem.tables
            self.polish(min(found, key=lambda s: s.energy), effort.polishing, 0.05, 0.005)
        if self.statistics.grown == 0:
            raise NoTreeError(
                f"no tree found for {len(self.problem)} voxels in template "
                f"{self.problem.template.name!r} from {effort.roots} root poses (seed "
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
            if any(len(state.tree.keys ^ other.tree.keys) < 4 for other in chosen if other.tree):
                continue
            candidate = self.candidate(state)
            if candidate is None:
                continue
            chosen.append(state)
            out.append(candidate)
            if len(out) == self.effort.keep:
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
    """Trees of rigid joints and half-turn hinges that fold, best first.

    Deterministic for the same problem, seed and effort. Phase A lowers the energy plus a penalty
    for hinges that cannot move and for what the planner leaves unresolved, until a tree folds;
    phase B anneals the energy among trees that fold.

    Parameters
    ----------
    problem : TreeProblem
    seed : int
        Not negative.
    foldability : Foldability
    effort : Effort, optional
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
