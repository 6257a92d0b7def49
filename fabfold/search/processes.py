"""Seeds in this process, or in worker processes on this machine."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any

from fabfold.child_process import end_with_parent, safe_path
from fabfold.search.seeds import Better, Done, Event, Job, Lost, run_seed
from fabfold.search.warmup import warm_up_job
from fabfold.tree.candidate import Candidate
from fabfold.tree.catalogue import JointSet

__all__ = ["InProcessExecutor", "ProcessExecutor"]

_SPAWN = multiprocessing.get_context("spawn")
#: Seconds that a worker has to end by itself before it is killed.
PATIENCE = 5.0
#: Seconds that a worker on standby waits for its first seed before it ends.
STANDBY = 60.0
#: How far workers step back where there are fewer cores than processes.
_NICE = 5


class InProcessExecutor:
    """Runs one seed at a time in this process: for debugging, and for small problems.

    Parameters
    ----------
    over : callable
        Polled while a seed runs; True ends it early.
    """

    def __init__(self, over: Callable[[], bool]) -> None:
        self._over = over
        self._next: tuple[Job, int] | None = None

    def free(self) -> int:
        """Seeds that can be taken now."""
        return int(self._next is None)

    def submit(self, job: Job, seed: int) -> None:
        """Take a seed; it runs in :meth:`wait`."""
        self._next = job, seed

    def wait(self, on_event: Callable[[Event], None], seconds: float) -> None:
        """Run the seed to its end."""
        if self._next is None:
            return
        job, seed = self._next

        def report(candidate: Candidate) -> None:
            on_event(Better(seed, candidate))

        result = run_seed(job, seed, report, self._over)
        self._next = None
        on_event(Done(seed, result))

    def stop(self) -> None:
        """Do nothing: the seed polls for itself."""

    def close(self) -> None:
        """Do nothing: nothing runs."""


@dataclass
class _Worker:
    connection: Connection
    #: None for one that was forked: it ends with its pipe, or with the process that forked it.
    process: BaseProcess | None
    seed: int | None = None


class ProcessExecutor:
    """Runs seeds in worker processes on this machine, each started when it is first needed.

    Those on standby are forked from one process that has loaded the kernels, where the system can
    do so: loading takes as long as a seed of a small model. Every worker has a pipe of its own. So
    a worker that dies, for whatever reason, tells by its pipe which seed it had, and the others do
    not notice; and workers whose parent dies end too.

    Parameters
    ----------
    count : int
        Most processes at a time.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._workers: list[_Worker] = []
        self._forking: BaseProcess | None = None
        self._has_run = False

    def stand_by(self, joints: JointSet, seconds: float = STANDBY) -> None:
        """Start all workers now, so that they have loaded the kernels when there are seeds.

        Parameters
        ----------
        joints : str
            Joint types of the search to come.
        seconds : float
            Those that get no seed for so long end by themselves.
        """
        if sys.platform != "linux":  # Elsewhere those that are forked would not end with this one.
            while len(self._workers) < self._count:
                self._start((joints, seconds))
            return
        pipes = [_SPAWN.Pipe() for _ in range(self._count - len(self._workers))]
        self._forking = _started(_fork_workers, [theirs for _, theirs in pipes], joints, seconds)
        for ours, theirs in pipes:
            theirs.close()
            self._workers.append(_Worker(ours, None))

    def free(self) -> int:
        """Seeds that can be taken now."""
        return self._count - sum(worker.seed is not None for worker in self._workers)

    def submit(self, job: Job, seed: int) -> None:
        """Send a seed to an idle worker, or to a new one."""
        while True:
            idle = [worker for worker in self._workers if worker.seed is None]
            worker = idle[0] if idle else self._start()
            try:
                worker.connection.send((job, seed))
            except OSError:  # It died while it had nothing to do.
                self._drop(worker)
                if not idle:
                    raise
                continue
            worker.seed = seed
            self._has_run = True
            return

    def _start(self, standby: tuple[JointSet, float] | None = None) -> _Worker:
        ours, theirs = _SPAWN.Pipe()
        process = _started(_serve, theirs, standby)
        theirs.close()
        worker = _Worker(ours, process)
        self._workers.append(worker)
        return worker

    def _drop(self, worker: _Worker) -> None:
        self._workers.remove(worker)
        worker.connection.close()
        _end(worker.process)

    def wait(self, on_event: Callable[[Event], None], seconds: float) -> None:
        """Hand on to `on_event` what the workers sent, and which of them are gone."""
        busy = {worker.connection: worker for worker in self._workers if worker.seed is not None}
        for connection in wait(list(busy), seconds):
            self._read(busy[connection], on_event)  # type: ignore[index]

    def _read(self, worker: _Worker, on_event: Callable[[Event], None]) -> None:
        """Hand on what one worker sent; of several better trees only the last counts."""
        better: Event | None = None
        end: Event | None = None
        try:
            while end is None and worker.connection.poll():
                event: Event = worker.connection.recv()
                if isinstance(event, Better):
                    better = event
                else:
                    end = event
                    worker.seed = None
        except (EOFError, OSError):
            assert worker.seed is not None
            end = Lost(worker.seed)
            self._drop(worker)
        for last in (better, end):
            if last is not None:
                on_event(last)

    def _are_idle(self) -> bool:
        """Whether workers have run seeds, and none runs one: they end at once by themselves.

        One that has run none may still be loading the kernels.
        """
        return self._has_run and all(worker.seed is None for worker in self._workers)

    def stop(self) -> None:
        """Ask the seeds that run to end early with what they have."""
        for worker in self._workers:
            if worker.seed is not None:
                try:
                    worker.connection.send(None)
                except OSError:
                    continue  # It is gone; `wait` tells.

    def close(self) -> None:
        """End all workers at once: none has anything left that is wanted."""
        for worker in self._workers:
            worker.connection.close()
            if worker.process is not None:
                worker.process.terminate()
        if self._forking is not None and not self._are_idle():
            self._forking.terminate()  # And its children, in the middle of what they do.
        for process in (*(worker.process for worker in self._workers), self._forking):
            _end(process)
        self._workers.clear()
        self._forking = None


