"""Grooves: room for hinge barrels wherever they pass on the folding path.

A barrel stands out of its two bodies by its radius, around a lattice edge. The path was planned
for cubes, which know nothing of barrels, so every other body loses what comes closer to a barrel
than the clearance, in shape A, in shape B and in all states between.

Seen from a body, a barrel either rests or turns about the axis of the hinge that is moving. The
turn is cut into steps, and each step is covered by the convex hull of the barrel at its two ends.
The hull of two placements misses at most the sagitta of the arc, by which the barrel is thickened,
so the groove contains the true swept region. It exceeds it by hundredths of a millimetre, and by
up to 0.15 mm where a barrel across the axis turns on itself between two placements.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.fold.motion import Motion
from fabfold.tree.fold_tree import Edge, FoldTree

if TYPE_CHECKING:
    import manifold3d

__all__ = [
    "SAGITTA_MM",
    "Passage",
    "descendants",
    "distinct",
    "groove_tools",
    "inverse",
    "passages",
    "step_deg",
]

#: How far the hull of two placements may fall short of the arc between them, in mm.
SAGITTA_MM = 0.02
#: How far the hull may go beyond a barrel that turns on itself between two placements, in mm.
_EXCESS_MM = 0.15
_MAX_STEP_DEG = 6.0
_SIDES = 24

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Passage:
    """One way in which a barrel comes past a body, in the body's own frame (its place in A).

    Link plates pass in the same ways (:mod:`fabfold.joinery.pockets`).

    Attributes
    ----------
    body : int
        The body that it passes.
    hinge : int
        The hinge whose barrel it is (the first found, if several go the same way); of a plate, the
        index of its link.
    start : (2, 3) float64 array
        Ends of the lattice edge that carries the barrel, lattice units; of a plate, all corners.
    point, direction : (3,) float64 arrays
        Axis of the turn, lattice units; unused if `angle_deg` is 0.
    angle_deg : float
        Signed right-handed turn; 0 for a barrel that rests.
    """

    body: int
    hinge: int
    start: Floats
    point: Floats
    direction: Floats
    angle_deg: float

    def placements(self, angles_deg: Floats) -> Floats:
        """`start` at some angles of the turn, shape (a, 2, 3)."""
        radians = np.radians(np.asarray(angles_deg, dtype=float))[:, None, None]
        away = self.start - self.point
        along = (away @ self.direction)[:, None] * self.direction
        turned = np.cos(radians) * (away - along) + np.sin(radians) * np.cross(self.direction, away)
        return np.asarray(self.point + along + turned)


def descendants(tree: FoldTree) -> NDArray[np.bool_]:
    """Which bodies each hinge carries, shape (hinges, bodies)."""
    moves = np.zeros((len(tree.hinges), len(tree.bodies)), dtype=bool)
    for index in range(len(tree.hinges) - 1, -1, -1):
        child = tree.hinges[index].child
        moves[index, child] = True
        for later in range(index + 1, len(tree.hinges)):
            if tree.hinges[later].parent == child:
                moves[index] |= moves[later]
    return moves


def passages(tree: FoldTree, motion: Motion, reach: float) -> list[Passage]:
    """Every distinct way in which a barrel may come past a body that it does not belong to.

    Parameters
    ----------
    tree : FoldTree
    motion : Motion
        One hinge a move, linear between keyframes.
    reach : float
        Radius of a groove in lattice units; passages that stay farther than this from every cell
        of the body are left out.

    Returns
    -------
    list of Passage
        In a fixed order.
    """
    carried = descendants(tree)
    # A link's plate lies within a cube about the middle of its face.
    links = [
        (index, tree.edges[b.edge]) for index, b in enumerate(tree.bodies) if b.edge is not None
    ]
    middles = [(tree.source[edge.parent] + tree.source[edge.child]) / 2.0 for _, edge in links]
    places = np.concatenate([tree.source.astype(float), np.array(middles).reshape(-1, 3)])
    owner = np.concatenate([tree.voxel_body, np.array([b for b, _ in links], dtype=np.int32)])
    apart = {pair for _, edge in links for pair in _one_line(tree, edge)}
    ends = np.array(
        [
            [np.array(h.point) + s * 0.5 * np.array(h.direction, dtype=float) for s in (-1, 1)]
            for h in tree.hinges
        ]
    ).reshape(-1, 2, 3)
    parents = np.array([h.parent for h in tree.hinges], dtype=int)
    found: list[Passage] = []
    zero = np.zeros(3)
    for h, hinge in enumerate(tree.hinges):
        near = _box_distance(ends[h], places) < reach
        for b in np.unique(owner[near]).tolist():
            if b not in (hinge.parent, hinge.child) and (h, b) not in apart:
                found.append(Passage(b, h, ends[h], zero, zero, 0.0))
    for k in range(1, len(motion.angles_deg)):
        poses = tree.body_poses(motion.angles_deg[k - 1])
        placed = _moved(poses[parents], ends)
        cells = _moved(poses[owner], places[:, None])[:, 0]
        for m in motion.moves[k]:
            turn = float(motion.angles_deg[k, m] - motion.angles_deg[k - 1, m])
            world = poses[parents[m]]
            point = world[:3, :3] @ np.array(tree.hinges[m].point) + world[:3, 3]
            axis = world[:3, :3] @ np.array(tree.hinges[m].direction, dtype=float)
            moving = carried[m, parents]
            meets = _may_meet(placed, cells, point, axis, reach)
            meets &= moving[:, None] != carried[m, owner][None, :]
            meets[m] = False
            for h in np.flatnonzero(meets.any(axis=1)).tolist():
                for b in np.unique(owner[meets[h]]).tolist():
                    if (h, b) in apart:
                        continue
                    back = inverse(poses[b])
                    found.append(
                        Passage(
                            b,
                            h,
                            placed[h] @ back[:3, :3].T + back[:3, 3],
                            back[:3, :3] @ point + back[:3, 3],
                            back[:3, :3] @ axis,
                            turn if moving[h] else -turn,
                        )
                    )
    return distinct(found)


def _one_line(tree: FoldTree, edge: Edge) -> list[tuple[int, int]]:
    """Hinges of a double hinge with both axes on one edge, each with the body of the other one.

    They share their knuckles' line, so each half is made for the other's barrels already.
    """
    first, second = edge.hinges
    if tree.hinges[first].point != tree.hinges[second].point:
        return []
    return [(first, tree.hinges[second].child), (second, tree.hinges[first].parent)]


def distinct(found: list[Passage]) -> list[Passage]:
    """The passages without those that sweep the same region as another, in their order."""
    kept: dict[tuple[object, ...], Passage] = {}
    for passage in found:
        kept.setdefault(_key(passage), passage)
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
    way = across[:, 1] - across[:, 0]
    length2 = np.maximum((way**2).sum(axis=1), 1e-12)
    foot = np.clip(-(across[:, 0] * way).sum(axis=1) / length2, 0.0, 1.0)
    nearest = np.linalg.norm(across[:, 0] + foot[:, None] * way, axis=1)
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


def inverse(pose: Floats) -> Floats:
    """The rigid transform that undoes another, (4, 4)."""
    back = np.eye(4)
    back[:3, :3] = pose[:3, :3].T
    back[:3, 3] = -pose[:3, :3].T @ pose[:3, 3]
    return back


def _segment_key(ends: Floats) -> tuple[tuple[float, ...], ...]:
    return tuple(sorted(tuple((np.round(end, 5) + 0.0).tolist()) for end in ends))


def _key(passage: Passage) -> tuple[object, ...]:
    """Equal for passages that sweep the same region, in whichever direction."""
    if passage.angle_deg == 0.0:
        return (passage.body, 0.0, _segment_key(passage.start))
    unit, angle = passage.direction, passage.angle_deg
    last = passage.placements(np.array([angle]))[0]
    start, end = _segment_key(passage.start), _segment_key(last)
    if end < start:
        start, end, angle = end, start, -angle
    if tuple(np.round(unit, 5)) < tuple(np.round(-unit, 5)):
        unit, angle = -unit, -angle
    foot = passage.point - (passage.point @ unit) * unit
    return (
        passage.body,
        round(angle, 4),
        start,
        end,
        tuple((np.round(foot, 5) + 0.0).tolist()),
        tuple((np.round(unit, 5) + 0.0).tolist()),
    )


def _without_covered_rests(found: list[Passage]) -> list[Passage]:
    """Leave out resting barrels that are the start or the end of a turn."""
    covered = set()
    for passage in found:
        if passage.angle_deg != 0.0:
            for ends in passage.placements(np.array([0.0, passage.angle_deg])):
                covered.add((passage.body, _segment_key(ends)))
    return [
        passage
        for passage in found
        if passage.angle_deg != 0.0 or (passage.body, _segment_key(passage.start)) not in covered
    ]


def _segment_distance(placements: Floats, low: Floats, high: Floats) -> Floats:
    """Lower bound of the distance from barrels' edges to a set of boxes, shape (a,)."""
    samples = np.linspace(0.0, 1.0, 9)
    points = placements[:, :1] + samples[:, None] * (placements[:, 1:] - placements[:, :1])
    flat = points.reshape(-1, 1, 3)
    outside = np.maximum(np.maximum(low - flat, flat - high), 0.0)
    nearest = np.linalg.norm(outside, axis=2).min(axis=1).reshape(len(placements), -1).min(axis=1)
    return np.asarray(nearest - 0.5 / (len(samples) - 1), dtype=float)


