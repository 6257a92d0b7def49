"""Rounds of the search: seeds by the handful, each with the next voxelization."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from typing import Any

from fabfold.errors import NoFoldError, NoTreeError, RecipeError
from fabfold.fold.core_sweep import CORE_HALF_SIDE
from fabfold.fold.crease_hinges import add_crease_hinges
from fabfold.fold.lattice_foldability import LatticeFoldability
from fabfold.lattice.template import Template
from fabfold.progress import Progress
from fabfold.recipe.recipe import Recipe
from fabfold.recipe.recipe_wishes import weights_of, wished
from fabfold.search.run import (
    Budget,
    Tally,
    executor,
    require_fit,
    run_seeds,
    search_tasks,
    warm_up,
)
from fabfold.search.saved import SeedCache
from fabfold.search.seeds import Event, Job, SeedResult
from fabfold.store import StageStore, stage_key
from fabfold.tree.candidate import Candidate
from fabfold.tree.effort import EFFORTS
from fabfold.tree.problem import from_features
from fabfold.tree.template_parts import restrict_to_parts
from fabfold.voxels.features import features
from fabfold.voxels.voxel_model import Voxels
from fabfold.wishes.protect import rank_by_cuts, rigid_pairs
from fabfold.wishes.wish_list import Wishes

__all__ = ["Rounds", "search_order"]

#: Seeds in one round; a constant, so that results do not depend on the workers.
SEEDS_PER_ROUND = 4
#: Templates of more cells are large: near misses are locked by more than corners.
LARGE = 72
#: Distance of the search's first seeds for recipe seeds that follow each other: more than
#: any recipe's rounds use, so that two recipes share none.
SEED_STRIDE = 10_000


def search_order(options: Sequence[Voxels]) -> list[Voxels]:
    """Order in which seeds take voxelizations: from the fewest voxels to the most, and again.

    What leaves much of the template free folds within seconds; what fills it better has to beat
    that. Of each two neighbours in size one comes in the first turn, the other in the second.
    """
    ordered = sorted(options, key=len)
    return ordered[0::2] + ordered[1::2]


def _usable(options: Sequence[Voxels], template: Template, wishes: Wishes) -> list[Voxels]:
    """Voxelizations in which the wishes can come true, in their order of search.

    Raises
    ------
    NoTreeError
        If there is none.
    RecipeError
        If the template does not go with the wishes.
    """
    if template.creases and (wishes.keeps or wishes.void):
        raise RecipeError(
            f"template {template.name!r} folds once more when it is filled: --keep and --void, "
            "which speak of the sides of the filled template, do not go with it"
        )
    if template.joints == "inside":
        # The last hinge to turn brings two halves together. With all four cells around its edge
        # full, a quarter turn before the end some of them would have been in one another.
        roomy = [voxels for voxels in options if len(voxels) < len(template)]
        if not roomy:
            raise NoTreeError(
                f"joints inside: every voxelization fills all {len(template)} cells of template "
                f"{template.name!r}, and the last hinge to turn needs an empty cell beside it; "
                "take a template with a few more cells, a larger --drop-below, or allow hinges "
                "on the surface"
            )
        options = roomy
    ordered = search_order(options)
    if wishes.regions:
        found = [(voxels, features(voxels)) for voxels in ordered]
        ordered = [ordered[index] for index in rank_by_cuts(wishes.regions, found, template)]
    return ordered


#: A tree that folds, and the voxels that it joins.
Found = tuple[Voxels, Candidate]


@dataclass(frozen=True)
class Batch:
    """The seeds of one round, for those who run several rounds at once.

    Attributes
    ----------
    keys : dict of int to str
        Seeds, and the digest of all that each one's result depends on.
    known : dict of int to SeedResult
        Those that are done.
    """

    keys: dict[int, str]
    known: dict[int, SeedResult]


class Rounds:
    """The search of a recipe, a round at a time; every finished seed is kept.

    Parameters
    ----------
    recipe : Recipe
        Weights, effort, joints and seed of the search.
    template : Template
        The target shape, as it is filled.
    options : sequence of Voxels
        Voxelizations; each seed searches the next one, see :func:`search_order`.
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
    ) -> None:
        self.recipe = recipe
        self.template = template
        self.wishes = wishes or Wishes()
        self.options = _usable(options, template, self.wishes)
        self._shift = shift
        self.workers = workers
        self.scheduler = scheduler
        self.seconds = seconds
        self._key = key
        self._cache = SeedCache(store)
        self._open_progress = open_progress
        self._jobs: dict[int, Job | SeedResult] = {}
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
        fits = found = False
        why = ""
        for number in range(self.recipe.rounds):
            try:
                pairs = self._round(number)
            except NoTreeError as error:
                why = why or str(error)
                continue
            fits = True
            if pairs:
                found = True
                yield pairs
        if not fits:
            raise NoTreeError(why)
        if not found:
            raise NoFoldError(
                f"no tree that folds in {self.recipe.rounds} rounds of {SEEDS_PER_ROUND} "
                "seeds; try --effort thorough, more --rounds, another --seed or a larger template"
                + self._about_wishes()
            )

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
        keys: dict[int, str] = {}
        known: dict[int, SeedResult] = {}
        rounds = SEED_STRIDE // SEEDS_PER_ROUND
        for number in range(rounds):
            fresh = self._keys(number)
            held = self._cache.known(fresh)
            if not held:
                break
            keys |= fresh
            known |= held

        def searchable() -> bool:
            """Whether any voxelization can be searched at all."""
            jobs = any(isinstance(job, Job) for job in self._jobs.values())
            return jobs or any(result.fits for result in tally.results.values())

        def tasks() -> Iterator[tuple[int, Job | SeedResult]]:
            for number in range(rounds):
                tally.check_failures()
                keys.update(self._keys(number))
                for seed in self._seeds(number):
                    cut = known[seed].cut if seed in known else 0.0
                    # With no more time than it had before, a seed would not come further.
                    if cut is not None and cut < seconds:
                        yield seed, self.job(seed)
                if number * SEEDS_PER_ROUND >= len(self.options) and not searchable():
                    return

        if seconds <= 0:
            return known
        with self._open_progress("fit") as progress:
            budget = Budget(seconds)
            tally = Tally(progress, known, lambda _done: budget.share)
            with executor(self.workers, self.scheduler, rounds, budget.over) as pool:

                def on_event(event: Event) -> None:
                    tally.on_event(self._cache.keep(event, keys[event.seed], seconds))

                progress.update(None, "getting ready")
                warm_up(pool, self.recipe.joints)
                budget.restart()
                run_seeds(pool, tasks(), on_event, budget.over)
        tally.check_failures()
        return tally.results

    def _option(self, seed: int) -> int:
        """Number of the voxelization that a seed searches."""
        return (seed - self._seeds(0)[0]) % len(self.options)

    def voxels(self, seed: int) -> Voxels:
        """The voxelization that a seed searches."""
        return self.options[self._option(seed)]

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

    def _keys(self, number: int) -> dict[int, str]:
        """Digest of all that each seed of a round depends on."""
        recipe = self.recipe
        about = [recipe.surface_weight, recipe.single_weight, recipe.effort, self._carves(number)]
        about += wished(recipe)
        return {seed: stage_key(self._key, *about, seed) for seed in self._seeds(number)}

    def batch(self, number: int) -> Batch:
        """The seeds of a round."""
        keys = self._keys(number)
        whole = {s: r for s, r in self._cache.known(keys).items() if r.cut is None}
        return Batch(keys, whole)

    def keep(self, event: Event, key: str) -> None:
        """Keep what a seed of a batch found."""
        self._cache.keep(event, key)

    def job(self, seed: int) -> Job | SeedResult:
        """What a seed searches, or its result where its voxelization rules every tree out."""
        if self.template.creases:
            return self._job_of(seed)  # the faces of the parts depend on the seed
        option = self._option(seed)
        if option not in self._jobs:
            self._jobs[option] = self._job_of(seed)
        job = self._jobs[option]
        if isinstance(job, Job) and self._carves((seed - self._seeds(0)[0]) // SEEDS_PER_ROUND):
            judge = LatticeFoldability(carve=CORE_HALF_SIDE, material=self.voxels(seed).subvoxels)
            return replace(job, foldability=judge)
        return job

    def _job_of(self, seed: int) -> Job | SeedResult:
        voxels = self.voxels(seed)
        joints = features(voxels)
        protected = self.wishes.protected(voxels, joints, self.template)
        try:
            problem = from_features(
                voxels,
                joints,
                self.template,
                weights_of(self.recipe),
                extra_cost=self.wishes.extra_cost(voxels, self.template),
                always_rigid=rigid_pairs(protected, joints),
                joints=self.recipe.joints,
                share=self.recipe.share,
            )
            problem = self.wishes.with_roots(problem, voxels, self.template)
            if self.template.creases:
                problem = restrict_to_parts(problem, seed, joints.depth)
        except NoTreeError as error:
            return SeedResult((), fits=False, why=str(error))
        return Job(problem, LatticeFoldability(), EFFORTS[self.recipe.effort])

    def _carves(self, number: int) -> bool:
        """Whether cells may be cut in this round: where whole ones do not fold, every second one.

        On large templates near misses are locked by more than corners: it would only cost time.
        """
        return number % 2 == 1 and len(self.template) <= LARGE and not self.template.creases

    def _round(self, number: int) -> list[Found]:
        if number in self._done:
            return self._done[number]
        keys = self._keys(number)
        results: Mapping[int, SeedResult] = {
            seed: result for seed, result in self._cache.known(keys).items() if result.cut is None
        }

        def on_event(event: Event) -> None:
            self._cache.keep(event, keys[event.seed])

        if len(results) < len(keys):
            with self._open_progress(f"fit-{number}") as progress:
                results = search_tasks(
                    {seed: self.job(seed) for seed in keys},
                    workers=self.workers,
                    scheduler=self.scheduler,
                    progress=progress,
                    known=results,
                    on_event=on_event,
                )
        require_fit([results[seed] for seed in keys])
        self._done[number] = self._paired(results)
        return self._done[number]

    def closed(self, candidates: Sequence[Candidate]) -> list[Candidate]:
        """Those that can be folded along the template's creases too, where it has any."""
        folded = (add_crease_hinges(candidate, self.template) for candidate in candidates)
        return [candidate for candidate in folded if candidate is not None]
