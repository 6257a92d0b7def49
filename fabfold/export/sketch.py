"""Pictures of a tree before it is built: its bodies without hinges and grooves, open and folded."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fabfold.export.colours import body_colours
from fabfold.export.picture import strip
from fabfold.export.render import Image, View
from fabfold.fold.motion import Motion
from fabfold.joinery.bodies import BodyMesh, Joinery
from fabfold.joinery.cells import eroded_cells, model_manifold
from fabfold.tree.fold_tree import FoldTree
from fabfold.voxels.voxel_model import Voxels

__all__ = ["picture_of_tree"]

#: Side of a voxel and gap between bodies in the picture.
_VOXEL, _GAP = 20.0, 0.6


def _pieces(voxels: Voxels, tree: FoldTree) -> tuple[tuple[BodyMesh, ...], NDArray[np.uint8]]:
    model = model_manifold(voxels, _VOXEL)
    meshes, colours = [], []
    for body, colour in zip(tree.bodies, body_colours(tree), strict=True):
        if not body.voxels:  # a link plate, which has no thickness yet
            vertices, faces = np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32)
        else:
            own = list(body.voxels)
            octants = None if tree.octants is None else tree.octants[own]
            cut = model ^ eroded_cells(tree.source[own], _VOXEL, _GAP / 2, octants)
            mesh = cut.to_mesh64()
            vertices = np.asarray(mesh.vert_properties, dtype=float)[:, :3]
            faces = np.asarray(mesh.tri_verts, dtype=np.int32)
        meshes.append(BodyMesh(body.name, vertices, faces))
        colours.append(colour)
    return tuple(meshes), np.array(colours, dtype=np.uint8)


def picture_of_tree(voxels: Voxels, tree: FoldTree, view: View | None = None) -> Image:
    """The opened model and the folded box side by side, each body in its colour.

    Parameters
    ----------
    voxels : Voxels
    tree : FoldTree
    view : View, optional
        A small, quick one by default. See :func:`fabfold.export.picture.strip`.

    Returns
    -------
    (height, width, 3) uint8 array
    """
    bodies, colours = _pieces(voxels, tree)
    joinery = Joinery(bodies, _VOXEL, (0.0, 0.0, 0.0), _GAP, 0.0, 0.0, 0)
    angles = np.stack([np.zeros(len(tree.hinges)), tree.fold_angles])
    names = tuple(hinge.name for hinge in tree.hinges)
    motion = Motion(names, angles, ((), tuple(range(len(names)))))
    view = view or View(size=(420, 420), lights=16)
    upright = voxels.rotation.T
    return strip(joinery, tree, motion, view, colours=colours, upright=upright, between=False)
