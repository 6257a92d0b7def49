"""Rules that refuse a hinge which cannot be printed or cannot turn.

==============  ================================================================================
rule            what it asks for
==============  ================================================================================
``wall``        material around the widest recess, bore or pocket of a barrel: the process's wall
``web``         the same between two recesses of one knuckle, or behind one
``knuckle``     knuckles at least two walls long
``pin``         a printed pin at least as thick as two walls
``cone``        a cone that stays in its recess by 0.2 mm after its axial play
``retention``   the child cannot leave along the axis
``bracket``     material of the bracket behind the groove of the other half's knuckles
``arm``         an arm that carries its knuckles, below the top of its body and clear of the other
``chamfer``     barrel ends that keep a flat after their chamfer
``range``       the turn stays between the two brackets
``pose``        the pose that is drawn keeps the clearance to the stops and sits at a detent
``stop``        a stop that has something to lean on
``detent``      a bump that fits the end face of a barrel
``gap``         bodies printed together no nearer than what moves in their hinge
``plate``       a link plate thick and wide enough to carry both rows of knuckles
``strain``      a spring stays below the strain that its material bears again and again
==============  ================================================================================
"""

from __future__ import annotations

from typing import Final

from .exceptions import FitError

__all__ = ["RULES", "at_least", "at_most"]

RULES: Final[tuple[str, ...]] = (
    "wall",
    "web",
    "knuckle",
    "pin",
    "cone",
    "retention",
    "bracket",
    "arm",
    "chamfer",
    "range",
    "pose",
    "stop",
    "detent",
    "gap",
    "plate",
    "strain",
)

_ROUNDING: Final = 1e-9


def at_least(
    rule: str, what: str, value: float, limit: float, advice: str, unit: str = "mm"
) -> None:
    """Raise unless `value` reaches `limit`.

    Parameters
    ----------
    rule : str
        One of ``RULES``.
    what : str
        What was measured, in words.
    value, limit : float
        What was measured and the least that the rule accepts, in `unit`.
    advice : str
        What to change.
    unit : str
        Unit of both: "mm", "°", "%" or "" for counts.

    Raises
    ------
    FitError
        If `value` is below `limit`.
    """
    if not value >= limit - _ROUNDING:
        raise FitError(rule, what, value, limit, advice, unit)


def at_most(
    rule: str, what: str, value: float, limit: float, advice: str, unit: str = "mm"
) -> None:
    """Raise if `value` is above `limit`.

    Parameters
    ----------
    rule : str
        One of ``RULES``.
    what : str
        What was measured, in words.
    value, limit : float
        What was measured and the most that the rule accepts, in `unit`.
    advice : str
        What to change.
    unit : str
        Unit of both: "mm", "°", "%" or "" for counts.

    Raises
    ------
    FitError
        If `value` is above `limit`.
    """
    if not value <= limit + _ROUNDING:
        raise FitError(rule, what, value, limit, advice, unit)
