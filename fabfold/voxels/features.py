"""Which joints the material of the voxels can carry: contacts, hinge edges, ray depths.

References
----------
Zhou, Sueda, Matusik, Shamir: Boxelization, section 3 (connectivity), Eq. 7 and Eq. 8.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fabfold.lattice.rotations import FACES
from fabfold.voxels.offsets import Planes
from fabfold.voxels.voxel_model import SUBDIVISION, Voxels

__all__ = [
    "DOUBLE_CONTACT",
    "HINGE_POSITIONS",
    "HINGE_REACH",
    "RIGID_CONTACT",
    "Features",
    "box_depth",
    "contact_counts",
    "face_pairs",
    "features",
    "largest_pieces",
]

#: Subvoxel contacts (of 400) between the main pieces of two voxels that hold them together as one
#: printed piece: 5 % of the face, 4.5 mm square on a 20 mm voxel.
RIGID_CONTACT = 20
#: Subvoxel contacts (of 400) that leave room for the link plate of a double hinge.
DOUBLE_CONTACT = 60
#: A hinge edge wants material at this many of its 20 positions, on both sides of the face ...
HINGE_POSITIONS = 6
#: ... within this many subvoxels of the edge.
HINGE_REACH = 3
#: Samples along a cell by which its ray depths are judged before it is cut.
_DEPTH_SAMPLES = 10


@dataclass(frozen=True)
class Features:
    """Where the voxels touch, and what joint each contact can hold.

    Attributes
    ----------
    pairs : (m, 2) int32 array
        Voxels ``i < j`` whose cells share a face, sorted; ``cells[j] - cells[i]`` is +x, +y or +z.
    rigid : (m,) bool array
        The main pieces of both voxels touch enough (`RIGID_CONTACT`) to be one printed piece.
    hinge : (m, 4) bool array
        Which edges of the shared face can hold a printed single hinge. An edge is named by its
        outward direction in the face, in the order of
        :data:`fabfold.lattice.rotations.FACES` without the two directions of the face's normal.
    double : (m,) bool array
        The contact leaves room for a double hinge (`DOUBLE_CONTACT`).
    depth : (n, 6) float64 array
        Mean depth to the first material of rays shot into the voxel from each face, in the order of
        :data:`fabfold.lattice.rotations.FACES`; 0 is a full face, 1 an empty voxel (Eq. 8).
    """

    pairs: NDArray[np.int32]
    rigid: NDArray[np.bool_]
    hinge: NDArray[np.bool_]
    double: NDArray[np.bool_]
    depth: NDArray[np.float64]


def largest_pieces(subvoxels: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The largest piece of material in each cell, joined through faces of subvoxels.

    Parameters
    ----------
    subvoxels : (n, s, s, s) bool array
        Material in each cell.

    Returns
    -------
    (n, s, s, s) bool array
        Subvoxels of the largest piece of each cell (of the first of several equal ones).
    """
    from scipy import ndimage

    structure = np.zeros((3, 3, 3, 3), dtype=bool)
    structure[1, :, 1, 1] = structure[1, 1, :, 1] = structure[1, 1, 1, :] = True
    structure[:, 1, 1, 1] = [False, True, False]
    labels, count = ndimage.label(subvoxels, structure=structure, output=np.int32)
    sizes = np.bincount(labels.ravel(), minlength=count + 1)
    owner = np.zeros(count + 1, dtype=np.int64)
    where = np.nonzero(labels)
    owner[labels[where]] = where[0]
    best = np.zeros(len(subvoxels), dtype=np.int64)
    # Written from the smallest to the largest, so the largest (and of equals the first) stays.
    order = np.lexsort((-np.arange(1, count + 1), sizes[1:])) + 1
    best[owner[order]] = order
    return np.asarray((labels == best[:, None, None, None]) & (labels > 0))


def face_pairs(cells: NDArray[np.int32]) -> NDArray[np.int32]:
    """Pairs of cells that share a face.

    Parameters
    ----------
    cells : (n, 3) int32 array
        Lattice coordinates, sorted lexicographically, no two the same.

    Returns
    -------
    (m, 2) int32 array
        Indices ``i < j`` into `cells`, sorted.
    """
    low = cells.min(axis=0)
    shape = cells.max(axis=0) - low + 2
    index = np.full(shape, -1, dtype=np.int32)
    index[tuple((cells - low).T)] = np.arange(len(cells))
    found = []
    for step in FACES[::2]:
        other = index[tuple((cells - low + step).T)]
        here = np.flatnonzero(other >= 0)
        found.append(np.column_stack([here, other[here]]))
    pairs = np.concatenate(found)
    return np.asarray(pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))], dtype=np.int32)


def _axes(cells: NDArray[np.int32], pairs: NDArray[np.int32]) -> NDArray[np.int64]:
    return np.asarray(np.argmax(cells[pairs[:, 1]] - cells[pairs[:, 0]], axis=1))


