"""Timed runs of the search and proofs of what they found; shared by the benchmarks beside it.

Every run is a process of one core. It goes through the product's own rounds of seeds, writes down
when each better folding tree came, and keeps the trees, so that they can be built and proven
afterwards. A run is one JSON file; what is there is not run again.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
SHARED = HERE.parents[1] / "shared" / "models"
#: Trees that a run keeps: the first ones and the last ones.
FIRST, LAST = 4, 8
#: Candidates that are tried before a run counts as not certified.
TRIES = 4
#: Seconds of the clock, for each second of the processor, after which a run ends anyway.
PATIENCE = 4.0


@dataclass(frozen=True)
class Model:
    """One row of the table."""

    source: Path
    template: str
    paper_joints: int | None = None
    paper_hours: int | None = None
    aim_joints: int | None = None
    aim_seconds: float | None = None


PAPER = {
    "bunny": Model(SHARED / "paper/bunny.stl", "box-4x4x4", 29, 245, 19, 5),
    "kitten": Model(SHARED / "paper/kitten.stl", "box-4x4x4", 34, 345, 22, 5),
    "dragon": Model(SHARED / "paper/dragon.stl", "box-4x4x4", 32, 215, 21, 5),
    "car": Model(SHARED / "paper/car.stl", "box-3x4x4", 22, 161, 14, 5),
    "elephant": Model(SHARED / "paper/elephant.stl", "box-5x5x5", 62, 1005, 41, 60),
    "u-car": Model(SHARED / "paper/car.stl", "u-112", 45, 805, 30, 60),
}
DEV = {
    path.partition(".")[0]: Model(SHARED / "dev" / path, "box-4x4x4")
    for path in (
        "airplane.ply",
        "bicycle.stl",
        "double_torus.off",
        "featuretype.step",
        "idler_riser.stl",
        "knight.stl",
        "locomotive.stl",
        "office_chair.stl",
        "spot.obj",
        "trex.stl",
    )
}
MODELS = PAPER | DEV


def machine() -> dict[str, Any]:
    """What the figures were measured on."""
    cpu = platform.processor()
    info = Path("/proc/cpuinfo")
    if info.is_file():
        lines = info.read_text(encoding="utf-8").splitlines()
        cpu = next((x.partition(":")[2].strip() for x in lines if "model name" in x), cpu)
    names = ("fabfold", "numpy", "numba", "manifold3d", "python-fcl")
    return {
        "cpu": cpu,
        "cores": os.cpu_count(),
        "system": platform.system(),
        "python": platform.python_version(),
        "packages": {name: metadata.version(name) for name in names},
    }


def machine_line(facts: dict[str, Any]) -> str:
    """The same in one line."""
    packages = ", ".join(f"{name} {version}" for name, version in facts["packages"].items())
    return f"{facts['cores']} cores of {facts['cpu']}, Python {facts['python']}, {packages}"


def digests(kit: Path) -> dict[str, str]:
    """SHA-256 of every file of a kit, those of its stages too, by name."""
    return {
        str(path.relative_to(kit)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(kit.rglob("*"))
        if path.is_file()
    }


def write(path: Path, data: Any) -> None:
    """Write JSON whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part")
    part.write_text(json.dumps(data) + "\n", encoding="utf-8")
    part.replace(path)


def read(path: Path) -> Any:
    """Read JSON; None where there is no file."""
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else None


def side_by_side(commands: Sequence[Sequence[str]], workers: int, names: Sequence[str]) -> None:
    """Run commands as processes of one core, `workers` at a time, in their order."""
    single = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMBA")}
    waiting = list(zip(names, commands, strict=True))
    running: list[tuple[str, subprocess.Popen[bytes], float]] = []
    done, total = 0, len(waiting)
    while waiting or running:
        while waiting and len(running) < workers:
            name, command = waiting.pop(0)
            process = subprocess.Popen([*command], env={**os.environ, **single})
            running.append((name, process, time.perf_counter()))
        time.sleep(0.1)
        for entry in list(running):
            name, process, start = entry
            if process.poll() is not None:
                running.remove(entry)
                done += 1
                verdict = "" if process.returncode == 0 else f" FAILED ({process.returncode})"
                took = time.perf_counter() - start
                print(f"[{done}/{total}] {name}: {took:.0f} s{verdict}", file=sys.stderr)


# --- inside a run's process -------------------------------------------------------------------


