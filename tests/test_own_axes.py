"""Axes that turn and mirror with the model."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from fabfold.samples.builtin import load_sample
from fabfold.solid.own_axes import own_axes

#: The same examples in every run, and no folder for those that failed.
QUICK = settings(deadline=None, max_examples=10, derandomize=True, database=None)


def angle_bracket() -> trimesh.Trimesh:
    foot = trimesh.creation.box((30, 10, 12))
    arm = trimesh.creation.box((10, 40, 12)).apply_translation((-10, 15, 0))
    return trimesh.boolean.union([foot, arm])


SHAPES = {
    "cube": trimesh.creation.box((2, 2, 2)),
    "square bar": trimesh.creation.box((8, 2, 2)),
    "brick": trimesh.creation.box((3, 2, 1)),
    "wheel": trimesh.creation.cylinder(1, 0.3, sections=30),
    "hexagon": trimesh.creation.cylinder(1, 1, sections=6),
    "pyramid": trimesh.creation.cone(1, 2, sections=5),
    "ring": trimesh.creation.torus(3, 1),
    "bracket": angle_bracket(),
    "duck": load_sample("duck"),
}


def in_own_axes(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    own = np.asarray(points) @ own_axes(points, faces).T
    return own - own.mean(axis=0)


@pytest.mark.slow
@pytest.mark.parametrize("name", SHAPES)
@QUICK
@given(axis=st.tuples(*[st.floats(-1, 1)] * 3), angle=st.floats(-180, 180), mirrored=st.booleans())
def test_a_turned_or_mirrored_model_lies_alike_in_them(
    name: str, axis: tuple[float, float, float], angle: float, mirrored: bool
) -> None:
    """Alike as a set of points: a symmetry of the model may change which is which."""
    if np.linalg.norm(axis) < 0.1:
        return
    shape = SHAPES[name]
    points, faces = np.asarray(shape.vertices, dtype=float), np.asarray(shape.faces)
    turn = trimesh.transformations.rotation_matrix(np.radians(angle), axis)[:3, :3]
    if mirrored:
        turn[0], faces = -turn[0], faces[:, ::-1]
    wanted = in_own_axes(points, np.asarray(shape.faces))
    found = in_own_axes(7.3 * points @ turn.T + [40.0, -3.0, 1.0], faces) / 7.3
    assert cKDTree(wanted).query(found)[0].max() < 1e-9 * np.ptp(points)
    assert cKDTree(found).query(wanted)[0].max() < 1e-9 * np.ptp(points)


def test_they_are_those_of_the_blocks_longest_first() -> None:
    brick = trimesh.creation.box((1, 3, 2))
    axes = own_axes(np.asarray(brick.vertices), np.asarray(brick.faces))
    assert np.allclose(np.abs(axes), [[0, 1, 0], [0, 0, 1], [1, 0, 0]], atol=1e-12)
    # A bracket has no such principal axes: they lean towards its far corners.
    bracket = angle_bracket()
    axes = own_axes(np.asarray(bracket.vertices), np.asarray(bracket.faces))
    assert np.allclose(np.abs(axes).max(axis=1), 1.0, atol=1e-12)


def test_only_a_shape_without_mirror_symmetry_tells_its_hand() -> None:
    """A screw's axes are left-handed where those of its mirror image are right-handed."""
    duck = load_sample("duck")
    points, faces = np.array(duck.vertices), np.asarray(duck.faces)
    points[:, 1] += 0.1 * points[:, 0] * points[:, 2] / np.ptp(points)  # no longer symmetric
    here = np.linalg.det(own_axes(points, faces))
    there = np.linalg.det(own_axes(points * [-1, 1, 1], faces[:, ::-1]))
    assert round(here * there) == -1


def test_a_mesh_without_area_keeps_the_axes_of_its_file() -> None:
    flat = np.zeros((3, 3))
    assert np.array_equal(own_axes(flat, np.array([[0, 1, 2]])), np.eye(3))
