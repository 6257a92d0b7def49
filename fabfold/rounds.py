"""Rounds of the search: seeds by the handful, one voxelization after the other."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager

from fabfold.errors import NoFoldError, NoTreeError
from fabfold.fold.foldability import LatticeFoldability
from fabfold.lattice import Template
from fabfold.progress import Progress, SilentProgress
from fabfold.recipe import Recipe
from fabfold.search import SeedResult, search
from fabfold.stagefiles import load_seed, save_seed
from fabfold.store import StageStore, stage_key
from fabfold.tree.effort import EFFORTS
from fabfold.tree.problem import Weights, from_features
from fabfold.tree.solve import Candidate
from fabfold.voxels.features import features
from fabfold.voxels.model import Voxels

__all__ = ["Rounds"]

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


def _in_order(options: Sequence[Voxels], cells: int) -> list[Voxels]:
    """Order of search: best first, but those that leave a large template some room before."""
    if cells <= LARGE:
        return list(options)
    return sorted(options, key=lambda voxels: len(voxels) > (1.0 - ROOM) * cells)


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
    ) -> None:
        self.recipe = recipe
        self.template = template
        self.options = _in_order(options, len(template))
        self.workers = workers
        self._key = key
        self._store = store
        self._listening = listening
        self._done: dict[int, list[Candidate]] = {}

    @property
    def seeds_per_round(self) -> int:
        """Seeds that one round searches."""
        return SEEDS_PER_LARGE_ROUND if len(self.template) > LARGE else SEEDS_PER_ROUND

    def found(self) -> Iterator[tuple[Voxels, list[Candidate]]]:
        """Rounds that found trees that fold, with the voxelization that they join.

        Raises
        ------
        NoTreeError
            At the end, if no round found a tree that fits the template.
        NoFoldError
            At the end, if trees fitted but none folded.
        """
        fits = found = False
        why = ""
        for number in range(self.recipe.rounds):
            voxels = self.options[number % len(self.options)]
            try:
                candidates = self._round(number, voxels)
            except NoTreeError as error:
                why = why or str(error)
                continue
            fits = True
            if candidates:
                found = True
                yield voxels, candidates
        if not fits:
            raise NoTreeError(why)
        if not found:
            raise NoFoldError(
                f"no tree that folds in {self.recipe.rounds} rounds of {self.seeds_per_round} "
                "seeds; try --effort thorough, more --rounds, another --seed or a larger template"
            )

    def _round(self, number: int, voxels: Voxels) -> list[Candidate]:
        if number in self._done:
            return self._done[number]
        recipe = self.recipe
        count = self.seeds_per_round
        first = recipe.seed * SEED_STRIDE + number * count
        seeds = range(first, first + count)
        weights = Weights(surface=recipe.surface_weight, single=recipe.single_weight)
        about = [recipe.surface_weight, recipe.single_weight, recipe.effort, number]
        keys = {seed: stage_key(self._key, *about, seed) for seed in seeds}
        known = {
            seed: load_seed(self._store, seed)
            for seed in seeds
            if self._store.holds(f"seed-{seed}", keys[seed])
        }

        def keep(seed: int, result: SeedResult) -> None:
            if self._store.folder is not None:
                self._store.record(f"seed-{seed}", keys[seed], save_seed(self._store, seed, result))

        def run(progress: Progress) -> list[Candidate]:
            return search(
                from_features(voxels, features(voxels), self.template, weights),
                seeds,
                LatticeFoldability(),
                EFFORTS[recipe.effort],
                workers=self.workers,
                progress=progress,
                known=known,
                on_result=keep,
            )

        if len(known) == len(seeds):
            candidates = run(SilentProgress())
        else:
            with self._listening(f"fit-{number}") as progress:
                candidates = run(progress)
        self._done[number] = candidates
        return candidates