def voxelized(model: Model, folder: Path, **options: Any) -> Any:
    """Kit of a model, with its voxelizations made once and kept in `folder`."""
    from fabfold.kit.kit import Kit

    kit = Kit.from_model(
        model.source, template=model.template, folder=folder, workers=1, seed=1, **options
    )
    start = time.process_time()
    kit.voxelize()
    timing = folder / "voxelize-seconds.json"
    if not timing.is_file():
        write(timing, time.process_time() - start)
    return kit


def recipe_of(kit: Any, seed: int, joints: str | None) -> Any:
    """The recipe of one run: the product's defaults but for seed and joints."""
    fields = {**kit.recipe.model_dump(), "seed": seed}
    if joints is not None:
        fields["joints"] = joints
    return type(kit.recipe)(**fields)


def rounds_of(kit: Any, recipe: Any, options: Sequence[Any] | None = None) -> Any:
    """Rounds of seeds over the kit's voxelizations, or over some of them, for another recipe."""
    from fabfold.progress import SilentListener
    from fabfold.search.rounds import Rounds
    from fabfold.store import StageStore

    return Rounds(
        recipe,
        kit.template,
        kit.voxelize() if options is None else options,
        key="",
        store=StageStore(None),
        workers=1,
        open_progress=SilentListener().stage,
    )


def warm_up(job: Any, joints: Any) -> float:
    """Compile all kernels, or load them from the cache; CPU seconds."""
    from fabfold.search.seeds import run_seed
    from fabfold.search.warmup import warm_up_job

    start = time.process_time()
    run_seed(warm_up_job(joints), 1, lambda _: None, lambda: False)
    # The real problem may use kernels that the strip does not: two seconds of it, thrown away.
    until = time.process_time() + 2.0
    run_seed(job, 0, lambda _: None, lambda: time.process_time() > until)
    return time.process_time() - start


class Judge:
    """The product's judge of folding, for others to leave something out or to look on."""

    def __init__(self, judge: Any) -> None:
        self.judge = judge

    def stuck_hinges(self, system: Any) -> Any:
        return self.judge.stuck_hinges(system)

    def estimate(self, system: Any, expansions: int, guide: Any = None) -> Any:
        return self.judge.estimate(system, expansions, guide)

    def path(self, system: Any, guide: Any = None) -> Any:
        return self.judge.path(system, guide)


class Recorder:
    """Writes down when better trees come, on a clock of processor seconds."""

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self.events: list[dict[str, Any]] = []
        self.trees: dict[int, dict[str, Any]] = {}
        self.best = float("inf")
        self.option = 0
        self._cpu, self._wall = time.process_time(), time.perf_counter()

    @property
    def cpu(self) -> float:
        """Processor seconds since the start."""
        return time.process_time() - self._cpu

    @property
    def wall(self) -> float:
        """Seconds of the clock since the start."""
        return time.perf_counter() - self._wall

    def over(self) -> bool:
        """Whether the time is up."""
        return self.cpu >= self.seconds or self.wall >= PATIENCE * self.seconds

    def report(self, candidate: Any) -> None:
        """Take a better tree of the seed that runs."""
        energy = candidate.energy
        if energy["total"] >= self.best - 1e-9:
            return
        self.best = energy["total"]
        number = len(self.events)
        self.events.append(
            {
                "cpu": round(self.cpu, 3),
                "wall": round(self.wall, 3),
                "joints": candidate.tree.joints,
                "hinges": len(candidate.tree.hinges),
                "surface": energy["surface"],
                "total": energy["total"],
                "moves": len(candidate.path),
                "seed": candidate.seed,
            }
        )
        self.trees[number] = {
            "option": self.option,
            "tree": candidate.tree.to_json(1.0, (0.0, 0.0, 0.0)),
            "path": candidate.path.tolist(),
        }
        if number >= FIRST + LAST:
            self.trees.pop(number - LAST, None)


