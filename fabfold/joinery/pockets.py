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
from fabfold.joinery.barrel_sweeps import (
    Sweep,
    descendants,
    distinct_sweeps,
    resting_sweep,
    turn_axis,
    turning_sweep,
)
from fabfold.joinery.grooves import SAGITTA_MM, hull_step_deg
from fabfold.joinery.hinge_placement import LinkPlate
from fabfold.tree.fold_tree import FoldTree

if TYPE_CHECKING:
    import manifold3d

__all__ = ["plate_sweeps", "pocket_tools"]

Floats = NDArray[np.float64]


def grown_corners(plate: LinkPlate, by_mm: float) -> Floats:
    """Corners of a plate that is larger on every side.

    Parameters
    ----------
    plate : LinkPlate
        The plate in its place in A.
    by_mm : float
        How much larger, mm.

    Returns
    -------
    (k, 3) float64 array
        Corners in mm, in a fixed order; their hull is the larger plate.
    """
    import manifold3d

    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    points = plate.corners[:, None] + by_mm * (signs @ plate.frame.T)
    hull = manifold3d.Manifold.hull_points(points.reshape(-1, 3))
    corners = np.array(hull.to_mesh64().vert_properties[:, :3], dtype=float)
    order = np.lexsort(np.round(corners, 6).T)
    return np.asarray(corners[order])


def plate_sweeps(
    tree: FoldTree,
    motion: Motion,
    plates: dict[int, LinkPlate],
    *,
    voxel_mm: float,
    clearance_mm: float,
) -> list[Sweep]:
    """Every distinct way in which a link plate may pass another body.

    How a plate lies beside its own parent and child in A is the hinge's business and left out. Of
    two links only the later one makes room for the other.

    Parameters
    ----------
    tree : FoldTree
        The bodies and their hinges.
    motion : Motion
        The folding path: one hinge a move, linear between keyframes.
    plates : dict of int to LinkPlate
        The link plates by index of the link.
    voxel_mm : float
        Side of a voxel in mm.
    clearance_mm : float
        Gap between bodies in mm.

    Returns
    -------
    list of Sweep
        In a fixed order; ``owner`` is the index of the link, ``points`` the corners of the plate
        with the clearance around it.
    """
    carried = descendants(tree)
    shapes = {
        link: grown_corners(plate, clearance_mm + SAGITTA_MM) / voxel_mm
        for link, plate in sorted(plates.items())
    }
    centres = body_cells(tree, plates)
    found: list[Sweep] = []
    for link, corners in shapes.items():
        for body, cells in enumerate(centres):
            if body in (link, *plates[link].bodies) or (body in plates and body < link):
                continue
            low, high = corners.min(axis=0), corners.max(axis=0)
            if ((cells - 0.5 < high) & (low < cells + 0.5)).all(axis=1).any():
                found.append(resting_sweep(body, link, corners))
    for k in range(1, len(motion.angles_deg)):
        poses = tree.body_poses(motion.angles_deg[k - 1])
        for m in motion.moves[k]:
            turn = float(motion.angles_deg[k, m] - motion.angles_deg[k - 1, m])
            point, axis = turn_axis(tree.hinges[m], poses)
            for link, corners in shapes.items():
                moving = bool(carried[m, link])
                angle = turn if moving else -turn
                placed = corners @ poses[link][:3, :3].T + poses[link][:3, 3]
                for body in np.flatnonzero(carried[m] != moving).tolist():
                    if body in plates and body < link:
                        continue
                    pose = poses[body]
                    cells = centres[body] @ pose[:3, :3].T + pose[:3, 3]
                    if _may_meet(placed, cells, point, axis):
                        found.append(turning_sweep(body, link, placed, point, axis, angle, pose))
    return distinct_sweeps(found)


def body_cells(tree: FoldTree, plates: dict[int, LinkPlate]) -> list[Floats]:
    """Unit cubes that hold each body, barrels left out; a link has one about its face.

    Parameters
    ----------
    tree : FoldTree
        The bodies and their voxels.
    plates : dict of int to LinkPlate
        The link plates by index of the link.

    Returns
    -------
    list of (n, 3) float64 arrays
        Middles of the cubes of each body, lattice units.
    """
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


def pocket_tools(
    sweeps: list[Sweep], low: Floats, high: Floats, *, voxel_mm: float
) -> list[tuple[int, manifold3d.Manifold]]:
    """Tools that cut the pockets of one body.

    Parameters
    ----------
    sweeps : list of Sweep
        How link plates pass this body.
    low : (m, 3) float64 array
        Lowest corners of boxes that hold the body's material, lattice units.
    high : (m, 3) float64 array
        Highest corners of these boxes, lattice units.
    voxel_mm : float
        Side of a voxel in mm.

    Returns
    -------
    list of (int, manifold3d.Manifold)
        Index of the link, and a convex solid in mm; solids may overlap each other.
    """
    import manifold3d

    tools = []
    for sweep in sweeps:
        if sweep.angle_deg == 0.0:
            steps = sweep.points[None]
        else:
            step = hull_step_deg(sweep, voxel_mm)
            count = max(1, int(np.ceil(abs(sweep.angle_deg) / step)))
            places = sweep.placements(np.linspace(0.0, sweep.angle_deg, count + 1))
            steps = np.concatenate([places[:-1], places[1:]], axis=1)
        for index in np.flatnonzero(_may_overlap(steps, low, high)):
            hull = manifold3d.Manifold.hull_points(steps[index] * voxel_mm)
            tools.append((sweep.owner, hull))
    return tools


def _may_overlap(steps: Floats, low: Floats, high: Floats) -> NDArray[np.bool_]:
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
