"""How closed a box can be, and the move of all leaves at once, against brute force and scipy."""

import itertools

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment
from tree_cases import animal, solid_problem, strip

from fabfold.fold.lattice_foldability import LatticeFoldability
from fabfold.lattice.rotations import ROTATIONS, parity
from fabfold.lattice.shipped import load_template
from fabfold.tree.bound import (
    ClosingBound,
    closed_at_most,
    closed_share,
    least_surface,
    phase_bounds,
    visible_faces,
)
from fabfold.tree.catalogue import JOINT_SETS
from fabfold.tree.effort import Effort
from fabfold.tree.leaf_assignment import assign, reassign_leaves
from fabfold.tree.pose_energy import count_defects, energy_of
from fabfold.tree.rng import generator
from fabfold.tree.search_state import pose_of_tree
from fabfold.tree.solve import Statistics, solve
from fabfold.tree.swept_cells import hinge_tables

QUICK = Effort(starts=1, restarts=6, polish_each=40, polish_best=20)


@pytest.fixture(scope="module")
def bar():
    depth = np.random.default_rng(3).random((8, 6))
    return solid_problem(strip(8), "box-2x2x2", depth=depth)


@pytest.fixture(scope="module")
def folded(bar):
    return solve(bar, 1, LatticeFoldability(), QUICK)


def test_a_box_shows_its_outer_faces():
    assert visible_faces(load_template("box-2x2x2")) == 24
    assert visible_faces(load_template("box-3x4x4")) == 2 * (12 + 12 + 16)


def test_the_bound_is_that_of_the_best_permutation(bar):
    # Half turns about edges mirror a voxel along each axis along which its cell changed parity.
    cost = bar.tables.cost.reshape(8, 8, 24).astype(float)
    turn_of = {matrix.tobytes(): r for r, matrix in enumerate(ROTATIONS)}
    orders = np.array(list(itertools.permutations(range(8))))
    colours = (parity(bar.source) + parity(bar.template.cells)[orders]) % 2
    orders = orders[colours.min(axis=1) == colours.max(axis=1)]
    best = np.inf
    for root in ROTATIONS:
        for shift in itertools.product((0, 1), repeat=3):
            moved = (bar.template.cells @ root)[None] - bar.source[:, None] - shift
            price = np.full((8, 8), np.inf)
            for v, c in zip(*np.nonzero(moved.sum(axis=2) % 2 == 0), strict=True):
                turned = root @ np.diag(1 - 2 * (moved[v, c] % 2))
                price[v, c] = cost[v, c, turn_of[turned.astype(ROTATIONS.dtype).tobytes()]]
            best = min(best, price[range(8), orders].sum(axis=1).min())
    assert least_surface(bar) == pytest.approx(best)


def test_bounds_of_phases_ascend_and_are_had_by_their_poses(bar):
    bounds = phase_bounds(bar)
    assert len(bounds) > 1
    energies = [bound.energy for bound in bounds]
    assert energies == sorted(energies)
    assert energies[0] == least_surface(bar)
    for bound in bounds:
        assert sorted(bound.pose // 24) == list(range(8))
        shown = bar.tables.cost[np.arange(8), bound.pose].sum()
        assert bound.energy == pytest.approx(shown, rel=1e-5)


def test_no_tree_closes_the_box_further_than_the_bound(bar, folded):
    for candidate in folded:
        closed = closed_share(candidate.tree)
        assert closed <= closed_at_most(bar) + 1e-9
        shown = candidate.energy["surface"] / visible_faces(bar.template)
        assert closed == pytest.approx(1 - shown)


@pytest.mark.slow
@pytest.mark.parametrize("joints", JOINT_SETS)
@pytest.mark.parametrize("name", ["box-2x2x2", "box-3x2x2", "box-4x2x1", "l-64"])
def test_the_bound_of_cells_and_depths_is_that_of_the_problem(name, joints):
    template = load_template(name)
    rng = np.random.default_rng(len(template))
    for count in (len(template), len(template) - 1):
        depth = rng.random((count, 6))
        problem = solid_problem(strip(count), name, depth=depth, joints=joints)
        least = least_surface(problem) / problem.weights.surface
        bound = ClosingBound(template, joints)
        if np.isinf(least):
            assert np.isinf(bound.open_faces(problem.source, depth))
        else:
            assert bound.open_faces(problem.source, depth) == pytest.approx(least, rel=1e-5)


def test_an_empty_cell_counts_its_visible_faces():
    problem = solid_problem(strip(7), "box-2x2x2")
    assert least_surface(problem) == pytest.approx(3 * problem.weights.surface)
    assert closed_at_most(problem) == pytest.approx(1 - 3 / 24)


def test_assignment_is_scipys():
    rng = np.random.default_rng(0)
    for rows, columns in ((1, 1), (3, 3), (5, 9), (12, 12), (12, 20)):
        cost = rng.random((rows, columns))
        row_of = np.empty(columns, np.int32)
        assign(cost, rows, columns, row_of)
        taken = np.flatnonzero(row_of >= 0)
        assert sorted(row_of[taken]) == list(range(rows))
        i, j = linear_sum_assignment(cost)
        assert cost[row_of[taken], taken].sum() == pytest.approx(cost[i, j].sum())


@pytest.mark.slow
def test_leaves_move_to_full_poses_of_the_energy_told():
    problem = animal(27, "box-3x3x3", 2)
    pose = pose_of_tree(solve(problem, 3, LatticeFoldability(), QUICK)[0].tree)
    start, _ = energy_of(problem.tables, pose, problem.empty_face)
    state = generator(5)
    out = np.empty_like(pose)
    moved = set()
    for _ in range(200):
        used, energy, left = reassign_leaves(
            problem.tables, pose, problem.empty_face, hinge_tables(), 10.0, start + 1.0, 5, 8, 0.3,
            state, out,
        )  # fmt: skip
        assert 1 <= used <= 5
        if np.isinf(energy):
            continue
        assert energy <= start + 1.0
        assert sorted(out // 24) == list(range(27))
        assert count_defects(problem.tables, out) == 0
        told, _ = energy_of(problem.tables, out, problem.empty_face)
        assert energy == pytest.approx(told + 10.0 * left)
        assert (out != pose).any()
        moved.add(int((out != pose).sum()))
    assert max(moved) > 1, "several leaves at once"


def test_a_tree_that_folds_is_gone_on_from(bar, folded):
    start = folded[-1]
    counts = Statistics()
    effort = Effort(polish_best=20, kicks=3, kick_patience=2)
    found = solve(bar, 9, LatticeFoldability(), effort, counts, start=start)
    assert counts.grown == counts.annealed == 0
    assert found[0].energy["total"] <= start.energy["total"] + 1e-9
    assert {candidate.seed for candidate in found} == {9}
    assert any(np.array_equal(c.path, start.path) for c in found)
