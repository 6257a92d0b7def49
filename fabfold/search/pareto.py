"""Fewest joints or the best surface: the solutions between which only taste can choose.

A ladder of weights is searched, all seeds of all its steps as tasks of one executor. What is found
is put together, and everything that another solution beats in one respect and equals in the rest
is left out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fabfold.errors import NoFoldError, NoTreeError, RecipeError
from fabfold.progress import Progress
from fabfold.search.run import Budget, Tally, run_seeds
from fabfold.search.seeds import Event, Job, SeedResult
from fabfold.tree.candidate import Candidate
from fabfold.voxels.voxel_model import Voxels

if TYPE_CHECKING:
    from fabfold.recipe.recipe import Recipe
    from fabfold.search.rounds import Rounds

__all__ = ["LADDER", "Solution", "picked", "solutions", "undominated"]

#: Steps of the knob between fewest hinges (0) and best surface (1).
LADDER = (0.0, 0.25, 0.5, 0.75, 1.0)
#: Where the seeds of the ladder begin within those of a recipe, and how many a step may use.
_SHIFT = 500_000
_STEP = 100_000


@dataclass(frozen=True)
class Solution:
    """One of the solutions.

    Attributes
    ----------
    voxels : Voxels
        The voxelization that the tree joins.
    candidate : Candidate
        The tree, its path and its energy.
    prefer : float
        Step of the ladder that found it.
    joints : int
        Hinged joints, single and double.
    surface : float
        Eq. 8 over all visible faces of the box, unweighted; 0 is a perfect surface.
    kept : float or None
        Mean share of what was to be kept; None where nothing was.
    """

    voxels: Voxels
    candidate: Candidate
    prefer: float
    joints: int
    surface: float
    kept: float | None = None

    @property
    def costs(self) -> tuple[float, ...]:
        """What is to be small, each by itself."""
        kept = () if self.kept is None else (-round(self.kept, 6),)
        return (float(self.joints), round(self.surface, 6), *kept)

    def to_json(self, number: int) -> dict[str, Any]:
        """The entry of ``pareto.json``."""
        entry: dict[str, Any] = {
            "number": number,
            "joints": self.joints,
            "surface": round(self.surface, 6),
            "prefer": self.prefer,
            "seed": self.candidate.seed,
            "bodies": len(self.candidate.tree.bodies),
            "moves": len(self.candidate.path),
            "picture": f"pareto-{number}.png",
        }
        if self.kept is not None:
            entry["kept"] = round(self.kept, 6)
        return entry


def undominated(found: Sequence[Solution]) -> list[Solution]:
    """Solutions that no other one beats, fewest joints first; of equals the first.

    One beats another where it is better in some respect and worse in none.
    """
    chosen: list[Solution] = []
    for solution in sorted(found, key=lambda s: s.costs):
        # Sorted so, nothing that comes later can beat what was chosen.
        if not any(
            all(a <= b for a, b in zip(other.costs, solution.costs, strict=True))
            for other in chosen
        ):
            chosen.append(solution)
    return chosen


def solutions(
    recipe: Recipe,
    rounds_of: Callable[[Recipe, int], Rounds],
    open_progress: Callable[[str], AbstractContextManager[Progress]],
) -> list[Solution]:
    """Search the ladder, a round at a time, until a round finds trees that fold.

    Parameters
    ----------
    recipe : Recipe
        Its own `prefer` counts for nothing here.
    rounds_of : callable
        Makes the search of a recipe whose seeds are shifted by a number.
    open_progress : callable
        Opens the progress of a stage by its name.

    Raises
    ------
    NoTreeError
        If no tree fits the template.
    NoFoldError
        If trees fit but none folds.
    """
    ladder = [
        rounds_of(recipe.model_copy(update={"prefer": prefer, "pick": 0}), _SHIFT + _STEP * step)
        for step, prefer in enumerate(LADDER)
    ]
    why = ""
    fits = False
    from fabfold.search.schedule import SEEDS_PER_ROUND

    most = min(recipe.rounds, _STEP // SEEDS_PER_ROUND)
    for number in range(most):
        found, fitted, reason = _round(ladder, number, open_progress)
        fits, why = fits or fitted, why or reason
        if found:
            return undominated(found)
        if not fitted:
            for rounds in ladder:
                rounds.no_tree_fits(number)
    if not fits:
        raise NoTreeError(why)
    raise NoFoldError(
        f"no tree that folds in {most} rounds of {len(LADDER)} preferences; try --effort thorough, "
        "more --rounds, another --seed or a larger template"
    )


def picked(found: Sequence[Solution], number: int) -> Solution:
    """Solution by its number, from 1.

    Raises
    ------
    RecipeError
        If there are fewer.
    """
    if number > len(found):
        raise RecipeError(
            f"--pick {number}: the Pareto list has {len(found)} solutions; "
            "'fabfold fit --pareto' shows them"
        )
    return found[number - 1]


def _round(
    ladder: Sequence[Rounds],
    number: int,
    open_progress: Callable[[str], AbstractContextManager[Progress]],
) -> tuple[list[Solution], bool, str]:
    """One round of every step: solutions, whether any tree fitted, and why not."""
    batches = [rounds.batch(number) for rounds in ladder]
    owner = {seed: step for step, batch in enumerate(batches) for seed in batch.keys}
    results = {seed: result for batch in batches for seed, result in batch.known.items()}
    if len(results) < len(owner):

        def tasks() -> Iterator[tuple[int, Job | SeedResult]]:
            for seed, step in owner.items():
                if seed not in results:
                    yield seed, ladder[step].job(number, seed)

        with open_progress(f"pareto-{number}") as progress:
            ladder[0].wait_for_kernels(progress)
            tally = Tally(progress, results, lambda done: done / len(owner), len(owner))

            def on_event(event: Event) -> None:
                step = owner[event.seed]
                ladder[step].keep(event, batches[step].keys[event.seed])
                tally.on_event(event)

            forever = Budget()
            with ladder[0].executor(len(owner), forever.over) as pool:
                run_seeds(pool, tasks(), on_event, forever.over)
            tally.check_failures()
            results = tally.results
    found = []
    for seed in sorted(owner):
        rounds = ladder[owner[seed]]
        voxels = rounds.voxels(seed)
        for candidate in rounds.closed(results[seed].candidates):
            found.append(_solution(rounds, voxels, candidate))
    fitted = any(result.fits for result in results.values())
    return found, fitted, "" if fitted else results[min(results)].why


def _solution(rounds: Rounds, voxels: Voxels, candidate: Candidate) -> Solution:
    kept = [entry.share for entry in rounds.wishes.kept(voxels, candidate.tree)]
    return Solution(
        voxels=voxels,
        candidate=candidate,
        prefer=rounds.recipe.prefer,
        joints=sum(candidate.tree.joints.values()),
        surface=float(candidate.energy["surface"]),
        kept=sum(kept) / len(kept) if kept else None,
    )
