"""Whether two triangles of a mesh really cross, by exact signs.

MeshLab finds triangles of a surface that cross others. Of triangles in one slanted plane it
sometimes takes two that only lie beside each other for crossing, and what it says of these depends
on where they lie in memory. So what it finds is looked at once more: signs of determinants are told
by floats where these are sure, and by fractions elsewhere.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fabfold.solid.convert import to_mesh_set

__all__ = ["crossing_triangles", "really_crossing"]

#: A determinant above this share of the product of its lengths has the sign that floats give it.
_SURE = 1e-12

Point = Sequence[float]


def crossing_triangles(
    vertices: NDArray[np.float64], faces: NDArray[np.integer[Any]]
) -> NDArray[np.int64]:
    """Triangles of a mesh that cross others: of those that MeshLab finds, the ones that really do.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        Corners of the mesh.
    faces : (f, 3) integer array
        Triangles as indices into `vertices`.

    Returns
    -------
    (k,) int64 array
        Their indices; empty for a surface that is a plain solid's.
    """
    meshes = to_mesh_set(vertices, faces)
    meshes.compute_selection_by_self_intersections_per_face()
    found = np.flatnonzero(meshes.current_mesh().face_selection_array()).astype(np.int64)
    return really_crossing(vertices, faces, found)


def really_crossing(
    vertices: NDArray[np.float64], faces: NDArray[np.integer[Any]], suspects: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Those of some triangles that meet another of them where they share nothing.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        Corners of the mesh.
    faces : (f, 3) integer array
        Triangles as indices into `vertices`.
    suspects : (k,) int64 array
        Triangles that are looked at.

    Returns
    -------
    (m,) int64 array
        Those that cross or touch another one beyond their common corners and edges.
    """
    corners = np.asarray(vertices, dtype=np.float64)[faces[suspects]]
    low, high = corners.min(axis=1), corners.max(axis=1)
    found: set[int] = set()
    for one in range(len(suspects)):
        near = ((low[one + 1 :] <= high[one]) & (high[one + 1 :] >= low[one])).all(axis=1)
        for other in (one + 1 + np.flatnonzero(near)).tolist():
            if one in found and other in found:
                continue
            pair = [faces[suspects[k]].tolist() for k in (one, other)]
            if _meet(*pair, *(corners[k].tolist() for k in (one, other))):
                found |= {one, other}
    return np.asarray(suspects[sorted(found)], dtype=np.int64)


def _meet(one: list[int], two: list[int], a: list[Point], b: list[Point]) -> bool:
    """Whether two triangles have more in common than their common corners."""
    common = [corner for corner in one if corner in two]
    if len(common) == 3:
        return True
    if len(common) == 2:  # One lies on the other where they are folded flat along their edge.
        (tip,) = (point for corner, point in zip(one, a, strict=True) if corner not in common)
        (other,) = (point for corner, point in zip(two, b, strict=True) if corner not in common)
        if _side(a[0], a[1], a[2], other) != 0:
            return False
        edge = [a[one.index(corner)] for corner in common]
        flat = _flat(a)
        ends = [_turn(*(_drop(point, flat) for point in (*edge, end))) for end in (tip, other)]
        return ends[0] * ends[1] > 0
    edges = [*_edges(one, a, common), *_edges(two, b, common)]
    sides = [b] * (len(edges) // 2) + [a] * (len(edges) // 2)
    return any(_pierces(p, q, side) for (p, q), side in zip(edges, sides, strict=True))


def _edges(
    corners: list[int], points: list[Point], without: list[int]
) -> Iterator[tuple[Point, Point]]:
    """The edges of a triangle that do not begin or end at some corners."""
    for k in range(3):
        ends = k, (k + 1) % 3
        if not any(corners[end] in without for end in ends):
            yield points[ends[0]], points[ends[1]]


def _pierces(p: Point, q: Point, triangle: list[Point]) -> bool:
    """Whether a segment has a point in common with a triangle."""
    first, second, third = triangle
    ends = _side(first, second, third, p), _side(first, second, third, q)
    if ends[0] * ends[1] > 0:
        return False
    if ends != (0, 0):
        turns = {_side(p, q, triangle[k], triangle[(k + 1) % 3]) for k in range(3)}
        return not {1, -1} <= turns
    flat = _flat(triangle)
    start, end, *plane = (_drop(point, flat) for point in (p, q, *triangle))
    for point in (start, end):
        turns = {_turn(plane[k], plane[(k + 1) % 3], point) for k in range(3)}
        if not {1, -1} <= turns:
            return True
    return any(_cross(start, end, plane[k], plane[(k + 1) % 3]) for k in range(3))


def _cross(p: Point, q: Point, r: Point, s: Point) -> bool:
    """Whether two segments of a plane cross; where an end lies on the other it does not matter."""
    return (
        _turn(p, q, r) * _turn(p, q, s) <= 0
        and _turn(r, s, p) * _turn(r, s, q) <= 0
        and (_turn(p, q, r), _turn(p, q, s)) != (0, 0)
    )


def _flat(triangle: list[Point]) -> int:
    """The axis along which a triangle is seen largest."""
    first, second, third = np.array(triangle)
    return int(np.abs(np.cross(second - first, third - first)).argmax())


def _drop(point: Point, axis: int) -> Point:
    return [value for k, value in enumerate(point) if k != axis]


def _side(a: Point, b: Point, c: Point, d: Point) -> int:
    """On which side of the plane of a, b, c the point d lies: 1, 0 or -1."""
    return _sign([[p[k] - a[k] for k in range(3)] for p in (b, c, d)], (a, b, c, d))


def _turn(a: Point, b: Point, c: Point) -> int:
    """Whether c lies left of the line from a to b in the plane: 1, 0 or -1."""
    return _sign([[p[k] - a[k] for k in range(2)] for p in (b, c)], (a, b, c))


def _sign(rows: list[list[float]], points: Sequence[Point]) -> int:
    """Sign of the determinant of differences from the first of some points."""
    size = 1.0
    for row in rows:
        size *= max(abs(value) for value in row)
    value = _determinant(rows)
    # Differences of floats are rounded: by no more than their own last digit, if at all.
    if abs(value) > _SURE * max(size, 1e-300) * _spread(rows, points):
        return 1 if value > 0 else -1
    first = [Fraction(x) for x in points[0]]
    exact = [[Fraction(x) - y for x, y in zip(point, first, strict=True)] for point in points[1:]]
    whole = _determinant(exact)
    return int(whole > 0) - int(whole < 0)


def _spread(rows: list[list[float]], points: Sequence[Point]) -> float:
    """How much larger the coordinates are than their differences, at least 1."""
    largest = max(abs(value) for point in points for value in point)
    least = min(max(abs(value) for value in row) for row in rows)
    return max(1.0, largest / least) if least > 0 else np.inf


def _determinant(rows: list[list[Any]]) -> Any:
    if len(rows) == 2:
        (a, b), (c, d) = rows
        return a * d - b * c
    (a, b, c), (d, e, f), (g, h, i) = rows
    return a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
