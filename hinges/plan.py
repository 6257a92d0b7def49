"""The plan of a single hinge: every parameter checked, every shape as data.

Exact solids (:mod:`hinges.brep`) and meshes (:mod:`hinges.mesh`) are both made from the plan.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from math import floor
from typing import Any, Literal

from .clearance import PROCESSES, Clearance
from .errors import FitError, HingeError
from .fit import at_least, at_most
from .leaf import Bracket, Leaf
from .pins import ConePin, Pin, Roof
from .shapes import Shape
from .stops import Detents, Stops
from .train import Train, groove, lay_out

__all__ = [
    "BarrelOptions",
    "BarrelSpec",
    "HalfPlan",
    "SinglePlan",
    "SingleSpec",
    "default_pin_radius",
    "default_radii",
    "plan_single",
    "wall_of",
]

DEFAULT_WALL = 0.8


@dataclass(frozen=True)
class HalfPlan:
    """One half as data: ``half = (web - carve) + add - bore``.

    Attributes
    ----------
    carve : tuple of Shape
        To cut from the body first, and from the web.
    web : tuple of Shape
        What joins the knuckles.
    add : tuple of Shape
        Knuckles, with their round bores and recesses.
    bore : tuple of Shape
        Cut from the finished half: roofs of bores, pockets, dimples, screw holes.
    """

    carve: tuple[Shape, ...]
    web: tuple[Shape, ...]
    add: tuple[Shape, ...]
    bore: tuple[Shape, ...] = ()


@dataclass(frozen=True, kw_only=True)
class BarrelSpec:
    """Parameters that single and double hinges have alike, defaults filled in."""

    knuckles: int
    radius: float
    pin: Pin
    clearance: Clearance
    gap: float
    chamfer: float
    margin: float
    wall: float
    roof: Roof


@dataclass(frozen=True, kw_only=True)
class BarrelOptions:
    """What single and double hinges may be asked for alike; see :class:`hinges.SingleHinge`."""

    radius: float | None = None
    pin: Pin | None = None
    clearance: Clearance | float | str = "fdm"
    gap: float | None = None
    chamfer: float = 0.0
    margin: float | None = None
    wall: float | None = None
    bore: Literal["round", "teardrop", "octagon"] = "round"
    up: float = 90.0

    def filled(self, length: float, knuckles: int, drawn: tuple[float, ...]) -> BarrelSpec:
        """Fill in the defaults for an edge of `length` mm.

        `drawn` are the angles in degrees by which the owners of knuckles stand turned. The margin
        keeps hinges on two edges that meet at a corner clear of one another.
        """
        room = Clearance.read(self.clearance)
        wall = wall_of(self.clearance) if self.wall is None else self.wall
        radius, pin = self.radius, self.pin
        if radius is None:
            if pin is None:
                radius, _ = default_radii(length, room, wall, knuckles, self.margin)
            else:
                radius = max(2.0, 0.1 * -floor(-10.0 * pin.thinnest_barrel(room, wall, knuckles)))
        if pin is None:
            pin = ConePin(max(default_pin_radius(radius, room, wall), 0.3))
        return BarrelSpec(
            knuckles=knuckles,
            radius=float(radius),
            pin=pin,
            clearance=room,
            gap=room.radial if self.gap is None else float(self.gap),
            chamfer=float(self.chamfer),
            margin=radius + room.radial if self.margin is None else float(self.margin),
            wall=wall,
            roof=Roof(self.bore, tuple(self.up - angle for angle in drawn)),
        )


@dataclass(frozen=True, kw_only=True)
class SingleSpec(BarrelSpec):
    """All parameters of a single hinge, defaults filled in; see :class:`hinges.SingleHinge`."""

    length: float
    leaf: Bracket | Leaf
    angle: float
    angular_range: tuple[float, float]
    stops: Stops | None
    detents: Detents | None

    @classmethod
    def read(
        cls,
        length: float,
        *,
        knuckles: int = 3,
        leaf: Bracket | Leaf | None = None,
        angle: float = 0.0,
        angular_range: tuple[float, float] = (0.0, 180.0),
        stops: Stops | bool | None = None,
        detents: Detents | None = None,
        **barrel: Any,
    ) -> SingleSpec:
        """Fill in the defaults; parameters as for :class:`hinges.SingleHinge`.

        `barrel` are those of :class:`BarrelOptions`.
        """
        options = BarrelOptions(**barrel)
        shared = dict(vars(options.filled(length, knuckles, (0.0, angle))))
        if options.margin is None and isinstance(leaf, Leaf):
            shared["margin"] = 0.0
        return cls(
            length=float(length),
            leaf=Bracket() if leaf is None else leaf,
            angle=float(angle),
            angular_range=(float(angular_range[0]), float(angular_range[1])),
            stops=Stops() if stops is True else stops or None,
            detents=detents,
            **shared,
        )

    def with_(self, **changes: Any) -> SingleSpec:
        """Copy with some fields changed."""
        return replace(self, **changes)


@dataclass(frozen=True)
class SinglePlan:
    """The checked plan of a single hinge.

    Attributes
    ----------
    spec : SingleSpec
    train : Train
    core : float
        Radius in mm that each body gives up inside its own knuckles.
    parent, child : HalfPlan
        Both in the pose at angle 0.
    loose : tuple of Shape
        Loose pin, screw and nut, if any.
    """

    spec: SingleSpec
    train: Train
    core: float
    parent: HalfPlan
    child: HalfPlan
    loose: tuple[Shape, ...]


def wall_of(clearance: Clearance | float | str) -> float:
    """Thinnest wall in mm of the process that a clearance names, or 0.8."""
    name = clearance.source.split(":")[0] if isinstance(clearance, Clearance) else clearance
    if isinstance(name, str) and name.lower() in PROCESSES:
        return PROCESSES[name.lower()].wall
    return DEFAULT_WALL


def default_pin_radius(barrel: float, clearance: Clearance, wall: float = DEFAULT_WALL) -> float:
    """Choose a cone's foot radius: 60 % of the barrel, or as much as the wall leaves (mm)."""
    widening = ConePin(1.0).widening(clearance)
    return floor(1000.0 * min(0.6 * barrel, barrel - wall - widening) + 1e-6) / 1000.0


