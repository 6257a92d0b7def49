"""Compiled kernels against the same code run by NumPy: writes benchmarks/kernels.md and .json.

    python benchmarks/kernels.py [--seeds 2 3] [--work DIR]

The same tasks with the same seeds run twice, once compiled and once with NUMBA_DISABLE_JIT=1, where
the kernels are plain Python on NumPy arrays. Answers are compared byte for byte. Then the time to
the first answer is taken with an empty cache of compiled kernels, and again with the full one.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import runs
from runs import HERE


@cache
def car_problem() -> Any:
    """The sample's car, its roomiest voxelization, with single hinges."""
    kit = runs.voxelized(runs.MODELS["sample car"], Path(os.environ["KERNELS_WORK"]) / "car")
    rounds = runs.rounds_of(kit, runs.recipe_of(kit, 1, "S"))
    return next(job for _, job in runs.jobs_of(rounds)).problem


def digest(*values: Any) -> str:
    """Digest of arrays, numbers and JSON."""
    out = hashlib.sha256()
    for value in values:
        if isinstance(value, np.ndarray):
            out.update(str((value.dtype, value.shape)).encode())
            out.update(np.ascontiguousarray(value).tobytes())
        else:
            out.update(json.dumps(value, sort_keys=True).encode())
    return out.hexdigest()[:16]


def do_grow(seed: int) -> str:
    from fabfold.tree.initial_poses import grow

    return digest(*grow(car_problem(), seed, root_poses=2))


def do_solve(seed: int) -> str:
    from dataclasses import asdict

    from fabfold.errors import NoFoldError
    from fabfold.fold.lattice_foldability import LatticeFoldability
    from fabfold.tree.effort import Effort
    from fabfold.tree.solve import Statistics, solve

    effort = Effort(
        root_poses=10, restarts=1, removals=1000, closure_tests=1, planner_runs=1, starts=1,
        polish_each=8, polish_best=8, spanning_trees=1, long_patience=40,
    )  # fmt: skip
    judge = LatticeFoldability(expansions=100, patience=20)
    counts = Statistics()
    try:
        found = solve(car_problem(), seed, judge, effort, counts)
    except NoFoldError:
        found = []
    trees = [x for c in found for x in (c.tree.to_json(1.0, (0.0, 0.0, 0.0)), c.path)]
    return digest(asdict(counts), *trees)


