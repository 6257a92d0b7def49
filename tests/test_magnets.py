"""Magnets that hold the box shut: what moves without them, where they meet, their pockets."""

import csv
import json

import numpy as np
import pytest

from fabfold.joinery.body_poses import poses_in_mm
from fabfold.joinery.box_hold import Retention, hold_by_magnets
from fabfold.joinery.cells import as_manifold
from fabfold.joinery.free_motions import free_hinges
from fabfold.joinery.loose_pins import cylinder_between
from fabfold.joinery.magnets import MAGNETS, Pocket
from fabfold.kit.kit import Kit


@pytest.fixture(scope="module")
def held(bar_kit):
    built = bar_kit.join()
    tree, motion = built.planned.tree, built.planned.motion
    joinery, retention = hold_by_magnets(tree, motion, built.joinery, Pocket(MAGNETS["3x1"]))
    return tree, motion, built.joinery, joinery, retention


def test_speeds_that_are_bound_and_speeds_that_are_not():
    none = np.zeros((0, 2))
    assert free_hinges(none, none) == [0, 1]
    # Neither may fall, their sum may not rise: nothing moves.
    assert free_hinges(np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, -1.0]]), none) == []
    # One may only rise.
    assert free_hinges(np.array([[1.0, 0.0]]), np.array([[0.0, 1.0]])) == [0]
    assert free_hinges(none, np.array([[1.0, -1.0]])) == [0, 1]


def test_magnets_leave_fewer_hinges_that_move(held):
    tree, _, _, _, retention = held
    assert set(retention.free_before) <= set(range(len(tree.hinges)))
    assert retention.free_before
    assert set(retention.free_after) < set(retention.free_before)
    assert 0 < len(retention.pairs) <= len(tree.hinges)


def test_a_pair_meets_in_the_box_pole_to_pole(held):
    tree, motion, _, joinery, retention = held
    poses = poses_in_mm(tree, joinery, motion.angles_deg[-1])
    for pair in retention.pairs:
        mouths, inwards = [], []
        for body, point, inward in zip(pair.bodies, pair.points_mm, pair.inwards, strict=True):
            turn, shift = poses[body][:3, :3], poses[body][:3, 3]
            mouths.append(turn @ np.array(point) + shift)
            inwards.append(turn @ np.array(inward))
        assert np.allclose(inwards[0], -inwards[1], atol=1e-9)
        apart = mouths[1] - mouths[0]
        assert np.allclose(apart, joinery.clearance_mm * inwards[1], atol=1e-6)


def test_pockets_have_their_size_and_a_wall_behind_and_around(held):
    _, _, before, after, retention = held
    places = {body: [] for pair in retention.pairs for body in pair.bodies}
    for pair in retention.pairs:
        for body, point, inward in zip(pair.bodies, pair.points_mm, pair.inwards, strict=True):
            places[body].append((np.array(point), np.array(inward)))
    for body, sides in places.items():
        full, cut = before.bodies[body], after.bodies[body]
        assert full.volume - cut.volume == pytest.approx(
            len(sides) * np.pi * 1.6**2 * 1.2, rel=0.03
        )
        solid = as_manifold(cut.vertices, cut.faces, "body")
        for mouth, into in sides:
            pocket = cylinder_between(mouth, mouth + 1.19 * into, 1.59, outside=False)
            assert (solid ^ pocket).volume() < 1e-3
            around = cylinder_between(mouth + 0.05 * into, mouth + 2.0 * into, 2.4, outside=False)
            hole = cylinder_between(mouth, mouth + 1.2 * into, 1.6, outside=False)
            wall = around - hole
            assert (solid ^ wall).volume() >= 0.97 * wall.volume()
    untouched = set(range(len(before.bodies))) - set(places)
    assert all(before.bodies[i] is after.bodies[i] for i in untouched)


def test_the_same_again_and_through_json(held, bar_kit):
    tree, motion, before, _, retention = held
    _, again = hold_by_magnets(tree, motion, before, Pocket(MAGNETS["3x1"]))
    assert again == retention
    assert Retention.from_json(json.loads(json.dumps(retention.to_json()))) == retention


@pytest.mark.slow
def test_a_kit_with_magnets_passes_and_counts_them(searched, bar, bar_options, tmp_path):
    folder = searched(tmp_path / "kit")
    kit = Kit.from_model(bar, folder=folder, workers=1, retention="magnet", **bar_options)
    kit.export()
    report = json.loads((folder / "report.json").read_text("utf-8"))
    assert report["verdict"] == "ok"
    data = json.loads((folder / "retention.json").read_text("utf-8"))
    assert len(data["pairs"]) == report["summary"]["magnet_pairs"]
    assert all(pair["north_out"]["body"] != pair["south_out"]["body"] for pair in data["pairs"])
    rows = list(csv.DictReader((folder / "bom.csv").open(encoding="utf-8")))
    (magnets,) = (row for row in rows if row["item"].startswith("disc magnet"))
    assert int(magnets["count"]) == 2 * len(data["pairs"])
    held = next(check for check in report["checks"] if check["name"] == "hinges held shut")
    hinges = len(kit.fold().tree.hinges)
    assert held["figure"] == hinges - len(data["held_by_friction_only"])
    assert kit.join().retention == Retention.from_json(kit.join().retention.to_json())
