"""The wish of ``--joints-inside``: no hinge on the visible faces of the box.

The search keeps the wish by the template, which offers edges inside it only
(:meth:`fabfold.lattice.template.Template.inside_edges`). Here its result is counted.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fabfold.tree.fold_tree import FoldTree

__all__ = ["count_surface_hinges", "joints_inside_report"]


def count_surface_hinges(tree: FoldTree) -> int:
    """Hinges that the folded box shows: a cell around their edge is no cell of the template.

    Parameters
    ----------
    tree : FoldTree
        A tree of any search.

    Returns
    -------
    int
        Number of hinges.
    """
    cells = {tuple(cell) for cell in tree.template.cells.tolist()}
    root = np.eye(4)
    root[:3, :3], root[:3, 3] = tree.root_rotation, tree.root_translation
    poses = root @ tree.body_poses(tree.fold_angles)
    outside = 0
    for hinge in tree.hinges:
        pose = poses[hinge.parent]
        middle = pose[:3, :3] @ np.array(hinge.point) + pose[:3, 3]
        along = np.abs(pose[:3, :3] @ np.array(hinge.direction)).round().astype(bool)
        one, other = np.eye(3)[~along] / 2
        around = [middle + a * one + b * other for a in (1, -1) for b in (1, -1)]
        outside += any(tuple(np.rint(c).astype(int).tolist()) not in cells for c in around)
    return outside


def joints_inside_report(tree: FoldTree) -> dict[str, Any]:
    """How many hinges lie on the surface all the same.

    Parameters
    ----------
    tree : FoldTree
        A tree of any search.

    Returns
    -------
    dict
        The number and a line of text (JSON-ready).
    """
    outside = count_surface_hinges(tree)
    text = f"joints inside: {outside} of {len(tree.hinges)} hinges lie on the surface"
    return {"wish": "joints inside", "outside": outside, "text": text}
