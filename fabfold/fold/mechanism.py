"""A hinge system made ready for the kernels, and where its cells are in a lattice state.

The bodies are renumbered: the tree is hung on its middle body, so that the smaller side of every
hinge is the one that moves, and bodies are numbered depth first, so that what hinge ``k`` moves is
the run of bodies ``k + 1`` to ``end[k] - 1``, and their cells are one run as well.

A *lattice state* is a vector ``q`` of steps: hinge ``k`` has made ``q[k]`` of its ``steps[k]``
quarter turns. All zeros is shape A, ``steps`` is shape B.
"""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.lattice.rotations import ROTATION_PRODUCT, ROTATIONS, rotation_about, rotation_index
from fabfold.tree.system import HingeSystem

__all__ = ["Mechanism", "Scene", "clear_scene", "mechanism", "pose_scene", "scene"]

I32 = NDArray[np.int32]

#: Index in ROTATIONS of q quarter turns about the positive axis, shape (3, 4).
QUARTERS: I32 = np.array(
    [
        [rotation_index(rotation_about(np.zeros(3), axis, 90.0 * q)[:3, :3]) for q in range(4)]
        for axis in np.eye(3)
    ],
    dtype=np.int32,
)


class Mechanism(NamedTuple):
    """A hinge system hung on its middle body, bodies numbered depth first.

    Attributes
    ----------
    cell : (n, 3) int32 array
        Source cells, in the order of their bodies.
    first : (b + 1,) int32 array
        Body ``i`` has the cells ``first[i]`` to ``first[i + 1] - 1``.
    up : (h,) int32 array
        Body that hinge ``k`` turns against; it carries body ``k + 1``.
    end : (h,) int32 array
        Hinge ``k`` moves the bodies ``k + 1`` to ``end[k] - 1``.
    axis : (h,) int32 array
        0, 1 or 2.
    pivot : (h, 3) int32 array
        Twice the middle of the hinge's lattice edge in A.
    sign : (h,) int32 array
        +1 or -1: sense of one step about the positive axis, of the side that moves here.
    steps : (h,) int32 array
        Quarter turns from A to B.
    turn_rotation : (h, 4) int32 array
        Index in ROTATIONS of the turn by 0 to 3 steps.
    turn_shift : (h, 4, 3) int32 array
        Its translation.
    barrel : (m, 5) int32 array
        Unit lattice edges that carry hinges: hinge, axis, and twice the middle in A.
    plate : (m, 5) int32 array
        Unit lattice faces that are link plates: body, axis of the normal, and twice the middle.
    origin : (h,) int32 array
        Which hinge of the system this is.
    body : (b,) int32 array
        Which body of the system this is.
    reach : int
        No cell ever comes further than this from the origin of the middle body's frame.
    span : int
        No cell or barrel that a hinge moves is ever further than this from the hinge.
    """

    cell: I32
    first: I32
    up: I32
    end: I32
    axis: I32
    pivot: I32
    sign: I32
    steps: I32
    turn_rotation: I32
    turn_shift: NDArray[np.int32]
    barrel: I32
    plate: I32
    origin: I32
    body: I32
    reach: int
    span: int


@njit(cache=True)
def _plate(first, axis1, second, axis2, middle):  # type: ignore[no-untyped-def]
    """Axis of the normal of the face with two given edges, -1 where there is none."""
    side = 2 if first[axis1] % 2 == 0 else 4
    middle[:] = first
    if axis1 == axis2:
        other = -1
        for i in range(3):
            if first[i] != second[i]:
                if other >= 0 or i == axis1 or abs(first[i] - second[i]) != side:
                    return -1
                other = i
        if other < 0:
            return -1
        middle[other] = (first[other] + second[other]) // 2
        return 3 - axis1 - other
    normal = 3 - axis1 - axis2
    if (
        first[normal] != second[normal]
        or 2 * abs(first[axis1] - second[axis1]) != side
        or 2 * abs(first[axis2] - second[axis2]) != side
    ):
        return -1
    middle[axis2] = second[axis2]
    return normal


