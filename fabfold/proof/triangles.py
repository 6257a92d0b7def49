"""Distances of two triangles: the exact one, and a bound that costs little."""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["plane_gap", "triangle_distance"]

F64 = NDArray[np.float64]


@njit(cache=True)
def _segments(p: F64, u: F64, q: F64, v: F64, out: F64) -> float:
    """Squared distance of two segments (point, edge vector); `out` gets the two nearest points."""
    a = u[0] * u[0] + u[1] * u[1] + u[2] * u[2]
    e = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
    rx = p[0] - q[0]
    ry = p[1] - q[1]
    rz = p[2] - q[2]
    f = v[0] * rx + v[1] * ry + v[2] * rz
    c = u[0] * rx + u[1] * ry + u[2] * rz
    b = u[0] * v[0] + u[1] * v[1] + u[2] * v[2]
    s = 0.0
    t = 0.0
    if a <= 0.0 and e <= 0.0:
        pass
    elif a <= 0.0:
        t = min(1.0, max(0.0, f / e))
    elif e <= 0.0:
        s = min(1.0, max(0.0, -c / a))
    else:
        denominator = a * e - b * b
        if denominator > 1e-14 * a * e:
            s = min(1.0, max(0.0, (b * f - c * e) / denominator))
        t = (b * s + f) / e
        if t < 0.0:
            t = 0.0
            s = min(1.0, max(0.0, -c / a))
        elif t > 1.0:
            t = 1.0
            s = min(1.0, max(0.0, (b - c) / a))
    total = 0.0
    for i in range(3):
        out[0, i] = p[i] + s * u[i]
        out[1, i] = q[i] + t * v[i]
        total += (out[0, i] - out[1, i]) ** 2
    return total


@njit(cache=True)
def _cross(a: F64, b: F64, out: F64) -> None:
    """Cross product; `out` gets it."""
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@njit(cache=True)
def _pierces(tri: F64, edge: F64, normal: F64, p: F64, d: F64, out: F64) -> bool:
    """Whether the segment from p along d goes through a triangle; `out` gets the point."""
    height = 0.0
    rise = 0.0
    for i in range(3):
        height += normal[i] * (p[i] - tri[0, i])
        rise += normal[i] * d[i]
    if rise == 0.0:
        return False
    share = -height / rise
    if share < 0.0 or share > 1.0:
        return False
    point = np.empty(3)
    for i in range(3):
        point[i] = p[i] + share * d[i]
    side = np.empty(3)
    away = np.empty(3)
    for k in range(3):
        for i in range(3):
            away[i] = point[i] - tri[k, i]
        _cross(edge[k], away, side)
        if side[0] * normal[0] + side[1] * normal[1] + side[2] * normal[2] < 0.0:
            return False
    out[0] = point
    out[1] = point
    return True


@njit(cache=True)
def _corner_to_face(
    tri: F64, edge: F64, normal: F64, square: float, corner: F64, out: F64, which: int
) -> float:
    """Squared distance of a corner to a triangle where its foot is inside, else infinity."""
    height = 0.0
    for i in range(3):
        height += normal[i] * (corner[i] - tri[0, i])
    side = np.empty(3)
    away = np.empty(3)
    for k in range(3):
        for i in range(3):
            away[i] = corner[i] - tri[k, i]
        _cross(edge[k], away, side)
        if side[0] * normal[0] + side[1] * normal[1] + side[2] * normal[2] < 0.0:
            return np.inf
    for i in range(3):
        out[which, i] = corner[i]
        out[1 - which, i] = corner[i] - height * normal[i] / square
    return height * height / square


@njit(cache=True)
def triangle_distance(one: F64, two: F64, nearest: F64) -> float:
    """Distance of two triangles.

    Parameters
    ----------
    one, two : (3, 3) float64 arrays
        Corners, mm.
    nearest : (2, 3) float64 array
        Out: a nearest point on each.

    Returns
    -------
    float
        Distance in mm; 0 where they meet.
    """
    edge_one = np.empty((3, 3))
    edge_two = np.empty((3, 3))
    for k in range(3):
        for i in range(3):
            edge_one[k, i] = one[(k + 1) % 3, i] - one[k, i]
            edge_two[k, i] = two[(k + 1) % 3, i] - two[k, i]
    points = np.empty((2, 3))
    best = np.inf
    for k in range(3):
        for j in range(3):
            square = _segments(one[k], edge_one[k], two[j], edge_two[j], points)
            if square < best:
                best = square
                nearest[:] = points
    normal = np.empty(3)
    for turn in range(2):
        tri, edge, corner, stroke = (
            (two, edge_two, one, edge_one) if turn == 0 else (one, edge_one, two, edge_two)
        )
        _cross(edge[0], edge[1], normal)
        size = normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2
        if size <= 0.0:
            continue
        for k in range(3):
            square = _corner_to_face(tri, edge, normal, size, corner[k], points, turn)
            if square < best:
                best = square
                nearest[:] = points
            if best > 0.0 and _pierces(tri, edge, normal, corner[k], stroke[k], points):
                nearest[:] = points
                return 0.0
    return np.sqrt(best)


@njit(cache=True)
def plane_gap(one: F64, two: F64) -> float:
    """Best separation of two triangles by the plane of either.

    Parameters
    ----------
    one, two : (3, 3) float64 arrays
        Corners, mm.

    Returns
    -------
    float
        Lower bound of their distance, mm; below 0 where neither plane parts them.
    """
    best = -np.inf
    edge = np.empty((2, 3))
    normal = np.empty(3)
    for turn in range(2):
        flat, other = (one, two) if turn == 0 else (two, one)
        for k in range(2):
            for i in range(3):
                edge[k, i] = flat[k + 1, i] - flat[0, i]
        _cross(edge[0], edge[1], normal)
        length = np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
        if length <= 0.0:
            continue
        low = np.inf
        high = -np.inf
        for k in range(3):
            height = 0.0
            for i in range(3):
                height += normal[i] * (other[k, i] - flat[0, i])
            low = min(low, height)
            high = max(high, height)
        best = max(best, low / length, -high / length)
    return best
