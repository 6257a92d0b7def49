"""The tolerance coupon: bodies, gaps, overhangs, files."""

from itertools import pairwise

import lib3mf
import manifold3d
import numpy as np
import pytest
from build123d import import_step

from hinges import Coupon, FitError, HingeError
from hinges.coupon_files import write_coupon
from hinges.coupon_plan import (
    DEFAULT_CLEARANCES,
    coupon_meshes,
    fine_clearances,
    plan_coupon,
    relieved,
)
from hinges.digits import raised_number
from hinges.shape_meshes import manifold_of

FEW = (0.2, 0.35)


def solids_of(meshes):
    return [
        manifold3d.Manifold(manifold3d.Mesh64(mesh.vertices, mesh.faces.astype(np.uint64)))
        for mesh in meshes
    ]


@pytest.fixture(scope="module")
def solids():
    return solids_of(coupon_meshes(plan_coupon(DEFAULT_CLEARANCES)))


def test_a_frame_a_flap_for_each_clearance_and_a_plug(solids):
    assert len(solids) == 1 + len(DEFAULT_CLEARANCES) + 1
    assert all(len(solid.decompose()) == 1 for solid in solids)
    assert all(solid.bounding_box()[2] == pytest.approx(0.0, abs=1e-6) for solid in solids)


def test_every_gap_is_the_number_on_the_frame(solids):
    frame, *flaps, plug = solids
    for flap, clearance in zip(flaps, DEFAULT_CLEARANCES, strict=True):
        assert (frame ^ flap).volume() == pytest.approx(0.0, abs=1e-9)
        assert frame.min_gap(flap, clearance + 0.05) == pytest.approx(clearance, abs=0.005)
    for one, other in pairwise(flaps):
        assert one.min_gap(other, 1.0) >= 1.0
    assert plug.min_gap(frame, 1.0) >= 1.0


def test_the_plug_has_its_number_as_room_in_every_socket(solids):
    frame, plug = solids[0], solids[-1]
    low, high = np.array(plug.bounding_box()).reshape(2, 3)
    home = plug.translate(tuple(-0.5 * (low + high) * (1, 1, 0)))
    pitch = 13.2
    for index, clearance in enumerate(DEFAULT_CLEARANCES):
        reach = 2.5 + clearance + 0.85
        place = (pitch * (index - 3.5), 2.8 + reach - 0.4, 0.0)
        inside = home.translate(place)
        assert (inside ^ frame).volume() == pytest.approx(0.0, abs=1e-9)
        assert inside.min_gap(frame, 1.0) == pytest.approx(clearance, abs=1e-6)


@pytest.mark.parametrize("pin", [1.75, 2.85])
def test_every_bore_is_its_number_wider_than_the_pin(pin):
    frame = solids_of(coupon_meshes(plan_coupon(DEFAULT_CLEARANCES, pin=pin)))[0]
    for index, clearance in enumerate(DEFAULT_CLEARANCES):
        outer = 0.5 * (pin + clearance) + 0.85
        x, y = 13.2 * (index - 3.5), 2.8 + 2.0 * (2.5 + clearance + 0.85 - 0.4) + outer
        inside = manifold3d.Manifold.cylinder(1.0, 0.5 * pin, circular_segments=64)
        inside = inside.translate((x, y, 1.0))  # the pin in the middle of its bore
        assert (inside ^ frame).volume() == pytest.approx(0.0, abs=1e-9)
        assert inside.min_gap(frame, 1.0) == pytest.approx(0.5 * clearance, abs=0.004)
        wall = frame.slice(2.5) ^ manifold3d.CrossSection.circle(outer + 0.01, 64).translate((x, y))
        assert wall.area() == pytest.approx(np.pi * (outer**2 - (outer - 0.85) ** 2), rel=0.01)


def test_flaps_turn_half_way_round_without_touching(solids):
    frame, flap = solids[0], solids[1]
    # the axis: 6.2 mm from the frame's middle line, at the height of the barrels' centre
    axis = np.array([0.0, -6.2, flap.bounding_box()[5] - 2.5])
    for angle in range(0, 181, 20):
        turned = flap.translate(tuple(-axis)).rotate((-angle, 0, 0)).translate(tuple(axis))
        assert (frame ^ turned).volume() == pytest.approx(0.0, abs=1e-9)
        assert frame.min_gap(turned, 0.3) >= 0.15 - 1e-6


