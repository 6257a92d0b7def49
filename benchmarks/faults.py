"""Exports that are killed at random moments: the next run ends as an undisturbed one does.

    python benchmarks/faults.py [TRIALS]

Starts ``fabfold export`` of a bar of eight voxels, kills it with SIGKILL after a random time, looks
at what it left, and runs it again to its end. Every file of the kit must then have the bytes of a
kit that nothing disturbed, and no process and no temporary file may be left. Writes
benchmarks/faults.md.
"""

from __future__ import annotations

import contextlib
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
import zipfile
from pathlib import Path

import trimesh
from runs import digests

HERE = Path(__file__).resolve().parent
BAR = (80.0, 9.6, 9.6)
#: Seconds that processes have to end: one that has just begun may still import its modules.
PATIENCE = 3
OPTIONS = ("-t", "box-2x2x2", "--effort", "quick", "-j", "2", "-q")


def command(model: Path, kit: Path) -> list[str]:
    return [sys.executable, "-m", "fabfold", "export", str(model), "-o", str(kit), *OPTIONS]


def half_written(kit: Path) -> list[str]:
    """Files under their final names that are not whole."""
    bad = []
    for path in sorted(kit.rglob("*")):
        if not path.is_file() or path.name.startswith(".part-"):
            continue
        try:
            if path.suffix == ".json":
                json.loads(path.read_text("utf-8"))
            elif path.suffix in (".3mf", ".npz"):
                with zipfile.ZipFile(path) as archive:
                    assert archive.testzip() is None
            elif path.suffix == ".stl" and path.parent.name == "bodies":
                data = path.read_bytes()
                assert len(data) == 84 + 50 * int.from_bytes(data[80:84], "little")
            elif path.suffix == ".step":
                assert b"END-ISO-10303-21" in path.read_bytes()[-64:]
        except (ValueError, AssertionError, zipfile.BadZipFile):
            bad.append(path.name)
    return bad


def processes_of(kit: Path) -> int:
    """Processes that the run of a kit has left: they have its mark in their environment."""
    found = 0
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit() and int(entry.name) != os.getpid():
            with contextlib.suppress(OSError):
                found += f"FAULTS={kit}\0".encode() in (entry / "environ").read_bytes()
    return found


def main() -> None:
    trials = int(sys.argv[1]) if len(sys.argv) > 1 else 50
    rng = random.Random(1)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        model = folder / "bar.stl"
        trimesh.creation.box(BAR).export(model)
        for kit in ("first", "whole"):  # The first may have to compile.
            start = time.monotonic()
            subprocess.run(command(model, folder / kit), check=True, capture_output=True)
            length = time.monotonic() - start
        want = digests(folder / "whole")
        stages: dict[str, int] = {}
        faults: list[str] = []
        for trial in range(trials):
            kit = folder / f"kit-{trial}"
            run = subprocess.Popen(
                command(model, kit),
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                env={**os.environ, "FAULTS": str(kit)},
            )
            time.sleep(rng.uniform(0.2, length))
            run.send_signal(signal.SIGKILL)
            run.wait()
            journal = kit / "stages" / "journal.json"
            done = len(json.loads(journal.read_text())["stages"]) if journal.is_file() else 0
            if (kit / "report.json").is_file():
                done = 99
            key = {0: "before anything was kept", 99: "at the very end"}.get(
                done, f"{done} stages kept"
            )
            stages[key] = stages.get(key, 0) + 1
            faults += [f"trial {trial}: {bad} half written" for bad in half_written(kit)]
            until = time.monotonic() + PATIENCE
            while (left := processes_of(kit)) and time.monotonic() < until:
                time.sleep(0.1)
            if left:
                faults.append(f"trial {trial}: {left} processes left after {PATIENCE} s")
            again = subprocess.run(command(model, kit), capture_output=True, check=False)
            if again.returncode:
                faults.append(f"trial {trial}: the next run ends with {again.returncode}")
            elif (found := digests(kit)) != want:
                other = sorted(k for k in {*found, *want} if found.get(k) != want.get(k))
                faults.append(f"trial {trial}: other bytes in {', '.join(other)}")
            mine = [fault for fault in faults if fault.startswith(f"trial {trial}:")]
            print(trial, key, mine or "ok", flush=True)
    lines = [
        "# Exports killed at random moments",
        "",
        f"Written by `python benchmarks/faults.py {trials}`: a bar of eight voxels, SIGKILL after",
        f"a random time of up to {length:.0f} s, then the same command again.",
        "",
        "| killed | runs |",
        "|---|--:|",
        *(f"| {key} | {count} |" for key, count in sorted(stages.items())),
        "",
        f"Faults: {len(faults)} of {trials}.",
        *(f"- {fault}" for fault in faults),
    ]
    (HERE / "faults.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
