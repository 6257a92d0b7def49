"""Boundary representation of a body: vertices, edges and faces that share them.

Made from a mesh whose triangles are gathered into regions (see :mod:`fabfold.export.surfaces`):
each region becomes a face, each run of mesh edges between the same two regions an edge.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fabfold.export.surfaces import ROUND_MM, Axis, Plane, Round, Surface

__all__ = ["Brep", "BrepEdge", "Face", "brep_of"]

#: A run of mesh edges this near to a straight line is one edge, mm.
_STRAIGHT_MM = 1e-4


@dataclass(frozen=True)
class BrepEdge:
    """An edge from one vertex to another: straight, or an arc counter-clockwise about an axis.

    Attributes
    ----------
    start : int
        Index of the vertex where it begins.
    end : int
        Index of the vertex where it ends.
    axis : Axis or None
        Axis of the arc; None for a straight edge.
    radius : float
        Radius of the arc in mm.
    height : float
        Height of the arc above the axis' point in mm.
    """

    start: int
    end: int
    axis: Axis | None = None
    radius: float = 0.0
    height: float = 0.0


@dataclass(frozen=True)
class Face:
    """A bounded piece of a surface.

    Attributes
    ----------
    surface : Plane or Round
        The surface that carries the face.
    loops : tuple of tuples of (edge index, bool)
        Counter-clockwise seen from outside; True where the edge runs along the loop. The outer
        loop comes first.
    """

    surface: Surface
    loops: tuple[tuple[tuple[int, bool], ...], ...]


@dataclass(frozen=True)
class Brep:
    """One closed shell.

    Attributes
    ----------
    vertices : (v, 3) float64 array
        Points in mm.
    edges : tuple of BrepEdge
        Edges between vertices; each belongs to two faces.
    faces : tuple of Face
        Faces bounded by these edges.
    """

    vertices: NDArray[np.float64]
    edges: tuple[BrepEdge, ...]
    faces: tuple[Face, ...]


def _half_edges(faces: NDArray[np.int32]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Twin of each half-edge, and the vertex it starts at; half-edge ``3 f + k`` follows face f."""
    count = int(faces.max()) + 1
    start = faces.reshape(-1).astype(np.int64)
    end = np.roll(faces, -1, axis=1).reshape(-1).astype(np.int64)
    backward = end * count + start
    order = np.argsort(backward, kind="stable")
    return order[np.searchsorted(backward[order], start * count + end)], start


def _loops(faces: NDArray[np.int32], labels: NDArray[np.int32]) -> list[tuple[int, list[int]]]:
    """Boundary loops as (region, half-edges), each region's material on the left."""
    twin, _ = _half_edges(faces)
    twins, region = twin.tolist(), np.repeat(labels, 3).tolist()
    rim = np.flatnonzero(np.repeat(labels, 3) != np.repeat(labels, 3)[twin]).tolist()
    seen: set[int] = set()
    loops = []
    for first in rim:
        if first in seen:
            continue
        here, loop = first, []
        while here not in seen:
            seen.add(here)
            loop.append(here)
            # Turn about the end of the edge inside the region until the next rim edge.
            step = here - 2 if here % 3 == 2 else here + 1
            while region[twins[step]] == region[step]:
                step = twins[step]
                step = step - 2 if step % 3 == 2 else step + 1
            here = step
        loops.append((region[first], loop))
    return loops


def brep_of(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    labels: NDArray[np.int32],
    surfaces: Sequence[Surface],
) -> Brep:
    """Faces of the regions of a closed mesh.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        Corners of the mesh in mm.
    faces : (f, 3) int32 array
        Triangles as indices into `vertices`, counter-clockwise seen from outside.
    labels : (f,) int32 array
        Index of the region of each triangle.
    surfaces : sequence of Plane or Round
        Surface of each region.

    Returns
    -------
    Brep
        One face for each region.
    """
    twin, starts = _half_edges(faces)
    region = np.repeat(labels, 3)
    loops = _loops(faces, labels)
    stops = _stops(vertices, twin, starts, region, surfaces)
    edges: list[BrepEdge] = []
    by_half: dict[int, tuple[int, bool]] = {}
    loops_of: list[list[tuple[tuple[int, bool], ...]]] = [[] for _ in surfaces]
    rims_of: list[list[list[int]]] = [[] for _ in surfaces]
    for owner, loop in loops:
        turned = _from_a_stop(loop, starts, stops)
        refs: list[tuple[int, bool]] = []
        run: list[int] = []
        for position, half in enumerate(turned):
            run.append(half)
            after = turned[(position + 1) % len(turned)]
            if not stops[starts[after]] and position + 1 < len(turned):
                continue
            back = int(twin[run[-1]])
            if back in by_half:
                index, along = by_half[back]
                refs.append((index, not along))
            else:
                edge, along = _edge(vertices, run, starts, twin, region, surfaces)
                by_half[run[0]] = (len(edges), along)
                refs.append((len(edges), along))
                edges.append(edge)
            run = []
        loops_of[owner].append(tuple(refs))
        rims_of[owner].append(loop)
    made = []
    for surface, found, rims in zip(surfaces, loops_of, rims_of, strict=True):
        order = [0]
        if len(found) > 1:
            extents = [_extent(vertices[starts[loop]], surface) for loop in rims]
            order = sorted(range(len(found)), key=lambda i: -extents[i])
        made.append(Face(surface, tuple(found[i] for i in order)))
    return Brep(vertices, tuple(edges), tuple(made))


