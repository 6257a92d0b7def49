"""Slice the 3MF of each kit with PrusaSlicer, headless: python benchmarks/slicing.py KIT [KIT ...].

Prints a line a file with the slicer's exit code and the size of the G-code, and exits 1 if the
slicer refused one: ``NAME.3mf`` of a kit that is printed in place, every plate of one that is not.
The bed is made large enough for the kit; supports are on, since shape A hangs over itself.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path


def slice_kit(kit: Path) -> bool:
    """Slice what is to be printed; whether the slicer took everything."""
    report = json.loads((kit / "report.json").read_text(encoding="utf-8"))
    if report["summary"]["print"] == "apart":
        verdicts = [slice_file(path) for path in sorted(kit.glob("plate-*.3mf"))]
        return all(verdicts)
    return slice_file(kit / f"{report['summary']['model']}.3mf")


def slice_file(model: Path) -> bool:
    """Slice one file; whether the slicer took it."""
    with tempfile.TemporaryDirectory() as folder:
        gcode = Path(folder) / "kit.gcode"
        command = [
            "prusa-slicer", "--export-gcode", "--center", "250,250",
            "--bed-shape", "0x0,500x0,500x500,0x500", "--max-print-height", "500",
            "--support-material", "--layer-height", "0.3", "--first-layer-height", "0.3",
            "--fill-density", "5%", "--output", str(gcode), str(model),
        ]  # fmt: skip
        start = time.perf_counter()
        done = subprocess.run(command, capture_output=True, encoding="utf-8", check=False)
        size = gcode.stat().st_size if gcode.is_file() else 0
        seconds = time.perf_counter() - start
        good = done.returncode == 0 and size > 0
        print(
            f"{model}: PrusaSlicer exit {done.returncode}, {size / 1e6:.1f} MB of G-code, "
            f"{seconds:.0f} s"
        )
        if not good:
            print(done.stdout[-2000:], done.stderr[-2000:], sep="\n")
        return good


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    verdicts = [slice_kit(Path(kit)) for kit in sys.argv[1:]]
    sys.exit(not all(verdicts))
