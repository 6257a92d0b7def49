"""A hinge on one axis, as a build123d part."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from typing import Literal, Unpack

from build123d import (
    Align,
    BuildPart,
    Color,
    Edge,
    Location,
    Mode,
    Part,
    Plane,
    Rotation,
    RotationLike,
    Solid,
)

from .arm import Mount, corner_of
from .clearance import Clearance
from .edges import edge_frame
from .exact_solids import build_all, build_half, build_shape, laid, one_part
from .exceptions import HingeError
from .let_in import frame_at, let_in, one_body, require_edge
from .options import BoreStyle, SingleHingeKeywords, SingleHingeOptions, call_of
from .pins import Pin
from .placement import (
    FixedJoint,
    HingeJoint,
    PlacedPart,
    outside_builders,
    require_free_joint,
)
from .plan_single import SinglePlan, SingleSpec, plan_single
from .shapes import Point
from .stops import Detents, Stops
from .turn_check import require_turn
from .turn_sweep import TurnSweep, single_sweep, spread

__all__ = ["HingeCarve", "HingeHalf", "SingleHinge"]

Side = Literal["parent", "child"]
PARENT_COLOR = (0.20, 0.45, 0.70)
CHILD_COLOR = (0.90, 0.55, 0.15)


@lru_cache(maxsize=128)
def _half(spec: SingleSpec, side: Side) -> Solid:
    plan = plan_single(spec)
    return build_half(plan.parent if side == "parent" else plan.child, side).solid()


@lru_cache(maxsize=128)
def _carve(spec: SingleSpec, side: Side) -> tuple[Solid, ...]:
    plan = plan_single(spec)
    return tuple(build_all((plan.parent if side == "parent" else plan.child).carve).solids())


def _posed(spec: SingleSpec, side: Side, solids: tuple[Solid, ...]) -> Part:
    turn = Rotation(0, 0, spec.angle if side == "child" else 0.0)
    return one_part([laid(solid, turn) for solid in solids])


def _side(side: str) -> Side:
    if side == "parent":
        return "parent"
    if side == "child":
        return "child"
    raise HingeError(f"side {side!r}: use 'parent' or 'child'")


class SingleHinge(PlacedPart):
    """A print-in-place or pinned hinge on one axis: two halves that turn about z.

    The axis is z through the origin, with the hinge centred on it. At angle 0 the parent's
    material lies in the quadrant x < 0, y < 0 and the child's in x > 0, y < 0, as two boxes side by
    side that share the face x = 0; y points out of that face. The child turns about +z, and lies
    on the parent at 180°.

    Parameters
    ----------
    length : float or str
        Length of the edge that the hinge is for: in mm, or with a unit such as "2 in".
    knuckles : int
        Number of knuckles, 2 or more. With an odd count the parent has one more than the child.
    ratio : float
        Length of a knuckle of the child against one of the parent.
    radius : float, optional
        Radius of the barrel in mm. It follows from the length, or from the pin, when left out.
    pin : Pin, optional
        What holds the knuckles: :class:`ConePin` (default), :class:`StraightPin`,
        :class:`FilamentPin`, :class:`ScrewPin` or :class:`RodPin`.
    clearance : Clearance, float or str
        Room between surfaces that move past one another: a :class:`Clearance`, a number in mm, a
        length such as "300 um", or a process: "fdm", "sla", "sls", "mjf", "polyjet".
    leaf : Bracket, Leaf or Arm, or a pair of them, optional
        What joins the knuckles to their body: a bar inside it (default), a door hinge's plate, or
        arms to an axis outside of it. A pair gives the parent's and the child's.
    gap : float, optional
        Distance in mm between the two bodies at 0° and 180°; the radial clearance when left out.
    angle : float
        Angle in degrees at which it is drawn and printed.
    angular_range : (float, float)
        Lowest and highest angle in degrees, within 0 to 180; down to -180 with arms.
    opens : float, optional
        How far it opens, in degrees from the closed pose, with a stop there; in place of
        `angular_range` and `stops`. Beyond 180 with arms, which have no stop.
    closed : {0, 180}
        The angle at which it is closed, for `opens`: 0 where the lid lies on its box, 180 where
        both lie side by side and fold onto one another.
    stops : Stops or bool, optional
        Lugs at the ends of the range; True for one at the upper end.
    detents : Detents, optional
        Angles at which it clicks.
    friction : float, optional
        Interference in mm of bumps that drag over the whole turn, so that a lid stays where it is
        let go: 0.05 to 0.1. It is free at the angle that is drawn and printed.
    chamfer : float
        Leg in mm of the 45° chamfer on the ends of barrels; 0 for none.
    margin : float, optional
        Length in mm left free at each end of the edge. When left out, 0 with a leaf; with a bracket
        the barrel radius plus the clearance, so that hinges on two edges that meet at a corner stay
        clear of one another.
    wall : float, optional
        Thinnest wall in mm; of the process named by `clearance`, or 0.8, when left out.
    bore : {"round", "teardrop", "octagon"}
        Form of the bores. A hinge printed with its axis lying wants one of the last two.
    up : float
        Direction of printing in degrees about the axis from +x, for the roofs of the bores.
    rotation, align, mode
        As for every build123d part. `align` is None, since the axis has to stay the origin.

    Attributes
    ----------
    parent_half, child_half : Part
        To add to the two bodies, each with a joint named "hinge".
    parent_carve, child_carve : Part
        To cut from them first: ``body - carve + half``.
    hardware : Part or None
        The loose pin, screw and nut, for drawings; None for a printed pin.
    spec : SingleSpec
        All parameters, defaults filled in.
    plan : SinglePlan
        Every shape of the hinge as data.

    Raises
    ------
    FitError
        If the hinge cannot be printed or cannot turn, naming the rule and what to change.
    HingeError
        If a parameter makes no sense.

    Examples
    --------
    >>> hinge = SingleHinge(20, clearance=0.3)
    >>> len(hinge.solids())
    2
    >>> hinge.joints["hinge"].angular_range
    (0.0, 180.0)
    """

    def __init__(
        self,
        length: float | str,
        *,
        knuckles: int = 3,
        ratio: float = 1.0,
        radius: float | None = None,
        pin: Pin | None = None,
        clearance: Clearance | float | str = "fdm",
        leaf: Mount | tuple[Mount, Mount] | None = None,
        gap: float | None = None,
        angle: float = 0.0,
        angular_range: tuple[float, float] = (0.0, 180.0),
        opens: float | None = None,
        closed: float = 0.0,
        stops: Stops | bool | None = None,
        detents: Detents | None = None,
        friction: float | None = None,
        chamfer: float = 0.0,
        margin: float | None = None,
        wall: float | None = None,
        bore: BoreStyle = "round",
        up: float = 90.0,
        rotation: RotationLike = (0, 0, 0),
        align: Align | tuple[Align, Align, Align] | None = None,
        mode: Mode = Mode.ADD,
    ) -> None:
        asked: SingleHingeKeywords = {
            "knuckles": knuckles,
            "ratio": ratio,
            "radius": radius,
            "pin": pin,
            "clearance": clearance,
            "leaf": leaf,
            "gap": gap,
            "angle": angle,
            "angular_range": angular_range,
            "opens": opens,
            "closed": closed,
            "stops": stops,
            "detents": detents,
            "friction": friction,
            "chamfer": chamfer,
            "margin": margin,
            "wall": wall,
            "bore": bore,
            "up": up,
        }
        self.spec = SingleSpec.read(length, **asked)
        self._asked = (length, asked)
        plan_single(self.spec)
        super().__init__(part=self._built(), rotation=rotation, align=align, mode=mode)
        self.label = "hinge"
        self.color = Color(*PARENT_COLOR)
        self._bind("hinge", Location(), self.spec.angular_range)
        self._bind("parent", Location())

    def _built(self) -> Part:
        """Both halves in the drawn pose."""
        return one_part(
            [
                *_posed(self.spec, "parent", (_half(self.spec, "parent"),)).solids(),
                *_posed(self.spec, "child", (_half(self.spec, "child"),)).solids(),
            ]
        )

    def __repr__(self) -> str:
        """The call that makes this hinge, without what is left at its default."""
        return call_of("SingleHinge", *self._asked, SingleHingeOptions())

    @property
    def plan(self) -> SinglePlan:
        """Every shape of the hinge as data."""
        return plan_single(self.spec)

    def _half(self, side: Side) -> Part:
        return self._like(outside_builders(lambda: HingeHalf(self, side)))

    def _carved(self, side: Side) -> Part:
        return self._like(outside_builders(lambda: HingeCarve(self, side)))

    @property
    def parent_half(self) -> Part:
        """The parent's knuckles and bracket; its joint "hinge" turns."""
        return self._half("parent")

    @property
    def child_half(self) -> Part:
        """The child's knuckles and bracket in the drawn pose; its joint "hinge" is rigid."""
        return self._half("child")

    @property
    def parent_carve(self) -> Part:
        """What the parent's body gives up before its half is added."""
        return self._carved("parent")

    @property
    def child_carve(self) -> Part:
        """What the child's body, in the drawn pose, gives up before its half is added."""
        return self._carved("child")

    @property
    def corners(self) -> tuple[Point, Point]:
        """How far aside of the axis and below it the edges of parent and child lie, in mm."""
        spec, layout = self.spec, self.plan.layout
        if not spec.on_arms:
            return (0.5 * spec.gap, 0.5 * spec.gap), (0.5 * spec.gap, 0.5 * spec.gap)
        parent, child = (corner_of(mount, layout, spec.gap) for mount in spec.mounts)
        return parent, child

    @property
    def hardware(self) -> Part | None:
        """The loose pin, screw and nut, or None for a printed pin."""
        loose = self.plan.loose
        if not loose:
            return None
        drawn = self._like(one_part([build_shape(shape) for shape in loose]))
        drawn.label = "hardware"
        return drawn

    def fit(
        self,
        parent: Part | Solid | BuildPart,
        child: Part | Solid | BuildPart,
        at: Location | Plane | None = None,
        joint: str = "hinge",
        *,
        edge: Edge | None = None,
        check: bool = True,
    ) -> tuple[Part, Part]:
        """Let the hinge into two bodies.

        Parameters
        ----------
        parent, child : Part, Solid or BuildPart
            The bodies in the drawn pose. Each keeps at least half the gap inside its quadrant:
            away from the face that they share, and from the one that they fold together on.
        at : Location or Plane, optional
            Where the hinge lies, see :func:`hinges.hinge_location`; where it is when left out.
        joint : str
            Name of the joints on both bodies; for a body with several hinges.
        edge : Edge, optional
            A straight edge of either body, in place of `at`: axis and outward side follow from it
            and from where the other body lies.
        check : bool
            Whether the bodies are turned through the range and measured.

        Returns
        -------
        parent, child : Part
            The bodies with their halves, and with the joints on the axis. Rigid and revolute joints
            that the bodies had are kept.

        Raises
        ------
        HingeError
            If a body is not one solid, is shorter than the row of knuckles, does not come out in
            one piece because it does not meet its half, or has a joint of that name; or if the two
            meet as they turn, or touch as they are drawn.

        Notes
        -----
        What would stand out of a body of its bracket is trimmed.
        """
        if edge is not None and at is not None:
            raise HingeError("fit: give either the edge or the place, not both")
        place = frame_at(at)
        if edge is not None:
            turned = self._at_angle_0(child)
            corners = self.corners if self.spec.on_arms else None
            where = edge_frame(parent, turned, edge, self.spec.gap, corners)
            place = where * self.place.inverse()
        frame = place * self.place
        bodies = {"parent": one_body(parent, "parent"), "child": one_body(child, "child")}
        require_free_joint(tuple(bodies.items()), joint)
        spec, layout = self.spec, self.plan.layout
        reach = max(spec.radius, spec.stops.radius(layout) if spec.stops else 0.0) + 0.01
        made = []
        for name, body in bodies.items():
            side = _side(name)
            mount = spec.mounts[0 if side == "parent" else 1]
            require_edge(body, name, frame, (layout.start, layout.end), mount)
            half, carve = self._half(side).moved(place), self._carved(side).moved(place)
            on_body = frame * Rotation(0, 0, spec.angle) if side == "child" else frame
            made.append(let_in(body, name, half, carve, on_body, reach, mount))
        HingeJoint(joint, made[0], frame, spec.angular_range)
        FixedJoint(joint, made[1], frame * Rotation(0, 0, spec.angle))
        if check:
            require_turn(self.spec, made[0], made[1], joint)
        return made[0], made[1]

    @classmethod
    def along(cls, edge: Edge, **options: Unpack[SingleHingeKeywords]) -> SingleHinge:
        """Make a hinge as long as an edge.

        Parameters
        ----------
        edge : Edge
            The edge that ``fit(..., edge=edge)`` will lay it on.
        **options
            The other keywords of the class.

        Returns
        -------
        SingleHinge
            The hinge.
        """
        return cls(edge.length, **options)

    def _at_angle_0(self, child: Part | Solid | BuildPart) -> Part | Solid | BuildPart:
        """Refuse to guess an axis about which the child has been turned."""
        if self.spec.angle:
            raise HingeError(
                f"the hinge is drawn at {self.spec.angle:g}°: an edge tells the axis where both "
                "bodies lie at 0°; give the place with hinge_location"
            )
        return child

    def sweep(
        self,
        parent: Part,
        child: Part,
        angles: Iterable[float] | None = None,
        joint: str = "hinge",
    ) -> TurnSweep:
        """Measure the gap between two bodies as they turn.

        Parameters
        ----------
        parent, child : Part
            Bodies that :meth:`fit` returned, in any pose.
        angles : iterable of float, optional
            Angles in degrees; the whole range in steps of 5° when left out.
        joint : str
            Name of the joint.

        Returns
        -------
        TurnSweep
            Gap and overlap at each angle.

        Raises
        ------
        HingeError
            If the surface of a body does not close.
        """
        wanted = spread(*self.spec.angular_range, 5.0) if angles is None else angles
        frames = parent.joints[joint].location, child.joints[joint].location
        return single_sweep(parent, child, frames, wanted)


