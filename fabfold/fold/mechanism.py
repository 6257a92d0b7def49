"""A hinge system made ready for the search kernels.

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

from fabfold.fold.link_plates import link_plates
from fabfold.lattice.rotations import ROTATIONS, rotation_about, rotation_index
from fabfold.tree.system import HingeSystem

__all__ = ["Mechanism", "mechanism"]

I32 = NDArray[np.int32]
F64 = NDArray[np.float64]

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

    All lengths are in lattice units: a voxel's side is 1.

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
        Lattice axis along which the hinge's edge runs in A: 0, 1 or 2.
    pivot : (h, 3) int32 array
        Twice the middle of the hinge's lattice edge in A.
    sign : (h,) int32 array
        +1 or -1: sense of one step about the positive axis, of the side that moves here.
    steps : (h,) int32 array
        Quarter turns from A to B, at most 3.
    turn_rotation : (h, 4) int32 array
        Index in ROTATIONS of the turn by 0 to 3 steps.
    turn_shift : (h, 4, 3) int32 array
        Translation of that turn, which is about the hinge's axis and not about the origin.
    barrel : (m, 5) int32 array
        Unit lattice edges that carry hinges: hinge, axis, and twice the middle in A.
    plate : (p, 5) int32 array
        Unit lattice faces that are link plates: body, axis of the normal, and twice the middle.
    origin : (h,) int32 array
        Hinge of the system that this hinge is.
    body : (b,) int32 array
        Body of the system that this body is.
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
    turn_shift: I32
    barrel: I32
    plate: I32
    origin: I32
    body: I32
    reach: int
    span: int


@njit(cache=True)
def _middle_body(weight: I32, parent: I32, total: int) -> int:
    """Body of which no side holds more than half of all cells.

    Parameters
    ----------
    weight : (b,) int32 array
        Number of cells of each body.
    parent : (h,) int32 array
        Body that each hinge of the system turns against.
    total : int
        Number of all cells.

    Returns
    -------
    int
        Body, in the system's numbers.
    """
    hinges = len(parent)
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
    return middle


@njit(cache=True)
def _depth_first(parent: I32, root: int) -> tuple[I32, I32, I32]:
    """Number the bodies depth first from a root.

    Parameters
    ----------
    parent : (h,) int32 array
        Body that each hinge of the system turns against.
    root : int
        Body of the system to begin at.

    Returns
    -------
    order : (b,) int32 array
        Bodies of the system in their new order.
    hung_on : (b,) int32 array
        Body that each body of the system hangs on now; -1 for the root.
    hung_by : (b,) int32 array
        Hinge of the system that carries each body now; -1 for the root.
    """
    hinges = len(parent)
    bodies = hinges + 1
    order = np.zeros(bodies, np.int32)
    hung_on = np.full(bodies, -1, np.int32)
    hung_by = np.full(bodies, -1, np.int32)
    stack = np.zeros(bodies, np.int32)
    stack[0] = root
    depth = 1
    count = 0
    while depth > 0:
        depth -= 1
        b = stack[depth]
        order[count] = b
        count += 1
        for h in range(hinges - 1, -1, -1):
            other = -1
            if parent[h] == b:
                other = h + 1
            elif h + 1 == b:
                other = parent[h]
            if other >= 0 and other != hung_on[b]:
                hung_on[other] = b
                hung_by[other] = h
                stack[depth] = other
                depth += 1
    return order, hung_on, hung_by


@njit(cache=True)
def _cells_by_body(cells: I32, body: I32, weight: I32, order: I32, number: I32) -> tuple[I32, I32]:
    """Sort the cells by the new numbers of their bodies.

    Parameters
    ----------
    cells : (n, 3) int32 array
        Cells in A.
    body : (n,) int32 array
        Body of each cell, in the system's numbers.
    weight : (b,) int32 array
        Number of cells of each body of the system.
    order : (b,) int32 array
        Bodies of the system in their new order.
    number : (b,) int32 array
        New number of each body of the system.

    Returns
    -------
    cell, first
        As in :class:`Mechanism`.
    """
    first = np.zeros(len(order) + 1, np.int32)
    for i in range(len(order)):
        first[i + 1] = first[i] + weight[order[i]]
    cell = np.zeros((len(cells), 3), np.int32)
    fill = first.copy()
    for v in range(len(cells)):
        i = number[body[v]]
        cell[fill[i]] = cells[v]
        fill[i] += 1
    return cell, first


@njit(cache=True)
def _turns_of(axis: I32, pivot: I32, sign: I32) -> tuple[I32, I32]:
    """Rotation and translation of 0 to 3 steps of every hinge.

    Parameters
    ----------
    axis, pivot, sign
        As in :class:`Mechanism`.

    Returns
    -------
    turn_rotation, turn_shift
        As in :class:`Mechanism`.
    """
    hinges = len(axis)
    rotation = np.zeros((hinges, 4), np.int32)
    shift = np.zeros((hinges, 4, 3), np.int32)
    for k in range(hinges):
        for s in range(4):
            rotation[k, s] = QUARTERS[axis[k], (sign[k] * s) % 4]
            matrix = ROTATIONS[rotation[k, s]]
            for i in range(3):
                moved = 0
                for j in range(3):
                    moved += matrix[i, j] * pivot[k, j]
                shift[k, s, i] = (pivot[k, i] - moved) // 2
    return rotation, shift


@njit(cache=True)
def _from_hinge(cell: I32, pivot: I32) -> float:
    """Distance of a cell's centre from the middle of a hinge's edge; both (3,), `pivot` doubled."""
    square = 0.0
    for a in range(3):
        square += (cell[a] - 0.5 * pivot[a]) ** 2
    return np.sqrt(square)


@njit(cache=True)
def _between_hinges(one: I32, two: I32) -> float:
    """Distance of the middles of two hinges' edges, both (3,) and doubled."""
    square = 0.0
    for a in range(3):
        square += (0.5 * (one[a] - two[a])) ** 2
    return np.sqrt(square)


