"""Putting hinges on their lattice edges."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import GeometryError
from fabfold.joinery.cells import as_manifold
from fabfold.joinery.sizes import HingeSize
from fabfold.tree.model import FoldTree, Hinge

if TYPE_CHECKING:
    import manifold3d

__all__ = ["HingePieces", "hinge_frames", "hinge_pieces", "knuckle_zone"]


class HingePieces(NamedTuple):
    """The four solids of one hinge in its place, mm, lattice origin at zero."""

    parent_half: manifold3d.Manifold
    child_half: manifold3d.Manifold
    parent_carve: manifold3d.Manifold
    child_carve: manifold3d.Manifold


def hinge_frames(tree: FoldTree) -> NDArray[np.float64]:
    """Frame of every single hinge on its lattice edge.

    Parameters
    ----------
    tree : FoldTree

    Returns
    -------
    (h, 3, 4) float64 array
        Columns x (from the parent's cell to the child's), y (outwards, from the middle of the
        shared face to the hinged edge), z = x × y (the axis) and the origin in the middle of the
        edge, lattice units.

    Raises
    ------
    GeometryError
        If a hinge does not lie on an edge of the face that its two voxels share.
    """
    frames = np.zeros((len(tree.hinges), 3, 4))
    for edge in tree.edges:
        for h in edge.hinges:
            hinge = tree.hinges[h]
            parent = tree.source[edge.parent].astype(float)
            ahead = tree.source[edge.child] - parent
            out = 2.0 * (np.array(hinge.point) - parent - ahead / 2)
            axis = np.cross(ahead, out)
            # Every one of these is a unit vector along an axis, or the hinge is misplaced.
            if (
                np.abs(ahead).sum() != 1.0
                or np.abs(out).sum() != 1.0
                or np.abs(axis).tolist() != np.abs(np.array(hinge.direction, dtype=float)).tolist()
            ):
                raise GeometryError(
                    f"{hinge.name} does not lie on an edge of the face between voxels "
                    f"{edge.parent} and {edge.child}"
                )
            frames[h] = np.column_stack([ahead, out, axis, np.array(hinge.point)])
    return frames


def hinge_pieces(tree: FoldTree, size: HingeSize, voxel_mm: float) -> list[HingePieces]:
    """The solids of all hinges of a tree, in the order of ``tree.hinges``.

    Parameters
    ----------
    tree : FoldTree
        With single hinges only.
    size : HingeSize
    voxel_mm : float
    """
    blanks = [
        as_manifold(part.vertices, part.faces, "hinge piece")
        for part in (
            size.meshes.parent_half,
            size.meshes.child_half,
            size.meshes.parent_carve,
            size.meshes.child_carve,
        )
    ]
    placed = []
    for frame in hinge_frames(tree):
        transform = frame.copy()
        transform[:, 3] *= voxel_mm
        placed.append(HingePieces(*(blank.transform(transform) for blank in blanks)))
    return placed


def knuckle_zone(hinge: Hinge, size: HingeSize, voxel_mm: float) -> manifold3d.Manifold:
    """The barrel of a hinge as one cylinder, a little smaller than it is.

    A groove that only just reaches a knuckle's end or skin (by the thickness that groove tools
    have to spare) must not count as a cut.

    Parameters
    ----------
    hinge : Hinge
    size : HingeSize
    voxel_mm : float
    """
    import manifold3d

    spare = 0.08
    length = voxel_mm - 2 * (size.reach_mm + spare)
    rod = manifold3d.Manifold.cylinder(length, size.barrel_radius_mm - spare, -1.0, 32, True)
    axis = np.array(hinge.direction, dtype=float)
    # Any rotation that takes z to the axis will do: cyclic permutation of the unit vectors.
    turn = {0: [1, 2, 0], 1: [2, 0, 1], 2: [0, 1, 2]}[int(np.abs(axis).argmax())]
    rotation = np.eye(3)[:, turn]
    return rod.transform(np.column_stack([rotation, np.array(hinge.point) * voxel_mm]))
