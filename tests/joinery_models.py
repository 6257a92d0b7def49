"""Small models for the tests of joinery and printing: box-shaped strips that fold up."""

from __future__ import annotations

from itertools import pairwise

import manifold3d
import numpy as np
from numpy.typing import NDArray

from fabfold.fold.motion import Motion
from fabfold.joinery.cells import as_manifold, occupancy
from fabfold.lattice.template import Template
from fabfold.tree.fold_tree import Body, Edge, FoldTree, Hinge
from fabfold.voxels.voxel_model import SUBDIVISION, Voxels


def box_mesh(
    low: NDArray[np.float64] | list[float], high: NDArray[np.float64] | list[float]
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Twelve triangles of an axis-aligned box."""
    size = np.subtract(high, low)
    cube = manifold3d.Manifold.cube(tuple(size)).translate(tuple(np.asarray(low, dtype=float)))
    mesh = cube.to_mesh64()
    return np.array(mesh.vert_properties[:, :3]), np.array(mesh.tri_verts, dtype=np.int32)


def voxels_of(cells: NDArray[np.int32], solid) -> Voxels:
    """Voxels of a manifold in lattice units."""
    mesh = solid.to_mesh64()
    step = 1.0 / SUBDIVISION
    subvoxels = np.array(
        [occupancy(solid, c - 0.5 + step / 2, step, (SUBDIVISION,) * 3) for c in cells]
    )
    zero = np.zeros(1)
    return Voxels(
        cells=cells,
        subvoxels=subvoxels,
        fill=subvoxels.mean(axis=(1, 2, 3)),
        vertices=np.array(mesh.vert_properties[:, :3], dtype=float),
        faces=np.array(mesh.tri_verts, dtype=np.int32),
        rotation=np.eye(3),
        origin=np.zeros(3),
        pitch=1.0,
        plane_offsets=(zero, zero, zero),
        lost_volume=0.0,
        energy={},
    )


def strip_tree(length: int, sides: list[int], run: int = 2) -> FoldTree:
    """Strip of cells along x with a hinge after every `run` cells, on the +y or -y side."""
    source = np.array([[i, 0, 0] for i in range(length)], dtype=np.int32)
    bodies = tuple(
        Body(f"body-{b:02d}", tuple(range(start, min(start + run, length))))
        for b, start in enumerate(range(0, length, run))
    )
    hinges = tuple(
        Hinge(
            f"hinge-{h:02d}",
            h,
            h + 1,
            ((h + 1) * run - 0.5, 0.5 * side, 0.0),
            (0, 0, 1),
            180.0 * side,
        )
        for h, side in enumerate(sides)
    )
    edges = []
    for i, j in pairwise(range(length)):
        hinged = j % run == 0
        edges.append(Edge(i, j, "S" if hinged else "R", (j // run - 1,) if hinged else ()))
    tree = FoldTree(
        template=Template("strip", source),
        source=source,
        target=source,
        orientation=np.tile(np.eye(3, dtype=np.int32), (length, 1, 1)),
        fill=np.ones(length),
        edges=tuple(edges),
        bodies=bodies,
        hinges=hinges,
        root_rotation=np.eye(3, dtype=np.int32),
        root_translation=np.zeros(3, dtype=np.int32),
        energy={"surface": 0.0, "count": 0.0, "total": 0.0},
    )
    poses = tree.body_poses(tree.fold_angles)
    target = np.zeros_like(source)
    orientation = np.zeros((length, 3, 3), dtype=np.int32)
    for voxel, body in enumerate(tree.voxel_body):
        target[voxel] = np.rint(poses[body][:3, :3] @ source[voxel] + poses[body][:3, 3])
        orientation[voxel] = np.rint(poses[body][:3, :3])
    shift = -target.min(axis=0)
    return FoldTree(
        template=Template("folded strip", target + shift),
        source=source,
        target=target + shift,
        orientation=orientation,
        fill=np.ones(length),
        edges=tree.edges,
        bodies=bodies,
        hinges=hinges,
        root_rotation=np.eye(3, dtype=np.int32),
        root_translation=shift.astype(np.int32),
        energy=tree.energy,
    )


def motion_of_order(tree: FoldTree, order: list[int]) -> Motion:
    """Fold the hinges one after another, a quarter turn at a time."""
    angles = [np.zeros(len(tree.hinges))]
    moves: list[tuple[int, ...]] = [()]
    for h in order:
        total = tree.hinges[h].angle_deg
        for _ in range(round(abs(total) / 90)):
            frame = angles[-1].copy()
            frame[h] += 90.0 * np.sign(total)
            angles.append(frame)
            moves.append((h,))
    return Motion(tuple(h.name for h in tree.hinges), np.array(angles), tuple(moves))


def box_strip(length: int):
    """Solid bar around a strip of cells, a little smaller than the cells."""
    size = (length - 0.02, 0.98, 0.98)
    return manifold3d.Manifold.cube(size, True).translate(((length - 1) / 2, 0, 0))


def corner_tree() -> FoldTree:
    """Three cells whose third comes to rest beside the barrel of the first hinge.

    The second cell folds over the first; the third sits on the second and folds over its side,
    where it fills the room beside the first hinge's edge.
    """
    source = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 1]], dtype=np.int32)
    hinges = (
        Hinge("hinge-00", 0, 1, (0.5, 0.5, 0.0), (0, 0, 1), 180.0),
        Hinge("hinge-01", 1, 2, (0.5, 0.0, 0.5), (0, 1, 0), -180.0),
    )
    target = np.array([[0, 0, 0], [0, 1, 0], [1, 1, 0]], dtype=np.int32)
    tree = FoldTree(
        template=Template("corner", target),
        source=source,
        target=target,
        orientation=np.tile(np.eye(3, dtype=np.int32), (3, 1, 1)),
        fill=np.ones(3),
        edges=(Edge(0, 1, "S", (0,)), Edge(1, 2, "S", (1,))),
        bodies=tuple(Body(f"body-{b:02d}", (b,)) for b in range(3)),
        hinges=hinges,
        root_rotation=np.eye(3, dtype=np.int32),
        root_translation=np.zeros(3, dtype=np.int32),
        energy={"surface": 0.0, "count": 0.0, "total": 0.0},
    )
    poses = tree.body_poses(tree.fold_angles)
    for voxel in range(3):
        place = poses[voxel][:3, :3] @ source[voxel] + poses[voxel][:3, 3]
        if np.abs(place - target[voxel]).max() > 1e-9:
            raise ValueError(f"voxel {voxel} folds to {place}, not {target[voxel]}")
    return tree


def corner_solid():
    """Full cubes for the cells of :func:`corner_tree`."""
    cubes = [
        manifold3d.Manifold.cube((0.99, 0.99, 0.99), True).translate(tuple(map(float, cell)))
        for cell in corner_tree().source
    ]
    bridges = [
        manifold3d.Manifold.cube((0.9, 0.9, 0.9), True).translate(shift)
        for shift in ((0.5, 0.0, 0.0), (1.0, 0.0, 0.5))
    ]
    return manifold3d.Manifold.batch_boolean([*cubes, *bridges], manifold3d.OpType.Add)


def posed(joinery, tree: FoldTree, angles_deg: NDArray[np.float64]):
    """Bodies of a kit as manifolds in a state of the folding path, mm, root body at rest."""
    origin = np.array(joinery.origin_mm)
    placed = []
    for body, pose in zip(joinery.bodies, tree.body_poses(angles_deg), strict=True):
        move = pose[:3].copy()
        move[:, 3] = joinery.voxel_mm * pose[:3, 3] + origin - pose[:3, :3] @ origin
        placed.append(as_manifold(body.vertices, body.faces, body.name).transform(move))
    return placed
