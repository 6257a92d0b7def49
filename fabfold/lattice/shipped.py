"""Templates by name: boxes of any size, and the shapes that come with fabfold."""

from __future__ import annotations

import re
import tomllib
from functools import cache
from pathlib import Path

import numpy as np

from fabfold.errors import TemplateError
from fabfold.files import data_folder
from fabfold.lattice.template import MAX_CELLS, MAX_SIDE, Template
from fabfold.lattice.template_files import read_template

__all__ = ["describe", "load_template", "template_names"]

_BOX = re.compile(r"box-(\d+)x(\d+)x(\d+)")


def templates_folder() -> Path:
    """Folder that holds the template files.

    Returns
    -------
    Path
        In a checkout, or in an installed wheel.
    """
    return data_folder("templates")


def template_names() -> list[str]:
    """Names of the templates that come as files; boxes of any size need no file.

    Returns
    -------
    list of str
        Sorted.
    """
    return sorted(path.stem for path in templates_folder().glob("*.toml"))


def describe(name: str) -> str:
    """What a shipped template says of itself.

    Parameters
    ----------
    name : str
        One of :func:`template_names`.

    Returns
    -------
    str
        The description in its file; empty where it has none.
    """
    text = (templates_folder() / f"{name}.toml").read_text(encoding="utf-8")
    return str(tomllib.loads(text).get("description", ""))


def load_template(name: str) -> Template:
    """Template by name: ``box-AxBxC`` of any size, a shipped name, or a ``.toml`` file.

    The format of a file is described in :mod:`fabfold.lattice.template_files`. A mesh as the target
    is :func:`fabfold.voxels.mesh_template.template_of_solid`.

    Parameters
    ----------
    name : str
        Name, or path of a ``.toml`` file.

    Returns
    -------
    Template
        The same object for the same name; a file is read at every call.

    Raises
    ------
    TemplateError
        If there is no such template, or the file cannot be used.
    """
    if Path(name).suffix == ".toml":
        return _read(Path(name), name)
    return _shipped(name)


@cache
def _shipped(name: str) -> Template:
    box = _BOX.fullmatch(name)
    if box:
        size = [int(group) for group in box.groups()]
        if min(size) < 1 or max(size) > MAX_SIDE or int(np.prod(size)) > MAX_CELLS:
            raise TemplateError(
                f"template {name!r}: each side must be 1 to {MAX_SIDE} cells, the whole at most "
                f"{MAX_CELLS}"
            )
        return Template(name, np.argwhere(np.ones(size, dtype=bool)).astype(np.int32))
    return _read(templates_folder() / f"{name}.toml", name)


def _read(path: Path, name: str) -> Template:
    if not path.is_file():
        known = ", ".join(template_names()) or "none"
        raise TemplateError(
            f"no template {name!r}: use box-AxBxC (for example box-4x4x4), "
            f"the path of a .toml file or of a mesh, or one of: {known}"
        )
    return read_template(path)
