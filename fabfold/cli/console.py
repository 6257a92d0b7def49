"""What the command line shows: progress while a stage runs, and its result."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
from rich.progress import Progress as RichProgress
from rich.table import Table

from fabfold.errors import RecipeError, harmless
from fabfold.progress import LastMessage, Progress, processor_seconds

if TYPE_CHECKING:
    from fabfold.kit.kit import Kit
    from fabfold.printing.checks import Check
    from fabfold.proof.rehearsal import Rehearsal
    from fabfold.solid.inspection import Inspection
    from fabfold.tree.fold_tree import FoldTree

__all__ = [
    "ConsoleListener",
    "show_checks",
    "show_inspection",
    "show_list",
    "show_rehearsal",
    "show_result",
]

_TITLES = {
    "solid": "Reading the model",
    "voxelize": "Cutting voxels",
    "fit": "Finding trees that fold",
    "pareto": "Finding the Pareto list",
    "pictures": "Drawing the solutions",
    "early": "A first kit that folds",
    "fold": "Taking the best tree's path",
    "join": "Making bodies and hinges",
    "check": "Checking",
    "export": "Writing the kit",
    "render": "Drawing the fold",
    "rehearse": "Folding with weight",
}
_STAGES = {
    "solid": "reading",
    "voxelize": "cutting",
    "fit": "searching",
    "fold": "path",
    "join": "bodies",
    "check": "checks",
    "export": "files",
    "early": "first kit",
}


def _console(*, soft_wrap: bool = False) -> Console:
    """A console that shows brackets as they are: names of files may hold some."""
    return Console(highlight=False, markup=False, soft_wrap=soft_wrap)


class ConsoleListener:
    """Shows a bar a stage on a terminal, and a line a stage elsewhere; stages may be nested."""

    def __init__(self) -> None:
        self._console = Console(stderr=True)
        # Stages of several threads share one display, which is there while any of them is open.
        self._bars: RichProgress | None = None
        self._open = 0
        self._lock = threading.Lock()

    @contextmanager
    def stage(self, name: str) -> Iterator[Progress]:
        """Show the progress of one stage while the context is open."""
        base, _, number = name.partition("-")
        title = _TITLES.get(base, base) + (f", round {int(number) + 1}" if number else "")
        if not self._console.is_terminal:
            plain = LastMessage()
            start = time.monotonic()
            try:
                yield plain
            finally:  # What was reached is worth telling, also where the stage is stopped.
                seconds = time.monotonic() - start
                self._console.print(
                    f"{title:32} {seconds:6.1f} s  {harmless(plain.message)}",
                    highlight=False,
                    markup=False,
                    soft_wrap=True,
                )
        else:
            with self._display() as bars, _bar(bars, title) as bar:
                yield bar

    @contextmanager
    def _display(self) -> Iterator[RichProgress]:
        """The bars of the stages that are open."""
        with self._lock:
            if self._bars is None:
                columns = (
                    TextColumn("{task.fields[title]:32}"),
                    BarColumn(bar_width=20),
                    TimeElapsedColumn(),
                    TextColumn("{task.description}", markup=False),
                )
                self._bars = RichProgress(*columns, console=self._console)
                self._bars.start()
            bars = self._bars
            self._open += 1
        try:
            yield bars
        finally:
            with self._lock:
                self._open -= 1
                if self._open == 0:
                    bars.stop()
                    self._bars = None


@contextmanager
def _bar(bars: RichProgress, title: str) -> Iterator[_LiveBar]:
    bar = _LiveBar(bars, title)
    yield bar
    bar.done()


class _LiveBar:
    def __init__(self, bar: RichProgress, title: str) -> None:
        self._bar = bar
        self._task = bar.add_task("", title=title, total=None)

    def update(self, share: float | None, message: str = "") -> None:
        message = harmless(message)
        if share is None:
            self._bar.update(self._task, description=message)
        else:
            self._bar.update(self._task, total=1.0, completed=share, description=message)

    def done(self) -> None:
        self._bar.update(self._task, total=1.0, completed=1.0)


def show_result(kit: Kit, stage: str, checks: Sequence[Check] = ()) -> None:
    """Print what `stage` found, with its checks, and where its files are."""
    console = _console(soft_wrap=True)
    for line in _result_lines(kit, stage, checks):
        console.print(harmless(line))
    # Not part of the kit, whose files are the same on every machine.
    spent = {
        _STAGES.get(name, name): seconds
        for name, seconds in kit.processor_seconds.items()
        if seconds >= 0.1
    }
    compiling = kit.kernel_seconds
    if compiling >= 0.1 and "searching" in spent:
        # The kernels are waited for when the search begins.
        spent = {"compiling, once": compiling, **spent}
        spent["searching"] -= compiling
    if spent:
        each = ", ".join(f"{name} {seconds:.1f}" for name, seconds in spent.items())
        console.print(f"processor seconds: {each}; {processor_seconds():.1f} with the start")


def _result_lines(kit: Kit, stage: str, checks: Sequence[Check]) -> list[str]:
    from fabfold.kit.template_advice import advised_box

    notes = [*([kit.damage] if kit.damage else []), *kit.cut_solid().notes]
    lines = [f"note: {note}" for note in notes]
    if stage == "voxelize":
        template = kit.template
        even, odd = template.colours
        lines.append(
            f"template {template.name}: {len(template)} cells in "
            f"{' x '.join(map(str, template.shape))}, {even} + {odd} by checkerboard colour"
            + (f", {len(template.creases)} more folds" if template.creases else "")
        )
        for index, voxels in enumerate(kit.voxelize()):
            lines.append(
                f"voxelization {index}: {len(voxels)} voxels, {voxels.fill.mean():.0%} full, "
                f"smallest {voxels.fill.min():.0%}, {voxels.lost_volume:.1%} of the volume lost"
            )
        return lines
    built = None if stage in ("fit", "fold") else kit.join()
    planned = kit.fold() if built is None else built.planned
    tree, motion = planned.tree, planned.motion
    joinery = None if built is None else built.joinery
    lines += [f"note: {note}" for note in planned.voxels.notes if note not in notes]
    lines.append(
        f"{len(tree.source)} voxels in {len(tree.bodies)} bodies, {len(tree.hinges)} hinges, "
        f"folding into {tree.template.name} in {len(motion.moves) - 1} moves"
    )
    closure = kit.box_closure(planned)
    if closure is not None:
        more = {"quick": "normal", "normal": "thorough"}.get(kit.recipe.effort)
        hint = f"; --effort {more} looks further" if more and kit.seconds is None else ""
        lines.append(f"{closure}{hint}")
        if stage in ("fit", "export"):
            advice = advised_box(kit.cut_solid(), kit.recipe, kit.template, closure.at_most)
            lines += [f"another box suits the model better: {advice}"] if advice else []
    lines += [str(entry["text"]) for entry in kit.wish_report(planned, joinery)]
    if motion.certificate:
        lines.append(f"smallest gap on the whole path {motion.certificate['min_gap_mm']:.3f} mm")
    if checks:
        bad = [check for check in checks if not check.ok]
        lines += [
            f"FAILED {check.name}: {check.figure:g} {check.unit} "
            f"(limit {check.limit:g}): {check.note}"
            for check in bad
        ]
        lines.append(f"{len(checks) - len(bad)} of {len(checks)} checks passed")
    if kit.folder is not None:
        lines.append(f"kit: {kit.folder}")
    return lines


def show_checks(checks: Sequence[Check], about: Mapping[str, str], *, as_json: bool) -> None:
    """Print checks as a table, or as JSON with what they are about."""
    if as_json:
        verdict = "ok" if all(check.ok for check in checks) else "failed"
        entries = [asdict(check) for check in checks]
        print(json.dumps({**about, "verdict": verdict, "checks": entries}, ensure_ascii=False))
        return
    table = Table("", "check", "figure", "limit", "what it means", box=None)
    for check in checks:
        limit = "" if check.limit is None else f"{check.limit:.4g}"
        mark = "" if check.limit is None else "ok" if check.ok else "FAILED"
        note = harmless(check.note)
        table.add_row(mark, check.name, f"{check.figure:.4g} {check.unit}", limit, note)
    console = _console()
    console.print(table)
    passed = sum(check.ok for check in checks)
    which = harmless(", ".join(about.values()))
    console.print(f"{which}: {passed} of {len(checks)} checks passed")


def show_rehearsal(found: Rehearsal, tree: FoldTree, *, as_json: bool) -> None:
    """Print the torque of every hinge, and how the box keeps when it is let go."""
    if as_json:
        names = [hinge.name for hinge in tree.hinges]
        print(json.dumps({"hinges": names, **found.to_json()}, indent=1))
        return
    console = _console()
    table = Table(box=None, pad_edge=False)
    table.add_column("hinge")
    table.add_column("turning, N mm", justify="right")
    table.add_column("held, N mm", justify="right")
    for hinge, turned, held in zip(tree.hinges, found.torque_nmm, found.held_nmm, strict=True):
        table.add_row(hinge.name, f"{turned:.1f}", f"{held:.1f}")
    console.print(table)
    shut = ", ".join(found.stays_shut)
    console.print(
        f"{found.weight_g:g} g, {found.up} up, friction {found.friction:g}. Let go, the box "
        + (f"stays shut with {shut} up" if shut else "stays shut on none of its six sides")
        + "; "
        + ", ".join(f"{side} opens {angle:g}°" for side, angle in found.opens_deg.items()),
        soft_wrap=True,
    )


def show_inspection(found: Inspection, *, as_json: bool) -> None:
    """Print what a model is, as sentences or as JSON."""
    if as_json:
        print(json.dumps(found.to_json(), ensure_ascii=False))
        return
    unit = "" if found.units == "none" else f" {found.units}"
    painted = found.painted
    colours = ", ".join(painted) if isinstance(painted, list) else "one or none"
    size = " x ".join(f"{side:.4g}" for side in found.size)
    lines = {
        "file": f"{found.file}, {found.format}, {found.triangles:,} triangles",
        "size": f"{size}{unit}" + ("" if unit else " (the file names no unit)"),
        "volume": f"{found.volume:.5g}" + (f"{unit}³" if unit else ""),
        "pieces": f"{found.pieces}",
        "colours": colours,
        "thin": f"{found.thin_share:.0%} of the surface, with 64 voxels",
        "boxes": ", ".join(found.templates),
    }
    if found.objects:
        lines["objects"] = ", ".join(
            f"{number}: {name}" for number, name in enumerate(found.objects, start=1)
        )
    console = _console(soft_wrap=True)
    for name, text in lines.items():
        console.print(harmless(f"{name:8} {text}"))
    for note in found.notes:
        console.print(harmless(f"note: {note}"))
    if found.thin_share > 0.1:
        console.print("note: thin parts are thickened where they have to be (--thicken)")


def show_pareto(kit: Kit) -> None:
    """Print the Pareto list of a kit as a table, and where its pictures are."""
    console = _console(soft_wrap=True)
    found = kit.pareto()
    table = Table("pick", "joints", "surface", "bodies", "moves", "preference", box=None)
    kept = any(solution.kept is not None for solution in found)
    if kept:
        table.add_column("kept")
    for number, solution in enumerate(found, start=1):
        tree = solution.candidate.tree
        row = [
            str(number),
            str(solution.joints),
            f"{solution.surface:.2f}",
            str(len(tree.bodies)),
            str(len(solution.candidate.path)),
            f"{solution.prefer:g}",
        ]
        table.add_row(*row, *([f"{solution.kept:.0%}"] if solution.kept is not None else []))
    console.print(table)
    if kit.folder is not None:
        console.print(f"pictures: {kit.folder}/pareto-1.png and so on")
        console.print(f"fabfold export {kit.folder} --pick 1 goes on with the first")


def show_list(what: str) -> None:
    """Print the samples, templates or profiles there are.

    Raises
    ------
    RecipeError
        If `what` is none of the three.
    """
    console = Console(markup=False)
    if what == "samples":
        from fabfold.samples.builtin import sample, sample_names

        table = Table("sample", "template", "what it is", box=None)
        for known in map(sample, sample_names()):
            table.add_row(f"sample:{known.name}", known.template, known.title)
    elif what == "templates":
        from fabfold.lattice.shipped import describe, load_template, template_names

        table = Table("template", "cells", "what it is", box=None)
        table.add_row("box-AxBxC", "A × B × C", "a box of any size")
        for name in template_names():
            table.add_row(name, str(len(load_template(name))), describe(name))
    elif what == "profiles":
        from fabfold.printing.print_mode import print_mode
        from fabfold.printing.profiles import load_profile, profile_names

        table = Table("profile", "process", "printed", "clearance", "what it is", box=None)
        for name in profile_names():
            profile = load_profile(name)
            mode = print_mode(profile)
            clearance = f"{mode.profile.clearance_mm:g} mm"
            table.add_row(name, profile.process, mode.name, clearance, profile.description)
    else:
        raise RecipeError(f"cannot list {what!r}: there are samples, templates and profiles")
    console.print(table)
