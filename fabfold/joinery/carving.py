"""Carving: room for cells that run into each other on the folding path.

:mod:`fabfold.fold.carving_plan` says which two cells meet and which of them gives way on which
circles about the axis. Here the cut is worked out on the solids. All that the other body has in its
cell, hinges included, is looked at in slabs across the axis and in rings about it; in each ring
the angle at which it begins (or ends) is exact. What gives way loses the ring from that angle on,
and the clearance all around. So the tool contains all that the other sweeps and goes beyond it by
the width of a ring and a slab at most. Meetings are worked out one after the other, and what is
gone by then sweeps nothing.

Struts come later. They keep to where nothing passes: those of the body that gives way are kept out
of the cut, and those of the other behind what it was seen to have.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import GeometryError
from fabfold.fold.carving_plan import CarvingPlan, plan_carving, skin_of
from fabfold.fold.clashes import Clash
from fabfold.fold.motion import Motion, quarter_path
from fabfold.joinery.cells import eroded_cells, occupancy
from fabfold.tree.fold_tree import FoldTree
from fabfold.tree.system import hinge_system
from fabfold.voxels.voxel_model import Voxels

if TYPE_CHECKING:
    import manifold3d

    Solids = list[manifold3d.Manifold]

__all__ = ["Carved", "carve"]

#: Rings and slabs in the side of a voxel.
_RINGS, _SLABS = 80, 10
#: Added to the clearance all around, in mm, for the rounding of coordinates.
_SPARE_MM = 0.01
#: How far tools reach beyond the quadrant in which both cells lie.
_BEYOND = np.radians(25.0)
_ARC_STEP = np.radians(3.0)
#: Least volume that counts as cut, and that a tool must meet to be used, in mm³.
_LEAST_MM3, _TOUCH_MM3 = 0.01, 1e-6
#: Share of the bracket and knuckles of a hinge that a tool may graze.
_GRAZE = 0.005

Floats = NDArray[np.float64]


@dataclass
class Carved:
    """What carving takes, body by body.

    Attributes
    ----------
    tools : dict of int to list of manifold3d.Manifold
        By body: to be taken from it; mm, lattice origin at zero.
    shut : dict of int to list of manifold3d.Manifold
        By body: where its struts may not run, beside `tools`.
    cells : int
        Cells that lose material.
    skin_mm3, inside_mm3 : float
        What they lose, at the model's surface and inside.
    """

    tools: dict[int, Solids] = field(default_factory=dict)
    shut: dict[int, Solids] = field(default_factory=dict)
    cells: int = 0
    skin_mm3: float = 0.0
    inside_mm3: float = 0.0

    @property
    def mm3(self) -> float:
        """All that is lost."""
        return self.skin_mm3 + self.inside_mm3

    def notes(self) -> tuple[str, ...]:
        """What was done, in a maker's words."""
        if not self.cells:
            return ()
        return (
            f"corners of {self.cells} cells rounded off so that they pass each other: "
            f"{self.skin_mm3:.0f} mm³ at the model's surface, {self.inside_mm3:.0f} mm³ inside",
        )


def carve(
    voxels: Voxels,
    tree: FoldTree,
    motion: Motion,
    model: manifold3d.Manifold,
    halves: Sequence[Sequence[tuple[manifold3d.Manifold, manifold3d.Manifold]]],
    *,
    voxel_mm: float,
    clearance_mm: float,
) -> Carved:
    """Work out what must be carved so that the cells of the bodies pass each other.

    Parameters
    ----------
    voxels : Voxels
    tree : FoldTree
    motion : Motion
        One hinge a move.
    model : manifold3d.Manifold
        The warped model, mm, lattice origin at zero.
    halves : sequence of sequences of (half, carve)
        Of each body: what its hinges add to it and take from it.
    voxel_mm, clearance_mm : float

    Returns
    -------
    Carved
        Empty where whole cells pass each other.

    Raises
    ------
    GeometryError
        If a hinge would be cut.
    """
    path = quarter_path(tree, motion)
    if path is None or tree.octants is not None:
        # A path past voxels that share cells is planned on eighths, and nothing gives way.
        return Carved()
    planned = plan_carving(hinge_system(tree), path, voxels.subvoxels)
    if planned.blocked:
        names = [tree.bodies[int(tree.voxel_body[v])].name for v in planned.blocked[0]]
        raise GeometryError(
            f"{names[0]} and {names[1]} run into each other on the folding path, and carving "
            "would cut through a hinge"
        )
    if not planned.clashes:
        return Carved()
    return _Bench(voxels, tree, model, halves, voxel_mm, clearance_mm).work(planned)


