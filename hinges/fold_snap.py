"""Snaps that hold two panels at the angle to which they are folded.

Frame: the fold runs along z through the origin, the lower face of the flat sheet is y = 0, and the
upper faces come together. A lock stands on the panel at x < 0 and two sockets on the panel at
x > 0. Their round heads meet on one axis when the sheet is folded: as far from the bend on either
side, they come to lie on the plane that halves the angle. A cone on either end of the lock then
drops into a dimple of each socket, whose posts have been bent aside.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, radians, sin, sqrt, tan
from typing import TYPE_CHECKING, Final

from .clearance import number
from .exceptions import HingeError
from .fit import at_least, at_most
from .shapes import Moved, Prism, Shape, Turned

if TYPE_CHECKING:
    from build123d import Part

__all__ = ["ACROSS_LAYERS", "Bend", "FoldSnap"]

ACROSS_LAYERS: Final = 0.5
"""Posts stand upright on the bed and bend across their layers: what they bear of the strain that
the material bears along them."""

#: Corners of the round head of a post.
_CORNERS: Final = 24
#: How deep posts reach into their panel, and heads keep off the bend, in mm.
_OVER: Final = 0.2
#: Room of a cone in its dimple, normal to it, in mm.
_SNUG: Final = 0.05


@dataclass(frozen=True)
class Bend:
    """How a sheet is bent between two panels.

    Attributes
    ----------
    angle : float
        How far it is folded, in degrees.
    thickness : float
        Thickness of the sheet in mm.
    land, web : float
        Length across the fold and thickness of what bends, in mm; 0 for a seam, at which two panels
        meet in the line of their lower faces.
    """

    angle: float
    thickness: float
    land: float = 0.0
    web: float = 0.0

    @property
    def radius(self) -> float:
        """Radius of the bent web at its middle, in mm."""
        return self.land / radians(self.angle)

    @property
    def lean(self) -> float:
        """Tangent of half the angle."""
        return tan(0.5 * radians(self.angle))

    def aside(self, height: float) -> float:
        """Find where the plane that halves the angle meets a height over a flat panel.

        Parameters
        ----------
        height : float
            Above the panel's lower face, in mm.

        Returns
        -------
        float
            Distance from the middle of the fold in mm.
        """
        return 0.5 * self.land + (height - 0.5 * self.web - self.radius) * self.lean

    @property
    def outside(self) -> float:
        """How far the outer face of a folded panel lies beyond the fold's middle, in mm."""
        # Where the lower faces of both panels would meet.
        return -self.aside(0.0)


