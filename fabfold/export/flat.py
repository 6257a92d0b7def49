"""The state in which a kit lies flat, for templates that fold once more."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fabfold.fold.motion import Motion
from fabfold.joinery.bodies import Joinery
from fabfold.lattice.template import Template
from fabfold.tree.fold_tree import FoldTree

__all__ = ["flat_poses"]


def flat_poses(
    joinery: Joinery, tree: FoldTree, motion: Motion, template: Template
) -> NDArray[np.float64] | None:
    """Poses of the bodies where they fill the template, before it folds on its creases.

    Parameters
    ----------
    joinery : Joinery
        The printed bodies; it tells the voxel's side and the origin.
    tree : FoldTree
        The tree whose path ends in the folded shape.
    motion : Motion
        The folding path.
    template : Template
        The template as it lies flat.

    Returns
    -------
    (b, 4, 4) float64 array or None
        Rigid transform of each body from shape A in mm, the thinnest side of the template up; None
        where the template has no creases, or the path no such state.
    """
    if not template.creases:
        return None
    wanted = sorted(side - 1 for side in template.shape)
    owner = tree.voxel_body
    for angles in motion.angles_deg[::-1]:
        poses = tree.body_poses(angles)
        at = np.einsum("nij,nj->ni", poses[owner, :3, :3], tree.source.astype(float))
        extent = np.ptp(at + poses[owner, :3, 3], axis=0)
        if np.allclose(sorted(extent), wanted, atol=1e-6):
            break
    else:
        return None
    order = np.argsort(-np.rint(extent), kind="stable")
    upright = np.eye(4)
    upright[:3, :3] = np.eye(3)[order]
    upright[1, :3] *= np.linalg.det(upright[:3, :3])
    to_mm = np.eye(4)
    to_mm[:3, :3] *= joinery.voxel_mm
    to_mm[:3, 3] = joinery.origin_mm
    return np.asarray(upright @ to_mm @ poses @ np.linalg.inv(to_mm))
