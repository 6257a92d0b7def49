"""Growth of time and memory with the number of cells: writes benchmarks/growth.md and .json.

    python benchmarks/growth.py [--model sample:elephant] [--sides 3 4 5 6 8] [--budget 120]
        [--seed 1] [--only-table]

For a box of each size: seconds and peak memory to voxelize the model, to the first tree that fits
the template, and to the first tree that folds. Every stage runs in a process of its own, compiled
kernels are loaded before the clock starts, and seconds are of the process's own CPU time, so that
whatever else the machine does counts little. The search for a tree that folds ends with the budget;
the table then tells how near the planner came.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
SIDES = (3, 4, 5, 6, 8)


def say(**figures: Any) -> None:
    """A line for the parent: figures so far, with the memory used up to now."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(json.dumps({**figures, "megabytes": round(peak)}), flush=True)


def do_solid(model: str, folder: Path) -> None:
    """In a process of its own too: CAD kernels and mesh repair take more memory than the rest."""
    from fabfold.solid.load import load_solid
    from fabfold.stagefiles import save_solid
    from fabfold.store import StageStore

    save_solid(StageStore(folder), load_solid(model))


def do_voxelize(side: int, seed: int, folder: Path) -> None:
    from fabfold.lattice import load_template
    from fabfold.rounds import search_order
    from fabfold.stagefiles import load_solid
    from fabfold.store import StageStore
    from fabfold.voxels.search import voxelize
    from fabfold.voxels.store import save_voxels

    solid = load_solid(StageStore(folder), ["solid.npz"])
    voxelize(solid, load_template("box-3x3x3"), seed=seed, placements=2, shortlist=1, results=1)
    template = load_template(f"box-{side}x{side}x{side}")
    start = time.process_time()
    options = voxelize(solid, template, seed=seed)
    seconds = time.process_time() - start
    chosen = search_order(options, len(template))[0]
    save_voxels(folder / f"{side}.npz", chosen)
    say(
        seconds=round(seconds, 2),
        voxels=len(chosen),
        fill=round(float(chosen.fill.mean()), 3),
        lost=round(float(chosen.lost_volume), 4),
    )


def do_tree(side: int, seed: int, folder: Path, budget: float) -> None:
    import numpy as np

    from fabfold.errors import FabfoldError
    from fabfold.fold.foldability import LatticeFoldability
    from fabfold.lattice import load_template
    from fabfold.seeds import run_seed
    from fabfold.tree.effort import Effort
    from fabfold.tree.problem import from_features
    from fabfold.tree.solve import Candidate, grow, solve
    from fabfold.voxels.features import features
    from fabfold.voxels.store import load_voxels
    from fabfold.warming import strip_job

    template = load_template(f"box-{side}x{side}x{side}")
    voxels = load_voxels(folder / f"{side}.npz")

    class Watched(LatticeFoldability):
        """Notes how near the planner came."""

        def outlook(self, system: Any, expansions: int, guide: Any = None) -> Any:
            found = super().outlook(system, expansions, guide)
            left = found.left
            share = (int(left.sum()), int(np.abs(system.turns).sum()))
            if best[0] is None or share[0] * best[0][1] < best[0][0] * share[1]:
                best[0] = share
                say(left=share, first_tree=first_tree, hinges=len(system.turns))
            return found

        def stuck_hinges(self, system: Any) -> Any:
            stuck = super().stuck_hinges(system)
            jammed = int(stuck.any(axis=0).sum())
            if best[0] is None and (best[1] is None or jammed < best[1]):
                best[1] = jammed
                say(stuck=(jammed, len(system.turns)), first_tree=first_tree)
            return stuck

    best: list[Any] = [None, None]
    first_tree = 0.0
    run_seed(strip_job(), 0, lambda _: None, lambda: False)
    start = time.process_time()
    problem = from_features(voxels, features(voxels), template)
    next(grow(problem, seed))
    first_tree = round(time.process_time() - start, 2)
    say(first_tree=first_tree)

    found: list[Candidate] = []

    def stop() -> bool:
        return bool(found) or time.process_time() - start > budget

    start = time.process_time()
    try:
        effort = Effort(roots=10**6, restarts=10**6)
        solve(problem, seed, Watched(), effort, report=found.append, stop=stop)
    except FabfoldError as error:
        if time.process_time() - start < budget:
            say(first_tree=first_tree, error=str(error), left=best[0])
            return
    if found:
        say(
            first_tree=first_tree,
            folds=round(time.process_time() - start, 2),
            hinges=len(found[0].tree.hinges),
            moves=len(found[0].path),
        )


