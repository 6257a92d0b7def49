"""How long the tree search may try.

Budgets are counts and never seconds, so that the same effort finds the same trees on any machine.
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["EFFORTS", "Effort"]


@dataclass(frozen=True)
class Effort:
    """Budget and settings of one run of the tree search.

    Attributes
    ----------
    beam_width : int
        States that the beam keeps while poses are grown.
    root_poses : int
        Root poses tried before growing is given up.
    restarts : int
        Starts made while none of them folds; then another seed, with another voxelization, is
        worth more.
    starts : int
        Starts made in any case, so that the best of several trees that fold is polished.
    choices : int
        Sets of poses made for each start; the one of least energy is taken.
    swaps : int
        Swaps, per voxel, of the annealing that makes a set of poses; 0 to grow them instead.
    swap_heats : (float, float)
        First and last temperature of that annealing, weighted energy.
    settling : int
        Steps, per start and voxel, in which energy and hinges that cannot move go down together
        before the planner is asked for the first time.
    settle_heats : (float, float)
        First and last temperature of settling, for poses that were annealed.
    removals : int
        Large-neighbourhood steps, per start, until hinges that can turn join all the clusters.
    closure_tests : int
        Sets of poses judged by the closure test, per start and voxel, in phase A.
    planner_runs : int
        Runs of the planner, per start and voxel, until a tree folds in phase A.
    polish_each : int
        Sets of poses judged to lower the energy of each tree that folds.
    polish_best : int
        The same for the best of them, in phase B.
    kicks : int
        Most times that the best tree is shaken, settled and folded again.
    kick_steps : int
        Steps of settling, per voxel, after each kick.
    kick_patience : int
        Kicks in a row without a better tree after which no more are made.
    min_removed, max_removed : int
        Least and greatest number of voxels taken out at a time.
    repair_beam_width : int
        States that the beam keeps while they are put back.
    spanning_trees : int
        Spanning trees tried for each set of poses.
    short_patience : int
        Planner expansions without progress after which the first run for a tree ends.
    long_patience : int
        The same for the second run in phase A, made where the first leaves little unresolved.
    polish_patience : int
        The same in phase B, along the steps of the tree that was changed; there is no second run.
    near_miss : float
        Greatest share of unresolved quarter turns that counts as little.
    max_candidates : int
        Most trees returned.
    """

    beam_width: int = 10
    root_poses: int = 100
    restarts: int = 3
    starts: int = 2
    choices: int = 2
    swaps: int = 18000
    swap_heats: tuple[float, float] = (0.12, 0.05)
    settling: int = 30
    settle_heats: tuple[float, float] = (0.1, 0.04)
    removals: int = 6000
    closure_tests: int = 8
    planner_runs: int = 1
    polish_each: int = 300
    polish_best: int = 600
    kicks: int = 0
    kick_steps: int = 16
    kick_patience: int = 4
    min_removed: int = 4
    max_removed: int = 16
    repair_beam_width: int = 6
    spanning_trees: int = 3
    short_patience: int = 40
    long_patience: int = 100
    polish_patience: int = 24
    near_miss: float = 0.12
    max_candidates: int = 5


#: Effort by name: how long one seed may try.
EFFORTS: dict[str, Effort] = {
    "quick": Effort(root_poses=40, restarts=2, starts=1, polish_best=200),
    "normal": Effort(restarts=2, starts=1),
    "thorough": Effort(root_poses=400, restarts=6, starts=3, settling=60, polish_each=800),
}
