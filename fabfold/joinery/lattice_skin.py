"""Bodies without the model's surface: each a block of its cells, with chamfered edges."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from fabfold.joinery.cells import eroded_cells
from fabfold.voxels.voxel_model import Voxels

__all__ = ["CHAMFER_SHARE", "blocks_of"]

#: Leg of the chamfer on the edges of blocks, in voxel sides.
CHAMFER_SHARE: Final = 0.05
#: Cells are grown by this much, in voxel sides, so that those beside each other are one solid.
_GROWN = 0.01


def blocks_of(voxels: Voxels) -> Voxels:
    """The same voxels, each full.

    Parameters
    ----------
    voxels : Voxels
        A model cut into voxels.

    Returns
    -------
    Voxels
        Its cells, grid and figures, with all cells as the model.
    """
    made = eroded_cells(voxels.cells, 1.0, -_GROWN).to_mesh64()
    return replace(
        voxels,
        subvoxels=np.ones_like(voxels.subvoxels),
        fill=np.ones_like(voxels.fill),
        vertices=np.asarray(made.vert_properties, dtype=np.float64)[:, :3].copy(),
        faces=np.asarray(made.tri_verts, dtype=np.int32),
    )
