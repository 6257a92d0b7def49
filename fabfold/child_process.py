"""How modules of ours are run in processes of their own."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

__all__ = ["end_with_parent", "module_call", "safe_path"]

#: Environment variable with the number of the process that called.
_PARENT = "FABFOLD_PARENT"
#: PR_SET_PDEATHSIG of prctl.
_DEATH_SIGNAL = 1


def module_call(module: str, *arguments: str) -> tuple[list[str], dict[str, str]]:
    """How a module of ours is run by the same Python in a process of its own.

    Unlike a process of multiprocessing it does not read a script of the user's once more, so the
    script needs no ``if __name__ == "__main__"``. Modules are found where this process finds them
    and nowhere else: a ``numpy.py`` in the working folder is not taken for numpy.

    Parameters
    ----------
    module : str
        Dotted name of the module.
    *arguments : str
        What it is given.

    Returns
    -------
    command : list of str
        Program and arguments.
    environment : dict of str to str
        Environment variables.
    """
    places = [part for part in sys.path if part]
    root = str(Path(__file__).resolve().parents[1])
    if root not in places:  # Found through the working folder, by an empty entry.
        places.append(root)
    path = os.pathsep.join(places)
    # BLAS' threads wait for each other longer than they work on matrices as small as ours.
    threads = {"OPENBLAS_NUM_THREADS": "1"}
    environment = {**threads, **os.environ, "PYTHONPATH": path, _PARENT: str(os.getpid())}
    return [sys.executable, "-P", "-m", module, *arguments], environment


def end_with_parent(parent: int | None = None) -> None:
    """Let this process end as soon as the one that called it does, however that ends.

    Otherwise what a killed run has left would still write into its kit while the next run does.
    Only Linux can do so.

    Parameters
    ----------
    parent : int, optional
        Number of the process that called; by default what :func:`module_call` has noted.
    """
    if sys.platform != "linux":
        return
    ctypes.CDLL(None).prctl(_DEATH_SIGNAL, signal.SIGKILL)
    known = os.environ.get(_PARENT, "") if parent is None else str(parent)
    if known and known != str(os.getppid()):
        os._exit(1)  # It ended before the system was told.


@contextmanager
def safe_path() -> Iterator[None]:
    """While it is open, started Python processes do not look for modules in the working folder."""
    before = os.environ.get("PYTHONSAFEPATH")
    os.environ["PYTHONSAFEPATH"] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ["PYTHONSAFEPATH"]
        else:
            os.environ["PYTHONSAFEPATH"] = before
