"""What a hinge may be asked for: the keywords of hinges, their types and their defaults.

Each kind of hinge has a frozen dataclass that holds the defaults and refuses unknown keywords, and
a ``TypedDict`` of the same names and types for functions that pass keywords on. What each keyword
means is told in :class:`hinges.SingleHinge` and :class:`hinges.DoubleHinge`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypedDict

from .clearance import Clearance
from .hardware import LoosePin
from .leaf import Bracket, Leaf
from .pins import Pin
from .stops import Detents, Stops

__all__ = [
    "BarrelKeywords",
    "BarrelOptions",
    "BoreStyle",
    "DoubleHingeKeywords",
    "DoubleHingeOptions",
    "MeshKeywords",
    "MeshOptions",
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


class MeshKeywords(TypedDict, total=False):
    """Keywords of hinges that are built as meshes, as of :mod:`hinges.mesh`."""

    barrel_radius_mm: float | None
    pin_radius_mm: float | None
    gap_mm: float | None
    bracket_mm: float | None
    margin_mm: float | None
    wall_mm: float
    segments: int
    pin: LoosePin | None


@dataclass(frozen=True, kw_only=True)
class MeshOptions:
    """Sizes of a hinge's meshes; None stands for one that follows from the others.

    Attributes
    ----------
    barrel_radius_mm : float, optional
        Radius of the barrels in mm; :func:`hinges.barrel.default_radii` chooses it when left out.
    pin_radius_mm : float, optional
        Radius at the foot of the cone pins in mm; 60 % of the barrel, or as much as the wall
        leaves, when left out.
    gap_mm : float, optional
        Distance between the two bodies in mm; each is inset by half of it. The clearance when left
        out.
    bracket_mm : float, optional
        Width and depth in mm of the square web that joins the knuckles of a half, measured from the
        axis. When left out the groove and 1.2 mm of material behind it, or 0.15 of the voxel when
        that is more.
    margin_mm : float, optional
        Length in mm left free at each end of the edge; barrel radius plus clearance when left out.
    wall_mm : float
        Thinnest wall in mm.
    segments : int
        Number of corners of a full circle.
    pin : LoosePin, optional
        A pin that is put in after printing, in place of printed cones; `pin_radius_mm` is then its
        own.
    """

    barrel_radius_mm: float | None = None
    pin_radius_mm: float | None = None
    gap_mm: float | None = None
    bracket_mm: float | None = None
    margin_mm: float | None = None
    wall_mm: float = 0.8
    segments: int = 64
    pin: LoosePin | None = None
