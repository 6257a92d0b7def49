"""Play: how far a joint can shift and tilt, from its clearances and its geometry.

Every pair of surfaces that face one another across a clearance gives linear constraints on a small
motion of the child, ``u(p) = t + ω × p``: the gap at p may not close. Play is how far the child
moves before the first of them binds. Play is small against the sizes of a hinge, so the linear
model is exact to second order; a test compares it with sampled collisions of the real solids.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import acos, asin, degrees, pi
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .arm import Mount
from .exceptions import HingeError
from .plan_single import SinglePlan, SingleSpec, plan_single
from .shapes import HalfPlan

if TYPE_CHECKING:
    from .double import DoubleHinge
    from .plan_double import DoublePlan
    from .single import SingleHinge

__all__ = ["Play", "play", "total_play"]

Floats = NDArray[np.float64]
_STEP = pi / 48.0


@dataclass(frozen=True)
class Play:
    """Play of a joint, or of several in a row.

    Attributes
    ----------
    radial : float
        Largest shift across the axis in mm, over all directions, from the centred position.
    radial_least : float
        The same in the direction that allows least.
    axial : (float, float)
        Largest shift along -z and +z in mm; infinite where the child is lifted off.
    tilt : float
        Largest tilt of the child out of its plane, to one side, in degrees.
    """

    radial: float
    radial_least: float
    axial: tuple[float, float]
    tilt: float

    def at(self, distance: float) -> float:
        """Compute the largest shift of a point of the child.

        Parameters
        ----------
        distance : float
            Distance of the point from the axis in mm.

        Returns
        -------
        float
            Shift in mm.
        """
        return self.radial + distance * float(np.radians(self.tilt))


def total_play(joints: Iterable[Play]) -> Play:
    """Add up the play of joints in a row, each at its worst.

    Parameters
    ----------
    joints : iterable of Play
        Play of each joint.

    Returns
    -------
    Play
        Play of the last body against the first. It leaves out the shifts that a tilting joint adds
        over the length of a link; see :meth:`Play.at`.

    Raises
    ------
    HingeError
        If there is no joint.
    """
    all_of = list(joints)
    if not all_of:
        raise HingeError("a chain of joints needs at least one joint")
    return Play(
        sum(one.radial for one in all_of),
        sum(one.radial_least for one in all_of),
        (sum(one.axial[0] for one in all_of), sum(one.axial[1] for one in all_of)),
        sum(one.tilt for one in all_of),
    )


def contacts(plan: SinglePlan, angle: float) -> tuple[Floats, Floats, Floats]:
    """Sample the facing surfaces of the two halves.

    Parameters
    ----------
    plan : SinglePlan
        The hinge.
    angle : float
        Angle of the hinge in degrees.

    Returns
    -------
    points : (n, 3) float64 array
        Points on the surfaces in mm.
    normals : (n, 3) float64 array
        Unit direction in which the child closes the gap at each.
    gaps : (n,) float64 array
        Width of the gap at each in mm.
    """
    spec, layout = plan.spec, plan.layout
    circle = np.arange(0.0, 2.0 * pi, _STEP)
    points: list[Floats] = []
    normals: list[Floats] = []
    gaps: list[Floats] = []

    def add(
        where: Floats, radius: float, z: float, normal: tuple[float, float], gap: float
    ) -> None:
        rows = np.stack([np.cos(where), np.sin(where), np.zeros_like(where)], axis=1)
        points.append(radius * rows + (0.0, 0.0, z))
        normals.append(normal[0] * rows + (0.0, 0.0, normal[1]))
        gaps.append(np.full(len(where), gap))

    pin_owner = layout.pin_owner
    for circled in spec.pin.contact_circles(layout):
        # the other's surface lies outside the pin owner's: a motion against the normal closes it
        side = -1.0 if pin_owner == 0 else 1.0
        across, along = circled.normal
        where = circle
        if circled.arc != (0.0, 360.0):
            where = np.radians(np.linspace(*circled.arc, 5))
        add(where, circled.radius, circled.z, (side * across, side * along), circled.gap)
    grooves = [_groove_arc(mount, plan) for mount in spec.mounts]
    for knuckle in layout.knuckles:
        ends = (knuckle.start, knuckle.end)
        for z in ends:
            if knuckle.owner == 0:  # the parent's barrel in the child's groove
                where = grooves[1] + np.radians(angle)
                add(where, layout.radius, z, (-1.0, 0.0), spec.clearance.radial)
            else:  # the child's barrel in the parent's
                add(pi - grooves[0], layout.radius, z, (1.0, 0.0), spec.clearance.radial)
    rims = (layout.radius - spec.chamfer, spec.pin.largest_radius(layout, spec.bore_form))
    for one, after in zip(layout.knuckles, layout.knuckles[1:], strict=False):
        direction = -1.0 if one.owner == 0 else 1.0
        for radius in rims:
            add(
                circle,
                radius,
                0.5 * (one.end + after.start),
                (0.0, direction),
                layout.clearance.axial,
            )
    return np.concatenate(points), np.concatenate(normals), np.concatenate(gaps)


def _groove_arc(mount: Mount, plan: SinglePlan) -> Floats:
    """Directions, in radians, in which a body has a groove; none where an arm keeps it away."""
    near, _, top, bottom = mount.limits(plan.layout, plan.spec.gap)
    reach = plan.layout.groove_radius
    if near >= reach or top >= reach:
        return np.empty(0)
    low = max(-asin(min(1.0, bottom / reach)), -acos(near / reach))
    high = -asin(max(-1.0, top / reach))
    return np.linspace(low, high, max(2, int((high - low) / _STEP) + 1))


def play(
    hinge: SingleHinge | DoubleHinge | SingleSpec | SinglePlan | DoublePlan,
    angle: float | None = None,
) -> Play:
    """Compute the play of a single or double hinge.

    Parameters
    ----------
    hinge : SingleHinge, DoubleHinge, or their plan or parameters
        The hinge.
    angle : float, optional
        Angle of a single hinge in degrees; the drawn pose when left out. What the two bodies lean
        on changes with it.

    Returns
    -------
    Play
        Play of the child against the parent.

    Raises
    ------
    HingeError
        If `hinge` is no hinge.

    Examples
    --------
    >>> from hinges import SingleHinge
    >>> found = play(SingleHinge(20, clearance=0.3), angle=60)
    >>> round(found.radial, 3), round(found.axial[1], 3)
    (0.424, 0.3)
    """
    from .plan_double import DoublePlan

    if isinstance(hinge, SingleSpec):
        plan: object = plan_single(hinge)
    else:
        plan = hinge if isinstance(hinge, SinglePlan | DoublePlan) else getattr(hinge, "plan", None)
    if isinstance(plan, SinglePlan):
        return _single(plan, plan.spec.angle if angle is None else angle)
    if isinstance(plan, DoublePlan):
        return total_play(_single(one, 90.0) for one in _axes(plan))
    raise HingeError(f"play() takes a SingleHinge or a DoubleHinge, not {type(hinge).__name__}")


def _axes(plan: DoublePlan) -> list[SinglePlan]:
    """Read each axis of a double hinge as a single hinge of the same knuckles."""
    spec = plan.spec
    like = SingleSpec.read(
        spec.size,
        radius=spec.radius,
        pin=spec.pin,
        clearance=spec.clearance,
        leaf=spec.bracket,
        gap=spec.gap,
        chamfer=spec.chamfer,
        margin=spec.margin,
        wall=spec.wall,
    )
    made = []
    for axis in (0, 1):
        layout = plan.layouts[0 if spec.same_edge else axis]
        if spec.same_edge:  # link, body, link: the knuckles on either side of one body's
            block = 2 * axis
            where = [i for i, knuckle in enumerate(layout.knuckles) if knuckle.owner == block]
            kept = layout.knuckles[where[0] - 1 : where[-1] + 2]
            kept = tuple(
                replace(knuckle, owner=0 if knuckle.owner == block else 1) for knuckle in kept
            )
            layout = replace(layout, knuckles=kept)
        none = HalfPlan((), (), ())
        made.append(SinglePlan(like, layout, 0.0, none, none, ()))
    return made


def _single(plan: SinglePlan, angle: float) -> Play:
    points, normals, gaps = contacts(plan, angle)
    shifts = []
    for direction in np.arange(0.0, 2.0 * pi, _STEP):
        closing = normals[:, 0] * np.cos(direction) + normals[:, 1] * np.sin(direction)
        binding = closing > 1e-9
        shifts.append(float(np.min(gaps[binding] / closing[binding])))
    along = []
    for direction in (-1.0, 1.0):
        closing = direction * normals[:, 2]
        binding = closing > 1e-9
        along.append(float(np.min(gaps[binding] / closing[binding], initial=np.inf)))
    directions = np.arange(0.0, 2.0 * pi, 4.0 * _STEP)
    tilts = [largest_tilt(points, normals, gaps, float(direction))[1] for direction in directions]
    return Play(max(shifts), min(shifts), (along[0], along[1]), degrees(max(tilts)))


def largest_tilt(
    points: Floats, normals: Floats, gaps: Floats, direction: float
) -> tuple[tuple[float, float, float], float]:
    """Tilt the child as far as its contacts allow.

    Parameters
    ----------
    points, normals, gaps : float64 arrays
        Contacts as :func:`contacts` gives them.
    direction : float
        Direction, in radians from +x, of the axis that it tilts about; it is square to the hinge's
        own.

    Returns
    -------
    shift : (float, float, float)
        How far the child's point at the origin moves with it, in mm.
    tilt : float
        Angle in radians.

    Raises
    ------
    HingeError
        If nothing limits it.
    """
    from scipy.optimize import linprog

    about = np.array([np.cos(direction), np.sin(direction), 0.0])
    turning = np.einsum("ij,ij->i", np.cross(about, points), normals)
    rows = np.column_stack([normals, turning])
    best = linprog(
        [0.0, 0.0, 0.0, -1.0], A_ub=rows, b_ub=gaps, bounds=[(None, None)] * 3 + [(0.0, None)]
    )
    if best.status != 0:
        raise HingeError("nothing limits the tilt of this hinge: its two halves do not meet")
    x, y, z, tilt = (float(value) for value in best.x)
    return (x, y, z), tilt
