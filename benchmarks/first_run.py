"""What a newcomer waits for: the first kit after installing, and the next one.

    python benchmarks/first_run.py [SOURCE] [--options ...]
    python benchmarks/first_run.py --cold-only [--limit SECONDS]

Exports a sample twice, in processes of their own: once with an empty cache of compiled kernels, and
once with what the first run left there. Prints seconds of the clock, processor seconds (workers
included), the size of the cache, and the size of the installed packages. With ``--cold-only`` only
the kernels are compiled, with an empty cache, as the first export does it; it exits with 1 where
that takes more processor seconds than the limit.
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


def compile_cold(limit: float | None) -> int:
    """Compile the kernels with an empty cache; exit code."""
    from fabfold.progress import SilentProgress
    from fabfold.search.kernels import KernelCompiler

    with tempfile.TemporaryDirectory() as folder:
        os.environ["NUMBA_CACHE_DIR"] = folder
        from numba.core import config

        config.CACHE_DIR = folder
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        start = time.perf_counter()
        compiler = KernelCompiler()
        compiler.start()
        compiler.wait(SilentProgress())
        seconds = time.perf_counter() - start
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        processor = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        kernels = len(list(Path(folder).rglob("*.nbc")))
        print(
            f"kernels from an empty cache: {processor:.0f} processor seconds, {seconds:.0f} s by "
            f"the clock, {kernels} compiled"
        )
    return int(kernels == 0 or (limit is not None and processor > limit))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("source", nargs="?", default="sample:car")
    parser.add_argument("--options", nargs=argparse.REMAINDER, default=[])
    parser.add_argument("--cold-only", action="store_true")
    parser.add_argument("--limit", type=float, metavar="SECONDS")
    asked = parser.parse_args()
    if asked.cold_only:
        return compile_cold(asked.limit)
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
    return 0


if __name__ == "__main__":
    sys.exit(main())
