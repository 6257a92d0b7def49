"""Hinges as triangle meshes, ready for mesh booleans.

.. code-block:: text

    single_hinge_meshes(
        voxel_mm, clearance_mm, *, barrel_radius_mm=None, pin_radius_mm=None, knuckles=3,
        gap_mm=None, bracket_mm=None, margin_mm=None, wall_mm=0.8, segments=64,
    ) -> HingeMeshes(parent_half, child_half, parent_carve, child_carve,
                     barrel_radius_mm, pin_radius_mm, knuckles, reach_mm)

    double_hinge_meshes(
        voxel_mm, clearance_mm, first="+y", second="-y", turns=(180, 180), *,
        barrel_radius_mm=None, pin_radius_mm=None, knuckles=None, plate_mm=None,
        gap_mm=None, bracket_mm=None, margin_mm=None, wall_mm=0.8, segments=64,
    ) -> DoubleHingeMeshes(parent_half, link, child_half, parent_carve, child_carve, plate,
                           barrel_radius_mm, pin_radius_mm, knuckles, reach_mm, plate_mm)

    each piece: MeshPart(vertices (v, 3) float64 in mm, faces (f, 3) int32)

Use it as ``body - carve + half`` on each of the two bodies, in that order; nothing needs to be
subtracted after.

Frame: the axis is z through the origin and the edge is centred on it (z from -voxel/2 to +voxel/2).
At angle 0 the parent's material is in the quadrant x < 0, y < 0 and the child's in x > 0, y < 0:
x points from the parent's cell to the child's, y outwards from the shared face at the hinged edge.
A positive turn of the child about +z takes it through x > 0, y > 0 to x < 0, y > 0 at 180°.

Frame of a double hinge: the face that both cells share is |y|, |z| ≤ voxel/2 of the plane x = 0,
the parent's cell lies at x < 0 and the child's at x > 0. `first` and `second` name the edges of
that face on which the parent-link and the link-child axis run: "+y", "-y", "+z" or "-z". A positive
first angle turns link and child about the direction ``x × edge``, a positive second angle the child
about ``x × edge`` of its own edge: both carry the child away from the face and around the edge.
`link` is a body of its own. The carves hold the pockets for the link plate at 0 and, for a turn of
270, where it comes to lie on the other face; no material of the bodies may lie within gap/2 of the
faces of their cells.

The meshes are built from polygons of `segments` corners that lie inside the true circle on barrels
and cones and outside it on grooves and recesses, so a gap between meshes is never below the exact
one and at most 0.0024 (r + c) above it for 64 segments (0.007 mm at r + c = 2.8 mm).
"""

from __future__ import annotations

from functools import lru_cache
from math import cos, pi
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .clearance import Clearance
from .leaf import Bracket
from .pins import ConePin
from .plan import HalfPlan, SingleSpec, default_pin_radius, default_radii, plan_single
from .plan_double import DoubleSpec, plan_double, plate_shape
from .shapes import Moved, Prism, Shape

if TYPE_CHECKING:
    from manifold3d import Manifold

__all__ = [
    "DoubleHingeMeshes",
    "HingeMeshes",
    "MeshPart",
    "double_hinge_meshes",
    "half_of",
    "part_of",
    "single_hinge_meshes",
    "solid_of",
]


