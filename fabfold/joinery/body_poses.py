"""Where the printed bodies are in a pose."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fabfold.joinery.bodies import Joinery
from fabfold.tree.fold_tree import FoldTree

__all__ = ["poses_in_mm"]


def poses_in_mm(
    tree: FoldTree, joinery: Joinery, angles_deg: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Rigid transform of every body in a pose.

    Parameters
    ----------
    tree : FoldTree
        The bodies and their hinges.
    joinery : Joinery
        It tells the voxel's side and the origin.
    angles_deg : (h,) float64 array
        Angles of all hinges in degrees.

    Returns
    -------
    (b, 4, 4) float64 array
        From shape A, mm.
    """
    poses = np.asarray(tree.body_poses(angles_deg), dtype=float).copy()
    origin = np.asarray(joinery.origin_mm)
    turned = np.einsum("bij,j->bi", poses[:, :3, :3], origin)
    poses[:, :3, 3] = joinery.voxel_mm * poses[:, :3, 3] + origin - turned
    return poses
