"""Put the moves of a path in an order that suits hands: one region at a time.

The planner opens what is free and does not care where. A person who turns a hinge at one end, then
one at the other, and comes back, searches for each. Moves next to each other that are free in
either order may change places without changing anything after them; so moves travel, place by
place, to where the hinges worked at just before and after are near.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fabfold.fold.core_sweep import CORE_HALF_SIDE
from fabfold.fold.lattice_planner import count_free_moves, kernel_inputs, moves_of_steps
from fabfold.fold.shortcut import may_replace
from fabfold.tree.system import HingeSystem

__all__ = ["hinge_distances", "tidied", "walk"]

I32 = NDArray[np.int32]

#: Times that all moves are looked at.
_PASSES = 6


def hinge_distances(parent: I32) -> I32:
    """How far hinges are apart in the tree.

    Parameters
    ----------
    parent : (h,) int32 array
        Body that each hinge turns against; hinge ``k`` carries body ``k + 1``.

    Returns
    -------
    (h, h) int32 array
        Bodies on the way from one hinge to the other; 1 for two hinges of one body, 0 for the same.
    """
    count = len(parent)
    far = np.full((count + 1, count + 1), 10_000, dtype=np.int32)
    np.fill_diagonal(far, 0)
    for hinge, body in enumerate(np.asarray(parent).tolist()):
        # The new leaf is as far from all others as its parent, and one more.
        far[hinge + 1, : hinge + 1] = far[body, : hinge + 1] + 1
        far[: hinge + 1, hinge + 1] = far[hinge + 1, : hinge + 1]
    ends = np.stack([np.asarray(parent), np.arange(1, count + 1)], axis=1)
    between = far[ends[:, None, :, None], ends[None, :, None, :]].min(axis=(2, 3)) + 1
    np.fill_diagonal(between, 0)
    return np.asarray(between, dtype=np.int32)


def walk(path: I32, distances: I32) -> int:
    """How far hands walk on a path: the distances of hinges that follow each other, added up."""
    return _walked(np.asarray(path)[:, 0], distances)


def _walked(hinges: Sequence[int] | I32, distances: I32) -> int:
    """The same of the hinges in the order of their moves."""
    return int(distances[hinges[:-1], hinges[1:]].sum())


def tidied(system: HingeSystem, path: I32) -> I32:
    """The same path with its moves in an order that walks less.

    Parameters
    ----------
    system : HingeSystem
        What folds.
    path : (m, 2) int32 array
        Free on whole cells, or on their cores; see
        :func:`fabfold.fold.lattice_planner.count_free_moves`.

    Returns
    -------
    (k, 2) int32 array
        The same turns; where cells are carved, no more of them clash than before.
    """
    path = np.asarray(path, dtype=np.int32).reshape(-1, 2)
    carve = None
    if system.octants is None and count_free_moves(system, path) < len(path):
        carve = CORE_HALF_SIDE
    order = _Order(system, path, carve)
    distances = hinge_distances(np.asarray(system.parent, dtype=np.int32))
    for _ in range(_PASSES):
        if not order.improve(distances):
            break
    return order.path()


class _Order:
    """Moves of a path in an order that may be changed."""

    def __init__(self, system: HingeSystem, path: I32, carve: float | None) -> None:
        self._system = system
        self._mech, self._scene, self._table = kernel_inputs(system, carve)
        self._carved = carve is not None
        self._whole = kernel_inputs(system)[2] if self._carved else self._table
        place = np.argsort(self._mech.origin)
        #: Hinge of the system, and its steps in the mechanism, of every move.
        self._moves: list[tuple[int, NDArray[np.int16]]] = []
        for hinge, turns in path.tolist():
            way = 1 if turns * int(system.turns[hinge]) > 0 else -1
            step = np.array([[place[hinge], way]], dtype=np.int16)
            self._moves.append((hinge, np.tile(step, (abs(turns), 1))))

    def path(self) -> I32:
        """The path as it is now; neighbouring moves of one hinge are one."""
        steps = [steps for _, steps in self._moves]
        joined = np.concatenate(steps) if steps else np.zeros((0, 2), np.int16)
        return moves_of_steps(self._system, self._mech, joined)

    def improve(self, distances: I32) -> bool:
        """Let every move travel to its best place once; False where none gains."""
        gained = False
        for number in range(len(self._moves)):
            start = list(self._moves)
            best, least = start, self._walk(distances)
            for way in (-1, 1):
                self._moves, at = list(start), number
                while self._swap(at + min(way, 0)):
                    at += way
                    if (cost := self._walk(distances)) < least:
                        best, least, gained = list(self._moves), cost, True
            self._moves = best
        return gained

    def _walk(self, distances: I32) -> int:
        """How far hands walk on the moves as they are now."""
        return _walked([hinge for hinge, _ in self._moves], distances)

    def _swap(self, low: int) -> bool:
        """Exchange two neighbouring moves where both orders are free; False where they are not."""
        if not 0 <= low < len(self._moves) - 1:
            return False
        (one, first), (other, second) = self._moves[low], self._moves[low + 1]
        if one == other:
            return False
        before = [steps for _, steps in self._moves[:low]]
        path = np.concatenate([*before, first, second])
        start = sum(len(steps) for steps in before)
        size = len(first) + len(second)
        part = np.concatenate([second, first])
        if not may_replace(
            self._mech, self._scene, self._table, self._whole, self._carved, path, start, size, part
        ):
            return False
        self._moves[low], self._moves[low + 1] = self._moves[low + 1], self._moves[low]
        return True
