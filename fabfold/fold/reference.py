"""The plain meaning of the lattice kernels, in NumPy, by another way.

Nothing here shares code with the kernels: poses are 4 by 4 matrices, the root body stays still,
and a turn is looked at every degree with separating axes instead of a table. It is slow, it is
what the kernels are tested against, and it says independently whether a path is free.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fabfold.fold.barrels import INSET, LEAST, segment_distance
from fabfold.lattice import rotation_about
from fabfold.tree.system import HingeSystem

__all__ = [
    "barrel_meetings",
    "path_overlap",
    "poses",
    "state_is_valid",
    "stuck",
    "subtree",
    "turn_overlap",
]

#: Overlaps below this, in voxel sides, are faces that touch.
TOUCH = 1e-9


def subtree(system: HingeSystem, hinge: int) -> NDArray[np.bool_]:
    """Bodies that a hinge carries, shape (b,) bool."""
    inside = np.zeros(len(system.parent) + 1, dtype=bool)
    inside[hinge + 1] = True
    for later in range(hinge + 1, len(system.parent)):
        inside[later + 1] |= inside[system.parent[later]]
    return inside


def poses(system: HingeSystem, quarters: NDArray[np.floating]) -> NDArray[np.float64]:
    """Transforms of all bodies with hinge ``h`` turned by ``quarters[h]`` times 90°.

    Returns
    -------
    (b, 4, 4) float64 array
    """
    out = np.tile(np.eye(4), (len(system.parent) + 1, 1, 1))
    for h, parent in enumerate(system.parent):
        turn = rotation_about(
            np.asarray(system.point2)[h] / 2.0, np.eye(3)[system.axis[h]], 90.0 * quarters[h]
        )
        out[h + 1] = out[parent] @ turn
    return out


def _cells(system: HingeSystem, pose: NDArray[np.float64]) -> NDArray[np.float64]:
    mine = pose[np.asarray(system.body)]
    return np.asarray(np.einsum("nij,nj->ni", mine[:, :3, :3], system.cells) + mine[:, :3, 3])


def _barrels(system: HingeSystem, pose: NDArray[np.float64]) -> list[tuple[float, ...]]:
    """Axis and middle of the unit edges that each hinge covers."""
    found = []
    for h in range(len(system.parent)):
        axis = np.eye(3)[system.axis[h]]
        shifts = (0.0,) if system.point2[h][system.axis[h]] % 2 == 0 else (-0.5, 0.5)
        for shift in shifts:
            middle = pose[h + 1] @ np.append(np.asarray(system.point2)[h] / 2 + shift * axis, 1.0)
            along = int(np.abs(pose[h + 1][:3, :3] @ axis).argmax())
            found.append((along, *np.round(2 * middle[:3]).tolist()))
    return found


def state_is_valid(system: HingeSystem, quarters: NDArray[np.integer]) -> bool:
    """Whether no two cells coincide and no two barrels lie on one lattice edge."""
    pose = poses(system, np.asarray(quarters, dtype=float))
    cells = [tuple(cell) for cell in np.round(_cells(system, pose)).astype(int).tolist()]
    barrels = _barrels(system, pose)
    return len(set(cells)) == len(cells) and len(set(barrels)) == len(barrels)


def turn_overlap(
    system: HingeSystem,
    quarters: NDArray[np.integer],
    hinge: int,
    turn: int,
    step_deg: float = 1.0,
) -> NDArray[np.float64]:
    """How deep cubes run into each other while one hinge turns.

    Parameters
    ----------
    quarters : (h,) integer array
        State at the start of the turn.
    hinge : int
    turn : int
        Signed quarter turns.
    step_deg : float
        The turn is looked at this often.

    Returns
    -------
    (n, n) float64 array
        For a moving cell i and a still cell j, the greatest separating-axis overlap on the way,
        in voxel sides; 0 and less where they stay apart or touch, minus infinity elsewhere.
    """
    start = np.asarray(quarters, dtype=float)
    pose = poses(system, start)
    centre = _cells(system, pose)
    moving = subtree(system, hinge)[np.asarray(system.body)]
    parent = pose[system.parent[hinge]]
    axis = np.rint(parent[:3, :3] @ np.eye(3)[system.axis[hinge]])
    point = (parent @ np.append(np.asarray(system.point2)[hinge] / 2.0, 1.0))[:3]
    along = int(np.abs(axis).argmax())
    u, v = [i for i in range(3) if i != along]
    depth = np.full((len(centre), len(centre)), -np.inf)
    pairs = np.argwhere(
        moving[:, None]
        & ~moving[None, :]
        & (np.abs(centre[:, None, along] - centre[None, :, along]) < 0.5)
    )
    if len(pairs) == 0:
        return depth
    still = centre[pairs[:, 1]][:, (u, v)]
    count = max(1, round(90.0 * abs(turn) / step_deg))
    for share in np.linspace(0.0, 1.0, count + 1):
        angle = 90.0 * turn * share
        spin = rotation_about(point, axis, angle)
        moved = (centre[pairs[:, 0]] @ spin[:3, :3].T + spin[:3, 3])[:, (u, v)]
        cosine, sine = spin[u, u], spin[v, u]
        half = 0.5 * (1.0 + abs(cosine) + abs(sine))
        apart = still - moved
        gap = np.maximum(
            np.abs(apart).max(axis=1),
            np.maximum(
                np.abs(apart @ np.array([cosine, sine])), np.abs(apart @ np.array([-sine, cosine]))
            ),
        )
        deep = half - gap
        depth[pairs[:, 0], pairs[:, 1]] = np.maximum(depth[pairs[:, 0], pairs[:, 1]], deep)
    return depth


def path_overlap(
    system: HingeSystem, path: NDArray[np.integer], step_deg: float = 1.0
) -> list[float]:
    """Greatest overlap in each move of a path from A, voxel sides; see :func:`turn_overlap`.

    A move that passes through a state that is not valid, or on which barrels meet, counts as
    infinite.
    """
    q = np.zeros(len(system.parent), dtype=int)
    found = []
    for hinge, turn in np.asarray(path, dtype=int).reshape(-1, 2).tolist():
        deep = float(turn_overlap(system, q, hinge, turn, step_deg).max(initial=-np.inf))
        if barrel_meetings(system, q, hinge, turn):
            deep = np.inf
        for _ in range(abs(turn)):
            q[hinge] += 1 if turn > 0 else -1
            if not state_is_valid(system, q):
                deep = np.inf
        found.append(deep)
    return found


def barrel_meetings(
    system: HingeSystem, quarters: NDArray[np.integer], hinge: int, turn: int, step_deg: float = 0.5
) -> list[tuple[int, int]]:
    """Pairs of hinges (carried, staying) whose barrels come too near while one hinge turns.

    Parameters
    ----------
    system : HingeSystem
        On whole cells.
    quarters, hinge, turn, step_deg
        As for :func:`turn_overlap`.
    """
    pose = poses(system, np.asarray(quarters, dtype=float))
    inside = subtree(system, hinge)
    middles = np.asarray(system.point2) / 2.0
    half = (0.5 - INSET) * np.eye(3)[np.asarray(system.axis, dtype=int)]
    ends = np.stack([middles - half, middles + half], axis=1)
    frame = pose[1:]
    ends = np.einsum("hij,hkj->hki", frame[:, :3, :3], ends) + frame[:, None, :3, 3]
    carried = [g for g in range(len(ends)) if inside[g + 1] and g != hinge]
    staying = [g for g in range(len(ends)) if not inside[g + 1]]
    parent = pose[system.parent[hinge]]
    axis = parent[:3, :3] @ np.eye(3)[system.axis[hinge]]
    point = (parent @ np.append(middles[hinge], 1.0))[:3]
    found = set()
    for share in np.linspace(0.0, 1.0, max(1, round(90.0 * abs(turn) / step_deg)) + 1):
        spin = rotation_about(point, axis, 90.0 * turn * share)
        for g in carried:
            moved = ends[g] @ spin[:3, :3].T + spin[:3, 3]
            for other in staying:
                if segment_distance(moved, ends[other]) < LEAST - 1e-3:
                    found.add((g, other))
    return sorted(found)


def stuck(system: HingeSystem, quarters: NDArray[np.integer], way: int) -> int:
    """Closure test by the definition; see :func:`fabfold.fold.turns.count_stuck`."""
    hinges = len(system.parent)
    if not state_is_valid(system, quarters):
        return hinges
    chain: list[set[int]] = [set()]
    for h in range(hinges):
        chain.append(chain[system.parent[h]] | {h})
    blocked: list[list[set[int]]] = []
    for h in range(hinges):
        turn = int(np.sign(system.turns[h])) * way
        deep = turn_overlap(system, quarters, h, turn)
        body = np.asarray(system.body)
        ways = [chain[body[i]] ^ chain[body[j]] for i, j in np.argwhere(deep > TOUCH)]
        for g, other in barrel_meetings(system, quarters, h, turn):
            # Each barrel goes with both of its bodies: take the two that are nearest.
            ends = [
                chain[a] ^ chain[b]
                for a in (g + 1, int(system.parent[g]))
                for b in (other + 1, int(system.parent[other]))
            ]
            ways.append(min(ends, key=len))
        blocked.append(ways)
    movable: set[int] = set()
    while True:
        more = {
            h
            for h in range(hinges)
            if h not in movable and all(way & movable for way in blocked[h])
        }
        if not more:
            return hinges - len(movable)
        movable |= more
