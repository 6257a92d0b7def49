"""Pictures of a tree before it is built: its bodies without hinges and grooves, open and folded."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fabfold.export.camera import View
from fabfold.export.colours import body_colours
from fabfold.export.kit_picture import strip
from fabfold.export.render import Image
from fabfold.fold.motion import Motion
from fabfold.joinery.bodies import BodyMesh, Joinery
from fabfold.joinery.cells import eroded_cells, model_manifold
from fabfold.tree.fold_tree import FoldTree
from fabfold.voxels.voxel_model import Voxels

__all__ = ["picture_of_tree"]

#: Side of a voxel and gap between bodies in the picture, mm.
_VOXEL_MM, _GAP_MM = 20.0, 0.6


def _bodies(voxels: Voxels, tree: FoldTree) -> tuple[tuple[BodyMesh, ...], NDArray[np.uint8]]:
    """The model cut into the cells of each body, and the colours (b, 3) of the bodies."""
    model = model_manifold(voxels, _VOXEL_MM)
    meshes, colours = [], []
    for body, colour in zip(tree.bodies, body_colours(tree), strict=True):
        if not body.voxels:  # a link plate, which has no thickness yet
            vertices, faces = np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32)
        else:
            own = list(body.voxels)
            octants = None if tree.octants is None else tree.octants[own]
            cut = model ^ eroded_cells(tree.source[own], _VOXEL_MM, _GAP_MM / 2, octants)
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
        The voxels and the warped model.
    tree : FoldTree
        The tree of these voxels.
    view : View, optional
        Direction, size and light, see :func:`fabfold.export.kit_picture.strip`; small and quick
        by default.

    Returns
    -------
    (height, width, 3) uint8 array
        The picture, sRGB.
    """
    bodies, colours = _bodies(voxels, tree)
    joinery = Joinery(bodies, _VOXEL_MM, (0.0, 0.0, 0.0), _GAP_MM, 0.0, 0.0, 0)
    angles = np.stack([np.zeros(len(tree.hinges)), tree.fold_angles])
    names = tuple(hinge.name for hinge in tree.hinges)
    motion = Motion(names, angles, ((), tuple(range(len(names)))))
    view = view or View(size=(420, 420), lights=16)
    upright = voxels.rotation.T
    return strip(joinery, tree, motion, view, colours=colours, upright=upright, between=False)
