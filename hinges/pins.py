"""Pins: what holds the knuckles of a hinge on their axis.

A pin says how it shapes every knuckle, what it takes out of the bodies beside them, and whether
the result can be printed. Printed pins grow on the knuckles of the train's holder (the parent of
a single hinge); loose ones (:mod:`hinges.hardware`) are put in after printing.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from math import cos, radians, sin, tan
from typing import Literal

from .clearance import Clearance
from .errors import HingeError
from .fit import at_least
from .shapes import Point, Prism, Shape, Turned, cylinder, regular, teardrop
from .train import Span, Train

__all__ = ["ConePin", "Pin", "Ring", "Roof", "StraightPin"]

Owned = tuple[int, Shape]
_SLOPE = 2.0**0.5


@dataclass(frozen=True)
class Roof:
    """How bores that lie down while printing are closed above.

    Attributes
    ----------
    style : {"round", "teardrop", "octagon"}
        Round for an axis that stands upright, the others print without support lying down.
    up : tuple of float
        Direction of printing for each owner, in degrees about the axis from +x, in the pose at
        angle 0.
    """

    style: Literal["round", "teardrop", "octagon"] = "round"
    up: tuple[float, ...] = (90.0, 90.0, 90.0)

    def __post_init__(self) -> None:
        """Refuse an unknown style."""
        if self.style not in ("round", "teardrop", "octagon"):
            raise HingeError(f"bore style {self.style!r}: use round, teardrop or octagon")

    @property
    def factor(self) -> float:
        """Largest radius of the bore over the radius of the round one."""
        return {"round": 1.0, "teardrop": 1.219, "octagon": 1.0 / cos(radians(22.5))}[self.style]

    def over(self, radius: float, span: Span) -> tuple[Prism, ...]:
        """Give what to cut besides the round bore of `radius` (mm) through a knuckle."""
        up = self.up[span.owner]
        if self.style == "teardrop":
            return (teardrop(radius, span.start, span.end, up),)
        if self.style == "octagon":
            return (regular(8, 2.0 * radius, span.start, span.end, up + 22.5),)
        return ()


@dataclass(frozen=True)
class Ring:
    """A circle on the holder's pin and how near the bore around it is, for play.

    Attributes
    ----------
    z, radius : float
        In mm.
    normal : (radial, axial) float
        Outward normal of the pin's surface.
    gap : float
        To the facing surface, in mm.
    """

    z: float
    radius: float
    normal: tuple[float, float]
    gap: float


class Pin(ABC):
    """What every kind of pin tells the hinge."""

    @abstractmethod
    def reach(self, train: Train, roof: Roof) -> float:
        """Largest radius in mm that the pin takes out of a barrel."""

    @abstractmethod
    def check(self, train: Train, wall: float, roof: Roof) -> None:
        """Raise :class:`~hinges.errors.FitError` for a train that these pins cannot hold."""

    @abstractmethod
    def knuckles(self, train: Train, chamfer: float) -> tuple[Owned, ...]:
        """Shape every knuckle, its round bores and recesses included."""

    @abstractmethod
    def thinnest_barrel(self, clearance: Clearance, wall: float, knuckles: int) -> float:
        """Smallest barrel radius in mm that leaves `wall` around the pin."""

    @abstractmethod
    def rings(self, train: Train) -> tuple[Ring, ...]:
        """Where pin and bores face one another, for :func:`hinges.wobble.play`."""

    def bores(self, train: Train, roof: Roof) -> tuple[Owned, ...]:
        """Give what is cut out of the finished halves: roofs, nut pockets."""
        del train, roof
        return ()

    def access(self, train: Train, edge: float) -> tuple[Shape, ...]:
        """Give what both bodies give up beyond the knuckles to put a loose pin in.

        `edge` is half the length of the edge in mm.
        """
        del train, edge
        return ()

    def hardware(self, train: Train) -> tuple[Shape, ...]:
        """Draw the loose pin itself; empty for a printed one."""
        del train
        return ()

    def _check_common(self, train: Train, wall: float, roof: Roof) -> None:
        at_least(
            "wall",
            "the barrel wall around the pin's recess or bore",
            train.radius - self.reach(train, roof),
            wall,
            "use a wider barrel, a thinner pin or a smaller clearance",
        )
        at_least(
            "knuckle",
            "the length of a knuckle",
            min(span.length for span in train.spans),
            2.0 * wall,
            "use fewer knuckles or a longer edge",
        )


def rim(radius: float, chamfer: float, face: float, inward: float) -> list[Point]:
    """Outer corners of a barrel's end: the chamfer's two, or one."""
    if chamfer <= 0.0:
        return [(radius, face)]
    return [(radius - chamfer, face), (radius, face + inward * chamfer)]


def ring(train: Train, span: Span, chamfer: float, start: list[Point], end: list[Point]) -> Turned:
    """Turn a knuckle whose inner outline at its two ends is given from the inside outwards."""
    first = start + rim(train.radius, chamfer, span.start, 1.0)
    second = end + rim(train.radius, chamfer, span.end, -1.0)
    return Turned((*first, *reversed(second)))


@dataclass(frozen=True)
class ConePin(Pin):
    """A captive printed cone on the holder's knuckles, in recesses of the others'.

    The clearance is normal to the cone: the recess is the cone moved outwards by c / cos(angle),
    so at 45° a child can shift by 1.41 c across the axis before the cones touch.

    Parameters
    ----------
    radius : float
        At the foot of the cone in mm.
    angle : float
        Between the cone's surface and the axis in degrees; 45 prints in any pose.
    tip : float
        Radius of the blunt tip in mm.
    """

    radius: float
    angle: float = 45.0
    tip: float = 0.2

    def __post_init__(self) -> None:
        """Refuse what is no cone."""
        if not 0.0 < self.tip < self.radius:
            raise HingeError(
                f"cone pin: tip radius {self.tip:g} mm must be above 0 and below the radius "
                f"{self.radius:g} mm"
            )
        if not 20.0 <= self.angle <= 60.0:
            raise HingeError(f"cone pin: angle {self.angle:g}° is outside 20° to 60°")

    @property
    def height(self) -> float:
        """How far the cone stands out of its knuckle, in mm."""
        return (self.radius - self.tip) / tan(radians(self.angle))

    def widening(self, clearance: Clearance) -> float:
        """How much wider than the cone's foot the mouth of the recess is, in mm."""
        slope = radians(self.angle)
        return clearance.radial / cos(slope) - clearance.axial * tan(slope)

    def mouth(self, clearance: Clearance) -> float:
        """Radius of the recess in the face of its knuckle, in mm."""
        return self.radius + self.widening(clearance)

    def floor(self, clearance: Clearance) -> float:
        """Radius of the flat floor of the recess, in mm."""
        return self.tip + self.widening(clearance)

    def reach(self, train: Train, roof: Roof) -> float:
        """Largest radius in mm that the pin takes out of a barrel."""
        del roof
        return self.mouth(train.clearance)

    def thinnest_barrel(self, clearance: Clearance, wall: float, knuckles: int) -> float:
        """Smallest barrel radius in mm that leaves `wall` around the recess."""
        del knuckles
        return self.mouth(clearance) + wall

    def check(self, train: Train, wall: float, roof: Roof) -> None:
        """Refuse a train that these pins cannot hold.

        Raises
        ------
        FitError
            If a wall is too thin or the pins do not hold the child.
        """
        at_least(
            "retention",
            "the number of knuckles on a cone-pinned axis",
            len(train.spans),
            3,
            "use 3 knuckles or more, a straight pin with a head, or a screw",
            "",
        )
        at_least(
            "wall",
            "the barrel wall around a recess (r - r_pin - 0.414 c at 45°)",
            train.radius - self.reach(train, roof),
            wall,
            "use a wider barrel, a thinner pin or a smaller clearance",
        )
        self._check_common(train, wall, roof)
        at_least(
            "cone",
            "the depth that a cone keeps in its recess after its axial play",
            self.height - 2.0 * train.clearance.axial,
            0.2,
            "use a thicker pin, a sharper tip or a smaller clearance",
        )
        last = len(train.spans) - 1
        for index, span in enumerate(train.spans):
            if span.owner == train.holder:
                continue
            recesses = (index > 0) + (index < last)
            between = "between the recesses" if recesses == 2 else "behind the recess"
            at_least(
                "web",
                f"the material {between} of knuckle {index + 1}",
                span.length - recesses * self.height,
                wall,
                "use fewer knuckles, a thinner pin or a longer edge",
            )

    def knuckles(self, train: Train, chamfer: float) -> tuple[Owned, ...]:
        """Turn every knuckle with its cones or recesses in one outline."""
        mouth, floor = self.mouth(train.clearance), self.floor(train.clearance)
        last = len(train.spans) - 1

        def core(owner: int, face: float, inward: float, outer: bool) -> list[Point]:
            if outer:
                return [(0.0, face)]
            if owner == train.holder:
                far = face - inward * self.height
                return [(0.0, far), (self.tip, far), (self.radius, face)]
            far = face + inward * self.height
            return [(0.0, far), (floor, far), (mouth, face)]

        return tuple(
            (
                span.owner,
                ring(
                    train,
                    span,
                    chamfer,
                    core(span.owner, span.start, 1.0, index == 0),
                    core(span.owner, span.end, -1.0, index == last),
                ),
            )
            for index, span in enumerate(train.spans)
        )

    def rings(self, train: Train) -> tuple[Ring, ...]:
        """Foot and tip of every cone."""
        slope = radians(self.angle)
        gap = train.clearance.radial
        made = []
        for one, after in zip(train.spans, train.spans[1:], strict=False):
            face, up = (one.end, 1.0) if one.owner == train.holder else (after.start, -1.0)
            normal = (cos(slope), up * sin(slope))
            made.append(Ring(face, self.radius, normal, gap))
            made.append(Ring(face + up * self.height, self.tip, normal, gap))
        return tuple(made)


