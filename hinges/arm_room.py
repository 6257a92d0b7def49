"""Whether the arms of a hinge keep clear of the other body, looked at across the axis.

Each body is taken to fill the quadrant that its mount leaves it, but for the groove of the barrel.
Below 0° a body that large meets everything; there the child is taken to be as thick as the foot of
its arm, and below -90° the parent too. The turn of the bodies themselves is looked at when the
hinge is let into them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from .arm import Arm, Mount, corner_of
from .fit import at_least
from .knuckles import KnuckleLayout

if TYPE_CHECKING:
    from manifold3d import CrossSection

__all__ = ["check_arms"]

#: Larger than the bodies near a hinge, in mm.
_FAR = 300.0
#: What circles of many corners are off by, in mm.
_ROUNDING = 0.005
#: Step of the angles, in degrees.
_STEP = 5.0
#: What two outlines may share without meeting, in mm².
_NOTHING = 1e-6


def check_arms(
    mounts: tuple[Mount, Mount], layout: KnuckleLayout, gap: float, limits: tuple[float, float]
) -> None:
    """Refuse arms that meet the other body, and bodies that meet one another, as they turn.

    Parameters
    ----------
    mounts : (Mount, Mount)
        What joins the knuckles of parent and child to their bodies, at least one of them an arm.
    layout : KnuckleLayout
        The knuckles of the axis.
    gap : float
        Distance between the two bodies in mm.
    limits : (float, float)
        Lowest and highest angle in degrees.

    Raises
    ------
    FitError
        If less than the clearance stays between what passes.
    """
    low, high = limits
    corners = [corner_of(mount, layout, gap) for mount in mounts]
    if low <= 0.0:
        at_least(
            "gap",
            "the distance of the two walls at 0°",
            corners[0][0] + corners[1][0],
            gap,
            "use larger offsets, or a range that begins above 0°",
        )
    if high >= 180.0:
        at_least(
            "range",
            "the distance of the two tops at 180°",
            corners[0][1] + corners[1][1],
            gap,
            "use rises that are not below 0 together (Arm.pair), or a range that ends before 180°",
        )
    room = min(layout.clearance.radial, gap)
    bodies = [_quadrant(*corner, layout.groove_radius) for corner in corners]
    arms = [mount.section(layout, gap) if isinstance(mount, Arm) else None for mount in mounts]
    inside = _angles(max(low, 0.0), min(high, 180.0))
    larger = "use a larger offset, a taller height, clear_top=True, or a smaller range"
    parent, child = (_mirrored(bodies[0]), bodies[1])
    for angle in (*_angles(low, 0.0), *inside):
        if arms[1] is not None:
            beside = parent if angle >= -90.0 else _mirrored(_foot(mounts[0], layout, gap))
            what = "the child's arm beside the parent"
            _keep_apart(what, arms[1].rotate(angle), beside, room, angle, larger)
        if arms[0] is not None and angle >= 0.0:
            turned = _mirrored(arms[0]).rotate(-angle)
            _keep_apart("the parent's arm beside the child", turned, child, room, angle, larger)
        if arms[0] is not None and angle < 0.0:
            turned = _foot(mounts[1], layout, gap).rotate(angle)
            beside = parent if angle >= -90.0 else _mirrored(_foot(mounts[0], layout, gap))
            advice = (
                "use a larger offset of the parent, or a child's arm with a smaller foot "
                "(angle=90, clear_top=True)"
            )
            _keep_apart("the child beside the parent", turned, beside, room, angle, advice)
            advice = "use a larger offset of the child, or angle=90 and clear_top=True"
            what = "the child beside the parent's arm"
            _keep_apart(what, turned, _mirrored(arms[0]), room, angle, advice)


def _foot(mount: Mount, layout: KnuckleLayout, gap: float) -> CrossSection:
    """The least body of a child that stands on its arm: as thick as the arm's foot."""
    from manifold3d import CrossSection

    near, _, _, bottom = mount.limits(layout, gap)
    least = _box(near, _FAR, -bottom, -corner_of(mount, layout, gap)[1])
    return least - CrossSection.circle(layout.groove_radius, 128)


def _angles(low: float, high: float) -> Sequence[float]:
    """Angles from one to another, both among them; none where there is no way between."""
    if high <= low:
        return () if high < low else (low,)
    count = max(1, round((high - low) / _STEP))
    return tuple(low + (high - low) * index / count for index in range(count + 1))


def _box(west: float, east: float, south: float, north: float) -> CrossSection:
    from manifold3d import CrossSection

    return CrossSection([[(west, south), (east, south), (east, north), (west, north)]])


def _quadrant(aside: float, below: float, groove: float) -> CrossSection:
    """The child's body across the axis, without the groove."""
    from manifold3d import CrossSection

    return _box(aside, _FAR, -_FAR, -below) - CrossSection.circle(groove, 128)


def _mirrored(section: CrossSection) -> CrossSection:
    """The same on the parent's side."""
    return section.mirror((1.0, 0.0))


def _keep_apart(
    what: str, one: CrossSection, other: CrossSection, room: float, angle: float, advice: str
) -> None:
    """Refuse outlines that are nearer than the room between them."""
    if _apart(one, other, room - _ROUNDING):
        return
    least, most = 0.0, room
    for _ in range(8):
        middle = 0.5 * (least + most)
        least, most = (middle, most) if _apart(one, other, middle) else (least, middle)
    at_least("arm", f"the room of {what} at {angle:.4g}°", least, room, advice)


def _apart(one: CrossSection, other: CrossSection, room: float) -> bool:
    from manifold3d import JoinType

    grown = one.offset(room, JoinType.Round, circular_segments=64) if room > 0.0 else one
    return float((grown ^ other).area()) <= _NOTHING
