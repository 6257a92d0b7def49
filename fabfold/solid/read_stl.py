"""STL, binary and ASCII, checked before it is believed.

A binary STL is told from an ASCII one by its size, never by the word "solid", and its triangle
count is compared with the size of the file before anything is allocated.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fabfold.errors import ModelError
from fabfold.solid.raw import RawMesh, head_of, is_text, no_faces, what_is_it

__all__ = ["read_stl"]

_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_HEADER = 84
#: What a facet of an ASCII file is made of, in order.
_FACET = (
    ("facet",),
    ("outer", "loop"),
    ("vertex",),
    ("vertex",),
    ("vertex",),
    ("endloop",),
    ("endfacet",),
)


def read_stl(path: Path) -> RawMesh:
    """Read an STL file.

    Parameters
    ----------
    path : Path
        A file that is not empty.

    Returns
    -------
    RawMesh
        Three corners of its own for every triangle.

    Raises
    ------
    ModelError
        If the file is no STL, is cut off, or holds no triangle.
    """
    size = path.stat().st_size
    head = head_of(path)
    if size >= _HEADER:
        count = int.from_bytes(head[80:84], "little")
        spare = size - _HEADER - _RECORD.itemsize * count
        if spare == 0 or (0 < spare < _RECORD.itemsize and not is_text(head)):
            return _read_binary(path, count, spare)
    if head.lstrip(b"\xef\xbb\xbf \t\r\n")[:5].lower() == b"solid" and is_text(head):
        return _read_ascii(path)
    known = what_is_it(head)
    if known != "binary data":
        raise ModelError(
            f"{path.name} is not an STL file but {known}: export the model as STL, "
            "or give the file its right suffix"
        )
    if size < _HEADER:
        raise ModelError(
            f"{path.name} is not an STL file: it has {size} bytes, and a binary STL starts "
            f"with {_HEADER}; export the model again"
        )
    raise ModelError(
        f"{path.name} is damaged: its header says {count:,} triangles, but the file has room for "
        f"{(size - _HEADER) / _RECORD.itemsize:,.1f}; export or download it again"
    )


def _read_binary(path: Path, count: int, spare: int) -> RawMesh:
    if count == 0:
        raise no_faces(path.name)
    records = np.fromfile(path, dtype=_RECORD, count=count, offset=_HEADER)
    vertices = records["corners"].reshape(-1, 3).astype(np.float64)
    notes = (f"{spare} bytes after the last triangle were ignored",) if spare else ()
    return RawMesh(vertices, np.arange(3 * count).reshape(-1, 3), notes, float32=True)


def _read_ascii(path: Path) -> RawMesh:
    corners: list[tuple[float, float, float]] = []
    state = 0
    number = 0
    with path.open(encoding="utf-8", errors="replace") as stream:
        for number, line in enumerate(stream, start=1):
            words = line.lower().split()
            if not words or (state == 0 and words[0] in ("solid", "endsolid")):
                continue
            expected = _FACET[state]
            if tuple(words[: len(expected)]) != expected:
                raise ModelError(
                    f"{path.name}, line {number}: expected {' '.join(expected)!r}, found "
                    f"{line.strip()[:40]!r}; the file is damaged or cut off, export it again"
                )
            if expected == ("vertex",):
                corners.append(_corner(path, number, words))
            state = (state + 1) % len(_FACET)
    if state:
        raise ModelError(
            f"{path.name}, line {number}: the file ends inside a triangle; "
            "it was cut off, export or download it again"
        )
    if not corners:
        raise no_faces(path.name)
    return RawMesh(np.array(corners, dtype=np.float64), np.arange(len(corners)).reshape(-1, 3))


def _corner(path: Path, number: int, words: list[str]) -> tuple[float, float, float]:
    if len(words) != 4:
        raise ModelError(
            f"{path.name}, line {number}: a vertex needs 3 coordinates, found {len(words) - 1}; "
            "export the model again"
        )
    try:
        return (float(words[1]), float(words[2]), float(words[3]))
    except ValueError:
        raise ModelError(
            f"{path.name}, line {number}: {' '.join(words[1:])[:60]!r} are not three numbers "
            "(a decimal point is wanted, not a comma); export the model again"
        ) from None