def contact_counts(
    cells: NDArray[np.int32], pairs: NDArray[np.int32], material: NDArray[np.bool_]
) -> NDArray[np.int32]:
    """Pairs of subvoxels with material on both sides of the face that two cells share.

    Parameters
    ----------
    cells : (n, 3) int32 array
        Lattice coordinates.
    pairs : (m, 2) int32 array
        From :func:`face_pairs`.
    material : (n, s, s, s) bool array
        Material in each cell: all of it, or only the largest piece.

    Returns
    -------
    (m,) int32 array
        For each pair of cells, 0 to s².
    """
    contact = np.zeros(len(pairs), dtype=np.int32)
    axes = _axes(cells, pairs)
    for axis in range(3):
        these = np.flatnonzero(axes == axis)
        first = np.take(material[pairs[these, 0]], -1, axis=axis + 1)
        second = np.take(material[pairs[these, 1]], 0, axis=axis + 1)
        contact[these] = (first & second).sum(axis=(1, 2))
    return contact


def _edge_runs(material: NDArray[np.bool_], axis: int, side: int, across: int, end: int) -> object:
    """Positions along an edge with material near it, for cells (n, s, s, s)."""
    reach = slice(-HINGE_REACH, None), slice(0, HINGE_REACH)
    window: list[slice] = [slice(None)] * 4
    window[axis + 1] = reach[side]
    window[across + 1] = reach[end]
    return material[tuple(window)].any(axis=(axis + 1, across + 1))


def _hinge_edges(
    cells: NDArray[np.int32], pairs: NDArray[np.int32], material: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    hinge = np.zeros((len(pairs), 4), dtype=bool)
    axes = _axes(cells, pairs)
    for axis in range(3):
        these = np.flatnonzero(axes == axis)
        slot = 0
        for across in range(3):
            if across == axis:
                continue
            for end in (0, 1):  # +, then -
                first = _edge_runs(material[pairs[these, 0]], axis, 0, across, end)
                second = _edge_runs(material[pairs[these, 1]], axis, 1, across, end)
                both = np.asarray(first) & np.asarray(second)
                hinge[these, slot] = both.sum(axis=1) >= HINGE_POSITIONS
                slot += 1
    return hinge


def _ray_depth(subvoxels: NDArray[np.bool_]) -> NDArray[np.float64]:
    depth = np.empty((len(subvoxels), 6))
    side = subvoxels.shape[1]
    for axis in range(3):
        hit = subvoxels.any(axis=axis + 1)
        for sign in range(2):
            rays = np.flip(subvoxels, axis=axis + 1) if sign == 0 else subvoxels
            first = np.where(hit, rays.argmax(axis=axis + 1), side)
            depth[:, 2 * axis + sign] = first.mean(axis=(1, 2)) / side
    return depth


def box_depth(
    inside: NDArray[np.bool_], planes: Planes, cells: NDArray[np.integer]
) -> NDArray[np.float64]:
    """Ray depths of cells that are boxes between moved planes, before anything is cut.

    Parameters
    ----------
    inside : (x, y, z) bool array
        Material of the model, by subvoxel; there is none outside.
    planes : three int64 arrays
        Ascending plane positions, in subvoxels.
    cells : (n, 3) int array
        Between which planes each cell lies.

    Returns
    -------
    (n, 6) float64 array
        As `Features.depth`, up to the distance of the samples.
    """
    share = (np.arange(_DEPTH_SAMPLES) + 0.5) / _DEPTH_SAMPLES
    at = []
    material = np.ones((len(cells), 1, 1, 1), dtype=bool)
    for axis in range(3):
        low = planes[axis][cells[:, axis]]
        width = planes[axis][cells[:, axis] + 1] - low
        sample = np.floor(low[:, None] + width[:, None] * share).astype(np.int64)
        line = [len(cells), 1, 1, 1]
        line[axis + 1] = _DEPTH_SAMPLES
        material = material & ((sample >= 0) & (sample < inside.shape[axis])).reshape(line)
        at.append(np.clip(sample, 0, inside.shape[axis] - 1).reshape(line))
    return _ray_depth(material & inside[at[0], at[1], at[2]])


def features(voxels: Voxels) -> Features:
    """Find the contacts of the voxels and which joints they can carry.

    Parameters
    ----------
    voxels : Voxels
        Cells and their material.

    Returns
    -------
    Features
        `rigid`, `hinge` and `double` look at the largest piece of each voxel only: a hinge on a
        crumb, or a wall that touches the second leg in a cell, holds nothing. Where the voxels ask
        for bosses, each edge of a face with a rigid contact can hold a hinge.
    """
    if voxels.subvoxels.shape[1:] != (SUBDIVISION,) * 3:
        raise ValueError(f"subvoxels must be (n, 20, 20, 20), not {voxels.subvoxels.shape}")
    main = largest_pieces(voxels.subvoxels)
    pairs = face_pairs(voxels.cells)
    held = contact_counts(voxels.cells, pairs, main)
    hinge = _hinge_edges(voxels.cells, pairs, main)
    if voxels.bosses:
        hinge |= (held >= RIGID_CONTACT)[:, None]
    return Features(
        pairs=pairs,
        rigid=held >= RIGID_CONTACT,
        hinge=hinge,
        double=held >= DOUBLE_CONTACT,
        depth=_ray_depth(voxels.subvoxels),
    )
