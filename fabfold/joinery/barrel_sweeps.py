"""Sweeps of hinge barrels: every way in which a barrel passes another body on the folding path.

Seen from a body, the barrel of another hinge either rests or turns about the axis of the hinge that
is moving. Both are a *sweep*: a segment, an axis and an angle, in the body's own frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fabfold.fold.motion import Motion
from fabfold.tree.fold_tree import Edge, FoldTree, Hinge

__all__ = [
    "Sweep",
    "barrel_sweeps",
    "descendants",
    "distinct_sweeps",
    "lighter_sides",
    "resting_sweep",
    "turn_axis",
    "turning_sweep",
]

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Sweep:
    """One way in which a barrel passes a body, in the body's own frame (its place in A).

    Link plates pass in the same ways (:mod:`fabfold.joinery.pockets`).

    Attributes
    ----------
    body : int
        Index of the body that is passed.
    owner : int
        Index of the hinge whose barrel passes (the first found, if several go the same way); of a
        plate, the index of its link.
    points : (k, 3) float64 array
        Where the sweep begins, lattice units: the two ends of the lattice edge that carries the
        barrel; of a plate, all of its corners.
    axis_point : (3,) float64 array
        A point of the axis of the turn, lattice units; unused if `angle_deg` is 0.
    axis : (3,) float64 array
        Unit vector along the axis of the turn; unused if `angle_deg` is 0.
    angle_deg : float
        Angle of the turn in degrees, right-handed about `axis`; 0 for a barrel that rests.
    """

    body: int
    owner: int
    points: Floats
    axis_point: Floats
    axis: Floats
    angle_deg: float

    def placements(self, angles_deg: Floats) -> Floats:
        """`points` at some angles of the turn.

        Parameters
        ----------
        angles_deg : (a,) float64 array
            Angles in degrees from the beginning of the turn.

        Returns
        -------
        (a, k, 3) float64 array
            The turned points, lattice units.
        """
        radians = np.radians(np.asarray(angles_deg, dtype=float))[:, None, None]
        away = self.points - self.axis_point
        along = (away @ self.axis)[:, None] * self.axis
        turned = np.cos(radians) * (away - along) + np.sin(radians) * np.cross(self.axis, away)
        return np.asarray(self.axis_point + along + turned)

    @property
    def radius(self) -> float:
        """Largest distance of `points` from the axis of the turn, lattice units."""
        away = self.points - self.axis_point
        across = away - (away @ self.axis)[:, None] * self.axis
        return float(np.linalg.norm(across, axis=1).max())


def descendants(tree: FoldTree) -> NDArray[np.bool_]:
    """Which bodies each hinge carries.

    Parameters
    ----------
    tree : FoldTree
        The bodies and their hinges.

    Returns
    -------
    (h, b) bool array
        True where body b moves when hinge h turns.
    """
    moves = np.zeros((len(tree.hinges), len(tree.bodies)), dtype=bool)
    for index in range(len(tree.hinges) - 1, -1, -1):
        child = tree.hinges[index].child
        moves[index, child] = True
        for later in range(index + 1, len(tree.hinges)):
            if tree.hinges[later].parent == child:
                moves[index] |= moves[later]
    return moves


def lighter_sides(tree: FoldTree, volume: Floats) -> NDArray[np.bool_]:
    """Which bodies a person turns about each hinge: the side with less material.

    Parameters
    ----------
    tree : FoldTree
        The bodies and their hinges.
    volume : (b,) float64 array
        Of every body.

    Returns
    -------
    (h, b) bool array
        The bodies that a hinge carries, unless they are more than half of the material.
    """
    carried = descendants(tree)
    heavy = carried @ volume > ~carried @ volume
    return np.where(heavy[:, None], ~carried, carried)


def barrel_sweeps(tree: FoldTree, motion: Motion, reach: float) -> list[Sweep]:
    """Every distinct way in which a barrel may pass a body that it does not belong to.

    Parameters
    ----------
    tree : FoldTree
        The bodies and their hinges.
    motion : Motion
        The folding path: one hinge a move, linear between keyframes.
    reach : float
        Radius of a groove in lattice units; sweeps that stay farther than this from every cell of
        the body are left out.

    Returns
    -------
    list of Sweep
        The sweeps of all bodies, in a fixed order.
    """
    carried = descendants(tree)
    # A link's plate lies within a cube about the middle of its face.
    links = [
        (index, tree.edges[b.edge]) for index, b in enumerate(tree.bodies) if b.edge is not None
    ]
    middles = [(tree.source[edge.parent] + tree.source[edge.child]) / 2.0 for _, edge in links]
    cubes = np.concatenate([tree.source.astype(float), np.array(middles).reshape(-1, 3)])
    cube_body = np.concatenate([tree.voxel_body, np.array([b for b, _ in links], dtype=np.int32)])
    excluded = {pair for _, edge in links for pair in _coaxial_pairs(tree, edge)}
    ends = np.array(
        [
            [np.array(h.point) + s * 0.5 * np.array(h.direction, dtype=float) for s in (-1, 1)]
            for h in tree.hinges
        ]
    ).reshape(-1, 2, 3)
    parents = np.array([h.parent for h in tree.hinges], dtype=int)
    found: list[Sweep] = []
    for h, hinge in enumerate(tree.hinges):
        near = _box_distance(ends[h], cubes) < reach
        for b in np.unique(cube_body[near]).tolist():
            if b not in (hinge.parent, hinge.child) and (h, b) not in excluded:
                found.append(resting_sweep(b, h, ends[h]))
    for k in range(1, len(motion.angles_deg)):
        poses = tree.body_poses(motion.angles_deg[k - 1])
        placed = _moved(poses[parents], ends)
        cells = _moved(poses[cube_body], cubes[:, None])[:, 0]
        for m in motion.moves[k]:
            turn = float(motion.angles_deg[k, m] - motion.angles_deg[k - 1, m])
            point, axis = turn_axis(tree.hinges[m], poses)
            moving = carried[m, parents]
            meets = _may_meet(placed, cells, point, axis, reach)
            meets &= moving[:, None] != carried[m, cube_body][None, :]
            meets[m] = False
            for h in np.flatnonzero(meets.any(axis=1)).tolist():
                angle = turn if moving[h] else -turn
                for b in np.unique(cube_body[meets[h]]).tolist():
                    if (h, b) not in excluded:
                        found.append(turning_sweep(b, h, placed[h], point, axis, angle, poses[b]))
    return distinct_sweeps(found)


def turn_axis(hinge: Hinge, poses: Floats) -> tuple[Floats, Floats]:
    """Point and direction of a hinge's axis in a state of the path.

    Parameters
    ----------
    hinge : Hinge
        The hinge that turns.
    poses : (b, 4, 4) float64 array
        Pose of every body, lattice units.

    Returns
    -------
    point : (3,) float64 array
        A point of the axis, lattice units.
    axis : (3,) float64 array
        Unit vector along it.
    """
    pose = poses[hinge.parent]
    point = pose[:3, :3] @ np.array(hinge.point) + pose[:3, 3]
    axis = pose[:3, :3] @ np.array(hinge.direction, dtype=float)
    return point, axis


def resting_sweep(body: int, owner: int, points: Floats) -> Sweep:
    """Sweep of what rests beside a body in A.

    Parameters
    ----------
    body : int
        Index of the body.
    owner : int
        Index of the hinge or the link, see :class:`Sweep`.
    points : (k, 3) float64 array
        Points of the barrel's edge or of the plate, lattice units.

    Returns
    -------
    Sweep
        Of angle 0.
    """
    zero = np.zeros(3)
    return Sweep(body, owner, points, zero, zero, 0.0)


def turning_sweep(
    body: int,
    owner: int,
    points: Floats,
    axis_point: Floats,
    axis: Floats,
    angle_deg: float,
    pose: Floats,
) -> Sweep:
    """Sweep of what turns past a body, taken from the frame of the root to that of the body.

    Parameters
    ----------
    body : int
        Index of the body.
    owner : int
        Index of the hinge or the link, see :class:`Sweep`.
    points : (k, 3) float64 array
        Points of the barrel's edge or of the plate where the turn begins, lattice units.
    axis_point : (3,) float64 array
        A point of the axis of the turn, lattice units.
    axis : (3,) float64 array
        Unit vector along the axis of the turn.
    angle_deg : float
        Angle by which the points turn as seen from the body, degrees.
    pose : (4, 4) float64 array
        Pose of the body where the turn begins, lattice units.

    Returns
    -------
    Sweep
        In the body's own frame.
    """
    back = np.eye(4)
    back[:3, :3] = pose[:3, :3].T
    back[:3, 3] = -pose[:3, :3].T @ pose[:3, 3]
    return Sweep(
        body,
        owner,
        points @ back[:3, :3].T + back[:3, 3],
        back[:3, :3] @ axis_point + back[:3, 3],
        back[:3, :3] @ axis,
        angle_deg,
    )


def _coaxial_pairs(tree: FoldTree, edge: Edge) -> list[tuple[int, int]]:
    """Hinges of a double hinge with both axes on one edge, each with the body of the other one.

    Their knuckles lie on one line, so each half is made for the other's barrels already.
    """
    first, second = edge.hinges
    if tree.hinges[first].point != tree.hinges[second].point:
        return []
    return [(first, tree.hinges[second].child), (second, tree.hinges[first].parent)]


def distinct_sweeps(found: list[Sweep]) -> list[Sweep]:
    """The sweeps without those that cover the same region as another, in their order."""
    kept: dict[tuple[object, ...], Sweep] = {}
    for sweep in found:
        kept.setdefault(_key(sweep), sweep)
    return _without_covered_rests(list(kept.values()))


def _moved(poses: Floats, points: Floats) -> Floats:
    """Sets of points (n, k, 3) moved by poses (n, 4, 4)."""
    return np.asarray(np.einsum("nij,nkj->nki", poses[:, :3, :3], points) + poses[:, None, :3, 3])


def _box_distance(segment: Floats, cells: Floats) -> Floats:
    """Lower bound of the distance from a segment along an axis to unit cubes, shape (n,)."""
    low, high = segment.min(axis=0), segment.max(axis=0)
    gap = np.maximum(np.maximum(cells - 0.5 - high, low - cells - 0.5), 0.0)
    return np.asarray(np.linalg.norm(gap, axis=1), dtype=float)


def _may_meet(
    segments: Floats, cells: Floats, point: Floats, axis: Floats, reach: float
) -> NDArray[np.bool_]:
    """Whether barrels (h, 2, 3) can come near unit cubes (n, 3) in a turn about an axis, (h, n).

    Both keep their place along the axis and their distance from it.
    """
    ends = segments - point
    along = ends @ axis
    across = ends - along[..., None] * axis
    chord = across[:, 1] - across[:, 0]
    length2 = np.maximum((chord**2).sum(axis=1), 1e-12)
    foot = np.clip(-(across[:, 0] * chord).sum(axis=1) / length2, 0.0, 1.0)
    nearest = np.linalg.norm(across[:, 0] + foot[:, None] * chord, axis=1)
    farthest = np.linalg.norm(across, axis=2).max(axis=1)
    centre = cells - point
    height = centre @ axis
    radius = np.linalg.norm(centre - height[:, None] * axis, axis=1)
    corner = np.sqrt(0.5)
    return np.asarray(
        (along.min(axis=1)[:, None] - reach < height + 0.5)
        & (along.max(axis=1)[:, None] + reach > height - 0.5)
        & (nearest[:, None] - reach < radius + corner)
        & (farthest[:, None] + reach > radius - corner)
    )


def _points_key(points: Floats) -> tuple[tuple[float, ...], ...]:
    """Equal for the same points (k, 3) in whichever order."""
    return tuple(sorted(tuple((np.round(point, 5) + 0.0).tolist()) for point in points))


def _key(sweep: Sweep) -> tuple[object, ...]:
    """Equal for sweeps that cover the same region, in whichever direction."""
    if sweep.angle_deg == 0.0:
        return (sweep.body, 0.0, _points_key(sweep.points))
    unit, angle = sweep.axis, sweep.angle_deg
    last = sweep.placements(np.array([angle]))[0]
    start, end = _points_key(sweep.points), _points_key(last)
    if end < start:
        start, end, angle = end, start, -angle
    if tuple(np.round(unit, 5)) < tuple(np.round(-unit, 5)):
        unit, angle = -unit, -angle
    foot = sweep.axis_point - (sweep.axis_point @ unit) * unit
    return (
        sweep.body,
        round(angle, 4),
        start,
        end,
        tuple((np.round(foot, 5) + 0.0).tolist()),
        tuple((np.round(unit, 5) + 0.0).tolist()),
    )


def _without_covered_rests(found: list[Sweep]) -> list[Sweep]:
    """Leave out resting barrels that are the start or the end of a turn."""
    covered = set()
    for sweep in found:
        if sweep.angle_deg != 0.0:
            for ends in sweep.placements(np.array([0.0, sweep.angle_deg])):
                covered.add((sweep.body, _points_key(ends)))
    return [
        sweep
        for sweep in found
        if sweep.angle_deg != 0.0 or (sweep.body, _points_key(sweep.points)) not in covered
    ]
