"""TOML files that people write, however their editor saved them, with every fault told at once."""

from __future__ import annotations

import difflib
import re
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from pydantic import ValidationError

__all__ = ["TomlError", "faults_of", "line_of", "nearest", "read_toml"]

#: What pydantic puts before the message of a validator of ours.
_PREFIX = re.compile(r"^(Value|Assertion) error, ")


class TomlError(ValueError):
    """A file that is no TOML; says the line where it can."""


def read_toml(path: Path) -> tuple[dict[str, Any], str]:
    """Read a TOML file in UTF-8 or UTF-16, with or without a byte-order mark.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    data : dict
        Its tables.
    text : str
        Its text, for the lines of :func:`faults_of`.

    Raises
    ------
    TomlError
        If it cannot be read.
    """
    try:
        raw = path.read_bytes()
        marked = raw[:2] in (b"\xff\xfe", b"\xfe\xff")
        text = raw.decode("utf-16" if marked else "utf-8-sig")
        return tomllib.loads(text.replace("\r\n", "\n")), text
    except OSError as error:
        raise TomlError(f"cannot be read: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise TomlError("cannot be read: it is no text in UTF-8 or UTF-16") from None
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise TomlError(f"cannot be read: {error}") from None


def nearest(name: str, known: Iterable[str]) -> str:
    """What to say after a name that is not known: the nearest one, or all.

    Parameters
    ----------
    name : str
        The name.
    known : iterable of str
        Those that there are.
    """
    names = list(known)
    close = difflib.get_close_matches(name, names, n=1, cutoff=0.6)
    return f"did you mean {close[0]}?" if close else f"there are {', '.join(names)}"


def faults_of(error: ValidationError, known: Iterable[str], text: str = "") -> str:
    """All faults that a model of pydantic found, each with its line where there is a text.

    Parameters
    ----------
    error : ValidationError
        What was found.
    known : iterable of str
        Names of the fields, for those that are unknown.
    text : str
        Text of the file.

    Returns
    -------
    str
        Sentences with semicolons between.
    """
    names = list(known)
    told: dict[str, None] = {}  # One fault of a choice is told once, not for each alternative.
    for problem in error.errors():
        where = ".".join(str(part) for part in problem["loc"][:1]) or "it"
        line = line_of(text, where)
        if problem["type"] == "extra_forbidden":
            told[f"{line}{where} is no option; {nearest(where, names)}"] = None
            continue
        if problem["type"] == "missing":
            told[f"{where} is missing"] = None
            continue
        message = _PREFIX.sub("", problem["msg"])
        found = "" if where == "it" else f"{where} = {problem['input']!r}: "
        told[f"{line}{found}{message[:1].lower()}{message[1:]}"] = None
    return "; ".join(told)


def line_of(text: str, key: str) -> str:
    """Find where a key is set.

    Parameters
    ----------
    text : str
        Text of the file.
    key : str
        Name of the key, or of a table.

    Returns
    -------
    str
        ``line N: `` of the first place; empty where there is none.
    """
    for number, line in enumerate(text.splitlines(), start=1):
        name = re.escape(key)
        if re.match(rf"\s*([\"']?{name}[\"']?\s*[=.]|\[+\s*{name}\s*\])", line):
            return f"line {number}: "
    return ""
