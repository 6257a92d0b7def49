"""A pin that the child lifts off from: open at one end, with or without a tooth that keeps it on.

The parent's knuckle carries the pin, the child's slides over it along +z and nowhere else: against
-z it stands on the parent's knuckle. The bodies are cleared so that the knuckles can pass. Where
the pin has a tooth above the child's knuckle, the child comes off at those angles only at which a
keyway in its bore lies under the tooth.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import asin, cos, degrees, hypot, radians, sin
from typing import ClassVar

from .clearance import Clearance, number
from .exceptions import FitError, HingeError
from .fit import at_least
from .knuckles import KnuckleLayout
from .pins import BoreForm, ContactCircle, OwnedShape, Pin, barrel_end, turned_knuckle
from .shapes import Point, Prism, Turned, cylinder

__all__ = ["LiftPin"]

#: Direction in which the tooth stands out of the pin, in degrees from +x: outwards.
_UP = 90.0
#: How far a tooth still lies over the rim of the bore after all play, in mm.
_HOLD = 0.4
#: Length of the tooth along the axis, in mm.
_LONG = 1.2


@dataclass(frozen=True)
class LiftPin(Pin):
    """A printed straight pin on the parent, from which the child is lifted along +z.

    It takes two knuckles: a longer edge takes two hinges that point the same way.

    Parameters
    ----------
    radius : float
        Radius of the pin in mm.
    at : float or tuple of float, optional
        Angles in degrees at which the child comes off; at all others a tooth holds it. It comes off
        at every angle, and rests by its weight alone, when left out.
    tooth : float, optional
        How far the tooth stands out of the pin in mm. When left out, twice the clearance and
        0.4 mm, so that it holds by that much however the child leans.
    """

    printed: ClassVar[bool] = True

    radius: float
    at: tuple[float, ...] | float | None = None
    tooth: float | None = None

    def __post_init__(self) -> None:
        """Refuse a pin of no thickness, and angles that are none; one angle is one of several."""
        if number(self.radius, "a lift pin's radius") <= 0.0:
            raise HingeError(f"lift pin: radius {self.radius:g} mm must be above 0")
        if self.at is not None:
            angles = self.at if isinstance(self.at, (tuple, list)) else (self.at,)
            read = tuple(number(angle, "an angle of a lift pin") for angle in angles)
            if not read:
                raise HingeError("lift pin: give at least one angle at which the child comes off")
            object.__setattr__(self, "at", read)
        if self.tooth is not None and number(self.tooth, "a lift pin's tooth") <= 0.0:
            raise HingeError(f"lift pin: tooth {self.tooth:g} mm must be above 0")
        if self.tooth is not None and self.at is None:
            raise HingeError("lift pin: a tooth needs the angles at which it lets go: give at")

    @property
    def angles(self) -> tuple[float, ...]:
        """Angles in degrees at which the child comes off; none where it does at every angle."""
        return () if self.at is None else tuple(self.at)  # type: ignore[arg-type]

    def _tooth(self, clearance: Clearance) -> float:
        """How far the tooth stands out of the pin in mm; 0 where there is none."""
        if self.at is None:
            return 0.0
        return 2.0 * clearance.radial + _HOLD if self.tooth is None else self.tooth

    @property
    def _wide(self) -> float:
        """Width of the tooth in mm."""
        return max(0.8, 0.6 * self.radius)

    def _reach(self, clearance: Clearance) -> float:
        """Largest radius of pin and tooth in mm."""
        if self.at is None:
            return self.radius
        return hypot(self.radius + self._tooth(clearance), 0.5 * self._wide)

    def tip(self, layout: KnuckleLayout) -> float:
        """Find where the pin ends.

        Parameters
        ----------
        layout : KnuckleLayout
            The knuckles of the axis.

        Returns
        -------
        float
            End plane along z in mm.
        """
        return layout.end + (0.0 if self.at is None else layout.clearance.axial + _LONG)

    def travel(self, layout: KnuckleLayout) -> float:
        """How far the child is lifted until it is off its pin.

        Parameters
        ----------
        layout : KnuckleLayout
            The knuckles of the axis.

        Returns
        -------
        float
            Along +z in mm.
        """
        return self.tip(layout) - layout.knuckles[1].start

    def window(self, layout: KnuckleLayout) -> float:
        """How far beside the angles of `at` the tooth still passes its keyway.

        Parameters
        ----------
        layout : KnuckleLayout
            The knuckles of the axis.

        Returns
        -------
        float
            To either side, in degrees; 180 where there is no tooth.
        """
        if self.at is None:
            return 180.0
        room = layout.clearance.radial
        return degrees(asin(min(1.0, room / (self.radius + self._tooth(layout.clearance)))))

    def largest_radius(self, layout: KnuckleLayout, bore_form: BoreForm) -> float:
        """Largest radius in mm that the pin takes out of a barrel."""
        room = layout.clearance
        bore = (self.radius + room.radial) * bore_form.factor
        return bore if self.at is None else max(bore, self._keyway(room))

    def _keyway(self, clearance: Clearance) -> float:
        """Largest radius of the keyway in mm."""
        room = clearance.radial
        return hypot(self.radius + self._tooth(clearance) + room, 0.5 * self._wide + room)

    def thinnest_barrel(self, clearance: Clearance, wall: float, knuckles: int) -> float:
        """Smallest barrel radius in mm that leaves `wall` around bore and keyway."""
        del knuckles
        bore = self.radius + clearance.radial
        return (bore if self.at is None else max(bore, self._keyway(clearance))) + wall

    def check(self, layout: KnuckleLayout, wall: float, bore_form: BoreForm) -> None:
        """Refuse a layout from which the child cannot be lifted, or falls off.

        Raises
        ------
        FitError
            If there are not two knuckles, a wall or the pin is too thin, the pin is shorter than it
            is thick, or the tooth does not hold.
        """
        if len(layout.knuckles) != 2:
            raise FitError(
                "retention",
                "the number of knuckles on a lift-off pin",
                len(layout.knuckles),
                2,
                "use knuckles=2, so that nothing stands in the way of the child; on a long edge "
                "two hinges that point the same way",
                "",
            )
        self._check_common(layout, wall, bore_form)
        thick = "use a thicker pin"
        at_least("pin", "the thickness of the printed pin", 2.0 * self.radius, 2.0 * wall, thick)
        at_least(
            "retention",
            "the length of the pin in the child's knuckle",
            layout.knuckles[1].length,
            2.0 * self.radius,
            "use a longer edge or a thinner pin, or the child tilts off",
        )
        if self.at is not None:
            at_least(
                "retention",
                "how far the tooth lies over the rim of the bore after its play",
                self._tooth(layout.clearance) - 2.0 * layout.clearance.radial,
                0.2,
                "use a larger tooth or a smaller clearance",
            )
            # Halfway between two keyways the tooth has to stand on the rim with its whole width.
            room = layout.clearance.radial
            across = (self._wide + room) / (self.radius + room)
            for before, after in pairwise(sorted(self.angles)):
                at_least(
                    "retention",
                    "the distance of two angles at which the child comes off",
                    after - before,
                    2.0 * degrees(across),
                    "move them apart, or use a thicker pin: between them nothing would hold it",
                    "°",
                )

    def knuckle_shapes(self, layout: KnuckleLayout, chamfer: float) -> tuple[OwnedShape, ...]:
        """Turn the parent's knuckle with its pin, the child's with its bore; and the tooth."""
        below, above = layout.knuckles
        bore, tip, lead = self.radius + layout.clearance.radial, self.tip(layout), 0.3
        outline: list[Point] = [(0.0, below.start)]
        outline += barrel_end(layout.radius, chamfer, below.start, 1.0)
        outline += reversed(barrel_end(layout.radius, chamfer, below.end, -1.0))
        outline += [(self.radius, below.end), (self.radius, tip - lead)]
        outline += [(self.radius - lead, tip), (0.0, tip)]
        ring = turned_knuckle(layout, above, chamfer, [(bore, above.start)], [(bore, above.end)])
        made: list[OwnedShape] = [(0, Turned(tuple(outline))), (1, ring)]
        if self.at is not None:
            high = self.radius + self._tooth(layout.clearance)
            foot = layout.end + layout.clearance.axial
            made.append((0, _key(0.5 * self._wide, high, foot, tip - lead - 0.1, _UP)))
        return tuple(made)

    def bore_cuts(self, layout: KnuckleLayout, bore_form: BoreForm) -> tuple[OwnedShape, ...]:
        """Give the roof over the child's bore, and its keyways."""
        above, room = layout.knuckles[1], layout.clearance.radial
        made: list[OwnedShape] = [(1, over) for over in bore_form.roof(self.radius + room, above)]
        high = self.radius + self._tooth(layout.clearance) + room
        for angle in self.angles:
            ends = above.start - 0.01, above.end + 0.01
            made.append((1, _key(0.5 * self._wide + room, high, *ends, _UP - angle)))
        return tuple(made)

    def travel_cuts(self, layout: KnuckleLayout, edge: float) -> tuple[OwnedShape, ...]:
        """Clear the parent above the child's knuckle, and the child below the parent's."""
        groove, room = layout.groove_radius, layout.clearance
        top = max(edge, self.tip(layout) + room.axial)
        return (
            (0, cylinder(groove, layout.knuckles[1].start, top + 0.01)),
            (1, cylinder(groove, -edge - 0.01, layout.knuckles[0].end)),
            (1, cylinder(self._reach(room) + room.radial, layout.end, top + 0.01)),
        )

    def contact_circles(self, layout: KnuckleLayout) -> tuple[ContactCircle, ...]:
        """Both ends of the bore, and the tooth above it."""
        above, room = layout.knuckles[1], layout.clearance
        made = [
            ContactCircle(z, self.radius, (1.0, 0.0), room.radial) for z in (above.start, above.end)
        ]
        if self.at is not None:
            at = self.radius + self._tooth(room)
            side = degrees(0.5 * self._wide / at)
            arc = (_UP - side, _UP + side)
            made.append(ContactCircle(above.end + room.axial, at, (0.0, -1.0), room.axial, arc))
        return tuple(made)


def _key(half: float, high: float, start: float, end: float, turn: float) -> Prism:
    """Draw a tooth, or the keyway for it, from the axis outwards in a direction in degrees."""
    across, out = radians(turn - 90.0), radians(turn)
    corners = ((-half, 0.0), (half, 0.0), (half, high), (-half, high))
    outline = tuple(
        (x * cos(across) + y * cos(out), x * sin(across) + y * sin(out)) for x, y in corners
    )
    return Prism(outline, start, end)
