"""End stops and detents: where a hinge ends its turn, and where it clicks.

A stop is a heel on the child whose flat face meets the parent's face in one plane at the stop's
angle. A detent is a small cone on an end face of a parent's knuckle that drops into dimples of the
child's knuckle; between two dimples it runs in a relieved track, and over the ridges beside each
dimple it is pressed in by the interference.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import asin, cos, degrees, pi, radians, sin, sqrt

from .errors import HingeError
from .fit import at_least, at_most
from .shapes import Moved, Point, Prism, Shape, Turned
from .train import Train

__all__ = ["Detents", "Stops"]


@dataclass(frozen=True)
class Stops:
    """Heels that end the turn at the limits of its range.

    Parameters
    ----------
    lower, upper : bool
        Which ends of the range get a heel.
    reach : float, optional
        Radius of the heel in mm; 2 mm more than the groove when left out.
    """

    lower: bool = False
    upper: bool = True
    reach: float | None = None

    def radius(self, train: Train) -> float:
        """Radius of the heel in mm."""
        return train.reach + 2.0 if self.reach is None else self.reach

    def clear_angle(self, train: Train, gap: float) -> float:
        """How far from a stop (degrees) its face is one `gap` (mm) away at its nearest point."""
        return degrees(asin(min(1.0, gap / train.reach)))

    def heel(self, train: Train, angle: float, top: float, *, upper: bool) -> tuple[Shape, ...]:
        """Draw one heel in the child's pose at angle 0.

        Parameters
        ----------
        train : Train
        angle : float
            Of the stop in degrees.
        top : float
            From the axis to the faces that meet, in mm: the upper faces for the upper stop, the
            shared faces for the lower.
        upper : bool
            Which stop.

        Returns
        -------
        tuple of Shape
        """
        far = self.radius(train)
        opening = radians(180.0 - angle) if upper else radians(angle)
        # In a frame where the child's own face is y = -top and the material lies at x > 0, y < 0,
        # the heel fills the wedge from that face up to the partner's face turned back.
        first = asin(-top / far)
        last = opening - first
        count = max(2, int((last - first) / radians(10.0)) + 1)
        arc = [first + (last - first) * i / count for i in range(count + 1)]
        outline = [(0.0, -top), *((far * cos(a), far * sin(a)) for a in arc)]
        outline.append((-top * sin(opening), top * cos(opening)))
        if not upper:  # mirrored in the diagonal: the child's other face is x = +top
            outline = [(-y, -x) for x, y in outline][::-1]
        return (Prism(tuple(outline), train.start, train.end),)

    def check(self, train: Train, faces: tuple[float, float], wall: float) -> None:
        """Refuse stops that have nothing to lean on.

        Parameters
        ----------
        train : Train
        faces : (upper, lower) float
            How far the partner's faces reach from the axis, in mm.
        wall : float
            Least height of the contact in mm.

        Raises
        ------
        FitError
        """
        reaches = ((self.upper, faces[0], "upper"), (self.lower, faces[1], "lower"))
        for wanted, far, name in reaches:
            if wanted:
                at_least(
                    "stop",
                    f"the height of the face that the {name} stop leans on",
                    min(far, self.radius(train)) - train.reach,
                    wall,
                    "use a wider bracket (deeper for the lower stop) or a larger stop reach",
                )


@dataclass(frozen=True)
class Detents:
    """Angles at which the hinge clicks.

    Parameters
    ----------
    angles : tuple of float
        In degrees.
    interference : float
        How deep the bump is pressed into the ridges, in mm.
    snug : float
        Room of the bump in a dimple in mm; at the angle that is drawn (and printed) the dimple
        has the hinge's clearance instead.
    ridge : float
        Width of the ridge on either side of a dimple in degrees; the rest of the track is
        relieved.
    strain : float
        What the material bears again and again; 0.02 suits PETG, PP and nylon, 0.008 PLA.
    """

    angles: tuple[float, ...]
    interference: float = 0.1
    snug: float = 0.05
    ridge: float = 12.0
    strain: float = 0.02

    _TIP = 0.15
    _LEAN = 0.5  # radius gained per height: about 27° to the bump's own axis

    def __post_init__(self) -> None:
        """Refuse what cannot click."""
        if not self.angles or self.interference <= 0.0 or self.snug <= 0.0 or self.ridge <= 0.0:
            raise HingeError(
                "detents need at least one angle and an interference, a snug room and a ridge "
                "width above 0"
            )

    def height(self, train: Train) -> float:
        """How far the bump stands out of its face, in mm."""
        return train.clearance.axial + self.interference

    def foot(self, train: Train) -> float:
        """Radius of the bump at its foot in mm."""
        return self._TIP + self._LEAN * self.height(train)

    def _room(self, normal: float) -> float:
        """Widen a flank by `normal` mm, measured in its radius."""
        return normal * sqrt(1.0 + self._LEAN**2)

    def _dimple(self, train: Train, room: float) -> tuple[Point, ...]:
        """Draw a dimple about its own axis, which points into the face from the bump's face."""
        height, axial = self.height(train), train.clearance.axial
        wide = self._room(room)
        mouth = self.foot(train) - self._LEAN * axial + wide
        end = self._TIP + wide
        deep = height + room
        return (
            (0.0, axial - 0.05),
            (mouth + 0.05 * self._LEAN, axial - 0.05),
            (end, height),
            (end, deep),
            (0.0, deep),
        )

    def circle(self, train: Train, core: float, chamfer: float) -> float:
        """Radius of the circle on which bumps and dimples stand, in mm."""
        return 0.5 * (core + train.radius - chamfer)

    def faces(self, train: Train) -> tuple[tuple[float, float], ...]:
        """Where bumps stand: plane z and direction along z, for the first holder's end."""
        return tuple(
            (span.end, 1.0)
            for span, after in zip(train.spans, train.spans[1:], strict=False)
            if span.owner == train.holder and after.owner != train.holder
        )[:1]

    def bumps(self, train: Train, core: float, chamfer: float) -> tuple[Shape, ...]:
        """Draw the bumps on the parent, in its own direction 225°."""
        circle, height = self.circle(train, core, chamfer), self.height(train)
        outline = (
            (0.0, -0.2),
            (self.foot(train), -0.2),
            (self.foot(train), 0.0),
            (self._TIP, height),
            (0.0, height),
        )
        place = radians(225.0)
        return tuple(
            Moved(
                Turned(outline),
                (circle * cos(place), circle * sin(place), z),
                (0.0, 0.0, direction),
            )
            for z, direction in self.faces(train)
        )

    def hollows(
        self,
        train: Train,
        core: float,
        chamfer: float,
        drawn: float,
        limits: tuple[float, float],
    ) -> tuple[Shape, ...]:
        """Draw the dimples and the relieved tracks in the child's pose at angle 0."""
        circle = self.circle(train, core, chamfer)
        made: list[Shape] = []
        for z, direction in self.faces(train):
            for angle in sorted(self.angles):
                room = train.clearance.radial if abs(angle - drawn) < 1e-6 else self.snug
                place = radians(225.0 - angle)
                made.append(
                    Moved(
                        Turned(self._dimple(train, room)),
                        (circle * cos(place), circle * sin(place), z),
                        (0.0, 0.0, direction),
                    )
                )
            for first, last in self._tracks(train, circle, limits, drawn):
                made.append(self._track(train, circle, z, direction, first, last))
        return tuple(made)

    def _half_width(self, train: Train, circle: float, angle: float, drawn: float) -> float:
        """Half the angle that a dimple takes at its mouth, in degrees."""
        room = train.clearance.radial if abs(angle - drawn) < 1e-6 else self.snug
        return degrees(self._dimple(train, room)[1][0] / circle)

    def _tracks(
        self, train: Train, circle: float, limits: tuple[float, float], drawn: float
    ) -> list[tuple[float, float]]:
        """Ranges of hinge angle in which the bump runs free."""
        own = degrees(self.foot(train) / circle)
        blocks = sorted(
            (angle - side, angle + side)
            for angle in self.angles
            for side in [self._half_width(train, circle, angle, drawn) + self.ridge]
        )
        first = limits[0] - own
        tracks = []
        for low, high in [*blocks, (limits[1] + own, limits[1] + own)]:
            if low - first > 2.0:
                tracks.append((first, low))
            first = max(first, high)
        return tracks

    def _track(
        self, train: Train, circle: float, z: float, direction: float, first: float, last: float
    ) -> Shape:
        room = train.clearance.axial
        deep = self.height(train) + room
        half = self.foot(train) + self._room(room)
        outline = [(circle - half, z), (circle + half, z)]
        outline += [(circle + half, z + direction * deep), (circle - half, z + direction * deep)]
        return Turned(tuple(outline), 225.0 - last, last - first)

    def check(
        self, train: Train, core: float, chamfer: float, web: float, limits: tuple[float, float]
    ) -> None:
        """Refuse detents that do not fit or that break the hinge.

        Parameters
        ----------
        train : Train
        core : float
            Widest radius that the pin takes, in mm.
        chamfer : float
            Of the barrel ends in mm.
        web : float
            Thickness in mm of the bracket behind the groove.
        limits : (low, high)
            Range of the hinge in degrees.

        Raises
        ------
        FitError
        """
        at_least(
            "detent",
            "the free ring on the end face of a barrel",
            train.radius - chamfer - core,
            2.0 * self.foot(train),
            "use a wider barrel, a thinner pin, less interference or a smaller clearance",
        )
        for angle in self.angles:
            at_least("detent", "a detent's angle", angle, limits[0], "move it into the range", "°")
            at_most("detent", "a detent's angle", angle, limits[1], "move it into the range", "°")
        bridge = min(span.length for span in train.spans if span.owner != train.holder)
        bridge += 2.0 * train.clearance.axial
        lever = train.radius
        at_most(
            "strain",
            "the strain of the bracket as the bump is pressed over its ridge",
            100.0 * web * 0.5 * self.interference / (lever * bridge),
            100.0 * self.strain,
            "use less interference, longer knuckles or a tougher material",
            "%",
        )

    def overlap(self, train: Train) -> float:
        """Volume in mm³ that one bump is pressed into a ridge."""
        deep = self.interference
        foot = self._TIP + self._LEAN * deep
        return pi * deep / 3.0 * (foot**2 + foot * self._TIP + self._TIP**2)
