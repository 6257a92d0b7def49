"""The first kit that folds, on disk while the search still looks for better ones."""

from __future__ import annotations

import pickle
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from fabfold.child_process import end_with_parent, module_call
from fabfold.fold.motion import motion_of
from fabfold.kit.stages import PlannedTree, build
from fabfold.printing.print_mode import PrintMode
from fabfold.progress import Listener
from fabfold.recipe.recipe import Recipe
from fabfold.search.rounds import Found
from fabfold.tree.bound import closed_share

__all__ = ["EarlyKit", "write_early"]

#: What takes long to load, loaded while there is no tree yet.
_NEEDED = ("fabfold.kit.writing", "manifold3d", "pymeshlab")


class EarlyKit:
    """Builds and writes a first tree beside the search, in a process of its own.

    A thread only waits for it: MeshLab, which looks at the bodies, may not be used in a thread that
    is not the first. What is written is what a printer needs and the proof that it folds:
    ``tree.json``, ``motion.json`` with its certificate, the bodies and the 3MF. Everything is
    replaced by the final kit, so it is given up where the search is over sooner. Where the tree
    cannot be built, nothing is written.

    Parameters
    ----------
    folder : Path
        Kit folder.
    recipe : Recipe
        Names the files and has the size of a voxel.
    mode : PrintMode
        How the kit is printed.
    listener : Listener
        Shows that the kit is there.
    """

    def __init__(self, folder: Path, recipe: Recipe, mode: PrintMode, listener: Listener) -> None:
        self._folder, self._recipe, self._mode = folder, recipe, mode
        self._listener = listener
        self._thread: threading.Thread | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._over = False

    def start(self, found: Found) -> None:
        """Begin with a tree; only the first call counts, and only in a folder without a kit."""
        if self._thread is not None or (self._folder / "report.json").is_file():
            return
        voxels, candidate = found
        motion = motion_of(candidate.tree, candidate.path)
        planned = PlannedTree(voxels, candidate.tree, motion)
        # A daemon, so that Ctrl-C ends the run at once: each file is written whole or not at all.
        self._thread = threading.Thread(target=self._make, args=(planned,), daemon=True)
        self._thread.start()

    def __enter__(self) -> EarlyKit:
        """Start the process, which loads what it needs before there is a tree."""
        there = (self._folder / name for name in ("tree.json", "report.json"))
        if not any(path.is_file() for path in there):
            self._process = self._open()
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Give up what the final kit replaces; where none will come, wait until it is written."""
        if kind is None or self._thread is None:
            self._over = True
            if self._process is not None:
                self._process.terminate()
                if self._thread is None:
                    self._process.communicate()
        self.wait()

    def _open(self) -> subprocess.Popen[bytes]:
        command, environment = module_call("fabfold.kit.early")
        return subprocess.Popen(
            command,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
        )

    def wait(self) -> None:
        """Wait until nothing is written any more."""
        if self._thread is not None:
            self._thread.join()

    def _make(self, planned: PlannedTree) -> None:
        work = pickle.dumps((planned, self._mode, self._recipe, self._folder))
        with self._listener.stage("early") as progress:
            process = self._process = self._process or self._open()
            if self._over:
                process.terminate()
            _, said = process.communicate(work)
            hinges, closed = len(planned.tree.hinges), 100 * closed_share(planned.tree)
            text = f"{hinges} hinges, box closed to {closed:.0f} %; better ones replace it"
            if process.returncode and self._over:
                text = "given up: the search is over"
            elif process.returncode:
                # The search has other trees.
                why = said.decode(errors="replace").strip().splitlines()[-1:]
                text = f"not this one: {' '.join(why)}"
            progress.update(1.0, text)


def write_early(work: bytes, before_writing: Callable[[], object] = lambda: None) -> None:
    """Build and write what :class:`EarlyKit` asks for.

    Parameters
    ----------
    work : bytes
        Pickle of the planned tree, the print mode, the recipe and the folder.
    before_writing : callable, optional
        Called once the bodies are made.

    Raises
    ------
    GeometryError, CheckError
        If the bodies do not come out.
    """
    from fabfold.kit.writing import write_printable
    from fabfold.progress import SilentProgress

    planned, mode, recipe, folder = pickle.loads(work)
    built = build(planned, mode, recipe.voxel_mm, (), SilentProgress(), orders=False)
    before_writing()
    write_printable(folder, recipe, mode, built)


if __name__ == "__main__":
    end_with_parent()
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    for name in _NEEDED:
        import_module(name)
    # Given up before it writes anything, or not at all: there are no half-written kits.
    write_early(sys.stdin.buffer.read(), lambda: signal.signal(signal.SIGTERM, signal.SIG_IGN))
