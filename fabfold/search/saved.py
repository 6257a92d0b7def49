"""What the seeds of a search found, kept in a kit as soon as it is known."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fabfold.files import write_json
from fabfold.search.seeds import Better, Done, Event, SeedResult
from fabfold.store import StageStore
from fabfold.tree.candidate import Candidate
from fabfold.tree.fold_tree import FoldTree

__all__ = ["SeedCache", "load_seed", "save_seed"]


class SeedCache:
    """Results of seeds in a stage store: whole ones, and the best so far of those cut short.

    Parameters
    ----------
    store : StageStore
        The stages of the kit; results are files of it.
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
        """Keep what an event brings.

        Parameters
        ----------
        event : Event
            What a seed found, or that it ended.
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


def save_seed(store: StageStore, seed: int, result: SeedResult) -> list[str]:
    """Write what one seed of the search found."""
    file = f"seed-{seed}.json"
    entries = [
        {"tree": c.tree.to_json(1.0, (0.0, 0.0, 0.0)), "path": c.path.tolist(), "seed": c.seed}
        for c in result.candidates
    ]
    content = {
        "format": "fabfold-seed",
        "version": 1,
        "fits": result.fits,
        "why": result.why,
        "cut": result.cut,
        "candidates": entries,
    }
    write_json(store.path(file), content)
    return [file]


def load_seed(store: StageStore, seed: int) -> SeedResult:
    """Read what :func:`save_seed` wrote."""
    data = json.loads(store.path(f"seed-{seed}.json").read_text(encoding="utf-8"))
    candidates = tuple(
        Candidate(
            tree=FoldTree.from_json(entry["tree"]),
            path=np.array(entry["path"], dtype=np.int32).reshape(-1, 2),
            seed=entry["seed"],
        )
        for entry in data["candidates"]
    )
    return SeedResult(candidates, data["fits"], data["why"], data.get("cut"))