def _rods(ends: Floats, radius: float, trim: float) -> Floats:
    """Points whose hulls are rods about segments (a, 2, 3) in mm, shortened by `trim` at each end.

    The polygon is drawn about the circle, so a rod contains the round one.

    Returns
    -------
    (a, 2 * _SIDES, 3) float64 array
    """
    axis = ends[:, 1] - ends[:, 0]
    axis = axis / np.linalg.norm(axis, axis=1, keepdims=True)
    helper = np.eye(3)[np.abs(axis).argmin(axis=1)]
    across = np.cross(axis, helper)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    upright = np.cross(axis, across)
    angles = 2 * np.pi * np.arange(_SIDES) / _SIDES
    ring = np.cos(angles)[:, None] * across[:, None] + np.sin(angles)[:, None] * upright[:, None]
    ring *= radius / np.cos(np.pi / _SIDES)
    start, end = ends[:, 0] + trim * axis, ends[:, 1] - trim * axis
    return np.concatenate([start[:, None] + ring, end[:, None] + ring], axis=1)


def groove_tools(
    found: list[Passage],
    low: Floats,
    high: Floats,
    *,
    voxel_mm: float,
    radius_mm: float,
    trim_mm: float,
) -> list[tuple[int, manifold3d.Manifold]]:
    """Cutting solids for one body.

    Parameters
    ----------
    found : list of Passage
        The passages of this body.
    low, high : (m, 3) float64 arrays
        Boxes that hold the body's material, lattice units.
    voxel_mm : float
    radius_mm : float
        Barrel radius and clearance.
    trim_mm : float
        How much shorter than the lattice edge the groove is at each end.

    Returns
    -------
    list of (int, manifold3d.Manifold)
        Hinge and convex solid in mm; solids may overlap each other.
    """
    import manifold3d

    tools = []
    reach = (radius_mm + SAGITTA_MM) / voxel_mm / np.cos(np.pi / _SIDES)
    for passage in found:
        if passage.angle_deg == 0.0:
            if _segment_distance(passage.start[None], low, high)[0] < reach:
                (rod,) = _rods(passage.start[None] * voxel_mm, radius_mm, trim_mm)
                tools.append((passage.hinge, manifold3d.Manifold.hull_points(rod)))
            continue
        arm = _arm(passage)
        step = step_deg(passage, voxel_mm)
        count = max(1, int(np.ceil(abs(passage.angle_deg) / step)))
        angles = np.linspace(0.0, passage.angle_deg, count + 1)
        # A bound at every step end, widened by the way a point makes in half a step.
        placements = passage.placements(angles)
        slack = arm * np.radians(abs(passage.angle_deg) / count) / 2
        near = _segment_distance(placements, low, high) < reach + slack
        wanted = near[:-1] | near[1:]
        rods = _rods(placements * voxel_mm, radius_mm + SAGITTA_MM, trim_mm - SAGITTA_MM)
        for index in np.flatnonzero(wanted):
            hull = manifold3d.Manifold.hull_points(rods[index : index + 2].reshape(-1, 3))
            tools.append((passage.hinge, hull))
    return tools


def step_deg(passage: Passage, voxel_mm: float, excess_mm: float = _EXCESS_MM) -> float:
    """Largest step of a turn whose hulls keep to the bounds on both sides.

    Parameters
    ----------
    passage : Passage
    voxel_mm : float
    excess_mm : float
        How far a hull may go beyond what turns on itself between two placements.
    """
    sagitta = 1.0 - SAGITTA_MM / max(_arm(passage) * voxel_mm, 1e-9)
    step = 2.0 * float(np.degrees(np.arccos(max(0.0, sagitta))))
    rise = passage.start @ passage.direction
    flat = passage.start - rise[:, None] * passage.direction
    across = float(np.linalg.norm(flat - flat[0], axis=1).max())
    if across > 1e-6:
        # The two rods cross like the blades of scissors; the hull closes the gap between them.
        step = min(step, 2.0 * float(np.degrees(2.0 * excess_mm / (across * voxel_mm))))
    return min(step, _MAX_STEP_DEG)


def _arm(passage: Passage) -> float:
    """Largest distance of what passes from the axis of the turn, lattice units."""
    away = passage.start - passage.point
    across = away - (away @ passage.direction)[:, None] * passage.direction
    return float(np.linalg.norm(across, axis=1).max())
