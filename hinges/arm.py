"""Arms that hold the knuckles of a half off its body: for axes outside of the body.

An arm is drawn in the plane across the axis. From the barrel it runs straight down by its height,
then down and aside at its angle until it meets the wall of its body. The wall is the face that
looks at the other body. It ends above at the body's top, which lies below the axis by the rise.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from math import cos, inf, radians, sin, sqrt, tan
from typing import TYPE_CHECKING, Any

import numpy as np

from .clearance import number
from .exceptions import HingeError
from .fit import at_least
from .knuckles import KnuckleLayout
from .leaf import Bracket, Leaf
from .shapes import Point, Prism, Shape, box

if TYPE_CHECKING:
    from manifold3d import CrossSection

__all__ = ["Arm", "Mount", "corner_of"]

#: What an arm keeps from the groove of its neighbours where no offset is given, in mm.
_BESIDE = 0.1
#: Larger than any arm, in mm.
_FAR = 1e3
#: Thickness of an arm over that of its barrel: its sides cut the barrel and do not just touch it.
_SLIM = 0.98
#: How far a rounding reaches into the arm, in mm.
_OVERLAP = 0.2
#: How much smaller the bar in the wall is than the foot, above and below, in mm.
_INSET = 0.05
#: Detail that an outline does not keep, in mm.
_FINE = 1e-5
#: How far from the corner the curve of a rounding is held, as a share of its reach.
_SMOOTH = 0.8
#: Points of the curve of a rounding, and the powers of its polynomials.
_POINTS = 17
_POWERS = np.arange(5)


@dataclass(frozen=True, repr=False)
class Arm:
    """Arms from the knuckles down to the wall of the body, for an axis outside of the body.

    Each half may have its own: ``leaf=(Arm(...), Arm(...))`` for the parent and the child. Bodies
    of unequal height turn about an axis halfway between their tops, see :meth:`pair`.

    Parameters
    ----------
    offset : float, optional
        Distance in mm from the axis to the wall. When left out the groove of a barrel and 0.1 mm,
        so that nothing is cut from the wall. A smaller one, below the barrel's radius too, cuts a
        groove for the other half's knuckles into it.
    rise : float
        How far the axis lies above the body's top, besides half the gap, in mm; negative below it.
    height : float, optional
        Length in mm of the upright part, from the axis down. When left out as much as the sloped
        part needs to meet the wall below its top.
    angle : float
        Angle in degrees between the sloped part and the upright direction, above 0 and up to 90.
    fill : bool
        Whether the space between arm and wall is filled, up to the axis or the body's top.
    clear_top : bool or float
        Whether what would stand above the body's top is cut away from the arm, but for its upright
        part and the barrel; a number does so within that distance in mm from the wall only.
    clip : float, optional
        Distance in mm below the axis at which the arm ends, for a body that is thinner than it.
    round_top, round_bottom : float
        How far in mm the roundings between arm and wall reach along both, above and below. Their
        curvature is continuous.
    root : float
        How deep in mm the arms reach into the wall, where a bar joins them along the axis.
    """

    offset: float | None = None
    rise: float = 0.0
    height: float | None = None
    angle: float = 45.0
    fill: bool = True
    clear_top: bool | float = False
    clip: float | None = None
    round_top: float = 0.0
    round_bottom: float = 0.0
    root: float = 0.8

    def __post_init__(self) -> None:
        """Refuse what is no length and no angle."""
        number(self.rise, "an arm's rise")
        if not 0.0 < number(self.angle, "an arm's angle") <= 90.0:
            raise HingeError(
                f"arm: angle is {self.angle:g}: give an angle above 0 and up to 90 degrees"
            )
        least = {"height": 0.0, "round_top": 0.0, "round_bottom": 0.0}
        for name in ("offset", "height", "clip", "round_top", "round_bottom", "root"):
            value = getattr(self, name)
            if value is not None and (
                number(value, f"an arm's {name}") < 0.0 or (value == 0.0 and name not in least)
            ):
                words = "of 0 or more" if name in least else "above 0"
                raise HingeError(f"arm: {name} is {value:g} mm: give a length {words}")
        if not isinstance(self.clear_top, bool) and number(self.clear_top, "clear_top") <= 0.0:
            raise HingeError(
                f"arm: clear_top is {self.clear_top:g}: give True, False or the distance from the "
                "wall in mm"
            )
        if self.round_top and (self.fill or self.clear_top is not False):
            raise HingeError(
                "arm: round_top lies where fill and clear_top work: give fill=False, and no "
                "clear_top"
            )

    def __repr__(self) -> str:
        """The call that makes this arm, without what is left at its default."""
        asked = ((each.name, getattr(self, each.name), each.default) for each in fields(self))
        more = (f"{name}={value!r}" for name, value, default in asked if value != default)
        return f"Arm({', '.join(more)})"

    @classmethod
    def pair(cls, step: float, **options: Any) -> tuple[Arm, Arm]:
        """Arms for two bodies whose tops are not level: a box, and a lower lid beside it.

        Parameters
        ----------
        step : float
            How far the parent's top is above the child's in mm, as they lie at 0°; negative where
            it is below. Folded together at 180° their tops then lie one gap apart.
        **options
            Everything of :class:`Arm` but `rise`, for both arms.

        Returns
        -------
        parent, child : Arm
            What `leaf` of :class:`hinges.SingleHinge` takes.

        Examples
        --------
        >>> parent, child = Arm.pair(26.0)
        >>> parent.rise, child.rise
        (-13.0, 13.0)
        """
        half = 0.5 * number(step, "step")
        return cls(rise=-half, **options), cls(rise=half, **options)

    def wall(self, layout: KnuckleLayout) -> float:
        """Distance from the axis to the wall, in mm."""
        return layout.groove_radius + _BESIDE if self.offset is None else self.offset

    def top(self, gap: float) -> float:
        """Height of the body's top in mm, as y in the hinge's frame."""
        return -self.rise - 0.5 * gap

    def _slope(self) -> float:
        """How far the sloped part goes aside for every mm that it falls."""
        return inf if self.angle == 90.0 else tan(radians(self.angle))

    def _along(self, layout: KnuckleLayout) -> float:
        """How far the sloped part falls on its way to the wall, in mm."""
        return self.wall(layout) / self._slope()

    def upright(self, layout: KnuckleLayout, gap: float) -> float:
        """Length of the upright part in mm: as given, or as much as is needed."""
        if self.height is not None:
            return self.height
        lean = radians(self.angle)
        over = _SLIM * layout.radius / sin(lean) + self.round_top
        # Folded, the other body's edge lies one gap beyond the top and looks at the arm's slope.
        over += gap / sin(lean) - gap
        above = -0.5 * gap if self.clear_top is not False else over
        needed = max(0.0, above - self._along(layout) - self.top(gap))
        if self.clear_top is not False and self.top(gap) < -0.5 * layout.radius:
            return max(needed, -self.top(gap))  # or the barrel would hang above what is left
        return needed

    def _ends(self, layout: KnuckleLayout, gap: float) -> tuple[float, float]:
        """Lower and upper end of the bare sloped part on the wall, y in mm."""
        middle = -self.upright(layout, gap) - self._along(layout)
        half = _SLIM * layout.radius / sin(radians(self.angle))
        return middle - half, middle + half

    def foot(self, layout: KnuckleLayout, gap: float) -> tuple[float, float]:
        """Find where the arm stands on its wall.

        Parameters
        ----------
        layout : KnuckleLayout
            The knuckles of the axis.
        gap : float
            Distance between the two bodies in mm.

        Returns
        -------
        low, high : float
            Its lower and upper end, as y in the hinge's frame, mm.
        """
        top = self.top(gap)
        low, high = self._ends(layout, gap)
        low -= self.round_bottom
        high += self.round_top
        if self.fill:
            high = max(high, min(0.0, top))
        if self.clear_top is not False:
            high = min(high, top)
        return (low if self.clip is None else max(low, -self.clip)), high

    def limits(self, layout: KnuckleLayout, gap: float) -> tuple[float, float, float, float]:
        """Find where the foot lies, as :meth:`Bracket.limits` does for its bar."""
        wall, (low, high) = self.wall(layout), self.foot(layout, gap)
        return wall, wall + self.root, -high, -low

    def check(self, layout: KnuckleLayout, gap: float, wall: float) -> None:
        """Refuse an arm that does not carry its knuckles or stands above its body.

        Parameters
        ----------
        layout : KnuckleLayout
            The knuckles of the axis.
        gap : float
            Distance between the two bodies in mm.
        wall : float
            Thinnest wall in mm.

        Raises
        ------
        FitError
            If the foot is too small or too high, a rounding is longer than the arm, or the grooves
            cut the bar that joins the arms.
        """
        lean, offset, top = radians(self.angle), self.wall(layout), self.top(gap)
        upright, half = self.upright(layout, gap), _SLIM * layout.radius / sin(lean)
        low, high = self.foot(layout, gap)
        needed = replace(self, height=None).upright(layout, gap)
        taller = f"use a height of {needed + 0.005:.2f} mm or more"
        if self.clear_top is False:
            words = "how far the arm's foot stays below the top of its body"
            at_least("arm", words, top - high, 0.0, f"{taller}, or clear_top=True")
        else:
            inner = offset if self.clear_top is True else min(offset, float(self.clear_top))
            start = offset - inner
            start = max(start, layout.radius) if upright else start
            fall = start / self._slope()
            left = min(top, half - upright - fall) + upright + fall + half
            words = "what clear_top leaves of the arm"
            if not upright:
                left = min(left, top + layout.radius)
            at_least("arm", words, left, wall, "use a taller height, or clear_top=False")
        at_least(
            "arm",
            "the foot of the arm on its wall",
            high - low,
            2.0 * wall,
            "use a deeper clip, a smaller rise or a steeper angle",
        )
        if self.clip is not None:
            at_least(
                "arm",
                "how far the arm reaches below the axis",
                self.clip - max(0.0, upright - layout.radius),
                wall,
                "use a deeper clip or a smaller height",
            )
        sloped = offset / sin(lean) - layout.radius * tan(0.5 * lean)
        for name, reach in (("round_top", self.round_top), ("round_bottom", self.round_bottom)):
            if reach:
                at_least(
                    "arm",
                    f"the length of the arm beside its {name}",
                    sloped - reach,
                    0.0,
                    f"use a smaller {name} or a larger offset",
                )
        groove = layout.groove_radius
        behind = offset + self.root - groove
        below = -sqrt(max(0.0, groove**2 - offset**2)) - low
        at_least(
            "bracket",
            "the bar in the wall, behind or below the grooves of the other half's knuckles",
            max(behind, below) if offset < groove else self.root,
            min(wall, self.root) if offset >= groove else wall,
            "use a larger offset, a deeper root or a taller height",
        )

    def section(self, layout: KnuckleLayout, gap: float) -> CrossSection:
        """Draw the arm of the child across the axis, without the barrel.

        Parameters
        ----------
        layout : KnuckleLayout
            The knuckles of the axis.
        gap : float
            Distance between the two bodies in mm.

        Returns
        -------
        manifold3d.CrossSection
            Its area, in the pose at angle 0.
        """
        from manifold3d import CrossSection

        def polygon(*points: Point) -> CrossSection:
            return CrossSection([list(points)])

        def lower(level: float) -> CrossSection:
            return polygon((-_FAR, -_FAR), (_FAR, -_FAR), (_FAR, level), (-_FAR, level))

        lean, wall, r = radians(self.angle), self.wall(layout), _SLIM * layout.radius
        upright, top = self.upright(layout, gap), self.top(gap)
        low, high = self._ends(layout, gap)
        # The arm ends inside the bar in the wall, so that no faces of the two lie in one plane.
        back = wall + 0.5 * self.root
        fall = (back - wall) / self._slope()
        middle = 0.5 * (low + high)
        across = (r * cos(lean), r * sin(lean))
        drawn = polygon(
            (-across[0], -upright - across[1]),
            (back, low - fall),
            (back, high - fall),
            (across[0], -upright + across[1]),
        )
        stem = CrossSection()
        if upright:
            elbow = r * tan(0.5 * lean)
            stem = polygon((-r, -upright), (r, -upright), (r, 0.0), (-r, 0.0))
            corner = (-r, -upright - elbow)
            drawn += polygon(
                (-r, -upright), corner, (-across[0], -upright - across[1]), (0.0, -upright)
            )
        if self.fill:
            between = polygon((0.0, 0.0), (0.0, -upright), (wall, middle))
            between += polygon((0.0, 0.0), (wall, middle), (back, middle), (back, 0.0))
            drawn += between ^ lower(min(0.0, top))
        for reach, end, up in ((self.round_bottom, low, -1.0), (self.round_top, high, 1.0)):
            if reach:
                drawn += _rounding((wall, back), end, reach, self.angle, up)
        if self.clear_top is not False:
            west = -_FAR if self.clear_top is True else wall - float(self.clear_top)
            west = max(west, r) if upright else west
            drawn -= polygon((west, top), (_FAR, top), (_FAR, _FAR), (west, _FAR))
        drawn += stem
        if self.clip is not None:
            drawn -= lower(-self.clip)
        return drawn

    def outline(self, layout: KnuckleLayout, gap: float) -> tuple[Point, ...]:
        """Corners of :meth:`section`, counter-clockwise.

        Parameters
        ----------
        layout : KnuckleLayout
            The knuckles of the axis.
        gap : float
            Distance between the two bodies in mm.

        Returns
        -------
        tuple of (x, y)
            In mm.

        Raises
        ------
        HingeError
            If the arm comes out in pieces.
        """
        rims = self.section(layout, gap).simplify(_FINE).to_polygons()
        if len(rims) != 1:
            raise HingeError(
                f"arm: clip or clear_top cuts it into {len(rims)} outlines: cut less away"
            )
        return tuple((round(float(x), 6), round(float(y), 6)) for x, y in rims[0])

    def web(self, layout: KnuckleLayout, gap: float, side: float) -> tuple[Shape, ...]:
        """Draw the arms of one half and the bar that joins them, as :meth:`Bracket.web`."""
        outline = self.outline(layout, gap)
        if side < 0.0:
            outline = tuple((-x, y) for x, y in reversed(outline))
        near, far, top, bottom = self.limits(layout, gap)
        west, east = sorted((side * near, side * far))
        owner = 0 if side < 0.0 else 1
        return (
            box(west, east, _INSET - bottom, -top - _INSET, layout.start, layout.end),
            *(
                Prism(outline, knuckle.start, knuckle.end)
                for knuckle in layout.knuckles
                if knuckle.owner == owner
            ),
        )

    def hole_cuts(self, layout: KnuckleLayout, gap: float, side: float) -> tuple[Shape, ...]:
        """Plan what is cut through the web: nothing for arms."""
        del layout, gap, side
        return ()


Mount = Bracket | Leaf | Arm
"""What joins the knuckles of a half to its body."""


def _rounding(
    wall: tuple[float, float], corner: float, reach: float, angle: float, up: float
) -> CrossSection:
    """Draw what a rounding adds between the wall and the lower or upper side of the arm.

    It is a Bézier curve of degree 4 that leaves the wall and joins the arm without curvature, and
    it reaches as deep into the wall as the arm does.
    """
    from manifold3d import CrossSection

    lean = radians(angle)
    first = (wall[0], corner + up * reach)
    last = (wall[0] - reach * sin(lean), corner + reach * cos(lean))
    ends = np.array([first, last])
    middle = np.array([wall[0], corner])
    inner = middle + _SMOOTH * (ends - middle)
    control = np.array([ends[0], inner[0], middle, inner[1], ends[1]])
    at = np.linspace(0.0, 1.0, _POINTS)[:, None]
    weights = np.array([1.0, 4.0, 6.0, 4.0, 1.0]) * (1.0 - at) ** (4 - _POWERS) * at**_POWERS
    # It overlaps the arm: outlines that share a line do not unite cleanly.
    inside = -up * _OVERLAP
    over = (last[0] + inside * cos(lean), last[1] + inside * sin(lean))
    points = [(wall[1], corner + inside), (wall[1], first[1]), *(weights @ control).tolist(), over]
    return CrossSection([points if up > 0.0 else points[::-1]])


def corner_of(mount: Mount, layout: KnuckleLayout, gap: float) -> Point:
    """Where the edge of a body lies that has this mount.

    Parameters
    ----------
    mount : Bracket, Leaf or Arm
        What joins the knuckles to the body.
    layout : KnuckleLayout
        The knuckles of the axis.
    gap : float
        Distance between the two bodies in mm.

    Returns
    -------
    aside, below : float
        Distances in mm from the axis to the face that looks at the other body, and down to the
        body's top; the latter is negative where the top lies above the axis.
    """
    if isinstance(mount, Arm):
        return mount.wall(layout), -mount.top(gap)
    if isinstance(mount, Leaf):
        return 0.5 * gap, mount.limits(layout, gap)[2]
    return 0.5 * gap, 0.5 * gap
