"""Take recipe and picture of finished sample kits into the gallery.

    python benchmarks/gallery.py [--kits paper-kits]

Reads the kits that ``benchmarks/paper_table.py`` left, writes ``prints/gallery/NAME.toml`` (the
recipe), ``docs/pictures/NAME.png`` (A, half-way, B as ``fabfold export`` drew them) and
``docs/gallery.md``.
"""

from __future__ import annotations

import argparse
import json
import shutil
from pathlib import Path

from fabfold.samples.builtin import sample, sample_names

ROOT = Path(__file__).resolve().parents[1]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kits", type=Path, default=Path("paper-kits"))
    kits = parser.parse_args().kits
    lines = [
        "# Gallery",
        "",
        "Every built-in sample as the model (A), half-way, and folded (B), drawn by",
        "`fabfold export` itself. The recipes are in `prints/gallery/`:",
        "`fabfold export prints/gallery/car.toml -o car-kit` makes the same kit again.",
    ]
    for name in sample_names():
        kit = kits / f"sample-{name}"
        if not (kit / "fold.png").is_file():
            print(f"{name}: no kit in {kit}")
            continue
        for source, place in (
            (kit / "kit.toml", ROOT / "prints" / "gallery" / f"{name}.toml"),
            (kit / "fold.png", ROOT / "docs" / "pictures" / f"{name}.png"),
        ):
            place.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, place)
        summary = json.loads((kit / "report.json").read_text(encoding="utf-8"))["summary"]
        lines += [
            "",
            f"## {name}",
            "",
            f"{sample(name).title[0].upper()}{sample(name).title[1:]}: {summary['voxels']} voxels, "
            f"{summary['bodies']} bodies, {summary['joints']['S']} hinges, folds into "
            f"{summary['template']} in {summary['moves']} moves.",
            "",
            f"![{name}: model, half-way, box](pictures/{name}.png)",
        ]
        print(f"{name}: taken from {kit}")
    (ROOT / "docs" / "gallery.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
