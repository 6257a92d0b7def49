"""Which template cells are free for a voxel while poses are chosen.

A cell holds one voxel, or two that keep to different octants of it (:mod:`fabfold.tree.sharing`).
The functions are kernels: beam, removals and energy call them in their innermost loops. A pose is
``24 * template cell + rotation``, -1 for a voxel that has none yet. Octants are bits of a mask.
"""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.tree.rng import random_float
from fabfold.tree.tables import Tables

__all__ = [
    "close_taken_cells",
    "conflicts",
    "counted_twice",
    "counted_twice_in_cell",
    "list_occupants",
    "mark_sharing_voxels",
    "occupy",
    "random_occupant",
]


@njit(cache=True)
def conflicts(taken: int, octant_mask: NDArray[np.uint8], v: int, q: int) -> bool:
    """Whether voxel `v` at pose `q` needs an octant of its cell that is taken.

    Parameters
    ----------
    taken : int
        Mask of the octants taken in the cell of `q`.
    octant_mask : (n, 24) uint8 array
        Octants that each voxel needs in each rotation, see ``Tables.octant_mask``.
    v, q : int
        Number of the voxel, and its pose.

    Returns
    -------
    bool
        True where the voxel cannot go there.
    """
    return taken == 255 or (taken != 0 and (taken & octant_mask[v, q % 24]) != 0)


@njit(cache=True)
def occupy(taken: NDArray[np.uint8], octant_mask: NDArray[np.uint8], v: int, q: int) -> int:
    """Take the octants of voxel `v` at pose `q`; two voxels take all of a cell.

    Parameters
    ----------
    taken : (m,) uint8 array
        Mask of the octants taken in each template cell; changed in place.
    octant_mask : (n, 24) uint8 array
        Octants that each voxel needs in each rotation, see ``Tables.octant_mask``.
    v, q : int
        Number of the voxel, and its pose.

    Returns
    -------
    int
        1 where the cell holds two voxels now, else 0.
    """
    if taken[q // 24] != 0:
        taken[q // 24] = 255
        return 1
    taken[q // 24] = octant_mask[v, q % 24]
    return 0


@njit(cache=True)
def close_taken_cells(taken: NDArray[np.uint8]) -> None:
    """Let no second voxel into any cell that holds one.

    Parameters
    ----------
    taken : (m,) uint8 array
        Mask of the octants taken in each template cell; changed in place.
    """
    for cell in range(len(taken)):
        if taken[cell] != 0:
            taken[cell] = 255


@njit(cache=True)
def counted_twice(tables: Tables, v: int, q: int, w: int, p: int) -> float:
    """What counts twice when the costs of two voxels in one cell are added.

    Of each quarter of a visible face the nearer material is seen, by the mean depth: that is exact
    where only one of them has material behind the quarter, else a little more than the mean of the
    nearer depths.

    Parameters
    ----------
    tables : Tables
        Tables of the problem.
    v, q, w, p : int
        One voxel and its pose, and the other voxel and its pose.

    Returns
    -------
    float
        Weighted energy to be taken off the sum of the two costs.
    """
    total = 0.0
    for f in range(6):
        if (tables.exposed[q // 24] >> f) & 1 == 0:
            continue
        for k in range(4):
            total += max(
                np.float64(tables.quarter_depth[v, q % 24, f, k]),
                np.float64(tables.quarter_depth[w, p % 24, f, k]),
            )
    return total


@njit(cache=True)
def counted_twice_in_cell(tables: Tables, pose: NDArray[np.int32], v: int, q: int) -> float:
    """As :func:`counted_twice`, with the voxel that is in the cell of `q` already.

    Parameters
    ----------
    tables : Tables
        Tables of the problem.
    pose : (n,) int32 array
        Pose of each voxel, -1 for none.
    v, q : int
        The voxel that is added, and its pose.

    Returns
    -------
    float
        Weighted energy to be taken off; 0 where the cell is empty.
    """
    for w in range(len(pose)):
        if w != v and pose[w] >= 0 and pose[w] // 24 == q // 24:
            return counted_twice(tables, v, q, w, pose[w])
    return 0.0


@njit(cache=True)
def list_occupants(pose: NDArray[np.int32], out: NDArray[np.int32]) -> None:
    """List the voxels in each template cell.

    Parameters
    ----------
    pose : (n,) int32 array
        Pose of each voxel, -1 for none.
    out : (m, 2) int32 array
        Filled with up to two voxels a cell, -1 for none.
    """
    out[:] = -1
    for v in range(len(pose)):
        if pose[v] >= 0:
            cell = pose[v] // 24
            if out[cell, 0] < 0:
                out[cell, 0] = v
            else:
                out[cell, 1] = v


@njit(cache=True)
def random_occupant(occupants: NDArray[np.int32], cell: int, generator: NDArray[np.uint64]) -> int:
    """A voxel in a cell, one of the two where there are two.

    Parameters
    ----------
    occupants : (m, 2) int32 array
        From :func:`list_occupants`.
    cell : int
        Number of the template cell.
    generator : (1,) uint64 array
        Random state; advanced where the cell holds two voxels.

    Returns
    -------
    int
        Number of the voxel, -1 for an empty cell.
    """
    if occupants[cell, 1] >= 0 and random_float(generator) < 0.5:
        return occupants[cell, 1]
    return occupants[cell, 0]


@njit(cache=True)
def mark_sharing_voxels(
    tables: Tables, pose: NDArray[np.int32], shares_cell: NDArray[np.bool_]
) -> None:
    """Mark the voxels that share their cell with another one.

    Parameters
    ----------
    tables : Tables
        Tables of the problem.
    pose : (n,) int32 array
        Full set of poses.
    shares_cell : (n,) bool array
        All False at first; set True for voxels that share.
    """
    first = np.full(len(tables.cells), -1, np.int32)
    for v in range(len(pose)):
        other = first[pose[v] // 24]
        if other >= 0:
            shares_cell[v] = True
            shares_cell[other] = True
        first[pose[v] // 24] = v
