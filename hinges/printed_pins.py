"""Printed pins: cones in recesses, and straight ones that run through the barrel."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, radians, sin, tan
from typing import ClassVar

from .clearance import Clearance
from .exceptions import HingeError
from .fit import at_least
from .knuckles import KnuckleLayout
from .pins import BoreForm, ContactCircle, OwnedShape, Pin, barrel_end, turned_knuckle
from .shapes import Point, Shape, Turned, cylinder

__all__ = ["ConePin", "StraightPin"]

#: How much wider a 45° countersink is than its cone, for one unit of clearance normal to it.
_SLOPE = 2.0**0.5


@dataclass(frozen=True)
class ConePin(Pin):
    """A captive pin of printed cones on the pin owner's knuckles, in recesses of the others'.

    The clearance is normal to the cone: the recess is the cone moved outwards by c / cos(angle),
    so at 45° a child can shift by 1.41 c across the axis before the cones touch.

    Parameters
    ----------
    radius : float
        Radius at the foot of the cone in mm.
    angle : float
        Angle between the cone's surface and the axis in degrees; 45 prints in any pose.
    tip : float
        Radius of the blunt tip in mm.
    """

    printed: ClassVar[bool] = True

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
        """Compute how much wider than the cone's foot the mouth of the recess is.

        Parameters
        ----------
        clearance : Clearance
            Room between cone and recess.

        Returns
        -------
        float
            Difference of the radii in mm.
        """
        slope = radians(self.angle)
        return clearance.radial / cos(slope) - clearance.axial * tan(slope)

    def mouth(self, clearance: Clearance) -> float:
        """Compute the radius of the recess in the face of its knuckle.

        Parameters
        ----------
        clearance : Clearance
            Room between cone and recess.

        Returns
        -------
        float
            Radius in mm.
        """
        return self.radius + self.widening(clearance)

    def floor(self, clearance: Clearance) -> float:
        """Compute the radius of the flat floor of the recess.

        Parameters
        ----------
        clearance : Clearance
            Room between cone and recess.

        Returns
        -------
        float
            Radius in mm.
        """
        return self.tip + self.widening(clearance)

    def largest_radius(self, layout: KnuckleLayout, bore_form: BoreForm) -> float:
        """Largest radius in mm that the pin takes out of a barrel."""
        del bore_form
        return self.mouth(layout.clearance)

    def thinnest_barrel(self, clearance: Clearance, wall: float, knuckles: int) -> float:
        """Smallest barrel radius in mm that leaves `wall` around the recess."""
        del knuckles
        return self.mouth(clearance) + wall

    def check(self, layout: KnuckleLayout, wall: float, bore_form: BoreForm) -> None:
        """Refuse a layout that these pins cannot hold.

        Raises
        ------
        FitError
            If a wall is too thin or the pins do not hold the child.
        """
        at_least(
            "retention",
            "the number of knuckles on a cone-pinned axis",
            len(layout.knuckles),
            3,
            "use 3 knuckles or more, a straight pin with a head, or a screw",
            "",
        )
        at_least(
            "wall",
            "the barrel wall around a recess (r - r_pin - 0.414 c at 45°)",
            layout.radius - self.largest_radius(layout, bore_form),
            wall,
            "use a wider barrel, a thinner pin or a smaller clearance",
        )
        self._check_common(layout, wall, bore_form)
        at_least(
            "cone",
            "the depth that a cone keeps in its recess after its axial play",
            self.height - 2.0 * layout.clearance.axial,
            0.2,
            "use a thicker pin, a sharper tip or a smaller clearance",
        )
        last = len(layout.knuckles) - 1
        for index, knuckle in enumerate(layout.knuckles):
            if knuckle.owner == layout.pin_owner:
                continue
            recesses = (index > 0) + (index < last)
            between = "between the recesses" if recesses == 2 else "behind the recess"
            at_least(
                "web",
                f"the material {between} of knuckle {index + 1}",
                knuckle.length - recesses * self.height,
                wall,
                "use fewer knuckles, a thinner pin or a longer edge",
            )

    def knuckle_shapes(self, layout: KnuckleLayout, chamfer: float) -> tuple[OwnedShape, ...]:
        """Turn every knuckle with its cones or recesses in one outline."""
        mouth, floor = self.mouth(layout.clearance), self.floor(layout.clearance)
        last = len(layout.knuckles) - 1

        def core(owner: int, face: float, inward: float, outer: bool) -> list[Point]:
            if outer:
                return [(0.0, face)]
            if owner == layout.pin_owner:
                far = face - inward * self.height
                return [(0.0, far), (self.tip, far), (self.radius, face)]
            far = face + inward * self.height
            return [(0.0, far), (floor, far), (mouth, face)]

        return tuple(
            (
                knuckle.owner,
                turned_knuckle(
                    layout,
                    knuckle,
                    chamfer,
                    core(knuckle.owner, knuckle.start, 1.0, index == 0),
                    core(knuckle.owner, knuckle.end, -1.0, index == last),
                ),
            )
            for index, knuckle in enumerate(layout.knuckles)
        )

    def contact_circles(self, layout: KnuckleLayout) -> tuple[ContactCircle, ...]:
        """Foot and tip of every cone."""
        slope = radians(self.angle)
        gap = layout.clearance.radial
        made = []
        for one, after in zip(layout.knuckles, layout.knuckles[1:], strict=False):
            face, up = (one.end, 1.0) if one.owner == layout.pin_owner else (after.start, -1.0)
            normal = (cos(slope), up * sin(slope))
            made.append(ContactCircle(face, self.radius, normal, gap))
            made.append(ContactCircle(face + up * self.height, self.tip, normal, gap))
        return tuple(made)


@dataclass(frozen=True)
class StraightPin(Pin):
    """A captive printed pin that runs through the bores of the other knuckles.

    Where the last knuckle is not the pin owner's, the pin ends in a 45° head in a countersink, so
    that two knuckles are enough.

    Parameters
    ----------
    radius : float
        Radius of the pin in mm.
    """

    printed: ClassVar[bool] = True

    radius: float

    def __post_init__(self) -> None:
        """Refuse a pin of no thickness."""
        if self.radius <= 0.0:
            raise HingeError(f"straight pin: radius {self.radius:g} mm must be above 0")

    def _head(self, clearance: Clearance) -> float:
        """How far the head stands over the pin, in mm; 0.3 more than its play."""
        return clearance.radial + 0.3

    def largest_radius(self, layout: KnuckleLayout, bore_form: BoreForm) -> float:
        """Largest radius in mm that the pin takes out of a barrel."""
        clearance = layout.clearance
        bore = (self.radius + clearance.radial) * bore_form.factor
        if all(layout.knuckles[end].owner == layout.pin_owner for end in (0, -1)):
            return bore
        return max(bore, self.radius + self._head(clearance) + _SLOPE * clearance.radial)

    def thinnest_barrel(self, clearance: Clearance, wall: float, knuckles: int) -> float:
        """Smallest barrel radius in mm that leaves `wall` around the bore."""
        head = self._head(clearance) + (_SLOPE - 1.0) * clearance.radial
        return self.radius + clearance.radial + (0.0 if knuckles % 2 else head) + wall

    def check(self, layout: KnuckleLayout, wall: float, bore_form: BoreForm) -> None:
        """Refuse a layout that this pin cannot hold.

        Raises
        ------
        FitError
            If a wall or the pin is too thin.
        """
        self._check_common(layout, wall, bore_form)
        at_least(
            "pin",
            "the thickness of the printed pin",
            2.0 * self.radius,
            2.0 * wall,
            "use a thicker pin, or a loose one",
        )

    def knuckle_shapes(self, layout: KnuckleLayout, chamfer: float) -> tuple[OwnedShape, ...]:
        """Turn the pin owner's knuckles and pin in one outline, and every other knuckle's ring."""
        gap = layout.clearance.radial
        head = self._head(layout.clearance)
        bore = self.radius + gap
        made: list[OwnedShape] = []
        outline: list[Point] = []
        last = len(layout.knuckles) - 1
        for index, knuckle in enumerate(layout.knuckles):
            if knuckle.owner == layout.pin_owner:
                if index:
                    outline.append((self.radius, knuckle.start))
                outline += barrel_end(layout.radius, chamfer, knuckle.start, 1.0)
                outline += reversed(barrel_end(layout.radius, chamfer, knuckle.end, -1.0))
                if index < last:
                    outline.append((self.radius, knuckle.end))
                continue
            ends: list[list[Point]] = []
            for outer, face, inward in (
                (index == 0, knuckle.start, 1.0),
                (index == last, knuckle.end, -1.0),
            ):
                if not outer:
                    ends.append([(bore, face)])
                    continue
                flare = [(self.radius + head, face), (self.radius, face + inward * head)]
                outline += flare if index == 0 else reversed(flare)
                foot = face + inward * (head + (_SLOPE - 1.0) * gap)
                ends.append([(bore, foot), (self.radius + head + _SLOPE * gap, face)])
            made.append((knuckle.owner, turned_knuckle(layout, knuckle, chamfer, *ends)))
        whole = Turned(((0.0, outline[0][1]), *outline, (0.0, outline[-1][1])))
        return ((layout.pin_owner, whole), *made)

    def bore_cuts(self, layout: KnuckleLayout, bore_form: BoreForm) -> tuple[OwnedShape, ...]:
        """Give the roofs over the bores."""
        radius = self.radius + layout.clearance.radial
        return tuple(
            (knuckle.owner, roof_shape)
            for knuckle in layout.knuckles
            if knuckle.owner != layout.pin_owner
            for roof_shape in bore_form.roof(radius, knuckle)
        )

    def insertion_cuts(self, layout: KnuckleLayout, edge: float) -> tuple[Shape, ...]:
        """Clear the bodies before the flat end of a head."""
        del edge
        wide = self.radius + self._head(layout.clearance) + _SLOPE * layout.clearance.radial
        room = layout.clearance.axial
        ends = (
            (layout.knuckles[0], layout.start - room, layout.start),
            (layout.knuckles[-1], layout.end, layout.end + room),
        )
        return tuple(
            cylinder(wide, low, high)
            for knuckle, low, high in ends
            if knuckle.owner != layout.pin_owner
        )

    def contact_circles(self, layout: KnuckleLayout) -> tuple[ContactCircle, ...]:
        """Both ends of every bore, and the flare of a head."""
        gap, head = layout.clearance.radial, self._head(layout.clearance)
        made = []
        last = len(layout.knuckles) - 1
        for index, knuckle in enumerate(layout.knuckles):
            if knuckle.owner == layout.pin_owner:
                continue
            made += [
                ContactCircle(z, self.radius, (1.0, 0.0), gap) for z in (knuckle.start, knuckle.end)
            ]
            for outer, face, up in (
                (index == 0, knuckle.start, 1.0),
                (index == last, knuckle.end, -1.0),
            ):
                if outer:
                    normal = (0.5**0.5, up * 0.5**0.5)
                    made.append(ContactCircle(face, self.radius + head, normal, gap))
        return tuple(made)
