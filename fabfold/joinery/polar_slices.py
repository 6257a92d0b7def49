"""Solids in cylindrical coordinates: in which angles material lies, slab by slab and ring by ring.

A cell that turns about an axis is looked at in *slabs*, between two heights along the axis, and in
*rings*, between two radii about it. The axis is z of a frame of its own, and all angles are about
it. In each ring of each slab the angles at which material begins and ends are exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import manifold3d

__all__ = ["PolarSlices", "common_rings", "extreme_angles", "slab_edges", "square_edges"]

#: Rings in the side of a voxel.
_RINGS = 80
#: How far a solid beyond some angles reaches over the quadrant in which both cells lie, radians.
_BEYOND = np.radians(25.0)
#: Largest angle of a chord that stands for an arc, radians.
_ARC_STEP = np.radians(3.0)

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class PolarSlices:
    """The rings and slabs in which one of two cells that run into each other is looked at.

    Attributes
    ----------
    voxel : int
        Index of the cell's voxel.
    frame : (3, 4) float64 array
        Rigid transform from shape A, in mm, to the frame whose z is the axis of the turn.
    rings : (r + 1,) float64 array
        Radii that bound the rings, mm.
    levels : (s + 1,) float64 array
        Heights that bound the slabs, mm.
    ahead : bool
        Whether the cell gives way ahead of the other one (at larger angles) or behind it.
    """

    voxel: int
    frame: Floats
    rings: Floats
    levels: Floats
    ahead: bool

    def beyond(self, limits: Floats, margin_mm: float) -> manifold3d.Manifold | None:
        """Solid of all that lies ahead of (or behind) an angle in each ring of each slab.

        Parameters
        ----------
        limits : (s, r) float64 array
            Angle in radians from which on the solid fills the ring; infinite where it fills none
            of it.
        margin_mm : float
            How much larger the solid is made all around, mm.

        Returns
        -------
        manifold3d.Manifold or None
            In mm, shape A; None if it is empty.
        """
        import manifold3d

        parts = []
        k = 0
        while k < len(limits):
            last = k
            while last + 1 < len(limits) and np.array_equal(limits[last + 1], limits[k]):
                last += 1
            section = _section(self.rings, limits[k], self.ahead)
            if section is not None:
                if margin_mm > 0.0:
                    section = section.offset(margin_mm, manifold3d.JoinType.Round, 2.0, 24)
                height = self.levels[last + 1] - self.levels[k] + 2 * margin_mm
                base = self.levels[k] - margin_mm
                parts.append(section.extrude(height).translate((0.0, 0.0, base)))
            k = last + 1
        if not parts:
            return None
        whole = manifold3d.Manifold.batch_boolean(parts, manifold3d.OpType.Add)
        return whole.transform(_inverse_frame(self.frame))


def _inverse_frame(frame: Floats) -> Floats:
    """The rigid transform (3, 4) that undoes another one."""
    back = np.empty((3, 4))
    back[:, :3] = frame[:, :3].T
    back[:, 3] = -frame[:, :3].T @ frame[:, 3]
    return back


def common_rings(first: Floats, second: Floats, margin: float) -> Floats:
    """Radii that divide the rings in which two unit squares both have a part, and a little beyond.

    What turns just inside of such a ring comes too near as well, so the rings reach further by a
    margin.

    Parameters
    ----------
    first : (2 or more,) float64 array
        Lowest corner of the first square in the plane across the axis, lattice units.
    second : (2 or more,) float64 array
        Lowest corner of the second square, lattice units.
    margin : float
        How much further the rings reach inwards and outwards, lattice units.

    Returns
    -------
    (r + 1,) float64 array
        Radii in lattice units, rising.
    """
    low = max(0.0, np.hypot(*first[:2]) - margin, np.hypot(*second[:2]) - margin)
    high = min(np.hypot(*(first[:2] + 1)), np.hypot(*(second[:2] + 1))) + margin
    return np.linspace(low, high, max(2, int(np.ceil((high - low) * _RINGS))) + 1)


def square_edges(corner: Floats, side: float) -> Floats:
    """Edges of a square across the axis.

    Parameters
    ----------
    corner : (2 or more,) float64 array
        Lowest corner, mm.
    side : float
        Side of the square, mm.

    Returns
    -------
    (4, 2, 2) float64 array
        Start and end of each edge, mm.
    """
    x, y = corner[:2]
    points = np.array([(x, y), (x + side, y), (x + side, y + side), (x, y + side)])
    return np.stack([points, np.roll(points, -1, axis=0)], axis=1)


def slab_edges(solids: list[manifold3d.Manifold], frame: Floats, levels: Floats) -> list[Floats]:
    """Edges of the triangles of what lies in each slab, seen along the axis.

    Parameters
    ----------
    solids : list of manifold3d.Manifold
        In mm, shape A.
    frame : (3, 4) float64 array
        Rigid transform to the frame whose z is the axis, mm.
    levels : (s + 1,) float64 array
        Heights that bound the slabs, mm.

    Returns
    -------
    list of (k, 2, 2) float64 arrays
        Start and end of each edge in the plane across the axis, mm; one array a slab.
    """
    placed = [solid.transform(frame) for solid in solids]
    found = []
    for low, high in pairwise(levels):
        edges = [np.zeros((0, 2, 2))]
        for solid in placed:
            box = solid.bounding_box()
            if box[5] <= low or box[2] >= high:
                continue
            slab = solid.trim_by_plane((0.0, 0.0, 1.0), low).trim_by_plane((0.0, 0.0, -1.0), -high)
            if slab.is_empty():
                continue
            mesh = slab.to_mesh64()
            corners = mesh.vert_properties[:, :2][mesh.tri_verts]
            edges.append(
                np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2, 2)
            )
        found.append(np.concatenate(edges))
    return found


def extreme_angles(edges: Floats, rings: Floats, sign: float) -> Floats:
    """Largest or smallest angle at which edges lie in each ring.

    Angles along a straight line rise or fall all the way, so the ends of what a ring holds of it
    decide.

    Parameters
    ----------
    edges : (k, 2, 2) float64 array
        Start and end of each edge in the plane across the axis, mm.
    rings : (r + 1,) float64 array
        Radii that bound the rings, mm.
    sign : float
        1 for the largest angle, -1 for the smallest.

    Returns
    -------
    (r,) float64 array
        Angles in radians; in a ring that holds nothing, minus infinity for the largest and
        infinity for the smallest.
    """
    start, end = edges[:, 0], edges[:, 1]
    along_line = end - start
    length = np.linalg.norm(along_line, axis=1)
    keep = length > 1e-12
    start, length = start[keep], length[keep]
    unit = along_line[keep] / length[:, None]
    best = np.full(len(rings) - 1, -np.inf)
    if len(start) == 0:
        return sign * best
    along = np.einsum("ij,ij->i", start, unit)
    foot = start - along[:, None] * unit
    foot2 = np.einsum("ij,ij->i", foot, foot)
    # On either side of the foot of the perpendicular from the axis the radius rises or falls.
    for side in (-1.0, 1.0):
        t0, t1 = along, along + length
        t0, t1 = (
            (np.minimum(t0, 0.0), np.minimum(t1, 0.0))
            if side < 0
            else (np.maximum(t0, 0.0), np.maximum(t1, 0.0))
        )
        some = t1 > t0
        if not some.any():
            continue
        r0, r1 = np.sqrt(foot2 + t0**2), np.sqrt(foot2 + t1**2)
        r_low, r_high = np.minimum(r0, r1)[some], np.maximum(r0, r1)[some]
        base, line, square = foot[some], unit[some], foot2[some]
        inside = (r_high[:, None] >= rings[None, :-1]) & (r_low[:, None] <= rings[None, 1:])
        i, j = np.nonzero(inside)
        for radius in (np.maximum(r_low[i], rings[j]), np.minimum(r_high[i], rings[j + 1])):
            t = side * np.sqrt(np.maximum(radius**2 - square[i], 0.0))
            point = base[i] + t[:, None] * line[i]
            np.maximum.at(best, j, sign * np.arctan2(point[:, 1], point[:, 0]))
    return sign * best


def _section(rings: Floats, limits: Floats, ahead: bool) -> manifold3d.CrossSection | None:
    """Section across the axis of what lies beyond the limit in each ring; None if it is empty."""
    import manifold3d

    sign = 1.0 if ahead else -1.0
    # Angles from the far side: turned so that "ahead" is always upwards.
    begin = np.where(np.isfinite(limits), sign * limits, np.inf)
    far = np.pi / 2 + _BEYOND if ahead else _BEYOND
    polygons = []
    j = 0
    while j < len(begin):
        if begin[j] >= far:
            j += 1
            continue
        last = j
        while last + 1 < len(begin) and begin[last + 1] < far:
            last += 1
        # At a radius between two rings, what lies ahead of the nearer of their two limits.
        inner = np.concatenate([begin[j : last + 1], [np.inf]])
        outer = np.concatenate([[np.inf], begin[j : last + 1]])
        angle = np.minimum(inner, outer)
        radius = rings[j : last + 2]
        top = _arc(radius[-1], angle[-1], far, True)
        bottom = _arc(radius[0], far, angle[0], False)
        side = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
        points = np.concatenate([side, top, bottom[:-1]])
        points[:, 1] *= sign
        polygons.append(points if ahead else points[::-1])
        j = last + 1
    if not polygons:
        return None
    return manifold3d.CrossSection(polygons, manifold3d.FillRule.NonZero)


def _arc(radius: float, start: float, end: float, outside: bool) -> Floats:
    """Points (k, 2) of an arc whose chords stay outside (or inside) of the circle."""
    count = max(1, int(np.ceil(abs(end - start) / _ARC_STEP)))
    angles = np.linspace(start, end, count + 1)
    if outside:
        radius = radius / np.cos(abs(end - start) / count / 2)
    return np.column_stack([radius * np.cos(angles), radius * np.sin(angles)])
