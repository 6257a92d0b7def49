"""Voxels of given material, for tests that need no model."""

from __future__ import annotations

import numpy as np

from fabfold.voxels.voxel_model import Voxels


def material_voxels(
    cells: list[tuple[int, int, int]], material: np.ndarray | None = None
) -> Voxels:
    """Voxels with the given material, full cubes by default; the mesh is a mere placeholder."""
    where = np.array(cells, dtype=np.int32)
    solid = np.ones((len(cells), 20, 20, 20), dtype=bool) if material is None else material
    extent = where.max(axis=0) + 2
    return Voxels(
        cells=where,
        subvoxels=solid,
        fill=solid.mean(axis=(1, 2, 3)),
        vertices=np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float),
        faces=np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], dtype=np.int32),
        rotation=np.eye(3),
        origin=np.array([0.25, -1.0, 3.0]),
        pitch=12.5,
        plane_offsets=tuple(np.zeros(n) for n in extent),
        lost_volume=0.015625,
        energy={"fullness": 1.5, "score": -0.25},
    )
