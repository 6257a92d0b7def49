"""Small facts about triangle meshes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["mesh_volume"]


def mesh_volume(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> float:
    """Volume enclosed by a closed mesh, by the divergence theorem.

    Parameters
    ----------
    vertices : (v, 3) float64 array
    faces : (f, 3) int32 array
        Counter-clockwise seen from outside.

    Returns
    -------
    float
        In the cube of the unit of `vertices`; negative if the mesh is inside out.
    """
    corners = vertices[faces] - vertices.mean(axis=0)
    normals = np.cross(corners[:, 1], corners[:, 2])
    return float(np.einsum("ij,ij->", corners[:, 0], normals) / 6.0)
