"""Octants of a cell, so that two partly filled voxels can go into one template cell.

The collision term of the paper (section 4) lets two voxels take one place where their meshes do not
overlap. Here a cell has eight octants. A voxel that shares keeps to the octants that hold its
material, and two voxels may take one cell where their octants, turned as they come to lie, are all
different. Bit ``4 x + 2 y + z`` of a mask stands for the octant on the side ``x, y, z`` (0 low,
1 high).
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from fabfold.lattice.rotations import FACE_BEFORE, FACES, ROTATIONS

__all__ = [
    "LEAST_FILL",
    "WHOLE",
    "edge_octants",
    "max_shared_cells",
    "octant_masks",
    "quarter_depths",
    "shared_octants",
    "turned_masks",
    "unpacked",
]

#: The mask of a whole cell.
WHOLE = 255
#: An octant that is less full than this is given up by a voxel that shares: half a per cent of a
#: cell, as much as a loose crumb that joinery leaves out.
LEAST_FILL = 0.04
#: At most one voxel in so many sits in the cell of another one.
_ONE_IN = 10

#: Side of each octant along x, y and z, (8, 3).
_SIDES: NDArray[np.int64] = np.indices((2, 2, 2)).reshape(3, 8).T


def max_shared_cells(voxels: int) -> int:
    """Most cells with two voxels that a tree may have.

    Parameters
    ----------
    voxels : int
        Number of voxels.

    Returns
    -------
    int
        One for every ten voxels.
    """
    return voxels // _ONE_IN


def octant_masks(subvoxels: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Which octants of its cell a voxel must have.

    Those that are filled to at least :data:`LEAST_FILL`. A voxel whose octants do not hang together
    by faces gets the whole cell: nothing could tie it together.

    Parameters
    ----------
    subvoxels : (n, s, s, s) bool array
        Material in each cell in shape A, s even.

    Returns
    -------
    (n,) uint8 array
        Mask of each voxel in shape A, never 0; 255 where nothing is left to share.
    """
    count, size = subvoxels.shape[:2]
    half = size // 2
    share = subvoxels.reshape(count, 2, half, 2, half, 2, half).mean(axis=(2, 4, 6))
    held = share.reshape(count, 8) >= LEAST_FILL
    bits = (held << np.arange(8)).sum(axis=1)
    return np.array([b if _hangs_together(int(b)) else WHOLE for b in bits], dtype=np.uint8)


def _hangs_together(bits: int) -> bool:
    """Whether octants form one piece by their faces; False for none."""
    left = {k for k in range(8) if bits >> k & 1}
    queue = sorted(left)[:1]
    left.difference_update(queue)
    while queue:
        here = queue.pop()
        near = {here ^ step for step in (1, 2, 4)} & left
        left -= near
        queue += near
    return bits != 0 and not left


@cache
def _places() -> NDArray[np.int64]:
    """Octant that each octant becomes in each rotation, (24, 8)."""
    turned = (np.einsum("rij,oj->roi", ROTATIONS, 2 * _SIDES - 1) + 1) // 2
    return np.asarray(turned @ np.array([4, 2, 1]))


def turned_masks(masks: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Masks in each of the 24 rotations.

    Parameters
    ----------
    masks : (n,) uint8 array
        Mask of each voxel in shape A.

    Returns
    -------
    (n, 24) uint8 array
        Mask of each voxel in each rotation.
    """
    bits = (np.asarray(masks)[:, None] >> np.arange(8)) & 1
    return np.asarray((bits[:, None, :] << _places()[None]).sum(axis=2), dtype=np.uint8)


def unpacked(masks: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Masks as arrays.

    Parameters
    ----------
    masks : (n,) uint8 array
        Mask of each voxel.

    Returns
    -------
    (n, 2, 2, 2) bool array
        Indexed by the voxel and the side along x, y and z.
    """
    bits = (np.asarray(masks)[:, None] >> np.arange(8)) & 1
    return bits.astype(bool).reshape(-1, 2, 2, 2)


@cache
def edge_octants() -> NDArray[np.uint8]:
    """The two octants beside each edge of a cell.

    A hinge on the edge has its knuckles and its bracket there.

    Returns
    -------
    (6, 6) uint8 array
        Mask for the edge of two faces, by these faces.
    """
    on = np.array([(2 * _SIDES - 1) @ face > 0 for face in FACES])
    both = on[:, None] & on[None, :]
    return np.asarray((both << np.arange(8)).sum(axis=2), dtype=np.uint8)


def quarter_depths(subvoxels: NDArray[np.bool_], weight: float) -> NDArray[np.float32]:
    """Weighted ray depth (Eq. 8) of each quarter of each face, in each rotation.

    Parameters
    ----------
    subvoxels : (n, s, s, s) bool array
        Material in each cell in shape A, s even.
    weight : float
        Weight of the surface in the energy.

    Returns
    -------
    (n, 24, 6, 4) float32 array
        Of face ``f`` of the cell in B. Quarters are ordered by the side along the two axes of the
        face, the lower axis first. Four quarters add up to the weighted depth of the face.
    """
    count, size = subvoxels.shape[:2]
    half = size // 2
    # By face in A and octant beside it: the quarter of the face that the octant touches.
    depth = np.zeros((count, 6, 8), dtype=np.float32)
    for axis in range(3):
        for sign in range(2):
            rays = np.flip(subvoxels, axis=axis + 1) if sign == 0 else subvoxels
            first = np.where(rays.any(axis=axis + 1), rays.argmax(axis=axis + 1), size) / size
            quarter = first.reshape(count, 2, half, 2, half).mean(axis=(2, 4))
            rest = [a for a in range(3) if a != axis]
            where = 2 * _SIDES[:, rest[0]] + _SIDES[:, rest[1]]
            depth[:, 2 * axis + sign] = quarter.reshape(count, 4)[:, where]
    out = np.empty((count, 24, 6, 4), dtype=np.float32)
    for r in range(len(ROTATIONS)):
        back = np.argsort(_places()[r])  # octant in A of each octant in B
        for f, face in enumerate(FACES):
            inner = np.flatnonzero((2 * _SIDES - 1) @ face > 0)
            # Octants are numbered by x, y, z, so those beside a face are in the wanted order.
            out[:, r, f] = depth[:, FACE_BEFORE[r, f]][:, back[inner]]
    return np.ascontiguousarray(0.25 * weight * out, dtype=np.float32)


def shared_octants(pose: NDArray[np.int32], masks: NDArray[np.uint8]) -> NDArray[np.uint8] | None:
    """The octants that count of each voxel, once it is known which voxels share.

    Parameters
    ----------
    pose : (n,) int32 array
        ``24 * template cell + rotation`` of each voxel.
    masks : (n,) uint8 array
        From :func:`octant_masks`.

    Returns
    -------
    (n,) uint8 array or None
        The mask of each voxel that shares its cell, 255 for the others; None where none shares.
    """
    cell = np.asarray(pose) // 24
    together = np.bincount(cell)[cell] > 1
    if not together.any():
        return None
    return np.where(together, masks, WHOLE).astype(np.uint8)
