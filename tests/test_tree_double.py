"""Double hinges: rows of the search, spanning trees with link plates, the filter, the checker."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from itertools import chain

import numpy as np
import pytest
from fold_oracle import TOUCH, path_overlap
from tree_cases import face_pairs, strip

from fabfold.errors import NoTreeError
from fabfold.fold.lattice_foldability import LatticeFoldability
from fabfold.fold.lattice_planner import count_free_moves, find_path
from fabfold.lattice.rotations import FACES, ROTATIONS, parity
from fabfold.lattice.shipped import load_template
from fabfold.recipe.recipe_wishes import default_weights
from fabfold.tree.assembly import fold_tree, hinge_choice
from fabfold.tree.catalogue import edge_sides, edge_turn, face_transforms, joint_types, realizations
from fabfold.tree.effort import Effort
from fabfold.tree.fold_tree import FoldTree
from fabfold.tree.initial_poses import grow
from fabfold.tree.kinematics_check import check_tree
from fabfold.tree.pose_energy import doubles_needed
from fabfold.tree.problem import tree_problem
from fabfold.tree.rng import generator
from fabfold.tree.search_state import axes_of_tree
from fabfold.tree.solve import solve
from fabfold.tree.swept_cells import double_blocked, hinge_tables
from fabfold.tree.system import HingeSystem, hinge_system

QUICK = Effort(polish_best=20, restarts=10)


def doubled(cells, template, joints="S+D", hinge=None):
    cells = np.array(cells, dtype=np.int32)
    pairs = face_pairs(cells)
    return tree_problem(
        cells,
        load_template(template),
        pairs=pairs,
        rigid=np.ones(len(pairs), dtype=bool),
        hinge=np.ones((len(pairs), 4), dtype=bool) if hinge is None else hinge,
        depth=np.zeros((len(cells), 6)),
        weights=default_weights(),
        double=np.ones(len(pairs), dtype=bool),
        joints=joints,
    )


def without_single_hinges(cells, template):
    """The strip's halves meet where no single hinge is printable."""
    pairs = face_pairs(cells)
    return doubled(cells, template, hinge=np.zeros((len(pairs), 4), dtype=bool))


@pytest.fixture(scope="module")
def tree():
    problem = without_single_hinges(strip(4), "box-2x2x1")
    found = solve(problem, 0, LatticeFoldability(), QUICK)
    return found[0]


@pytest.mark.slow
def test_rows_of_each_set_of_joints():
    count = {
        name: Counter(row[0].kind for row in joint_types(name)) for name in ("S", "S90", "all")
    }
    assert count["S"] == {"R": 1, "S": 4}
    assert count["S90"] == {"R": 1, "S": 8}
    assert count["all"] == {"R": 1, "S": 8, "D": 84}
    assert Counter(row[0].kind for row in joint_types("S+D")) == {"R": 1, "S": 4, "D": 32}
    assert doubled(strip(4), "box-2x2x1").keeps_colour
    assert not doubled(strip(4), "box-2x2x1", "all").keeps_colour


@pytest.mark.slow
@pytest.mark.parametrize("face", range(6))
def test_every_way_makes_its_joint(face):
    total = 0
    for joint in face_transforms(face):
        for first, q1, second, q2 in realizations(joint):
            made = edge_turn(face, first, q1)
            if second >= 0:
                assert first != second
                made = made @ edge_turn(face, second, q2)
                total += 1
            moved = made @ np.append(FACES[face], 1.0)
            assert tuple(np.rint(moved[:3]).astype(int)) == joint.offset
            assert (np.rint(made[:3, :3]) == ROTATIONS[joint.rotation]).all()
        if joint.kind == "D" and sum(map(abs, joint.offset)) == 1:
            assert all(
                3 in (way[1], way[3]) and way[1] % 2 == way[3] % 2 for way in realizations(joint)
            )
    # All pairs of different edges, three turns each.
    assert total == 12 * 9


@pytest.mark.slow
def test_colours_that_do_not_fit_want_all_joints():
    # A plus has one cell of one colour and four of the other.
    cells = [(1, 1, 0), (0, 1, 0), (2, 1, 0), (1, 0, 0), (1, 2, 0)]
    with pytest.raises(NoTreeError, match="all joints"):
        next(grow(doubled(cells, "box-5x1x1"), 0))
    assert doubled(cells, "box-5x1x1", "all").colourings() == [0, 1]


@pytest.mark.slow
def test_trees_reserve_edges_voxels_and_faces():
    rng = np.random.default_rng(0)
    problem = doubled(strip(8), "box-2x2x2", hinge=rng.random((7, 4)) < 0.3)
    state = generator(5)
    with_links = 0
    for pose in grow(problem, 3, root_poses=100):
        choice = hinge_choice(problem, pose)
        for _ in range(10):
            found = choice.tree(choice.kept(None), state)
            if found is None:
                continue
            made = fold_tree(problem, pose, found)
            assert check_tree(made) == []
            with_links += made.joints["D"] > 0
            assert made.joints["D"] >= doubles_needed(problem.tables, pose)
            weights = problem.weights
            assert made.energy["count"] == pytest.approx(
                weights.single * made.joints["S"] + weights.double * made.joints["D"]
            )
            assert made.energy["total"] == pytest.approx(
                made.energy["count"] + weights.surface * made.energy["surface"], abs=1e-4
            )
    assert with_links