def _started(target: Callable[..., None], *arguments: Any) -> BaseProcess:
    process = _SPAWN.Process(target=target, args=arguments, name="fabfold-seed", daemon=True)
    with _stops_held(), safe_path():
        process.start()
    return process


def _end(process: BaseProcess | None) -> None:
    if process is None:
        return
    process.join(PATIENCE)
    if process.is_alive():
        process.kill()
        process.join()
    process.close()


@contextmanager
def _stops_held() -> Iterator[None]:
    """Hold a stop back while a process starts; it is heard after.

    A process whose parent is stopped before it was told all would say so with a traceback. Ctrl-C
    reaches the whole process group: the process comes with that signal blocked, since the parent
    decides what is kept and ends the workers. Blocking alone would not do, for another thread of
    this process may take a signal, and Python's handler then runs in the first one all the same.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    asked: list[int] = []
    heard = {name: signal.getsignal(name) for name in (signal.SIGINT, signal.SIGTERM)}
    heard = {name: handler for name, handler in heard.items() if callable(handler)}
    for name in heard:
        signal.signal(name, lambda number, _: asked.append(number))
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        for name, handler in heard.items():
            signal.signal(name, handler)
        if asked:
            signal.raise_signal(asked[0])


def _begin() -> None:
    """Leave Ctrl-C to the process that started this one, and end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    if hasattr(os, "nice"):  # What a person waits for goes first: the first kit, and the screen.
        os.nice(_NICE)
    caller = multiprocessing.parent_process()
    end_with_parent(None if caller is None else caller.pid)


def _warm_up(joints: JointSet) -> None:
    run_seed(warm_up_job(joints), 1, lambda _: None, lambda: False)


def _fork_workers(connections: Sequence[Connection], joints: JointSet, seconds: float) -> None:
    """Load the kernels, become a worker for each connection, and wait until all of them ended."""
    _begin()
    _warm_up(joints)
    parent = os.getpid()
    for connection in connections:
        if os.fork() == 0:
            end_with_parent(parent)
            for other in connections:
                if other is not connection:
                    other.close()
            if connection.poll(seconds):
                _run_seeds(connection)
            os._exit(0)
    for connection in connections:
        connection.close()
    with suppress(ChildProcessError):
        while True:
            os.wait()


def _serve(connection: Connection, standby: tuple[JointSet, float] | None) -> None:
    """Run seeds as they come, until the parent closes the pipe or is gone."""
    _begin()
    if standby is not None:
        joints, seconds = standby
        _warm_up(joints)
        if not connection.poll(seconds):
            return
    _run_seeds(connection)


def _run_seeds(connection: Connection) -> None:
    def stop() -> bool:
        if not connection.poll():
            return False
        try:
            connection.recv()
        except (EOFError, OSError):
            os._exit(0)  # Nobody listens any more.
        return True

    try:
        while True:
            message = connection.recv()
            if message is None:
                continue  # It came when the seed had just ended.
            job, seed = message

            def report(candidate: Candidate, seed: int = seed) -> None:
                connection.send(Better(seed, candidate))

            connection.send(Done(seed, run_seed(job, seed, report, stop)))
    except (EOFError, OSError):
        return
