"""What a step is called, in words."""

from __future__ import annotations

from collections.abc import Sequence

from fabfold.guide.fold_steps import FoldStep

__all__ = ["listed", "part_number", "step_text"]

_TURNS = {90: "Quarter turn", 180: "Half turn", 270: "Three quarters of a turn"}


def listed(words: Sequence[str]) -> str:
    """Words with commas, and "and" before the last."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def part_number(body: int) -> str:
    """What a manual calls a body: they are counted from 1 there, and from 0 everywhere else."""
    return str(body + 1)


def step_text(step: FoldStep, *, brief: bool = False) -> str:
    """One line about a step: how far, and which parts.

    Parameters
    ----------
    step : FoldStep
        The step.
    brief : bool
        Whether to say how many parts turn together, in place of their numbers.
    """
    if step.then:
        told = [_turn_text(phase, brief).lower() for phase in step.phases]
        letters = [f"{letter}) {text}" for letter, text in zip("abcd", told, strict=False)]
        return f"One after the other: {'; '.join(letters)}"
    if step.also:
        told = [_turn_text(turn, brief).lower() for turn in step.turns]
        return f"In any order: {'; '.join(told)}"
    return _turn_text(step, brief)


def _turn_text(turn: FoldStep, brief: bool) -> str:
    parts = [part_number(body) for body in turn.moving]
    which = f"parts {listed(parts)} together"
    if len(parts) == 1:
        which = f"part {parts[0]}"
    elif brief:
        which = f"{len(parts)} parts together"
    return f"{_TURNS.get(round(turn.degrees), 'Turn')} ({turn.degrees:g}°): {which}"
