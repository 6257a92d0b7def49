"""Shapes as data, so that exact solids and meshes come from the same numbers."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, radians, sin

__all__ = [
    "Blank",
    "Bored",
    "Bounds",
    "HalfPlan",
    "Moved",
    "Point",
    "Prism",
    "Shape",
    "Turned",
    "bounds",
    "box",
    "cylinder",
    "meet",
    "regular",
    "teardrop",
]

Point = tuple[float, float]
Vector = tuple[float, float, float]
#: Boxes that share less than this, in mm, only touch.
_TOUCH = 1e-6
#: Lowest and highest x, y and z in mm.
Bounds = tuple[tuple[float, float], tuple[float, float], tuple[float, float]]


@dataclass(frozen=True)
class Turned:
    """A closed (radius, z) outline turned about the z axis.

    Attributes
    ----------
    outline : tuple of (radius, z)
        Corners in mm, at least three corners, all radii at or above 0.
    begin, turn : float
        First direction and angle of the turn in degrees, counter-clockwise from +x.
    """

    outline: tuple[Point, ...]
    begin: float = 0.0
    turn: float = 360.0


@dataclass(frozen=True)
class Prism:
    """A closed (x, y) outline drawn out along z.

    Attributes
    ----------
    outline : tuple of (x, y)
        Corners in mm, counter-clockwise.
    start, end : float
        z of the two flat ends in mm.
    holes : tuple of outlines
        Corners in mm of holes inside the outline, clear of one another.
    """

    outline: tuple[Point, ...]
    start: float
    end: float
    holes: tuple[tuple[Point, ...], ...] = ()


@dataclass(frozen=True)
class Moved:
    """A shape laid into another frame.

    Attributes
    ----------
    shape : Shape
        The shape in its own frame.
    origin : (x, y, z)
        Where the shape's origin goes, in mm.
    z_dir, x_dir : (x, y, z)
        Where its z and x axes point; unit vectors at right angles.
    """

    shape: Shape
    origin: Vector = (0.0, 0.0, 0.0)
    z_dir: Vector = (0.0, 0.0, 1.0)
    x_dir: Vector = (1.0, 0.0, 0.0)

    @property
    def y_dir(self) -> Vector:
        """Where the shape's y axis points."""
        (a, b, c), (d, e, f) = self.z_dir, self.x_dir
        return (b * f - c * e, c * d - a * f, a * e - b * d)


@dataclass(frozen=True)
class Bored:
    """A shape with others cut out of it, such as a knuckle with the roof over its bore.

    Attributes
    ----------
    shape : Shape
        The shape.
    cuts : tuple of Shape
        What is cut out of it, in the same frame.
    """

    shape: Shape
    cuts: tuple[Shape, ...]


@dataclass(frozen=True)
class Blank:
    """A prism united with a round bar about the z axis, as long as itself.

    Attributes
    ----------
    web : Prism
        The prism, without holes; its outline meets the circle of the bar twice.
    radius : float
        Radius of the bar in mm.
    """

    web: Prism
    radius: float


Shape = Turned | Prism | Moved | Bored | Blank


@dataclass(frozen=True)
class HalfPlan:
    """One half as data: ``half = (web - carve) + add - bore``.

    Attributes
    ----------
    carve : tuple of Shape
        To cut from the body first, and from the web.
    web : tuple of Shape
        What joins the knuckles.
    add : tuple of Shape
        Knuckles, with their bores and recesses.
    bore : tuple of Shape
        Cut from the finished half: dimples, screw holes, what is below a flat foot.
    seat : tuple of Shape
        `carve` with the outline of the half's own knuckles where it has a core inside of them, so
        that ``web - seat`` only touches what is added, and ``(web - seat) + add`` is the same half.
        Empty where something that is added reaches into the web or into a knuckle.
    blank : Shape or None
        Web and barrel in one piece, where ``blank - notches - bore`` is the same half.
    notches : tuple of Shape
        What is cut from the blank.
    """

    carve: tuple[Shape, ...]
    web: tuple[Shape, ...]
    add: tuple[Shape, ...]
    bore: tuple[Shape, ...] = ()
    seat: tuple[Shape, ...] = ()
    blank: Shape | None = None
    notches: tuple[Shape, ...] = ()


