"""Growth of time and memory with the number of cells: writes benchmarks/growth.md and .json.

    python benchmarks/growth.py [--model sample:elephant] [--sides 3 4 5 6 8] [--budget 120]
        [--seed 1] [--workers 2] [--only-table]

For a box of each size: seconds and peak memory to cut the model into the product's voxelizations of
several sizes, to the first tree that fits the template, to the first tree that passes the closure
test, and to the first tree that folds. Seeds take the voxelizations as in the product, roomy ones
first. Every stage runs in a process of its own, compiled kernels are loaded before the clock
starts, and seconds are of the process's own CPU time, so that whatever else the machine does counts
little. The search ends with the first tree that folds or with the budget; the table then tells how
near the planner came.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import runs
from runs import HERE, Judge

SIDES = (3, 4, 5, 6, 8)


def say(**figures: Any) -> None:
    """A line for the parent: figures so far, with the memory used up to now."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(json.dumps({**figures, "megabytes": round(peak)}), flush=True)


def name_of(side: int) -> str:
    """Template of a cube."""
    return f"box-{side}x{side}x{side}"


def do_solid(model: str, folder: Path) -> None:
    """In a process of its own too: CAD kernels and mesh repair take more memory than the rest."""
    from fabfold.kit.stage_files import save_solid
    from fabfold.samples.builtin import load_model
    from fabfold.store import StageStore

    save_solid(StageStore(folder), load_model(model))


def do_voxelize(side: int, seed: int, folder: Path) -> None:
    from fabfold.kit.stage_files import load_solid
    from fabfold.lattice.shipped import load_template
    from fabfold.store import StageStore
    from fabfold.voxels.voxel_files import save_voxels
    from fabfold.voxels.voxelize import voxelize

    solid = load_solid(StageStore(folder), ["solid.npz"])
    voxelize(solid, load_template(name_of(3)), seed=seed, placements=2, shortlist=1, results=1)
    start = time.process_time()
    options = voxelize(solid, load_template(name_of(side)), seed=seed)
    seconds = time.process_time() - start
    files = [f"voxels-{side}-{index}.npz" for index in range(len(options))]
    for name, voxels in zip(files, options, strict=True):
        save_voxels(folder / name, voxels)
    say(
        seconds=round(seconds, 2),
        voxels=[len(voxels) for voxels in options],
        fill=[round(float(voxels.fill.mean()), 3) for voxels in options],
        files=files,
    )


class Watched(Judge):
    """Notes how near the closure test and the planner came."""

    def __init__(self, judge: Any, notes: dict[str, Any], clock: runs.Recorder) -> None:
        super().__init__(judge)
        self.notes = notes
        self.clock = clock

    def stuck_hinges(self, system: Any) -> Any:
        stuck = super().stuck_hinges(system)
        jammed, hinges = int(stuck.any(axis=0).sum()), stuck.shape[1]
        before = self.notes.get("stuck")
        if before is None or jammed * before[1] < before[0] * hinges:
            self.notes["stuck"] = (jammed, hinges)
            say(**self.notes)
        if jammed == 0 and "closed" not in self.notes:
            self.notes["closed"] = round(self.clock.cpu, 2)
            say(**self.notes)
        return stuck

    def estimate(self, system: Any, expansions: int, guide: Any = None) -> Any:
        found = super().estimate(system, expansions, guide)
        share = (int(found.unresolved.sum()), int(np.abs(system.turns).sum()))
        before = self.notes.get("left")
        if before is None or share[0] * before[1] < before[0] * share[1]:
            self.notes["left"] = share
            say(**self.notes)
        return found


def do_tree(
    model: str, side: int, seed: int, folder: Path, budget: float, files: list[str]
) -> None:
    """The product's seeds, one after the other, until one folds."""
    from fabfold.kit.kit import Kit
    from fabfold.search.seeds import Job, run_seed
    from fabfold.search.warmup import warm_up_job
    from fabfold.tree.initial_poses import grow
    from fabfold.voxels.voxel_files import load_voxels

    kit = Kit.from_model(model, template=name_of(side), seed=seed)
    options = [load_voxels(folder / name) for name in files]
    rounds = runs.rounds_of(kit, kit.recipe, options)
    run_seed(warm_up_job(), 0, lambda _: None, lambda: False)
    notes: dict[str, Any] = {}
    found: list[Any] = []
    clock = runs.Recorder(budget)

    def stop() -> bool:
        return bool(found) or clock.over()

    for tried, (turn, job) in enumerate(runs.jobs_of(rounds)):
        if stop():
            break
        if not isinstance(job, Job):
            if tried >= len(options) and "grown" not in notes:
                say(error=job.why)
                return
            continue
        if "grown" not in notes and next(grow(job.problem, turn), None) is not None:
            notes["grown"] = round(clock.cpu, 2)
            say(**notes)
            clock = runs.Recorder(budget)
        watched = replace(job, foldability=Watched(job.foldability, notes, clock))
        ended = run_seed(watched, turn, found.append, stop)
        if ended.failed:
            raise SystemExit(ended.why)
        if found:
            notes["folds"] = round(clock.cpu, 2)
            notes["joined"] = len(rounds.voxels(turn))
            notes["hinges"] = len(found[0].tree.hinges)
            notes["moves"] = len(found[0].path)
        notes["seeds"] = tried + 1
        say(**notes)


