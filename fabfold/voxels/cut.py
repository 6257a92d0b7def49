"""From one placement of the grid to voxels: warp, sample, drop small cells, keep one group."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fabfold.lattice.rotations import parity
from fabfold.solid.scan import scan_mesh
from fabfold.voxels.features import RIGID_CONTACT, contact_counts, face_pairs, largest_pieces
from fabfold.voxels.grid_placement import SURPLUS_DROP_BELOW, Capacity
from fabfold.voxels.offsets import CellEnergy
from fabfold.voxels.voxel_model import SUBDIVISION, Voxels
from fabfold.voxels.warp import warp_mesh

__all__ = ["Placement", "colour_surplus", "cut_voxels"]


@dataclass(frozen=True)
class Placement:
    """A grid with its planes moved.

    Attributes
    ----------
    rotation : (3, 3) float64 array
        From model axes to lattice axes.
    origin : (3,) float64 array
        The point that becomes lattice (0, 0, 0): lattice axes, model units.
    pitch : float
        Side of a voxel in model units.
    first : (3,) int64 array
        Lattice index of the first cell on each axis; plane ``i`` is at ``first - 0.5 + i``.
    offsets : three float64 arrays
        How far each plane was moved, in voxel sides; the outermost ones are outside the model.
    """

    rotation: NDArray[np.float64]
    origin: NDArray[np.float64]
    pitch: float
    first: NDArray[np.int64]
    offsets: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]

    def in_axes(self, axes: NDArray[np.float64]) -> Placement:
        """The same grid for the model in the axes that it had before.

        Parameters
        ----------
        axes : (3, 3) float64 array
            The orthogonal matrix by which the model's corners were multiplied before the grid was
            placed. Where it mirrors, the grid of the unmirrored model is mirrored along lattice x.

        Returns
        -------
        Placement
            Its planes cut the model where those of this one cut it in the other axes.
        """
        rotation = np.einsum("ij,jk->ik", self.rotation, axes)
        if np.linalg.det(axes) > 0:
            return replace(self, rotation=rotation)
        sign = np.array([-1.0, 1.0, 1.0])
        x, y, z = self.offsets
        first = self.first.copy()
        first[0] = 2 - len(x) - first[0]
        return replace(
            self,
            rotation=sign[:, None] * rotation,
            origin=sign * self.origin,
            first=first,
            offsets=(-x[::-1], y, z),
        )


def colour_surplus(cells: NDArray[np.int32], capacity: Capacity) -> tuple[int, int]:
    """Cells of each checkerboard colour for which the template has no room.

    Parameters
    ----------
    cells : (n, 3) int32 array
        Lattice coordinates.
    capacity : Capacity
        What the template holds.

    Returns
    -------
    (int, int)
        Surplus of colour 0 and of colour 1, for the way to assign the model's colours to the
        template's that leaves fewer cells over.
    """
    odd = int(parity(cells).sum())
    even = len(cells) - odd
    one, other = capacity.colours
    ways = [(max(0, even - a), max(0, odd - b)) for a, b in ((one, other), (other, one))]
    return min(ways, key=sum)


def _largest_group(
    cells: NDArray[np.int32], material: NDArray[np.bool_], weight: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Mask of the cells in the group, joined by printed contact, that holds the most material."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    pairs = face_pairs(cells)
    pairs = pairs[contact_counts(cells, pairs, material) >= RIGID_CONTACT]
    ones = np.ones(len(pairs), dtype=np.int8)
    graph = coo_array((ones, (pairs[:, 0], pairs[:, 1])), shape=(len(cells),) * 2)
    _, label = connected_components(graph, directed=False)
    return np.asarray(label == np.argmax(np.bincount(label, weights=weight)))


def _volume(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> float:
    """Volume of a closed mesh, summed in one run.

    It differs from `mesh_volume` in the last digit at most. The score of the voxels is part of a
    kit, digit by digit, so the order of its sum stays.
    """
    corners = vertices[faces] - vertices.mean(axis=0)
    normals = np.cross(corners[:, 1], corners[:, 2])
    return float(np.einsum("ij,ij->", corners[:, 0], normals) / 6.0)


def cut_voxels(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    placement: Placement,
    energy: CellEnergy,
    capacity: Capacity,
) -> tuple[Voxels | None, int, int]:
    """Cut the model into voxels.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        The model, model units.
    faces : (f, 3) int32 array
        Three vertex indices for each triangle, closed and outward-oriented.
    placement : Placement
        Its planes enclose the whole model.
    energy : CellEnergy
        `drop_below` decides which cells are dropped.
    capacity : Capacity
        What the template holds.

    Returns
    -------
    voxels : Voxels or None
        None if the template cannot hold the cells, or no cell is left.
    kept : int
        Cells with enough material, in one group.
    excess : int
        Cells for which the template has no room; 0 if it holds them all.
    """
    lattice = (vertices @ placement.rotation.T - placement.origin) / placement.pitch
    regular = [
        placement.first[axis] - 0.5 + np.arange(len(placement.offsets[axis])) for axis in range(3)
    ]
    moved = [regular[axis] + placement.offsets[axis] for axis in range(3)]
    warped, warped_faces = warp_mesh(
        lattice, faces, (moved[0], moved[1], moved[2]), (regular[0], regular[1], regular[2])
    )
    nx, ny, nz = (len(planes) - 1 for planes in regular)
    s = SUBDIVISION
    grid = scan_mesh((warped - placement.first + 0.5) * s, warped_faces, (nx * s, ny * s, nz * s))
    blocks = grid.reshape(nx, s, ny, s, nz, s).transpose(0, 2, 4, 1, 3, 5)
    fill = blocks.mean(axis=(3, 4, 5))
    total = float(fill.sum())

    kept = np.argwhere(fill >= max(energy.drop_below, 1.0 / s**3)).astype(np.int32)
    excess = 0
    while len(kept):
        subvoxels = blocks[tuple(kept.T)]
        weight = fill[tuple(kept.T)]
        group = _largest_group(kept, largest_pieces(subvoxels), weight)
        kept, weight = kept[group], weight[group]
        surplus = colour_surplus(kept, capacity)
        excess = sum(surplus)
        if excess == 0:
            break
        colour = parity(kept)
        doomed: list[int] = []
        for which in range(2):
            small = np.flatnonzero((colour == which) & (weight < SURPLUS_DROP_BELOW))
            order = small[np.argsort(weight[small], kind="stable")]
            doomed.extend(order[: surplus[which]].tolist())
        if len(doomed) < excess:
            return None, len(kept), excess
        kept = np.delete(kept, doomed, axis=0)
    if not len(kept):
        return None, len(kept), excess

    low = kept.min(axis=0)
    high = kept.max(axis=0)
    subvoxels = np.ascontiguousarray(blocks[tuple(kept.T)])
    share = fill[tuple(kept.T)]
    slivers = int((share < energy.sliver_below).sum())
    lost = total - float(share.sum())
    moves = sum(float(((offsets * s) ** 2).sum()) for offsets in placement.offsets)
    missed = abs(total - _volume(warped, warped_faces))
    shift = placement.first + low
    voxels = Voxels(
        cells=(kept - low).astype(np.int32),
        subvoxels=subvoxels,
        fill=share,
        vertices=warped - shift,
        faces=warped_faces,
        rotation=placement.rotation,
        origin=placement.origin + shift * placement.pitch,
        pitch=placement.pitch,
        plane_offsets=(
            placement.offsets[0][low[0] : high[0] + 2],
            placement.offsets[1][low[1] : high[1] + 2],
            placement.offsets[2][low[2] : high[2] + 2],
        ),
        lost_volume=lost / total,
        energy={
            "fullness": float((1.0 - share).sum()),
            "fill": float(share.sum()),
            "slivers": float(slivers),
            "lost": lost,
            "moves": moves,
            "missed": missed,
            "score": float(share.sum())
            - energy.sliver_cost * slivers
            - energy.loss_cost * lost
            - energy.move_cost * moves
            - missed,
        },
    )
    return voxels, len(kept), 0
