"""What joins the knuckles of a half to one another and to the part they belong to."""

from __future__ import annotations

from dataclasses import dataclass

from .exceptions import HingeError
from .fit import at_least
from .knuckles import KnuckleLayout
from .shapes import Moved, Prism, Shape, Turned, box

__all__ = ["Bracket", "Leaf", "flat_foot", "flat_level"]


def flat_level(layout: KnuckleLayout) -> float:
    """How far below the axis a barrel begins to overhang by less than 45°, in mm.

    Parameters
    ----------
    layout : KnuckleLayout
        The knuckles of the axis.

    Returns
    -------
    float
        Distance in mm.
    """
    return float(layout.radius * 0.5**0.5)


def flat_foot(layout: KnuckleLayout, bottom: float) -> tuple[Shape, ...]:
    """Plan what is cut from barrels that lie on the bed.

    Parameters
    ----------
    layout : KnuckleLayout
        The knuckles of the axis.
    bottom : float
        How far below the axis the lower face of what they stand on lies, in mm.

    Returns
    -------
    tuple of Shape
        What lies below the flat foot.
    """
    level, wide = max(bottom, flat_level(layout)), 1.1 * layout.radius
    deep = max(level, layout.radius) + 1.0
    return (box(-wide, wide, -deep, -level, layout.start - 1.0, layout.end + 1.0),)


@dataclass(frozen=True)
class Bracket:
    """A square bar along the axis, inside the quadrant of its body: for hinges let into a part.

    Parameters
    ----------
    width : float, optional
        Distance in mm from the axis into the body, across the shared face. When left out the groove
        of the other half's knuckles and 1.2 mm of material behind it.
    depth : float, optional
        Distance in mm from the axis into the body, along the shared face; `width` when left out.
    gusset : bool
        Whether the bar's lower side slopes at 45° down to the shared face, so that it prints
        without support inside a wall thinner than itself, in a body that stands with y up.
    flat : bool
        Whether the barrels are cut flat below, where they would overhang by more than 45°, for
        plates that print lying. Without `depth` the bar ends in that plane, 0.71 radii below the
        axis: the lower face of plates that thick.
    """

    width: float | None = None
    depth: float | None = None
    gusset: bool = False
    flat: bool = False

    def __post_init__(self) -> None:
        """Refuse a slope below a flat foot."""
        if self.flat and self.gusset:
            raise HingeError("bracket: a flat one lies on the bed and has no gusset: give one")

    def limits(self, layout: KnuckleLayout, gap: float) -> tuple[float, float, float, float]:
        """Find where the web lies.

        Parameters
        ----------
        layout : KnuckleLayout
            The knuckles of the axis.
        gap : float
            Distance between the two bodies in mm.

        Returns
        -------
        near, far, top, bottom : float
            Distances from the axis in mm: of its two ends across the shared face, and of its upper
            and lower face along it.
        """
        width = layout.groove_radius + 1.2 if self.width is None else self.width
        depth = self.depth
        if depth is None:
            depth = flat_level(layout) if self.flat else width
        return 0.5 * gap, width, 0.5 * gap, depth

    def check(self, layout: KnuckleLayout, gap: float, wall: float) -> None:
        """Refuse a bar that the groove would cut through.

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
            If less than a wall of it stays behind the groove, either way.
        """
        _, width, top, depth = self.limits(layout, gap)
        behind = width if self.flat else min(width, depth)
        at_least(
            "bracket",
            "the bracket's material behind the groove",
            behind - layout.groove_radius,
            wall,
            "use a wider and deeper bracket or a smaller barrel",
        )
        if self.flat:
            at_least(
                "bracket",
                "the thickness of a flat bracket",
                depth - top,
                wall,
                "use a deeper bracket, a wider barrel or a smaller gap",
            )

    def web(self, layout: KnuckleLayout, gap: float, side: float) -> tuple[Shape, ...]:
        """Draw the bar of one half.

        Parameters
        ----------
        layout : KnuckleLayout
            The knuckles of the axis.
        gap : float
            Distance between the two bodies in mm.
        side : float
            -1 for the parent's half, 1 for the child's.

        Returns
        -------
        tuple of Shape
            What joins the knuckles of the half, in mm.
        """
        near, far, top, bottom = self.limits(layout, gap)
        west, east = sorted((side * near, side * far))
        if not self.gusset:
            return (box(west, east, -bottom, -top, layout.start, layout.end),)
        low = -bottom - (far - near)
        corners = [(near, low), (far, -bottom), (far, -top), (near, -top)]
        if side < 0.0:
            corners = [(-x, y) for x, y in reversed(corners)]
        return (Prism(tuple(corners), layout.start, layout.end),)

    def hole_cuts(self, layout: KnuckleLayout, gap: float, side: float) -> tuple[Shape, ...]:
        """Plan what is cut through the web.

        Parameters
        ----------
        layout : KnuckleLayout
            The knuckles of the axis.
        gap : float
            Distance between the two bodies in mm.
        side : float
            -1 for the parent's half, 1 for the child's.

        Returns
        -------
        tuple of Shape
            What lies below a flat foot; otherwise nothing.
        """
        del side
        return flat_foot(layout, self.limits(layout, gap)[3]) if self.flat else ()


