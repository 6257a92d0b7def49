"""Files for printers and for other CAD programs: one object of named, coloured parts.

No one arrangement is read as *one object of named parts* by every slicer, so :func:`write_3mf`
writes one of two. ``slicer="prusa"``: one mesh that holds all parts, whose triangle ranges, names
and filaments stand in ``Metadata/Slic3r_PE_model.config``; PrusaSlicer and SuperSlicer open it as
one object of named parts. ``slicer="bambu"``: a mesh a part and one object that holds them as
components, named in ``Metadata/model_settings.config``; Bambu Studio and OrcaSlicer open it so.
Both carry the colours as the 3MF materials extension has them.

References
----------
3MF Core Specification 1.3, sections 4 and 5; 3MF Materials and Properties Extension 1.2.
"""

from __future__ import annotations

import json
import os
import tempfile
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal
from xml.sax.saxutils import escape, quoteattr

import numpy as np
from numpy.typing import NDArray

from .exceptions import HingeError

if TYPE_CHECKING:
    from build123d import Shape

__all__ = ["write_3mf", "write_step"]

#: Colours of parts that have none, by turns.
_COLOURS = ("#4E8FD6", "#F2A23A", "#5BB574", "#E05A5A", "#9A78D0", "#2FB5B8")
#: Corners nearer than this are one, mm.
_WELD_MM = 1e-5
_CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
_MATERIAL = "http://schemas.microsoft.com/3dmanufacturing/material/2015/02"
_TYPES = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" '
    'ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" '
    'ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>'
    '<Default Extension="config" ContentType="application/octet-stream"/></Types>\n'
)
_RELATIONS = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Target="/3D/3dmodel.model" Id="rel0" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>\n'
)


@dataclass(frozen=True)
class _Piece:
    """A part, ready to be written."""

    name: str
    colour: str
    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]


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
    pieces = [
        _Piece(name, colour, *_mesh(part, name, tolerance))
        for part, name, colour in zip(parts, called, painted, strict=True)
    ]
    whole = title or file.stem
    entries = {"[Content_Types].xml": _TYPES, "_rels/.rels": _RELATIONS}
    if slicer == "prusa":
        entries["3D/3dmodel.model"] = _one_mesh(pieces, whole)
        entries["Metadata/Slic3r_PE_model.config"] = _prusa_config(pieces, whole)
    else:
        entries["3D/3dmodel.model"] = _components(pieces, whole)
        entries["Metadata/model_settings.config"] = _bambu_config(pieces, whole)
        entries["Metadata/project_settings.config"] = _bambu_project(pieces)
    _write_whole(file, entries)
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


def _mesh_xml(vertices: NDArray[np.float64], faces: NDArray[np.int64], paint: list[str]) -> str:
    """The ``mesh`` element; `paint` holds attributes of each triangle."""
    points = "".join(
        f'<vertex x="{x:.6g}" y="{y:.6g}" z="{z:.6g}"/>\n' for x, y, z in vertices.tolist()
    )
    triangles = "".join(
        f'<triangle v1="{a}" v2="{b}" v3="{c}"{more}/>\n'
        for (a, b, c), more in zip(faces.tolist(), paint, strict=True)
    )
    return (
        f"<mesh>\n<vertices>\n{points}</vertices>\n<triangles>\n{triangles}</triangles>\n</mesh>\n"
    )


def _model(resources: str, item: int, title: str, application: str) -> str:
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<model unit="millimeter" xml:lang="en-US" xmlns="{_CORE}" xmlns:m="{_MATERIAL}">\n'
        f'<metadata name="Title">{escape(title)}</metadata>\n'
        f'<metadata name="Application">{application}</metadata>\n'
        f"<resources>\n{resources}</resources>\n"
        f'<build>\n<item objectid="{item}"/>\n</build>\n</model>\n'
    )


def _palette(pieces: Sequence[_Piece], number: int) -> str:
    colours = "".join(f'<m:color color="{piece.colour}FF"/>\n' for piece in pieces)
    return f'<m:colorgroup id="{number}">\n{colours}</m:colorgroup>\n'


