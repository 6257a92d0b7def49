"""Trees that fold within seconds, for a first kit while the model is still being cut well."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from fabfold.fold.crease_hinges import add_crease_hinges
from fabfold.fold.motion import motion_of
from fabfold.kit.cutting_stage import cut_model
from fabfold.kit.stages import PlannedTree
from fabfold.lattice.template import Template
from fabfold.progress import SilentProgress
from fabfold.recipe.recipe import Recipe
from fabfold.search.schedule import schedule
from fabfold.search.seeds import SeedResult, run_seed
from fabfold.search.voxelization_problems import VoxelizationProblems
from fabfold.solid.closed_solid import Solid
from fabfold.tree.candidate import Candidate
from fabfold.tree.effort import Effort
from fabfold.wishes.wish_list import Wishes

__all__ = ["first_trees"]

#: Most seeds of a voxelization, from the roomiest one on, which folds soonest.
_SEEDS = (3, 1)
#: So many that find trees that fold are enough. A seed takes as long as one or two hinges take to
#: be made, and the second one's best tree has up to eleven fewer.
_ENOUGH = 2


def first_trees(
    recipe: Recipe, template: Template, solid: Solid, wishes: Wishes
) -> Iterator[PlannedTree]:
    """Trees that fold, soonest first and not best: one cut in haste, one short search.

    Parameters
    ----------
    recipe : Recipe
        Seed, weights and joints.
    template : Template
        The target shape, as it is filled.
    solid : Solid
        The model.
    wishes : Wishes
        Of the recipe.

    Yields
    ------
    PlannedTree
        Those of the first seeds that find any, fewest hinges first, for each costs a body to make
        and moves to prove; nothing where no seed does.

    Raises
    ------
    NoVoxelsError, NoTreeError, RecipeError
        If the model cannot be cut or the wishes cannot come true in the voxels.
    """
    cut = cut_model(recipe, solid, template, wishes.regions, SilentProgress(), hasty=True)
    problems = VoxelizationProblems(recipe, template, cut.options, wishes)
    effort = schedule(recipe.effort, 0)[0].effort
    for options in (problems.plain, problems.bossed):
        fits = False
        for option, seeds in zip(options, _SEEDS, strict=False):
            trees, some_fit = _short_search(problems, option, seeds, effort, template)
            for candidate in sorted(trees, key=_size):
                motion = motion_of(candidate.tree, candidate.path)
                yield PlannedTree(problems.options[option], candidate.tree, motion)
            if trees:
                return
            fits = fits or some_fit
        if fits:
            return


def _short_search(
    problems: VoxelizationProblems, option: int, seeds: int, effort: Effort, template: Template
) -> tuple[list[Candidate], bool]:
    """Trees of a voxelization that fold, of so many seeds at most, and whether any tree fits."""
    trees: list[Candidate] = []
    fits, lucky = False, 0
    for seed in range(seeds):
        job = problems.job(option, seed)
        if isinstance(job, SeedResult):
            continue
        found = run_seed(replace(job, effort=effort), seed, lambda _: None, lambda: False)
        folded = [add_crease_hinges(tree, template) for tree in found.candidates]
        trees += [tree for tree in folded if tree is not None]
        fits = fits or found.fits
        lucky += any(tree is not None for tree in folded)
        if lucky == _ENOUGH:
            break
    return trees, fits


def _size(candidate: Candidate) -> tuple[int, float]:
    return len(candidate.tree.hinges), candidate.energy["total"]
