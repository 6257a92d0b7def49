"""Print profiles, wall thickness, and checks that find what is wrong with a body."""

from __future__ import annotations

from dataclasses import replace

import manifold3d
import numpy as np
import pytest
from joinery_models import box_mesh, box_strip, motion_of_order, strip_tree, voxels_of

from fabfold.errors import RecipeError
from fabfold.joinery.bodies import BodyMesh, Joinery
from fabfold.joinery.build import build_bodies
from fabfold.joinery.sizes import hinge_size
from fabfold.printing.body_checks import check_bodies
from fabfold.printing.gap_checks import smallest_gap
from fabfold.printing.profiles import DEFAULT_PROFILE, Profile, load_profile, profile_names
from fabfold.printing.thickness import ray_thickness, surface_samples

SHIPPED = ["fdm-petg-0.4", "fdm-pla-0.4", "mjf-pa12", "polyjet", "sla-tough", "sls-pa12"]


def test_shipped_profiles_are_all_there():
    assert set(SHIPPED) <= set(profile_names())
    assert load_profile(DEFAULT_PROFILE).in_place


@pytest.mark.parametrize("name", profile_names())
def test_profile_has_sources_and_works_at_twenty_millimetres(name):
    profile = load_profile(name)
    assert profile.name == name
    assert profile.description
    assert profile.sources
    assert profile.min_gap_mm < profile.clearance_mm
    size = hinge_size(20.0, profile.clearance_mm)
    wall = size.barrel_radius_mm - size.pin_radius_mm - (np.sqrt(2) - 1) * size.clearance_mm
    assert wall >= profile.min_wall_mm - 1e-9


MINE = """
name = "mine"
process = "FDM"
clearance_mm = 0.4
min_gap_mm = 0.3
min_wall_mm = 0.8
in_place = false
"""


def test_own_file_is_a_profile(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(MINE, encoding="utf-8")
    assert load_profile(str(path)) == Profile(
        name="mine",
        process="FDM",
        clearance_mm=0.4,
        min_gap_mm=0.3,
        min_wall_mm=0.8,
        in_place=False,
    )


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        (MINE + "nozle_mm = 0.4\n", "nozle_mm"),
        (MINE.replace("0.8", "-1"), "min_wall_mm"),
        (MINE.replace("= 0.3", "= 0.5"), "must be below clearance_mm"),
        (MINE.replace('"FDM"', "3"), "process"),
        ("name = ", "cannot be read"),
        ("", "name is missing"),
    ],
)
def test_wrong_profile_file_says_what_is_wrong(tmp_path, text, wanted):
    path = tmp_path / "wrong.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(RecipeError, match=wanted) as caught:
        load_profile(str(path))
    assert "wrong.toml" in str(caught.value)


@pytest.mark.parametrize("name", ["", "nylon", "missing.toml", "../prints"])
def test_unknown_profile_lists_the_known_ones(name):
    with pytest.raises(RecipeError, match=r"fdm-pla-0\.4.*mjf-pa12.*sls-pa12"):
        load_profile(name)


def test_thickness_of_a_plate():
    vertices, faces = box_mesh([0, 0, 0], [40, 30, 2])
    solid = manifold3d.Manifold.cube((40, 30, 2))
    found = ray_thickness(solid, vertices, faces, 400, 50.0)
    flat = (found.points[:, 2] < 1e-9) | (found.points[:, 2] > 2 - 1e-9)
    assert found.values[flat] == pytest.approx(2.0, abs=1e-3)
    assert set(np.round(found.values[~flat], 2)) <= {30.0, 40.0}
    assert found.share_below(1.9) == 0.0
    assert found.share_below(2.1) == pytest.approx(2400 / (2400 + 280), abs=0.02)


def test_rays_end_where_they_are_told_to():
    vertices, faces = box_mesh([0, 0, 0], [10, 10, 10])
    found = ray_thickness(manifold3d.Manifold.cube((10, 10, 10)), vertices, faces, 60, 3.0)
    assert (found.values == 3.0).all()


