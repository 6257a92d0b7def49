"""Fewer triangles on sculpted surfaces, none of the others touched."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fabfold.meshes import is_closed, mesh_volume

__all__ = ["thinned"]

Mesh = tuple[NDArray[np.float64], NDArray[np.int32]]

#: Shares of the sculpted triangles to try to get by with, each about 1.3 times the one before.
_SHARES = (0.1, 0.13, 0.17, 0.22, 0.28, 0.36, 0.47, 0.61, 0.78)
#: So few sculpted triangles are left as they are.
_FEWEST = 100
#: The thinned mesh may change the volume by this share.
_VOLUME_SHARE = 0.003


def thinned(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    sculpted: NDArray[np.bool_],
    tolerance_mm: float,
    original: Mesh | None = None,
) -> Mesh:
    """Decimate some triangles of a closed mesh within a bound.

    More triangles are taken to be nearer to the old mesh, so the fewest are found by halving.

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
    original : (vertices, faces), optional
        The old mesh, where this one is already simpler than that.

    Returns
    -------
    vertices : (w, 3) float64 array
        Corners in mm of the mesh with the fewest triangles that is closed and within the bound;
        of the old mesh if there is none.
    faces : (g, 3) int32 array
        Its triangles as indices into the new vertices.

    References
    ----------
    Garland & Heckbert, "Surface simplification using quadric error metrics", 1997.
    """
    original = original or (vertices, faces)
    movable = int(sculpted.sum())
    if movable < _FEWEST:
        return original
    volume = mesh_volume(*original)
    best = original
    low, high = 0, len(_SHARES)
    while low < high:
        middle = (low + high) // 2
        found = _decimated(vertices, faces, sculpted, int(movable * _SHARES[middle]))
        same = is_closed(found[1])
        same = same and abs(mesh_volume(*found) - volume) <= _VOLUME_SHARE * volume
        if same and _distance(original, found) <= tolerance_mm:
            best, high = found, middle
        else:
            low = middle + 1
    return best


def _decimated(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], sculpted: NDArray[np.bool_], count: int
) -> Mesh:
    """The mesh with so many sculpted triangles."""
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    marks = sculpted.astype(np.float64)
    meshes.add_mesh(pymeshlab.Mesh(vertices, faces, f_scalar_array=marks))
    meshes.compute_selection_by_condition_per_face(condselect="fq > 0.5")
    meshes.meshing_decimation_quadric_edge_collapse(
        targetfacenum=count,
        selected=True,
        preserveboundary=True,
        preservenormal=True,
        preservetopology=True,
        planarquadric=True,
        autoclean=False,
    )
    found = meshes.current_mesh()
    points = np.array(found.vertex_matrix(), dtype=np.float64)
    return points, np.array(found.face_matrix(), dtype=np.int32)


def _distance(one: Mesh, other: Mesh) -> float:
    """Largest distance of a corner of either mesh from the other one, mm."""
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    for mesh in (one, other):
        meshes.add_mesh(pymeshlab.Mesh(*mesh))
    # No more corners than `samplenum` would be looked at.
    return max(
        float(
            meshes.get_hausdorff_distance(
                sampledmesh=k, targetmesh=1 - k, samplevert=True, samplenum=len(mesh[0])
            )["max"]
        )
        for k, mesh in enumerate((one, other))
    )
