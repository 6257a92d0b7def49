"""What a set of poses is worth: rigid clusters, surplus pieces and weighted energy.

The functions are kernels. A pose is ``24 * template cell + rotation``, -1 for a voxel that has none
yet. Two voxels that share a face form a rigid cluster where a rigid joint carries one pose to the
other. The number of joints of any tree is then the number of clusters less one (paper, Eq. 9).
"""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.tree.cell_occupancy import counted_twice
from fabfold.tree.tables import Tables

__all__ = [
    "count_defects",
    "doubles_needed",
    "energy_of",
    "label_clusters",
    "label_pieces",
]


@njit(cache=True)
def label_pieces(
    tables: Tables, pose: NDArray[np.int32], last: int, label: NDArray[np.int32]
) -> int:
    """Label the connected pieces that the joint types 0 to `last` make of the placed voxels.

    Parameters
    ----------
    tables : Tables
        Tables of the problem.
    pose : (n,) int32 array
        Pose of each voxel, -1 for none.
    last : int
        Last joint type that joins; 0 for rigid joints alone.
    label : (n,) int32 array
        Filled with the piece of each voxel, -1 for a voxel without a pose.

    Returns
    -------
    int
        Number of pieces.
    """
    count = len(pose)
    stack = np.empty(count, np.int32)
    label[:] = -1
    found = 0
    for first in range(count):
        if pose[first] < 0 or label[first] >= 0:
            continue
        label[first] = found
        stack[0] = first
        top = 1
        while top > 0:
            top -= 1
            u = stack[top]
            for f in range(6):
                v = tables.neighbour[u, f]
                if v < 0 or pose[v] < 0 or label[v] >= 0:
                    continue
                for j in range(last + 1):
                    if tables.allowed[u, f, j] and tables.child_pose[f, pose[u], j] == pose[v]:
                        label[v] = found
                        stack[top] = v
                        top += 1
                        break
        found += 1
    return found


@njit(cache=True)
def label_clusters(tables: Tables, pose: NDArray[np.int32], label: NDArray[np.int32]) -> int:
    """Label the rigid clusters of the placed voxels.

    Parameters
    ----------
    tables : Tables
        Tables of the problem.
    pose : (n,) int32 array
        Pose of each voxel, -1 for none.
    label : (n,) int32 array
        Filled with the cluster of each voxel, -1 for a voxel without a pose.

    Returns
    -------
    int
        Number of clusters.
    """
    return label_pieces(tables, pose, 0, label)


@njit(cache=True)
def doubles_needed(tables: Tables, pose: NDArray[np.int32]) -> int:
    """Fewest double hinges that poses need.

    Parameters
    ----------
    tables : Tables
        Tables of the problem.
    pose : (n,) int32 array
        Full set of poses.

    Returns
    -------
    int
        The pieces, less one, that rigid joints and single hinges leave.
    """
    if tables.last_single + 1 >= tables.child_pose.shape[2]:
        return 0
    return max(0, label_pieces(tables, pose, tables.last_single, np.empty(len(pose), np.int32)) - 1)


@njit(cache=True)
def count_defects(tables: Tables, pose: NDArray[np.int32]) -> int:
    """Count what keeps poses from being a tree: unplaced voxels and surplus pieces.

    Parameters
    ----------
    tables : Tables
        Tables of the problem.
    pose : (n,) int32 array
        Pose of each voxel, -1 for none.

    Returns
    -------
    int
        Voxels without a pose, plus the pieces, less one, that the possible joints leave. Zero for
        a full set of poses that some tree joins.
    """
    joints = tables.child_pose.shape[2]
    defects = label_pieces(tables, pose, joints - 1, np.empty(len(pose), np.int32))
    for v in range(len(pose)):
        if pose[v] < 0:
            defects += 1
    return defects - 1


@njit(cache=True)
def energy_of(tables: Tables, pose: NDArray[np.int32], empty_face: float) -> tuple[float, int]:
    """Weighted energy of a full set of poses (paper section 6) and its number of rigid clusters.

    Clusters that single hinges alone would leave unjoined cost the weight of a double hinge. A
    visible face of a cell with two voxels counts by its nearer material, see
    :func:`fabfold.tree.cell_occupancy.counted_twice`.

    Parameters
    ----------
    tables : Tables
        Tables of the problem.
    pose : (n,) int32 array
        Full set of poses.
    empty_face : float
        Weighted energy of one boundary face of an empty template cell.

    Returns
    -------
    energy : float
        Weighted sum of surface, joints and whatever else ``Tables.cost`` holds.
    clusters : int
        Number of rigid clusters.
    """
    label = np.empty(len(pose), np.int32)
    found = label_clusters(tables, pose, label)
    taken = np.full(len(tables.cells), -1, np.int32)
    total = tables.joint_weight[1] * (found - 1)
    if tables.last_single + 1 < len(tables.joint_weight):
        more = tables.joint_weight[tables.last_single + 1] - tables.joint_weight[1]
        total += more * doubles_needed(tables, pose)
    for v in range(len(pose)):
        if pose[v] >= 0:
            total += np.float64(tables.cost[v, pose[v]])
            w = taken[pose[v] // 24]
            if w >= 0:
                total -= counted_twice(tables, v, pose[v], w, pose[w])
            taken[pose[v] // 24] = v
    for cell in range(len(taken)):
        if taken[cell] < 0:
            for f in range(6):
                if tables.cell_neighbour[cell, f] < 0:
                    total += empty_face
    return total, found
