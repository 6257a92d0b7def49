"""Which faces of a model are painted: those in another colour than most of its surface."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fabfold.meshes import face_areas
from fabfold.solid.closed_solid import Paint

__all__ = ["SAME_COLOUR", "colours_of_corners", "colours_of_mesh", "painted_faces"]

#: Colours whose bytes differ by no more than this are one.
SAME_COLOUR = 8


def colours_of_corners(
    faces: NDArray[np.integer], colours: NDArray[np.integer]
) -> NDArray[np.uint8]:
    """Colour of each face from the colours of its corners: what two of them agree on, or the mean.

    Parameters
    ----------
    faces : (f, 3) integer array
        Three vertex indices for each triangle.
    colours : (v, 3) integer array
        sRGB of each vertex.

    Returns
    -------
    (f, 3) uint8 array
        sRGB of each triangle.
    """
    a, b, c = (np.asarray(colours)[faces[:, k]].astype(int) for k in range(3))
    mean = np.rint((a + b + c) / 3).astype(int)
    first = (a == b).all(axis=1) | (a == c).all(axis=1)
    last = (b == c).all(axis=1)
    return np.asarray(np.where(first[:, None], a, np.where(last[:, None], b, mean)), dtype=np.uint8)


def colours_of_mesh(mesh: Any) -> NDArray[np.uint8] | None:
    """Face colours of a trimesh object: its face or vertex colours, or those of its material.

    Parameters
    ----------
    mesh : trimesh.Trimesh
        As it was loaded, its faces in the order of the file.

    Returns
    -------
    (f, 3) uint8 array or None
        sRGB of each triangle; None if the mesh has no colours.
    """
    visual = mesh.visual
    if visual.kind == "texture":
        try:
            visual = visual.to_color()
        except (AttributeError, IndexError, TypeError, ValueError):
            return None  # a texture that cannot be looked up is no paint
    if visual.kind not in ("face", "vertex"):
        return None
    by_face = visual.kind == "face"
    shades = np.asarray(visual.face_colors if by_face else visual.vertex_colors)
    if shades.shape[1:] not in ((3,), (4,)):
        return None
    if by_face and len(shades) == len(mesh.faces):
        return np.asarray(shades[:, :3], dtype=np.uint8)
    if not by_face and len(shades) == len(mesh.vertices):
        return colours_of_corners(mesh.faces, shades[:, :3])
    return None


def painted_faces(
    vertices: NDArray[np.float64],
    faces: NDArray[np.integer],
    colours: NDArray[np.uint8] | None,
) -> Paint | None:
    """The faces in another colour than the one that covers most of the surface.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        Corner coordinates in model units.
    faces : (f, 3) integer array
        Three vertex indices for each triangle.
    colours : (f, 3) uint8 array or None
        sRGB of each triangle; None where the file has no colours.

    Returns
    -------
    Paint or None
        None if all faces have about the same colour.
    """
    if colours is None or len(colours) != len(faces):
        return None
    corners = np.asarray(vertices, dtype=np.float64)[faces]
    area = face_areas(corners)
    known, which = np.unique(colours, axis=0, return_inverse=True)
    base = known[int(np.bincount(which.reshape(-1), weights=area).argmax())].astype(int)
    other = np.abs(colours.astype(int) - base).max(axis=1) > SAME_COLOUR
    other &= area > 0
    if not other.any():
        return None
    return Paint(np.ascontiguousarray(corners[other]), np.ascontiguousarray(colours[other]))
