"""The path played in MuJoCo: nothing touches on a good path, and a bad one is felt."""

from __future__ import annotations

from dataclasses import replace

import joinery_models
import numpy as np
import pytest

from fabfold.fold.motion import Motion, motion_of
from fabfold.proof.replay import material_boxes, replay
from fabfold.tree.fold_tree import Hinge

ORIGIN = (1.0, 2.0, 3.0)


def kit():
    tree = joinery_models.strip_tree(8, [1, -1, 1])
    meshes = [
        joinery_models.box_mesh(
            np.array(ORIGIN) + 10 * np.array([2 * b - 0.5, -0.5, -0.5]) + 0.15,
            np.array(ORIGIN) + 10 * np.array([2 * b + 1.5, 0.5, 0.5]) - 0.15,
        )
        for b in range(4)
    ]
    return tree, meshes


def test_a_good_path_is_followed_without_contact():
    tree, meshes = kit()
    motion = motion_of(tree, np.array([[0, 2], [1, -2], [2, 2]]))
    report = replay(tree, motion, meshes, 10.0, ORIGIN)
    assert report.max_penetration_mm < 0.01
    assert report.max_angle_error_deg < 0.33
    assert report.end_pose_error_mm < 0.2
    assert report.steps == 6 * 600
    assert report == replay(tree, motion, meshes, 10.0, ORIGIN)


def test_a_fold_into_the_parent_is_felt():
    tree, meshes = kit()
    # Turned the other way about the same edge the child would pass through its parent.
    wrong = tuple(
        Hinge(h.name, h.parent, h.child, h.point, h.direction, -h.angle_deg) for h in tree.hinges
    )
    tree = replace(tree, hinges=wrong)
    motion = motion_of(tree, np.array([[0, -2], [1, 2], [2, -2]]))
    report = replay(tree, motion, meshes, 10.0, ORIGIN)
    assert report.contact_steps > 100
    assert report.max_penetration_mm > 0.3
    assert report.max_angle_error_deg > 10
    # After each of the three moves the motors hold for a second, and it does not come free.
    assert 6 * 600 + 200 <= report.steps <= 6 * 600 + 3 * 200


def test_a_long_arm_does_not_lag_behind():
    tree = joinery_models.strip_tree(48, [1], run=24)
    meshes = [
        joinery_models.box_mesh(
            np.array(ORIGIN) + 10 * np.array([24 * b - 0.5, -0.5, -0.5]) + 0.15,
            np.array(ORIGIN) + 10 * np.array([24 * b + 23.5, 0.5, 0.5]) - 0.15,
        )
        for b in range(2)
    ]
    motion = motion_of(tree, np.array([[0, 2]]))
    report = replay(tree, motion, meshes, 10.0, ORIGIN)
    assert report.contact_steps == 0
    assert report.max_lag_deg < 0.4
    assert report.max_angle_error_deg < 0.01


def test_boxes_hold_the_material_of_each_cell():
    tree, meshes = kit()
    boxes = material_boxes(tree, meshes, 10.0, ORIGIN, 0.3)
    assert [box.body for box in boxes] == [0, 0, 1, 1, 2, 2, 3, 3]
    assert boxes[2].low == pytest.approx([1.515, -0.485, -0.485])
    assert boxes[2].high == pytest.approx([2.485, 0.485, 0.485])


def test_motion_of_gives_a_keyframe_after_every_move():
    tree, _ = kit()
    motion = motion_of(tree, np.array([[2, 1], [0, 2], [2, 1], [1, -2]]))
    assert motion.moves == ((), (2,), (0,), (2,), (1,))
    assert motion.angles_deg[:, 2].tolist() == [0, 90, 90, 180, 180]
    assert np.array_equal(motion.angles_deg[-1], tree.fold_angles)
    assert Motion.from_json(motion.to_json()).moves == motion.moves
    with pytest.raises(ValueError, match="hinge-01"):
        motion_of(tree, np.array([[0, 2], [2, 2]]))