class HingeHalf(PlacedPart):
    """One half of a hinge, to add to its body after :class:`HingeCarve` was cut from it.

    Parameters
    ----------
    hinge : SingleHinge
        The hinge that it is of.
    side : {"parent", "child"}
        Which of the two bodies it is for.
    rotation, align, mode
        As for every build123d part.
    """

    def __init__(
        self,
        hinge: SingleHinge,
        side: Side,
        rotation: RotationLike = (0, 0, 0),
        align: Align | tuple[Align, Align, Align] | None = None,
        mode: Mode = Mode.ADD,
    ) -> None:
        side = _side(side)
        part = _posed(hinge.spec, side, (_half(hinge.spec, side),))
        super().__init__(part=part, rotation=rotation, align=align, mode=mode)
        self.label = f"{side} half"
        self.color = Color(*(PARENT_COLOR if side == "parent" else CHILD_COLOR))
        if side == "parent":
            self._bind("hinge", Location(), hinge.spec.angular_range)
        else:
            self._bind("hinge", Rotation(0, 0, hinge.spec.angle))


class HingeCarve(PlacedPart):
    """What a body gives up to a hinge: grooves for the other half's knuckles, and its own bores.

    Parameters
    ----------
    hinge : SingleHinge
        The hinge that it is of.
    side : {"parent", "child"}
        Which of the two bodies it is for.
    rotation, align, mode
        As for every build123d part; subtracted from the part under construction by default.
    """

    def __init__(
        self,
        hinge: SingleHinge,
        side: Side,
        rotation: RotationLike = (0, 0, 0),
        align: Align | tuple[Align, Align, Align] | None = None,
        mode: Mode = Mode.SUBTRACT,
    ) -> None:
        side = _side(side)
        part = _posed(hinge.spec, side, _carve(hinge.spec, side))
        super().__init__(part=part, rotation=rotation, align=align, mode=mode)
        self.label = f"{side} carve"
