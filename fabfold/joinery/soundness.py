"""The final mesh of a body: few triangles, closed, one piece, also in the precision of STL.

An STL file holds coordinates in single precision, and its readers join corners that round to the
same point. Such a mesh must still be a closed two-manifold.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import GeometryError
from fabfold.meshes import compact, weld
from fabfold.solid.crossing import crossing_triangles

if TYPE_CHECKING:
    import manifold3d

__all__ = [
    "mesh_faults",
    "piece_count",
    "piece_of_vertices",
    "printable_body",
    "stl_mesh",
]

#: Flat faces are merged and short edges collapsed up to this deviation.
SIMPLIFY_MM = 0.001
#: Side of the cubes that are taken out where a body touches itself in a point or along an edge.
_NICK_MM = 0.15
#: How often nicks are cut, each time a little larger.
_ROUNDS = 6
#: Corners of a cube of side 2.
_CUBE = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)


def stl_mesh(
    vertices: NDArray[np.float64], faces: NDArray[np.generic]
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """The mesh that a reader of a binary STL file sees.

    Coordinates are rounded to single precision, equal corners become one vertex, and triangles
    that lost a corner by it vanish.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        Corners of the mesh in mm.
    faces : (f, 3) integer array
        Triangles as indices into `vertices`.

    Returns
    -------
    vertices : (w, 3) float64 array
        Distinct corners in mm; every value is exactly a single-precision number.
    faces : (g, 3) int32 array
        The triangles that are left, as indices into the new vertices.
    """
    rounded = np.asarray(vertices, dtype=np.float32)
    points, triangles = compact(*weld(rounded, np.asarray(faces, dtype=np.int64), order="xyz"))
    return points.astype(np.float64), triangles.astype(np.int32)


def mesh_faults(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.int64]:
    """Where a mesh is not a closed, oriented two-manifold.

    An edge is at fault if it is not shared by exactly two triangles that run through it in
    opposite directions, a vertex if its triangles form more than one fan.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        Corners of the mesh, no two alike.
    faces : (f, 3) int32 array
        Triangles as indices into `vertices`.

    Returns
    -------
    (k, 2) int64 array
        The two vertices of each faulty edge; twice the same for a faulty vertex. Empty for a
        sound mesh.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    count = len(vertices)
    start = faces.reshape(-1).astype(np.int64)
    end = np.roll(faces, -1, axis=1).reshape(-1).astype(np.int64)
    forward, backward = start * count + end, end * count + start
    keys, times = np.unique(forward, return_counts=True)
    unmatched = keys[(times != 1) | ~np.isin(keys, backward)]
    if len(unmatched):
        edges = np.sort(np.stack([unmatched // count, unmatched % count], axis=1), axis=1)
        return np.asarray(np.unique(edges, axis=0), dtype=np.int64)
    # Corners of one vertex hang together across the edges that leave it: one component a fan.
    order = np.argsort(backward)
    position = np.searchsorted(backward[order], forward)
    twin = order[position]  # half-edge that runs against half-edge i
    following = np.arange(len(start)).reshape(-1, 3)[:, [1, 2, 0]].reshape(-1)
    # Half-edge i starts at v; its twin ends at v, so the twin's successor starts at v again.
    links = coo_matrix(
        (np.ones(len(start), dtype=np.int8), (np.arange(len(start)), following[twin])),
        shape=(len(start), len(start)),
    )
    _, fan = connected_components(links, directed=False)
    pairs = np.unique(np.stack([start, fan.astype(np.int64)], axis=1), axis=0)
    vertex, fans = np.unique(pairs[:, 0], return_counts=True)
    split = vertex[fans > 1].astype(np.int64)
    return np.stack([split, split], axis=1)


def piece_of_vertices(count: int, faces: NDArray[np.integer[Any]]) -> NDArray[np.int32]:
    """Which piece of a mesh each vertex belongs to.

    Parameters
    ----------
    count : int
        Number of vertices.
    faces : (f, 3) integer array
        Triangles as indices of vertices.

    Returns
    -------
    (count,) int32 array
        Numbers from 0; a vertex that no triangle uses is a piece of its own.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    ends = faces[:, [0, 1, 1, 2]].reshape(-1, 2)
    graph = coo_matrix(
        (np.ones(len(ends), dtype=np.int8), (ends[:, 0], ends[:, 1])), shape=(count, count)
    )
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int32)


def piece_count(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> int:
    """Number of pieces of a mesh that are connected along edges.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        Corners of the mesh; each is used.
    faces : (f, 3) int32 array
        Triangles as indices into `vertices`.

    Returns
    -------
    int
        At least 1 for a mesh that is not empty.
    """
    return int(piece_of_vertices(len(vertices), faces).max(initial=-1)) + 1


def printable_body(
    solid: manifold3d.Manifold, name: str, origin_mm: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Final mesh of one body in shape A.

    Flat faces are merged, the body is moved to its place, and the mesh is made a closed
    two-manifold as an STL reader will see it: where the body touches itself in a point or along an
    edge, a nick of a tenth of a millimetre parts the two sides. Where triangles cross, as slivers
    do once they are rounded, edges of up to some hundredths of a millimetre are collapsed too.

    Parameters
    ----------
    solid : manifold3d.Manifold
        One piece, in mm, lattice origin at zero.
    name : str
        Name of the body, for the error message.
    origin_mm : (3,) float64 array
        Where the lattice origin lies in shape A, mm; it is added to every point.

    Returns
    -------
    vertices : (v, 3) float64 array
        Corners in mm, shape A; every value is exactly a single-precision number.
    faces : (f, 3) int32 array
        Triangles as indices into `vertices`, counter-clockwise seen from outside.

    Raises
    ------
    GeometryError
        If no closed two-manifold single piece that does not cross itself comes out.
    """
    import manifold3d

    current = solid.as_original().simplify(SIMPLIFY_MM)
    if current.is_empty():
        raise GeometryError(f"{name}: nothing is left of it after cutting")
    for attempt in range(_ROUNDS):
        mesh = current.translate(tuple(origin_mm)).to_mesh64()
        vertices, faces = stl_mesh(mesh.vert_properties[:, :3], mesh.tri_verts)
        faults = mesh_faults(vertices, faces)
        if len(faults) == 0:
            pieces = piece_count(vertices, faces)
            if pieces != 1:
                raise GeometryError(f"{name}: falls into {pieces} pieces when it is written")
            crossing = crossing_triangles(vertices, faces)
            if len(crossing) == 0:
                return vertices, faces
            # Slivers a few micrometres high, which rounding has tipped into each other.
            current = current.simplify(SIMPLIFY_MM * 2.0 ** (attempt + 1))
            continue
        half = _NICK_MM * (1.0 + 0.5 * attempt) / 2.0
        ends = vertices[faults] - origin_mm
        nicks = [
            manifold3d.Manifold.hull_points((end[:, None] + half * _CUBE).reshape(-1, 3))
            for end in ends
        ]
        parts = manifold3d.Manifold.batch_boolean(
            [current, *nicks], manifold3d.OpType.Subtract
        ).decompose()
        current = max(parts, key=lambda part: part.volume()).as_original().simplify(SIMPLIFY_MM)
    if len(faults) == 0:
        raise GeometryError(
            f"{name}: {len(crossing)} triangles of its surface cross others, first near "
            f"{np.round(vertices[faces[crossing[0], 0]], 2).tolist()} mm; another voxel size may "
            "help"
        )
    raise GeometryError(
        f"{name}: touches itself at {len(faults)} points, "
        f"first near {np.round(vertices[faults[0]], 2).tolist()} mm; another voxel size may help"
    )
