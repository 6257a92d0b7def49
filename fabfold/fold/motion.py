"""A lattice path as keyframes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fabfold.fold.model import Motion
from fabfold.tree.model import FoldTree

__all__ = ["motion_of"]


def motion_of(tree: FoldTree, path: NDArray[np.integer]) -> Motion:
    """Keyframes of a path: shape A, then one after each move.

    Parameters
    ----------
    tree : FoldTree
    path : (m, 2) integer array
        Hinge and signed quarter turns about the positive axis, as
        :meth:`fabfold.fold.foldability.LatticeFoldability.path` gives it.

    Returns
    -------
    Motion
        Without a certificate.

    Raises
    ------
    ValueError
        If the path does not end in shape B.
    """
    moves = np.asarray(path, dtype=int).reshape(-1, 2)
    sign = np.array([sum(hinge.direction) for hinge in tree.hinges], dtype=int)
    angles = np.zeros((len(moves) + 1, len(tree.hinges)))
    for row, (hinge, quarter) in enumerate(moves.tolist(), start=1):
        angles[row] = angles[row - 1]
        angles[row, hinge] += 90.0 * quarter * sign[hinge]
    short = np.flatnonzero(np.abs(angles[-1] - tree.fold_angles) > 1e-9)
    if len(short):
        hinge = int(short[0])
        raise ValueError(
            f"the path leaves {tree.hinges[hinge].name} at {angles[-1, hinge]:g}°, "
            f"shape B wants {tree.fold_angles[hinge]:g}°"
        )
    return Motion(
        hinges=tuple(hinge.name for hinge in tree.hinges),
        angles_deg=angles,
        moves=((), *((int(hinge),) for hinge in moves[:, 0])),
    )
