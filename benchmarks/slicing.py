"""Slice the 3MF of each kit with PrusaSlicer, headless: python benchmarks/slicing.py KIT [KIT ...].

Prints a line a kit with the slicer's exit code and the size of the G-code, and exits 1 if the
slicer refused one. The bed is made large enough for the kit; supports are on, since shape A hangs
over itself.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path


def slice_kit(kit: Path) -> bool:
    """Slice ``KIT/*.3mf``; whether the slicer took it."""
    (model,) = kit.glob("*.3mf")
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