@dataclass(frozen=True)
class _Side:
    """One of two cells that meet, and the rings and slabs in which both are looked at.

    Attributes
    ----------
    voxel : int
    frame : (3, 4) float64 array
        From shape A, in mm, to where the axis of the meeting is z.
    rings, level : (r + 1,), (s + 1,) float64 arrays
        Radii of the rings and heights of the slabs in mm.
    ahead : bool
        Whether the cell gives way ahead of the other, or behind it.
    """

    voxel: int
    frame: Floats
    rings: Floats
    level: Floats
    ahead: bool

    def beyond(self, limit: Floats, wider: float) -> manifold3d.Manifold | None:
        """What lies ahead of (or behind) the limits (slabs, rings), wider all around; shape A."""
        import manifold3d

        parts = []
        k = 0
        while k < len(limit):
            last = k
            while last + 1 < len(limit) and np.array_equal(limit[last + 1], limit[k]):
                last += 1
            section = _section(self.rings, limit[k], self.ahead)
            if section is not None:
                if wider > 0.0:
                    section = section.offset(wider, manifold3d.JoinType.Round, 2.0, 24)
                height = self.level[last + 1] - self.level[k] + 2 * wider
                parts.append(section.extrude(height).translate((0.0, 0.0, self.level[k] - wider)))
            k = last + 1
        if not parts:
            return None
        whole = manifold3d.Manifold.batch_boolean(parts, manifold3d.OpType.Add)
        return whole.transform(_inverse(self.frame))