@njit(cache=True)
def _reach(cell: I32, first: I32, up: I32, pivot: I32) -> float:
    """How far anything can come from the origin: the chain of hinges, pulled straight.

    Parameters
    ----------
    cell, first, up, pivot
        As in :class:`Mechanism`.

    Returns
    -------
    float
        Bound of the distance of any cell's centre or hinge, in any state.
    """
    hinges = len(up)
    origin = np.zeros(3, np.int32)
    far = np.zeros(hinges, np.float64)
    reach = 0.0
    for i in range(hinges + 1):
        near = origin if i == 0 else pivot[i - 1]
        so_far = 0.0 if i == 0 else far[i - 1]
        for v in range(first[i], first[i + 1]):
            reach = max(reach, _from_hinge(cell[v], near) + so_far)
        for k in range(hinges):
            if up[k] == i:
                far[k] = _between_hinges(pivot[k], near) + so_far
                reach = max(reach, far[k])
    return reach


@njit(cache=True)
def _span(cell: I32, first: I32, up: I32, pivot: I32) -> float:
    """How far anything that a hinge moves can come from that hinge.

    Parameters
    ----------
    cell, first, up, pivot
        As in :class:`Mechanism`.

    Returns
    -------
    float
        The greatest such bound of all hinges.
    """
    hinges = len(up)
    span = 0.0
    down = np.zeros(hinges, np.float64)
    for k in range(hinges - 1, -1, -1):
        for v in range(first[k + 1], first[k + 2]):
            down[k] = max(down[k], _from_hinge(cell[v], pivot[k]))
        for j in range(k + 1, hinges):
            if up[j] == k + 1:
                down[k] = max(down[k], _between_hinges(pivot[k], pivot[j]) + down[j])
        span = max(span, down[k])
    return span


@njit(cache=True)
def _barrels_of(axis: I32, pivot: I32) -> I32:
    """Unit edges of the hinges: one each, or two halves of one on a lattice of half cells.

    Parameters
    ----------
    axis, pivot
        As in :class:`Mechanism`.

    Returns
    -------
    (m, 5) int32 array
        ``Mechanism.barrel``.
    """
    hinges = len(axis)
    edges = 0
    for k in range(hinges):
        edges += 1 if pivot[k, axis[k]] % 2 == 0 else 2
    barrel = np.zeros((edges, 5), np.int32)
    edges = 0
    for k in range(hinges):
        whole = pivot[k, axis[k]] % 2 == 0
        for half in range(1 if whole else 2):
            barrel[edges, 0] = k
            barrel[edges, 1] = axis[k]
            barrel[edges, 2:] = pivot[k]
            if not whole:
                barrel[edges, 2 + axis[k]] += 2 * half - 1
            edges += 1
    return barrel


