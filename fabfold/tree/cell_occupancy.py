"""Room in the cells of the template: for one voxel, or for two in different eighths (kernels)."""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.tree.problem import Tables
from fabfold.tree.rng import random_float

__all__ = ["clash", "close", "find_guests", "holders", "occupy", "one_of", "saved", "seen_twice"]


@njit(cache=True)
def clash(held: int, mask: NDArray[np.uint8], v: int, q: int) -> bool:
    """Whether a cell of which the eighths `held` are taken has no room for `v` at pose `q`."""
    return held == 255 or (held != 0 and (held & mask[v, q % 24]) != 0)


@njit(cache=True)
def occupy(taken: NDArray[np.uint8], mask: NDArray[np.uint8], v: int, q: int) -> int:
    """Take the eighths of voxel `v` at pose `q`; two voxels take all of a cell.

    Returns
    -------
    int
        1 where the cell holds two voxels now, else 0.
    """
    if taken[q // 24] != 0:
        taken[q // 24] = 255
        return 1
    taken[q // 24] = mask[v, q % 24]
    return 0


@njit(cache=True)
def close(taken: NDArray[np.uint8]) -> None:
    """Let nothing more into cells that hold anything."""
    for cell in range(len(taken)):
        if taken[cell] != 0:
            taken[cell] = 255


@njit(cache=True)
def seen_twice(tables: Tables, v: int, q: int, w: int, p: int) -> float:
    """What counts twice when the costs of two voxels in one cell are added.

    Of each quarter of a visible face the nearer material is seen, by the mean depth: that is exact
    where only one of them has material behind the quarter, else a little more than the mean of the
    nearer depths.

    Parameters
    ----------
    tables : Tables
    v, q, w, p : int
        A voxel and its pose, and the other one's.

    Returns
    -------
    float
        Weighted energy to be taken off.
    """
    total = 0.0
    for f in range(6):
        if (tables.exposed[q // 24] >> f) & 1 == 0:
            continue
        for k in range(4):
            total += max(
                np.float64(tables.seen[v, q % 24, f, k]), np.float64(tables.seen[w, p % 24, f, k])
            )
    return total


@njit(cache=True)
def saved(tables: Tables, pose: NDArray[np.int32], v: int, q: int) -> float:
    """As :func:`seen_twice`, with whoever is in the cell."""
    for w in range(len(pose)):
        if w != v and pose[w] >= 0 and pose[w] // 24 == q // 24:
            return seen_twice(tables, v, q, w, pose[w])
    return 0.0


@njit(cache=True)
def holders(tables: Tables, pose: NDArray[np.int32], out: NDArray[np.int32]) -> None:
    """Fill `out` (m, 2) with the voxels in each template cell, -1 for none."""
    out[:] = -1
    for v in range(len(pose)):
        if pose[v] >= 0:
            cell = pose[v] // 24
            if out[cell, 0] < 0:
                out[cell, 0] = v
            else:
                out[cell, 1] = v


@njit(cache=True)
def one_of(holder: NDArray[np.int32], cell: int, generator: NDArray[np.uint64]) -> int:
    """A voxel in a cell, either where there are two; -1 for none."""
    if holder[cell, 1] >= 0 and random_float(generator) < 0.5:
        return holder[cell, 1]
    return holder[cell, 0]


@njit(cache=True)
def find_guests(tables: Tables, pose: NDArray[np.int32], guest: NDArray[np.bool_]) -> None:
    """Mark the voxels that share their cell with another one."""
    first = np.full(len(tables.cells), -1, np.int32)
    for v in range(len(pose)):
        other = first[pose[v] // 24]
        if other >= 0:
            guest[v] = True
            guest[other] = True
        first[pose[v] // 24] = v
