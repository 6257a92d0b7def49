"""Barrels that swing into each other are seen on the path, before anything is cut."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from fold_oracle import BARREL_INSET, BARREL_LEAST, segment_distance
from joinery_models import strip_tree

from fabfold.fold.barrel_collisions import first_barrel_collision
from fabfold.fold.motion import Motion


def motion_on(tree, path):
    """Keyframes of a path that need not end in B."""
    angles, moves = [np.zeros(len(tree.hinges))], [()]
    for hinge, quarters in path:
        angles.append(angles[-1] + 90.0 * quarters * np.eye(len(tree.hinges))[hinge])
        moves.append((hinge,))
    return Motion(tuple(h.name for h in tree.hinges), np.array(angles), tuple(moves))


def first_collision(tree, motion):
    return first_barrel_collision(tree, motion, inset=BARREL_INSET, least=BARREL_LEAST)


def nearest_by_oracle(tree, motion):
    """Smallest distance of two barrels' inner axes, looked at every degree."""
    half = 0.5 - BARREL_INSET
    ends = np.array(
        [
            [np.array(h.point) + s * half * np.array(h.direction) for s in (-1, 1)]
            for h in tree.hinges
        ]
    )
    nearest = np.inf
    for before, after in itertools.pairwise(motion.angles_deg):
        for share in np.linspace(0.0, 1.0, 181):
            poses = tree.body_poses(before + share * (after - before))
            placed = np.array(
                [
                    e @ poses[h.parent][:3, :3].T + poses[h.parent][:3, 3]
                    for e, h in zip(ends, tree.hinges, strict=True)
                ]
            )
            i, j = np.triu_indices(len(ends), 1)
            nearest = min(nearest, float(segment_distance(placed[i], placed[j]).min()))
    return nearest


def test_barrels_that_stay_apart_pass():
    zigzag = strip_tree(8, [1, -1, 1])
    for path in ([(2, 2), (1, -2), (0, 2)], [(2, 1), (2, 1), (1, -1), (1, -1), (0, 2)]):
        motion = motion_on(zigzag, path)
        assert nearest_by_oracle(zigzag, motion) > BARREL_LEAST
        assert first_collision(zigzag, motion) is None


def test_barrels_that_swing_into_each_other_are_named():
    # All hinges on one side: rolled up, the third barrel comes to lie on the first.
    roll = strip_tree(8, [1, 1, 1])
    motion = motion_on(roll, [(0, 1), (1, 1), (2, 1), (0, 1), (1, 1)])
    found = first_collision(roll, motion)
    assert (found.move, found.turning, found.moving, found.resting) == (5, 1, 2, 0)
    assert found.distance == pytest.approx(nearest_by_oracle(roll, motion), abs=1e-3)
    assert first_collision(roll, motion_on(roll, [(0, 1), (1, 1), (2, 1), (0, 1)])) is None


def test_a_path_without_moves_has_no_collision():
    tree = strip_tree(4, [1])
    assert first_collision(tree, motion_on(tree, [])) is None


def test_the_oracle_knows_the_distance_of_segments():
    one = np.array([[[0.0, 0, 0], [1, 0, 0]]] * 3)
    two = np.array([[[0.5, 1, -1], [0.5, 1, 1]], [[0, 2, 0], [1, 2, 0]], [[3, 0, 4], [3, 1, 4]]])
    assert segment_distance(one, two) == pytest.approx([1.0, 2.0, np.sqrt(20.0)])
