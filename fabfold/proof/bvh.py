"""Bounding volume hierarchies: trees of boxes over the triangles of bodies.

They are built once and fitted anew for every axis of rotation, those of a body that is far from all
others not at all: :func:`place` gives a body's root a box that is large enough, and :func:`fit`
fits its tree. Everything is in the frame of one hinge: its axis is the z axis. Besides its box each
node knows its *invariants*, the ranges of four quantities that a turn about the axis does not
change: ``z``, the distance ``r`` from the axis, ``(z + r) / √2`` and ``(z - r) / √2``.
"""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["BoxTrees", "PlacedBodies", "build_tree", "fit", "new_bodies", "place"]

#: Most triangles in a leaf.
_LEAF = 2

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]


class BoxTrees(NamedTuple):
    """Box trees of several bodies in one set of arrays.

    ``b`` bodies, ``m`` nodes and ``t`` triangles in all; lengths in mm.

    Attributes
    ----------
    root : (b + 1,) int32 array
        Nodes ``root[i]`` to ``root[i + 1] - 1`` belong to body ``i``, its root first.
    child : (m, 2) int32 array
        Children of a node, or -1 for a leaf; they come after their parent.
    leaf : (m, 2) int32 array
        First triangle and number of triangles of a node.
    box : (m, 6) float64 array
        Smallest x, y, z and largest x, y, z of a node.
    invariant : (m, 8) float64 array
        Smallest and largest z, r, (z + r) / √2, (z - r) / √2 of a node.
    triangle : (t, 3, 3) float64 array
        Corners of each triangle, in the order of the leaves.
    own_invariant : (t, 8) float64 array
        `invariant` of each triangle.
    """

    root: I32
    child: I32
    leaf: I32
    box: F64
    invariant: F64
    triangle: F64
    own_invariant: F64


class PlacedBodies(NamedTuple):
    """Bodies as they were given, where they are now, and whether their trees are fitted to that.

    Attributes
    ----------
    triangle : (t, 3, 3) float64 array
        Corners of each triangle as given, in the order of the leaves.
    extent : (b, 6) float64 array
        Smallest x, y, z and largest x, y, z of each body as given.
    pose : (b, 4, 4) float64 array
        Rigid transform of each body into the frame of the axis.
    fitted : (b,) bool array
        Whether all nodes of a body are fitted; else its root's box is only large enough.
    """

    triangle: F64
    extent: F64
    pose: F64
    fitted: NDArray[np.bool_]


@njit(cache=True)
def _split(centre: F64, order: I32, low: int, high: int) -> int:
    """Sort a part of `order` about the middle of its widest direction; returns where it parts."""
    axis = 0
    widest = -1.0
    cut = 0.0
    for i in range(3):
        small = np.inf
        large = -np.inf
        for at in range(low, high):
            value = centre[order[at], i]
            small = min(small, value)
            large = max(large, value)
        if large - small > widest:
            widest = large - small
            cut = 0.5 * (small + large)
            axis = i
    place = low
    for at in range(low, high):
        if centre[order[at], axis] < cut:
            order[at], order[place] = order[place], order[at]
            place += 1
    # Centres in one place, or all but a few on one side: part them by number.
    if place - low < (high - low) // 8 or high - place < (high - low) // 8 or place == low:
        part = order[low:high]
        order[low:high] = part[np.argsort(centre[part, axis], kind="mergesort")]
        place = (low + high) // 2
    return place