@dataclass(frozen=True)
class FoldSnap:
    """A lock between two sockets, for a sheet that folds on living hinges.

    Parameters
    ----------
    radius : float
        Radius of the round heads in mm.
    length : float
        Length of the lock along the fold in mm.
    post : float
        Thickness of a socket's post along the fold in mm; posts bend along it.
    catch : float
        How far each socket is bent aside as a cone goes in, in mm.
    clearance : float
        Distance between lock and sockets in mm.
    height : float, optional
        Height of the heads' axis above the panel in mm. When left out the lowest at which the posts
        stand clear of the bend and bear their bending.
    """

    radius: float = 2.0
    length: float = 4.0
    post: float = 1.2
    catch: float = 0.2
    clearance: float = 0.3
    height: float | None = None

    def __post_init__(self) -> None:
        """Refuse what is no length."""
        for name, value in vars(self).items():
            if value is not None and number(value, f"a fold snap's {name}") <= 0.0:
                raise HingeError(f"fold snap: {name} is {value:g} mm: give a length above 0")

    @property
    def bump(self) -> float:
        """Height of a cone in mm."""
        return self.clearance + self.catch

    @property
    def _foot(self) -> float:
        """Radius of a cone at its foot in mm."""
        return 0.6 * self.radius

    def lowest(self, bend: Bend, strain: float) -> float:
        """Find the lowest axis at which the heads meet and their posts last.

        Parameters
        ----------
        bend : Bend
            The fold.
        strain : float
            What the material bears again and again, as a share of 1.

        Returns
        -------
        float
            Height above the panel in mm.
        """
        # The foot of a post stands clear of the groove, whose side leans by half the angle.
        clear = bend.radius - 0.5 * bend.web + (self.radius + _OVER) / bend.lean
        return max(clear, sqrt(1.5 * self.post * self.catch / strain), self.radius + self.clearance)

    def rise(self, bend: Bend, strain: float) -> float:
        """Height of the heads' axis above the panel, in mm.

        Parameters
        ----------
        bend : Bend
            The fold.
        strain : float
            What the material bears again and again, as a share of 1.

        Returns
        -------
        float
            As given, or the lowest.
        """
        return self.lowest(bend, strain) if self.height is None else self.height

    def strain(self, rise: float) -> float:
        """Strain at the foot of a socket's post as a cone goes in: a cantilever, 1.5 t δ / l².

        Parameters
        ----------
        rise : float
            Height of the heads' axis above the panel in mm.

        Returns
        -------
        float
            As a share of 1.
        """
        return 1.5 * self.post * self.catch / rise**2

    def check(self, bend: Bend, strain: float, material: str) -> None:
        """Refuse a snap that would not hold, break, or stand in its bend.

        Parameters
        ----------
        bend : Bend
            The fold.
        strain : float
            What the material bears again and again, as a share of 1.
        material : str
            Its name.

        Raises
        ------
        FitError
            If a rule of fit fails; it names the rule and what to change.
        """
        rise = self.rise(bend, strain)
        at_least("wall", "the post of a socket", self.post, 0.8, "use a thicker post")
        at_least("wall", "the lock between its cones", self.length, 1.6, "use a longer lock")
        at_least(
            "retention",
            "how deep a cone drops into its dimple",
            self.catch,
            0.1,
            "use a larger catch",
        )
        at_least(
            "retention",
            "the tip of a cone",
            self._foot - self.bump,
            0.2,
            "use a larger radius, a smaller catch or a smaller clearance",
        )
        at_least(
            "wall",
            "the post behind its dimple",
            self.post - self.catch - _SNUG,
            0.4,
            "use a thicker post or a smaller catch",
        )
        lowest = bend.radius - 0.5 * bend.web + (self.radius + _OVER) / bend.lean
        at_least(
            "retention",
            "the height of the snap above its panel",
            rise,
            max(lowest, self.radius + self.clearance),
            "use a larger height, a smaller radius or a shorter land: below it the post stands in "
            "the bend",
        )
        at_most(
            "strain",
            f"the strain of a socket's post in {material}",
            100.0 * self.strain(rise),
            100.0 * strain,
            "use a larger height, a thinner post or a smaller catch",
            "%",
        )

    def parts(self, bend: Bend, material: str = "pp") -> tuple[Part, Part]:
        """Build lock and sockets, to add to two panels by hand.

        Parameters
        ----------
        bend : Bend
            The fold or seam.
        material : str
            What it is printed in: a name of :data:`hinges.living_hinge.FLEX_LIVES`.

        Returns
        -------
        lock, sockets : Part
            In the frame of the fold, the lock at x < 0.

        Raises
        ------
        FitError
            As of :meth:`check`.
        HingeError
            If the material is unknown.
        """
        from .exact_solids import build_all, build_shape, one_part, solids_of
        from .living_hinge import FLEX_LIVES

        if material.lower() not in FLEX_LIVES:
            raise HingeError(
                f"material {material!r} is unknown: use one of {', '.join(FLEX_LIVES)}"
            )
        bears = ACROSS_LAYERS * FLEX_LIVES[material.lower()].again
        self.check(bend, bears, material)
        rise = self.rise(bend, bears)
        dimples = [build_shape(shape) for shape in self.dimples(bend, rise)]
        posts = [build_shape(shape) for shape in self.sockets(bend, rise)]
        sockets = one_part([piece for post in posts for piece in solids_of(post.cut(*dimples))])
        return build_all(self.lock(bend, rise)), sockets

    def lock(self, bend: Bend, rise: float) -> tuple[Shape, ...]:
        """Draw the lock on the panel at x < 0.

        Parameters
        ----------
        bend : Bend
            The fold.
        rise : float
            Height of the heads' axis above the panel in mm.

        Returns
        -------
        tuple of Shape
            Post and cones, which overlap.
        """
        high = bend.thickness + rise
        aside, half = -bend.aside(high), 0.5 * self.length
        tip = self._foot - self.bump
        cone = Turned(
            (
                (0.0, -_OVER),
                (self._foot, -_OVER),
                (self._foot, 0.0),
                (tip, self.bump),
                (0.0, self.bump),
            )
        )
        return (
            self._post(bend, aside, high, -half, half),
            *(Moved(cone, (aside, high, up * half), (0.0, 0.0, up)) for up in (-1.0, 1.0)),
        )

    def sockets(self, bend: Bend, rise: float) -> tuple[Shape, ...]:
        """Draw the posts of both sockets on the panel at x > 0, see :meth:`lock`."""
        high = bend.thickness + rise
        near = 0.5 * self.length + self.clearance
        ends = ((-near - self.post, -near), (near, near + self.post))
        return tuple(self._post(bend, bend.aside(high), high, *pair) for pair in ends)

    def dimples(self, bend: Bend, rise: float) -> tuple[Shape, ...]:
        """Draw what is cut from both sockets for the cones, see :meth:`lock`."""
        high = bend.thickness + rise
        near, wide = 0.5 * self.length + self.clearance, _SNUG * 2.0**0.5
        mouth = self._foot - self.clearance + wide
        deep = self.catch + _SNUG
        hole = Turned(
            (
                (0.0, -_OVER),
                (mouth + _OVER, -_OVER),
                (mouth - self.catch, self.catch),
                (mouth - self.catch, deep),
                (0.0, deep),
            )
        )
        origin = bend.aside(high)
        return tuple(Moved(hole, (origin, high, up * near), (0.0, 0.0, up)) for up in (-1.0, 1.0))

    def feet(self, bend: Bend, rise: float) -> tuple[tuple[tuple[float, float, float], ...], ...]:
        """Find the corners of the feet of lock and sockets, just inside their panels.

        Parameters
        ----------
        bend : Bend
            The fold.
        rise : float
            Height of the heads' axis above the panel in mm.

        Returns
        -------
        lock, sockets : tuple of (x, y, z)
            In mm.
        """
        aside = bend.aside(bend.thickness + rise)
        far = 0.5 * self.length + self.clearance + self.post
        return tuple(
            tuple(
                (side * aside + across * self.radius, bend.thickness - 0.5 * _OVER, up * reach)
                for across in (-1.0, 1.0)
                for up in (-1.0, 1.0)
            )
            for side, reach in ((-1.0, 0.5 * self.length), (1.0, far))
        )

    def _post(self, bend: Bend, aside: float, high: float, start: float, end: float) -> Prism:
        """A post with a round head."""
        r, foot = self.radius, bend.thickness - _OVER
        arc = [pi * index / _CORNERS for index in range(_CORNERS + 1)]
        rim = [(aside + r * cos(at), high + r * sin(at)) for at in arc]
        return Prism(((aside - r, foot), (aside + r, foot), *rim), start, end)
