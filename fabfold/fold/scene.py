"""Where cells, barrels and link plates are in one lattice state, and what occupies each place.

The kernels ask two things: where a cell is, and who owns a place of the lattice. A scene answers
both. It is made once for a mechanism, filled for a state, and emptied again for the next.
"""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.fold.mechanism import Mechanism
from fabfold.lattice.rotations import ROTATION_PRODUCT, ROTATIONS

__all__ = ["Scene", "clear_scene", "edge_index", "empty_scene", "pose_scene"]

I16 = NDArray[np.int16]
I32 = NDArray[np.int32]


class Scene(NamedTuple):
    """Where everything is in one lattice state; filled by :func:`pose_scene`.

    Coordinates are lattice units, moved by ``Mechanism.reach`` so that none is negative. The
    owner arrays are occupancy grids of ``s = 2 * reach + 1`` cells along a side.

    Attributes
    ----------
    rotation : (b,) int32 array
        Orientation of every body, an index in ROTATIONS.
    shift : (b, 3) int32 array
        Translation of every body: ``cell -> ROTATIONS[rotation] @ cell + shift``, not moved.
    cell : (n, 3) int32 array
        Places of the cells.
    barrel : (m, 4) int32 array
        Unit edges of the hinge barrels: axis, and twice the middle.
    plate : (p, 4) int32 array
        Unit faces of the link plates: axis of the normal, and twice the middle.
    cell_owner : (s * s * s,) int16 array
        1 + body in each cell, 0 where it is empty.
    edge_owner : (3 * s * s * s,) int16 array
        1 + hinge on each lattice edge, 0 where there is none; see :func:`edge_index`.
    face_owner : (3 * s * s * s,) int16 array
        1 + body of the link plate on each lattice face, 0 where there is none; of no size for a
        mechanism without link plates.
    """

    rotation: I32
    shift: I32
    cell: I32
    barrel: I32
    plate: I32
    cell_owner: I16
    edge_owner: I16
    face_owner: I16


@njit(cache=True)
def empty_scene(mech: Mechanism) -> Scene:
    """Make the scene of a mechanism, with empty occupancy grids.

    Parameters
    ----------
    mech : Mechanism
        What the scene has room for.

    Returns
    -------
    Scene
        To be filled by :func:`pose_scene`.
    """
    side = 2 * mech.reach + 1
    return Scene(
        np.zeros(len(mech.up) + 1, np.int32),
        np.zeros((len(mech.up) + 1, 3), np.int32),
        np.zeros((len(mech.cell), 3), np.int32),
        np.zeros((len(mech.barrel), 4), np.int32),
        np.zeros((len(mech.plate), 4), np.int32),
        np.zeros(side * side * side, np.int16),
        np.zeros(3 * side * side * side, np.int16),
        np.zeros(3 * side * side * side if len(mech.plate) > 0 else 0, np.int16),
    )


@njit(cache=True)
def edge_index(side: int, axis: int, x2: int, y2: int, z2: int) -> int:
    """Index of a unit edge in ``Scene.edge_owner``, or of a unit face in ``Scene.face_owner``.

    Parameters
    ----------
    side : int
        Cells along a side of the grid.
    axis : int
        Axis along which the edge runs, or axis of the face's normal.
    x2, y2, z2 : int
        Twice the middle of the edge or face, as in the scene.

    Returns
    -------
    int
        Index in the flat array.
    """
    return ((axis * side + (x2 >> 1)) * side + (y2 >> 1)) * side + (z2 >> 1)


