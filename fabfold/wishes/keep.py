"""Wishes of ``--keep``: a part of the model's surface shall be seen on one side of the box.

A wish becomes an energy of each voxel at each pose, and root poses from which growing begins. What
a tree shows of the part where it was wished is measured as a share of the part's area.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fabfold.lattice.rotations import FACE_BEFORE, FACES
from fabfold.lattice.template import Template
from fabfold.solid.regions import SurfaceSamples
from fabfold.tree.fold_tree import FoldTree
from fabfold.voxels.region_cells import containing_voxels
from fabfold.voxels.voxel_model import Voxels

__all__ = ["Keep", "KeptShare", "add_keep_cost", "keep_root_poses", "kept_share"]


@dataclass(frozen=True)
class Keep:
    """A part of the model's surface that shall be seen on one side of the box.

    Attributes
    ----------
    text : str
        The wish as it was written.
    area : SurfaceSamples
        Samples of the part's surface.
    side : int
        Side of the template, as an index of :data:`fabfold.lattice.rotations.FACES`.
    """

    text: str
    area: SurfaceSamples
    side: int

    def area_by_face(self, voxels: Voxels) -> tuple[NDArray[np.float64], float]:
        """Area of the part that each voxel holds, as seen from each of its faces in A.

        A direction between two faces counts for each by the square of its cosine, so the shares of
        a sample add up to 1.

        Parameters
        ----------
        voxels : Voxels
            The voxelization.

        Returns
        -------
        by_face : (n, 6) float64 array
            Area at each face of each voxel, in faces of a voxel.
        whole : float
            Area of the whole part, in faces of a voxel.
        """
        seen = np.maximum((self.area.outward @ voxels.rotation.T) @ FACES.T, 0.0) ** 2
        holder = containing_voxels(voxels, self.area.points)
        by_face = np.zeros((len(voxels), 6))
        held = holder >= 0
        unit = voxels.pitch**2
        np.add.at(by_face, holder[held], seen[held] * self.area.weight[held, None] / unit)
        return by_face, float(self.area.weight.sum()) / unit


@dataclass(frozen=True)
class KeptShare:
    """How much of a kept part is where it was wished to be.

    Attributes
    ----------
    text : str
        The wish as it was written.
    share : float
        Share of the part's area that is on that side of the box and faces outwards, 0 to 1.
    voxels : int
        Voxels that show some of it there.
    of : int
        Voxels that hold some of it.
    """

    text: str
    share: float
    voxels: int
    of: int

    def __str__(self) -> str:
        return (
            f"keep {self.text}: {self.share:.0%} of its area is there, "
            f"{self.voxels} of {self.of} voxels"
        )


def add_keep_cost(
    cost: NDArray[np.float64], keep: Keep, weight: float, voxels: Voxels, template: Template
) -> None:
    """Add what a wish costs for each voxel at each pose.

    A kept part costs `weight` for each face's worth of it that is not shown, so 0 is the best there
    is.

    Parameters
    ----------
    cost : (n, m, 24) float64 array
        Weighted energy of each voxel in each template cell and rotation; changed in place.
    keep : Keep
        The wish.
    weight : float
        Energy of one face's worth of the part's area.
    voxels : Voxels
        The voxelization.
    template : Template
        The shape to fill.
    """
    by_face, _ = keep.area_by_face(voxels)
    on_side = template.outer_faces()[:, keep.side]
    shown = by_face[:, FACE_BEFORE[:, keep.side]]
    cost += weight * by_face.sum(axis=1)[:, None, None]
    cost -= weight * shown[:, None, :] * on_side[None, :, None]


def keep_root_poses(
    keeps: Sequence[Keep], voxels: Voxels, template: Template, colours: Sequence[int]
) -> NDArray[np.int32] | None:
    """Where growing shall begin: voxels with much of the largest kept part, shown as wished.

    Half turns never change which axis of the model lies along which axis of the box. A search that
    began with a wrong one could not keep anything.

    Parameters
    ----------
    keeps : sequence of Keep
        The wishes.
    voxels : Voxels
        The voxelization.
    template : Template
        The shape to fill.
    colours : sequence of int
        Colours of the cells that voxels of source colour 0 can take.

    Returns
    -------
    (k, 2) int32 array or None
        Voxels and poses; None where there is nothing to keep.
    """
    areas = [keep.area_by_face(voxels)[0] for keep in keeps]
    if not areas:
        return None
    largest = int(np.argmax([area.sum() for area in areas]))
    by_face, side = areas[largest], keeps[largest].side
    if not by_face.any():
        return None
    rotations = np.ones(24, dtype=bool)
    for area, keep in zip(areas, keeps, strict=True):
        # Any turn that shows the part's main axis on the right axis of the box will do.
        axis = int(area.sum(axis=0).reshape(3, 2).sum(axis=1).argmax())
        fits = FACE_BEFORE[:, keep.side] >> 1 == axis
        rotations &= fits if (rotations & fits).any() else True
    cells = np.flatnonzero(template.outer_faces()[:, side])
    voxel_colour = voxels.cells.sum(axis=1) % 2
    cell_colour = template.cells.sum(axis=1) % 2
    found = []
    for rotation in np.flatnonzero(rotations).tolist():
        here = by_face[:, FACE_BEFORE[rotation, side]]
        for voxel in np.flatnonzero(here >= 0.5 * by_face.max()).tolist():
            fitting = [c for c in cells if (cell_colour[c] - voxel_colour[voxel]) % 2 in colours]
            found += [(voxel, 24 * cell + rotation) for cell in fitting]
    return np.array(found, dtype=np.int32).reshape(-1, 2) if found else None


def kept_share(keep: Keep, voxels: Voxels, tree: FoldTree) -> KeptShare:
    """How much of a kept part a tree shows where it was wished to be.

    Parameters
    ----------
    keep : Keep
        The wish.
    voxels : Voxels
        The voxelization that the tree joins.
    tree : FoldTree
        A tree of any search.

    Returns
    -------
    KeptShare
        Share of the area, and numbers of voxels.
    """
    cells = {tuple(cell): k for k, cell in enumerate(tree.template.cells.tolist())}
    where = np.array([cells[tuple(cell)] for cell in tree.target.tolist()])
    on_side = tree.template.outer_faces()
    by_face, whole = keep.area_by_face(voxels)
    # The direction in A that comes to face the side in B.
    seen = np.einsum("nji,j->ni", tree.orientation, FACES[keep.side])
    face = (seen @ FACES.T).argmax(axis=1)
    shown = by_face[np.arange(len(by_face)), face] * on_side[where, keep.side]
    return KeptShare(
        keep.text,
        float(shown.sum() / whole),
        int((shown > 0.01).sum()),
        int((by_face.sum(axis=1) > 0.01).sum()),
    )
