"""Scan conversion: from a closed mesh to subvoxels, and counts of subvoxels in boxes.

The scan is watertight by construction. Each triangle is cut by the rows of subvoxel centres (one y,
one x after another) at its directed edges. Where a row crosses an edge is computed from the edge's
two corners in the order of their indices, so both triangles beside it get the same floating-point
number. The signed intervals of a closed mesh therefore cancel exactly, whatever the rounding, and
no column leaks.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = [
    "TIE",
    "box_counts",
    "box_counts_kernel",
    "scan_and_summed_volume",
    "scan_mesh",
    "summed_volume",
]

#: So that what lies just half-way falls one way whatever the unit, place and direction of the model
#: and whatever the rounding of its file, in subvoxels: a flat face through centres of subvoxels, a
#: plane of a grid between two. It is more than coordinates of four bytes are off. A power of two,
#: so that centres are exact numbers: a column leaks where one triangle takes a centre by comparing
#: it, and its neighbour by rounding.
TIE = 2.0**-13
_CENTRE = 0.5 + TIE


@njit(cache=True)
def _winding_steps(vertices, faces, nx, ny, nz):  # type: ignore[no-untyped-def]
    """Change of the winding number at each subvoxel centre on the way up in z, int16."""
    steps = np.zeros((nx, ny, nz), dtype=np.int16)
    for f in range(faces.shape[0]):
        y_low = math.inf
        y_high = -math.inf
        for corner in range(3):
            y = vertices[faces[f, corner], 1]
            y_low = min(y_low, y)
            y_high = max(y_high, y)
        first = max(0, math.ceil(y_low - _CENTRE))
        last = min(ny - 1, math.floor(y_high - _CENTRE))
        for iy in range(first, last + 1):
            py = iy + _CENTRE
            x_up = z_up = x_down = z_down = 0.0
            crossings = 0
            for corner in range(3):
                u = faces[f, corner]
                v = faces[f, (corner + 1) % 3]
                below_u = vertices[u, 1] <= py
                below_v = vertices[v, 1] <= py
                if below_u == below_v:
                    continue
                low = min(u, v)
                high = max(u, v)
                share = (py - vertices[low, 1]) / (vertices[high, 1] - vertices[low, 1])
                x = vertices[low, 0] + share * (vertices[high, 0] - vertices[low, 0])
                z = vertices[low, 2] + share * (vertices[high, 2] - vertices[low, 2])
                crossings += 1
                if below_u:
                    x_up = x
                    z_up = z
                else:
                    x_down = x
                    z_down = z
            if crossings != 2 or x_up == x_down:
                continue
            # The rising edge is on the right of a triangle that faces up: the top of the solid.
            if x_up > x_down:
                step = -1
                x_low, x_high, z_left, z_right = x_down, x_up, z_down, z_up
            else:
                step = 1
                x_low, x_high, z_left, z_right = x_up, x_down, z_up, z_down
            ix = max(0, math.ceil(x_low - _CENTRE))
            while ix < nx and ix + _CENTRE < x_high:
                share = (ix + _CENTRE - x_low) / (x_high - x_low)
                height = z_left + share * (z_right - z_left)
                k = max(0, math.ceil(height - _CENTRE))
                if k < nz:
                    steps[ix, iy, k] += step
                ix += 1
    return steps


@njit(cache=True)
def _inside(steps):  # type: ignore[no-untyped-def]
    nx, ny, nz = steps.shape
    result = np.zeros((nx, ny, nz), dtype=np.bool_)
    for i in range(nx):
        for j in range(ny):
            winding = 0
            for k in range(nz):
                winding += steps[i, j, k]
                result[i, j, k] = winding > 0
    return result


@njit(cache=True)
def _summed(steps):  # type: ignore[no-untyped-def]
    nx, ny, nz = steps.shape
    table = np.zeros((nx + 1, ny + 1, nz + 1), dtype=np.int32)
    for i in range(nx):
        for j in range(ny):
            winding = 0
            column = 0
            for k in range(nz):
                winding += steps[i, j, k]
                if winding > 0:
                    column += 1
                table[i + 1, j + 1, k + 1] = (
                    column + table[i, j + 1, k + 1] + table[i + 1, j, k + 1] - table[i, j, k + 1]
                )
    return table


@njit(cache=True)
def box_counts_kernel(table, xs, ys, zs):  # type: ignore[no-untyped-def]
    """The compiled part of :func:`box_counts`, which other compiled functions can call.

    Parameters
    ----------
    table : int32 array
        From :func:`summed_volume`.
    xs, ys, zs : int64 arrays
        Ascending plane positions in subvoxels.

    Returns
    -------
    (len(xs) - 1, len(ys) - 1, len(zs) - 1) int32 array
        Numbers of subvoxels.
    """
    counts = np.zeros((len(xs) - 1, len(ys) - 1, len(zs) - 1), dtype=np.int32)
    nx, ny, nz = table.shape[0] - 1, table.shape[1] - 1, table.shape[2] - 1
    for i in range(len(xs) - 1):
        x0 = min(max(xs[i], 0), nx)
        x1 = min(max(xs[i + 1], 0), nx)
        for j in range(len(ys) - 1):
            y0 = min(max(ys[j], 0), ny)
            y1 = min(max(ys[j + 1], 0), ny)
            for k in range(len(zs) - 1):
                z0 = min(max(zs[k], 0), nz)
                z1 = min(max(zs[k + 1], 0), nz)
                counts[i, j, k] = (
                    table[x1, y1, z1]
                    - table[x0, y1, z1]
                    - table[x1, y0, z1]
                    - table[x1, y1, z0]
                    + table[x0, y0, z1]
                    + table[x0, y1, z0]
                    + table[x1, y0, z0]
                    - table[x0, y0, z0]
                )
    return counts


def scan_mesh(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], shape: tuple[int, int, int]
) -> NDArray[np.bool_]:
    """Which subvoxels have their centre inside a closed mesh.

    Inside is where the winding number is positive, so overlapping shells count as material.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        In subvoxel units: subvoxel ``(i, j, k)`` is the unit cube with its centre at
        ``(i, j, k) + 0.5``, and its side is 1.
    faces : (f, 3) int32 array
        A closed mesh, counter-clockwise seen from outside.
    shape : three int
        Subvoxels along x, y and z. The mesh may reach out of these: what lies below z = 0 still
        counts for the winding number above it.

    Returns
    -------
    bool array of `shape`
        True where there is material.
    """
    return np.asarray(_inside(_winding_steps(vertices, faces, *shape)))


def summed_volume(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], shape: tuple[int, int, int]
) -> NDArray[np.int32]:
    """Summed volume table of :func:`scan_mesh`.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        In subvoxel units, as for :func:`scan_mesh`.
    faces : (f, 3) int32 array
        A closed mesh, counter-clockwise seen from outside.
    shape : three int
        Subvoxels along x, y and z.

    Returns
    -------
    int32 array, one longer than `shape` on each axis
        Entry ``(i, j, k)`` counts the subvoxels with material whose three indices are all below it.
    """
    return np.asarray(_summed(_winding_steps(vertices, faces, *shape)))


def scan_and_summed_volume(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], shape: tuple[int, int, int]
) -> tuple[NDArray[np.bool_], NDArray[np.int32]]:
    """What :func:`scan_mesh` and :func:`summed_volume` give, by one scan.

    Parameters
    ----------
    vertices, faces, shape
        As for both.

    Returns
    -------
    inside : bool array of `shape`
        True where there is material.
    table : int32 array, one longer than `shape` on each axis
        Counts of it.
    """
    steps = _winding_steps(vertices, faces, *shape)
    return np.asarray(_inside(steps)), np.asarray(_summed(steps))


def box_counts(
    table: NDArray[np.int32],
    planes: tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]],
) -> NDArray[np.int32]:
    """Subvoxels with material in each box between neighbouring planes.

    Parameters
    ----------
    table : int32 array
        From :func:`summed_volume`.
    planes : three int64 arrays
        Ascending plane positions in subvoxels; those outside the table see no material.

    Returns
    -------
    (len(x) - 1, len(y) - 1, len(z) - 1) int32 array
        Numbers of subvoxels.
    """
    return np.asarray(box_counts_kernel(table, *planes))
