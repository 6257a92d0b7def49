"""Where a hinge lies: parts and joints that keep to its frame however they are placed.

A build123d joint on an axis knows a point and a direction. A hinge needs a whole frame, so that two
halves made in different places meet at the same angle. And parts are placed in many ways: moved,
rotated, aligned, made at the locations and on the planes of a builder, or mirrored.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextvars import Context
from copy import deepcopy
from typing import Any, TypeVar

from build123d import (
    Align,
    Axis,
    BasePartObject,
    BuildPart,
    Color,
    Joint,
    Location,
    LocationList,
    Mode,
    Part,
    Plane,
    RevoluteJoint,
    RigidJoint,
    Rotation,
    RotationLike,
    Vector,
)

__all__ = [
    "FixedJoint",
    "HingeJoint",
    "HingedPart",
    "PlacedPart",
    "add_joint",
    "axis_of",
    "keep_joints",
    "outside_builders",
    "require_free_joint",
]

Made = TypeVar("Made")


class HingeJoint(RevoluteJoint):  # type: ignore[misc]
    """A joint that turns about the z axis of a frame, counted from its x axis.

    Parameters
    ----------
    label : str
        Name of the joint.
    to_part : Part or BuildPart
        What it is on.
    frame : Location
        Where the hinge's frame lies, in the same space as the part.
    angular_range : (float, float)
        Lowest and highest angle in degrees.

    Attributes
    ----------
    relative_frame : Location
        The frame seen from the part.
    """

    def __init__(
        self,
        label: str,
        to_part: Any,
        frame: Location,
        angular_range: tuple[float, float],
    ) -> None:
        super().__init__(label, to_part, axis=axis_of(frame), angular_range=angular_range)
        self.relative_frame = to_part.location.inverse() * frame

    def __getstate__(self) -> dict[str, Any]:
        state = {**self.__dict__, "angle_reference": tuple(self.angle_reference)}
        state["relative_frame"] = _numbers(self.relative_frame)
        del state["relative_axis"]  # An object of the kernel; it follows from the frame.
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self.angle_reference = Vector(*state["angle_reference"])
        self.relative_frame = _location(state["relative_frame"])
        self.relative_axis = axis_of(self.relative_frame)

    def _reparent(self, parent: Any) -> None:
        """Bind to a part that the body became, in the same place."""
        self.relative_frame = parent.location.inverse() * self.location
        self.relative_axis = axis_of(self.relative_frame)
        self.parent = parent

    @property
    def location(self) -> Location:
        """Where the frame lies now."""
        return self.parent.location * self.relative_frame

    def relative_to(self, other: RigidJoint, *, angle: float | None = None) -> Location:
        """Where the other part lies, seen from this one, at an angle in degrees."""
        super().relative_to(other, angle=angle)  # checks the joint and the angle
        turn = Rotation(0, 0, self.angular_range[0] if angle is None else angle)
        return self.relative_frame * turn * other.relative_location.inverse()


class FixedJoint(RigidJoint):  # type: ignore[misc]
    """A rigid joint that is pickled to the last digit, which a location of the kernel is not."""

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "relative_location": _numbers(self.relative_location)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self.relative_location = _location(state["relative_location"])


def _numbers(frame: Location) -> tuple[tuple[float, ...], ...]:
    """Origin, x and z direction of a frame."""
    plane = Plane(frame)
    return tuple(plane.origin), tuple(plane.x_dir), tuple(plane.z_dir)


def _location(numbers: tuple[tuple[float, ...], ...]) -> Location:
    origin, x_dir, z_dir = numbers
    return Plane(origin, x_dir, z_dir).location


def axis_of(frame: Location) -> Axis:
    """The z axis of a frame.

    Parameters
    ----------
    frame : Location
        Any frame.

    Returns
    -------
    Axis
        Through its origin.
    """
    plane = Plane(frame)
    return Axis(plane.origin, plane.z_dir)


def keep_joints(body: Any, fitted: Part) -> None:
    """Bind copies of a body's rigid and revolute joints to the part that it became.

    Parameters
    ----------
    body : Part or Solid
        The body as it was.
    fitted : Part
        The body with its half of the hinge.
    """
    for label, joint in body.joints.items():
        if isinstance(joint, RigidJoint):
            FixedJoint(label, fitted, joint.location)
        elif isinstance(joint, HingeJoint):
            HingeJoint(label, fitted, joint.location, joint.angular_range)
        elif isinstance(joint, RevoluteJoint):
            axis = axis_of(joint.location)
            RevoluteJoint(label, fitted, axis=axis, angular_range=joint.angular_range)


def outside_builders(make: Callable[[], Made]) -> Made:
    """Make a part for itself and not for the builder around it.

    Parameters
    ----------
    make : callable
        Makes the part.

    Returns
    -------
    Part
        What it made.
    """
    return Context().run(make)


def _carried(transform: Any, frame: Location) -> Location:
    """A frame after a transform; after a mirroring one its z axis points the other way.

    So a turn by a positive angle stays one: ``M R(angle) M⁻¹`` turns backwards about the mirrored
    z axis.
    """
    plane = Plane(frame)
    origin = Vector(plane.origin.to_pnt().Transformed(transform))
    x_dir, z_dir = (
        Vector(direction.to_dir().Transformed(transform))
        for direction in (plane.x_dir, plane.z_dir)
    )
    return Plane(origin, x_dir, -z_dir if transform.IsNegative() else z_dir).location


def _carry_joints(before: Part, after: Part, transform: Any) -> None:
    """Put the joints of a transformed copy where the transform carries them."""
    back = after.location.inverse()
    for label, joint in after.joints.items():
        carried = _carried(transform, before.joints[label].location)
        joint.parent = after
        if isinstance(joint, HingeJoint):
            joint.relative_frame = back * carried
        if isinstance(joint, RevoluteJoint):
            joint.relative_axis = axis_of(back * carried)
        elif isinstance(joint, RigidJoint):
            joint.relative_location = back * carried


class _Stored(Part):  # type: ignore[misc]
    """A part that can be pickled with its colour, which is an object of the kernel."""

    def __getstate__(self) -> dict[str, Any]:
        state = dict(self.__dict__)
        if state.get("_color") is not None:
            state["_color"] = tuple(state["_color"])
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        if state.get("_color") is not None:
            self._color = Color(*state["_color"])


class HingedPart(_Stored):
    """A body with hinges let into it; mirrored, its joints are mirrored too."""

    def _apply_transform(self, transformation: Any) -> Part:
        moved = super()._apply_transform(transformation)
        _carry_joints(self, moved, transformation)
        return moved


class PlacedPart(_Stored, BasePartObject):  # type: ignore[misc]
    """A part of a hinge, which knows where the hinge's frame lies.

    Parameters
    ----------
    part : Part
        Drawn in the hinge's frame.
    rotation, align, mode
        As for every build123d part.

    Attributes
    ----------
    flipped : bool
        Whether it was mirrored: the hinge's own shape is then mirrored in z first, and laid in its
        frame after that.
    """

    def __init__(
        self,
        part: Part,
        rotation: RotationLike,
        align: Align | tuple[Align, Align, Align] | None,
        mode: Mode,
    ) -> None:
        # build123d up to 0.12 lays the part while it is made, later ones after that.
        at_once = not hasattr(BasePartObject, "_publish_to_context")
        builder = BuildPart._get_context(self, log=False) if at_once else None
        if builder is not None:  # Its boolean writes into what it joins; equal hinges share solids.
            part = deepcopy(part)
        super().__init__(part=part, rotation=rotation, align=align, mode=mode)
        self.flipped = False
        self._bound: list[tuple[str, Location, tuple[float, float] | None]] = []
        places = [self.location]
        if builder is not None:
            places = [
                location * self.rotation * part.location
                for location in LocationList._get_context().locations
            ]
        self._lay(places, builder if mode == Mode.ADD else None)

    def _publish_to_context(self, scope: Any) -> None:
        """Follow build123d from 0.13 on, which lays a finished part at the builder's locations."""
        frame = self.place
        super()._publish_to_context(scope)
        places = [
            at * output * frame
            for at in scope.publication_locations
            for output in scope.output_placements
        ]
        mode = getattr(self, "mode", Mode.ADD)
        self._lay(places, scope.publication_target if mode == Mode.ADD else None)

    @property
    def place(self) -> Location:
        """Where the hinge's frame lies; the first of several places at which a builder made it."""
        return self.location * self._frames[0]

    def _lay(self, places: Sequence[Location], builder: Any) -> None:
        """Keep where the hinge's frame lies, and bind its joints there."""
        back = self.location.inverse()
        self._frames = [back * place for place in places]
        self._builder: Any = builder if isinstance(builder, BuildPart) else None
        self.joints: dict[str, Joint] = {}
        bound, self._bound = self._bound, []
        for label, frame, turns in bound:
            self._bind(label, frame, turns)

    def _bind(self, label: str, frame: Location, turns: tuple[float, float] | None = None) -> None:
        """Add a joint at a frame of the hinge: a rigid one, or one that turns.

        It is added at every place at which a builder made the part, and to the builder's part too.
        The second and further ones are called ``label 2`` and so on.
        """
        self._bound.append((label, frame, turns))
        for number, place in enumerate(self._frames, start=1):
            name = label if number == 1 else f"{label} {number}"
            at = self.location * place * frame
            add_joint(name, self, at, turns)
            if self._builder is not None:
                name = _free_name(name, self._builder.joints)
                add_joint(name, self._builder, _outside(self._builder) * at, turns)

    def __getstate__(self) -> dict[str, Any]:
        state = super().__getstate__()
        state.pop("_builder", None)  # It is done with the part.
        state["_frames"] = [_numbers(frame) for frame in self._frames]
        state["_bound"] = [(label, _numbers(at), turns) for label, at, turns in self._bound]
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        super().__setstate__(state)
        self._builder = None
        self._frames = [_location(numbers) for numbers in state["_frames"]]
        self._bound = [(label, _location(at), turns) for label, at, turns in state["_bound"]]

    def __deepcopy__(self, memo: dict[int, Any]) -> PlacedPart:
        builder, self._builder = self._builder, None
        try:
            copied: PlacedPart = super().__deepcopy__(memo)
        finally:
            self._builder = builder
        return copied

    def _like(self, made: Part) -> Part:
        """Lay another part of the same hinge, just made in its frame, where this one lies."""
        return (made.mirror(Plane.XY) if self.flipped else made).move(self.place)

    def _apply_transform(self, transformation: Any) -> PlacedPart:
        moved: PlacedPart = super()._apply_transform(transformation)
        _carry_joints(self, moved, transformation)
        back = moved.location.inverse()
        moved._frames = [
            back * _carried(transformation, self.location * frame) for frame in self._frames
        ]
        moved.flipped = self.flipped != bool(transformation.IsNegative())
        return moved


