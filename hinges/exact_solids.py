"""Exact solids of planned shapes, built with build123d's own interface only."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from .exceptions import HingeError
from .shapes import HalfPlan, Moved, Prism, Shape

if TYPE_CHECKING:
    import build123d as bd

__all__ = ["build_all", "build_half", "build_shape", "one_part"]


def build_shape(shape: Shape) -> bd.Solid:
    """Build one shape.

    Parameters
    ----------
    shape : Turned, Prism or Moved
        What to build, in mm.

    Returns
    -------
    Solid
        The exact solid in mm.
    """
    import build123d as bd

    if isinstance(shape, Moved):
        frame = bd.Plane(origin=shape.origin, x_dir=shape.x_dir, z_dir=shape.z_dir)
        return build_shape(shape.shape).moved(frame.location)
    if isinstance(shape, Prism):
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
    carves = [build_shape(shape) for shape in plan.carve]
    webs = [build_shape(shape) for shape in plan.web]
    body = webs[0].fuse(*webs[1:]) if len(webs) > 1 else webs[0]
    pieces = solids_of(body.cut(*carves) if carves else body)
    added = [build_shape(shape) for shape in plan.add]
    whole = pieces[0].fuse(*pieces[1:], *added)
    if plan.bore:
        solids = solids_of(whole)
        whole = solids[0].cut(*(build_shape(shape) for shape in plan.bore))
        pieces = solids[1:] + solids_of(whole)
    else:
        pieces = solids_of(whole)
    if len(pieces) != 1 or not _valid(pieces[0]):
        raise HingeError(
            f"the {name} half came out as {len(pieces)} solids, not as one valid solid: check that "
            "its bracket or leaf reaches all of its knuckles, or move a size by a hundredth of a mm"
        )
    return one_part(pieces)


def _valid(solid: bd.Solid) -> bool:
    valid = solid.is_valid  # a property from build123d 0.10 on, a method before
    return bool(valid() if callable(valid) else valid)
