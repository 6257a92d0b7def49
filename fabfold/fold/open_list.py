"""The open list of a best-first search: a heap of states to expand, and all states reached so far.

The states are nodes of a tree: each remembers the step that led to it. A hash table finds a state
again, so that none is reached twice.
"""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = [
    "BEST",
    "EXPANDED",
    "NODES",
    "QUEUED",
    "OpenList",
    "enlarged",
    "hash_slot",
    "insert_start",
    "join_paths",
    "new_open_list",
    "pop",
    "push",
    "set_target",
    "step_distance",
]

#: Places in ``OpenList.counts``.
NODES, QUEUED, EXPANDED, BEST = 0, 1, 2, 3


class OpenList(NamedTuple):
    """States that one side of a search has reached, and those that it may expand.

    Room for ``c`` nodes; node 0 is the start.

    Attributes
    ----------
    counts : (4,) int64 array
        Number of nodes, number of heap entries, number of expansions, and the node nearest to the
        target; see NODES, QUEUED, EXPANDED and BEST.
    state : (c, h) int8 array
        Lattice state of each node: steps that each hinge has made.
    parent : (c,) int32 array
        Node that each node was reached from, -1 for the start.
    move : (c, 2) int16 array
        Hinge and way (+1, -1) of the step that led to each node.
    penalty : (c,) float64 array
        What the key of a node counts beside its distance from the target, in steps.
    slots : (s,) int32 array
        Open-addressing hash table of nodes, -1 where a slot is empty.
    heap : (c,) int32 array
        What to expand next, a binary heap: ``2 * node`` stands for a node's steps towards the
        target, ``2 * node + 1`` for its other steps, which bring nothing before those do.
    key : (c,) float64 array
        Key of each node, in steps; its other steps have the key plus one.
    """

    counts: NDArray[np.int64]
    state: NDArray[np.int8]
    parent: NDArray[np.int32]
    move: NDArray[np.int16]
    penalty: NDArray[np.float64]
    slots: NDArray[np.int32]
    heap: NDArray[np.int32]
    key: NDArray[np.float64]


@njit(cache=True)
def _hash(state: NDArray[np.int8]) -> np.uint64:
    """FNV-1a hash of a lattice state, mixed once more at every hinge."""
    value = np.uint64(14695981039346656037)
    for i in range(len(state)):
        value = (value ^ np.uint64(state[i] + 1)) * np.uint64(1099511628211)
        value ^= value >> np.uint64(29)
    return value


@njit(cache=True)
def new_open_list(hinges: int, room: int) -> OpenList:
    """Make an open list without nodes.

    Parameters
    ----------
    hinges : int
        Hinges of the mechanism.
    room : int
        Nodes that it has room for.

    Returns
    -------
    OpenList
        Empty.
    """
    slots = 64
    while slots < 4 * room:
        slots *= 2
    return OpenList(
        np.zeros(4, np.int64),
        np.zeros((room, hinges), np.int8),
        np.full(room, -1, np.int32),
        np.zeros((room, 2), np.int16),
        np.zeros(room, np.float64),
        np.full(slots, -1, np.int32),
        np.zeros(room, np.int32),
        np.zeros(room, np.float64),
    )


@njit(cache=True)
def enlarged(open_list: OpenList) -> OpenList:
    """Copy an open list to one with room for twice as many nodes.

    Parameters
    ----------
    open_list : OpenList
        What is copied.

    Returns
    -------
    OpenList
        The same nodes with the same numbers.
    """
    old = len(open_list.state)
    new = new_open_list(open_list.state.shape[1], 2 * old)
    new.counts[:] = open_list.counts
    new.state[:old] = open_list.state
    new.parent[:old] = open_list.parent
    new.move[:old] = open_list.move
    new.penalty[:old] = open_list.penalty
    new.heap[:old] = open_list.heap
    new.key[:old] = open_list.key
    for node in range(open_list.counts[NODES]):
        new.slots[hash_slot(new, open_list.state[node])] = node
    return new


@njit(cache=True)
def hash_slot(open_list: OpenList, state: NDArray[np.int8]) -> int:
    """Find a state in the hash table.

    Parameters
    ----------
    open_list : OpenList
        Where to look.
    state : (h,) int8 array
        Lattice state.

    Returns
    -------
    int
        Slot of the state, or the empty slot where it belongs.
    """
    mask = len(open_list.slots) - 1
    slot = np.int64(_hash(state)) & mask
    while True:
        node = open_list.slots[slot]
        if node < 0:
            return int(slot)
        same = True
        for i in range(len(state)):
            if open_list.state[node, i] != state[i]:
                same = False
                break
        if same:
            return int(slot)
        slot = (slot + 1) & mask


@njit(cache=True)
def _before(open_list: OpenList, a: int, b: int) -> bool:
    """Whether heap entry `a` is expanded before heap entry `b`."""
    first = open_list.key[a >> 1] + (a & 1)
    second = open_list.key[b >> 1] + (b & 1)
    return first < second or (first == second and a < b)


