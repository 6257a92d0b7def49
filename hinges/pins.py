"""Pins: what holds the knuckles of a hinge on their axis."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, radians, tan

from .clearance import Clearance
from .errors import HingeError
from .fit import at_least
from .shapes import Point, Turned
from .train import Train

__all__ = ["ConePin"]


@dataclass(frozen=True)
class ConePin:
    """A captive printed cone on the parent's knuckles, in recesses of the child's.

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
        if not 0.0 <= self.tip < self.radius:
            raise HingeError(
                f"cone pin: tip radius {self.tip:g} mm must be at or above 0 and below the radius "
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
        """Radius of the recess in the face of the child's knuckle, in mm."""
        return self.radius + self.widening(clearance)

    def floor(self, clearance: Clearance) -> float:
        """Radius of the flat floor of the recess, in mm."""
        return self.tip + self.widening(clearance)

    def reach(self, clearance: Clearance) -> float:
        """Largest radius in mm that the pin takes out of a barrel."""
        return self.mouth(clearance)

    def check(self, train: Train, wall: float) -> None:
        """Refuse a train that these pins cannot hold.

        Parameters
        ----------
        train : Train
        wall : float
            Thinnest wall of the process in mm.

        Raises
        ------
        FitError
            If a wall is too thin or the pins do not hold the child.
        """
        clearance = train.clearance
        at_least(
            "retention",
            "the number of knuckles on a cone-pinned axis",
            len(train.spans),
            3,
            "use 3 knuckles or more, or a pin with a head",
        )
        at_least(
            "wall",
            "the barrel wall around a recess (r - r_pin - 0.414 c at 45°)",
            train.radius - self.mouth(clearance),
            wall,
            "use a wider barrel, a thinner pin or a smaller clearance",
        )
        at_least(
            "cone",
            "the depth that a cone keeps in its recess after its axial play",
            self.height - 2.0 * clearance.axial,
            0.2,
            "use a thicker pin, a sharper tip or a smaller clearance",
        )
        for index, span in enumerate(train.spans):
            if span.owner == 0:
                continue
            recesses = 1 if index + 1 == len(train.spans) else 2
            at_least(
                "web",
                f"the material between the recesses of knuckle {index + 1}"
                if recesses == 2
                else f"the material behind the recess of knuckle {index + 1}",
                span.length - recesses * self.height,
                wall,
                "use fewer knuckles, a thinner pin or a longer edge",
            )

    def knuckles(self, train: Train, chamfer: float) -> tuple[tuple[int, Turned], ...]:
        """Turn every knuckle with its cones or recesses in one outline.

        Returns
        -------
        tuple of (owner, Turned)
        """
        clearance = train.clearance
        mouth, floor = self.mouth(clearance), self.floor(clearance)
        last = len(train.spans) - 1
        made = []
        for index, span in enumerate(train.spans):
            ends: list[list[Point]] = []
            for plain, face, inward in (
                (index == 0, span.start, 1.0),
                (index == last, span.end, -1.0),
            ):
                rim = [(train.radius - chamfer, face), (train.radius, face + inward * chamfer)]
                if chamfer == 0.0:
                    rim = rim[:1]
                if plain:
                    core = [(0.0, face)]
                elif span.owner == 0:
                    far = face - inward * self.height
                    core = [(0.0, far), (self.tip, far), (self.radius, face)]
                    core = core if self.tip > 0.0 else core[1:]
                else:
                    far = face + inward * self.height
                    core = [(0.0, far), (floor, far), (mouth, face)]
                ends.append(core + rim)
            made.append((span.owner, Turned((*ends[0], *reversed(ends[1])))))
        return tuple(made)
