"""The cells of a body as solids, and solids as points of a grid.

All of joinery works in a frame of its own: millimetres, axes and origin of the lattice of shape A,
so that the lattice point ``p`` lies at ``voxel_mm * p``. The origin of the kit is added at the end.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import GeometryError
from fabfold.joinery.bodies import BodyMesh
from fabfold.tree.sharing import WHOLE, unpacked
from fabfold.voxels.voxel_model import Voxels

if TYPE_CHECKING:
    import manifold3d

__all__ = ["as_manifold", "eroded_cells", "model_manifold", "occupancy", "solids_of"]

#: Shift of the scan lines in `occupancy`, as a share of the pitch: rays that run through the
#: vertices and edges of axis-aligned boxes would meet degenerate hits.
_SCAN_SHIFT = (0.0131, 0.0173)


def as_manifold(
    vertices: NDArray[np.float64], faces: NDArray[np.generic], what: str
) -> manifold3d.Manifold:
    """Solid of a closed mesh, for exact booleans.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        Corners of the mesh, in any unit.
    faces : (f, 3) integer array
        Triangles as indices into `vertices`, counter-clockwise seen from outside.
    what : str
        Name of the mesh for the error message.

    Returns
    -------
    manifold3d.Manifold
        In the unit of `vertices`.

    Raises
    ------
    GeometryError
        If the mesh is not a closed two-manifold.
    """
    import manifold3d

    solid = manifold3d.Manifold(
        manifold3d.Mesh64(
            np.ascontiguousarray(vertices, dtype=np.float64),
            np.ascontiguousarray(faces, dtype=np.uint64),
        )
    )
    if solid.status() != manifold3d.Error.NoError or solid.is_empty():
        raise GeometryError(
            f"{what}: not a closed two-manifold mesh (manifold3d says {solid.status().name}); "
            "repair the mesh and run again"
        )
    return solid


def solids_of(bodies: Sequence[BodyMesh]) -> list[manifold3d.Manifold]:
    """Bodies as solids, in the same order and place.

    Parameters
    ----------
    bodies : sequence of BodyMesh
        The meshes, mm.

    Returns
    -------
    list of manifold3d.Manifold
        In mm.

    Raises
    ------
    GeometryError
        If a mesh is not a closed two-manifold; it names the body.
    """
    return [as_manifold(body.vertices, body.faces, body.name) for body in bodies]


def model_manifold(voxels: Voxels, voxel_mm: float) -> manifold3d.Manifold:
    """The warped model as a solid.

    Parameters
    ----------
    voxels : Voxels
        The voxels with the warped model's mesh, lattice units.
    voxel_mm : float
        Side of a voxel in mm.

    Returns
    -------
    manifold3d.Manifold
        In mm, lattice origin at zero.
    """
    return as_manifold(voxels.vertices * voxel_mm, voxels.faces, "warped model")


def eroded_cells(
    cells: NDArray[np.int32],
    voxel_mm: float,
    inset_mm: float,
    octants: NDArray[np.uint8] | None = None,
    chamfer_mm: float = 0.0,
) -> manifold3d.Manifold:
    """Cells of a body less everything within `inset_mm` of a cell that is not its own.

    Distance is measured by the largest coordinate difference.

    Parameters
    ----------
    cells : (m, 3) int32 array
        The body's cells in lattice units.
    voxel_mm : float
        Side of a cell in mm.
    inset_mm : float
        Half the gap between bodies in mm.
    octants : (m,) uint8 array, optional
        Which octants of each cell are the body's own, see ``FoldTree.octants``; all by default.
    chamfer_mm : float
        Leg of the chamfer on all outer edges in mm; none by default.

    Returns
    -------
    manifold3d.Manifold
        In mm, lattice origin at zero.
    """
    if octants is None or (octants == WHOLE).all():
        return _eroded_cubes(cells, voxel_mm, inset_mm, chamfer_mm)
    kept = np.argwhere(unpacked(octants))
    halves = (2 * cells[kept[:, 0]] + kept[:, 1:]).astype(np.int32)
    # The half cell 0 begins where the cell 0 does, so its centre is a quarter of a cell below 0.
    octant_solid = _eroded_cubes(halves, voxel_mm / 2, inset_mm, chamfer_mm)
    return octant_solid.translate((-voxel_mm / 4,) * 3)


def _eroded_cubes(
    cells: NDArray[np.int32], side_mm: float, inset_mm: float, chamfer_mm: float
) -> manifold3d.Manifold:
    """Cubes of a lattice (m, 3) less everything near a cube that is not among them, mm.

    The result is the union of boxes: one for each cube, each pair that shares a face, each square
    of four and each block of eight, every one inset on all sides. Where cubes meet, these boxes
    overlap and no gap is left. Where one of them ends inside another, its chamfer is filled; what
    is left is a chamfer on every outer edge, mitred in corners.
    """
    import manifold3d

    own = {tuple(cell) for cell in cells.tolist()}
    boxes = []
    for extent in itertools.product((1, 2), repeat=3):
        offsets = list(itertools.product(*(range(e) for e in extent)))
        for cell in sorted(own):
            if not all(tuple(np.add(cell, o)) in own for o in offsets):
                continue
            # A larger block that holds this one makes it superfluous.
            if _inside_larger(cell, extent, own):
                continue
            size = np.array(extent) * side_mm - 2 * inset_mm
            corner = (np.array(cell) - 0.5) * side_mm + inset_mm
            boxes.append(_chamfered(size, chamfer_mm).translate(tuple(corner)))
    return manifold3d.Manifold.batch_boolean(boxes, manifold3d.OpType.Add)


def _chamfered(size: NDArray[np.float64], chamfer_mm: float) -> manifold3d.Manifold:
    """A box from the origin to `size` (3,) with all edges chamfered, mm."""
    import manifold3d

    if chamfer_mm == 0.0:
        return manifold3d.Manifold.cube(tuple(size))
    corners = np.array(list(itertools.product((0.0, 1.0), repeat=3)))
    # On each of its three faces a corner stands back from the two others.
    back = chamfer_mm * (1.0 - np.eye(3))
    points = corners[:, None] * size + (1.0 - 2.0 * corners[:, None]) * back
    return manifold3d.Manifold.hull_points(points.reshape(-1, 3))


def _inside_larger(
    cell: tuple[int, ...], extent: tuple[int, ...], own: set[tuple[int, ...]]
) -> bool:
    """Whether the block, grown along one of its thin axes, stays within the body's cells."""
    for axis in range(3):
        if extent[axis] == 2:
            continue
        slab = itertools.product(*(range(e) for e in extent))
        layer = [tuple(np.add(cell, o)) for o in slab]
        for step in (-1, 1):
            shift = np.eye(3, dtype=int)[axis] * step
            if all(tuple(np.add(c, shift).tolist()) in own for c in layer):
                return True
    return False


