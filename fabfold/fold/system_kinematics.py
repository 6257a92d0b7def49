"""Where the bodies of a hinge system are when its hinges are turned, as rigid transforms.

The kernels of the search have their own, in whole numbers (:mod:`fabfold.fold.scene`). These are
for what is done once a path.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fabfold.lattice.rotations import rotation_about
from fabfold.tree.system import HingeSystem

__all__ = ["carried_bodies", "poses_at"]


def carried_bodies(parents: NDArray[np.integer], hinge: int) -> NDArray[np.bool_]:
    """Which bodies a hinge carries.

    Parameters
    ----------
    parents : (h,) integer array
        Body that each hinge turns against; hinge ``h`` carries body ``h + 1``, parents come before
        children.
    hinge : int
        Index of the hinge.

    Returns
    -------
    (b,) bool array
        True for the hinge's own body and all that hang on it.
    """
    inside = np.zeros(len(parents) + 1, dtype=bool)
    inside[hinge + 1] = True
    for later in range(hinge + 1, len(parents)):
        inside[later + 1] |= inside[parents[later]]
    return inside


def poses_at(system: HingeSystem, quarters: NDArray[np.floating]) -> NDArray[np.float64]:
    """Pose of every body with the hinges turned.

    Parameters
    ----------
    system : HingeSystem
        Bodies on hinges, parents before children.
    quarters : (h,) float array
        Quarter turns that each hinge has made from A, about its positive axis.

    Returns
    -------
    (b, 4, 4) float64 array
        Rigid transform of each body from its place in A, lattice units; the root stays.
    """
    poses = np.tile(np.eye(4), (len(system.parent) + 1, 1, 1))
    middle = np.asarray(system.point2) / 2.0
    for hinge, parent in enumerate(system.parent):
        axis = np.eye(3)[system.axis[hinge]]
        poses[hinge + 1] = poses[parent] @ rotation_about(
            middle[hinge], axis, 90.0 * quarters[hinge]
        )
    return poses
