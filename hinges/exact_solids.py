"""Exact solids of planned shapes, built with build123d's own interface only."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

from .exceptions import HingeError
from .shapes import Bored, Bounds, HalfPlan, Moved, Prism, Shape, Turned, bounds

if TYPE_CHECKING:
    import build123d as bd

#: Boxes that share less than this, in mm, only touch.
_TOUCH = 1e-6

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
    import build123d as bd

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
    import build123d as bd

    return bd.Solid(solid.wrapped.Moved(place.wrapped))


def _shifted(shape: Shape, by: float) -> Shape:
    """A shape moved along z; equal knuckles that begin at 0 are the same to the last bit."""
    if isinstance(shape, Bored):
        return Bored(_shifted(shape.shape, by), tuple(_shifted(cut, by) for cut in shape.cuts))
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
    import build123d as bd

    if isinstance(shape, Moved):
        return build_shape(shape)
    if isinstance(shape, Bored):
        (whole,) = solids_of(_at_nought(shape.shape).cut(*map(build_shape, shape.cuts)))
        return whole
    if isinstance(shape, Prism):
        corners = set(shape.outline)
        (west, east), (south, north), _ = bounds(shape)
        if corners == {(x, y) for x in (west, east) for y in (south, north)} and not shape.holes:
            frame = bd.Plane(origin=(west, south, shape.start))
            return bd.Solid.make_box(east - west, north - south, shape.end - shape.start, frame)
        rim, *inner = (
            bd.Wire.make_polygon([(x, y, shape.start) for x, y in outline], close=True)
            for outline in (shape.outline, *shape.holes)
        )
        return bd.Solid.extrude(bd.Face(rim, inner), bd.Vector(0, 0, shape.end - shape.start))
    rim = bd.Wire.make_polygon([(r, 0, z) for r, z in shape.outline], close=True)
    turned = bd.Solid.revolve(bd.Face(rim), shape.turn, bd.Axis.Z)
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
    import build123d as bd

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
    return one_part(solids_of(built[0].fuse(*built[1:])))


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
    for glued in (True, False) if plan.seat else (False,):
        pieces = _half(plan, glued=glued)
        if len(pieces) == 1 and _valid(pieces[0]):
            return one_part(pieces)
    raise HingeError(
        f"the {name} half came out as {len(pieces)} solids, not as one valid solid: check that "
        "its bracket or leaf reaches all of its knuckles, or move a size by a hundredth of a mm"
    )


def _half(plan: HalfPlan, *, glued: bool) -> list[bd.Solid]:
    """Build a half from its shapes, whatever comes out.

    Glued, the webs are cut so that they only touch their knuckles: surfaces that touch need not be
    intersected, which is twice as fast.
    """
    import build123d as bd

    added = [build_shape(shape) for shape in plan.add]
    webs = [build_shape(shape) for shape in plan.web]
    room = [bounds(shape) for shape in plan.web]
    cuts = [
        build_shape(shape)
        for shape in (plan.seat if glued else plan.carve)
        if any(_meet(bounds(shape), each) for each in room)
    ]
    with bd.SkipClean():  # The last step joins faces that lie in one surface.
        body = webs[0].fuse(*webs[1:]) if len(webs) > 1 else webs[0]
        pieces = solids_of(body.cut(*cuts) if cuts else body)
    if not plan.bore:
        return solids_of(pieces[0].fuse(*pieces[1:], *added, glue=glued))
    with bd.SkipClean():
        solids = solids_of(pieces[0].fuse(*pieces[1:], *added, glue=glued))
    return solids[1:] + solids_of(solids[0].cut(*(build_shape(shape) for shape in plan.bore)))


def _meet(one: Bounds, other: Bounds) -> bool:
    """Whether two boxes share room."""
    return all(
        a0 < b1 - _TOUCH and b0 < a1 - _TOUCH for (a0, a1), (b0, b1) in zip(one, other, strict=True)
    )


def _valid(solid: bd.Solid) -> bool:
    valid = solid.is_valid  # a property from build123d 0.10 on, a method before
    return bool(valid() if callable(valid) else valid)