class MeshPart(NamedTuple):
    """A closed, outward-oriented mesh.

    Attributes
    ----------
    vertices : (v, 3) float64 array
        In mm.
    faces : (f, 3) int32 array
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]

    def copied(self) -> MeshPart:
        """Copy both arrays."""
        return MeshPart(self.vertices.copy(), self.faces.copy())


class HingeMeshes(NamedTuple):
    """The four pieces of one single hinge, and the sizes that were used.

    Attributes
    ----------
    parent_half, child_half : MeshPart
        To add to each body after its carve was subtracted. One connected piece each.
    parent_carve, child_carve : MeshPart
        To subtract from each body first.
    barrel_radius_mm, pin_radius_mm : float
    knuckles : int
    reach_mm : float
        Radius of the groove that a barrel needs in any other body: barrel plus clearance.
    """

    parent_half: MeshPart
    child_half: MeshPart
    parent_carve: MeshPart
    child_carve: MeshPart
    barrel_radius_mm: float
    pin_radius_mm: float
    knuckles: int
    reach_mm: float


class DoubleHingeMeshes(NamedTuple):
    """The five pieces of one double hinge, and the sizes that were used.

    Attributes
    ----------
    parent_half, child_half : MeshPart
        To add to each body after its carve was subtracted. One connected piece each.
    link : MeshPart
        The link plate with its knuckles: a body of its own.
    parent_carve, child_carve : MeshPart
        To subtract from each body first.
    plate : MeshPart
        The link plate alone, without knuckles and grooves. Along edges without an axis it keeps the
        margin free, so that another hinge's barrel on such an edge does not meet it.
    barrel_radius_mm, pin_radius_mm : float
    knuckles : int
        On each axis; of both together when they share an edge.
    reach_mm : float
        Radius of the groove that a barrel needs in any other body.
    plate_mm : float
        Thickness of the link plate.
    """

    parent_half: MeshPart
    link: MeshPart
    child_half: MeshPart
    parent_carve: MeshPart
    child_carve: MeshPart
    plate: MeshPart
    barrel_radius_mm: float
    pin_radius_mm: float
    knuckles: int
    reach_mm: float
    plate_mm: float


def solid_of(shape: Shape, segments: int, *, outside: bool) -> Manifold:
    """Turn a shape into a manifold that never takes room from a clearance.

    A round face that looks outwards lies inside the true circle when the shape is added and
    outside it when the shape is cut away; one that looks inwards (a recess) the other way round.

    Parameters
    ----------
    shape : Turned or Prism
    segments : int
        Corners of a full circle.
    outside : bool
        True for what is cut away, False for what is added.
    """
    from manifold3d import CrossSection, FillRule, Manifold

    if isinstance(shape, Moved):
        frame = np.column_stack((shape.x_dir, shape.y_dir, shape.z_dir, shape.origin))
        return solid_of(shape.shape, segments, outside=outside).transform(frame)
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


def half_of(plan: HalfPlan, segments: int) -> tuple[Manifold, Manifold]:
    """Build a half and its carve from their plan.

    Parameters
    ----------
    plan : HalfPlan
    segments : int
        Corners of a full circle.

    Returns
    -------
    half, carve : Manifold
    """
    from manifold3d import Manifold, OpType

    def united(shapes: tuple[Shape, ...], outside: bool) -> Manifold:
        built = [solid_of(shape, segments, outside=outside) for shape in shapes]
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


def part_of(solid: Manifold) -> MeshPart:
    """Read a manifold's triangles into arrays."""
    mesh = solid.to_mesh64()
    vertices = np.array(mesh.vert_properties, dtype=np.float64)[:, :3].copy()
    faces = np.array(mesh.tri_verts, dtype=np.int32)
    return MeshPart(vertices, faces)


def single_hinge_meshes(voxel_mm: float, clearance_mm: float, **options: Any) -> HingeMeshes:
    """Build the four pieces of a cone-pinned single hinge for the edge of a voxel.

    Parameters
    ----------
    voxel_mm : float
        Length of the edge.
    clearance_mm : float
        Normal clearance in the hinge.
    barrel_radius_mm, pin_radius_mm : float, optional
        Chosen by :func:`default_radii` when left out.
    knuckles : int
        3 by default; the parent has the odd one.
    gap_mm : float, optional
        Between the two bodies; each is inset by half of it. `clearance_mm` when left out.
    bracket_mm : float, optional
        Width and depth of the square web that joins the knuckles of a half, measured from the
        axis. At least the groove and 1.2 mm of material behind it; 0.15 voxel when that is more.
    margin_mm : float, optional
        Left free at both ends of the edge; barrel radius plus clearance when left out.
    wall_mm : float
        Thinnest wall.
    segments : int
        Corners of a full circle.

    Returns
    -------
    HingeMeshes
        The work is cached by the arguments; the arrays are the caller's own copies.

    Raises
    ------
    FitError
        If the hinge cannot be printed at this size, naming the rule and what to change.
    """
    made = _single(float(voxel_mm), float(clearance_mm), **options)
    return made._replace(
        parent_half=made.parent_half.copied(),
        child_half=made.child_half.copied(),
        parent_carve=made.parent_carve.copied(),
        child_carve=made.child_carve.copied(),
    )


