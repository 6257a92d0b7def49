"""Carving on the solids: bodies that whole cubes would jam pass with the full gap."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from carving_models import LID, LID_HINGES, SLOT, SLOT_HINGES, full_voxels, tree_of
from joinery_models import motion_of_order, posed

from fabfold.errors import CheckError, GeometryError
from fabfold.fold.carving_plan import plan_carving
from fabfold.fold.motion import quarter_path
from fabfold.joinery import build
from fabfold.joinery.build import build_bodies
from fabfold.joinery.carving import CarvedMaterial
from fabfold.joinery.hinge_placement import barrel_solid
from fabfold.joinery.sizes import hinge_size
from fabfold.proof.certify import certify
from fabfold.proof.replay import replay
from fabfold.proof.sampled import sample_path
from fabfold.tree.system import hinge_system

VOXEL, CLEARANCE = 20.0, 0.3


def proof(tree, motion, joinery):
    return certify(
        tree,
        motion,
        [(body.vertices, body.faces) for body in joinery.bodies],
        voxel_mm=VOXEL,
        origin_mm=joinery.origin_mm,
        min_gap_mm=0.25,
    )


def kit(bodies, hinges, order, holes=None):
    tree = tree_of(bodies, hinges)
    motion = motion_of_order(tree, order)
    voxels = full_voxels(tree, holes)
    joinery = build_bodies(voxels, tree, motion, voxel_mm=VOXEL, clearance_mm=CLEARANCE)
    return tree, motion, voxels, joinery


@pytest.fixture(scope="module")
def slot():
    return kit(SLOT, SLOT_HINGES, [0])


@pytest.fixture(scope="module")
def lid():
    return kit(LID, LID_HINGES, [0, 1])


@pytest.mark.slow
@pytest.mark.parametrize("case", ["slot", "lid"])
def test_carved_bodies_keep_the_gap_at_every_angle(case, request):
    tree, motion, _, joinery = request.getfixturevalue(case)
    assert joinery.rounded_cells > 0
    assert proof(tree, motion, joinery)["min_gap_mm"] == pytest.approx(CLEARANCE, abs=0.011)


@pytest.mark.slow
def test_samples_by_another_library_see_the_gap_too(lid):
    tree, motion, _, joinery = lid
    seen = sample_path(
        tree.to_json(joinery.voxel_mm, joinery.origin_mm),
        motion.to_json(),
        {body.name: (body.vertices, body.faces) for body in joinery.bodies},
        step_deg=1.0,
        gap_step_deg=10.0,
    )
    assert seen.ok
    assert seen.least_mm == pytest.approx(CLEARANCE, abs=0.01)


def test_without_carving_they_jam(slot, monkeypatch):
    tree, motion, voxels, _ = slot
    monkeypatch.setattr(build, "carve", lambda *_, **__: CarvedMaterial())
    joinery = build_bodies(voxels, tree, motion, voxel_mm=VOXEL, clearance_mm=CLEARANCE)
    with pytest.raises(CheckError, match="run into each other"):
        proof(tree, motion, joinery)


def test_volume_is_what_was_planned_and_the_clearance(slot):
    tree, motion, voxels, joinery = slot
    planned = plan_carving(hinge_system(tree), quarter_path(tree, motion), voxels.subvoxels)
    lost = joinery.rounded_skin_mm3 + joinery.rounded_inside_mm3
    assert joinery.rounded_cells == np.count_nonzero(planned.lost) == 2
    # The planned volume on subvoxels, and 0.3 mm along cuts of some 20 by 13 mm each.
    assert 0.0 < lost - VOXEL**3 * planned.lost.sum() < 2 * 0.3 * 20 * 15 + 0.02 * VOXEL**3
    assert any("rounded off" in note and "2 cells" in note for note in joinery.notes)


@pytest.mark.slow
def test_no_hinge_is_cut(lid):
    tree, motion, voxels, joinery = lid
    still = replace(motion, angles_deg=motion.angles_deg[:1], moves=motion.moves[:1])
    whole = build_bodies(voxels, tree, still, voxel_mm=VOXEL, clearance_mm=CLEARANCE)
    assert whole.rounded_cells == 0
    size = hinge_size(VOXEL, CLEARANCE)
    start = np.zeros(len(tree.hinges))
    offset = tuple(joinery.origin_mm)
    for hinge in tree.hinges:
        barrel = barrel_solid(hinge, size, VOXEL).translate(offset)
        for cut, uncut in zip(posed(joinery, tree, start), posed(whole, tree, start), strict=True):
            assert (cut ^ barrel).volume() == pytest.approx((uncut ^ barrel).volume(), abs=0.01)


def test_a_cut_through_a_hinge_is_refused(slot, monkeypatch):
    tree, motion, voxels, _ = slot
    real = plan_carving

    def blocked(*args, **kwargs):
        carving = real(*args, **kwargs)
        return replace(carving, blocked=((carving.clashes[0].first, carving.clashes[0].second),))

    monkeypatch.setattr("fabfold.joinery.carving.plan_carving", blocked)
    with pytest.raises(GeometryError, match=r"body-01 and body-00.*hinge"):
        build_bodies(voxels, tree, motion, voxel_mm=VOXEL, clearance_mm=CLEARANCE)


def test_cells_that_are_empty_there_lose_nothing():
    hole = ((1.4, -0.6, -0.6), (1.95, 0.6, 0.6))
    tree, motion, _, joinery = kit(SLOT, SLOT_HINGES, [0], [hole])
    assert joinery.rounded_cells == 0
    assert proof(tree, motion, joinery)["min_gap_mm"] > 0.25


def test_loose_material_is_joined_behind_the_cut():
    # A groove all around parts the turning cell; the strut keeps out of what passes.
    hole = ((0.9, -0.6, -0.6), (1.1, 0.6, 0.6))
    tree, motion, _, joinery = kit(SLOT, SLOT_HINGES, [0], [hole])
    assert joinery.struts > 0
    assert proof(tree, motion, joinery)["min_gap_mm"] > 0.25


def test_replay_takes_the_cores_of_carved_cells(slot):
    tree, motion, _, joinery = slot
    meshes = [(body.vertices, body.faces) for body in joinery.bodies]
    seen = replay(tree, motion, meshes, VOXEL, joinery.origin_mm, gap_mm=0.29)
    assert seen.max_penetration_mm == 0.0
    assert "2 carved cells by their cores" in seen.geometry


def test_half_a_quarter_turn_is_no_lattice_path(slot):
    tree, motion, _, _ = slot
    assert quarter_path(tree, motion).tolist() == [[0, 1], [0, 1]]
    odd = replace(motion, angles_deg=0.5 * motion.angles_deg)
    assert quarter_path(tree, odd) is None
