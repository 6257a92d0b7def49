"""STL, binary and ASCII, checked before it is believed.

A binary STL is told from an ASCII one by its size, never by the word "solid", and its triangle
count is compared with the size of the file before anything is allocated.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import ModelError
from fabfold.solid.raw import RawMesh, encoding_of, head_of, is_text, no_faces, what_is_it

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

#: Words that begin a statement.
_KEYWORDS = ("facet", "outer", "vertex", "endloop", "endfacet", "endsolid", "end", "solid")


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
        padded = spare > 0 and count > 0 and not is_text(head)
        if spare == 0 or (padded and not _more_follow(path, count)):
            return _read_binary(path, count, spare)
    text = head.decode(encoding_of(path), "replace").lstrip()
    if text[:5].lower() == "solid" and is_text(text.encode("utf-8")):
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
    return RawMesh(
        vertices,
        np.arange(3 * count).reshape(-1, 3),
        notes,
        float32=True,
        colours=_colours(head_of(path, 80), records["attribute"]),
    )


def _more_follow(path: Path, count: int) -> bool:
    """Whether what stands after the last triangle of the header's count is triangles too."""
    records = np.fromfile(path, dtype=_RECORD, count=count + 2, offset=_HEADER)
    own, more = records["corners"][:count], records["corners"][count:]
    if len(more) == 0 or not np.any(more):
        return False
    with np.errstate(all="ignore"):
        low, high = own.min(axis=(0, 1)), own.max(axis=(0, 1))
        room = 10.0 * float((high - low).max())
        near = (more >= low - room) & (more <= high + room)
    # Bytes of something else are nearly always far off as numbers, or none.
    tiny = (np.abs(more) < 1e-30) & (more != 0)
    return bool(near[0].all() and not tiny[0].any() and np.isfinite(records["normal"][count]).all())


def _colours(header: bytes, attributes: NDArray[np.uint16]) -> NDArray[np.uint8] | None:
    """Colours of the two conventions that use the two spare bytes of a triangle, 5 bits a channel.

    VisCAM and SolidView: the highest bit says that there is a colour, blue in the lowest bits.
    Materialise Magics: ``COLOR=`` and four bytes in the header for all; a highest bit of 0 says
    that the triangle has its own, red in the lowest bits.
    """
    at = header.find(b"COLOR=")
    magics = 0 <= at <= 70
    own = ((attributes >> 15) == 0) if magics else ((attributes >> 15) == 1)
    if not magics and not own.any():
        return None
    first, second, third = ((attributes >> shift) & 31 for shift in (0, 5, 10))
    channels = (first, second, third) if magics else (third, second, first)
    shades = np.rint(np.stack(channels, axis=1) * (255.0 / 31.0)).astype(np.uint8)
    whole = header[at + 6 : at + 9] if magics else b"\xff\xff\xff"
    shades[~own] = np.frombuffer(whole.ljust(3, b"\xff"), dtype=np.uint8)
    return shades


def _read_ascii(path: Path) -> RawMesh:
    corners: list[tuple[float, float, float]] = []
    state = 0
    number = 0
    with path.open(encoding=encoding_of(path), errors="replace") as stream:
        for number, words in _statements(stream):
            if state == 0 and words[0] in ("solid", "endsolid"):
                continue
            expected = _FACET[state]
            if tuple(words[: len(expected)]) != expected:
                raise ModelError(
                    f"{path.name}, line {number}: expected {' '.join(expected)!r}, found "
                    f"{' '.join(words)[:40]!r}; the file is damaged or cut off, export it again"
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


def _statements(lines: Iterable[str]) -> Iterator[tuple[int, list[str]]]:
    """Statements of an ASCII STL with the numbers of their lines.

    STL is a stream of words: a line may hold several statements. ``end solid`` is ``endsolid``.
    """
    for number, line in enumerate(lines, start=1):
        words = line.lower().split()
        while words:
            if words[0] == "end" and len(words) > 1:
                words[:2] = ["end" + words[1]]
            named = words[0] in ("solid", "endsolid")  # then any words may follow: a name
            begins = ("facet", "solid") if named else _KEYWORDS
            length = 1
            while length < len(words) and not (
                words[length] in begins and (not named or _begins(words, length))
            ):
                length += 1
            yield number, words[:length]
            words = words[length:]


def _begins(words: list[str], at: int) -> bool:
    """Whether a statement begins here, and not a word of a name."""
    return words[at : at + 2] == ["facet", "normal"] or words[at - 1 : at + 1] == ["end", "solid"]


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
