"""Finished trees as kits for a filament printer: writes benchmarks/apart.md.

    python benchmarks/apart.py KIT [KIT ...] [--no-slicing]

Takes the tree of each kit folder, lays it out for PLA on beds of 220 and 180 mm, puts it together
with its real pins, and slices every plate with PrusaSlicer. Processor seconds are those of this
process for each step.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

from fabfold.apart.pin_order import find_order
from fabfold.apart.pin_replay import replay_assembly
from fabfold.apart.plates import lay_out_plates, on_plate
from fabfold.errors import FabfoldError
from fabfold.export.threemf import write_3mf
from fabfold.joinery.box_hold import hold_by_magnets
from fabfold.joinery.build import build_bodies
from fabfold.joinery.loose_pins import meshes_with_pins, pin_bores, with_pins
from fabfold.joinery.magnets import MAGNETS, Pocket
from fabfold.kit.kit import open_kit
from fabfold.printing.print_mode import print_mode
from fabfold.printing.profiles import load_profile
from fabfold.progress import SilentProgress
from fabfold.proof.certify import certify

HERE = Path(__file__).resolve().parent
BEDS = (220.0, 180.0)


def sliced(path: Path, bed: float) -> dict[str, Any]:
    """What PrusaSlicer says of a plate: exit code, hours and grams."""
    with tempfile.TemporaryDirectory() as folder:
        gcode = Path(folder) / "plate.gcode"
        command = [
            "prusa-slicer", "--export-gcode", "--dont-arrange", "--nozzle-diameter", "0.4",
            "--layer-height", "0.2", "--bed-shape", f"0x0,{bed:g}x0,{bed:g}x{bed:g},0x{bed:g}",
            "--support-material", "--support-material-buildplate-only", "--fill-density", "15%",
            "--filament-type", "PLA", "--filament-density", "1.24", "--filament-diameter", "1.75",
            "--output", str(gcode), str(path),
        ]  # fmt: skip
        done = subprocess.run(command, capture_output=True, encoding="utf-8", check=False)
        if done.returncode or not gcode.is_file():
            return {"exit": done.returncode or 1, "hours": 0.0, "grams": 0.0}
        text = gcode.read_text(encoding="utf-8", errors="replace")
    grams = re.search(r"; total filament used \[g\] = ([\d.]+)", text)
    spent = re.search(r"; estimated printing time \(normal mode\) = (.*)", text)
    assert grams is not None and spent is not None
    parts = {unit: int(number) for number, unit in re.findall(r"(\d+)([dhms])", spent[1])}
    hours = 24 * parts.get("d", 0) + parts.get("h", 0) + parts.get("m", 0) / 60
    return {"exit": 0, "hours": hours, "grams": float(grams[1])}


def row_of(folder: Path, slicing: bool) -> dict[str, Any]:
    """One kit: pins, plates, seconds of each step, and what the slicer says."""
    kit = open_kit(str(folder))
    # A kit that was printed apart has the tree whose pins go in; one printed in place, the best.
    planned = kit.join().planned if kit.print_mode().apart else kit.fold()
    tree, motion = planned.tree, planned.motion
    mode = print_mode(load_profile("fdm-pla-0.4"))
    fit, seconds = mode.profile.apart, {}
    clock = time.process_time()

    def lap(name: str) -> None:
        nonlocal clock
        now = time.process_time()
        seconds[name] = now - clock
        clock = now

    row: dict[str, Any] = {"bodies": len(tree.bodies), "joints": dict(tree.joints)}
    try:
        joinery = build_bodies(
            planned.voxels, tree, motion, voxel_mm=20.0, clearance_mm=fit.clearance_mm,
            face_gap_mm=fit.face_gap_mm, pin=mode.loose_pin(),
        )  # fmt: skip
        lap("bodies")
        bores = pin_bores(tree, joinery)
        steps = find_order(tree, motion, joinery, bores, mode.pin_fit, SilentProgress())
        lap("order")
        ends = {step.pin: step.end for step in steps}
        joinery = with_pins(joinery, bores, [ends[i] for i in range(len(bores))], mode.pin_fit)
        lap("pins")
        seen = replay_assembly(tree, joinery, bores, steps, mode.pin_fit)
        lap("replay")
        proof = certify(
            tree, motion, meshes_with_pins(joinery), 20.0, joinery.origin_mm, fit.min_gap_mm
        )
        lap("proof")
        _, kept = hold_by_magnets(tree, motion, joinery, Pocket(MAGNETS["3x1"]))
        lap("magnets")
    except FabfoldError as error:
        return {**row, "error": str(error)}
    row |= {
        "pins": f"{seen.done} of {seen.pins}",
        "poses": len({step.angles_deg for step in steps}),
        "gap": proof["min_gap_mm"],
        "moves": [len(kept.free_before), len(kept.free_after), len(kept.pairs)],
        "hinges": len(tree.hinges),
        "cm3": sum(body.volume for body in joinery.bodies) / 1000,
        "beds": {},
    }
    for bed in BEDS:
        profile = mode.profile.model_copy(update={"bed_mm": (bed, bed, 250.0)})
        clock = time.process_time()
        plates = lay_out_plates(joinery, bores, profile)
        entry: dict[str, Any] = {
            "plates": plates.count,
            "supported": len(plates.supported),
            "sliced": [],
        }
        if slicing:
            with tempfile.TemporaryDirectory() as home:
                for index in range(plates.count):
                    path = Path(home) / f"plate-{index + 1}.3mf"
                    write_3mf(
                        path, on_plate(joinery, plates, index), title=path.stem, layout="apart",
                        keep_place=True,
                    )  # fmt: skip
                    if "plates" not in seconds:
                        lap("plates")
                    entry["sliced"].append(sliced(path, bed))
        row["beds"][f"{bed:g}"] = entry
    row["seconds"] = seconds
    return row


def table(rows: dict[str, dict[str, Any]]) -> str:
    """Markdown of all rows."""
    lines = [
        "# Kits for a filament printer",
        "",
        "Written by `python benchmarks/apart.py`: trees of finished kits as bodies of PLA (profile",
        "`fdm-pla-0.4`, voxels of 20 mm, pins of filament), put together with their real pins, and",
        "sliced with PrusaSlicer (0.2 mm layers, 15 % infill, support from the plate only).",
        "*Poses* is how many poses of the folding path the order of assembly uses.",
        "",
        "| kit | bodies | pins pushed in | poses | gap on the path mm | cm³ |"
        + "".join(f" plates, {bed:g} mm bed | slicer | hours | g |" for bed in BEDS)
        + " bodies with support |",
        "|---|--:|--:|--:|--:|--:|" + "--:|--:|--:|--:|" * len(BEDS) + "--:|",
    ]
    for name, row in rows.items():
        if "error" in row:
            lines.append(f"| {name} | {row['bodies']} | {row['error']} |")
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
        supported = next(iter(row["beds"].values()))["supported"]
        lines.append(
            f"| {name} | {row['bodies']} | {row['pins']} | {row['poses']} | {row['gap']:.3f} |"
            f" {row['cm3']:.0f} |" + "".join(cells) + f" {supported} |"
        )
    lines += [
        "",
        "With `--retention magnet`: hinges that move, to first order, when the box is shut, and",
        "with pairs of magnets of 3 × 1 mm; what is left is held by friction only.",
        "",
        "| kit | hinges | move when shut | with magnets | pairs |",
        "|---|--:|--:|--:|--:|",
    ]
    for name, row in rows.items():
        if "error" not in row:
            before, after, pairs = row["moves"]
            lines.append(f"| {name} | {row['hinges']} | {before} | {after} | {pairs} |")
    steps = ("bodies", "order", "pins", "replay", "proof", "plates", "magnets")
    lines += [
        "",
        "Processor seconds. *Bodies* and *proof* are made for every kit; order, pins, replay and",
        "plates are what printing apart adds.",
        "",
        "| kit | " + " | ".join(steps) + " | added |",
        "|---|" + "--:|" * (len(steps) + 1),
    ]
    for name, row in rows.items():
        if "error" in row:
            continue
        spent = [row["seconds"].get(step, 0.0) for step in steps]
        added = sum(row["seconds"].get(s, 0.0) for s in ("order", "pins", "replay", "plates"))
        cells = [f"{value:.1f}" for value in (*spent, added)]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kits", nargs="+", type=Path)
    parser.add_argument("--no-slicing", action="store_true")
    options = parser.parse_args()
    memory = HERE / "apart.json"
    rows = json.loads(memory.read_text(encoding="utf-8")) if memory.is_file() else {}
    for kit in options.kits:
        rows[kit.name] = row_of(kit, not options.no_slicing)
        print(kit.name, rows[kit.name], flush=True)
        memory.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
        (HERE / "apart.md").write_text(table(rows), encoding="utf-8")


if __name__ == "__main__":
    main()
