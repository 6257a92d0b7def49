"""Phases, and annealing by swaps, against the joints themselves."""

import numpy as np
import pytest
from tree_cases import animal, solid_problem, strip

from fabfold.search.warmup import warm_up_job
from fabfold.tree.assembly import hinge_choice
from fabfold.tree.bound import phase_bounds
from fabfold.tree.catalogue import joint_types
from fabfold.tree.cell_swaps import anneal_swaps
from fabfold.tree.effort import Effort
from fabfold.tree.phases import phase_labels, phase_of, phase_rotations
from fabfold.tree.pose_energy import energy_of
from fabfold.tree.pose_moves import PoseMoves
from fabfold.tree.rng import generator
from fabfold.tree.search_state import Statistics
from fabfold.tree.spanning_trees import loose_pieces
from fabfold.tree.swept_cells import hinge_tables

ANYWHERE = np.empty(0, np.int32)


@pytest.mark.parametrize(
    ("joints", "phases", "turns"),
    [("S", 48, 1), pytest.param("S+D", 4, 12, marks=pytest.mark.slow)],
)
def test_joints_keep_the_phase(joints, phases, turns):
    labels = phase_labels(joint_types(joints))
    assert sorted(np.unique(labels)) == list(range(phases))
    problem = warm_up_job(joints).problem
    tables = problem.tables
    cells = problem.template.cells
    for found in phase_rotations(labels, problem.source, cells):
        assert found.shape == (8, 8, turns)
    checked = 0
    for pose in range(0, 24 * 8, 5):
        for face in (0, 1):
            for joint in range(len(problem.joints)):
                child = tables.child_pose[face, pose, joint]
                u = 3
                v = tables.neighbour[u, face]
                if child < 0 or v < 0:
                    continue
                ends = [
                    phase_of(labels, problem.source[w], cells[q // 24], q % 24)
                    for w, q in ((u, pose), (v, child))
                ]
                assert ends[0] == ends[1]
                checked += 1
    assert checked > 20


@pytest.fixture(scope="module")
def beast():
    return animal(27, "box-3x3x3", 2)


def annealed(problem, seed, steps):
    phase = phase_bounds(problem)[0]
    out = np.empty(len(problem), np.int32)
    used, energy, left = anneal_swaps(
        problem.tables, phase.pose, phase.turns, problem.empty_face, hinge_tables(), 0.3, np.inf,
        ANYWHERE, steps, 0.25, 0.03, 0.5, generator(seed), out,
    )  # fmt: skip
    assert used == steps
    return out, energy, left


def test_annealing_joins_the_voxels_and_tells_the_energy(beast):
    found = [annealed(beast, seed, 40_000) for seed in range(6)]
    joined = [(pose, energy) for pose, energy, left in found if left == 0]
    assert joined
    for pose, energy in joined:
        assert sorted(pose // 24) == list(range(27))
        assert energy == pytest.approx(energy_of(beast.tables, pose, beast.empty_face)[0])
        choice = hinge_choice(beast, pose)
        assert loose_pieces(choice.rows, choice.clusters, 50, generator(0)) == 0
        assert energy >= phase_bounds(beast)[0].energy - 1e-4
    again, energy, _ = annealed(beast, 0, 40_000)
    assert (again == found[0][0]).all() and energy == found[0][1]


def test_one_swap_moves_two_voxels_at_most(beast):
    pose, start, left = next(
        found for seed in range(6) if (found := annealed(beast, seed, 40_000))[2] == 0
    )
    out = np.empty_like(pose)
    state = generator(3)
    turns = phase_bounds(beast)[0].turns
    focus = np.array([4, 9, 20], np.int32)
    moved = 0
    for _ in range(30):
        used, energy, left = anneal_swaps(
            beast.tables, pose, turns, beast.empty_face, hinge_tables(), 10.0, start + 1.0, focus,
            2000, 0.0, 0.0, 0.0, state, out,
        )  # fmt: skip
        assert 1 <= used <= 2000
        if np.isinf(energy):
            continue
        assert energy <= start + 1.0
        assert energy == pytest.approx(
            energy_of(beast.tables, out, beast.empty_face)[0] + 10.0 * left
        )
        changed = np.flatnonzero(out != pose)
        assert 1 <= len(changed) <= 2
        assert set(changed) & set(focus.tolist())
        moved += 1
    assert moved


def test_starts_are_in_the_phases_that_could_close_the_box_best():
    depth = np.random.default_rng(4).uniform(0.0, 1.0, (8, 6))
    problem = solid_problem(strip(8), "box-2x2x2", depth=depth)
    bounds = phase_bounds(problem)
    worse = np.array([bound.energy for bound in bounds]) - bounds[0].energy
    assert worse.max() > 0.6
    effort = Effort(swaps=500, choices=1)
    moves = PoseMoves(
        problem, effort, np.random.default_rng(0), generator(0), Statistics(), lambda: False
    )
    starts = [state for (state, _), _ in zip(moves.starts(0), range(30), strict=False)]
    rows = np.arange(8)
    of_start = [
        next(b.energy for b in bounds if (b.turns[rows, s.pose // 24, 0] == s.pose % 24).all())
        for s in starts
    ]
    assert len(starts) == 30
    above = np.array(of_start) - bounds[0].energy
    odds = np.exp(-np.unique(worse.round(5)) / 0.2)
    expected = (odds * np.unique(worse.round(5))).sum() / odds.sum()
    assert expected < 0.6 * worse.mean()
    assert above.mean() == pytest.approx(expected, abs=0.05)
