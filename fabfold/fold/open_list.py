"""The states that one side of the planner has reached: a hash table, a heap and a tree of moves."""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = [
    "Front",
    "begin",
    "distance",
    "grown",
    "joined",
    "new_front",
    "pop",
    "push",
    "retarget",
    "slot_of",
]


class Front(NamedTuple):
    """The states that one side has reached.

    Attributes
    ----------
    tally : (4,) int64 array
        Nodes, heap entries, expansions, best node.
    state : (c, h) int8 array
    before : (c,) int32 array
        Node that this one came from, -1 at the start.
    move : (c, 2) int16 array
        Hinge and way (+1, -1) of the step that led here.
    force : (c,) float64 array
        Repulsion term of the key.
    slots : (s,) int32 array
        Open-addressing hash table of nodes, -1 where empty.
    heap : (c,) int32 array
        What to expand next, a binary heap: ``2 * node`` stands for a node's steps towards the
        target, ``2 * node + 1`` for its other steps, which bring nothing before those do.
    key : (c,) float64 array
        Of each node; its other steps have the key plus one.
    """

    tally: NDArray[np.int64]
    state: NDArray[np.int8]
    before: NDArray[np.int32]
    move: NDArray[np.int16]
    force: NDArray[np.float64]
    slots: NDArray[np.int32]
    heap: NDArray[np.int32]
    key: NDArray[np.float64]


@njit(cache=True)
def _hash(state: NDArray[np.int8]) -> np.uint64:
    value = np.uint64(14695981039346656037)
    for i in range(len(state)):
        value = (value ^ np.uint64(state[i] + 1)) * np.uint64(1099511628211)
        value ^= value >> np.uint64(29)
    return value


@njit(cache=True)
def new_front(hinges: int, room: int) -> Front:
    """Empty front with room for some nodes."""
    slots = 64
    while slots < 4 * room:
        slots *= 2
    return Front(
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
def grown(front: Front) -> Front:
    """Copy of a front with room for twice as many nodes."""
    old = len(front.state)
    new = new_front(front.state.shape[1], 2 * old)
    new.tally[:] = front.tally
    new.state[:old] = front.state
    new.before[:old] = front.before
    new.move[:old] = front.move
    new.force[:old] = front.force
    new.heap[:old] = front.heap
    new.key[:old] = front.key
    for node in range(front.tally[0]):
        new.slots[slot_of(new, front.state[node])] = node
    return new


@njit(cache=True)
def slot_of(front: Front, state: NDArray[np.int8]) -> int:
    """Place of a state in the hash table: where it is, or the empty place where it belongs."""
    mask = len(front.slots) - 1
    slot = np.int64(_hash(state)) & mask
    while True:
        node = front.slots[slot]
        if node < 0:
            return int(slot)
        same = True
        for i in range(len(state)):
            if front.state[node, i] != state[i]:
                same = False
                break
        if same:
            return int(slot)
        slot = (slot + 1) & mask


@njit(cache=True)
def _before(front: Front, a: int, b: int) -> bool:
    first = front.key[a >> 1] + (a & 1)
    second = front.key[b >> 1] + (b & 1)
    return first < second or (first == second and a < b)


@njit(cache=True)
def _sift(front: Front, place: int) -> None:
    size = front.tally[1]
    heap = front.heap
    node = heap[place]
    while True:
        child = 2 * place + 1
        if child >= size:
            break
        if child + 1 < size and _before(front, heap[child + 1], heap[child]):
            child += 1
        if not _before(front, heap[child], node):
            break
        heap[place] = heap[child]
        place = child
    heap[place] = node


@njit(cache=True)
def push(front: Front, entry: int) -> None:
    """Put an entry, the key of whose node is set, into the heap."""
    place = front.tally[1]
    front.tally[1] += 1
    heap = front.heap
    while place > 0:
        above = (place - 1) // 2
        if not _before(front, entry, heap[above]):
            break
        heap[place] = heap[above]
        place = above
    heap[place] = entry


@njit(cache=True)
def pop(front: Front) -> int:
    """Take out the entry with the least key."""
    entry = front.heap[0]
    front.tally[1] -= 1
    size = front.tally[1]
    if size > 0:
        front.heap[0] = front.heap[size]
        _sift(front, 0)
    return int(entry)


@njit(cache=True)
def distance(a: NDArray[np.int8], b: NDArray[np.int8]) -> int:
    """Steps by which two states differ."""
    total = 0
    for i in range(len(a)):
        total += abs(int(a[i]) - int(b[i]))
    return total


@njit(cache=True)
def retarget(front: Front, target: NDArray[np.int8]) -> None:
    """Make new keys for a new target, and find the node nearest to it."""
    best = -1
    least = 1 << 30
    for node in range(front.tally[0]):
        far = distance(front.state[node], target)
        front.key[node] = far + front.force[node]
        if far < least:
            least = far
            best = node
    front.tally[3] = best
    for place in range(front.tally[1]):
        front.heap[place] &= ~1  # other steps lead to the new target
    for place in range(front.tally[1] // 2 - 1, -1, -1):
        _sift(front, place)


@njit(cache=True)
def begin(front: Front, state: NDArray[np.int8], target: NDArray[np.int8]) -> None:
    """Put the first state into an empty front."""
    front.state[0] = state
    front.slots[slot_of(front, state)] = 0
    front.tally[0] = 1
    front.key[0] = distance(state, target)
    push(front, 0)


@njit(cache=True)
def _trace(front: Front, node: int, out: NDArray[np.int16]) -> int:
    """Steps from the start of a front to `node`, in order; returns how many."""
    size = 0
    at = node
    while front.before[at] >= 0:
        size += 1
        at = front.before[at]
    at = node
    place = size
    while front.before[at] >= 0:
        place -= 1
        out[place] = front.move[at]
        at = front.before[at]
    return size


@njit(cache=True)
def joined(mine: Front, here: int, other: Front, there: int, forward: bool) -> NDArray[np.int16]:
    """Steps from A to a node of one front, then from a node of the other to B."""
    if not forward:
        mine, other = other, mine
        here, there = there, here
    steps = np.empty((mine.tally[0] + other.tally[0], 2), np.int16)
    size = _trace(mine, here, steps)
    rest = _trace(other, there, steps[size:])
    path = steps[: size + rest].copy()
    for i in range(rest):
        path[size + i, 0] = steps[size + rest - 1 - i, 0]
        path[size + i, 1] = -steps[size + rest - 1 - i, 1]
    return path
