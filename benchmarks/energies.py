"""How good the trees are and how long they take: writes benchmarks/energies.md and its plot.

    python benchmarks/energies.py [NAME ...] [--effort normal] [--seed 1] [--joints auto]

Each model is voxelized and searched (``fabfold fit``) in a fresh process with one worker, the
paper's weights and warm kernels; by the default joints, or the `--joints` asked for, which are
printed and not kept. Seconds are processor seconds of that process.
Beside them stand the figures of before the search was changed (``energies_before.json``): one
``fabfold fit`` with one worker for each model, start of the program included. Results are kept in
``energies.json``; models that are named are measured again. Models of the paper and of others are
looked for in ``--models``, and left out where they are not there.
"""

from __future__ import annotations

import argparse
import json
import resource
import statistics
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from runs import HERE, MODELS, SEARCH, SHARED, marked

PLOT = HERE.parent / "docs" / "pictures" / "energy-over-time.svg"
#: Seconds at which the plot and the table look at the best tree so far.
MARKS = (5, 10, 20, 40, 80, 160)


def measure(source: str, template: str, effort: str, seed: int, joints: str) -> dict[str, Any]:
    """Voxelize and search one model in this process; the row of the table."""
    from fabfold.errors import FabfoldError
    from fabfold.kit.kit import Kit
    from fabfold.search import rounds
    from fabfold.search.seeds import Better, Done
    from fabfold.tree.bound import closed_share

    curve: list[tuple[float, float, int, float]] = []
    begin = 0.0

    class Watched(rounds.Tally):
        """Notes when each better tree came."""

        def on_event(self, event: Any) -> None:
            super().on_event(event)
            if isinstance(event, Better | Done) and self.best is not None:
                energy = self.best.energy["total"]
                if not curve or energy < curve[-1][1] - 1e-9:
                    seconds = round(time.process_time() - begin, 2)
                    hinges, closed = len(self.best.tree.hinges), closed_share(self.best.tree)
                    curve.append((seconds, round(energy, 3), hinges, round(closed, 4)))

    rounds.Tally = Watched  # type: ignore[misc]
    row: dict[str, Any] = {"effort": effort, "seed": seed, "search": SEARCH}
    start = time.process_time()
    options: dict[str, Any] = {"effort": effort, "seed": seed, "joints": joints}
    kit = Kit.from_model(source, template=template, workers=1, **options)
    try:
        kit.voxelize()
        begin = time.process_time()
        row["cut_s"] = round(begin - start, 1)
        planned = kit.fold()
        row["search_s"] = round(time.process_time() - begin, 1)
        closure = kit.box_closure(planned)
        row |= {
            "voxels": len(planned.tree.source),
            "energy": round(planned.tree.energy["total"], 3),
            "hinges": len(planned.tree.hinges),
            "closed": round(closure.closed, 4),
            "at_most": round(closure.at_most, 4),
        }
    except FabfoldError as error:
        row["error"] = str(error)
        row["search_s"] = round(time.process_time() - (begin or start), 1)
    row["curve"] = curve
    row["memory_mb"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
    return row


def _key(name: str, effort: str, seed: int) -> str:
    return f"{name}, {effort}, seed {seed}"


def table(rows: dict[str, dict[str, Any]], before: dict[str, dict[str, Any]]) -> str:
    """The page of results."""
    lines = [
        "# Trees: how good, and how long they take",
        "",
        "Written by `python benchmarks/energies.py`; the default joints (single hinges, and double",
        "ones where they pay; *hinges* counts the axes, of which a double one has two; joints, as",
        "the paper counts them, are in [whole kits](paper_table.md)), one worker, processor",
        "seconds.",
        "*closed* is the share to which the box is closed, *at most* what these voxels would allow",
        "whatever the joints. *Before* is the search of 0.1 at its default effort, `fabfold fit`",
        "once a model with one worker (`energies_before.json`).",
        "Seconds of both on one machine, one after the other, are in [whole kits](paper_table.md).",
        "Rows with a * are of an earlier search.",
        "",
        "| model | effort | seed | voxels | energy | before | hinges | before | closed | before "
        "| at most | first tree s | cut s | search s | MB |",
        "|" + "---|" * 15,
    ]
    gains = []
    for name in MODELS:
        for key, row in rows.items():
            if not key.startswith(name + ","):
                continue
            old = before.get(f"{name}, seed {row['seed']}", {})
            if "error" in row:
                lines.append(f"| {name} | {row['effort']} | {row['seed']} | {row['error']} |")
                continue
            cells = [
                marked(name, row),
                row["effort"],
                row["seed"],
                row["voxels"],
                f"{row['energy']:.2f}",
            ]
            cells += [f"{old['energy']:.2f}" if "energy" in old else "–"]
            cells += [row["hinges"], old.get("hinges", "–"), f"{row['closed']:.3f}"]
            cells += [f"{old['closed']:.3f}" if "closed" in old else "–", f"{row['at_most']:.3f}"]
            cells += [row["curve"][0][0], row["cut_s"], row["search_s"], row["memory_mb"]]
            lines.append("| " + " | ".join(map(str, cells)) + " |")
            if row["effort"] == "normal" and "energy" in old:
                gains.append(row["energy"] / old["energy"])
    if gains:
        energy = sorted(gains)[len(gains) // 2]
        better = sum(gain < 1 - 1e-9 for gain in gains)
        lines += [
            "",
            f"Normal effort against before: energy lower in {better} of {len(gains)} runs, median "
            f"ratio {energy:.2f}.",
        ]
    lines += medians(rows)
    lines += ["", "## Closed after so many seconds of the search (normal effort)", ""]
    lines += ["| model | seed | " + " | ".join(f"{m} s" for m in MARKS) + " |"]
    lines += ["|" + "---|" * (len(MARKS) + 2)]
    for key, row in rows.items():
        if row["effort"] != "normal" or "error" in row:
            continue
        cells = []
        for mark in MARKS:
            known = [point for point in row["curve"] if point[0] <= mark]
            cells.append(f"{known[-1][3]:.2f} ({known[-1][1]:.2f})" if known else "–")
        lines.append(f"| {key.split(',')[0]} | {row['seed']} | " + " | ".join(cells) + " |")
    lines += [
        "",
        "In brackets: energy. The same as a plot: ![](../docs/pictures/" + PLOT.name + ")",
    ]
    return "\n".join(lines) + "\n"


def medians(rows: dict[str, dict[str, Any]]) -> list[str]:
    """Table of the models that several seeds searched at normal effort."""
    lines = [
        "",
        "## Median of seeds (normal effort)",
        "",
        "*left* is what is left between *closed* and *at most*.",
        "",
        "| model | seeds | energy | hinges | closed | left | search s |",
        "|---|---|---|---|---|---|---|",
    ]
    for name in MODELS:
        found = [
            row
            for key, row in rows.items()
            if key.startswith(name + ",") and row["effort"] == "normal" and "error" not in row
        ]
        if len(found) < 3:
            continue
        cells = [name, ", ".join(str(seed) for seed in sorted(row["seed"] for row in found))]
        for value, digits in (
            ([row["energy"] for row in found], 2),
            ([row["hinges"] for row in found], 0),
            ([row["closed"] for row in found], 3),
            ([row["at_most"] - row["closed"] for row in found], 3),
            ([row["search_s"] for row in found], 1),
        ):
            cells.append(f"{statistics.median(value):.{digits}f}")
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def plot(rows: dict[str, dict[str, Any]]) -> str:
    """Closed share over processor seconds of the search, as SVG."""
    import math

    width, height, left, low = 760, 420, 50, 380
    top = 20

    def x_of(seconds: float) -> float:
        return left + (width - left - 130) * math.log(max(seconds, 0.5) / 0.5) / math.log(640)

    def y_of(closed: float) -> float:
        return low - (low - top) * (closed - 0.2) / 0.8

    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
        'font-family="system-ui, sans-serif" font-size="12">',
        f'<rect width="{width}" height="{height}" fill="#fff"/>',
    ]
    for mark in (1, *MARKS, 320):
        x = x_of(mark)
        parts.append(f'<path d="M{x:.1f} {top}V{low}" stroke="#ddd"/>')
        parts.append(f'<text x="{x:.1f}" y="{low + 16}" text-anchor="middle">{mark}</text>')
    for closed in (0.2, 0.4, 0.6, 0.8, 1.0):
        y = y_of(closed)
        parts.append(f'<path d="M{left} {y:.1f}H{width - 130}" stroke="#ddd"/>')
        parts.append(f'<text x="{left - 6}" y="{y + 4:.1f}" text-anchor="end">{closed:.1f}</text>')
    parts.append(
        f'<text x="{(left + width - 130) / 2}" y="{height - 6}" text-anchor="middle">'
        "processor seconds of the search (normal effort); share to which the box is closed</text>"
    )
    shown = [(k.split(",")[0], r) for k, r in rows.items() if r["effort"] == "normal"]
    shown = [(name, row) for name, row in shown if row["curve"] and row["seed"] == 1]
    for place, (name, row) in enumerate(shown):
        colour = f"hsl({(place * 137) % 360} 60% 42%)"
        steps = ""
        for seconds, _, _, closed in row["curve"]:
            x, y = x_of(seconds), y_of(closed)
            steps += f"M{x:.1f} {y:.1f}" if not steps else f"H{x:.1f}V{y:.1f}"
        steps += f"H{x_of(row['search_s']):.1f}"
        parts.append(f'<path d="{steps}" fill="none" stroke="{colour}" stroke-width="1.6"/>')
        y = top + 14 + 17 * place
        parts.append(f'<text x="{width - 118}" y="{y}" fill="{colour}">{name}</text>')
    return "\n".join([*parts, "</svg>"]) + "\n"


def main() -> int:
    """Measure, and write the page and the plot."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("names", nargs="*")
    parser.add_argument("--effort", default="normal")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--joints", default="auto")
    parser.add_argument("--models", type=Path, default=SHARED)
    parser.add_argument("--one", nargs=2, metavar=("SOURCE", "TEMPLATE"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print(json.dumps(measure(*options.one, options.effort, options.seed, options.joints)))
        return 0
    kept, old = HERE / "energies.json", HERE / "energies_before.json"
    rows = json.loads(kept.read_text("utf-8")) if kept.is_file() else {}
    before = json.loads(old.read_text("utf-8")) if old.is_file() else {}
    for name, model in MODELS.items():
        key = _key(name, options.effort, options.seed)
        source = model.where(options.models)
        if source is None or (name not in options.names if options.names else key in rows):
            continue
        call = [sys.executable, __file__, "--one", source, model.template]
        call += [
            "--effort",
            options.effort,
            "--seed",
            str(options.seed),
            "--joints",
            options.joints,
        ]
        done = subprocess.run(call, capture_output=True, text=True, check=False)
        if done.returncode:
            print(f"{key}: {done.stderr[-500:]}", file=sys.stderr)
            continue
        if options.joints != "auto":
            print(f"{key}, {options.joints}: {done.stdout.strip()}", flush=True)
            continue
        # Another run may have written meanwhile.
        rows = json.loads(kept.read_text("utf-8")) if kept.is_file() else {}
        rows[key] = json.loads(done.stdout)
        kept.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
        told = {k: v for k, v in rows[key].items() if k != "curve"}
        print(key, told, flush=True)
    (HERE / "energies.md").write_text(table(rows, before), encoding="utf-8")
    PLOT.write_text(plot(rows), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