@njit(cache=True)
def build_tree(triangle: F64) -> tuple[I32, I32, I32]:
    """Build the tree of one body, without boxes.

    Parameters
    ----------
    triangle : (t, 3, 3) float64 array
        Corners of the body's triangles.

    Returns
    -------
    order : (t,) int32 array
        Triangles in the order of the leaves.
    child, leaf : (m, 2) int32 arrays
        As in :class:`BoxTrees`, counted from 0.
    """
    total = len(triangle)
    order = np.arange(total).astype(np.int32)
    centre = np.empty((total, 3))
    for t in range(total):
        for i in range(3):
            small = min(triangle[t, 0, i], triangle[t, 1, i], triangle[t, 2, i])
            large = max(triangle[t, 0, i], triangle[t, 1, i], triangle[t, 2, i])
            centre[t, i] = 0.5 * (small + large)
    child = np.full((2 * total, 2), -1, np.int32)
    part = np.zeros((2 * total, 2), np.int32)
    part[0, 1] = total
    nodes = 1
    at = 0
    while at < nodes:
        low = part[at, 0]
        size = part[at, 1]
        if size > _LEAF:
            middle = _split(centre, order, low, low + size)
            child[at, 0] = nodes
            child[at, 1] = nodes + 1
            part[nodes, 0] = low
            part[nodes, 1] = middle - low
            part[nodes + 1, 0] = middle
            part[nodes + 1, 1] = low + size - middle
            nodes += 2
        at += 1
    return order, child[:nodes].copy(), part[:nodes].copy()


def new_bodies(meshes: list[F64]) -> tuple[BoxTrees, PlacedBodies]:
    """Build the trees of several bodies, which are where they were given.

    Parameters
    ----------
    meshes : list of (t, 3, 3) float64 arrays
        Corners of the triangles of each body.

    Returns
    -------
    boxes : BoxTrees
        Not fitted yet.
    bodies : PlacedBodies
        To be placed by :func:`place`.
    """
    roots, children, parts, triangles, extents = [0], [], [], [], []
    nodes = corners = 0
    for triangle in meshes:
        order, child, part = build_tree(np.ascontiguousarray(triangle, dtype=np.float64))
        child[child >= 0] += nodes
        part[:, 0] += corners
        nodes += len(child)
        corners += len(triangle)
        roots.append(nodes)
        children.append(child)
        parts.append(part)
        triangles.append(triangle[order])
        extents.append((*triangle.min(axis=(0, 1)), *triangle.max(axis=(0, 1))))
    given = np.ascontiguousarray(np.concatenate(triangles), dtype=np.float64)
    boxes = BoxTrees(
        np.array(roots, dtype=np.int32),
        np.concatenate(children),
        np.concatenate(parts),
        np.zeros((nodes, 6)),
        np.zeros((nodes, 8)),
        given.copy(),
        np.zeros((corners, 8)),
    )
    bodies = PlacedBodies(
        given,
        np.array(extents, dtype=np.float64),
        np.tile(np.eye(4), (len(meshes), 1, 1)),
        np.zeros(len(meshes), dtype=np.bool_),
    )
    place(boxes, bodies, bodies.pose.copy())
    return boxes, bodies


def place(boxes: BoxTrees, bodies: PlacedBodies, pose: F64) -> None:
    """Move bodies; their roots get boxes and invariants that are large enough.

    Parameters
    ----------
    boxes, bodies
        In and out.
    pose : (b, 4, 4) float64 array
        Rigid transform of each body into the frame of the axis.
    """
    bodies.pose[:] = pose
    bodies.fitted[:] = False
    middle = (bodies.extent[:, :3] + bodies.extent[:, 3:]) / 2
    half = (bodies.extent[:, 3:] - bodies.extent[:, :3]) / 2
    turn = pose[:, :3, :3]
    middle = np.einsum("bij,bj->bi", turn, middle) + pose[:, :3, 3]
    half = np.einsum("bij,bj->bi", np.abs(turn), half) * (1 + 1e-12)
    low, high = middle - half, middle + half
    root = boxes.root[:-1]
    boxes.box[root] = np.concatenate((low, high), axis=1)
    z0, z1 = low[:, 2], high[:, 2]
    r0 = np.linalg.norm(np.maximum(0.0, np.maximum(low, -high))[:, :2], axis=1)
    r1 = np.linalg.norm(np.maximum(-low, high)[:, :2], axis=1)
    share = np.sqrt(0.5)
    boxes.invariant[root] = np.stack(
        (
            z0,
            z1,
            r0,
            r1,
            share * (z0 + r0),
            share * (z1 + r1),
            share * (z0 - r1),
            share * (z1 - r0),
        ),
        axis=1,
    )


