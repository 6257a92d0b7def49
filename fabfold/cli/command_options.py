"""The options of the commands: their names, what they take, and what help says of them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = [
    "Actions",
    "Around",
    "BoxMm",
    "ClearanceMm",
    "Clearances",
    "Closed",
    "DoubleWeight",
    "DropBelow",
    "Effort",
    "Fill",
    "FitBed",
    "Fuses",
    "Joints",
    "JointsInside",
    "Json",
    "Keep",
    "KeepWeight",
    "MadeAround",
    "MadeWith",
    "MagnetFit",
    "MagnetName",
    "Method",
    "ObjectName",
    "Origin",
    "Output",
    "Pareto",
    "Pick",
    "PinGrip",
    "PinName",
    "PinSlip",
    "Pitch",
    "Pose",
    "Prefer",
    "Print",
    "ProfileName",
    "Protect",
    "Quiet",
    "RetentionInA",
    "RetentionName",
    "Rotation",
    "Rounds",
    "Scale",
    "Scheduler",
    "Seed",
    "Share",
    "Skin",
    "Slicer",
    "Source",
    "TemplateCells",
    "TemplateName",
    "Thicken",
    "Time",
    "TurnsFreely",
    "Void",
    "VoxelMm",
    "Workers",
    "number_or_text",
]

Source = Annotated[
    str,
    typer.Argument(
        metavar="MODEL",
        help="STL, OBJ, PLY, OFF, GLB, 3MF or STEP file; sample:NAME; a kit.toml; or a kit folder.",
        show_default=False,
    ),
]
Output = Annotated[
    Path | None,
    typer.Option("--output", "-o", metavar="KIT", help="Kit folder. Default: NAME-kit."),
]
ObjectName = Annotated[
    str | None,
    typer.Option(
        "--object",
        metavar="NAME",
        help="Of a 3MF file with several objects: the name, or the number from 1, of the one to "
        "take.",
    ),
]
TemplateName = Annotated[
    str | None,
    typer.Option(
        "--template",
        "-t",
        help="Target shape: box-AxBxC, a name of 'fabfold list templates', a .toml file, or a "
        "mesh. Default: the sample's own, else box-4x4x4.",
    ),
]
TemplateCells = Annotated[
    int | None,
    typer.Option(
        "--template-cells",
        help="Cells of a target that is a mesh. Default: the best match from 32 to 128.",
    ),
]
VoxelMm = Annotated[
    float | None, typer.Option("--voxel-mm", help="Printed side of a voxel in mm. Default: 20.")
]
BoxMm = Annotated[
    float | None,
    typer.Option(
        "--box-mm",
        help="Longest side of the finished box in mm; sets --voxel-mm.",
        show_default=False,
    ),
]
Scale = Annotated[
    float | None,
    typer.Option(
        "--scale",
        help="Size against the usual one, whose voxels are 20 mm; sets --voxel-mm.",
        show_default=False,
    ),
]
ProfileName = Annotated[
    str | None,
    typer.Option(
        "--profile",
        help="Printer and material: a name of 'fabfold list profiles', or a .toml file.",
    ),
]
ClearanceMm = Annotated[
    float | None,
    typer.Option("--clearance-mm", help="Clearance in the hinges. Default: the profile's."),
]
Print = Annotated[
    str | None,
    typer.Option(
        "--print",
        metavar="auto|in-place|apart",
        help="As one object that is closed (in-place), or body by body on plates, with pins that "
        "are pushed in (apart). Default: what the profile can (auto).",
    ),
]
PinName = Annotated[
    str | None,
    typer.Option(
        "--pin",
        metavar="1.75|2.85|rod-2|m2",
        help="Pin of bodies that are printed apart: a piece of filament or of rod, or a screw M2. "
        "Default: 1.75.",
    ),
]
Pose = Annotated[
    str | None,
    typer.Option(
        "--pose",
        metavar="a|b|auto|N",
        help="Pose in which a kit is printed in place: the model (a, the default), the box (b), "
        "after move N of the path, or the one that prints best (auto).",
    ),
]
Slicer = Annotated[
    str | None,
    typer.Option(
        "--slicer",
        metavar="any|prusa|prusa3|orca|bambu|all",
        help="Write the 3MF of a kit in place for this slicer too, as one object of named parts in "
        "the kit's colours. Default: any, which is for Bambu Studio and OrcaSlicer.",
    ),
]
RetentionName = Annotated[
    str | None,
    typer.Option(
        "--retention",
        metavar="none|magnet|friction|magnet+friction",
        help="What holds the box shut: pairs of disc magnets, as many as it takes; pins that both "
        "bodies grip (printed apart), in hinges that move; or both. Default: none.",
    ),
]
RetentionInA = Annotated[
    bool | None,
    typer.Option(
        "--retention-in-a/--retention-in-b",
        help="Magnets hold the model too, before it is folded. Default: the box only.",
        show_default=False,
    ),
]
MagnetFit = Annotated[
    str | None,
    typer.Option(
        "--magnet-fit",
        metavar="glued|enclosed",
        help="Magnets are glued into open pockets, or laid in while the print pauses at heights "
        "that are told. Default: glued.",
    ),
]
MagnetName = Annotated[
    str | None,
    typer.Option(
        "--magnet", metavar="3x1|4x2|5x2", help="Disc magnets for --retention. Default: 3x1."
    ),
]
Skin = Annotated[
    str | None,
    typer.Option(
        "--skin",
        metavar="model|lattice",
        help="Bodies with the model's surface, or plain blocks of cells with chamfered edges "
        "(lattice): exact in CAD, and small files. Default: model.",
    ),
]
Fill = Annotated[
    bool | None,
    typer.Option(
        "--fill/--no-fill",
        help="Close open faces of the box from inside, with plates as thick as the printer's wall "
        "behind faces that another voxel covers in the model. Default: no.",
        show_default=False,
    ),
]
Seed = Annotated[
    int | None, typer.Option("--seed", help="Seed of every random choice. Default: 1.")
]
Effort = Annotated[
    str | None, typer.Option("--effort", help="quick, normal (default) or thorough search.")
]
Rounds = Annotated[
    int | None, typer.Option("--rounds", help="Rounds of seeds before giving up. Default: 8.")
]
Closed = Annotated[
    float | None,
    typer.Option(
        "--closed",
        help="Search until the box is closed to this share, such as 0.85, or say it cannot be.",
        show_default=False,
    ),
]
FitBed = Annotated[
    bool,
    typer.Option(
        "--fit-bed",
        help="Make the kit smaller where it, or its largest body printed apart, is too large for "
        "the printer.",
    ),
]
Method = Annotated[
    str | None,
    typer.Option(
        "--method",
        metavar="planner|physics",
        help="How the folding path is found: planned on the lattice, or by forces that unfold both "
        "shapes in a simulation until they meet. Default: planner.",
    ),
]
Actions = Annotated[
    str | None,
    typer.Option(
        "--actions",
        metavar="FILE",
        help="With --method physics: pins, pushes and carving that help the forces, as recorded.",
        show_default=False,
    ),
]
Rotation = Annotated[
    str | None,
    typer.Option(
        "--rotation", metavar="X,Y,Z", help="Turn the model by hand, degrees about x, y, z."
    ),
]
Origin = Annotated[
    str | None,
    typer.Option(
        "--origin",
        metavar="X,Y,Z",
        help="Corner of the grid by hand, in model units after the rotation.",
    ),
]
Pitch = Annotated[float | None, typer.Option("--pitch", help="Voxel side by hand, in model units.")]
DropBelow = Annotated[
    float | None,
    typer.Option(
        "--drop-below", help="Drop cells with less material than this share. Default: 0.04."
    ),
]
Thicken = Annotated[
    str | None,
    typer.Option(
        "--thicken",
        metavar="auto|off|MM",
        help="Thicken what is too thin for walls and hinges: where nothing else works (auto), "
        "never (off), or all that is thinner than MM, in mm as printed. Default: auto.",
    ),
]
Prefer = Annotated[
    str | None,
    typer.Option(
        "--prefer",
        metavar="hinges|surface|balanced|0..1",
        help="Fewest hinges (0), the best surface (1), or between. Default: balanced (0.5).",
    ),
]
Void = Annotated[
    str | None,
    typer.Option(
        "--void",
        metavar="inside|even|surface|-1..1",
        help="Where empty space goes: inside the box (1), at its surface (-1). Default: even (0).",
    ),
]
Keep = Annotated[
    list[str] | None,
    typer.Option(
        "--keep",
        metavar="WHAT:SIDE",
        help="Show a part of the model on a side of the box: 'front:+x', 'top:+z' (front is the "
        "model's -y), or a region such as 'box(0,0,50%,100%,100%,100%):top'. Repeatable.",
    ),
]
KeepWeight = Annotated[
    float | None,
    typer.Option("--keep-weight", help="How much --keep counts; a hinge is 0.1. Default: 0.3."),
]
Protect = Annotated[
    list[str] | None,
    typer.Option(
        "--protect",
        metavar="REGION",
        help="No cut may cross this region of the model: 'sphere(x,y,z,r)', "
        "'box(x0,y0,z0,x1,y1,z1)' in model units or with % of its extent, 'painted' or "
        "'painted(#rrggbb)' for faces in another colour. Repeatable.",
    ),
]
Joints = Annotated[
    str | None,
    typer.Option(
        "--joints",
        help="Hinges to search with: S (single), S+D (double ones too), auto (double ones where "
        "they pay, the default), S90 or all (quarter turns too).",
    ),
]
DoubleWeight = Annotated[
    float | None,
    typer.Option(
        "--double-weight", help="Energy of a double hinge; a single is 0.1. Default: 0.12."
    ),
]
JointsInside = Annotated[
    bool | None,
    typer.Option(
        "--joints-inside/--joints-anywhere",
        help="No hinge on the visible faces of the box; it needs a template with some cells to "
        "spare, and finds less. Default: anywhere.",
        show_default=False,
    ),
]
Share = Annotated[
    bool | None,
    typer.Option(
        "--share/--no-share",
        help="Two partly filled voxels may share a cell of the box where their material does not "
        "overlap. Default: no.",
        show_default=False,
    ),
]
Pick = Annotated[
    int | None,
    typer.Option("--pick", min=0, help="Go on with this solution of 'fit --pareto'; 0 unpicks."),
]
Pareto = Annotated[
    bool,
    typer.Option(
        "--pareto",
        help="List the solutions between fewest joints and best surface, with a picture of each.",
    ),
]
Workers = Annotated[
    int | None,
    typer.Option(
        "--workers", "-j", help="Processes of the search. Default: one a core. Changes no result."
    ),
]
Scheduler = Annotated[
    str | None,
    typer.Option(
        "--scheduler",
        metavar="tcp://HOST:PORT",
        help="Search on the workers of this Dask scheduler instead. Changes no result.",
    ),
]
Time = Annotated[
    float | None,
    typer.Option(
        "--time",
        metavar="SECONDS",
        min=0,
        help="Search for so long, then go on with the best so far; 0 takes what earlier runs left. "
        "The result depends on how fast the machine is; without this option it never does.",
        show_default=False,
    ),
]
Json = Annotated[
    bool,
    typer.Option("--json", help="With 'check': the checks as JSON, and nothing else."),
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress, only the result.")]
Clearances = Annotated[
    str | None,
    typer.Option("--clearances", help="In mm, such as 0.2,0.3,0.4. Default: 0.15 to 0.50."),
]
Around = Annotated[
    float | None,
    typer.Option("--around", help="A second coupon in steps of 0.025 mm about this clearance."),
]
MadeWith = Annotated[
    str | None,
    typer.Option("--clearances", help="What the coupon was made with, where not the default."),
]
MadeAround = Annotated[
    float | None, typer.Option("--around", help="What the second coupon was made around.")
]
TurnsFreely = Annotated[
    float,
    typer.Option(
        "--turns-freely", help="Smallest clearance on the coupon whose hinge turns freely, mm."
    ),
]
Fuses = Annotated[
    float | None,
    typer.Option("--fuses", help="Largest clearance on the coupon whose hinge is fused, mm."),
]
PinGrip = Annotated[
    float | None,
    typer.Option(
        "--pin-grip", help="Number of the smallest bore that the pin goes into and stays in."
    ),
]
PinSlip = Annotated[
    float | None,
    typer.Option("--pin-slip", help="Number of the smallest bore that the pin turns in by itself."),
]


def number_or_text(text: str | None) -> float | str | None:
    """A number where the text of an option is one, else the text."""
    try:
        return text if text is None else float(text)
    except ValueError:
        return text