def measured(arguments: list[str], limit: float) -> dict[str, Any]:
    """Last figures of one stage in a process of its own, killed after `limit` CPU seconds."""

    def bounded() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (int(limit), int(limit) + 5))

    done = subprocess.run(
        [sys.executable, __file__, *arguments],
        check=False,
        stdout=subprocess.PIPE,
        text=True,
        preexec_fn=bounded,
    )
    figures: dict[str, Any] = {}
    for line in done.stdout.splitlines():
        if line.startswith("{"):
            figures.update(json.loads(line))
    return figures


def told(row: dict[str, Any], budget: float) -> str:
    """The last column: how the search ended."""
    tree = row["tree"]
    if "folds" in tree:
        return f"{tree['folds']:.1f} s, {tree['hinges']} hinges, {tree['moves']} moves"
    if tree.get("left"):
        left, total = tree["left"]
        return f"not folded in {budget:g} s, {left} of {total} quarter turns left"
    if "stuck" in tree:
        return (
            f"not folded in {budget:g} s, {tree['stuck'][0]} of {tree['stuck'][1]} hinges "
            "locked in the best tree"
        )
    return f"not folded in {budget:g} s, no tree whose hinges can turn joins all voxels"


def table(data: dict[str, Any]) -> str:
    lines = [
        "# Growth with the number of cells",
        "",
        f"Written by `python benchmarks/growth.py`: {data['model']}, seed {data['seed']}, at most "
        f"{data['budget']:g} s for the tree. Seconds are CPU time of one core; memory is the peak "
        "of the stage's own process, Python and libraries included.",
        "",
        "| cells | voxels | voxelize | memory | first tree that fits | first tree that folds |"
        " memory |",
        "|---:|---:|---:|---:|---:|---|---:|",
    ]
    for row in data["rows"]:
        cut, tree = row["voxelize"], row["tree"]
        fits = f"{tree['first_tree']:.2f} s" if "first_tree" in tree else "none"
        lines.append(
            f"| {row['side'] ** 3} | {cut.get('voxels', '-')} | {cut.get('seconds', 0):.1f} s | "
            f"{cut.get('megabytes', 0)} MB | {fits} | {told(row, data['budget'])} | "
            f"{tree.get('megabytes', 0)} MB |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--model", default="sample:elephant", help="sample:NAME or a file")
    parser.add_argument("--sides", type=int, nargs="+", default=list(SIDES))
    parser.add_argument("--budget", type=float, default=120.0, help="CPU seconds for the tree")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only-table", action="store_true", help="from growth.json")
    parser.add_argument("--stage", nargs=2, help=argparse.SUPPRESS)
    parser.add_argument("--folder", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.stage:
        name, side = options.stage[0], int(options.stage[1])
        if name == "solid":
            do_solid(options.model, options.folder)
        elif name == "voxelize":
            do_voxelize(side, options.seed, options.folder)
        else:
            do_tree(side, options.seed, options.folder, options.budget)
        return
    kept = HERE / "growth.json"
    if options.only_table:
        data = json.loads(kept.read_text(encoding="utf-8"))
    else:
        data = {
            "model": options.model,
            "seed": options.seed,
            "budget": options.budget,
            "rows": [],
        }
        with tempfile.TemporaryDirectory() as folder:
            common = ["--folder", folder, "--seed", str(options.seed), "--model", options.model]
            common += ["--budget", str(options.budget)]
            measured(["--stage", "solid", "0", *common], 900)
            for side in options.sides:
                row: dict[str, Any] = {"side": side}
                row["voxelize"] = measured(["--stage", "voxelize", str(side), *common], 900)
                row["tree"] = {}
                if (Path(folder) / f"{side}.npz").is_file():
                    limit = 2 * options.budget + 120
                    row["tree"] = measured(["--stage", "tree", str(side), *common], limit)
                data["rows"].append(row)
                print(json.dumps(row), flush=True)
                kept.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    (HERE / "growth.md").write_text(table(data), encoding="utf-8")
    print(table(data))


if __name__ == "__main__":
    main()
