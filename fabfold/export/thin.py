"""Fewer triangles on sculpted surfaces, none of the others touched."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fabfold.meshes import is_closed, mesh_volume

__all__ = ["thinned"]

#: Shares of the sculpted triangles to try to get by with.
_SHARES = (0.25, 0.4, 0.6, 0.8)
#: The thinned mesh may change the volume by this share.
_VOLUME_SHARE = 0.003


def thinned(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    sculpted: NDArray[np.bool_],
    tolerance_mm: float,
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Decimate some triangles of a closed mesh within a bound.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        Corners of the mesh in mm.
    faces : (f, 3) int32 array
        Triangles as indices into `vertices`.
    sculpted : (f,) bool array
        Triangles that may go. Corners of any other triangle stay where they are.
    tolerance_mm : float
        Largest distance of a corner of the old mesh from the new one, and the other way, mm.

    Returns
    -------
    vertices : (w, 3) float64 array
        Corners in mm of the mesh with the fewest triangles that is closed and within the bound;
        of the mesh itself if there is none.
    faces : (g, 3) int32 array
        Its triangles as indices into the new vertices.

    References
    ----------
    Garland & Heckbert, "Surface simplification using quadric error metrics", 1997.
    """
    import pymeshlab

    movable = int(sculpted.sum())
    if movable < 100:
        return vertices, faces
    volume = mesh_volume(vertices, faces)
    for share in _SHARES:
        meshes = pymeshlab.MeshSet()
        marks = sculpted.astype(np.float64)
        meshes.add_mesh(pymeshlab.Mesh(vertices, faces, f_scalar_array=marks))
        meshes.add_mesh(pymeshlab.Mesh(vertices, faces, f_scalar_array=marks))
        meshes.compute_selection_by_condition_per_face(condselect="fq > 0.5")
        meshes.meshing_decimation_quadric_edge_collapse(
            targetfacenum=int(movable * share),
            selected=True,
            preserveboundary=True,
            preservenormal=True,
            preservetopology=True,
            planarquadric=True,
            autoclean=False,
        )
        found = meshes.current_mesh()
        points = np.array(found.vertex_matrix(), dtype=np.float64)
        triangles = np.array(found.face_matrix(), dtype=np.int32)
        if not is_closed(triangles):
            continue
        if abs(mesh_volume(points, triangles) - volume) > _VOLUME_SHARE * volume:
            continue
        # No more corners than `samplenum` would be looked at.
        if all(
            meshes.get_hausdorff_distance(
                sampledmesh=one, targetmesh=1 - one, samplevert=True, samplenum=len(vertices)
            )["max"]
            <= tolerance_mm
            for one in (0, 1)
        ):
            return points, triangles
    return vertices, faces
