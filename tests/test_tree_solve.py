from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest
from tree_cases import QUICK, animal, large_animal, solid_problem, strip

from fabfold.errors import NoFoldError, NoTreeError
from fabfold.fold.lattice_foldability import LatticeFoldability
from fabfold.fold.lattice_planner import count_free_moves
from fabfold.tree.effort import Effort
from fabfold.tree.initial_poses import grow
from fabfold.tree.kinematics_check import check_tree
from fabfold.tree.search_state import Statistics
from fabfold.tree.solve import _Search, solve
from fabfold.tree.system import hinge_system


def energies(candidates):
    return [c.energy["total"] for c in candidates]


def best_of_seeds(problem):
    # Half turns keep the phase of the voxels against the template, so a seed only finds its own.
    return min(
        (c for seed in range(8) for c in solve(problem, seed, LatticeFoldability(), QUICK)),
        key=lambda candidate: candidate.energy["total"],
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("length", "template", "joints"),
    [(4, "box-2x2x1", 1), (6, "box-2x3x1", 1), (6, "box-3x1x2", 1), (8, "box-2x2x2", 3)],
)
def test_strips_fold_with_the_fewest_hinges(length, template, joints):
    best = best_of_seeds(solid_problem(strip(length), template))
    assert best.tree.joints == {"S": joints, "D": 0}
    assert check_tree(best.tree) == []
    assert best.energy["count"] == pytest.approx(0.1 * joints)


@pytest.mark.slow
def test_a_box_that_is_its_own_template_needs_no_hinge():
    cells = [(x, y, z) for x in range(2) for y in range(2) for z in range(2)]
    best = best_of_seeds(solid_problem(cells, "box-2x2x2"))
    assert best.tree.joints["S"] == 0
    assert len(best.tree.bodies) == 1
    assert len(best.path) == 0
    assert check_tree(best.tree) == []


def test_one_voxel():
    found = solve(solid_problem([(0, 0, 0)], "box-2x2x2"), 0, LatticeFoldability(), QUICK)
    assert check_tree(found[0].tree) == []


def test_colours_that_do_not_fit():
    star = [(1, 1, 0), (0, 1, 0), (2, 1, 0), (1, 0, 0)]
    with pytest.raises(NoTreeError, match="checkerboard"):
        solve(solid_problem(star, "box-2x2x1"), 0, LatticeFoldability(), QUICK)


def test_more_voxels_than_cells():
    with pytest.raises(NoTreeError, match="5 voxels"):
        solid_problem(strip(5), "box-2x2x1")


def test_voxels_without_a_printable_joint():
    rigid = np.array([True, False, True])
    hinge = np.tile(rigid[:, None], (1, 4))
    with pytest.raises(NoTreeError, match="no printable joint"):
        solid_problem(strip(4), "box-2x2x1", rigid=rigid, hinge=hinge)


@pytest.mark.slow
def test_hinges_stay_on_printable_edges():
    hinge = np.ones((3, 4), dtype=bool)
    hinge[1] = [True, False, False, False]
    best = best_of_seeds(solid_problem(strip(4), "box-2x2x1", hinge=hinge))
    assert best.tree.hinges[0].point == (1.5, 0.5, 0.0)
    hinge[1] = False
    hinge[[0, 2]] = False
    with pytest.raises(NoTreeError):
        solve(solid_problem(strip(4), "box-2x2x1", hinge=hinge), 0, LatticeFoldability(), QUICK)


def test_pairs_that_cannot_be_rigid_turn_or_part():
    rigid = np.array([True, True, False, True])
    problem = solid_problem(strip(5), "box-2x3x1", rigid=rigid)
    for candidate in solve(problem, 0, LatticeFoldability(), QUICK):
        assert not any(
            e.kind == "R" and {e.parent, e.child} == {2, 3} for e in candidate.tree.edges
        )
        assert check_tree(candidate.tree) == []


@pytest.mark.slow
def test_surface_decides_which_way_a_strip_folds():
    depth = np.full((4, 6), 0.1)
    # The +y faces are hollow: better inside the folded box than outside.
    depth[:, 2] = 1.0
    best = best_of_seeds(solid_problem(strip(4), "box-2x2x1", depth=depth))
    assert best.tree.hinges[0].point == (1.5, 0.5, 0.0)
    assert best.energy["surface"] == pytest.approx(16 * 0.1, abs=1e-5)


@pytest.fixture(scope="module")
def dog():
    return large_animal()


@pytest.mark.slow
def test_an_animal_folds(animal_trees):
    assert animal_trees
    assert energies(animal_trees) == sorted(energies(animal_trees))
    for candidate in animal_trees:
        assert check_tree(candidate.tree) == []
        system = hinge_system(candidate.tree)
        turned = np.zeros(len(system.turns), dtype=int)
        np.add.at(turned, candidate.path[:, 0], candidate.path[:, 1])
        assert (turned == system.turns).all()
        assert count_free_moves(system, candidate.path) == len(candidate.path)


@pytest.mark.slow
def test_candidates_differ(animal_trees):
    hinges = [{(h.point, h.angle_deg) for h in c.tree.hinges} for c in animal_trees]
    for i, one in enumerate(hinges):
        assert all(one != other for other in hinges[:i])


@pytest.mark.slow
def test_same_seed_same_trees_also_through_pickle(dog, animal_trees):
    again = solve(pickle.loads(pickle.dumps(dog)), 0, LatticeFoldability(), QUICK)
    assert [c.tree.to_json(1.0, (0.0, 0.0, 0.0)) for c in again] == [
        c.tree.to_json(1.0, (0.0, 0.0, 0.0)) for c in animal_trees
    ]
    assert all((a.path == b.path).all() for a, b in zip(again, animal_trees, strict=True))


def test_seeds_differ(dog):
    first, second = (next(grow(dog, seed)) for seed in (1, 2))
    assert (first != second).any()


def test_full_template_of_125_cells_is_filled():
    problem = animal(125, "box-5x5x5", 1)
    pose = next(grow(problem, 0))
    assert len(set((pose // 24).tolist())) == 125


@pytest.mark.slow
def test_nothing_folds_without_budget(dog):
    class Stubborn(LatticeFoldability):
        def estimate(self, system, expansions, guide=None):
            return (
                super()
                .estimate(system, 1)
                ._replace(unresolved=np.ones(len(system.parent), dtype=np.int32))
            )

    with pytest.raises(NoFoldError, match="none of"):
        solve(dog, 0, Stubborn(), Effort(restarts=2))


@pytest.mark.slow
def test_what_folds_while_poses_settle_is_found(dog):
    # No budget after settling: whatever folds was asked about on the way.
    effort = replace(QUICK, starts=1, closure_tests=0, polish_each=0, polish_best=0)
    (found, *_) = solve(dog, 0, LatticeFoldability(), effort)
    system = hinge_system(found.tree)
    assert check_tree(found.tree) == []
    assert count_free_moves(system, found.path) == len(found.path)


@pytest.mark.slow
def test_what_settles_no_better_is_neither_folded_nor_polished(dog, animal_trees):
    statistics = Statistics()
    search = _Search(dog, 0, LatticeFoldability(), QUICK, statistics)
    state = search.state_of(animal_trees[0])
    runs = statistics.planner_runs
    assert search.settled_and_folded(state, 0, (0.1, 0.05), state.energy) is None
    assert statistics.planner_runs == runs and not search.results
    search.settled_and_folded(state, 0, (0.1, 0.05), state.energy + 0.1)
    assert statistics.planner_runs > runs
