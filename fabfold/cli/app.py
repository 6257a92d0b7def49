"""The command line: commands only, no logic; heavy imports stand inside the commands."""

from __future__ import annotations

import functools
import io
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fabfold.cli.command_options import (
    Actions,
    Around,
    BoxMm,
    ClearanceMm,
    Clearances,
    Closed,
    DoubleWeight,
    DropBelow,
    Effort,
    Fill,
    FitBed,
    Fuses,
    Joints,
    JointsInside,
    Json,
    Keep,
    KeepWeight,
    MadeAround,
    MadeWith,
    MagnetFit,
    MagnetName,
    Method,
    ObjectName,
    Origin,
    Output,
    Pareto,
    Pick,
    PinGrip,
    PinName,
    PinSlip,
    Pitch,
    Pose,
    Prefer,
    Print,
    ProfileName,
    Protect,
    Quiet,
    RetentionInA,
    RetentionName,
    Rotation,
    Rounds,
    Scale,
    Scheduler,
    Seed,
    Share,
    Skin,
    Slicer,
    Source,
    TemplateCells,
    TemplateName,
    Thicken,
    Time,
    TurnsFreely,
    Void,
    VoxelMm,
    Workers,
    number_or_text,
)
from fabfold.cli.model_file_check import check_model_file, is_model_file
from fabfold.cli.stopping import hear_stops, stop_asked
from fabfold.errors import (
    CheckError,
    FabfoldError,
    InputError,
    RecipeError,
    harmless,
    system_message,
)
from fabfold.version import __version__

if TYPE_CHECKING:
    from fabfold.kit.kit import Kit
    from fabfold.printing.checks import Check

__all__ = ["app", "main"]

