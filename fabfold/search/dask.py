"""Seeds on the workers of a Dask cluster.

The scheduler needs nothing of fabfold; each worker needs the same fabfold as the client, and none
of the client's files: what a seed needs travels with it. A worker runs one seed at a time, which is
given to that very worker. So a worker that is gone tells which seed it had, and a seed that takes
workers down is not handed on by the scheduler to one after the other.
"""

from __future__ import annotations

import contextlib
import itertools
import logging
import pickle
import queue
import re
import threading
import time
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from fabfold.errors import RecipeError, WorkerError
from fabfold.search.dask_worker import unpacked
from fabfold.search.seeds import Done, Event, Job, Lost
from fabfold.version import __version__

__all__ = ["DaskExecutor", "check_address"]

#: Seconds to reach the scheduler, and to get an answer from it or a worker.
CONNECT = 10.0
#: Seconds that it waits for a first worker, and for another one when all are gone.
FIRST = 10.0
PATIENCE = 60.0
#: Seconds between looks at which workers there are.
LOOK = 1.0


@dataclass
class _Running:
    seed: int
    future: Any
    worker: str
    identity: str


class DaskExecutor:
    """Runs seeds on the workers of a Dask scheduler.

    Parameters
    ----------
    address : str
        Such as ``tcp://host:8786``.

    Raises
    ------
    RecipeError
        If the address is wrong, nobody answers there, the extra ``cluster`` is not installed, or
        workers lack fabfold or have another version.
    """

    def __init__(self, address: str) -> None:
        self._address = address
        self._client = _connect(address)
        self._topic = f"fabfold-{self._client.id}"
        self._events: queue.SimpleQueue[tuple[str, Any]] = queue.SimpleQueue()
        self._client.subscribe_topic(self._topic, lambda event: self._events.put(("better", event)))
        self._running: dict[str, _Running] = {}
        self._numbers = itertools.count()
        self._payload: tuple[Job, bytes] | None = None
        self._workers: dict[str, str] = {}
        self._foreign: dict[str, str] = {}
        self._looked = self._last_seen = 0.0
        try:
            self._first_look()
        except BaseException:
            self.close()
            raise

    # Workers ----------------------------------------------------------------------------------

    def _first_look(self) -> None:
        deadline = time.monotonic() + FIRST
        while not self._workers and not self._foreign and time.monotonic() < deadline:
            self._look()
            time.sleep(0.0 if self._workers else 0.2)
        if self._foreign:
            worker, why = min(self._foreign.items())
            raise RecipeError(
                f"--scheduler {self._address}: worker {worker} {why}; install fabfold "
                f"{__version__} where each worker runs, and start it again"
            )
        if not self._workers:
            raise RecipeError(
                f"--scheduler {self._address}: has no workers; start some with "
                f"'dask worker {self._address} --nthreads 1'"
            )

    def _look(self) -> None:
        """See which workers there are; those that are new are asked for their fabfold."""
        now = time.monotonic()
        if now - self._looked < LOOK and self._workers:
            return
        self._looked = now
        try:
            info = self._client.scheduler_info(n_workers=-1)["workers"]
        except (OSError, TimeoutError, RuntimeError) as error:
            raise self._gone(error) from None
        except KeyError:  # The client has lost the connection, and tells of no workers.
            raise self._gone("the connection is lost") from None
        there = {address: str(worker.get("id", address)) for address, worker in info.items()}
        new = [
            address
            for address, identity in there.items()
            if identity not in (self._workers.get(address), self._foreign.get(address))
        ]
        new = [address for address in new if address not in self._foreign]
        self._workers = {a: there[a] for a in self._workers if there.get(a) == self._workers[a]}
        self._foreign = {a: why for a, why in self._foreign.items() if a in there}
        for address, answer in self._ask(new).items():
            if answer == __version__:
                self._workers[address] = there[address]
            elif isinstance(answer, str):
                self._foreign[address] = f"has fabfold {answer}"
            elif isinstance(answer, ImportError):
                self._foreign[address] = f"cannot import fabfold ({answer})"
        if self._workers:
            self._last_seen = now

    def _ask(self, workers: list[str]) -> dict[str, Any]:
        def version() -> str:  # Nested, so that it travels as code: not all can import fabfold.
            from fabfold.version import __version__ as installed

            return installed

        if not workers:
            return {}
        try:
            answers: dict[str, Any] = self._client.run(version, workers=workers, on_error="return")
        except (OSError, TimeoutError, ValueError, KeyError):
            return {}  # One of them went away meanwhile; the next look asks again.
        return answers

    def _gone(self, why: object) -> WorkerError:
        return WorkerError(
            f"the scheduler {self._address} does not answer any more ({why}); what is done is "
            "kept, the same command goes on from there"
        )

    # The interface of an executor -------------------------------------------------------------

    def free(self) -> int:
        """Seeds that can be taken now: one for each worker that has none of ours."""
        self._look()
        return len(self._idle())

    def _idle(self) -> list[str]:
        busy = {run.worker for run in self._running.values()}
        return sorted(worker for worker in self._workers if worker not in busy)

    def submit(self, job: Job, seed: int) -> None:
        """Give a seed to an idle worker."""

        def run(payload: bytes, seed: int, topic: str) -> bytes:
            from fabfold.search.dask_worker import run_payload

            return run_payload(payload, seed, topic)

        worker = self._idle()[0]
        key = f"{self._topic}-{seed}-{next(self._numbers)}"
        future = self._client.submit(
            run,
            self._packed(job),
            seed,
            self._topic,
            key=key,
            workers=[worker],
            allow_other_workers=False,
            pure=False,
        )
        self._running[key] = _Running(seed, future, worker, self._workers[worker])
        future.add_done_callback(lambda future: self._events.put(("ended", future.key)))

    def _packed(self, job: Job) -> bytes:
        import cloudpickle

        if self._payload is None or self._payload[0] is not job:
            self._payload = job, zlib.compress(cloudpickle.dumps(job), 1)
        return self._payload[1]

    def wait(self, on_event: Callable[[Event], None], seconds: float) -> None:
        """Hand on to `on_event` what the workers sent, and which of them are gone."""
        for kind, content in self._news(seconds):
            if kind == "better":
                on_event(unpacked(content))
            elif content in self._running:
                on_event(self._ended(content))
        self._look()
        for key, run in list(self._running.items()):
            if self._workers.get(run.worker) != run.identity:
                del self._running[key]
                run.future.cancel()
                on_event(Lost(run.seed))
        if not self._workers and time.monotonic() - self._last_seen > PATIENCE:
            raise WorkerError(
                f"the scheduler {self._address} has no worker left; what is done is kept: start "
                "workers, and the same command goes on from there"
            )

    def _news(self, seconds: float) -> list[tuple[str, Any]]:
        news: list[tuple[str, Any]] = []
        try:
            news.append(self._events.get(timeout=seconds))
            while True:
                news.append(self._events.get_nowait())
        except queue.Empty:
            return news

    def _ended(self, key: str) -> Event:
        run = self._running.pop(key)
        try:
            result = pickle.loads(zlib.decompress(run.future.result(timeout=CONNECT)))
        except Exception:
            # The seed's own errors are part of its result: what comes here is a worker's trouble.
            run.future.cancel()
            return Lost(run.seed)
        run.future.release()
        return Done(run.seed, result)

    def stop(self) -> None:
        """Ask the seeds that run to end early with what they have."""

        def stop(topic: str) -> None:
            from fabfold.search.dask_worker import stop_search

            stop_search(topic)

        workers = [run.worker for run in self._running.values() if run.worker in self._workers]

        def tell() -> None:
            # Who cannot be told ends when its task is taken back.
            with contextlib.suppress(Exception):
                self._client.run(stop, self._topic, workers=workers, on_error="ignore")

        # Aside: a worker whose seed hangs may never answer.
        threading.Thread(target=tell, name="fabfold-stop", daemon=True).start()

    def close(self) -> None:
        """Leave nothing running, and go."""
        # Where the scheduler does not answer, it forgets us when it notices that we are gone.
        with contextlib.suppress(OSError, TimeoutError, RuntimeError):
            for run in self._running.values():
                run.future.cancel()
            self._running.clear()
            self._client.close(timeout=CONNECT)


def check_address(address: str) -> None:
    """Refuse what cannot be the address of a scheduler.

    Raises
    ------
    RecipeError
        If it is none.
    """
    if not re.fullmatch(r"(tcp|tls)://(\[[0-9a-fA-F:]+\]|[^\s:/]+):\d{1,5}", address):
        raise RecipeError(
            f"--scheduler wants an address such as tcp://host:8786, found {address!r}"
        )


def _connect(address: str) -> Any:
    """Client of the scheduler at `address`, which says nothing on the terminal by itself."""
    check_address(address)
    try:
        from distributed import Client
    except ImportError:
        raise RecipeError(
            "--scheduler needs Dask: install fabfold with its extra, pip install 'fabfold[cluster]'"
        ) from None
    for name in ("distributed", "distributed.client", "distributed.core", "distributed.comm"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        return Client(address, timeout=CONNECT, set_as_default=False, name="fabfold")
    except Exception as error:
        # Whatever answers there: a name that is none, a closed port, a server of another kind.
        raise RecipeError(
            f"--scheduler {address}: no Dask scheduler answers there within {CONNECT:g} s "
            f"({str(error) or type(error).__name__}); start one with 'dask scheduler'"
        ) from None