def add_joint(label: str, part: Any, at: Location, turns: tuple[float, float] | None) -> None:
    """Bind a joint to a part: a rigid one, or one that turns.

    Parameters
    ----------
    label : str
        Name of the joint.
    part : Part or BuildPart
        What it is on.
    at : Location
        Its frame.
    turns : (float, float) or None
        Lowest and highest angle in degrees; None for a rigid joint.
    """
    if turns is None:
        FixedJoint(label, part, at)
    else:
        HingeJoint(label, part, at, turns)


def _outside(builder: BuildPart) -> Location:
    """Where a builder lays what it makes: build123d from 0.13 on makes it elsewhere."""
    made = getattr(builder, "part_local", None)
    return Location() if made is None else builder.part.location * made.location.inverse()


def _free_name(name: str, taken: dict[str, Joint]) -> str:
    """The name, or the next with a number that is not taken."""
    base, number = name, 1
    while name in taken:
        number += 1
        name = f"{base} {number}"
    return name


def require_free_joint(bodies: Sequence[tuple[str, Any]], joint: str) -> None:
    """Refuse a name that a body has given to a joint already.

    Parameters
    ----------
    bodies : sequence of (str, Part or Solid)
        Bodies and what to call them.
    joint : str
        The name.

    Raises
    ------
    HingeError
        If it is taken.
    """
    from .exceptions import HingeError

    for name, body in bodies:
        if joint in body.joints:
            raise HingeError(
                f"the {name} body already has a joint named {joint!r}: give this hinge a name of "
                f"its own, such as joint={joint + ' 2'!r}"
            )
