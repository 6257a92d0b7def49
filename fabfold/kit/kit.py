"""A kit: the stages from a model to print-ready files, in memory or in a folder.

Data flows one way: solid → voxels → candidates → planned tree → built tree → checks → files. Each
stage is a method of :class:`Kit` that runs what is missing before it and returns a typed result.
With a folder, finished stages are kept there, and the same recipe goes on from what is done.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from itertools import chain, islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from fabfold.errors import KitError, RecipeError
from fabfold.files import write_text
from fabfold.kit import keys
from fabfold.kit.stage_runner import StageRunner
from fabfold.kit.stages import BuiltTree, PlannedTree, build_first
from fabfold.lattice.template import Template
from fabfold.progress import Progress, SilentProgress
from fabfold.recipe.recipe import Recipe
from fabfold.recipe.start import require_free_folder, set_up_project, with_size
from fabfold.recipe.targets import load_target
from fabfold.store import StageStore

if TYPE_CHECKING:
    from fabfold.joinery.bodies import Joinery
    from fabfold.kit.box_closure import BoxClosure
    from fabfold.kit.early import EarlyKit
    from fabfold.printing.checks import Check
    from fabfold.printing.print_mode import PrintMode
    from fabfold.search.pareto import Solution
    from fabfold.search.rounds import Found, Rounds
    from fabfold.search.standby import SearchStandby
    from fabfold.solid.closed_solid import Solid
    from fabfold.tree.candidate import Candidate
    from fabfold.voxels.thickening import Cut
    from fabfold.voxels.voxel_model import Voxels
    from fabfold.wishes.wish_list import Wishes

__all__ = ["Kit", "open_kit"]


class Kit(StageRunner):
    """One model on its way to a printed, folding object.

    Parameters
    ----------
    recipe : Recipe
        Every choice that the result depends on.
    model : Path or None
        The model's file; None for a sample.
    template : Path or None
        The template's file; None for a box or a shipped template.
    actions : Path or None
        File of what a person did in an unfolding by forces.
    folder : Path or None
        Kit folder that keeps finished stages; None works in memory until :meth:`export`.
    workers : int or None
        Processes of the search; None takes one a core. Changes no result.
    scheduler : str or None
        Address of a Dask scheduler, whose workers search instead. Changes no result.
    seconds : float or None
        Search for so long and take the best that was found; depends on the machine's speed.
    """

    def __init__(
        self,
        recipe: Recipe,
        *,
        model: Path | None = None,
        template: Path | None = None,
        actions: Path | None = None,
        folder: Path | None = None,
        workers: int | None = None,
        scheduler: str | None = None,
        seconds: float | None = None,
    ) -> None:
        if workers is not None and workers < 1:
            raise RecipeError(f"--workers {workers}: there must be at least one")
        if seconds is not None and not seconds >= 0:
            raise RecipeError(f"--time {seconds}: must be a number of seconds, 0 or more")
        if scheduler is not None:
            from fabfold.search.dask import check_address

            check_address(scheduler)
        super().__init__(StageStore(folder))
        self.recipe = recipe
        self.folder = folder
        self.workers = workers
        self.scheduler = scheduler
        self.seconds = seconds
        self._accepted = False
        #: Told of each better tree that a search finds, with its voxels.
        self.on_better: Callable[[Found], None] | None = None
        self._early: EarlyKit | None = None
        self._standby: SearchStandby | None = None
        self._files = {"model": model, "template": template, "actions": actions}
        self._template: Template = load_target(recipe.template, template, recipe.template_cells)
        if recipe.joints_inside:
            self._template = replace(self._template, joints="inside")
        if folder is not None:
            require_free_folder(folder)
        self.print_mode()  # An unknown profile, pin or gap is refused before anything is read.

    @classmethod
    def from_model(
        cls,
        model: str | Path,
        *,
        folder: str | Path | None = None,
        workers: int | None = None,
        scheduler: str | None = None,
        seconds: float | None = None,
        **options: Any,
    ) -> Kit:
        """Kit of a model file or ``sample:NAME``; `options` and errors as of :func:`open_kit`."""
        return open_kit(
            str(model),
            folder=None if folder is None else Path(folder),
            workers=workers,
            scheduler=scheduler,
            seconds=seconds,
            **options,
        )

    @property
    def template(self) -> Template:
        """The target shape, as it is filled (before any folds of its own)."""
        return self._template

    # Stages -----------------------------------------------------------------------------------

    def solid(self) -> Solid:
        """Closed manifold of the model (repaired where it could be)."""
        from fabfold.kit.stage_files import load_solid, save_solid
        from fabfold.samples.builtin import load_model

        def make(progress: Progress) -> Solid:
            progress.update(None, self.recipe.model)
            solid = load_model(self._files["model"] or self.recipe.model, self.recipe.object)
            progress.update(1.0, f"{len(solid.faces)} triangles")
            return solid

        key = keys.solid_key(self.recipe)
        return self._stage("solid", key, make, save_solid, load_solid, on_trial=True)

    def voxelize(self) -> list[Voxels]:
        """Voxelizations of the model, best first (paper section 3)."""
        return self._cut().options

    def cut_solid(self) -> Solid:
        """What the voxels are cut from: the model, thickened where too thin, as its notes tell."""
        cut = self._cut()
        return replace(cut.solid, notes=(*self.solid().notes, *cut.notes(self.recipe.voxel_mm)))

    def _cut(self) -> Cut:
        from fabfold.kit.cutting_stage import cut_model
        from fabfold.kit.stage_files import load_cut, save_cut

        mode = self.print_mode()
        mode.require_hinge(self.recipe.voxel_mm)
        mode.require_template(self._template)
        solid = self.solid()
        regions = self.wishes().regions

        def make(progress: Progress) -> Cut:
            return cut_model(self.recipe, solid, self._template, regions, progress)

        key = keys.voxels_key(self.recipe, self._template)
        return self._stage("voxelize", key, make, save_cut, load_cut)

    def fit(self) -> list[Candidate]:
        """Trees that fold, best first (paper section 4), of the first round that finds any.

        With a budget in seconds, the best of all rounds that there is time for.

        Raises
        ------
        NoTreeError, NoFoldError
            If no round of the recipe finds one.
        """
        return [candidate for _, candidate in next(self._found())]

    def fold(self) -> PlannedTree:
        """Best tree with the keyframes of its folding path on the lattice (paper section 5).

        Raises
        ------
        NoTreeError, NoFoldError
            If no round of the recipe finds one.
        """
        from fabfold.kit.stage_files import load_planned, save_planned

        def make(progress: Progress) -> PlannedTree:
            planned = next(self._planned_trees(progress))
            hinges, moves = len(planned.tree.hinges), len(planned.motion.moves) - 1
            progress.update(1.0, f"{hinges} hinges, {moves} moves")
            return planned

        key = keys.fold_key(self.recipe, self._template, self._mark())
        if not self._is_done("fold", key):  # The search shows its own progress, ahead of this.
            self.fit()
        return self._stage("fold", key, make, save_planned, load_planned)

    def join(self) -> BuiltTree:
        """Printed bodies of the best tree that survives on them, with the final certificate.

        Raises
        ------
        NoFoldError
            If every tree of every round was refused; it says why.
        """
        from fabfold.kit.stage_files import load_built, save_built

        mode = self.print_mode()
        best = self.fold()

        def make(progress: Progress) -> BuiltTree:
            trees = chain([best], islice(self._planned_trees(progress), 1, None))
            return build_first(trees, mode, self.recipe.voxel_mm, progress)

        key = keys.join_key(self.recipe, self._template, mode, self._mark())
        return self._stage("join", key, make, save_built, load_built)

    def check(self) -> list[Check]:
        """Checks of the printed bodies and the replay of the path, each with figure and limit."""
        from fabfold.kit.checking import run_checks
        from fabfold.kit.stage_files import load_checks, save_checks

        mode = self.print_mode()
        built = self.join()

        def make(progress: Progress) -> list[Check]:
            checks = run_checks(built, mode, progress)
            progress.update(1.0, f"{sum(check.ok for check in checks)} of {len(checks)} passed")
            return checks

        key = keys.check_key(self.recipe, self._template, mode, self._mark())
        return self._stage("check", key, make, save_checks, load_checks)

    def export(self, folder: str | Path | None = None) -> Path:
        """Write the files of the kit and return their folder.

        Parameters
        ----------
        folder : path or None
            Where to write; None is the kit's own folder.

        Raises
        ------
        KitError
            If there is no folder to write to, or it holds something else.
        """
        target = self.folder if folder is None else Path(folder)
        if target is None:
            raise KitError("where to? Give a folder to export to")
        require_free_folder(target)
        store = self._store if target == self.folder else StageStore(target)
        with store.locked():
            self._export(target, store)
        return target

    def _export(self, target: Path, store: StageStore) -> None:
        from fabfold.kit.delivered import recorded_export
        from fabfold.kit.early import EarlyKit
        from fabfold.kit.step_process import StepProcess
        from fabfold.kit.writing import write_kit

        mode = self.print_mode()
        files = self.recipe, self._template, mode, target
        self._early = EarlyKit(
            *files, lambda: (self.solid(), self.wishes()), self._claim, self.listener
        )
        with self._early as early:
            with self._stand_by():
                early.start(wanted=store is self._store and not self.recipe.pick)
                self.cut_solid()  # Before anything in a folder with a kit changes.
            store.take()
            with recorded_export(store, target, self.recipe.name):
                self.fold()
                early.end()
                built = self.join()
                path = target / f"{self.recipe.name}.step"
                with StepProcess(path, built, beside=self.workers != 1) as step:
                    checks = self.check()
                    with self._open_progress("export") as progress:
                        write_kit(
                            target, self.recipe, mode, self.cut_solid(), built, checks, progress,
                            step.wait, self.wish_report(built.planned, built.joinery),
                            self._template, self.box_closure(built.planned),
                        )  # fmt: skip
        self.processor_seconds["early"] = early.processor_seconds
        if store is not self._store:
            from fabfold.kit.stage_files import keep_inputs

            keep_inputs(store, self.recipe, self._files)

    def run(self, stage: str) -> None:
        """Run one stage by name, with all before it that is missing, and write its kit files.

        Raises
        ------
        KitError
            If another run is at work in the kit folder.
        """
        from fabfold.kit.writing import write_stage

        with self._store.locked():
            result = getattr(self, stage)()
            # The files of an exported kit stay as they are: they are what is checked.
            if stage != "check" or not self.delivered():
                write_stage(self, stage, result)

    def is_made(self, stage: Literal["fold", "join"]) -> bool:
        """Whether the result of a stage is there for this recipe, in memory or in the folder."""
        key = keys.fold_key(self.recipe, self._template, self._mark())
        if stage == "join":
            key = keys.join_key(self.recipe, self._template, self.print_mode(), self._mark())
        return self._is_done(stage, key)

    def delivered(self) -> list[Check]:
        """Check of the files of an exported kit against what was built; none before an export."""
        from fabfold.kit.delivered import delivered_checks

        return delivered_checks(self._store, self.recipe, self.join)

    # How the stages hang together ---------------------------------------------------------------

    def print_mode(self) -> PrintMode:
        """How the kit is printed, with the clearance of the recipe where it gives one."""
        from fabfold.kit.holding import mode_of

        return mode_of(self.recipe)

    @property
    def kernel_seconds(self) -> float:
        """Processor seconds that compiling the search's kernels took; part of the fit stage's."""
        return 0.0 if self._standby is None else self._standby.kernel_seconds

    def _rounds(self) -> Rounds:
        return self._once("rounds", lambda: self._rounds_of(self.recipe, seconds=self.seconds))

    def _rounds_of(self, recipe: Recipe, shift: int = 0, seconds: float | None = None) -> Rounds:
        """Search of the kit's voxelizations for its recipe, or one with another preference."""
        from fabfold.search.rounds import Rounds

        with self._stand_by():
            return Rounds(
                recipe,
                self._template,
                self.voxelize(),
                key=keys.voxels_key(self.recipe, self._template),
                store=self._store,
                workers=self.workers,
                open_progress=self._open_progress,
                scheduler=self.scheduler,
                seconds=seconds,
                wishes=self.wishes(),
                shift=shift,
                on_begin=None if self._early is None else self._early.search,
                on_better=self.on_better,
                standby=self._standby,
            )

    def _stand_by(self) -> AbstractContextManager[object]:
        from fabfold.search.standby import SearchStandby

        # With one worker all happens in this process, and what is called is compiled.
        if self._standby is None and self.workers != 1 and self.scheduler is None:
            cut = self._is_done("voxelize", keys.voxels_key(self.recipe, self._template))
            self._standby = SearchStandby(self.workers, self.recipe.first_joints)
            self._standby.start(workers=not cut)
        return nullcontext() if self._standby is None else self._standby

    def _mark(self) -> list[Any]:
        return [] if self.recipe.pick else self._rounds().mark()

    def wishes(self) -> Wishes:
        """The wishes of the recipe, sampled on the model."""
        from fabfold.recipe.recipe_wishes import make_wishes

        return self._once("wishes", lambda: make_wishes(self.recipe, self.solid()))

    def wish_report(
        self, planned: PlannedTree, joinery: Joinery | None = None
    ) -> list[dict[str, Any]]:
        """What became of each wish in a tree and its bodies: figures and a line of text."""
        from fabfold.kit.wish_report import wish_report

        return wish_report(self.wishes(), planned, joinery)

    def box_closure(self, planned: PlannedTree) -> BoxClosure | None:
        """How closed the box of a tree is and could be; None where that cannot be said."""
        from fabfold.kit.box_closure import box_closure

        return box_closure(self.recipe, self._template, planned)

    def pareto(self) -> list[Solution]:
        """Trees that fold, none better than another in every respect, as :meth:`fit` raises.

        They are numbered from 1, fewest joints first; the recipe's `pick` goes on with one of them.
        """
        from fabfold.search.pareto import solutions

        search = (self._rounds_of, self._open_progress)
        return self._once("pareto", lambda: solutions(self.recipe, *search))

    def _found(self) -> Iterator[list[Found]]:
        """What each round finds, or what was picked; nothing is searched before it is wanted."""
        from fabfold.search.pareto import picked

        if self.recipe.pick:
            solution = picked(self.pareto(), self.recipe.pick)
            yield [(solution.voxels, solution.candidate)]
        else:
            yield from self._rounds().found()

    def _planned_trees(self, progress: Progress | None = None) -> Iterator[PlannedTree]:
        """Every candidate of every round, best first, with its path as the recipe finds it."""
        from fabfold.kit.planning import paths_by_forces, planned_trees

        trees = planned_trees(self._found())
        if self.recipe.method == "physics":
            trees = paths_by_forces(trees, self._files["actions"], progress or SilentProgress())
        return trees

    def _accept(self) -> None:
        """Write the recipe and keep the files that it names, before what was made is kept."""
        from fabfold.kit.stage_files import keep_inputs

        with self._accepting:
            if self.folder is not None and not self._accepted:
                self._store.take()
                keep_inputs(self._store, self.recipe, self._files)
                write_text(self.folder / "kit.toml", self.recipe.to_toml())
                self._accepted = True
            super()._accept()

    def _claim(self) -> None:
        """Make the kit folder this run's, for a first kit is about to be written there."""
        self._accept()
        self._store.record_names([*self._store.names, self.recipe.name])

    def _spent(self) -> float:
        """Processor seconds so far, without those of the first kit."""
        return super()._spent() - (self._early.processor_seconds if self._early else 0.0)


