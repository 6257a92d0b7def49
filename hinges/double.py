"""A hinge with a link plate and two axes, as a build123d part."""

from __future__ import annotations

from functools import lru_cache
from typing import Literal

from build123d import (
    Align,
    BuildPart,
    Color,
    Location,
    Mode,
    Part,
    Plane,
    Rotation,
    RotationLike,
    Solid,
)

from .clearance import Clearance
from .double_poses import colliding_poses
from .exact_solids import build_all, build_half, build_shape, laid, one_part
from .exceptions import HingeError
from .leaf import Bracket
from .let_in import frame_at, let_in, one_body, require_edge
from .options import BoreStyle, DoubleHingeKeywords, DoubleHingeOptions, call_of
from .pins import Pin
from .placement import (
    HingedPart,
    PlacedPart,
    add_joint,
    outside_builders,
    require_free_joint,
)
from .plan_double import (
    DoublePlan,
    DoubleSpec,
    Matrix,
    child_pose,
    link_pose,
    plan_double,
)
from .shapes import HalfPlan

__all__ = ["DoubleHinge", "DoubleHingeCarve", "DoubleHingePart"]

BodyName = Literal["parent", "link", "child"]
COLORS = {
    "parent": (0.20, 0.45, 0.70),
    "link": (0.35, 0.65, 0.35),
    "child": (0.90, 0.55, 0.15),
}


def _body(name: str) -> BodyName:
    if name == "parent":
        return "parent"
    if name == "link":
        return "link"
    if name == "child":
        return "child"
    raise HingeError(f"body {name!r}: use 'parent', 'link' or 'child'")


def _half_plan(spec: DoubleSpec, body: BodyName) -> HalfPlan:
    plan = plan_double(spec)
    return {"parent": plan.parent, "link": plan.link, "child": plan.child}[body]


@lru_cache(maxsize=128)
def _piece(plan: HalfPlan, body: BodyName) -> Solid:
    return build_half(plan, body).solid()


@lru_cache(maxsize=128)
def _carve(plan: HalfPlan) -> tuple[Solid, ...]:
    return tuple(build_all(plan.carve).solids())


def _location(matrix: Matrix) -> Location:
    origin, x_dir, z_dir = (tuple(map(float, matrix[:3, column])) for column in (3, 0, 2))
    return Plane(origin=origin, x_dir=x_dir, z_dir=z_dir).location


def _pose(spec: DoubleSpec, body: BodyName) -> Location:
    first, second = spec.angles
    if body == "parent":
        return Location()
    return _location(link_pose(spec, first) if body == "link" else child_pose(spec, first, second))


