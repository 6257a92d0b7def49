"""A motion by forces as a path of quarter turns, one hinge at a time.

All hinges move at once in a simulation. Here the motion is shortened to what the lattice knows: a
hinge makes a step when it passes the middle between two quarter turns, in the order in which that
happens; a step that is not yet free waits until others are made. What comes out is free of
collision by the same table as a planned path, and is shortened, carved and certified like one.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fabfold.fold.core_sweep import CORE_HALF_SIDE
from fabfold.fold.lattice_planner import kernel_inputs, moves_of_steps
from fabfold.fold.shortcut import follow, shorten
from fabfold.tree.fold_tree import FoldTree
from fabfold.tree.system import HingeSystem, hinge_system

__all__ = ["lattice_path", "steps_of"]

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]

#: Steps that may be tried, taken back ones included.
_TRIES = 4000


def steps_of(way_deg: F64, *, detours: bool) -> list[tuple[int, int]]:
    """Steps that the hinges make in a motion.

    Parameters
    ----------
    way_deg : (t, h) float64 array
        Angles of all hinges on the way, degrees.
    detours : bool
        With the steps that are taken back later.

    Returns
    -------
    list of (hinge, way)
        In the order in which the hinges pass 45°, 135°, 225°; way is 1 towards B, -1 back.
    """
    state = np.rint(np.abs(way_deg) / 90.0).astype(int)
    steps: list[tuple[int, int]] = []
    for before, after in pairwise(state):
        for hinge in np.flatnonzero(before != after).tolist():
            change = int(after[hinge] - before[hinge])
            steps += [(hinge, 1 if change > 0 else -1)] * abs(change)
    return steps if detours else _without_detours(steps)


def _without_detours(steps: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Leave out steps forth and back of one hinge, whatever others did between."""
    kept: list[tuple[int, int] | None] = list(steps)
    stacks: dict[int, list[int]] = {}
    for place, (hinge, way) in enumerate(steps):
        stack = stacks.setdefault(hinge, [])
        if stack and steps[stack[-1]][1] == -way:
            kept[stack.pop()] = None
            kept[place] = None
        else:
            stack.append(place)
    return [step for step in kept if step is not None]


def lattice_path(tree: FoldTree, from_a_deg: F64, from_b_deg: F64) -> tuple[I32 | None, int]:
    """Path of quarter turns from two motions by forces that end with the same angles.

    Whole cells are tried first; where they are in each other's way, their cores, which are what
    carving can leave of them. Each half is made from its shape on, where room is scarce, without
    the steps that are taken back later where that does. What is then left between the two is
    made last.

    Parameters
    ----------
    tree : FoldTree
        What moves.
    from_a_deg, from_b_deg : (t, h) float64 arrays
        Angles of all hinges, from shape A and from shape B, degrees.

    Returns
    -------
    path : (m, 2) int32 array or None
        One row a move: hinge, and signed quarter turns about its positive axis; None where some
        steps never become free.
    left : int
        Steps that do not.
    """
    system, left = hinge_system(tree), 0
    for carve in (None,) if system.octants is not None else (None, CORE_HALF_SIDE):
        lattice = _Lattice(system, carve)
        for detours in (False, True):
            path, left = lattice.joined(from_a_deg, from_b_deg, detours=detours)
            if path is not None:
                return path, 0
    return None, left


class _Lattice:
    """A tree on the lattice, and what turns sweep there.

    Parameters
    ----------
    system : HingeSystem
        What folds.
    carve : float or None
        As of :func:`fabfold.fold.lattice_planner.find_path`.
    """

    def __init__(self, system: HingeSystem, carve: float | None) -> None:
        self._system, self._carve = system, carve
        self._mech, self._scene, self._table = kernel_inputs(system, carve)
        self._place = np.argsort(self._mech.origin)

    def joined(self, from_a_deg: F64, from_b_deg: F64, *, detours: bool) -> tuple[I32 | None, int]:
        """Path of two halves, as of :func:`lattice_path`."""
        start, end = np.zeros(len(self._mech.up), np.int8), self._mech.steps.astype(np.int8)
        way, here = self._in_turn(steps_of(from_a_deg, detours=detours), start)
        back, there = self._in_turn(steps_of(from_b_deg, detours=detours), end)
        between = [
            (int(self._mech.origin[k]), 1 if there[k] > here[k] else -1)
            for k in np.repeat(np.arange(len(here)), np.abs(there - here)).tolist()
        ]
        rest, met = self._in_turn(between, here)
        if (left := int(np.abs(there - met).sum())) > 0:
            return None, left
        turned = [(hinge, -sign) for hinge, sign in reversed(back)]
        return self._shortened([*way, *rest, *turned]), 0

    def _in_turn(
        self, steps: list[tuple[int, int]], start: NDArray[np.int8]
    ) -> tuple[list[tuple[int, int]], NDArray[np.int8]]:
        """Make steps one by one, each as early as it is free, as many as can be made.

        Where none is free, the last step is taken back and another one made in its place.
        Returns the steps in the order in which they were made, and the state that they lead to.
        """
        ahead = [(int(self._place[hinge]), way) for hinge, way in steps]
        made: list[int] = []  # of `ahead`
        best: list[int] = []
        state, reached = start.copy(), start.copy()
        untried = [np.ones(len(ahead), dtype=bool)]  # by depth
        seen: set[bytes] = set()
        for _ in range(_TRIES):
            if len(best) == len(ahead):
                break
            step = self._next_free(state, ahead, made, untried[-1])
            if step is None:
                if not made:
                    break
                self._take_back(state, ahead, made)
                untried.pop()
                continue
            untried[-1][step] = False
            made.append(step)
            key = np.sort(np.array(made)).tobytes()
            if key in seen:
                self._take_back(state, ahead, made)
                continue
            seen.add(key)
            untried.append(np.ones(len(ahead), dtype=bool))
            if len(made) > len(best):
                best, reached = made.copy(), state.copy()
        return [steps[number] for number in best], reached

    def _take_back(
        self, state: NDArray[np.int8], ahead: list[tuple[int, int]], made: list[int]
    ) -> None:
        hinge, way = ahead[made.pop()]
        state[hinge] -= way

    def _next_free(
        self,
        state: NDArray[np.int8],
        ahead: list[tuple[int, int]],
        made: list[int],
        untried: NDArray[np.bool_],
    ) -> int | None:
        """First step that is free now, made in the state; a hinge's own steps keep their order."""
        done, passed = set(made), set()
        for number, step in enumerate(ahead):
            if number in done or step[0] in passed:
                continue
            passed.add(step[0])
            row = np.array([step], dtype=np.int16)
            if untried[number] and follow(self._mech, self._scene, self._table, state, row):
                return number
        return None

    def _shortened(self, steps: list[tuple[int, int]]) -> I32:
        """Steps that lead from A to B as moves, as few as the lattice allows."""
        rows = [(int(self._place[hinge]), way) for hinge, way in steps]
        path = np.array(rows, dtype=np.int16).reshape(-1, 2)
        carved = self._carve is not None
        whole = kernel_inputs(self._system)[2] if carved else self._table
        short = shorten(self._mech, self._scene, self._table, whole, carved, path)
        return moves_of_steps(self._system, self._mech, short)
