"""The plan of a double hinge: a link plate in the face that two boxes share, with two axes.

Frame: the shared face is the square |y|, |z| ≤ size / 2 of the plane x = 0, the parent's box lies
at x < 0 and the child's at x > 0. Each axis runs along one edge of the face. An edge is named by
its direction from the middle of the face: "+y", "-y", "+z" or "-z".
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache, partial
from math import sqrt
from typing import Final, Unpack

import numpy as np
from numpy.typing import NDArray

from .barrel import BarrelSpec, barrel_spec, check_gap
from .blank import cut_from_blank
from .clearance import Clearance, millimetres
from .exceptions import HingeError
from .fit import at_least
from .knuckles import KnuckleLayout, groove, lay_out_knuckles
from .leaf import Bracket
from .options import DoubleHingeKeywords, DoubleHingeOptions
from .shapes import HalfPlan, Moved, Point, Prism, Shape, box, cylinder

__all__ = [
    "EDGES",
    "DoublePlan",
    "DoubleSpec",
    "child_pose",
    "link_pose",
    "plan_double",
    "plate_shape",
]

Matrix = NDArray[np.float64]

EDGES: Final[dict[str, tuple[float, float, float]]] = {
    "+y": (0.0, 1.0, 0.0),
    "-y": (0.0, -1.0, 0.0),
    "+z": (0.0, 0.0, 1.0),
    "-z": (0.0, 0.0, -1.0),
}
_TURNS: Final = (90.0, 180.0, 270.0)


def _neck(radius: float, plate: float, clearance: Clearance, top: float | None) -> float:
    """Width in mm of the joint between a barrel and the bracket beside a link plate.

    `top` is how far the block's outer face lies inside the axis; None where the plate comes to lie
    on it.
    """
    near = 0.5 * plate + clearance.radial
    top = near if top is None else top
    if near**2 + top**2 >= radius**2:
        return 0.0
    along = sqrt(radius**2 - near**2) - top
    across = sqrt(radius**2 - top**2) - near
    return sqrt(along**2 + across**2)


@dataclass(frozen=True, kw_only=True)
class DoubleSpec(BarrelSpec):
    """All parameters of a double hinge, defaults filled in.

    Attributes
    ----------
    size : float
        Side of the shared face in mm.
    first, second : str
        Edges of the parent-link and of the link-child axis: "+y", "-y", "+z" or "-z".
    turns : (float, float)
        How far each axis turns, in degrees: 90, 180 or 270.
    angles : (float, float)
        Angles of the two axes in degrees at which the hinge is drawn and printed.
    plate : float
        Thickness of the link plate in mm.
    bracket : Bracket
        What joins the knuckles of the parent's and the child's half.
    """

    size: float
    first: str
    second: str
    turns: tuple[float, float]
    angles: tuple[float, float]
    plate: float
    bracket: Bracket

    @classmethod
    def read(cls, size: float | str, **keywords: Unpack[DoubleHingeKeywords]) -> DoubleSpec:
        """Fill in the defaults.

        Parameters
        ----------
        size : float
            Side of the shared face in mm.
        **keywords
            The keywords of :class:`hinges.DoubleHinge`.

        Returns
        -------
        DoubleSpec
            All sizes, not yet checked against the rules of fit.

        Raises
        ------
        HingeError
            If the clearance cannot be read or the form of the bores is unknown.
        """
        options = DoubleHingeOptions(**keywords)
        size = millimetres(size, "size")
        knuckles, plate = options.knuckles, options.plate
        if knuckles is None:
            knuckles = 5 if options.first == options.second else 3
        # The bores' roofs are the same in every pose: each axis has its own direction of printing.
        shared = barrel_spec(options, size, knuckles, (0.0, 0.0, 0.0))
        if plate is None:
            tops = [shared.gap / 2.0 if turn <= 180.0 else None for turn in options.turns]
            necks = {
                t: min(_neck(shared.radius, t, shared.clearance, top) for top in tops)
                for t in (2.0, 1.8, 1.6, 1.4, 1.2)
            }
            plate = next((t for t, neck in necks.items() if neck >= shared.wall), 2.0)
        return cls(
            size=float(size),
            first=options.first,
            second=options.second,
            turns=(float(options.turns[0]), float(options.turns[1])),
            angles=(float(options.angles[0]), float(options.angles[1])),
            plate=float(plate),
            bracket=Bracket() if options.bracket is None else options.bracket,
            **vars(shared),
        )

    @property
    def same_edge(self) -> bool:
        """Whether both axes lie on one edge."""
        return self.first == self.second

    def frame(self, axis: int) -> Matrix:
        """Lay out the frame of an axis.

        Parameters
        ----------
        axis : int
            0 for the parent-link axis, 1 for the link-child axis.

        Returns
        -------
        (4, 4) float64 array
            Frame in mm. z runs along the axis and y out of the face; x points to the link, from the
            parent for axis 0 and from the child for axis 1.
        """
        side = 1.0 if axis == 0 else -1.0
        outwards = np.array(EDGES[self.second if axis else self.first])
        across = np.array([side, 0.0, 0.0])
        matrix = np.eye(4)
        matrix[:3, 0] = across
        matrix[:3, 1] = outwards
        matrix[:3, 2] = np.cross(across, outwards)
        matrix[:3, 3] = 0.5 * self.size * outwards
        return matrix


@dataclass(frozen=True)
class DoublePlan:
    """The checked plan of a double hinge.

    Attributes
    ----------
    spec : DoubleSpec
        The parameters that it was made from.
    layouts : tuple of KnuckleLayout
        The knuckles of each axis; a single layout when both axes lie on one edge.
    parent, link, child : HalfPlan
        Shapes of the three bodies, all in the pose with both angles 0.
    loose : tuple of Shape
        Shapes of the loose pins; empty for printed ones.
    """

    spec: DoubleSpec
    layouts: tuple[KnuckleLayout, ...]
    parent: HalfPlan
    link: HalfPlan
    child: HalfPlan
    loose: tuple[Shape, ...]


def placed(matrix: Matrix, shape: Shape) -> Moved:
    """Lay a shape into a frame.

    Parameters
    ----------
    matrix : (4, 4) float64 array
        The frame, in mm.
    shape : Turned, Prism or Moved
        The shape in its own frame.

    Returns
    -------
    Moved
        The shape in its place.
    """
    origin, z_dir, x_dir = (
        (float(column[0]), float(column[1]), float(column[2]))
        for column in (matrix[:3, 3], matrix[:3, 2], matrix[:3, 0])
    )
    return Moved(shape, origin, z_dir, x_dir)


def _turn(angle: float) -> Matrix:
    """Turn about z by degrees, exact at quarter turns."""
    quarter = angle / 90.0
    if quarter == round(quarter):
        cos, sin = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[round(quarter) % 4]
    else:
        cos, sin = float(np.cos(np.radians(angle))), float(np.sin(np.radians(angle)))
    matrix = np.eye(4)
    matrix[:2, :2] = ((cos, -sin), (sin, cos))
    return matrix


def _about(frame: Matrix, angle: float) -> Matrix:
    inverse = np.eye(4)
    inverse[:3, :3] = frame[:3, :3].T
    inverse[:3, 3] = -frame[:3, :3].T @ frame[:3, 3]
    return frame @ _turn(angle) @ inverse


def link_pose(spec: DoubleSpec, first: float) -> Matrix:
    """Compute the pose of the link.

    Parameters
    ----------
    spec : DoubleSpec
        The hinge.
    first : float
        Angle of the first axis in degrees.

    Returns
    -------
    (4, 4) float64 array
        Rigid transform in mm from the pose with both angles 0.
    """
    return _about(spec.frame(0), first)


def child_pose(spec: DoubleSpec, first: float, second: float) -> Matrix:
    """Compute the pose of the child.

    Parameters
    ----------
    spec : DoubleSpec
        The hinge.
    first, second : float
        Angles of the two axes in degrees.

    Returns
    -------
    (4, 4) float64 array
        Rigid transform in mm from the pose with both angles 0.
    """
    return link_pose(spec, first) @ _about(spec.frame(1), -second)


def plate_shape(spec: DoubleSpec, grow: float = 0.0, beyond: float = 0.0) -> Moved:
    """Draw the link plate without its knuckles.

    Parameters
    ----------
    spec : DoubleSpec
        The hinge.
    grow : float
        How much larger it is drawn on every side, in mm.
    beyond : float
        How much larger again in its plane, in mm.

    Returns
    -------
    Moved
        The plate in the pose with both angles 0.
    """
    u_dir = np.array(EDGES[spec.first])
    v_dir = np.cross((1.0, 0.0, 0.0), u_dir)
    frame = np.eye(4)
    frame[:3, 0], frame[:3, 1], frame[:3, 2] = u_dir, v_dir, (1.0, 0.0, 0.0)
    wider = grow + beyond
    edge, inner = 0.5 * spec.size + wider, 0.5 * spec.size - spec.margin + wider
    outline: tuple[Point, ...]
    turned = float(np.dot(v_dir, EDGES[spec.second]))
    if spec.same_edge:
        low = 0.5 * spec.size - _width(spec) - wider
        outline = ((low, -inner), (edge, -inner), (edge, inner), (low, inner))
    elif abs(turned) < 0.5:
        outline = ((-edge, -inner), (edge, -inner), (edge, inner), (-edge, inner))
    else:
        outline = (
            (-inner, -inner),
            (edge, -inner),
            (edge, inner),
            (inner, inner),
            (inner, edge),
            (-inner, edge),
        )
        if turned < 0.0:
            outline = tuple((u, -v) for u, v in reversed(outline))
    half = 0.5 * spec.plate + grow
    return placed(frame, Prism(outline, -half, half))


def _swing(spec: DoubleSpec) -> float:
    """How far the plate's far edge reaches beyond its place at rest as the plate sets off, mm."""
    arm = _width(spec) if spec.same_edge else spec.size - spec.margin
    return sqrt(arm**2 + (0.5 * spec.plate) ** 2) - arm


