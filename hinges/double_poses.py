"""Poses of a double hinge in which its two bodies would take one another's room."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from .plan_double import DoubleSpec, child_pose

__all__ = ["colliding_poses"]

#: What two cubes may share without a collision, as a share of their side.
_TOUCH = 0.01


def colliding_poses(spec: DoubleSpec) -> tuple[tuple[float, float], ...]:
    """Find pairs of angles, in steps of 90°, at which the cubes of the two bodies overlap.

    Parameters
    ----------
    spec : DoubleSpec
        The hinge.

    Returns
    -------
    tuple of (float, float)
        Angles of the first and the second axis in degrees, within the turns of both.
    """
    half = 0.5 * spec.size
    corners = np.array(list(product((0.0, 1.0), repeat=3)))
    parent = np.array([(-spec.size, -half, -half), (0.0, half, half)])
    child = np.column_stack([corners * spec.size + (0.0, -half, -half), np.ones(8)])
    found = []
    for first, second in product(*(np.arange(0.0, turn + 1.0, 90.0) for turn in spec.turns)):
        # In steps of 90 degrees a cube stays square to the axes.
        moved: NDArray[np.float64] = (child_pose(spec, first, second) @ child.T).T[:, :3]
        low = np.maximum(parent[0], moved.min(axis=0))
        high = np.minimum(parent[1], moved.max(axis=0))
        if (high - low > _TOUCH * spec.size).all():
            found.append((float(first), float(second)))
    return tuple(found)
