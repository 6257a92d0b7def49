"""What a hinge may be asked for: the keywords of hinges, their types and their defaults.

Each kind of hinge has a frozen dataclass that holds the defaults and refuses unknown keywords, and
a ``TypedDict`` of the same names and types for functions that pass keywords on. What each keyword
means is told in :class:`hinges.SingleHinge` and :class:`hinges.DoubleHinge`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, TypedDict

from .arm import Arm, Mount
from .clearance import Clearance, number
from .exceptions import HingeError
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
    "call_of",
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

    def __post_init__(self) -> None:
        """Refuse what is no pin, no number or no size."""
        if isinstance(self.pin, type):
            name = self.pin.__name__
            raise HingeError(f"pin is the class {name}: make one of it, such as pin={name}(...)")
        if self.pin is not None and not isinstance(self.pin, Pin):
            raise HingeError(
                f"pin is {self.pin!r}: give a pin, such as ConePin(1.2), FilamentPin(), RodPin(2) "
                'or ScrewPin("M3")'
            )
        above = {"radius": self.radius, "gap": self.gap, "wall": self.wall}
        for name, value in {**above, "chamfer": self.chamfer, "margin": self.margin}.items():
            if value is None:
                continue
            if number(value, name) < 0.0 or (name in above and value == 0.0):
                least = "above 0" if name in above else "of 0 or more"
                raise HingeError(f"{name} is {value:g} mm: give a length {least}")
        number(self.up, "up")


def _require_pair(value: object, name: str, words: str) -> None:
    """Refuse what are not two numbers."""
    if not isinstance(value, (tuple, list)) or len(value) != 2:
        raise HingeError(f"{name} is {value!r}: give {words}")
    for each in value:
        number(each, name)


class SingleHingeKeywords(BarrelKeywords, total=False):
    """Keywords of a single hinge."""

    knuckles: int
    ratio: float
    leaf: Mount | tuple[Mount, Mount] | None
    angle: float
    angular_range: tuple[float, float]
    opens: float | None
    closed: float
    stops: Stops | bool | None
    detents: Detents | None
    friction: float | None


@dataclass(frozen=True, kw_only=True)
class SingleHingeOptions(BarrelOptions):
    """Values of :class:`SingleHingeKeywords`."""

    knuckles: int = 3
    ratio: float = 1.0
    leaf: Mount | tuple[Mount, Mount] | None = None
    angle: float = 0.0
    angular_range: tuple[float, float] = (0.0, 180.0)
    opens: float | None = None
    closed: float = 0.0
    stops: Stops | bool | None = None
    detents: Detents | None = None
    friction: float | None = None

    def __post_init__(self) -> None:
        """Refuse what is no angle, no range, no leaf, no stops and no detents."""
        super().__post_init__()
        number(self.angle, "angle")
        if not 0.1 <= number(self.ratio, "ratio") <= 10.0:
            raise HingeError(
                f"ratio is {self.ratio:g}: give the length of a knuckle of the child against one "
                "of the parent, 0.1 to 10"
            )
        words = "the lowest and the highest angle in degrees, such as (0, 110)"
        _require_pair(self.angular_range, "angular_range", words)
        if number(self.closed, "closed") not in (0.0, 180.0):
            raise HingeError(f"closed is {self.closed:g}: give 0 or 180")
        if self.opens is not None:
            if not 0.0 < number(self.opens, "opens") <= 270.0:
                raise HingeError(f"opens is {self.opens:g}: give an angle above 0 and up to 270")
            if self.stops is not None or tuple(self.angular_range) != (0.0, 180.0):
                raise HingeError("opens stands for angular_range and stops: leave those out")
        if self.stops is not None and not isinstance(self.stops, (Stops, bool)):
            raise HingeError(
                f"stops is {self.stops!r}: give True or Stops(...); the angle at which a stop "
                "stands is an end of angular_range, such as angular_range=(0, 110)"
            )
        if self.detents is not None and not isinstance(self.detents, Detents):
            raise HingeError(f"detents is {self.detents!r}: give Detents((0, 90)) or the like")
        if self.friction is not None and number(self.friction, "friction") <= 0.0:
            raise HingeError(f"friction is {self.friction:g} mm: give an interference above 0")
        if self.friction is not None and self.detents is not None:
            raise HingeError("friction and detents share their bumps: give one of them")
        for mount in self.mounts:
            if not isinstance(mount, (Bracket, Leaf, Arm)):
                raise HingeError(
                    f"leaf is {self.leaf!r}: give Bracket(...), Leaf(...) or Arm(...), or a pair "
                    "of them for parent and child"
                )
        if (self.opens or 0.0) > 180.0 and self.closed != 180.0:
            raise HingeError(
                f"opens is {self.opens:g}: beyond 180° the child turns below 0°, down along the "
                "wall of its parent; draw it so and give closed=180"
            )

    @property
    def mounts(self) -> tuple[Mount, Mount]:
        """What joins the knuckles of parent and child to their bodies."""
        if isinstance(self.leaf, (tuple, list)) and len(self.leaf) == 2:
            return self.leaf[0], self.leaf[1]
        mount = Bracket() if self.leaf is None else self.leaf
        return mount, mount  # type: ignore[return-value]


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

    def __post_init__(self) -> None:
        """Refuse what is no angle and no bracket."""
        super().__post_init__()
        _require_pair(self.turns, "turns", "how far each axis turns in degrees, such as (180, 90)")
        _require_pair(self.angles, "angles", "the angles of both axes in degrees, such as (0, 0)")
        if self.plate is not None and number(self.plate, "plate") <= 0.0:
            raise HingeError(f"plate is {self.plate:g} mm: give a length above 0")
        if self.bracket is not None and not isinstance(self.bracket, Bracket):
            raise HingeError(f"bracket is {self.bracket!r}: give Bracket(...)")
        if self.bracket is not None and self.bracket.flat:
            raise HingeError(
                "bracket is flat: the barrels of a double hinge stand on two sides and lie on none"
            )


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
    leaf: Mount | tuple[Mount, Mount] | None


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
    leaf : Bracket, Leaf or Arm, or a pair of them, optional
        What joins the knuckles of a single hinge to their bodies, in place of the bracket.
    """

    barrel_radius_mm: float | None = None
    pin_radius_mm: float | None = None
    gap_mm: float | None = None
    bracket_mm: float | None = None
    margin_mm: float | None = None
    wall_mm: float = 0.8
    segments: int = 64
    pin: LoosePin | None = None
    leaf: Mount | tuple[Mount, Mount] | None = None


def call_of(name: str, size: object, asked: Mapping[str, object], options: BarrelOptions) -> str:
    """Write the call that makes a hinge.

    Parameters
    ----------
    name : str
        Name of the class.
    size : object
        Its first argument.
    asked : mapping
        Its keywords.
    options : BarrelOptions
        The defaults; a keyword at its default is left out.

    Returns
    -------
    str
        Python source, as long as the values' own are.
    """
    defaults = vars(options)
    more = [f"{key}={value!r}" for key, value in asked.items() if value != defaults[key]]
    return f"{name}({', '.join([repr(size), *more])})"
