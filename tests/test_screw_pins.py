"""Kits whose hinges turn on screws: heads sunk, threads cut, lengths that are sold."""

from dataclasses import replace

import numpy as np
import pytest

from fabfold.apart.apart_kit import prepare_apart
from fabfold.apart.pin_replay import replay_assembly
from fabfold.apart.plate_files import assembly_data, bill_rows
from fabfold.errors import RecipeError
from fabfold.guide.advice import assembly_lines, content_lines
from fabfold.joinery.build import build_bodies
from fabfold.joinery.cells import as_manifold
from fabfold.joinery.loose_pins import cylinder_between, meshes_with_pins, pin_bores
from fabfold.joinery.pin_kinds import PINS
from fabfold.printing.print_mode import print_mode
from fabfold.printing.profiles import load_profile
from fabfold.printing.wall_checks import check_walls
from fabfold.progress import SilentProgress
from fabfold.proof.certify import certify

MODE = print_mode(load_profile("fdm-pla-0.4"), pin="m2")
FIT = MODE.pin_fit


@pytest.fixture(scope="module")
def screwed(bar_kit):
    """The bar's tree, its path, its bodies with screws, and the order."""
    planned = bar_kit.fold()
    joinery = build_bodies(
        planned.voxels,
        planned.tree,
        planned.motion,
        voxel_mm=20.0,
        clearance_mm=MODE.profile.clearance_mm,
        face_gap_mm=MODE.face_gap_mm,
        pin=MODE.loose_pin(),
    )
    joinery, kit = prepare_apart(planned.tree, planned.motion, joinery, MODE, SilentProgress())
    return planned.tree, planned.motion, joinery, kit


def solid(joinery, body):
    mesh = joinery.bodies[body]
    return as_manifold(mesh.vertices, mesh.faces, mesh.name)


@pytest.mark.slow
def test_a_screw_clears_all_knuckles_but_the_last_and_bites_there(screwed):
    tree, _, joinery, _ = screwed
    assert len(joinery.pins) == len(tree.hinges)
    for pin in joinery.pins:
        hinge = tree.hinges[pin.hinge]
        tip, tail = np.array(pin.tip_mm), np.array(pin.tail_mm)
        out = (tail - tip) / pin.length_mm
        assert pin.length_mm == 10.0
        owner, child = solid(joinery, pin.owner), solid(joinery, hinge.child)
        assert pin.owner == hinge.parent
        shank = cylinder_between(tip + (pin.thread_mm + 0.25) * out, tail, 1.0, outside=False)
        # Above the thread there is the slip all round, in the parent as in the child.
        for body in (owner, child):
            assert body.min_gap(shank, 1.0) == pytest.approx(FIT.slip_mm, abs=0.02)
        # In the last knuckle the thread takes a ring from 1.7 to 2.0 mm.
        thread = cylinder_between(tip, tip + (pin.thread_mm - 0.01) * out, 1.0, outside=False)
        ring = np.pi * (1.0**2 - 0.85**2) * pin.thread_mm
        assert (owner ^ thread).volume() == pytest.approx(ring, rel=0.08)
        assert (child ^ thread).volume() == 0.0
        assert pin.thread_mm >= 2.0


@pytest.mark.slow
def test_heads_are_sunk_into_the_barrel_with_a_wall_around_them(screwed):
    tree, _, joinery, _ = screwed
    for bore, pin in zip(pin_bores(tree, joinery), joinery.pins, strict=True):
        tip, tail = np.array(pin.tip_mm), np.array(pin.tail_mm)
        out = (tail - tip) / pin.length_mm
        head = cylinder_between(tail, tail + pin.head_height_mm * out, pin.head_mm, outside=True)
        for body in bore.bodies:
            assert (solid(joinery, body) ^ head).volume() < 1e-5
        # The head lies on its knuckle, and ends below the end of the barrel.
        seat = solid(joinery, pin.owner) ^ head.translate(tuple(-0.1 * out))
        assert seat.volume() == pytest.approx(0.1 * np.pi * (1.9**2 - 1.2**2), rel=0.05)
        deepest = abs((tail + pin.head_height_mm * out - bore.middle) @ bore.axis)
        assert deepest == pytest.approx(bore.half_mm - 0.2, abs=1e-5)
    wall = check_walls(joinery, [solid(joinery, i) for i in range(len(tree.bodies))], MODE.profile)
    assert wall[0].figure == pytest.approx(joinery.barrel_radius_mm - 1.9 - 0.15)
    assert wall[0].ok


