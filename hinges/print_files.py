"""Files for printers and for other CAD programs: one object of named, coloured parts.

No one arrangement is read as *one object of named parts* by every slicer, so :func:`write_3mf`
writes one of two layouts of :mod:`hinges.package`: ``slicer="prusa"`` one mesh that holds all
parts, ``slicer="bambu"`` a mesh a part and one object that holds them. Both carry the colours as
the 3MF materials extension has them.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from .exceptions import HingeError
from .package import PackagePart, package_3mf
from .slicer_parts import BAMBU, PRUSA

if TYPE_CHECKING:
    from build123d import Shape

__all__ = ["write_3mf", "write_step"]

#: Colours of parts that have none, by turns.
_COLOURS = ("#4E8FD6", "#F2A23A", "#5BB574", "#E05A5A", "#9A78D0", "#2FB5B8")
#: Corners nearer than this are one, mm.
_WELD_MM = 1e-5


def write_3mf(
    parts: Sequence[Shape],
    path: str | os.PathLike[str],
    *,
    names: Sequence[str] | None = None,
    colours: Sequence[str] | None = None,
    slicer: Literal["prusa", "bambu"] = "prusa",
    title: str = "",
    tolerance: float = 0.02,
) -> Path:
    """Write parts as one object, such as a box and its lid with the hinge between them.

    Parameters
    ----------
    parts : sequence of build123d shapes
        Each with one solid at least, where they are to be printed.
    path : path
        Ends in ``.3mf``. It is written whole or not at all.
    names : sequence of str, optional
        One a part; a part's ``label`` by default, or ``part 1`` and so on.
    colours : sequence of str, optional
        One a part, such as ``"#4E8FD6"``; a part's ``color`` by default, or different ones.
    slicer : "prusa" or "bambu"
        For which family of slicers the parts are grouped.
    title : str
        Name of the object; the file's name by default.
    tolerance : float
        How far triangles may be from curved faces, mm.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    HingeError
        If there is no part, one has no solid, or a name or colour makes no sense.
    """
    file = _checked(path, ".3mf")
    if slicer not in ("prusa", "bambu"):
        raise HingeError(f'slicer={slicer!r}: choose "prusa" or "bambu"')
    if not 0.0 < tolerance <= 10.0:
        raise HingeError(f"tolerance={tolerance!r}: a length in mm above 0 is needed")
    called = _names(parts, names)
    painted = _painted(parts, colours)
    pieces = []
    for part, name, colour in zip(parts, called, painted, strict=True):
        pieces.append(PackagePart(name, *_mesh(part, name, tolerance), _rgb(colour)))
    whole = title or file.stem
    application = PRUSA if slicer == "prusa" else BAMBU
    package = package_3mf(
        pieces,
        title=whole,
        facts={"Title": whole, "Application": application},
        layout="whole" if slicer == "prusa" else "assembly",
    )
    with tempfile.TemporaryDirectory(dir=file.parent) as work:
        made = Path(work) / file.name
        made.write_bytes(package)
        made.replace(file)
    return file


def write_step(
    parts: Sequence[Shape],
    path: str | os.PathLike[str],
    *,
    names: Sequence[str] | None = None,
    colours: Sequence[str] | None = None,
    title: str = "",
) -> Path:
    """Write parts as an assembly of products of their own, named and coloured.

    Parameters
    ----------
    parts, names, colours, title
        As of :func:`write_3mf`.
    path : path
        Ends in ``.step`` or ``.stp``.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    HingeError
        As of :func:`write_3mf`; and if the CAD kernel cannot write the file.
    """
    from build123d import Color, Compound, export_step

    file = _checked(path, ".step", ".stp")
    called, painted = _names(parts, names), _painted(parts, colours)
    children = []
    for part, name, colour in zip(parts, called, painted, strict=True):
        solids = _solids(part, name)
        child: Any = solids[0] if len(solids) == 1 else Compound(solids)
        child.label = name
        child.color = Color(*(value / 255 for value in _rgb(colour)))
        children.append(child)
    whole = Compound(label=title or file.stem, children=children)
    with tempfile.TemporaryDirectory(dir=file.parent) as work:
        made = Path(work) / f"whole{file.suffix}"
        if not export_step(whole, str(made)):
            raise HingeError(f"{file}: the CAD kernel could not write it")
        made.replace(file)
    return file


def _checked(path: str | os.PathLike[str], *endings: str) -> Path:
    file = Path(path)
    if file.suffix.lower() not in endings:
        raise HingeError(f"{file}: its name must end in {' or '.join(endings)}")
    if not file.parent.is_dir():
        raise HingeError(f"{file}: there is no folder {file.parent}")
    return file


def _names(parts: Sequence[Shape], names: Sequence[str] | None) -> list[str]:
    """Name of every part; refuses numbers of parts and names that do not agree."""
    if not len(parts):
        raise HingeError("there is no part to write")
    if names is None:
        labels = [str(getattr(part, "label", "") or "") for part in parts]
        return [label or f"part {number + 1}" for number, label in enumerate(labels)]
    if len(names) != len(parts):
        raise HingeError(f"{len(parts)} parts, but {len(names)} names")
    for name in names:
        if not isinstance(name, str) or not name or not name.isprintable():
            raise HingeError(f"name {name!r}: give a text of letters that can be read")
    return list(names)


def _painted(parts: Sequence[Shape], colours: Sequence[str] | None) -> list[str]:
    """Colour of every part as ``#RRGGBB``."""
    if colours is not None and len(colours) != len(parts):
        raise HingeError(f"{len(parts)} parts, but {len(colours)} colours")
    found = []
    for number, part in enumerate(parts):
        given = colours[number] if colours is not None else getattr(part, "color", None)
        if given is None:
            found.append(_COLOURS[number % len(_COLOURS)])
        elif isinstance(given, str):
            _rgb(given)
            found.append(given.upper())
        else:
            red, green, blue = (round(255 * value) for value in tuple(given)[:3])
            found.append(f"#{red:02X}{green:02X}{blue:02X}")
    return found


def _rgb(colour: str) -> tuple[int, int, int]:
    """The three bytes of a colour ``#RRGGBB``."""
    try:
        if len(colour) != 7 or colour[0] != "#":
            raise ValueError
        return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)
    except ValueError:
        raise HingeError(f"colour {colour!r}: write it as #RRGGBB, such as #4E8FD6") from None


def _solids(part: Any, name: str) -> list[Any]:
    """Solids of a part; refuses what has none."""
    solids = list(part.solids()) if hasattr(part, "solids") else []
    if not solids:
        raise HingeError(f"{name}: it has no solid; give a build123d part, such as builder.part")
    return solids


def _mesh(part: Any, name: str, tolerance: float) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Triangles of all solids of a part, corners in one place being one."""
    corners: list[NDArray[np.float64]] = []
    triangles: list[NDArray[np.int64]] = []
    count = 0
    for solid in _solids(part, name):
        points, faces = solid.tessellate(tolerance, 0.2)
        vertices = np.array([tuple(point) for point in points], dtype=float)
        _, first, which = np.unique(
            np.rint(vertices / _WELD_MM), axis=0, return_index=True, return_inverse=True
        )
        welded = which.reshape(-1)[np.array(faces, dtype=np.int64)]
        flat = (welded == np.roll(welded, 1, axis=1)).any(axis=1)
        corners.append(vertices[first])
        triangles.append(welded[~flat] + count)
        count += len(first)
    return np.concatenate(corners), np.concatenate(triangles)
