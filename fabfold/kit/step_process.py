"""STEP written by a process of its own, beside the checks and the pictures."""

from __future__ import annotations

import gc
import pickle
import signal
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO

from fabfold.child_process import end_with_parent, module_call
from fabfold.errors import GeometryError
from fabfold.export.colours import body_colours
from fabfold.export.hardware_brep import hardware_solids
from fabfold.export.step import write_step
from fabfold.joinery.bodies import Joinery
from fabfold.joinery.box_hold import Retention
from fabfold.kit.stages import BuiltTree
from fabfold.tree.fold_tree import FoldTree

__all__ = ["HARDWARE", "StepProcess", "assembled_path"]

#: Folder of the files that hold more than the printed bodies.
HARDWARE = "hardware"


def assembled_path(step: Path) -> Path:
    """Where the file with bodies, pins and magnets is, beside that of the bodies alone."""
    return step.parent / HARDWARE / f"{step.stem}-assembled.step"


class StepProcess:
    """Writes the STEP file of a kit while this process does something else.

    Turning meshes into faces and having the CAD kernel check them takes longer than anything else
    that is done with finished bodies, and nothing waits for it. What is written is byte for byte
    what :func:`fabfold.export.step.write_step` writes.

    Parameters
    ----------
    path : Path
        File to write, ending in ``.step``; its name names the assembly.
    built : BuiltTree
        The printed bodies in shape A. With magnets or pins there is a second file that holds all,
        in the folder :data:`HARDWARE`.
    beside : bool
        False writes it in this process, once it is waited for.

    Examples
    --------
    ::

        with StepProcess(folder / "car.step", built) as step:
            checks = check_everything()
            step.wait()
    """

    def __init__(
        self,
        path: Path,
        built: BuiltTree,
        *,
        beside: bool = True,
    ) -> None:
        self._work = (path, built.joinery, built.planned.tree, built.retention)
        self._beside = beside
        self._process: subprocess.Popen[bytes] | None = None
        self._said: IO[bytes] | None = None

    def __enter__(self) -> StepProcess:
        if not self._beside:
            return self
        command, environment = module_call("fabfold.kit.step_process")
        # A file, not a pipe: nobody empties it before the process ends.
        self._said = TemporaryFile()
        self._process = subprocess.Popen(
            command,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=self._said,
        )
        assert self._process.stdin is not None
        try:
            with self._process.stdin as work:
                pickle.dump(self._work, work)
        except BrokenPipeError:  # It has ended; wait() tells why.
            pass
        return self

    def wait(self) -> None:
        """Wait until the file is written.

        Raises
        ------
        GeometryError
            If the CAD kernel finds no valid solid for a body, or the process was ended.
        """
        if self._process is None or self._said is None:
            _write(*self._work)
            return
        if self._process.wait() == 0:
            return
        self._said.seek(0)
        why = self._said.read().decode(errors="replace").strip().splitlines()[-1:]
        raise GeometryError(f"no STEP file: {''.join(why) or 'its process was ended'}")

    def __exit__(self, *_: object) -> None:
        """End the process where nobody waited for it."""
        if self._process is None or self._said is None:
            return
        if self._process.poll() is None:
            self._process.terminate()
            self._process.wait()
        self._said.close()


def _write(path: Path, joinery: Joinery, tree: FoldTree, retention: Retention | None) -> None:
    write_step(
        path,
        joinery,
        tree,
        title=path.stem,
        colours=body_colours(tree),
        hardware=hardware_solids(joinery, tree, retention),
        assembled=assembled_path(path),
    )


if __name__ == "__main__":
    end_with_parent()
    # Millions of numbers in lists, none of them in a circle: to look for circles takes seconds.
    gc.disable()
    # Asked to end, it takes its temporary file along.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    _write(*pickle.loads(sys.stdin.buffer.read()))
