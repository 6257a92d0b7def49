"""Pairs of whole cells that run into each other on a path: the clashes.

Two cells that clash in a quarter turn lie in the same layer along its axis. Turned into one
quadrant of the plane across it, they run into each other exactly where, on one circle about the
axis, a point of the one, called *second* here, lies at no smaller an angle than a point of the
other, the *first*. Which of the two moves no longer matters.
"""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.fold.system_kinematics import carried_bodies, poses_at
from fabfold.lattice.sweep import arcs_overlap
from fabfold.tree.system import HingeSystem

__all__ = ["Clash", "clashes_on"]

F64 = NDArray[np.float64]


@dataclass(frozen=True)
class Clash:
    """Two whole cells that run into each other in a quarter turn.

    A clash has a frame of its own: the axis of the turn is its third axis, and both cells are
    placed in the first quadrant across it. They run into each other where, on one circle, a point
    of the second lies at no smaller an angle than a point of the first.

    Attributes
    ----------
    move : int
        Row of the path, the first one where this happens several times.
    hinge : int
        Hinge that turns in that move.
    first : int
        Voxel that lies ahead: it is free once it loses all that lies behind the second.
    second : int
        Voxel that lies behind: it is free once it loses all that lies ahead of the first.
    to_first : (3, 4) float64 array
        Rigid transform from shape A to the frame with the body of the first voxel, lattice units.
    to_second : (3, 4) float64 array
        The same with the body of the second voxel.
    """

    move: int
    hinge: int
    first: int
    second: int
    to_first: F64
    to_second: F64


@njit(cache=True)
def _overlaps(first: NDArray[np.int64], second: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether the arcs of pairs of squares (p, 2) overlap, shape (p,); see `arcs_overlap`."""
    out = np.zeros(len(first), np.bool_)
    for i in range(len(first)):
        out[i] = arcs_overlap(first[i, 0], first[i, 1], second[i, 0], second[i, 1])
    return out


def _quarter(turns: int) -> F64:
    """Rotation about the third axis by quarter turns, (3, 3), exact."""
    cosine, sine = ((1, 0), (0, 1), (-1, 0), (0, -1))[turns % 4]
    return np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]], dtype=float)


def _placed(pose: F64, frame: F64) -> F64:
    """Frame (3, 4) after pose (4, 4), exact."""
    return np.asarray(np.rint(2 * frame @ pose) / 2 + 0.0)


def clashes_on(system: HingeSystem, path: NDArray[np.integer]) -> list[Clash]:
    """Every distinct way in which two whole cells run into each other on a path.

    Parameters
    ----------
    system : HingeSystem
        What folds, on whole cells.
    path : (m, 2) integer array
        From A: hinge and signed quarter turns about its positive axis, one row a move.

    Returns
    -------
    list of Clash
        In the order of the path; empty where whole cells pass each other.
    """
    q = np.zeros(len(system.parent))
    body = np.asarray(system.body, dtype=int)
    found: dict[tuple[object, ...], Clash] = {}
    for move, (hinge, turns) in enumerate(np.asarray(path, dtype=int).reshape(-1, 2).tolist()):
        carried = carried_bodies(system.parent, hinge)[body]
        way = 1 if turns > 0 else -1
        for _ in range(abs(turns)):
            # A turn back sweeps what the turn forth from its end sweeps.
            pose = poses_at(system, q if way > 0 else q - np.eye(len(q))[hinge])
            q[hinge] += way
            frame = _axis_frame(system, pose, hinge)
            for clash in _clashes_in_turn(system, pose, frame, carried, move, hinge):
                found.setdefault(_key(clash), clash)
    return list(found.values())


def _axis_frame(system: HingeSystem, pose: F64, hinge: int) -> F64:
    """From the world to a frame whose third axis is the hinge's, (3, 4)."""
    world = pose[system.parent[hinge]]
    point = (world @ np.append(np.asarray(system.point2)[hinge] / 2.0, 1.0))[:3]
    along = np.rint(world[:3, :3] @ np.eye(3)[system.axis[hinge]])
    u = np.eye(3)[(int(np.abs(along).argmax()) + 1) % 3]
    frame = np.empty((3, 4))
    frame[:, :3] = np.array([u, np.cross(along, u), along])
    frame[:, 3] = -frame[:, :3] @ point
    return frame


def _clashes_in_turn(
    system: HingeSystem,
    pose: F64,
    frame: F64,
    carried: NDArray[np.bool_],
    move: int,
    hinge: int,
) -> list[Clash]:
    """Clashes of one quarter turn; `pose` is that before a turn forward."""
    body = np.asarray(system.body, dtype=int)
    world = np.einsum("nij,nj->ni", pose[body][:, :3, :3], system.cells) + pose[body][:, :3, 3]
    corner = np.rint(2 * (world @ frame[:, :3].T + frame[:, 3])).astype(int)
    # Lower corners of the squares, and the quadrant they lie in.
    corner[:, :2] = (corner[:, :2] - 1) // 2
    positive = corner[:, :2] >= 0
    quadrant = np.where(positive[:, 1], np.where(positive[:, 0], 0, 1), 2 + positive[:, 0])
    square = np.empty((len(corner), 2), dtype=np.int64)
    for k in range(4):
        mine = quadrant == k
        a, b = corner[mine, 0], corner[mine, 1]
        square[mine] = np.column_stack([(a, b), (b, -a - 1), (-a - 1, -b - 1), (-b - 1, a)][k])
    movers, rests = np.flatnonzero(carried), np.flatnonzero(~carried)
    level = corner[movers, 2][:, None] == corner[rests, 2][None, :]
    ahead = (quadrant[rests][None, :] - quadrant[movers][:, None]) % 4
    out = []
    for step in (0, 1):
        i, j = np.nonzero(level & (ahead == step))
        one, other = movers[i], rests[j]
        if step == 1:  # what rests in the next quadrant is hit from behind
            one, other = other, one
        hit = _overlaps(square[one], square[other])
        for first, second in zip(one[hit].tolist(), other[hit].tolist(), strict=True):
            out.append(
                Clash(
                    move,
                    hinge,
                    first,
                    second,
                    _placed(pose[body[first]], _quarter(-int(quadrant[first])) @ frame),
                    _placed(pose[body[second]], _quarter(-int(quadrant[second])) @ frame),
                )
            )
    return out


def _key(clash: Clash) -> tuple[object, ...]:
    """Equal for clashes that are the same seen from the two bodies."""
    one, other = clash.to_first.copy(), clash.to_second.copy()
    first, second = clash.first, clash.second
    if first > second:
        # Seen from the other end of the axis, angles run back from 90° and the two change places.
        flip = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]])
        one, other, first, second = flip @ other, flip @ one, second, first
    level = one[2, 3]
    one[2, 3] -= level
    other[2, 3] -= level
    return (first, second, tuple((one + 0.0).ravel()), tuple((other + 0.0).ravel()))
