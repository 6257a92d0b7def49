"""What each part of the search brings: writes benchmarks/ablation.md and .json.

    python benchmarks/ablation.py [--models bunny kitten] [--seeds 1 2 3] [--seconds 12]
        [--parts closure octants ...] [--work DIR] [--only-table]

The product's seeds take voxelizations of several sizes in turn, and roomy ones fold at once,
whatever is left out. So the second variant takes the roomy ones away, and all others go on from
there: each leaves one part of the search out (or puts one in), and runs the same seeds on the
fullest voxelizations for the same seconds of one core. Growth is looked at by itself: how many of
the same root poses end with every voxel of the fullest voxelization in its place.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import runs
from runs import HERE, MODELS, Judge

#: The whole product, and what the other variants are compared with.
PRODUCT, BASE = "several sizes", "full templates"
#: Variants of the whole search: name and what is different.
VARIANTS = {
    PRODUCT: "the product: voxelizations that leave cells free (partial fill), and full ones",
    BASE: "only the fullest quarter of the voxelizations; so in all rows below",
    "no improvement": "grown trees are only tested: no phase A, no phase B",
    "no polish": "phase A alone: trees are taken as they first fold",
    "no gathering": "the first tree that folds is polished, not the best of several",
    "no closure": "the objective asks the planner alone, not the closure test",
    "no guide": "the planner starts each tree from nothing, not along the steps of the last",
    "no planner": "the objective asks the closure test alone; the planner filters afterwards",
    "fold afterwards": "the energy alone is lowered; closure and planner filter afterwards",
    "one tree": "one spanning tree for each set of poses instead of several",
    "octants": "put in: eighths of cells count as they hold material, not whole cells",
    "carving": "put in from the first seed: cores of cells count, carving is weighed",
}
#: Variants of growth alone.
GROWTH = {
    "constrained first + insertion": "as in the product",
    "constrained first": "voxels that find no place are not put in by moving others",
    "breadth first + insertion": "a fixed breadth-first order of the voxels",
    "breadth first": "the same, without insertion",
}


class Unclosed(Judge):
    """Never asks the closure test."""

    def stuck_hinges(self, system: Any) -> Any:
        return np.zeros((2, len(system.parent)), dtype=bool)


class Unguided(Judge):
    """Plans every tree from nothing."""

    def estimate(self, system: Any, expansions: int, guide: Any = None) -> Any:
        return self.judge.estimate(system, expansions)


class Unplanned(Judge):
    """Takes for folding whatever passes the closure test, until a path is asked for."""

    def estimate(self, system: Any, expansions: int, guide: Any = None) -> Any:
        from fabfold.tree.foldability import PlannerEstimate

        hinges = len(system.parent)
        return PlannerEstimate(np.zeros(hinges, dtype=np.int32), np.zeros((0, 5), dtype=np.int32))

    def path(self, system: Any, guide: Any = None) -> Any:
        return self.judge.path(system)


class Unjudged(Unplanned, Unclosed):
    """Takes everything for folding, until a path is asked for."""


def changed(variant: str, job: Any, voxels: Any) -> Any:
    """The job of a seed as a variant has it."""
    from fabfold.fold.core_sweep import CORE_HALF_SIDE
    from fabfold.fold.lattice_foldability import LatticeFoldability, octants_of

    effort, judge = job.effort, job.foldability
    if variant == "no improvement":
        effort = replace(effort, closure_tests=0, planner_runs=0, polish_each=0, polish_best=0)
    elif variant == "no polish":
        effort = replace(effort, polish_each=0, polish_best=0)
    elif variant == "no gathering":
        effort = replace(effort, starts=1)
    elif variant == "one tree":
        effort = replace(effort, spanning_trees=1)
    elif variant == "no closure":
        judge = Unclosed(judge)
    elif variant == "no guide":
        judge = Unguided(judge)
    elif variant == "no planner":
        judge = Unplanned(judge)
    elif variant == "fold afterwards":
        judge = Unjudged(judge)
    elif variant == "octants":
        judge = LatticeFoldability(octants=octants_of(voxels.subvoxels))
    elif variant == "carving":
        judge = LatticeFoldability(carve=CORE_HALF_SIDE, material=voxels.subvoxels)
    return replace(job, effort=effort, foldability=judge)


def fullest(options: Sequence[Any], count: int) -> list[Any]:
    """Those with the most voxels."""
    return sorted(options, key=len, reverse=True)[:count]


def run_variant(
    model: runs.Model, folder: Path, variant: str, seed: int, joints: str, seconds: float
) -> dict[str, Any]:
    """One run of one variant: the product's seeds, one after the other."""
    from fabfold.search.seeds import Job, run_seed

    kit = runs.voxelized(model, folder)
    options = kit.voxelize()
    if variant != PRODUCT:
        options = fullest(options, max(1, len(options) // 4))
    rounds = runs.rounds_of(kit, runs.recipe_of(kit, seed, joints), options)
    known = (
        (number, changed(variant, job, rounds.voxels(number)))
        for number, job in runs.jobs_of(rounds)
        if isinstance(job, Job)
    )
    kernels = runs.warm_up(next(known)[1], joints)
    rounds = runs.rounds_of(kit, rounds.recipe, options)
    clock = runs.Recorder(seconds)
    folded = []
    for number, job in runs.jobs_of(rounds):
        if clock.over():
            break
        if not isinstance(job, Job):
            continue
        mine = changed(variant, job, rounds.voxels(number))
        before, started, best = len(clock.events), clock.cpu, clock.best
        clock.best = float("inf")
        found = run_seed(mine, number, clock.report, clock.over)
        if found.failed:
            raise SystemExit(found.why)
        for event in clock.events[before:]:
            event["voxels"] = len(rounds.voxels(number))
        some = len(clock.events) > before
        folded.append([round(clock.cpu - started, 2), some, found.cut is not None])
        clock.best = min(best, clock.best)
    return {
        "kernels": kernels,
        "cpu": clock.cpu,
        "voxels": [len(voxels) for voxels in options],
        "starts": folded,
        "events": clock.events,
    }


# --- growth -----------------------------------------------------------------------------------


def breadth_first(neighbour: Any, root: int) -> list[int]:
    """Voxels in the order in which a breadth-first walk from the root meets them."""
    order, seen = [root], {root}
    for u in order:
        for v in neighbour[u].tolist():
            if v >= 0 and v not in seen:
                seen.add(v)
                order.append(v)
    return order


def grown_in_order(problem: Any, start: Any, order: list[int], beam: int, state: Any) -> Any:
    """Beam growth in a fixed order, one voxel at a time; the fullest state where all die."""
    from fabfold.tree.beam import fill_beam
    from fabfold.tree.pose_energy import energy_of

    states = [start]
    out = np.empty((beam, len(start)), np.int32)
    for v in order[1:]:
        todo = np.array([v], dtype=np.int32)
        found: dict[bytes, tuple[float, Any]] = {}
        for pose in states:
            rows, _ = fill_beam(problem.tables, pose, todo, beam, 0.3, 0.5, False, state, out)
            for row in out[:rows]:
                energy, _ = energy_of(problem.tables, row, 0.0)
                found[row.tobytes()] = (energy, row.copy())
        if not found:
            # This voxel has no place in any state: go on without it.
            continue
        states = [pose for _, pose in sorted(found.values(), key=lambda e: e[0])[:beam]]
    return states[0]


def run_growth(model: runs.Model, folder: Path, variant: str, seed: int, joints: str) -> Any:
    """Grow from the same root poses, one way or the other."""
    from fabfold.lattice.rotations import parity
    from fabfold.tree.beam import fill_beam
    from fabfold.tree.large_neighbourhood import repair
    from fabfold.tree.rng import generator

    kit = runs.voxelized(model, folder)
    recipe = runs.recipe_of(kit, seed, joints)
    rounds = runs.rounds_of(kit, recipe, fullest(kit.voxelize(), 1))
    job = next(job for _, job in runs.jobs_of(rounds))
    problem, effort = job.problem, job.effort
    tables = problem.tables
    rng = np.random.default_rng([seed, 7])
    state = generator(int(rng.integers(2**62)))
    colour, colourings = parity(problem.source), problem.colourings()
    cells = [np.flatnonzero(parity(problem.template.cells) == c) for c in (0, 1)]
    count = len(problem)
    out = np.empty((effort.beam_width, count), np.int32)
    left_over, full = [], 0
    spent = 0.0
    roots = 20
    for k in range(roots + 1):
        root = int(rng.integers(count))
        wanted = cells[(colour[root] + colourings[0]) % 2]
        pose = np.full(count, -1, np.int32)
        pose[root] = 24 * wanted[rng.integers(len(wanted))] + rng.integers(24)
        began = time.process_time()
        if variant.startswith("breadth"):
            order = breadth_first(tables.neighbour, root)
            pose = grown_in_order(problem, pose, order, effort.beam_width, state)
        else:
            todo = np.flatnonzero(pose < 0).astype(np.int32)
            fill_beam(tables, pose, todo, effort.beam_width, 0.3, 0.5, True, state, out)
            pose = out[0].copy()
        before = int((pose < 0).sum())
        done = before == 0
        if variant.endswith("insertion"):
            left, _ = repair(tables, pose, 2000, 20, 12, state)
            done = left == 0
        if k == 0:
            continue  # The first one loads kernels.
        spent += time.process_time() - began
        left_over.append(before)
        full += done
    return {"roots": roots, "full": full, "left": left_over, "cpu": spent}


# --- table ------------------------------------------------------------------------------------


def path_of(options: argparse.Namespace, model: str, part: str, seed: int) -> Path:
    """Where a run is kept, by all that it depends on."""
    kind = f"{options.joints}-{options.seconds:g}s"
    return Path(options.work / "ablation" / kind / f"{model}-{part.replace(' ', '-')}-{seed}.json")


def missing(options: argparse.Namespace, model: str, seed: int) -> list[str]:
    """Parts that were not measured yet."""
    parts = [part for part in [*VARIANTS, *GROWTH] if part in options.parts]
    return [part for part in parts if not path_of(options, model, part, seed).is_file()]


def whole_row(variant: str, entries: list[dict[str, Any]], seconds: float) -> str:
    firsts = [e["events"][0]["cpu"] if e["events"] else float("inf") for e in entries]
    last = [min(e["events"], key=lambda v: v["total"]) for e in entries if e["events"]]
    starts = [s for e in entries for s in e["starts"] if not s[2] or s[1]]
    folded = sum(s[1] for s in starts)
    middle = median(firsts)
    sizes = sorted({size for e in entries for size in e["voxels"]})
    cells = [
        variant,
        f"{sizes[0]}–{sizes[-1]}" if len(sizes) > 1 else f"{sizes[0]}",
        f"{len(last)} of {len(entries)}",
        f"> {seconds:g}" if middle == float("inf") else f"{middle:.1f}",
        f"{folded} of {len(starts)}",
        f"{median(sum(v['joints'].values()) for v in last):.0f}" if last else "–",
        f"{median(v['surface'] for v in last):.2f}" if last else "–",
        f"{median(v['total'] for v in last):.2f}" if last else "–",
        f"{median(v['voxels'] for v in last):.0f}" if last else "–",
    ]
    return "| " + " | ".join(cells) + f" | {VARIANTS[variant]} |"


def growth_row(variant: str, entries: list[dict[str, Any]]) -> str:
    roots = sum(e["roots"] for e in entries)
    left = [value for e in entries for value in e["left"]]
    per_root = sum(e["cpu"] for e in entries) / roots
    return (
        f"| {variant} | {sum(e['full'] for e in entries)} of {roots} | {median(left):.0f} |"
        f" {1000 * per_root:.0f} | {GROWTH[variant]} |"
    )


def table(data: dict[str, Any], facts: dict[str, Any]) -> str:
    """Markdown of all that is there."""
    lines = [
        "# What each part of the search brings",
        "",
        "Written by `python benchmarks/ablation.py`. The product's seeds take voxelizations of",
        "several sizes in turn, and roomy ones fold at once whatever is left out. So the second",
        "row has the fullest voxelizations only, and each row below leaves one part of the search",
        "out besides, or puts one in. All run the same seeds for "
        f"{facts['seconds']:g} seconds of one core each,",
        f"joints {facts['joints']}. *Voxels*: of the voxelizations searched. *Folds*: seeds with a",
        "tree that folds as cubes on the lattice. *Runs*: how many of the search's own seeds that",
        "came to an end, or found a tree, found one. Joints, energies, and *of voxels*: those of",
        "the best tree, median of the seeds that fold.",
        "",
        f"Machine: {runs.machine_line(facts)}.",
    ]
    for model, by_variant in data.items():
        whole = [v for v in VARIANTS if v in by_variant]
        if whole:
            lines += [
                "",
                f"## {model}",
                "",
                "| variant | voxels | folds | first s, median | runs | joints | surface | energy |"
                " of voxels | what |",
                "|---|--:|--:|--:|--:|--:|--:|--:|--:|---|",
            ]
            lines += [whole_row(v, by_variant[v], facts["seconds"]) for v in whole]
        growth = [v for v in GROWTH if v in by_variant]
        if growth:
            lines += [
                "",
                f"### Growth alone: {model}",
                "",
                "| order | every voxel placed | left before insertion | ms a root | what |",
                "|---|--:|--:|--:|---|",
            ]
            lines += [growth_row(v, by_variant[v]) for v in growth]
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--models", nargs="+", default=["bunny", "kitten"])
    parser.add_argument("--seeds", nargs="+", type=int, default=[1, 2, 3])
    parser.add_argument("--seconds", type=float, default=12.0)
    parser.add_argument("--joints", default="S", choices=["S", "S+D"])
    parser.add_argument("--parts", nargs="+", default=[*VARIANTS, *GROWTH])
    parser.add_argument("--work", type=Path, default=Path("search-runs"))
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--only-table", action="store_true")
    parser.add_argument("--out", type=Path, default=HERE / "ablation.md")
    parser.add_argument("--one", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    unknown = [part for part in options.parts if part not in VARIANTS | GROWTH]
    if unknown:
        parser.error(f"no such parts: {', '.join(unknown)}")
    if options.one:
        name, seed = options.one[0], int(options.one[1])
        for part in missing(options, name, seed):
            where = (MODELS[name], options.work / name, part, seed, options.joints)
            found = run_growth(*where) if part in GROWTH else run_variant(*where, options.seconds)
            runs.write(path_of(options, name, part, seed), found)
        return
    if not options.only_table:
        jobs = [
            (name, str(seed))
            for seed in options.seeds
            for name in options.models
            if missing(options, name, seed)
        ]
        base = [sys.executable, __file__, "--work", str(options.work), "--joints", options.joints]
        base += ["--seconds", str(options.seconds), "--parts", *options.parts]
        for name in options.models:
            runs.voxelized(MODELS[name], options.work / name)
        runs.side_by_side(
            [[*base, "--one", *job] for job in jobs], options.workers, [" ".join(j) for j in jobs]
        )
    data: dict[str, Any] = {}
    for name in MODELS:
        for variant in [*VARIANTS, *GROWTH]:
            entries = [runs.read(path_of(options, name, variant, s)) for s in options.seeds]
            if any(entries):
                data.setdefault(name, {})[variant] = [e for e in entries if e]
    facts = {**runs.machine(), "seconds": options.seconds, "joints": options.joints}
    options.out.write_text(table(data, facts), encoding="utf-8")
    options.out.with_suffix(".json").write_text(
        json.dumps({"machine": facts, "runs": data}, indent=1) + "\n", encoding="utf-8"
    )


if __name__ == "__main__":
    main()
