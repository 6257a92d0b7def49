"""Run the tree search for many seeds: in worker processes here, or on a cluster.

The answer depends on the problem, the seeds and the effort alone: every seed is a task of its own,
and the results are merged in the order of the seeds, whichever worker finished first. Only a
budget in seconds makes it depend on the machine.
"""

from __future__ import annotations

import os
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager

from fabfold.errors import NoTreeError, RecipeError, WorkerError
from fabfold.progress import Progress, SilentProgress
from fabfold.search.seeds import Better, Done, Event, Executor, Job, SeedResult
from fabfold.search.warmup import warm_up_job
from fabfold.tree.candidate import Candidate
from fabfold.tree.catalogue import JointSet
from fabfold.tree.effort import Effort
from fabfold.tree.foldability import Foldability
from fabfold.tree.problem import TreeProblem

__all__ = [
    "Budget",
    "SeedResult",
    "Tally",
    "executor",
    "require_fit",
    "run_seeds",
    "search",
    "search_tasks",
    "warm_up",
]

#: Workers that a seed may take down before it is left out.
TRIES = 3
#: Seconds between looks at the budget.
TICK = 0.5
#: Seconds that seeds have to end after the budget is over.
GRACE = 20.0


class Budget:
    """Seconds that a search may take, counted from the start of this object.

    Parameters
    ----------
    seconds : float or None
        None is without end.
    """

    def __init__(self, seconds: float | None = None) -> None:
        self.seconds = seconds
        self._start = time.monotonic()

    @property
    def share(self) -> float:
        """How much of it is used, from 0 to 1."""
        if self.seconds is None:
            return 0.0
        if self.seconds <= 0:
            return 1.0
        return min(1.0, (time.monotonic() - self._start) / self.seconds)

    def over(self) -> bool:
        """Whether it is used up."""
        return self.share >= 1.0

    def restart(self) -> None:
        """Count from now on."""
        self._start = time.monotonic()


@contextmanager
def executor(
    workers: int | None, scheduler: str | None, seeds: int, over: Callable[[], bool]
) -> Iterator[Executor]:
    """Open what runs the seeds; nothing runs any more when the context closes.

    Parameters
    ----------
    workers : int or None
        Processes on this machine; None is one a core. With one, seeds run in this process, where
        nothing guards it against a seed that crashes.
    scheduler : str or None
        Address of a Dask scheduler; its workers run the seeds then.
    seeds : int
        Seeds that there may be to run.
    over : callable
        Whether the seeds that run shall end.

    Raises
    ------
    RecipeError
        If the number of workers or the address is wrong, or the cluster cannot be used.
    """
    opened: Executor
    if workers is not None and workers < 1:
        raise RecipeError(f"--workers {workers}: there must be at least one")
    if scheduler is not None:
        from fabfold.search.dask import DaskExecutor

        opened = DaskExecutor(scheduler)
    elif workers == 1:
        from fabfold.search.processes import InProcessExecutor

        opened = InProcessExecutor(over)
    else:
        from fabfold.search.processes import ProcessExecutor

        opened = ProcessExecutor(min(workers or os.cpu_count() or 1, max(1, seeds)))
    try:
        yield opened
    finally:
        opened.close()


def run_seeds(
    pool: Executor,
    tasks: Iterable[tuple[int, Job | SeedResult]],
    on_event: Callable[[Event], None],
    over: Callable[[], bool],
) -> None:
    """Run seeds until all have ended, or `over` says so.

    A seed whose worker dies is tried again, and left out after `TRIES` workers; the others do not
    notice. Seeds that run when it is over end early; those that do not end in time are given up,
    and the better trees that they had reported count.

    Parameters
    ----------
    pool : Executor
        What runs the seeds.
    tasks : iterable of (int, Job or SeedResult)
        Taken as workers become free; may be endless. Where there is nothing to search, the result.
    on_event : callable
        Told of each :class:`Better` and each :class:`Done`.
    over : callable
        Polled often.
    """
    waiting = iter(tasks)
    again: list[tuple[int, Job]] = []
    running: dict[int, Job] = {}
    best: dict[int, Candidate] = {}
    losses: Counter[int] = Counter()

    def take(event: Event) -> None:
        if event.seed not in running:
            return
        if isinstance(event, Better):
            best[event.seed] = event.candidate
            on_event(event)
        elif isinstance(event, Done):
            del running[event.seed]
            on_event(event)
        else:
            job = running.pop(event.seed)
            losses[event.seed] += 1
            if losses[event.seed] < TRIES:
                again.append((event.seed, job))
            else:
                why = f"seed {event.seed} took its worker down {TRIES} times"
                on_event(Done(event.seed, SeedResult((), why=why, failed=True)))

    grace: Budget | None = None
    while True:
        if grace is None and over():
            pool.stop()
            grace = Budget(GRACE)
        while grace is None and pool.free() > 0:
            task = again.pop(0) if again else next(waiting, None)
            if task is None:
                break
            seed, job = task
            if isinstance(job, SeedResult):
                on_event(Done(seed, job))
                continue
            running[seed] = job
            pool.submit(job, seed)
        if not running and (grace is not None or not again):
            break
        if grace is not None and grace.over():
            break
        pool.wait(take, TICK)
    for seed in [*running, *(seed for seed, _ in again)]:
        found = (best[seed],) if seed in best else ()
        on_event(Done(seed, SeedResult(found, why="no time left", cut=0.0)))


def warm_up(pool: Executor, joints: JointSet = "S") -> None:
    """Have each worker load the compiled kernels, so that a budget is spent on the search.

    After an installation that takes a minute, for they are compiled first; later a second.
    """
    job = warm_up_job(joints)
    forever = Budget()
    run_seeds(pool, [(seed, job) for seed in range(pool.free())], lambda _event: None, forever.over)


