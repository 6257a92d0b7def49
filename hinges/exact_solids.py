"""Exact solids of planned shapes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import lru_cache, partial

import build123d as bd

from .blank import rim
from .exceptions import HingeError
from .kernel_calls import across_axis, arced, cut, fused, through_axis
from .shapes import Blank, Bored, HalfPlan, Moved, Prism, Shape, Turned, bounds, meet

__all__ = ["build_all", "build_half", "build_shape", "laid", "one_part", "solids_of"]


def build_shape(shape: Shape) -> bd.Solid:
    """Build one shape.

    Parameters
    ----------
    shape : Shape
        What to build, in mm.

    Returns
    -------
    Solid
        The exact solid in mm.
    """
    if isinstance(shape, Moved):
        frame = bd.Plane(origin=shape.origin, x_dir=shape.x_dir, z_dir=shape.z_dir)
        return laid(build_shape(shape.shape), frame.location)
    start = bounds(shape)[2][0]
    return laid(_at_nought(_shifted(shape, -start)), bd.Pos(0, 0, start))


def laid(solid: bd.Solid, place: bd.Location) -> bd.Solid:
    """Lay a solid elsewhere without a copy of its surfaces.

    Parameters
    ----------
    solid : Solid
        The solid, which stays where it is.
    place : Location
        How it is moved.

    Returns
    -------
    Solid
        The solid in its new place; it shares its surfaces with the other one.
    """
    return bd.Solid(solid.wrapped.Moved(place.wrapped))


def _shifted(shape: Shape, by: float) -> Shape:
    """A shape moved along z; equal knuckles that begin at 0 are the same to the last bit."""
    if isinstance(shape, Bored):
        return Bored(_shifted(shape.shape, by), tuple(_shifted(cut, by) for cut in shape.cuts))
    if isinstance(shape, Blank):
        return Blank(replace(shape.web, start=0.0, end=round(shape.web.end + by, 9)), shape.radius)
    if isinstance(shape, Prism):
        low, high = round(shape.start + by, 9), round(shape.end + by, 9)
        return Prism(shape.outline, low, high, shape.holes)
    if isinstance(shape, Moved):
        x, y, z = shape.origin
        return replace(shape, origin=(x, y, round(z + by, 9)))
    outline = tuple((radius, round(z + by, 9)) for radius, z in shape.outline)
    return Turned(outline, shape.begin, shape.turn)


@lru_cache(maxsize=256)
def _at_nought(shape: Shape) -> bd.Solid:
    """Build a shape that begins at z = 0; knuckles of one row are mostly equal."""
    if isinstance(shape, Moved):
        return build_shape(shape)
    if isinstance(shape, Bored):
        (whole,) = cut([_at_nought(shape.shape)], map(build_shape, shape.cuts), joined=True)
        return whole
    if isinstance(shape, Blank):
        web = shape.web
        face = arced(rim(shape), shape.radius, web.start)
        return bd.Solid.extrude(face, bd.Vector(0, 0, web.end - web.start))
    if isinstance(shape, Prism):
        face = across_axis((shape.outline, *shape.holes), shape.start)
        return bd.Solid.extrude(face, bd.Vector(0, 0, shape.end - shape.start))
    turned = bd.Solid.revolve(through_axis(shape.outline), shape.turn, bd.Axis.Z)
    return turned.rotate(bd.Axis.Z, shape.begin) if shape.begin else turned


def solids_of(shape: bd.Shape | Iterable[bd.Shape]) -> list[bd.Solid]:
    """List the solids of whatever a boolean operation gave.

    Parameters
    ----------
    shape : Shape or iterable of Shape
        One shape, or several.

    Returns
    -------
    list of Solid
        All solids in it, in their order.
    """
    if hasattr(shape, "solids"):
        return list(shape.solids())
    return [solid for piece in shape for solid in piece.solids()]


def one_part(solids: Sequence[bd.Solid]) -> bd.Part:
    """Gather solids in one part.

    Parameters
    ----------
    solids : sequence of Solid
        The solids, which are not united.

    Returns
    -------
    Part
        A part that holds them.
    """
    return bd.Part(list(solids))


def build_all(shapes: Sequence[Shape]) -> bd.Part:
    """Build shapes and unite them.

    Parameters
    ----------
    shapes : sequence of Shape
        What to build, in mm.

    Returns
    -------
    Part
        The united solids; neighbours that only touch stay apart.
    """
    built = [build_shape(shape) for shape in shapes]
    if len(built) < 2:
        return one_part(built)
    return one_part(fused(built, joined=True))


def build_half(plan: HalfPlan, name: str) -> bd.Part:
    """Build ``(web - carve) + add - bore``.

    Parameters
    ----------
    plan : HalfPlan
        Shapes of the half, in mm.
    name : str
        Name of the half, for messages.

    Returns
    -------
    Part
        The half: exactly one valid solid.

    Raises
    ------
    HingeError
        If the kernel returned anything else.
    """
    for way in _ways(plan):
        pieces = way(plan)
        if len(pieces) == 1 and _valid(pieces[0]):
            return one_part(pieces)
    raise HingeError(
        f"the {name} half came out as {len(pieces)} solids, not as one valid solid: check that "
        "its bracket or leaf reaches all of its knuckles, or move a size by a hundredth of a mm"
    )


def _ways(plan: HalfPlan) -> list[Callable[[HalfPlan], list[bd.Solid]]]:
    """How a half can be built, the fastest way first."""
    ways = [_notched] if plan.blank else []
    return [*ways, partial(_welded, glued=True), _welded] if plan.seat else [*ways, _welded]


def _notched(plan: HalfPlan) -> list[bd.Solid]:
    """Cut a half from its blank, whatever comes out: one operation, of surfaces that cross."""
    assert plan.blank is not None
    cuts = (*plan.notches, *plan.bore)
    # Turned notches are clear of one another and leave no two faces side by side in one surface.
    joined = not all(_is_turned(shape) for shape in cuts)
    return cut([build_shape(plan.blank)], map(build_shape, cuts), joined=joined)


def _is_turned(shape: Shape) -> bool:
    """Whether a shape was turned, wherever it lies."""
    return isinstance(shape.shape if isinstance(shape, Moved) else shape, Turned)


def _welded(plan: HalfPlan, *, glued: bool = False) -> list[bd.Solid]:
    """Build a half from its shapes, whatever comes out; the last step joins its faces.

    Glued, the webs are cut so that they only touch their knuckles: surfaces that touch need not be
    intersected, which is twice as fast.
    """
    added = [build_shape(shape) for shape in plan.add]
    pieces = [build_shape(shape) for shape in plan.web]
    room = [bounds(shape) for shape in plan.web]
    cuts = [
        build_shape(shape)
        for shape in (plan.seat if glued else plan.carve)
        if any(meet(bounds(shape), each) for each in room)
    ]
    if len(pieces) > 1:
        pieces = fused(pieces, joined=False)
    if cuts:
        pieces = cut(pieces, cuts, joined=False)
    solids = fused([*pieces, *added], glued=glued, joined=not plan.bore)
    if not plan.bore or not solids:
        return solids
    return solids[1:] + cut(solids[:1], map(build_shape, plan.bore), joined=True)


def _valid(solid: bd.Solid) -> bool:
    valid = solid.is_valid  # a property from build123d 0.10 on, a method before
    return bool(valid() if callable(valid) else valid)
