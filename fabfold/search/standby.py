"""What a search needs, made ready while the model is read and cut."""

from __future__ import annotations

import os
from types import TracebackType
from typing import Self

from fabfold.progress import Progress
from fabfold.search.kernels import KernelCompiler
from fabfold.search.processes import ProcessExecutor
from fabfold.search.seeds import Executor
from fabfold.tree.catalogue import JointSet

__all__ = ["SearchStandby"]


class SearchStandby:
    """Kernels and worker processes of a search that is to come.

    Reading and cutting a model keep one core busy. Meanwhile others compile the kernels where they
    are not there yet; where they are, the workers start and load them.

    Parameters
    ----------
    workers : int or None
        Processes of the search; None is one a core.
    joints : str
        Joint types of the search.
    """

    def __init__(self, workers: int | None, joints: JointSet) -> None:
        self._count = (os.cpu_count() or 1) if workers is None else workers
        self._joints: JointSet = joints
        self._compiler = KernelCompiler()
        self._pool: ProcessExecutor | None = None

    @property
    def kernel_seconds(self) -> float:
        """Processor seconds that compiling the kernels took."""
        return self._compiler.processor_seconds

    def start(self, *, workers: bool = True) -> None:
        """Begin, beside what follows.

        Parameters
        ----------
        workers : bool
            Whether there is enough to do before the search for workers to start now.
        """
        if not self._compiler.start() and workers and self._count > 1:
            self._pool = ProcessExecutor(self._count)
            self._pool.stand_by(self._joints)

    def __enter__(self) -> Self:
        """What is done in here comes before the search: if it fails, the workers end."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        at: TracebackType | None,
    ) -> None:
        if kind is not None and (pool := self.take()) is not None:
            pool.close()

    def wait(self, progress: Progress) -> None:
        """Wait until the kernels are compiled, which `progress` is told."""
        self._compiler.wait(progress)

    def take(self) -> Executor | None:
        """Hand over the workers, once; None where none were started."""
        pool, self._pool = self._pool, None
        return pool