def default_radii(
    length: float,
    clearance: Clearance,
    wall: float = DEFAULT_WALL,
    knuckles: int = 3,
    margin: float | None = None,
    widest: float = 3.0,
) -> tuple[float, float]:
    """Choose a barrel and pin radius for a cone-pinned hinge on an edge.

    Parameters
    ----------
    length : float
        Of the edge in mm.
    clearance : Clearance
    wall : float
        Thinnest wall in mm.
    knuckles : int
    margin : float, optional
        Left free at each end of the edge in mm; barrel plus clearance when left out.
    widest : float
        Largest barrel radius to wish for, in mm.

    Returns
    -------
    barrel, pin : float
        In mm: the barrel nearest to an eighth of the edge (at most `widest`) that the rules of fit
        accept, and 60 % of it or as much as the wall leaves; 2.5 and 1.5 on an edge of 20 mm with
        0.3 mm clearance. The wanted barrel when none fits.
    """
    wanted = min(length / 8.0, widest)
    for step in (0, *(sign * n for n in range(1, 21) for sign in (1, -1))):
        barrel = round(wanted * (1.0 + 0.02 * step), 3)
        free = barrel + clearance.radial if margin is None else margin
        try:
            pin = ConePin(default_pin_radius(barrel, clearance, wall))
            pin.check(lay_out(length, knuckles, barrel, clearance, free), wall, Roof())
        except HingeError:
            continue
        return barrel, pin.radius
    return wanted, default_pin_radius(wanted, clearance, wall)


