"""Walls at cut faces: where the cut leaves a blade of the model, it is made as thick as prints.

A cut plane that meets the model's surface at a shallow angle leaves material that thins out to
nothing. The outline of the material on the cut face is drawn out inwards by the least wall. Where
the body is thicker this changes nothing; where it is thinner it gets its wall, inside its own cell.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.joinery.booleans import union
from fabfold.joinery.cells import eroded_cells
from fabfold.lattice.rotations import FACES
from fabfold.tree.fold_tree import FoldTree

if TYPE_CHECKING:
    import manifold3d

__all__ = ["with_cut_walls"]

#: Walls are thicker than asked for by this, mm, so that none is thinner once it is rounded.
_SPARE_MM = 0.01
#: The material is looked at so far below the cut face, mm.
_BELOW_MM = 0.002
#: Strips narrower than twice this share of the wall are left as they are.
_SLIVER = 0.125
#: Outlines are simplified to within this, mm.
_FINE_MM = 0.005


def with_cut_walls(
    model: manifold3d.Manifold, tree: FoldTree, voxel_mm: float, inset_mm: float, wall_mm: float
) -> tuple[manifold3d.Manifold, float]:
    """The model with walls of a least thickness behind all faces that the cut makes.

    Parameters
    ----------
    model : manifold3d.Manifold
        The warped model, mm, lattice origin at zero.
    tree : FoldTree
        Which cells are one body.
    voxel_mm : float
        Side of a voxel, mm.
    inset_mm : float
        Half the gap between bodies, mm.
    wall_mm : float
        Least thickness, mm.

    Returns
    -------
    model : manifold3d.Manifold
        With the walls; each lies in the cells of its own body, and is cut with them.
    added_mm3 : float
        Volume of what they add, mm³.
    """
    walls: list[manifold3d.Manifold] = []
    wall = wall_mm + _SPARE_MM
    added = 0.0
    for body in tree.bodies:
        if not body.voxels:
            continue
        voxels = list(body.voxels)
        cells = tree.source[voxels]
        octants = None if tree.octants is None else tree.octants[voxels]
        space = eroded_cells(cells, voxel_mm, inset_mm, octants)
        material = model ^ space
        slabs = [
            slab
            for normal in FACES
            for slab in _slabs(material, cells, normal, voxel_mm, inset_mm, wall)
        ]
        if slabs:
            walls += slabs
            added += ((union(slabs) ^ space) - material).volume()
    return (union([model, *walls]) if walls else model), float(added)


def _slabs(
    material: manifold3d.Manifold,
    cells: NDArray[np.int32],
    normal: NDArray[np.int32],
    side: float,
    inset: float,
    wall: float,
) -> list[manifold3d.Manifold]:
    """Walls behind the cut faces of a body that look along a normal."""
    import manifold3d

    own = {tuple(cell) for cell in cells.tolist()}
    cut = [cell for cell in cells if tuple((cell + normal).tolist()) not in own]
    if not cut:
        return []
    # Rows: two axes of the face and its normal.
    first = np.roll(np.abs(normal), 1)
    frame = np.array([first, np.cross(normal, first), normal], dtype=float)
    turned = material.transform(np.column_stack([frame, np.zeros(3)]))
    back = np.column_stack([frame.T, np.zeros(3)])
    places = np.array(cut) @ frame.T
    slabs = []
    for level in np.unique(places[:, 2]):
        height = (level + 0.5) * side - inset
        section = turned.slice(float(height - _BELOW_MM))
        deep = turned.slice(float(height - wall))
        squares = manifold3d.CrossSection.batch_boolean(
            [
                manifold3d.CrossSection.square((side, side), True).translate((side * x, side * y))
                for x, y in places[places[:, 2] == level, :2].tolist()
            ],
            manifold3d.OpType.Add,
        )
        thin = _thin(section ^ squares, deep, wall)
        if not thin.is_empty():
            # Into the gap before the face, where the cut takes it off like the model.
            slab = thin.extrude(wall + inset / 2).translate((0.0, 0.0, float(height - wall)))
            slabs.append(slab.transform(back))
    return slabs


def _thin(
    outline: manifold3d.CrossSection, deep: manifold3d.CrossSection, wall: float
) -> manifold3d.CrossSection:
    """Where there is material at a face and none a wall deeper, and a little of what is beside it.

    What is narrower than the wall is left out: no depth makes that print.
    """
    import manifold3d

    miter = manifold3d.JoinType.Miter
    wide = outline.offset(-wall / 2, miter).offset(wall / 2, miter) ^ outline
    bare = (wide - deep).offset(-_SLIVER * wall, miter).offset(_SLIVER * wall, miter)
    if bare.is_empty():
        return bare
    return (bare.offset(wall / 2, miter) ^ wide).simplify(_FINE_MM)
