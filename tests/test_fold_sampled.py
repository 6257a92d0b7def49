"""The sampled second opinion: known collisions and gaps, link plates, and what the proof says."""

from __future__ import annotations

import joinery_models
import numpy as np
import pytest

from fabfold.proof.certify import certify
from fabfold.proof.sampled import sample_path

VOXEL = 10.0
ORIGIN = (3.0, -2.0, 7.0)


def mm(point):
    return np.array(ORIGIN) + VOXEL * np.asarray(point, dtype=float)


def together(*meshes):
    starts = np.cumsum([0] + [len(v) for v, _ in meshes])
    return (
        np.concatenate([v for v, _ in meshes]),
        np.concatenate([f + start for (_, f), start in zip(meshes, starts, strict=False)]),
    )


@pytest.fixture
def strip():
    """Strip of eight cells in four plain boxes, faces 0.3 mm apart."""
    tree = joinery_models.strip_tree(8, [1, -1, 1])
    motion = joinery_models.motion_of_order(tree, [0, 1, 2])
    meshes = {
        f"body-{b:02d}": joinery_models.box_mesh(
            mm((2 * b - 0.5, -0.5, -0.5)) + 0.15, mm((2 * b + 1.5, 0.5, 0.5)) - 0.15
        )
        for b in range(4)
    }
    return tree.to_json(VOXEL, ORIGIN), motion.to_json(), meshes


def test_a_known_gap_is_measured(strip):
    seen = sample_path(*strip, step_deg=5.0)
    assert seen.ok
    assert seen.least_mm == pytest.approx(0.3, abs=1e-6)
    assert seen.overlap_mm3 == pytest.approx(0.0, abs=1e-6)
    assert seen.poses == 1 + 6 * 19
    assert "body-0" in seen.where


def test_a_collision_at_one_degree_is_found_and_named(strip):
    tree, motion, meshes = strip
    # The far corner of the strip passes here at 37° of the first move; a degree is 1 mm there.
    turn = np.radians(37.0) * np.sign(tree["hinges"][0]["angle_deg"])
    pivot = mm(tree["hinges"][0]["point"])[:2]
    corner = mm((7.5, -0.5, 0.0))[:2] + np.array([-0.15, 0.15]) - pivot
    wheel = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    place = np.array([*(wheel @ corner + pivot), ORIGIN[2]])
    post = joinery_models.box_mesh(place - 0.05, place + 0.05)
    meshes["body-00"] = together(meshes["body-00"], post)
    seen = sample_path(tree, motion, meshes, gap_step_deg=10.0)
    assert not seen.ok
    assert seen.least_mm == 0.0
    assert seen.hits[0] == "move 1 of 6 (hinge-00), 37°: body-03 and body-00"
    # Samples prove nothing between them.
    assert sample_path(tree, motion, meshes, step_deg=2.0, gap_step_deg=10.0).ok


def test_a_body_inside_another_shows_as_common_volume(strip):
    tree, motion, meshes = strip
    small = joinery_models.box_mesh(mm((0, 0, 0)) - 1, mm((0, 0, 0)) + 1)
    meshes["body-03"] = together(meshes["body-03"], small)
    seen = sample_path(tree, motion, meshes, step_deg=45.0)
    assert seen.overlap_mm3 >= 8.0 - 1e-6


def link_kit(second_turn):
    """Two cubes and the link plate between them: the plate turns, then the second cube."""
    axis = {"dir": [0, 0, 1]}
    tree = {
        "voxel_mm": VOXEL,
        "origin_mm": [0.0, 0.0, 0.0],
        "bodies": [{"name": "body-00"}, {"name": "link-00"}, {"name": "body-01"}],
        "hinges": [
            {"name": "a", "parent": "body-00", "child": "link-00", "point": [0.5, 0.5, 0], **axis},
            {"name": "b", "parent": "link-00", "child": "body-01", "point": [0.5, -0.5, 0], **axis},
        ],
    }
    frames = [[0.0, 0.0], [90.0, 0.0], [90.0, second_turn]]
    motion = {"hinges": ["a", "b"], "keyframes": [{"angles_deg": angles} for angles in frames]}
    box = joinery_models.box_mesh
    meshes = {
        "body-00": box([-5.0, -5.0, -5.0], [3.7, 5.0, 5.0]),
        "link-00": box([4.0, -5.0, -5.0], [6.0, 5.0, 5.0]),
        "body-01": box([6.3, -5.0, -5.0], [15.0, 5.0, 5.0]),
    }
    return tree, motion, meshes


def test_link_plates_are_bodies_like_others():
    seen = sample_path(*link_kit(-90.0))
    assert seen.ok
    assert seen.least_mm == pytest.approx(0.3, abs=1e-6)
    wrong = sample_path(*link_kit(90.0))
    assert len(wrong.hits) == 1
    assert wrong.hits[0].startswith("move 2 of 2 (b), ")
    assert wrong.hits[0].endswith("body-01 and link-00")


def test_order_of_hinges_in_the_file_does_not_matter():
    tree, motion, meshes = link_kit(-90.0)
    turned = {**tree, "hinges": tree["hinges"][::-1]}
    assert sample_path(turned, motion, meshes) == sample_path(tree, motion, meshes)


@pytest.mark.slow
def test_it_agrees_with_the_proof_on_printed_hinges():
    from fabfold.joinery.build import build_bodies

    tree = joinery_models.strip_tree(6, [1, -1])
    motion = joinery_models.motion_of_order(tree, [1, 0])
    voxels = joinery_models.voxels_of(tree.source, joinery_models.box_strip(6))
    made = build_bodies(voxels, tree, motion, voxel_mm=20.0, clearance_mm=0.3)
    meshes = {body.name: (body.vertices, body.faces) for body in made.bodies}
    proof = certify(tree, motion, list(meshes.values()), 20.0, made.origin_mm, 0.27)
    data = tree.to_json(20.0, made.origin_mm)
    seen = sample_path(data, motion.to_json(), meshes, gap_step_deg=5.0)
    assert seen.ok
    assert proof["min_gap_mm"] <= seen.least_mm <= proof["seen_gap_mm"] + 0.01


def test_what_does_not_fit_together_is_refused(strip):
    tree, motion, meshes = strip
    with pytest.raises(ValueError, match="body-03"):
        sample_path(tree, motion, {k: v for k, v in meshes.items() if k != "body-03"})
    frames = [motion["keyframes"][0], motion["keyframes"][-1]]
    with pytest.raises(ValueError, match="3 hinges turn"):
        sample_path(tree, {**motion, "keyframes": frames}, meshes)
    with pytest.raises(ValueError, match="above 0"):
        sample_path(tree, motion, meshes, step_deg=0.0)
