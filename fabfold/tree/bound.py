"""How closed the box can be: a bound on the surface energy, whatever the joints.

Equation 8 of the paper adds up the mean depth behind each visible face of the box. Divided by the
number of those faces, and taken from 1, it is the share to which the box is *closed*. What it could
be at most is an assignment problem: each voxel in the cell that suits it best, no two in one cell,
whether or not joints can bring them there. The phase of the tree (:mod:`fabfold.tree.phases`) says
how a voxel lies in each cell, so there is one such problem for each phase.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fabfold.lattice.rotations import FACES
from fabfold.lattice.template import Template
from fabfold.tree.fold_tree import FoldTree
from fabfold.tree.phases import phase_labels, phase_rotations
from fabfold.tree.problem import TreeProblem

__all__ = [
    "PhaseBound",
    "closed_at_most",
    "closed_share",
    "least_surface",
    "phase_bounds",
    "visible_faces",
]

#: Price of a cell that a voxel cannot take: more than any energy.
_NEVER = 1e6


def visible_faces(template: Template) -> int:
    """Number of faces of a template's cells that the filled shape shows."""
    cells = {tuple(cell) for cell in template.cells.tolist()}
    beside = (template.cells[:, None] + FACES).reshape(-1, 3)
    return sum(tuple(cell) not in cells for cell in beside.tolist())


def closed_share(tree: FoldTree) -> float:
    """Share to which the box of a tree is closed, 1 less the mean depth behind a visible face."""
    return 1.0 - tree.energy["surface"] / visible_faces(tree.template)


@dataclass(frozen=True)
class PhaseBound:
    """What could be had at most in one phase.

    Attributes
    ----------
    energy : float
        Weighted energy of the surface that no set of poses of the phase can be below.
    pose : (n,) int32 array
        The poses that have it, ``24 * template cell + rotation``; no joints need join them.
    turns : (n, m, k) int8 array
        Rotations of each voxel in each cell, see :func:`fabfold.tree.phases.phase_rotations`.
    """

    energy: float
    pose: NDArray[np.int32]
    turns: NDArray[np.int8]


def phase_bounds(problem: TreeProblem, *, with_wishes: bool = False) -> list[PhaseBound]:
    """Bounds of all phases into which the voxels fit, the best first.

    Parameters
    ----------
    problem : TreeProblem
        Voxels, joints and template; no two voxels share a cell.
    with_wishes : bool
        Count what was added to the surface's energy too.

    Returns
    -------
    list of PhaseBound
        Those that a turn of the template makes of one another have the same bound.
    """
    cost = problem.tables.cost.astype(np.float64)
    if problem.extra_cost is not None and not with_wishes:
        cost = cost - problem.extra_cost
    cost = cost.reshape(len(problem), len(problem.template), 24)
    exposed = (problem.tables.exposed[:, None] >> np.arange(6)) & 1
    empty = problem.empty_face * exposed.sum(axis=1).astype(np.float64)
    labels = phase_labels(problem.joints)
    phases = phase_rotations(labels, problem.source, problem.template.cells)
    bounds = (_assigned(cost, empty, turns) for turns in phases)
    return sorted((bound for bound in bounds if bound is not None), key=lambda bound: bound.energy)


def _assigned(
    cost: NDArray[np.float64], empty: NDArray[np.float64], turns: NDArray[np.int8]
) -> PhaseBound | None:
    """The best assignment of voxels to cells in one phase; None where there is none."""
    from scipy.optimize import linear_sum_assignment

    count, cells = turns.shape[:2]
    by_turn = np.take_along_axis(cost, np.maximum(turns, 0).astype(np.int64), axis=2)
    by_turn[turns < 0] = _NEVER
    best = by_turn.argmin(axis=2)
    # Rows after the voxels stand for nobody: an empty cell.
    matrix = np.repeat(empty[None], cells, axis=0)
    matrix[:count] = by_turn.min(axis=2)
    rows, columns = linear_sum_assignment(matrix)
    energy = float(matrix[rows, columns].sum())
    if energy >= _NEVER:
        return None
    voxel, cell = np.arange(count), columns[:count]
    pose = 24 * cell + turns[voxel, cell, best[voxel, cell]]
    return PhaseBound(energy, pose.astype(np.int32), turns)


def least_surface(problem: TreeProblem) -> float:
    """Bound on the weighted surface energy of every set of poses.

    Parameters
    ----------
    problem : TreeProblem
        Voxels, joints and template; no two voxels share a cell.

    Returns
    -------
    float
        Weighted energy that no tree of the problem can be below; infinite where no phase has room
        for the voxels. Which joints can be made and whether anything folds does not count.
    """
    bounds = phase_bounds(problem)
    return bounds[0].energy if bounds else float("inf")


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
    return max(0.0, 1.0 - least_surface(problem) / problem.weights.surface / faces)
