"""Letting the half of a hinge into its body: what is refused, and what is trimmed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from build123d import BuildPart, Location, Part, Plane, Solid

from .arm import Arm, Mount
from .exact_solids import build_shape, solids_of
from .exceptions import HingeError
from .leaf import Leaf
from .placement import HingedPart, keep_joints
from .shapes import box, cylinder

__all__ = ["frame_at", "let_in", "one_body", "require_edge"]

#: What may stand out of a body without being trimmed, in mm³.
_SLIVER = 1e-3


def frame_at(at: Location | Plane | None) -> Location:
    """Where a hinge is let in.

    Parameters
    ----------
    at : Location, Plane or None
        As the user gave it.

    Returns
    -------
    Location
        The frame; that of the hinge itself where nothing was given.
    """
    return at.location if isinstance(at, Plane) else (at or Location())


def one_body(body: Any, name: str) -> Part | Solid:
    """Read a body that a hinge is let into.

    Parameters
    ----------
    body : Part, Solid or BuildPart
        As the user gave it.
    name : str
        What to call it.

    Returns
    -------
    Part or Solid
        With exactly one solid.

    Raises
    ------
    HingeError
        If it is no body, or not one.
    """
    if isinstance(body, BuildPart):
        body = body.part
    if not hasattr(body, "solids"):
        raise HingeError(f"the {name} body is {body!r}: give a Part, a Solid or a BuildPart")
    count = len(body.solids())
    if count != 1:
        raise HingeError(
            f"the {name} body has {count} solids: a hinge is let into one; fuse them, or give the "
            "one that carries it"
        )
    result: Part | Solid = body
    return result


def require_edge(
    body: Part | Solid, name: str, frame: Location, ends: tuple[float, float], leaf: Mount
) -> None:
    """Refuse a hinge that is longer than its body.

    Parameters
    ----------
    body : Part or Solid
        The body.
    name : str
        What to call it.
    frame : Location
        The hinge's frame.
    ends : (float, float)
        First and last z of the knuckles, in mm.
    leaf : Bracket, Leaf or Arm
        What joins the knuckles; a leaf carries them without the body.

    Raises
    ------
    HingeError
        If knuckles would hang in the air beside it.
    """
    if isinstance(leaf, Leaf):
        return
    bounds = body.moved(frame.inverse()).bounding_box()
    low, high = bounds.min.Z, bounds.max.Z
    over = max(low - ends[0], ends[1] - high)
    if over > 0.01:
        raise HingeError(
            f"the hinge's knuckles are {ends[1] - ends[0]:.4g} mm long and reach {over:.3g} mm "
            f"beyond the {name} body, which is {high - low:.4g} mm long there: use a shorter "
            "length, or move the hinge along the edge"
        )


def let_in(
    body: Part | Solid,
    name: str,
    half: Part,
    carve: Part,
    frame: Location,
    barrel: float,
    leaf: Mount,
) -> HingedPart:
    """Cut and add: ``body - carve + half``, with what would stand out of the body trimmed.

    A bracket may fill a hollow of its body, behind a thin wall; out of the body's bounds, laid
    along the hinge's frame, it may not stand.

    Parameters
    ----------
    body : Part or Solid
        The body.
    name : str
        What to call it.
    half, carve : Part
        The hinge's, in their places.
    frame : Location
        The hinge's frame as it lies on the body, its axis along z.
    barrel : float
        Radius in mm about the axis that belongs to the hinge.
    leaf : Bracket, Leaf or Arm
        What joins the knuckles; a bracket lies in its body and nowhere else, an arm does not reach
        below it.

    Returns
    -------
    HingedPart
        The body with its half; its joints, label and colour are kept.

    Raises
    ------
    HingeError
        If it does not come out in one piece.
    """
    added = half.solids()
    if not isinstance(leaf, Leaf):
        added = _trimmed(added, body, frame, barrel, outside=isinstance(leaf, Arm))
    solids = solids_of(solids_of(body)[0].cut(*carve.solids()))
    fitted = HingedPart(solids_of(solids[0].fuse(*solids[1:], *added)))
    if len(fitted.solids()) != 1:
        raise HingeError(
            f"the {name} body came out in {len(fitted.solids())} pieces: it must reach the "
            f"{'arm' if isinstance(leaf, Arm) else 'bracket'} of its half, and the carve must not "
            f"cut it in two{_where(body, frame) if isinstance(leaf, Arm) else ''}"
        )
    fitted.label = body.label or name
    fitted.color = body.color
    keep_joints(body, fitted)
    return fitted


def _trimmed(
    added: Sequence[Solid],
    body: Part | Solid,
    frame: Location,
    barrel: float,
    *,
    outside: bool,
) -> list[Solid]:
    """The solids of a half without what stands out of the body's bounds; of arms, below it only."""
    bounds = body.moved(frame.inverse()).bounding_box()
    length = 2.0 * max(solid.bounding_box().diagonal for solid in added)
    limits = [bounds.min.X, bounds.max.X, bounds.min.Y, bounds.max.Y, bounds.min.Z, bounds.max.Z]
    if outside:
        limits = [-length, length, bounds.min.Y, length, -length, length]
    room = build_shape(box(*limits))
    own = [room.moved(frame), build_shape(cylinder(barrel, -length, length)).moved(frame)]
    kept: list[Solid] = []
    for solid in added:
        stray = [piece for piece in solids_of(solid.cut(*own)) if piece.volume > _SLIVER]
        kept += solids_of(solid.cut(*stray)) if stray else [solid]
    return kept


def _where(body: Part | Solid, frame: Location) -> str:
    """Where a body lies about the axis, for a message."""
    bounds = body.moved(frame.inverse()).bounding_box()
    aside = min(bounds.max.X, -bounds.min.X, key=abs)
    return (
        f"; its wall lies {abs(aside):.3g} mm beside the axis (offset) and its top "
        f"{-bounds.max.Y:.3g} mm below it (rise and half the gap)"
    )