def test_samples_lie_on_the_surface_by_area():
    vertices, faces = box_mesh([0, 0, 0], [10, 10, 1])
    points, normals = surface_samples(vertices, faces, 1000)
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1.0)
    top = points[:, 2] > 1 - 1e-9
    assert top.mean() == pytest.approx(100 / 240, abs=0.01)
    assert (normals[top] == [0, 0, 1]).all()
    again, _ = surface_samples(vertices, faces, 1000)
    assert (points == again).all()


def test_gap_of_nested_solids_is_no_gap():
    outer, inner = manifold3d.Manifold.cube((10, 10, 10), True), manifold3d.Manifold.sphere(1.0)
    assert smallest_gap(outer, inner, 1.0)[0] == 0.0
    apart = smallest_gap(outer, inner.translate((6.5, 0, 0)), 1.0)
    assert apart == (pytest.approx(0.5, abs=1e-6), 0.0)


@pytest.fixture(scope="module")
def strip():
    tree = strip_tree(4, [1])
    motion = motion_of_order(tree, [0])
    joinery = build_bodies(
        voxels_of(tree.source, box_strip(4)), tree, motion, voxel_mm=20.0, clearance_mm=0.5
    )
    return tree, motion, joinery


def found(checks, name):
    return next(check for check in checks if check.name == name)


def with_body(joinery: Joinery, vertices, faces) -> Joinery:
    body = BodyMesh("body-01", np.asarray(vertices, dtype=float), np.asarray(faces, dtype=np.int32))
    return replace(joinery, bodies=(joinery.bodies[0], body))


def test_sound_kit_passes_every_check(strip):
    tree, motion, joinery = strip
    checks = check_bodies(joinery, tree, motion, load_profile("mjf-pa12"))
    assert [check.name for check in checks if not check.ok] == []
    gap = found(checks, "smallest gap between bodies")
    assert gap.figure == pytest.approx(0.5, abs=0.005)
    assert gap.limit == 0.4
    assert "body-00 and body-01, at hinge-00" in gap.note
    wall = found(checks, "thinnest wall in a hinge")
    assert wall.figure == pytest.approx(2.5 - 1.49 - (np.sqrt(2) - 1) * 0.5, abs=0.02)
    material = found(checks, "material")
    assert material.limit is None
    assert material.figure == pytest.approx(sum(b.volume for b in joinery.bodies) / 1000)
    assert "40 × 40 × 20 mm in 2 moves" in material.note
    assert found(checks, "smallest body").figure == pytest.approx(
        min(b.volume for b in joinery.bodies)
    )
    assert all(isinstance(check.ok, bool) and check.note for check in checks)


def test_gap_too_small_for_the_printer_fails(strip):
    tree, motion, joinery = strip
    strict = load_profile("sls-pa12").model_copy(update={"min_gap_mm": 0.55})
    check = found(check_bodies(joinery, tree, motion, strict), "smallest gap between bodies")
    assert not check.ok
    assert "--clearance-mm" in check.note


def test_open_mesh_fails_and_names_the_body(strip):
    tree, motion, joinery = strip
    broken = with_body(joinery, joinery.bodies[1].vertices, joinery.bodies[1].faces[1:])
    checks = check_bodies(broken, tree, motion, load_profile("mjf-pa12"))
    closed = found(checks, "closed surfaces")
    assert (closed.figure, closed.ok) == (3.0, False)
    assert "body-01 (3)" in closed.note
    assert not found(checks, "bodies are solids").ok


def test_loose_piece_fails(strip):
    tree, motion, joinery = strip
    body = joinery.bodies[1]
    vertices, faces = box_mesh([300, 0, 0], [301, 1, 1])
    loose = with_body(
        joinery,
        np.concatenate([body.vertices, vertices]),
        np.concatenate([body.faces, faces + len(body.vertices)]),
    )
    checks = check_bodies(loose, tree, motion, load_profile("mjf-pa12"))
    assert (found(checks, "one piece a body").figure, found(checks, "one piece a body").ok) == (
        1.0,
        False,
    )


