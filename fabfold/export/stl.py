"""Binary STL of every body, and of the whole kit in one file."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fabfold.export.weld import printable_mesh
from fabfold.files import write_bytes
from fabfold.joinery.bodies import Joinery
from fabfold.meshes import face_normals

__all__ = ["stl_bytes", "write_combined_stl", "write_stl"]

_TRIANGLE = np.dtype(
    [("normal", "<f4", (3,)), ("corners", "<f4", (3, 3)), ("attribute", "<u2")], align=False
)


def stl_bytes(meshes: Sequence[tuple[NDArray[np.float32], NDArray[np.int32]]]) -> bytes:
    """Binary STL that holds the given meshes one after the other.

    Parameters
    ----------
    meshes : sequence of ((v, 3) float32 array, (f, 3) int32 array)
        Vertices in mm and triangles.

    Returns
    -------
    bytes
        The header says ``fabfold, mm`` and nothing that changes from run to run.
    """
    corners = np.concatenate([vertices[faces] for vertices, faces in meshes])
    wide = corners.astype(np.float64)
    normals, _ = face_normals(wide)
    records = np.zeros(len(corners), dtype=_TRIANGLE)
    records["normal"] = normals.astype(np.float32) + np.float32(0.0)
    records["corners"] = corners
    header = b"fabfold, mm".ljust(80, b" ")
    return header + struct.pack("<I", len(corners)) + records.tobytes()


def write_stl(folder: Path, joinery: Joinery) -> list[Path]:
    """Write ``NAME.stl`` for every body: binary, in mm, shape A.

    Parameters
    ----------
    folder : Path
        Made if it is not there, usually ``KIT/bodies``.
    joinery : Joinery

    Returns
    -------
    list of Path
        In the order of the bodies.

    Raises
    ------
    GeometryError
        If a body's mesh does not stay closed in single precision.
    """
    paths = []
    for body in joinery.bodies:
        path = folder / f"{body.name}.stl"
        write_bytes(path, stl_bytes([printable_mesh(body)]))
        paths.append(path)
    return paths


def write_combined_stl(path: Path, joinery: Joinery) -> None:
    """Write all bodies in one binary STL, in mm, shape A.

    Slicers take the file as one object, so the bodies keep their places; names and colours are
    what the 3MF file is for.
    """
    write_bytes(path, stl_bytes([printable_mesh(body) for body in joinery.bodies]))
