"""How far plates close the boxes of the samples, and what they weigh: writes benchmarks/fill.md.

    python benchmarks/fill.py [SAMPLE ...] [--kits DIR]

Each sample is searched quickly once. Its bodies are then made and certified with and without
``--fill``.
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path

from fabfold.files import write_text
from fabfold.kit.kit import Kit
from fabfold.samples.builtin import sample_names

HERE = Path(__file__).resolve().parent


def row(name: str, folder: Path) -> str:
    """One line of the table."""
    volume, gap, note, words = [], [], "", ""
    for fill in (False, True):
        kit = Kit.from_model(
            f"sample:{name}", effort="quick", fill=fill, folder=folder / name, workers=2
        )
        built = kit.join()
        volume.append(sum(body.volume for body in built.joinery.bodies) / 1000)
        gap.append(built.planned.motion.certificate["min_gap_mm"])
        note = next((n for n in built.joinery.notes if "open faces" in n), note)
        checks = kit.check()
        words = f"{sum(check.ok for check in checks)} of {len(checks)}"
    faces, grams, after, before = re.search(
        r"(\d+) open faces .* ([\d.]+) g in all: .* to (\d+) % instead of (\d+) %", note
    ).groups()
    return (
        f"| {name} | {faces} | {before} % | {after} % | {grams} | {volume[0]:.1f} | "
        f"{volume[1]:.1f} | {gap[0]:.3f} | {gap[1]:.3f} | {words} |"
    )


def main() -> None:
    """Run the samples and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", default=sample_names())
    parser.add_argument("--kits", type=Path, default=Path("fill-kits"))
    options = parser.parse_args()
    lines = [
        "# Open faces closed by plates",
        "",
        "Written by `python benchmarks/fill.py`: samples searched with `--effort quick`, profile",
        "`mjf-pa12`, voxels of 20 mm, plates of 0.5 mm. *Gap* is the smallest one proven on the",
        "whole path.",
        "",
        "| sample | faces closed | closed before | after | plates, g | bodies, cm³ | with plates | "
        "gap, mm | with plates | checks with plates |",
        "|---|--:|--:|--:|--:|--:|--:|--:|--:|---|",
        *(row(name, options.kits) for name in options.names),
        "",
    ]
    write_text(HERE / "fill.md", "\n".join(lines))
    print("\n".join(lines))


if __name__ == "__main__":
    main()
