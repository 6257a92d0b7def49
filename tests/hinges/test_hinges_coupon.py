"""The tolerance coupon: bodies, gaps, overhangs, files."""

from itertools import combinations

import lib3mf
import manifold3d
import numpy as np
import pytest
from build123d import import_step

from hinges import Coupon, FitError, HingeError
from hinges.digits import raised_number
from hinges.mesh import manifold_of
from hinges.tolerance_coupon import DEFAULT_CLEARANCES, coupon_meshes, plan_coupon, write_coupon

FEW = (0.2, 0.35)


@pytest.fixture(scope="module")
def solids():
    meshes = coupon_meshes(plan_coupon(DEFAULT_CLEARANCES, 20.0, 0.8))
    return [
        manifold3d.Manifold(manifold3d.Mesh64(mesh.vertices, mesh.faces.astype(np.uint64)))
        for mesh in meshes
    ]


def test_one_frame_and_three_bodies_for_each_clearance(solids):
    assert len(solids) == 1 + 3 * len(DEFAULT_CLEARANCES)
    assert all(len(solid.decompose()) == 1 for solid in solids)
    assert all(solid.bounding_box()[2] == pytest.approx(0.0, abs=1e-6) for solid in solids)


def test_every_gap_is_the_number_on_the_frame(solids):
    frame, rest = solids[0], solids[1:]
    for index, clearance in enumerate(DEFAULT_CLEARANCES):
        flap, link, double = rest[3 * index : 3 * index + 3]
        for one, other in ((frame, flap), (frame, link), (link, double)):
            assert (one ^ other).volume() == pytest.approx(0.0, abs=1e-9)
            assert one.min_gap(other, clearance + 0.05) == pytest.approx(clearance, abs=0.005)
        assert frame.min_gap(double, 1.0) == 1.0
    for one, other in combinations(rest[::3], 2):
        assert one.min_gap(other, 1.0) >= 1.0


def test_flaps_turn_half_way_round_without_touching(solids):
    frame, flap = solids[0], solids[1]
    # the axis: 12 mm from the frame's middle line, at the height of the barrels' centre
    axis = np.array([0.0, -12.0, flap.bounding_box()[5] - 3.0])
    for angle in range(0, 181, 20):
        turned = flap.translate(tuple(-axis)).rotate((-angle, 0, 0)).translate(tuple(axis))
        assert (frame ^ turned).volume() == pytest.approx(0.0, abs=1e-9)
        assert frame.min_gap(turned, 0.3) >= 0.15 - 1e-6


def test_it_prints_without_support(solids):
    """Nothing above the bed overhangs by more than 45°, to the rounding of the facets."""
    for solid in solids:
        mesh = solid.to_mesh64()
        corners = mesh.vert_properties[:, :3][mesh.tri_verts]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        areas = 0.5 * np.linalg.norm(normals, axis=1)
        steep = normals[:, 2] < -np.cos(np.radians(42.0)) * np.maximum(2.0 * areas, 1e-12)
        above = corners[:, :, 2].min(axis=1) > 0.05
        assert areas[steep & above].sum() < 0.5


@pytest.mark.slow
def test_the_exact_coupon_agrees(solids):
    coupon = Coupon(FEW)
    assert coupon.names[0] == "frame"
    assert len(coupon.solids()) == len(coupon.names) == 7
    assert all(solid.is_valid for solid in coupon.solids())
    volumes = [solid.volume for solid in coupon.solids()]
    meshes = [
        manifold3d.Manifold(manifold3d.Mesh64(mesh.vertices, mesh.faces.astype(np.uint64))).volume()
        for mesh in coupon.meshes
    ]
    assert volumes == pytest.approx(meshes, rel=5e-3)


@pytest.mark.parametrize("suffix", ["3mf", "stl"])
def test_files_are_the_same_from_run_to_run(tmp_path, suffix):
    paths = [tmp_path / name / f"coupon.{suffix}" for name in ("one", "two")]
    for path in paths:
        write_coupon(path, FEW, guide=False)
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_3mf_is_one_object_so_that_no_slicer_moves_flaps(tmp_path):
    write_coupon(tmp_path / "coupon.3mf", FEW, guide=False)
    wrapper = lib3mf.get_wrapper()
    model = wrapper.CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(tmp_path / "coupon.3mf"))
    assert reader.GetWarningCount() == 0
    objects = model.GetMeshObjects()
    assert objects.Count() == 1
    objects.MoveNext()
    body = objects.GetCurrentMeshObject()
    assert body.IsManifoldAndOriented()
    assert model.GetUnit() == lib3mf.ModelUnit.MilliMeter


@pytest.mark.slow
def test_step_holds_every_body_by_name(tmp_path):
    written = write_coupon(tmp_path / "coupon.step", (0.3,), guide=False)
    assert written == [tmp_path / "coupon.step"]
    read = import_step(written[0])
    assert len(read.solids()) == 4
    text = written[0].read_text("utf-8")
    for name in ("frame", "single 0.30", "link 0.30", "double 0.30"):
        assert f"'{name}'" in text


def test_refusals(tmp_path):
    with pytest.raises(HingeError, match="use a name that ends in"):
        write_coupon(tmp_path / "coupon.txt")
    with pytest.raises(HingeError, match="at least one"):
        Coupon(())
    with pytest.raises(HingeError, match="only once"):
        Coupon((0.3, 0.3))
    with pytest.raises(FitError, match=r"coupon hinge at 1\.5 mm"):
        plan_coupon((0.3, 1.5), 20.0, 0.8)
    with pytest.raises(HingeError, match="cannot raise"):
        raised_number("0.3a", 0, 0, 0)


def test_numbers_are_raised_in_one_piece_a_digit():
    shapes = raised_number("0123456789.", 0.0, 0.0, 1.0)
    assert len(shapes) == 11
    for shape in shapes:
        solid = manifold_of(shape, 32, outside=False)
        assert len(solid.decompose()) == 1
        assert solid.bounding_box()[5] == pytest.approx(1.6)
