"""Magnets that hold the box shut: where they are needed, where there is room, and their pockets.

To first order a folded kit is a linkage: the speed of every point is linear in the speeds of the
hinges. Faces that meet may only part, which bounds some of these speeds; a pair of magnets holds
two bodies together where it sits, which takes up to three. Pairs are chosen one by one, each the
one that leaves the fewest ways to move, until nothing moves or no pair helps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from fabfold.fold.motion import Motion
from fabfold.joinery.bodies import BodyMesh, Joinery
from fabfold.joinery.body_poses import poses_in_mm
from fabfold.joinery.booleans import subtract
from fabfold.joinery.box_faces import (
    FaceMeeting,
    across,
    are_flush,
    face_meetings,
    is_material,
    meeting_sides,
)
from fabfold.joinery.cells import solids_of
from fabfold.joinery.loose_pins import cylinder_between
from fabfold.joinery.soundness import printable_body
from fabfold.tree.fold_tree import FoldTree

if TYPE_CHECKING:
    import manifold3d

__all__ = ["MAGNETS", "DiscMagnet", "MagnetPair", "Retention", "free_hinges", "hold_shut"]

Floats = NDArray[np.float64]

#: A magnet lies so far below the mouth of its pocket, mm.
DEEP_MM = 0.2
#: Room around a magnet, in diameter, and the wall around its pocket, mm.
_ROOM_MM, _WALL_MM = 0.2, 0.8
#: Places on a face that are tried, in voxel sides from its middle.
_PLACES = (0.0, 0.22, -0.22)
#: Speeds below this count as none; a hinge turns at most at 1.
_STILL = 1e-6


@dataclass(frozen=True)
class DiscMagnet:
    """A disc magnet.

    Attributes
    ----------
    name : str
        Diameter and thickness in mm, such as ``"3x1"``.
    diameter_mm, thick_mm : float
        The same as numbers.
    pull_n : float
        What pulls two of them apart that touch, N: the low end of what dealers of N42 discs give.
    """

    name: str
    diameter_mm: float
    thick_mm: float
    pull_n: float


MAGNETS: Final[dict[str, DiscMagnet]] = {
    magnet.name: magnet
    for magnet in (
        DiscMagnet("3x1", 3.0, 1.0, 1.5),
        DiscMagnet("4x2", 4.0, 2.0, 4.0),
        DiscMagnet("5x2", 5.0, 2.0, 6.0),
    )
}
"""Magnets that kits can be made with, by name."""


@dataclass(frozen=True)
class MagnetPair:
    """Two magnets that meet in the box.

    Attributes
    ----------
    bodies : (int, int)
        Indices of the two bodies. The north pole of the first looks out, that of the second in.
    points_mm : (2, 3) tuple of float
        Middle of the mouth of each pocket, mm, shape A.
    inwards : (2, 3) tuple of float
        Unit vector into each body, shape A.
    """

    bodies: tuple[int, int]
    points_mm: tuple[tuple[float, float, float], tuple[float, float, float]]
    inwards: tuple[tuple[float, float, float], tuple[float, float, float]]


@dataclass(frozen=True)
class Retention:
    """What holds the box shut.

    Attributes
    ----------
    magnet : str
        Name of the magnets, of :data:`MAGNETS`.
    pairs : tuple of MagnetPair
        Where they are.
    free_before : tuple of int
        Indices of the hinges that move, to first order, when faces are shut and nothing holds them.
    free_after : tuple of int
        The same with the magnets: these are held by friction only.
    """

    magnet: str
    pairs: tuple[MagnetPair, ...]
    free_before: tuple[int, ...]
    free_after: tuple[int, ...]

    def to_json(self) -> dict[str, Any]:
        """Ready for a JSON file."""
        return {
            "magnet": self.magnet,
            "pairs": [
                {
                    "bodies": list(pair.bodies),
                    "points_mm": [list(point) for point in pair.points_mm],
                    "inwards": [list(inward) for inward in pair.inwards],
                }
                for pair in self.pairs
            ],
            "free_before": list(self.free_before),
            "free_after": list(self.free_after),
        }

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> Retention:
        """Retention from what :meth:`to_json` wrote."""
        pairs = []
        for entry in data["pairs"]:
            one, other = entry["bodies"]
            points, inwards = ([tuple(row) for row in entry[k]] for k in ("points_mm", "inwards"))
            pairs.append(MagnetPair((one, other), (points[0], points[1]), (inwards[0], inwards[1])))
        before, after = tuple(data["free_before"]), tuple(data["free_after"])
        return cls(data["magnet"], tuple(pairs), before, after)


def hold_shut(
    tree: FoldTree, motion: Motion, joinery: Joinery, magnet: DiscMagnet
) -> tuple[Joinery, Retention]:
    """Choose pairs of magnets and cut their pockets.

    Parameters
    ----------
    tree : FoldTree
        The bodies and their hinges.
    motion : Motion
        The folding path; its end is the box.
    joinery : Joinery
        The printed bodies.
    magnet : DiscMagnet
        What is to be put in.

    Returns
    -------
    joinery : Joinery
        The bodies with pockets.
    retention : Retention
        Where the pairs are, and what moves before and after.
    """
    poses = poses_in_mm(tree, joinery, motion.angles_deg[-1])
    speeds = _Speeds(tree, joinery, poses)
    solids = solids_of(joinery.bodies)
    meetings = face_meetings(tree, joinery, poses)
    shut = [speeds.parting(m) for m in meetings if are_flush(m, joinery, solids, poses)]
    bounds = np.concatenate(shut) if shut else np.zeros((0, len(tree.hinges)))
    held = np.zeros((0, len(tree.hinges)))
    before = free_hinges(bounds, held)
    candidates = [
        (pair, speeds.together(meeting.bodies, place))
        for meeting in meetings
        for pair, place in _places(meeting, joinery, solids, poses, magnet)
    ]
    chosen: list[MagnetPair] = []
    free = before
    while len(free) and candidates:
        still = _null_space(held)
        ranks = [_rank(rows @ still) for _, rows in candidates]
        best = int(np.argmax(ranks))
        if ranks[best] == 0:
            break
        pair, rows = candidates.pop(best)
        held = np.concatenate([held, rows])
        chosen.append(pair)
        free = free_hinges(bounds, held)
    chosen, free = _without_idle(chosen, free, bounds, speeds, poses)
    return _with_pockets(joinery, solids, chosen, magnet), Retention(
        magnet.name, tuple(chosen), tuple(before), tuple(free)
    )


def _without_idle(
    chosen: list[MagnetPair],
    free: list[int],
    bounds: Floats,
    speeds: _Speeds,
    poses: Floats,
) -> tuple[list[MagnetPair], list[int]]:
    """Pairs without which more would move; later ones may have made earlier ones idle."""
    kept = list(chosen)
    for pair in chosen:
        rest = [other for other in kept if other is not pair]
        rows = [np.zeros((0, bounds.shape[1]))] + [
            speeds.together(other.bodies, _in_box(other, poses)) for other in rest
        ]
        if len(free_hinges(bounds, np.concatenate(rows))) <= len(free):
            kept = rest
    return kept, free


def _in_box(pair: MagnetPair, poses: Floats) -> Floats:
    pose = poses[pair.bodies[0]]
    return np.asarray(pose[:3, :3] @ np.array(pair.points_mm[0]) + pose[:3, 3])


def free_hinges(bounds: Floats, held: Floats) -> list[int]:
    """Hinges that can move to first order.

    Parameters
    ----------
    bounds : (m, h) float64 array
        Rows r with r · q >= 0 for every possible vector q of the hinges' speeds.
    held : (k, h) float64 array
        Rows r with r · q = 0.

    Returns
    -------
    list of int
        Indices of hinges whose speed is not bound to 0.
    """
    from scipy.optimize import linprog

    count = bounds.shape[1]
    moving: set[int] = set()
    for hinge in range(count):
        if hinge in moving:
            continue
        for sign in (1.0, -1.0):
            cost = np.zeros(count)
            cost[hinge] = -sign
            found = linprog(
                cost,
                A_ub=-bounds if len(bounds) else None,
                b_ub=np.zeros(len(bounds)) if len(bounds) else None,
                A_eq=held if len(held) else None,
                b_eq=np.zeros(len(held)) if len(held) else None,
                bounds=(-1.0, 1.0),
                method="highs",
            )
            if found.status == 0 and -found.fun > 1e-5:
                moving.update(np.flatnonzero(np.abs(found.x) > 1e-5).tolist())
                break
    return sorted(moving)


def _null_space(rows: Floats) -> Floats:
    """Orthonormal columns that all rows leave alone."""
    if not len(rows):
        return np.eye(rows.shape[1])
    _, sizes, axes = np.linalg.svd(rows)
    rank = int((sizes > _STILL * max(1.0, float(sizes.max()))).sum())
    return np.asarray(axes[rank:].T)


def _rank(rows: Floats) -> int:
    return int(np.linalg.matrix_rank(rows, tol=1e-3)) if rows.size else 0


class _Speeds:
    """How the speeds of points of the box depend on those of the hinges."""

    def __init__(self, tree: FoldTree, joinery: Joinery, poses: Floats) -> None:
        origin = np.asarray(joinery.origin_mm)
        self._count = len(tree.hinges)
        self._axes: list[Floats] = []
        self._points: list[Floats] = []
        way: dict[int, tuple[int, ...]] = {0: ()}
        for index, hinge in enumerate(tree.hinges):
            pose = poses[hinge.parent]
            point = origin + joinery.voxel_mm * np.asarray(hinge.point, dtype=float)
            self._points.append(pose[:3, :3] @ point + pose[:3, 3])
            self._axes.append(pose[:3, :3] @ np.asarray(hinge.direction, dtype=float))
            way[hinge.child] = (*way[hinge.parent], index)
        self._way = way
        self._side = joinery.voxel_mm

    def of(self, body: int, point: Floats) -> Floats:
        """Speed of a point of a body, in voxel sides, as rows (3, h) of the hinges' speeds."""
        rows = np.zeros((3, self._count))
        for index in self._way[body]:
            rows[:, index] = np.cross(self._axes[index], point - self._points[index]) / self._side
        return rows

    def together(self, bodies: tuple[int, int], point: Floats) -> Floats:
        """Rows (3, h) that are 0 where two bodies do not move against each other at a point."""
        return np.asarray(self.of(bodies[1], point) - self.of(bodies[0], point))

    def parting(self, meeting: FaceMeeting) -> Floats:
        """Rows (4, h), not below 0 where two faces do not run into each other."""
        u, v = across(meeting.normal)
        rows = []
        for i, j in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            corner = meeting.middle + 0.3 * self._side * (i * u + j * v)
            rows.append(meeting.normal @ self.together(meeting.bodies, corner))
        return np.array(rows)


