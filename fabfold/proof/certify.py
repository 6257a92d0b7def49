"""The swept proof: no two printed bodies come closer than a gap, at any angle of the folding path.

Section 5 of the paper leaves this to a simulator and a person. Here each move of the path is proven
for all angles that it passes through, on the triangles that are printed, hinges included. The
bounds are those of :mod:`fabfold.proof.gap`, the trees that make it quick :mod:`fabfold.proof.bvh`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import CheckError
from fabfold.fold.motion import Motion, end_pose_error
from fabfold.joinery.barrel_sweeps import descendants, lighter_sides
from fabfold.meshes import mesh_volume
from fabfold.progress import Progress, SilentProgress
from fabfold.proof.bvh import BoxTrees, PlacedBodies, new_bodies, place
from fabfold.proof.gap import FAILED, UNPROVEN, prove_gap, prove_pairs
from fabfold.tree.fold_tree import FoldTree

__all__ = ["certify", "certify_orders"]

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]
_START = "shape A"


def _frame(point: F64, direction: F64) -> F64:
    """Rigid transform that carries an axis onto the z axis; exact for axes along x, y and z."""
    along = direction / np.linalg.norm(direction)
    first = int(np.abs(along).argmin())
    u = np.cross(along, np.eye(3)[first])
    u /= np.linalg.norm(u)
    frame = np.eye(4)
    frame[:3, :3] = np.array([u, np.cross(along, u), along])
    frame[:3, 3] = -frame[:3, :3] @ point
    return frame


@dataclass
class _Bodies:
    """All bodies' triangles in shape A in mm, and the boxes over them.

    Attributes
    ----------
    names : tuple of b str
        Names of the bodies.
    boxes : BoxTrees
        Trees over the triangles.
    placed : PlacedBodies
        The triangles, and where the bodies were last placed.
    voxel_mm : float
        Side of a voxel in mm.
    origin_mm : (3,) float64 array
        Where the lattice's origin is in mm in shape A.
    """

    names: tuple[str, ...]
    boxes: BoxTrees
    placed: PlacedBodies
    voxel_mm: float
    origin_mm: F64

    def in_mm(self, pose: F64) -> F64:
        """Transforms in lattice units, (..., 4, 4), as transforms in mm."""
        out = pose.copy()
        turn = pose[..., :3, :3]
        out[..., :3, 3] = self.voxel_mm * pose[..., :3, 3] + self.origin_mm - turn @ self.origin_mm
        return out


def _load(
    tree: FoldTree,
    meshes: Sequence[tuple[F64, I32]],
    voxel_mm: float,
    origin_mm: Sequence[float],
) -> _Bodies:
    """Triangles of all bodies, and the trees over them; refuses what is no mesh."""
    if len(meshes) != len(tree.bodies):
        raise ValueError(f"{len(tree.bodies)} bodies, but {len(meshes)} meshes")
    triangles = []
    for body, (vertices, faces) in zip(tree.bodies, meshes, strict=True):
        corners = np.asarray(vertices, dtype=float)[np.asarray(faces)]
        if len(corners) == 0 or not np.isfinite(corners).all():
            raise CheckError(f"{body.name}: its mesh is empty or has corners that are no numbers")
        triangles.append(corners)
    boxes, placed = new_bodies(triangles)
    names = tuple(body.name for body in tree.bodies)
    return _Bodies(names, boxes, placed, float(voxel_mm), np.array(origin_mm, float))


def _inside(point: F64, triangle: F64) -> bool:
    """Whether a point, not on the surface, is inside a closed mesh: its winding number."""
    a, b, c = (triangle[:, k] - point for k in range(3))
    la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))
    below = (
        la * lb * lc
        + np.einsum("ij,ij->i", a, b) * lc
        + np.einsum("ij,ij->i", b, c) * la
        + np.einsum("ij,ij->i", c, a) * lb
    )
    return bool(abs(np.arctan2(volume, below).sum() / (2 * np.pi)) > 0.5)


def _probes(vertices: F64, faces: I32) -> F64:
    """One corner of every connected piece of a mesh, shape (p, 3)."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    faces = np.asarray(faces)
    rows = faces[:, (0, 1)].ravel()
    columns = faces[:, (1, 2)].ravel()
    size = len(vertices)
    graph = coo_matrix((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(size, size))
    _, label = connected_components(graph, directed=False)
    used = np.unique(faces)
    _, first = np.unique(label[used], return_index=True)
    return np.asarray(vertices, dtype=float)[used[first]]


def _check_nesting(names: Sequence[str], meshes: Sequence[tuple[F64, I32]]) -> None:
    """Refuse a body inside another; their surfaces are known not to meet."""
    bounds = [(v.min(axis=0), v.max(axis=0)) for v, _ in meshes]
    probes = [_probes(v, f) for v, f in meshes]
    for outer, (vertices, faces) in enumerate(meshes):
        low, high = bounds[outer]
        for inner, points in enumerate(probes):
            if inner == outer:
                continue
            for point in points[((points > low) & (points < high)).all(axis=1)]:
                if _inside(point, np.asarray(vertices, dtype=float)[np.asarray(faces)]):
                    raise CheckError(
                        f"{_START}: {names[inner]} lies inside {names[outer]} at "
                        f"{np.round(point, 3).tolist()} mm; two bodies may not share material"
                    )


def _refuse(
    verdict: int, where: str, bodies: _Bodies, pair: I32, result: F64, asked: float
) -> None:
    """Raise for a proof that failed; the boxes are still where it failed."""
    a, b = (bodies.names[int(i)] for i in pair)
    angle = f" at {math.degrees(result[2]):.3f}° of the move" if where != _START else ""
    if verdict == FAILED:
        # The proof stops at the first distance that is too small: say the smallest at that angle.
        least = np.array([result[0], np.inf, 0.0])
        prove_gap(bodies.boxes, pair[0], pair[1], result[2], result[2], -1.0, 1e-9, least)
        told = "run into each other" if least[0] <= 0 else f"come within {max(least[0], 0):.4f} mm"
        raise CheckError(
            f"{where}: {a} and {b} {told}{angle}, less than the {asked:g} mm "
            "asked for; more clearance, deeper grooves or another tree is needed"
        )
    if verdict == UNPROVEN:
        raise CheckError(
            f"{where}: a gap of {asked:g} mm between {a} and {b} cannot be proven{angle}; "
            "ask for a slightly smaller gap"
        )


def _figure(value: float) -> float:
    """A lower bound to write down, rounded down to 0.1 µm."""
    return math.floor(value * 1e4) / 1e4


def certify(
    tree: FoldTree,
    motion: Motion,
    meshes: Sequence[tuple[F64, I32]],
    voxel_mm: float,
    origin_mm: Sequence[float],
    min_gap_mm: float,
    progress: Progress | None = None,
    *,
    slack_mm: float = 0.01,
) -> dict[str, Any]:
    """Prove that all bodies keep a gap on the whole folding path.

    In shape A all pairs of bodies are measured, and none may lie inside another. In each move the
    bodies that turn are proven against those that stay, for all angles of the move; bodies that
    keep their places relative to each other need no new proof. So every pair is covered at every
    instant, bodies joined by a hinge too.

    Parameters
    ----------
    tree : FoldTree
        What folds.
    motion : Motion
        Its path, one hinge a move.
    meshes : sequence of (vertices, faces)
        Closed triangle meshes of ``tree.bodies``, in their order: (v, 3) float64 in mm, shape A,
        and (f, 3) int32.
    voxel_mm : float
        Side of a voxel in mm.
    origin_mm : (3,) sequence of float
        ``origin_mm + voxel_mm * lattice`` is mm in shape A.
    min_gap_mm : float
        The gap that must be proven, mm, above 0.
    progress : Progress, optional
        Hears of every move.
    slack_mm : float
        How far the certified figures may stay below the smallest distance really met, mm.

    Returns
    -------
    dict
        Ready for ``motion.json``: ``geometry`` (what was proven, in words), ``min_gap_mm`` (proven
        lower bound over the whole path), ``seen_gap_mm`` (smallest distance measured, an upper
        bound), ``moves`` (one ``{"min_gap_mm", "hinge", "from_deg", "to_deg"}`` a move) and
        ``end_pose_error`` (voxel sides). Figures of proven gaps are capped at twice `min_gap_mm`.

    Raises
    ------
    CheckError
        If two bodies come closer, lie in each other, or the path does not end in shape B. The
        message names the bodies, the move and the angle.
    ValueError
        If the meshes do not match the bodies, more than one hinge turns in a move, or a
        parameter is out of range.
    """
    if min_gap_mm <= 0 or slack_mm <= 0:
        raise ValueError("min_gap_mm and slack_mm must be above 0")
    progress = progress or SilentProgress()
    bodies = _load(tree, meshes, voxel_mm, origin_mm)
    everyone = np.arange(len(bodies.names), dtype=np.int32)
    ceiling = 2.0 * min_gap_mm
    wanted = min_gap_mm - 1e-9

    progress.update(0.0, "measuring the gaps in shape A")
    poses = tree.body_poses(motion.angles_deg[0])
    place(bodies.boxes, bodies.placed, bodies.in_mm(poses))
    pair = np.zeros(2, dtype=np.int32)
    result = np.array([ceiling, np.inf, 0.0])
    verdict = prove_pairs(
        bodies.boxes, bodies.placed, everyone, everyone, 0.0, 0.0, wanted, 1e-6, result, pair
    )
    _refuse(verdict, _START, bodies, pair, result, min_gap_mm)
    _check_nesting(bodies.names, meshes)
    seen = float(result[0])
    proven = min(ceiling, float(result[1]))

    moves: list[dict[str, Any]] = []
    total = len(motion.moves) - 1
    for number in range(1, total + 1):
        before, after = motion.angles_deg[number - 1], motion.angles_deg[number]
        turning = np.flatnonzero(before != after)
        if len(turning) != 1:
            raise ValueError(f"move {number}: {len(turning)} hinges turn, wants one")
        hinge = int(turning[0])
        where = f"move {number} of {total} ({tree.hinges[hinge].name})"
        progress.update((number - 1) / total, f"proving {where}, least gap {proven:.3f} mm")
        result = _move(tree, bodies, before, hinge, float(after[hinge] - before[hinge]),
                       wanted, slack_mm, min(seen, ceiling), where, min_gap_mm)  # fmt: skip
        seen = min(seen, float(result[0]))
        least = min(ceiling, float(result[1]))
        proven = min(proven, least)
        moves.append(
            {
                "min_gap_mm": _figure(least),
                "hinge": tree.hinges[hinge].name,
                "from_deg": float(before[hinge]),
                "to_deg": float(after[hinge]),
            }
        )
    error = end_pose_error(tree, motion.angles_deg[-1])
    if error > 1e-6:
        raise CheckError(
            f"the path ends {error:.2g} voxels away from shape B; plan the folding path again"
        )
    progress.update(1.0, f"least gap {proven:.3f} mm")
    count = len(bodies.placed.triangle)
    return {
        "geometry": (
            f"printed bodies with hinges, {len(meshes)} bodies of {count} triangles together; "
            "every pair of bodies at every angle of every move; gaps are proven lower bounds "
            f"within {slack_mm:g} mm of the smallest distance met, capped at {ceiling:g} mm"
        ),
        "min_gap_mm": _figure(proven),
        "seen_gap_mm": round(seen, 4),
        "moves": moves,
        "end_pose_error": error,
    }


def certify_orders(
    tree: FoldTree,
    motion: Motion,
    meshes: Sequence[tuple[F64, I32]],
    voxel_mm: float,
    origin_mm: Sequence[float],
    min_gap_mm: float,
    progress: Progress | None = None,
    *,
    volume: F64 | None = None,
    most: int = 3,
    slack_mm: float = 0.01,
) -> list[tuple[int, int]]:
    """Moves next to each other that may be made in any order, and keep the gap in each.

    Moves of a group turn parts that have no body in common, the smaller side of each hinge. Every
    move of it is proven from every state in which some of the others are made already.

    Parameters
    ----------
    tree, motion, meshes, voxel_mm, origin_mm, min_gap_mm, slack_mm
        As for :func:`certify`, which the path has passed.
    progress : Progress, optional
        Hears of every group.
    volume : (b,) float64 array, optional
        Of every body, as it decides which side of a hinge is turned; that of the meshes by default.
    most : int
        Moves of a group at most.

    Returns
    -------
    list of (first, last)
        Numbers of moves, from 1; groups of at least two, in order.
    """
    progress = progress or SilentProgress()
    bodies = _load(tree, meshes, voxel_mm, origin_mm)
    hinges = [int(moving[0]) for moving in motion.moves[1:]]
    if volume is None:
        volume = np.array([mesh_volume(vertices, faces) for vertices, faces in meshes])
    parts = lighter_sides(tree, volume)[hinges]
    groups: list[tuple[int, int]] = []
    first = 0
    while first < len(hinges):
        last = first
        while last + 1 < len(hinges) and last + 1 - first < most:
            more = range(first, last + 2)
            if any((parts[last + 1] & parts[other]).any() for other in more[:-1]):
                break
            progress.update(first / len(hinges), f"moves {first + 1} to {last + 2} in any order")
            if not _in_any_order(tree, motion, bodies, list(more), min_gap_mm, slack_mm):
                break
            last += 1
        if last > first:
            groups.append((first + 1, last + 1))
        first = last + 1
    return groups


def _in_any_order(
    tree: FoldTree, motion: Motion, bodies: _Bodies, moves: list[int], gap: float, slack: float
) -> bool:
    """Whether each of some moves, counted from 0, keeps the gap whichever others are made."""
    start = motion.angles_deg[moves[0]]
    turns = [motion.angles_deg[move + 1] - motion.angles_deg[move] for move in moves]
    # The last one was added to moves for which this is known: what involves it is new.
    for number, turn in enumerate(turns):
        others = [other for other in range(len(turns)) if other != number]
        for count in range(len(others) + 1):
            for made in combinations(others, count):
                if number != len(turns) - 1 and len(turns) - 1 not in made:
                    continue
                if made == tuple(range(number)):
                    continue  # The order of the path itself.
                before = start + sum((turns[other] for other in made), np.zeros(len(start)))
                hinge = int(np.flatnonzero(turn)[0])
                try:
                    _move(tree, bodies, before, hinge, float(turn[hinge]), gap - 1e-9, slack,
                          2.0 * gap, f"hinge {hinge}", gap)  # fmt: skip
                except CheckError:
                    return False
    return True


def _move(
    tree: FoldTree,
    bodies: _Bodies,
    before: F64,
    hinge: int,
    turn_deg: float,
    wanted: float,
    slack: float,
    seen: float,
    where: str,
    asked: float,
) -> F64:
    """Prove one move; returns smallest distance seen and least bound proven."""
    poses = tree.body_poses(before)
    axis = tree.hinges[hinge]
    parent = poses[axis.parent]
    point = parent[:3, :3] @ np.array(axis.point) + parent[:3, 3]
    direction = parent[:3, :3] @ np.array(axis.direction, dtype=float)
    frame = _frame(point * bodies.voxel_mm + bodies.origin_mm, direction)
    place(bodies.boxes, bodies.placed, frame @ bodies.in_mm(poses))
    inside = descendants(tree)[hinge]
    turning = np.flatnonzero(inside).astype(np.int32)
    resting = np.flatnonzero(~inside).astype(np.int32)
    pair = np.zeros(2, dtype=np.int32)
    result = np.array([seen, np.inf, 0.0])
    parts = max(1, math.ceil(abs(turn_deg) / 90.0 - 1e-9))
    for part in range(parts):
        ends = sorted(math.radians(turn_deg) * share / parts for share in (part, part + 1))
        verdict = prove_pairs(
            bodies.boxes,
            bodies.placed,
            turning,
            resting,
            ends[0],
            ends[1],
            wanted,
            slack,
            result,
            pair,
        )
        _refuse(verdict, where, bodies, pair, result, asked)
    return result
