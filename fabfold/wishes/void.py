"""Wishes of ``--void``: where the empty space of the box goes.

A template has more cells than the model has voxels, and voxels are partly filled. The wish puts a
price on empty space at the surface of the box or inside it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fabfold.lattice.template import Template
from fabfold.tree.fold_tree import FoldTree
from fabfold.voxels.voxel_model import Voxels

__all__ = ["add_void_cost", "void_report"]


def add_void_cost(
    cost: NDArray[np.float64], void: float, weight: float, voxels: Voxels, template: Template
) -> None:
    """Add what empty space costs, counted from a full template.

    Parameters
    ----------
    cost : (n, m, 24) float64 array
        Weighted energy of each voxel in each template cell and rotation; changed in place.
    void : float
        From -1, empty space at the surface, to 1, empty space inside.
    weight : float
        Energy of an empty cell in the wrong place at full `void`.
    voxels : Voxels
        The voxelization.
    template : Template
        The shape to fill.
    """
    visible = template.outer_faces().any(axis=1)
    price = weight * np.where(visible, max(void, 0.0), max(-void, 0.0))
    # Material in a dear cell is worth what its emptiness would cost.
    cost -= (voxels.fill[:, None] * price[None, :])[:, :, None]


def void_report(tree: FoldTree) -> dict[str, Any]:
    """Where the empty space of a tree is.

    Parameters
    ----------
    tree : FoldTree
        A tree of any search.

    Returns
    -------
    dict
        Empty space inside the box and at its surface, in cells, and a line of text (JSON-ready).
    """
    visible = {
        tuple(cell)
        for cell, outer in zip(
            tree.template.cells.tolist(),
            np.any(tree.template.outer_faces(), axis=1).tolist(),
            strict=True,
        )
        if outer
    }
    full: dict[tuple[int, ...], float] = {}
    for cell, share in zip(tree.target.tolist(), tree.fill.tolist(), strict=True):
        full[tuple(cell)] = full.get(tuple(cell), 0.0) + share
    empty = [0.0, 0.0]
    for cell in tree.template.cells.tolist():
        empty[tuple(cell) in visible] += 1.0 - full.get(tuple(cell), 0.0)
    return {
        "wish": "void",
        "inside": round(empty[0], 3),
        "surface": round(empty[1], 3),
        "text": f"empty space: {empty[0]:.2f} cells inside the box, {empty[1]:.2f} at its surface",
    }