@njit(cache=True)
def _prepare(  # type: ignore[no-untyped-def]  # noqa: PLR0912, PLR0915 - one straight pass
    cells, body, parent, point2, axis, turns
):
    hinges = len(parent)
    bodies = hinges + 1
    # The middle body: no side of it holds more than half of the cells.
    weight = np.zeros(bodies, np.int32)
    for i in body:
        weight[i] += 1
    total = len(cells)
    below = weight.copy()
    for h in range(hinges - 1, -1, -1):
        below[parent[h]] += below[h + 1]
    middle = 0
    going = True
    while going:
        going = False
        for h in range(hinges):
            if parent[h] == middle and 2 * below[h + 1] > total:
                middle = h + 1
                going = True
                break

    # Depth first from the middle body.
    order = np.zeros(bodies, np.int32)
    number = np.full(bodies, -1, np.int32)
    by = np.full(bodies, -1, np.int32)  # hinge that carries the body, in the system's numbers
    stack = np.zeros(bodies, np.int32)
    came = np.full(bodies, -1, np.int32)
    stack[0] = middle
    depth = 1
    count = 0
    while depth > 0:
        depth -= 1
        b = stack[depth]
        order[count] = b
        number[b] = count
        count += 1
        for h in range(hinges - 1, -1, -1):
            other = -1
            if parent[h] == b:
                other = h + 1
            elif h + 1 == b:
                other = parent[h]
            if other >= 0 and other != came[b]:
                came[other] = b
                by[other] = h
                stack[depth] = other
                depth += 1

    first = np.zeros(bodies + 1, np.int32)
    for i in range(bodies):
        first[i + 1] = first[i] + weight[order[i]]
    cell = np.zeros((total, 3), np.int32)
    fill = first.copy()
    for v in range(total):
        i = number[body[v]]
        cell[fill[i]] = cells[v]
        fill[i] += 1

    up = np.zeros(hinges, np.int32)
    end = np.zeros(hinges, np.int32)
    ax = np.zeros(hinges, np.int32)
    pivot = np.zeros((hinges, 3), np.int32)
    sign = np.zeros(hinges, np.int32)
    steps = np.zeros(hinges, np.int32)
    origin = np.zeros(hinges, np.int32)
    rotation = np.zeros((hinges, 4), np.int32)
    shift = np.zeros((hinges, 4, 3), np.int32)
    last = np.arange(1, bodies + 1).astype(np.int32)
    for k in range(hinges - 1, -1, -1):
        h = by[order[k + 1]]
        origin[k] = h
        up[k] = number[came[order[k + 1]]]
        last[up[k]] = max(last[up[k]], last[k + 1])
        end[k] = last[k + 1]
        ax[k] = axis[h]
        pivot[k] = point2[h]
        steps[k] = abs(turns[h])
        sign[k] = 1 if turns[h] >= 0 else -1
        if h + 1 != order[k + 1]:
            sign[k] = -sign[k]  # seen from the child, the parent turns the other way
        for s in range(4):
            rotation[k, s] = QUARTERS[ax[k], (sign[k] * s) % 4]
            matrix = ROTATIONS[rotation[k, s]]
            for i in range(3):
                moved = 0
                for j in range(3):
                    moved += matrix[i, j] * pivot[k, j]
                shift[k, s, i] = (pivot[k, i] - moved) // 2

    # How far anything can come, along the chain of hinges.
    far = np.zeros(hinges, np.float64)
    reach = 0.0
    for i in range(bodies):
        for v in range(first[i], first[i + 1]):
            length = 0.0
            for a in range(3):
                if i == 0:
                    length += float(cell[v, a]) ** 2
                else:
                    length += (cell[v, a] - 0.5 * pivot[i - 1, a]) ** 2
            reach = max(reach, np.sqrt(length) + (far[i - 1] if i > 0 else 0.0))
        for k in range(hinges):
            if up[k] == i:
                length = 0.0
                for a in range(3):
                    if i == 0:
                        length += (0.5 * pivot[k, a]) ** 2
                    else:
                        length += (0.5 * (pivot[k, a] - pivot[i - 1, a])) ** 2
                far[k] = np.sqrt(length) + (far[i - 1] if i > 0 else 0.0)
                reach = max(reach, far[k])

    span = 0.0
    down = np.zeros(hinges, np.float64)
    for k in range(hinges - 1, -1, -1):
        for v in range(first[k + 1], first[k + 2]):
            length = 0.0
            for a in range(3):
                length += (cell[v, a] - 0.5 * pivot[k, a]) ** 2
            down[k] = max(down[k], np.sqrt(length))
        for j in range(k + 1, hinges):
            if up[j] == k + 1:
                length = 0.0
                for a in range(3):
                    length += (0.5 * (pivot[k, a] - pivot[j, a])) ** 2
                down[k] = max(down[k], np.sqrt(length) + down[j])
        span = max(span, down[k])

    # A hinge covers one lattice edge, or two halves of one on a finer lattice.
    edges = 0
    for k in range(hinges):
        edges += 1 if pivot[k, ax[k]] % 2 == 0 else 2
    barrel = np.zeros((edges, 5), np.int32)
    edges = 0
    for k in range(hinges):
        whole = pivot[k, ax[k]] % 2 == 0
        for half in range(1 if whole else 2):
            barrel[edges, 0] = k
            barrel[edges, 1] = ax[k]
            barrel[edges, 2:] = pivot[k]
            if not whole:
                barrel[edges, 2 + ax[k]] += 2 * half - 1
            edges += 1

    # A body without cells between two hinges on edges of one face is a link plate.
    plate = np.zeros((4 * bodies, 5), np.int32)
    faces = 0
    middle_of = np.zeros(3, np.int32)
    for h in range(hinges):
        if weight[h + 1] > 0:
            continue
        child = -1
        more = False
        for g in range(h + 1, hinges):
            if parent[g] == h + 1:
                more = child >= 0
                child = g
        if child < 0 or more:
            continue
        normal = _plate(point2[h], axis[h], point2[child], axis[child], middle_of)
        if normal < 0:
            continue
        whole = point2[h, axis[h]] % 2 == 0
        for part in range(1 if whole else 4):
            plate[faces, 0] = number[h + 1]
            plate[faces, 1] = normal
            plate[faces, 2:] = middle_of
            if not whole:
                plate[faces, 2 + (normal + 1) % 3] += 2 * (part % 2) - 1
                plate[faces, 2 + (normal + 2) % 3] += 2 * (part // 2) - 1
            faces += 1
    plate = plate[:faces].copy()
    bodies_of = order
    return (
        cell, first, up, end, ax, pivot, sign, steps, rotation, shift, barrel, plate, origin,
        bodies_of, int(np.ceil(reach)) + 3, int(np.ceil(span)) + 2,
    )  # fmt: skip


def mechanism(system: HingeSystem) -> Mechanism:
    """Make a hinge system ready for the kernels.

    Raises
    ------
    ValueError
        If a hinge is not on a lattice edge, turns by more than 270° or hangs on a later body.
    """
    hinges = len(system.parent)
    point2 = np.asarray(system.point2, dtype=np.int32).reshape(hinges, 3)
    axis = np.asarray(system.axis, dtype=np.int32)
    across = (np.arange(3) != axis[:, None]) if hinges else np.zeros((0, 3), dtype=bool)
    if (point2[across] % 2 == 0).any():
        bad = int(np.flatnonzero(((point2 % 2 == 0) & across).any(axis=1))[0])
        raise ValueError(f"hinge {bad}: its axis does not lie on a lattice edge")
    if (np.abs(np.asarray(system.turns, dtype=int)) > 3).any():
        raise ValueError("a hinge turns by more than 270°")
    parent = np.asarray(system.parent, dtype=np.int32)
    if (parent > np.arange(hinges)).any() or (parent < 0).any():
        raise ValueError("bodies are out of order: a hinge's parent must come before its child")
    cells = np.asarray(system.cells, dtype=np.int32).reshape(-1, 3)
    # The middle of A at the origin keeps the grids small.
    middle = (cells.min(axis=0) + cells.max(axis=0)) // 2 if len(cells) else np.zeros(3, np.int32)
    return Mechanism(
        *_prepare(
            np.ascontiguousarray(cells - middle, dtype=np.int32),
            np.ascontiguousarray(system.body, dtype=np.int32),
            parent,
            np.ascontiguousarray(point2 - 2 * middle, dtype=np.int32),
            axis,
            np.asarray(system.turns, dtype=np.int32),
        )
    )


class Scene(NamedTuple):
    """Where everything is in one lattice state; filled by :func:`pose_scene`.

    Attributes
    ----------
    rotation : (b,) int32 array
    shift : (b, 3) int32 array
        Pose of every body: ``cell -> ROTATIONS[rotation] @ cell + shift``.
    world : (n, 3) int32 array
        Cells, moved by the reach so that no coordinate is negative.
    edge : (m, 4) int32 array
        Unit edges of the barrels: axis and twice the middle, moved likewise.
    grid : (s * s * s,) int16 array
        1 + body of the cell, 0 where empty.
    edges : (3 * s * s * s,) int16 array
        1 + hinge of the lattice edge that begins at each corner, by axis; 0 where there is none.
    face : (m, 4) int32 array
        Unit faces of the plates: axis of the normal and twice the middle, moved likewise.
    faces : (3 * s * s * s,) int16 array
        1 + body of the plate on each lattice face, as `edges`; of no size where there is none.
    """

    rotation: I32
    shift: I32
    world: I32
    edge: I32
    grid: NDArray[np.int16]
    edges: NDArray[np.int16]
    face: I32
    faces: NDArray[np.int16]


@njit(cache=True)
def scene(mech: Mechanism) -> Scene:
    """Empty scene for a mechanism."""
    side = 2 * mech.reach + 1
    return Scene(
        np.zeros(len(mech.up) + 1, np.int32),
        np.zeros((len(mech.up) + 1, 3), np.int32),
        np.zeros((len(mech.cell), 3), np.int32),
        np.zeros((len(mech.barrel), 4), np.int32),
        np.zeros(side * side * side, np.int16),
        np.zeros(3 * side * side * side, np.int16),
        np.zeros((len(mech.plate), 4), np.int32),
        np.zeros(3 * side * side * side if len(mech.plate) > 0 else 0, np.int16),
    )


@njit(cache=True)
def edge_slot(side: int, axis: int, x2: int, y2: int, z2: int) -> int:
    """Index in ``Scene.edges`` of the unit edge along `axis` with the given doubled middle.

    The same for ``Scene.faces``, with the axis of the face's normal.
    """
    return ((axis * side + (x2 >> 1)) * side + (y2 >> 1)) * side + (z2 >> 1)


@njit(cache=True)
def clear_scene(mech: Mechanism, at: Scene) -> None:
    """Empty the grids again, touching only what was filled."""
    side = 2 * mech.reach + 1
    for v in range(len(at.world)):
        at.grid[(at.world[v, 0] * side + at.world[v, 1]) * side + at.world[v, 2]] = 0
    for e in range(len(at.edge)):
        at.edges[edge_slot(side, at.edge[e, 0], at.edge[e, 1], at.edge[e, 2], at.edge[e, 3])] = 0
    for p in range(len(at.face)):
        at.faces[edge_slot(side, at.face[p, 0], at.face[p, 1], at.face[p, 2], at.face[p, 3])] = 0


@njit(cache=True)
def pose_scene(mech: Mechanism, at: Scene, q: NDArray[np.int8]) -> bool:
    """Put everything where it is in state `q`; the grids must be empty.

    Returns
    -------
    bool
        False when two cells coincide, two barrels lie on one lattice edge or two plates on one
        lattice face.
    """
    reach = mech.reach
    side = 2 * reach + 1
    good = True
    at.rotation[0] = 0
    at.shift[0, :] = 0
    for k in range(len(mech.up)):
        p = mech.up[k]
        r = at.rotation[p]
        at.rotation[k + 1] = ROTATION_PRODUCT[r, mech.turn_rotation[k, q[k]]]
        for i in range(3):
            total = at.shift[p, i]
            for j in range(3):
                total += ROTATIONS[r, i, j] * mech.turn_shift[k, q[k], j]
            at.shift[k + 1, i] = total
    for b in range(len(mech.up) + 1):
        r = at.rotation[b]
        for v in range(mech.first[b], mech.first[b + 1]):
            for i in range(3):
                at.world[v, i] = at.shift[b, i] + reach + (
                    ROTATIONS[r, i, 0] * mech.cell[v, 0]
                    + ROTATIONS[r, i, 1] * mech.cell[v, 1]
                    + ROTATIONS[r, i, 2] * mech.cell[v, 2]
                )  # fmt: skip
            slot = (at.world[v, 0] * side + at.world[v, 1]) * side + at.world[v, 2]
            if at.grid[slot] != 0:
                good = False
            at.grid[slot] = b + 1
    for e in range(len(mech.barrel)):
        k = mech.barrel[e, 0]
        b = k + 1
        r = at.rotation[b]
        for i in range(3):
            at.edge[e, 1 + i] = 2 * (at.shift[b, i] + reach) + (
                ROTATIONS[r, i, 0] * mech.barrel[e, 2]
                + ROTATIONS[r, i, 1] * mech.barrel[e, 3]
                + ROTATIONS[r, i, 2] * mech.barrel[e, 4]
            )
            if ROTATIONS[r, i, mech.barrel[e, 1]] != 0:
                at.edge[e, 0] = i
        slot = edge_slot(side, at.edge[e, 0], at.edge[e, 1], at.edge[e, 2], at.edge[e, 3])
        if at.edges[slot] != 0:
            good = False
        at.edges[slot] = k + 1
    for p in range(len(mech.plate)):
        b = mech.plate[p, 0]
        r = at.rotation[b]
        for i in range(3):
            at.face[p, 1 + i] = 2 * (at.shift[b, i] + reach) + (
                ROTATIONS[r, i, 0] * mech.plate[p, 2]
                + ROTATIONS[r, i, 1] * mech.plate[p, 3]
                + ROTATIONS[r, i, 2] * mech.plate[p, 4]
            )
            if ROTATIONS[r, i, mech.plate[p, 1]] != 0:
                at.face[p, 0] = i
        slot = edge_slot(side, at.face[p, 0], at.face[p, 1], at.face[p, 2], at.face[p, 3])
        if at.faces[slot] != 0:
            good = False
        at.faces[slot] = b + 1
    return good
