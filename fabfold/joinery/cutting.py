"""Cut one body: grooves for barrels, pockets for link plates, and what they may not touch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import GeometryError
from fabfold.joinery.barrel_sweeps import Sweep
from fabfold.joinery.booleans import bounds, effective_tools, evaluated, subtract, union
from fabfold.joinery.grooves import groove_tools
from fabfold.joinery.hinge_placement import PlacedHinges, barrel_solid
from fabfold.joinery.pockets import pocket_tools
from fabfold.joinery.sizes import HingeSize
from fabfold.tree.fold_tree import FoldTree

if TYPE_CHECKING:
    import manifold3d

    from fabfold.joinery.booleans import Tools

__all__ = ["BodyCutter"]

#: A groove may not take more than this from the knuckles of a hinge, in mm³.
_KNUCKLE_LOSS_MM3 = 0.01
#: Pockets keep off a cylinder that is this much larger than the knuckles, in mm.
_KNUCKLE_MARGIN_MM = 0.01

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class BodyCutter:
    """One body and all that passes it on the folding path.

    Attributes
    ----------
    index : int
        Index of the body in the tree.
    tree : FoldTree
        The tree of all bodies and hinges.
    hinges : PlacedHinges
        The solids of all hinges.
    barrel_sweeps : list of Sweep
        How barrels of other hinges pass this body.
    plate_sweeps : list of Sweep
        How link plates pass this body.
    size : HingeSize
        Size of the hinges.
    voxel_mm : float
        Side of a voxel in mm.
    """

    index: int
    tree: FoldTree
    hinges: PlacedHinges
    barrel_sweeps: list[Sweep]
    plate_sweeps: list[Sweep]
    size: HingeSize
    voxel_mm: float

    @property
    def name(self) -> str:
        """Name of the body."""
        return self.tree.bodies[self.index].name

    @property
    def own_hinges(self) -> list[int]:
        """Indices of the body's own hinges."""
        return [
            h
            for h, hinge in enumerate(self.tree.hinges)
            if self.index in (hinge.parent, hinge.child)
        ]

    def boxes(
        self, cells: NDArray[np.int32], halves: Sequence[manifold3d.Manifold]
    ) -> tuple[Floats, Floats]:
        """Boxes that hold all that a tool could meet, struts included.

        Parameters
        ----------
        cells : (m, 3) int32 array
            Cells of the body, lattice units.
        halves : sequence of manifold3d.Manifold
            The body's halves of hinges, mm.

        Returns
        -------
        low : (m + halves, 3) float64 array
            Lowest corner of each box, lattice units.
        high : (m + halves, 3) float64 array
            Highest corner of each box, lattice units.
        """
        lows = list((cells - 0.5) * self.voxel_mm)
        highs = list((cells + 0.5) * self.voxel_mm)
        for half in halves:
            low, high = bounds(half)
            lows.append(low)
            highs.append(high)
        return np.array(lows) / self.voxel_mm, np.array(highs) / self.voxel_mm

    def groove_tools(self, low: Floats, high: Floats, extra_mm: float = 0.0) -> Tools:
        """Tools for the barrels that pass.

        Parameters
        ----------
        low : (m, 3) float64 array
            Lowest corners of boxes that hold the body, lattice units.
        high : (m, 3) float64 array
            Highest corners of these boxes, lattice units.
        extra_mm : float
            How much wider than the clearance the grooves are on every side, mm.

        Returns
        -------
        list of (int, manifold3d.Manifold)
            Index of the hinge whose barrel passes, and a tool in mm.

        Raises
        ------
        GeometryError
            If a groove without extra cuts into the knuckles of the body's own hinges.
        """
        tools = groove_tools(
            self.barrel_sweeps,
            low,
            high,
            voxel_mm=self.voxel_mm,
            radius_mm=self.size.reach_mm + extra_mm,
            trim_mm=self.size.barrel_radius_mm - extra_mm,
        )
        if extra_mm == 0.0:
            self._refuse_cut_knuckles(tools)
        return tools

    def pocket_tools(self, low: Floats, high: Floats) -> Tools:
        """Tools for the link plates that pass.

        In the two cells beside a plate the hinge itself makes room for it, all around its turn.

        Parameters
        ----------
        low : (m, 3) float64 array
            Lowest corners of boxes that hold the body, lattice units: its cells, or the box of a
            link.
        high : (m, 3) float64 array
            Highest corners of these boxes, lattice units.

        Returns
        -------
        list of (int, manifold3d.Manifold)
            Index of the link whose plate passes, and a tool in mm.
        """
        import manifold3d

        tools = []
        side = self.voxel_mm
        cube = manifold3d.Manifold.cube((side, side, side), True)
        for link, plate in self.hinges.plates.items():
            sweeps = [sweep for sweep in self.plate_sweeps if sweep.owner == link]
            if self.index not in plate.bodies:
                tools += pocket_tools(sweeps, low, high, voxel_mm=side)
                continue
            cell = plate.cells[plate.bodies.index(self.index)].astype(float)
            rest = (np.abs((low + high) / 2 - cell) > 1e-6).any(axis=1)
            beside_plate = cube.translate(tuple(side * cell))
            for _, tool in pocket_tools(sweeps, low[rest], high[rest], voxel_mm=side):
                tools.append((link, evaluated(tool - beside_plate)))
        return tools

    def cut_half(
        self, half: manifold3d.Manifold, grooves: Tools, pockets: Tools
    ) -> manifold3d.Manifold:
        """A half of one of the body's hinges after all cuts.

        Link plates have grooves for the knuckles that pass them, like any body. So a pocket takes
        from the bracket only.

        Parameters
        ----------
        half : manifold3d.Manifold
            The half, or the link, before the cuts; mm.
        grooves : list of (int, manifold3d.Manifold)
            From :meth:`groove_tools`.
        pockets : list of (int, manifold3d.Manifold)
            From :meth:`pocket_tools`.

        Returns
        -------
        manifold3d.Manifold
            In mm.
        """
        pockets_in_half = effective_tools(pockets, half)
        tools = effective_tools(grooves, half)
        if pockets_in_half:
            knuckles = [
                barrel_solid(self.tree.hinges[h], self.size, self.voxel_mm, -_KNUCKLE_MARGIN_MM)
                for h in self.own_hinges
            ]
            tools.append(subtract(union(pockets_in_half), knuckles))
        return subtract(half, tools)

    def _refuse_cut_knuckles(self, tools: Tools) -> None:
        """Refuse a groove that would cut into the knuckles of one of the body's own hinges."""
        for h in self.own_hinges:
            barrel = barrel_solid(self.tree.hinges[h], self.size, self.voxel_mm)
            low, high = bounds(barrel)
            for culprit, tool in tools:
                start, end = bounds(tool)
                if (start >= high).any() or (low >= end).any():
                    continue
                if (barrel ^ tool).volume() > _KNUCKLE_LOSS_MM3:
                    hinges = self.tree.hinges
                    raise GeometryError(
                        f"{self.name}: the barrel of {hinges[culprit].name} passes through the "
                        f"knuckles of {hinges[h].name} on the folding path"
                    )
