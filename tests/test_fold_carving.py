"""Which cells give way to each other: cores, clashes, volumes, hinges and skin spared."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from carving_models import (
    LID,
    LID_HINGES,
    SLOT,
    SLOT_HINGES,
    full_material,
    tree_of,
)
from fold_oracle import TOUCH, plate_meetings, plates, turn_overlap
from test_fold_lattice import random_system, with_links

from fabfold.fold.carving_plan import CarvingPlan, carved_path, plan_carving
from fabfold.fold.clashes import clashes_on
from fabfold.fold.core_sweep import CORE_HALF_SIDE, core_sweep_table
from fabfold.fold.lattice_foldability import LatticeFoldability
from fabfold.fold.lattice_planner import count_free_moves, find_path, stuck_hinges
from fabfold.lattice.sweep import sweep_table
from fabfold.tree.system import hinge_system

ROUND = 1.0 - np.pi / 4


def voxel(tree, cell):
    return tree.source.tolist().index(list(cell))


@pytest.fixture(scope="module")
def slot():
    tree = tree_of(SLOT, SLOT_HINGES)
    return tree, hinge_system(tree), np.array([[0, 2]])


@pytest.fixture(scope="module")
def lid():
    tree = tree_of(LID, LID_HINGES)
    return tree, hinge_system(tree), np.array([[0, 2], [1, 2]])


def squares_meet(one, other):
    for corners in (one, other):
        for i in (0, 1):
            side = corners[i + 1] - corners[i]
            normal = np.array([-side[1], side[0]])
            p, q = one @ normal, other @ normal
            if min(p.max(), q.max()) - max(p.min(), q.min()) <= 1e-7:
                return False
    return True


@pytest.mark.slow
@pytest.mark.parametrize("half_side", [0.25, CORE_HALF_SIDE, 0.4])
def test_cores_sweep_what_turning_squares_show(half_side):
    table = core_sweep_table(8, half_side)
    whole = sweep_table(8)
    turns = [
        np.array([[np.cos(t), -np.sin(t)], [np.sin(t), np.cos(t)]])
        for t in np.radians(np.linspace(0, 90, 361))
    ]
    unit = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * half_side
    rng = np.random.default_rng(5)
    for _ in range(25):
        a, b = rng.integers(0, 4, 2)
        entry = a * table.side + b
        swept = set(map(tuple, table.cells[table.start[entry] : table.start[entry + 1]].tolist()))
        turned = [(unit + np.array([a + 0.5, b + 0.5])) @ turn.T for turn in turns]
        for c, d in whole.cells[whole.start[entry] : whole.start[entry + 1]].tolist():
            still = unit + np.array([c + 0.5, d + 0.5])
            assert ((c, d) in swept) == any(squares_meet(moved, still) for moved in turned)


def test_cores_of_whole_cells_are_whole_cells():
    assert (core_sweep_table(8, 0.5).cells == sweep_table(8).cells).all()
    with pytest.raises(ValueError, match="half_side"):
        core_sweep_table(8, 0.6)


def test_whole_cubes_block_and_cores_pass(slot):
    _, system, path = slot
    assert stuck_hinges(system).any()
    assert find_path(system).path is None
    assert not stuck_hinges(system, carve=CORE_HALF_SIDE).any()
    assert find_path(system, carve=CORE_HALF_SIDE).path.tolist() == path.tolist()
    assert count_free_moves(system, path) == 0
    assert count_free_moves(system, path, carve=CORE_HALF_SIDE) == 1


@pytest.mark.slow
def test_cores_of_systems_with_link_plates_are_planned():
    planned = 0
    for seed in range(40):
        system = with_links(random_system((3, 2, 1), 3, seed, 0), seed)
        found = find_path(system, carve=CORE_HALF_SIDE)
        if find_path(system).path is not None:
            assert found.path is not None, seed
        if found.path is not None:
            assert count_free_moves(system, found.path, carve=CORE_HALF_SIDE) == len(found.path)
            # Plates are never carved: whatever they sweep over must be out of the way.
            q = np.zeros(len(system.parent), dtype=int)
            for hinge, turn in found.path.tolist():
                assert not plate_meetings(system, q, hinge, turn)
                q[hinge] += turn
            planned += len(plates(system)) > 0
    assert planned >= 3


def test_clashes_are_the_overlaps_of_cubes():
    found = 0
    for seed in range(12):
        system = random_system((3, 3, 2), 5, seed, 0)
        start = np.zeros(len(system.parent), dtype=int)
        for hinge in range(len(system.parent)):
            for way in (1, -1):
                deep = turn_overlap(system, start, hinge, way)
                wanted = {tuple(sorted(pair)) for pair in np.argwhere(deep > TOUCH).tolist()}
                met = clashes_on(system, np.array([[hinge, way]]))
                assert {tuple(sorted((m.first, m.second))) for m in met} == wanted
                found += len(wanted)
    assert found > 100


def test_turns_forth_and_back_are_one_clash(slot):
    _, system, path = slot
    once = clashes_on(system, path)
    again = clashes_on(system, np.array([[0, 2], [0, -2], [0, 1], [0, -1], [0, 2]]))
    assert len(once) == len(again) == 1


@pytest.mark.slow
def test_a_cell_that_gives_way_alone_is_rounded(slot, lid):
    # A hinge that takes all of the wall's cell leaves no choice.
    tree, system, path = lid
    held = plan_carving(system, path, full_material(tree), bracket=(0.3, 0.0))
    turning = voxel(tree, (1, 0, 0))
    assert held.blocked == ()
    assert held.lost[turning] > 0.5 * ROUND
    tree, system, path = slot
    material = full_material(tree)
    best = plan_carving(system, path, material)
    assert best.blocked == ()
    # Both give way a little: less than a round of the one, far less than of the other.
    assert best.lost.sum() == pytest.approx(0.13, abs=0.01)
    assert np.flatnonzero(best.lost).tolist() == [
        voxel(tree, (1, 0, 0)),
        voxel(tree, (2, 0, 0)),
    ]


@pytest.mark.parametrize(("gives", "volume"), [((1, 0, 0), ROUND), ((2, 0, 0), np.pi / 4 - 0.5)])
def test_volume_of_a_one_sided_cut_is_the_analytic_one(slot, gives, volume, monkeypatch):
    # No way to share: between the two sides only.
    monkeypatch.setattr("fabfold.fold.carving_plan._SPLITS", 0)
    tree, system, path = slot
    material = full_material(tree)
    other = voxel(tree, (2, 0, 0) if gives == (1, 0, 0) else (1, 0, 0))
    monkeypatch.setattr(
        "fabfold.fold.carving_plan.skin_of", lambda cells, given: only(given, other)
    )
    carving = plan_carving(system, path, material)
    assert carving.lost[voxel(tree, gives)] == pytest.approx(volume, abs=0.015)
    assert carving.lost[other] == 0.0


def only(material, row):
    skin = np.zeros_like(material)
    skin[row] = True
    return skin


def test_empty_material_need_not_give_way(slot):
    tree, system, path = slot
    material = full_material(tree)
    wall = voxel(tree, (2, 0, 0))
    material[wall, :9] = False  # 0.45 of the wall's cell, beyond the reach of 0.415
    carving = plan_carving(system, path, material)
    assert len(carving.clashes) == 1
    assert carving.lost.sum() == 0.0
    assert carving.cost == 0.0


def test_hinges_are_never_carved(lid):
    tree, system, path = lid
    carving = plan_carving(system, path, full_material(tree))
    assert carving.blocked == ()
    turning, wall = voxel(tree, (1, 0, 0)), voxel(tree, (2, 0, 0))
    # The bracket on the wall's edge reaches radius 1.2: on all rings inside the cell gives way.
    rings = {
        (m.first, m.second): ring
        for m, ring in zip(carving.clashes, carving.rings.tolist(), strict=True)
    }
    low, high = rings[turning, wall]
    assert low <= 1.0
    assert high >= np.hypot(1.2, 0.2)
    blocked = plan_carving(system, path, full_material(tree), bracket=(1.1, 0.0))
    assert (turning, wall) in blocked.blocked
    assert blocked.cost == np.inf


def test_skin_is_spared():
    shares = []
    for cover in (
        [(3, 0, 0), (2, -1, 0), (2, 0, 1), (3, 0, 1), (3, -1, 0), (2, -1, 1)],
        [(1, -1, 0), (0, -1, 0), (1, -1, 1), (0, -1, 1), (1, 0, 1), (1, -1, -1)],
    ):
        # Only what is covered is inside; the rest of the surface costs three times as much.
        tree = tree_of([[*SLOT[0], *cover], SLOT[1]], SLOT_HINGES)
        carving = plan_carving(hinge_system(tree), np.array([[0, 2]]), full_material(tree))
        turning, wall = voxel(tree, (1, 0, 0)), voxel(tree, (2, 0, 0))
        shares.append(carving.lost[turning] / (carving.lost[turning] + carving.lost[wall]))
    covered_wall, covered_cell = shares
    assert covered_cell > covered_wall + 0.1


def test_judge_looks_at_cores_only_when_asked(slot):
    tree, system, path = slot
    assert LatticeFoldability().estimate(system, 100).unresolved.any()
    judge = LatticeFoldability(carve=CORE_HALF_SIDE, material=full_material(tree))
    judge = pickle.loads(pickle.dumps(judge))
    assert LatticeFoldability().path(system) is None
    assert judge.path(system).tolist() == path.tolist()
    assert not judge.stuck_hinges(system).any()
    assert not judge.estimate(system, 100).unresolved.any()
    assert LatticeFoldability(carve=CORE_HALF_SIDE).path(system).tolist() == path.tolist()


def test_path_that_needs_no_carving_is_preferred():
    # The wall can swing away first; the planner pays less for that than for a cut.
    tree = tree_of(
        [[(0, 0, 0), (0, 0, -1), (1, 0, -1), (2, 0, -1)], [(1, 0, 0)], [(2, 0, 0)]],
        [SLOT_HINGES[0], ((2, 0, -1), (2, 0, 0), (1, 0, 0), 2)],
    )
    system = hinge_system(tree)
    path, carving = carved_path(system, full_material(tree))
    assert count_free_moves(system, path) == len(path)
    assert carving.clashes == ()
    assert path[0, 0] == 1


def test_the_same_again(lid):
    tree, system, _ = lid
    first, second = (carved_path(system, full_material(tree)) for _ in range(2))
    assert (first[0] == second[0]).all()
    assert isinstance(first[1], CarvingPlan)
    assert (first[1].rings == second[1].rings).all()
    assert (first[1].lost == second[1].lost).all()


def test_wrong_material_is_named(slot):
    _, system, path = slot
    with pytest.raises(ValueError, match="material"):
        plan_carving(system, path, np.ones((3, 20, 20, 20), dtype=bool))
