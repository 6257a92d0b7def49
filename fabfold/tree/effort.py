"""How long the tree search may try, in counts and never in seconds."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["EFFORTS", "Effort"]


@dataclass(frozen=True)
class Effort:
    """Budget and settings of one run of the tree search.

    Attributes
    ----------
    beam : int
        States kept while growing.
    roots : int
        Root poses tried before growing is given up.
    restarts : int
        Fresh starts of the folding phase while none folds; then another seed, with another
        voxelization, is worth more.
    removals : int
        Large-neighbourhood moves, per start, until hinges that can turn join all the clusters.
    closing : int
        Candidates judged per start and voxel until the closure test passes (phase A).
    looking : int
        Looks of the planner per start and voxel until a tree folds (phase A).
    gathering : int
        Starts made in any case, so that the best of several trees that fold is polished.
    trying : int
        Candidates judged to lower the energy of each of these.
    polishing : int
        The same for the best of them (phase B).
    least, most : int
        Voxels taken out at a time.
    rebeam : int
        States kept while they are put back.
    trees : int
        Spanning trees tried for each set of poses.
    glance : int
        Planner expansions without progress for a first score.
    look : int
        The same, where the first score leaves little to do.
    strict_look : int
        The same in phase B, along the steps of the tree that was changed.
    near : float
        Share of unresolved planner levels that still counts as little.
    keep : int
        Most candidates returned.
    """

    beam: int = 10
    roots: int = 100
    restarts: int = 12
    removals: int = 30000
    closing: int = 8
    looking: int = 1
    gathering: int = 20
    trying: int = 400
    polishing: int = 4000
    least: int = 4
    most: int = 16
    rebeam: int = 6
    trees: int = 3
    glance: int = 40
    look: int = 100
    strict_look: int = 400
    near: float = 0.12
    keep: int = 5


#: Effort by name, as the command line offers it.
EFFORTS: dict[str, Effort] = {
    "quick": Effort(roots=40, restarts=6, gathering=1, polishing=200),
    "normal": Effort(),
    "thorough": Effort(roots=400, restarts=60, gathering=30, polishing=20000),
}
