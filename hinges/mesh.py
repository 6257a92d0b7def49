"""Hinges as triangle meshes, ready for mesh booleans.

.. code-block:: text

    single_hinge_meshes(
        voxel_mm, clearance_mm, *, barrel_radius_mm=None, pin_radius_mm=None, knuckles=3,
        gap_mm=None, bracket_mm=None, margin_mm=None, wall_mm=0.8, segments=64,
    ) -> HingeMeshes(parent_half, child_half, parent_carve, child_carve,
                     barrel_radius_mm, pin_radius_mm, knuckles, reach_mm)

    each of the four: MeshPart(vertices (v, 3) float64 in mm, faces (f, 3) int32)

Use it as ``body - carve + half`` on each of the two bodies, in that order; nothing needs to be
subtracted after.

Frame: the axis is z through the origin and the edge is centred on it (z from -voxel/2 to +voxel/2).
At angle 0 the parent's material is in the quadrant x < 0, y < 0 and the child's in x > 0, y < 0:
x points from the parent's cell to the child's, y outwards from the shared face at the hinged edge.
A positive turn of the child about +z takes it through x > 0, y > 0 to x < 0, y > 0 at 180°.

The meshes are built from polygons of `segments` corners that lie inside the true circle on barrels
and cones and outside it on grooves and recesses, so a gap between meshes is never below the exact
one and at most 0.0024 (r + c) above it for 64 segments (0.007 mm at r + c = 2.8 mm).
"""

from __future__ import annotations

from functools import lru_cache
from math import cos, floor, pi
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .clearance import Clearance
from .errors import HingeError
from .fit import at_least
from .pins import ConePin
from .shapes import Prism, Shape
from .train import groove, lay_out

if TYPE_CHECKING:
    from manifold3d import Manifold

__all__ = [
    "HingeMeshes",
    "MeshPart",
    "default_pin_radius",
    "default_radii",
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


def _widening(clearance: Clearance) -> float:
    """How much a 45° recess is wider than its cone, in mm."""
    return ConePin(1.0).widening(clearance)


def default_radii(
    length: float, clearance: Clearance, wall: float = 0.8, knuckles: int = 3
) -> tuple[float, float]:
    """Choose a barrel and pin radius for a cone-pinned hinge on an edge.

    Parameters
    ----------
    length : float
        Of the edge in mm.
    clearance : Clearance
    wall : float
        Thinnest wall in mm.
    knuckles : int

    Returns
    -------
    barrel, pin : float
        In mm: the barrel nearest to an eighth of the edge (at most 5) that the rules of fit
        accept, and 60 % of it or as much as the wall leaves; 2.5 and 1.5 on an edge of 20 mm with
        0.3 mm clearance. An eighth of the edge when none fits.
    """
    wanted = min(length / 8.0, 5.0)
    for step in (0, *(sign * n for n in range(1, 21) for sign in (1, -1))):
        barrel = round(wanted * (1.0 + 0.02 * step), 3)
        try:
            pin = ConePin(default_pin_radius(barrel, clearance, wall))
            pin.check(lay_out(length, knuckles, barrel, clearance, barrel + clearance.radial), wall)
        except HingeError:
            continue
        return barrel, pin.radius
    return wanted, default_pin_radius(wanted, clearance, wall)


def default_pin_radius(barrel: float, clearance: Clearance, wall: float = 0.8) -> float:
    """Choose a cone's foot radius: 60 % of the barrel, or as much as the wall leaves (mm)."""
    return floor(1000.0 * min(0.6 * barrel, barrel - wall - _widening(clearance)) + 1e-6) / 1000.0


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

    if isinstance(shape, Prism):
        section = CrossSection([list(shape.outline)], FillRule.Positive)
        return Manifold.extrude(section, shape.end - shape.start).translate((0, 0, shape.start))
    outline = np.array(shape.outline)
    along = np.roll(outline, -1, axis=0) - outline
    area = np.sum(outline[:, 0] * along[:, 1] - outline[:, 1] * along[:, 0])
    outwards = np.sign(area) * along[:, 1]  # radial part of each edge's outward normal
    grown = outwards > 0.0 if outside else outwards < 0.0
    grown = (grown | np.roll(grown, 1)) & (outline[:, 0] > 0.0)
    outline[grown, 0] /= cos(pi / segments)
    return Manifold.revolve(CrossSection([outline], FillRule.NonZero), segments)


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
    clearance = Clearance(clearance_mm)
    barrel, thick = default_radii(voxel_mm, clearance, wall_mm, knuckles)
    if barrel_radius_mm is not None:
        barrel = barrel_radius_mm
        thick = default_pin_radius(barrel, clearance, wall_mm)
    pin = ConePin(thick if pin_radius_mm is None else pin_radius_mm)
    reach = barrel + clearance.radial
    margin = reach if margin_mm is None else margin_mm
    train = lay_out(voxel_mm, knuckles, barrel, clearance, margin)
    pin.check(train, wall_mm)
    half_gap = 0.5 * (clearance_mm if gap_mm is None else gap_mm)
    bracket = max(0.15 * voxel_mm, reach + 1.2) if bracket_mm is None else bracket_mm
    at_least(
        "bracket",
        "the bracket's material behind the groove",
        bracket - reach,
        wall_mm,
        "use a wider bracket or a smaller barrel",
    )
    core = 0.5 * (pin.reach(clearance) + barrel)
    carves = [solid_of(groove(train, owner, core), segments, outside=True) for owner in (0, 1)]
    halves = []
    for owner, side in ((0, -1.0), (1, 1.0)):
        near, far = side * half_gap, side * bracket
        west, east = min(near, far), max(near, far)
        corners = ((west, -bracket), (east, -bracket), (east, -half_gap), (west, -half_gap))
        half = solid_of(Prism(corners, train.start, train.end), segments, outside=False)
        half -= carves[owner]
        for whose, shape in pin.knuckles(train, 0.0):
            if whose == owner:
                half += solid_of(shape, segments, outside=False)
        halves.append(half)
    return HingeMeshes(
        part_of(halves[0]),
        part_of(halves[1]),
        part_of(carves[0]),
        part_of(carves[1]),
        barrel,
        pin.radius,
        knuckles,
        reach,
    )
