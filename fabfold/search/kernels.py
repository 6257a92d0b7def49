"""The search's kernels, compiled once an installation by two processes into one cache.

numba compiles a kernel when it is first called and keeps it beside the source. Without help the
program itself and each worker would compile the same kernels side by side. So where they are not
there yet, two processes compile a half each while the model is read and cut: those of the tree and
of the proof, and those of folding. The search begins when they are done.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import numpy as np

from fabfold.child_process import end_with_parent, module_call
from fabfold.progress import Progress, children_seconds

__all__ = ["HALVES", "KernelCompiler", "compile_half", "forget_stale_kernels", "kernel_stamp"]

#: What the processes compile.
HALVES = ("tree", "fold")
#: Seconds between looks at the processes.
_TICK = 0.2
#: Packages that have kernels.
_PACKAGES = ("export", "fold", "lattice", "proof", "solid", "tree", "voxels")


def kernel_stamp() -> Path:
    """File that is there once the kernels of these sources are compiled for this machine."""
    import numba
    from numba.core import config
    from numba.core.registry import cpu_target

    root = Path(__file__).resolve().parents[1]
    machine = cpu_target.target_context.codegen().magic_tuple()
    digest = hashlib.sha256(f"{numba.__version__} {sys.version} {machine}".encode())
    for package in _PACKAGES:
        for path in sorted((root / package).glob("*.py")):
            about = path.stat()
            digest.update(f"{path.name} {about.st_size} {about.st_mtime_ns}".encode())
    folder = Path(config.CACHE_DIR) if config.CACHE_DIR else root / "tree" / "__pycache__"
    if not os.access(folder if folder.exists() else folder.parent, os.W_OK):
        folder = Path.home() / ".cache" / "fabfold"
    return folder / f"kernels-{digest.hexdigest()[:16]}.stamp"


def forget_stale_kernels(root: Path) -> int:
    """Remove compiled kernels that are older than any source of kernels.

    numba compiles a kernel anew where the file that it stands in has changed, but not where a
    kernel that it calls has, in another file. So after an update, which leaves compiled kernels
    where they are, old code would be called. Kernels in a folder of the user's own
    (``NUMBA_CACHE_DIR``) are left alone: it may hold those of others.

    Parameters
    ----------
    root : Path
        Folder of the package.

    Returns
    -------
    int
        How many kernels were removed.
    """
    sources = (path for name in _PACKAGES for path in (root / name).glob("*.py"))
    newest = max((path.stat().st_mtime for path in sources), default=0.0)
    removed = 0
    for name in _PACKAGES:
        for index in (root / name / "__pycache__").glob("*.nbi"):  # without it no code is found
            with suppress(OSError):  # Another process may do the same, or the folder be read-only.
                if index.stat().st_mtime < newest:
                    index.unlink()
                    removed += 1
    return removed


class KernelCompiler:
    """Processes that compile what is missing; none where everything is there.

    Attributes
    ----------
    processor_seconds : float
        What it has cost, once it was waited for.

    Examples
    --------
    >>> compiler = KernelCompiler()
    >>> begun = compiler.start()  # goes on beside what follows
    >>> compiler.close()
    """

    def __init__(self) -> None:
        self._stamp = kernel_stamp()
        self._running: list[subprocess.Popen[bytes]] = []
        self.processor_seconds = 0.0

    def start(self) -> bool:
        """Begin, unless the kernels are there or it has begun already; whether there is work."""
        from numba.core import config

        if self._running or self._stamp.exists():
            return bool(self._running)
        if not config.CACHE_DIR:
            forget_stale_kernels(Path(__file__).resolve().parents[1])
        atexit.register(self.close)  # where the run ends before the search begins
        for half in HALVES:
            command, environment = module_call("fabfold.search.kernels", half)
            # LLVM's first level makes kernels as fast as its third, in less time.
            environment.setdefault("NUMBA_OPT", "1")
            self._running.append(
                subprocess.Popen(
                    command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
                )
            )
        return True

    def wait(self, progress: Progress) -> None:
        """Wait until all is compiled.

        A process that fails is no matter: who needs a kernel that is missing compiles it.

        Parameters
        ----------
        progress : Progress
            Is told what is being waited for.
        """
        if not self._running:
            return
        before = children_seconds()
        try:
            while any(process.poll() is None for process in self._running):
                done = sum(process.poll() is not None for process in self._running)
                progress.update(
                    None,
                    "compiling the search's kernels, once an installation: "
                    f"{done} of {len(HALVES)} parts",
                )
                time.sleep(_TICK)
            if all(process.returncode == 0 for process in self._running):
                self._write_stamp()
        finally:
            self.close()
            self.processor_seconds += children_seconds() - before

    def close(self) -> None:
        """End what still runs."""
        for process in self._running:
            if process.poll() is None:
                process.terminate()
            process.wait()
        self._running.clear()
        atexit.unregister(self.close)

    def _write_stamp(self) -> None:
        try:
            self._stamp.parent.mkdir(parents=True, exist_ok=True)
            for old in self._stamp.parent.glob("kernels-*.stamp"):
                old.unlink()
            self._stamp.touch()
        except OSError:
            return  # Then the next run looks again; that costs it some seconds.


def compile_half(half: str) -> None:
    """Compile one half of the kernels in this process, by using them.

    Parameters
    ----------
    half : str
        One of :data:`HALVES`.
    """
    if half == "tree":
        _search_without_folding()
        # Not searched with, but wanted by the first kit soon after, and this half is the shorter.
        _prove_a_gap()
    else:
        _fold_strips()


def _fold_strips() -> None:
    """Test, plan and shorten the folding of a strip of four cells and of two on a link plate."""
    from fabfold.fold.lattice_foldability import LatticeFoldability
    from fabfold.tree.system import HingeSystem

    strip = HingeSystem(
        cells=np.array([(i, 0, 0) for i in range(4)], np.int32),
        body=np.arange(4, dtype=np.int32),
        parent=np.arange(3, dtype=np.int32),
        point2=np.array([(1, 0, 1), (3, 0, -1), (5, 0, 1)], np.int32),
        axis=np.array([1, 1, 1], np.int8),
        turns=np.array([-2, 2, -2], np.int8),
    )
    linked = HingeSystem(
        cells=np.array([(0, 0, 0), (1, 0, 0)], np.int32),
        body=np.array([0, 2], np.int32),
        parent=np.arange(2, dtype=np.int32),
        point2=np.array([(1, 0, 1), (1, 1, 0)], np.int32),
        axis=np.array([1, 2], np.int8),
        turns=np.array([-2, 2], np.int8),
    )
    judge = LatticeFoldability()
    for system in (strip, linked):
        judge.stuck_hinges(system)
        found = judge.estimate(system, 40)
        judge.path(system, found.guide)


def _prove_a_gap() -> None:
    """Prove that two triangles keep apart."""
    from fabfold.proof.bvh import new_bodies, place
    from fabfold.proof.gap import prove_pairs

    corners = np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]])
    boxes, placed = new_bodies([corners, corners + 2.0])
    place(boxes, placed, np.stack([np.eye(4)] * 2))
    one, other = np.zeros(1, np.int32), np.ones(1, np.int32)
    result, pair = np.array([2.0, np.inf, 0.0]), np.zeros(2, np.int32)
    prove_pairs(boxes, placed, one, other, 0.0, 0.0, 1.0, 1e-6, result, pair)


def _search_without_folding() -> None:
    """Search the strip of the warm-up with a judge to whom everything folds, in both ways."""
    from dataclasses import replace

    from fabfold.search.schedule import schedule
    from fabfold.search.warmup import warm_up_job
    from fabfold.tree.foldability import PlannerEstimate
    from fabfold.tree.solve import solve
    from fabfold.tree.system import HingeSystem

    class Yes:
        def stuck_hinges(self, system: HingeSystem) -> np.ndarray:
            return np.zeros((2, len(system.parent)), np.bool_)

        def estimate(
            self, system: HingeSystem, expansions: int, guide: np.ndarray | None = None
        ) -> PlannerEstimate:
            none = np.zeros((0, 5), np.int32) if guide is None else guide
            return PlannerEstimate(np.zeros(len(system.parent), np.int32), none)

        def path(self, system: HingeSystem, guide: np.ndarray | None = None) -> np.ndarray:
            return np.stack([np.arange(len(system.parent)), system.turns], axis=1).astype(np.int32)

    job = warm_up_job()
    # Poses are annealed by most seeds, and grown by the first one.
    for effort in (replace(job.effort, kicks=1), schedule("normal", 0)[0].effort):
        solve(job.problem, 1, Yes(), effort)


if __name__ == "__main__":
    end_with_parent()
    compile_half(sys.argv[1])
