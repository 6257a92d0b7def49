"""What a tolerance coupon costs to print: writes benchmarks/coupon.md.

    python benchmarks/coupon.py

Slices the first coupon of a profile, a second one in finer steps, and one for powder, with
PrusaSlicer's own settings for PLA at layers of 0.2 mm.
"""

from __future__ import annotations

import re
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np

from fabfold.printing.profile_coupon import coupon_clearances, make_coupon
from fabfold.solid.load import read_mesh

HERE = Path(__file__).resolve().parent
COUPONS = (
    ("first, 0.15 to 0.50", "fdm-pla-0.4", None, None),
    ("second, --around 0.3", "fdm-pla-0.4", None, 0.3),
    ("powder, 0.4 to 0.7", "sls-pa12", "0.4,0.5,0.6,0.7", None),
)


def sliced(path: Path, folder: Path) -> tuple[str, float]:
    """Printing time, and grams of filament."""
    gcode = folder / "coupon.gcode"
    command = [
        "prusa-slicer", "--export-gcode", "--nozzle-diameter", "0.4", "--layer-height", "0.2",
        "--first-layer-height", "0.2", "--fill-density", "15%", "--filament-type", "PLA",
        "--filament-density", "1.24", "--filament-diameter", "1.75", "--output", str(gcode),
        str(path),
    ]  # fmt: skip
    subprocess.run(command, capture_output=True, check=True)
    text = gcode.read_text(encoding="utf-8", errors="replace")
    spent = re.search(r"; estimated printing time \(normal mode\) = (.*)", text)
    grams = re.search(r"; total filament used \[g\] = ([\d.]+)", text)
    assert spent is not None
    assert grams is not None
    return spent[1].strip(), float(grams[1])


def main() -> None:
    lines = [
        "# What a coupon costs",
        "",
        "Written by `python benchmarks/coupon.py`: PrusaSlicer, PLA, layers of 0.2 mm. The last",
        "column is processor seconds to write the 3MF and the page.",
        "",
        "| coupon | hinges | size, mm | cm³ | printing time | g | seconds |",
        "|---|--:|---|--:|--:|--:|--:|",
    ]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for title, profile, clearances, around in COUPONS:
            start = time.process_time()
            path, _ = make_coupon(folder / "coupon.3mf", profile, clearances, around)
            spent = time.process_time() - start
            mesh = read_mesh(path)
            corners = mesh.vertices[mesh.faces]
            a, b, c = corners.transpose(1, 0, 2)
            volume = float((a * np.cross(b, c)).sum() / 6000.0)
            size = " x ".join(f"{side:.0f}" for side in np.ptp(mesh.vertices, axis=0))
            hours, grams = sliced(path, folder)
            cells = (
                title, len(coupon_clearances(clearances, around)), size, f"{volume:.1f}", hours,
                f"{grams:.1f}", f"{spent:.1f}",
            )  # fmt: skip
            lines.append("| " + " | ".join(map(str, cells)) + " |")
            print(lines[-1], flush=True)
    (HERE / "coupon.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