@pytest.mark.slow
def test_screws_go_in_in_order_and_the_path_is_proven_with_them(screwed):
    tree, motion, joinery, kit = screwed
    assert (kit.replay.done, kit.replay.faults) == (len(joinery.pins), ())
    proof = certify(tree, motion, meshes_with_pins(joinery), 20.0, joinery.origin_mm, 0.1)
    assert 0.1 <= proof["min_gap_mm"] <= FIT.slip_mm
    first = kit.steps[0]
    wrong = [replace(first, end=-first.end), *kit.steps[1:]]
    seen = replay_assembly(tree, joinery, pin_bores(tree, joinery), wrong, FIT)
    assert seen.done == len(kit.steps) - 1
    assert "in the way of the pin" in seen.faults[0]


@pytest.mark.slow
def test_bill_order_and_manual_name_the_screws(screwed):
    tree, _, joinery, kit = screwed
    count = len(joinery.pins)
    rows = {row[0]: row for row in bill_rows(joinery, "PLA", "m2")}
    assert rows["screw M2, cylinder head (ISO 4762)"][1:3] == (count, "M2 × 10 mm")
    assert "hex key of 1.5 mm" in rows
    assert not any("needle" in name for name in rows)
    step = assembly_data(tree, joinery, kit)["steps"][0]["pin"]
    assert (step["diameter_mm"], step["length_mm"], step["head_diameter_mm"]) == (2.0, 10.0, 3.8)
    assert all("drive in a screw of 10 mm" in line for line in assembly_lines(joinery, kit))
    assert f"{count} screws M2 × 10 mm" in "\n".join(content_lines(joinery, tree, MODE, None))


@pytest.mark.parametrize(
    ("voxel_mm", "length"), [(18, 8), (20, 10), (22, 12), (24, 12), (30, 16), (40, 20)]
)
def test_lengths_are_those_that_are_sold(voxel_mm, length):
    from fabfold.joinery.sizes import hinge_size

    clearance = MODE.profile.clearance_mm
    size = hinge_size(voxel_mm, clearance, gap_mm=MODE.face_gap_mm, pin=MODE.loose_pin())
    barrel = voxel_mm - 2 * size.reach_mm
    knuckle = (barrel - 2 * clearance) / 3
    assert FIT.screw_length(barrel, knuckle, 2.0) == length
    MODE.require_hinge(voxel_mm)


@pytest.mark.parametrize("voxel_mm", [12, 16, 60])
def test_voxels_that_no_screw_fits_are_refused_before_anything_is_made(voxel_mm):
    with pytest.raises(RecipeError, match=r"voxel"):
        MODE.require_hinge(voxel_mm)


def test_the_barrel_keeps_its_wall_around_a_pocket():
    from hinges.clearance import Clearance

    pin = MODE.loose_pin()
    assert pin.pocket == pytest.approx(1.9 + 0.15)
    assert pin.thinnest_barrel(Clearance(0.3), 0.8, 3) == pytest.approx(2.05 + 0.8)
    plain = replace(pin, pocket=0.0)
    assert plain.thinnest_barrel(Clearance(0.3), 0.8, 3) < 2.3


def test_plain_pins_are_cut_to_length_and_screws_have_a_thread():
    assert [name for name, kind in PINS.items() if kind.screw] == ["m2"]
    for name, kind in PINS.items():
        fit = kind.fit(0.1, 0.2)
        assert fit.slip_mm == 0.2
        assert fit.threaded == (name == "m2")
    assert FIT.grip_mm == pytest.approx(-0.15)
