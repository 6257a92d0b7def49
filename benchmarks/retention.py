"""What holds the box shut: writes benchmarks/retention.md.

    python benchmarks/retention.py [MODEL ...]

Each model becomes bodies of PLA (``--effort quick --profile fdm-pla-0.4 --retention
magnet+friction``). Hinges that move are counted by the linear programs that choose the magnets, and
the box is let go in MuJoCo with each of six sides up, with and without what holds it. The last
columns say how many places there would be for a snap tongue. A kit is kept in `--out`, and is read
from there when it is asked for again.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fabfold.errors import FabfoldError
from fabfold.joinery.body_poses import poses_in_mm
from fabfold.joinery.box_faces import face_meetings, is_material, meeting_sides
from fabfold.joinery.box_hold import Retention
from fabfold.joinery.cells import solids_of
from fabfold.joinery.friction_pins import pin_friction
from fabfold.kit.kit import open_kit
from fabfold.kit.stages import BuiltTree
from fabfold.proof.rehearsal import let_go
from hinges.clearance import Clearance
from hinges.exceptions import HingeError
from hinges.plan_single import SingleSpec, plan_single
from hinges.printed_pins import ConePin

HERE = Path(__file__).resolve().parent
MODELS = tuple(f"sample:{name}" for name in ("car", "duck", "elephant", "locomotive", "rabbit"))
#: A box that opens by less than this stays shut, degrees.
OPEN_DEG = 5.0
#: What a tongue of 4 mm wants on both sides: a disc of this radius filled so deep, mm.
TONGUE_MM, MORTISE_MM = 3.0, 5.0


def snap_places(built: BuiltTree) -> dict[str, int]:
    """Face meetings of the box with room for a snap, and those where a tongue could stand in A."""
    tree, joinery = built.planned.tree, built.joinery
    poses = poses_in_mm(tree, joinery, built.planned.motion.angles_deg[-1])
    solids = solids_of(joinery.bodies)
    cells = {tuple(cell) for cell in tree.source.tolist()}
    meetings = face_meetings(tree, joinery, poses)
    room = free = 0
    for meeting in meetings:
        sides = meeting_sides(meeting, meeting.middle, joinery, poses)
        if not all(
            is_material(solids[body], point + 0.02 * into, into, TONGUE_MM, MORTISE_MM)
            for body, point, into in sides
        ):
            continue
        room += 1
        ahead = [
            tuple((tree.source[voxel] - np.rint(into).astype(int)).tolist())
            for voxel, (_, _, into) in zip(meeting.voxels, sides, strict=True)
        ]
        free += any(cell not in cells for cell in ahead)
    return {"meetings": len(meetings), "room": room, "free_in_a": free}


def row_of(model: str, home: Path) -> dict[str, Any]:
    """One kit: what moves, and on how many sides it stays shut."""
    folder = home / f"{Path(model.removeprefix('sample:')).stem}-held"
    kit = open_kit(
        str(folder) if (folder / "kit.toml").is_file() else model,
        folder=folder, effort="quick", profile="fdm-pla-0.4", retention="magnet+friction",
    )  # fmt: skip
    try:
        built = kit.join()
    except FabfoldError as error:
        return {"error": str(error)}
    tree, motion, joinery = built.planned.tree, built.planned.motion, built.joinery
    retention, profile = built.retention, kit.print_mode().profile
    assert retention is not None
    everywhere = pin_friction(
        tree, joinery, motion.angles_deg[-1], retention.free_before, material=profile.material,
        density_g_cm3=profile.density_g_cm3, grip_mm=profile.apart.grip_mm,
    )  # fmt: skip
    ways: dict[str, Retention | None] = {
        "nothing": None,
        "magnets": replace(retention, friction=None),
        "friction pins": Retention(
            retention.free_before, retention.free_before, friction=everywhere
        ),
        "both": retention,
    }
    shut = {}
    for name, way in ways.items():
        opens = let_go(tree, motion, joinery, profile.density_g_cm3, retention=way)
        shut[name] = sum(angle < OPEN_DEG for angle in opens.values())
    return {
        "hinges": len(tree.hinges),
        "before": len(retention.free_before),
        "after": len(retention.free_after),
        "pairs": len(retention.pairs),
        "torque": everywhere.torque_nmm,
        "needed": everywhere.needed_nmm,
        "shut": shut,
        "snap": snap_places(built),
    }


def ridge_barrel(clearance_mm: float, interference_mm: float) -> str:
    """Smallest barrel on an edge of 20 mm whose knuckles have room for a ridge that rubs, mm."""
    for radius in np.arange(2.5, 4.0, 0.05).round(2).tolist():
        for pin in np.arange(0.8, 2.0, 0.1).round(1).tolist():
            try:
                spec = SingleSpec.read(
                    20.0, knuckles=3, radius=radius, pin=ConePin(pin), gap=clearance_mm,
                    clearance=Clearance(clearance_mm), wall=0.8, friction=interference_mm,
                )  # fmt: skip
                plan_single(spec)
            except HingeError:
                continue
            return f"{radius:g}"
    return "none"


def table(rows: dict[str, dict[str, Any]]) -> str:
    """Markdown of all rows."""
    lines = [
        "# What holds the box shut",
        "",
        "Written by `python benchmarks/retention.py`: kits of PLA printed apart",
        "(`--effort quick --profile fdm-pla-0.4 --retention magnet+friction`, magnets 3 × 1 mm).",
        "*Moves* counts hinges that move, to first order, when the faces of the box are shut;",
        "all of them get friction pins. *Pin holds* is the torque of one friction pin",
        "at the strain that PLA bears; *weight asks* the largest torque of the weight about any",
        "hinge that moves. *Stays shut*: sides of six that can be up without a hinge opening by 5°",
        "when the box is let go in MuJoCo, with friction of 0.3 between bodies.",
        "",
        "| kit | hinges | moves | with magnets | pairs | pin holds N mm | weight asks N mm | stays "
        "shut, nothing | magnets | friction pins | both |",
        "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|",
    ]
    for name, row in rows.items():
        if "error" in row:
            lines.append(f"| {name} | {row['error']} |")
            continue
        cells = [row[key] for key in ("hinges", "before", "after", "pairs", "torque", "needed")]
        cells += [f"{count} of 6" for count in row["shut"].values()]
        lines.append(f"| {name} | " + " | ".join(str(cell) for cell in cells) + " |")
    lines += [
        "",
        "Places for a snap tongue of 4 mm: cell faces of two bodies that meet in the box, those",
        "with room for tongue and mortise on both sides, and those of them where one side has no",
        "other cell in front of it in the model, so that a tongue could stand there.",
        "",
        "| kit | faces that meet | with room | free in the model |",
        "|---|--:|--:|--:|",
    ]
    for name, row in rows.items():
        if "snap" in row:
            lines.append(f"| {name} | " + " | ".join(str(n) for n in row["snap"].values()) + " |")
    lines += [
        "",
        "Ridges that rub in hinges printed in place, on edges of 20 mm: radius of the smallest",
        "barrel that has room for them, mm, by how deep they press (`hinges` takes 0.07).",
        "",
        "| clearance mm | 0.03 mm | 0.07 mm |",
        "|--:|--:|--:|",
    ]
    for clearance in (0.3, 0.5, 0.6):
        cells = [ridge_barrel(clearance, press) for press in (0.03, 0.07)]
        lines.append(f"| {clearance:g} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure the models that are named, or the samples."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("models", nargs="*", default=list(MODELS))
    parser.add_argument("--out", type=Path, default=Path("retention-kits"))
    options = parser.parse_args()
    rows: dict[str, dict[str, Any]] = {}
    for model in options.models:
        rows[Path(model.removeprefix("sample:")).stem] = row_of(model, options.out)
        print(model, json.dumps(rows[Path(model.removeprefix("sample:")).stem]), flush=True)
    (HERE / "retention.md").write_text(table(rows), encoding="utf-8")


if __name__ == "__main__":
    main()