@lru_cache(maxsize=64)
def _single(
    voxel_mm: float,
    clearance_mm: float,
    *,
    barrel_radius_mm: float | None = None,
    pin_radius_mm: float | None = None,
    knuckles: int = 3,
    gap_mm: float | None = None,
    bracket_mm: float | None = None,
    margin_mm: float | None = None,
    wall_mm: float = 0.8,
    segments: int = 64,
) -> HingeMeshes:
    room = Clearance(clearance_mm)
    barrel = barrel_radius_mm
    if barrel is None:
        barrel, _ = default_radii(voxel_mm, room, wall_mm, knuckles, margin_mm, widest=5.0)
    pin = default_pin_radius(barrel, room, wall_mm) if pin_radius_mm is None else pin_radius_mm
    reach = barrel + room.radial
    bracket = max(0.15 * voxel_mm, reach + 1.2) if bracket_mm is None else bracket_mm
    spec = SingleSpec.read(
        voxel_mm,
        knuckles=knuckles,
        radius=barrel,
        pin=ConePin(pin),
        clearance=room,
        leaf=Bracket(bracket),
        gap=gap_mm,
        margin=margin_mm,
        wall=wall_mm,
    )
    plan = plan_single(spec)
    parent, parent_carve = half_of(plan.parent, segments)
    child, child_carve = half_of(plan.child, segments)
    return HingeMeshes(
        part_of(parent),
        part_of(child),
        part_of(parent_carve),
        part_of(child_carve),
        barrel,
        pin,
        knuckles,
        reach,
    )


def double_hinge_meshes(
    voxel_mm: float,
    clearance_mm: float,
    first: str = "+y",
    second: str = "-y",
    turns: tuple[float, float] = (180.0, 180.0),
    **options: Any,
) -> DoubleHingeMeshes:
    """Build the five pieces of a cone-pinned double hinge for the face between two voxels.

    Parameters
    ----------
    voxel_mm : float
        Side of the face.
    clearance_mm : float
        Normal clearance in the hinge, and room around the link plate.
    first, second : {"+y", "-y", "+z", "-z"}
        Edges of the two axes.
    turns : (float, float)
        How far each axis turns: 90, 180 or 270 degrees.
    barrel_radius_mm, pin_radius_mm, gap_mm, bracket_mm, margin_mm, wall_mm, segments
        As for :func:`single_hinge_meshes`.
    knuckles : int, optional
        On each axis, 3 by default; 5 when both share an edge.
    plate_mm : float, optional
        Thickness of the link plate; 2, or thinner where a small barrel asks for it.

    Returns
    -------
    DoubleHingeMeshes
        The work is cached by the arguments; the arrays are the caller's own copies.

    Raises
    ------
    FitError
        If the hinge cannot be printed at this size, naming the rule and what to change.
    HingeError
        If an edge or a turn is unknown.
    """
    pair = (float(turns[0]), float(turns[1]))
    made = _double(float(voxel_mm), float(clearance_mm), first, second, pair, **options)
    return made._replace(
        parent_half=made.parent_half.copied(),
        link=made.link.copied(),
        child_half=made.child_half.copied(),
        parent_carve=made.parent_carve.copied(),
        child_carve=made.child_carve.copied(),
        plate=made.plate.copied(),
    )


@lru_cache(maxsize=256)
def _double(
    voxel_mm: float,
    clearance_mm: float,
    first: str,
    second: str,
    turns: tuple[float, float],
    *,
    barrel_radius_mm: float | None = None,
    pin_radius_mm: float | None = None,
    knuckles: int | None = None,
    plate_mm: float | None = None,
    gap_mm: float | None = None,
    bracket_mm: float | None = None,
    margin_mm: float | None = None,
    wall_mm: float = 0.8,
    segments: int = 64,
) -> DoubleHingeMeshes:
    room = Clearance(clearance_mm)
    count = knuckles or (5 if first == second else 3)
    barrel = barrel_radius_mm
    if barrel is None:
        barrel, _ = default_radii(voxel_mm, room, wall_mm, count, margin_mm, widest=5.0)
    pin = default_pin_radius(barrel, room, wall_mm) if pin_radius_mm is None else pin_radius_mm
    reach = barrel + room.radial
    bracket = max(0.15 * voxel_mm, reach + 1.2) if bracket_mm is None else bracket_mm
    spec = DoubleSpec.read(
        voxel_mm,
        first=first,
        second=second,
        turns=turns,
        knuckles=count,
        radius=barrel,
        pin=ConePin(pin),
        clearance=room,
        plate=plate_mm,
        bracket=Bracket(bracket),
        gap=gap_mm,
        margin=margin_mm,
        wall=wall_mm,
    )
    plan = plan_double(spec)
    parent, parent_carve = half_of(plan.parent, segments)
    child, child_carve = half_of(plan.child, segments)
    link, _ = half_of(plan.link, segments)
    return DoubleHingeMeshes(
        part_of(parent),
        part_of(link),
        part_of(child),
        part_of(parent_carve),
        part_of(child_carve),
        part_of(solid_of(plate_shape(spec), segments, outside=False)),
        barrel,
        pin,
        count,
        reach,
        spec.plate,
    )