class DoubleHinge(PlacedPart):
    """Two boxes joined by a link plate that turns on both: three bodies, two axes.

    The shared face is the square |y|, |z| ≤ size / 2 of the plane x = 0; the parent's box lies at
    x < 0, the child's at x > 0, the link plate between them. Each axis runs along one edge of the
    face, named by its direction: "+y", "-y", "+z" or "-z". Opposite edges give parallel axes,
    neighbouring ones perpendicular axes, and the same edge twice one common line. Both angles count
    from the closed pose; a positive one carries the child away from the face and around the edge.

    Parameters
    ----------
    size : float or str
        Side of the shared face: in mm, or with a unit such as "2 in".
    first, second : {"+y", "-y", "+z", "-z"}
        Edges of the parent-link and of the link-child axis.
    turns : (float, float)
        How far each axis turns: 90, 180 or 270 degrees. With 270 the plate comes to lie on the
        neighbouring face of the body, which gets a pocket for it.
    angles : (float, float)
        Angles of the two axes in degrees at which it is drawn and printed.
    knuckles : int, optional
        Number of knuckles on each axis. 3 when left out; both axes on one edge need 5 or 9.
    radius, pin, clearance, gap, chamfer, margin, wall, bore
        As for :class:`SingleHinge`.
    plate : float, optional
        Thickness of the link plate in mm; 2, or thinner where a small barrel asks for it.
    bracket : Bracket, optional
        What joins the knuckles of the parent's and the child's half.
    up : float
        Direction of printing in degrees about each axis, from the direction that points from the
        body to the link; for the roofs of the bores.
    rotation, align, mode
        As for every build123d part.

    Attributes
    ----------
    parent_half, link, child_half : Part
        The link is a body of its own, the halves belong to the two bodies. Their joints chain up:
        ``parent_half.joints["link"]`` turns ``link.joints["parent"]``, and
        ``link.joints["child"]`` turns ``child_half.joints["link"]``.
    parent_carve, child_carve : Part
        To cut from the two bodies first: ``body - carve + half``.
    spec : DoubleSpec
        All parameters, defaults filled in.
    plan : DoublePlan
        Every shape of the hinge as data.

    Raises
    ------
    FitError
        If the hinge cannot be printed, naming the rule and what to change.
    HingeError
        If a parameter makes no sense.

    Examples
    --------
    >>> hinge = DoubleHinge(20, first="+y", second="+z", turns=(180, 90), clearance=0.3)
    >>> len(hinge.solids())
    3
    """

    def __init__(
        self,
        size: float | str,
        *,
        first: str = "+y",
        second: str = "-y",
        turns: tuple[float, float] = (180.0, 180.0),
        angles: tuple[float, float] = (0.0, 0.0),
        knuckles: int | None = None,
        radius: float | None = None,
        pin: Pin | None = None,
        clearance: Clearance | float | str = "fdm",
        plate: float | None = None,
        bracket: Bracket | None = None,
        gap: float | None = None,
        chamfer: float = 0.0,
        margin: float | None = None,
        wall: float | None = None,
        bore: BoreStyle = "round",
        up: float = 90.0,
        rotation: RotationLike = (0, 0, 0),
        align: Align | tuple[Align, Align, Align] | None = None,
        mode: Mode = Mode.ADD,
    ) -> None:
        asked: DoubleHingeKeywords = {
            "first": first,
            "second": second,
            "turns": turns,
            "angles": angles,
            "knuckles": knuckles,
            "radius": radius,
            "pin": pin,
            "clearance": clearance,
            "plate": plate,
            "bracket": bracket,
            "gap": gap,
            "chamfer": chamfer,
            "margin": margin,
            "wall": wall,
            "bore": bore,
            "up": up,
        }
        self.spec = DoubleSpec.read(size, **asked)
        self._asked = (size, asked)
        plan_double(self.spec)
        super().__init__(part=self._built(), rotation=rotation, align=align, mode=mode)
        self.label = "double hinge"
        self.color = Color(*COLORS["parent"])
        self._bind("parent", Location())

    def _built(self) -> Part:
        """All three bodies in the drawn pose."""
        bodies: tuple[BodyName, ...] = ("parent", "link", "child")
        return one_part(
            [
                laid(_piece(_half_plan(self.spec, body), body), _pose(self.spec, body))
                for body in bodies
            ]
        )

    def __repr__(self) -> str:
        """The call that makes this hinge, without what is left at its default."""
        return call_of("DoubleHinge", *self._asked, DoubleHingeOptions())

    @property
    def plan(self) -> DoublePlan:
        """Every shape of the hinge as data."""
        return plan_double(self.spec)

    def _body(self, body: BodyName) -> Part:
        return self._like(outside_builders(lambda: DoubleHingePart(self, body)))

    def _carved(self, body: BodyName) -> Part:
        return self._like(outside_builders(lambda: DoubleHingeCarve(self, body)))

    @property
    def parent_half(self) -> Part:
        """The parent's knuckles and bracket; its joint "link" turns."""
        return self._body("parent")

    @property
    def link(self) -> Part:
        """The link plate; its joint "parent" is rigid, its joint "child" turns."""
        return self._body("link")

    @property
    def child_half(self) -> Part:
        """The child's knuckles and bracket in the drawn pose; its joint "link" is rigid."""
        return self._body("child")

    @property
    def parent_carve(self) -> Part:
        """What the parent's body gives up: grooves, and pockets for the link plate."""
        return self._carved("parent")

    @property
    def child_carve(self) -> Part:
        """What the child's body, in the drawn pose, gives up."""
        return self._carved("child")

    @property
    def colliding_poses(self) -> tuple[tuple[float, float], ...]:
        """Pairs of angles, in steps of 90°, at which the two boxes would take one another's room.

        Both axes turn on their own, so the hinge does not keep them from it: a hinge that turns by
        270° cannot stand at 270/0, nor one with both axes on one edge at 180/90.
        """
        return colliding_poses(self.spec)

    @property
    def hardware(self) -> Part | None:
        """The loose pins in the pose with both angles 0, or None for printed ones."""
        loose = self.plan.loose
        return self._like(one_part([build_shape(shape) for shape in loose])) if loose else None

    def fit(
        self,
        parent: Part | Solid | BuildPart,
        child: Part | Solid | BuildPart,
        at: Location | Plane | None = None,
        joint: str = "link",
    ) -> tuple[Part, Part, Part]:
        """Let the hinge into two bodies.

        Parameters
        ----------
        parent, child : Part, Solid or BuildPart
            The bodies in the drawn pose. Each keeps at least half the gap inside its box: away
            from the face that they share, and from the faces that they fold together on.
        at : Location or Plane, optional
            Where the hinge lies; where it is when left out.
        joint : str
            Name of the joints on both bodies; for a body with several hinges, as in a chain.

        Returns
        -------
        parent, link, child : Part
            The three bodies with their joints, as on the hinge's own bodies. Rigid and revolute
            joints that the bodies had are kept.

        Raises
        ------
        HingeError
            If a body does not come out in one piece, or has a joint of that name.
        """
        place = frame_at(at)
        frame = place * self.place
        bodies = {"parent": one_body(parent, "parent"), "child": one_body(child, "child")}
        require_free_joint(tuple(bodies.items()), joint)
        spec = self.spec
        axes = self._axes()
        made = []
        for index, (name, body) in enumerate(bodies.items()):
            axis = frame * axes[index]
            layout = self.plan.layouts[min(index, len(self.plan.layouts) - 1)]
            require_edge(body, name, axis, (layout.start, layout.end), spec.bracket)
            half = self._body(_body(name)).moved(place)
            carve = self._carved(_body(name)).moved(place)
            reach = spec.radius + 0.01
            made.append(let_in(body, name, half, carve, axis, reach, spec.bracket))
        link = HingedPart([self.link.moved(place).solid()])
        link.label, link.color = "link", Color(*COLORS["link"])
        for part, name in ((made[0], "parent"), (link, "link"), (made[1], "child")):
            for label, at_joint, turns in _joints(self.spec, _body(name), joint):
                add_joint(label, part, frame * at_joint, turns)
        return made[0], link, made[1]

    def _axes(self) -> tuple[Location, Location]:
        """Both axes in the drawn pose, seen from the hinge's frame."""
        first, second = _joints(self.spec, "parent")[0][1], _joints(self.spec, "link")[1][1]
        return first, second


