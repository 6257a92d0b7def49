"""Between arrays and the objects of manifold3d and pymeshlab."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fabfold.solid.topology import Faces, Points

if TYPE_CHECKING:
    import manifold3d

__all__ = ["from_mesh_set", "thinned", "to_manifold", "to_mesh", "to_mesh_set"]


def to_manifold(vertices: Points, faces: Faces) -> manifold3d.Manifold:
    """A manifold3d object in double precision; its `status` tells whether it is one."""
    import manifold3d

    return manifold3d.Manifold(
        manifold3d.Mesh64(
            np.ascontiguousarray(vertices, dtype=np.float64),
            np.ascontiguousarray(faces, dtype=np.uint64),
        )
    )


def to_mesh(manifold: manifold3d.Manifold) -> tuple[Points, Faces]:
    """Vertices (v, 3) float64 and faces (f, 3) int64 of a manifold3d object."""
    mesh = manifold.to_mesh64()
    return (
        np.asarray(mesh.vert_properties, dtype=np.float64)[:, :3].copy(),
        np.asarray(mesh.tri_verts, dtype=np.int64),
    )


def to_mesh_set(vertices: Points, faces: Faces) -> Any:
    """A pymeshlab.MeshSet with one mesh."""
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
    """Vertices (v, 3) float64 and faces (f, 3) int64 of the current mesh of a MeshSet."""
    found = meshes.current_mesh()
    return (
        np.array(found.vertex_matrix(), dtype=np.float64),
        np.array(found.face_matrix(), dtype=np.int64),
    )


def thinned(manifold: manifold3d.Manifold, limit: int) -> manifold3d.Manifold:
    """Thin a mesh (longest side about 1) to at most `limit` triangles, tolerance by tolerance."""
    tolerance = 2.5e-5
    while manifold.num_tri() > limit and tolerance < 0.01:
        manifold = manifold.simplify(tolerance)
        tolerance *= 2
    return manifold
