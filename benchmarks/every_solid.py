"""Whether every solid thing becomes a kit: writes benchmarks/every_solid.md and .json.

    python benchmarks/every_solid.py [NAME ...] [--seeds 1 2 3 4 5] [--effort quick] [--workers 2]

Each model and seed of the recipe is cut, searched, built, certified and checked in a process of its
own with one worker and the product's defaults; what an export would only write besides is left out.
A kit counts where all checks passed, one of which is a second opinion on the folding path by
another library. Results are kept in ``every_solid.json``; what is named is measured again, and
without names what is not there yet. Models are looked for in ``--models``, and left out where they
are not there; samples need nothing.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from statistics import median
from typing import Any

from runs import HERE, MODELS, SHARED, machine, machine_line, write

STAGES = ("cut", "search", "bodies", "checks")


def measure(source: str, template: str, seed: int, effort: str) -> dict[str, Any]:
    """Make one kit in this process; what came of it."""
    from fabfold.errors import FabfoldError
    from fabfold.kit.kit import Kit

    row: dict[str, Any] = {}
    seconds = row["seconds"] = {}

    def timed(stage: str, make: Callable[[], Any]) -> Any:
        start = time.process_time()
        try:
            return make()
        finally:
            seconds[stage] = round(time.process_time() - start, 1)

    try:
        kit = Kit.from_model(source, template=template, workers=1, effort=effort, seed=seed)
        timed("cut", kit.voxelize)
        planned = timed("search", kit.fold)
        closure = kit.box_closure(planned)
        row |= {
            "voxels": len(planned.tree.source),
            "energy": round(planned.tree.energy["total"], 3),
            "hinges": len(planned.tree.hinges),
            "moves": len(planned.motion.moves),
            "closed": round(closure.closed, 4),
            "at_most": round(closure.at_most, 4),
        }
        built = timed("bodies", kit.join)
        row |= {
            "bodies": len(built.joinery.bodies),
            "gap_mm": built.planned.motion.certificate["min_gap_mm"],
            "notes": list(dict.fromkeys([*kit.cut_solid().notes, *planned.voxels.notes])),
        }
        checks = timed("checks", kit.check)
        row["failed"] = [f"{check.name}: {check.note}" for check in checks if not check.ok]
    except FabfoldError as error:
        row["error"] = f"{type(error).__name__}: {error}"
    return row


def state_of(row: dict[str, Any]) -> str:
    """Why a row is no kit; empty where it is one."""
    return str(row.get("error") or "; ".join(row["failed"]))


def spread(values: list[float], digits: int) -> str:
    """Median, and least to most in brackets."""
    low, high = min(values), max(values)
    return f"{median(values):.{digits}f} ({low:.{digits}f} to {high:.{digits}f})"


def table(rows: dict[str, dict[str, Any]], facts: dict[str, Any]) -> str:
    """The page of results."""
    lines = [
        "# Every solid thing folds",
        "",
        "Written by `python benchmarks/every_solid.py`: each model with several seeds of the",
        f"recipe, `--effort {facts['effort']}`, the product's defaults. *Kits*: seeds whose bodies",
        "were built, certified on the whole folding path, and passed all checks. *Certified gap*:",
        "the least of all seeds. Other figures: the median, least and most in brackets; processor",
        "seconds of one worker: the median, two runs side by side.",
        "",
        f"Machine: {machine_line(facts)}.",
        "",
        "| model | box | kits | voxels | hinges | closed | certified gap mm | "
        + " | ".join(f"{stage} s" for stage in STAGES)
        + " |",
        "|---|---|--:|--:|--:|--:|--:|" + "--:|" * len(STAGES),
    ]
    why, kits, runs = [], 0, 0
    for name, model in MODELS.items():
        mine = rows.get(name, {})
        good = [row for row in mine.values() if not state_of(row)]
        kits, runs = kits + len(good), runs + len(mine)
        bad = {seed: state_of(row) for seed, row in mine.items() if state_of(row)}
        why += [f"- {name}, seed {seed}: {reason}" for seed, reason in bad.items()]
        if not mine:
            continue
        cells = [name, model.template, f"{len(good)} of {len(mine)}"]
        if good:
            cells += [spread([row[key] for row in good], 0) for key in ("voxels", "hinges")]
            cells += [spread([row["closed"] for row in good], 2)]
            cells += [f"{min(row['gap_mm'] for row in good):.3f}"]
            cells += [f"{median(row['seconds'][stage] for row in good):.1f}" for stage in STAGES]
        else:
            cells += ["–"] * (4 + len(STAGES))
        lines.append("| " + " | ".join(cells) + " |")
    lines += ["", f"{kits} of {runs} runs are kits."]
    if why:
        lines += ["", "## No kits", "", *why]
    notes = {
        f"- {name}: {note}"
        for name, mine in rows.items()
        for row in mine.values()
        for note in row.get("notes", [])
    }
    if notes:
        lines += ["", "## What was done to models", "", *sorted(notes)]
    return "\n".join(lines) + "\n"


def main() -> int:
    """Measure what is missing, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("names", nargs="*")
    parser.add_argument("--seeds", nargs="+", type=int, default=[1, 2, 3, 4, 5])
    parser.add_argument("--effort", default="quick")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--models", type=Path, default=SHARED)
    parser.add_argument("--out", type=Path, default=HERE / "every_solid.md")
    parser.add_argument("--one", nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        source, template, seed = options.one
        print(json.dumps(measure(source, template, int(seed), options.effort)))
        return 0
    data = options.out.with_suffix(".json")
    kept = json.loads(data.read_text("utf-8")) if data.is_file() else {"rows": {}}
    rows: dict[str, dict[str, Any]] = kept["rows"]
    lock = threading.Lock()

    def run(job: tuple[str, str, str, int]) -> None:
        name, source, template, seed = job
        call = [sys.executable, __file__, "--effort", options.effort]
        done = subprocess.run(
            [*call, "--one", source, template, str(seed)],
            capture_output=True,
            text=True,
            check=False,
        )
        row = {"error": f"crashed: {' '.join(done.stderr[-500:].split())}", "seconds": {}}
        if done.returncode == 0:
            row = json.loads(done.stdout)
        print(f"{name}, seed {seed}: {state_of(row) or 'a kit'}", flush=True)
        with lock:
            rows.setdefault(name, {})[str(seed)] = row
            write(data, {"facts": {**machine(), "effort": options.effort}, "rows": rows})

    jobs = []
    for name, model in MODELS.items():
        source = model.where(options.models)
        for seed in options.seeds if source is not None else ():
            done = str(seed) in rows.get(name, {})
            if name in options.names if options.names else not done:
                jobs.append((name, str(source), model.template, seed))
    with ThreadPoolExecutor(options.workers) as pool:
        list(pool.map(run, jobs))
    if not rows:
        parser.error(f"no such models in {options.models}")
    kept = json.loads(data.read_text("utf-8"))
    options.out.write_text(table(kept["rows"], kept["facts"]), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
