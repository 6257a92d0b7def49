"""Gaps, overlaps and soundness of bodies as a user has them, measured apart from the library."""

from __future__ import annotations

from itertools import combinations

import manifold3d as m3
import numpy as np

#: How far meshes may lie off their surfaces, mm: gaps are that much larger at most, on either side.
FINE = 0.004


def solid_mesh(part) -> m3.Manifold:
    """The mesh of a part; each of its solids must close."""
    pieces = []
    for solid in part.solids():
        corners, faces = solid.tessellate(FINE, 0.15)
        points = np.array([tuple(corner) for corner in corners])
        _, first, back = np.unique(
            np.round(points, 6), axis=0, return_index=True, return_inverse=True
        )
        faces = back.reshape(-1)[np.array(faces)]
        faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
        piece = m3.Manifold(m3.Mesh64(points[first], faces.astype(np.uint64)))
        assert piece.status() == m3.Error.NoError
        assert piece.volume() > 0.0
        pieces.append(piece)
    return m3.Manifold.compose(pieces)


def sound(*parts) -> bool:
    """Whether every part is one solid that the kernel finds valid."""
    return all(len(part.solids()) == 1 and part.solid().is_valid for part in parts)


def _mesh_gap(one: m3.Manifold, other: m3.Manifold, up_to: float) -> float:
    shared = (one ^ other).volume()
    return -shared if shared > 1e-6 else one.min_gap(other, up_to)


def gap(one, other, up_to=0.6) -> float:
    """Smallest distance of two parts, mm; below 0 where they share volume: minus mm³."""
    return _mesh_gap(solid_mesh(one), solid_mesh(other), up_to)


def least_gap(*parts, up_to=0.6) -> float:
    """Smallest gap of any two of several parts."""
    pairs = combinations([solid_mesh(part) for part in parts], 2)
    return min(_mesh_gap(one, other, up_to) for one, other in pairs)


def overhang(part, up=(0.0, 0.0, 1.0), steepest=46.0) -> float:
    """Area in mm² of faces above the bed that lean out by more than an angle from the upright."""
    mesh = solid_mesh(part).to_mesh64()
    corners = mesh.vert_properties[:, :3][mesh.tri_verts]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * np.linalg.norm(cross, axis=1)
    down = -(cross @ np.array(up)) / np.maximum(2.0 * area, 1e-12)
    high = (corners @ np.array(up)).min(axis=1)
    hangs = (down > np.sin(np.radians(steepest))) & (high > high.min() + 0.05)
    return float(area[hangs].sum())
