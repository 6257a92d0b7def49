"""Singular and plural in the notes for the maker."""

from __future__ import annotations

__all__ = ["were"]


def were(count: int, noun: str) -> str:
    """Begin a sentence about a number of things.

    Parameters
    ----------
    count : int
        How many there are.
    noun : str
        What they are, in the singular.

    Returns
    -------
    str
        ``were(1, "hole")`` is "1 hole was", ``were(3, "hole")`` is "3 holes were".
    """
    if count == 1:
        return f"1 {noun} was"
    plural = noun[:-1] + "ies" if noun.endswith("y") else noun + "s"
    return f"{count:,} {plural} were"
