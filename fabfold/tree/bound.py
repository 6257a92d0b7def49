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

from fabfold.lattice.rotations import FACES, ROTATION_PRODUCT, ROTATIONS
from fabfold.lattice.template import Template
from fabfold.tree.catalogue import JointSet, joint_types
from fabfold.tree.fold_tree import FoldTree
from fabfold.tree.phases import phase_labels, phase_of, phase_rotations
from fabfold.tree.problem import TreeProblem
from fabfold.tree.tables import depth_by_pose

__all__ = [
    "ClosingBound",
    "PhaseBound",
    "closed_at_most",
    "closed_share",
    "least_surface",
    "phase_bounds",
    "visible_faces",
]

#: Price of a cell that a voxel cannot take: more than any energy.
_NEVER = 1e6


def _shown_faces(template: Template) -> NDArray[np.bool_]:
    """Which faces of its cells the filled shape shows, (m, 6)."""
    cells = {tuple(cell) for cell in template.cells.tolist()}
    beside = (template.cells[:, None] + FACES).reshape(-1, 3).tolist()
    return np.array([tuple(cell) not in cells for cell in beside]).reshape(-1, 6)


def visible_faces(template: Template) -> int:
    """Number of faces of a template's cells that the filled shape shows."""
    return int(_shown_faces(template).sum())


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


class ClosingBound:
    """How far voxels could close a box, from their cells and ray depths alone.

    The same bound as :func:`closed_at_most`, but for voxels that are not cut yet. Many are asked
    about, so phases that a turn of the template makes of one another are looked at once.

    Parameters
    ----------
    template : Template
        The target shape.
    joints : str
        Joint types in use, see :data:`fabfold.tree.catalogue.JOINT_SETS`.
    """

    def __init__(self, template: Template, joints: JointSet) -> None:
        self._cells = template.cells
        self._shown = _shown_faces(template).astype(np.int64)
        self._labels = phase_labels(joint_types(joints))
        self._phases = _unlike_phases(self._labels, template)

    def open_faces(self, source: NDArray[np.int32], depth: NDArray[np.float64]) -> float:
        """Least sum of mean depths behind the visible faces of the box.

        Parameters
        ----------
        source : (n, 3) int32 array
            Cells of the voxels in shape A, at most as many as the template has.
        depth : (n, 6) float64 array
            Mean depth to the first material from each of their faces, 0 to 1.

        Returns
        -------
        float
            0 where every face is closed, 1 more for each that is wholly open; infinite where no
            phase has room for the colours of the voxels.
        """
        cost = depth_by_pose(depth, self._shown)
        empty = self._shown.sum(axis=1).astype(np.float64)
        phases = phase_rotations(self._labels, source, self._cells, self._phases)
        bounds = (_assigned(cost, empty, turns) for turns in phases)
        return min((bound.energy for bound in bounds if bound is not None), default=np.inf)


def _unlike_phases(labels: NDArray[np.int32], template: Template) -> list[int]:
    """Phases none of which a turn of the template onto itself makes of another."""
    cells = template.cells
    own = {tuple(cell) for cell in cells.tolist()}
    turned_into: dict[int, set[int]] = {}
    for turn in range(24):
        turned = cells @ ROTATIONS[turn].T
        shift = -turned.min(axis=0)
        if {tuple(cell) for cell in (turned + shift).tolist()} != own:
            continue
        # Any state of a phase tells what becomes of it; the template's corner may be any cell.
        for phase in range(int(labels.max()) + 1):
            source, cell, rotation = np.argwhere(labels == phase)[0]
            place = np.array(np.unravel_index(cell, (2, 2, 2)))
            image = phase_of(
                labels,
                np.array(np.unravel_index(source, (2, 2, 2)), dtype=np.int32),
                (ROTATIONS[turn] @ place + shift).astype(np.int32),
                int(ROTATION_PRODUCT[turn, rotation]),
            )
            turned_into.setdefault(phase, set()).add(image)
    return [phase for phase, images in turned_into.items() if phase == min(images)]
