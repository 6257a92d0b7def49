"""What a newcomer waits for: the first kit after installing, and the next one.

    python benchmarks/first_run.py [SOURCE] [--options ...]

Exports a sample twice, in processes of their own: once with an empty cache of compiled kernels, and
once with what the first run left there. Prints seconds of the clock, processor seconds (workers
included), the size of the cache, and the size of the installed packages.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import sysconfig
import tempfile
import time
from pathlib import Path


def size_mib(folder: Path) -> float:
    """Size of all files below a folder, MiB."""
    return sum(p.stat().st_size for p in folder.rglob("*") if p.is_file()) / 2**20


def timed_export(source: str, options: list[str], kit: Path, cache: Path) -> tuple[float, float]:
    """Seconds of the clock and of the processors that an export takes."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    start = time.perf_counter()
    subprocess.run(
        [sys.executable, "-m", "fabfold", "export", source, "-q", "-o", str(kit), *options],
        env={**os.environ, "NUMBA_CACHE_DIR": str(cache)},
        check=True,
        stdout=subprocess.DEVNULL,
    )
    seconds = time.perf_counter() - start
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    processor = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return seconds, processor


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("source", nargs="?", default="sample:car")
    parser.add_argument("--options", nargs=argparse.REMAINDER, default=[])
    asked = parser.parse_args()
    packages = Path(sysconfig.get_paths()["purelib"])
    print(f"installed packages: {size_mib(packages):.0f} MiB")
    with tempfile.TemporaryDirectory() as folder:
        cache = Path(folder) / "kernels"
        for name in ("first", "second"):
            seconds, processor = timed_export(
                asked.source, asked.options, Path(folder) / name, cache
            )
            print(
                f"{name} export of {asked.source}: {seconds:.0f} s by the clock, "
                f"{processor:.0f} processor seconds; kernels kept: {size_mib(cache):.0f} MiB",
                flush=True,
            )


if __name__ == "__main__":
    main()
