"""The plan of a single hinge: every parameter checked, every shape as data.

Exact solids (:mod:`hinges.exact_solids`) and meshes (:mod:`hinges.mesh`) are both made from it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Unpack

from .arm import Arm, Mount
from .arm_room import check_arms
from .barrel import BarrelSpec, barrel_spec, check_gap
from .blank import cut_from_blank
from .clearance import millimetres
from .exceptions import FitError, HingeError
from .fit import at_least, at_most
from .knuckles import KnuckleLayout, groove, lay_out_knuckles
from .leaf import Bracket
from .options import SingleHingeKeywords, SingleHingeOptions
from .shapes import HalfPlan, Shape
from .stops import Detents, Stops

__all__ = ["SinglePlan", "SingleSpec", "plan_single"]


@dataclass(frozen=True, kw_only=True)
class SingleSpec(BarrelSpec):
    """All parameters of a single hinge, defaults filled in.

    Attributes
    ----------
    length : float
        Length in mm of the edge that the hinge is for.
    mounts : (Mount, Mount)
        What joins the knuckles of the parent and of the child to their bodies.
    angle : float
        Angle in degrees at which the hinge is drawn and printed.
    angular_range : (float, float)
        Lowest and highest angle in degrees.
    stops : Stops or None
        Lugs that end the turn.
    detents : Detents or None
        Angles at which the hinge clicks.
    ratio : float
        Length of a knuckle of the child against one of the parent.
    """

    length: float
    mounts: tuple[Mount, Mount]
    angle: float
    angular_range: tuple[float, float]
    stops: Stops | None
    detents: Detents | None
    ratio: float = 1.0

    @property
    def leaf(self) -> Mount:
        """What joins the knuckles of the parent."""
        return self.mounts[0]

    @property
    def on_arms(self) -> bool:
        """Whether either half stands on arms."""
        return any(isinstance(mount, Arm) for mount in self.mounts)

    @classmethod
    def read(cls, length: float | str, **keywords: Unpack[SingleHingeKeywords]) -> SingleSpec:
        """Fill in the defaults.

        Parameters
        ----------
        length : float
            Length in mm of the edge that the hinge is for.
        **keywords
            The keywords of :class:`hinges.SingleHinge`.

        Returns
        -------
        SingleSpec
            All sizes, not yet checked against the rules of fit.

        Raises
        ------
        HingeError
            If the clearance cannot be read or the form of the bores is unknown.
        """
        options = SingleHingeOptions(**keywords)
        length = millimetres(length, "length")
        if options.margin is None and not any(
            isinstance(mount, Bracket) for mount in options.mounts
        ):
            options = replace(options, margin=0.0)
        sizes = vars(barrel_spec(options, length, options.knuckles, (0.0, options.angle)))
        low, high, stops = _range(options)
        return cls(
            length=float(length),
            mounts=options.mounts,
            angle=float(options.angle),
            angular_range=(float(low), float(high)),
            stops=stops,
            detents=_detents(options),
            ratio=float(options.ratio),
            **sizes,
        )


def _range(options: SingleHingeOptions) -> tuple[float, float, Stops | None]:
    """Lowest and highest angle, and the stops there; arms have nothing that a stop leans on."""
    if options.opens is None:
        stops = Stops() if options.stops is True else options.stops or None
        return (*options.angular_range, stops)
    bare = any(isinstance(mount, Arm) for mount in options.mounts)
    if options.closed == 0.0:
        return 0.0, options.opens, None if bare else Stops()
    return 180.0 - options.opens, 180.0, None if bare else Stops(lower=True, upper=False)


def _detents(options: SingleHingeOptions) -> Detents | None:
    """Detents as asked for; bumps that drag all the way but where it is drawn, for friction."""
    if options.friction is None:
        return options.detents
    return Detents((options.angle,), interference=options.friction, ridge=360.0)


@dataclass(frozen=True)
class SinglePlan:
    """The checked plan of a single hinge.

    Attributes
    ----------
    spec : SingleSpec
        The parameters that it was made from.
    layout : KnuckleLayout
        The knuckles along the axis.
    core : float
        Radius in mm that each body gives up inside its own knuckles.
    parent, child : HalfPlan
        Shapes of the two halves, both in the pose at angle 0.
    loose : tuple of Shape
        Shapes of the loose pin, screw and nut; empty for a printed pin.
    """

    spec: SingleSpec
    layout: KnuckleLayout
    core: float
    parent: HalfPlan
    child: HalfPlan
    loose: tuple[Shape, ...]


def _check_turn(spec: SingleSpec, layout: KnuckleLayout) -> None:
    low, high = spec.angular_range
    advice = "the child's quadrant lies beside the parent's at 0° and on it at 180°"
    outside = all(isinstance(mount, Arm) for mount in spec.mounts)
    below = f"{advice}; below 0° it turns on an axis outside of both bodies, on leaf=Arm(...)"
    at_least("range", "the low end of the range", low, -180.0 if outside else 0.0, below, "°")
    at_most("range", "the turn", high - low, 270.0, "give (low, high) in degrees", "°")
    at_most("range", "the high end of the range", high, 180.0, advice, "°")
    at_least("range", "the turn", high - low, 1.0, "give (low, high) in degrees", "°")
    inside = "draw the hinge inside its range, and off its stops"
    slack = spec.stops.clear_angle(layout, spec.gap) if spec.stops else 0.0
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

    Parameters
    ----------
    spec : SingleSpec
        All parameters of the hinge.

    Returns
    -------
    SinglePlan
        The plan; cached by the parameters.

    Raises
    ------
    FitError
        If the hinge cannot be printed or cannot turn, naming the rule, the value and what to
        change.
    HingeError
        If a parameter makes no sense.
    """
    layout = lay_out_knuckles(
        spec.length, spec.knuckles, spec.radius, spec.clearance, spec.margin, ratio=spec.ratio
    )
    if not 0.0 < spec.gap <= 2.0 * spec.radius:
        raise HingeError(f"gap {spec.gap:g} mm must be above 0 and at most the barrel's thickness")
    check_gap(spec)
    spec.pin.check(layout, spec.wall, spec.bore_form)
    for mount in spec.mounts:
        mount.check(layout, spec.gap, spec.wall)
    _check_turn(spec, layout)
    if spec.on_arms:
        if spec.stops:
            raise HingeError(
                "stops lean on the faces of brackets and leaves, arms have none: leave stops out, "
                "or give leaf=Bracket(...)"
            )
        check_arms(spec.mounts, layout, spec.gap, spec.angular_range)
    widest = spec.pin.largest_radius(layout, spec.bore_form)
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
    lugs: list[Shape] = []
    if spec.stops:
        _, far, top, bottom = spec.leaf.limits(layout, spec.gap)
        spec.stops.check(layout, (far, bottom), spec.wall)
        low, high = spec.angular_range
        if spec.stops.upper:
            lugs += spec.stops.lug(layout, high, top, upper=True)
        if spec.stops.lower:
            lugs += spec.stops.lug(layout, low, 0.5 * spec.gap, upper=False)
    bumps: tuple[Shape, ...] = ()
    dimples: tuple[Shape, ...] = ()
    if spec.detents:
        spec.detents.check(layout, widest, spec.chamfer, spec.gap, spec.wall, spec.angular_range)
        bumps = spec.detents.bumps(layout, widest, spec.chamfer)
        dimples = spec.detents.dimple_cuts(
            layout, widest, spec.chamfer, spec.angle, spec.angular_range
        )
    access = spec.pin.insertion_cuts(layout, 0.5 * spec.length)
    travel = spec.pin.travel_cuts(layout, 0.5 * spec.length)
    barrels = spec.pin.knuckles(layout, spec.chamfer, spec.bore_form)
    halves = []
    for owner, (side, mount) in enumerate(zip((-1.0, 1.0), spec.mounts, strict=True)):
        room = (*access, *(shape for who, shape in travel if who == owner))
        web = (*mount.web(layout, spec.gap, side), *(lugs if owner else ()))
        add = (*(shape for who, shape in barrels if who == owner), *(() if owner else bumps))
        half = HalfPlan(
            (groove(layout, owner, core), *room),
            web,
            add,
            (*mount.hole_cuts(layout, spec.gap, side), *(dimples if owner else ())),
        )
        if not (spec.chamfer or travel or (bumps and not owner)):
            row = groove(layout, owner, spec.radius)
            blank, cut = cut_from_blank(web, add, row, room)
            half = replace(half, seat=(row, *room), blank=blank, notches=cut)
        halves.append(half)
    return SinglePlan(
        spec, layout, core, halves[0], halves[1], spec.pin.hardware(layout, spec.bore_form)
    )
