"""What joins the knuckles of a half to one another and to the part they belong to."""

from __future__ import annotations

from dataclasses import dataclass

from .errors import HingeError
from .fit import at_least
from .shapes import Moved, Prism, Shape, Turned, box
from .train import Train

__all__ = ["Bracket", "Leaf"]


@dataclass(frozen=True)
class Bracket:
    """A square bar along the axis, inside the quadrant of its body: for hinges let into a part.

    Parameters
    ----------
    width : float, optional
        From the axis into the body across the shared face, in mm. The groove of the other half's
        knuckles and 1.2 mm of material behind it when left out.
    depth : float, optional
        From the axis into the body along the shared face, in mm; `width` when left out.
    gusset : bool
        Slope the bar's lower side at 45° down to the shared face, so that it prints without support
        inside a wall thinner than itself, in a body that stands with y up.
    """

    width: float | None = None
    depth: float | None = None
    gusset: bool = False

    def limits(self, train: Train, gap: float) -> tuple[float, float, float, float]:
        """Near and far limit across the face, near and far limit along it, in mm."""
        width = train.reach + 1.2 if self.width is None else self.width
        depth = width if self.depth is None else self.depth
        return 0.5 * gap, width, 0.5 * gap, depth

    def check(self, train: Train, gap: float, wall: float) -> None:
        """Refuse a bar that the groove would cut through.

        Raises
        ------
        FitError
            If less than `wall` (mm) of it stays behind the groove, either way.
        """
        _, width, _, depth = self.limits(train, gap)
        at_least(
            "bracket",
            "the bracket's material behind the groove",
            min(width, depth) - train.reach,
            wall,
            "use a wider and deeper bracket or a smaller barrel",
        )

    def web(self, train: Train, gap: float, side: float) -> tuple[Shape, ...]:
        """Draw the bar on one side: -1 parent, +1 child."""
        near, far, top, bottom = self.limits(train, gap)
        west, east = sorted((side * near, side * far))
        if not self.gusset:
            return (box(west, east, -bottom, -top, train.start, train.end),)
        low = -bottom - (far - near)
        corners = [(near, low), (far, -bottom), (far, -top), (near, -top)]
        if side < 0.0:
            corners = [(-x, y) for x, y in reversed(corners)]
        return (Prism(tuple(corners), train.start, train.end),)

    def drilled(self, train: Train, gap: float, side: float) -> tuple[Shape, ...]:
        """Give what is cut through it: nothing."""
        del train, gap, side
        return ()


@dataclass(frozen=True)
class Leaf:
    """A flat plate, as on a door hinge; it prints lying, flush with the bottom of the barrel.

    Parameters
    ----------
    width : float
        From the axis to the far edge in mm.
    thickness : float
        In mm.
    offset : float, optional
        From the axis down to the plate's upper face in mm; so that plate and barrel end at one
        level below when left out.
    holes : int
        Screw holes in a row along the middle of the free part of the plate.
    hole : float
        Their diameter in mm.
    sink : float
        Diameter of a 90° countersink on the upper face in mm; 0 for none.
    flat : bool
        Cut the barrels flat below, where they would overhang by more than 45°, and lay the plate's
        lower face in that plane: a hinge to print lying, without support.
    """

    width: float
    thickness: float = 2.0
    offset: float | None = None
    holes: int = 0
    hole: float = 3.4
    sink: float = 0.0
    flat: bool = False

    def limits(self, train: Train, gap: float) -> tuple[float, float, float, float]:
        """Near and far limit across the face, near and far limit along it, in mm."""
        level = train.radius * (0.5**0.5 if self.flat else 1.0)
        top = max(0.5 * gap, level - self.thickness) if self.offset is None else self.offset
        return 0.5 * gap, self.width, top, top + self.thickness

    def check(self, train: Train, gap: float, wall: float) -> None:
        """Refuse a plate too thin, too narrow for its holes, or not joined to its barrel.

        Raises
        ------
        FitError
            If the plate cannot carry its half.
        HingeError
            If hole sizes make no sense.
        """
        _, _, top, bottom = self.limits(train, gap)
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
            min(bottom, train.radius) - top,
            wall,
            "use a smaller offset",
        )
        at_least(
            "bracket",
            "the leaf's material behind the groove",
            self.width - train.reach,
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
                0.5 * (self.width - train.reach - wide),
                wall,
                "use a wider leaf or smaller holes",
            )
            at_least(
                "bracket",
                "the leaf between two screw holes",
                (train.end - train.start) / self.holes - wide,
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

    def web(self, train: Train, gap: float, side: float) -> tuple[Shape, ...]:
        """Draw the plate on one side: -1 parent, +1 child."""
        near, far, top, bottom = self.limits(train, gap)
        west, east = sorted((side * near, side * far))
        return (box(west, east, -bottom, -top, train.start, train.end),)

    def drilled(self, train: Train, gap: float, side: float) -> tuple[Shape, ...]:
        """Give the screw holes, drilled from the upper face, and what lies below a flat foot."""
        _, far, top, bottom = self.limits(train, gap)
        foot: tuple[Shape, ...] = ()
        if self.flat:
            level, wide = max(bottom, train.radius * 0.5**0.5), 1.1 * train.radius
            deep = max(level, train.radius) + 1.0
            foot = (box(-wide, wide, -deep, -level, train.start - 1.0, train.end + 1.0),)
        middle = 0.5 * side * (train.reach + far)
        radius, over = 0.5 * self.hole, 0.01
        deep = bottom - top + over
        outline = [(0.0, -over), (radius, -over), (radius, deep), (0.0, deep)]
        if self.sink > 0.0:
            wide = 0.5 * self.sink
            outline[1:2] = [(wide + over, -over), (radius, wide - radius)]
        pitch = (train.end - train.start) / max(self.holes, 1)
        drilled = tuple(
            Moved(
                Turned(tuple(outline)),
                (middle, -top, train.start + (index + 0.5) * pitch),
                (0.0, -1.0, 0.0),
                (1.0, 0.0, 0.0),
            )
            for index in range(self.holes)
        )
        return (*foot, *drilled)
