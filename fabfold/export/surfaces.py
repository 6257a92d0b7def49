"""Triangles of one body, gathered into the faces that a CAD program would draw.

Flat faces first: triangles that lie in one plane become one region. Then the round faces of the
hinges: the strips that a mesh has for a cylinder or cone about a hinge's axis become one region on
the true surface, where all of its rim allows it: a rim must run straight along the surface, or
around it in a plane square to the axis beside a flat face or another surface of the same hinge.
Strips with any other rim, such as where a barrel meets a sculpted surface, stay flat.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fabfold.meshes import face_normals

__all__ = [
    "FLAT_MM",
    "Axis",
    "Plane",
    "Round",
    "Surface",
    "flat_regions",
    "round_regions",
    "sculpted_triangles",
]

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
#: Index of the axis, radius at its point, slope, and whether the normal points away from it.
Strip = tuple[int, float, float, bool]
Strips = dict[int, Strip]


def _neighbours(faces: NDArray[np.int32]) -> NDArray[np.int32]:
    """Triangle across each of a triangle's three edges, shape (f, 3); the mesh is closed."""
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
    beside = _neighbours(faces).tolist()
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
    planes = [_plane(corners[sorted(region)], normals[region[0]]) for region in regions]
    return np.array(labels, dtype=np.int32), planes


def _plane(corners: NDArray[np.float64], normal: NDArray[np.float64]) -> Plane:
    """Plane through the middle of the triangles, along a lattice axis where that is meant."""
    axis = int(np.abs(normal).argmax())
    if 1.0 - abs(normal[axis]) < 1e-6:
        normal = np.where(np.arange(3) == axis, np.sign(normal), 0.0)
    points = corners.reshape(-1, 3)
    height = points @ normal
    point = points[0] + normal * ((height.min() + height.max()) / 2 - height[0])
    x, y, z = (float(v) for v in point)
    return Plane((x, y, z), (float(normal[0]), float(normal[1]), float(normal[2])))


