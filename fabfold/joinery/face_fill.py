"""Plates that close open faces of the box from inside.

A face of the box stays open where its voxel holds little material behind it. In the model most of
these faces look at another voxel, so a plate as thick as the printer's wall may lie behind them. It
lies inside its own cell, inset like all of it, and is cut and certified with the body.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.joinery.booleans import union
from fabfold.lattice.rotations import FACES
from fabfold.tree.fold_tree import FoldTree

if TYPE_CHECKING:
    import manifold3d

__all__ = ["FaceFill", "covered_faces", "plate_before", "with_filled_faces"]

#: A face with less than this mean depth behind it, in voxel sides, counts as closed.
_CLOSED = 0.02
#: Plates are thicker than the wall by this, mm, so that none is thinner once it is rounded.
_SPARE_MM = 0.01
#: A plate has to meet this much of its body's material, in cubes of the wall, to hold to it.
_HOLDS = 4.0


@dataclass(frozen=True)
class FaceFill:
    """What closing open faces has done.

    Attributes
    ----------
    faces : int
        Faces of the box that got a plate.
    left_open : int
        Faces that could have one, but have no material for it to hold to.
    unshut : int
        Faces that are left open so that powder comes out of a hollow behind them.
    added_mm3 : float
        Volume of what the plates add, before hinges are cut, mm³.
    before, after : float
        Share to which the box is closed, from 0 to 1, with a plate as a closed face.
    """

    faces: int
    left_open: int
    added_mm3: float
    before: float
    after: float
    unshut: int = 0

    def note(self, wall_mm: float, density_g_cm3: float) -> str:
        """What was done, in a maker's words."""
        grams = self.added_mm3 / 1000 * density_g_cm3
        left = f"; {self.left_open} more have no material to hold one" if self.left_open else ""
        if self.unshut:
            left += f"; {self.unshut} stay open so that powder comes out of a hollow behind"
        return (
            f"{self.faces} open faces of the box have plates of {wall_mm:g} mm, {grams:.1f} g in "
            f"all: it is closed to {100 * self.after:.0f} % instead of {100 * self.before:.0f} %"
            f"{left}"
        )


def covered_faces(tree: FoldTree) -> NDArray[np.int64]:
    """Faces of voxels that look at another voxel in A, and outwards in B.

    Parameters
    ----------
    tree : FoldTree
        Cells and orientations of the voxels in A and B.

    Returns
    -------
    (k, 2) int64 array
        Index of the voxel, and of the face in :data:`fabfold.lattice.rotations.FACES` as it lies
        in A.
    """
    model = {tuple(cell) for cell in tree.source.tolist()}
    box = {tuple(cell) for cell in tree.target.tolist()}
    found = []
    for voxel, (here, there, turn) in enumerate(
        zip(tree.source, tree.target, tree.orientation, strict=True)
    ):
        for face, normal in enumerate(FACES):
            hidden = tuple((here + normal).tolist()) in model
            shown = tuple((there + turn @ normal).tolist()) not in box
            if hidden and shown:
                found.append((voxel, face))
    return np.array(found, dtype=np.int64).reshape(-1, 2)


def plate_before(
    tree: FoldTree,
    depth: NDArray[np.float64],
    body: int,
    point: NDArray[np.float64],
    without: Collection[tuple[int, int]],
) -> tuple[int, int] | None:
    """The plate of a body that is nearest to a point: what shuts the hollow there.

    Parameters
    ----------
    tree : FoldTree
        Where the voxels lie in A and B.
    depth : (n, 6) float64 array
        As of :func:`with_filled_faces`.
    body : int
        Index of the body.
    point : (3,) float64 array
        In lattice units, in A.
    without : collection of (int, int)
        Voxels and faces that have no plate.

    Returns
    -------
    (int, int) or None
        Voxel and face as of :func:`covered_faces`; None where no plate is within a voxel's side.
    """
    found = []
    for voxel, face in covered_faces(tree).tolist():
        if depth[voxel, face] < _CLOSED or (voxel, face) in without:
            continue
        if voxel not in tree.bodies[body].voxels:
            continue
        away = point - tree.source[voxel] - FACES[face] / 2
        across = np.maximum(np.abs(away) - np.where(FACES[face] == 0, 0.5, 0.0), 0.0)
        found.append((float(np.linalg.norm(across)), voxel, face))
    nearest = min(found, default=(1.0, 0, 0))
    return nearest[1:] if nearest[0] < 1.0 else None


def with_filled_faces(
    model: manifold3d.Manifold,
    tree: FoldTree,
    depth: NDArray[np.float64],
    *,
    voxel_mm: float,
    inset_mm: float,
    wall_mm: float,
    without: Collection[tuple[int, int]] = (),
) -> tuple[manifold3d.Manifold, FaceFill]:
    """The model with plates behind the open faces of the box that another voxel covers in A.

    Parameters
    ----------
    model : manifold3d.Manifold
        The warped model, mm, lattice origin at zero.
    tree : FoldTree
        Where the voxels lie in A and B.
    depth : (n, 6) float64 array
        Mean depth behind each face, in voxel sides, from :class:`fabfold.voxels.features.Features`.
    voxel_mm : float
        Side of a voxel, mm.
    inset_mm : float
        Half the gap between bodies, mm.
    wall_mm : float
        Thickness of a plate, mm.
    without : collection of (int, int)
        Voxels and faces, as of :func:`covered_faces`, that get no plate.

    Returns
    -------
    model : manifold3d.Manifold
        With the plates; each lies in the cell of its own voxel.
    fill : FaceFill
        What they close.
    """
    import manifold3d

    from fabfold.tree.bound import closed_share, visible_faces

    reach, wall = voxel_mm / 2 - inset_mm, wall_mm + _SPARE_MM
    plates: list[manifold3d.Manifold] = []
    left, added, closed = 0, 0.0, 0.0
    for voxel, face in covered_faces(tree).tolist():
        if depth[voxel, face] < _CLOSED or (voxel, face) in without:
            continue
        middle, normal = voxel_mm * tree.source[voxel], FACES[face]
        place = (middle + normal * (reach - wall / 2)).tolist()
        inner = np.where(normal == 0, 2 * reach, wall).tolist()
        plate = manifold3d.Manifold.cube(inner, True).translate(place)
        bare = plate.volume() - (plate ^ model).volume()
        if plate.volume() - bare < _HOLDS * wall**3:
            left += 1
            continue
        # As wide as the cell, so that plates of one body meet; the cut takes off what is too much.
        whole = np.where(normal == 0, voxel_mm, wall).tolist()
        plates.append(manifold3d.Manifold.cube(whole, True).translate(place))
        added += bare
        closed += float(depth[voxel, face])
    before = closed_share(tree)
    after = before + closed / visible_faces(tree.template)
    fill = FaceFill(len(plates), left, added, before, after, len(without))
    return (union([model, *plates]) if plates else model), fill
