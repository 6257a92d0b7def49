"""The exception tree of fabfold.

.. code-block:: text

    FabfoldError                     anything that fabfold itself reports   exit code
    ├── InputError                   bad usage or bad input                     2
    │   ├── ModelError               the 3D model cannot be used                2
    │   ├── RecipeError              an option or recipe value is wrong         2
    │   ├── TemplateError            the target shape cannot be used            2
    │   └── KitError                 the kit folder is not what it should be    2
    ├── NoSolutionError              the search ended with nothing that works   3
    │   ├── NoVoxelsError            no grid placement fits the template        3
    │   ├── NoTreeError              no tree fits the template                  3
    │   └── NoFoldError              trees fit, but none could be folded        3
    ├── CheckError                   a finished kit failed one of its checks    1
    ├── GeometryError                a geometric construction failed            1
    └── WorkerError                  processes or a cluster failed the search   1

Every message says what is wrong, where, and what to do about it.
"""

from __future__ import annotations

import errno
import re

__all__ = [
    "CheckError",
    "FabfoldError",
    "GeometryError",
    "InputError",
    "KitError",
    "ModelError",
    "NoFoldError",
    "NoSolutionError",
    "NoTreeError",
    "NoVoxelsError",
    "RecipeError",
    "TemplateError",
    "WorkerError",
    "harmless",
    "system_message",
]

#: What to do about an error of the file system.
_REMEDIES = {
    errno.EACCES: "it may not be read or written by you; change its permissions or choose another",
    errno.EPERM: "it may not be changed by you; choose another place",
    errno.EROFS: "that place can only be read; give another with --output",
    errno.ENOSPC: "the disk is full; make room and run the same command again, it goes on",
    errno.EDQUOT: "your share of the disk is full; make room and run the same command again",
    errno.ENAMETOOLONG: "the name is too long; give a shorter one",
    errno.ENOTDIR: "a part of that path is a file, not a folder; give another",
    errno.EISDIR: "that is a folder, a file is wanted",
    errno.ENOENT: "there is no such file, folder or place to write to",
    errno.EMFILE: "too many files are open; close other programs",
    errno.EPIPE: "the program that reads the output has ended",
}


class FabfoldError(Exception):
    """Base of every error that fabfold reports on purpose.

    Attributes
    ----------
    exit_code : int
        What the command line returns for this error.
    """

    exit_code: int = 1


class InputError(FabfoldError):
    """The caller gave something that cannot be used."""

    exit_code = 2


class ModelError(InputError):
    """The 3D model cannot be read, or is not one solid."""


class RecipeError(InputError):
    """An option of the recipe or the command line is wrong."""


class TemplateError(InputError):
    """The template (target shape) is unknown or malformed."""


class KitError(InputError):
    """The kit folder is missing something, or holds something else."""


class NoSolutionError(FabfoldError):
    """A search ended within its limits and found nothing."""

    exit_code = 3


class NoVoxelsError(NoSolutionError):
    """No placement of the grid gives a voxelization that the template can hold."""


class NoTreeError(NoSolutionError):
    """No joint tree carries the voxels into the template."""


class NoFoldError(NoSolutionError):
    """Trees fit the template, but none survived folding on the real bodies."""


class CheckError(FabfoldError):
    """A finished kit failed one of its checks."""


class GeometryError(FabfoldError):
    """A geometric construction gave no valid solid."""


class WorkerError(FabfoldError):
    """The worker processes or the cluster cannot go on with the search."""


def system_message(error: OSError) -> str:
    """One sentence about an error of the file system: where, what, and what to do.

    Parameters
    ----------
    error : OSError
        What was raised.

    Returns
    -------
    str
        The sentence.
    """
    what = error.strerror or str(error) or type(error).__name__
    name = error.filename2 if error.filename2 is not None else error.filename
    where = "" if name is None else f"{str(name)[:200]}: "
    remedy = _REMEDIES.get(error.errno or 0)
    return f"{where}{what}" + ("" if remedy is None else f": {remedy}")


#: What a terminal obeys instead of showing it: control characters, and turns of direction.
_COMMANDS = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069]")


def harmless(text: str) -> str:
    r"""A text that may hold names from somebody's file, so that a terminal only shows it.

    Parameters
    ----------
    text : str
        Any text.

    Returns
    -------
    str
        Control characters are written out, such as ``\x1b``; line ends and tabs stay.
    """
    return _COMMANDS.sub(lambda found: ascii(found[0])[1:-1], text)
