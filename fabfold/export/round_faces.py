"""Round faces of the hinges, from the narrow flat strips that a mesh has for them.

The strips that a mesh has for a cylinder or cone about a hinge's axis become one region on the true
surface, where all of its rim allows it: a rim must run straight along the surface, or around it in
a plane square to the axis beside a flat face or another surface of the same hinge. Strips with any
other rim, such as where a barrel meets a sculpted surface, stay flat.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fabfold.export.surfaces import ROUND_MM, Axis, Plane, Round, Surface, neighbours

__all__ = ["round_regions", "sculpted_triangles"]

#: Index of the axis, radius at its point, slope, and whether the normal points away from it.
Strip = tuple[int, float, float, bool]
Strips = dict[int, Strip]


def _polar(
    points: NDArray[np.float64], axis: Axis
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Radius, angle and height of points about an axis."""
    along = axis.direction
    first, second = (along + 1) % 3, (along + 2) % 3
    offset = points - np.asarray(axis.point)
    x, y = offset[..., first], offset[..., second]
    return np.hypot(x, y), np.arctan2(y, x), offset[..., along]


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
        if not near:
            continue
        normals = np.array([planes[region].normal for region in near])
        found = _narrow(vertices, [corners_of[region] for region in near], normals, axis)
        for row, radius, slope, outward in found:
            strips[near[row]] = (index, radius, slope, outward)
    return strips


def _narrow(
    vertices: NDArray[np.float64],
    corners: list[NDArray[np.int32]],
    normals: NDArray[np.float64],
    axis: Axis,
) -> list[tuple[int, float, float, bool]]:
    """The regions, by their corners, that are narrow strips of a cylinder or cone about an axis.

    Returns
    -------
    list of (int, float, float, bool)
        Row of the region, radius of its surface at the axis' point, slope, and whether the normal
        points away from the axis.
    """
    counts = np.array([len(own) for own in corners])
    first = np.cumsum([0, *counts[:-1]])
    points = vertices[np.concatenate(corners)]
    radius, angle, height = _polar(points, axis)
    widest, least = np.maximum.reduceat(radius, first), np.minimum.reduceat(radius, first)
    top, bottom = np.maximum.reduceat(height, first), np.minimum.reduceat(height, first)
    good = (widest <= axis.radius) & (np.maximum(np.abs(top), np.abs(bottom)) <= axis.half_length)
    good &= (widest >= 10 * ROUND_MM) & (top - bottom >= 10 * ROUND_MM)
    # A strip is narrow, and not square to the axis.
    far = radius > 10 * ROUND_MM
    place = np.where(far, np.arange(len(points)), len(points))
    origin = np.minimum(np.minimum.reduceat(place, first), len(points) - 1)
    turn = np.angle(np.exp(1j * (angle - np.repeat(angle[origin], counts))))
    most = np.maximum.reduceat(np.where(far, turn, -np.inf), first)
    lowest = np.minimum.reduceat(np.where(far, turn, np.inf), first)
    good &= (most - lowest <= np.radians(12.0)) & (most - lowest >= 1e-3)
    # Radius over height is a line: by least squares, and no corner far from it.
    lever = height - np.repeat(np.add.reduceat(height, first) / counts, counts)
    mean = np.add.reduceat(radius, first) / counts
    cone = widest - least >= ROUND_MM
    square = np.add.reduceat(lever * lever, first)
    moment = np.add.reduceat(lever * (radius - np.repeat(mean, counts)), first)
    slope = np.where(cone & (square > 0.0), moment / np.where(square > 0.0, square, 1.0), 0.0)
    middle_height = np.add.reduceat(height, first) / counts
    at_point = np.where(cone, mean - slope * middle_height, (least + widest) / 2)
    fit = np.repeat(at_point, counts) + np.repeat(slope, counts) * height
    off = np.maximum.reduceat(np.abs(radius - fit), first)
    good &= ~cone | ((off <= ROUND_MM) & (np.abs(slope) <= 20))
    # The flat face is square to the surface's normal half-way.
    along = axis.direction
    half = np.where(good, (lowest + most) / 2 + angle[origin], 0.0)
    away = np.cos(half) * normals[:, (along + 1) % 3] + np.sin(half) * normals[:, (along + 2) % 3]
    good &= np.abs(np.abs(away) - 1.0 / np.hypot(1.0, slope)) <= 0.02
    return [
        (int(row), float(at_point[row]), float(slope[row]), bool(away[row] > 0))
        for row in np.flatnonzero(good)
    ]


