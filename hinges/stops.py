"""End stops and detents: where a hinge ends its turn, and where it clicks.

A stop is a lug on the child whose flat face meets the parent's face in one plane at the stop's
angle. A detent is a pair of small cones on the two end faces of the parent that look at one
knuckle of the child. They drop into dimples of that knuckle; between two dimples they run in
relieved tracks, and over the ridges beside each dimple they are pressed in by the interference.
Since they stand at both ends, the child cannot slip aside by its axial play: what one gains the
other loses.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import asin, cos, degrees, radians, sin, sqrt
from typing import ClassVar

from .clearance import number
from .exceptions import FitError, HingeError
from .fit import at_least, at_most
from .knuckles import Knuckle, KnuckleLayout
from .shapes import Moved, Point, Prism, Shape, Turned

__all__ = ["Detents", "Stops"]


@dataclass(frozen=True)
class Stops:
    """Lugs that end the turn at the limits of its range.

    Parameters
    ----------
    lower, upper : bool
        Whether the lower and the upper end of the range get a lug.
    reach : float, optional
        Radius of the lug about the axis in mm; 2 mm more than the groove when left out.
    """

    lower: bool = False
    upper: bool = True
    reach: float | None = None

    def radius(self, layout: KnuckleLayout) -> float:
        """Find how far a lug reaches.

        Parameters
        ----------
        layout : KnuckleLayout
            The knuckles of the axis.

        Returns
        -------
        float
            Radius about the axis in mm.
        """
        return layout.groove_radius + 2.0 if self.reach is None else self.reach

    def clear_angle(self, layout: KnuckleLayout, gap: float) -> float:
        """Find the turn off a stop at which its face is one gap away at its nearest point.

        Parameters
        ----------
        layout : KnuckleLayout
            The knuckles of the axis.
        gap : float
            Distance between the two bodies in mm.

        Returns
        -------
        float
            Angle in degrees.
        """
        return degrees(asin(min(1.0, gap / layout.groove_radius)))

    def lug(
        self, layout: KnuckleLayout, angle: float, top: float, *, upper: bool
    ) -> tuple[Shape, ...]:
        """Draw one lug in the child's pose at angle 0.

        Parameters
        ----------
        layout : KnuckleLayout
            The knuckles of the axis.
        angle : float
            Angle of the stop in degrees.
        top : float
            Distance in mm from the axis to the faces that meet: the upper faces for the upper stop,
            the shared faces for the lower.
        upper : bool
            Whether it is the upper stop.

        Returns
        -------
        tuple of Shape
            The lug, as long as the row of knuckles.
        """
        far = self.radius(layout)
        opening = radians(180.0 - angle) if upper else radians(angle)
        # In a frame where the child's own face is y = -top and the material lies at x > 0, y < 0,
        # the lug fills the wedge from that face up to the partner's face turned back.
        first = asin(-top / far)
        last = opening - first
        count = max(2, int((last - first) / radians(10.0)) + 1)
        arc = [first + (last - first) * i / count for i in range(count + 1)]
        outline = [(0.0, -top), *((far * cos(a), far * sin(a)) for a in arc)]
        outline.append((-top * sin(opening), top * cos(opening)))
        if not upper:  # mirrored in the diagonal: the child's other face is x = +top
            outline = [(-y, -x) for x, y in outline][::-1]
        return (Prism(tuple(outline), layout.start, layout.end),)

    def check(self, layout: KnuckleLayout, faces: tuple[float, float], wall: float) -> None:
        """Refuse stops that have nothing to lean on.

        Parameters
        ----------
        layout : KnuckleLayout
            The knuckles of the axis.
        faces : (float, float)
            How far the parent's upper and shared face reach from the axis, in mm.
        wall : float
            Least height of the contact in mm.

        Raises
        ------
        FitError
            If less than that of a face meets the lug.
        """
        reaches = ((self.upper, faces[0], "upper"), (self.lower, faces[1], "lower"))
        for wanted, far, name in reaches:
            if wanted:
                at_least(
                    "stop",
                    f"the height of the face that the {name} stop leans on",
                    min(far, self.radius(layout)) - layout.groove_radius,
                    wall,
                    "use a wider bracket (deeper for the lower stop) or a larger stop reach",
                )


@dataclass(frozen=True)
class Detents:
    """Angles at which the hinge clicks.

    Parameters
    ----------
    angles : float or tuple of float
        Where it clicks, in degrees.
    interference : float
        How deep the bump at each end is pressed in over the ridges, in mm.
    snug : float
        Room of a bump in a dimple in mm; at the angle that is drawn (and printed) the dimple has
        the hinge's clearance instead.
    ridge : float
        Width of the ridge on either side of a dimple in degrees; the rest of the track is
        relieved. 360 leaves no track: the hinge then drags all the way.
    strain : float
        Strain, as a share of 1, that the material bears again and again; 0.02 suits PETG, PP and
        nylon, 0.008 PLA.
    width : float
        Width of a bump halfway up, in mm: two widths of the nozzle at least.
    """

    angles: tuple[float, ...]
    interference: float = 0.07
    snug: float = 0.05
    ridge: float = 12.0
    strain: float = 0.02
    width: float = 0.8

    _LEAN: ClassVar[float] = 0.5  # radius gained per height: about 27° to the bump's own axis
    #: Where bumps stand on the parent: outwards, far from its body, where a knuckle gives most.
    _PLACE: ClassVar[float] = 45.0
    #: Of plastics; of a rectangular section.
    _POISSON: ClassVar[float] = 0.35
    _SHEAR: ClassVar[float] = 1.2

    def __post_init__(self) -> None:
        """Refuse what cannot click; a single angle is one of several."""
        angles = self.angles if isinstance(self.angles, (tuple, list)) else (self.angles,)
        read = tuple(number(angle, "a detent's angle") for angle in angles)
        object.__setattr__(self, "angles", read)
        sizes = (self.interference, self.snug, self.ridge, self.strain, self.width)
        if not read or min(number(size, "a detent's size") for size in sizes) <= 0.0:
            raise HingeError(
                "detents need at least one angle, and an interference, a snug room, a ridge width, "
                "a strain and a bump's width above 0"
            )

    def _height(self, layout: KnuckleLayout) -> float:
        """How far a bump stands out of its face, in mm."""
        return layout.clearance.axial + self.interference

    def _tip(self, layout: KnuckleLayout) -> float:
        """Radius of a bump at its tip in mm."""
        return 0.5 * self.width - 0.5 * self._LEAN * self._height(layout)

    def _foot(self, layout: KnuckleLayout) -> float:
        """Radius of a bump at its foot in mm."""
        return 0.5 * self.width + 0.5 * self._LEAN * self._height(layout)

    def _room(self, normal: float) -> float:
        """Widen a flank by `normal` mm, measured in its radius."""
        return normal * sqrt(1.0 + self._LEAN**2)

    def _dimple(self, layout: KnuckleLayout, room: float) -> tuple[Point, ...]:
        """Draw a dimple about its own axis, which points into the face from the bump's face."""
        height, axial = self._height(layout), layout.clearance.axial
        wide = self._room(room)
        mouth = self._foot(layout) - self._LEAN * axial + wide
        end = self._tip(layout) + wide
        deep = height + room
        return (
            (0.0, axial - 0.05),
            (mouth + 0.05 * self._LEAN, axial - 0.05),
            (end, height),
            (end, deep),
            (0.0, deep),
        )

    def _pitch_radius(self, layout: KnuckleLayout, core: float, chamfer: float) -> float:
        """Radius of the circle on which bumps and dimples stand, in mm."""
        return 0.5 * (core + layout.radius - chamfer)

    @staticmethod
    def _held(layout: KnuckleLayout) -> tuple[Knuckle, Knuckle, Knuckle] | None:
        """The first knuckle of the child between two of the parent's, and those."""
        rows = zip(layout.knuckles, layout.knuckles[1:], layout.knuckles[2:], strict=False)
        for before, held, after in rows:
            if held.owner != layout.pin_owner == before.owner == after.owner:
                return before, held, after
        return None

    def _faces(self, layout: KnuckleLayout) -> tuple[tuple[float, float], ...]:
        """Where bumps stand: plane z and direction along z, at both ends of one knuckle."""
        row = self._held(layout)
        return () if row is None else ((row[0].end, 1.0), (row[2].start, -1.0))

    def _moved(self, shape: Shape, circle: float, turn: float, face: tuple[float, float]) -> Moved:
        place, (z, direction) = radians(turn), face
        return Moved(shape, (circle * cos(place), circle * sin(place), z), (0.0, 0.0, direction))

    def bumps(self, layout: KnuckleLayout, core: float, chamfer: float) -> tuple[Shape, ...]:
        """Draw the bumps on the parent.

        Parameters
        ----------
        layout : KnuckleLayout
            The knuckles of the axis.
        core : float
            Largest radius that the pin takes, in mm.
        chamfer : float
            Leg of the chamfer on the ends of barrels in mm.

        Returns
        -------
        tuple of Shape
            What to add to the parent's half.
        """
        circle, height = self._pitch_radius(layout, core, chamfer), self._height(layout)
        outline = (
            (0.0, -0.2),
            (self._foot(layout), -0.2),
            (self._foot(layout), 0.0),
            (self._tip(layout), height),
            (0.0, height),
        )
        return tuple(
            self._moved(Turned(outline), circle, self._PLACE, face) for face in self._faces(layout)
        )

    def dimple_cuts(
        self,
        layout: KnuckleLayout,
        core: float,
        chamfer: float,
        drawn: float,
        limits: tuple[float, float],
    ) -> tuple[Shape, ...]:
        """Draw the dimples and the relieved tracks in the child's pose at angle 0.

        Parameters
        ----------
        layout : KnuckleLayout
            The knuckles of the axis.
        core : float
            Largest radius that the pin takes, in mm.
        chamfer : float
            Leg of the chamfer on the ends of barrels in mm.
        drawn : float
            Angle in degrees at which the hinge is drawn and printed.
        limits : (float, float)
            Lowest and highest angle of the hinge in degrees.

        Returns
        -------
        tuple of Shape
            What to cut from the child's half.
        """
        circle = self._pitch_radius(layout, core, chamfer)
        made: list[Shape] = []
        for face in self._faces(layout):
            for angle in sorted(self.angles):
                room = layout.clearance.radial if abs(angle - drawn) < 1e-6 else self.snug
                dimple = Turned(self._dimple(layout, room))
                made.append(self._moved(dimple, circle, self._PLACE - angle, face))
            for first, last in self._tracks(layout, circle, limits, drawn):
                made.append(self._track(layout, circle, face, first, last))
        return tuple(made)

    def _half_width(
        self, layout: KnuckleLayout, circle: float, angle: float, drawn: float
    ) -> float:
        """Half the angle that a dimple takes at its mouth, in degrees."""
        room = layout.clearance.radial if abs(angle - drawn) < 1e-6 else self.snug
        return degrees(self._dimple(layout, room)[1][0] / circle)

    def _tracks(
        self, layout: KnuckleLayout, circle: float, limits: tuple[float, float], drawn: float
    ) -> list[tuple[float, float]]:
        """Ranges of hinge angle in which the bumps run free."""
        own = degrees((self._foot(layout) + self._room(layout.clearance.axial)) / circle)
        blocks = sorted(
            (angle - side, angle + side)
            for angle in self.angles
            for side in [self._half_width(layout, circle, angle, drawn) + self.ridge]
        )
        first = limits[0] - own
        tracks = []
        for low, high in [*blocks, (limits[1] + own, limits[1] + own)]:
            if low - first > 2.0:
                tracks.append((first, low))
            first = max(first, high)
        return tracks

    def _track(
        self,
        layout: KnuckleLayout,
        circle: float,
        face: tuple[float, float],
        first: float,
        last: float,
    ) -> Shape:
        room, (z, direction) = layout.clearance.axial, face
        deep = self._height(layout) + room
        half = self._foot(layout) + self._room(room)
        low, high = sorted((z, z + direction * deep))
        inner, outer = circle - half, circle + half
        outline = ((inner, low), (outer, low), (outer, high), (inner, high))
        return Turned(outline, self._PLACE - last, last - first)

    def strain_at(self, layout: KnuckleLayout, core: float, chamfer: float, gap: float) -> float:
        """Strain where a knuckle stands on its body, as its bump is pressed over a ridge.

        Both neighbours of the child's knuckle give way by the interference. Each is a short beam on
        its body, as high as its bump is above it and as deep as it is long, bent along the axis:
        a part of the way is bending and the rest is shear (Timoshenko).

        Parameters
        ----------
        layout : KnuckleLayout
            The knuckles of the axis.
        core, chamfer : float
            As for :meth:`bumps`.
        gap : float
            Distance between the two bodies in mm.

        Returns
        -------
        float
            Equivalent strain (von Mises) as a share of 1.
        """
        row = self._held(layout)
        if row is None:
            return 0.0
        high = self._pitch_radius(layout, core, chamfer) + gap * sqrt(0.5)
        deep = min(row[0].length, row[2].length)
        bent = 4.0 * (high / deep) ** 3
        sheared = self._SHEAR * 2.0 * (1.0 + self._POISSON) * high / deep
        share = bent / (bent + sheared)
        stretch = 1.5 * share * self.interference * deep / high**2
        shear = (1.0 - share) * self.interference / high
        return sqrt(stretch**2 + shear**2 / 3.0)

    def check(
        self,
        layout: KnuckleLayout,
        core: float,
        chamfer: float,
        gap: float,
        wall: float,
        limits: tuple[float, float],
    ) -> None:
        """Refuse detents that do not fit or that break the hinge.

        Parameters
        ----------
        layout : KnuckleLayout
            The knuckles of the axis.
        core : float
            Largest radius that the pin takes, in mm.
        chamfer : float
            Leg of the chamfer on the ends of barrels in mm.
        gap : float
            Distance between the two bodies in mm.
        wall : float
            Thinnest wall in mm.
        limits : (float, float)
            Lowest and highest angle of the hinge in degrees.

        Raises
        ------
        FitError
            If no knuckle of the child stands between two of the parent's, a bump is too wide for
            its barrel or has no tip, an angle lies outside the range, or a knuckle is bent too far.
        """
        row = self._held(layout)
        if row is None:
            raise FitError(
                "detent",
                "the number of knuckles of a hinge that clicks",
                len(layout.knuckles),
                3,
                "use 3 knuckles or more: one of the child's has to stand between two of the "
                "parent's, or it slips aside by its play",
                "",
            )
        at_least(
            "detent",
            "the radius of a bump's tip",
            self._tip(layout),
            0.1,
            "use a wider bump, less interference or a smaller clearance",
        )
        at_least(
            "detent",
            "the free ring on the end face of a barrel",
            layout.radius - chamfer - core,
            2.0 * self._foot(layout),
            "use a wider barrel, a thinner pin, less interference or a smaller clearance",
        )
        deep = self.interference + max(layout.clearance.radial, layout.clearance.axial)
        at_least(
            "web",
            "the material between the dimples of a knuckle",
            row[1].length - 2.0 * deep,
            wall,
            "use fewer knuckles or a longer edge",
        )
        for angle in self.angles:
            at_least("detent", "a detent's angle", angle, limits[0], "move it into the range", "°")
            at_most("detent", "a detent's angle", angle, limits[1], "move it into the range", "°")
        at_most(
            "strain",
            "the strain of the knuckles as a bump is pressed over its ridge",
            100.0 * self.strain_at(layout, core, chamfer, gap),
            100.0 * self.strain,
            "use less interference, a wider barrel or a tougher material",
            "%",
        )
