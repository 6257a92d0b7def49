"""Regions of a model on the grid: into how many cells they are cut, which voxel holds a point."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fabfold.solid.regions import MIN_PIECE_SHARE, Points, Region
from fabfold.voxels.cut import Placement
from fabfold.voxels.voxel_model import Voxels

__all__ = ["containing_voxels", "region_cut_cost", "to_lattice"]

#: Price of each cell after the first that a region falls into, in full cells: that of a sliver.
_CUT_COST = 0.5


def region_cut_cost(regions: Sequence[Region], placement: Placement) -> float:
    """Price of cutting regions into cells.

    Parameters
    ----------
    regions : sequence of Region
        Parts of the model that shall lie in few cells.
    placement : Placement
        The grid, its planes moved.

    Returns
    -------
    float
        In full cells: 0.5 for each cell after the first that a piece of a region falls into.
    """
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
            cuts += int((sizes >= MIN_PIECE_SHARE * len(some)).sum()) - 1
    return _CUT_COST * cuts


def to_lattice(voxels: Voxels, points: Points) -> Points:
    """Warp points of the model into the lattice of shape A.

    Parameters
    ----------
    voxels : Voxels
        Their rotation, origin, pitch and plane offsets make the warp.
    points : (k, 3) float64 array
        Model axes and units.

    Returns
    -------
    (k, 3) float64 array
        Lattice units of shape A.
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


def containing_voxels(voxels: Voxels, points: Points) -> NDArray[np.int32]:
    """Find the voxel that holds each of some points of the model.

    Parameters
    ----------
    voxels : Voxels
        The cells to look in.
    points : (k, 3) float64 array
        Model axes and units.

    Returns
    -------
    (k,) int32 array
        Index of the voxel; -1 where no voxel holds the point.
    """
    cell = np.floor(to_lattice(voxels, points) + 0.5).astype(np.int64)
    size = voxels.cells.max(axis=0) + 1
    index = np.full(size, -1, dtype=np.int32)
    index[tuple(voxels.cells.T)] = np.arange(len(voxels), dtype=np.int32)
    inside = ((cell >= 0) & (cell < size)).all(axis=1)
    out = np.full(len(cell), -1, dtype=np.int32)
    out[inside] = index[tuple(cell[inside].T)]
    return out
