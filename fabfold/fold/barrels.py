"""Hinge barrels that run into each other between the states of the lattice.

Cubes know nothing of barrels. No two hinges lie on one lattice edge in any state of a path, but
while one hinge turns, a barrel on the moving side can still swing through a barrel on the other
side, whose knuckles cannot be grooved. This finds such encounters from the axes alone, quickly
enough to look at a path before any solid is cut.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fabfold.fold.motion import Motion
from fabfold.lattice.rotations import rotation_about
from fabfold.lattice.segments import INSET, LEAST
from fabfold.tree.fold_tree import FoldTree
from fabfold.tree.system import HingeSystem

__all__ = [
    "Encounter",
    "encounter_on_lattice",
    "first_encounter",
    "segment_distance",
]

#: Samples of a quarter turn; the nearest one is looked at again as finely between its neighbours.
_SAMPLES = 24

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Encounter:
    """Two barrels that come too near on the way to a keyframe.

    Attributes
    ----------
    move : int
        Index of the keyframe that the move leads to.
    turning : int
        Hinge that turns.
    angle_deg : float
        How far it has turned from the keyframe before.
    moving, resting : int
        Hinges whose barrels meet.
    distance : float
        Of the two barrels' inner axes, lattice units.
    """

    move: int
    turning: int
    angle_deg: float
    moving: int
    resting: int
    distance: float


def segment_distance(first: Floats, second: Floats) -> Floats:
    """Distance between pairs of segments.

    Parameters
    ----------
    first, second : (..., 2, 3) float64 arrays
        End points.

    Returns
    -------
    (...) float64 array
    """
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


def first_encounter(
    tree: FoldTree, motion: Motion, *, inset: float, least: float
) -> Encounter | None:
    """First move on which one barrel runs into another.

    Parameters
    ----------
    tree : FoldTree
    motion : Motion
        One hinge a move.
    inset : float
        How much of the lattice edge is left off at each end of a barrel's axis: where the barrel
        ends, and its radius once more, so that a ball about any point of what remains lies inside
        the barrel. Lattice units.
    least : float
        Two barrels are too near when their axes, so shortened, come nearer than this: twice the
        radius and the clearance, lattice units.

    Returns
    -------
    Encounter or None
        None does not prove that barrels stay apart: the ends of the barrels are left off.
    """
    chain = _Chain(
        np.array([h.parent for h in tree.hinges], dtype=int),
        np.array([h.point for h in tree.hinges], dtype=float).reshape(-1, 3),
        np.array([h.direction for h in tree.hinges], dtype=float).reshape(-1, 3),
    )
    for k in range(1, len(motion.angles_deg)):
        before, after = motion.angles_deg[k - 1], motion.angles_deg[k]
        for m in motion.moves[k]:
            found = chain.meet(before, m, float(after[m] - before[m]), inset, least)
            if found is not None:
                moving, resting, angle, distance = found
                return Encounter(k, m, angle, moving, resting, distance)
    return None


def encounter_on_lattice(
    system: HingeSystem,
    path: NDArray[np.integer],
    *,
    inset: float = INSET,
    least: float = LEAST,
) -> Encounter | None:
    """As :func:`first_encounter`, for a path of quarter turns before sizes in mm are known.

    Parameters
    ----------
    system : HingeSystem
    path : (m, 2) integer array
        Hinge and signed quarter turns about its positive axis.
    inset, least : float
        By default those of the usual hinge: barrel radius 0.125 of the voxel, clearance 0.015.
    """
    chain = _Chain(
        system.parent.astype(int),
        system.point2.astype(float).reshape(-1, 3) / 2.0,
        np.eye(3)[system.axis.astype(int)].reshape(-1, 3),
    )
    angles = np.zeros(len(system.parent))
    for k, (m, quarter) in enumerate(np.asarray(path, dtype=int).reshape(-1, 2).tolist(), start=1):
        found = chain.meet(angles, m, 90.0 * quarter, inset, least)
        if found is not None:
            moving, resting, angle, distance = found
            return Encounter(k, m, angle, moving, resting, distance)
        angles[m] += 90.0 * quarter
    return None


class _Chain:
    """The hinges' axes as a tree of moving frames; hinge ``h`` carries body ``h + 1``."""

    def __init__(self, parents: NDArray[np.int_], points: Floats, directions: Floats) -> None:
        self.parents, self.points, self.directions = parents, points, directions
        count = len(parents)
        self.carried = np.zeros((count, count + 1), dtype=bool)
        for h in range(count - 1, -1, -1):
            self.carried[h, h + 1] = True
            self.carried[h] |= self.carried[h + 1 :][parents[h + 1 :] == h + 1].any(axis=0)

    def poses(self, angles_deg: Floats) -> Floats:
        """Rigid transform of every body from its place in A, shape (b, 4, 4)."""
        poses = np.tile(np.eye(4), (len(self.parents) + 1, 1, 1))
        for h, angle in enumerate(angles_deg):
            turn = rotation_about(self.points[h], self.directions[h], float(angle))
            poses[h + 1] = poses[self.parents[h]] @ turn
        return poses

    def meet(
        self, angles_deg: Floats, hinge: int, turn: float, inset: float, least: float
    ) -> tuple[int, int, float, float] | None:
        """Nearest encounter while one hinge turns, if it is too near."""
        held = self.poses(angles_deg)[self.parents]
        half = (0.5 - inset) * self.directions
        ends = np.stack([self.points - half, self.points + half], axis=1)
        placed = np.einsum("nij,nkj->nki", held[:, :3, :3], ends) + held[:, None, :3, 3]
        rotation, shift = held[hinge, :3, :3], held[hinge, :3, 3]
        return _in_turn(
            placed,
            self.carried[hinge, self.parents],
            rotation @ self.points[hinge] + shift,
            rotation @ self.directions[hinge],
            turn,
            hinge,
            least,
        )


def _turned(segments: Floats, point: Floats, axis: Floats, angles_deg: Floats) -> Floats:
    """Segments (p, 2, 3) turned about an axis by angles (p, a): shape (p, a, 2, 3)."""
    away = (segments - point)[:, None]
    along = (away @ axis)[..., None] * axis
    radians = np.radians(angles_deg)[..., None, None]
    across = away - along
    side = np.cross(axis, away)
    return np.asarray(point + along + np.cos(radians) * across + np.sin(radians) * side)


def _in_turn(
    placed: Floats,
    carried: NDArray[np.bool_],
    point: Floats,
    axis: Floats,
    turn: float,
    hinge: int,
    least: float,
) -> tuple[int, int, float, float] | None:
    """Moving hinge, resting hinge, angle and distance of the nearest encounter of one turn."""
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
        distance = segment_distance(
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
