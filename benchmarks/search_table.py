"""Trees that fold, seed by seed: writes benchmarks/search_table.md and .json.

    python benchmarks/search_table.py [--models bunny car ...] [--seeds 1 2 3 4 5] [--seconds 60]
        [--joints S S+D] [--work DIR] [--only-table]

Every run searches one model with one seed and one set of joints for so many seconds of one core,
as the product does, and notes when each better tree came. Then the first and the best tree of the
run are built, proven by the swept test, and looked at by an independent check every degree.
Everything is kept in the work folder, one JSON a run: what is there is not made again (a run with
fewer seconds than now asked for is), and the table is made of all that is there.

Groups of models: paper (the paper's), dev (the ten others).
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from statistics import median
from typing import Any

import runs
from runs import DEV, HERE, MODELS, PAPER

SEEDS = (1, 2, 3, 4, 5)
#: Seconds of `MARK_CORES` cores, for all seeds of a row together, at which the best is told.
MARKS = (60.0, 300.0)
MARK_CORES = 2
#: The same in processor seconds of each of these runs, which all get as many.
CORE_MARKS = tuple(mark * MARK_CORES / len(SEEDS) for mark in MARKS)


def core_seconds(mark: float) -> float:
    """Processor seconds of each run at a mark, when all seeds of a row run side by side."""
    return mark * MARK_CORES / len(SEEDS)


def path_of(work: Path, kind: str, name: str, joints: str, seed: int) -> Path:
    return work / kind / f"{name}-{joints}-{seed}.json"


def do_run(options: argparse.Namespace) -> None:
    """One run, in a process of its own."""
    name, joints, seed = options.run[0], options.run[1], int(options.run[2])
    found = runs.timed_run(MODELS[name], options.work / name, seed, joints, options.seconds)
    runs.write(path_of(options.work, "runs", name, joints, seed), found)


def do_proof(options: argparse.Namespace) -> None:
    """Build and prove what one run found."""
    name, joints, seed = options.proof[0], options.proof[1], int(options.proof[2])
    run = runs.read(path_of(options.work, "runs", name, joints, seed))
    mark = [run["seconds"], len(run["events"])]
    before = runs.read(path_of(options.work, "proofs", name, joints, seed))
    if before and before["run"] != mark:
        before = None
    where = (MODELS[name], options.work / name)
    found = runs.proven(*where, run, options.prove, options.gap_step, before)
    found["run"] = mark
    runs.write(path_of(options.work, "proofs", name, joints, seed), found)


def missing(options: argparse.Namespace, names: list[str]) -> list[tuple[str, str, int]]:
    out = []
    for seed in options.seeds:
        for name in names:
            for joints in options.joints:
                run = runs.read(path_of(options.work, "runs", name, joints, seed))
                if run is None or (run["seconds"] < options.seconds and "error" not in run):
                    out.append((name, joints, seed))
    return out


def unproven(options: argparse.Namespace, names: list[str]) -> list[tuple[str, str, int]]:
    out: list[tuple[str, str, int]] = []
    if not options.prove:
        return out
    for seed in options.seeds:
        for name in names:
            for joints in options.joints:
                run = runs.read(path_of(options.work, "runs", name, joints, seed))
                proof = runs.read(path_of(options.work, "proofs", name, joints, seed))
                if not run or not run["events"]:
                    continue
                fresh = proof and proof["run"] == [run["seconds"], len(run["events"])]
                if not fresh or any(what not in proof for what in options.prove):
                    out.append((name, joints, seed))
    return out


def measure(options: argparse.Namespace, names: list[str]) -> None:
    """Make all runs and proofs that are missing."""
    base = [sys.executable, __file__, "--work", str(options.work)]
    base += ["--seconds", str(options.seconds), "--gap-step", str(options.gap_step)]
    base += ["--prove", *options.prove]
    # Voxelizations first, so that no two runs make the same one.
    fresh = [n for n in names if not (options.work / n / "voxelize-seconds.json").is_file()]
    runs.side_by_side([[*base, "--voxels", n] for n in fresh], options.workers, fresh)
    for kind, left in (("run", missing), ("proof", unproven)):
        todo = left(options, names)
        runs.side_by_side(
            [[*base, f"--{kind}", name, joints, str(seed)] for name, joints, seed in todo],
            options.workers,
            [f"{kind} {name} {joints} seed {seed}" for name, joints, seed in todo],
        )


# --- the table --------------------------------------------------------------------------------


def collect(work: Path) -> dict[str, Any]:
    """All runs that are there, without their trees, joined with their proofs."""
    out: dict[str, Any] = {}
    for name in MODELS:
        for joints in ("S", "S+D"):
            for seed in SEEDS:
                run = runs.read(path_of(work, "runs", name, joints, seed))
                if run is None:
                    continue
                run.pop("trees")
                run["proof"] = runs.read(path_of(work, "proofs", name, joints, seed))
                run["voxelize"] = runs.read(work / name / "voxelize-seconds.json")
                out.setdefault(name, {}).setdefault(joints, {})[str(seed)] = run
    return out


def first_certified(run: dict[str, Any]) -> float | None:
    proof = run["proof"]
    if not proof or proof.get("first") is None:
        return None
    return float(run["events"][proof["first"]]["cpu"])


def length(run: dict[str, Any]) -> float:
    """Processor seconds that a run had."""
    return float(min(run["seconds"], run["cpu"]))


def best_at(run: dict[str, Any], seconds: float) -> dict[str, Any] | None:
    """Best tree after so many processor seconds of the run; None where there was none yet."""
    found = [event for event in run["events"] if event["cpu"] <= seconds]
    return found[-1] if found else None


def voxels_of(run: dict[str, Any], event: dict[str, Any]) -> int:
    """Number of voxels of the voxelization that a tree joins."""
    option = {search_seed: option for search_seed, option, *_ in run["ended"]}
    return int(run["voxels"][option[event["seed"]]])


def joints_of(event: dict[str, Any]) -> int:
    return int(sum(event["joints"].values()))


def spread(values: list[float], form: str = "{:.0f}") -> str:
    """Least of some values, and their median in brackets; infinite where there was no tree."""
    told = ["–" if v == float("inf") else form.format(v) for v in (min(values), median(values))]
    return told[0] if told[0] == "–" else f"{told[0]} ({told[1]})"


def at_mark(entries: list[dict[str, Any]], mark: float) -> list[str]:
    """Joints and energy of the best trees at a mark, of the runs that were as long."""
    long = [run for run in entries if length(run) >= mark - 0.5]
    if not long:
        return ["–", "–"]
    best = [best_at(run, mark) for run in long]
    some = "" if len(long) == len(entries) else f" of {len(long)}"
    return [
        spread([float("inf") if event is None else joints_of(event) for event in best]) + some,
        spread([float("inf") if event is None else event["total"] for event in best], "{:.2f}")
        + some,
    ]


def first_of(run: dict[str, Any]) -> float:
    """Seconds to the first certified tree, or to the first that folds where none was proven."""
    if run["proof"]:
        found = first_certified(run)
        return float("inf") if found is None else found
    return float(run["events"][0]["cpu"]) if run["events"] else float("inf")


def seconds_of(entries: list[dict[str, Any]]) -> tuple[str, str]:
    """Median and worst seconds to the first tree; a run without one counts as endless.

    Of runs that were put to the proof the first certified one, of others the first that folds.
    """
    times = sorted(first_of(run) for run in entries)
    longest = max(run["seconds"] for run in entries)

    def told(value: float) -> str:
        return f"> {longest:g}" if value == float("inf") else f"{value:.1f}"

    return told(median(times)), told(times[-1])


def told_range(values: list[int]) -> str:
    """Least and largest."""
    low, high = min(values), max(values)
    return f"{low}" if low == high else f"{low}–{high}"


def marks_of(measured: list[dict[str, Any]]) -> tuple[float, ...]:
    """Marks that any of some runs reaches; the end of the longest where that is none."""
    longest = max((length(run) for run in measured), default=CORE_MARKS[0])
    return tuple(m for m in MARKS if core_seconds(m) <= longest + 0.5) or (
        round(longest * len(SEEDS) / MARK_CORES),
    )


def row(name: str, joints: str, by_seed: dict[str, Any], marks: tuple[float, ...]) -> str:
    model, entries = MODELS[name], list(by_seed.values())
    if all("error" in run for run in entries):
        return f"| {name} | {joints} | {model.template} | | {entries[0]['error']} |"
    entries = [run for run in entries if "error" not in run]
    certified = [run for run in entries if first_certified(run) is not None]
    middle, worst = seconds_of(entries)
    cells = [
        name,
        joints,
        f"{told_range(entries[0]['voxels'])} in {model.template}",
        f"{sum(bool(run['events']) for run in entries)} of {len(entries)}",
        f"{len(certified)} of {sum(bool(run['proof']) for run in entries)}",
        middle,
        worst,
        f"{model.aim_seconds:g}" if model.aim_seconds else "–",
    ]
    for mark in marks:
        cells += at_mark(entries, core_seconds(mark))
    sizes = [voxels_of(run, run["events"][-1]) for run in entries if run["events"]]
    cells.append(f"{median(sizes):.0f}" if sizes else "–")
    proofs = [p for run in entries if run["proof"] for p in run["proof"]["tried"].values()]
    refused = sum(not p["ok"] for p in proofs)
    proofs = [p for p in proofs if p["ok"]]
    bests = [run["proof"]["best"] for run in entries if run["proof"] and "best" in run["proof"]]
    cells += [
        f"{sum(b is not None for b in bests)} of {len(bests)}" if bests else "–",
        f"{refused}",
        f"{model.aim_joints}" if model.aim_joints else "–",
        f"{model.paper_joints}" if model.paper_joints else "–",
        f"{model.paper_hours}" if model.paper_hours else "–",
        f"{min(p['proven_mm'] for p in proofs):.3f}" if proofs else "–",
        f"{min(p['sampled_mm'] for p in proofs):.3f}" if proofs else "–",
        f"{median(p['seconds'] for p in proofs):.0f}" if proofs else "–",
        f"{entries[0]['voxelize']:.1f}" if entries[0]["voxelize"] else "–",
    ]
    return "| " + " | ".join(cells) + " |"


def head(marks: tuple[float, ...]) -> list[str]:
    cells = ["model", "joints", "voxels", "folds", "certified", "first s, median", "worst", "aim"]
    for mark in marks:
        cells += [f"joints {mark:g} s", f"energy {mark:g} s"]
    cells += ["voxels of the best", "best certified", "refused", "aim", "paper", "paper core-h"]
    cells += ["proven mm", "sampled mm", "build s", "voxels s"]
    return ["| " + " | ".join(cells) + " |", "|---|---|---|" + "--:|" * (len(cells) - 3)]


def compared(data: dict[str, Any]) -> list[str]:
    """Surface energy with double hinges against single hinges alone, seed by seed."""
    lines = []
    for name, kinds in data.items():
        pairs = [
            (run, kinds["S+D"][seed])
            for seed, run in kinds.get("S", {}).items()
            if seed in kinds.get("S+D", {})
        ]
        pairs = [pair for pair in pairs if not any("error" in run for run in pair)]
        if not pairs:
            continue
        # The longer runs are told as they were when the shortest ended.
        seconds = min(length(run) for pair in pairs for run in pair)
        found = [(best_at(one, seconds), best_at(two, seconds)) for one, two in pairs]
        both = [(one, two) for one, two in found if one is not None and two is not None]
        told = f"| {name} | {seconds:.0f} | {len(both)} of {len(pairs)} |"
        if not both:
            lines.append(f"{told} – | – | – | – | – | – |")
            continue
        single = median(one["surface"] for one, _ in both)
        double = median(two["surface"] for _, two in both)
        doubles = median(two["joints"].get("D", 0) for _, two in both)
        counts = [median(joints_of(pair[k]) for pair in both) for k in (0, 1)]
        change = f"{100 * (double / single - 1):+.0f} %" if single else "–"
        lines.append(
            f"{told} {single:.2f} | {double:.2f} | {change} | {counts[0]:.0f} | {counts[1]:.0f} |"
            f" {doubles:.0f} |"
        )
    if not lines:
        return []
    return [
        "",
        "## Surface energy, double hinges beside single ones",
        "",
        "Eq. 8, median of the seeds' best trees, at as many processor seconds of each run (those",
        "of the shortest); of the seeds that have a tree of both kinds by then. The aim is a third",
        "less.",
        "",
        "| model | core s | seeds | surface S | surface S+D | change | joints S | joints S+D |"
        " of these double |",
        "|---|--:|--:|--:|--:|--:|--:|--:|--:|",
        *lines,
    ]


def refusals(data: dict[str, Any]) -> list[str]:
    """Runs without a certified tree, and why."""
    lines = []
    for name, kinds in data.items():
        for joints, by_seed in kinds.items():
            for seed, run in by_seed.items():
                if "error" in run or first_certified(run) is not None:
                    continue
                proof = run["proof"]
                if not run["events"]:
                    why = f"no tree folds in {run['seconds']:g} s"
                elif not proof:
                    continue  # not put to the proof
                else:
                    tried = list(proof["tried"].values())
                    why = f"{len(tried)} trees refused on the bodies: {tried[-1]['why']}"
                lines.append(f"- {name}, {joints}, seed {seed}: {why}")
    return ["", "## Without a certificate", "", *lines] if lines else []


def table(data: dict[str, Any], facts: dict[str, Any]) -> str:
    """Markdown of all that is there."""
    runs_there = [run for kinds in data.values() for by in kinds.values() for run in by.values()]
    measured = [run for run in runs_there if "error" not in run]
    load = max((run["wall"] / max(run["cpu"], 1e-9) for run in measured), default=1.0)
    lengths = [round(run["seconds"]) for run in measured] or [0]
    kernels = max((run["kernels"] for run in measured), default=0.0)
    lines = [
        "# Trees that fold",
        "",
        "Written by `python benchmarks/search_table.py`. A run is one model, one seed and one",
        f"set of joints on one core for {told_range(lengths)} s, {facts['workers']} runs side by",
        "side, with the product's defaults. Seconds are seconds of that core from the start of the",
        f"search, with voxels made and kernels loaded before (at most {kernels:.1f} s); the clock",
        f"showed at most {load:.2f} times as much. *Folds*: seeds with a tree that folds as",
        "cubes on the lattice. *Certified*: of the seeds that were put to the proof, those with a",
        "tree whose printed bodies were built, proven by the swept test, and seen free of",
        "collision at every degree by another check. *First*: when the first such tree was found,",
        "of seeds that were not put to the proof the first that folds; building and proving takes",
        "*build s* more.",
        "",
        "*Joints* and *energy* (paper's weights): the best of all seeds, the median seed's in",
        f"brackets, after {MARKS[0]:g} s and {MARKS[1]:g} s of {MARK_CORES} cores for all "
        f"{len(SEEDS)} seeds together:",
        f"each run then had {CORE_MARKS[0]:g} and {CORE_MARKS[1]:g} seconds of its core (*of 3*: "
        "only three seeds",
        "were searched as long; –: none was, or there was no tree yet). *Voxels*: sizes of the",
        "voxelizations that seeds take in turn, from roomy to full ones; *voxels of the best*:",
        "joined by the best tree at the end of a run, the median.",
        "",
        "*Proven*, *sampled*: smallest gap of all trees of the row by the swept test, and seen by",
        "the other check. *Best certified*: of the best trees that were put to the proof (where",
        "one is refused, the next best). *Refused*: trees that fold as cubes and not as bodies.",
        "",
        f"Machine: {runs.machine_line(facts)}.",
    ]
    for title, names in (("The paper's models", PAPER), ("Ten other models", DEV)):
        kinds = [(n, joints, data[n][joints]) for n in names if n in data for joints in data[n]]
        marks = marks_of([r for *_, runs_of in kinds for r in runs_of.values() if "error" not in r])
        if kinds:
            lines += ["", f"## {title}", "", *head(marks), *(row(*kind, marks) for kind in kinds)]
    lines += compared(data) + refusals(data)
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--models", nargs="+", default=["paper"], help="names, paper, dev, or all")
    parser.add_argument("--seeds", nargs="+", type=int, default=list(SEEDS))
    parser.add_argument(
        "--seconds", type=float, default=CORE_MARKS[-1], help="processor seconds of each run"
    )
    parser.add_argument("--joints", nargs="+", default=["S"], choices=["S", "S+D"])
    parser.add_argument("--work", type=Path, default=Path("search-runs"))
    parser.add_argument("--workers", type=int, default=2, help="runs side by side")
    parser.add_argument(
        "--gap-step", type=float, default=10.0, help="degrees between measured gaps (1 is slow)"
    )
    parser.add_argument(
        "--prove",
        nargs="*",
        default=["first", "best"],
        choices=["first", "best"],
        help="trees of each run to build and prove; nothing proves none",
    )
    parser.add_argument("--only-table", action="store_true")
    parser.add_argument("--out", type=Path, default=HERE / "search_table.md")
    parser.add_argument("--voxels", help=argparse.SUPPRESS)
    parser.add_argument("--run", nargs=3, help=argparse.SUPPRESS)
    parser.add_argument("--proof", nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.voxels:
        runs.voxelized(MODELS[options.voxels], options.work / options.voxels)
        return
    if options.run:
        do_run(options)
        return
    if options.proof:
        do_proof(options)
        return
    names: list[str] = []
    for name in options.models:
        names += {"paper": list(PAPER), "dev": list(DEV), "all": list(MODELS)}.get(name, [name])
    unknown = [name for name in names if name not in MODELS]
    if unknown:
        parser.error(f"no such models: {', '.join(unknown)}")
    if not options.only_table:
        measure(options, names)
    data = collect(options.work)
    facts = {**runs.machine(), "workers": options.workers}
    options.out.write_text(table(data, facts), encoding="utf-8")
    content = {"machine": facts, "runs": data}
    options.out.with_suffix(".json").write_text(
        json.dumps(content, indent=1) + "\n", encoding="utf-8"
    )


if __name__ == "__main__":
    main()