def open_kit(
    source: str,
    *,
    folder: Path | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    seconds: float | None = None,
    box_mm: float | None = None,
    scale: float | None = None,
    **options: Any,
) -> Kit:
    """Kit of a model file, ``sample:NAME``, a ``kit.toml`` or a kit folder.

    Parameters
    ----------
    source : str
        Path of a model, a recipe or a kit folder; or ``sample:NAME``.
    folder : Path or None
        Kit folder; for a kit folder or its ``kit.toml`` the default is that folder.
    workers, scheduler, seconds
        How the search runs, as of :class:`Kit`.
    box_mm : float, optional
        Longest side of the finished box, mm; sets the recipe's `voxel_mm`.
    scale : float, optional
        Size against the usual one, whose voxels are 20 mm; sets `voxel_mm` too.
    **options
        Fields of the recipe; those that are None keep the recipe's or the default value.

    Raises
    ------
    ModelError
        If there is no such file or sample.
    RecipeError
        If the recipe or an option is wrong.
    """
    if options.get("voxel_mm") is not None and (box_mm is not None or scale is not None):
        raise RecipeError("--voxel-mm sets the size too: leave out --box-mm and --scale")
    start = with_size(set_up_project(source, folder, options), box_mm, scale)
    return Kit(
        start.recipe,
        model=start.model,
        template=start.template,
        actions=start.actions,
        folder=start.folder,
        workers=workers,
        scheduler=scheduler,
        seconds=seconds,
    )
