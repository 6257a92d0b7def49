"""How closed the box can be: a bound on the surface energy, whatever the joints.

Equation 8 of the paper adds up the mean depth behind each visible face of the box. Divided by the
number of those faces, and taken from 1, it is the share to which the box is closed. What it could
be at most is an assignment problem: each voxel in the cell and the rotation that suit it best, no
two in one cell, whether or not joints can bring them there.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fabfold.lattice.rotations import FACES, ROTATIONS, parity
from fabfold.lattice.template import Template
from fabfold.tree.fold_tree import FoldTree
from fabfold.tree.problem import TreeProblem

__all__ = ["closed_at_most", "closed_share", "least_surface", "visible_faces"]


def visible_faces(template: Template) -> int:
    """Number of faces of a template's cells that the filled shape shows."""
    cells = {tuple(cell) for cell in template.cells.tolist()}
    beside = (template.cells[:, None] + FACES).reshape(-1, 3)
    return sum(tuple(cell) not in cells for cell in beside.tolist())


def closed_share(tree: FoldTree) -> float:
    """Share to which the box of a tree is closed, 1 less the mean depth behind a visible face."""
    return 1.0 - tree.energy["surface"] / visible_faces(tree.template)


def least_surface(problem: TreeProblem) -> float:
    """Bound on the weighted surface energy of every set of poses.

    Parameters
    ----------
    problem : TreeProblem
        Voxels, joints and template; no two voxels share a cell.

    Returns
    -------
    float
        Weighted energy that no tree of the problem can be below. Checkerboard colours, which the
        joints may keep, and the rotations that they can make count; which joints can be made and
        whether anything folds does not.
    """
    from scipy.optimize import linear_sum_assignment

    count, cells = len(problem), len(problem.template)
    cost = problem.tables.cost.astype(np.float64)
    if problem.extra_cost is not None:
        cost = cost - problem.extra_cost
    by_rotation = cost.reshape(count, cells, 24)
    exposed = (problem.tables.exposed[:, None] >> np.arange(6)) & 1
    empty = problem.empty_face * exposed.sum(axis=1)
    source, target = parity(problem.source), parity(problem.template.cells)
    groups = _reachable_rotations() if problem.keeps_colour else [np.arange(24)]
    best = np.inf
    for rotations in groups:
        least = by_rotation[:, :, rotations].min(axis=2)
        for colouring in problem.colourings():
            # An odd voxel goes into an even cell at the price of all; so never where it may not.
            matrix = np.repeat(empty[None], cells, axis=0)
            matrix[:count] = least
            if problem.keeps_colour:
                wrong = (source[:, None] + colouring) % 2 != target[None, :]
                matrix[:count][wrong] = 1e6
            rows, columns = linear_sum_assignment(matrix)
            best = min(best, float(matrix[rows, columns].sum()))
    return best


def _reachable_rotations() -> list[NDArray[np.int64]]:
    """Rotations by what half turns about the axes make of one another: six groups of four."""
    kind = [tuple(np.abs(matrix).argmax(axis=1).tolist()) for matrix in ROTATIONS]
    return [np.array([r for r in range(24) if kind[r] == k]) for k in sorted(set(kind))]


def closed_at_most(problem: TreeProblem) -> float:
    """Share to which the box could be closed at most with these voxels.

    Parameters
    ----------
    problem : TreeProblem
        Voxels, joints and template.

    Returns
    -------
    float
        From 0 to 1; 1 where voxels may share cells or surface counts for nothing, since the bound
        does not hold there.
    """
    if problem.tables.max_shared or problem.weights.surface <= 0:
        return 1.0
    faces = visible_faces(problem.template)
    return 1.0 - least_surface(problem) / problem.weights.surface / faces