@njit(cache=True)
def _axis_distance(triangle: F64) -> float:
    """Distance of a triangle from the z axis."""
    least = np.inf
    left = False
    right = False
    for i in range(3):
        ax = triangle[i, 0]
        ay = triangle[i, 1]
        bx = triangle[(i + 1) % 3, 0] - ax
        by = triangle[(i + 1) % 3, 1] - ay
        length = bx * bx + by * by
        share = 0.0
        if length > 0:
            share = min(1.0, max(0.0, -(ax * bx + ay * by) / length))
        least = min(least, np.hypot(ax + share * bx, ay + share * by))
        side = ax * by - ay * bx
        left = left or side >= 0
        right = right or side <= 0
    if not (left and right):  # the axis pierces it
        return 0.0
    return least


@njit(cache=True)
def fit(boxes: BoxTrees, bodies: PlacedBodies, body: int) -> None:
    """Fit the boxes and invariants of a body's nodes to where it is, where they are not.

    Parameters
    ----------
    boxes, bodies
        In and out.
    body : int
        Number of the body.
    """
    if bodies.fitted[body]:
        return
    bodies.fitted[body] = True
    pose = bodies.pose[body]
    half = np.sqrt(0.5)
    for node in range(boxes.root[body + 1] - 1, boxes.root[body] - 1, -1):
        box = boxes.box[node]
        invariant = boxes.invariant[node]
        box[:3] = np.inf
        box[3:] = -np.inf
        invariant[0::2] = np.inf
        invariant[1::2] = -np.inf
        if boxes.child[node, 0] >= 0:
            for way in range(2):
                below = boxes.child[node, way]
                for i in range(3):
                    box[i] = min(box[i], boxes.box[below, i])
                    box[3 + i] = max(box[3 + i], boxes.box[below, 3 + i])
                for i in range(0, 8, 2):
                    invariant[i] = min(invariant[i], boxes.invariant[below, i])
                    invariant[i + 1] = max(invariant[i + 1], boxes.invariant[below, i + 1])
            continue
        begin = boxes.leaf[node, 0]
        for t in range(begin, begin + boxes.leaf[node, 1]):
            corner = boxes.triangle[t]
            for i in range(3):
                x, y, z = bodies.triangle[t, i]
                for j in range(3):
                    corner[i, j] = pose[j, 0] * x + pose[j, 1] * y + pose[j, 2] * z + pose[j, 3]
            own = boxes.own_invariant[t]
            own[0::2] = np.inf
            own[1::2] = -np.inf
            # r is at least the coordinate along any unit vector e across the axis, so a plane
            # stands in for it from below; from above the corners are enough (r is convex).
            ex = corner[0, 0] + corner[1, 0] + corner[2, 0]
            ey = corner[0, 1] + corner[1, 1] + corner[2, 1]
            length = np.hypot(ex, ey)
            ex, ey = (ex / length, ey / length) if length > 0 else (1.0, 0.0)
            for i in range(3):
                x = corner[i, 0]
                y = corner[i, 1]
                z = corner[i, 2]
                r = np.hypot(x, y)
                under = x * ex + y * ey
                own[0] = min(own[0], z)
                own[1] = max(own[1], z)
                own[3] = max(own[3], r)
                own[4] = min(own[4], half * (z + under))
                own[5] = max(own[5], half * (z + r))
                own[6] = min(own[6], half * (z - r))
                own[7] = max(own[7], half * (z - under))
                for j in range(3):
                    box[j] = min(box[j], corner[i, j])
                    box[3 + j] = max(box[3 + j], corner[i, j])
            own[2] = _axis_distance(corner)
            for i in range(0, 8, 2):
                invariant[i] = min(invariant[i], own[i])
                invariant[i + 1] = max(invariant[i + 1], own[i + 1])