def _check_turn(spec: SingleSpec, train: Train) -> None:
    low, high = spec.angular_range
    advice = "the child's quadrant lies beside the parent's at 0° and on it at 180°"
    at_least("range", "the low end of the range", low, 0.0, advice, "°")
    at_most("range", "the high end of the range", high, 180.0, advice, "°")
    at_least("range", "the turn", high - low, 1.0, "give (low, high) in degrees", "°")
    inside = "draw the hinge inside its range, and off its stops"
    slack = spec.stops.clear_angle(train, spec.gap) if spec.stops else 0.0
    lowest = low + (slack if spec.stops and spec.stops.lower else 0.0)
    highest = high - (slack if spec.stops and spec.stops.upper else 0.0)
    at_least("pose", "the drawn angle", spec.angle, lowest, inside, "°")
    at_most("pose", "the drawn angle", spec.angle, highest, inside, "°")
    if spec.detents and not any(abs(spec.angle - a) < 1e-6 for a in spec.detents.angles):
        track = min(spec.detents.angles, key=lambda a: abs(a - spec.angle))
        raise FitError(
            "pose",
            "the drawn angle of a hinge with detents",
            spec.angle,
            track,
            "draw it at one of its detents, where it is free of its bumps",
            "°",
        )


@lru_cache(maxsize=256)
def plan_single(spec: SingleSpec) -> SinglePlan:
    """Check all rules of fit and plan every shape of a single hinge.

    Raises
    ------
    FitError
        Naming the rule, the value and what to change.
    HingeError
        If a parameter makes no sense.
    """
    train = lay_out(spec.length, spec.knuckles, spec.radius, spec.clearance, spec.margin)
    if not 0.0 < spec.gap <= 2.0 * spec.radius:
        raise HingeError(f"gap {spec.gap:g} mm must be above 0 and at most the barrel's thickness")
    spec.pin.check(train, spec.wall, spec.roof)
    spec.leaf.check(train, spec.gap, spec.wall)
    _check_turn(spec, train)
    widest = spec.pin.reach(train, spec.roof)
    if spec.chamfer < 0.0:
        raise HingeError(f"chamfer {spec.chamfer:g} mm must not be negative")
    at_least(
        "chamfer",
        "the flat that the chamfer leaves on a barrel's end",
        spec.radius - spec.chamfer - widest,
        0.4 if spec.chamfer else 0.0,
        "use a smaller chamfer, a thinner pin or a wider barrel",
    )
    core = 0.5 * (widest + spec.radius)
    _, far, top, bottom = spec.leaf.limits(train, spec.gap)
    heels: list[Shape] = []
    if spec.stops:
        spec.stops.check(train, (far, bottom), spec.wall)
        low, high = spec.angular_range
        if spec.stops.upper:
            heels += spec.stops.heel(train, high, top, upper=True)
        if spec.stops.lower:
            heels += spec.stops.heel(train, low, 0.5 * spec.gap, upper=False)
    bumps: tuple[Shape, ...] = ()
    hollows: tuple[Shape, ...] = ()
    if spec.detents:
        behind = min(far, bottom) - train.reach
        spec.detents.check(train, widest, spec.chamfer, behind, spec.angular_range)
        bumps = spec.detents.bumps(train, widest, spec.chamfer)
        hollows = spec.detents.hollows(train, widest, spec.chamfer, spec.angle, spec.angular_range)
    access = spec.pin.access(train, 0.5 * spec.length)
    barrels = spec.pin.knuckles(train, spec.chamfer)
    roofs = spec.pin.bores(train, spec.roof)
    halves = []
    for owner, side in ((0, -1.0), (1, 1.0)):
        halves.append(
            HalfPlan(
                (groove(train, owner, core), *access),
                (*spec.leaf.web(train, spec.gap, side), *(heels if owner else ())),
                (*(shape for who, shape in barrels if who == owner), *(() if owner else bumps)),
                (
                    *(shape for who, shape in roofs if who == owner),
                    *spec.leaf.drilled(train, spec.gap, side),
                    *(hollows if owner else ()),
                ),
            )
        )
    return SinglePlan(spec, train, core, halves[0], halves[1], spec.pin.hardware(train))
