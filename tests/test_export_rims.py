"""Rims of sculpted surfaces with fewer corners."""

from __future__ import annotations

import manifold3d as m3
import numpy as np
import pytest
import trimesh

from fabfold.export.rims import straightened
from fabfold.export.step import THIN_CLEARANCE
from fabfold.export.surfaces import flat_regions
from fabfold.export.thin import thinned
from fabfold.meshes import is_closed, mesh_volume


def _cut_ball(cut: m3.Manifold) -> tuple:
    """A part of a ball of radius 10, its triangles, flat regions and which are the ball's."""
    mesh = (m3.Manifold.sphere(10, 320) ^ cut).to_mesh64()
    vertices = np.array(mesh.vert_properties[:, :3])
    faces = np.array(mesh.tri_verts, dtype=np.int32)
    labels, planes = flat_regions(vertices, faces)
    ball = np.array([max(map(abs, plane.normal)) < 1 - 1e-9 for plane in planes])[labels]
    return vertices, faces, labels, planes, ball


@pytest.fixture(scope="module")
def octant():
    """Three flat faces that meet in the middle, each with a rim of a quarter circle."""
    return _cut_ball(m3.Manifold.cube((20, 20, 20)))


def _on_plane(points: np.ndarray, axis: int) -> np.ndarray:
    return points[np.abs(points[:, axis]) < 1e-9]


@pytest.mark.parametrize("tolerance", [0.02, 0.05, 0.125])
def test_rims_have_fewer_corners_near_those_that_went(octant, tolerance):
    vertices = octant[0]
    points, triangles, sculpted = straightened(*octant, tolerance)
    assert is_closed(triangles)
    known = {tuple(point) for point in vertices.tolist()}
    assert all(tuple(point) in known for point in points.tolist())
    for axis in range(3):
        before, after = _on_plane(vertices, axis), _on_plane(points, axis)
        assert len(after) < len(before)
        rim = after[np.abs(np.linalg.norm(after, axis=1) - 10) < 1e-6]
        rim = rim[np.argsort(np.arctan2(rim[:, (axis + 2) % 3], rim[:, (axis + 1) % 3]))]
        # A chord of a circle is furthest from it in its middle.
        chords = np.linalg.norm(np.diff(rim, axis=0), axis=1)
        assert (10 - np.sqrt(100 - chords**2 / 4)).max() <= tolerance + 1e-9
    flat = points[triangles[~sculpted]]
    in_plane = np.abs(flat).max(axis=1) < 1e-9
    assert in_plane.any(axis=1).all() and in_plane.any(axis=0).all()


def test_corners_where_flat_faces_meet_stay(octant):
    points, _, _ = straightened(*octant, 1.0)
    for corner in ((0, 0, 0), (10, 0, 0), (0, 10, 0), (0, 0, 10)):
        assert np.abs(points - corner).max(axis=1).min() < 1e-9


def test_rims_of_slanted_faces_stay():
    """Only faces along the lattice are known to be cut: any other flat face may be sculpted."""
    ball = _cut_ball(m3.Manifold.cube((40, 40, 40), True).rotate((20, 30, 0)).translate((0, 0, 15)))
    vertices, faces, labels, planes, _ = ball
    count = np.bincount(labels)
    sculpted = labels != count.argmax()
    points, triangles, _ = straightened(vertices, faces, labels, planes, sculpted, 0.1)
    assert len(points) == len(vertices) and len(triangles) == len(faces)


def test_nothing_goes_where_nothing_is_sculpted(octant):
    vertices, faces, labels, planes, ball = octant
    points, triangles, _ = straightened(vertices, faces, labels, planes, ~(ball | ~ball), 0.1)
    assert np.array_equal(points, vertices) and np.array_equal(triangles, faces)


def test_thinning_after_it_keeps_the_bound_from_the_old_mesh(octant):
    """Fewer triangles than thinning alone can do with, no further from the old surface."""
    vertices, faces, _, _, ball = octant
    tolerance = THIN_CLEARANCE * 0.5
    alone = thinned(vertices, faces, ball, tolerance)
    simpler = straightened(*octant, tolerance)
    both = thinned(*simpler, tolerance, original=(vertices, faces))
    assert is_closed(both[1])
    assert len(both[1]) < 0.8 * len(alone[1])
    assert mesh_volume(*both) == pytest.approx(mesh_volume(vertices, faces), rel=3e-3)
    for one, other in (((vertices, faces), both[0]), (both, vertices)):
        away = trimesh.proximity.closest_point(trimesh.Trimesh(*one, process=False), other)[1]
        assert away.max() <= tolerance + 1e-4  # MeshLab measures in single precision


def test_the_old_mesh_comes_back_where_thinning_finds_nothing(octant):
    vertices, faces, _, _, _ = octant
    simpler = straightened(*octant, 3.0)
    points, triangles = thinned(*simpler, 1e-6, original=(vertices, faces))
    assert points is vertices and triangles is faces
