"""Grooves: room for hinge barrels wherever they pass on the folding path.

A barrel stands out of its two bodies by its radius, around a lattice edge. The path was planned
for cubes, which know nothing of barrels, so every other body loses what comes closer to a barrel
than the clearance, in shape A, in shape B and in all states between.

A barrel that turns past a body (:mod:`fabfold.joinery.barrel_sweeps`) sweeps a volume. The turn is
cut into steps, and each step is covered by the convex hull of the barrel at its two ends. The hull
of two placements misses at most the sagitta of the arc, by which the barrel is thickened, so the
groove contains the true swept volume. It exceeds it by hundredths of a millimetre, and by up to
2 % of the voxel's side where a barrel across the axis turns on itself between two placements.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.joinery.barrel_sweeps import Sweep

if TYPE_CHECKING:
    import manifold3d

__all__ = ["SAGITTA_MM", "groove_tools", "hull_step_deg"]

#: How far the hull of two placements may fall short of the arc between them, in mm.
SAGITTA_MM = 0.02
#: How far the hull may go beyond what turns on itself between two placements, in voxel sides. With
#: 0.0075 the grooves would take 0.05 % less off, and bodies 1.6 times as long to make.
_EXCESS = 0.02
#: Largest step of a turn in degrees.
_MAX_STEP_DEG = 8.0
#: Sides of the polygon that stands for a barrel's circle.
_SIDES = 24

Floats = NDArray[np.float64]


def _segment_distance(placements: Floats, low: Floats, high: Floats) -> Floats:
    """Lower bound of the distance from segments (a, 2, 3) to a set of boxes (m, 3), shape (a,).

    Lattice units: the segments are edges of the lattice, of length 1.
    """
    samples = np.linspace(0.0, 1.0, 9)
    points = placements[:, :1] + samples[:, None] * (placements[:, 1:] - placements[:, :1])
    flat = points.reshape(-1, 1, 3)
    outside = np.maximum(np.maximum(low - flat, flat - high), 0.0)
    nearest = np.linalg.norm(outside, axis=2).min(axis=1).reshape(len(placements), -1).min(axis=1)
    return np.asarray(nearest - 0.5 / (len(samples) - 1), dtype=float)


def _rods(ends: Floats, radius: float, trim: float) -> Floats:
    """Points (a, 2 * _SIDES, 3) whose hulls are rods about segments (a, 2, 3), all in mm.

    A rod is shorter than its segment by `trim` at each end. Its polygon is drawn about the circle,
    so it contains the round rod.
    """
    axis = ends[:, 1] - ends[:, 0]
    axis = axis / np.linalg.norm(axis, axis=1, keepdims=True)
    helper = np.eye(3)[np.abs(axis).argmin(axis=1)]
    across = np.cross(axis, helper)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    upright = np.cross(axis, across)
    angles = 2 * np.pi * np.arange(_SIDES) / _SIDES
    ring = np.cos(angles)[:, None] * across[:, None] + np.sin(angles)[:, None] * upright[:, None]
    ring *= radius / np.cos(np.pi / _SIDES)
    start, end = ends[:, 0] + trim * axis, ends[:, 1] - trim * axis
    return np.concatenate([start[:, None] + ring, end[:, None] + ring], axis=1)


def groove_tools(
    sweeps: list[Sweep],
    low: Floats,
    high: Floats,
    *,
    voxel_mm: float,
    radius_mm: float,
    trim_mm: float,
) -> list[tuple[int, manifold3d.Manifold]]:
    """Tools that cut the grooves of one body.

    Parameters
    ----------
    sweeps : list of Sweep
        How barrels pass this body.
    low : (m, 3) float64 array
        Lowest corners of boxes that hold the body's material, lattice units.
    high : (m, 3) float64 array
        Highest corners of these boxes, lattice units.
    voxel_mm : float
        Side of a voxel in mm.
    radius_mm : float
        Radius of the groove in mm: barrel radius and clearance.
    trim_mm : float
        How much shorter than the lattice edge the groove is at each end, mm.

    Returns
    -------
    list of (int, manifold3d.Manifold)
        Index of the hinge, and a convex solid in mm; solids may overlap each other.
    """
    import manifold3d

    tools = []
    reach = (radius_mm + SAGITTA_MM) / voxel_mm / np.cos(np.pi / _SIDES)
    for sweep in sweeps:
        if sweep.angle_deg == 0.0:
            if _segment_distance(sweep.points[None], low, high)[0] < reach:
                (rod,) = _rods(sweep.points[None] * voxel_mm, radius_mm, trim_mm)
                tools.append((sweep.owner, manifold3d.Manifold.hull_points(rod)))
            continue
        radius = sweep.radius
        step = hull_step_deg(sweep, voxel_mm)
        count = max(1, int(np.ceil(abs(sweep.angle_deg) / step)))
        angles = np.linspace(0.0, sweep.angle_deg, count + 1)
        # The distance is known at the ends of the steps; half a step brings a point nearer by
        # half the arc of a step.
        placements = sweep.placements(angles)
        half_arc = radius * np.radians(abs(sweep.angle_deg) / count) / 2
        near = _segment_distance(placements, low, high) < reach + half_arc
        wanted = near[:-1] | near[1:]
        rods = _rods(placements * voxel_mm, radius_mm + SAGITTA_MM, trim_mm - SAGITTA_MM)
        for index in np.flatnonzero(wanted):
            hull = manifold3d.Manifold.hull_points(rods[index : index + 2].reshape(-1, 3))
            tools.append((sweep.owner, hull))
    return tools


def hull_step_deg(sweep: Sweep, voxel_mm: float) -> float:
    """Largest step of a turn whose hulls keep to the bounds on both sides.

    Parameters
    ----------
    sweep : Sweep
        The turn.
    voxel_mm : float
        Side of a voxel in mm.

    Returns
    -------
    float
        The step in degrees.
    """
    sagitta = 1.0 - SAGITTA_MM / max(sweep.radius * voxel_mm, 1e-9)
    step = 2.0 * float(np.degrees(np.arccos(max(0.0, sagitta))))
    rise = sweep.points @ sweep.axis
    flat = sweep.points - rise[:, None] * sweep.axis
    across = float(np.linalg.norm(flat - flat[0], axis=1).max())
    if across > 1e-6:
        # The two rods cross like the blades of scissors; the hull closes the gap between them.
        step = min(step, 2.0 * float(np.degrees(2.0 * _EXCESS / across)))
    return min(step, _MAX_STEP_DEG)
