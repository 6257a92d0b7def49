"""Planned shapes as manifolds, and manifolds as arrays.

Polygons of `segments` corners lie inside the true circle where material is added and outside it
where it is cut away, so that a gap between meshes is never below the exact one.
"""

from __future__ import annotations

from math import cos, pi
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .shapes import Blank, Bored, HalfPlan, Moved, Prism, Shape, cylinder

if TYPE_CHECKING:
    from manifold3d import Manifold

__all__ = ["MeshPart", "half_manifolds", "manifold_of", "mesh_part"]


class MeshPart(NamedTuple):
    """A closed, outward-oriented mesh.

    Attributes
    ----------
    vertices : (v, 3) float64 array
        Corners in mm.
    faces : (f, 3) int32 array
        Three corners of each triangle, counter-clockwise as seen from outside.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]

    def copied(self) -> MeshPart:
        """Copy both arrays."""
        return MeshPart(self.vertices.copy(), self.faces.copy())


def manifold_of(shape: Shape, segments: int, *, outside: bool) -> Manifold:
    """Turn a shape into a manifold that never takes room from a clearance.

    A round face that looks outwards lies inside the true circle when the shape is added and
    outside it when the shape is cut away; one that looks inwards (a recess) the other way round.

    Parameters
    ----------
    shape : Shape
        What to build, in mm.
    segments : int
        Number of corners of a full circle.
    outside : bool
        True for what is cut away, False for what is added.

    Returns
    -------
    Manifold
        The shape in mm.
    """
    from manifold3d import CrossSection, FillRule, Manifold, OpType

    if isinstance(shape, Moved):
        frame = np.column_stack((shape.x_dir, shape.y_dir, shape.z_dir, shape.origin))
        return manifold_of(shape.shape, segments, outside=outside).transform(frame)
    if isinstance(shape, Bored):
        cuts = [manifold_of(cut, segments, outside=not outside) for cut in shape.cuts]
        whole = manifold_of(shape.shape, segments, outside=outside)
        return Manifold.batch_boolean([whole, *cuts], OpType.Subtract)
    if isinstance(shape, Blank):
        bar = cylinder(shape.radius, shape.web.start, shape.web.end)
        web, round_bar = (manifold_of(part, segments, outside=outside) for part in (shape.web, bar))
        return web + round_bar
    if isinstance(shape, Prism):
        rims = [list(shape.outline), *(list(hole) for hole in shape.holes)]
        section = CrossSection(rims, FillRule.EvenOdd)
        return Manifold.extrude(section, shape.end - shape.start).translate((0, 0, shape.start))
    outline = np.array(shape.outline)
    along = np.roll(outline, -1, axis=0) - outline
    area = np.sum(outline[:, 0] * along[:, 1] - outline[:, 1] * along[:, 0])
    outwards = np.sign(area) * along[:, 1]  # radial part of each edge's outward normal
    grown = outwards > 0.0 if outside else outwards < 0.0
    grown = (grown | np.roll(grown, 1)) & (outline[:, 0] > 0.0)
    outline[grown, 0] /= cos(pi / segments)
    section = CrossSection([outline], FillRule.NonZero)
    if shape.turn >= 360.0:
        return Manifold.revolve(section, segments)
    part = Manifold.revolve(section, segments, shape.turn)
    return part.rotate((0.0, 0.0, shape.begin))


def half_manifolds(plan: HalfPlan, segments: int) -> tuple[Manifold, Manifold]:
    """Build a half and its carve from their plan.

    Parameters
    ----------
    plan : HalfPlan
        Shapes of the half.
    segments : int
        Number of corners of a full circle.

    Returns
    -------
    half, carve : Manifold
        What to add to the body, and what to cut from it first, in mm.
    """
    from manifold3d import Manifold, OpType

    def united(shapes: tuple[Shape, ...], outside: bool) -> Manifold:
        built = [manifold_of(shape, segments, outside=outside) for shape in shapes]
        return Manifold.batch_boolean(built, OpType.Add) if len(built) > 1 else built[0]

    carve = united(plan.carve, True)
    half = (united(plan.web, False) - carve) + united(plan.add, False)
    if plan.bore:
        half -= united(plan.bore, True)
    return _without_slivers(half), carve


def _without_slivers(solid: Manifold) -> Manifold:
    """Drop flat leftovers of planes that differ by rounding only."""
    from manifold3d import Manifold

    parts = solid.decompose()
    kept = [part for part in parts if abs(part.volume()) > 1e-6]
    return solid if len(kept) == len(parts) else Manifold.compose(kept)


def mesh_part(solid: Manifold) -> MeshPart:
    """Read a manifold's triangles into arrays.

    Parameters
    ----------
    solid : Manifold
        The solid in mm.

    Returns
    -------
    MeshPart
        Its corners and triangles.
    """
    mesh = solid.to_mesh64()
    vertices = np.array(mesh.vert_properties, dtype=np.float64)[:, :3].copy()
    faces = np.array(mesh.tri_verts, dtype=np.int32)
    return MeshPart(vertices, faces)