class _Bench:
    """The cells in question as solids, while meeting after meeting is carved."""

    def __init__(
        self,
        voxels: Voxels,
        tree: FoldTree,
        model: manifold3d.Manifold,
        halves: Sequence[Sequence[tuple[manifold3d.Manifold, manifold3d.Manifold]]],
        voxel_mm: float,
        clearance_mm: float,
    ) -> None:
        self.voxels, self.tree, self.model, self.halves = voxels, tree, model, halves
        self.voxel_mm, self.clearance_mm = voxel_mm, clearance_mm
        self.body = tree.voxel_body
        self.cells: dict[int, manifold3d.Manifold] = {}
        self.start: dict[int, manifold3d.Manifold] = {}
        self._whole: dict[int, manifold3d.Manifold] = {}

    def work(self, planned: CarvingPlan) -> Carved:
        """Carve all meetings in order."""
        out = Carved()
        for meeting, bounds in zip(planned.clashes, planned.rings, strict=True):
            self._carve(meeting, float(bounds[0]), float(bounds[1]), out)
        self._count(out)
        return out

    def _cell(self, voxel: int) -> manifold3d.Manifold:
        """A cell's material and a little of its neighbours' in the same body."""
        if voxel not in self.cells:
            body = int(self.body[voxel])
            if body not in self._whole:
                own = self.tree.source[list(self.tree.bodies[body].voxels)]
                solid = self.model ^ eroded_cells(own, self.voxel_mm, self.clearance_mm / 2)
                for _, hole in self.halves[body]:
                    solid -= hole
                self._whole[body] = _worked_out(solid)
            self.cells[voxel] = _worked_out(self._whole[body] ^ self._box(voxel, self._reach))
            self.start[voxel] = self.cells[voxel]
        return self.cells[voxel]

    @property
    def _reach(self) -> float:
        return self.clearance_mm + _SPARE_MM

    def _box(self, voxel: int, wider_mm: float) -> manifold3d.Manifold:
        import manifold3d

        side = self.voxel_mm + 2 * wider_mm
        cube = manifold3d.Manifold.cube((side, side, side), True)
        return cube.translate(tuple(self.voxel_mm * self.tree.source[voxel].astype(float)))

    def _parts(self, voxel: int) -> Solids:
        """All that a body has in a cell, hinges included."""
        box = self._box(voxel, self._reach)
        parts = [self._cell(voxel)]
        parts += [_worked_out(half ^ box) for half, _ in self.halves[int(self.body[voxel])]]
        return [part for part in parts if not part.is_empty()]

    def _carve(self, meeting: Clash, low: float, high: float, out: Carved) -> None:
        frames = [to.copy() for to in (meeting.to_first, meeting.to_second)]
        for to in frames:
            to[:, 3] *= self.voxel_mm
        voxels = (meeting.first, meeting.second)
        corners = [
            np.rint(2.0 * (to[:, :3] @ self.tree.source[v] + to[:, 3] / self.voxel_mm)) / 2.0 - 0.5
            for to, v in zip(frames, voxels, strict=True)
        ]
        rings = _common_rings(corners[0], corners[1], self._reach / self.voxel_mm)
        rings = rings * self.voxel_mm
        level = (corners[0][2] + np.arange(_SLABS + 1) / _SLABS) * self.voxel_mm
        inner, outer = low * self.voxel_mm, high * self.voxel_mm
        sides = [_slabs(self._parts(v), to, level) for to, v in zip(frames, voxels, strict=True)]
        first = _Side(meeting.first, frames[0], rings, level, ahead=False)
        second = _Side(meeting.second, frames[1], rings, level, ahead=True)
        # Looked at before either is cut.
        begins = np.array([_extreme(edges, rings, -1.0) for edges in sides[0]])
        ends = np.array([_extreme(edges, rings, 1.0) for edges in sides[1]])
        near = self._reach
        middle = 0.5 * (rings[:-1] + rings[1:])
        gives = (middle >= inner) & (middle < outer)
        # Beside the radius at which the sides change, both must clear the other by the gap.
        first_gives = (rings[1:] > inner) & (rings[:-1] < outer)
        second_gives = (rings[:-1] < inner + near) | (rings[1:] > outer - near)
        if first_gives.any():
            self._take(first, np.where(first_gives, ends, -np.inf), out)
        if second_gives.any():
            self._take(second, np.where(second_gives, begins, np.inf), out)
        # Struts: behind what the other has been cut for.
        square = [_square_edges(corner * self.voxel_mm, self.voxel_mm) for corner in corners]
        last = _extreme(square[1], rings, 1.0)
        nearest = _extreme(square[0], rings, -1.0)
        shut_first = np.where(gives, -np.inf, np.where(np.isfinite(begins), begins, last))
        shut_second = np.where(gives, np.where(np.isfinite(ends), ends, nearest), np.inf)
        self._shut(first, shut_first, out)
        self._shut(second, shut_second, out)

    def _take(self, side: _Side, limit: Floats, out: Carved) -> None:
        """Take from a cell what lies beyond the limits (slabs, rings)."""
        voxel = side.voxel
        tool = side.beyond(limit, self._reach)
        if tool is None:
            return
        tool = _worked_out(tool ^ self._box(voxel, 2 * self._reach))
        cell = self._cell(voxel)
        body = int(self.body[voxel])
        hit = False
        for half, _ in self.halves[body]:
            if (half ^ tool).volume() <= _TOUCH_MM3:
                continue
            # What stands out of the cell is the barrel; the other body has a groove for it.
            tool = _worked_out(tool - (half - self._box(voxel, 0.0)))
            lost = (half ^ tool).volume()
            hit = hit or lost > _TOUCH_MM3
            if lost > _GRAZE * half.volume():
                raise GeometryError(
                    f"{self.tree.bodies[body].name}: carving would take {lost:.1f} mm³ of one of "
                    "its hinges"
                )
        hit = hit or (cell ^ tool).volume() > _TOUCH_MM3
        if not hit:
            return
        out.tools.setdefault(body, []).append(tool)
        for other in [v for v in self.cells if int(self.body[v]) == body]:
            self.cells[other] = _worked_out(self.cells[other] - tool)
        self._whole[body] = _worked_out(self._whole[body] - tool)

    def _shut(self, side: _Side, limit: Floats, out: Carved) -> None:
        """Keep struts out of what lies beyond the limits (slabs, rings)."""
        tool = side.beyond(limit, 0.0)
        if tool is not None:
            body = int(self.body[side.voxel])
            out.shut.setdefault(body, []).append(tool ^ self._box(side.voxel, 0.0))

    def _count(self, out: Carved) -> None:
        skin = None
        size = self.voxels.subvoxels.shape[1]
        step = self.voxel_mm / size
        for voxel in sorted(self.cells):
            box = self._box(voxel, 0.0)
            lost = _worked_out((self.start[voxel] - self.cells[voxel]) ^ box)
            volume = lost.volume()
            if volume < _LEAST_MM3:
                continue
            if skin is None:
                skin = skin_of(self.voxels.cells, self.voxels.subvoxels)
            corner = self.voxel_mm * (self.tree.source[voxel] - 0.5) + step / 2
            inside = occupancy(lost, corner, step, (size, size, size))
            share = float((inside & skin[voxel]).sum() / max(1, inside.sum()))
            out.cells += 1
            out.skin_mm3 += share * volume
            out.inside_mm3 += (1.0 - share) * volume


# --- rings and slabs ---------------------------------------------------------------------------


def _worked_out(solid: manifold3d.Manifold) -> manifold3d.Manifold:
    solid.num_tri()
    return solid


