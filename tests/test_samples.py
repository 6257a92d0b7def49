"""The built-in samples: sound solids that stand upright and look the same from both sides."""

from __future__ import annotations

import functools
from typing import Any

import manifold3d
import numpy as np
import pytest
import trimesh

from fabfold.errors import ModelError
from fabfold.lattice.shipped import load_template
from fabfold.meshes import is_closed
from fabfold.samples.builtin import (
    build_sample,
    drawn_from,
    load_model,
    mesh_sample,
    sample,
    sample_names,
    source_digest,
)
from fabfold.solid.closed_solid import Solid
from fabfold.solid.convert import to_manifold
from fabfold.solid.scan import scan_mesh


@functools.cache
def drawn(name: str) -> Any:
    return build_sample(name)


@functools.cache
def loaded(name: str) -> Solid:
    return load_model(f"sample:{name}")


def test_names() -> None:
    assert {"car", "elephant", "rabbit"} <= set(sample_names())
    assert sample_names() == sorted(sample_names())
    with pytest.raises(ModelError, match=r"no sample 'unicorn'.*rabbit"):
        load_model("sample:unicorn")


def test_templates_of_the_classics() -> None:
    assert sample("car").template == "box-3x4x4"
    assert sample("rabbit").template == "box-4x4x4"
    assert sample("elephant").template == "box-4x4x4"


@pytest.mark.parametrize("name", sample_names())
def test_mesh_was_drawn_by_this_source(name: str) -> None:
    """Drawing takes seconds, so only one sample is drawn again."""
    assert drawn_from(name) == source_digest(name), "draw the meshes again"
    result = loaded(name)
    manifold = to_manifold(result.vertices, result.faces)
    assert manifold.status() == manifold3d.Error.NoError
    assert len(manifold.decompose()) == 1
    assert is_closed(result.faces)
    assert result.notes == ()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["car"])
def test_mesh_is_the_drawn_solid(name: str) -> None:
    part = drawn(name)
    assert part.is_valid
    assert len(part.solids()) == 1
    assert part.label == name
    result = loaded(name)
    meshed = mesh_sample(part, sample(name))
    assert len(meshed.faces) == len(result.faces), "draw the meshes again"
    assert meshed.volume == pytest.approx(result.volume, rel=1e-9)
    assert meshed.sha256 == result.sha256
    assert result.volume == pytest.approx(part.volume, rel=0.01)
    box = part.bounding_box()
    expected = np.array([[box.min.X, box.min.Y, box.min.Z], [box.max.X, box.max.Y, box.max.Z]])
    assert result.bounds == pytest.approx(expected, abs=0.1)


@pytest.mark.parametrize("name", sample_names())
def test_stands_on_the_ground_and_is_symmetric(name: str) -> None:
    result = loaded(name)
    low, high = result.bounds
    assert abs(low[2]) < 0.6
    assert low[1] == pytest.approx(-high[1], abs=0.05)
    mesh = trimesh.Trimesh(result.vertices, result.faces, process=False)
    assert abs(mesh.center_mass[1]) < 0.01 * (high[1] - low[1])
    # The middle of mass stands over the feet.
    feet = result.vertices[result.vertices[:, 2] < low[2] + 3]
    assert feet[:, 0].min() < mesh.center_mass[0] < feet[:, 0].max()


@pytest.mark.parametrize("name", sample_names())
def test_is_chunky_enough_for_its_box(name: str) -> None:
    """Voxels of the size that the box asks for are half full or fuller."""
    result = loaded(name)
    cells = len(load_template(sample(name).template))
    pitch = (result.volume / (0.5 * cells)) ** (1 / 3)
    longest = np.ptp(result.bounds, axis=0).max()
    assert 4.5 < longest / pitch < 8.5
    fine = 10
    reach = np.ceil(np.ptp(result.bounds, axis=0) / pitch / 2 + 0.5).astype(int)
    corner = result.bounds.mean(axis=0) - (reach + 0.5) * pitch
    count = 2 * reach + 1
    x, y, z = (fine * count).tolist()
    inside = scan_mesh((result.vertices - corner) * fine / pitch, result.faces, (x, y, z))
    cubes = inside.reshape(count[0], fine, count[1], fine, count[2], fine)
    touched = int((cubes.mean(axis=(1, 3, 5)) > 0.02).sum())
    assert touched < 1.6 * cells


@pytest.mark.slow
def test_same_bytes_every_time() -> None:
    first, second = loaded("duck"), load_model("sample:duck")
    assert first.vertices.tobytes() == second.vertices.tobytes()
    assert first.faces.tobytes() == second.faces.tobytes()
    assert first.sha256 == second.sha256
    assert first.sha256 != loaded("rabbit").sha256
