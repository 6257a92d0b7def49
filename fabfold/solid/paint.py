"""Which faces of a model are painted: those in another colour than most of its surface."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fabfold.solid.closed_solid import Paint

__all__ = ["colours_of_corners", "colours_of_mesh", "painted_faces"]

#: Colours whose bytes differ by no more than this are one.
_ALIKE = 8


def colours_of_corners(
    faces: NDArray[np.integer], colours: NDArray[np.integer]
) -> NDArray[np.uint8]:
    """Colour of each face from the colours of its corners: what two of them agree on, or the mean.

    Parameters
    ----------
    faces : (f, 3) integer array
    colours : (v, 3) integer array
        sRGB of each vertex.

    Returns
    -------
    (f, 3) uint8 array
    """
    a, b, c = (np.asarray(colours)[faces[:, k]].astype(int) for k in range(3))
    mean = np.rint((a + b + c) / 3).astype(int)
    first = (a == b).all(axis=1) | (a == c).all(axis=1)
    last = (b == c).all(axis=1)
    return np.asarray(np.where(first[:, None], a, np.where(last[:, None], b, mean)), dtype=np.uint8)


def colours_of_mesh(mesh: Any) -> NDArray[np.uint8] | None:
    """Face colours of a trimesh object, from face or vertex colours or its material; else None."""
    visual = mesh.visual
    if visual.kind == "texture":
        try:
            visual = visual.to_color()
        except (AttributeError, IndexError, TypeError, ValueError):
            return None  # a texture that cannot be looked up is no paint
    if visual.kind == "face" and len(visual.face_colors) == len(mesh.faces):
        return np.asarray(visual.face_colors[:, :3], dtype=np.uint8)
    if visual.kind == "vertex" and len(visual.vertex_colors) == len(mesh.vertices):
        return colours_of_corners(mesh.faces, visual.vertex_colors[:, :3])
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
    faces : (f, 3) integer array
    colours : (f, 3) uint8 array or None
    """
    if colours is None or len(colours) != len(faces):
        return None
    corners = np.asarray(vertices, dtype=np.float64)[faces]
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    known, which = np.unique(colours, axis=0, return_inverse=True)
    base = known[int(np.bincount(which.reshape(-1), weights=area).argmax())].astype(int)
    other = np.abs(colours.astype(int) - base).max(axis=1) > _ALIKE
    other &= area > 0
    if not other.any():
        return None
    return Paint(np.ascontiguousarray(corners[other]), np.ascontiguousarray(colours[other]))
