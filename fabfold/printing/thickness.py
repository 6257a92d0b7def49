"""Surface of a mesh: its area, points spread over it, and the thickness of the wall below them."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fabfold.joinery.bodies import BodyMesh
from fabfold.meshes import face_areas, face_normals

if TYPE_CHECKING:
    import manifold3d

__all__ = ["Thickness", "ray_thickness", "surface_area", "surface_samples"]


#: Two surfaces whose normals are opposed to within 18 degrees are the two sides of a wall.
_FACING = 0.95


class Thickness(NamedTuple):
    """Thickness at points spread evenly over a surface.

    Attributes
    ----------
    points : (k, 3) float64 array
        Points of the surface in mm.
    values : (k,) float64 array
        Distance through the material to the surface on the other side, mm.
    opposed : (k,) bool array
        Whether the surface on the other side faces the other way: a wall, and no edge or corner.
    """

    points: NDArray[np.float64]
    values: NDArray[np.float64]
    opposed: NDArray[np.bool_]

    def share_below(self, limit_mm: float) -> float:
        """Share of the surface that is thinner than a limit in mm, 0 to 1."""
        return float((self.values < limit_mm).mean()) if len(self.values) else 0.0


def surface_area(body: BodyMesh) -> float:
    """Area of a body's surface in mm²."""
    return float(face_areas(body.vertices[body.faces]).sum())


def surface_samples(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], count: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points spread over a mesh by area, the same every time.

    The area is cut into `count` equal stretches in the order of the faces and one point is drawn
    in each, so no part of the surface is missed and none is drawn twice.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        Corners of the mesh in mm.
    faces : (f, 3) int32 array
        Triangles as indices into `vertices`, counter-clockwise seen from outside.
    count : int
        Number of points.

    Returns
    -------
    points : (count, 3) float64 array
        Points of the surface in mm.
    normals : (count, 3) float64 array
        Unit normals there, outwards.
    """
    corners = vertices[faces]
    normals, areas = face_normals(corners)
    reach = np.cumsum(areas)
    random = np.random.default_rng(0)
    targets = (np.arange(count) + random.random(count)) / count * reach[-1]
    chosen = np.minimum(np.searchsorted(reach, targets), len(faces) - 1)
    u, v = random.random(count), random.random(count)
    folded = u + v > 1.0
    u, v = np.where(folded, 1.0 - u, u), np.where(folded, 1.0 - v, v)
    a, b, c = (corners[chosen, i] for i in range(3))
    points = a + u[:, None] * (b - a) + v[:, None] * (c - a)
    return points, normals[chosen]


def ray_thickness(
    solid: manifold3d.Manifold,
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    count: int,
    reach_mm: float,
) -> Thickness:
    """Thickness along the inward normal at evenly spread points.

    Near the knife edge of a wedge the thickness falls to zero, so the smallest value says little;
    the share of the surface below a limit does.

    Parameters
    ----------
    solid : manifold3d.Manifold
        The mesh as a solid, mm.
    vertices : (v, 3) float64 array
        Corners of the mesh in mm.
    faces : (f, 3) int32 array
        Triangles as indices into `vertices`, counter-clockwise seen from outside.
    count : int
        Number of points.
    reach_mm : float
        Length of the rays in mm; thicker places have this value.

    Returns
    -------
    Thickness
        The points and the thickness at each.
    """
    points, normals = surface_samples(vertices, faces, count)
    # Start a little below the surface, so that the ray does not hit the face it starts from.
    skin = 1e-4
    starts = points - skin * normals
    ends = points - reach_mm * normals
    values = np.full(count, reach_mm)
    opposed = np.zeros(count, dtype=np.bool_)
    for index in range(count):
        hits = solid.ray_cast(tuple(starts[index]), tuple(ends[index]))
        for hit in hits:
            # Leaving the material; a hit from outside belongs to the start's own face.
            facing = float(np.dot(hit.normal, -normals[index]))
            if facing > 0.0:
                values[index] = skin + hit.distance * (reach_mm - skin)
                opposed[index] = facing > _FACING
                break
    return Thickness(points, values, opposed)
