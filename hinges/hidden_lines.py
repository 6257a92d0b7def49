"""Line drawings of meshes in parallel projection, without the lines that are hidden.

An edge of a mesh is drawn where two faces meet at an angle, or where one of them looks away. What
hides a line begins and ends at an outline, so each edge is cut where an outline crosses it in the
drawing, and of every piece the middle is looked at.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, radians

import numpy as np
from numpy.typing import NDArray

from .shape_meshes import MeshPart

__all__ = ["visible_edges"]

Floats = NDArray[np.float64]

#: Faces that meet at less than this, in degrees, are facets of one curved face.
_CREASE = 20.0
#: Cosine to the line of sight below which a face is seen from its side.
_SIDE = 1e-6
#: What stands less than this before a line does not hide it, in mm.
_BEFORE = 1e-3
_SQUARE = 6.0  # side of the squares of the drawing whose lines are looked at together, mm
_AT_ONCE = 256  # how many at most


@dataclass(frozen=True)
class _View:
    """Meshes as they are seen: x to the right, y upwards, z to the eye.

    Attributes
    ----------
    points : (v, 3) float64 array
        Corners.
    faces : (f, 3) int array
        Corners of the triangles that look to the eye.
    drawn, outlines : (e, 2) int array
        Both ends of the edges that may be drawn, and of those where the surface turns away.
    """

    points: Floats
    faces: NDArray[np.int64]
    drawn: NDArray[np.int64]
    outlines: NDArray[np.int64]


def visible_edges(
    meshes: Sequence[MeshPart],
    eye: tuple[float, float, float],
    up: tuple[float, float, float] = (0.0, 0.0, 1.0),
) -> list[Floats]:
    """Draw the visible edges of closed meshes in parallel projection.

    Parameters
    ----------
    meshes : sequence of MeshPart
        Bodies in mm, clear of one another.
    eye : (float, float, float)
        Point in mm from which they are seen, looking at the origin.
    up : (float, float, float)
        Direction that stands upright in the drawing.

    Returns
    -------
    list of (2, 2) float64 array
        Ends of each line in mm, to the right and upwards from the origin.
    """
    view = _seen(meshes, np.array(eye), np.array(up))
    starts, ends = (view.points[view.drawn[:, side]] for side in (0, 1))
    cuts = _crossings(starts, ends, view)
    owner = np.repeat(np.arange(len(cuts)), [len(cut) - 1 for cut in cuts])
    low = np.concatenate([cut[:-1] for cut in cuts])
    high = np.concatenate([cut[1:] for cut in cuts])
    middle = starts[owner] + (0.5 * (low + high))[:, None] * (ends - starts)[owner]
    shown = ~_hidden(middle, view)
    lines: list[Floats] = []
    for edge in range(len(cuts)):
        mine = np.flatnonzero((owner == edge) & shown)
        for run in np.split(mine, np.flatnonzero(np.diff(mine) > 1) + 1):
            if len(run):
                along = np.array([low[run[0]], high[run[-1]]])[:, None]
                lines.append((starts[edge] + along * (ends - starts)[edge])[:, :2])
    return lines


def _seen(meshes: Sequence[MeshPart], eye: Floats, up: Floats) -> _View:
    """Turn meshes into the view, and find the edges that may be drawn."""
    towards = eye / np.linalg.norm(eye)
    right = np.cross(up, towards)
    right /= np.linalg.norm(right)
    axes = np.column_stack([right, np.cross(towards, right), towards])
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    points = np.concatenate([mesh.vertices for mesh in meshes]) @ axes
    faces = np.concatenate(
        [mesh.faces.astype(np.int64) + s for mesh, s in zip(meshes, starts, strict=False)]
    )
    corners = points[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    front = normals[:, 2] > _SIDE
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    owner = np.tile(np.arange(len(faces)), 3)
    order = np.lexsort(np.sort(sides, axis=1).T)
    one, other = owner[order[0::2]], owner[order[1::2]]  # closed: each edge has two faces
    edges = sides[order[0::2]]
    turns = front[one] != front[other]
    sharp = (normals[one] * normals[other]).sum(axis=1) < cos(radians(_CREASE))
    drawn = (turns | sharp) & (front[one] | front[other])
    return _View(points, faces[front], edges[drawn], edges[turns])


def _crossings(starts: Floats, ends: Floats, view: _View) -> list[Floats]:
    """Where outlines cross each edge in the drawing: shares of its length, 0 and 1 among them."""
    bars = np.stack([view.points[view.outlines[:, side], :2] for side in (0, 1)])
    edges = np.stack([starts[:, :2], ends[:, :2]])
    low, high = bars.min(axis=0), bars.max(axis=0)
    found: list[Floats] = [np.array([0.0, 1.0])] * len(starts)
    for some in _neighbours(edges.min(axis=0)):
        here = edges[:, some]
        first, last = here.min(axis=(0, 1)), here.max(axis=(0, 1))
        near = ((low <= last) & (high >= first)).all(axis=1)
        along = (here[1] - here[0])[:, None]
        across = (bars[1] - bars[0])[None, near]
        gap = bars[0][None, near] - here[0][:, None]
        with np.errstate(divide="ignore", invalid="ignore"):
            area = _cross(along, across)
            mine, theirs = _cross(gap, across) / area, _cross(gap, along) / area
            met = (theirs > -1e-9) & (theirs < 1.0 + 1e-9) & (mine > 1e-6) & (mine < 1.0 - 1e-6)
        for edge, shares, hit in zip(some, mine, met, strict=True):
            if hit.any():
                found[edge] = np.unique([0.0, 1.0, *shares[hit]])
    return found


def _neighbours(points: Floats) -> list[NDArray[np.int64]]:
    """Numbers of points in groups that lie near each other: squares of the drawing, cut small."""
    cells = np.floor(points[:, :2] / _SQUARE).astype(np.int64)
    _, owner = np.unique(cells, axis=0, return_inverse=True)
    order = np.argsort(owner.ravel(), kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(owner.ravel()[order])) + 1)
    return [part for g in groups for part in np.split(g, range(_AT_ONCE, len(g), _AT_ONCE))]


def _cross(one: Floats, other: Floats) -> Floats:
    """Cross products of directions in the drawing."""
    made: Floats = one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0]
    return made


def _hidden(points: Floats, view: _View) -> NDArray[np.bool_]:
    """Whether a face stands before each point."""
    hidden = np.zeros(len(points), dtype=bool)
    corners = view.points[view.faces]
    low, high = corners.min(axis=1), corners.max(axis=1)
    for some in _neighbours(points):
        here = points[some]
        near = (
            (low[:, :2] <= here[:, :2].max(axis=0)).all(axis=1)
            & (high[:, :2] >= here[:, :2].min(axis=0)).all(axis=1)
            & (high[:, 2] > here[:, 2].min())
        )
        a, b, c = corners[near].transpose(1, 0, 2)
        area = _doubled(a, b, c)
        shares = [_doubled(*pair, here[:, None]) / area for pair in ((b, c), (c, a), (a, b))]
        inside = np.logical_and.reduce([share > -1e-9 for share in shares])
        depth = sum(share * corner[:, 2] for share, corner in zip(shares, (a, b, c), strict=True))
        hidden[some] = (inside & (depth > here[:, None, 2] + _BEFORE)).any(axis=1)
    return hidden


def _doubled(a: Floats, b: Floats, c: Floats) -> Floats:
    """Twice the area of triangles in the drawing, counter-clockwise ones above 0."""
    return _cross(b - a, c - a)