def measured(arguments: list[str]) -> dict[str, Any]:
    """Last figures of one stage in a process of its own."""
    done = subprocess.run(
        [sys.executable, __file__, *arguments], check=False, stdout=subprocess.PIPE, text=True
    )
    figures: dict[str, Any] = {}
    for line in done.stdout.splitlines():
        if line.startswith("{"):
            figures.update(json.loads(line))
    return figures


def bounded(seconds: float) -> None:
    """End this process after so many CPU seconds, whatever it does."""
    resource.setrlimit(resource.RLIMIT_CPU, (int(seconds), int(seconds) + 5))


def told(row: dict[str, Any], budget: float) -> str:
    """How the search ended."""
    tree = row["tree"]
    if "folds" in tree:
        return (
            f"{tree['folds']:.1f} s: {tree['joined']} voxels, {tree['hinges']} hinges, "
            f"{tree['moves']} moves"
        )
    if tree.get("left"):
        left, total = tree["left"]
        return f"not in {budget:g} s, {left} of {total} quarter turns left"
    if "stuck" in tree:
        return f"not in {budget:g} s, {tree['stuck'][0]} of {tree['stuck'][1]} hinges locked"
    return str(tree.get("error", f"not in {budget:g} s, no tree whose hinges can turn"))


def table(data: dict[str, Any]) -> str:
    lines = [
        "# Growth with the number of cells",
        "",
        f"Written by `python benchmarks/growth.py`: {data['model']}, seed {data['seed']}, at most",
        f"{data['budget']:g} s for the search. Seconds are CPU time of one core; memory is the",
        "peak of the stage's own process, Python and libraries included. *Voxels*: sizes of the",
        "voxelizations, which seeds take in turn, roomy ones first. *Fits*: growing, to the first",
        "tree that fits. From there on the search: *closed*, to the first tree whose hinges all",
        "pass the closure test, and *folds*, to the first one with a folding path.",
        "",
        f"Machine: {runs.machine_line(data['machine'])}.",
        "",
        "| cells | voxels | voxelize | memory | fits | closed | folds | memory |",
        "|---:|---|---:|---:|---:|---:|---|---:|",
    ]
    for row in data["rows"]:
        cut, tree = row["voxelize"], row["tree"]
        sizes = cut.get("voxels") or [0]
        lines.append(
            f"| {row['side'] ** 3} | {min(sizes)}–{max(sizes)} | {cut.get('seconds', 0):.1f} s | "
            f"{cut.get('megabytes', 0)} MB | "
            + " | ".join(f"{tree[k]:.2f} s" if k in tree else "–" for k in ("grown", "closed"))
            + f" | {told(row, data['budget'])} | {tree.get('megabytes', 0)} MB |"
        )
    return "\n".join(lines) + "\n"


def row_of(side: int, common: list[str]) -> dict[str, Any]:
    """All that is measured for one size."""
    row: dict[str, Any] = {"side": side, "tree": {}}
    row["voxelize"] = measured(["--stage", "voxelize", str(side), *common])
    if files := row["voxelize"].get("files"):
        row["tree"] = measured(["--stage", "tree", str(side), "--files", *files, *common])
    print(json.dumps(row), file=sys.stderr, flush=True)
    return row


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--model", default="sample:elephant", help="sample:NAME or a file")
    parser.add_argument("--sides", type=int, nargs="+", default=list(SIDES))
    parser.add_argument("--budget", type=float, default=120.0, help="CPU seconds for the search")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2, help="sizes side by side")
    parser.add_argument("--out", type=Path, default=HERE / "growth.md")
    parser.add_argument("--only-table", action="store_true", help="from growth.json")
    parser.add_argument("--stage", nargs=2, help=argparse.SUPPRESS)
    parser.add_argument("--folder", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--files", nargs="*", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.stage:
        name, side = options.stage[0], int(options.stage[1])
        if name == "solid":
            do_solid(options.model, options.folder)
        elif name == "voxelize":
            do_voxelize(side, options.seed, options.folder)
        else:
            # Growing polls nothing, and a first tree may take long.
            bounded(2 * options.budget + 120)
            where = (options.model, side, options.seed, options.folder)
            do_tree(*where, options.budget, options.files)
        return
    kept = options.out.with_suffix(".json")
    if options.only_table:
        data = json.loads(kept.read_text(encoding="utf-8"))
    else:
        data = {
            "machine": runs.machine(),
            "model": options.model,
            "seed": options.seed,
            "budget": options.budget,
        }
        with tempfile.TemporaryDirectory() as folder:
            common = ["--folder", folder, "--seed", str(options.seed), "--model", options.model]
            common += ["--budget", str(options.budget)]
            measured(["--stage", "solid", "0", *common])
            # The largest takes longest: it comes first.
            sides = sorted(options.sides, reverse=True)
            with ThreadPoolExecutor(options.workers) as pool:
                rows = list(pool.map(lambda side: row_of(side, common), sides))
        data["rows"] = rows[::-1]
        kept.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    options.out.write_text(table(data), encoding="utf-8")
    print(table(data))


if __name__ == "__main__":
    main()
