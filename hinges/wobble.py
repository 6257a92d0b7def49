"""How much a joint wobbles, from its clearances and its geometry.

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

from .errors import HingeError
from .plan import HalfPlan, SinglePlan, SingleSpec, plan_single

if TYPE_CHECKING:
    from .plan_double import DoublePlan

__all__ = ["Play", "chain", "play"]

Floats = NDArray[np.float64]
_STEP = pi / 48.0


@dataclass(frozen=True)
class Play:
    """Play of a joint, or of a chain of joints.

    Attributes
    ----------
    radial : float
        Largest shift across the axis in mm, over all directions, from the centred position.
    radial_least : float
        The same in the direction that allows least.
    axial : (float, float)
        Shift along -z and +z in mm.
    tilt : float
        Largest rocking of the child out of its plane, to one side, in degrees.
    """

    radial: float
    radial_least: float
    axial: tuple[float, float]
    tilt: float

    def at(self, distance: float) -> float:
        """Largest shift in mm of a point of the child at a `distance` in mm from the axis."""
        return self.radial + distance * float(np.radians(self.tilt))


def chain(links: Iterable[Play]) -> Play:
    """Add up the play of joints in a row, each at its worst.

    Parameters
    ----------
    links : iterable of Play

    Returns
    -------
    Play
        Of the last body against the first; shifts that a rocking joint adds over the length of a
        link are not in it, see :meth:`Play.at`.

    Raises
    ------
    HingeError
        If there is no joint.
    """
    all_of = list(links)
    if not all_of:
        raise HingeError("a chain needs at least one joint")
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
    angle : float
        Of the hinge in degrees.

    Returns
    -------
    points : (n, 3) float64 array
        In mm.
    normals : (n, 3) float64 array
        Direction in which the child closes the gap there.
    gaps : (n,) float64 array
        In mm.
    """
    spec, train = plan.spec, plan.train
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

    holder = train.holder
    for ring in spec.pin.rings(train):
        # the other's surface lies outside the holder's: a motion against the normal closes it
        side = -1.0 if holder == 0 else 1.0
        add(circle, ring.radius, ring.z, (side * ring.normal[0], side * ring.normal[1]), ring.gap)
    _, far, top, bottom = spec.leaf.limits(train, spec.gap)
    reach = train.reach
    low = -asin(min(1.0, bottom / reach))
    if far > 0.0:
        low = max(low, -acos(min(1.0, 0.5 * spec.gap / reach)))
    high = -asin(min(1.0, top / reach))
    count = max(2, int((high - low) / _STEP) + 1)
    arc = np.linspace(low, high, count)
    for span in train.spans:
        ends = (span.start, span.end)
        for z in ends:
            if span.owner == 0:  # the parent's barrel in the child's groove
                add(arc + np.radians(angle), train.radius, z, (-1.0, 0.0), spec.clearance.radial)
            else:  # the child's barrel in the parent's
                add(pi - arc, train.radius, z, (1.0, 0.0), spec.clearance.radial)
    rims = (train.radius - spec.chamfer, spec.pin.reach(train, spec.roof))
    for one, after in zip(train.spans, train.spans[1:], strict=False):
        direction = -1.0 if one.owner == 0 else 1.0
        for radius in rims:
            add(
                circle,
                radius,
                0.5 * (one.end + after.start),
                (0.0, direction),
                train.clearance.axial,
            )
    return np.concatenate(points), np.concatenate(normals), np.concatenate(gaps)


def play(hinge: object, angle: float | None = None) -> Play:
    """Work out the play of a single or double hinge.

    Parameters
    ----------
    hinge : SingleHinge, DoubleHinge or SingleSpec
    angle : float, optional
        Of a single hinge in degrees; the drawn pose when left out. What the two bodies lean on
        changes with it.

    Returns
    -------
    Play
        For a double hinge, of the child against the parent.

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
        return chain(_single(one, 90.0) for one in _axes(plan))
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
        train = plan.trains[0 if spec.same_edge else axis]
        if spec.same_edge:  # link, body, link: the knuckles on either side of one body's
            block = 2 * axis
            where = [i for i, span in enumerate(train.spans) if span.owner == block]
            kept = train.spans[where[0] - 1 : where[-1] + 2]
            kept = tuple(replace(span, owner=0 if span.owner == block else 1) for span in kept)
            train = replace(train, spans=kept)
        none = HalfPlan((), (), ())
        made.append(SinglePlan(like, train, 0.0, none, none, ()))
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
        along.append(float(np.min(gaps[binding] / closing[binding])))
    directions = np.arange(0.0, 2.0 * pi, 4.0 * _STEP)
    tilts = [rock(points, normals, gaps, float(direction))[1] for direction in directions]
    return Play(max(shifts), min(shifts), (along[0], along[1]), degrees(max(tilts)))


def rock(
    points: Floats, normals: Floats, gaps: Floats, direction: float
) -> tuple[tuple[float, float, float], float]:
    """Rock the child as far as its contacts allow.

    Parameters
    ----------
    points, normals, gaps
        As :func:`contacts` gives them.
    direction : float
        Of the axis that it rocks about, across the hinge's own, in radians from +x.

    Returns
    -------
    shift : (x, y, z)
        Of the child's point at the origin in mm.
    tilt : float
        In radians.

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
        raise HingeError("nothing limits the rocking of this hinge: its two halves do not meet")
    x, y, z, tilt = (float(value) for value in best.x)
    return (x, y, z), tilt