def bounds(shape: Shape) -> Bounds:
    """Box about a shape; of one that is turned by a part only, about the whole turn.

    Parameters
    ----------
    shape : Shape
        The shape.

    Returns
    -------
    Bounds
        Lowest and highest x, y and z in mm.
    """
    if isinstance(shape, Turned):
        wide = max(radius for radius, _ in shape.outline)
        along = [z for _, z in shape.outline]
        return (-wide, wide), (-wide, wide), (min(along), max(along))
    if isinstance(shape, Prism):
        xs, ys = zip(*shape.outline, strict=True)
        return (min(xs), max(xs)), (min(ys), max(ys)), (shape.start, shape.end)
    if isinstance(shape, Blank):
        (west, east), (south, north), ends = bounds(shape.web)
        wide = shape.radius
        return (min(west, -wide), max(east, wide)), (min(south, -wide), max(north, wide)), ends
    inner = bounds(shape.shape)
    if isinstance(shape, Bored):
        return inner
    made = []
    for axis, origin in enumerate(shape.origin):
        turn = [direction[axis] for direction in (shape.x_dir, shape.y_dir, shape.z_dir)]
        reach = [sorted((t * a, t * b)) for t, (a, b) in zip(turn, inner, strict=True)]
        made.append((origin + sum(r[0] for r in reach), origin + sum(r[1] for r in reach)))
    return made[0], made[1], made[2]


def meet(one: Bounds, other: Bounds) -> bool:
    """Tell whether two boxes share room.

    Parameters
    ----------
    one, other : Bounds
        The boxes in mm.

    Returns
    -------
    bool
        False where they only touch.
    """
    return all(
        a0 < b1 - _TOUCH and b0 < a1 - _TOUCH for (a0, a1), (b0, b1) in zip(one, other, strict=True)
    )


def cylinder(radius: float, start: float, end: float) -> Turned:
    """Turn a plain cylinder on the z axis.

    Parameters
    ----------
    radius : float
        Radius in mm.
    start, end : float
        Its two ends, z in mm.

    Returns
    -------
    Turned
        The cylinder.
    """
    return Turned(((0.0, start), (radius, start), (radius, end), (0.0, end)))


def box(west: float, east: float, south: float, north: float, start: float, end: float) -> Prism:
    """Draw a box from its limits.

    Parameters
    ----------
    west, east : float
        Limits in x, mm.
    south, north : float
        Limits in y, mm.
    start, end : float
        Limits in z, mm.

    Returns
    -------
    Prism
        The box.
    """
    return Prism(((west, south), (east, south), (east, north), (west, north)), start, end)


def regular(corners: int, across_flats: float, start: float, end: float, first: float) -> Prism:
    """Draw a regular prism about the z axis, such as a nut.

    Parameters
    ----------
    corners : int
        Number of corners.
    across_flats : float
        Distance between opposite sides in mm.
    start, end : float
        Its two ends, z in mm.
    first : float
        Direction of one corner in degrees from +x.

    Returns
    -------
    Prism
        The prism.
    """
    radius = 0.5 * across_flats / cos(radians(180.0 / corners))
    steps = (radians(first + 360.0 * i / corners) for i in range(corners))
    return Prism(tuple((radius * cos(a), radius * sin(a)) for a in steps), start, end)


def teardrop(radius: float, start: float, end: float, up: float) -> Prism:
    """Draw the roof that makes a lying round bore printable without support.

    Parameters
    ----------
    radius : float
        Radius of the bore in mm. The roof touches it at 45° on both sides and is cut flat at 1.2
        radii.
    start, end : float
        Its two ends, z in mm.
    up : float
        Direction of printing in degrees from +x about the axis.

    Returns
    -------
    Prism
        What to cut besides the round bore.
    """
    flat = 1.2
    side, top = 0.5**0.5, 2.0**0.5 - flat
    corners = ((-side, side), (0.0, 0.0), (side, side), (top, flat), (-top, flat))
    turn = radians(up - 90.0)
    return Prism(
        tuple(
            (radius * (x * cos(turn) - y * sin(turn)), radius * (x * sin(turn) + y * cos(turn)))
            for x, y in corners
        ),
        start,
        end,
    )