@njit(cache=True)
def _hung_on_its_middle(
    cells: I32, body: I32, parent: I32, point2: I32, axis: I32, turns: I32
) -> Mechanism:
    """Mechanism of a system, moved so that A is about the origin: that keeps the grids small.

    Parameters
    ----------
    cells, body, parent, point2, axis, turns
        As in :class:`fabfold.tree.system.HingeSystem`, all int32.

    Returns
    -------
    Mechanism
        Ready for the kernels.
    """
    hinges = len(parent)
    middle = np.zeros(3, np.int32)
    for i in range(3 if len(cells) > 0 else 0):
        middle[i] = (cells[:, i].min() + cells[:, i].max()) // 2
    cells, point2 = cells - middle, point2 - (middle + middle)
    weight = np.zeros(hinges + 1, np.int32)
    for i in body:
        weight[i] += 1
    order, hung_on, hung_by = _depth_first(parent, _middle_body(weight, parent, len(cells)))
    number = np.zeros(hinges + 1, np.int32)
    for i in range(hinges + 1):
        number[order[i]] = i
    cell, first = _cells_by_body(cells, body, weight, order, number)

    origin = np.zeros(hinges, np.int32)
    up = np.zeros(hinges, np.int32)
    end = np.zeros(hinges, np.int32)
    own_axis = np.zeros(hinges, np.int32)
    pivot = np.zeros((hinges, 3), np.int32)
    sign = np.zeros(hinges, np.int32)
    steps = np.zeros(hinges, np.int32)
    last = np.arange(1, hinges + 2).astype(np.int32)
    for k in range(hinges - 1, -1, -1):
        b = order[k + 1]
        h = hung_by[b]
        origin[k] = h
        up[k] = number[hung_on[b]]
        last[up[k]] = max(last[up[k]], last[k + 1])
        end[k] = last[k + 1]
        own_axis[k] = axis[h]
        pivot[k] = point2[h]
        steps[k] = abs(turns[h])
        sign[k] = 1 if turns[h] >= 0 else -1
        if h + 1 != b:
            sign[k] = -sign[k]  # seen from the child, the parent turns the other way
    rotation, shift = _turns_of(own_axis, pivot, sign)
    reach = _reach(cell, first, up, pivot)
    span = _span(cell, first, up, pivot)
    return Mechanism(
        cell,
        first,
        up,
        end,
        own_axis,
        pivot,
        sign,
        steps,
        rotation,
        shift,
        _barrels_of(own_axis, pivot),
        link_plates(weight, parent, point2, axis, number),
        origin,
        order,
        int(np.ceil(reach)) + 3,
        int(np.ceil(span)) + 2,
    )


#: What can be wrong with a hinge.
_FAULTS = (
    "",
    "hinge {hinge}: its axis does not lie on a lattice edge",
    "hinge {hinge} turns by more than 270°",
    "bodies are out of order: the parent of hinge {hinge} must come before its child",
)


@njit(cache=True)
def _first_fault(parent: I32, point2: I32, axis: I32, turns: I32) -> tuple[int, int]:
    """Number in `_FAULTS` of the first thing that is wrong, and the hinge; zeros for nothing."""
    for h in range(len(parent)):
        for i in range(3):
            if i != axis[h] and point2[h, i] % 2 == 0:
                return 1, h
    for h in range(len(parent)):
        if abs(turns[h]) > 3:
            return 2, h
    for h in range(len(parent)):
        if parent[h] > h or parent[h] < 0:
            return 3, h
    return 0, 0


def mechanism(system: HingeSystem) -> Mechanism:
    """Make a hinge system ready for the kernels.

    Parameters
    ----------
    system : HingeSystem
        Bodies, cells and hinges in shape A.

    Returns
    -------
    Mechanism
        The same, hung on its middle body and moved so that A is about the origin.

    Raises
    ------
    ValueError
        If a hinge is not on a lattice edge, turns by more than 270° or hangs on a later body.
    """
    hinges = len(system.parent)
    point2 = np.asarray(system.point2, dtype=np.int32).reshape(hinges, 3)
    axis = np.asarray(system.axis, dtype=np.int32)
    turns = np.asarray(system.turns, dtype=np.int32)
    parent = np.asarray(system.parent, dtype=np.int32)
    fault, hinge = _first_fault(parent, point2, axis, turns)
    if fault:
        raise ValueError(_FAULTS[fault].format(hinge=hinge))
    return _hung_on_its_middle(
        np.ascontiguousarray(np.asarray(system.cells, dtype=np.int32).reshape(-1, 3)),
        np.ascontiguousarray(system.body, dtype=np.int32),
        parent,
        point2,
        axis,
        turns,
    )
