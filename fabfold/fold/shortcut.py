"""Make a path of lattice steps short: drop needless steps, bring a hinge's steps together."""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.fold.mechanism import Mechanism
from fabfold.fold.scene import Scene, clear_scene, pose_scene
from fabfold.fold.turn_obstacles import TurnBuffers, obstacles, turn_buffers
from fabfold.lattice.sweep import SweepTable

__all__ = ["count_clashes", "follow", "may_replace", "shorten"]


@njit(cache=True)
def _count_obstacles(
    mech: Mechanism,
    scene: Scene,
    table: SweepTable,
    q: NDArray[np.int8],
    step: NDArray[np.int16],
    buffers: TurnBuffers,
) -> int:
    """Pairs that hinder a step from state `q`; -1 where the state itself is not valid."""
    count = -1
    if pose_scene(mech, scene, q):
        count = obstacles(mech, scene, table, step[0], step[1], buffers)
    clear_scene(mech, scene)
    return count


@njit(cache=True)
def follow(
    mech: Mechanism,
    scene: Scene,
    table: SweepTable,
    q: NDArray[np.int8],
    path: NDArray[np.int16],
) -> int:
    """Make the steps of a path as far as they are free.

    Parameters
    ----------
    mech : Mechanism
        What folds.
    scene : Scene
        Its scene, empty before and after.
    table : SweepTable
        Sweeps up to the span of the mechanism: what must be free.
    q : (h,) int8 array
        In and out: lattice state before the path, and after the steps made.
    path : (m, 2) int16 array
        Hinge of the mechanism and way (+1, -1) of each step.

    Returns
    -------
    int
        Steps made: ``len(path)`` when all of them are free.
    """
    buffers = turn_buffers(0)
    for i in range(len(path)):
        k = path[i, 0]
        step = q[k] + path[i, 1]
        if (
            step < 0
            or step > mech.steps[k]
            or _count_obstacles(mech, scene, table, q, path[i], buffers) != 0
        ):
            return i
        q[k] = step
    return len(path)


@njit(cache=True)
def count_clashes(
    mech: Mechanism,
    scene: Scene,
    whole: SweepTable,
    q: NDArray[np.int8],
    path: NDArray[np.int16],
) -> int:
    """Count the pairs of whole cells that run into each other on a path.

    Parameters
    ----------
    mech : Mechanism
        What folds.
    scene : Scene
        Its scene, empty before and after.
    whole : SweepTable
        Sweeps of whole cells up to the span of the mechanism.
    q : (h,) int8 array
        Lattice state before the path.
    path : (m, 2) int16 array
        Hinge of the mechanism and way (+1, -1) of each step; it leads through valid states, as one
        that :func:`follow` made to its end.

    Returns
    -------
    int
        Pairs, those of every step together.
    """
    now = q.copy()
    buffers = turn_buffers(256)
    total = 0
    for i in range(len(path)):
        total += _count_obstacles(mech, scene, whole, now, path[i], buffers)
        now[path[i, 0]] += path[i, 1]
    return total


@njit(cache=True)
def may_replace(
    mech: Mechanism,
    scene: Scene,
    table: SweepTable,
    whole: SweepTable,
    carved: bool,
    path: NDArray[np.int16],
    low: int,
    size: int,
    part: NDArray[np.int16],
) -> bool:
    """Whether `part` can stand for the `size` steps of `path` from `low` on.

    It must be free, and where turns are free only because cells are carved, it must not need
    more carving.
    """
    q = np.zeros(len(mech.up), np.int8)
    for i in range(low):
        q[path[i, 0]] += path[i, 1]
    start = q.copy()
    if follow(mech, scene, table, q, part) < len(part):
        return False
    if not carved:
        return True
    old = count_clashes(mech, scene, whole, start, path[low : low + size])
    return count_clashes(mech, scene, whole, start, part) <= old


@njit(cache=True)
def _drop_pairs(
    mech: Mechanism,
    scene: Scene,
    table: SweepTable,
    whole: SweepTable,
    carved: bool,
    path: NDArray[np.int16],
) -> NDArray[np.int16]:
    """Leave out pairs of steps, forth and back of one hinge, that nothing between needs."""
    i = 0
    while i < len(path):
        j = i + 1
        while j < len(path) and path[j, 0] != path[i, 0]:
            j += 1
        if j < len(path) and path[j, 1] == -path[i, 1]:
            part = path[i + 1 : j].copy()
            if may_replace(mech, scene, table, whole, carved, path, i, j + 1 - i, part):
                path = np.concatenate((path[:i], part, path[j + 1 :]))
                i = 0
                continue
        i += 1
    return path


@njit(cache=True)
def _gather_turns(
    mech: Mechanism,
    scene: Scene,
    table: SweepTable,
    whole: SweepTable,
    carved: bool,
    path: NDArray[np.int16],
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
            if may_replace(mech, scene, table, whole, carved, path, low, len(early), early):
                path[low : j + 1] = early
                changed = True
                continue
            if may_replace(mech, scene, table, whole, carved, path, low, len(late), late):
                path[low : j + 1] = late
                changed = True
                i = low
                continue
        i += 1
    return path, changed


@njit(cache=True)
def shorten(
    mech: Mechanism,
    scene: Scene,
    table: SweepTable,
    whole: SweepTable,
    carved: bool,
    path: NDArray[np.int16],
) -> NDArray[np.int16]:
    """Shorten a path from A to B; every step stays free.

    Parameters
    ----------
    mech : Mechanism
        What folds.
    scene : Scene
        Its scene, empty before and after.
    table : SweepTable
        Sweeps up to the span of the mechanism: what must stay free.
    whole : SweepTable
        Sweeps of whole cells; `table` itself where nothing is carved.
    carved : bool
        `table` has the sweeps of the cells' cores: keep from carving more than before.
    path : (m, 2) int16 array
        Hinge of the mechanism and way (+1, -1) of each step.

    Returns
    -------
    (k, 2) int16 array
        The shorter path, of the same form.
    """
    path = _drop_pairs(mech, scene, table, whole, carved, path.copy())
    for _ in range(8):
        path, changed = _gather_turns(mech, scene, table, whole, carved, path)
        if not changed:
            break
        path = _drop_pairs(mech, scene, table, whole, carved, path)
    return path
