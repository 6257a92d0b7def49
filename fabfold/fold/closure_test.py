"""The closure test: which hinges of a mechanism can never turn.

It is necessary, not sufficient, and takes some microseconds, so the tree search asks it of every
tree before it asks the planner.
"""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.fold.mechanism import Mechanism
from fabfold.fold.scene import Scene, clear_scene, empty_scene, pose_scene
from fabfold.fold.turn_obstacles import obstacles, turn_buffers
from fabfold.lattice.sweep import SweepTable

__all__ = ["movable_hinges", "stuck_at_both_ends"]


@njit(cache=True)
def _blocking_paths(
    mech: Mechanism, scene: Scene, table: SweepTable, way: int
) -> tuple[NDArray[np.uint64], NDArray[np.int32]]:
    """For each hinge, the paths in the tree between the bodies that block its next step.

    Parameters
    ----------
    mech : Mechanism
        That of the scene.
    scene : Scene
        Posed in the state to leave.
    table : SweepTable
        Sweeps up to the span of the mechanism.
    way : int
        1: every hinge wants to step forward, -1: back.

    Returns
    -------
    paths : (p, w) uint64 array
        One path a row: bit ``k % 64`` of word ``k // 64`` is set where hinge ``k`` is on it.
    start : (h + 1,) int32 array
        Rows ``start[k]`` to ``start[k + 1] - 1`` belong to hinge ``k``.
    """
    hinges = len(mech.up)
    words = (hinges + 63) // 64
    one = np.uint64(1)
    from_root = np.zeros((hinges + 1, words), np.uint64)
    for k in range(hinges):
        from_root[k + 1] = from_root[mech.up[k]]
        from_root[k + 1, k // 64] |= one << np.uint64(k % 64)
    buffers = turn_buffers(1024)
    paths = np.empty((256, words), np.uint64)
    start = np.zeros(hinges + 1, np.int32)
    seen = np.zeros((hinges + 1, hinges + 1), np.int32)
    used = 0
    for k in range(hinges):
        count = obstacles(mech, scene, table, k, way, buffers) if mech.steps[k] > 0 else 0
        while count == len(buffers.pairs):
            buffers = turn_buffers(4 * len(buffers.pairs))
            count = obstacles(mech, scene, table, k, way, buffers)
        for i in range(count):
            a = buffers.pairs[i, 0]
            b = buffers.pairs[i, 1]
            if seen[a, b] == k + 1:
                continue
            seen[a, b] = k + 1
            if used == len(paths):
                wider = np.empty((2 * len(paths), words), np.uint64)
                wider[:used] = paths
                paths = wider
            for w in range(words):
                paths[used, w] = from_root[a, w] ^ from_root[b, w]
            used += 1
        start[k + 1] = used
    return paths, start


@njit(cache=True)
def _meets(path: NDArray[np.uint64], hinges: NDArray[np.uint64]) -> bool:
    """Whether a path has any of some hinges, both as bits."""
    hit = False
    for w in range(len(path)):
        hit = hit or path[w] & hinges[w] != 0
    return hit


@njit(cache=True)
def movable_hinges(
    mech: Mechanism, scene: Scene, table: SweepTable, q: NDArray[np.int8], way: int
) -> NDArray[np.bool_]:
    """Closure test: hinges that something may set free, starting from a state.

    A hinge counts as movable when every pair of bodies that blocks its first turn has an already
    movable hinge on its path in the tree; repeated until nothing changes. A hinge that stays
    behind is hopeless: what blocks it never moves against it. The converse does not hold.

    Parameters
    ----------
    mech : Mechanism
        That of the scene.
    scene : Scene
        With empty grids, before and after.
    table : SweepTable
        Sweeps up to the span of the mechanism.
    q : (h,) int8 array
        Lattice state to leave.
    way : int
        1: every hinge wants to step forward, -1: back.

    Returns
    -------
    (h,) bool array
        False for hinges that nothing can ever set free; for all of them if the state itself is
        not valid.
    """
    hinges = len(mech.up)
    loose = np.zeros(hinges, np.bool_)
    if not pose_scene(mech, scene, q):
        clear_scene(mech, scene)
        return loose
    paths, start = _blocking_paths(mech, scene, table, way)
    clear_scene(mech, scene)

    movable = np.zeros((hinges + 63) // 64, np.uint64)
    changed = True
    while changed:
        changed = False
        for k in range(hinges):
            if loose[k]:
                continue
            free = True
            for i in range(start[k], start[k + 1]):
                if not _meets(paths[i], movable):
                    free = False
                    break
            if free:
                loose[k] = True
                movable[k // 64] |= np.uint64(1) << np.uint64(k % 64)
                changed = True
    return loose


@njit(cache=True)
def stuck_at_both_ends(mech: Mechanism, table: SweepTable) -> NDArray[np.bool_]:
    """Hinges that nothing can ever set free, from shape A and from shape B.

    Parameters
    ----------
    mech : Mechanism
        What is to fold.
    table : SweepTable
        Sweeps up to the span of the mechanism.

    Returns
    -------
    (2, h) bool array
        By hinges of the system that the mechanism was made of.
    """
    hinges = len(mech.up)
    scene = empty_scene(mech)
    stuck = np.zeros((2, hinges), np.bool_)
    start = np.zeros(hinges, np.int8)
    for way in range(2):
        if way == 1:
            start[:] = mech.steps
        movable = movable_hinges(mech, scene, table, start, 1 - 2 * way)
        for k in range(hinges):
            stuck[way, mech.origin[k]] = not movable[k]
    return stuck
