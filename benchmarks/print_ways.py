"""Kits printed in place and apart, whole, checked and sliced: writes benchmarks/print_ways.md.

    python benchmarks/print_ways.py MODEL [MODEL ...] [--joints S+D] [--effort quick]
                                    [--home print-kits] [--verify SCRIPT] [--no-slicing]

Each model is exported in place for Multi Jet Fusion (``HOME/NAME/in-place``), and its tree again
body by body for PLA on a bed of 220 mm (``HOME/NAME/apart``); for a bed of 180 mm its bodies are
laid out anew. Every plate is sliced with PrusaSlicer. ``--verify`` names a script that is given
each kit folder and says ``0 failed`` in its last line where all is well. Processor seconds are
those of this process and of all that it started. Rows of models that are not named stay.
"""

from __future__ import annotations

import argparse
import json
import resource
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from apart import sliced

from fabfold.apart.plates import lay_out_plates, on_plate
from fabfold.errors import FabfoldError
from fabfold.export.threemf import write_3mf
from fabfold.joinery.loose_pins import pin_bores
from fabfold.kit.kit import Kit, open_kit
from fabfold.printing.print_pose import print_pose

HERE = Path(__file__).resolve().parent
SMALL_BED = 180.0


def seconds() -> float:
    """Processor seconds so far, of this process and those that it started."""
    spent = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(usage.ru_utime + usage.ru_stime for usage in spent)


def exported(kit: Kit, folder: Path, verify: Path | None) -> dict[str, Any]:
    """Export a kit; its figures, its checks, and what another program says of it."""
    start = seconds()
    kit.export(folder)
    built, checks = kit.join(), kit.check()
    tree = built.planned.tree
    row = {
        "bodies": len(tree.bodies),
        "joints": dict(tree.joints),
        "gap": built.planned.motion.certificate["min_gap_mm"],
        "cm3": sum(body.volume for body in built.joinery.bodies) / 1000,
        "refused": len(built.refused),
        "checks": [sum(check.ok for check in checks), len(checks)],
        "failed": [check.name for check in checks if not check.ok],
        "seconds": seconds() - start,
    }
    if verify is not None:
        done = subprocess.run(
            [sys.executable, str(verify), str(folder)],
            capture_output=True, encoding="utf-8", check=False,
        )  # fmt: skip
        row["verified"] = (done.stdout.strip().splitlines() or ["no answer"])[-1]
    return row


def in_place_row(kit: Kit, folder: Path, verify: Path | None) -> dict[str, Any]:
    """The kit for a powder printer, and the pose in which it would print best."""
    row = exported(kit, folder, verify)
    built, profile = kit.join(), kit.print_mode().profile
    tree, motion, joinery = built.planned.tree, built.planned.motion, built.joinery
    row["poses"] = {}
    for asked in ("a", "b", "auto"):
        pose = print_pose(tree, motion, joinery, profile, asked)
        row["poses"][asked] = [pose.name, pose.box_cm3, pose.narrow_mm2]
    row["grams"] = row["cm3"] * profile.density_g_cm3
    return row


def apart_row(kit: Kit, folder: Path, verify: Path | None, slicing: bool) -> dict[str, Any]:
    """The same tree for a filament printer: pins, plates, and what the slicer says."""
    row = exported(kit, folder, verify)
    built = kit.join()
    tree, joinery = built.planned.tree, built.joinery
    assert built.apart is not None
    seen = built.apart.replay
    row |= {
        "pins": f"{seen.done} of {seen.pins}",
        "poses": len({step.angles_deg for step in built.apart.steps}),
        "beds": {},
    }
    plates = built.apart.plates
    files = sorted(folder.glob("plate-*.3mf"))
    row["beds"]["220"] = {
        "plates": plates.count,
        "supported": len(plates.supported),
        "sliced": [sliced(path, 220.0) for path in files] if slicing else [],
    }
    small = kit.print_mode().profile.model_copy(update={"bed_mm": (SMALL_BED, SMALL_BED, 180.0)})
    plates = lay_out_plates(joinery, pin_bores(tree, joinery), small)
    entry: dict[str, Any] = {"plates": plates.count, "supported": len(plates.supported)}
    entry["sliced"] = []
    with tempfile.TemporaryDirectory() as home:
        for index in range(plates.count if slicing else 0):
            path = Path(home) / f"plate-{index + 1}.3mf"
            write_3mf(
                path, on_plate(joinery, plates, index), title=path.stem, layout="apart",
                keep_place=True,
            )  # fmt: skip
            entry["sliced"].append(sliced(path, SMALL_BED))
    row["beds"]["180"] = entry
    return row


def rows_of(model: str, options: argparse.Namespace) -> dict[str, Any]:
    """Both kits of a model."""
    name = name_of(model, options.joints)
    home = options.home / name
    home.mkdir(parents=True, exist_ok=True)
    rows: dict[str, Any] = {"effort": options.effort, "joints": options.joints}
    asked = {"joints": options.joints, "effort": options.effort}
    try:
        kit = open_kit(model, folder=home / "in-place", profile="mjf-pa12", **asked)
        rows["in-place"] = in_place_row(kit, home / "in-place", options.verify)
        # The tree and its path are kept: only what follows from the printer is made again.
        shutil.copytree(home / "in-place" / "stages", home / "apart" / "stages", dirs_exist_ok=True)
        again = open_kit(model, folder=home / "apart", profile="fdm-pla-0.4", **asked)
        rows["apart"] = apart_row(again, home / "apart", options.verify, not options.no_slicing)
    except FabfoldError as error:
        rows["error"] = str(error)
    return rows