def _places(
    meeting: FaceMeeting,
    joinery: Joinery,
    solids: Sequence[manifold3d.Manifold],
    poses: Floats,
    magnet: DiscMagnet,
) -> list[tuple[MagnetPair, Floats]]:
    """The first place on a meeting with room for a pocket and its wall on both sides."""
    u, v = across(meeting.normal)
    radius = (magnet.diameter_mm + _ROOM_MM) / 2 + _WALL_MM
    deep = magnet.thick_mm + DEEP_MM + _WALL_MM
    for i in _PLACES:
        for j in _PLACES:
            place = meeting.middle + joinery.voxel_mm * (i * u + j * v)
            sides = meeting_sides(meeting, place, joinery, poses)
            if all(
                is_material(solids[body], point + 0.02 * into, into, radius, deep)
                for body, point, into in sides
            ):
                (_, one, first), (_, other, second) = sides
                pair = MagnetPair(
                    meeting.bodies,
                    (_triple(one), _triple(other)),
                    (_triple(first), _triple(second)),
                )
                return [(pair, place)]
    return []


def _triple(vector: Floats) -> tuple[float, float, float]:
    x, y, z = (round(float(value), 6) + 0.0 for value in vector)
    return x, y, z


def _with_pockets(
    joinery: Joinery,
    solids: Sequence[manifold3d.Manifold],
    pairs: Sequence[MagnetPair],
    magnet: DiscMagnet,
) -> Joinery:
    """The bodies with a pocket for every magnet."""
    tools: dict[int, list[manifold3d.Manifold]] = {}
    radius, deep = (magnet.diameter_mm + _ROOM_MM) / 2, magnet.thick_mm + DEEP_MM
    for pair in pairs:
        for body, point, inward in zip(pair.bodies, pair.points_mm, pair.inwards, strict=True):
            mouth, into = np.array(point), np.array(inward)
            pocket = cylinder_between(mouth - into, mouth + deep * into, radius, outside=True)
            tools.setdefault(body, []).append(pocket)
    bodies = list(joinery.bodies)
    for body, cuts in sorted(tools.items()):
        name = bodies[body].name
        solid = subtract(solids[body], cuts)
        bodies[body] = BodyMesh(name, *printable_body(solid, name, np.zeros(3)))
    return replace(joinery, bodies=tuple(bodies))