def _inverse(frame: Floats) -> Floats:
    back = np.empty((3, 4))
    back[:, :3] = frame[:, :3].T
    back[:, 3] = -frame[:, :3].T @ frame[:, 3]
    return back


def _common_rings(first: Floats, second: Floats, beyond: float) -> Floats:
    """Radii, lattice units, that divide the rings in which both unit squares have a part.

    And a little beyond: what turns just inside of such a ring comes too near.
    """
    low = max(0.0, np.hypot(*first[:2]) - beyond, np.hypot(*second[:2]) - beyond)
    high = min(np.hypot(*(first[:2] + 1)), np.hypot(*(second[:2] + 1))) + beyond
    return np.linspace(low, high, max(2, int(np.ceil((high - low) * _RINGS))) + 1)


def _square_edges(corner: Floats, side: float) -> Floats:
    """Edges (4, 2, 2) of a square."""
    x, y = corner[:2]
    points = np.array([(x, y), (x + side, y), (x + side, y + side), (x, y + side)])
    return np.stack([points, np.roll(points, -1, axis=0)], axis=1)


def _slabs(parts: Solids, frame: Floats, level: Floats) -> list[Floats]:
    """Edges, seen along the axis, of what lies between each two levels: (k, 2, 2) each."""
    placed = [part.transform(frame) for part in parts]
    out = []
    for low, high in pairwise(level):
        edges = [np.zeros((0, 2, 2))]
        for part in placed:
            box = part.bounding_box()
            if box[5] <= low or box[2] >= high:
                continue
            slab = part.trim_by_plane((0.0, 0.0, 1.0), low).trim_by_plane((0.0, 0.0, -1.0), -high)
            if slab.is_empty():
                continue
            mesh = slab.to_mesh64()
            corners = mesh.vert_properties[:, :2][mesh.tri_verts]
            edges.append(
                np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2, 2)
            )
        out.append(np.concatenate(edges))
    return out


def _extreme(edges: Floats, rings: Floats, sign: float) -> Floats:
    """Largest (sign 1) or smallest (sign -1) angle at which edges lie in each ring.

    Angles along a straight line rise or fall all the way, so the ends of what a ring holds of it
    decide. Minus or plus infinity in a ring that holds nothing.
    """
    start, end = edges[:, 0], edges[:, 1]
    way = end - start
    length = np.linalg.norm(way, axis=1)
    keep = length > 1e-12
    start, way, length = start[keep], way[keep] / length[keep, None], length[keep]
    best = np.full(len(rings) - 1, -np.inf)
    if len(start) == 0:
        return sign * best
    along = np.einsum("ij,ij->i", start, way)
    foot = start - along[:, None] * way
    near2 = np.einsum("ij,ij->i", foot, foot)
    for half in (-1.0, 1.0):  # towards the foot of the axis on the line, and away from it
        t0, t1 = along, along + length
        t0, t1 = (
            (np.minimum(t0, 0.0), np.minimum(t1, 0.0))
            if half < 0
            else (np.maximum(t0, 0.0), np.maximum(t1, 0.0))
        )
        some = t1 > t0
        if not some.any():
            continue
        r0, r1 = np.sqrt(near2 + t0**2), np.sqrt(near2 + t1**2)
        r_low, r_high = np.minimum(r0, r1)[some], np.maximum(r0, r1)[some]
        base, line, square = foot[some], way[some], near2[some]
        inside = (r_high[:, None] >= rings[None, :-1]) & (r_low[:, None] <= rings[None, 1:])
        i, j = np.nonzero(inside)
        for radius in (np.maximum(r_low[i], rings[j]), np.minimum(r_high[i], rings[j + 1])):
            t = half * np.sqrt(np.maximum(radius**2 - square[i], 0.0))
            point = base[i] + t[:, None] * line[i]
            np.maximum.at(best, j, sign * np.arctan2(point[:, 1], point[:, 0]))
    return sign * best


def _section(rings: Floats, limit: Floats, ahead: bool) -> manifold3d.CrossSection | None:
    import manifold3d

    sign = 1.0 if ahead else -1.0
    # Angles from the far side: turned so that "ahead" is always upwards.
    begin = np.where(np.isfinite(limit), sign * limit, np.inf)
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
    """Points of an arc whose chords stay outside (or inside) of the circle."""
    count = max(1, int(np.ceil(abs(end - start) / _ARC_STEP)))
    angles = np.linspace(start, end, count + 1)
    if outside:
        radius = radius / np.cos(abs(end - start) / count / 2)
    return np.column_stack([radius * np.cos(angles), radius * np.sin(angles)])
