"""`fabfold inspect`: what is told of a model before anything is made of it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

from fabfold.cli.app import app
from fabfold.solid.inspection import inspect_model
from tests.test_solid_3mf import ITEM, mesh, thing, write
from tests.test_solid_dialects import binary_stl

KEYS = {
    "file", "format", "units", "triangles", "pieces", "size", "volume", "painted", "objects",
    "thin_share", "templates", "notes",
}  # fmt: skip


def inspected(*arguments: object) -> dict[str, object]:
    done = CliRunner().invoke(app, ["inspect", *map(str, arguments), "--json"])
    assert done.exit_code == 0, done.output
    found: dict[str, object] = json.loads(done.output)
    assert set(found) == KEYS
    return found


def test_figures_are_those_of_the_file(tmp_path: Path) -> None:
    path = tmp_path / "block.stl"
    trimesh.creation.box((40, 30, 20)).export(path)
    found = inspected(path)
    assert found["size"] == [40.0, 30.0, 20.0]
    assert found["volume"] == pytest.approx(24000.0)
    assert (found["triangles"], found["pieces"]) == (12, 1)
    assert (found["format"], found["units"], found["painted"]) == ("STL", "none", False)
    assert found["notes"] == []
    assert found["thin_share"] < 0.01


@pytest.mark.slow
def test_units_colours_and_objects(tmp_path: Path) -> None:
    red = np.full(12, 0x8000 | 31 << 10)
    red[:4] = 0x8000 | 31
    path = tmp_path / "cube.stl"
    path.write_bytes(binary_stl(attributes=red))
    assert inspected(path)["painted"] == ["#ff0000", "#0000ff"]
    red[:] = 0x8000 | 31
    path.write_bytes(binary_stl(attributes=red))
    assert inspected(path)["painted"] is False
    parts = thing(1, mesh(), 'name="lid"') + thing(2, mesh(2, (50, 0, 0)), 'name="box"')
    package = write(tmp_path / "two.3mf", parts, ITEM(1, "") + ITEM(2, ""))
    text = package.with_name("renamed.3mf")
    package.rename(text)
    done = CliRunner().invoke(app, ["inspect", str(text)])
    assert done.exit_code == 2
    assert "1: lid, 2: box" in done.stderr
    found = inspected(text, "--object", "box")
    assert (found["units"], found["volume"]) == ("mm", pytest.approx(64000.0))


def test_pieces_and_repairs_are_told(tmp_path: Path) -> None:
    big, crumb = trimesh.creation.box((20, 20, 20)), trimesh.creation.box((2, 2, 2))
    crumb.apply_translation((30, 0, 0))
    path = tmp_path / "crumb.stl"
    trimesh.util.concatenate([big, crumb]).export(path)
    found = inspect_model(path)
    assert found.pieces == 2
    assert any("1 loose piece was dropped" in note for note in found.notes)
    assert found.volume == pytest.approx(8000.0)


@pytest.mark.slow
def test_thin_models_want_more_voxels(tmp_path: Path) -> None:
    cross = [trimesh.creation.box(size) for size in ((80, 8, 8), (8, 80, 8), (8, 8, 80))]
    path = tmp_path / "cross.stl"
    trimesh.boolean.union(cross, engine="manifold").export(path)
    plate = tmp_path / "plate.stl"
    trimesh.creation.box((60, 60, 2)).export(plate)
    chunky = tmp_path / "block.stl"
    trimesh.creation.box((40, 30, 20)).export(chunky)
    thick, thin = inspect_model(chunky), inspect_model(plate)
    assert thin.thin_share > 0.5 > thick.thin_share
    assert thin.templates[0] == "box-5x5x5"
    assert thick.templates[0] == "box-3x3x4"
    assert 0.0 <= inspect_model(path).thin_share < 0.5


def test_samples_and_words(tmp_path: Path) -> None:
    found = inspected("sample:car")
    assert (found["format"], found["units"], found["pieces"]) == ("sample", "mm", 1)
    done = CliRunner().invoke(app, ["inspect", "sample:car"])
    assert done.exit_code == 0
    assert "72 x 37.2 x 35.8 mm" in done.output
    (tmp_path / "empty.stl").write_bytes(b"")
    done = CliRunner().invoke(app, ["inspect", str(tmp_path / "empty.stl")])
    assert done.exit_code == 2
    assert "empty.stl is empty" in done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["empty.stl"]
