"""Hinge barrels that run into each other between the states of the lattice.

Cubes know nothing of barrels. No two hinges lie on one lattice edge in any state of a path, but
while one hinge turns, a barrel on the moving side can still swing through a barrel on the other
side, whose knuckles cannot be grooved. This finds such collisions from the axes alone, quickly
enough to look at a path before any solid is cut. It samples the angles and proves nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fabfold.fold.motion import Motion
from fabfold.fold.system_kinematics import carried_bodies
from fabfold.tree.fold_tree import FoldTree

__all__ = ["BarrelCollision", "first_barrel_collision"]

#: Samples of a quarter turn; the nearest one is looked at again as finely between its neighbours.
_SAMPLES = 24

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class BarrelCollision:
    """Two barrels that come too near on the way to a keyframe.

    Attributes
    ----------
    move : int
        Index of the keyframe that the move leads to.
    turning : int
        Hinge that turns.
    angle_deg : float
        How far it has turned from the keyframe before.
    moving : int
        Hinge whose barrel is carried along.
    resting : int
        Hinge whose barrel stays.
    distance : float
        Distance of the two barrels' inner axes, lattice units.
    """

    move: int
    turning: int
    angle_deg: float
    moving: int
    resting: int
    distance: float


def first_barrel_collision(
    tree: FoldTree, motion: Motion, *, inset: float, least: float
) -> BarrelCollision | None:
    """First move on which one barrel runs into another.

    Parameters
    ----------
    tree : FoldTree
        What folds.
    motion : Motion
        Its path, one hinge a move.
    inset : float
        How much of the lattice edge is left off at each end of a barrel's axis: where the barrel
        ends, and its radius once more, so that a ball about any point of what remains lies inside
        the barrel. Lattice units.
    least : float
        Two barrels are too near when their axes, so shortened, come nearer than this: twice the
        radius and the clearance, lattice units.

    Returns
    -------
    BarrelCollision or None
        None does not prove that barrels stay apart: the ends of the barrels are left off.
    """
    parents = np.array([h.parent for h in tree.hinges], dtype=int)
    points = np.array([h.point for h in tree.hinges], dtype=float).reshape(-1, 3)
    directions = np.array([h.direction for h in tree.hinges], dtype=float).reshape(-1, 3)
    half = (0.5 - inset) * directions
    ends = np.stack([points - half, points + half], axis=1)
    for k in range(1, len(motion.angles_deg)):
        before, after = motion.angles_deg[k - 1], motion.angles_deg[k]
        held = tree.body_poses(before)[parents]
        placed = np.einsum("nij,nkj->nki", held[:, :3, :3], ends) + held[:, None, :3, 3]
        for hinge in motion.moves[k]:
            rotation, shift = held[hinge, :3, :3], held[hinge, :3, 3]
            found = _nearest_in_turn(
                placed,
                carried_bodies(parents, hinge)[parents],
                rotation @ points[hinge] + shift,
                rotation @ directions[hinge],
                float(after[hinge] - before[hinge]),
                hinge,
                least,
            )
            if found is not None:
                moving, resting, angle, distance = found
                return BarrelCollision(k, hinge, angle, moving, resting, distance)
    return None


def _segment_distance(first: Floats, second: Floats) -> Floats:
    """Distance between pairs of segments, both (..., 2, 3) end points; shape (...)."""
    d1, d2 = first[..., 1, :] - first[..., 0, :], second[..., 1, :] - second[..., 0, :]
    r = first[..., 0, :] - second[..., 0, :]
    a, e, b = (d1 * d1).sum(-1), (d2 * d2).sum(-1), (d1 * d2).sum(-1)
    c, f = (d1 * r).sum(-1), (d2 * r).sum(-1)
    wide = a * e - b * b
    s = np.where(wide > 1e-9, np.clip((b * f - c * e) / np.maximum(wide, 1e-9), 0, 1), 0.5)
    t = np.clip((b * s + f) / e, 0, 1)
    s = np.clip((b * t - c) / a, 0, 1)
    t = np.clip((b * s + f) / e, 0, 1)
    apart = r + s[..., None] * d1 - t[..., None] * d2
    return np.asarray(np.linalg.norm(apart, axis=-1), dtype=float)


def _turned(segments: Floats, point: Floats, axis: Floats, angles_deg: Floats) -> Floats:
    """Segments (p, 2, 3) turned about an axis by angles (p, a): shape (p, a, 2, 3)."""
    away = (segments - point)[:, None]
    along = (away @ axis)[..., None] * axis
    radians = np.radians(angles_deg)[..., None, None]
    across = away - along
    side = np.cross(axis, away)
    return np.asarray(point + along + np.cos(radians) * across + np.sin(radians) * side)


def _nearest_in_turn(
    placed: Floats,
    carried: NDArray[np.bool_],
    point: Floats,
    axis: Floats,
    turn: float,
    hinge: int,
    least: float,
) -> tuple[int, int, float, float] | None:
    """Moving hinge, resting hinge, angle and distance of the nearest pair, if it is too near."""
    others = np.arange(len(placed)) != hinge
    movers, resters = np.flatnonzero(carried & others), np.flatnonzero(~carried & others)
    if len(movers) == 0 or len(resters) == 0:
        return None
    # Both keep their height along the axis and their distance from it: most pairs never meet.
    away = placed - point
    height = away @ axis
    radius = np.linalg.norm(away - height[..., None] * axis, axis=-1)
    # A segment across the axis is nearest to it somewhere between its ends, but never
    # nearer than the farther end less the length.
    length = np.linalg.norm(placed[:, 1] - placed[:, 0], axis=1)
    low, high = radius.max(axis=1) - length, radius.max(axis=1)
    i, j = (grid.reshape(-1) for grid in np.meshgrid(movers, resters, indexing="ij"))
    near = (low[i] - least < high[j]) & (low[j] - least < high[i])
    near &= (height[i].min(axis=1) - least < height[j].max(axis=1)) & (
        height[j].min(axis=1) - least < height[i].max(axis=1)
    )
    i, j = i[near], j[near]
    if len(i) == 0:
        return None
    count = max(2, int(np.ceil(_SAMPLES * abs(turn) / 90.0))) + 1
    angles = np.tile(np.linspace(0.0, turn, count), (len(i), 1))
    for _ in range(2):
        distance = _segment_distance(
            _turned(placed[i], point, axis, angles), placed[j][:, None].repeat(count, axis=1)
        )
        best = distance.argmin(axis=1)
        rows = np.arange(len(i))
        left = angles[rows, np.maximum(best - 1, 0)]
        right = angles[rows, np.minimum(best + 1, count - 1)]
        nearest, at = distance[rows, best], angles[rows, best]
        angles = left[:, None] + (right - left)[:, None] * np.linspace(0.0, 1.0, count)
    worst = int(nearest.argmin())
    if nearest[worst] >= least - 1e-3:
        return None
    return int(i[worst]), int(j[worst]), float(abs(at[worst])), float(nearest[worst])
