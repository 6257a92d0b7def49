"""Rounds of the search: seeds by the handful, one voxelization after the other."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from fabfold.errors import NoFoldError, NoTreeError, RecipeError
from fabfold.fold.closing import closed
from fabfold.fold.cores import CORE
from fabfold.fold.foldability import LatticeFoldability
from fabfold.lattice import Template
from fabfold.progress import Progress
from fabfold.recipe import Recipe
from fabfold.search import Budget, Tally, best_first, executor, run_seeds, search, warm_up
from fabfold.seeds import Event, Job, SeedResult
from fabfold.shelf import Shelf
from fabfold.store import StageStore, stage_key
from fabfold.tree.effort import EFFORTS
from fabfold.tree.parts import parted
from fabfold.tree.problem import from_features
from fabfold.tree.solve import Candidate
from fabfold.tree.wishes import Wishes, rank_by_cuts, uncut_pairs
from fabfold.voxels.features import features
from fabfold.voxels.model import Voxels
from fabfold.wishes import weights_of, wished

__all__ = ["Rounds", "search_order"]

#: Seeds in one round; constants, so that results do not depend on the workers.
SEEDS_PER_ROUND = 4
SEEDS_PER_LARGE_ROUND = 2
#: Templates of more cells are large: a search takes minutes, and a full template seldom folds.
LARGE = 72
#: Share of a large template that a voxelization leaves free to be searched first.
ROOM = 0.06
#: Distance of the search's first seeds for recipe seeds that follow each other: more than
#: any recipe's rounds use, so that two recipes share none.
SEED_STRIDE = 10_000


def search_order(options: Sequence[Voxels], cells: int) -> list[Voxels]:
    """Order of search: best first, but those that leave a large template some room before."""
    if cells <= LARGE:
        return list(options)
    return sorted(options, key=lambda voxels: len(voxels) > (1.0 - ROOM) * cells)


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
    ordered = search_order(options, len(template))
    if wishes.regions:
        found = [(voxels, features(voxels)) for voxels in ordered]
        ordered = [ordered[index] for index in rank_by_cuts(wishes, found, template)]
    return ordered


@dataclass(frozen=True)
class Batch:
    """The seeds of one round, for those who run several rounds at once.

    Attributes
    ----------
    voxels : Voxels
    keys : dict of int to str
        Seeds, and the digest of all that each one's result depends on.
    known : dict of int to SeedResult
        Those that are done.
    job : callable
        Makes what the seeds share.
    """

    voxels: Voxels
    keys: dict[int, str]
    known: dict[int, SeedResult]
    job: Callable[[], Job]


class Rounds:
    """The search of a recipe, a round at a time; every finished seed is kept.

    Parameters
    ----------
    recipe : Recipe
    template : Template
    options : sequence of Voxels
        Voxelizations, best first; each round searches the next one, with those first that
        leave a large template some room.
    key : str
        Digest of all that `options` depend on.
    store : StageStore
    workers : int or None
    listening : callable
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
        listening: Callable[[str], AbstractContextManager[Progress]],
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
        self._shelf = Shelf(store)
        self._listening = listening
        self._done: dict[int, list[Candidate]] = {}
        self._ranked: list[tuple[Voxels, Candidate]] | None = None

    @property
    def seeds_per_round(self) -> int:
        """Seeds that one round searches."""
        return SEEDS_PER_LARGE_ROUND if len(self.template) > LARGE else SEEDS_PER_ROUND

    def found(self) -> Iterator[tuple[Voxels, list[Candidate]]]:
        """Rounds that found trees that fold, with the voxelization that they join.

        With a budget in seconds, the trees of all rounds best first instead.

        Raises
        ------
        NoTreeError
            At the end, if no round found a tree that fits the template.
        NoFoldError
            At the end, if trees fitted but none folded.
        """
        if self.seconds is not None:
            for _, group in groupby(self.ranked(self.seconds), key=lambda pair: id(pair[0])):
                pairs = list(group)
                yield pairs[0][0], [candidate for _, candidate in pairs]
            return
        fits = found = False
        why = ""
        for number in range(self.recipe.rounds):
            try:
                candidates = self._round(number)
            except NoTreeError as error:
                why = why or str(error)
                continue
            fits = True
            if candidates:
                found = True
                yield self._voxels(number), candidates
        if not fits:
            raise NoTreeError(why)
        if not found:
            raise NoFoldError(
                f"no tree that folds in {self.recipe.rounds} rounds of {self.seeds_per_round} "
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

    def ranked(self, seconds: float) -> list[tuple[Voxels, Candidate]]:
        """Every tree that folds, best first, found in `seconds` or in earlier runs.

        Raises
        ------
        NoFoldError
            If nothing folds yet.
        """
        if self._ranked is None:
            results = self._search_for(seconds)
            count = self.seeds_per_round
            first = self._seeds(0)[0]
            pairs = [
                (self._voxels((seed - first) // count), candidate)
                for seed in sorted(results)
                for candidate in self.closed(results[seed].candidates)
            ]
            self._ranked = sorted(pairs, key=lambda pair: pair[1].energy["total"])
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
        rounds = SEED_STRIDE // self.seeds_per_round
        for number in range(rounds):
            fresh = self._keys(number)
            held = self._shelf.known(fresh)
            if not held:
                break
            keys |= fresh
            known |= held

        def tasks() -> Iterator[tuple[int, Job]]:
            given = bool(known)
            for number in range(rounds):
                tally.check_failures()
                keys.update(self._keys(number))
                job: Job | None = None
                for seed in self._seeds(number):
                    cut = known[seed].cut if seed in known else 0.0
                    # With no more time than it had before, a seed would not come further.
                    if cut is not None and cut < seconds:
                        try:
                            job = job or self._job(number)
                        except NoTreeError:
                            # Another voxelization may do; where none does, the first says why.
                            if number + 1 >= len(self.options) and not given:
                                raise
                            break
                        given = True
                        yield seed, job

        if seconds <= 0:
            return known
        with self._listening("fit") as progress:
            budget = Budget(seconds)
            tally = Tally(progress, known, lambda _done: budget.share)
            with executor(self.workers, self.scheduler, rounds, budget.over) as pool:

                def hear(event: Event) -> None:
                    tally.hear(self._shelf.keep(event, keys[event.seed], seconds))

                progress.update(None, "getting ready")
                warm_up(pool)
                budget.restart()
                run_seeds(pool, tasks(), hear, budget.over)
        tally.check_failures()
        return tally.results

    def _voxels(self, number: int) -> Voxels:
        return self.options[number % len(self.options)]

    def _seeds(self, number: int) -> range:
        count = self.seeds_per_round
        first = self.recipe.seed * SEED_STRIDE + self._shift + number * count
        return range(first, first + count)

    def _keys(self, number: int) -> dict[int, str]:
        """Digest of all that each seed of a round depends on."""
        recipe = self.recipe
        about = [recipe.surface_weight, recipe.single_weight, recipe.effort, number]
        about += wished(recipe)
        return {seed: stage_key(self._key, *about, seed) for seed in self._seeds(number)}

    def batch(self, number: int) -> Batch:
        """The seeds of a round."""
        keys = self._keys(number)
        whole = {s: r for s, r in self._shelf.known(keys).items() if r.cut is None}
        return Batch(self._voxels(number), keys, whole, lambda: self._job(number))

    def keep(self, event: Event, key: str) -> None:
        """Keep what a seed of a batch tells."""
        self._shelf.keep(event, key)

    def _job(self, number: int) -> Job:
        voxels = self._voxels(number)
        joints = features(voxels)
        uncut = self.wishes.uncut(voxels, joints, self.template)
        problem = from_features(
            voxels,
            joints,
            self.template,
            weights_of(self.recipe),
            bias=self.wishes.bias(voxels, self.template),
            stiff=uncut_pairs(uncut, joints),
            joints=self.recipe.joints,
            share=self.recipe.share,
        )
        problem = self.wishes.apply(problem, voxels, self.template)
        if self.template.creases:
            problem = parted(problem, self._seeds(number)[0], joints.depth)
        return Job(problem, self._judge(number, voxels), EFFORTS[self.recipe.effort])

    def _judge(self, number: int, voxels: Voxels) -> LatticeFoldability:
        """Whole cells count at first; where they do not fold, every second round lets them be cut.

        On large templates near misses are locked by more than corners: it would only cost time.
        """
        if number % 2 == 0 or len(self.template) > LARGE or self.template.creases:
            return LatticeFoldability()
        return LatticeFoldability(carve=CORE, material=voxels.subvoxels)

    def _round(self, number: int) -> list[Candidate]:
        if number in self._done:
            return self._done[number]
        keys = self._keys(number)
        known = {
            seed: result for seed, result in self._shelf.known(keys).items() if result.cut is None
        }

        def hear(event: Event) -> None:
            self._shelf.keep(event, keys[event.seed])

        if len(known) == len(keys):
            candidates = best_first(self._seeds(number), known)
        else:
            with self._listening(f"fit-{number}") as progress:
                job = self._job(number)
                candidates = search(
                    job.problem,
                    self._seeds(number),
                    job.foldability,
                    job.effort,
                    workers=self.workers,
                    scheduler=self.scheduler,
                    progress=progress,
                    known=known,
                    hear=hear,
                )
        candidates = self.closed(candidates)
        self._done[number] = candidates
        return candidates

    def closed(self, candidates: Sequence[Candidate]) -> list[Candidate]:
        """Those that can be folded along the template's creases too, where it has any."""
        folded = (closed(candidate, self.template) for candidate in candidates)
        return [candidate for candidate in folded if candidate is not None]
