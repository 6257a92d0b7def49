"""How a long stage tells what it is doing, without knowing who listens."""

from __future__ import annotations

from typing import Protocol

__all__ = ["Progress", "SilentProgress"]


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
