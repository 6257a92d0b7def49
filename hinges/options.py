"""What a hinge may be asked for: the keywords of hinges, their types and their defaults.

Each kind of hinge has a frozen dataclass that holds the defaults and refuses unknown keywords, and
a ``TypedDict`` of the same names and types for functions that pass keywords on. What each keyword
means is told in :class:`hinges.SingleHinge` and :class:`hinges.DoubleHinge`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypedDict

from .clearance import Clearance
from .leaf import Bracket, Leaf
from .pins import Pin
from .stops import Detents, Stops

__all__ = [
    "BarrelKeywords",
    "BarrelOptions",
    "BoreStyle",
    "DoubleHingeKeywords",
    "DoubleHingeOptions",
    "SingleHingeKeywords",
    "SingleHingeOptions",
]

BoreStyle = Literal["round", "teardrop", "octagon"]


class BarrelKeywords(TypedDict, total=False):
    """Keywords that single and double hinges share."""

    radius: float | None
    pin: Pin | None
    clearance: Clearance | float | str
    gap: float | None
    chamfer: float
    margin: float | None
    wall: float | None
    bore: BoreStyle
    up: float


@dataclass(frozen=True, kw_only=True)
class BarrelOptions:
    """Values of :class:`BarrelKeywords`; None stands for a size that follows from the others."""

    radius: float | None = None
    pin: Pin | None = None
    clearance: Clearance | float | str = "fdm"
    gap: float | None = None
    chamfer: float = 0.0
    margin: float | None = None
    wall: float | None = None
    bore: BoreStyle = "round"
    up: float = 90.0


class SingleHingeKeywords(BarrelKeywords, total=False):
    """Keywords of a single hinge."""

    knuckles: int
    leaf: Bracket | Leaf | None
    angle: float
    angular_range: tuple[float, float]
    stops: Stops | bool | None
    detents: Detents | None


@dataclass(frozen=True, kw_only=True)
class SingleHingeOptions(BarrelOptions):
    """Values of :class:`SingleHingeKeywords`."""

    knuckles: int = 3
    leaf: Bracket | Leaf | None = None
    angle: float = 0.0
    angular_range: tuple[float, float] = (0.0, 180.0)
    stops: Stops | bool | None = None
    detents: Detents | None = None


class DoubleHingeKeywords(BarrelKeywords, total=False):
    """Keywords of a double hinge."""

    first: str
    second: str
    turns: tuple[float, float]
    angles: tuple[float, float]
    knuckles: int | None
    plate: float | None
    bracket: Bracket | None


@dataclass(frozen=True, kw_only=True)
class DoubleHingeOptions(BarrelOptions):
    """Values of :class:`DoubleHingeKeywords`."""

    first: str = "+y"
    second: str = "-y"
    turns: tuple[float, float] = (180.0, 180.0)
    angles: tuple[float, float] = (0.0, 0.0)
    knuckles: int | None = None
    plate: float | None = None
    bracket: Bracket | None = None
