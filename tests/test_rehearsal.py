"""A kit with weight, and the play of its box, against what can be worked out by hand."""

from __future__ import annotations

import json
from dataclasses import replace

import joinery_models
import numpy as np
import pytest

from fabfold.fold.motion import motion_of
from fabfold.joinery.bodies import BodyMesh, Joinery
from fabfold.joinery.box_hold import Retention
from fabfold.joinery.friction_pins import PinFriction
from fabfold.joinery.magnets import MagnetPair
from fabfold.proof.box_play import box_play
from fabfold.proof.rehearsal import rehearse
from fabfold.proof.replay import course

SIDE = 20.0


def kit(length=4, sides=(1,), gap=0.5):
    """A strip of full cubes; its bodies as boxes."""
    tree = joinery_models.strip_tree(length, list(sides))
    bodies = []
    for body in tree.bodies:
        cells = tree.source[list(body.voxels)]
        mesh = joinery_models.box_mesh(
            SIDE * (cells.min(axis=0) - 0.5) + gap / 2, SIDE * (cells.max(axis=0) + 0.5) - gap / 2
        )
        bodies.append(BodyMesh(body.name, *mesh))
    joinery = Joinery(tuple(bodies), SIDE, (0.0, 0.0, 0.0), gap, 2.5, 1.49, 3)
    path = np.array([[h, 2 * side] for h, side in enumerate(sides)])
    return tree, motion_of(tree, path), joinery


def test_torque_is_weight_times_lever():
    tree, motion, joinery = kit()
    found = rehearse(tree, motion, joinery, 1.0, up="-y", friction=0.0)
    mass = joinery.bodies[1].volume / 1e6  # kg
    assert found.weight_g == pytest.approx(sum(b.volume for b in joinery.bodies) / 1000, abs=0.1)
    # The axis is 10 mm above the middle and 20 mm beside it: the largest lever is the distance.
    lever = np.hypot(20.0, 10.0)
    assert found.torque_nmm[0] == pytest.approx(mass * 9.81 * lever, rel=0.05)
    # About a vertical axis nothing is lifted.
    flat = rehearse(tree, motion, joinery, 1.0, up="+z", friction=0.0)
    assert flat.torque_nmm[0] < 0.05 * found.torque_nmm[0]


def test_a_box_falls_open_on_the_side_that_gravity_pulls():
    tree, motion, joinery = kit()
    found = rehearse(tree, motion, joinery, 1.0)
    # Folded back upon the first body, the second lies on it with +y up and falls with -y up.
    assert found.opens_deg["+y"] < 5
    assert found.opens_deg["-y"] > 20
    assert "+y" in found.stays_shut
    assert "-y" not in found.stays_shut


def test_magnets_hold_what_they_can_and_no_more():
    tree, motion, joinery = kit()
    half = 0.5 * SIDE - 0.25
    pair = MagnetPair((0, 1), ((0.0, half, 0.0), (60.0, half, 0.0)), ((0, -1.0, 0), (0, -1.0, 0)))
    held = Retention((0,), (), "3x1", pairs=(pair,))
    light = rehearse(tree, motion, joinery, 1.0, retention=held)
    assert light.opens_deg["-y"] < 5
    heavy = rehearse(tree, motion, joinery, 60.0, retention=held)
    assert heavy.opens_deg["-y"] > 20


def test_friction_pins_hold_up_to_their_torque():
    tree, motion, joinery = kit()
    weight = joinery.bodies[1].volume / 1e6 * 9.81 * np.hypot(20.0, 10.0)  # N mm, at most
    pins = PinFriction((0,), 0.1, 0.008, 0.007, 1.5 * weight, weight)
    held = Retention((0,), (0,), friction=pins)
    assert rehearse(tree, motion, joinery, 1.0, retention=held).opens_deg["-y"] < 5
    weak = replace(held, friction=replace(pins, torque_nmm=0.1 * weight))
    assert rehearse(tree, motion, joinery, 1.0, retention=weak).opens_deg["-y"] > 20


def test_motors_stop_at_each_end_and_hurry_between():
    _, motion, _ = kit(6, (1, -1))
    rows = list(course(motion, 1.0, 0.01))
    ends = [goal for _, goal, rate in rows if rate is None]
    assert np.allclose(np.degrees(ends), motion.angles_deg[1:])
    turning = np.array([rate[0] for number, _, rate in rows if rate is not None and number == 1])
    assert turning[-1] == pytest.approx(0, abs=1e-9)
    assert turning.max() == pytest.approx(1.875 * np.pi / 2, rel=1e-3)


def test_play_grows_with_the_chain_and_less_when_pressed():
    figures = []
    for sides in ((1,), (1, -1, 1, -1)):
        tree, motion, joinery = kit(2 * len(sides) + 2, sides)
        material = np.ones((len(tree.source), 20, 20, 20), dtype=bool)
        figures.append(box_play(tree, joinery, material, motion.angles_deg[-1]))
    one, four = figures
    assert 0 < one.held_wander_mm <= one.wander_mm
    assert four.wander_mm > one.wander_mm
    # Full faces that lie on each other keep the seam of a pressed box within two gaps.
    assert 0.5 <= one.held_seam_mm < 1.0
    assert one.seam_mm > 1.5
    tree, motion, joinery = kit()
    material = np.ones((4, 20, 20, 20), dtype=bool)
    again = box_play(tree, joinery, material, motion.angles_deg[-1])
    assert again == one


def test_play_follows_the_clearance():
    tight, loose = [], []
    for clearance, figures in ((0.2, tight), (0.5, loose)):
        tree, motion, joinery = kit(6, (1, -1))
        joinery = replace(joinery, clearance_mm=clearance)
        material = np.ones((6, 20, 20, 20), dtype=bool)
        figures.append(box_play(tree, joinery, material, motion.angles_deg[-1]))
    assert tight[0].wander_mm < 0.6 * loose[0].wander_mm


def test_the_command_tells_torques_and_sides(bar_kit, capsys):
    from fabfold.cli.app import main

    with pytest.raises(SystemExit) as stopped:
        main(["rehearse", str(bar_kit.folder), "--json"])
    assert not stopped.value.code
    data = json.loads(capsys.readouterr().out)
    hinges = len(bar_kit.fold().tree.hinges)
    assert len(data["torque_nmm"]) == len(data["hinges"]) == hinges
    assert max(data["torque_nmm"]) > 0
    assert set(data["opens_deg"]) == {"+x", "-x", "+y", "-y", "+z", "-z"}
    with pytest.raises(SystemExit) as stopped:
        main(["rehearse", str(bar_kit.folder), "--up", "north"])
    assert stopped.value.code == 2
    assert "--up north: must be one of +x" in capsys.readouterr().err