def timed_run(
    model: Model,
    folder: Path,
    seed: int,
    joints: str | None,
    seconds: float,
    change: Callable[[Any], Any] | None = None,
) -> dict[str, Any]:
    """Search for so many processor seconds, round after round, as the product does.

    Parameters
    ----------
    model : Model
    folder : Path
        Keeps the voxelizations.
    seed : int
        Of the recipe.
    joints : str or None
        ``"S"`` or ``"S+D"``; None for the default.
    seconds : float
    change : callable, optional
        Changes each job, for the ablation.
    """
    from fabfold.errors import FabfoldError
    from fabfold.search.seeds import Job, run_seed

    facts: dict[str, Any] = {"seed": seed, "joints": joints, "seconds": seconds}
    try:
        kit = voxelized(model, folder)
        rounds = rounds_of(kit, recipe_of(kit, seed, joints))
        first = rounds.job(rounds._seeds(0)[0])
        if not isinstance(first, Job):
            return {**facts, "error": first.why, "events": [], "trees": {}}
        facts["kernels"] = warm_up(first, rounds.recipe.joints)
    except FabfoldError as error:
        return {**facts, "error": str(error), "events": [], "trees": {}}
    rounds = rounds_of(kit, rounds.recipe)  # the making of the jobs counts
    clock = Recorder(seconds)
    ended = []
    number = 0
    while not clock.over():
        for search_seed in rounds._seeds(number):
            if clock.over():
                break
            clock.option = rounds._option(search_seed)
            job = rounds.job(search_seed)
            if isinstance(job, Job):
                job = job if change is None else change(job)
                result = run_seed(job, search_seed, clock.report, clock.over)
            else:
                result = job
            if result.failed:
                raise SystemExit(result.why)
            why = "" if result.candidates else result.why
            ended.append([search_seed, clock.option, round(clock.cpu, 2), why])
        number += 1
    return {
        **facts,
        "template": model.template,
        "voxels": [len(voxels) for voxels in rounds.options],
        "cells": len(rounds.template),
        "cpu": clock.cpu,
        "wall": clock.wall,
        "ended": ended,
        "events": clock.events,
        "trees": clock.trees,
    }


def proven(
    model: Model,
    folder: Path,
    run: dict[str, Any],
    wanted: Sequence[str],
    gap_step_deg: float,
    before: dict[str, Any] | None = None,
) -> dict[str, Any]:
    """Build, certify and sample the first and the best tree of a run, or one of them.

    Where a tree is refused, the next one takes its place: the next later one for the first, the
    next worse one for the best. `before` is what was proven of this run already.
    """
    kit = voxelized(model, folder)
    rounds = rounds_of(kit, recipe_of(kit, run["seed"], run["joints"]))
    out = {**(before or {"tried": {}})}
    known = out["tried"]

    def holds(number: str) -> bool:
        if number not in known:
            known[number] = _prove(kit, rounds, run, number, gap_step_deg)
        return bool(known[number]["ok"])

    numbers = sorted(run["trees"], key=int)
    for what in wanted:
        order = numbers if what == "first" else numbers[::-1]
        good = (int(number) for number in order[:TRIES] if holds(number))
        out[what] = next(good, None)
    return out


def _prove(
    kit: Any, rounds: Any, run: dict[str, Any], number: str, gap_step_deg: float
) -> dict[str, Any]:
    import numpy as np

    from fabfold.errors import CheckError, GeometryError
    from fabfold.fold.motion import motion_of
    from fabfold.kit.stages import PlannedTree, build
    from fabfold.progress import SilentProgress
    from fabfold.proof.sampled import sample_path
    from fabfold.tree.fold_tree import FoldTree
    from fabfold.tree.kinematics_check import check_tree

    entry = run["trees"][number]
    tree = FoldTree.from_json(entry["tree"])
    path = np.array(entry["path"], dtype=np.int32).reshape(-1, 2)
    start = time.process_time()
    faults = check_tree(tree)
    if faults:
        return {"ok": False, "why": f"tree: {faults[0]}"}
    planned = PlannedTree(rounds.options[entry["option"]], tree, motion_of(tree, path))
    try:
        made = build(planned, kit.print_mode(), kit.recipe.voxel_mm, (), SilentProgress())
    except (GeometryError, CheckError) as error:
        return {"ok": False, "why": str(error), "seconds": time.process_time() - start}
    certified = time.process_time()
    joinery, motion = made.joinery, made.planned.motion
    seen = sample_path(
        made.planned.tree.to_json(joinery.voxel_mm, joinery.origin_mm),
        motion.to_json(),
        {body.name: (body.vertices, body.faces) for body in joinery.bodies},
        gap_step_deg=gap_step_deg,
    )
    return {
        "ok": seen.ok and seen.overlap_mm3 < 1e-3,
        "why": "; ".join(seen.hits[:2]),
        "seconds": certified - start,
        "proven_mm": motion.certificate["min_gap_mm"],
        "sampled_mm": seen.least_mm,
        "poses": seen.poses,
        "bodies": len(joinery.bodies),
        "triangles": sum(len(body.faces) for body in joinery.bodies),
        "carved_cells": joinery.carved_cells,
        "sampled_seconds": time.process_time() - certified,
    }
