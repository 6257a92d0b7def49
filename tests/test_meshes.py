"""Helpers of triangle meshes and of colours, on random ones."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fabfold.meshes import (
    compact,
    face_areas,
    face_normals,
    is_closed,
    mesh_volume,
    triple_products,
    weld,
)
from fabfold.srgb import bytes_of_light, colour_of_hex, hex_of_colour, linear_light

#: The same examples in every run, and no folder for those that failed.
QUICK = settings(deadline=None, max_examples=50, derandomize=True, database=None)

#: Few different numbers, so that many points are equal; both zeros are among them.
POINTS = arrays(np.float64, (12, 3), elements=st.sampled_from([0.0, -0.0, 1.0, 2.5]))
FACES = arrays(np.int64, (10, 3), elements=st.integers(0, 11))


@pytest.mark.slow
@pytest.mark.parametrize("order", ["zyx", "xyz", "use"])
@QUICK
@given(vertices=POINTS, faces=FACES)
def test_weld_joins_equal_points_only(order: str, vertices: np.ndarray, faces: np.ndarray) -> None:
    points, triangles = weld(vertices, faces, order)
    assert len(np.unique(points, axis=0)) == len(points)
    assert not np.signbit(points).any()
    corners = vertices[faces]
    sides = (corners != np.roll(corners, 1, axis=1)).any(axis=2)
    kept = corners[sides.all(axis=1)]
    assert np.array_equal(points[triangles], kept)
    if order == "use":
        _, first = np.unique((vertices + 0.0)[faces.ravel()], axis=0, return_index=True)
        assert np.array_equal(points, vertices[faces.ravel()][np.sort(first)])
    else:
        expected = np.unique(vertices[:, :: 1 if order == "xyz" else -1], axis=0)
        assert np.array_equal(points, expected[:, :: 1 if order == "xyz" else -1])


@QUICK
@given(vertices=POINTS, faces=FACES)
def test_compact_keeps_the_triangles_and_drops_unused_points(
    vertices: np.ndarray, faces: np.ndarray
) -> None:
    points, triangles = compact(vertices, faces)
    assert np.array_equal(points[triangles], vertices[faces])
    assert np.array_equal(np.unique(triangles), np.arange(len(points)))


def test_areas_normals_and_volume_of_a_turned_ellipsoid() -> None:
    mesh = trimesh.creation.icosphere(subdivisions=2)
    mesh.apply_scale((1, 2, 3)).apply_translation((5, -3, 2))
    mesh.apply_transform(trimesh.transformations.rotation_matrix(0.7, (1, 2, 3)))
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    corners = vertices[faces]
    normals, areas = face_normals(corners)
    assert normals == pytest.approx(mesh.face_normals)
    assert areas == pytest.approx(mesh.area_faces)
    assert np.array_equal(areas, face_areas(corners))
    assert mesh_volume(vertices, faces) == pytest.approx(mesh.volume)
    assert mesh_volume(vertices, faces[:, ::-1]) == pytest.approx(-mesh.volume)
    assert triple_products(corners).sum() == pytest.approx(6 * mesh.volume)
    assert is_closed(faces)
    assert not is_closed(faces[1:])


def test_a_triangle_without_area_has_no_normal() -> None:
    corners = np.array([[[0, 0, 0], [1, 1, 1], [3, 3, 3]], [[0, 0, 0], [2, 0, 0], [0, 2, 0]]])
    normals, areas = face_normals(corners.astype(float))
    assert normals.tolist() == [[0, 0, 0], [0, 0, 1]]
    assert areas.tolist() == [0, 2]


@QUICK
@given(colour=st.tuples(*[st.integers(0, 255)] * 3))
def test_colours_come_back_from_light_and_from_text(colour: tuple[int, int, int]) -> None:
    light = linear_light(colour)
    assert ((light >= 0) & (light <= 1)).all()
    assert bytes_of_light(light).tolist() == list(colour)
    assert colour_of_hex(hex_of_colour(colour)) == colour
    assert colour_of_hex(f" {hex_of_colour(colour)[1:].upper()} ") == colour


@pytest.mark.parametrize("text", ["", "#12345", "#1234567", "#12345g", "red"])
def test_what_is_no_colour(text: str) -> None:
    assert colour_of_hex(text) is None
