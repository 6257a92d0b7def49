"""OBJ and OFF: line-oriented text, read here so that errors can name the line."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from fabfold.errors import ModelError
from fabfold.solid.paint import colours_of_corners
from fabfold.solid.polygon import triangulate_polygons
from fabfold.solid.raw import RawMesh, encoding_of, head_of, is_text, no_faces, what_is_it

__all__ = ["read_obj", "read_off"]

_AGAIN = "export the model again"
#: Colour of a face whose material is not known.
_PLAIN = (255, 255, 255)


def read_obj(path: Path) -> RawMesh:
    """Read the vertices and faces of a Wavefront OBJ file; normals and UVs are skipped.

    Colours are read where every vertex line has them, ``v x y z red green blue`` from 0 to 1, or
    from the materials' ``Kd`` where their file stands beside it.

    Parameters
    ----------
    path : Path
        A file that is not empty.

    Returns
    -------
    RawMesh
        Polygons are cut into triangles; the vertices are those of the file.

    Raises
    ------
    ModelError
        With the line number, where a line cannot be used; or if there are no faces.
    """
    _refuse_binary(path, "an OBJ")
    vertices: list[tuple[float, ...]] = []
    painted: list[tuple[float, ...]] = []
    polygons: list[list[int]] = []
    libraries: list[str] = []
    used: list[str] = []
    material = ""
    for number, line in _logical_lines(path):
        words = line.split()
        if words[0] == "mtllib":
            libraries.append(line.split(None, 1)[1] if len(words) > 1 else "")
        elif words[0] == "usemtl":
            material = line.split(None, 1)[1] if len(words) > 1 else ""
        elif words[0] == "v":
            vertices.append(_numbers(path, number, words[1:4]))
            if len(words) == 7:
                painted.append(_numbers(path, number, words[4:7]))
        elif words[0] == "f":
            corners = [word.split("/")[0] for word in words[1:]]
            indices = [_obj_index(path, number, corner, len(vertices)) for corner in corners]
            if len(indices) < 3:
                raise ModelError(
                    f"{path.name}, line {number}: a face needs at least 3 corners, this one has "
                    f"{len(indices)}; {_AGAIN}"
                )
            polygons.append(indices)
            used.append(material)
    if not vertices:
        raise ModelError(f"{path.name} has no vertices: it is not an OBJ model; {_AGAIN}")
    if not polygons:
        raise no_faces(path.name, f" ({len(vertices)} points or lines only)")
    # An OBJ face may name a vertex that follows it, so positive indices are checked at the end.
    _check_range(path, polygons, len(vertices))
    corners_of = np.array(vertices, dtype=np.float64)
    faces = triangulate_polygons(corners_of, polygons)
    colours = None
    if len(painted) == len(vertices):
        shades = np.rint(255 * np.clip(np.array(painted), 0.0, 1.0)).astype(int)
        colours = colours_of_corners(faces, shades)
    elif any(used) and (known := _materials(path, libraries)):
        shades = np.array([known.get(name, _PLAIN) for name in used])
        each = [len(polygon) - 2 for polygon in polygons]
        colours = np.repeat(shades, each, axis=0).astype(np.uint8)
    return RawMesh(corners_of, faces, colours=colours)


def _materials(path: Path, libraries: Sequence[str]) -> dict[str, tuple[int, ...]]:
    """Colours by name, of the material files beside a model; a missing one is no loss."""
    known: dict[str, tuple[int, ...]] = {}
    for library in dict.fromkeys(libraries):
        # Only the name counts: nothing outside the model's own folder is opened.
        file = path.parent / library.replace("\\", "/").rpartition("/")[2]
        if not library or not file.is_file():
            continue
        name = ""
        for _, line in _logical_lines(file):
            words = line.split()
            if words[0] == "newmtl":
                name = line.split(None, 1)[1] if len(words) > 1 else ""
            elif words[0] == "Kd" and len(words) == 4:
                try:
                    kd = [float(word) for word in words[1:]]
                except ValueError:
                    continue
                # In this order "nan", which no comparison holds for, becomes 0.
                known[name] = tuple(round(255 * min(1.0, max(0.0, value))) for value in kd)
    return known


def _obj_index(path: Path, number: int, corner: str, known: int) -> int:
    try:
        index = int(corner)
    except ValueError:
        raise ModelError(
            f"{path.name}, line {number}: {corner[:20]!r} is not a vertex number; {_AGAIN}"
        ) from None
    if index == 0 or known + index < 0:
        raise ModelError(
            f"{path.name}, line {number}: there is no vertex {index} "
            f"({known} vertices so far); {_AGAIN}"
        )
    return index - 1 if index > 0 else known + index


def _check_range(path: Path, polygons: Sequence[Sequence[int]], count: int) -> None:
    if max(map(max, polygons)) < count:
        return
    faces = 0
    for number, line in _logical_lines(path):
        if line.split()[0] == "f":
            if max(polygons[faces]) >= count:
                raise ModelError(
                    f"{path.name}, line {number}: the face names vertex "
                    f"{max(polygons[faces]) + 1}, but the file has {count}; {_AGAIN}"
                )
            faces += 1


def read_off(path: Path) -> RawMesh:
    """Read an ASCII OFF file (also COFF, NOFF and so on: only the positions are used).

    Parameters
    ----------
    path : Path
        A file that is not empty.

    Returns
    -------
    RawMesh
        Polygons are cut into triangles; the vertices are those of the file.

    Raises
    ------
    ModelError
        With the line number, where a line cannot be used; if the file ends early; or if there
        are no faces.
    """
    _refuse_binary(path, "an OFF")
    lines = _logical_lines(path)
    number, line = next(lines, (1, ""))
    words = line.split()
    if not words or not words[0].upper().endswith("OFF"):
        raise ModelError(f"{path.name}, line {number}: an OFF file starts with OFF; {_AGAIN}")
    words = words[1:]
    if not words:
        number, line = next(lines, (number, ""))
        words = line.split()
    counts = [int(word) for word in words[:2] if word.isdecimal()]
    if len(counts) != 2:
        raise ModelError(
            f"{path.name}, line {number}: expected the numbers of vertices and faces; {_AGAIN}"
        )
    rest = list(lines)
    if len(rest) < sum(counts):
        raise ModelError(
            f"{path.name} ends early: its header says {counts[0]} vertices and {counts[1]} faces, "
            f"but only {len(rest)} lines follow; {_AGAIN}"
        )
    vertices = [_numbers(path, number, line.split()[:3]) for number, line in rest[: counts[0]]]
    polygons = [
        _off_face(path, number, line.split(), counts[0])
        for number, line in rest[counts[0] : sum(counts)]
    ]
    if not polygons:
        raise no_faces(path.name)
    corners_of = np.array(vertices, dtype=np.float64)
    return RawMesh(corners_of, triangulate_polygons(corners_of, polygons))


def _off_face(path: Path, number: int, words: list[str], count: int) -> list[int]:
    try:
        size = int(words[0])
        indices = [int(word) for word in words[1 : size + 1]]
    except ValueError:
        # More vertex lines than faces is the usual sign of a header that counts wrongly.
        raise ModelError(
            f"{path.name}, line {number}: {' '.join(words)[:40]!r} is not a face; the header's "
            f"counts are wrong or the file is damaged; {_AGAIN}"
        ) from None
    if size < 3 or len(indices) < size:
        raise ModelError(
            f"{path.name}, line {number}: a face needs at least 3 corners and as many numbers as "
            f"it says; {_AGAIN}"
        )
    if min(indices) < 0 or max(indices) >= count:
        raise ModelError(
            f"{path.name}, line {number}: the face names a vertex outside 0 to {count - 1}; "
            f"{_AGAIN}"
        )
    return indices


def _numbers(path: Path, number: int, words: list[str]) -> tuple[float, ...]:
    try:
        values = tuple(float(word) for word in words)
    except ValueError:
        values = ()
    if len(values) != 3:
        raise ModelError(
            f"{path.name}, line {number}: {' '.join(words)[:60]!r} are not three numbers "
            f"(a decimal point is wanted, not a comma); {_AGAIN}"
        )
    return values


def _logical_lines(path: Path) -> Iterator[tuple[int, str]]:
    """Lines with their numbers, without comments and blanks, joined where one ends in a stroke."""
    pending = ""
    with path.open(encoding=encoding_of(path), errors="replace") as stream:
        for number, line in enumerate(stream, start=1):
            text = (pending + line.split("#", 1)[0]).strip()
            pending = ""
            if text.endswith("\\"):
                pending = text[:-1] + " "
            elif text:
                yield number, text


def _refuse_binary(path: Path, kind: str) -> None:
    head = head_of(path)
    if encoding_of(path) == "utf-16":
        head = head.decode("utf-16", "replace").encode("utf-8")
    if not is_text(head):
        raise ModelError(
            f"{path.name} is not {kind} file but {what_is_it(head)}: {_AGAIN}, "
            "or give the file its right suffix"
        )
