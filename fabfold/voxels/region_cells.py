"""Regions of a model on the grid: the cells they fall into, the voxels that hold points."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fabfold.solid.regions import CRUMB, Points, Region
from fabfold.voxels.cut import Placement
from fabfold.voxels.voxel_model import Voxels

__all__ = ["owners", "spread", "to_lattice"]

#: Price of a cell more for a region, in full cells: that of a sliver.
_CUT_COST = 0.5


def spread(regions: Sequence[Region], placement: Placement) -> float:
    """Price of the cells into which a placement of the grid divides regions, 0.5 for each cut."""
    cuts = 0
    for region in regions:
        for points in region.pieces:
            some = points[:: max(1, len(points) // 2000)]
            at = (some @ placement.rotation.T - placement.origin) / placement.pitch
            cell = np.empty(at.shape, dtype=np.int64)
            for axis, offsets in enumerate(placement.offsets):
                planes = placement.first[axis] - 0.5 + np.arange(len(offsets)) + offsets
                cell[:, axis] = np.searchsorted(planes, at[:, axis])
            sizes = np.unique(cell, axis=0, return_counts=True)[1]
            cuts += int((sizes >= CRUMB * len(some)).sum()) - 1
    return _CUT_COST * cuts


def to_lattice(voxels: Voxels, points: Points) -> Points:
    """Where points of the model come to lie in the warped lattice of shape A.

    Parameters
    ----------
    voxels : Voxels
    points : (k, 3) float64 array
        Model units.
    """
    regular = (np.asarray(points) @ voxels.rotation.T - voxels.origin) / voxels.pitch
    out = np.empty_like(regular)
    for axis, offsets in enumerate(voxels.plane_offsets):
        target = np.arange(len(offsets)) - 0.5
        planes = target + offsets
        x = regular[:, axis]
        out[:, axis] = np.interp(x, planes, target)
        below, above = x < planes[0], x > planes[-1]
        out[below, axis] = target[0] + x[below] - planes[0]
        out[above, axis] = target[-1] + x[above] - planes[-1]
    return out


def owners(voxels: Voxels, points: Points) -> NDArray[np.int32]:
    """Voxel that holds each point of the model (k, 3); -1 where no voxel does."""
    cell = np.floor(to_lattice(voxels, points) + 0.5).astype(np.int64)
    size = voxels.cells.max(axis=0) + 1
    index = np.full(size, -1, dtype=np.int32)
    index[tuple(voxels.cells.T)] = np.arange(len(voxels), dtype=np.int32)
    inside = ((cell >= 0) & (cell < size)).all(axis=1)
    out = np.full(len(cell), -1, dtype=np.int32)
    out[inside] = index[tuple(cell[inside].T)]
    return out