@njit(cache=True)
def _sift(open_list: OpenList, place: int) -> None:
    """Let the heap entry at a place sink to where it belongs."""
    size = open_list.counts[QUEUED]
    heap = open_list.heap
    node = heap[place]
    while True:
        child = 2 * place + 1
        if child >= size:
            break
        if child + 1 < size and _before(open_list, heap[child + 1], heap[child]):
            child += 1
        if not _before(open_list, heap[child], node):
            break
        heap[place] = heap[child]
        place = child
    heap[place] = node


@njit(cache=True)
def push(open_list: OpenList, entry: int) -> None:
    """Put an entry into the heap.

    Parameters
    ----------
    open_list : OpenList
        In and out; the key of the entry's node is set already.
    entry : int
        See ``OpenList.heap``.
    """
    place = open_list.counts[QUEUED]
    open_list.counts[QUEUED] += 1
    heap = open_list.heap
    while place > 0:
        above = (place - 1) // 2
        if not _before(open_list, entry, heap[above]):
            break
        heap[place] = heap[above]
        place = above
    heap[place] = entry


@njit(cache=True)
def pop(open_list: OpenList) -> int:
    """Take the entry with the least key out of the heap.

    Parameters
    ----------
    open_list : OpenList
        In and out; its heap is not empty.

    Returns
    -------
    int
        The entry, see ``OpenList.heap``.
    """
    entry = open_list.heap[0]
    open_list.counts[QUEUED] -= 1
    size = open_list.counts[QUEUED]
    if size > 0:
        open_list.heap[0] = open_list.heap[size]
        _sift(open_list, 0)
    return int(entry)


@njit(cache=True)
def step_distance(a: NDArray[np.int8], b: NDArray[np.int8]) -> int:
    """Number of steps by which two lattice states differ.

    Parameters
    ----------
    a, b : (h,) int8 arrays
        Steps that each hinge has made.

    Returns
    -------
    int
        Sum of the differences of all hinges.
    """
    total = 0
    for i in range(len(a)):
        total += abs(int(a[i]) - int(b[i]))
    return total


@njit(cache=True)
def set_target(open_list: OpenList, target: NDArray[np.int8]) -> None:
    """Make new keys for a new target, and find the node nearest to it.

    Parameters
    ----------
    open_list : OpenList
        In and out: keys, heap and nearest node are worked out anew.
    target : (h,) int8 array
        Lattice state to come close to.
    """
    best = -1
    least = 1 << 30
    for node in range(open_list.counts[NODES]):
        far = step_distance(open_list.state[node], target)
        open_list.key[node] = far + open_list.penalty[node]
        if far < least:
            least = far
            best = node
    open_list.counts[BEST] = best
    for place in range(open_list.counts[QUEUED]):
        open_list.heap[place] &= ~1  # other steps lead to the new target
    for place in range(open_list.counts[QUEUED] // 2 - 1, -1, -1):
        _sift(open_list, place)


@njit(cache=True)
def insert_start(open_list: OpenList, state: NDArray[np.int8], target: NDArray[np.int8]) -> None:
    """Put the first state into an empty open list.

    Parameters
    ----------
    open_list : OpenList
        In and out.
    state : (h,) int8 array
        Lattice state at which the search begins.
    target : (h,) int8 array
        Lattice state to come close to.
    """
    open_list.state[0] = state
    open_list.slots[hash_slot(open_list, state)] = 0
    open_list.counts[NODES] = 1
    open_list.key[0] = step_distance(state, target)
    push(open_list, 0)


@njit(cache=True)
def _trace(open_list: OpenList, node: int, out: NDArray[np.int16]) -> int:
    """Write the steps from the start to a node into `out`, in order; returns how many."""
    size = 0
    at = node
    while open_list.parent[at] >= 0:
        size += 1
        at = open_list.parent[at]
    at = node
    place = size
    while open_list.parent[at] >= 0:
        place -= 1
        out[place] = open_list.move[at]
        at = open_list.parent[at]
    return size


@njit(cache=True)
def join_paths(
    mine: OpenList, here: int, other: OpenList, there: int, forward: bool
) -> NDArray[np.int16]:
    """Steps from A to a node of one side, then from a node of the other side to B.

    Parameters
    ----------
    mine : OpenList
        One side of the search.
    here : int
        Its node.
    other : OpenList
        The other side.
    there : int
        Its node; the same state as `here` on a complete path.
    forward : bool
        Whether `mine` is the side that began at A.

    Returns
    -------
    (m, 2) int16 array
        Hinge and way (+1, -1) of each step.
    """
    if not forward:
        mine, other = other, mine
        here, there = there, here
    steps = np.empty((mine.counts[NODES] + other.counts[NODES], 2), np.int16)
    size = _trace(mine, here, steps)
    rest = _trace(other, there, steps[size:])
    path = steps[: size + rest].copy()
    for i in range(rest):
        path[size + i, 0] = steps[size + rest - 1 - i, 0]
        path[size + i, 1] = -steps[size + rest - 1 - i, 1]
    return path
