"""The side of a Dask worker: what a cluster's worker runs for :mod:`fabfold.search.dask`."""

from __future__ import annotations

import pickle
import zlib
from typing import Any

from fabfold.search.seeds import Better, Event, Job, run_seed
from fabfold.tree.candidate import Candidate

__all__ = ["run_payload", "stop_search", "unpacked"]

#: Searches whose seeds shall end early.
_stopped: set[str] = set()


def stop_search(topic: str) -> None:
    """End the seeds of a search that run in this worker, with what they have."""
    _stopped.add(topic)


def unpacked(news: Any) -> Event:
    """The event in what a worker wrote to the topic of a search: (time stamp, bytes)."""
    event: Event = pickle.loads(zlib.decompress(news[1]))
    return event


def run_payload(payload: bytes, seed: int, topic: str) -> bytes:
    """Run a seed in a task of this worker.

    Parameters
    ----------
    payload : bytes
        Compressed pickle of a :class:`~fabfold.search.seeds.Job`.
    seed : int
        Seed of every random choice of this task.
    topic : str
        Where better trees are told, and the name under which the search is stopped.

    Returns
    -------
    bytes
        Compressed pickle of a :class:`~fabfold.search.seeds.SeedResult`.
    """
    from distributed import get_worker

    job: Job = pickle.loads(zlib.decompress(payload))
    worker = get_worker()
    key = worker.get_current_task()

    def report(candidate: Candidate) -> None:
        worker.log_event(topic, zlib.compress(pickle.dumps(Better(seed, candidate)), 1))

    def stop() -> bool:
        if topic in _stopped:
            return True
        # The scheduler takes a task back when its client cancels it, or is gone.
        task = worker.state.tasks.get(key)
        return task is None or task.state == "cancelled"

    return zlib.compress(pickle.dumps(run_seed(job, seed, report, stop)), 1)
