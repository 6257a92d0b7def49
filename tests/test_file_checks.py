"""Checks of files that are not ours: what is wrong with them, how much, and where."""

import json

import manifold3d
import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

from fabfold.cli.app import app
from fabfold.errors import ModelError
from fabfold.printing.file_checks import check_file, parts_of
from fabfold.printing.profiles import load_profile
from fabfold.printing.standing import stands_over
from fabfold.progress import SilentProgress

PLA = load_profile("fdm-pla-0.4")
MJF = load_profile("mjf-pa12")


def cube(low, high):
    size = np.subtract(high, low)
    return manifold3d.Manifold.cube(tuple(map(float, size))).translate(tuple(map(float, low)))


def tube(outer, inner, height):
    rod = manifold3d.Manifold.cylinder
    return rod(height, outer, outer, 256) - rod(height + 2, inner, inner, 256).translate((0, 0, -1))


def written(tmp_path, *solids):
    meshes = []
    for solid in solids:
        mesh = solid.to_mesh64()
        meshes.append(trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts, process=False))
    path = tmp_path / "toy.stl"
    trimesh.util.concatenate(meshes).export(path)
    return path


def checked(path, profile=PLA):
    return {check.name: check for check in check_file(path, profile, SilentProgress())}


def shell(size, wall):
    return manifold3d.Manifold.sphere(size, 128) - manifold3d.Manifold.sphere(size - wall, 128)


WALLS = {
    "plate": (lambda: cube((0, 0, 0), (40, 30, 1.2)), 1.2),
    "tube": (lambda: tube(10.0, 8.5, 20.0), 1.5),
    "shell": (lambda: shell(15.0, 2.0) - cube((-2, -2, 10), (2, 2, 20)), 2.0),
}


@pytest.mark.parametrize("form", WALLS)
def test_the_thinnest_wall_is_found_within_two_per_cent(tmp_path, form):
    make, wall = WALLS[form]
    found = checked(written(tmp_path, make()))["thinnest wall"]
    assert found.figure == pytest.approx(wall, rel=0.02)
    assert found.ok


def test_a_thin_wall_fails_and_its_place_is_told(tmp_path):
    fin = cube((0, 0, 0), (30, 30, 5)) + cube((10, 10, 4), (10.5, 20, 25))
    found = checked(written(tmp_path, fin))["thinnest wall"]
    assert not found.ok
    assert found.figure == pytest.approx(0.5, rel=0.02)
    x, y, z = (float(text) for text in found.note.split("at ")[1].removesuffix(" mm").split(", "))
    assert 9.9 <= x <= 10.6
    assert 9.9 <= y <= 20.1
    assert 5.0 <= z <= 25.1


def test_gap_and_overlap_of_parts_are_measured(tmp_path):
    apart = checked(written(tmp_path, cube((0, 0, 0), (9, 9, 9)), cube((9.2, 0, 0), (18, 9, 9))))
    assert apart["smallest gap between bodies"].figure == pytest.approx(0.2, abs=1e-5)
    assert not apart["smallest gap between bodies"].ok
    assert "part-01 and part-02" in apart["smallest gap between bodies"].note
    into = checked(written(tmp_path, cube((0, 0, 0), (9, 9, 9)), cube((8, 0, 0), (18, 9, 9.5))))
    assert into["bodies overlap"].figure == pytest.approx(81.0, rel=1e-4)
    assert not into["bodies overlap"].ok


def test_a_closed_pocket_traps_powder_and_not_air(tmp_path):
    path = written(tmp_path, cube((0, 0, 0), (20, 20, 20)) - cube((5, 5, 5), (15, 15, 15)))
    parts, pockets = parts_of(path)
    assert len(parts) == 1
    assert pockets == [pytest.approx(1000.0)]
    assert not checked(path, MJF)["closed pockets"].ok
    assert checked(path, PLA)["closed pockets"].ok


def test_what_lies_hangs_and_topples(tmp_path):
    table = cube((0, 0, 10), (30, 30, 13)) + cube((0, 0, 0), (4, 4, 11))
    found = checked(written(tmp_path, table))
    assert found["contact with the plate"].figure == pytest.approx(16.0)
    assert found["overhang"].figure == pytest.approx(900.0 - 16.0)
    assert found["stands by itself"].figure == 0.0
    floating = checked(written(tmp_path, cube((0, 0, 0), (5, 5, 5)), cube((9, 0, 3), (14, 5, 9))))
    assert "part-01 begin in the air" in floating["contact with the plate"].note


def test_a_centre_of_mass_is_over_the_outline_of_what_touches_or_beside_it():
    turn = np.linspace(0.0, 2.0 * np.pi, 2000, endpoint=False)
    ring = 10.0 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    centre = lambda x: np.array([x, 0.0, 5.0])  # noqa: E731
    assert stands_over(centre(0.0), ring)
    assert stands_over(centre(9.9999), ring)
    assert not stands_over(centre(10.0001), ring)
    square = np.array([[x, y] for x in (-0.3, 0.1) for y in (-0.7, 0.7)]) @ np.array(
        [[0.8, 0.6], [-0.6, 0.8]]
    )
    assert stands_over(np.append(square[2:].mean(axis=0), 5.0), square), "over a side"
    assert not stands_over(centre(0.0), ring[:2])
    line = np.stack([np.arange(-3.0, 4.0), np.zeros(7)], axis=1)
    assert not stands_over(centre(0.0), line), "what touches in a line spans no area"


def test_a_file_that_is_too_large_is_told_the_scale_that_fits(tmp_path):
    found = checked(written(tmp_path, cube((0, 0, 0), (440, 10, 10))))["fits the printer"]
    assert not found.ok
    assert "scaled to 50 % it fits" in found.note


@pytest.mark.slow
def test_the_command_checks_any_file_and_speaks_json(tmp_path, bar_kit):
    path = written(tmp_path, cube((0, 0, 0), (20, 20, 0.4)))
    run = CliRunner().invoke
    done = run(app, ["check", str(path), "--profile", "fdm-pla-0.4", "--json"])
    assert done.exit_code == 1
    said = json.loads(done.stdout)
    assert (said["file"], said["profile"], said["verdict"]) == ("toy.stl", "fdm-pla-0.4", "failed")
    wall = next(check for check in said["checks"] if check["name"] == "thinnest wall")
    assert wall["figure"] == pytest.approx(0.4, rel=0.02)
    kit = bar_kit.folder / f"{bar_kit.recipe.name}.3mf"
    done = run(app, ["check", str(kit), "-q"])
    assert done.exit_code == 0, done.stdout
    assert run(app, ["fit", str(path), "--json"]).exit_code == 2
    (tmp_path / "x.stl").write_text("nothing", "utf-8")
    assert run(app, ["check", str(tmp_path / "x.stl")]).exit_code == 2


def test_what_is_no_part_is_refused(tmp_path):
    mesh = trimesh.creation.box((1, 1, 1))
    mesh.invert()
    mesh.export(tmp_path / "inside.stl")
    with pytest.raises(ModelError, match="inside out"):
        parts_of(tmp_path / "inside.stl")
