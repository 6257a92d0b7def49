"""Move the planes of the grid back to the regular lattice, and the mesh with them.

The warp is separable and linear between planes. It is exact on a triangle mesh once no triangle
reaches across a plane at which its slope changes, so the mesh is first split there. A new vertex
belongs to an edge, not to a triangle: the mesh stays closed and two-manifold.

References
----------
Zhou, Sueda, Matusik, Shamir: Boxelization, section 3, figure 3(c).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["split_at_plane", "warp_mesh"]

_Mesh = tuple[NDArray[np.float64], NDArray[np.int32]]


def split_at_plane(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], axis: int, position: float
) -> _Mesh:
    """Split the triangles that cross the plane ``x[axis] == position``.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        Corner coordinates, in any unit.
    faces : (f, 3) int32 array
        Three vertex indices for each triangle.
    axis : int
        0, 1 or 2: the axis that the plane is perpendicular to.
    position : float
        Where the plane crosses this axis, in the unit of `vertices`.

    Returns
    -------
    vertices : (v + w, 3) float64 array
        The old ones, then one on each edge that crossed; those lie exactly on the plane.
    faces : (g, 3) int32 array
        Triangles, none with corners on both sides of the plane. Orientation and closedness are
        kept.
    """
    place = vertices[:, axis]
    side = (place > position).view(np.int8) - (place < position).view(np.int8)
    # Corner by corner: numpy takes ten times as long along an axis of three.
    one, two, three = (side[faces[:, corner]] for corner in range(3))
    crossing = np.minimum(np.minimum(one, two), three) < 0
    crossing &= np.maximum(np.maximum(one, two), three) > 0
    if not crossing.any():
        return vertices, faces
    cut = faces[crossing]
    cut_side = side[cut]

    # Turn each triangle so that its first corner is the one that stands alone: on the plane, with
    # the others on either side, or else by itself on its side of the plane.
    touching = (cut_side == 0).any(axis=1)
    alone = np.where(
        touching, np.argmax(cut_side == 0, axis=1), np.argmax(cut_side == -_majority(cut_side), 1)
    )
    turned = np.take_along_axis(cut, (alone[:, None] + np.arange(3)) % 3, axis=1)

    pairs = np.concatenate(
        [turned[touching][:, [1, 2]], turned[~touching][:, [0, 1]], turned[~touching][:, [2, 0]]]
    )
    edges, index = np.unique(np.sort(pairs, axis=1), axis=0, return_inverse=True)
    low, high = vertices[edges[:, 0]], vertices[edges[:, 1]]
    share = (position - low[:, axis]) / (high[:, axis] - low[:, axis])
    points = low + share[:, None] * (high - low)
    points[:, axis] = position
    index = (index.reshape(-1) + len(vertices)).astype(np.int32)

    on, off = turned[touching], turned[~touching]
    middle, first, last = np.split(index, [len(on), len(on) + len(off)])
    parts = [
        faces[~crossing],
        np.column_stack([on[:, 0], on[:, 1], middle]),
        np.column_stack([on[:, 0], middle, on[:, 2]]),
        np.column_stack([off[:, 0], first, last]),
        np.column_stack([first, off[:, 1], off[:, 2]]),
        np.column_stack([first, off[:, 2], last]),
    ]
    return np.concatenate([vertices, points]), np.concatenate(parts).astype(np.int32)


def _majority(sides: NDArray[np.int8]) -> NDArray[np.int8]:
    """The side, -1 or 1, on which most corners of each triangle are; shape (f, 1)."""
    return np.asarray(np.sign(sides.sum(axis=1, keepdims=True)), dtype=np.int8)


def warp_mesh(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    planes: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
    targets: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
) -> _Mesh:
    """Carry the grid planes of each direction to their targets, and the mesh with them.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        Corner coordinates inside the outermost planes, lattice units.
    faces : (f, 3) int32 array
        Triangles of a closed two-manifold.
    planes, targets : three float64 arrays each
        Ascending positions of the planes of x, y and z before and after the warp, lattice units.

    Returns
    -------
    vertices : (w, 3) float64 array
        Lattice units; vertices on a plane are exactly on its target.
    faces : (g, 3) int32 array
        Triangles: closed, two-manifold, oriented as before.
    """
    reach = 1e-9 * float(np.ptp(vertices, axis=0).max())
    vertices = vertices.copy()
    for axis in range(3):
        now, then = planes[axis], targets[axis]
        slope = np.diff(then) / np.diff(now)
        bends = np.flatnonzero(np.abs(np.diff(slope)) > 1e-12) + 1
        for position in now[bends]:
            # A vertex a rounding error beside the plane would leave a triangle without width.
            near = np.abs(vertices[:, axis] - position) < reach
            vertices[near, axis] = position
            vertices, faces = split_at_plane(vertices, faces, axis, float(position))
    warped = np.column_stack(
        [np.interp(vertices[:, axis], planes[axis], targets[axis]) for axis in range(3)]
    )
    return warped, faces
