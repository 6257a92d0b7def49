"""The voxelizations of a model as problems of the tree search, and which of them are promising."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from fabfold.errors import NoTreeError, RecipeError
from fabfold.fold.lattice_foldability import LatticeFoldability
from fabfold.lattice.template import Template
from fabfold.recipe.recipe import Recipe
from fabfold.recipe.recipe_wishes import weights_of
from fabfold.search.seeds import Job, SeedResult
from fabfold.tree.bound import closed_at_most, visible_faces
from fabfold.tree.catalogue import JointSet
from fabfold.tree.effort import Effort
from fabfold.tree.problem import from_features
from fabfold.tree.template_parts import restrict_to_parts
from fabfold.voxels.features import features
from fabfold.voxels.voxel_model import Voxels
from fabfold.voxels.voxelize import LARGE, paying_sizes
from fabfold.wishes.protect import rank_by_cuts, rigid_pairs
from fabfold.wishes.wish_list import Wishes

__all__ = ["VoxelizationProblems", "search_order", "usable"]


def search_order(options: Sequence[Voxels]) -> list[Voxels]:
    """Voxelizations from the fewest voxels to the most, and again.

    What leaves much of the template free folds within seconds. Of each two neighbours in size one
    comes in the first turn, the other in the second.
    """
    ordered = sorted(options, key=len)
    return ordered[0::2] + ordered[1::2]


def usable(options: Sequence[Voxels], template: Template, wishes: Wishes) -> list[Voxels]:
    """Voxelizations in which the wishes can come true, in their order of search.

    Parameters
    ----------
    options : sequence of Voxels
        Voxelizations.
    template : Template
        The target shape, as it is filled.
    wishes : Wishes
        Of the recipe.

    Returns
    -------
    list of Voxels
        From the fewest voxels on; with ``--protect``, by cuts.

    Raises
    ------
    NoTreeError
        If there is none.
    RecipeError
        If the template does not go with the wishes.
    """
    if template.creases and (wishes.keeps or wishes.void):
        raise RecipeError(
            f"template {template.name!r} folds once more when it is filled: --keep and --void, "
            "which speak of the sides of the filled template, do not go with it"
        )
    if template.joints == "inside":
        # The last hinge to turn brings two halves together. With all four cells around its edge
        # full, a quarter turn before the end some of them would have been in one another.
        roomy = [voxels for voxels in options if len(voxels) < len(template)]
        if not roomy:
            raise NoTreeError(
                f"joints inside: every voxelization fills all {len(template)} cells of template "
                f"{template.name!r}, and the last hinge to turn needs an empty cell beside it; "
                "take a template with a few more cells, a larger --drop-below, or allow hinges "
                "on the surface"
            )
        options = roomy
    ordered = search_order(options)
    if wishes.regions:
        found = [(voxels, features(voxels)) for voxels in ordered]
        ordered = [ordered[index] for index in rank_by_cuts(wishes.regions, found, template)]
    return ordered


#: Voxelizations whose numbers of voxels differ by no more than this are of one size.
_ALIKE = 2


class VoxelizationProblems:
    """Problems of a recipe's voxelizations, each made once.

    Parameters
    ----------
    recipe : Recipe
        Weights and joints.
    template : Template
        The target shape, as it is filled.
    options : sequence of Voxels
        Voxelizations.
    wishes : Wishes
        Of the recipe.

    Attributes
    ----------
    options : list of Voxels
        Those in which the wishes can come true, from the fewest voxels on, see
        :func:`search_order`; then the same with bosses. They are spoken of by their number here.
    plain : range
        Numbers of the former.
    bossed : range
        Numbers of the latter, for models of which no tree fits: where few edges of a thin limb have
        material for a hinge, it may be too stiff to be laid into the template. There are none where
        hinges may stand on bosses anyway, or the model is not to be made thicker.

    Raises
    ------
    NoTreeError
        If the wishes can come true in none.
    RecipeError
        If the template does not go with the wishes.
    """

    def __init__(
        self, recipe: Recipe, template: Template, options: Sequence[Voxels], wishes: Wishes
    ) -> None:
        self.recipe, self.template, self.wishes = recipe, template, wishes
        plain = usable(options, template, wishes)
        bossed = [replace(voxels, bosses=True) for voxels in plain]
        if recipe.thicken == "off" or all(voxels.bosses for voxels in plain):
            bossed = []
        self.options = plain + bossed
        self.plain = range(len(plain))
        self.bossed = range(len(plain), len(self.options))
        self._jobs: dict[tuple[int, JointSet], Job | SeedResult] = {}
        self._at_most: dict[tuple[int, JointSet], float] = {}
        self._closing: dict[range, list[int]] = {}

    def job(self, option: int, seed: int, joints: JointSet | None = None) -> Job | SeedResult:
        """The problem of a voxelization, or the result where it rules every tree out.

        Parameters
        ----------
        option : int
            Number of the voxelization.
        seed : int
            Decides the faces of the parts, where the template folds once more.
        joints : str, optional
            Joint types; by default those that the recipe searches with.
        """
        joints = joints or self.recipe.first_joints
        if self.template.creases:
            return self._job_of(option, seed, joints)  # the faces of the parts depend on the seed
        if (option, joints) not in self._jobs:
            self._jobs[option, joints] = self._job_of(option, seed, joints)
        return self._jobs[option, joints]

    def _job_of(self, option: int, seed: int, joints: JointSet) -> Job | SeedResult:
        voxels = self.options[option]
        found = features(voxels)
        protected = self.wishes.protected(voxels, found, self.template)
        try:
            problem = from_features(
                voxels,
                found,
                self.template,
                weights_of(self.recipe),
                extra_cost=self.wishes.extra_cost(voxels, self.template),
                always_rigid=rigid_pairs(protected, found),
                joints=joints,
                share=self.recipe.share,
            )
            problem = self.wishes.with_roots(problem, voxels, self.template)
            if self.template.creases:
                problem = restrict_to_parts(problem, seed, found.depth)
        except NoTreeError as error:
            return SeedResult((), fits=False, why=str(error))
        return Job(problem, LatticeFoldability(), Effort())

    def closing_order(self, options: range) -> list[int]:
        """Some voxelizations by how open the box is likely to stay; with --protect by cuts.

        Of large templates the fullest come last: they seldom fold.

        See :mod:`fabfold.voxels.openness`.
        """
        if options not in self._closing:
            order = list(options)
            if not self.wishes.regions:
                order.sort(key=lambda option: (self._seldom_folds(option), self._openness(option)))
            self._closing[options] = order
        return self._closing[options]

    def _seldom_folds(self, option: int) -> bool:
        """Whether a voxelization is of the fullest size of a large template.

        Of 34 tries on such ones two folded, and each takes longest. Whoever looks further, or
        wants a share of the box closed, has them tried all the same.
        """
        recipe = self.recipe
        if recipe.effort == "thorough" or recipe.closed is not None or len(self.template) <= LARGE:
            return False
        return self._size_ranks()[option] == 0

    def _openness(self, option: int) -> float:
        """Faces that must stay open, and cells' worth of space among the voxels."""
        closed = self._bound(option, self.recipe.first_joints)
        least = (1.0 - closed) * visible_faces(self.template)
        fill = self.options[option].fill
        return least + len(fill) - float(fill.sum())

    def _size_ranks(self) -> list[int]:
        """For each voxelization the number of sizes that are fuller than its own."""
        ranks: dict[int, int] = {}
        head, rank = None, -1
        for size in sorted({len(voxels) for voxels in self.options}, reverse=True):
            if head is None or head - size > _ALIKE:
                head, rank = size, rank + 1
            ranks[size] = rank
        return [ranks[len(voxels)] for voxels in self.options]

    def promising_order(self, options: range, found: Mapping[int, float]) -> list[int]:
        """Some voxelizations by the best tree found on each, or by what is to be expected.

        Parameters
        ----------
        options : range
            Numbers of the voxelizations.
        found : mapping of int to float
            Least energy by voxelization; infinite where nothing folded.

        Returns
        -------
        list of int
            Those that were not tried count as if they came as near to their openness as the best
            of the others. Those on which nothing folded come last, and with them what was not tried
            and is of their size, where a size that pays folds: room decides.
        """
        weight = weights_of(self.recipe).surface
        floor = {option: weight * self._openness(option) for option in options}
        gaps = [found[option] - floor[option] for option in found]
        gap = min(gaps, default=0.0)
        size = [len(voxels) for voxels in self.options]
        rank, paying = self._size_ranks(), paying_sizes(len(self.template))
        pays = any(found[k] < float("inf") for k in found if rank[k] in paying)

        def expected(option: int) -> float:
            if option in found:
                return found[option]
            if self._seldom_folds(option):
                return float("inf")
            alike = [found[k] for k in found if abs(size[k] - size[option]) <= _ALIKE]
            if pays and alike and min(alike) == float("inf"):
                return float("inf")
            return floor[option] + gap

        return sorted(self.closing_order(options), key=expected)

    def at_most(self, option: int) -> float:
        """Share to which the box could be closed with a voxelization; 0 where no tree fits."""
        return self._bound(option, self.recipe.every_joint)

    def _bound(self, option: int, joints: JointSet) -> float:
        if (option, joints) not in self._at_most:
            job = self.job(option, self.recipe.seed, joints)
            closed = closed_at_most(job.problem) if isinstance(job, Job) else 0.0
            self._at_most[option, joints] = closed
        return self._at_most[option, joints]
