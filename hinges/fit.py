"""Rules that refuse a hinge which cannot be printed or cannot turn.

==================  ============================================================================
rule                what it asks for
==================  ============================================================================
``wall``            material around the widest recess or bore: r − r_recess ≥ the process's wall
``web``             material between two recesses of one knuckle, or behind one
``knuckle``         a knuckle at least as long as the least length
``cone``            a cone pin that stays in its recess: engagement above the axial play
``retention``       the child cannot leave along the axis
``bracket``         the bracket reaches past the groove of the other body's knuckles
``range``           the turn ends before the two brackets meet
==================  ============================================================================
"""

from __future__ import annotations

from typing import Final

from .errors import FitError

__all__ = ["RULES", "at_least"]

RULES: Final[tuple[str, ...]] = (
    "wall",
    "web",
    "knuckle",
    "cone",
    "retention",
    "bracket",
    "range",
)

_ROUNDING: Final = 1e-9


def at_least(rule: str, what: str, value: float, limit: float, advice: str) -> None:
    """Raise unless `value` reaches `limit`.

    Parameters
    ----------
    rule : str
        One of ``RULES``.
    what : str
        What was measured, in words.
    value, limit : float
        In mm.
    advice : str
        What to change.

    Raises
    ------
    FitError
        If `value` is below `limit`.
    """
    if value < limit - _ROUNDING:
        raise FitError(rule, what, value, limit, advice)