Rims = dict[tuple[int, int], list[tuple[int, int]]]


def _rims(faces: NDArray[np.int32], labels: NDArray[np.int32]) -> Rims:
    """Mesh edges between each ordered pair of regions, as the first region runs along them."""
    beside = labels[neighbours(faces)]
    at = beside != labels[:, None]
    one, other = np.broadcast_to(labels[:, None], at.shape)[at], beside[at]
    start, end = faces[at], np.roll(faces, -1, axis=1)[at]
    rims: Rims = {}
    for pair in zip(one.tolist(), other.tolist(), start.tolist(), end.tolist(), strict=True):
        rims.setdefault(pair[:2], []).append(pair[2:])
    return rims


def _corners_by_region(
    faces: NDArray[np.int32], labels: NDArray[np.int32], count: int
) -> list[NDArray[np.int32]]:
    many = int(faces.max()) + 1
    pairs = np.unique(np.repeat(labels.astype(np.int64), 3) * many + faces.reshape(-1))
    ends = np.searchsorted(pairs, np.arange(count + 1) * many).tolist()
    corners = (pairs % many).astype(np.int32)
    return [corners[low:high] for low, high in pairwise(ends)]


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


def _rim_ways(
    vertices: NDArray[np.float64], axes: Sequence[Axis], rims: Rims, strips: Strips
) -> dict[tuple[int, int], tuple[bool, bool]]:
    """How the rim of each strip runs along each of its neighbours.

    Whether all of it runs straight along the surface, and whether all else of it is square to the
    axis.
    """
    pairs = [pair for pair in rims if pair[0] in strips]
    if not pairs:
        return {}
    counts = [len(rims[pair]) for pair in pairs]
    first = np.cumsum([0, *counts[:-1]])
    ends = vertices[np.array([edge for pair in pairs for edge in rims[pair]])]
    kinds = np.repeat([strips[pair[0]][0] for pair in pairs], counts)
    cone = np.repeat([strips[pair[0]][2] != 0.0 for pair in pairs], counts)
    straight = np.zeros(len(ends), dtype=bool)
    level = np.zeros(len(ends), dtype=bool)
    for index in np.unique(kinds).tolist():
        here = kinds == index
        radius, angle, height = _polar(ends[here], axes[index])
        nearest = radius.min(axis=1)
        turn = np.abs(np.angle(np.exp(1j * (angle[:, 1] - angle[:, 0]))))
        straight[here] = (nearest * turn < ROUND_MM) | (cone[here] & (nearest < ROUND_MM))
        level[here] = np.abs(height[:, 1] - height[:, 0]) <= ROUND_MM
    all_straight = np.logical_and.reduceat(straight, first).tolist()
    all_level = np.logical_and.reduceat(straight | level, first).tolist()
    return dict(zip(pairs, zip(all_straight, all_level, strict=True), strict=True))


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
    ways = _rim_ways(vertices, axes, rims, strips)

    def fits(region: int) -> bool:
        index = strips[region][0]
        for other in beside[region]:
            straight, level = ways[region, other]
            if straight:
                continue  # runs straight along the surface
            if other in strips and _same(strips[region], strips[other]):
                return False  # a slanted cut between two strips of one surface
            if not level:
                return False
            flat = other not in strips and _square(planes[other], axes[index])
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

    _drop_lonely(beside, strips)
    # Faces are cut along two fixed half-planes, so that none closes on itself.
    sector = {
        region: float(_polar(vertices[corners_of[region]].mean(axis=0), axes[strip[0]])[1]) > 0.0
        for region, strip in strips.items()
    }
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
                    and sector[other] == sector[seed]
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
