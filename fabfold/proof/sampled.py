"""A second opinion on the folding path by other libraries: the printed bodies at many angles.

The proof of :mod:`fabfold.proof.certify` covers every angle, by code of this project. This check
shares no code with it: forward kinematics of its own from the content of ``tree.json`` and
``motion.json``, collision and distance by FCL, volumes by manifold3d. It proves nothing between its
samples, but a fault that both have is hard to imagine.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fabfold.progress import Progress, SilentProgress

__all__ = ["SampledPath", "sample_path"]

F64 = NDArray[np.float64]
Mesh = tuple[NDArray[np.float64], NDArray[np.int32]]
Poses = dict[str, F64]


@dataclass(frozen=True)
class SampledPath:
    """What was seen along a path.

    Attributes
    ----------
    step_deg : float
        Degrees between two poses at which collisions were looked for.
    gap_step_deg : float
        Degrees between two poses at which the distance was measured.
    poses : int
        Number of poses looked at.
    least_mm : float
        Smallest distance of two bodies measured, mm; 0.0 where some collide.
    where : str
        Where that was: move, angle and bodies.
    hits : tuple of str
        The first collision of every move that has one: move, angle and bodies.
    overlap_mm3 : float
        Volume that bodies share in shape A and in shape B, mm³; finds a body inside another.
    """

    step_deg: float
    gap_step_deg: float
    poses: int
    least_mm: float
    where: str
    hits: tuple[str, ...]
    overlap_mm3: float

    @property
    def ok(self) -> bool:
        """Whether no two bodies were seen to touch."""
        return not self.hits and self.least_mm > 0.0


def _turn(point: F64, direction: Sequence[float], degrees: float) -> F64:
    """Rigid transform that turns space about a line (Rodrigues), shape (4, 4)."""
    x, y, z = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
    sine, cosine = math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
    rest = 1.0 - cosine
    out = np.eye(4)
    out[:3, :3] = [
        [cosine + x * x * rest, x * y * rest - z * sine, x * z * rest + y * sine],
        [y * x * rest + z * sine, cosine + y * y * rest, y * z * rest - x * sine],
        [z * x * rest - y * sine, z * y * rest + x * sine, cosine + z * z * rest],
    ]
    out[:3, 3] = point - out[:3, :3] @ point
    return out


class _Linkage:
    """Bodies and hinges by name, in mm."""

    def __init__(self, tree: Mapping[str, Any], names: Sequence[str]) -> None:
        scale, origin = float(tree["voxel_mm"]), np.array(tree["origin_mm"], dtype=float)
        self.root = str(tree["bodies"][0]["name"])
        self.point = {h["name"]: origin + scale * np.array(h["point"]) for h in tree["hinges"]}
        self.direction = {h["name"]: h["dir"] for h in tree["hinges"]}
        self.ends = {h["name"]: (h["parent"], h["child"]) for h in tree["hinges"]}
        self.names = list(names)

    def poses(self, angles: Mapping[str, float]) -> Poses:
        """Where every body is, as a transform from its place in shape A."""
        out = {self.root: np.eye(4)}
        waiting = list(self.ends)
        while waiting:
            later = []
            for hinge in waiting:
                parent, child = self.ends[hinge]
                if parent not in out:
                    later.append(hinge)
                    continue
                turn = _turn(self.point[hinge], self.direction[hinge], angles[hinge])
                out[child] = out[parent] @ turn
            if len(later) == len(waiting):
                raise ValueError(f"hinges {later} hang on no body that the root carries")
            waiting = later
        return out

    def carried(self, hinge: str) -> set[str]:
        """Bodies that a hinge turns."""
        out = {self.ends[hinge][1]}
        while True:
            more = {child for parent, child in self.ends.values() if parent in out} - out
            if not more:
                return out
            out |= more


def _placed(mesh: Mesh, pose: F64) -> F64:
    """Corners of a mesh moved by a transform, mm."""
    return np.asarray(mesh[0], dtype=float) @ pose[:3, :3].T + pose[:3, 3]


class _FclBody:
    """A body as a mesh of FCL, and the box around it in shape A."""

    def __init__(self, mesh: Mesh) -> None:
        import fcl

        vertices, faces = np.asarray(mesh[0], dtype=float), np.asarray(mesh[1])
        model = fcl.BVHModel()
        model.beginModel(len(vertices), len(faces))
        model.addSubModel(vertices, faces)
        model.endModel()
        self.thing = fcl.CollisionObject(model)
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        self.middle, self.half = (low + high) / 2, (high - low) / 2

    def put(self, pose: F64) -> None:
        """Move the body by a transform, from its place in shape A."""
        import fcl

        self.thing.setTransform(fcl.Transform(pose[:3, :3], pose[:3, 3]))


class _Placed:
    """Some bodies where transforms put them, with boxes that hold them there."""

    def __init__(self, bodies: Mapping[str, _FclBody], poses: Poses) -> None:
        self.names = list(poses)
        self.poses = poses
        turns = np.array([pose[:3, :3] for pose in poses.values()])
        moves = np.array([pose[:3, 3] for pose in poses.values()])
        middles = np.array([bodies[name].middle for name in self.names])
        halves = np.array([bodies[name].half for name in self.names])
        middle = np.einsum("bij,bj->bi", turns, middles) + moves
        half = np.einsum("bij,bj->bi", np.abs(turns), halves)
        self.low, self.high = middle - half, middle + half

    def apart(self, other: _Placed) -> F64:
        """Distances between the boxes of these and of others, (b, c)."""
        away = np.maximum(
            self.low[:, None] - other.high[None, :], other.low[None, :] - self.high[:, None]
        )
        return np.asarray(np.linalg.norm(np.maximum(away, 0.0), axis=2))


def _overlap(meshes: Mapping[str, Mesh], poses: Poses) -> float:
    """Volume of all bodies together less that of their union."""
    import manifold3d

    solids = [
        manifold3d.Manifold(
            manifold3d.Mesh64(
                np.ascontiguousarray(_placed(mesh, poses[name])),
                np.ascontiguousarray(mesh[1], dtype=np.uint64),
            )
        )
        for name, mesh in meshes.items()
    ]
    whole = manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add)
    return max(0.0, float(sum(solid.volume() for solid in solids) - whole.volume()))


class _Sightings:
    """What was seen so far of some bodies."""

    def __init__(self, bodies: Mapping[str, _FclBody]) -> None:
        self.bodies = bodies
        self.least = math.inf
        self.where = ""
        self.hits: list[str] = []
        self.poses = 0

    def see(self, ones: _Placed, others: _Placed, apart: F64, where: str, measure: bool) -> bool:
        """Look at pairs of bodies in one pose; False where two collide.

        `others` have been put there. Boxes that are `apart` rule out that two collide, or are
        nearer than the nearest so far.
        """
        import fcl

        self.poses += 1
        reach = self.least if measure else 0.0
        near = np.argwhere(apart <= reach)
        near = near[np.argsort(apart[near[:, 0], near[:, 1]], kind="stable")]
        for i in np.unique(near[:, 0]).tolist():
            self.bodies[ones.names[i]].put(ones.poses[ones.names[i]])
        pairs = [(ones.names[i], others.names[j], apart[i, j]) for i, j in near.tolist()]
        for one, two, away in pairs:
            if away <= 0.0 and fcl.collide(self.bodies[one].thing, self.bodies[two].thing):
                self.hits.append(f"{where}: {one} and {two}")
                self.least, self.where = 0.0, self.hits[0]
                return False
        for one, two, away in pairs if measure else []:
            if away >= self.least:
                break
            gap = max(0.0, float(fcl.distance(self.bodies[one].thing, self.bodies[two].thing)))
            if gap < self.least:
                self.least, self.where = gap, f"{where}: {one} and {two}"
        return True


def _see_start(watch: _Sightings, poses: Poses) -> None:
    """All pairs in shape A."""
    placed = _Placed(watch.bodies, poses)
    for name, pose in poses.items():
        watch.bodies[name].put(pose)
    apart = placed.apart(placed)
    apart[np.triu_indices(len(apart))] = np.inf  # each pair once
    watch.see(placed, placed, apart, "shape A", True)


def sample_path(
    tree: Mapping[str, Any],
    motion: Mapping[str, Any],
    meshes: Mapping[str, Mesh],
    *,
    step_deg: float = 1.0,
    gap_step_deg: float | None = None,
    progress: Progress | None = None,
) -> SampledPath:
    """Look at the printed bodies along the whole folding path, one pose every degree.

    In shape A all pairs of bodies are looked at; in each move those that turn against those that
    stay, since the others do not move relative to each other.

    Parameters
    ----------
    tree, motion : mapping
        The content of ``tree.json`` and ``motion.json``; one hinge turns in a move.
    meshes : mapping of str to (vertices, faces)
        Closed mesh of every body by name, link plates of double hinges included: (v, 3) in mm in
        shape A, (f, 3) corners of the triangles.
    step_deg : float
        Most degrees between two poses that are searched for collisions.
    gap_step_deg : float, optional
        The same for the distance, which takes FCL some twenty times as long; default `step_deg`.
        It is measured in shape A and at the end of every move in any case.
    progress : Progress, optional
        Hears of every move.

    Returns
    -------
    SampledPath
        What was seen: collisions, the smallest distance, shared volume.

    Raises
    ------
    ValueError
        If a body has no mesh, more than one hinge turns in a move, or a step is not above 0.
    """
    progress = progress or SilentProgress()
    gap_step = step_deg if gap_step_deg is None else gap_step_deg
    if not (step_deg > 0 and gap_step > 0):
        raise ValueError("step_deg and gap_step_deg must be above 0")
    names = [str(body["name"]) for body in tree["bodies"]]
    if set(names) != set(meshes):
        raise ValueError(f"no mesh for {sorted(set(names) ^ set(meshes))}, or no such body")
    linkage = _Linkage(tree, names)
    hinges: list[str] = list(motion["hinges"])
    frames = [np.array(frame["angles_deg"], dtype=float) for frame in motion["keyframes"]]

    def poses_at(angles: F64) -> Poses:
        return linkage.poses(dict(zip(hinges, angles.tolist(), strict=True)))

    watch = _Sightings({name: _FclBody(mesh) for name, mesh in meshes.items()})
    progress.update(0.0, "looking at shape A")
    _see_start(watch, poses_at(frames[0]))
    overlap = _overlap(meshes, poses_at(frames[0])) + _overlap(meshes, poses_at(frames[-1]))
    total = len(frames) - 1
    for number in range(1, total + 1):
        before, after = frames[number - 1 : number + 1]
        turning = np.flatnonzero(before != after)
        if len(turning) != 1:
            raise ValueError(f"move {number}: {len(turning)} hinges turn, wants one")
        hinge = hinges[int(turning[0])]
        turn = float((after - before)[turning[0]])
        move = f"move {number} of {total} ({hinge})"
        progress.update((number - 1) / total, f"looking at {move}")
        _see_move(watch, linkage, poses_at(before), hinge, turn, move, step_deg, gap_step)
    progress.update(1.0, f"{watch.poses} poses, smallest gap {watch.least:.3f} mm")
    return SampledPath(
        step_deg=step_deg,
        gap_step_deg=gap_step,
        poses=watch.poses,
        least_mm=watch.least,
        where=watch.where,
        hits=tuple(watch.hits),
        overlap_mm3=overlap,
    )


def _see_move(
    watch: _Sightings,
    linkage: _Linkage,
    poses: Poses,
    hinge: str,
    turn: float,
    move: str,
    step: float,
    gap_step: float,
) -> None:
    """All poses of one move, up to its first collision."""
    carried = linkage.carried(hinge)
    resting = _Placed(watch.bodies, {n: poses[n] for n in linkage.names if n not in carried})
    for name, pose in resting.poses.items():
        watch.bodies[name].put(pose)
    parent = poses[linkage.ends[hinge][0]]
    point = parent[:3, :3] @ linkage.point[hinge] + parent[:3, 3]
    direction = parent[:3, :3] @ np.array(linkage.direction[hinge], dtype=float)
    count = max(1, math.ceil(abs(turn) / step - 1e-9))
    every = max(1, math.floor(gap_step / (abs(turn) / count) + 1e-9))
    for k in range(count + 1):
        angle = turn * k / count
        turned = _turn(point, direction, angle)
        moving = _Placed(
            watch.bodies, {n: turned @ poses[n] for n in linkage.names if n in carried}
        )
        where = f"{move}, {abs(angle):g}°"
        # At the start each pair stands as shape A or an earlier move has left it, and was measured.
        measure = k > 0 and (k % every == 0 or k == count)
        if not watch.see(moving, resting, moving.apart(resting), where, measure):
            return
