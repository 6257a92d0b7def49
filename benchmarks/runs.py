"""Models, the machine, and the search's own seeds; shared by the benchmarks beside it."""

from __future__ import annotations

import hashlib
import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib import metadata
from itertools import count
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
#: Raised with every change of the search that changes its trees or what they cost: rows of earlier
#: ones are marked.
SEARCH = 3
SHARED = HERE.parents[1] / "shared" / "models"
#: Seconds of the clock, for each second of the processor, after which a run ends anyway.
PATIENCE = 4.0


@dataclass(frozen=True)
class Model:
    """A model and the box that it is to become.

    Attributes
    ----------
    source : str
        ``sample:NAME``, or a file below the folder of models.
    template : str
        Name of the box.
    """

    source: str
    template: str

    def where(self, folder: Path = SHARED) -> str | None:
        """What fabfold takes as the model; None where there is no such file."""
        if self.source.startswith("sample:"):
            return self.source
        path = folder / self.source
        return str(path) if path.is_file() else None


MODELS = {
    "sample car": Model("sample:car", "box-3x4x4"),
    "sample duck": Model("sample:duck", "box-4x4x4"),
    "sample rabbit": Model("sample:rabbit", "box-4x4x4"),
    "sample elephant": Model("sample:elephant", "box-4x4x4"),
    "sample locomotive": Model("sample:locomotive", "box-4x4x4"),
    "bunny": Model("paper/bunny.stl", "box-4x4x4"),
    "kitten": Model("paper/kitten.stl", "box-4x4x4"),
    "dragon": Model("paper/dragon.stl", "box-4x4x4"),
    "car": Model("paper/car.stl", "box-3x4x4"),
    "elephant": Model("paper/elephant.stl", "box-5x5x5"),
    "u-car": Model("paper/car.stl", "u-112"),
    "airplane": Model("dev/airplane.ply", "box-4x4x4"),
    "bicycle": Model("dev/bicycle.stl", "box-4x4x4"),
    "double_torus": Model("dev/double_torus.off", "box-4x4x4"),
    "featuretype": Model("dev/featuretype.step", "box-4x4x4"),
    "idler_riser": Model("dev/idler_riser.stl", "box-4x4x4"),
    "knight": Model("dev/knight.stl", "box-4x4x4"),
    "locomotive": Model("dev/locomotive.stl", "box-4x4x4"),
    "office_chair": Model("dev/office_chair.stl", "box-4x4x4"),
    "spot": Model("dev/spot.obj", "box-4x4x4"),
    "trex": Model("dev/trex.stl", "box-4x4x4"),
}


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

    source = model.where()
    if source is None:
        raise SystemExit(f"{SHARED / model.source}: no such file")
    kit = Kit.from_model(
        source, template=model.template, folder=folder, workers=1, seed=1, **options
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


def jobs_of(rounds: Any) -> Iterator[tuple[int, Any]]:
    """Seeds of round after round and what each searches: those that need no other's result."""
    for number in count():
        for seed in sorted(rounds.batch(number).keys):
            yield seed, rounds.job(number, seed)


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
        self.best = float("inf")
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


def marked(name: str, row: dict[str, Any]) -> str:
    """The name of a table's row, marked where an earlier search made it."""
    return name if row.get("search") == SEARCH else f"{name} *"