def _width(spec: DoubleSpec) -> float:
    reach = spec.radius + spec.clearance.radial
    return reach + 1.2 if spec.bracket.width is None else spec.bracket.width


def _block_top(spec: DoubleSpec, axis: int) -> float:
    """How far the block's outer face lies inside the axis, in mm."""
    if spec.turns[axis] > 180.0:
        return 0.5 * spec.plate + spec.clearance.radial
    return 0.5 * spec.gap


def _check(spec: DoubleSpec, layouts: tuple[KnuckleLayout, ...]) -> None:
    for layout in layouts:
        spec.pin.check(layout, spec.wall, spec.bore_form)
    widest = max(spec.pin.largest_radius(layout, spec.bore_form) for layout in layouts)
    at_least(
        "chamfer",
        "the flat that the chamfer leaves on a barrel's end",
        spec.radius - spec.chamfer - widest,
        0.4 if spec.chamfer else 0.0,
        "use a smaller chamfer, a thinner pin or a wider barrel",
    )
    reach = layouts[0].groove_radius
    at_least("plate", "the thickness of the link plate", spec.plate, spec.wall, "use a thicker one")
    at_least(
        "plate",
        "the plate between its two rows of knuckles",
        spec.size - 2.0 * reach,
        2.0 * spec.wall,
        "use smaller barrels or a larger face",
    )
    for axis in (0, 1):
        top = 0.5 * spec.gap if spec.turns[axis] <= 180.0 else None
        neck = _neck(spec.radius, spec.plate, spec.clearance, top)
        at_least(
            "plate",
            f"the neck between barrel and bracket beside the link plate (axis {axis + 1})",
            neck,
            spec.wall,
            "use a thinner plate or a wider barrel",
        )
    width = _width(spec)
    depth = width if spec.bracket.depth is None else spec.bracket.depth
    at_least(
        "bracket",
        "the bracket's material behind the groove",
        min(width, depth) - reach,
        spec.wall,
        "use a wider and deeper bracket or a smaller barrel",
    )


