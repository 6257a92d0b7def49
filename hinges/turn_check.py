"""Refusing bodies that cannot turn on their hinge, with what to change."""

from __future__ import annotations

from build123d import Part

from .exceptions import HingeError
from .plan_single import SingleSpec
from .turn_sweep import single_sweep, spread

__all__ = ["require_turn"]

#: What bumps of detents and faces of stops may share with their partner, in mm³.
_PRESSED = 0.5


def require_turn(spec: SingleSpec, parent: Part, child: Part, joint: str) -> None:
    """Refuse bodies that meet as they turn, or that print in one piece.

    Parameters
    ----------
    spec : SingleSpec
        The hinge.
    parent, child : Part
        The bodies with their halves.
    joint : str
        Name of the joint on both.

    Raises
    ------
    HingeError
        If they overlap at some angle of the range; or lie nearer than half the clearance as they
        are drawn, where they are printed together.
    """
    least = 0.5 * min(spec.gap, spec.clearance.least)
    frames = parent.joints[joint].location, child.joints[joint].location
    angles = (spec.angle, *spread(*spec.angular_range, 15.0))
    swept = single_sweep(parent, child, frames, angles, least)
    worst, drawn = swept.worst, swept.poses[0]
    if worst.overlap <= _PRESSED:
        if spec.pin.printed and drawn.gap < least:
            raise HingeError(
                f"at the drawn angle the bodies are {drawn.gap:.3g} mm apart and print in one "
                f"piece: keep each half a gap ({0.5 * spec.gap:g} mm) inside its quadrant, "
                "away from the face that they share and from the outer one"
            )
        return
    # Seen from the hinge's frame, the child as it lies at angle 0.
    boxes = [
        body.moved(body.joints[joint].location.inverse()).bounding_box() for body in (parent, child)
    ]
    tops = [box.max.Y - 0.5 * spec.gap for box in boxes]
    high = max(range(2), key=lambda index: tops[index])
    if boxes[0].center().X > 0.0 > boxes[1].center().X:
        advice = (
            "parent and child lie the wrong way round: swap them, or turn the direction along "
            "the edge about"
        )
    elif worst.angle < 0.0:
        offset = 0.5 * spec.gap - boxes[1].min.Y
        advice = (
            "below 0° the child hangs beside the wall of its parent, which its thickness takes: "
            f"give the parent's arm an offset of {offset:.3g} mm or more"
            if worst.angle >= -90.0
            else "below -90° the child goes on under its parent: that takes a thin parent, or a "
            "range that ends before"
        )
    elif tops[high] > spec.radius + 0.1 and not spec.on_arms:
        advice = (
            f"the {('parent', 'child')[high]} reaches {tops[high]:.3g} mm outwards beyond the "
            "axis: put the axis on its outer edge, or give the angular_range that it can turn"
        )
    else:
        within = (
            "behind the walls and below the tops that their arms reach"
            if spec.on_arms
            else "in their quadrants beside and below the axis"
        )
        advice = f"keep both {within}, or give the angular_range that they can turn"
    raise HingeError(
        f"at {worst.angle:.4g}° the bodies overlap by {worst.overlap:.4g} mm³: {advice}"
    )