@cache
def strip_system() -> Any:
    """Strip of 16 cells with seven hinges that roll it up."""
    from fabfold.tree.system import HingeSystem

    way = np.array([1, -1, 1, -1, 1, -1, 1])
    return HingeSystem(
        cells=np.array([(i, 0, 0) for i in range(16)], dtype=np.int32),
        body=(np.arange(16) // 2).astype(np.int32),
        parent=np.arange(7, dtype=np.int32),
        point2=np.array([(4 * h + 3, way[h], 0) for h in range(7)], dtype=np.int32),
        axis=np.full(7, 2, dtype=np.int8),
        turns=(2 * way).astype(np.int8),
    )


def do_closure(_seed: int) -> str:
    from fabfold.fold.lattice_planner import stuck_hinges

    return digest(stuck_hinges(strip_system()))


def do_plan(_seed: int) -> str:
    from fabfold.fold.lattice_planner import find_path

    found = find_path(strip_system(), 300, 60)
    path = np.zeros(0) if found.path is None else found.path
    return digest(found.remaining, found.expansions, path, found.apart)


def do_certify(_seed: int) -> str:
    """The swept proof of a barrel in its sleeve."""
    import manifold3d

    from fabfold.proof.bvh import fit, new_bodies
    from fabfold.proof.gap import prove_gap

    cylinder = manifold3d.Manifold.cylinder
    sleeve = cylinder(6.0, 5.0, 5.0, 24, True) - cylinder(9.0, 2.8, 2.8, 24, True)
    parts = []
    for solid in (cylinder(8.0, 2.5, 2.5, 24, True), sleeve):
        mesh = solid.to_mesh64()
        parts.append(np.array(mesh.vert_properties[:, :3])[np.array(mesh.tri_verts)])
    boxes, bodies = new_bodies(parts)
    for body in range(len(parts)):
        fit(boxes, bodies, body)
    result = np.array([1.0, np.inf, 0.0])
    verdict = prove_gap(boxes, 0, 1, 0.0, np.pi / 2, 0.2, 0.01, result)
    return digest(int(verdict), result)


TASKS: dict[str, tuple[Callable[[int], str], str]] = {
    "growth": (do_grow, "`grow`, the car's roomiest voxelization, from 2 roots"),
    "search": (do_solve, "`solve`, the car, one start with the least effort"),
    "closure": (do_closure, "`stuck_hinges`, a strip with 7 hinges, both ends"),
    "planner": (do_plan, "`find_path`, a strip with 7 hinges"),
    "proof": (do_certify, "`prove_gap`, a barrel in its sleeve through 90°"),
}


def tasks(seeds: list[int]) -> dict[str, Any]:
    """Answers and processor seconds of all tasks, in this process."""
    compiled = os.environ.get("NUMBA_DISABLE_JIT", "0") != "1"
    out: dict[str, Any] = {}
    car_problem()
    for name, (task, _) in TASKS.items():
        began = time.process_time()
        answers = [task(seeds[0])]
        first = spent = time.process_time() - began
        if compiled or first < 5.0:
            # Once more without what a first call makes and keeps (tables, kernels).
            answers, spent = [], 0.0
        for seed in seeds[len(answers) :]:
            rounds = 0
            began = time.process_time()
            while rounds == 0 or (compiled and time.process_time() - began < 0.2):
                answer = task(seed)
                rounds += 1
            spent += (time.process_time() - began) / rounds
            answers.append(answer)
        print(name, f"{spent:.3f} s", file=sys.stderr)
        out[name] = {"answers": answers, "first": first, "seconds": spent / len(seeds)}
    return out


def apart(seeds: list[int], **environment: str) -> dict[str, Any]:
    """The same in a process of its own, with the clock's seconds for the whole process."""
    command = [sys.executable, __file__, "--here", "--seeds", *map(str, seeds)]
    began = time.perf_counter()
    done = subprocess.run(
        command,
        env={**os.environ, **environment},
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    if done.returncode:
        raise SystemExit(done.stderr)
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return {"tasks": found, "wall": time.perf_counter() - began}


def told(seconds: float) -> str:
    """Seconds in a unit that suits them."""
    for factor, unit in ((1.0, "s"), (1e3, "ms"), (1e6, "µs")):
        if seconds * factor >= 1.0:
            return f"{seconds * factor:.3g} {unit}"
    return f"{seconds * 1e9:.0f} ns"


def table(data: dict[str, Any]) -> str:
    """Markdown."""
    one, two, cold, warm = (data[k]["tasks"] for k in ("numba", "numpy", "cold", "warm"))
    seeds = ", ".join(map(str, data["seeds"]))
    lines = [
        "# Compiled kernels against NumPy",
        "",
        f"Written by `python benchmarks/kernels.py`. Every task with seeds {seeds}, once compiled",
        "by numba and once with `NUMBA_DISABLE_JIT=1`: the same code as plain Python on NumPy",
        "arrays. Seconds of the processor for one task, kernels loaded. Answers are compared byte",
        "for byte. *First*: the first call in a process, kernels compiled, or read from the cache.",
        "",
        f"Machine: {runs.machine_line(data['machine'])}.",
        "",
        "| task | what | answers | NumPy | numba | ratio | first, no cache | first, cache |",
        "|---|---|---|--:|--:|--:|--:|--:|",
    ]
    for name, (_, what) in TASKS.items():
        same = "same" if one[name]["answers"] == two[name]["answers"] else "DIFFER"
        slow, fast = two[name]["seconds"], one[name]["seconds"]
        lines.append(
            f"| {name} | {what} | {same} | {told(slow)} | {told(fast)} |"
            f" {slow / fast:.0f} | {told(cold[name]['first'])} | {told(warm[name]['first'])} |"
        )
    total = [sum(entry["first"] for entry in part.values()) for part in (cold, warm)]
    lines += [
        "",
        f"First calls of all tasks: {total[0]:.0f} s with an empty cache of kernels, "
        f"{total[1]:.1f} s with a full one ({data['cache_mib']:.1f} MiB on disk). Kernels are "
        "compiled once an installation and kept beside the modules, or in `NUMBA_CACHE_DIR`.",
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", nargs="+", type=int, default=[2, 3])
    parser.add_argument("--work", type=Path, default=Path("search-runs"))
    parser.add_argument("--out", type=Path, default=HERE / "kernels.md")
    parser.add_argument("--here", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.here:
        print(json.dumps(tasks(options.seeds)))
        return
    os.environ["KERNELS_WORK"] = str(options.work)
    car_problem()
    data: dict[str, Any] = {"machine": runs.machine(), "seeds": options.seeds}
    data["numpy"] = apart(options.seeds, NUMBA_DISABLE_JIT="1")
    with tempfile.TemporaryDirectory() as folder:
        data["cold"] = apart(options.seeds, NUMBA_CACHE_DIR=folder)
        data["warm"] = apart(options.seeds, NUMBA_CACHE_DIR=folder)
        data["numba"] = data["warm"]
        size = sum(path.stat().st_size for path in Path(folder).rglob("*") if path.is_file())
    data["cache_mib"] = size / 2**20
    options.out.write_text(table(data), encoding="utf-8")
    options.out.with_suffix(".json").write_text(json.dumps(data, indent=1) + "\n", "utf-8")


if __name__ == "__main__":
    main()