def _joints(
    spec: DoubleSpec, body: BodyName, label: str = "link"
) -> list[tuple[str, Location, tuple[float, float] | None]]:
    """Joints of one body in the drawn pose: name, frame on its axis, and range where it turns."""
    first, second = spec.angles
    frames = []
    for axis, pose in ((0, Location()), (1, _location(link_pose(spec, first)))):
        frame = spec.frame(axis)
        if axis:  # the child turns about the link's own direction of the edge
            frame = frame.copy()
            frame[:3, 0] *= -1.0
            frame[:3, 2] *= -1.0
        frames.append(pose * _location(frame))
    ranges = [(0.0, float(turn)) for turn in spec.turns]
    if body == "parent":
        return [(label, frames[0], ranges[0])]
    if body == "link":
        return [
            ("parent", frames[0] * Rotation(0, 0, first), None),
            ("child", frames[1], ranges[1]),
        ]
    return [(label, frames[1] * Rotation(0, 0, second), None)]


class DoubleHingePart(PlacedPart):
    """One body of a double hinge: the parent's half, the link, or the child's half.

    Parameters
    ----------
    hinge : DoubleHinge
        The hinge that it is of.
    body : {"parent", "link", "child"}
        Which of the three bodies it is.
    rotation, align, mode
        As for every build123d part.
    """

    def __init__(
        self,
        hinge: DoubleHinge,
        body: BodyName,
        rotation: RotationLike = (0, 0, 0),
        align: Align | tuple[Align, Align, Align] | None = None,
        mode: Mode = Mode.ADD,
    ) -> None:
        body = _body(body)
        part = one_part([laid(_piece(_half_plan(hinge.spec, body), body), _pose(hinge.spec, body))])
        super().__init__(part=part, rotation=rotation, align=align, mode=mode)
        self.label = "link" if body == "link" else f"{body} half"
        self.color = Color(*COLORS[body])
        for label, frame, turns in _joints(hinge.spec, body):
            self._bind(label, frame, turns)


class DoubleHingeCarve(PlacedPart):
    """What a body gives up to a double hinge.

    Parameters
    ----------
    hinge : DoubleHinge
        The hinge that it gives way to.
    body : {"parent", "child"}
        Which of the two bodies it is for.
    rotation, align, mode
        As for every build123d part; subtracted from the part under construction by default.
    """

    def __init__(
        self,
        hinge: DoubleHinge,
        body: BodyName,
        rotation: RotationLike = (0, 0, 0),
        align: Align | tuple[Align, Align, Align] | None = None,
        mode: Mode = Mode.SUBTRACT,
    ) -> None:
        body = _body(body)
        if body == "link":
            raise HingeError("the link is a body of its own: only parent and child are carved")
        pose = _pose(hinge.spec, body)
        part = one_part([laid(solid, pose) for solid in _carve(_half_plan(hinge.spec, body))])
        super().__init__(part=part, rotation=rotation, align=align, mode=mode)
        self.label = f"{body} carve"
