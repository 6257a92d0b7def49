"""Trees with double hinges, made by hand, and solids for their cells."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fabfold.fold.motion import Motion
from fabfold.lattice.rotations import FACES
from fabfold.lattice.template import Template
from fabfold.tree.catalogue import edge_sides
from fabfold.tree.fold_tree import Body, Edge, FoldTree, Hinge

#: Kind, sides (0 to 3, see `edge_sides`) and quarter turns of a joint.
JointSpec = tuple[str, tuple[int, ...], tuple[int, ...]]
RIGID: JointSpec = ("R", (), ())


def hand_tree(
    cells: list[list[int]], joints: list[tuple[int, int, JointSpec]], *, share: bool = False
) -> FoldTree:
    """Tree of cells from joints (parent, child, spec), parents first; voxel 0 is the root's.

    The template is wherever the cells come to lie; two in one only if they `share` it.
    """
    source = np.array(cells, dtype=np.int32)
    owner = {0: 0}
    voxels: list[list[int]] = [[0]]
    of_edge: list[int | None] = [None]
    edges, hinges = [], []
    for parent, child, (kind, sides, turns) in joints:
        ahead = source[child] - source[parent]
        face = int(np.flatnonzero((ahead == FACES).all(axis=1))[0])
        body = owner[parent]
        mine = []
        for axis, (side, turn) in enumerate(zip(sides, turns, strict=True)):
            out = FACES[edge_sides(face)[side]]
            along = np.cross(ahead, out)
            point = (source[parent] + (ahead + out) / 2).tolist()
            mine.append(len(hinges))
            last = axis == len(sides) - 1
            voxels.append([])
            of_edge.append(None if last else len(edges))
            hinges.append(
                Hinge(
                    f"hinge-{len(hinges):02d}",
                    body,
                    len(voxels) - 1,
                    tuple(point),
                    tuple(np.abs(along).tolist()),
                    90.0 * turn * int(along.sum()),
                )
            )
            body = len(voxels) - 1
        voxels[body].append(child)
        owner[child] = body
        edges.append(Edge(parent, child, kind, tuple(mine)))
    names = []
    for index, edge in enumerate(of_edge):
        links = sum(e is not None for e in of_edge[:index])
        names.append(f"body-{index - links:02d}" if edge is None else f"link-{links:02d}")
    bodies = tuple(
        Body(name, tuple(sorted(v)), edge)
        for name, v, edge in zip(names, voxels, of_edge, strict=True)
    )
    blank = FoldTree(
        template=Template("blank", source),
        source=source,
        target=source,
        orientation=np.tile(np.eye(3, dtype=np.int32), (len(source), 1, 1)),
        fill=np.ones(len(source)),
        edges=tuple(edges),
        bodies=bodies,
        hinges=tuple(hinges),
        root_rotation=np.eye(3, dtype=np.int32),
        root_translation=np.zeros(3, dtype=np.int32),
        energy={"surface": 0.0, "count": 0.0, "total": 0.0},
    )
    poses = blank.body_poses(blank.fold_angles)[blank.voxel_body]
    target = np.rint(np.einsum("nij,nj->ni", poses[:, :3, :3], source) + poses[:, :3, 3])
    if not share and len(np.unique(target, axis=0)) < len(target):
        raise ValueError(f"two cells come to lie in one: {target.tolist()}")
    shift = -target.min(axis=0).astype(np.int32)
    return replace(
        blank,
        template=Template("folded", target.astype(np.int32) + shift),
        target=target.astype(np.int32) + shift,
        orientation=np.rint(poses[:, :3, :3]).astype(np.int32),
        root_translation=shift,
    )


def motion_of(tree: FoldTree, turns: list[tuple[int, int]]) -> Motion:
    """Path from (hinge, quarter turns) moves; positive turns go towards the folded angle."""
    angles = [np.zeros(len(tree.hinges))]
    moves: list[tuple[int, ...]] = [()]
    for h, quarters in turns:
        frame = angles[-1].copy()
        frame[h] += 90.0 * quarters * np.sign(tree.hinges[h].angle_deg)
        angles.append(frame)
        moves.append((h,))
    if np.abs(angles[-1] - tree.fold_angles).max() > 0:
        raise ValueError(f"the path ends at {angles[-1].tolist()}, not {tree.fold_angles.tolist()}")
    return Motion(tuple(h.name for h in tree.hinges), np.array(angles), tuple(moves))


def full_solid(tree: FoldTree):
    """Cubes that fill the cells but for 0.005 of a voxel, joined where cells share a face."""
    import manifold3d

    solids = []
    cells = {tuple(cell) for cell in tree.source.tolist()}
    for cell in sorted(cells):
        centre = np.array(cell, dtype=float)
        cube = manifold3d.Manifold.cube((0.99, 0.99, 0.99), True)
        solids.append(cube.translate(tuple(centre)))
        for axis in range(3):
            step = np.eye(3)[axis]
            if tuple((centre + step).astype(int).tolist()) in cells:
                bridge = manifold3d.Manifold.cube((0.98, 0.98, 0.98), True)
                solids.append(bridge.translate(tuple(centre + step / 2)))
    return manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add)


def _boxes(tree: FoldTree) -> list[list[tuple[np.ndarray, np.ndarray]]]:
    """Middle and size of the boxes of each body: shrunk cells, links as thin sheets."""
    found = []
    for body in tree.bodies:
        if body.edge is None:
            found.append([(tree.source[v].astype(float), np.full(3, 0.998)) for v in body.voxels])
            continue
        edge = tree.edges[body.edge]
        ahead = tree.source[edge.child] - tree.source[edge.parent]
        size = np.where(ahead != 0, 0.001, 0.9)
        found.append([((tree.source[edge.parent] + tree.source[edge.child]) / 2.0, size)])
    return found


def planned(tree: FoldTree, step_deg: float = 5.0) -> list[tuple[int, int]] | None:
    """Shortest path of quarter turns on which boxes stay apart, by trying all states."""
    import fcl

    objects = [
        [
            (fcl.CollisionObject(fcl.Box(*size), fcl.Transform(np.eye(3), middle)), middle)
            for middle, size in boxes
        ]
        for boxes in _boxes(tree)
    ]
    signs = np.sign(tree.fold_angles)
    goal = tuple(np.abs(tree.fold_angles / 90).astype(int).tolist())

    def free(state: tuple[float, ...]) -> bool:
        poses = tree.body_poses(90.0 * signs * np.array(state))
        for pose, items in zip(poses, objects, strict=True):
            for item, middle in items:
                item.setTransform(
                    fcl.Transform(pose[:3, :3].copy(), pose[:3, :3] @ middle + pose[:3, 3])
                )
        for i, items in enumerate(objects):
            for others in objects[i + 1 :]:
                for one, _ in items:
                    for other, _ in others:
                        if fcl.collide(one, other, fcl.CollisionRequest(), fcl.CollisionResult()):
                            return False
        return True

    start = (0,) * len(goal)
    before: dict[tuple[int, ...], tuple[tuple[int, ...], tuple[int, int]] | None] = {start: None}
    queue = [start]
    while queue and goal not in before:
        here = queue.pop(0)
        for h in range(len(goal)):
            for step in (1, -1):
                there = tuple(q + step * (h == k) for k, q in enumerate(here))
                if there in before or not 0 <= there[h] <= goal[h]:
                    continue
                count = round(90 / step_deg)
                if all(
                    free(tuple(q + step * i / count * (h == k) for k, q in enumerate(here)))
                    for i in range(1, count + 1)
                ):
                    before[there] = (here, (h, step))
                    queue.append(there)
    if goal not in before:
        return None
    path: list[tuple[int, int]] = []
    entry = before[goal]
    while entry is not None:
        path.append(entry[1])
        entry = before[entry[0]]
    return path[::-1]