app = typer.Typer(
    name="fabfold",
    help="Turn a 3D model into one printed object that folds into a box, and prove that it folds.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


_STOPPED = "stopped; what is done is kept, the same command goes on from there"


def _guarded(command: Callable[..., None]) -> Callable[..., None]:
    """Turn what fabfold reports, and Ctrl-C, into one sentence and an exit code."""

    @functools.wraps(command)
    def run(*args: Any, **kwargs: Any) -> None:
        try:
            command(*args, **kwargs)
            sys.stdout.flush()  # Here, so that a full disk behind it is told like any other.
        except (Exception, KeyboardInterrupt) as error:
            if stop_asked() or isinstance(error, KeyboardInterrupt):
                told, code = _STOPPED, 130
            elif isinstance(error, FabfoldError):
                told, code = harmless(str(error)), error.exit_code
            elif isinstance(error, OSError):
                _forget_stdout()
                told, code = harmless(system_message(error)), InputError.exit_code
            else:
                raise
            typer.echo(f"fabfold: {told}", err=True)
            raise typer.Exit(code) from None

    return run


def _forget_stdout() -> None:
    """What could not be written to the standard output is not tried again at the end."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _kit(source: str, output: Path | None, quiet: bool, **options: Any) -> Kit:
    from fabfold.cli.console import ConsoleListener
    from fabfold.kit.kit import open_kit

    for name in ("keep", "protect"):
        options[name] = options[name] or None
    for name in ("prefer", "void", "thicken"):
        options[name] = number_or_text(options[name])
    if output is None and not (Path(source).is_dir() or source.endswith(".toml")):
        output = Path(f"{Path(source.removeprefix('sample:')).stem}-kit")
    kit = open_kit(source, folder=output, **options)
    if not quiet:
        kit.listener = ConsoleListener()
    return kit


def _stage(name: str, summary: str) -> None:
    """Register the command of one stage; all take the same options."""

    def command(
        source: Source,
        output: Output = None,
        object: ObjectName = None,
        template: TemplateName = None,
        template_cells: TemplateCells = None,
        voxel_mm: VoxelMm = None,
        box_mm: BoxMm = None,
        scale: Scale = None,
        fit_bed: FitBed = False,
        profile: ProfileName = None,
        clearance_mm: ClearanceMm = None,
        print: Print = None,
        pin: PinName = None,
        pose: Pose = None,
        slicer: Slicer = None,
        retention: RetentionName = None,
        retention_in_a: RetentionInA = None,
        magnet: MagnetName = None,
        magnet_fit: MagnetFit = None,
        skin: Skin = None,
        fill: Fill = None,
        seed: Seed = None,
        effort: Effort = None,
        rounds: Rounds = None,
        closed: Closed = None,
        thicken: Thicken = None,
        drop_below: DropBelow = None,
        rotation: Rotation = None,
        origin: Origin = None,
        pitch: Pitch = None,
        prefer: Prefer = None,
        void: Void = None,
        keep: Keep = None,
        keep_weight: KeepWeight = None,
        protect: Protect = None,
        joints: Joints = None,
        double_weight: DoubleWeight = None,
        joints_inside: JointsInside = None,
        share: Share = None,
        pick: Pick = None,
        method: Method = None,
        actions: Actions = None,
        workers: Workers = None,
        scheduler: Scheduler = None,
        time: Time = None,
        pareto: Pareto = False,
        as_json: Json = False,
        quiet: Quiet = False,
    ) -> None:
        options = dict(locals())
        for key in ("name", "summary", "pareto", "as_json", "fit_bed"):
            options.pop(key, None)
        if name == "check" and output is None and is_model_file(source):
            check_model_file(Path(source), profile, as_json=as_json, quiet=quiet)
            return
        if as_json and name != "check":
            raise RecipeError(f"--json goes with 'fabfold check', not with {name!r}")
        options["seconds"] = options.pop("time")
        kit = _kit(**options)
        if pareto:
            _show_pareto(kit, name)
            return
        if fit_bed:
            kit = _fitted(kit, options)
        kit.run(name)
        from fabfold.cli.console import show_checks, show_result

        checks = _checks(kit, name)
        if as_json:
            show_checks(checks, {"kit": kit.recipe.name}, as_json=True)
        else:
            show_result(kit, name, checks)
        if not all(check.ok for check in checks):
            raise typer.Exit(CheckError.exit_code)

    command.__name__ = name
    app.command(name, help=summary)(_guarded(command))


def _fitted(kit: Kit, options: dict[str, Any]) -> Kit:
    """The kit, or the same with smaller voxels where its printer's bed does not hold it."""
    from fabfold.kit.bed_fit import fitting_voxel

    voxel = fitting_voxel(kit)
    if voxel is None:
        return kit
    typer.echo(f"fabfold: {voxel:g} mm voxels fit the bed of {kit.recipe.profile}", err=True)
    return _kit(**{**options, "voxel_mm": voxel, "box_mm": None, "scale": None})


def _checks(kit: Kit, stage: str) -> list[Check]:
    """Checks that a stage shows: those of the kit, and whether its files are what was proven."""
    if stage not in ("check", "export"):
        return []
    return [*kit.check(), *(kit.delivered() if stage == "check" else [])]


def _show_pareto(kit: Kit, stage: str) -> None:
    from fabfold.cli.console import show_pareto

    if stage != "fit":
        raise RecipeError(f"--pareto goes with 'fabfold fit', not with {stage!r}")
    kit.run("pareto")
    show_pareto(kit)


_stage("voxelize", "Cut the model into voxels.")
_stage("fit", "Find joint trees that carry the voxels into the template and fold.")
_stage("fold", "Take the best tree and keep its folding path.")
_stage("join", "Cut the printed bodies with their hinges, and certify the path on them.")
_stage(
    "check",
    "Check the printed bodies and replay the folding; or, of a model FILE without --output, "
    "whether the printer of --profile can make it as it lies, and what moves in it.",
)
_stage("export", "Make the whole kit: 3MF, STEP, STL, animation and report.")


@app.command()
@_guarded
def inspect(
    source: Annotated[str, typer.Argument(metavar="MODEL", help="A model file, or sample:NAME.")],
    object: ObjectName = None,
    as_json: Json = False,
) -> None:
    """Say what a model file is: format, size, colours, repairs, and the boxes that suit it."""
    from fabfold.cli.console import show_inspection
    from fabfold.samples.builtin import PREFIX, load_sample
    from fabfold.solid.inspection import inspect_model, inspect_solid

    if source.startswith(PREFIX):
        found = inspect_solid(load_sample(source.removeprefix(PREFIX)), source)
    else:
        found = inspect_model(Path(source), object or "")
    show_inspection(found, as_json=as_json)


@app.command()
@_guarded
def render(
    source: Annotated[str, typer.Argument(metavar="KIT", help="A kit folder.")],
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Ends in .mp4, .gif or .png.")
    ] = Path("fold.gif"),
    size: Annotated[str, typer.Option("--size", help="Width and height in pixels.")] = "640x480",
    quiet: Quiet = False,
) -> None:
    """Draw the folding of a kit as a film, a GIF, or a strip of three pictures."""
    from fabfold.cli.console import ConsoleListener
    from fabfold.kit.guide_files import render_kit
    from fabfold.kit.kit import open_kit
    from fabfold.progress import SilentListener

    sides = size.lower().split("x")
    if len(sides) != 2 or not all(s.isdecimal() and 64 <= int(s) <= 4096 for s in sides):
        raise RecipeError(f"--size {size}: give width and height, 64 to 4096, such as 640x480")
    listener = SilentListener() if quiet else ConsoleListener()
    built = open_kit(source).join()
    with listener.stage("render") as progress:
        even = (int(sides[0]) // 2 * 2, int(sides[1]) // 2 * 2)
        render_kit(built, output, even, progress)
    typer.echo(output)


@app.command()
@_guarded
def rehearse(
    source: Annotated[str, typer.Argument(metavar="KIT", help="A kit folder.")],
    up: Annotated[
        str, typer.Option("--up", help="Side of the model that is up: +x, -x, +y, -y, +z or -z.")
    ] = "+z",
    friction: Annotated[
        float, typer.Option("--friction", help="Coefficient between parts that touch.")
    ] = 0.3,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Fold a kit with its weight, in MuJoCo: torque of each hinge, and does the box stay shut."""
    from fabfold.cli.console import ConsoleListener, show_rehearsal
    from fabfold.kit.kit import open_kit
    from fabfold.progress import SilentListener
    from fabfold.proof.rehearsal import SIDES
    from fabfold.proof.rehearsal import rehearse as rehearsed

    if up not in SIDES:
        raise RecipeError(f"--up {up}: must be one of {', '.join(SIDES)}")
    if not 0.0 <= friction <= 10.0:
        raise RecipeError(f"--friction {friction}: must be a number from 0 to 10")
    listener = SilentListener() if quiet or as_json else ConsoleListener()
    kit = open_kit(source)
    built = kit.join()
    density = kit.print_mode().profile.density_g_cm3
    with listener.stage("rehearse") as progress:
        found = rehearsed(
            built.planned.tree, built.planned.motion, built.joinery, density, up=up,
            friction=friction, retention=built.retention, progress=progress,
        )  # fmt: skip
    show_rehearsal(found, built.planned.tree, as_json=as_json)


@app.command()
@_guarded
def studio(
    source: Annotated[
        str, typer.Argument(metavar="KIT|MODEL", help="A kit folder, a model file or sample:NAME.")
    ],
    output: Output = None,
    port: Annotated[
        int, typer.Option("--port", min=0, max=65535, help="Default: any that is free.")
    ] = 0,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")
    ] = True,
) -> None:
    """Look at a kit and change it on a page, served to this machine only."""
    from fabfold.studio.serve import serve

    with serve(source, None if output is None else str(output), port) as served:
        typer.echo(f"studio: {served.gate.address}\nCtrl-C ends it; every step is kept in the kit.")
        sys.stdout.flush()
        hear_stops(surely=True)
        served.run(browser=browser)


@app.command("list")
@_guarded
def list_things(
    what: Annotated[str, typer.Argument(help="samples, templates or profiles.")],
) -> None:
    """List the built-in samples, templates or profiles."""
    from fabfold.cli.console import show_list

    show_list(what)


@app.command()
@_guarded
def coupon(
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Ends in .3mf, .step or .stl.")
    ] = Path("coupon.3mf"),
    profile: ProfileName = None,
    clearances: Clearances = None,
    around: Around = None,
    pin: PinName = None,
) -> None:
    """Make a tolerance coupon: hinges at several clearances, and how to read them."""
    from fabfold.printing.profile_coupon import make_coupon

    for path in make_coupon(output, profile, clearances, around, pin or "1.75"):
        typer.echo(path)


@app.command()
@_guarded
def calibrate(
    turns_freely: TurnsFreely,
    profile: ProfileName = None,
    fuses: Fuses = None,
    pin_grip: PinGrip = None,
    pin_slip: PinSlip = None,
    clearances: MadeWith = None,
    around: MadeAround = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="The new profile. Default: my-PROFILE.toml."),
    ] = None,
) -> None:
    """Write your own printer profile from a printed coupon; 'export --profile FILE' uses it."""
    from fabfold.printing.calibrate import calibrate as calibrated
    from fabfold.printing.calibrate import write_profile
    from fabfold.printing.profile_coupon import coupon_clearances
    from fabfold.printing.profiles import DEFAULT_PROFILE, load_profile

    name = "" if output is None else output.stem
    known = load_profile(profile or DEFAULT_PROFILE)
    values = coupon_clearances(clearances, around)
    mine = calibrated(
        known,
        turns_freely,
        fuses_mm=fuses,
        pin_grip_mm=pin_grip,
        pin_slip_mm=pin_slip,
        name=name,
        clearances=values,
    )
    path = output or Path(f"{mine.name}.toml")
    write_profile(path, mine)
    bores = f"pins stay at {mine.apart.grip_mm:g} mm and turn at {mine.apart.slip_mm:g} mm a side"
    typer.echo(f"{path}: clearance {mine.clearance_mm:g} mm, {bores}; use it with --profile {path}")


def _version(value: bool) -> None:
    if value:
        typer.echo(f"fabfold {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    pass


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit with 0, 1, 2, 3 or 130 (see ``fabfold.errors``)."""
    hear_stops()
    # Packages start Python too (glfw does, for MuJoCo): none of them takes a numpy.py in the
    # working folder for numpy.
    os.environ["PYTHONSAFEPATH"] = "1"
    # BLAS' threads wait for each other longer than they work on matrices as small as ours.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    for stream in (sys.stdout, sys.stderr):
        # A terminal that knows ASCII only shows a question mark, and the run goes on.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    app(args=arguments)
