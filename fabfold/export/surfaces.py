"""Surfaces of the faces that a CAD program would draw, and triangles gathered into flat ones.

Triangles that lie in one plane become one region. Round faces come after them, see
:mod:`fabfold.export.round_faces`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fabfold.meshes import face_normals

__all__ = ["ROUND_MM", "Axis", "Plane", "Round", "Surface", "flat_regions", "neighbours"]

#: Corners this near to a plane lie in it, mm.
FLAT_MM = 1e-3
#: Corners this near to a cylinder or cone lie on it, mm.
ROUND_MM = 2e-3


@dataclass(frozen=True)
class Axis:
    """A hinge's axis as a bounded line.

    Attributes
    ----------
    point : (3,) tuple of float
        Middle of the hinge, mm.
    direction : int
        0, 1 or 2: along +x, +y or +z.
    half_length : float
        Half the length of the cylinder that holds all that is round about the axis, mm.
    radius : float
        Radius of that cylinder, mm.
    """

    point: tuple[float, float, float]
    direction: int
    half_length: float
    radius: float


@dataclass(frozen=True)
class Plane:
    """A flat face.

    Attributes
    ----------
    point : (3,) tuple of float
        A point of the plane, mm.
    normal : (3,) tuple of float
        Unit vector out of the body.
    """

    point: tuple[float, float, float]
    normal: tuple[float, float, float]


@dataclass(frozen=True)
class Round:
    """A face on a cylinder (`slope` 0) or a cone about `axis`.

    Attributes
    ----------
    axis : Axis
        Axis of the cylinder or cone.
    radius : float
        Radius where the surface crosses the plane through the axis' point, mm; may be negative on
        a cone.
    slope : float
        Growth of the radius along the axis.
    outward : bool
        Whether the body is inside, so that its outward normal points away from the axis.
    """

    axis: Axis
    radius: float
    slope: float
    outward: bool


Surface = Plane | Round


def neighbours(faces: NDArray[np.int32]) -> NDArray[np.int32]:
    """Triangles beside each triangle of a closed mesh.

    Parameters
    ----------
    faces : (f, 3) int32 array
        Triangles as indices of corners.

    Returns
    -------
    (f, 3) int32 array
        The triangle across each of the three edges.
    """
    count = int(faces.max()) + 1
    start = faces.reshape(-1).astype(np.int64)
    end = np.roll(faces, -1, axis=1).reshape(-1).astype(np.int64)
    backward = end * count + start
    order = np.argsort(backward, kind="stable")
    across = order[np.searchsorted(backward[order], start * count + end)]
    return (across // 3).reshape(-1, 3).astype(np.int32)


def flat_regions(
    vertices: NDArray[np.float64], faces: NDArray[np.int32]
) -> tuple[NDArray[np.int32], list[Plane]]:
    """Give each triangle of a closed mesh the flat region it belongs to.

    Regions grow from the largest triangle left over neighbours whose corners all lie in its plane.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        Corners of the mesh in mm.
    faces : (f, 3) int32 array
        Triangles as indices into `vertices`.

    Returns
    -------
    labels : (f,) int32 array
        Region of each triangle, an index into `planes`.
    planes : list of Plane
        Plane of each region.
    """
    corners = vertices[faces]
    normals, areas = face_normals(corners)
    doubled = 2 * areas
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    sliver = doubled < FLAT_MM * longest
    beside = neighbours(faces).tolist()
    # Plain numbers: arrays of three cost more to call than to add up.
    corner_of, normal_of, is_sliver = corners.tolist(), normals.tolist(), sliver.tolist()
    labels = [-1] * len(faces)
    regions: list[list[int]] = []
    for seed in np.argsort(-np.round(doubled, 9), kind="stable").tolist():
        if labels[seed] >= 0:
            continue
        label = len(regions)
        nx, ny, nz = normal_of[seed]
        px, py, pz = corner_of[seed][0]
        labels[seed] = label
        region = [seed]
        for here in region:  # grows while it is gone through
            for other in beside[here]:
                if labels[other] >= 0:
                    continue
                ox, oy, oz = normal_of[other]
                if not is_sliver[other] and ox * nx + oy * ny + oz * nz < 0.9:
                    continue
                for x, y, z in corner_of[other]:
                    if abs((x - px) * nx + (y - py) * ny + (z - pz) * nz) >= FLAT_MM:
                        break
                else:
                    labels[other] = label
                    region.append(other)
        regions.append(region)
    found = np.array(labels, dtype=np.int32)
    seeds = np.array([region[0] for region in regions])
    return found, _planes(corners, found, normals[seeds])


def _planes(
    corners: NDArray[np.float64], labels: NDArray[np.int32], normals: NDArray[np.float64]
) -> list[Plane]:
    """Plane through the middle of each region, along a lattice axis where that is meant."""
    along = np.abs(normals).argmax(axis=1)
    rows = np.arange(len(normals))
    lattice = 1.0 - np.abs(normals[rows, along]) < 1e-6
    straight = np.zeros_like(normals)
    straight[rows, along] = np.sign(normals[rows, along])
    normals = np.where(lattice[:, None], straight, normals)
    order = np.argsort(labels, kind="stable")
    first = 3 * np.searchsorted(labels[order], rows)
    points = corners[order].reshape(-1, 3)
    height = np.einsum("ij,ij->i", points, normals[np.repeat(labels[order], 3)])
    middle = (np.minimum.reduceat(height, first) + np.maximum.reduceat(height, first)) / 2
    anchors = points[first] + normals * (middle - height[first])[:, None]
    return [
        Plane((x, y, z), (nx, ny, nz))
        for (x, y, z), (nx, ny, nz) in zip(anchors.tolist(), normals.tolist(), strict=True)
    ]