def _polar(
    points: NDArray[np.float64], axis: Axis
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Radius, angle and height of points about an axis."""
    along = axis.direction
    first, second = (along + 1) % 3, (along + 2) % 3
    offset = points - np.asarray(axis.point)
    x, y = offset[..., first], offset[..., second]
    return np.hypot(x, y), np.arctan2(y, x), offset[..., along]


def _strip(
    points: NDArray[np.float64], normal: NDArray[np.float64], axis: Axis
) -> tuple[float, float, bool] | None:
    """Radius at the axis' point, slope and side of the surface that a narrow strip stands for."""
    radius, angle, height = _polar(points, axis)
    far = radius > 10 * ROUND_MM
    turn = np.angle(np.exp(1j * (angle[far] - angle[far][0])))
    if np.ptp(radius) < ROUND_MM:
        fit = (float((radius.min() + radius.max()) / 2), 0.0)
    else:
        middle_height, middle_radius = height.mean(), radius.mean()
        lever = height - middle_height
        slope = float(lever @ (radius - middle_radius) / (lever @ lever))
        fit = (float(middle_radius - slope * middle_height), slope)
        if np.abs(radius - (fit[0] + fit[1] * height)).max() > ROUND_MM or abs(slope) > 20:
            return None
    along = axis.direction
    middle = float(turn.min() + turn.max()) / 2 + float(angle[far][0])
    away = np.cos(middle) * normal[(along + 1) % 3] + np.sin(middle) * normal[(along + 2) % 3]
    steep = 1.0 / np.hypot(1.0, fit[1])
    if abs(abs(away) - steep) > 0.02:
        return None
    return fit[0], fit[1], bool(away > 0)


def round_regions(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    labels: NDArray[np.int32],
    planes: Sequence[Plane],
    axes: Sequence[Axis],
) -> tuple[NDArray[np.int32], list[Surface]]:
    """Join the strips about hinge axes into cylinders and cones.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        Corners of the mesh in mm.
    faces : (f, 3) int32 array
        Triangles as indices into `vertices`.
    labels : (f,) int32 array
        Flat region of each triangle, from :func:`flat_regions`.
    planes : sequence of Plane
        Plane of each flat region, from :func:`flat_regions`.
    axes : sequence of Axis
        Axes about which there may be round faces.

    Returns
    -------
    labels : (f,) int32 array
        Region of each triangle, an index into `surfaces`. A round region spans less than half a
        turn or so.
    surfaces : list of Plane or Round
        Surface of each region.
    """
    rims = _rims(faces, labels)
    corners_of = _corners_by_region(faces, labels, len(planes))
    strips = _strips(vertices, faces, labels, planes, axes, corners_of)
    _drop_unfit(vertices, planes, axes, rims, strips)
    return _joined(vertices, labels, planes, axes, rims, strips, corners_of)


def sculpted_triangles(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    labels: NDArray[np.int32],
    planes: Sequence[Plane],
    axes: Sequence[Axis],
) -> NDArray[np.bool_]:
    """Triangles that come from the model's own surface: neither cut along the lattice nor turned.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        Corners of the mesh in mm.
    faces : (f, 3) int32 array
        Triangles as indices into `vertices`.
    labels : (f,) int32 array
        Flat region of each triangle, from :func:`flat_regions`.
    planes : sequence of Plane
        Plane of each flat region, from :func:`flat_regions`.
    axes : sequence of Axis
        Axes about which there may be round faces.

    Returns
    -------
    (f,) bool array
        True for the sculpted triangles.
    """
    corners_of = _corners_by_region(faces, labels, len(planes))
    kept = np.array([max(abs(v) for v in plane.normal) > 1.0 - 1e-9 for plane in planes])
    kept[list(_strips(vertices, faces, labels, planes, axes, corners_of))] = True
    return ~kept[labels]


def _strips(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    labels: NDArray[np.int32],
    planes: Sequence[Plane],
    axes: Sequence[Axis],
    corners_of: list[NDArray[np.int32]],
) -> Strips:
    """Regions that may stand for a piece of a cylinder or cone about one of the axes."""
    strips: Strips = {}
    for index, axis in enumerate(axes):
        near = _regions_near(vertices, faces, labels, axis)
        near = [region for region in near if region not in strips]
        for region in _narrow(vertices, near, corners_of, axis):
            found = _strip(vertices[corners_of[region]], np.asarray(planes[region].normal), axis)
            if found is not None:
                strips[region] = (index, *found)
    return strips


def _narrow(
    vertices: NDArray[np.float64],
    regions: list[int],
    corners_of: list[NDArray[np.int32]],
    axis: Axis,
) -> list[int]:
    """Regions that are narrow strips within an axis' reach: what :func:`_strip` takes for granted.

    All regions at once, since most are sorted out here.
    """
    if not regions:
        return []
    first = np.cumsum([0, *(len(corners_of[region]) for region in regions[:-1])])
    points = vertices[np.concatenate([corners_of[region] for region in regions])]
    radius, angle, height = _polar(points, axis)
    widest = np.maximum.reduceat(radius, first)
    top, bottom = np.maximum.reduceat(height, first), np.minimum.reduceat(height, first)
    good = (widest <= axis.radius) & (np.maximum(np.abs(top), np.abs(bottom)) <= axis.half_length)
    good &= (widest >= 10 * ROUND_MM) & (top - bottom >= 10 * ROUND_MM)
    # A strip is narrow, and not square to the axis.
    far = radius > 10 * ROUND_MM
    counts = np.diff([*first, len(points)])
    place = np.where(far, np.arange(len(points)), len(points))
    origin = np.minimum(np.minimum.reduceat(place, first), len(points) - 1)
    turn = np.angle(np.exp(1j * (angle - np.repeat(angle[origin], counts))))
    most = np.maximum.reduceat(np.where(far, turn, -np.inf), first)
    span = most - np.minimum.reduceat(np.where(far, turn, np.inf), first)
    good &= (span <= np.radians(12.0)) & (span >= 1e-3)
    return [region for region, fits in zip(regions, good.tolist(), strict=True) if fits]


Rims = dict[tuple[int, int], list[tuple[int, int]]]


def _rims(faces: NDArray[np.int32], labels: NDArray[np.int32]) -> Rims:
    """Mesh edges between each ordered pair of regions, as the first region runs along them."""
    beside = _neighbours(faces)
    rims: Rims = {}
    for face, edge in np.argwhere(labels[beside] != labels[:, None]).tolist():
        pair = (int(labels[face]), int(labels[beside[face, edge]]))
        ends = (int(faces[face, edge]), int(faces[face, (edge + 1) % 3]))
        rims.setdefault(pair, []).append(ends)
    return rims


def _corners_by_region(
    faces: NDArray[np.int32], labels: NDArray[np.int32], count: int
) -> list[NDArray[np.int32]]:
    order = np.argsort(labels, kind="stable")
    parts = np.split(faces[order], np.searchsorted(labels[order], np.arange(1, count)))
    return [np.unique(part) for part in parts]


def _regions_near(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], labels: NDArray[np.int32], axis: Axis
) -> list[int]:
    radius, _, height = _polar(vertices, axis)
    inside = (radius <= axis.radius) & (np.abs(height) <= axis.half_length)
    return [int(label) for label in np.unique(labels[inside[faces].all(axis=1)])]


