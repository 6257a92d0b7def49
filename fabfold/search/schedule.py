"""The schedule of a round: which voxelizations are searched, how long, and what goes on.

A round is successive halving (Jamieson and Talwalkar 2016). Its first seed takes the roomiest
voxelization, whose tree is there at once and is the guarantee. Then several seeds search the
voxelizations that could close the box best, each for a short while, and more seeds those on which
the best trees were found. The best trees are then changed further, until that no longer pays. All
budgets are counts.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

from fabfold.search.seeds import SeedResult
from fabfold.tree.candidate import Candidate
from fabfold.tree.catalogue import JointSet
from fabfold.tree.effort import EFFORTS, Effort

__all__ = ["SEEDS_PER_ROUND", "Rung", "SeedTask", "best_lines", "schedule"]

#: Numbers that a round keeps for its seeds; a constant, so that rounds of any effort keep theirs.
SEEDS_PER_ROUND = 100
#: Least gain in energy, over a rung that changes the best trees, for which another one follows.
GAIN = 0.02


@dataclass(frozen=True)
class Rung:
    """Seeds of a round that run side by side.

    Attributes
    ----------
    takes : str
        ``"roomy"``: voxelizations from the fewest voxels on. ``"closing"``: those that could close
        the box best, best first. ``"promising"``: those of the best trees so far. ``"best"``: the
        best trees so far, of different seeds.
    seeds : int
        How many.
    effort : Effort
        How long each may try.
    options : int
        Voxelizations that the seeds share.
    every_joint : bool
        Whether all joints of the recipe are used, or those that it searches with.
    """

    takes: Literal["roomy", "closing", "promising", "best"]
    seeds: int
    effort: Effort
    options: int = 1
    every_joint: bool = False

    def is_last(self, before: float, after: float) -> bool:
        """Whether no rung follows, by the least energy before this one and after it.

        One without kicks only begins: it lets further joints in, and kicks may find what it has
        not.
        """
        return self.takes == "best" and self.effort.kicks > 0 and after > before - GAIN


def _rungs(
    effort: Effort,
    closing: tuple[int, int],
    promising: tuple[tuple[int, int], ...],
    best: tuple[tuple[int, int], ...],
) -> tuple[Rung, ...]:
    """Rungs from seeds and voxelizations, and from seeds and kicks."""
    first = replace(
        effort,
        restarts=12,
        starts=1,
        choices=1,
        swaps=0,
        swap_heats=Effort.swap_heats,
        settling=0,
        settle_heats=Effort.settle_heats,
        polish_each=100,
        polish_best=0,
    )
    search = replace(effort, polish_best=0)
    return (
        Rung("roomy", 1, first),
        Rung("closing", closing[0], search, closing[1]),
        *(Rung("promising", seeds, search, options) for seeds, options in promising),
        *(
            Rung("best", seeds, replace(effort, kicks=kicks), every_joint=True)
            for seeds, kicks in best
        ),
    )


def _large(effort: str) -> Effort:
    """Effort of a seed on a large template: one start, made with more care."""
    return replace(
        EFFORTS[effort],
        restarts=1,
        swaps=30000,
        swap_heats=(0.25, 0.03),
        settling=40,
        settle_heats=(0.15, 0.05),
    )


_SCHEDULES: dict[str, tuple[Rung, ...]] = {
    "quick": _rungs(EFFORTS["quick"], (2, 2), ((2, 1),), ((1, 0), (1, 2))),
    "normal": _rungs(EFFORTS["normal"], (4, 4), ((2, 1),), ((2, 0), (1, 8))),
    # On large templates a seed takes ten times as long, and few of them fold: what more of them
    # find does not pay, nor does a second start where the first did not fold.
    "quick, large": _rungs(_large("quick"), (2, 2), ((2, 1),), ((1, 0), (1, 2))),
    "normal, large": _rungs(_large("normal"), (2, 2), ((2, 1),), ((1, 0), (1, 4))),
    "thorough": _rungs(
        EFFORTS["thorough"],
        (12, 6),
        ((12, 3), (12, 2)),
        ((6, 0), (6, 20), (4, 20), (4, 20), (4, 20)),
    ),
}


def schedule(effort: str, number: int, *, large: bool = False) -> tuple[Rung, ...]:
    """Rungs of a round.

    Parameters
    ----------
    effort : str
        ``quick``, ``normal`` or ``thorough``.
    number : int
        Of the round, from 0. Rounds after the first follow where nothing folded: they try more
        roomy voxelizations before the others.
    large : bool
        Whether the template is large; unless the effort is thorough, less is tried then.

    Returns
    -------
    tuple of Rung
        In the order in which they run.
    """
    first, *others = _SCHEDULES[f"{effort}, large" if large and effort != "thorough" else effort]
    if number == 0:
        return (first, *others)
    return (replace(first, seeds=4, options=4), *others)


def best_lines(results: Mapping[int, SeedResult], origin: Mapping[int, int]) -> list[Candidate]:
    """The best tree of each seed and of the seeds that went on from it.

    Parameters
    ----------
    results : mapping of int to SeedResult
        By seed.
    origin : mapping of int to int
        For each seed that went on from a tree, the seed that had found it.

    Returns
    -------
    list of Candidate
        One for each line, best first; each bears the seed that found it last.
    """
    line: dict[int, int] = {}
    best: dict[int, Candidate] = {}
    for seed in sorted(results):
        for candidate in results[seed].candidates[:1]:
            root = line.get(origin.get(seed, seed), origin.get(seed, seed))
            line[seed] = root
            known = best.get(root)
            if known is None or candidate.energy["total"] < known.energy["total"]:
                best[root] = replace(candidate, seed=seed)
    return sorted(best.values(), key=lambda c: (c.energy["total"], c.seed))


@dataclass(frozen=True)
class SeedTask:
    """One seed: number, digest, voxelization, round, effort, joints, and a tree to go on from."""

    seed: int
    key: str
    option: int
    number: int
    effort: Effort
    joints: JointSet
    start: Candidate | None