@dataclass(frozen=True)
class StraightPin(Pin):
    """A captive printed pin that runs through the bores of the other knuckles.

    Where the last knuckle is not the holder's the pin ends in a 45° head in a countersink, so that
    two knuckles are enough.

    Parameters
    ----------
    radius : float
        Of the pin in mm.
    """

    radius: float

    def __post_init__(self) -> None:
        """Refuse a pin of no thickness."""
        if self.radius <= 0.0:
            raise HingeError(f"straight pin: radius {self.radius:g} mm must be above 0")

    def _head(self, clearance: Clearance) -> float:
        """How far the head stands over the pin, in mm; 0.3 more than its play."""
        return clearance.radial + 0.3

    def reach(self, train: Train, roof: Roof) -> float:
        """Largest radius in mm that the pin takes out of a barrel."""
        clearance = train.clearance
        bore = (self.radius + clearance.radial) * roof.factor
        if all(train.spans[end].owner == train.holder for end in (0, -1)):
            return bore
        return max(bore, self.radius + self._head(clearance) + _SLOPE * clearance.radial)

    def thinnest_barrel(self, clearance: Clearance, wall: float, knuckles: int) -> float:
        """Smallest barrel radius in mm that leaves `wall` around the bore."""
        head = self._head(clearance) + (_SLOPE - 1.0) * clearance.radial
        return self.radius + clearance.radial + (0.0 if knuckles % 2 else head) + wall

    def check(self, train: Train, wall: float, roof: Roof) -> None:
        """Refuse a train that this pin cannot hold.

        Raises
        ------
        FitError
            If a wall or the pin is too thin.
        """
        self._check_common(train, wall, roof)
        at_least(
            "pin",
            "the thickness of the printed pin",
            2.0 * self.radius,
            2.0 * wall,
            "use a thicker pin, or a loose one",
        )

    def knuckles(self, train: Train, chamfer: float) -> tuple[Owned, ...]:
        """Turn the holder's knuckles and pin in one outline, and every other knuckle's ring."""
        gap = train.clearance.radial
        head = self._head(train.clearance)
        bore = self.radius + gap
        made: list[Owned] = []
        outline: list[Point] = []
        last = len(train.spans) - 1
        for index, span in enumerate(train.spans):
            if span.owner == train.holder:
                if index:
                    outline.append((self.radius, span.start))
                outline += rim(train.radius, chamfer, span.start, 1.0)
                outline += reversed(rim(train.radius, chamfer, span.end, -1.0))
                if index < last:
                    outline.append((self.radius, span.end))
                continue
            ends: list[list[Point]] = []
            for outer, face, inward in (
                (index == 0, span.start, 1.0),
                (index == last, span.end, -1.0),
            ):
                if not outer:
                    ends.append([(bore, face)])
                    continue
                flare = [(self.radius + head, face), (self.radius, face + inward * head)]
                outline += flare if index == 0 else reversed(flare)
                foot = face + inward * (head + (_SLOPE - 1.0) * gap)
                ends.append([(bore, foot), (self.radius + head + _SLOPE * gap, face)])
            made.append((span.owner, ring(train, span, chamfer, *ends)))
        whole = Turned(((0.0, outline[0][1]), *outline, (0.0, outline[-1][1])))
        return ((train.holder, whole), *made)

    def bores(self, train: Train, roof: Roof) -> tuple[Owned, ...]:
        """Give the roofs over the bores."""
        radius = self.radius + train.clearance.radial
        return tuple(
            (span.owner, roof_shape)
            for span in train.spans
            if span.owner != train.holder
            for roof_shape in roof.over(radius, span)
        )

    def access(self, train: Train, edge: float) -> tuple[Shape, ...]:
        """Clear the bodies before the flat end of a head."""
        del edge
        wide = self.radius + self._head(train.clearance) + _SLOPE * train.clearance.radial
        room = train.clearance.axial
        ends = (
            (train.spans[0], train.start - room, train.start),
            (train.spans[-1], train.end, train.end + room),
        )
        return tuple(
            cylinder(wide, low, high) for span, low, high in ends if span.owner != train.holder
        )

    def rings(self, train: Train) -> tuple[Ring, ...]:
        """Both ends of every bore, and the flare of a head."""
        gap, head = train.clearance.radial, self._head(train.clearance)
        made = []
        last = len(train.spans) - 1
        for index, span in enumerate(train.spans):
            if span.owner == train.holder:
                continue
            made += [Ring(z, self.radius, (1.0, 0.0), gap) for z in (span.start, span.end)]
            for outer, face, up in ((index == 0, span.start, 1.0), (index == last, span.end, -1.0)):
                if outer:
                    normal = (0.5**0.5, up * 0.5**0.5)
                    made.append(Ring(face, self.radius + head, normal, gap))
        return tuple(made)
