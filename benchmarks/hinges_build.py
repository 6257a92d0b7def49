"""Seconds to build hinges: single, double, long, sixty with equal ones cached, the coupon.

python benchmarks/hinges_build.py [--repeat 5]

The last row is the whole command, from its start to its end.
"""

from __future__ import annotations

import argparse
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from hinges import Coupon, DoubleHinge, Leaf, SingleHinge, write_coupon
from hinges import double as _double
from hinges import exact_solids as _exact
from hinges import single as _single
from hinges.mesh import _double as _double_mesh
from hinges.mesh import _single as _single_mesh
from hinges.mesh import double_hinge_meshes, single_hinge_meshes
from hinges.plan_double import plan_double
from hinges.plan_single import plan_single


def forget() -> None:
    """Empty every cache, so that a build starts from nothing."""
    caches = (plan_single, plan_double, _single._half, _single._carve, _double._piece)
    for cache in (*caches, _double._carve, _exact._at_nought, _single_mesh, _double_mesh):
        cache.cache_clear()


def sixty() -> None:
    """Twenty placements each of two singles and one double, as a kit of equal voxels has."""
    for _ in range(20):
        for hinge in (SingleHinge(20, clearance=0.3), SingleHinge(25, knuckles=5, clearance=0.3)):
            _ = hinge.parent_half, hinge.child_half, hinge.parent_carve, hinge.child_carve
        double = DoubleHinge(20, clearance=0.3)
        _ = double.parent_half, double.link, double.child_half


def long() -> SingleHinge:
    """A piano hinge."""
    return SingleHinge(200, knuckles=31, clearance=0.3, leaf=Leaf(14, 2))


def command(path: Path) -> None:
    """Run the whole command that makes a coupon."""
    words = [sys.executable, "-m", "fabfold", "coupon", "--profile", "fdm-pla-0.4", "-o", str(path)]
    subprocess.run(words, check=True, capture_output=True)


def busy_seconds() -> float:
    """Processor time of this process and of those that it ran, in seconds."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def timed(work: Callable[[], object], repeat: int) -> tuple[float, float]:
    """Median seconds of `repeat` runs from empty caches: by the clock, and of the processor."""
    spent, worked = [], []
    for _ in range(repeat):
        forget()
        start, busy = time.perf_counter(), busy_seconds()
        work()
        spent.append(time.perf_counter() - start)
        worked.append(busy_seconds() - busy)
    return statistics.median(spent), statistics.median(worked)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeat", type=int, default=5)
    repeat = parser.parse_args().repeat
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "coupon.3mf"
        rows: list[tuple[str, Callable[[], object], float | None]] = [
            ("single hinge, exact", lambda: SingleHinge(20, clearance=0.3), 0.1),
            ("double hinge, exact", lambda: DoubleHinge(20, clearance=0.3), 0.5),
            ("31 knuckles, exact", long, None),
            ("60 hinges, equal ones cached", sixty, None),
            ("single hinge, mesh", lambda: single_hinge_meshes(20, 0.3), None),
            ("double hinge, mesh", lambda: double_hinge_meshes(20, 0.3), None),
            ("coupon, exact", Coupon, 5.0),
            ("coupon, 3MF and guide", lambda: write_coupon(path), 5.0),
            ("fabfold coupon", lambda: command(path), 5.0),
        ]
        SingleHinge(30, clearance=0.3)  # load the kernel
        print(f"{'what':32} {'clock':>8} {'CPU':>8} {'aim':>6}  (s)")
        for name, work, aim in rows:
            spent, worked = timed(work, repeat)
            print(f"{name:32} {spent:8.3f} {worked:8.3f} {aim if aim else '':>6}", flush=True)


if __name__ == "__main__":
    main()
