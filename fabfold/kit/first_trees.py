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
from fabfold.wishes.wish_list import Wishes

__all__ = ["first_trees"]

#: Seeds that are run until a tree folds, from the roomiest voxelization on, which folds soonest.
_SEEDS = (3, 1)


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
        Those of the first seed that finds any, fewest hinges first, for each costs a body to make
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
        turns = zip(options, _SEEDS, strict=False)
        for number, option in enumerate(option for option, seeds in turns for _ in range(seeds)):
            job = problems.job(option, number)
            if isinstance(job, SeedResult):
                continue
            found = run_seed(replace(job, effort=effort), number, lambda _: None, lambda: False)
            fits = fits or found.fits
            folded = (add_crease_hinges(tree, template) for tree in found.candidates)
            trees = sorted((tree for tree in folded if tree is not None), key=_size)
            for candidate in trees:
                motion = motion_of(candidate.tree, candidate.path)
                yield PlannedTree(problems.options[option], candidate.tree, motion)
            if trees:
                return
        if fits:
            return


def _size(candidate: Candidate) -> tuple[int, float]:
    return len(candidate.tree.hinges), candidate.energy["total"]
