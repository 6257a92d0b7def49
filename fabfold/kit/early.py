"""The first kit that folds, on disk while better trees are still looked for."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import BinaryIO

from fabfold.child_process import end_with_parent, module_call
from fabfold.errors import CheckError, FabfoldError, GeometryError, NoFoldError
from fabfold.kit.first_trees import first_trees
from fabfold.kit.stages import BuiltTree, build
from fabfold.lattice.template import Template
from fabfold.printing.print_mode import PrintMode
from fabfold.progress import Listener, SilentProgress, children_seconds
from fabfold.recipe.recipe import Recipe
from fabfold.search.kernels import kernel_stamp
from fabfold.solid.closed_solid import Solid
from fabfold.tree.bound import closed_share
from fabfold.wishes.wish_list import Wishes

__all__ = ["EarlyKit", "write_early"]

#: What takes long to load, loaded while the process waits for its model.
_NEEDED = ("fabfold.kit.writing", "manifold3d", "pymeshlab")
#: Trees whose bodies are tried.
_TREES = 3
#: What the process says once it has something to write.
_MADE = b"made\n"


class EarlyKit:
    """Cuts a model in haste, takes a tree that folds and builds it, in a process of its own.

    It does so from the moment the model is read, beside cutting it well and searching. A thread
    only waits for it: MeshLab, which looks at the bodies, may not be used in a thread that is not
    the first. What is written is what a printer needs and the proof that it folds: ``tree.json``,
    ``motion.json`` with its certificate, the bodies and the 3MF. Everything is replaced by the
    final kit, so it is given up where the search is over sooner. Where no tree can be built,
    nothing is written.

    Parameters
    ----------
    recipe : Recipe
        Names the files and has the size of a voxel.
    template : Template
        The target shape, as it is filled.
    mode : PrintMode
        How the kit is printed.
    folder : Path
        Kit folder; nothing is made where it has a kit.
    model : callable
        Gives the model and the wishes, once they are needed.
    claim : callable
        Makes the folder this run's, before anything is written to it; called in another thread.
    listener : Listener
        Shows that the kit is there.

    Attributes
    ----------
    processor_seconds : float
        What its process has cost, once that has ended.
    """

    def __init__(
        self,
        recipe: Recipe,
        template: Template,
        mode: PrintMode,
        folder: Path,
        model: Callable[[], tuple[Solid, Wishes]],
        claim: Callable[[], object],
        listener: Listener,
    ) -> None:
        self._job = recipe, template, mode, folder
        self._model, self._claim, self._listener = model, claim, listener
        there = (folder / name for name in ("tree.json", "report.json"))
        self._wanted = not any(path.is_file() for path in there)
        self._process: subprocess.Popen[bytes] | None = None
        self._threads: list[threading.Thread] = []
        # Between giving up and claiming the folder only one may come first.
        self._lock = threading.Lock()
        self._over = self._claimed = self._searching = False
        self.processor_seconds = 0.0

    def __enter__(self) -> EarlyKit:
        """While it is open, the kit may be made."""
        return self

    def start(self, *, wanted: bool = True) -> None:
        """Begin, if it has not begun.

        Not before the search's kernels are compiled, for here they would be compiled once more.

        Parameters
        ----------
        wanted : bool
            False to make nothing, now or later.
        """
        self._wanted &= wanted
        if not self._wanted or self._process is not None or not kernel_stamp().exists():
            return
        solid, wishes = self._model()
        command, environment = module_call("fabfold.kit.early")
        self._process = subprocess.Popen(
            command,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
        # Its modules are loaded before it reads, which nobody shall wait for.
        work = pickle.dumps((*self._job, solid, wishes))
        # A daemon, so that Ctrl-C ends the run at once: each file is written whole or not.
        for task in (partial(_send, self._process, work), partial(self._follow, self._process)):
            self._threads.append(threading.Thread(target=task, daemon=True))
            self._threads[-1].start()

    def search(self) -> None:
        """Begin at the latest now: the search does, and may find nothing before this does."""
        if not self._over:
            self.start()
            self._searching = True

    def _follow(self, process: subprocess.Popen[bytes]) -> None:
        """Let it write once it has something to write, and say what became of it."""
        assert process.stdin and process.stdout and process.stderr
        with self._listener.stage("early") as progress:
            progress.update(None, "cut in haste, beside the good one")
            trouble = ""
            if any(line == _MADE for line in process.stdout):
                with self._lock:
                    self._claimed = not self._over
                    try:
                        if self._claimed:
                            self._claim()
                    except (FabfoldError, OSError) as error:
                        trouble = str(error)
                        process.terminate()
            with suppress(BrokenPipeError):
                process.stdin.close()  # That its input ends tells it that it may write.
            said = process.stderr.read().decode(errors="replace").strip()
            before = children_seconds()
            process.wait()
            self.processor_seconds = children_seconds() - before
            last = "".join(said.splitlines()[-1:])
            if process.returncode == 0:
                text = f"{last}; better ones replace it"
            elif self._over:
                text = "given up" + (": the search is over" if self._searching else "")
            else:
                # The search has other trees.
                text = f"not this time: {trouble or last.partition('Error: ')[2] or last}"
            progress.update(1.0, text)

    def end(self) -> None:
        """Give up what the final kit will replace, or what nothing will come of."""
        with self._lock:
            self._over = True
            if self._process is not None:
                self._process.terminate()
        self.wait()

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Where no better kit will come, wait until this one is written."""
        if kind is None or not (self._searching or self._claimed):
            self.end()
        self.wait()

    def wait(self) -> None:
        """Wait until nothing is written any more."""
        for thread in self._threads:
            thread.join()


