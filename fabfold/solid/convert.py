"""Between arrays and the mesh objects of manifold3d and pymeshlab."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fabfold.solid.topology import Faces, Points

if TYPE_CHECKING:
    import manifold3d

__all__ = ["decimated", "from_mesh_set", "to_manifold", "to_mesh", "to_mesh_set"]


def to_manifold(vertices: Points, faces: NDArray[np.integer[Any]]) -> manifold3d.Manifold:
    """Make a manifold3d object in double precision.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        Corner coordinates, in any unit.
    faces : (f, 3) integer array
        Three vertex indices for each triangle.

    Returns
    -------
    manifold3d.Manifold
        Its `status` tells whether the triangles are a closed manifold.
    """
    import manifold3d

    return manifold3d.Manifold(
        manifold3d.Mesh64(
            # Writable, which arrays of a manifold are not.
            np.require(vertices, np.float64, ["C", "W"]),
            np.require(faces, np.uint64, ["C", "W"]),
        )
    )


def to_mesh(manifold: manifold3d.Manifold) -> tuple[Points, Faces]:
    """Triangles of a manifold3d object.

    Parameters
    ----------
    manifold : manifold3d.Manifold
        Any solid, also an empty one.

    Returns
    -------
    vertices : (v, 3) float64 array
        Corner coordinates, in the unit of the solid.
    faces : (f, 3) int64 array
        Three vertex indices for each triangle, counter-clockwise seen from outside.
    """
    mesh = manifold.to_mesh64()
    return (
        np.asarray(mesh.vert_properties, dtype=np.float64)[:, :3].copy(),
        np.asarray(mesh.tri_verts, dtype=np.int64),
    )


def to_mesh_set(vertices: Points, faces: NDArray[np.integer[Any]]) -> Any:
    """Make a pymeshlab.MeshSet with one mesh.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        Corner coordinates, in any unit.
    faces : (f, 3) integer array
        Three vertex indices for each triangle.

    Returns
    -------
    pymeshlab.MeshSet
        The mesh is its current one.
    """
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(
        pymeshlab.Mesh(
            np.ascontiguousarray(vertices, dtype=np.float64),
            np.ascontiguousarray(faces, dtype=np.int32),
        )
    )
    return meshes


def from_mesh_set(meshes: Any) -> tuple[Points, Faces]:
    """Triangles of the current mesh of a pymeshlab.MeshSet.

    Parameters
    ----------
    meshes : pymeshlab.MeshSet
        With at least one mesh.

    Returns
    -------
    vertices : (v, 3) float64 array
        Corner coordinates, in the unit of the mesh.
    faces : (f, 3) int64 array
        Three vertex indices for each triangle.
    """
    found = meshes.current_mesh()
    return (
        np.array(found.vertex_matrix(), dtype=np.float64),
        np.array(found.face_matrix(), dtype=np.int64),
    )


def decimated(manifold: manifold3d.Manifold, limit: int) -> manifold3d.Manifold:
    """Simplify a solid to at most `limit` triangles, with the smallest tolerance that will do.

    Parameters
    ----------
    manifold : manifold3d.Manifold
        Its longest side is about 1.
    limit : int
        Most triangles wanted.

    Returns
    -------
    manifold3d.Manifold
        With more triangles than `limit` where the largest tolerance, 0.0064, is not enough.
    """
    tolerance = 2.5e-5
    while manifold.num_tri() > limit and tolerance < 0.01:
        manifold = manifold.simplify(tolerance)
        tolerance *= 2
    return manifold