def occupancy(
    solid: manifold3d.Manifold,
    corner: NDArray[np.float64],
    pitch: float,
    shape: tuple[int, int, int],
) -> NDArray[np.bool_]:
    """Which points of a regular grid lie inside a solid.

    One ray a column is cast along z and its hits are paired up, which is exact but for the tiny
    shift of the columns.

    Parameters
    ----------
    solid : manifold3d.Manifold
        The solid, in mm.
    corner : (3,) float64 array
        First grid point in mm.
    pitch : float
        Grid spacing in mm.
    shape : (int, int, int)
        Number of grid points along x, y and z.

    Returns
    -------
    (x, y, z) bool array
        True at the points inside.
    """
    grid = np.zeros(shape, dtype=bool)
    if solid.is_empty():
        return grid
    low_x, low_y, low_z, high_x, high_y, high_z = solid.bounding_box()
    heights = corner[2] + pitch * np.arange(shape[2])
    start, stop = low_z - pitch, high_z + pitch
    for i in range(shape[0]):
        x = corner[0] + pitch * (i + _SCAN_SHIFT[0])
        if not low_x <= x <= high_x:
            continue
        for j in range(shape[1]):
            y = corner[1] + pitch * (j + _SCAN_SHIFT[1])
            if not low_y <= y <= high_y:
                continue
            hits = solid.ray_cast((x, y, start), (x, y, stop))
            if not hits:
                continue
            # Depth of nesting below each height: down-facing hits open, up-facing hits close.
            z = np.array([hit.position[2] for hit in hits])
            step = np.array([1 if hit.normal[2] < 0 else -1 for hit in hits])
            depth = np.concatenate([[0], np.cumsum(step)])
            grid[i, j] = depth[np.searchsorted(z, heights)] > 0
    return grid
