"""Kernels of the software renderer: fill triangles, cast shadows, shade.

All loops run in a fixed order in double precision, so a picture is the same on every run.
"""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"
from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Ints = NDArray[np.int32]

__all__ = ["cast_light", "fill_depth", "fill_triangles", "surface_points"]


@njit(cache=True)
def _span(u: float, v: float, ux: float, vx: float, most: int) -> tuple[int, int]:
    """First and last of the columns 0 to `most` of a row that lie in a triangle.

    `u` and `v` are the shares of two of its corners at column 0, and grow by `ux` and `vx`.
    """
    first, last = 0, most
    for value, slope in ((u, ux), (v, vx), (1.0 - u - v, -(ux + vx))):
        if slope > 0.0:
            if value < 0.0:
                first = max(first, math.ceil(min(-value / slope, most + 1.0) - 1e-9))
        elif value < 0.0:
            return 0, -1
        elif slope < 0.0:
            last = min(last, math.floor(min(value / -slope, float(most)) + 1e-9))
    return first, last


@njit(cache=True)
def fill_triangles(
    screen: Floats, corners: Ints, width: int, height: int
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Nearest triangle at each pixel.

    Parameters
    ----------
    screen : (v, 3) float64 array
        Pixel x and y of each vertex, and the inverse of its depth.
    corners : (f, 3) int32 array
        Triangles as indices into `screen`.
    width : int
        Width of the picture in pixels.
    height : int
        Height of the picture in pixels.

    Returns
    -------
    nearness : (height, width) float32 array
        Inverse of the depth at each pixel; 0 where nothing is.
    triangle : (height, width) int32 array
        Index of the nearest triangle; -1 where nothing is.
    """
    nearness = np.zeros((height, width), dtype=np.float32)
    triangle = np.full((height, width), -1, dtype=np.int32)
    for t in range(len(corners)):
        a, b, c = corners[t]
        ax, ay, bx, by = screen[a, 0], screen[a, 1], screen[b, 0], screen[b, 1]
        cx, cy = screen[c, 0], screen[c, 1]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area >= 0.0:  # y points down: front faces run clockwise on the screen
            continue
        left = max(0, math.ceil(min(ax, bx, cx) - 0.5))
        right = min(width - 1, math.floor(max(ax, bx, cx) - 0.5))
        top = max(0, math.ceil(min(ay, by, cy) - 0.5))
        bottom = min(height - 1, math.floor(max(ay, by, cy) - 0.5))
        # All is linear over the triangle: a division a side and row, an addition a pixel.
        ux, uy = (by - cy) / area, (cx - bx) / area
        vx, vy = (cy - ay) / area, (ax - cx) / area
        step = ux * screen[a, 2] + vx * screen[b, 2] - (ux + vx) * screen[c, 2]
        for row in range(top, bottom + 1):
            u = ux * (left + 0.5 - cx) + uy * (row + 0.5 - cy)
            v = vx * (left + 0.5 - cx) + vy * (row + 0.5 - cy)
            first, last = _span(u, v, ux, vx, right - left)
            near = u * screen[a, 2] + v * screen[b, 2] + (1.0 - u - v) * screen[c, 2]
            for column in range(first, last + 1):
                here = near + column * step
                if here > nearness[row, left + column]:
                    nearness[row, left + column] = here
                    triangle[row, left + column] = t
    return nearness, triangle


@njit(cache=True)
def surface_points(
    triangle: Ints, screen: Floats, corners: Ints, vertices: Floats, normals: Singles
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Place and normal of the surface at each covered pixel.

    Parameters
    ----------
    triangle : (h, w) int32 array
        Index of the triangle at each pixel, from :func:`fill_triangles`; -1 where nothing is.
    screen : (v, 3) float64 array
        Pixel x and y of each vertex, and the inverse of its depth.
    corners : (f, 3) int32 array
        Triangles as indices into `vertices`.
    vertices : (v, 3) float64 array
        Places of the vertices.
    normals : (f, 3, 3) float32 array
        Unit normal at each corner of each triangle.

    Returns
    -------
    points : (h, w, 3) float32 array
        Place of the surface at each pixel; zero where nothing is.
    directions : (h, w, 3) float32 array
        Unit normal there; zero where nothing is.
    """
    height, width = triangle.shape
    points = np.zeros((height, width, 3), dtype=np.float32)
    directions = np.zeros((height, width, 3), dtype=np.float32)
    for row in range(height):
        for column in range(width):
            t = triangle[row, column]
            if t < 0:
                continue
            a, b, c = corners[t]
            x, y = column + 0.5, row + 0.5
            ax, ay, bx, by = screen[a, 0], screen[a, 1], screen[b, 0], screen[b, 1]
            cx, cy = screen[c, 0], screen[c, 1]
            area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
            u = ((bx - x) * (cy - y) - (by - y) * (cx - x)) / area * screen[a, 2]
            v = ((cx - x) * (ay - y) - (cy - y) * (ax - x)) / area * screen[b, 2]
            w = ((ax - x) * (by - y) - (ay - y) * (bx - x)) / area * screen[c, 2]
            total = u + v + w
            u, v, w = u / total, v / total, w / total
            length = 0.0
            for k in range(3):
                points[row, column, k] = (
                    u * vertices[a, k] + v * vertices[b, k] + w * vertices[c, k]
                )
                value = u * normals[t, 0, k] + v * normals[t, 1, k] + w * normals[t, 2, k]
                directions[row, column, k] = value
                length += value * value
            length = math.sqrt(length)
            if length > 0.0:
                for k in range(3):
                    directions[row, column, k] /= length
    return points, directions


@njit(cache=True)
def fill_depth(flat: Floats, corners: Ints, size: int) -> NDArray[np.float32]:
    """Greatest height above each texel of a square map.

    Parameters
    ----------
    flat : (v, 3) float64 array
        Texel x and y of each vertex, and its height towards the light.
    corners : (f, 3) int32 array
        Triangles as indices into `flat`.
    size : int
        Texels along the side of the map.

    Returns
    -------
    (size, size) float32 array
        Height towards the light; -1e30 where nothing is.
    """
    depth = np.full((size, size), -1e30, dtype=np.float32)
    for t in range(len(corners)):
        a, b, c = corners[t]
        ax, ay, bx, by = flat[a, 0], flat[a, 1], flat[b, 0], flat[b, 1]
        cx, cy = flat[c, 0], flat[c, 1]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area <= 0.0:  # only what faces the light; the other side is in its own shade
            continue
        left = max(0, math.ceil(min(ax, bx, cx) - 0.5))
        right = min(size - 1, math.floor(max(ax, bx, cx) - 0.5))
        top = max(0, math.ceil(min(ay, by, cy) - 0.5))
        bottom = min(size - 1, math.floor(max(ay, by, cy) - 0.5))
        if left > right or top > bottom:
            continue
        ux, uy = (by - cy) / area, (cx - bx) / area
        vx, vy = (cy - ay) / area, (ax - cx) / area
        step = ux * flat[a, 2] + vx * flat[b, 2] - (ux + vx) * flat[c, 2]
        for row in range(top, bottom + 1):
            u = ux * (left + 0.5 - cx) + uy * (row + 0.5 - cy)
            v = vx * (left + 0.5 - cx) + vy * (row + 0.5 - cy)
            first, last = _span(u, v, ux, vx, right - left)
            high = u * flat[a, 2] + v * flat[b, 2] + (1.0 - u - v) * flat[c, 2]
            for column in range(first, last + 1):
                here = high + column * step
                depth[row, left + column] = max(depth[row, left + column], here)
    return depth


@njit(cache=True)
def cast_light(
    light: Singles,
    points: Singles,
    directions: Singles,
    depth: Singles,
    frame: Floats,
    offset: Floats,
    scale: float,
    bias: float,
    strength: float,
    scatter: float,
) -> None:
    """Add one distant light, with its shadows, to the light that falls on each point.

    Parameters
    ----------
    light : (n,) float32 array
        Linear light on each point; added to in place.
    points : (n, 3) float32 array
        Points of surfaces.
    directions : (n, 3) float32 array
        Unit normals there.
    depth : (s, s) float32 array
        Shadow map of the light, from :func:`fill_depth`.
    frame : (3, 3) float64 array
        Rows: unit vectors along the map's x, along its y, and towards the light.
    offset : (2,) float64 array
        Place of the map's corner along its x and y, in the unit of `points`.
    scale : float
        Texels along a unit of length.
    bias : float
        How far points are lifted off their surface before the comparison, in the unit of `points`.
    strength : float
        Linear light on a surface that faces the light.
    scatter : float
        Largest distance in texels by which lookups are scattered.
    """
    size = depth.shape[0]
    state = np.int64(12345)
    for i in range(len(points)):
        slope = (
            directions[i, 0] * frame[2, 0]
            + directions[i, 1] * frame[2, 1]
            + directions[i, 2] * frame[2, 2]
        )
        if slope <= 0.0:
            continue
        lift = bias * (1.0 + 2.0 * (1.0 - slope))
        px = points[i, 0] + lift * directions[i, 0]
        py = points[i, 1] + lift * directions[i, 1]
        pz = points[i, 2] + lift * directions[i, 2]
        # Lookups scatter by up to a texel, so that many sharp shadows blend into a soft one.
        state = (state * 1664525 + 1013904223) & 0xFFFFFFFF
        jitter_x = (state >> 16) / 32768.0 - 1.0
        state = (state * 1664525 + 1013904223) & 0xFFFFFFFF
        jitter_y = (state >> 16) / 32768.0 - 1.0
        x = (px * frame[0, 0] + py * frame[0, 1] + pz * frame[0, 2] - offset[0]) * scale - 0.5
        y = (px * frame[1, 0] + py * frame[1, 1] + pz * frame[1, 2] - offset[1]) * scale - 0.5
        x += scatter * jitter_x
        y += scatter * jitter_y
        high = px * frame[2, 0] + py * frame[2, 1] + pz * frame[2, 2]
        column, row = math.floor(x), math.floor(y)
        if column < 0 or row < 0 or column >= size - 1 or row >= size - 1:
            light[i] += strength * slope
            continue
        fx, fy = x - column, y - row
        seen = 0.0
        if depth[row, column] <= high:
            seen += (1.0 - fx) * (1.0 - fy)
        if depth[row, column + 1] <= high:
            seen += fx * (1.0 - fy)
        if depth[row + 1, column] <= high:
            seen += (1.0 - fx) * fy
        if depth[row + 1, column + 1] <= high:
            seen += fx * fy
        light[i] += strength * slope * seen
