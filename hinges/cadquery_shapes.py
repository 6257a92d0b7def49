"""Shapes between CadQuery and build123d, and places on edges of CadQuery's."""

from __future__ import annotations

from typing import Any

import cadquery as cq

from .exceptions import HingeError

__all__ = ["edge_place", "from_cadquery", "to_cadquery"]


def to_cadquery(part: Any) -> cq.Shape:
    """Hand a build123d shape to CadQuery.

    Parameters
    ----------
    part : build123d Shape
        What to hand over.

    Returns
    -------
    cadquery Shape
        Shape of the matching class, on the same kernel object. A part of one solid comes as a
        Solid.
    """
    solids = part.solids() if hasattr(part, "solids") else []
    return cq.Shape.cast(solids[0].wrapped if len(solids) == 1 else part.wrapped)


def from_cadquery(shape: Any) -> Any:
    """Hand a CadQuery shape, or the solids of a Workplane, to build123d.

    Parameters
    ----------
    shape : cadquery Shape or Workplane
        What to hand over.

    Returns
    -------
    build123d Part
        Part on the same kernel objects.

    Raises
    ------
    HingeError
        If there is no solid in it.
    """
    import build123d as bd

    if isinstance(shape, cq.Workplane):
        solids = [one for value in shape.vals() if isinstance(value, cq.Shape) for one in value]
        found = [solid for one in solids for solid in one.Solids()] or [
            solid for value in shape.vals() for solid in value.Solids()
        ]
    else:
        found = shape.Solids()
    if not found:
        raise HingeError("there is no solid in this CadQuery shape")
    return bd.Part([bd.Solid(solid.wrapped) for solid in found])


def edge_place(
    body: Any,
    edge: cq.Edge,
    side: str,
    outwards: tuple[float, float, float] | None,
    corner: tuple[float, float],
) -> cq.Location:
    """Lay a hinge on an edge of a body, half a gap off both of its faces or as its arm reaches.

    Parameters
    ----------
    body : cadquery Shape
        The body.
    edge : cadquery Edge
        An edge of it.
    side : {"parent", "child"}
        Which of the two bodies it is.
    outwards : (float, float, float) or None
        Direction out of both bodies.
    corner : (float, float)
        How far the edge lies aside of the axis and below it, in mm.

    Returns
    -------
    cadquery Location
        The hinge's frame.

    Raises
    ------
    HingeError
        If the direction is missing, or no face at the edge looks there.
    """
    import build123d as bd

    from .edges import faces_at

    if outwards is None:
        raise HingeError(
            "a hinge on an edge needs the direction out of both bodies, such as "
            "outwards=(0, 0, 1): the face that looks there stays outside, the other one meets the "
            "other body"
        )
    line = bd.Edge(edge.wrapped)
    normals = faces_at(from_cadquery(body), line)
    out = bd.Vector(*outwards).normalized()
    outer, inner = sorted(normals, key=lambda normal: -normal.dot(out))
    if (outer - out).length > 1e-6 or abs(outer.dot(inner)) > 1e-6:
        raise HingeError(
            f"no face at the edge looks in the direction {tuple(outwards)}, or the two are not "
            "square to one another"
        )
    origin = line.position_at(0.5) + inner * corner[0] + outer * corner[1]
    across = inner if side == "parent" else -inner
    return cq.Location(
        cq.Plane(tuple(origin), xDir=tuple(across), normal=tuple(across.cross(outer)))
    )