@pytest.mark.slow
def test_a_tree_keeps_the_edges_and_turns_of_its_hinges():
    """Two voxels may be joined about one edge or another; a tree that folds folds by its own."""
    rng = np.random.default_rng(0)
    problem = doubled(strip(8), "box-2x2x2", hinge=rng.random((7, 4)) < 0.3)
    state = generator(5)
    several = others = 0
    for pose in chain.from_iterable(grow(problem, seed, root_poses=100) for seed in range(3, 7)):
        choice = hinge_choice(problem, pose)
        ways = Counter(frozenset(pair) for pair in choice.rows[["u", "v"]].tolist())
        found = next(choice.trees(None, 1, state), None)
        if found is None:
            continue
        several += any(ways[frozenset(pair)] > 1 for pair in found.hinged_pairs)
        made = axes_of_tree(fold_tree(problem, pose, found))
        assert frozenset(map(tuple, made.tolist())) == found.hinges
        for _ in range(8):
            again = next(choice.trees(made, 3, state))
            assert again.hinges == found.hinges
            assert again.hinged_pairs == found.hinged_pairs
            loose = next(choice.trees(made, 3, state, exact=False))
            assert loose.hinged_pairs == found.hinged_pairs
            others += loose.hinges != found.hinges
    assert several > 1
    assert others > 1, "by their voxels alone, hinges may come to lie on other edges"


def two_cubes(first, q1, second, q2):
    """Parent at 0, child in +x, joined by a double hinge."""
    d = FACES[0]
    sides = FACES[list(edge_sides(0))]
    points, axes, turns = [], [], []
    for side, quarters in ((first, q1), (second, q2)):
        line = np.cross(d, sides[side])
        points.append(d + sides[side])
        axes.append(int(np.abs(line).argmax()))
        turns.append(quarters * int(line.sum()))
    return HingeSystem(
        np.array([[0, 0, 0], [1, 0, 0]], dtype=np.int32),
        np.array([0, 2], dtype=np.int32),
        np.array([0, 1], dtype=np.int32),
        np.array(points, dtype=np.int32),
        np.array(axes, dtype=np.int8),
        np.array(turns, dtype=np.int8),
    )


@pytest.mark.slow
def test_the_filter_agrees_with_the_planner_on_two_cubes():
    tables = hinge_tables()
    source = np.array([[0, 0, 0], [1, 0, 0]], dtype=np.int32)
    zero, one = np.array([0], dtype=np.int32), np.array([1], dtype=np.int32)
    sides = FACES[list(edge_sides(0))].astype(np.int32)
    passed = 0
    for first, second in np.ndindex(4, 4):
        if first == second:
            continue
        for q1 in (1, 2, 3):
            for q2 in (1, 2, 3):
                blocked = double_blocked(
                    source, zero, one, source[0], FACES[0], sides[first], q1, sides[second], q2,
                    tables.quarter_turn,
                )  # fmt: skip
                system = two_cubes(first, q1, second, q2)
                path = find_path(system).path
                assert blocked == (path is None), (first, q1, second, q2)
                if path is not None:
                    passed += 1
                    assert count_free_moves(system, path) == len(path)
                    assert max(path_overlap(system, path)) <= TOUCH
    assert passed


@pytest.mark.slow
def test_a_strip_without_single_hinges_folds_by_double_ones(tree):
    made = tree.tree
    assert check_tree(made) == []
    assert made.joints["D"] > 0 and made.joints["S"] == 0
    links = [body for body in made.bodies if body.edge is not None]
    assert len(links) == made.joints["D"]
    assert all(body.voxels == () and body.name.startswith("link-") for body in links)
    assert len(made.bodies) == len(made.hinges) + 1
    assert (parity(made.target) != parity(made.source)).all() or (
        parity(made.target) == parity(made.source)
    ).all()
    assert max(path_overlap(hinge_system(made), tree.path)) <= TOUCH


@pytest.mark.slow
def test_trees_with_links_survive_their_file(tree):
    made = tree.tree
    again = FoldTree.from_json(made.to_json(20.0, (0.0, 0.0, 0.0)))
    assert again.bodies == made.bodies and again.hinges == made.hinges
    assert again.edges == made.edges and check_tree(again) == []
    for one, other in zip(hinge_system(again), hinge_system(made), strict=True):
        assert np.array_equal(one, other)


@pytest.mark.slow
def test_the_checker_sees_what_is_wrong_with_a_link(tree):
    made = tree.tree
    number = next(i for i, edge in enumerate(made.edges) if edge.kind == "D")
    edge = made.edges[number]
    edges = list(made.edges)
    edges[number] = replace(edge, hinges=edge.hinges[::-1])
    found = check_tree(replace(made, edges=tuple(edges)))
    assert any("in this order" in text for text in found)
    hinges = list(made.hinges)
    second = edge.hinges[1]
    hinges[second] = replace(hinges[second], point=hinges[edge.hinges[0]].point)
    assert any("on one edge" in text for text in check_tree(replace(made, hinges=tuple(hinges))))
    hinges = list(made.hinges)
    hinges[second] = replace(hinges[second], angle_deg=-hinges[second].angle_deg)
    assert any("runs into the face" in t for t in check_tree(replace(made, hinges=tuple(hinges))))
    bodies = list(made.bodies)
    link = next(i for i, body in enumerate(bodies) if body.edge == number)
    bodies[link] = replace(bodies[link], edge=None)
    assert check_tree(replace(made, bodies=tuple(bodies)))
