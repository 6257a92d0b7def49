from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from fabfold.lattice.rotations import FACES, ROTATIONS, parity
from fabfold.tree.catalogue import (
    double_joints,
    edge_sides,
    edge_turn,
    face_transforms,
    single_joints,
)


@pytest.mark.parametrize("face", range(6))
def test_counts_of_the_link_plate(face):
    every = face_transforms(face)
    assert len(every) == 97
    assert len({(j.offset, j.rotation) for j in every}) == 97
    assert sum(j.offset == (0, 0, 0) for j in every) == 4
    assert len(double_joints(face, neighbours_only=False)) == 84
    assert len(double_joints(face)) == 32
    assert sum(j.kind == "R" for j in every) == 1
    assert sum(j.kind == "S" for j in every) == 12


@pytest.mark.parametrize("face", range(6))
def test_half_turn_carries_the_child_to_the_side_of_its_hinge(face):
    joints = single_joints(face)
    assert len(joints) == 4
    for joint, side in zip(joints, edge_sides(face), strict=True):
        assert joint.offset == tuple(FACES[side].tolist())
        # A half turn about d x n turns d and n round and leaves the axis.
        assert (ROTATIONS[joint.rotation] @ FACES[face] == -FACES[face]).all()
        assert (ROTATIONS[joint.rotation] @ FACES[side] == -FACES[side]).all()


def test_sides_are_in_the_plane_and_ascending():
    for face in range(6):
        sides = edge_sides(face)
        assert list(sides) == sorted(sides)
        assert all(FACES[face] @ FACES[side] == 0 for side in sides)


def test_both_voxels_of_a_pair_name_an_edge_alike():
    for face in range(6):
        assert edge_sides(face) == edge_sides(face ^ 1)
        for side in range(4):
            here = (FACES[face] + FACES[edge_sides(face)[side]]) / 2
            there = FACES[face] + (FACES[face ^ 1] + FACES[edge_sides(face ^ 1)[side]]) / 2
            assert np.allclose(here, there)


def test_a_quarter_turn_goes_around_the_outside():
    for face in range(6):
        for side in range(4):
            moved = edge_turn(face, side, 1) @ np.append(FACES[face], 1)
            assert np.allclose(moved[:3], FACES[face] + FACES[edge_sides(face)[side]])


def test_kinds_that_keep_the_colour_of_a_cell():
    for face in range(6):
        # A child keeps its colour where it lands on the colour that the parent has not.
        kept = [j for j in face_transforms(face) if parity(np.array(j.offset)) == 1]
        assert Counter(j.kind for j in kept) == {"R": 1, "S": 4, "D": 52}
        assert all(parity(np.array(j.offset)) == 1 for j in single_joints(face))
        assert all(parity(np.array(j.offset)) == 1 for j in double_joints(face))