def _square(plane: Plane, axis: Axis) -> bool:
    return abs(abs(plane.normal[axis.direction]) - 1.0) < 1e-6


def _same(one: Strip, other: Strip) -> bool:
    return (
        one[0] == other[0]
        and one[3] == other[3]
        and abs(one[1] - other[1]) < 2 * ROUND_MM
        and abs(one[2] - other[2]) < 5e-3
    )


def _drop_unfit(
    vertices: NDArray[np.float64],
    planes: Sequence[Plane],
    axes: Sequence[Axis],
    rims: Rims,
    strips: Strips,
) -> None:
    """Take out strips whose rim cannot follow the round surface, until none is left to take."""
    beside: dict[int, list[int]] = {}
    for one, other in rims:
        beside.setdefault(one, []).append(other)

    def fits(region: int) -> bool:
        index, _, slope, _ = strips[region]
        axis = axes[index]
        for other in beside[region]:
            joined = other in strips and _same(strips[region], strips[other])
            for start, end in rims[region, other]:
                ends = vertices[[start, end]]
                radius, angle, height = _polar(ends, axis)
                turn = abs(np.angle(np.exp(1j * (angle[1] - angle[0]))))
                if min(radius) * turn < ROUND_MM or (slope != 0.0 and min(radius) < ROUND_MM):
                    continue  # runs straight along the surface
                if joined:
                    return False  # a slanted cut between two strips of one surface
                if abs(height[1] - height[0]) > ROUND_MM:
                    return False
                flat = other not in strips and _square(planes[other], axis)
                turned = other in strips and strips[other][0] == index
                if not (flat or turned):
                    return False
        return True

    queue = deque(sorted(strips))
    while queue:
        region = queue.popleft()
        if region in strips and not fits(region):
            del strips[region]
            queue.extend(other for other in sorted(beside[region]) if other in strips)


def _drop_lonely(beside: dict[int, list[int]], strips: Strips) -> None:
    """Take out runs of fewer than three strips: too few to tell a round face from a chamfer."""
    seen: set[int] = set()
    for seed in sorted(strips):
        if seed in seen:
            continue
        seen.add(seed)
        run, queue = [seed], deque([seed])
        while queue:
            for other in beside[queue.popleft()]:
                if other in strips and other not in seen and _same(strips[seed], strips[other]):
                    seen.add(other)
                    run.append(other)
                    queue.append(other)
        if len(run) < 3:
            for region in run:
                del strips[region]


def _joined(
    vertices: NDArray[np.float64],
    labels: NDArray[np.int32],
    planes: Sequence[Plane],
    axes: Sequence[Axis],
    rims: Rims,
    strips: Strips,
    corners_of: list[NDArray[np.int32]],
) -> tuple[NDArray[np.int32], list[Surface]]:
    """Flood strips of one surface together, keeping each face to less than a full turn."""
    beside: dict[int, list[int]] = {}
    for one, other in rims:
        beside.setdefault(one, []).append(other)

    def sector(region: int) -> int:
        # Faces are cut along two fixed half-planes, so that none closes on itself.
        _, angle, _ = _polar(vertices[corners_of[region]].mean(axis=0), axes[strips[region][0]])
        return int(angle > 0.0)

    _drop_lonely(beside, strips)
    group: dict[int, int] = {}
    members: list[list[int]] = []
    for seed in sorted(strips):
        if seed in group:
            continue
        group[seed] = len(members)
        found = [seed]
        queue = deque([seed])
        while queue:
            here = queue.popleft()
            for other in sorted(beside[here]):
                if (
                    other in strips
                    and other not in group
                    and _same(strips[seed], strips[other])
                    and sector(other) == sector(seed)
                ):
                    group[other] = group[seed]
                    found.append(other)
                    queue.append(other)
        members.append(found)
    surfaces: list[Surface] = []
    renamed = np.empty(len(planes), dtype=np.int32)
    for region, plane in enumerate(planes):
        if region not in group:
            renamed[region] = len(surfaces)
            surfaces.append(plane)
    for found in members:
        values = np.array([strips[region][1:3] for region in found])
        index, _, _, outward = strips[found[0]]
        renamed[found] = len(surfaces)
        radius, slope = values.mean(axis=0)
        surfaces.append(Round(axes[index], float(radius), float(slope), outward))
    return renamed[labels], surfaces
