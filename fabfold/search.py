"""Run the tree search for many seeds, in this process or over worker processes.

The answer depends on the problem, the seeds and the effort alone: every seed is a task of its own,
and the results are merged in the order of the seeds, whichever worker finished first.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass

from fabfold.errors import NoFoldError, NoTreeError
from fabfold.progress import Progress, SilentProgress
from fabfold.tree.effort import Effort
from fabfold.tree.foldability import Foldability
from fabfold.tree.problem import TreeProblem
from fabfold.tree.solve import Candidate, solve

__all__ = ["SeedResult", "search"]

#: Times that a seed may take its worker down before it is left out.
TRIES = 2


@dataclass(frozen=True)
class SeedResult:
    """What one seed found.

    Attributes
    ----------
    candidates : tuple of Candidate
        Trees that fold, best first; empty where none was found.
    fits : bool
        Whether any tree fitted the template, folding or not.
    why : str
        What the search said where it found nothing.
    """

    candidates: tuple[Candidate, ...]
    fits: bool = True
    why: str = ""


def _task(problem: TreeProblem, seed: int, foldability: Foldability, effort: Effort) -> SeedResult:
    try:
        return SeedResult(tuple(solve(problem, seed, foldability, effort)))
    except NoFoldError as error:
        return SeedResult((), why=str(error))
    except NoTreeError as error:
        return SeedResult((), fits=False, why=str(error))


def _leave_signals_to_parent() -> None:
    # Ctrl-C reaches the whole process group; the parent decides what is kept and ends the workers.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)


def search(
    problem: TreeProblem,
    seeds: Sequence[int],
    foldability: Foldability,
    effort: Effort,
    *,
    workers: int | None = None,
    progress: Progress | None = None,
    known: Mapping[int, SeedResult] | None = None,
    on_result: Callable[[int, SeedResult], None] | None = None,
) -> list[Candidate]:
    """Trees that fold from all seeds, best first.

    Parameters
    ----------
    problem : TreeProblem
    seeds : sequence of int
    foldability : Foldability
        Must pickle where there is more than one worker.
    effort : Effort
    workers : int, optional
        Processes; default one a core. One works in this process. Changes no result.
    progress : Progress, optional
        Hears of each finished seed and the best so far.
    known : mapping of int to SeedResult, optional
        Seeds that are done already.
    on_result : callable, optional
        Called with each seed and its result as it finishes, so that it can be kept.

    Returns
    -------
    list of Candidate
        By ascending energy, then seed; empty where trees fit but none folds.

    Raises
    ------
    NoTreeError
        If no seed found any tree that fits the template.
    """
    progress = progress or SilentProgress()
    results: dict[int, SeedResult] = dict(known or {})
    todo = [seed for seed in seeds if seed not in results]
    count = min(workers or os.cpu_count() or 1, max(1, len(todo)))

    def tell() -> None:
        found = [c for result in results.values() for c in result.candidates]
        best = min(found, key=lambda c: c.energy["total"], default=None)
        text = f"{sum(s in results for s in seeds)} of {len(seeds)} seeds"
        if best is not None:
            text += f", best folding tree {len(best.tree.hinges)} hinges, "
            text += f"energy {best.energy['total']:.2f}"
        progress.update(sum(s in results for s in seeds) / max(1, len(seeds)), text)

    tell()
    run = _here if count == 1 else _in_processes
    for seed, result in run(problem, todo, foldability, effort, count):
        results[seed] = result
        if on_result is not None:
            on_result(seed, result)
        tell()
    ordered = [results[seed] for seed in seeds]
    if ordered and not any(result.fits for result in ordered):
        raise NoTreeError(ordered[0].why)
    merged = [candidate for result in ordered for candidate in result.candidates]
    return sorted(merged, key=lambda candidate: candidate.energy["total"])


def _here(
    problem: TreeProblem,
    seeds: Sequence[int],
    foldability: Foldability,
    effort: Effort,
    _workers: int,
) -> Iterator[tuple[int, SeedResult]]:
    for seed in seeds:
        yield seed, _task(problem, seed, foldability, effort)


def _in_processes(
    problem: TreeProblem,
    seeds: Sequence[int],
    foldability: Foldability,
    effort: Effort,
    workers: int,
) -> Iterator[tuple[int, SeedResult]]:
    """Results as they come; a seed whose worker dies is tried again, alone, then left out."""
    losses: dict[int, int] = {}
    todo = list(seeds)
    while todo:
        # After a loss nobody knows which seed did it: one at a time finds out.
        alone = [seed for seed in todo if losses.get(seed)]
        batch = alone[:1] or todo
        others = set(multiprocessing.active_children())
        pool = ProcessPoolExecutor(
            max_workers=1 if alone else workers,
            mp_context=multiprocessing.get_context("spawn"),
            initializer=_leave_signals_to_parent,
        )
        finished = False
        try:
            running: dict[Future[SeedResult], int] = {
                pool.submit(_task, problem, seed, foldability, effort): seed for seed in batch
            }
            while running:
                done, _ = wait(running, return_when=FIRST_COMPLETED)
                for future in sorted(done, key=running.__getitem__):
                    seed = running.pop(future)
                    try:
                        result = future.result()
                    except BrokenProcessPool:
                        losses[seed] = losses.get(seed, 0) + 1
                        if losses[seed] < TRIES + 1:
                            continue
                        result = SeedResult(
                            (), why=f"seed {seed} took its process down {TRIES} times"
                        )
                    todo.remove(seed)
                    yield seed, result
            finished = True
        finally:
            if not finished:
                # Stopped half-way: the workers must not go on behind our back.
                for process in set(multiprocessing.active_children()) - others:
                    process.terminate()
            pool.shutdown(wait=finished, cancel_futures=True)
