"""A joint tree as plain integer arrays: what the folding kernels work on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fabfold.tree.fold_tree import FoldTree
from fabfold.tree.sharing import unpacked

__all__ = ["HingeSystem", "hinge_system"]


class HingeSystem(NamedTuple):
    """Rigid bodies of unit cubes on lattice-edge hinges, in shape A.

    Body 0 is the root, hinge ``h`` carries body ``h + 1``, and ``parent[h] <= h``: parents come
    before children.

    Attributes
    ----------
    cells : (n, 3) int32 array
        Source cell of each voxel.
    body : (n,) int32 array
        Body of each voxel, 0 to h.
    parent : (h,) int32 array
        Body that hinge ``h`` turns against.
    point2 : (h, 3) int32 array
        Twice the lattice coordinates of the middle of the hinge's lattice edge.
    axis : (h,) int8 array
        0, 1 or 2: the axis runs along +x, +y or +z.
    turns : (h,) int8 array
        Signed quarter turns about the positive axis from A to B.
    octants : (n, 2, 2, 2) bool array or None
        Where voxels share cells of B: which octants of each cell, in shape A, count as taken. None
        where every voxel has a cell of its own; then whole cells count.
    """

    cells: NDArray[np.int32]
    body: NDArray[np.int32]
    parent: NDArray[np.int32]
    point2: NDArray[np.int32]
    axis: NDArray[np.int8]
    turns: NDArray[np.int8]
    octants: NDArray[np.bool_] | None = None


def hinge_system(tree: FoldTree) -> HingeSystem:
    """Arrays of a finished tree.

    Parameters
    ----------
    tree : FoldTree
        Its hinges run along +x, +y or +z.

    Returns
    -------
    HingeSystem
        The same bodies and hinges.
    """
    directions = np.array([h.direction for h in tree.hinges], dtype=np.int32).reshape(-1, 3)
    axis = np.abs(directions).argmax(axis=1).astype(np.int8)
    sign = directions.sum(axis=1)
    quarter = np.rint(tree.fold_angles / 90.0).astype(np.int32)
    points = np.array([h.point for h in tree.hinges], dtype=float).reshape(-1, 3)
    return HingeSystem(
        cells=tree.source.astype(np.int32),
        body=tree.voxel_body,
        parent=np.array([h.parent for h in tree.hinges], dtype=np.int32),
        point2=np.rint(2 * points).astype(np.int32),
        axis=axis,
        turns=(quarter * sign).astype(np.int8),
        octants=None if tree.octants is None else unpacked(tree.octants),
    )
