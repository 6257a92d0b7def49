"""Carving: room for cells that run into each other on the folding path.

:mod:`fabfold.fold.carving_plan` says which two cells meet and which of them gives way on which
circles about the axis. Here the cut is worked out on the solids. All that the other body has in its
cell, hinges included, is looked at in slabs across the axis and in rings about it
(:mod:`fabfold.joinery.polar_slices`); in each ring the angle at which it begins (or ends) is exact.
What gives way loses the ring from that angle on, and the clearance all around. So the tool contains
all that the other cell sweeps and goes beyond it by the width of a ring and a slab at most. The
pairs of cells are worked out one after the other, and what is gone by then sweeps nothing.

Struts come later. They keep to where nothing passes: those of the body that gives way are kept out
of the cut, and those of the other behind what it was seen to have.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import GeometryError
from fabfold.fold.carving_plan import CarvingPlan, plan_carving, skin_of
from fabfold.fold.clashes import Clash
from fabfold.fold.motion import Motion, quarter_path
from fabfold.joinery.booleans import evaluated
from fabfold.joinery.cells import eroded_cells, occupancy
from fabfold.joinery.hinge_placement import PlacedHalf
from fabfold.joinery.polar_slices import (
    PolarSlices,
    common_rings,
    extreme_angles,
    slab_edges,
    square_edges,
)
from fabfold.tree.fold_tree import FoldTree
from fabfold.tree.system import hinge_system
from fabfold.voxels.voxel_model import Voxels

if TYPE_CHECKING:
    import manifold3d

    Solids = list[manifold3d.Manifold]

__all__ = ["CarvedMaterial", "carve"]

#: Slabs in the side of a voxel.
_SLABS = 10
#: Added to the clearance all around, in mm, for the rounding of coordinates.
_SPARE_MM = 0.01
#: Least volume that counts as lost by a cell, in mm³.
_LEAST_MM3 = 0.01
#: Least volume that a tool must take to be used, in mm³.
_TOUCH_MM3 = 1e-6
#: Largest share of the bracket and knuckles of a hinge that a tool may take.
_GRAZE_SHARE = 0.005

Floats = NDArray[np.float64]


@dataclass
class CarvedMaterial:
    """What carving takes, body by body.

    Attributes
    ----------
    tools : dict of int to list of manifold3d.Manifold
        By index of the body: what is taken from it, mm, lattice origin at zero.
    strut_keep_outs : dict of int to list of manifold3d.Manifold
        By index of the body: where its struts may not run, beside `tools`; mm.
    cells : int
        Number of cells that lose material.
    skin_mm3 : float
        Volume in mm³ that they lose at the model's surface.
    inside_mm3 : float
        Volume in mm³ that they lose inside the model.
    """

    tools: dict[int, Solids] = field(default_factory=dict)
    strut_keep_outs: dict[int, Solids] = field(default_factory=dict)
    cells: int = 0
    skin_mm3: float = 0.0
    inside_mm3: float = 0.0

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
    halves: Sequence[Sequence[PlacedHalf]],
    *,
    voxel_mm: float,
    clearance_mm: float,
) -> CarvedMaterial:
    """Work out what must be carved so that the cells of the bodies pass each other.

    Parameters
    ----------
    voxels : Voxels
        The voxels with their material, in the order of the tree's voxels.
    tree : FoldTree
        The bodies and their hinges.
    motion : Motion
        The folding path, one hinge a move.
    model : manifold3d.Manifold
        The warped model, mm, lattice origin at zero.
    halves : sequence of sequences of PlacedHalf
        The hinge halves of each body, by index of the body.
    voxel_mm : float
        Side of a voxel in mm.
    clearance_mm : float
        Gap between bodies in mm.

    Returns
    -------
    CarvedMaterial
        Empty where whole cells pass each other.

    Raises
    ------
    GeometryError
        If a hinge would be cut.
    """
    path = quarter_path(tree, motion)
    if path is None or tree.octants is not None:
        # A path past voxels that share cells is planned on eighths, and nothing gives way.
        return CarvedMaterial()
    planned = plan_carving(hinge_system(tree), path, voxels.subvoxels)
    if planned.blocked:
        names = [tree.bodies[int(tree.voxel_body[v])].name for v in planned.blocked[0]]
        raise GeometryError(
            f"{names[0]} and {names[1]} run into each other on the folding path, and carving "
            "would cut through a hinge"
        )
    if not planned.clashes:
        return CarvedMaterial()
    return _CarvingJob(voxels, tree, model, halves, voxel_mm, clearance_mm).run(planned)


class _CarvingJob:
    """The cells that run into each other as solids, while pair after pair is carved."""

    def __init__(
        self,
        voxels: Voxels,
        tree: FoldTree,
        model: manifold3d.Manifold,
        halves: Sequence[Sequence[PlacedHalf]],
        voxel_mm: float,
        clearance_mm: float,
    ) -> None:
        self.voxels, self.tree, self.model, self.halves = voxels, tree, model, halves
        self.voxel_mm, self.clearance_mm = voxel_mm, clearance_mm
        self.carved = CarvedMaterial()
        #: Material of cells by voxel, as it is now and as it was before any cut.
        self._cells: dict[int, manifold3d.Manifold] = {}
        self._uncut: dict[int, manifold3d.Manifold] = {}
        #: Material of bodies by index, as it is now.
        self._bodies: dict[int, manifold3d.Manifold] = {}

    def run(self, planned: CarvingPlan) -> CarvedMaterial:
        """Carve all pairs of cells in the planned order."""
        for clash, bounds in zip(planned.clashes, planned.rings, strict=True):
            self._carve(clash, float(bounds[0]), float(bounds[1]))
        self._count()
        return self.carved

    @property
    def _gap_mm(self) -> float:
        """Distance that is kept from what passes."""
        return self.clearance_mm + _SPARE_MM

    def _body_of(self, voxel: int) -> int:
        return int(self.tree.voxel_body[voxel])

    def _box(self, voxel: int, margin_mm: float) -> manifold3d.Manifold:
        """The cell of a voxel as a cube that is larger by a margin on every side."""
        import manifold3d

        side = self.voxel_mm + 2 * margin_mm
        cube = manifold3d.Manifold.cube((side, side, side), True)
        return cube.translate(tuple(self.voxel_mm * self.tree.source[voxel].astype(float)))

    def _cell(self, voxel: int) -> manifold3d.Manifold:
        """A cell's material and a little of its neighbours' in the same body."""
        if voxel not in self._cells:
            body = self._body_of(voxel)
            if body not in self._bodies:
                own = self.tree.source[list(self.tree.bodies[body].voxels)]
                solid = self.model ^ eroded_cells(own, self.voxel_mm, self.clearance_mm / 2)
                for placed in self.halves[body]:
                    solid -= placed.cutout
                self._bodies[body] = evaluated(solid)
            self._cells[voxel] = evaluated(self._bodies[body] ^ self._box(voxel, self._gap_mm))
            self._uncut[voxel] = self._cells[voxel]
        return self._cells[voxel]

    def _parts(self, voxel: int) -> Solids:
        """All that a body has in a cell, hinges included."""
        box = self._box(voxel, self._gap_mm)
        parts = [self._cell(voxel)]
        parts += [evaluated(placed.half ^ box) for placed in self.halves[self._body_of(voxel)]]
        return [part for part in parts if not part.is_empty()]

    def _carve(self, clash: Clash, low: float, high: float) -> None:
        """Carve one pair: the first cell gives way between two radii, the second elsewhere."""
        voxels = (clash.first, clash.second)
        frames = [to.copy() for to in (clash.to_first, clash.to_second)]
        for to in frames:
            to[:, 3] *= self.voxel_mm
        corners = [
            np.rint(2.0 * (to[:, :3] @ self.tree.source[v] + to[:, 3] / self.voxel_mm)) / 2.0 - 0.5
            for to, v in zip(frames, voxels, strict=True)
        ]
        rings = common_rings(corners[0], corners[1], self._gap_mm / self.voxel_mm)
        rings = rings * self.voxel_mm
        levels = (corners[0][2] + np.arange(_SLABS + 1) / _SLABS) * self.voxel_mm
        first = PolarSlices(clash.first, frames[0], rings, levels, ahead=False)
        second = PolarSlices(clash.second, frames[1], rings, levels, ahead=True)
        # Both are looked at before either is cut.
        edges = [
            slab_edges(self._parts(v), to, levels) for to, v in zip(frames, voxels, strict=True)
        ]
        begins = np.array([extreme_angles(slab, rings, -1.0) for slab in edges[0]])
        ends = np.array([extreme_angles(slab, rings, 1.0) for slab in edges[1]])
        inner, outer = low * self.voxel_mm, high * self.voxel_mm
        # Beside the radius at which the sides change, both must clear the other by the gap.
        first_gives = (rings[1:] > inner) & (rings[:-1] < outer)
        second_gives = (rings[:-1] < inner + self._gap_mm) | (rings[1:] > outer - self._gap_mm)
        if first_gives.any():
            self._cut(first, np.where(first_gives, ends, -np.inf))
        if second_gives.any():
            self._cut(second, np.where(second_gives, begins, np.inf))
        # Struts stay behind what the other cell has been cut for; where a cell is empty, behind
        # the whole cell.
        squares = [square_edges(corner * self.voxel_mm, self.voxel_mm) for corner in corners]
        last = extreme_angles(squares[1], rings, 1.0)
        nearest = extreme_angles(squares[0], rings, -1.0)
        middle = 0.5 * (rings[:-1] + rings[1:])
        gives = (middle >= inner) & (middle < outer)
        begins = np.where(np.isfinite(begins), begins, last)
        ends = np.where(np.isfinite(ends), ends, nearest)
        self._keep_struts_out(first, np.where(gives, -np.inf, begins))
        self._keep_struts_out(second, np.where(gives, ends, np.inf))

    def _cut(self, slices: PolarSlices, limits: Floats) -> None:
        """Take from a cell what lies beyond the limits (slabs, rings)."""
        voxel = slices.voxel
        tool = slices.beyond(limits, self._gap_mm)
        if tool is None:
            return
        tool = evaluated(tool ^ self._box(voxel, 2 * self._gap_mm))
        cell = self._cell(voxel)
        body = self._body_of(voxel)
        hit = False
        for placed in self.halves[body]:
            half = placed.half
            if (half ^ tool).volume() <= _TOUCH_MM3:
                continue
            # What stands out of the cell is the barrel; the other body has a groove for it.
            tool = evaluated(tool - (half - self._box(voxel, 0.0)))
            lost = (half ^ tool).volume()
            hit = hit or lost > _TOUCH_MM3
            if lost > _GRAZE_SHARE * half.volume():
                raise GeometryError(
                    f"{self.tree.bodies[body].name}: carving would take {lost:.1f} mm³ of one of "
                    "its hinges"
                )
        hit = hit or (cell ^ tool).volume() > _TOUCH_MM3
        if not hit:
            return
        self.carved.tools.setdefault(body, []).append(tool)
        for other in [v for v in self._cells if self._body_of(v) == body]:
            self._cells[other] = evaluated(self._cells[other] - tool)
        self._bodies[body] = evaluated(self._bodies[body] - tool)

    def _keep_struts_out(self, slices: PolarSlices, limits: Floats) -> None:
        """Keep the struts of a cell out of what lies beyond the limits (slabs, rings)."""
        keep_out = slices.beyond(limits, 0.0)
        if keep_out is not None:
            body = self._body_of(slices.voxel)
            keep_outs = self.carved.strut_keep_outs.setdefault(body, [])
            keep_outs.append(keep_out ^ self._box(slices.voxel, 0.0))

    def _count(self) -> None:
        """Count the cells that lost material, and how much of it lay at the model's surface."""
        skin = None
        size = self.voxels.subvoxels.shape[1]
        step = self.voxel_mm / size
        for voxel in sorted(self._cells):
            box = self._box(voxel, 0.0)
            lost = evaluated((self._uncut[voxel] - self._cells[voxel]) ^ box)
            volume = lost.volume()
            if volume < _LEAST_MM3:
                continue
            if skin is None:
                skin = skin_of(self.voxels.cells, self.voxels.subvoxels)
            corner = self.voxel_mm * (self.tree.source[voxel] - 0.5) + step / 2
            inside = occupancy(lost, corner, step, (size, size, size))
            share = float((inside & skin[voxel]).sum() / max(1, inside.sum()))
            self.carved.cells += 1
            self.carved.skin_mm3 += share * volume
            self.carved.inside_mm3 += (1.0 - share) * volume
