"""The plan of a double hinge: a link plate in the face that two boxes share, with two axes.

Frame: the shared face is the square |y|, |z| ≤ size / 2 of the plane x = 0, the parent's box lies
at x < 0 and the child's at x > 0. Each axis runs along one edge of the face. An edge is named by
its direction from the middle of the face: "+y", "-y", "+z" or "-z".
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import sqrt
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from .clearance import Clearance
from .errors import HingeError
from .fit import at_least
from .leaf import Bracket
from .plan import BarrelOptions, BarrelSpec, HalfPlan
from .shapes import Moved, Point, Prism, Shape, box, cylinder
from .train import Train, groove, lay_out

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
Edge = Literal["+y", "-y", "+z", "-z"]

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
    """All parameters of a double hinge, defaults filled in; see :class:`hinges.DoubleHinge`."""

    size: float
    first: str
    second: str
    turns: tuple[float, float]
    angles: tuple[float, float]
    plate: float
    bracket: Bracket

    @classmethod
    def read(
        cls,
        size: float,
        *,
        first: str = "+y",
        second: str = "-y",
        turns: tuple[float, float] = (180.0, 180.0),
        angles: tuple[float, float] = (0.0, 0.0),
        knuckles: int | None = None,
        plate: float | None = None,
        bracket: Bracket | None = None,
        **barrel: Any,
    ) -> DoubleSpec:
        """Fill in the defaults; parameters as for :class:`hinges.DoubleHinge`.

        `barrel` are those of :class:`hinges.plan.BarrelOptions`.
        """
        if knuckles is None:
            knuckles = 5 if first == second else 3
        # The bores' roofs are the same in every pose: each axis has its own direction of printing.
        shared = BarrelOptions(**barrel).filled(size, knuckles, (0.0, 0.0, 0.0))
        if plate is None:
            tops = [shared.gap / 2.0 if turn <= 180.0 else None for turn in turns]
            necks = {
                t: min(_neck(shared.radius, t, shared.clearance, top) for top in tops)
                for t in (2.0, 1.8, 1.6, 1.4, 1.2)
            }
            plate = next((t for t, neck in necks.items() if neck >= shared.wall), 2.0)
        return cls(
            size=float(size),
            first=first,
            second=second,
            turns=(float(turns[0]), float(turns[1])),
            angles=(float(angles[0]), float(angles[1])),
            plate=float(plate),
            bracket=Bracket() if bracket is None else bracket,
            **vars(shared),
        )

    @property
    def same_edge(self) -> bool:
        """Whether both axes lie on one edge."""
        return self.first == self.second

    def frame(self, axis: int) -> Matrix:
        """Lay out an axis as a (4, 4) matrix.

        z runs along the axis and y out of the face; x points from the block (the parent for axis
        0, the child for axis 1) to the link.
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
    trains : tuple of Train
        One for each axis; a single one when both axes lie on one edge.
    parent, link, child : HalfPlan
        All in the pose with both angles 0.
    loose : tuple of Shape
        Loose pins, if any.
    """

    spec: DoubleSpec
    trains: tuple[Train, ...]
    parent: HalfPlan
    link: HalfPlan
    child: HalfPlan
    loose: tuple[Shape, ...]


def placed(matrix: Matrix, shape: Shape) -> Moved:
    """Lay a shape into the frame given by a (4, 4) matrix."""
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
    """Pose of the link for an angle of the first axis (degrees), as a (4, 4) matrix in mm."""
    return _about(spec.frame(0), first)


def child_pose(spec: DoubleSpec, first: float, second: float) -> Matrix:
    """Pose of the child for the angles of both axes (degrees), as a (4, 4) matrix in mm."""
    return link_pose(spec, first) @ _about(spec.frame(1), -second)


def plate_shape(spec: DoubleSpec, grow: float = 0.0, beyond: float = 0.0) -> Moved:
    """Draw the link plate, `grow` mm larger on every side and `beyond` mm more in its plane."""
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


def _check(spec: DoubleSpec, trains: tuple[Train, ...]) -> None:
    for train in trains:
        spec.pin.check(train, spec.wall, spec.roof)
    widest = max(spec.pin.reach(train, spec.roof) for train in trains)
    at_least(
        "chamfer",
        "the flat that the chamfer leaves on a barrel's end",
        spec.radius - spec.chamfer - widest,
        0.4 if spec.chamfer else 0.0,
        "use a smaller chamfer, a thinner pin or a wider barrel",
    )
    reach = trains[0].reach
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

    Raises
    ------
    FitError
        Naming the rule, the value and what to change.
    HingeError
        If a parameter makes no sense.
    """
    _read_checked(spec)
    room = (spec.knuckles, spec.radius, spec.clearance, spec.margin)
    if spec.same_edge:
        trains: tuple[Train, ...] = (lay_out(spec.size, *room, owners=(1, 0, 1, 2), holder=1),)
        blocks = ((0, 0, 0), (1, 0, 2))
    else:
        trains = (lay_out(spec.size, *room), lay_out(spec.size, *room))
        blocks = ((0, 0, 0), (1, 1, 0))
    _check(spec, trains)
    core = 0.5 * (max(spec.pin.reach(train, spec.roof) for train in trains) + spec.radius)
    links = [groove(train, 1, core) for train in trains]
    edge = 0.5 * spec.size
    bodies = []
    for axis, index, owner in blocks:
        frame, train = spec.frame(axis), trains[index]
        rows = spec.frame(index)  # where the train's own z runs
        near = 0.5 * spec.plate + spec.clearance.radial
        width = _width(spec)
        depth = width if spec.bracket.depth is None else spec.bracket.depth
        web = box(-width, -near, -depth, -_block_top(spec, axis), train.start, train.end)
        barrels = spec.pin.knuckles(train, spec.chamfer)
        roofs = spec.pin.bores(train, spec.roof)
        carve: list[Shape] = [placed(rows, groove(train, owner, core))]
        carve += [placed(rows, shape) for shape in spec.pin.access(train, edge)]
        in_way: list[Shape] = [plate_shape(spec, spec.clearance.radial, _swing(spec))]
        if not spec.same_edge:
            other = trains[1 - index]
            axial = spec.clearance.axial
            cleared = cylinder(other.reach, other.start - axial, other.end + axial)
            in_way.append(placed(spec.frame(1 - axis), cleared))
        carve += in_way
        if spec.turns[axis] > 180.0:
            carve += [placed(_about(frame, spec.turns[axis]), shape) for shape in in_way]
        bodies.append(
            HalfPlan(
                tuple(carve),
                (placed(frame, web),),
                tuple(placed(rows, shape) for who, shape in barrels if who == owner),
                tuple(placed(rows, shape) for who, shape in roofs if who == owner),
            )
        )
    in_link = [(spec.frame(index), train, links[index]) for index, train in enumerate(trains)]
    link = HalfPlan(
        tuple(placed(rows, cut) for rows, _, cut in in_link),
        (plate_shape(spec),),
        tuple(
            placed(rows, shape)
            for rows, train, _ in in_link
            for who, shape in spec.pin.knuckles(train, spec.chamfer)
            if who == 1
        ),
        tuple(
            placed(rows, shape)
            for rows, train, _ in in_link
            for who, shape in spec.pin.bores(train, spec.roof)
            if who == 1
        ),
    )
    loose = tuple(
        placed(rows, shape) for rows, train, _ in in_link for shape in spec.pin.hardware(train)
    )
    return DoublePlan(spec, trains, bodies[0], link, bodies[1], loose)