@dataclass(frozen=True)
class Leaf:
    """A flat plate, as on a door hinge; it prints lying, flush with the bottom of the barrel.

    Parameters
    ----------
    width : float
        Distance from the axis to the far edge in mm.
    thickness : float
        Thickness of the plate in mm.
    offset : float, optional
        Distance from the axis down to the plate's upper face in mm. When left out, plate and barrel
        end at one level below.
    holes : int
        Number of screw holes in a row along the middle of the free part of the plate.
    hole : float
        Diameter of the holes in mm.
    sink : float
        Diameter of a 90° countersink on the upper face in mm; 0 for none.
    flat : bool
        Whether the barrels are cut flat below, where they would overhang by more than 45°, with the
        plate's lower face in that plane: a hinge to print lying, without support.
    """

    width: float
    thickness: float = 2.0
    offset: float | None = None
    holes: int = 0
    hole: float = 3.4
    sink: float = 0.0
    flat: bool = False

    def limits(self, layout: KnuckleLayout, gap: float) -> tuple[float, float, float, float]:
        """Find where the plate lies, as :meth:`Bracket.limits` does."""
        level = flat_level(layout) if self.flat else layout.radius
        top = max(0.5 * gap, level - self.thickness) if self.offset is None else self.offset
        return 0.5 * gap, self.width, top, top + self.thickness

    def check(self, layout: KnuckleLayout, gap: float, wall: float) -> None:
        """Refuse a plate too thin, too narrow for its holes, or not joined to its barrel.

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
            If the plate cannot carry its half.
        HingeError
            If hole sizes make no sense.
        """
        _, _, top, bottom = self.limits(layout, gap)
        at_least("bracket", "the thickness of the leaf", self.thickness, wall, "use a thicker leaf")
        at_least(
            "bracket",
            "the height of the leaf's upper face below the axis",
            top,
            0.5 * gap,
            "use a larger offset or a smaller gap",
        )
        at_least(
            "bracket",
            "the thickness of leaf that meets the barrel",
            min(bottom, layout.radius) - top,
            wall,
            "use a smaller offset",
        )
        at_least(
            "bracket",
            "the leaf's material behind the groove",
            self.width - layout.groove_radius,
            2.0 * wall,
            "use a wider leaf or a smaller barrel",
        )
        if self.holes:
            if self.hole <= 0.0 or self.holes < 0 or 0.0 < self.sink <= self.hole:
                raise HingeError(
                    f"leaf: {self.holes} holes of {self.hole:g} mm with a countersink of "
                    f"{self.sink:g} mm; the countersink must be wider than the hole, or 0"
                )
            wide = max(self.hole, self.sink)
            at_least(
                "bracket",
                "the leaf beside a screw hole",
                0.5 * (self.width - layout.groove_radius - wide),
                wall,
                "use a wider leaf or smaller holes",
            )
            at_least(
                "bracket",
                "the leaf between two screw holes",
                (layout.end - layout.start) / self.holes - wide,
                wall,
                "use fewer or smaller holes",
            )
            at_least(
                "bracket",
                "the leaf below a countersink",
                self.thickness - max(0.0, 0.5 * (self.sink - self.hole)),
                0.4,
                "use a thicker leaf or a smaller countersink",
            )

    def web(self, layout: KnuckleLayout, gap: float, side: float) -> tuple[Shape, ...]:
        """Draw the plate of one half, as :meth:`Bracket.web` does its bar."""
        near, far, top, bottom = self.limits(layout, gap)
        west, east = sorted((side * near, side * far))
        return (box(west, east, -bottom, -top, layout.start, layout.end),)

    def hole_cuts(self, layout: KnuckleLayout, gap: float, side: float) -> tuple[Shape, ...]:
        """Plan the screw holes, drilled from the upper face, and what lies below a flat foot."""
        _, far, top, bottom = self.limits(layout, gap)
        foot = flat_foot(layout, bottom) if self.flat else ()
        middle = 0.5 * side * (layout.groove_radius + far)
        radius, over = 0.5 * self.hole, 0.01
        deep = bottom - top + over
        outline = [(0.0, -over), (radius, -over), (radius, deep), (0.0, deep)]
        if self.sink > 0.0:
            wide = 0.5 * self.sink
            outline[1:2] = [(wide + over, -over), (radius, wide - radius)]
        pitch = (layout.end - layout.start) / max(self.holes, 1)
        drilled = tuple(
            Moved(
                Turned(tuple(outline)),
                (middle, -top, layout.start + (index + 0.5) * pitch),
                (0.0, -1.0, 0.0),
                (1.0, 0.0, 0.0),
            )
            for index in range(self.holes)
        )
        return (*foot, *drilled)