def name_of(model: str, joints: str) -> str:
    """What a model's rows and folders are called."""
    stem = model.replace(":", "-") if model.startswith("sample:") else Path(model).stem
    return stem if joints == "S" else f"{stem} {joints}"


def passed(row: dict[str, Any]) -> str:
    """Checks that passed, and what another program says."""
    good, every = row["checks"]
    return f"{good} of {every} | {row.get('verified', '–')}"


def table(rows: dict[str, dict[str, Any]]) -> str:
    """Markdown of all rows."""
    lines = [
        "# Kits in place and apart",
        "",
        "Written by `python benchmarks/print_ways.py`: every model exported in place (`mjf-pa12`),",
        "and its tree body by body for PLA (`fdm-pla-0.4`, voxels of 20 mm, pins of filament).",
        "*Checks* are those of the report; *verified* is what a program that shares no code with",
        "fabfold says of the kit folder. Models in italics were searched with `--effort quick`.",
        "",
        "## In place",
        "",
        "*A* and *B*: box around the model and around the folded kit, and the surface that has",
        "nothing but the gap before it; *auto* is the pose that `--pose auto` takes.",
        "",
        "| kit | bodies | joints | gap mm | cm³ | g | checks | verified | A cm³ | A cm² | B cm³ |"
        " B cm² | auto | processor s |",
        "|---|--:|---|--:|--:|--:|---|---|--:|--:|--:|--:|---|--:|",
    ]
    for name, both in rows.items():
        row = both.get("in-place")
        if row is None:
            lines.append(f"| {shown(name, both)} | {both['error']} |")
            continue
        poses = row["poses"]
        cells = [f"{poses[p][1]:.0f} | {poses[p][2] / 100:.0f}" for p in ("a", "b")]
        lines.append(
            f"| {shown(name, both)} | {row['bodies']} | {joints(row)} | {row['gap']:.3f} |"
            f" {row['cm3']:.0f} | {row['grams']:.0f} | {passed(row)} | {cells[0]} | {cells[1]} |"
            f" {poses['auto'][0]} | {row['seconds']:.0f} |"
        )
    lines += [
        "",
        "## Apart",
        "",
        "Plates sliced with PrusaSlicer (0.2 mm layers, 15 % infill, support from the plate only).",
        "*Poses* is how many poses of the folding path the order of assembly uses.",
        "",
        "| kit | bodies | joints | pins pushed in | poses | gap mm | cm³ | checks | verified |"
        + "".join(f" plates, {bed} mm bed | slicer | hours | g |" for bed in ("220", "180"))
        + " bodies with support | processor s |",
        "|---|--:|---|--:|--:|--:|--:|---|---|" + "--:|--:|--:|--:|" * 2 + "--:|--:|",
    ]
    for name, both in rows.items():
        row = both.get("apart")
        if row is None:
            if "in-place" in both:
                lines.append(f"| {shown(name, both)} | {both['error']} |")
            continue
        cells = []
        for entry in row["beds"].values():
            done = entry["sliced"]
            codes = {str(plate["exit"]) for plate in done}
            hours, grams = (sum(plate[key] for plate in done) for key in ("hours", "grams"))
            cells.append(
                f" {entry['plates']} | exit {', '.join(sorted(codes)) or '–'} | {hours:.1f} |"
                f" {grams:.0f} |"
            )
        lines.append(
            f"| {shown(name, both)} | {row['bodies']} | {joints(row)} | {row['pins']} |"
            f" {row['poses']} | {row['gap']:.3f} | {row['cm3']:.0f} | {passed(row)} |"
            + "".join(cells) + f" {row['beds']['220']['supported']} | {row['seconds']:.0f} |"
        )  # fmt: skip
    lines += ["", *failures(rows)]
    return "\n".join(lines).rstrip() + "\n"


def failures(rows: dict[str, dict[str, Any]]) -> list[str]:
    """A line for each check that failed."""
    return [
        f"{name}, {way}: failed {', '.join(both[way]['failed'])}."
        for name, both in rows.items()
        for way in ("in-place", "apart")
        if both.get(way, {}).get("failed")
    ]


def shown(name: str, both: dict[str, Any]) -> str:
    """A model's name, in italics where it was searched quickly."""
    return f"*{name}*" if both["effort"] == "quick" else name


def joints(row: dict[str, Any]) -> str:
    """Joints such as ``12 S, 3 D``."""
    return ", ".join(f"{count} {kind}" for kind, count in row["joints"].items() if count)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("models", nargs="*")
    parser.add_argument("--joints", default="S")
    parser.add_argument("--effort", default="normal")
    parser.add_argument("--home", type=Path, default=Path("print-kits"))
    parser.add_argument("--verify", type=Path)
    parser.add_argument("--no-slicing", action="store_true")
    options = parser.parse_args()
    memory = HERE / "print_ways.json"
    rows = json.loads(memory.read_text(encoding="utf-8")) if memory.is_file() else {}
    for model in options.models:
        name = name_of(model, options.joints)
        rows[name] = rows_of(model, options)
        print(name, rows[name], flush=True)
        memory.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    (HERE / "print_ways.md").write_text(table(rows), encoding="utf-8")


if __name__ == "__main__":
    main()
