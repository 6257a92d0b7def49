"""The tables that the compiled kernels of the tree search read, and how they are filled."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fabfold.lattice.rotations import FACE_BEFORE, FACES, ROTATION_PRODUCT, ROTATIONS
from fabfold.lattice.template import Template
from fabfold.tree.catalogue import Joint, realizations

__all__ = ["Tables", "cost_table", "depth_by_pose", "joint_table", "realization_table"]


class Tables(NamedTuple):
    """What the kernels read. ``n`` voxels, ``m`` template cells, ``J`` joint types.

    A pose is ``24 * cell + rotation`` with ``cell`` an index into the template's cells.

    Attributes
    ----------
    neighbour : (n, 6) int32 array
        Voxel across each face, -1 where there is none or no joint is possible.
    allowed : (n, 6, J) bool array
        Whether a joint type can be made there.
    child_pose : (6, 24 m, J) int32 array
        Pose of the child from the face, the joint and the parent's pose; -1 outside the template.
    joint_weight : (J,) float64 array
        Energy of each joint type.
    last_single : int
        Joint types 1 to ``last_single`` are single hinges, those after them double ones.
    realization_start : (6, J + 1) int32 array
        Joint j of face f is made by the rows ``realization_start[f, j]`` to
        ``realization_start[f, j + 1] - 1`` of `realization`.
    realization : (w, 4) int32 array
        Side and quarter turns of both axes, see :func:`fabfold.tree.catalogue.realizations`.
    cost : (n, 24 m) float32 array
        Weighted energy of each voxel at each pose: Eq. 8 of the faces that the box shows, and
        `extra_cost` of :func:`tree_problem`.
    expected_cost : (n, m) float32 array
        Expected `cost` of each voxel in each cell. The beam subtracts it, so that states which
        fill different cells compare.
    always_rigid : (n, 6) bool array
        Pairs of voxels across a face that no cut may part. No rows where there is no such pair.
    final_edge : (a, b, c) int32 array
        Lattice edges of the template, indexed by twice their middle plus 1: the number of the edge
        on which a hinge there lies in the end, -1 where none may lie. The two differ where the
        template folds once more. Of no size where every edge may be used and is final.
    exposed : (m,) uint8 array
        Bit ``f`` is set where the template ends at face ``f`` of a cell.
    cell_neighbour : (m, 6) int32 array
        Template cell across each face, -1 outside.
    source : (n, 3) int32 array
        Cell of each voxel in shape A.
    cells : (m, 3) int32 array
        Cells of the template.
    rotations : (24, 3, 3) int32 array
        The lattice rotations, :data:`fabfold.lattice.rotations.ROTATIONS`.
    octant_mask : (n, 24) uint8 array
        Octants of its cell that a voxel must have in each rotation, see
        :mod:`fabfold.tree.sharing`; all 255 where no voxel may share.
    max_shared : int
        Most cells that may hold two voxels; 0 where none may.
    quarter_depth : (n, 24, 6, 4) float32 array
        Weighted ray depth of each quarter of each face, in each rotation; no rows where no voxel
        may share.
    edge_octants : (6, 6) uint8 array
        Mask of the octants beside the edge of two faces of a cell.
    """

    neighbour: NDArray[np.int32]
    allowed: NDArray[np.bool_]
    child_pose: NDArray[np.int32]
    joint_weight: NDArray[np.float64]
    last_single: int
    realization_start: NDArray[np.int32]
    realization: NDArray[np.int32]
    cost: NDArray[np.float32]
    expected_cost: NDArray[np.float32]
    always_rigid: NDArray[np.bool_]
    final_edge: NDArray[np.int32]
    exposed: NDArray[np.uint8]
    cell_neighbour: NDArray[np.int32]
    source: NDArray[np.int32]
    cells: NDArray[np.int32]
    rotations: NDArray[np.int32]
    octant_mask: NDArray[np.uint8]
    max_shared: int
    quarter_depth: NDArray[np.float32]
    edge_octants: NDArray[np.uint8]


def joint_table(
    template: Template, joints: Sequence[Sequence[Joint]]
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.uint8]]:
    """Where joints carry a child, for every pose of the parent.

    Parameters
    ----------
    template : Template
        The shape to fill.
    joints : sequence of sequences of Joint
        Joint types by index, one for each face of the parent.

    Returns
    -------
    child_pose : (6, 24 m, J) int32 array
        Pose of the child from the face, the joint and the parent's pose; -1 outside the template.
    cell_neighbour : (m, 6) int32 array
        Template cell across each face, -1 outside.
    exposed : (m,) uint8 array
        Bit ``f`` is set where the template ends at face ``f`` of a cell.
    """
    cells = template.cells
    pad = 2
    grid = np.full(np.array(template.shape) + 2 * pad, -1, dtype=np.int32)
    grid[tuple((cells + pad).T)] = np.arange(len(cells), dtype=np.int32)
    child_pose = np.full((6, 24 * len(cells), len(joints)), -1, dtype=np.int32)
    parents = 24 * np.arange(len(cells), dtype=np.int32)
    for index, by_face in enumerate(joints):
        for face, joint in enumerate(by_face):
            for rotation in range(24):
                moved = cells + ROTATIONS[rotation] @ np.array(joint.offset, dtype=np.int32) + pad
                landing = grid[tuple(moved.T)]
                turned = ROTATION_PRODUCT[rotation, joint.rotation]
                child_pose[face, parents + rotation, index] = np.where(
                    landing >= 0, 24 * landing + turned, -1
                )
    cell_neighbour = np.stack([grid[tuple((cells + d + pad).T)] for d in FACES], axis=1)
    exposed = ((cell_neighbour < 0) << np.arange(6)).sum(axis=1).astype(np.uint8)
    return child_pose, np.ascontiguousarray(cell_neighbour), exposed


def realization_table(
    joints: Sequence[Sequence[Joint]],
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """The single and double hinges that realize each joint type at each face.

    Parameters
    ----------
    joints : sequence of sequences of Joint
        Joint types by index, one for each face of the parent.

    Returns
    -------
    start : (6, J + 1) int32 array
        Where the rows of each joint type begin, by face.
    rows : (k, 4) int32 array
        One row a realization, see :func:`fabfold.tree.catalogue.realizations`.
    """
    found: list[tuple[int, int, int, int]] = []
    start = np.zeros((6, len(joints) + 1), dtype=np.int32)
    for face in range(6):
        for index, by_face in enumerate(joints):
            start[face, index] = len(found)
            found += realizations(by_face[face])
        start[face, len(joints)] = len(found)
    return start, np.array(found, dtype=np.int32).reshape(-1, 4)


def depth_by_pose(depth: NDArray[np.float64], shown: NDArray[np.integer]) -> NDArray[np.float64]:
    """Sum of the ray depths behind the faces that the box shows, of each voxel at each pose.

    Parameters
    ----------
    depth : (n, 6) float64 array
        Mean ray depth into each voxel from each of its faces in A, 0 to 1 (Eq. 8).
    shown : (m, 6) int array
        1 where the filled shape shows a face of a cell, 0 elsewhere.

    Returns
    -------
    (n, m, 24) float64 array
        By voxel, cell and rotation.
    """
    # Face f of the cell in B is face FACE_BEFORE[r, f] of the voxel in A.
    by_face = np.asarray(depth, dtype=float)[:, FACE_BEFORE]
    return np.asarray(np.einsum("nrf,mf->nmr", by_face, shown))


def cost_table(
    depth: NDArray[np.float64],
    exposed: NDArray[np.uint8],
    surface_weight: float,
    extra_cost: NDArray[np.floating] | None,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Energy of each voxel at each pose.

    Parameters
    ----------
    depth : (n, 6) float64 array
        Mean ray depth into each voxel from each of its faces in A, 0 to 1 (Eq. 8).
    exposed : (m,) uint8 array
        Faces of each template cell that the box shows, see :class:`Tables`.
    surface_weight : float
        Weight of the surface's energy.
    extra_cost : (n, 24 m) float array or None
        Energy added for a voxel at a pose.

    Returns
    -------
    cost : (n, 24 m) float32 array
        As in :class:`Tables`.
    expected_cost : (n, m) float32 array
        As in :class:`Tables`.
    """
    bits = (exposed[:, None] >> np.arange(6)) & 1
    cost = surface_weight * depth_by_pose(depth, bits)
    if extra_cost is not None:
        cost += np.asarray(extra_cost, dtype=float).reshape(cost.shape)
    by_cell = cost.mean(axis=2)
    cell_mean = by_cell.mean(axis=0)
    voxel_mean = (by_cell - cell_mean).mean(axis=1)
    expected_cost = cell_mean[None, :] + voxel_mean[:, None]
    return (
        np.ascontiguousarray(cost.reshape(len(cost), -1), dtype=np.float32),
        np.ascontiguousarray(expected_cost, dtype=np.float32),
    )
