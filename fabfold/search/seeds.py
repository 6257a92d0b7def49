"""One seed of the tree search as a task: what it is given, what it reports, and who may run it."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from fabfold.errors import NoFoldError, NoTreeError
from fabfold.tree.candidate import Candidate
from fabfold.tree.effort import Effort
from fabfold.tree.foldability import Foldability
from fabfold.tree.problem import TreeProblem
from fabfold.tree.solve import solve

__all__ = ["Batch", "Better", "Done", "Event", "Executor", "Job", "Lost", "SeedResult", "run_seed"]


@dataclass(frozen=True)
class Job:
    """What a seed searches; pickles.

    Attributes
    ----------
    problem : TreeProblem
        Voxels, joints and template as arrays.
    foldability : Foldability
        Tells which trees fold.
    effort : Effort
        How long it may try, in counts.
    start : Candidate, optional
        A tree of the problem that folds and is to be made better, instead of a new one.
    """

    problem: TreeProblem
    foldability: Foldability
    effort: Effort
    start: Candidate | None = None


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
    cut : float or None
        None where the seed ran to its end. Else the seconds of the budget that ended it early,
        0 where it was interrupted.
    failed : bool
        Whether it raised an error or took its workers down; then `why` tells.
    """

    candidates: tuple[Candidate, ...]
    fits: bool = True
    why: str = ""
    cut: float | None = None
    failed: bool = False

    @property
    def best(self) -> float:
        """Energy of the best tree; infinite where there is none."""
        return min((c.energy["total"] for c in self.candidates), default=float("inf"))


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


@dataclass(frozen=True)
class Better:
    """A seed that runs found a better tree that folds."""

    seed: int
    candidate: Candidate


@dataclass(frozen=True)
class Done:
    """A seed ended."""

    seed: int
    result: SeedResult


@dataclass(frozen=True)
class Lost:
    """The worker that ran a seed is gone."""

    seed: int


Event = Better | Done | Lost


class Executor(Protocol):
    """Runs seeds somewhere, one in a worker at a time, so that a dead worker tells which it was.

    Whoever runs the search decides what is tried again; an executor only tells of the loss.
    """

    def free(self) -> int:
        """Seeds that can be taken now."""

    def submit(self, job: Job, seed: int) -> None:
        """Start a seed; only where one is free."""

    def wait(self, on_event: Callable[[Event], None], seconds: float) -> None:
        """Tell `on_event` what happened, after waiting for it `seconds` at most.

        Raises
        ------
        WorkerError
            If no worker is left, and none comes.
        """

    def stop(self) -> None:
        """Ask the seeds that run to end early with what they have."""

    def close(self) -> None:
        """Leave nothing running."""


def run_seed(
    job: Job, seed: int, report: Callable[[Candidate], None], stop: Callable[[], bool]
) -> SeedResult:
    """Search one seed, here and now.

    Parameters
    ----------
    job : Job
        What is searched, by which judge, for how long.
    seed : int
        Seed of every random choice.
    report : callable
        Called with each better tree as it is found.
    stop : callable
        Polled; once it returns True the seed ends with what it has.
    """
    stopping = False

    def stopped() -> bool:
        nonlocal stopping
        stopping = stopping or stop()
        return stopping

    candidates: tuple[Candidate, ...] = ()
    fits, why, failed = True, "", False
    try:
        candidates = tuple(
            solve(
                job.problem,
                seed,
                job.foldability,
                job.effort,
                start=job.start,
                report=report,
                stop=stopped,
            )
        )
    except NoFoldError as error:
        why = str(error)
    except NoTreeError as error:
        fits, why = stopping, str(error)  # With more time one might have fitted.
    except Exception:
        # One seed that trips over a mistake must not take the others' results with it.
        why, failed = f"seed {seed} failed:\n{traceback.format_exc()}", True
    return SeedResult(candidates, fits, why, cut=0.0 if stopping else None, failed=failed)
