"""A ball and its socket, printed in place or pushed together.

The ball of radius r turns in a hollow of radius R = r + c. The socket ends in a plane at the height
h above the middle, where its mouth has the radius √(R² - h²). A neck of radius n that leans by the
angle s keeps the clearance c from the mouth's edge when

    s = φ - asin((n + c) / R),   cos φ = h / R,

so the swing that is asked for gives h. What holds the ball is how much narrower the mouth is than
the ball; that is the retention, r - R sin φ.
"""

from __future__ import annotations

from math import asin, cos, degrees, radians, sin
from typing import TYPE_CHECKING

from build123d import (
    Align,
    BallJoint,
    Box,
    Cylinder,
    Location,
    Part,
    Pos,
    RigidJoint,
    Sphere,
)

from .clearance import Clearance, millimetres, number
from .exceptions import HingeError
from .fit import at_least

if TYPE_CHECKING:
    from build123d import Shape

__all__ = ["BallSocket"]

#: The mouth is narrower than the ball by this share of its radius at least.
_LEAST_RETENTION = 0.06


class BallSocket:
    """A joint that turns every way, up to a swing from its axis.

    The middle of the ball is the origin, the neck leaves along +z, the socket's open side looks
    there too. Join `socket` to one body and `ball` to the other with ``+``.

    Parameters
    ----------
    radius : float
        Radius of the ball in mm.
    clearance : float, str or Clearance
        Room around the ball, as of :class:`hinges.SingleHinge`.
    swing : float
        How far the neck may lean from the axis, degrees.
    neck : float, optional
        Radius of the neck in mm; 45 % of the ball by default.
    reach : float, optional
        Length of the neck from the middle of the ball in mm; twice the ball's radius by default.
    wall : float
        Thickness of the socket in mm.
    slots : int
        Slots that cut the rim into fingers, for a ball that is pushed in after printing; none for
        one that is printed in place.

    Attributes
    ----------
    retention : float
        How much narrower the mouth is than the ball, mm of the radius.
    mouth : float
        Radius of the mouth in mm.
    height : float
        Height of the mouth above the ball's middle in mm.
    strain : float
        Strain of the rim, as a share of 1, when the ball is pushed in.

    Raises
    ------
    FitError
        If the mouth would not hold the ball, or the neck is thinner than the wall.
    HingeError
        If a parameter makes no sense.

    Examples
    --------
    >>> joint = BallSocket(6, clearance=0.3, swing=25)
    >>> round(joint.mouth, 2), round(joint.retention, 2)
    (5.06, 0.94)
    """

    def __init__(
        self,
        radius: float | str,
        *,
        clearance: Clearance | float | str = "fdm",
        swing: float = 25.0,
        neck: float | None = None,
        reach: float | None = None,
        wall: float = 1.6,
        slots: int = 0,
    ) -> None:
        self.radius = millimetres(radius, "radius")
        self.clearance = clearance if isinstance(clearance, Clearance) else Clearance(clearance)
        self.swing, self.wall = number(swing, "swing"), number(wall, "wall")
        if self.radius <= 0.0 or self.wall <= 0.0:
            raise HingeError("radius and wall must be above 0")
        self.neck = 0.45 * self.radius if neck is None else number(neck, "neck")
        self.reach = 2.0 * self.radius if reach is None else number(reach, "reach")
        if not 0.0 < self.neck < self.radius:
            raise HingeError(f"neck is {self.neck:g} mm: give a radius below that of the ball")
        if self.reach <= self.radius:
            raise HingeError(f"reach is {self.reach:g} mm: the neck must leave the ball")
        if not 0.0 <= self.swing < 90.0:
            raise HingeError(f"swing is {self.swing:g}: give an angle of 0 to 90 degrees")
        if slots < 0 or int(slots) != slots or slots == 1:
            raise HingeError(f"slots is {slots!r}: give 0, or a whole number of at least 2")
        self.slots = int(slots)
        room = self.clearance.radial
        hollow = self.radius + room
        at_least("wall", "the neck of a ball", self.neck, 0.5 * self.wall, "use a thicker neck")
        lean = radians(self.swing) + asin(min(1.0, (self.neck + room) / hollow))
        self.mouth, self.height = hollow * sin(lean), hollow * cos(lean)
        most = self.most_swing
        at_least(
            "cone",
            "what holds the ball in its socket",
            self.retention if lean < radians(90.0) else 0.0,
            _LEAST_RETENTION * self.radius,
            f"swing no more than {max(most, 0.0):.0f} degrees, use a thinner neck, a larger ball "
            "or less clearance",
        )

    @property
    def retention(self) -> float:
        """How much narrower the mouth is than the ball, mm of the radius."""
        return self.radius - self.mouth

    @property
    def strain(self) -> float:
        """Strain of the rim when the ball is pushed in, as a share of 1."""
        return max(0.0, self.retention) / self.mouth

    @property
    def most_swing(self) -> float:
        """Largest swing at which the mouth still holds the ball, degrees."""
        hollow = self.radius + self.clearance.radial
        widest = asin((1.0 - _LEAST_RETENTION) * self.radius / hollow)
        return degrees(widest - asin(min(1.0, (self.neck + self.clearance.radial) / hollow)))

    @property
    def ball(self) -> Part:
        """Ball and neck, with the rigid joint "ball" in its middle."""
        part = Part() + Sphere(self.radius)
        up = (Align.CENTER, Align.CENTER, Align.MIN)
        part += Cylinder(self.neck, self.reach, align=up)
        part.label = "ball"
        RigidJoint("ball", part, Location())
        return part

    @property
    def socket(self) -> Part:
        """The socket, with the ball joint "socket" in its middle."""
        hollow = self.radius + self.clearance.radial
        outer = hollow + self.wall
        part = Part() + Sphere(outer) - Sphere(hollow)
        over = (Align.CENTER, Align.CENTER, Align.MIN)
        part -= Pos(0, 0, self.height) * Box(3 * outer, 3 * outer, 2 * outer, align=over)
        for number_ in range(self.slots):
            side = (Align.MIN, Align.CENTER, Align.MIN)
            slot: Shape = Box(2 * outer, 0.15 * self.radius, 2 * outer, align=side)
            turned = Location((0, 0, 0), (0, 0, 360.0 * number_ / self.slots))
            part -= turned * slot
        part.label = "socket"
        swing = (-self.swing, self.swing)
        BallJoint("socket", part, Location(), angular_range=(swing, swing, (0, 360)))
        return part

    def __repr__(self) -> str:
        """The call that makes this joint."""
        return (
            f"BallSocket({self.radius:g}, clearance={self.clearance.radial:g}, "
            f"swing={self.swing:g}, neck={self.neck:g}, wall={self.wall:g}, slots={self.slots})"
        )
