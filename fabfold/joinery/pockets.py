"""Pockets: room for link plates wherever they rest or pass on the folding path.

The path was planned for plates without thickness, which lie in faces of the lattice. A printed
plate stands out of its face by half its thickness on both sides, so every body loses what comes
closer to a plate than the clearance, in shape A, in shape B and in all states between. Where a
plate comes to rest on a face this is a pocket; where it swings past the corner of a cell it is a
shallow groove.

Turns are cut into steps and covered by convex hulls as in :mod:`fabfold.joinery.grooves`, with the
plate thickened by the clearance and by the sagitta of a step.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.fold.motion import Motion
from fabfold.joinery.grooves import SAGITTA_MM, Passage, descendants, distinct, inverse, step_deg
from fabfold.joinery.hinge_placement import Plate
from fabfold.tree.fold_tree import FoldTree

if TYPE_CHECKING:
    import manifold3d

__all__ = ["plate_passages", "plate_tools"]

#: How far a hull may go beyond a plate that turns in its own plane between two placements, in mm.
_EXCESS_MM = 0.3

Floats = NDArray[np.float64]


def grown_corners(plate: Plate, by_mm: float) -> Floats:
    """Corners whose hull is the plate with `by_mm` more on every side, shape (k, 3), mm."""
    import manifold3d

    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    points = plate.corners[:, None] + by_mm * (signs @ plate.frame.T)
    hull = manifold3d.Manifold.hull_points(points.reshape(-1, 3))
    corners = np.array(hull.to_mesh64().vert_properties[:, :3], dtype=float)
    order = np.lexsort(np.round(corners, 6).T)
    return np.asarray(corners[order])


def plate_passages(
    tree: FoldTree,
    motion: Motion,
    plates: dict[int, Plate],
    *,
    voxel_mm: float,
    clearance_mm: float,
) -> list[Passage]:
    """Every distinct way in which a link plate may come past another body.

    How a plate lies beside its own parent and child in A is the hinge's business and left out. Of
    two links only the later one makes room for the other.

    Parameters
    ----------
    tree : FoldTree
    motion : Motion
        One hinge a move, linear between keyframes.
    plates : dict of int to Plate
        By index of the link.
    voxel_mm, clearance_mm : float

    Returns
    -------
    list of Passage
        In a fixed order; ``hinge`` is the index of the link, ``start`` the corners of the plate
        with the clearance around it.
    """
    carried = descendants(tree)
    shapes = {
        link: grown_corners(plate, clearance_mm + SAGITTA_MM) / voxel_mm
        for link, plate in sorted(plates.items())
    }
    centres = body_cells(tree, plates)
    found: list[Passage] = []
    zero = np.zeros(3)
    poses = tree.body_poses(motion.angles_deg[0])
    for link, corners in shapes.items():
        for body, cells in enumerate(centres):
            if body in (link, *plates[link].bodies) or (body in plates and body < link):
                continue
            low, high = corners.min(axis=0), corners.max(axis=0)
            if ((cells - 0.5 < high) & (low < cells + 0.5)).all(axis=1).any():
                found.append(Passage(body, link, corners, zero, zero, 0.0))
    for k in range(1, len(motion.angles_deg)):
        poses = tree.body_poses(motion.angles_deg[k - 1])
        for m in motion.moves[k]:
            turn = float(motion.angles_deg[k, m] - motion.angles_deg[k - 1, m])
            world = poses[tree.hinges[m].parent]
            point = world[:3, :3] @ np.array(tree.hinges[m].point) + world[:3, 3]
            axis = world[:3, :3] @ np.array(tree.hinges[m].direction, dtype=float)
            for link, corners in shapes.items():
                moving = bool(carried[m, link])
                placed = corners @ poses[link][:3, :3].T + poses[link][:3, 3]
                for body in np.flatnonzero(carried[m] != moving).tolist():
                    if body in plates and body < link:
                        continue
                    pose = poses[body]
                    cells = centres[body] @ pose[:3, :3].T + pose[:3, 3]
                    if not _may_meet(placed, cells, point, axis):
                        continue
                    back = inverse(pose)
                    found.append(
                        Passage(
                            body,
                            link,
                            placed @ back[:3, :3].T + back[:3, 3],
                            back[:3, :3] @ point + back[:3, 3],
                            back[:3, :3] @ axis,
                            turn if moving else -turn,
                        )
                    )
    return distinct(found)


def body_cells(tree: FoldTree, plates: dict[int, Plate]) -> list[Floats]:
    """Middles of unit cubes that hold each body, barrels left out; a link has one on its face."""
    return [
        plates[index].cells.mean(axis=0, keepdims=True)
        if index in plates
        else tree.source[list(body.voxels)].astype(float)
        for index, body in enumerate(tree.bodies)
    ]


def _may_meet(corners: Floats, cells: Floats, point: Floats, axis: Floats) -> bool:
    """Whether a plate can come near unit cubes in a turn about an axis.

    Both keep their place along the axis and their distance from it.
    """
    away = corners - point
    height = away @ axis
    across = away - height[:, None] * axis
    farthest = float(np.linalg.norm(across, axis=1).max())
    middle = across.mean(axis=0)
    nearest = float(
        np.linalg.norm(middle) - np.linalg.norm(across - middle, axis=1).max()
    )  # negative where the axis may run through it
    centre = cells - point
    along = centre @ axis
    radius = np.linalg.norm(centre - along[:, None] * axis, axis=1)
    corner = np.sqrt(0.5)
    return bool(
        (
            (height.min() < along + 0.5)
            & (height.max() > along - 0.5)
            & (nearest < radius + corner)
            & (farthest > radius - corner)
        ).any()
    )


def plate_tools(
    found: list[Passage], low: Floats, high: Floats, *, voxel_mm: float
) -> list[tuple[int, manifold3d.Manifold]]:
    """Cutting solids for one body.

    Parameters
    ----------
    found : list of Passage
        The passages of link plates past this body.
    low, high : (m, 3) float64 arrays
        Boxes that hold the body's material, lattice units.
    voxel_mm : float

    Returns
    -------
    list of (int, manifold3d.Manifold)
        Link and convex solid in mm; solids may overlap each other.
    """
    import manifold3d

    tools = []
    for passage in found:
        if passage.angle_deg == 0.0:
            steps = passage.start[None]
        else:
            step = step_deg(passage, voxel_mm, _EXCESS_MM)
            count = max(1, int(np.ceil(abs(passage.angle_deg) / step)))
            places = passage.placements(np.linspace(0.0, passage.angle_deg, count + 1))
            steps = np.concatenate([places[:-1], places[1:]], axis=1)
        for index in np.flatnonzero(_touching(steps, low, high)):
            hull = manifold3d.Manifold.hull_points(steps[index] * voxel_mm)
            tools.append((passage.hinge, hull))
    return tools


def _touching(steps: Floats, low: Floats, high: Floats) -> NDArray[np.bool_]:
    """Which hulls of points (s, k, 3) may overlap one of some boxes (m, 3): separating axes."""
    near = np.ones((len(steps), len(low)), dtype=bool)
    centre, half = (low + high) / 2, (high - low) / 2
    middle = steps - steps.mean(axis=1, keepdims=True)
    # The thin direction of each hull, where it has one.
    thin = np.linalg.svd(middle, full_matrices=False)[2][:, 2]
    for normals in (*np.eye(3)[:, None].repeat(len(steps), axis=1), thin):
        along = np.einsum("skj,sj->sk", steps, normals)
        place, reach = normals @ centre.T, np.abs(normals) @ half.T
        near &= (along.min(axis=1)[:, None] < place + reach) & (
            along.max(axis=1)[:, None] > place - reach
        )
    return np.asarray(near.any(axis=1))