def test_the_first_layers_stand_back_from_every_gap():
    bodies = plan_coupon(FEW)
    plain, made = solids_of(coupon_meshes(bodies)), solids_of(relieved(coupon_meshes(bodies)))
    for before, after in zip(plain, made, strict=True):
        assert len(after.decompose()) == 1
        foot, above = after.slice(0.15), after.slice(0.35)
        assert (foot - before.slice(0.15)).area() == pytest.approx(0.0, abs=1e-6)
        assert above.area() == pytest.approx(before.slice(0.35).area(), rel=1e-3)
    frame, flap = made[0], made[1]
    # 0.2 mm between the two where they turn; on the bed a quarter more on either side.
    grown = flap.slice(0.15).offset(0.2 + 2 * 0.25 - 0.02, manifold3d.JoinType.Round)
    assert (grown ^ frame.slice(0.15)).area() == pytest.approx(0.0, abs=1e-6)


def test_it_is_small_and_lies_on_every_bed(solids):
    assert sum(solid.volume() for solid in solids) < 5000.0
    boxes = np.array([solid.bounding_box() for solid in solids])
    size = boxes[:, 3:].max(axis=0) - boxes[:, :3].min(axis=0)
    assert size[0] < 120
    assert size[1] < 25


def test_larger_clearances_get_larger_hinges():
    bodies = plan_coupon((0.4, 0.7))
    spec = [plan for body in bodies for plan, _ in body.halves]
    assert len(spec) == 4
    frame, flap, wide, _ = solids_of(coupon_meshes(bodies))
    assert frame.min_gap(flap, 1.0) == pytest.approx(0.4, abs=0.005)
    assert frame.min_gap(wide, 1.0) == pytest.approx(0.7, abs=0.005)


def test_a_second_coupon_goes_in_finer_steps():
    assert fine_clearances(0.3) == (0.225, 0.25, 0.275, 0.3, 0.325, 0.35, 0.375)
    assert [body.name for body in plan_coupon(fine_clearances(0.3))][1:4] == [
        "flap 0.225",
        "flap 0.25",
        "flap 0.275",
    ]


@pytest.mark.parametrize("suffix", ["stl"])
def test_no_triangle_is_without_area(tmp_path, suffix):
    write_coupon(tmp_path / f"coupon.{suffix}", guide=False)
    data = np.fromfile(
        tmp_path / "coupon.stl",
        dtype=[("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")],
        offset=84,
    )
    corners = data["c"].astype(float)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert 0.5 * np.linalg.norm(cross, axis=1).min() > 1e-6


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
    assert len(coupon.solids()) == len(coupon.names) == 4
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
    assert len(read.solids()) == 3
    text = written[0].read_text("utf-8")
    for name in ("frame", "flap 0.3", "plug"):
        assert f"'{name}'" in text


def test_refusals(tmp_path):
    with pytest.raises(HingeError, match="use a name that ends in"):
        write_coupon(tmp_path / "coupon.txt")
    with pytest.raises(HingeError, match="at least one"):
        Coupon(())
    with pytest.raises(HingeError, match="only once"):
        Coupon((0.3, 0.3))
    with pytest.raises(FitError, match=r"coupon hinge at 4\.5 mm"):
        plan_coupon((0.3, 4.5))
    with pytest.raises(HingeError, match="a pin of 9 mm: give its diameter"):
        plan_coupon((0.3,), pin=9.0)
    with pytest.raises(HingeError, match="cannot raise"):
        raised_number("0.3a", 0, 0, 0)


def test_numbers_are_raised_in_one_piece_a_digit():
    shapes = raised_number("0123456789.", 0.0, 0.0, 1.0)
    assert len(shapes) == 11
    for shape in shapes:
        solid = manifold_of(shape, 32, outside=False)
        assert len(solid.decompose()) == 1
        assert solid.bounding_box()[5] == pytest.approx(1.6)
