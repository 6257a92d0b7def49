"""Scans at 20 subvoxels a voxel, whose planes are to be moved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fabfold.solid.scan import TIE, scan_and_summed_volume, summed_volume
from fabfold.voxels.grid_placement import RankedGrid
from fabfold.voxels.voxel_model import SUBDIVISION

__all__ = ["FineScan", "fine_scan", "grid_shape"]

#: Most subvoxels of a scan: a longer model is not scanned.
_LIMIT = 40_000_000


@dataclass(frozen=True)
class FineScan:
    """A scan that begins on a plane of its grid, so that its planes are at whole subvoxels.

    Attributes
    ----------
    table : int32 array
        From :func:`fabfold.solid.scan.summed_volume`.
    material : bool array or None
        The subvoxels that it counts, where they were asked for.
    window : int32 array
        The table from where the model begins.
    first : (3,) int64 array
        Where that is, in subvoxels.
    rotation : int
        Index into :attr:`fabfold.voxels.refinement.Refinement.rotations`.
    start : (3,) float64 array
        The table's lower corner: lattice axes, model units.
    side : float
        Side of a subvoxel, model units.
    """

    table: NDArray[np.int32]
    material: NDArray[np.bool_] | None
    window: NDArray[np.int32]
    first: NDArray[np.int64]
    rotation: int
    start: NDArray[np.float64]
    side: float


def fine_scan(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], item: RankedGrid, material: bool
) -> FineScan | None:
    """Scan a model for a grid.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        The model in lattice axes, model units.
    faces : (f, 3) int32 array
        Closed and outward-oriented triangles.
    item : RankedGrid
        The grid.
    material : bool
        Whether the subvoxels are asked for, and not the table alone.

    Returns
    -------
    FineScan or None
        None where a scan would take too much memory.
    """
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    side = item.pitch / SUBDIVISION
    corner = np.array(item.origin) - 0.5 * item.pitch
    start = corner + np.floor((low - corner) / item.pitch - TIE) * item.pitch
    shape = grid_shape(high - start, side)
    if float(np.prod(np.array(shape, dtype=float))) > _LIMIT:
        return None
    inside = None
    if material:
        inside, table = scan_and_summed_volume((vertices - start) / side, faces, shape)
    else:
        table = summed_volume((vertices - start) / side, faces, shape)
    first = np.maximum(np.floor((low - start) / side + TIE), 0).astype(np.int64)
    return FineScan(
        table,
        inside,
        np.ascontiguousarray(table[first[0] :, first[1] :, first[2] :]),
        first,
        item.rotation,
        start,
        side,
    )


def grid_shape(extent: NDArray[np.float64], side: float) -> tuple[int, int, int]:
    """Subvoxels that cover an extent.

    Parameters
    ----------
    extent : (3,) float64 array
        Along x, y and z, any unit.
    side : float
        Side of a subvoxel in that unit.
    """
    x, y, z = np.maximum(np.ceil(extent / side - TIE), 1).astype(int).tolist()
    return (x, y, z)
