"""A kit checked from its files alone, with NumPy and nothing else: no line of fabfold runs here.

The path is walked in steps of a few degrees. At each the bodies are posed by their hinges, and the
smallest distance of every two is found from their triangles.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]

#: What single precision and the proof's own tolerance leave open, in mm.
TOLERANCE = 0.02
#: Distances are looked for up to this, in mm.
FAR = 0.7


@dataclass
class KitFiles:
    """What stands in a kit folder."""

    tree: dict[str, Any]
    motion: dict[str, Any]
    meshes: list[Array]  # (n, 3, 3) corners in mm


def read_kit(folder: Path) -> KitFiles:
    tree = json.loads((folder / "tree.json").read_text("utf-8"))
    motion = json.loads((folder / "motion.json").read_text("utf-8"))
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    meshes = []
    for body in tree["bodies"]:
        data = np.fromfile(folder / "bodies" / f"{body['name']}.stl", dtype=record, offset=84)
        meshes.append(data["corners"].astype(float))
    return KitFiles(tree, motion, meshes)


def turn(point: Array, direction: Array, degrees: float) -> Array:
    """Rotation about a line as a (4, 4) matrix (Rodrigues)."""
    x, y, z = direction / np.linalg.norm(direction)
    cross = np.array([(0, -z, y), (z, 0, -x), (-y, x, 0)])
    angle = np.radians(degrees)
    rotation = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    matrix = np.eye(4)
    matrix[:3, :3] = rotation
    matrix[:3, 3] = point - rotation @ point
    return matrix


def poses(tree: dict[str, Any], angles: Array) -> list[Array]:
    """Pose of every body in mm; the first stays."""
    names = [body["name"] for body in tree["bodies"]]
    found: dict[str, Array] = {names[0]: np.eye(4)}
    left = list(zip(tree["hinges"], angles, strict=True))
    origin, side = np.array(tree["origin_mm"]), tree["voxel_mm"]
    while left:
        rest = []
        for hinge, angle in left:
            if hinge["parent"] in found:
                point = origin + side * np.array(hinge["point"], float)
                own = turn(point, np.array(hinge["dir"], float), angle)
                found[hinge["child"]] = found[hinge["parent"]] @ own
            else:
                rest.append((hinge, angle))
        if len(rest) == len(left):
            raise AssertionError("the hinges are no tree")
        left = rest
    return [found[name] for name in names]


def point_triangle(points: Array, corners: Array) -> Array:
    """Distance of each point (n, 3) to the inside of its triangle (n, 3, 3); infinite beside it."""
    a, ab, ac = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(ab, ac)
    size = np.maximum((normal * normal).sum(-1), 1e-30)
    away = points - a
    height = (away * normal).sum(-1)
    foot = away - height[:, None] * normal / size[:, None]
    u = (np.cross(foot, ac) * normal).sum(-1) / size
    v = (np.cross(ab, foot) * normal).sum(-1) / size
    inside = (u >= 0) & (v >= 0) & (u + v <= 1)
    return np.where(inside, np.abs(height) / np.sqrt(size), np.inf)


def segments_apart(p: Array, q: Array, r: Array, s: Array) -> Array:
    """Distance of each segment p-q (n, 3) to its segment r-s (n, 3)."""
    d1, d2, w = q - p, s - r, p - r
    a, e = (d1 * d1).sum(-1), (d2 * d2).sum(-1)
    b, c, f = (d1 * d2).sum(-1), (d1 * w).sum(-1), (d2 * w).sum(-1)
    wide = a * e - b * b
    slant = wide > 1e-12
    t1 = np.clip(np.where(slant, (b * f - c * e) / np.where(slant, wide, 1), 0), 0, 1)
    t2 = np.clip((b * t1 + f) / np.maximum(e, 1e-18), 0, 1)
    t1 = np.clip((b * t2 - c) / np.maximum(a, 1e-18), 0, 1)
    return np.asarray(np.linalg.norm(w + t1[:, None] * d1 - t2[:, None] * d2, axis=-1))


def crossing(one: Array, other: Array) -> Array:
    """Whether an edge of each triangle goes through the triangle that it is paired with."""
    a, b, c = other.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    through = np.zeros(len(one), dtype=bool)
    for k in range(3):
        p, q = one[:, k], one[:, (k + 1) % 3]
        hp, hq = ((p - a) * normal).sum(-1), ((q - a) * normal).sum(-1)
        both = hp * hq < 0
        hit = p + (hp / np.where(both, hp - hq, 1))[:, None] * (q - p)
        for corner, following in ((a, b), (b, c), (c, a)):
            both &= (np.cross(following - corner, hit - corner) * normal).sum(-1) > 0
        through |= both
    return through


def near_pairs(one: Array, other: Array) -> tuple[Array, Array]:
    """Triangles of two meshes whose boxes are less than FAR apart, in pairs."""
    low1, high1 = one.min(axis=1), one.max(axis=1)
    low2, high2 = other.min(axis=1), other.max(axis=1)
    keep1 = ((low1 <= high2.max(0) + FAR) & (high1 >= low2.min(0) - FAR)).all(-1)
    keep2 = ((low2 <= high1.max(0) + FAR) & (high2 >= low1.min(0) - FAR)).all(-1)
    rows1, rows2 = np.flatnonzero(keep1), np.flatnonzero(keep2)
    away = np.zeros((len(rows1), len(rows2)))
    for axis in range(3):
        behind = low1[rows1, None, axis] - high2[None, rows2, axis]
        before = low2[None, rows2, axis] - high1[rows1, None, axis]
        away += np.maximum(0.0, np.maximum(behind, before)) ** 2
    first, second = np.nonzero(away < FAR**2)
    return one[rows1[first]], other[rows2[second]]


def gap(one: Array, other: Array) -> float:
    """Distance of two meshes up to FAR; 0 where they cross."""
    first, second = near_pairs(np.asarray(one), np.asarray(other))
    if not len(first):
        return FAR
    if crossing(first, second).any() or crossing(second, first).any():
        return 0.0
    best = FAR
    for k in range(3):
        best = min(best, float(point_triangle(first[:, k], second).min()))
        best = min(best, float(point_triangle(second[:, k], first).min()))
        for n in range(3):
            ends = first[:, k], first[:, (k + 1) % 3], second[:, n], second[:, (n + 1) % 3]
            best = min(best, float(segments_apart(*ends).min()))
    return best


def faults(kit: KitFiles, step_deg: float = 60.0) -> list[str]:
    """Everything that is wrong with a kit, in words; empty for a sound one."""
    found = [*_tree_faults(kit), *_path_faults(kit)]
    return found or _gap_faults(kit, step_deg)


def _tree_faults(kit: KitFiles) -> list[str]:
    tree, found = kit.tree, []
    cells = np.array(tree["source"], float)
    for hinge in tree["hinges"]:
        point, along = np.array(hinge["point"], float), np.array(hinge["dir"], float)
        across = np.abs(along) < 0.5
        if not np.allclose((point[across] - 0.5) % 1.0, 0.0, atol=1e-9):
            found.append(f"{hinge['name']} is off the edges of the voxels")
    origin, side = np.array(tree["origin_mm"]), tree["voxel_mm"]
    for body, mesh in zip(tree["bodies"], kit.meshes, strict=True):
        middle = (origin + side * cells[body["voxels"]]).reshape(-1, 3)
        low, high = mesh.min(axis=(0, 1)), mesh.max(axis=(0, 1))
        if len(middle) and not ((middle > low) & (middle < high)).all():
            found.append(f"{body['name']} does not lie about its voxels")
    return found


def _path_faults(kit: KitFiles) -> list[str]:
    tree, motion, found = kit.tree, kit.motion, []
    names = [hinge["name"] for hinge in tree["hinges"]]
    if motion["hinges"] != names:
        found.append("the path names other hinges than the tree")
    frames = np.array([frame["angles_deg"] for frame in motion["keyframes"]])
    if np.abs(frames[0]).max() > 1e-9:
        found.append("the path does not begin at A")
    wanted = np.array([hinge["angle_deg"] for hinge in tree["hinges"]])
    if not np.allclose(frames[-1], wanted):
        found.append("the path does not end at B")
    for (before, after), frame in zip(pairwise(frames), motion["keyframes"][1:], strict=True):
        moving = {
            name for name, turns in zip(names, after - before, strict=True) if abs(turns) > 1e-9
        }
        if moving != set(frame["moves"]):
            found.append("a keyframe moves other hinges than it says")
    moves = motion["certificate"]["moves"]
    if len(moves) != len(frames) - 1:
        found.append("the certificate has another number of moves than the path")
    # The voxels come to lie in the template.
    origin, side = np.array(tree["origin_mm"]), tree["voxel_mm"]
    root = np.eye(4)
    root[:3, :3] = np.array(tree["root_pose"]["rotation"], float).reshape(3, 3)
    root[:3, 3] = tree["root_pose"]["translation"]
    for body, pose in zip(tree["bodies"], poses(tree, frames[-1]), strict=True):
        for voxel in body["voxels"]:
            here = pose @ np.append(origin + side * np.array(tree["source"][voxel], float), 1.0)
            there = root @ np.append((here[:3] - origin) / side, 1.0)
            if not np.allclose(there[:3], tree["target"][voxel], atol=1e-6):
                found.append(f"voxel {voxel} does not come to its place")
                break
    return found


def _gap_faults(kit: KitFiles, step_deg: float) -> list[str]:
    certificate = kit.motion["certificate"]
    frames = np.array([frame["angles_deg"] for frame in kit.motion["keyframes"]])
    seen = FAR
    for number, (before, after) in enumerate(pairwise(frames)):
        count = max(1, int(np.ceil(np.abs(after - before).max() / step_deg)))
        proven = certificate["moves"][number]["min_gap_mm"]
        for share in np.arange(count + 1) / count:
            placed = poses(kit.tree, before + share * (after - before))
            meshes = [
                mesh @ pose[:3, :3].T + pose[:3, 3]
                for mesh, pose in zip(kit.meshes, placed, strict=True)
            ]
            least = min(gap(meshes[i], meshes[j]) for i in range(len(meshes)) for j in range(i))
            if least < proven - TOLERANCE:
                return [f"move {number}: a gap of {least:.3f} mm, {proven:.3f} is certified"]
            seen = min(seen, least)
    if seen > certificate["seen_gap_mm"] + TOLERANCE:
        return [f"the smallest gap is {seen:.3f} mm, {certificate['seen_gap_mm']:.3f} was seen"]
    return []
