"""Small trees whose cells interlock: whole cubes block, carved ones pass."""

from __future__ import annotations

import numpy as np
from joinery_models import voxels_of
from numpy.typing import NDArray

from fabfold.lattice.template import Template
from fabfold.tree.fold_tree import Body, Edge, FoldTree, Hinge
from fabfold.voxels.voxel_model import Voxels

Cell = tuple[int, int, int]

#: A cell in a slot: it turns out of it about its neighbour's edge, past the far wall.
SLOT: list[list[Cell]] = [
    [(0, 0, 0), (0, 0, -1), (1, 0, -1), (2, 0, -1), (2, 0, 0)],
    [(1, 0, 0)],
]
SLOT_HINGES = [((0, 0, 0), (1, 0, 0), (0, 1, 0), 2)]


def tree_of(bodies: list[list[Cell]], hinges: list[tuple[Cell, Cell, Cell, int]]) -> FoldTree:
    """Bodies of cells, and hinges (parent cell, child cell, side of the edge, quarter turns).

    Hinge ``h`` carries body ``h + 1``; positive turns fold the child towards the side.
    """
    source = np.array(sorted(cell for body in bodies for cell in body), dtype=np.int32)
    index = {tuple(cell): i for i, cell in enumerate(source.tolist())}
    owner = {cell: b for b, body in enumerate(bodies) for cell in body}
    made = []
    edges = []
    for h, (p, c, side, quarter) in enumerate(hinges):
        ahead, out = np.subtract(c, p), np.array(side)
        axis = np.cross(ahead, out)
        point = np.array(p) + ahead / 2 + out / 2
        turn = 90.0 * quarter * int(axis.sum())
        x, y, z = (int(v) for v in np.abs(axis))
        made.append(
            Hinge(f"hinge-{h:02d}", owner[p], h + 1, tuple(point.tolist()), (x, y, z), turn)
        )
        edges.append(Edge(index[p], index[c], "S", (h,)))
    for body in bodies:
        reached = {body[0]}
        while len(reached) < len(body):
            for cell in body:
                near = [r for r in sorted(reached) if np.abs(np.subtract(r, cell)).sum() == 1]
                if cell not in reached and near:
                    edges.append(Edge(index[near[0]], index[cell], "R"))
                    reached.add(cell)
    eye = np.eye(3, dtype=np.int32)
    tree = FoldTree(
        template=Template("folded", source),
        source=source,
        target=source,
        orientation=np.tile(eye, (len(source), 1, 1)),
        fill=np.ones(len(source)),
        edges=tuple(edges),
        bodies=tuple(
            Body(f"body-{b:02d}", tuple(sorted(index[cell] for cell in body)))
            for b, body in enumerate(bodies)
        ),
        hinges=tuple(made),
        root_rotation=eye,
        root_translation=np.zeros(3, dtype=np.int32),
        energy={"surface": 0.0, "count": 0.0, "total": 0.0},
    )
    pose = tree.body_poses(tree.fold_angles)[tree.voxel_body]
    target = np.rint(np.einsum("nij,nj->ni", pose[:, :3, :3], source) + pose[:, :3, 3])
    shift = -target.min(axis=0).astype(np.int32)
    target = target.astype(np.int32) + shift
    return FoldTree(
        template=Template("folded", target),
        source=source,
        target=target,
        orientation=np.rint(pose[:, :3, :3]).astype(np.int32),
        fill=tree.fill,
        edges=tree.edges,
        bodies=tree.bodies,
        hinges=tree.hinges,
        root_rotation=eye,
        root_translation=shift,
        energy=tree.energy,
    )


def full_voxels(tree: FoldTree, holes: list[tuple[Cell, Cell]] | None = None) -> Voxels:
    """A model that fills all cells of a tree; `holes` are boxes (low, high) left empty."""
    import manifold3d

    cubes = [
        manifold3d.Manifold.cube((1.0, 1.0, 1.0), True).translate(tuple(map(float, cell)))
        for cell in tree.source
    ]
    solid = manifold3d.Manifold.batch_boolean(cubes, manifold3d.OpType.Add)
    for low, high in holes or []:
        size = tuple(np.subtract(high, low).astype(float))
        solid -= manifold3d.Manifold.cube(size).translate(tuple(map(float, low)))
    return voxels_of(tree.source, solid)


def full_material(tree: FoldTree) -> NDArray[np.bool_]:
    """Material of cells that are all full."""
    return np.ones((len(tree.source), 20, 20, 20), dtype=bool)


#: The same, and a third body that folds into the slot when it is empty: its hinge sits on the
#: edge of the far wall that the first cell passes.
LID = [*SLOT, [(2, 1, 0)]]
LID_HINGES = [*SLOT_HINGES, ((2, 0, 0), (2, 1, 0), (-1, 0, 0), 2)]
