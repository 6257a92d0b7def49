"""The result of one check of a kit."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Check"]


@dataclass(frozen=True)
class Check:
    """One check with what it found.

    Attributes
    ----------
    name : str
        What was looked at.
    figure : float
        What was found, in `unit`.
    limit : float or None
        What the figure is held against, in `unit`; None for information only.
    unit : str
        Unit of figure and limit.
    ok : bool
        Whether the check passed.
    note : str
        What it means, in a maker's words, and which body it is about.
    """

    name: str
    figure: float
    limit: float | None
    unit: str
    ok: bool
    note: str