def _one_mesh(pieces: Sequence[_Piece], title: str) -> str:
    """The model of one mesh that holds all parts."""
    starts = np.cumsum([0, *(len(piece.vertices) for piece in pieces)])
    vertices = np.concatenate([piece.vertices for piece in pieces])
    faces = np.concatenate([p.faces + s for p, s in zip(pieces, starts, strict=False)])
    paint = [
        f' pid="2" p1="{number}" p2="{number}" p3="{number}"'
        for number, piece in enumerate(pieces)
        for _ in range(len(piece.faces))
    ]
    mesh = _mesh_xml(vertices, faces, paint)
    head = f'<object id="1" type="model" name={quoteattr(title)} pid="2" pindex="0">'
    whole = head + "\n" + mesh + "</object>\n"
    return _model(_palette(pieces, 2) + whole, 1, title, "PrusaSlicer-2.9.0")


def _prusa_config(pieces: Sequence[_Piece], title: str) -> str:
    """Which triangles are which part, and in which filament."""
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', "<config>"]
    lines.append(' <object id="1" instances_count="1">')
    lines.append(f'  <metadata type="object" key="name" value={quoteattr(title)}/>')
    at = 0
    for number, piece in enumerate(pieces):
        lines.append(f'  <volume firstid="{at}" lastid="{at + len(piece.faces) - 1}">')
        for key, value in (
            ("name", piece.name),
            ("volume_type", "ModelPart"),
            ("extruder", str(number + 1)),
        ):
            lines.append(f'   <metadata type="volume" key="{key}" value={quoteattr(value)}/>')
        lines.append("  </volume>")
        at += len(piece.faces)
    return "\n".join([*lines, " </object>", "</config>", ""])


def _components(pieces: Sequence[_Piece], title: str) -> str:
    """The model of one object whose components are the parts."""
    palette, whole = len(pieces) + 1, len(pieces) + 2
    resources = _palette(pieces, palette)
    for number, piece in enumerate(pieces):
        mesh = _mesh_xml(piece.vertices, piece.faces, [""] * len(piece.faces))
        resources += (
            f'<object id="{number + 1}" type="model" name={quoteattr(piece.name)} '
            f'pid="{palette}" pindex="{number}">\n{mesh}</object>\n'
        )
    inside = "".join(f'<component objectid="{n + 1}"/>\n' for n in range(len(pieces)))
    resources += (
        f'<object id="{whole}" type="model" name={quoteattr(title)}>\n'
        f"<components>\n{inside}</components>\n</object>\n"
    )
    return _model(resources, whole, title, "BambuStudio-01.09.00.00")


def _bambu_config(pieces: Sequence[_Piece], title: str) -> str:
    """Names of the parts, and their filaments."""
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        "<config>",
        f'  <object id="{len(pieces) + 2}">',
        f'    <metadata key="name" value={quoteattr(title)}/>',
        '    <metadata key="extruder" value="1"/>',
    ]
    for number, piece in enumerate(pieces):
        lines += [
            f'    <part id="{number + 1}" subtype="normal_part">',
            f'      <metadata key="name" value={quoteattr(piece.name)}/>',
            '      <metadata key="matrix" value="1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"/>',
            f'      <metadata key="extruder" value="{number + 1}"/>',
            "    </part>",
        ]
    return "\n".join([*lines, "  </object>", "</config>", ""])


def _bambu_project(pieces: Sequence[_Piece]) -> str:
    settings = {
        "filament_colour": [piece.colour for piece in pieces],
        "printable_area": ["0x0", "256x0", "256x256", "0x256"],
        "printable_height": "256",
    }
    return json.dumps(settings, indent=1) + "\n"


def _write_whole(file: Path, entries: dict[str, str]) -> None:
    """Write a package under a temporary name, and give it its own; the same bytes each time."""
    handle, name = tempfile.mkstemp(prefix=".part-", suffix=file.suffix, dir=file.parent)
    try:
        with os.fdopen(handle, "wb") as stream, zipfile.ZipFile(stream, "w") as package:
            for entry, text in entries.items():
                info = zipfile.ZipInfo(entry, (1980, 1, 1, 0, 0, 0))
                info.compress_type = zipfile.ZIP_DEFLATED
                package.writestr(info, text.encode())
        Path(name).replace(file)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
