"""What all readers share: the triangles that they hand on, and looks at the first bytes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import ModelError

__all__ = ["RawMesh", "encoding_of", "head_of", "is_text", "no_faces", "what_is_it"]

#: How the bytes of files begin that people rename by mistake.
_SIGNATURES: tuple[tuple[bytes, str], ...] = (
    (b"\x89PNG", "a PNG picture"),
    (b"\xff\xd8\xff", "a JPEG picture"),
    (b"GIF8", "a GIF picture"),
    (b"%PDF", "a PDF document"),
    (b"PK\x03\x04", "a ZIP archive (3MF files are such archives)"),
    (b"glTF", "a GLB model"),
    (b"ply", "a PLY model"),
    (b"OFF", "an OFF model"),
    (b"ISO-10303-21", "a STEP file"),
    (b"Kaydara FBX", "an FBX model"),
    (b"BLENDER", "a Blender file"),
    (b"\x1f\x8b", "a gzip archive"),
    (b"<", "an XML or HTML text"),
)


@dataclass(frozen=True)
class RawMesh:
    """Triangles as a reader gives them, nothing repaired yet.

    Attributes
    ----------
    vertices : (v, 3) float64 array
        Corner coordinates in the file's unit; corners may be repeated.
    faces : (f, 3) int64 array
        Corner indices, each within ``range(v)``.
    notes : tuple of str
        What the reader had to assume.
    float32 : bool
        Whether the file stores coordinates in 32 bits.
    colours : (f, 3) uint8 array or None
        sRGB of each triangle, where the file has colours.
    negative : ((v, 3) float64 array, (f, 3) int64 array) or None
        Vertices and faces of what is taken away from the solid.
    objects : tuple of str
        Names of the objects that the file has, where it can have several.
    unit : str
        Unit of length that the file names; empty where it names none.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    notes: tuple[str, ...] = ()
    float32: bool = False
    colours: NDArray[np.uint8] | None = None
    negative: tuple[NDArray[np.float64], NDArray[np.int64]] | None = None
    objects: tuple[str, ...] = ()
    unit: str = ""


def no_faces(name: str, found: str = "") -> ModelError:
    """The error for a readable file that holds no triangle.

    Parameters
    ----------
    name : str
        Name of the file.
    found : str
        What the file has instead, in brackets after a blank.

    Returns
    -------
    ModelError
        To be raised by the reader.
    """
    return ModelError(
        f"{name} has no triangles{found}: there is no surface to fold; "
        "export the model as a closed mesh"
    )


def what_is_it(head: bytes) -> str:
    """Name the content of a file by its first bytes, for messages about renamed files.

    Parameters
    ----------
    head : bytes
        The first bytes of the file, see :func:`head_of`.

    Returns
    -------
    str
        With its article, such as ``"a PNG picture"``.
    """
    for signature, meaning in _SIGNATURES:
        if head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(signature):
            return meaning
    return "plain text" if is_text(head) else "binary data"


def is_text(head: bytes) -> bool:
    """Whether the first bytes of a file look like text.

    Parameters
    ----------
    head : bytes
        The first bytes of the file, see :func:`head_of`.

    Returns
    -------
    bool
        True where there are no control characters other than white space.
    """
    allowed = {9, 10, 11, 12, 13}
    return all(byte >= 32 or byte in allowed for byte in head)


def encoding_of(path: Path) -> str:
    """The encoding of a text file by its byte-order mark; UTF-8 where it has none.

    Parameters
    ----------
    path : Path
        Any file.

    Returns
    -------
    str
        Name of a codec, which skips the mark.
    """
    head = head_of(path, 3)
    return "utf-16" if head[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"


def head_of(path: Path, size: int = 1024) -> bytes:
    """The first bytes of a file.

    Parameters
    ----------
    path : Path
        Any file.
    size : int
        How many bytes; a shorter file gives fewer.

    Returns
    -------
    bytes
        From the beginning of the file.
    """
    with path.open("rb") as stream:
        return stream.read(size)
