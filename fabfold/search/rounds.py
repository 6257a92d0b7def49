"""Rounds of the search: seeds by the handful, the later ones where the earlier ones found most."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, closing
from dataclasses import replace
from typing import Any

from fabfold.errors import NoFoldError, NoTreeError
from fabfold.fold.core_sweep import CORE_HALF_SIDE
from fabfold.fold.crease_hinges import add_crease_hinges
from fabfold.fold.lattice_foldability import LatticeFoldability
from fabfold.lattice.template import Template
from fabfold.progress import Progress
from fabfold.recipe.recipe import Recipe
from fabfold.recipe.recipe_wishes import wished
from fabfold.search.run import Budget, Tally, executor, require_fit, run_seeds, warm_up
from fabfold.search.saved import SeedCache
from fabfold.search.schedule import SEEDS_PER_ROUND, Rung, SeedTask, best_lines, schedule
from fabfold.search.seeds import Batch, Event, Executor, Job, SeedResult
from fabfold.search.standby import SearchStandby
from fabfold.search.voxelization_problems import VoxelizationProblems
from fabfold.store import StageStore, stage_key
from fabfold.tree.bound import closed_share
from fabfold.tree.candidate import Candidate
from fabfold.voxels.voxel_model import Voxels
from fabfold.voxels.voxelize import LARGE
from fabfold.wishes.wish_list import Wishes

__all__ = ["Found", "Rounds"]

#: Distance of the search's first seeds for recipe seeds that follow each other: more than
#: any recipe's rounds use, so that two recipes share none.
SEED_STRIDE = 1_000_000
#: A tree that folds, and the voxels that it joins.
Found = tuple[Voxels, Candidate]


class Rounds:
    """The search of a recipe, a round at a time; every finished seed is kept.

    Parameters
    ----------
    recipe : Recipe
        Weights, effort, joints and seed of the search.
    template : Template
        The target shape, as it is filled.
    options : sequence of Voxels
        Voxelizations; :mod:`fabfold.search.schedule` tells which seeds search which.
    key : str
        Digest of all that `options` depend on.
    store : StageStore
        Where finished seeds are kept.
    workers : int or None
        Processes of the search; None is one a core.
    open_progress : callable
        Opens the progress of a round by its name.
    scheduler : str or None
        Address of a Dask scheduler whose workers run the seeds.
    seconds : float or None
        Search for so long, round after round, and rank all that was found; 0 takes what earlier
        runs left. None searches round by round, each to its end.
    wishes : Wishes, optional
        Of the recipe.
    shift : int
        Added to the number of each seed, for searches that run beside one another.
    on_begin : callable, optional
        Called whenever a search begins, its kernels compiled.
    on_better : callable, optional
        Told of each tree that is better than all before, with its voxels, as soon as it is known.
    standby : SearchStandby, optional
        Kernels and workers that were made ready beside what comes before.
    """

    def __init__(
        self,
        recipe: Recipe,
        template: Template,
        options: Sequence[Voxels],
        *,
        key: str,
        store: StageStore,
        workers: int | None,
        open_progress: Callable[[str], AbstractContextManager[Progress]],
        scheduler: str | None = None,
        seconds: float | None = None,
        wishes: Wishes | None = None,
        shift: int = 0,
        on_begin: Callable[[], None] | None = None,
        on_better: Callable[[Found], None] | None = None,
        standby: SearchStandby | None = None,
    ) -> None:
        self.recipe = recipe
        self.template = template
        self.wishes = wishes or Wishes()
        self.problems = VoxelizationProblems(recipe, template, options, self.wishes)
        self._shift = shift
        self.workers = workers
        self.scheduler = scheduler
        self.seconds = seconds
        self._key = key
        self._cache = SeedCache(store)
        self._open_progress = open_progress
        self._on_begin = on_begin
        self._on_better = on_better
        self._standby = standby
        self._option_of: dict[int, int] = {}
        self._origin: dict[int, int] = {}
        self._bosses_from = SEED_STRIDE  # the number of a round that never comes
        self._done: dict[int, list[Found]] = {}
        self._ranked: list[Found] | None = None

    def found(self) -> Iterator[list[Found]]:
        """Trees that fold with the voxels that they join, best first, round by round.

        With a budget in seconds, those of all rounds together instead.

        Raises
        ------
        NoTreeError
            At the end, if no round found a tree that fits the template.
        NoFoldError
            At the end, if trees fitted but none folded.
        """
        if self.seconds is not None:
            yield self.ranked(self.seconds)
            return
        if self.recipe.closed is not None:
            yield self._closed_to(self.recipe.closed)
            return
        yield from self._round_by_round()

    def _closed_to(self, share: float) -> list[Found]:
        """Trees of as many rounds as it takes until a box is closed to a share, those first.

        Raises
        ------
        NoFoldError
            If no voxelization allows it, or no round found one.
        """
        most = max(self.problems.at_most(option) for option in self.problems.plain)
        if most < share:
            raise NoFoldError(
                f"--closed {share:g}: no box of {self.template.name} can be closed further than to "
                f"{most:.2f} with the voxelizations of this model; take another --template or "
                "--seed, or ask for less"
            )
        everything: list[Found] = []
        for pairs in self._round_by_round():
            everything += pairs
            closed = [closed_share(candidate.tree) for _, candidate in everything]
            if max(closed) >= share:
                return sorted(
                    everything,
                    key=lambda pair: (
                        closed_share(pair[1].tree) < share,
                        pair[1].energy["total"],
                    ),
                )
        best = max(closed_share(candidate.tree) for _, candidate in everything)
        raise NoFoldError(
            f"--closed {share:g}: the best box of {self.recipe.rounds} rounds is closed to "
            f"{best:.2f} (at most {most:.2f} with these voxels); try more --rounds, --effort "
            "thorough, --prefer surface, or ask for less"
        )

    def _round_by_round(self) -> Iterator[list[Found]]:
        fits = found = False
        why = ""
        for number in range(self.recipe.rounds):
            try:
                pairs = self._round(number)
            except NoTreeError as error:
                why = why or str(error)
                self.no_tree_fits(number)
                continue
            fits = True
            if pairs:
                found = True
                yield pairs
        if not fits:
            raise NoTreeError(why)
        if not found:
            raise NoFoldError(
                f"no tree that folds in {self.recipe.rounds} rounds of the search; try "
                "--effort thorough, more --rounds, another --seed or a larger template"
                + self._about_wishes()
            )

    def no_tree_fits(self, number: int) -> bool:
        """Let hinges stand on bosses from the next round on; False where that is nothing new."""
        if not self.problems.bossed or number >= self._bosses_from:
            return False
        self._bosses_from = min(self._bosses_from, number + 1)
        return True

    def _about_wishes(self) -> str:
        """What else may help, as the end of a sentence."""
        if self.template.joints == "inside":
            return ", or allow hinges on the surface: those inside the box seldom can fold it"
        if self.wishes.regions:
            return ", or protect less of the model"
        return ""

    def mark(self) -> list[Any]:
        """What later stages depend on besides the recipe: the ranking, where the clock made it."""
        if self.seconds is None:
            return []
        return [
            [candidate.tree.to_json(1.0, (0.0, 0.0, 0.0)), candidate.path.tolist()]
            for _, candidate in self.ranked(self.seconds)
        ]

    def ranked(self, seconds: float) -> list[Found]:
        """Every tree that folds, best first, found in `seconds` or in earlier runs.

        Raises
        ------
        NoFoldError
            If nothing folds yet.
        """
        if self._ranked is None:
            results = self._search_for(seconds)
            self._ranked = self._paired(results)
            if results and not any(result.fits for result in results.values()):
                raise NoTreeError(results[min(results)].why)
        if not self._ranked:
            raise NoFoldError(
                f"nothing folds yet after {seconds:g} s; what is done is kept: the same command "
                "with a longer --time goes on from there, without --time each seed runs to its end"
            )
        return self._ranked

    def _search_for(self, seconds: float) -> dict[int, SeedResult]:
        """Results of all rounds that there is time for, and of earlier runs."""
        results: dict[int, SeedResult] = {}
        rounds = SEED_STRIDE // SEEDS_PER_ROUND
        if seconds <= 0:
            for number in range(rounds):
                if not (held := self._held(number)):
                    break
                results |= held
                if not any(result.fits for result in results.values()):
                    self.no_tree_fits(number)
            return results
        with self._open_progress("fit") as progress:
            self.wait_for_kernels(progress)
            budget = Budget(seconds)
            tally = Tally(progress, {}, lambda _done: budget.share, describe=self.describe)
            with self.executor(rounds, budget.over) as pool:
                progress.update(None, "getting ready")
                warm_up(pool, self.recipe.first_joints)
                budget.restart()
                for number in range(rounds):
                    results |= self._search_round(number, pool, tally, budget)
                    tally.check_failures()
                    fits = any(result.fits for result in results.values())
                    if budget.over() or not (fits or self.no_tree_fits(number)):
                        break
        tally.check_failures()
        return results

    def wait_for_kernels(self, progress: Progress) -> None:
        """Wait until the kernels are compiled; the search begins."""
        if self._standby is not None:
            self._standby.wait(progress)
        if self._on_begin is not None:
            self._on_begin()

    def executor(self, seeds: int, over: Callable[[], bool]) -> AbstractContextManager[Executor]:
        """What runs the seeds: workers that stood by, or :func:`fabfold.search.run.executor`."""
        ready = None if self._standby is None else self._standby.take()
        if ready is not None:
            return closing(ready)
        return executor(self.workers, self.scheduler, seeds, over)

    def _round(self, number: int) -> list[Found]:
        """Trees that a round finds, each seed run to its end."""
        if number in self._done:
            return self._done[number]
        whole = self._held(number, whole=True)
        results = whole
        if not self._is_complete(number, whole):
            with self._open_progress(f"fit-{number}") as progress:
                self.wait_for_kernels(progress)
                total = sum(rung.seeds for rung in self._rungs(number))
                tally = Tally(progress, {}, lambda done: done / total, total, self.describe)
                forever = Budget()
                with self.executor(total, forever.over) as pool:
                    results = self._search_round(number, pool, tally, forever)
                tally.check_failures()
        require_fit([results[seed] for seed in sorted(results)])
        self._done[number] = self._paired(results)
        return self._done[number]

    # The rungs of a round ---------------------------------------------------------------------

    def _rungs(self, number: int) -> tuple[Rung, ...]:
        return schedule(self.recipe.effort, number, large=len(self.template) > LARGE)

    def _search_round(
        self, number: int, pool: Executor, tally: Tally, budget: Budget
    ) -> dict[int, SeedResult]:
        """Run the rungs of a round, those seeds that are not done, until they no longer pay."""
        results: dict[int, SeedResult] = {}
        for place, rung in enumerate(self._rungs(number)):
            before = _best(results)
            tasks = self._tasks(number, place, results)
            if not tasks:
                break
            keys = {task.seed: task.key for task in tasks}
            known = self._cache.known(keys)
            limit = budget.seconds
            # With no more time than it had before, a seed would not come further.
            done = {
                seed: result
                for seed, result in known.items()
                if result.cut is None or (limit is not None and result.cut >= limit)
            }
            tally.include(known)
            found: dict[int, SeedResult] = dict(known)

            def on_event(
                event: Event,
                keys: dict[int, str] = keys,
                found: dict[int, SeedResult] = found,
            ) -> None:
                event = self._cache.keep(event, keys[event.seed], budget.seconds or 0.0)
                best = tally.best
                tally.on_event(event)
                if tally.best is not None and tally.best is not best:
                    self._tell_better(tally.best)
                if event.seed in tally.results:
                    found[event.seed] = tally.results[event.seed]

            todo = ((task.seed, self._work(task)) for task in tasks if task.seed not in done)
            run_seeds(pool, todo, on_event, budget.over)
            results |= found
            if budget.over() or rung.is_last(before, _best(results)):
                break
        return results

    def _tell_better(self, candidate: Candidate) -> None:
        option = self._option_of.get(candidate.seed)
        if self._on_better is not None and option is not None:
            self._on_better((self.problems.options[option], candidate))

    def _held(self, number: int, whole: bool = False) -> dict[int, SeedResult]:
        """Results of a round that earlier runs left; with `whole` those that ran to their end."""
        results: dict[int, SeedResult] = {}
        for place in range(len(self._rungs(number))):
            keys = {task.seed: task.key for task in self._tasks(number, place, results)}
            held = self._cache.known(keys)
            if whole:
                held = {seed: result for seed, result in held.items() if result.cut is None}
            if not held:
                break
            results |= held
        return results

    def _is_complete(self, number: int, results: Mapping[int, SeedResult]) -> bool:
        """Whether these whole results are all that a round would bring."""
        seen: dict[int, SeedResult] = {}
        for place, rung in enumerate(self._rungs(number)):
            before = _best(seen)
            tasks = self._tasks(number, place, seen)
            if any(task.seed not in results for task in tasks):
                return False
            seen |= {task.seed: results[task.seed] for task in tasks}
            if rung.is_last(before, _best(seen)):
                break
        return True

    def _tasks(self, number: int, place: int, results: Mapping[int, SeedResult]) -> list[SeedTask]:
        """What the seeds of one rung search, given the results of those before."""
        rungs = self._rungs(number)
        rung = rungs[place]
        first = self._seeds(number).start + sum(other.seeds for other in rungs[:place])
        seeds = range(first, first + rung.seeds)
        if rung.takes == "best":
            return [
                self._task(number, seed, self._option_of[start.seed], rung, start)
                for seed, start in zip(seeds, best_lines(results, self._origin), strict=False)
            ]
        options = self.problems.bossed if number >= self._bosses_from else self.problems.plain
        order = list(options)
        if rung.takes == "closing":
            order = self.problems.closing_order(options)
        elif rung.takes == "promising":
            order = self.problems.promising_order(options, self._best_by_option(results))
        order = order[: rung.options]
        return [
            self._task(number, seed, order[k % len(order)], rung) for k, seed in enumerate(seeds)
        ]

    def _best_by_option(self, results: Mapping[int, SeedResult]) -> dict[int, float]:
        """Least energy found on each voxelization; infinite where nothing folds."""
        found: dict[int, float] = {}
        for seed in sorted(results):
            option = self._option_of[seed]
            found[option] = min(results[seed].best, found.get(option, float("inf")))
        return found

    def _task(
        self,
        number: int,
        seed: int,
        option: int,
        rung: Rung,
        start: Candidate | None = None,
    ) -> SeedTask:
        recipe, effort = self.recipe, rung.effort
        joints = recipe.every_joint if rung.every_joint else recipe.first_joints
        self._option_of[seed] = option
        about: list[Any] = [recipe.surface_weight, recipe.single_weight, self._carves(number)]
        about += [*wished(recipe, joints), repr(effort), option]
        if start is not None:
            self._origin[seed] = start.seed
            about += [start.tree.to_json(1.0, (0.0, 0.0, 0.0)), start.path.tolist()]
        key = stage_key(self._key, *about, seed)
        return SeedTask(seed, key, option, number, effort, joints, start)

    def _work(self, task: SeedTask) -> Job | SeedResult:
        """What a seed searches, or its result where its voxelization rules every tree out."""
        job = self.problems.job(task.option, task.seed, task.joints)
        if isinstance(job, SeedResult):
            return job
        if self._carves(task.number):
            material = self.problems.options[task.option].subvoxels
            judge = LatticeFoldability(carve=CORE_HALF_SIDE, material=material)
            job = replace(job, foldability=judge)
        return replace(job, effort=task.effort, start=task.start)

    def describe(self, candidate: Candidate) -> str:
        """A tree in a few words: hinges, and how closed the box is and could be."""
        text = f"{len(candidate.tree.hinges)} hinges, box closed to "
        text += f"{100 * closed_share(candidate.tree):.0f} %"
        option = self._option_of.get(candidate.seed)
        if option is not None:
            text += f" (at most {100 * self.problems.at_most(option):.0f} %)"
        return text

    # For those who run several rounds at once ---------------------------------------------------

    def batch(self, number: int) -> Batch:
        """Seeds of a round that need none of each other's results."""
        tasks = self._batch_tasks(number)
        keys = {task.seed: task.key for task in tasks}
        whole = {s: r for s, r in self._cache.known(keys).items() if r.cut is None}
        return Batch(keys, whole)

    def _batch_tasks(self, number: int) -> list[SeedTask]:
        return [task for place in (0, 1) for task in self._tasks(number, place, {})]

    def keep(self, event: Event, key: str) -> None:
        """Keep what a seed of a batch found."""
        self._cache.keep(event, key)

    def job(self, number: int, seed: int) -> Job | SeedResult:
        """What a seed of a batch searches, or its result where no tree can fit."""
        return self._work(next(t for t in self._batch_tasks(number) if t.seed == seed))

    def voxels(self, seed: int) -> Voxels:
        """The voxelization that a seed searched."""
        return self.problems.options[self._option_of[seed]]

    def _paired(self, results: Mapping[int, SeedResult]) -> list[Found]:
        """Trees of all seeds that can be folded to the end, best first."""
        pairs = [
            (self.voxels(seed), candidate)
            for seed in sorted(results)
            for candidate in self.closed(results[seed].candidates)
        ]
        return sorted(pairs, key=lambda pair: pair[1].energy["total"])

    def _seeds(self, number: int) -> range:
        first = self.recipe.seed * SEED_STRIDE + self._shift + number * SEEDS_PER_ROUND
        return range(first, first + SEEDS_PER_ROUND)

    def _carves(self, number: int) -> bool:
        """Whether cells may be cut in this round: where whole ones do not fold, every second one.

        On large templates near misses are locked by more than corners: it would only cost time.
        """
        return number % 2 == 1 and len(self.template) <= LARGE and not self.template.creases

    def closed(self, candidates: Sequence[Candidate]) -> list[Candidate]:
        """Those that can be folded along the template's creases too, where it has any."""
        folded = (add_crease_hinges(candidate, self.template) for candidate in candidates)
        return [candidate for candidate in folded if candidate is not None]


def _best(results: Mapping[int, SeedResult]) -> float:
    """Least energy of all results; infinite where nothing folds."""
    return min((result.best for result in results.values()), default=float("inf"))
