"""What a step is called, in words."""

from __future__ import annotations

from collections.abc import Sequence

from fabfold.guide.fold_steps import FoldStep

__all__ = ["listed", "step_text"]

_TURNS = {90: "Quarter turn", 180: "Half turn", 270: "Three quarters of a turn"}


def listed(words: Sequence[str]) -> str:
    """Words with commas, and "and" before the last."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def step_text(step: FoldStep) -> str:
    """One line about a step: how far, and which parts.

    Parameters
    ----------
    step : FoldStep
        The step.

    Returns
    -------
    str
        Parts are counted from 1, as the bodies are from 0.
    """
    parts = [str(body + 1) for body in step.moving]
    turn = _TURNS.get(round(step.degrees), "Turn")
    which = f"part {parts[0]}" if len(parts) == 1 else f"parts {listed(parts)} together"
    return f"{turn} ({step.degrees:g}°): {which}"
