"""Cutting one body: grooves for barrels, pockets for link plates, and what they may not touch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import GeometryError
from fabfold.joinery.grooves import Passage, groove_tools
from fabfold.joinery.hinge_placement import Fittings, knuckle_zone
from fabfold.joinery.pockets import plate_tools
from fabfold.joinery.sizes import HingeSize
from fabfold.tree.fold_tree import FoldTree

if TYPE_CHECKING:
    import manifold3d

    Tools = list[tuple[int, manifold3d.Manifold]]

__all__ = ["Cut", "bounds", "evaluated", "less", "meeting", "united"]

#: A groove may not take more than this from the knuckles of a hinge, in mm³.
_ZONE_LOSS_MM3 = 0.01
#: The knuckles that pockets keep off are a little larger than they are, in mm.
_SHIELD_MM = 0.01
#: Tools are cut down to what they take and this much on every side, in mm.
_ROUND_MM = 0.5

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Cut:
    """One body and all that passes it on the folding path.

    Attributes
    ----------
    index : int
        Of the body.
    tree : FoldTree
    fitted : Fittings
    ways, plate_ways : list of Passage
        Of barrels and of link plates past this body.
    size : HingeSize
    voxel_mm : float
    """

    index: int
    tree: FoldTree
    fitted: Fittings
    ways: list[Passage]
    plate_ways: list[Passage]
    size: HingeSize
    voxel_mm: float

    @property
    def name(self) -> str:
        """Of the body."""
        return self.tree.bodies[self.index].name

    @property
    def own(self) -> list[int]:
        """The body's own hinges."""
        return [
            h
            for h, hinge in enumerate(self.tree.hinges)
            if self.index in (hinge.parent, hinge.child)
        ]

    def boxes(
        self, cells: NDArray[np.int32], halves: Sequence[manifold3d.Manifold]
    ) -> tuple[Floats, Floats]:
        """Boxes in lattice units that hold all that a tool could meet, struts included."""
        lows = list((cells - 0.5) * self.voxel_mm)
        highs = list((cells + 0.5) * self.voxel_mm)
        for half in halves:
            low, high = bounds(half)
            lows.append(low)
            highs.append(high)
        return np.array(lows) / self.voxel_mm, np.array(highs) / self.voxel_mm

    def grooves(self, low: Floats, high: Floats, extra_mm: float = 0.0) -> Tools:
        """Tools for the barrels that pass, with the hinge of each.

        Raises
        ------
        GeometryError
            If one cuts into the knuckles of the body's own hinges.
        """
        tools = groove_tools(
            self.ways,
            low,
            high,
            voxel_mm=self.voxel_mm,
            radius_mm=self.size.reach_mm + extra_mm,
            trim_mm=self.size.barrel_radius_mm - extra_mm,
        )
        if extra_mm == 0.0:
            self._protect_zones(tools)
        return tools

    def pockets(self, low: Floats, high: Floats) -> Tools:
        """Tools for the link plates that pass, with the link of each.

        In the two cells beside a plate the hinge itself makes room for it, all around its turn.

        Parameters
        ----------
        low, high : (m, 3) float64 arrays
            Boxes that hold the body, lattice units: its cells, or what there is of a link.
        """
        import manifold3d

        tools = []
        side = self.voxel_mm
        cube = manifold3d.Manifold.cube((side, side, side), True)
        for link, plate in self.fitted.plates.items():
            ways = [way for way in self.plate_ways if way.hinge == link]
            if self.index not in plate.bodies:
                tools += plate_tools(ways, low, high, voxel_mm=side)
                continue
            cell = plate.cells[plate.bodies.index(self.index)].astype(float)
            rest = (np.abs((low + high) / 2 - cell) > 1e-6).any(axis=1)
            mine = cube.translate(tuple(side * cell))
            for _, tool in plate_tools(ways, low[rest], high[rest], voxel_mm=side):
                tools.append((link, evaluated(tool - mine)))
        return tools

    def half(
        self, half: manifold3d.Manifold, grooves: Tools, pockets: Tools
    ) -> manifold3d.Manifold:
        """A half of one of the body's hinges after all cuts.

        Plates keep off knuckles: they are grooved for them like any body. So a pocket takes from
        the bracket only.
        """
        hits = meeting(pockets, half)
        tools = meeting(grooves, half)
        if hits:
            shields = [
                knuckle_zone(self.tree.hinges[h], self.size, self.voxel_mm, -_SHIELD_MM)
                for h in self.own
            ]
            tools.append(less(united(hits), shields))
        return less(half, tools)

    def _protect_zones(self, tools: Tools) -> None:
        """Refuse a groove that would cut into the knuckles of one of the body's own hinges."""
        for h in self.own:
            zone = knuckle_zone(self.tree.hinges[h], self.size, self.voxel_mm)
            low, high = bounds(zone)
            for culprit, tool in tools:
                start, end = bounds(tool)
                if (start >= high).any() or (low >= end).any():
                    continue
                if (zone ^ tool).volume() > _ZONE_LOSS_MM3:
                    hinges = self.tree.hinges
                    raise GeometryError(
                        f"{self.name}: the barrel of {hinges[culprit].name} passes through the "
                        f"knuckles of {hinges[h].name} on the folding path"
                    )


def evaluated(solid: manifold3d.Manifold) -> manifold3d.Manifold:
    """The same solid, worked out now.

    Booleans are lazy; one that is used twice before it is worked out may be worked out twice.
    """
    solid.num_tri()
    return solid


def united(solids: list[manifold3d.Manifold]) -> manifold3d.Manifold:
    """Union of solids."""
    import manifold3d

    return evaluated(manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add))


def less(solid: manifold3d.Manifold, tools: list[manifold3d.Manifold]) -> manifold3d.Manifold:
    """A solid without some tools."""
    if not tools:
        return evaluated(solid)
    return evaluated(evaluated(solid) - united(tools))


def meeting(tools: Tools, solid: manifold3d.Manifold) -> list[manifold3d.Manifold]:
    """The tools that take something off a solid, each cut down to a box about what it takes.

    Most pass by where a cell is empty, and those that do not mostly graze. Hundreds of hulls in a
    row unite much faster when only the parts that matter are left of them.
    """
    import manifold3d

    low, high = bounds(solid)
    found = []
    for _, tool in tools:
        start, end = bounds(tool)
        if not ((start < high).all() and (low < end).all()):
            continue
        common = solid ^ tool
        if common.volume() <= 1e-6:
            continue
        start, end = bounds(common)
        box = manifold3d.Manifold.cube(tuple(end - start + 2 * _ROUND_MM))
        found.append(evaluated(tool ^ box.translate(tuple(start - _ROUND_MM))))
    return found


def bounds(solid: manifold3d.Manifold) -> tuple[Floats, Floats]:
    """Lowest and highest corner of a solid's bounding box."""
    box = np.array(solid.bounding_box())
    return box[:3], box[3:]
