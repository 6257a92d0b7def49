"""Binary STL of every body."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fabfold.export.weld import printable_mesh
from fabfold.files import write_bytes
from fabfold.joinery.bodies import Joinery
from fabfold.meshes import face_normals

__all__ = ["stl_bytes", "write_stl"]

#: Record of one triangle in the file.
_TRIANGLE = np.dtype(
    [("normal", "<f4", (3,)), ("corners", "<f4", (3, 3)), ("attribute", "<u2")], align=False
)


def stl_bytes(vertices: NDArray[np.float32], faces: NDArray[np.int32]) -> bytes:
    """Binary STL of one mesh.

    Parameters
    ----------
    vertices : (v, 3) float32 array
        Corners of the mesh in mm.
    faces : (f, 3) int32 array
        Triangles as indices into `vertices`.

    Returns
    -------
    bytes
        The content of the file; the header says ``fabfold, mm`` and nothing that changes from run
        to run.
    """
    corners = vertices[faces]
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
        Folder for the files, usually ``KIT/bodies``; it is made if it is not there.
    joinery : Joinery
        The printed bodies in shape A.

    Returns
    -------
    list of Path
        The files, in the order of the bodies.

    Raises
    ------
    GeometryError
        If a body's mesh does not stay closed in single precision.
    """
    paths = []
    for body in joinery.bodies:
        path = folder / f"{body.name}.stl"
        write_bytes(path, stl_bytes(*printable_mesh(body)))
        paths.append(path)
    return paths
