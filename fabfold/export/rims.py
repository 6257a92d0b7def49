"""Fewer corners where sculpted surfaces meet flat faces.

A model that is cut along the lattice has a corner on the cut for each edge of its mesh, and every
one of them needs triangles of its own beside it. A corner that hardly bends the rim is merged into
the next one: flat faces stay in their planes, and the sculpted surface beside them can be thinned.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from fabfold.export.surfaces import Plane
from fabfold.meshes import compact

__all__ = ["straightened"]

Point = tuple[float, float, float]

#: Times that all corners are looked at: those beside a merged one may follow.
_SWEEPS = 3
#: Least cosine between the normals of a sculpted triangle before and after.
_TURNED = 0.5
#: Twice the area of the smallest triangle that may come about, mm².
_SMALLEST = 1e-6


def straightened(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    labels: NDArray[np.int32],
    planes: Sequence[Plane],
    sculpted: NDArray[np.bool_],
    tolerance_mm: float,
) -> tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.bool_]]:
    """Merge corners between a sculpted surface and one flat face that lies along the lattice.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        Corners of a closed mesh in mm.
    faces : (f, 3) int32 array
        Triangles as indices into `vertices`.
    labels : (f,) int32 array
        Flat region of each triangle, from :func:`fabfold.export.surfaces.flat_regions`.
    planes : sequence of Plane
        Plane of each flat region.
    sculpted : (f,) bool array
        Triangles of sculpted surfaces.
    tolerance_mm : float
        Largest distance of a corner that goes from the new rim, mm.

    Returns
    -------
    vertices : (w, 3) float64 array
        The corners that stay, where they were, mm.
    faces : (g, 3) int32 array
        Triangles as indices into the new vertices; the mesh is as closed as before.
    sculpted : (g,) bool array
        Which of them are sculpted.
    """
    mesh = _Rims(vertices, faces, labels, planes, sculpted, tolerance_mm)
    beside = [np.zeros(len(vertices), dtype=bool) for _ in range(2)]
    for mark, side in zip(beside, (sculpted, ~sculpted), strict=True):
        mark[faces[side]] = True
    corners = np.flatnonzero(beside[0] & beside[1]).tolist()
    for _ in range(_SWEEPS):
        if not sum([mesh.merge(corner) for corner in corners]):
            break
    points, triangles = compact(vertices, np.array(mesh.triangles, np.int32)[mesh.there])
    return points, triangles.astype(np.int32), sculpted[mesh.there]


class _Rims:
    """A mesh whose corners can be merged one by one."""

    def __init__(
        self,
        vertices: NDArray[np.float64],
        faces: NDArray[np.int32],
        labels: NDArray[np.int32],
        planes: Sequence[Plane],
        sculpted: NDArray[np.bool_],
        tolerance_mm: float,
    ) -> None:
        self.points: list[Point] = [(x, y, z) for x, y, z in vertices.tolist()]
        self.triangles: list[list[int]] = faces.tolist()
        self.there = np.ones(len(faces), dtype=bool)
        self.sculpted: list[bool] = sculpted.tolist()
        self.label: list[int] = labels.tolist()
        self.along_lattice = [max(map(abs, plane.normal)) > 1.0 - 1e-9 for plane in planes]
        self.most = tolerance_mm**2
        self.around: list[list[int]] = [[] for _ in self.points]
        for number, triangle in enumerate(self.triangles):
            for corner in triangle:
                self.around[corner].append(number)
        # Corners that went, by the edge of the rim that stands for them.
        self.passed: dict[tuple[int, int], list[Point]] = {}

    def merge(self, corner: int) -> bool:
        """Merge a corner into a neighbour on its rim; False where it has none or must stay."""
        ends = self._rim_ends(corner)
        if ends is None:
            return False
        passed = [self.points[corner]]
        for end in ends:
            passed += self.passed.get(_edge(corner, end), [])
        first, last = (self.points[end] for end in ends)
        if any(_square_distance(point, first, last) > self.most for point in passed):
            return False
        for end in ends:
            if self._may_move(corner, end):
                self._move(corner, end)
                for other in ends:
                    self.passed.pop(_edge(corner, other), None)
                self.passed[_edge(*ends)] = passed
                return True
        return False

    def _rim_ends(self, corner: int) -> tuple[int, int] | None:
        """The corners before and after one that lies between a sculpted and one flat face."""
        flat = {self.label[t] for t in self.around[corner] if not self.sculpted[t]}
        if len(flat) != 1 or not self.along_lattice[flat.pop()]:
            return None
        beside: dict[int, list[bool]] = {}
        for number in self.around[corner]:
            for other in self.triangles[number]:
                beside.setdefault(other, []).append(self.sculpted[number])
        del beside[corner]
        ends = [other for other, sides in beside.items() if sorted(sides) == [False, True]]
        return (ends[0], ends[1]) if len(ends) == 2 else None

    def _may_move(self, corner: int, goal: int) -> bool:
        """Whether no triangle turns over or vanishes, and the surface stays one sheet."""
        if len(self._neighbours(corner) & self._neighbours(goal)) != 2:
            return False
        for number in self.around[corner]:
            triangle = self.triangles[number]
            if goal in triangle:
                continue
            before = _normal(*(self.points[k] for k in triangle))
            after = _normal(*(self.points[goal if k == corner else k] for k in triangle))
            length = math.hypot(*after)
            least = _TURNED if self.sculpted[number] else 0.0
            if length < _SMALLEST or _dot(before, after) <= least * math.hypot(*before) * length:
                return False
        return True

    def _neighbours(self, corner: int) -> set[int]:
        found = {k for number in self.around[corner] for k in self.triangles[number]}
        found.discard(corner)
        return found

    def _move(self, corner: int, goal: int) -> None:
        for number in self.around[corner]:
            triangle = self.triangles[number]
            if goal in triangle:
                self.there[number] = False
                for other in triangle:
                    if other != corner:
                        self.around[other].remove(number)
            else:
                triangle[triangle.index(corner)] = goal
                self.around[goal].append(number)
        self.around[corner] = []


def _edge(one: int, other: int) -> tuple[int, int]:
    return (one, other) if one < other else (other, one)


def _dot(a: Iterable[float], b: Iterable[float]) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))


def _normal(a: Point, b: Point, c: Point) -> Point:
    """Normal of a triangle, as long as twice its area."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


def _square_distance(point: Point, first: Point, last: Point) -> float:
    """Squared distance of a point from a stretch."""
    along = [q - p for p, q in zip(first, last, strict=True)]
    away = [q - p for p, q in zip(first, point, strict=True)]
    square = _dot(along, along)
    share = min(1.0, max(0.0, _dot(away, along) / square)) if square > 0 else 0.0
    return sum((a - share * b) ** 2 for a, b in zip(away, along, strict=True))