class Tally:
    """Results so far, and the line of progress that shows them.

    Parameters
    ----------
    progress : Progress
        Shows the line.
    known : mapping of int to SeedResult
        Seeds that are done already.
    share : callable
        How far the search is, from 0 to 1, of the number of seeds that are done.
    total : int or None
        Seeds in all, where that is known.
    describe : callable, optional
        Tells a tree in a few words.
    """

    def __init__(
        self,
        progress: Progress,
        known: Mapping[int, SeedResult],
        share: Callable[[int], float],
        total: int | None = None,
        describe: Callable[[Candidate], str] | None = None,
    ) -> None:
        self._describe = describe or _in_words
        self.results = dict(known)
        self.best = min(
            (c for result in known.values() for c in result.candidates),
            key=lambda c: c.energy["total"],
            default=None,
        )
        self._progress, self._share, self._total = progress, share, total
        self.show()

    def on_event(self, event: Event) -> None:
        """Count an event in."""
        found: Sequence[Candidate] = ()
        if isinstance(event, Better):
            found = [event.candidate]
        elif isinstance(event, Done):
            self.results[event.seed] = event.result
            found = event.result.candidates
        for candidate in found:
            if self.best is None or candidate.energy["total"] < self.best.energy["total"]:
                self.best = candidate
        self.show()

    def include(self, known: Mapping[int, SeedResult]) -> None:
        """Count in seeds that are done already."""
        for seed, result in known.items():
            self.on_event(Done(seed, result))

    def show(self) -> None:
        """Show how far the search is, and its best tree."""
        done = len(self.results)
        text = f"{done} seeds" if self._total is None else f"{done} of {self._total} seeds"
        if self.best is not None:
            text += f", best folding tree {self._describe(self.best)}"
        self._progress.update(self._share(done), text)

    def check_failures(self) -> None:
        """Raise where no seed did its work.

        Raises
        ------
        WorkerError
            If every seed failed: the first one's reason.
        """
        failed = [seed for seed, result in self.results.items() if result.failed]
        if failed and len(failed) == len(self.results):
            raise WorkerError(
                f"every seed failed, {len(failed)} in all; the first: "
                f"{self.results[min(failed)].why}. If memory is short, fewer --workers may do"
            )


def _in_words(candidate: Candidate) -> str:
    return f"{len(candidate.tree.hinges)} hinges, energy {candidate.energy['total']:.2f}"


def search_tasks(
    tasks: Mapping[int, Job | SeedResult],
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Progress | None = None,
    known: Mapping[int, SeedResult] | None = None,
    on_event: Callable[[Event], None] | None = None,
) -> dict[int, SeedResult]:
    """Results of all seeds.

    Parameters
    ----------
    tasks : mapping of int to Job or SeedResult
        What each seed searches, or its result where there is nothing to search. Jobs must pickle
        where there is more than one worker.
    workers : int, optional
        Processes; default one a core. One works in this process. Changes no result.
    scheduler : str, optional
        Address of a Dask scheduler whose workers run the seeds instead. Changes no result.
    progress : Progress, optional
        Hears of each finished seed and the best so far.
    known : mapping of int to SeedResult, optional
        Seeds that are done already.
    on_event : callable, optional
        Told of each better tree, and of each seed that ends, so that they can be kept.

    Raises
    ------
    WorkerError
        If every seed failed, or the cluster is gone.
    """
    known = {seed: result for seed, result in (known or {}).items() if seed in tasks}
    tally = Tally(
        progress or SilentProgress(), known, lambda done: done / max(1, len(tasks)), len(tasks)
    )
    todo = [(seed, task) for seed, task in tasks.items() if seed not in known]
    if todo:

        def each(event: Event) -> None:
            if on_event is not None:
                on_event(event)
            tally.on_event(event)

        forever = Budget()
        with executor(workers, scheduler, len(todo), forever.over) as pool:
            run_seeds(pool, todo, each, forever.over)
    tally.check_failures()
    return tally.results


def search(
    problem: TreeProblem,
    seeds: Sequence[int],
    foldability: Foldability,
    effort: Effort,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Progress | None = None,
    known: Mapping[int, SeedResult] | None = None,
    on_event: Callable[[Event], None] | None = None,
) -> list[Candidate]:
    """Trees that fold from all seeds of one problem, best first.

    Parameters
    ----------
    problem : TreeProblem
        Voxels, template and joints as arrays.
    seeds : sequence of int
        Each is a search of its own.
    foldability : Foldability
        Tells which trees fold, and how.
    effort : Effort
        How long each seed may try, in counts.
    workers, scheduler, progress, known, on_event
        See :func:`search_tasks`.

    Returns
    -------
    list of Candidate
        By ascending energy, then seed; empty where trees fit but none folds.

    Raises
    ------
    NoTreeError
        If no seed found any tree that fits the template.
    WorkerError
        If every seed failed, or the cluster is gone.
    """
    job = Job(problem, foldability, effort)
    results = search_tasks(
        dict.fromkeys(seeds, job),
        workers=workers,
        scheduler=scheduler,
        progress=progress,
        known=known,
        on_event=on_event,
    )
    ordered = [results[seed] for seed in seeds]
    require_fit(ordered)
    merged = [candidate for result in ordered for candidate in result.candidates]
    return sorted(merged, key=lambda candidate: candidate.energy["total"])


def require_fit(results: Sequence[SeedResult]) -> None:
    """Raise where no seed found any tree that fits the template.

    Raises
    ------
    NoTreeError
        With the first seed's reason.
    """
    if results and not any(result.fits for result in results):
        raise NoTreeError(results[0].why)
