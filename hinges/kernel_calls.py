"""Direct calls of the CAD kernel: what build123d asks of it more of than hinges need.

Its booleans keep the history of every face and start threads, its faces are repaired and checked
although outlines are plane and closed. On solids as small as knuckles that is a fifth of the time.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import build123d as bd
from OCP.BOPAlgo import BOPAlgo_GlueEnum
from OCP.BRepAlgoAPI import BRepAlgoAPI_BooleanOperation, BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakePolygon,
    BRepBuilderAPI_MakeWire,
)
from OCP.gp import gp_Ax2, gp_Circ, gp_Dir, gp_Pln, gp_Pnt
from OCP.ShapeFix import ShapeFix_Face
from OCP.ShapeUpgrade import ShapeUpgrade_UnifySameDomain
from OCP.TopoDS import TopoDS_Wire

from .shapes import Point

try:  # Since the kernel of build123d 0.13.
    from OCP.collections import List_TopoDS_Shape as ShapeList
except ImportError:
    from OCP.TopTools import TopTools_ListOfShape as ShapeList

__all__ = ["across_axis", "arced", "cut", "fused", "through_axis"]


def across_axis(rims: Sequence[Sequence[Point]], z: float) -> bd.Face:
    """Draw a face across the z axis.

    Parameters
    ----------
    rims : sequence of outlines
        Corners (x, y) in mm of the outer outline, and of holes inside it.
    z : float
        Where it lies, in mm.

    Returns
    -------
    Face
        Looking along +z.
    """
    outer, *inner = (_polygon([(x, y, z) for x, y in rim]) for rim in rims)
    made = BRepBuilderAPI_MakeFace(gp_Pln(gp_Pnt(0.0, 0.0, z), gp_Dir(0.0, 0.0, 1.0)), outer)
    for wire in inner:
        made.Add(wire)
    if not inner:
        return bd.Face(made.Face())
    turned = ShapeFix_Face(made.Face())  # Holes run the other way round.
    turned.FixOrientation()
    return bd.Face(turned.Face())


def through_axis(rim: Sequence[Point]) -> bd.Face:
    """Draw a face in the half-plane of the x and z axes.

    Parameters
    ----------
    rim : sequence of (radius, z)
        Corners in mm.

    Returns
    -------
    Face
        To be turned about the z axis.
    """
    wire = _polygon([(radius, 0.0, z) for radius, z in rim])
    plane = gp_Pln(gp_Pnt(), gp_Dir(0.0, -1.0, 0.0))
    return bd.Face(BRepBuilderAPI_MakeFace(plane, wire).Face())


def arced(corners: Sequence[Point], radius: float, z: float) -> bd.Face:
    """Draw a face across the z axis that an arc about this axis closes.

    Parameters
    ----------
    corners : sequence of (x, y)
        In mm, counter-clockwise; the first and the last lie on the arc, which runs
        counter-clockwise from the last to the first.
    radius : float
        Radius of the arc in mm.
    z : float
        Where it lies, in mm.

    Returns
    -------
    Face
        Looking along +z.
    """
    points = [gp_Pnt(x, y, z) for x, y in corners]
    side = BRepBuilderAPI_MakePolygon()
    for point in points:
        side.Add(point)
    middle, up = gp_Pnt(0.0, 0.0, z), gp_Dir(0.0, 0.0, 1.0)
    circle = gp_Circ(gp_Ax2(middle, up), radius)
    rim = BRepBuilderAPI_MakeWire(side.Wire())
    rim.Add(BRepBuilderAPI_MakeEdge(circle, points[-1], points[0]).Edge())
    return bd.Face(BRepBuilderAPI_MakeFace(gp_Pln(middle, up), rim.Wire()).Face())


def cut(bodies: Iterable[bd.Shape], tools: Iterable[bd.Shape], *, joined: bool) -> list[bd.Solid]:
    """Cut shapes out of bodies.

    Parameters
    ----------
    bodies : iterable of Shape
        The bodies.
    tools : iterable of Shape
        What is cut out of them.
    joined : bool
        Whether faces side by side that lie in one surface are joined to one.

    Returns
    -------
    list of Solid
        What is left; empty if the kernel failed.
    """
    return _solids(BRepAlgoAPI_Cut(), bodies, tools, joined=joined)


def fused(bodies: Sequence[bd.Shape], *, joined: bool, glued: bool = False) -> list[bd.Solid]:
    """Unite bodies.

    Parameters
    ----------
    bodies : sequence of Shape
        Two bodies or more.
    joined : bool
        As for :func:`cut`.
    glued : bool
        Whether they only touch one another, so that no surfaces need to be intersected.

    Returns
    -------
    list of Solid
        Their union; empty if the kernel failed.
    """
    operation = BRepAlgoAPI_Fuse()
    if glued:
        operation.SetGlue(BOPAlgo_GlueEnum.BOPAlgo_GlueShift)
    return _solids(operation, bodies[:1], bodies[1:], joined=joined)


def _solids(
    operation: BRepAlgoAPI_BooleanOperation,
    bodies: Iterable[bd.Shape],
    tools: Iterable[bd.Shape],
    *,
    joined: bool,
) -> list[bd.Solid]:
    """Run a boolean operation."""
    operation.SetArguments(_listed(bodies))
    operation.SetTools(_listed(tools))
    operation.SetRunParallel(False)
    operation.SetToFillHistory(False)
    operation.Build()
    if not operation.IsDone():
        return []
    made = operation.Shape()
    if joined:
        upgrade = ShapeUpgrade_UnifySameDomain(made, True, True, True)
        upgrade.AllowInternalEdges(False)
        upgrade.Build()
        made = upgrade.Shape()
    return list(bd.Compound(made).solids())


def _listed(shapes: Iterable[bd.Shape]) -> ShapeList:
    listed = ShapeList()
    for shape in shapes:
        listed.Append(shape.wrapped)
    return listed


def _polygon(corners: Iterable[tuple[float, float, float]]) -> TopoDS_Wire:
    polygon = BRepBuilderAPI_MakePolygon()
    for corner in corners:
        polygon.Add(gp_Pnt(*corner))
    polygon.Close()
    return polygon.Wire()
