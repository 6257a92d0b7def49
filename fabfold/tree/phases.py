"""Phases: which rotations a voxel can have in a cell, once any voxel of its tree stands.

A joint moves a child by a whole number of cells, so its pose modulo 2 follows from the parent's.
The states (source cell modulo 2, template cell modulo 2, rotation) that the joints make of one
another are a *phase*, and all voxels of a tree are in one. Half turns leave 48 phases, and in each
of them a voxel has one rotation in every cell of its colour. Joints that do not keep the colour
leave fewer phases, with more rotations in each.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fabfold.lattice.rotations import FACES, ROTATION_PRODUCT, ROTATIONS
from fabfold.tree.catalogue import Joint

__all__ = ["phase_labels", "phase_of", "phase_rotations"]

#: Cells modulo 2.
_CORNERS = np.array(list(np.ndindex(2, 2, 2)))


def _number(cells: NDArray[np.integer]) -> NDArray[np.int64]:
    """Number of a cell modulo 2, 0 to 7; any shape with 3 last."""
    return np.asarray((cells % 2) @ np.array([4, 2, 1]), dtype=np.int64)


@lru_cache
def phase_labels(joints: Sequence[Sequence[Joint]]) -> NDArray[np.int32]:
    """The phase of every state of a voxel.

    Parameters
    ----------
    joints : tuple of J tuples of 6 Joint
        Joint types by index, one for each face of the parent.

    Returns
    -------
    (8, 8, 24) int32 array
        By source cell modulo 2, template cell modulo 2 (as x, y, z in binary) and rotation. States
        with the same number are those that the joints make of one another; numbers count from 0.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    source, cell, turn = np.meshgrid(np.arange(8), np.arange(8), np.arange(24), indexing="ij")
    state = (source * 8 + cell) * 24 + turn
    ends = []
    for by_face in joints:
        for face, joint in enumerate(by_face):
            there = _number(_CORNERS[source] + FACES[face])
            moved = _CORNERS[cell] + ROTATIONS[turn] @ np.array(joint.offset)
            ends.append((there * 8 + _number(moved)) * 24 + ROTATION_PRODUCT[turn, joint.rotation])
    first = np.concatenate([state.ravel()] * len(ends))
    second = np.concatenate([end.ravel() for end in ends])
    graph = coo_matrix((np.ones(len(first), np.int8), (first, second)), shape=(state.size,) * 2)
    _, label = connected_components(graph, directed=False)
    return np.asarray(label, dtype=np.int32).reshape(state.shape)


def phase_of(
    labels: NDArray[np.int32], source: NDArray[np.int32], cell: NDArray[np.int32], turn: int
) -> int:
    """The phase of a voxel.

    Parameters
    ----------
    labels : (8, 8, 24) int32 array
        From :func:`phase_labels`.
    source : (3,) int array
        Its cell in shape A.
    cell : (3,) int array
        Its cell in the template.
    turn : int
        Its rotation.

    Returns
    -------
    int
        Number of the phase.
    """
    return int(labels[_number(source), _number(cell), turn])


def phase_rotations(
    labels: NDArray[np.int32],
    source: NDArray[np.int32],
    cells: NDArray[np.int32],
    phases: Sequence[int] | None = None,
) -> list[NDArray[np.int8]]:
    """Rotations that each voxel can have in each cell, phase by phase.

    Parameters
    ----------
    labels : (8, 8, 24) int32 array
        From :func:`phase_labels`.
    source : (n, 3) int32 array
        Cell of each voxel in shape A.
    cells : (m, 3) int32 array
        Cells of the template.
    phases : sequence of int, optional
        Numbers of the phases that are wanted; all by default.

    Returns
    -------
    list of (n, m, k) int8 arrays
        For each of these phases the rotations, filled up with -1 at the end; k is the most that
        there are.
    """
    rows, columns = _number(source)[:, None], _number(cells)[None, :]
    listed = _listed(labels.tobytes())
    wanted = range(len(listed)) if phases is None else phases
    return [listed[phase][rows, columns] for phase in wanted]


@lru_cache
def _listed(labels: bytes) -> list[NDArray[np.int8]]:
    """For each phase the rotations by source cell and template cell modulo 2, (8, 8, k).

    Taken as bytes, so that it is remembered: every voxelization that is looked at asks for it.
    """
    phases = np.frombuffer(labels, dtype=np.int32).reshape(8, 8, 24)
    found = []
    for phase in range(int(phases.max()) + 1):
        here = phases == phase
        # Stable, so that the rotations that there are come first, in their order.
        order = np.argsort(~here, axis=2, kind="stable")
        count = here.sum(axis=2)
        most = int(count.max())
        listed = np.where(np.arange(most) < count[:, :, None], order[:, :, :most], -1)
        found.append(listed.astype(np.int8))
    return found
