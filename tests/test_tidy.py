"""Paths in an order that suits hands, and moves that may be made in any order."""

from __future__ import annotations

from itertools import permutations

import joinery_models
import numpy as np
import pytest

from fabfold.errors import CheckError
from fabfold.fold.core_sweep import CORE_HALF_SIDE
from fabfold.fold.lattice_planner import count_free_moves
from fabfold.fold.tidy import hinge_distances, tidied, walk
from fabfold.proof.certify import certify, certify_orders
from fabfold.tree.system import hinge_system


def test_distances_count_bodies_on_the_way():
    #   0 - 1 - 2        hinge 0: 0-1, 1: 1-2, 2: 0-3, 3: 3-4
    #   |
    #   3 - 4
    distances = hinge_distances(np.array([0, 1, 0, 3]))
    assert distances.tolist() == [[0, 1, 1, 2], [1, 0, 2, 3], [1, 2, 0, 1], [2, 3, 1, 0]]
    assert walk(np.array([[0, 1], [3, 1], [1, 1]]), distances) == 2 + 3


@pytest.mark.slow
def test_a_tidy_path_walks_less_and_stays_free(animal_trees):
    gained = 0
    for candidate in animal_trees:
        system = hinge_system(candidate.tree)
        distances = hinge_distances(system.parent)
        found = tidied(system, candidate.path)
        assert walk(found, distances) <= walk(candidate.path, distances)
        gained += walk(candidate.path, distances) - walk(found, distances)
        assert count_free_moves(system, found) == len(found)
        for path in (found, candidate.path):
            turned = np.zeros(len(system.turns), dtype=int)
            np.add.at(turned, path[:, 0], path[:, 1])
            assert (turned == system.turns).all()
        assert (tidied(system, candidate.path) == found).all()
    assert gained > 0


def test_a_path_that_needs_carving_needs_no_more():
    from fabfold.fold.clashes import clashes_on

    # Two cells turn past a corner that only carving opens: a strip of three bodies of one.
    tree = joinery_models.strip_tree(4, [1, -1, 1], run=1)
    system = hinge_system(tree)
    path = np.array([[0, 2], [1, -2], [2, 2]])
    assert count_free_moves(system, path, carve=CORE_HALF_SIDE) == 3
    found = tidied(system, path)
    assert count_free_moves(system, found, carve=CORE_HALF_SIDE) == len(found)
    assert len(clashes_on(system, found)) <= len(clashes_on(system, path))


def boxes(tree, gap, side=10.0):
    meshes = []
    for body in tree.bodies:
        cells = tree.source[list(body.voxels)]
        low, high = cells.min(axis=0) - 0.5, cells.max(axis=0) + 0.5
        meshes.append(joinery_models.box_mesh(side * low + gap / 2, side * high - gap / 2))
    return meshes


def test_moves_in_any_order_are_certified_in_each():
    """Both ends of a strip may be turned first; each order is certified by itself too."""
    tree = joinery_models.strip_tree(9, [1, 1], run=3)
    quarters = np.array([[0, 1], [1, 1]])
    meshes = boxes(tree, 0.4)
    motion = _partial(tree, quarters)
    assert certify_orders(tree, motion, meshes, 10.0, (0, 0, 0), 0.2) == [(1, 2)]
    for order in permutations(range(2)):
        _prove_each(tree, quarters[list(order)], meshes)


def test_moves_that_meet_in_the_other_order_are_no_group():
    """One end goes under the other only while that is still down."""
    tree = joinery_models.strip_tree(9, [1, 1], run=3)
    # The first end goes all the way over and back to a quarter, past where the other stands then.
    motion = _partial(tree, np.array([[0, 2], [1, 1]]))
    meshes = boxes(tree, 0.4)
    _prove_each(tree, np.array([[0, 2], [1, 1]]), meshes)
    assert certify_orders(tree, motion, meshes, 10.0, (0, 0, 0), 0.2) == [(1, 2)]
    # With ends longer than the middle, the one that comes second lands on the first.
    longer = joinery_models.strip_tree(8, [1, 1], run=3)
    body = longer.bodies
    assert [len(part.voxels) for part in body] == [3, 3, 2]
    both = _partial(longer, np.array([[0, 2], [1, 2]]))
    with pytest.raises(CheckError, match="run into each other"):
        certify(longer, both, boxes(longer, 0.4), 10.0, (0, 0, 0), 0.2)
    assert certify_orders(longer, both, boxes(longer, 0.4), 10.0, (0, 0, 0), 0.2) == []


def _partial(tree, path):
    """A motion that ends between A and B."""
    from fabfold.fold.motion import Motion

    angles = np.zeros((len(path) + 1, len(tree.hinges)))
    for row, (hinge, quarters) in enumerate(path.tolist(), start=1):
        angles[row] = angles[row - 1]
        angles[row, hinge] += 90.0 * quarters
    names = tuple(hinge.name for hinge in tree.hinges)
    return Motion(names, angles, ((), *((int(hinge),) for hinge in path[:, 0])))


def _prove_each(tree, path, meshes):
    """Every move of a partial path keeps the gap; only its end is not the box."""
    with pytest.raises(CheckError, match="voxels away from shape B"):
        certify(tree, _partial(tree, path), meshes, 10.0, (0, 0, 0), 0.2)


@pytest.mark.slow
def test_every_order_of_a_kits_groups_is_certified(bar_kit):
    built = bar_kit.join()
    tree, motion, joinery = built.planned.tree, built.planned.motion, built.joinery
    meshes = [(body.vertices, body.faces) for body in joinery.bodies]
    path = [
        (int(moving[0]), motion.angles_deg[k, moving[0]] - motion.angles_deg[k - 1, moving[0]])
        for k, moving in enumerate(motion.moves)
        if moving
    ]
    groups = motion.certificate["any_order"]
    assert groups, "this kit has moves in any order"
    from fabfold.fold.motion import Motion

    for first, last in groups:
        for order in permutations(range(first - 1, last)):
            moves = [*path[: first - 1], *(path[number] for number in order), *path[last:]]
            angles = np.zeros((len(moves) + 1, len(tree.hinges)))
            for row, (hinge, turn) in enumerate(moves, start=1):
                angles[row] = angles[row - 1]
                angles[row, hinge] += turn
            again = Motion(motion.hinges, angles, ((), *((hinge,) for hinge, _ in moves)))
            proven = certify(
                tree, again, meshes, joinery.voxel_mm, joinery.origin_mm,
                bar_kit.print_mode().profile.min_gap_mm,
            )  # fmt: skip
            assert proven["min_gap_mm"] >= bar_kit.print_mode().profile.min_gap_mm
