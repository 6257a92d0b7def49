"""PLY files whose faces are polygons of any number of corners, or strips of triangles.

The library that reads PLY for us takes triangles and quads; polygons of mixed lengths have no fixed
width in a binary file and have to be walked through.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from fabfold.errors import ModelError
from fabfold.solid.polygon import triangulate_polygons
from fabfold.solid.raw import RawMesh, no_faces

__all__ = ["read_ply_polygons", "triangles_only"]

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1",
    "short": "i2", "int16": "i2", "ushort": "u2", "uint16": "u2",
    "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
    "int64": "i8", "uint64": "u8",
}  # fmt: skip
#: Names of the list of a face's corners.
_CORNERS = ("vertex_indices", "vertex_index")
_COLOURS = ("red", "green", "blue")

#: A property: its name, the type of its count (empty where it is no list), its type.
_Property = tuple[str, str, str]


def _header(path: Path) -> tuple[str, list[tuple[str, int, list[_Property]]], bytes]:
    """Format, elements in order, and the bytes after the header."""
    data = path.read_bytes()
    end = data.index(b"end_header")
    body = data[data.index(b"\n", end) + 1 :]
    form = "ascii"
    elements: list[tuple[str, int, list[_Property]]] = []
    for number, line in enumerate(data[:end].decode("ascii", "replace").splitlines(), start=1):
        match line.split():
            case ["format", kind, *_]:
                form = kind
            case ["element", name, count, *_] if count.isdecimal():
                elements.append((name, int(count), []))
            case ["property", "list", counted, kind, name, *_] if elements:
                elements[-1][2].append((name, _type(path, counted), _type(path, kind)))
            case ["property", kind, name, *_] if elements and kind != "list":
                elements[-1][2].append((name, "", _type(path, kind)))
            case ["format" | "element" | "property", *_]:
                raise ModelError(
                    f"{path.name}: line {number} of its header is damaged ({line.strip()[:60]!r}); "
                    "export it again"
                )
    _check_properties(path, elements)
    return form, elements, body


def _type(path: Path, name: str) -> str:
    if name not in _TYPES:
        raise ModelError(f"{path.name}: {name!r} is no type of a PLY property; export it again")
    return _TYPES[name]


def triangles_only(path: Path) -> bool:
    """Whether the size of a binary file allows triangles only, or the file is ASCII.

    Parameters
    ----------
    path : Path
        A PLY file whose header was checked.

    Returns
    -------
    bool
        False where some face has another number of corners.
    """
    form, elements, body = _header(path)
    if any(counted for name, _, listed in elements if name != "face" for _, counted, _ in listed):
        return False
    if form == "ascii":
        return not any(
            len(line.split(None, 1)) == 2 and line.split(None, 1)[0] not in (b"3", b"4")
            for line in _face_lines(elements, body)
        )
    size = 0
    for _, count, properties in elements:
        for _, counted, kind in properties:
            width = np.dtype(kind).itemsize
            size += count * (np.dtype(counted).itemsize + 3 * width if counted else width)
    return len(body) == size


def _face_lines(elements: list[tuple[str, int, list[_Property]]], body: bytes) -> list[bytes]:
    lines = body.splitlines()
    start = 0
    for name, count, properties in elements:
        if name == "face" and properties and properties[0][1]:
            return lines[start : start + count]
        start += count
    return []


def read_ply_polygons(path: Path, single: bool) -> RawMesh:
    """Read a PLY file whose faces are polygons or strips, with the colours of faces or vertices.

    Parameters
    ----------
    path : Path
        A PLY file whose header was checked.
    single : bool
        Whether it stores coordinates in 32 bits.

    Returns
    -------
    RawMesh
        Polygons are cut into triangles.

    Raises
    ------
    ModelError
        If the file ends early, or a face names a vertex that is not there.
    """
    form, elements, body = _header(path)
    try:
        walk = _ascii_rows(elements, body) if form == "ascii" else _rows(form, elements, body)
        read = dict(walk)
    except (ValueError, IndexError, OverflowError):
        raise ModelError(
            f"{path.name} ends early or is damaged: a face cannot be read; export it again"
        ) from None
    points = read.get("vertex", {})
    if not all(axis in points for axis in "xyz"):
        raise ModelError(f"{path.name}: its vertices have no x, y and z; export it again")
    vertices = np.stack([np.asarray(points[axis], dtype=np.float64) for axis in "xyz"], axis=1)
    faces = read.get("face", {})
    listed: Any = next((faces[name] for name in _CORNERS if name in faces), [])
    strips = read.get("tristrips", {})
    listed_strips: Any = next((strips[name] for name in _CORNERS if name in strips), [])
    polygons = [_whole(path, polygon) for polygon in listed]
    listed_strips = [_whole(path, strip) for strip in listed_strips]
    for number, polygon in enumerate(polygons):
        if len(polygon) < 3:
            raise ModelError(
                f"{path.name}: face {number} (counted from 0) has {len(polygon)} corners; "
                "export it again"
            )
        if min(polygon) < 0 or max(polygon) >= len(vertices):
            raise ModelError(
                f"{path.name}: face {number} (counted from 0) names a vertex that is not there, "
                f"the file has {len(vertices)}; export it again"
            )
    shades = _shades(faces, len(polygons))
    owners = np.repeat(np.arange(len(polygons)), [len(polygon) - 2 for polygon in polygons])
    triangles = triangulate_polygons(vertices, polygons)
    from_strips = list(_strip_triangles(listed_strips))
    if from_strips and max(map(max, from_strips)) >= len(vertices):
        raise ModelError(f"{path.name}: a strip names a vertex that is not there; export it again")
    strip_triangles = np.array(from_strips, dtype=np.int64).reshape(-1, 3)
    triangles = np.concatenate([triangles, strip_triangles])
    if len(triangles) == 0:
        raise no_faces(path.name)
    colours = None
    corner_shades = _shades(points, len(vertices))
    if shades is not None and len(strip_triangles) == 0:
        colours = shades[owners]
    elif corner_shades is not None:
        from fabfold.solid.paint import colours_of_corners

        colours = colours_of_corners(triangles, corner_shades)
    return RawMesh(vertices, triangles, float32=single, colours=colours)


def _check_properties(path: Path, elements: list[tuple[str, int, list[_Property]]]) -> None:
    """Refuse what has another shape than its name: a number for a list, a list for a number."""
    for element, _, properties in elements:
        names = [name for name, _, _ in properties]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise ModelError(f"{path.name}: {element} has {twice!r} twice; export it again")
        lists = {"face": _CORNERS, "tristrips": _CORNERS}.get(element, ())
        for name, counted, _ in properties:
            if name in lists and not counted:
                raise ModelError(
                    f"{path.name}: {name!r} of a {element} is a number, not a list of corners; "
                    "export it again"
                )
            if counted and name in (*"xyz", *_COLOURS):
                raise ModelError(
                    f"{path.name}: {name!r} of a {element} is a list, not a number; export it again"
                )


def _whole(path: Path, corners: Any) -> list[int]:
    """Corners as whole numbers; a text file may hold any number there."""
    try:
        return [int(corner) for corner in corners]
    except (ValueError, OverflowError):
        raise ModelError(
            f"{path.name}: a face has a corner that is no number of a vertex; export it again"
        ) from None


def _shades(columns: dict[str, Any], count: int) -> Any:
    if not all(name in columns for name in _COLOURS) or count == 0:
        return None
    table = np.stack([np.asarray(columns[name], dtype=np.float64) for name in _COLOURS], axis=1)
    return np.clip(np.rint(np.nan_to_num(table)), 0, 255).astype(np.uint8)


def _strip_triangles(strips: Any) -> Iterator[tuple[int, int, int]]:
    """Triangles of strips; -1 begins a new one, every second triangle is turned over."""
    for strip in strips:
        run: list[int] = []
        for corner in [*strip, -1]:
            if corner >= 0:
                run.append(corner)
                continue
            for index in range(len(run) - 2):
                a, b, c = run[index : index + 3]
                if len({a, b, c}) == 3:
                    yield (a, b, c) if index % 2 == 0 else (b, a, c)
            run = []


def _rows(
    form: str, elements: list[tuple[str, int, list[_Property]]], body: bytes
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Columns of each element of a binary file."""
    order = ">" if form == "binary_big_endian" else "<"
    at = 0
    for name, count, properties in elements:
        if not any(counted for _, counted, _ in properties):
            row = np.dtype([(str(i), order + kind) for i, (_, _, kind) in enumerate(properties)])
            table = np.frombuffer(body, dtype=row, count=count, offset=at)
            at += row.itemsize * count
            yield name, {key: table[str(i)] for i, (key, _, _) in enumerate(properties)}
            continue
        columns: dict[str, Any] = {key: [] for key, _, _ in properties}
        for _ in range(count):
            for key, counted, kind in properties:
                length = 1
                if counted:
                    width = np.dtype(counted)
                    length = int(np.frombuffer(body, np.dtype(order + counted), 1, at)[0])
                    at += width.itemsize
                    if length < 0:
                        raise ValueError("a list of fewer than no entries")
                values: Any = (
                    np.frombuffer(body, np.dtype(order + kind), length, at) if length else ()
                )
                at += np.dtype(kind).itemsize * length
                columns[key].append(values if counted else values[0])
        yield name, columns


def _ascii_rows(
    elements: list[tuple[str, int, list[_Property]]], body: bytes
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Columns of each element of an ASCII file."""
    words = body.split()
    words.reverse()  # taken from the end, where an empty list raises IndexError
    for name, count, properties in elements:
        columns: dict[str, Any] = {key: [] for key, _, _ in properties}
        for _ in range(count if properties else 0):
            for key, counted, _ in properties:
                if counted:
                    columns[key].append([float(words.pop()) for _ in range(int(words.pop()))])
                else:
                    columns[key].append(float(words.pop()))
        yield name, columns