@njit(cache=True)
def clear_scene(mech: Mechanism, scene: Scene) -> None:
    """Empty the occupancy grids, touching only what was filled.

    Parameters
    ----------
    mech : Mechanism
        That of the scene.
    scene : Scene
        In and out: its owner arrays become 0.
    """
    side = 2 * mech.reach + 1
    for v in range(len(scene.cell)):
        x, y, z = scene.cell[v, 0], scene.cell[v, 1], scene.cell[v, 2]
        scene.cell_owner[(x * side + y) * side + z] = 0
    for e in range(len(scene.barrel)):
        row = scene.barrel[e]
        scene.edge_owner[edge_index(side, row[0], row[1], row[2], row[3])] = 0
    for p in range(len(scene.plate)):
        row = scene.plate[p]
        scene.face_owner[edge_index(side, row[0], row[1], row[2], row[3])] = 0


@njit(cache=True)
def _place(scene: Scene, reach: int, body: int, here: I32, there: I32) -> None:
    """Put a unit edge or face of a body where the body is.

    Parameters
    ----------
    scene : Scene
        Its bodies are posed.
    reach : int
        ``Mechanism.reach``.
    body : int
        Body that the edge or face moves with.
    here : (4,) int32 array
        Its axis and twice its middle in A.
    there : (4,) int32 array
        Out: the same in the scene.
    """
    r = scene.rotation[body]
    for i in range(3):
        there[1 + i] = 2 * (scene.shift[body, i] + reach) + (
            ROTATIONS[r, i, 0] * here[1]
            + ROTATIONS[r, i, 1] * here[2]
            + ROTATIONS[r, i, 2] * here[3]
        )
        if ROTATIONS[r, i, here[0]] != 0:
            there[0] = i


@njit(cache=True)
def pose_scene(mech: Mechanism, scene: Scene, q: NDArray[np.int8]) -> bool:
    """Put everything where it is in a lattice state.

    Parameters
    ----------
    mech : Mechanism
        That of the scene.
    scene : Scene
        In and out: its occupancy grids must be empty.
    q : (h,) int8 array
        Steps that each hinge has made.

    Returns
    -------
    bool
        False when two cells coincide, two barrels lie on one lattice edge or two plates on one
        lattice face.
    """
    reach = mech.reach
    side = 2 * reach + 1
    good = True
    scene.rotation[0] = 0
    scene.shift[0, :] = 0
    for k in range(len(mech.up)):
        p = mech.up[k]
        r = scene.rotation[p]
        scene.rotation[k + 1] = ROTATION_PRODUCT[r, mech.turn_rotation[k, q[k]]]
        for i in range(3):
            total = scene.shift[p, i]
            for j in range(3):
                total += ROTATIONS[r, i, j] * mech.turn_shift[k, q[k], j]
            scene.shift[k + 1, i] = total
    for b in range(len(mech.up) + 1):
        r = scene.rotation[b]
        for v in range(mech.first[b], mech.first[b + 1]):
            for i in range(3):
                scene.cell[v, i] = scene.shift[b, i] + reach + (
                    ROTATIONS[r, i, 0] * mech.cell[v, 0]
                    + ROTATIONS[r, i, 1] * mech.cell[v, 1]
                    + ROTATIONS[r, i, 2] * mech.cell[v, 2]
                )  # fmt: skip
            slot = (scene.cell[v, 0] * side + scene.cell[v, 1]) * side + scene.cell[v, 2]
            if scene.cell_owner[slot] != 0:
                good = False
            scene.cell_owner[slot] = b + 1
    for e in range(len(mech.barrel)):
        hinge = mech.barrel[e, 0]
        row = scene.barrel[e]
        _place(scene, reach, hinge + 1, mech.barrel[e, 1:], row)
        slot = edge_index(side, row[0], row[1], row[2], row[3])
        if scene.edge_owner[slot] != 0:
            good = False
        scene.edge_owner[slot] = hinge + 1
    for p in range(len(mech.plate)):
        body = mech.plate[p, 0]
        row = scene.plate[p]
        _place(scene, reach, body, mech.plate[p, 1:], row)
        slot = edge_index(side, row[0], row[1], row[2], row[3])
        if scene.face_owner[slot] != 0:
            good = False
        scene.face_owner[slot] = body + 1
    return good
