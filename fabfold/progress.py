"""How a long stage tells what it is doing, without knowing who listens."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Protocol

__all__ = [
    "LastMessage",
    "Listener",
    "Progress",
    "SilentListener",
    "SilentProgress",
    "children_seconds",
    "processor_seconds",
]


def children_seconds() -> float:
    """Processor seconds of the processes that this one started and that have ended."""
    spent = os.times()
    return spent.children_user + spent.children_system


def processor_seconds() -> float:
    """Processor seconds of this process and of those of :func:`children_seconds`."""
    spent = os.times()
    return spent.user + spent.system + children_seconds()


class Progress(Protocol):
    """Receives news of one stage."""

    def update(self, share: float | None, message: str = "") -> None:
        """Tell how far the stage is.

        Parameters
        ----------
        share : float or None
            From 0 to 1, or None where the end is not known.
        message : str
            What is being done and the best so far, in a maker's words.
        """


class SilentProgress:
    """Listens to nothing."""

    def update(self, share: float | None, message: str = "") -> None:
        """Do nothing."""


class LastMessage:
    """Keeps the last message of a stage.

    Attributes
    ----------
    message : str
        What was told last; empty before anything was.
    """

    message = ""

    def update(self, share: float | None, message: str = "") -> None:
        """Hear of it."""
        if message:
            self.message = message


class ProgressPart:
    """Progress of a part of something, told as a stretch of the whole.

    Parameters
    ----------
    whole : Progress
        Hears of it.
    start, end : float
        Where in the whole the part lies, 0 to 1.
    """

    def __init__(self, whole: Progress, start: float, end: float) -> None:
        self._whole = whole
        self._start, self._end = start, end

    def update(self, share: float | None, message: str = "") -> None:
        """Tell how much of the part is done; None where that is not known."""
        if share is not None:
            share = self._start + share * (self._end - self._start)
        self._whole.update(share, message)


class Listener(Protocol):
    """Hears of each stage as it runs."""

    def stage(self, name: str) -> AbstractContextManager[Progress]:
        """Open the progress of the stage `name`."""


class SilentListener:
    """Hears nothing."""

    @contextmanager
    def stage(self, name: str) -> Iterator[Progress]:
        """Listen to nothing."""
        yield SilentProgress()