def _extent(points: NDArray[np.float64], surface: Surface) -> float:
    """Signed area of a loop, to tell the outer one from holes."""
    if isinstance(surface, Plane):
        across = points - points[0]
        area = np.cross(across[:-1], across[1:]).sum(axis=0)
        return float(area @ np.asarray(surface.normal))
    return float(np.ptp(points, axis=0).sum())


def _from_a_stop(loop: list[int], starts: NDArray[np.int64], stops: NDArray[np.bool_]) -> list[int]:
    first = next((i for i, half in enumerate(loop) if stops[starts[half]]), 0)
    return loop[first:] + loop[:first]


def _stops(
    vertices: NDArray[np.float64],
    twin: NDArray[np.int64],
    starts: NDArray[np.int64],
    region: NDArray[np.int32],
    surfaces: Sequence[Surface],
) -> NDArray[np.bool_]:
    """Mesh vertices that stay vertices: where three faces meet, or an edge bends."""
    rim = np.flatnonzero(region != region[twin])
    order = rim[np.argsort(starts[rim], kind="stable")]
    vertex, first, count = np.unique(starts[order], return_index=True, return_counts=True)
    stops = np.zeros(len(vertices), dtype=bool)
    stops[vertex] = True
    one, other = order[first[count == 2]], order[first[count == 2] + 1]
    vertex = vertex[count == 2]
    same = region[one] == region[twin[other]]
    same &= region[twin[one]] == region[other]
    one, other, vertex = one[same], other[same], vertex[same]
    curved = [_curved(vertices, half, starts, twin, region, surfaces) for half in (one, other)]
    # Less than half a turn between stops: arcs are told apart by their ends.
    stops[vertex[curved[0] & curved[1]]] = False
    flat = ~curved[0] & ~curved[1]
    before, middle = vertices[starts[twin[one[flat]]]], vertices[vertex[flat]]
    after = vertices[starts[twin[other[flat]]]]
    along = after - before
    length = np.linalg.norm(along, axis=1)
    away = np.linalg.norm(np.cross(middle - before, along), axis=1)
    onwards = np.einsum("ij,ij->i", middle - before, after - middle) > 0
    straight = (length > 0) & onwards & (away < _STRAIGHT_MM * length)
    stops[vertex[flat][straight]] = False
    return stops


def _curved(
    vertices: NDArray[np.float64],
    halves: NDArray[np.int64],
    starts: NDArray[np.int64],
    twin: NDArray[np.int64],
    region: NDArray[np.int32],
    surfaces: Sequence[Surface],
) -> NDArray[np.bool_]:
    """Which of some rim edges run on a circle, as :func:`_arc` tells of one."""
    axes = [surface.axis if isinstance(surface, Round) else None for surface in surfaces]
    is_round = np.array([axis is not None for axis in axes])
    found = np.zeros(len(halves), dtype=bool)
    own = is_round[region[halves]]
    near = own | is_round[region[twin[halves]]]
    carrier = region[np.where(own, halves, twin[halves])[near]]
    along = np.array([-1 if axis is None else axis.direction for axis in axes])[carrier]
    middle = np.array([(0.0, 0.0, 0.0) if axis is None else axis.point for axis in axes])[carrier]
    ends = [vertices[starts[side]] - middle for side in (halves[near], twin[halves[near]])]
    rows = np.arange(len(along))
    x, y = ([end[rows, (along + k) % 3] for end in ends] for k in (1, 2))
    sine = np.abs(x[0] * y[1] - x[1] * y[0])
    radius = np.maximum(np.hypot(x[0], y[0]), np.hypot(x[1], y[1]))
    found[near] = sine >= ROUND_MM * np.maximum(radius, 1e-9)
    return found


def _arc(
    vertices: NDArray[np.float64],
    half: int,
    starts: NDArray[np.int64],
    twin: NDArray[np.int64],
    region: NDArray[np.int32],
    surfaces: Sequence[Surface],
) -> tuple[Axis, float, float] | None:
    """Axis, radius and height of the circle that a rim edge runs on, or None if it is straight."""
    for side in (half, int(twin[half])):
        surface = surfaces[region[side]]
        if not isinstance(surface, Round):
            continue
        axis = surface.axis
        along = axis.direction
        ends = vertices[[int(starts[half]), int(starts[twin[half]])]] - np.asarray(axis.point)
        flat = np.delete(ends, along, axis=1)
        radius = np.hypot(flat[:, 0], flat[:, 1])
        sine = abs(float(flat[0, 0] * flat[1, 1] - flat[0, 1] * flat[1, 0]))
        if sine < ROUND_MM * max(float(radius.max()), 1e-9):
            return None
        height = float(ends[:, along].mean())
        return axis, float(radius.mean()), height
    return None


def _edge(
    vertices: NDArray[np.float64],
    run: list[int],
    starts: NDArray[np.int64],
    twin: NDArray[np.int64],
    region: NDArray[np.int32],
    surfaces: Sequence[Surface],
) -> tuple[BrepEdge, bool]:
    """The edge of a run of half-edges, and whether it runs along them."""
    start, end = int(starts[run[0]]), int(starts[twin[run[-1]]])
    arc = _arc(vertices, run[0], starts, twin, region, surfaces)
    if arc is None:
        return BrepEdge(start, end), True
    axis, radius, height = arc
    along = axis.direction
    ends = vertices[[start, int(starts[twin[run[0]]])]] - np.asarray(axis.point)
    x, y = ends[:, (along + 1) % 3], ends[:, (along + 2) % 3]
    if x[0] * y[1] - x[1] * y[0] > 0:
        return BrepEdge(start, end, axis, radius, height), True
    return BrepEdge(end, start, axis, radius, height), False
