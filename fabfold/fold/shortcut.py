"""Make a path of lattice steps short: drop needless steps, bring a hinge's steps together."""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.fold.mechanism import Mechanism, Scene, clear_scene, pose_scene
from fabfold.fold.sweep import SweepTable
from fabfold.fold.turns import turn_is_free

__all__ = ["follow", "shorten"]


@njit(cache=True)
def follow(
    mech: Mechanism,
    at: Scene,
    table: SweepTable,
    q: NDArray[np.int8],
    path: NDArray[np.int16],
) -> int:
    """Make the steps of a path from state `q` (changed on the way) as far as they are free.

    Returns
    -------
    int
        Steps made: ``len(path)`` when all of them are free.
    """
    for i in range(len(path)):
        k = path[i, 0]
        step = q[k] + path[i, 1]
        if step < 0 or step > mech.steps[k]:
            return i
        free = pose_scene(mech, at, q) and turn_is_free(mech, at, table, k, path[i, 1])
        clear_scene(mech, at)
        if not free:
            return i
        q[k] = step
    return len(path)


@njit(cache=True)
def _try(
    mech: Mechanism,
    at: Scene,
    table: SweepTable,
    path: NDArray[np.int16],
    low: int,
    part: NDArray[np.int16],
) -> bool:
    """Whether `part` is free from the state in which `path` is before step `low`."""
    q = np.zeros(len(mech.up), np.int8)
    for i in range(low):
        q[path[i, 0]] += path[i, 1]
    return follow(mech, at, table, q, part) == len(part)


@njit(cache=True)
def _drop(
    mech: Mechanism, at: Scene, table: SweepTable, path: NDArray[np.int16]
) -> NDArray[np.int16]:
    """Leave out pairs of steps, forth and back of one hinge, that nothing between needs."""
    i = 0
    while i < len(path):
        j = i + 1
        while j < len(path) and path[j, 0] != path[i, 0]:
            j += 1
        if j < len(path) and path[j, 1] == -path[i, 1]:
            part = path[i + 1 : j].copy()
            if _try(mech, at, table, path, i, part):
                path = np.concatenate((path[:i], part, path[j + 1 :]))
                i = 0
                continue
        i += 1
    return path


@njit(cache=True)
def _gather(
    mech: Mechanism, at: Scene, table: SweepTable, path: NDArray[np.int16]
) -> tuple[NDArray[np.int16], bool]:
    """Bring the next step of a hinge up to the one before it, or the one before down to it."""
    changed = False
    i = 0
    while i < len(path):
        j = i + 1
        while j < len(path) and path[j, 0] != path[i, 0]:
            j += 1
        if j < len(path) and j > i + 1 and path[j, 1] == path[i, 1]:
            # The run of steps of this hinge that ends at i travels as one.
            low = i
            while low > 0 and path[low - 1, 0] == path[i, 0]:
                low -= 1
            run = path[low : i + 1]
            between = path[i + 1 : j]
            early = np.concatenate((run, path[j : j + 1], between))
            late = np.concatenate((between, run, path[j : j + 1]))
            if _try(mech, at, table, path, low, early):
                path[low : j + 1] = early
                changed = True
                continue
            if _try(mech, at, table, path, low, late):
                path[low : j + 1] = late
                changed = True
                i = low
                continue
        i += 1
    return path, changed


@njit(cache=True)
def shorten(
    mech: Mechanism, at: Scene, table: SweepTable, path: NDArray[np.int16]
) -> NDArray[np.int16]:
    """Shorten a path from A to B; every step stays free.

    Parameters
    ----------
    path : (m, 2) int16 array
        Hinge of the mechanism and way (+1, -1) of each step.

    Returns
    -------
    (k, 2) int16 array
    """
    path = _drop(mech, at, table, path.copy())
    for _ in range(8):
        path, changed = _gather(mech, at, table, path)
        if not changed:
            break
        path = _drop(mech, at, table, path)
    return path