def _read_checked(spec: DoubleSpec) -> None:
    for name in (spec.first, spec.second):
        if name not in EDGES:
            raise HingeError(f"edge {name!r} is unknown: use one of {', '.join(EDGES)}")
    for axis, (turn, angle) in enumerate(zip(spec.turns, spec.angles, strict=True)):
        if turn not in _TURNS:
            raise HingeError(f"turn {turn:g}° of axis {axis + 1}: use 90, 180 or 270")
        if not 0.0 <= angle <= turn:
            raise HingeError(
                f"angle {angle:g}° of axis {axis + 1} is outside its turn of 0 to {turn:g}°"
            )
    if spec.same_edge and spec.knuckles % 4 != 1:
        raise HingeError(
            f"{spec.knuckles} knuckles on one edge for both axes: use 5, 9, ... (link, parent, "
            "link, child, link)"
        )
    if not 0.0 < spec.gap <= 2.0 * spec.radius:
        raise HingeError(f"gap {spec.gap:g} mm must be above 0 and at most the barrel's thickness")
    if spec.chamfer < 0.0:
        raise HingeError(f"chamfer {spec.chamfer:g} mm must not be negative")


@lru_cache(maxsize=256)
def plan_double(spec: DoubleSpec) -> DoublePlan:
    """Check all rules of fit and plan every shape of a double hinge.

    Parameters
    ----------
    spec : DoubleSpec
        All parameters of the hinge.

    Returns
    -------
    DoublePlan
        The plan; cached by the parameters.

    Raises
    ------
    FitError
        If the hinge cannot be printed, naming the rule, the value and what to change.
    HingeError
        If a parameter makes no sense.
    """
    _read_checked(spec)
    check_gap(spec)
    room = (spec.knuckles, spec.radius, spec.clearance, spec.margin)
    if spec.same_edge:
        layouts: tuple[KnuckleLayout, ...] = (
            lay_out_knuckles(spec.size, *room, owners=(1, 0, 1, 2), pin_owner=1),
        )
        blocks = ((0, 0, 0), (1, 0, 2))
    else:
        layouts = (lay_out_knuckles(spec.size, *room), lay_out_knuckles(spec.size, *room))
        blocks = ((0, 0, 0), (1, 1, 0))
    _check(spec, layouts)
    core = 0.5 * (
        max(spec.pin.largest_radius(layout, spec.bore_form) for layout in layouts) + spec.radius
    )

    def row(index: int, owner: int, inside: float) -> Shape:
        return placed(spec.frame(index), groove(layouts[index], owner, inside))

    edge = 0.5 * spec.size
    bodies = []
    for axis, index, owner in blocks:
        frame, layout = spec.frame(axis), layouts[index]
        rows = spec.frame(index)  # where the layout's own z runs
        near = 0.5 * spec.plate + spec.clearance.radial
        width = _width(spec)
        depth = width if spec.bracket.depth is None else spec.bracket.depth
        side = -1.0 if axis == index else 1.0  # the other way round on one common edge
        west, east = sorted((side * width, side * near))
        web = box(west, east, -depth, -_block_top(spec, axis), layout.start, layout.end)
        barrels = spec.pin.knuckles(layout, spec.chamfer, spec.bore_form)
        carve: list[Shape] = [
            placed(rows, shape) for shape in spec.pin.insertion_cuts(layout, edge)
        ]
        in_way: list[Shape] = [plate_shape(spec, spec.clearance.radial, _swing(spec))]
        if not spec.same_edge:
            other = layouts[1 - index]
            axial = spec.clearance.axial
            cleared = cylinder(other.groove_radius, other.start - axial, other.end + axial)
            in_way.append(placed(spec.frame(1 - axis), cleared))
        carve += in_way
        if spec.turns[axis] > 180.0:
            carve += [placed(_about(frame, spec.turns[axis]), shape) for shape in in_way]
        own = tuple(shape for who, shape in barrels if who == owner)
        body = HalfPlan(
            (row(index, owner, core), *carve),
            (placed(rows, web),),
            tuple(placed(rows, shape) for shape in own),
        )
        if not spec.chamfer:
            seat = groove(layout, owner, spec.radius)
            blank, cut = cut_from_blank((web,), own, seat, carve, partial(placed, rows))
            body = replace(body, seat=(placed(rows, seat), *carve), blank=blank, notches=cut)
        bodies.append(body)
    in_link = [(spec.frame(index), layout) for index, layout in enumerate(layouts)]
    link = HalfPlan(
        tuple(row(index, 1, core) for index in range(len(layouts))),
        (plate_shape(spec),),
        tuple(
            placed(rows, shape)
            for rows, layout in in_link
            for who, shape in spec.pin.knuckles(layout, spec.chamfer, spec.bore_form)
            if who == 1
        ),
        seat=tuple(row(index, 1, spec.radius) for index in range(len(layouts)) if not spec.chamfer),
    )
    loose = tuple(
        placed(rows, shape)
        for rows, layout in in_link
        for shape in spec.pin.hardware(layout, spec.bore_form)
    )
    return DoublePlan(spec, layouts, bodies[0], link, bodies[1], loose)
