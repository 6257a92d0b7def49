"""The paper's models and the samples, end to end: writes benchmarks/paper_table.md.

    python benchmarks/paper_table.py [NAME ...] [--models DIR] [--kits DIR] [--verify verify_kit.py]
                                     [--before]

Each model runs in a fresh process with an empty kit folder, on the command line's defaults.
Processor seconds are those that each stage has cost, with the processes that it started; STEP is
written beside the checks, and is counted where it ends. Memory is the largest process.
Without names every model is run; with names only those rows are measured again, and of two runs
in which the same code makes the same kit the faster one is shown. With `--before` version 0.1,
taken from the repository's history, makes each kit too, right after this version.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import resource
import shutil
import subprocess
import sys
import tarfile
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from runs import SEARCH, marked

HERE = Path(__file__).resolve().parent
SHARED = HERE.parents[1] / "shared"
#: name: (source, template, joints of the paper, core-hours of the paper)
MODELS: dict[str, tuple[str, str, int | None, int | None]] = {
    "bunny": ("bunny.stl", "box-4x4x4", 29, 245),
    "kitten": ("kitten.stl", "box-4x4x4", 34, 345),
    "dragon": ("dragon.stl", "box-4x4x4", 32, 215),
    "car": ("car.stl", "box-3x4x4", 22, 161),
    "elephant": ("elephant.stl", "box-5x5x5", 62, 1005),
}
#: The last commit of version 0.1.
BEFORE = "0a770bb"
#: Runs the command line of the version that is found first.
_EXPORT = """
import sys
if __name__ == "__main__":
    from fabfold.cli.app import main
    sys.argv = ["fabfold", "export", sys.argv[1], "--template", sys.argv[2], "-o", sys.argv[3]]
    main()
"""
STAGES = ("solid", "voxelize", "early", "fit", "fold", "join", "check", "export")
#: The default, whose rows are called by the model alone.
USUAL = "normal"


class FirstKit:
    """Listener that notes when the first kit was on disk."""

    def __init__(self) -> None:
        self._start = time.perf_counter()
        self.seconds: float | None = None

    @contextmanager
    def stage(self, name: str) -> Iterator[Any]:
        """Look at the clock when the stage of the first kit ends with one."""
        from fabfold.progress import LastMessage

        told = LastMessage()
        yield told
        if name == "early" and "box closed to" in told.message:
            self.seconds = time.perf_counter() - self._start


def run_one(source: str, template: str, kit_folder: Path, effort: str) -> dict[str, Any]:
    """Make one kit in this process and return its row."""
    from fabfold.errors import FabfoldError
    from fabfold.kit.kit import Kit

    first = FirstKit()
    row: dict[str, Any] = {"template": template, "effort": effort, "search": SEARCH}
    row["code"] = code_digest()
    start = time.perf_counter()
    kit = None
    try:
        kit = Kit.from_model(source, template=template, folder=kit_folder, effort=effort)
        kit.listener = first
        kit.export()
        row["checks_failed"] = [check.name for check in kit.check() if not check.ok]
        row["exit"] = int(bool(row["checks_failed"]))
        row["summary"] = json.loads((kit_folder / "report.json").read_text(encoding="utf-8"))[
            "summary"
        ]
    except FabfoldError as error:
        row["exit"], row["error"] = error.exit_code, str(error)
    row["total"] = time.perf_counter() - start
    row["seconds"], row["first"] = {} if kit is None else kit.processor_seconds, first.seconds
    usage = [
        resource.getrusage(who).ru_maxrss
        for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    ]
    row["peak_mib"] = max(usage) / 1024
    return row


class Before:
    """Version 0.1, unpacked from the repository's history, its kernels compiled.

    Parameters
    ----------
    folder : Path
        Where it is unpacked.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        packed = folder / "before.tar"
        command = ["git", "-C", str(HERE.parent), "archive", "-o", str(packed), BEFORE]
        if subprocess.run(command, check=False).returncode:
            sys.exit(f"--before needs the repository with its history, for commit {BEFORE} of it")
        with tarfile.open(packed) as archive:
            archive.extractall(folder / "code", filter="data")
        (folder / "export.py").write_text(_EXPORT, encoding="utf-8")
        self.row("sample:car", "box-3x4x4")  # It compiles its kernels.

    def row(self, source: str, template: str) -> dict[str, Any]:
        """Make a kit and return its seconds and what its report says."""
        from fabfold.progress import processor_seconds

        kit = self._folder / "kit"
        shutil.rmtree(kit, ignore_errors=True)
        spent, start = processor_seconds(), time.perf_counter()
        done = subprocess.run(
            [sys.executable, str(self._folder / "export.py"), source, template, str(kit)],
            capture_output=True,
            check=False,
            env={
                **os.environ,
                "PYTHONPATH": str(self._folder / "code"),
                "NUMBA_CACHE_DIR": str(self._folder / "kernels"),
            },
        )
        row: dict[str, Any] = {
            "exit": done.returncode,
            "cpu": processor_seconds() - spent,
            "total": time.perf_counter() - start,
        }
        report = kit / "report.json"
        if report.is_file():
            row["summary"] = json.loads(report.read_text(encoding="utf-8"))["summary"]
        return row


