"""Kernels that choose, for cells that clash, which one gives way on which rings.

See :mod:`fabfold.fold.carving_plan`. Rings are as wide as a subvoxel; in each ring and layer, the
least angle of the first cell's material and the largest of the second's decide what is in the way.
"""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["ClashArrays", "choose_carving"]

F64 = NDArray[np.float64]


class ClashArrays(NamedTuple):
    """Clashes as arrays; ``m`` clashes, ``s`` subvoxels along a side.

    Attributes
    ----------
    cell : (m, 2) int32 array
        Row of `claims` of the first and the second voxel.
    stride : (m, 2, 4) int32 array
        Subvoxel ``(u, v, w)`` of the frame is entry ``stride[0] + u stride[1] + v stride[2] + w
        stride[3]`` of the row.
    ring : (m, 2, s * s) int32 array
        Ring in which each column ``u s + v`` lies; -1 where the other cell has nothing.
    angle : (m, 2, s * s) float64 array
        Angle of each column about the axis, radians.
    rings : (m,) int32 array
        Number of rings.
    """

    cell: NDArray[np.int32]
    stride: NDArray[np.int32]
    ring: NDArray[np.int32]
    angle: F64
    rings: NDArray[np.int32]


@njit(cache=True)
def _free_clash(  # noqa: PLR0912 - one pass, kept whole for speed
    arrays: ClashArrays,
    e: int,
    low: int,
    high: int,
    claims: NDArray[np.uint8],
    weight: NDArray[np.float32],
    size: int,
    apply: bool,
) -> float:
    """Free a clash, the first voxel giving way in rings low to high - 1; returns the cost.

    `claims` change only where it is to `apply`.
    """
    one, other = arrays.cell[e, 0], arrays.cell[e, 1]
    s1, s2 = arrays.stride[e, 0], arrays.stride[e, 1]
    rings = arrays.rings[e]
    begin = np.empty(rings)
    end = np.empty(rings)
    cost = 0.0
    for w in range(size):
        begin[:] = 9.0
        end[:] = -9.0
        for u in range(size):
            for v in range(size):
                p = u * size + v
                r = arrays.ring[e, 0, p]
                if r >= 0 and claims[one, s1[0] + u * s1[1] + v * s1[2] + w * s1[3]] != 0:
                    begin[r] = min(begin[r], arrays.angle[e, 0, p])
                r = arrays.ring[e, 1, p]
                if r >= 0 and claims[other, s2[0] + u * s2[1] + v * s2[2] + w * s2[3]] != 0:
                    end[r] = max(end[r], arrays.angle[e, 1, p])
        free = True
        for r in range(rings):
            if end[r] > begin[r]:
                free = False
                break
        if free:
            continue
        for u in range(size):
            for v in range(size):
                p = u * size + v
                r = arrays.ring[e, 0, p]
                if low <= r < high and arrays.angle[e, 0, p] <= end[r] and begin[r] < end[r]:
                    at = s1[0] + u * s1[1] + v * s1[2] + w * s1[3]
                    if claims[one, at] != 0:
                        cost += weight[one, at]
                        if apply:
                            claims[one, at] = 0
                r = arrays.ring[e, 1, p]
                outside = r >= 0 and not low <= r < high
                if outside and arrays.angle[e, 1, p] >= begin[r] and begin[r] < end[r]:
                    at = s2[0] + u * s2[1] + v * s2[2] + w * s2[3]
                    if claims[other, at] != 0:
                        cost += weight[other, at]
                        if apply:
                            claims[other, at] = 0
    return cost


@njit(cache=True)
def _option(rings: int, option: int, splits: int) -> tuple[int, int]:
    """Rings in which the first voxel gives way: none, all, the inner ones or the outer ones."""
    if option == 0:
        return 0, 0
    if option == 1:
        return 0, rings
    at = (option - 2) // 2 + 1
    middle = max(1, min(rings - 1, at * rings // (splits + 1)))
    return (0, middle) if option % 2 == 0 else (middle, rings)


@njit(cache=True)
def choose_carving(
    arrays: ClashArrays,
    claims: NDArray[np.uint8],
    weight: NDArray[np.float32],
    size: int,
    splits: int,
    budget: int,
) -> tuple[NDArray[np.int32], NDArray[np.int64], NDArray[np.float64]]:
    """Choose which voxel of each clash gives way on which rings, at the least cost.

    Parameters
    ----------
    arrays : ClashArrays
        The clashes.
    claims : (v, s * s * s) uint8 array
        In and out: subvoxels of each voxel in question that hold material or a hinge; what is
        carved becomes 0.
    weight : (v, s * s * s) float32 array
        Cost of each subvoxel.
    size : int
        Subvoxels along a side.
    splits : int
        Radii at which the voxel that gives way may change.
    budget : int
        Clashes that may be worked out anew to improve the first choice.

    Returns
    -------
    choice : (m, 2) int32 array
        First and last ring, the last not included, in which the first voxel of each clash gives
        way.
    order : (m,) int64 array
        Order in which clashes are carved.
    paid : (m,) float64 array
        What each clash costs in this order.
    """
    count = len(arrays.cell)
    options = 2 + 2 * splits
    choice = np.zeros((count, 2), np.int32)
    least = np.empty(count)
    for e in range(count):
        least[e] = np.inf
        for option in range(options):
            low, high = _option(arrays.rings[e], option, splits)
            least[e] = min(least[e], _free_clash(arrays, e, low, high, claims, weight, size, False))
    order = np.argsort(-least, kind="mergesort")
    now = claims.copy()
    total = 0.0
    for e in order:
        best = np.inf
        for option in range(options):
            low, high = _option(arrays.rings[e], option, splits)
            cost = _free_clash(arrays, e, low, high, now, weight, size, False)
            if cost < best - 1e-9:
                best = cost
                choice[e] = low, high
        total += _free_clash(arrays, e, choice[e, 0], choice[e, 1], now, weight, size, True)
    used = 0
    better = True
    while better and used < budget:
        better = False
        before = claims.copy()
        spent = 0.0
        for place in range(count):
            e = order[place]
            kept = choice[e].copy()
            for option in range(options):
                low, high = _option(arrays.rings[e], option, splits)
                if (low == kept[0] and high == kept[1]) or least[e] == 0.0 or used >= budget:
                    continue
                now[:] = before
                cost = spent + _free_clash(arrays, e, low, high, now, weight, size, True)
                used += 1
                for later in range(place + 1, count):
                    if cost >= total - 1e-9:
                        break
                    g = order[later]
                    cost += _free_clash(
                        arrays, g, choice[g, 0], choice[g, 1], now, weight, size, True
                    )
                    used += 1
                if cost < total - 1e-6:
                    total = cost
                    choice[e] = low, high
                    better = True
            spent += _free_clash(arrays, e, choice[e, 0], choice[e, 1], before, weight, size, True)
    now[:] = claims
    paid = np.zeros(count)
    for e in order:
        paid[e] = _free_clash(arrays, e, choice[e, 0], choice[e, 1], now, weight, size, True)
    claims[:] = now
    return choice, order, paid
