"""Lines in a flat plate: folds that bend, and seams at which edges meet."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, radians, sin
from typing import Any

from build123d import Location, Part, Plane, Pos, Rot, Vector

from .clearance import number
from .exact_solids import build_shape, one_part
from .exceptions import HingeError
from .fold_snap import Bend
from .shapes import Prism, Shape, Turned, box

__all__ = ["FoldLine", "Line", "bevel", "frame_of", "line_words", "read_line", "web_strip"]

Line = tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True)
class FoldLine:
    """A fold line and the panels on both sides of it.

    Attributes
    ----------
    frame : Location
        Its frame: x across it, y up, z along.
    bend : Bend
        How it is folded.
    length : float
        Its length in mm.
    panels : (int, int)
        Numbers of the panels at -x and +x.
    """

    frame: Location
    bend: Bend
    length: float
    panels: tuple[int, int]

    def turned(self, share: float) -> Location:
        """Where the panel at +x comes to lie, in the frame of the fold and the panel at -x.

        Parameters
        ----------
        share : float
            How far it is folded, as a share of its angle.

        Returns
        -------
        Location
            The panel's move.
        """
        if share == 0.0:
            return Location()
        bend = replace(self.bend, angle=share * self.bend.angle)
        angle, half, middle = radians(bend.angle), 0.5 * bend.land, 0.5 * bend.web
        end = Pos(bend.radius * sin(angle) - half, middle + bend.radius * (1.0 - cos(angle)))
        return end * Rot(0, 0, bend.angle) * Pos(-half, -middle)

    def web(self, share: float) -> Part:
        """Draw the bent web, in the frame of the fold and the panel at -x.

        Parameters
        ----------
        share : float
            How far it is folded, as a share of its angle, above 0.

        Returns
        -------
        Part
            The web.
        """
        bend, half = replace(self.bend, angle=share * self.bend.angle), 0.5 * self.length
        inner, outer = bend.radius - 0.5 * bend.web, bend.radius + 0.5 * bend.web
        rim = ((inner, -half), (outer, -half), (outer, half), (inner, half))
        centre = Pos(-0.5 * bend.land, 0.5 * bend.web + bend.radius)
        return one_part([build_shape(Turned(rim, -90.0, bend.angle)).moved(centre)])


def read_line(line: Any) -> tuple[Vector, Vector]:
    """Read both ends of a line.

    Parameters
    ----------
    line : ((float, float), (float, float))
        As the user gave it, in mm.

    Returns
    -------
    start, end : Vector
        On z = 0.

    Raises
    ------
    HingeError
        If these are not two points apart.
    """
    try:
        (ax, ay), (bx, by) = line
    except (TypeError, ValueError) as error:
        raise HingeError(
            f"a line is {line!r}: give both its ends, such as ((0, 0), (0, 40))"
        ) from error
    start, end = (
        Vector(number(x, "x of a line"), number(y, "y of a line"), 0.0)
        for x, y in ((ax, ay), (bx, by))
    )
    if (end - start).length < 1e-6:
        raise HingeError(f"the line {line_words((start, end))} has no length")
    return start, end


def line_words(line: tuple[Vector, Vector]) -> str:
    """Name a line in a message.

    Parameters
    ----------
    line : (Vector, Vector)
        Both its ends.

    Returns
    -------
    str
        Where it runs.
    """
    ends = " to ".join(f"({end.X:g}, {end.Y:g})" for end in line)
    return f"from {ends}"


def frame_of(start: Vector, end: Vector) -> Location:
    """Lay a line's frame: z along it, y up, x across it.

    Parameters
    ----------
    start, end : Vector
        Both its ends.

    Returns
    -------
    Location
        The frame in its middle.
    """
    along, up = (end - start).normalized(), Vector(0, 0, 1)
    return Plane(origin=(start + end) * 0.5, x_dir=up.cross(along), z_dir=along).location


def web_strip(land: float, web: float, length: float) -> Shape:
    """Draw what a web takes of the plate, in the frame of its line.

    Parameters
    ----------
    land, web, length : float
        Its sizes across, up and along, in mm.

    Returns
    -------
    Shape
        A box, a little larger.
    """
    half = 0.5 * length + 0.02
    return box(-0.5 * land, 0.5 * land, -1.0, web + 0.01, -half, half)


def bevel(bend: Bend, half: float, length: float, side: float) -> Shape:
    """Draw what an edge of a seam loses, in the frame of its line.

    Parameters
    ----------
    bend : Bend
        The seam.
    half : float
        Distance in mm that the edge keeps from the plane that halves the angle.
    length : float
        Length of the seam in mm.
    side : float
        1 where the panel is at -x, -1 where it is at +x.

    Returns
    -------
    Shape
        What to cut.
    """
    far, over = 4.0 * bend.thickness + 10.0, 1.0
    back = half * (1.0 + bend.lean**2) ** 0.5
    low, high = -over, bend.thickness + over
    outline = (
        (-back - low * bend.lean, low),
        (far, low),
        (far, high),
        (-back - high * bend.lean, high),
    )
    if side < 0.0:
        outline = tuple((-x, y) for x, y in reversed(outline))  # type: ignore[assignment]
    return Prism(outline, -0.5 * length - over, 0.5 * length + over)
