"""Small made-up kits for the tests of `fabfold.export`."""

from __future__ import annotations

import manifold3d as m3
import numpy as np

from fabfold.fold.motion import Motion
from fabfold.joinery.bodies import BodyMesh, Joinery
from fabfold.lattice.template import Template
from fabfold.tree.fold_tree import Body, Edge, FoldTree, Hinge

VOXEL_MM = 20.0
ORIGIN_MM = (12.5, -7.0, 10.0)
CLEARANCE_MM = 0.3
BARREL_MM = 2.5

#: Middle of each hinge's edge, its direction, and its angle: a row of 4 cells to 1 x 2 x 2.
ROW = (
    ((0.5, 0.5, 0.0), (0, 0, 1), 180.0),
    ((1.5, 0.0, 0.5), (0, 1, 0), -180.0),
    ((2.5, 0.5, 0.0), (0, 0, 1), 180.0),
)


def row_tree() -> FoldTree:
    """Four cells along x, three single hinges, folding to a block one cell deep."""
    source = np.array([[i, 0, 0] for i in range(4)], dtype=np.int32)
    hinges = tuple(
        Hinge(f"hinge-{i:02d}", i, i + 1, point, direction, angle)
        for i, (point, direction, angle) in enumerate(ROW)
    )
    bodies = tuple(Body(f"body-{i:02d}", (i,)) for i in range(4))
    edges = tuple(Edge(i, i + 1, "S", (i,)) for i in range(3))
    cells = np.array([[0, j, k] for j in range(2) for k in range(2)], dtype=np.int32)
    template = Template("box-1x2x2", cells)
    blank = FoldTree(
        template,
        source,
        source,
        np.tile(np.eye(3, dtype=np.int32), (4, 1, 1)),
        np.ones(4),
        edges,
        bodies,
        hinges,
        np.eye(3, dtype=np.int32),
        np.zeros(3, dtype=np.int32),
        {"surface": 0.0, "count": 0.0, "total": 0.0},
    )
    poses = blank.body_poses(blank.fold_angles)
    points = np.concatenate([source, np.ones((4, 1))], axis=1)
    target = np.rint(np.einsum("nij,nj->ni", poses, points)[:, :3]).astype(np.int32)
    return FoldTree(
        template,
        source,
        target,
        np.rint(poses[:, :3, :3]).astype(np.int32),
        np.ones(4),
        edges,
        bodies,
        hinges,
        np.eye(3, dtype=np.int32),
        np.zeros(3, dtype=np.int32),
        {"surface": 0.0, "count": 0.0, "total": 0.0},
    )


def row_motion(tree: FoldTree) -> Motion:
    """One hinge after the other, from the root outwards; the last in two steps of 90 degrees."""
    angles = np.zeros((len(tree.hinges) + 2, len(tree.hinges)))
    moves: list[tuple[int, ...]] = [()]
    for i, hinge in enumerate(tree.hinges):
        angles[i + 1 :, i] = hinge.angle_deg
        moves.append((i,))
    angles[3, 2] = 90.0
    moves.append((2,))
    return Motion(tuple(h.name for h in tree.hinges), angles, tuple(moves))


def _cylinder(point, direction, start: float, stop: float, radius: float) -> m3.Manifold:
    bar = m3.Manifold.cylinder(stop - start, radius, radius, 48).translate((0, 0, start))
    if direction[0]:
        bar = bar.rotate((0, 90, 0))
    elif direction[1]:
        bar = bar.rotate((-90, 0, 0))
    return bar.translate(tuple(point))


def row_joinery(tree: FoldTree, *, bump: bool = True) -> Joinery:
    """Boxes with a gap and three knuckles at each hinge (no pins), a sphere on one of them."""
    origin = np.array(ORIGIN_MM)
    inset = VOXEL_MM / 2 - CLEARANCE_MM / 2
    solids = []
    for body in tree.bodies:
        solid = m3.Manifold()
        for voxel in body.voxels:
            centre = origin + VOXEL_MM * tree.source[voxel]
            box = m3.Manifold.cube((2 * inset,) * 3, True).translate(tuple(centre))
            if bump and voxel == 3:
                box += m3.Manifold.sphere(8.0, 40).translate(
                    tuple(centre - np.array([0, inset, 0]))
                )
            solid += box
        solids.append(solid)
    half, margin = VOXEL_MM / 2, BARREL_MM + CLEARANCE_MM
    length = (2 * (half - margin) - 2 * CLEARANCE_MM) / 3
    for hinge in tree.hinges:
        point = origin + VOXEL_MM * np.array(hinge.point)
        for k in range(3):
            start = -half + margin + k * (length + CLEARANCE_MM)
            owner, other = (
                (hinge.parent, hinge.child) if k % 2 == 0 else (hinge.child, hinge.parent)
            )
            room = _cylinder(
                point, hinge.direction, start - 0.3, start + length + 0.3, BARREL_MM + CLEARANCE_MM
            )
            solids[other] -= room
        for k in range(3):
            start = -half + margin + k * (length + CLEARANCE_MM)
            owner = hinge.parent if k % 2 == 0 else hinge.child
            solids[owner] += _cylinder(point, hinge.direction, start, start + length, BARREL_MM)
    bodies = []
    for body, solid in zip(tree.bodies, solids, strict=True):
        mesh = solid.to_mesh64()
        bodies.append(
            BodyMesh(
                body.name,
                np.array(mesh.vert_properties[:, :3], dtype=float),
                np.array(mesh.tri_verts, dtype=np.int32),
            )
        )
    return Joinery(tuple(bodies), VOXEL_MM, ORIGIN_MM, CLEARANCE_MM, BARREL_MM, 1.5, 3)
