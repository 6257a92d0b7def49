"""Kits whose files were changed: each change is found, by the program and by NumPy alone."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from fabfold.cli.app import app
from fabfold.kit.kit import Kit, open_kit
from tests.kit_recheck import FAR, faults, gap, read_kit

Change = Callable[[Path, np.random.Generator], str]


def edit(path: Path, change: Callable[[dict[str, Any]], None]) -> None:
    data = json.loads(path.read_text("utf-8"))
    change(data)
    path.write_text(json.dumps(data), "utf-8")


def triangles(path: Path) -> tuple[bytes, np.ndarray]:
    data = path.read_bytes()
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    return data[:84], np.frombuffer(data, dtype=record, offset=84).copy()


def moved_body(kit: Path, rng: np.random.Generator) -> str:
    """A body moved by half the gap."""
    bodies = sorted((kit / "bodies").glob("*.stl"))
    path = bodies[int(rng.integers(len(bodies)))]
    head, records = triangles(path)
    # Along the bar: bodies lie in a row, so that a gap at one of its ends becomes narrower.
    records["corners"] += np.array([0.25, 0.0, 0.0]) * rng.choice([-1, 1])
    path.write_bytes(head + records.tobytes())
    return f"{path.name} moved"


def hinge_off_its_edge(kit: Path, rng: np.random.Generator) -> str:
    def change(tree: dict[str, Any]) -> None:
        hinge = tree["hinges"][int(rng.integers(len(tree["hinges"])))]
        across = [axis for axis in range(3) if hinge["dir"][axis] == 0]
        hinge["point"][int(rng.choice(across))] += float(rng.choice([-0.02, 0.01, 0.05]))

    edit(kit / "tree.json", change)
    return "hinge off its edge"


def move_left_out(kit: Path, rng: np.random.Generator) -> str:
    def change(motion: dict[str, Any]) -> None:
        del motion["keyframes"][int(rng.integers(1, len(motion["keyframes"])))]

    edit(kit / "motion.json", change)
    return "move left out"


def angle_changed(kit: Path, rng: np.random.Generator) -> str:
    def change(motion: dict[str, Any]) -> None:
        frame = motion["keyframes"][int(rng.integers(1, len(motion["keyframes"])))]
        frame["angles_deg"][int(rng.integers(len(frame["angles_deg"])))] += float(
            rng.choice([-90, -5, 5, 45])
        )

    edit(kit / "motion.json", change)
    return "angle changed"


def bodies_swapped(kit: Path, rng: np.random.Generator) -> str:
    one, other = rng.permutation(sorted((kit / "bodies").glob("*.stl")))[:2]
    contents = one.read_bytes(), other.read_bytes()
    one.write_bytes(contents[1])
    other.write_bytes(contents[0])
    return f"{one.name} and {other.name} swapped"


CHANGES: tuple[Change, ...] = (
    moved_body,
    hinge_off_its_edge,
    move_left_out,
    angle_changed,
    bodies_swapped,
)


@pytest.mark.slow
def test_a_sound_kit_has_no_fault(bar_kit: Kit) -> None:
    assert bar_kit.folder is not None
    kit = read_kit(bar_kit.folder)
    assert faults(kit) == []


def test_distances_of_meshes_are_exact() -> None:
    import trimesh

    box = np.array(trimesh.creation.box((2, 2, 2)).triangles)
    for shift, want in (((2.3, 0, 0), 0.3), ((2.3, 2.4, 0), 0.5), ((9, 0, 0), FAR)):
        assert gap(box, box + np.array(shift)) == pytest.approx(want)
    assert gap(box, box + np.array((1.9, 0.1, 0.2))) == 0.0
    turned = trimesh.creation.box((2, 2, 2))
    turned.apply_transform(trimesh.transformations.rotation_matrix(0.7, (1, 2, 3), (0, 0, 0)))
    turned.apply_translation((2.8, 0.3, 0.1))
    import manifold3d as m3

    solids = [
        m3.Manifold(m3.Mesh(np.array(m.vertices, np.float32), np.array(m.faces, np.uint32)))
        for m in (trimesh.creation.box((2, 2, 2)), turned)
    ]
    assert gap(box, turned.triangles) == pytest.approx(solids[0].min_gap(solids[1], 2), abs=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("change", CHANGES, ids=lambda change: change.__name__)
def test_every_change_of_a_hundred_is_found(bar_kit: Kit, tmp_path: Path, change: Change) -> None:
    assert bar_kit.folder is not None
    rng = np.random.default_rng(7)
    kit = tmp_path / "kit"
    shutil.copytree(bar_kit.folder, kit)
    opened = open_kit(str(kit), workers=1)
    (sound,) = opened.delivered()
    assert sound.ok
    kept = {path: path.read_bytes() for path in kit.rglob("*") if path.is_file()}
    for number in range(20):
        told = change(kit, rng)
        (check,) = opened.delivered()
        assert not check.ok, told
        assert check.figure >= 1
        if number < 3:  # the proof from outside, which takes longer
            assert faults(read_kit(kit)), told
        for path, content in kept.items():
            path.write_bytes(content)
    assert opened.delivered()[0].ok


@pytest.mark.slow
def test_the_command_finds_changes_and_leaves_them(bar_kit: Kit, tmp_path: Path) -> None:
    assert bar_kit.folder is not None
    kit = tmp_path / "kit"
    shutil.copytree(bar_kit.folder, kit)
    run = CliRunner().invoke
    assert run(app, ["check", str(kit), "-q", "-j", "1"]).exit_code == 0
    moved_body(kit, np.random.default_rng(1))
    (kit / "bodies" / "body-99.stl").write_bytes(b"strange")
    (kit / "bar.step").unlink()
    before = {path: path.read_bytes() for path in (kit / "bodies").iterdir()}
    done = run(app, ["check", str(kit), "-q", "-j", "1"])
    assert done.exit_code == 1
    assert "FAILED files as they were written: 3 files" in done.output
    assert "bodies/body-99.stl" in done.output
    assert {path: path.read_bytes() for path in (kit / "bodies").iterdir()} == before
    assert run(app, ["export", str(kit), "-q", "-j", "1"]).exit_code == 0
    assert run(app, ["check", str(kit), "-q", "-j", "1"]).exit_code == 0