def _send(process: subprocess.Popen[bytes], work: bytes) -> None:
    assert process.stdin is not None
    with suppress(BrokenPipeError):  # It ended; what follows it says why.
        process.stdin.write(work)
        process.stdin.flush()


def write_early(source: BinaryIO, before_writing: Callable[[], object] = lambda: None) -> str:
    """Find, build and write what :class:`EarlyKit` asks for.

    Parameters
    ----------
    source : binary file
        A pickle of the recipe, template, print mode, folder, solid and wishes.
    before_writing : callable, optional
        Called once the bodies are made.

    Returns
    -------
    str
        What the kit is, in a few words.

    Raises
    ------
    NoVoxelsError, NoTreeError, RecipeError
        As :func:`first_trees` does.
    NoFoldError
        If no tree folds.
    GeometryError, CheckError
        If the bodies of none come out.
    """
    from fabfold.kit.writing import write_printable

    recipe, template, mode, folder, solid, wishes = pickle.load(source)
    built = _first_built(recipe, template, solid, wishes, mode)
    before_writing()
    write_printable(folder, recipe, mode, built, slicers=False)
    tree = built.planned.tree
    return f"{len(tree.hinges)} hinges, box closed to {100 * closed_share(tree):.0f} %"


def _first_built(
    recipe: Recipe, template: Template, solid: Solid, wishes: Wishes, mode: PrintMode
) -> BuiltTree:
    trees = first_trees(recipe, template, solid, wishes)
    why: GeometryError | CheckError | None = None
    for planned, _ in zip(trees, range(_TREES), strict=False):
        try:
            return build(planned, mode, recipe.voxel_mm, (), SilentProgress(), orders=False)
        except (GeometryError, CheckError) as error:
            why = error
    raise why or NoFoldError("nothing folds yet")


def _keep_manifold_to_one_core() -> None:
    """Let manifold3d use one core: the search needs the others, and its threads mostly wait.

    It asks the system once, at its first work, how many there are.
    """
    if sys.platform != "linux":
        return
    from manifold3d import Manifold

    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(cores)})
    try:
        ball = Manifold.sphere(1.0, 40)
        (ball - ball.translate((0.5, 0.0, 0.0))).num_tri()
    finally:
        os.sched_setaffinity(0, cores)


def _wait_to_write() -> None:
    """Tell :class:`EarlyKit` that the bodies are made, and wait until they may be written."""
    sys.stdout.buffer.write(_MADE)
    sys.stdout.flush()
    sys.stdin.buffer.read()
    # Given up before it writes anything, or not at all: there are no half-written kits.
    signal.signal(signal.SIGTERM, signal.SIG_IGN)


if __name__ == "__main__":
    end_with_parent()
    # A run that is interrupted gives this up or waits for it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for name in _NEEDED:
        import_module(name)
    _keep_manifold_to_one_core()
    said = write_early(sys.stdin.buffer, _wait_to_write)
    sys.stderr.write(f"{said}\n")
