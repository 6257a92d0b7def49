"""Which bodies of a hinge system are link plates of double hinges, and on which lattice faces.

A link plate carries no cells: it is the flat piece between the two axes of a double hinge.
"""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["link_plates"]

I32 = NDArray[np.int32]


@njit(cache=True)
def _face_between(first: I32, axis1: int, second: I32, axis2: int, middle: I32) -> int:
    """Lattice face that has two given edges among its sides.

    Parameters
    ----------
    first, second : (3,) int32 arrays
        Twice the middles of the edges.
    axis1, axis2 : int
        Axes along which they run.
    middle : (3,) int32 array
        Out: twice the middle of the face.

    Returns
    -------
    int
        Axis of the face's normal; -1 where there is no such face.
    """
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
def _only_child(parent: I32, body: int) -> int:
    """Hinge that hangs on a body of the system; -1 where there is none, or more than one."""
    child = -1
    for h in range(body, len(parent)):
        if parent[h] == body:
            if child >= 0:
                return -1
            child = h
    return child


@njit(cache=True)
def link_plates(weight: I32, parent: I32, point2: I32, axis: I32, number: I32) -> I32:
    """Link plates: bodies without cells between two hinges on edges of one lattice face.

    Parameters
    ----------
    weight : (b,) int32 array
        Number of cells of each body of the system.
    parent, point2, axis
        As in :class:`fabfold.tree.system.HingeSystem`.
    number : (b,) int32 array
        New number of each body of the system.

    Returns
    -------
    (p, 5) int32 array
        ``Mechanism.plate``: one face each, or four quarters of one on a lattice of half cells.
    """
    hinges = len(parent)
    plate = np.zeros((4 * (hinges + 1), 5), np.int32)
    faces = 0
    middle = np.zeros(3, np.int32)
    for h in range(hinges):
        if weight[h + 1] > 0:
            continue
        child = _only_child(parent, h + 1)
        if child < 0:
            continue
        normal = _face_between(point2[h], axis[h], point2[child], axis[child], middle)
        if normal < 0:
            continue
        whole = point2[h, axis[h]] % 2 == 0
        for part in range(1 if whole else 4):
            plate[faces, 0] = number[h + 1]
            plate[faces, 1] = normal
            plate[faces, 2:] = middle
            if not whole:
                plate[faces, 2 + (normal + 1) % 3] += 2 * (part % 2) - 1
                plate[faces, 2 + (normal + 2) % 3] += 2 * (part // 2) - 1
            faces += 1
    return plate[:faces].copy()