def test_crossing_surfaces_and_overlaps_fail(strip):
    tree, motion, joinery = strip
    one, faces = box_mesh([50, 5, 5], [70, 15, 15])
    other, more = box_mesh([60, 7, 7], [90, 12, 12])
    crossing = with_body(
        joinery, np.concatenate([one, other]), np.concatenate([faces, more + len(one)])
    )
    assert not found(
        check_bodies(crossing, tree, motion, load_profile("mjf-pa12")),
        "surfaces that cross themselves",
    ).ok
    inside, faces = box_mesh([30, 5, 5], [50, 15, 15])
    overlapping = check_bodies(
        with_body(joinery, inside, faces), tree, motion, load_profile("mjf-pa12")
    )
    assert not found(overlapping, "bodies overlap").ok
    assert "body-00 and body-01" in found(overlapping, "bodies overlap").note
    assert found(overlapping, "smallest gap between bodies").figure == 0.0


def test_blade_fails_the_wall(strip):
    tree, motion, joinery = strip
    blade, faces = box_mesh([50, 0, 0], [90, 60, 0.4])
    checks = check_bodies(with_body(joinery, blade, faces), tree, motion, load_profile("sla-tough"))
    check = found(checks, "surface thinner than the printer's wall")
    assert not check.ok
    assert "body-01 (98 %)" in check.note or "body-01 (99 %)" in check.note


def test_thin_hinge_wall_and_small_bed_fail(strip):
    tree, motion, joinery = strip
    thick = load_profile("mjf-pa12").model_copy(
        update={"min_wall_mm": 1.2, "bed_mm": (60.0, 60.0, 60.0)}
    )
    checks = check_bodies(joinery, tree, motion, thick)
    assert not found(checks, "thinnest wall in a hinge").ok
    fits = found(checks, "fits the printer")
    assert not fits.ok
    assert "the closed kit" in fits.note
    # Printed apart, the same bodies fit the bed.
    apart = check_bodies(joinery, tree, motion, thick.model_copy(update={"in_place": False}))
    assert found(apart, "fits the printer").ok


def test_overhang_of_a_table():
    tree = strip_tree(2, [1], run=1)
    motion = motion_of_order(tree, [0])
    parts = [
        manifold3d.Manifold.cube((20, 20, 2)).translate((0, 0, 10)),
        manifold3d.Manifold.cube((4, 4, 10.5)).translate((8, 8, 0)),
    ]
    mesh = manifold3d.Manifold.batch_boolean(parts, manifold3d.OpType.Add).to_mesh64()
    table = BodyMesh(
        "body-00",
        np.array(mesh.vert_properties[:, :3]),
        np.array(mesh.tri_verts, dtype=np.int32),
    )
    plain, faces = box_mesh([40, 0, 0], [50, 10, 10])
    joinery = Joinery(
        (table, BodyMesh("body-01", plain, faces)), 20.0, (0.0, 0.0, 0.0), 0.4, 2.5, 1.5, 3
    )
    check = found(check_bodies(joinery, tree, motion, load_profile("fdm-pla-0.4")), "overhang")
    assert check.ok
    # Upside down, a table has no overhang; standing, its top hangs over by 400 - 16 mm².
    assert check.figure == pytest.approx(0.0, abs=1e-9)
    assert "0 % with -z up" in check.note
    free = check_bodies(joinery, tree, motion, load_profile("sls-pa12"))
    assert "no support" in found(free, "overhang").note


def test_hinges_and_profiles_have_one_default_a_process():
    import hinges
    from fabfold.version import __version__
    from hinges.clearance import PROCESSES

    assert hinges.__version__ == __version__
    usual = ("fdm-pla-0.4", "mjf-pa12", "polyjet", "sla-tough", "sls-pa12")
    profiles = {p.process.lower(): p.clearance_mm for p in map(load_profile, usual)}
    assert profiles == {name: process.radial for name, process in PROCESSES.items()}
