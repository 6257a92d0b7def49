"""What the tree search holds while it runs: a state, the objective of phase A, and counts."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fabfold.lattice.rotations import rotation_index
from fabfold.tree.assembly import SpanningTree, axes_array
from fabfold.tree.fold_tree import FoldTree

__all__ = [
    "ANYWHERE",
    "FoldingObjective",
    "SearchState",
    "Statistics",
    "axes_of_tree",
    "folding_objective",
    "pose_of_tree",
    "steps_of_path",
]


@dataclass
class Statistics:
    """What one run did, in counts.

    Attributes
    ----------
    grown : int
        Full sets of poses grown.
    annealed : int
        Sets of poses annealed by swaps until hinges could join them.
    starts : int
        Those whose clusters hinges could join, so that phase A began.
    removals : int
        Large-neighbourhood steps.
    swaps : int
        Swaps drawn as steps.
    assignments : int
        Sets of leaves that took their best places at once.
    judged : int
        Sets of poses that were judged.
    trees : int
        Spanning trees drawn for them.
    closed : int
        Spanning trees that passed the closure test.
    planner_runs : int
        Trees that the planner was asked about.
    second_runs : int
        Those that it was asked about again, with more patience.
    folded : int
        Steps of phase B that led to a tree that folds.
    """

    grown: int = 0
    annealed: int = 0
    starts: int = 0
    removals: int = 0
    swaps: int = 0
    assignments: int = 0
    judged: int = 0
    trees: int = 0
    closed: int = 0
    planner_runs: int = 0
    second_runs: int = 0
    folded: int = 0


#: No voxel in particular to start a removal from.
ANYWHERE = np.empty(0, np.int32)


@dataclass(frozen=True)
class SearchState:
    """Full poses, their hinges, and what the objective says of them.

    Attributes
    ----------
    pose : (n,) int32 array
        ``24 * template cell + rotation`` of each voxel.
    energy : float
        Weighted energy of the poses.
    tree : SpanningTree or None
        The best of the spanning trees drawn.
    penalty : float
        For what does not fold of that tree; 0 when it folds.
    focus : (k,) int32 array
        Voxels on hinges in trouble.
    guide : (g, 5) int32 array or None
        Steps that the planner found for the tree.
    """

    pose: NDArray[np.int32]
    energy: float
    tree: SpanningTree | None
    penalty: float
    focus: NDArray[np.int32] = field(default_factory=lambda: ANYWHERE)
    guide: NDArray[np.int32] | None = None


@dataclass(frozen=True)
class FoldingObjective:
    """Weights and temperatures of phase A, which depend on the size of the problem.

    Attributes
    ----------
    stuck_hinge : float
        Penalty for a hinge that cannot move.
    energy : float
        Factor on the energy of the poses.
    joint : float
        Energy of a single hinge in phase A.
    hot, cold : float
        First and last temperature.
    """

    stuck_hinge: float
    energy: float
    joint: float
    hot: float
    cold: float


def folding_objective(voxels: int) -> FoldingObjective:
    """Weights and temperatures of phase A.

    Parameters
    ----------
    voxels : int
        Number of voxels of the problem.
    """
    # A hinge that cannot move must cost about as much as the energy a few joints bring; in large
    # problems more, or the energy freezes before anything folds.
    if voxels <= 72:
        return FoldingObjective(stuck_hinge=0.15, energy=1.0, joint=0.1, hot=0.15, cold=0.02)
    return FoldingObjective(stuck_hinge=0.4, energy=1.0, joint=0.1, hot=0.15, cold=0.02)


def steps_of_path(tree: FoldTree, path: NDArray[np.int32]) -> NDArray[np.int32]:
    """The moves of a path as steps that guide the planner.

    Parameters
    ----------
    tree : FoldTree
        The tree that folds.
    path : (m, 2) int32 array
        One row a move: hinge index and signed quarter turns about its positive axis.

    Returns
    -------
    (g, 5) int32 array
        As :attr:`fabfold.tree.foldability.PlannerEstimate.guide`.
    """
    steps: list[tuple[int, int, int, int, int]] = []
    for number, quarters in path.tolist():
        hinge = tree.hinges[number]
        x, y, z = (round(2 * value) for value in hinge.point)
        way = 1 if quarters * hinge.angle_deg > 0 else -1
        steps += [(x, y, z, int(np.flatnonzero(hinge.direction)[0]), way)] * abs(quarters)
    return np.array(steps, np.int32).reshape(-1, 5)


def axes_of_tree(tree: FoldTree) -> NDArray[np.int32]:
    """Axes of the hinges of a tree, as :attr:`fabfold.tree.assembly.SpanningTree.axes`.

    Parameters
    ----------
    tree : FoldTree
        The tree.

    Returns
    -------
    (h, 6) int32 array
        Two rows for each double hinge.
    """
    hinged = [(edge, tree.hinges[number]) for edge in tree.edges for number in edge.hinges]
    return axes_array(
        [(edge.parent, edge.child) for edge, _ in hinged],
        [[round(2 * value) for value in hinge.point] for _, hinge in hinged],
        [round(hinge.angle_deg / 90.0) for _, hinge in hinged],
    )


def pose_of_tree(tree: FoldTree) -> NDArray[np.int32]:
    """Pose of each voxel of a tree, ``24 * template cell + rotation``.

    Parameters
    ----------
    tree : FoldTree
        The tree.

    Returns
    -------
    (n,) int32 array
        Poses.
    """
    number = {tuple(cell): k for k, cell in enumerate(tree.template.cells.tolist())}
    cells = np.array([number[tuple(cell)] for cell in tree.target.tolist()], np.int32)
    turns = np.array([rotation_index(matrix) for matrix in tree.orientation], np.int32)
    return 24 * cells + turns
