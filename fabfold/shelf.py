"""What the seeds of a search found, kept in a kit as soon as it is known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from fabfold.seeds import Better, Done, Event, SeedResult
from fabfold.stagefiles import load_seed, save_seed
from fabfold.store import StageStore

__all__ = ["Shelf"]


class Shelf:
    """Results of seeds in a stage store: whole ones, and the best so far of those cut short.

    Parameters
    ----------
    store : StageStore
    """

    def __init__(self, store: StageStore) -> None:
        self._store = store
        self._cut: dict[int, SeedResult] = {}

    def known(self, keys: Mapping[int, str]) -> dict[int, SeedResult]:
        """Results that are kept, of the seeds whose digest is given.

        Those with ``cut`` set did not run to their end.
        """
        found: dict[int, SeedResult] = {}
        for seed, key in keys.items():
            if self._store.holds(_name(seed), key):
                found[seed] = load_seed(self._store, seed)
                if found[seed].cut is not None:
                    self._cut[seed] = found[seed]
        return found

    def keep(self, event: Event, key: str, seconds: float = 0.0) -> Event:
        """Keep what `event` tells.

        Parameters
        ----------
        event : Event
        key : str
            Digest of all that the seed's result depends on.
        seconds : float
            Budget that ends seeds early; noted with those that it ended.

        Returns
        -------
        Event
            The same, but a seed that was cut short keeps what an earlier run had found better.
        """
        seed = event.seed
        if isinstance(event, Better):
            result = SeedResult((event.candidate,), cut=0.0)
            if result.best < self._best(seed):
                self._save(seed, key, result)
        elif isinstance(event, Done) and not event.result.failed:
            result = event.result
            if result.cut is not None:
                if self._best(seed) < result.best:
                    result = self._cut[seed]
                result = replace(result, cut=seconds)
            self._save(seed, key, result)
            return Done(seed, result)
        return event

    def _best(self, seed: int) -> float:
        return self._cut[seed].best if seed in self._cut else float("inf")

    def _save(self, seed: int, key: str, result: SeedResult) -> None:
        if result.cut is None:
            self._cut.pop(seed, None)
        else:
            self._cut[seed] = result
        if self._store.folder is not None:
            self._store.record(_name(seed), key, save_seed(self._store, seed, result))


def _name(seed: int) -> str:
    return f"seed-{seed}"