def code_digest() -> str:
    """SHA-256 of the program's sources: what got slower by a change is not hidden by older runs."""
    digest = hashlib.sha256()
    for package in ("fabfold", "hinges"):
        for path in sorted((HERE.parent / package).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()


def _kept(known: dict[str, Any] | None, row: dict[str, Any]) -> dict[str, Any]:
    """Of two runs in which the same code made the same kit the faster one; else the new one."""
    if known is None:
        return row
    kept = row
    same = ("code", "search", "exit", "verify", "summary")
    if all(known.get(key) == row.get(key) for key in same) and known["cpu"] < row["cpu"]:
        kept = known
    before = row.get("before", known.get("before"))
    return kept if before is None else {**kept, "before": before}


def before_table(rows: dict[str, dict[str, Any]]) -> list[str]:
    """Lines of Markdown of those rows that version 0.1 made too."""
    both = {name: row for name, row in rows.items() if "before" in row}
    if not both:
        return []
    lines = [
        "",
        "This version, as of the last run with `--before`, and 0.1 right after it on the same",
        "machine: processor seconds of the whole program, their ratio, and the clock. *Hinges*",
        "counts the axes. 0.1 writes no manual and no page that plays, and makes fewer checks.",
        "",
        "| model | all | 0.1 | ratio | clock | 0.1 | energy | 0.1 | hinges | 0.1 |",
        "|---|" + "--:|" * 9,
    ]
    for name, row in both.items():
        new, old = row["before"]["beside"], row["before"]
        cells = [f"{new['cpu']:.1f}", f"{old['cpu']:.1f}", f"{new['cpu'] / old['cpu']:.2f}"]
        cells += [f"{new['total']:.1f}", f"{old['total']:.1f}"]
        sides = [_facts(new), _facts(old)]
        cells += [side[0] for side in sides] + [side[1] for side in sides]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return lines


def _facts(row: dict[str, Any]) -> tuple[str, str]:
    """Energy and number of hinges of a row; where it has none, how it ended."""
    if "summary" not in row:
        return f"exit {row['exit']}", "–"
    made = row["summary"]["joints"]
    return f"{row['summary']['energy']['total']:.2f}", str(made["S"] + 2 * made["D"])


def _key(name: str, effort: str) -> str:
    """What the row of a model is called."""
    return name if effort == USUAL else f"{name}, {effort}"


def table(rows: dict[str, dict[str, Any]]) -> str:
    """Markdown of all rows."""
    lines = [
        "# The paper's models and the samples, end to end",
        "",
        "Written by `python benchmarks/paper_table.py [--effort quick]` on 2 cores, one run each",
        "(of two in which the same code makes the same kit the faster), with the defaults of",
        "`fabfold export` (seed 1) where no effort is named. Joints are",
        "single hinges + double ones, in brackets those of the paper, all single. *verify*",
        "is an independent checker of the kit folder, where it is at hand. *Closed* is the share",
        "of the box's faces that is closed, and what the same voxels allow at most. Rows with",
        "a * are of an earlier search; so is the comparison with 0.1.",
        "",
        "| model | template | voxels | joints (paper) | surface | count | total | closed | moves |"
        " carved cells | struts | gap mm | exit | verify |",
        "|---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|---|",
    ]
    for name, row in rows.items():
        paper = MODELS.get(name.partition(",")[0], ("", "", None, None))[2]
        joints = f" ({paper})" if paper else ""
        if "summary" not in row:
            lines.append(
                f"| {name} | {row['template']} | | {joints} | | | | | | | | | {row['exit']} |"
                f" {row['error']} |"
            )
            continue
        s = row["summary"]
        e, made = s["energy"], s["joints"]
        lines.append(
            f"| {marked(name, row)} | {row['template']} | {s['voxels']} |"
            f" {made['S']} + {made['D']}{joints} |"
            f" {e['surface']:.2f} | {e['count']:.2f} | {e['total']:.2f} |"
            f" {s['box_closed']:.2f} of {s['box_closed_at_most']:.2f} | {s['moves']} |"
            f" {s['carved_cells']} | {s['struts']} | {row['gap']:.3f} | {row['exit']} |"
            f" {row.get('verify', 'not run')} |"
        )
    lines += [
        "",
        "Processor seconds by stage (*early*: the first kit that folds, in a process beside the",
        "others); by the clock, when that was on disk, and when everything was, whatever else the",
        "machine was doing.",
        "",
        "| model | " + " | ".join(STAGES) + " | all | first kit, clock | all, clock | peak MiB |"
        " paper core-h |",
        "|---|" + "--:|" * (len(STAGES) + 5),
    ]
    for name, row in rows.items():
        hours = MODELS.get(name.partition(",")[0], ("", "", None, None))[3]
        cells = [f"{row['seconds'].get(stage, 0.0):.1f}" for stage in STAGES]
        lines.append(
            f"| {marked(name, row)} | "
            + " | ".join(cells)
            + f" | {sum(row['seconds'].values()):.1f} |"
            f" {'–' if row['first'] is None else format(row['first'], '.1f')} |"
            f" {row['total']:.1f} | {row['peak_mib']:.0f} |"
            f" {hours or '–'} |"
        )
    return "\n".join([*lines, *before_table(rows)]) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--models", type=Path, default=SHARED / "models" / "paper")
    parser.add_argument("--kits", type=Path, default=Path("paper-kits"))
    parser.add_argument("--verify", type=Path, default=SHARED / "tools" / "verify_kit.py")
    parser.add_argument("--before", action="store_true")
    parser.add_argument("--effort", choices=("quick", USUAL, "thorough"), default=USUAL)
    parser.add_argument("--one", nargs=3, metavar=("SOURCE", "TEMPLATE", "KIT"))
    options = parser.parse_args()
    if options.one:
        source, template, kit = options.one
        print(json.dumps(run_one(source, template, Path(kit), options.effort)))
        return

    from fabfold.progress import processor_seconds
    from fabfold.samples.builtin import sample, sample_names

    jobs = {n: (str(options.models / m[0]), m[1]) for n, m in MODELS.items()}
    jobs |= {f"sample:{n}": (f"sample:{n}", sample(n).template) for n in sample_names()}
    memory = HERE / "paper_table.json"
    rows = json.loads(memory.read_text(encoding="utf-8")) if memory.is_file() else {}
    old_version = None
    if options.before:
        folder = tempfile.TemporaryDirectory()
        old_version = Before(Path(folder.name))
    for name in options.names or jobs:
        source, template = jobs[name]
        kit = options.kits / name.replace(":", "-")
        shutil.rmtree(kit, ignore_errors=True)
        command = [sys.executable, __file__, "--effort", options.effort]
        command += ["--one", source, template, str(kit)]
        spent = processor_seconds()
        done = subprocess.run(
            command,
            capture_output=True,
            encoding="utf-8",
            check=False,
            env={"OPENBLAS_NUM_THREADS": "1", **os.environ},  # As the command line has it.
        )
        if done.returncode:
            sys.exit(f"{name}: {done.stderr}")
        row = json.loads(done.stdout.splitlines()[-1])
        row["cpu"] = processor_seconds() - spent
        if "summary" in row:
            motion = json.loads((kit / "motion.json").read_text(encoding="utf-8"))
            row["gap"] = motion["certificate"]["min_gap_mm"]
            if options.verify.is_file():
                verdict = subprocess.run(
                    [sys.executable, str(options.verify), str(kit), "--cad"],
                    capture_output=True,
                    encoding="utf-8",
                    check=False,
                )
                bad = [line for line in verdict.stdout.splitlines() if line.startswith("FAIL")]
                row["verify"] = "passes" if verdict.returncode == 0 else "; ".join(bad) or "died"
        if old_version is not None:
            beside = {key: row[key] for key in ("cpu", "total", "summary") if key in row}
            row["before"] = {**old_version.row(source, template), "beside": beside}
        print(
            f"{name}: exit {row['exit']}, {row['total']:.1f} s", row.get("verify", ""), flush=True
        )
        rows[_key(name, options.effort)] = _kept(rows.get(_key(name, options.effort)), row)
        keys = [_key(one, effort) for effort in ("quick", USUAL, "thorough") for one in jobs]
        ordered = {key: rows[key] for key in keys if key in rows}
        memory.write_text(json.dumps(ordered, indent=1) + "\n", encoding="utf-8")
        (HERE / "paper_table.md").write_text(table(ordered), encoding="utf-8")


if __name__ == "__main__":
    main()
