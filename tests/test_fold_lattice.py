"""Folding on the lattice: sweeps, planner, shortcut, against the plain meaning."""

from __future__ import annotations

import pickle
from collections import deque

import numpy as np
import pytest
from fold_oracle import (
    TOUCH,
    barrel_meetings,
    path_overlap,
    plate_meetings,
    plates,
    poses,
    state_is_valid,
    stuck,
    turn_overlap,
)

from fabfold.fold.lattice_foldability import LatticeFoldability, octants_of
from fabfold.fold.lattice_planner import (
    count_free_moves,
    find_path,
    kernel_inputs,
    refined,
    stuck_hinges,
)
from fabfold.fold.scene import pose_scene
from fabfold.fold.turn_obstacles import obstacles, turn_buffers
from fabfold.lattice.rotations import FACES
from fabfold.lattice.sweep import sweep_table
from fabfold.tree.system import HingeSystem

JUDGE = LatticeFoldability()


def stuck_counts(system):
    """How many hinges the closure test finds stuck, from A and from B."""
    return tuple(stuck_hinges(system).sum(axis=1).tolist())


def system_of(cells, groups, hinges):
    """System from cells, body of each cell, and hinges (parent cell, child cell, side, turns)."""
    cells = np.array(cells, dtype=np.int32)
    index = {tuple(c): i for i, c in enumerate(cells.tolist())}
    parent, point2, axis, turns = [], [], [], []
    for p, c, side, quarter in hinges:
        d, n = np.subtract(c, p), np.array(side)
        line = int(np.flatnonzero((d == 0) & (n == 0))[0])
        parent.append(groups[index[tuple(p)]])
        point2.append(2 * np.array(p) + d + n)
        axis.append(line)
        turns.append(quarter * int(np.cross(d, n)[line]))
    return HingeSystem(
        cells,
        np.array(groups, dtype=np.int32),
        np.array(parent, dtype=np.int32),
        np.array(point2, dtype=np.int32).reshape(-1, 3),
        np.array(axis, dtype=np.int8),
        np.array(turns, dtype=np.int8),
    )


def strip(length, cuts):
    """Row of cells along x; a cut is (position, side)."""
    cells = [(i, 0, 0) for i in range(length)]
    groups = [sum(i > at for at, _ in cuts) for i in range(length)]
    hinges = [((at, 0, 0), (at + 1, 0, 0), side, 2) for at, side in cuts]
    return system_of(cells, groups, hinges)


def random_system(shape, bodies, seed, quarter=2):
    """Random tree of bodies in a box, hinges on random edges."""
    rng = np.random.default_rng(seed)
    cells = [tuple(c) for c in np.argwhere(np.ones(shape, dtype=bool)).tolist()]
    links = [
        (a, tuple(np.add(a, f)))
        for a in cells
        for f in FACES[::2].tolist()
        if tuple(np.add(a, f)) in set(cells)
    ]
    owner = {c: i for i, c in enumerate(cells)}
    order = rng.permutation(len(links))
    left = len(cells)
    for at in order:
        a, b = owner[links[at][0]], owner[links[at][1]]
        if a != b and left > bodies:
            owner = {c: a if o == b else o for c, o in owner.items()}
            left -= 1
    number = {owner[cells[0]]: 0}
    hinges = []
    while len(number) < bodies:
        for at in order:
            a, b = links[at]
            if owner[b] in number and owner[a] not in number:
                a, b = b, a
            if owner[a] in number and owner[b] not in number:
                number[owner[b]] = len(number)
                d = np.subtract(b, a)
                sides = [f for f in FACES.tolist() if not np.dot(f, d)]
                turns = quarter if quarter else int(rng.integers(1, 3))
                hinges.append((a, b, sides[rng.integers(4)], turns))
                break
    return system_of(cells, [number[owner[c]] for c in cells], hinges)


def with_links(system, seed):
    """The same bodies, but some hinges are double: two edges of the face, a link between them."""
    rng = np.random.default_rng(seed)
    names = {0: 0}
    parent, point2, axis, turns = [], [], [], []
    for h, p in enumerate(system.parent.tolist()):
        base = names[p]
        if rng.random() < 0.5:
            # The opposite edge of the same face carries the first axis.
            face = [i for i in range(3) if i != system.axis[h]]
            face = face[int(rng.integers(2))]
            other = system.point2[h].copy()
            other[face] += 2 * (-1 if rng.random() < 0.5 else 1)
            parent.append(base)
            point2.append(other)
            axis.append(system.axis[h])
            turns.append(int(rng.choice([-2, -1, 1, 2])))
            base = len(parent)
        parent.append(base)
        point2.append(system.point2[h])
        axis.append(system.axis[h])
        turns.append(int(system.turns[h]))
        names[h + 1] = len(parent)
    return HingeSystem(
        system.cells,
        np.array([names[b] for b in system.body.tolist()], dtype=np.int32),
        np.array(parent, dtype=np.int32),
        np.array(point2, dtype=np.int32),
        np.array(axis, dtype=np.int8),
        np.array(turns, dtype=np.int8),
    )


def brute_force(system):
    """Whether B can be reached from A over lattice states, by looking at all of them."""
    goal = tuple(int(t) for t in system.turns)
    start = (0,) * len(goal)
    if not (state_is_valid(system, start) and state_is_valid(system, goal)):
        return False
    seen, queue = {start}, deque([start])
    while queue:
        q = queue.popleft()
        if q == goal:
            return True
        for h, t in enumerate(goal):
            for turn in (1, -1):
                step = (q[h] + turn) * int(np.sign(t))
                if not 0 <= step <= abs(t):
                    continue
                after = (*q[:h], q[h] + turn, *q[h + 1 :])
                if after in seen or not state_is_valid(system, after):
                    continue
                if turn_overlap(system, np.array(q), h, turn, 2.0).max(initial=0) > TOUCH:
                    continue
                if plate_meetings(system, q, h, turn, 1.0):
                    continue
                if not barrel_meetings(system, q, h, turn, 1.0):
                    seen.add(after)
                    queue.append(after)
    return False


def test_sweep_table_is_what_a_turning_square_passes_over():
    table = sweep_table(16)
    angles = np.radians(np.arange(0.0, 90.01, 0.5))
    spin = np.stack(
        [np.cos(angles), -np.sin(angles), np.sin(angles), np.cos(angles)], axis=-1
    ).reshape(-1, 2, 2)
    grid = np.stack(np.meshgrid(np.arange(-7, 7), np.arange(-2, 7), indexing="ij"), -1)
    for a in range(4):
        for b in range(4):
            entry = a * table.side + b
            listed = {
                tuple(c) for c in table.cells[table.start[entry] : table.start[entry + 1]].tolist()
            }
            centre = spin @ np.array([a + 0.5, b + 0.5])
            apart = grid[None] + 0.5 - centre[:, None, None]
            own = np.abs(np.einsum("txyi,tij->txyj", apart, spin)).max(-1)
            gap = np.maximum(np.abs(apart).max(-1), own)
            half = 0.5 * (1 + np.abs(spin[:, 0, 0]) + np.abs(spin[:, 0, 1]))
            hit = (half[:, None, None] - gap).max(axis=0) > 1e-9
            assert listed | {(a, b)} == {tuple(c) for c in grid[hit].tolist()}


def test_strip_of_four_folds_by_one_half_turn():
    system = strip(4, [(1, (0, 1, 0))])
    assert stuck_counts(system) == (0, 0)
    assert JUDGE.estimate(system, 40).unresolved.tolist() == [0]
    path = JUDGE.path(system)
    assert path.tolist() == [[0, 2]]
    end = poses(system, np.array([2.0]))[1]
    assert np.allclose(end @ [2, 0, 0, 1], [1, 1, 0, 1])


def test_strip_of_eight_folds_into_a_cube():
    system = strip(8, [(1, (0, 1, 0)), (3, (0, 0, 1)), (5, (0, 1, 0))])
    path = JUDGE.path(system)
    assert sorted(path[:, 0].tolist()) == [0, 1, 2]
    assert max(path_overlap(system, path)) <= TOUCH
    pose = poses(system, system.turns.astype(float))[system.body]
    cells = np.einsum("nij,nj->ni", pose[:, :3, :3], system.cells) + pose[:, :3, 3]
    assert len(np.unique(np.round(cells), axis=0)) == 8
    assert np.ptp(cells, axis=0) == pytest.approx([1, 1, 1])


def test_zigzag_strip_that_closes_on_itself_is_stuck():
    system = strip(8, [(1, (0, 1, 0)), (3, (0, 1, 0)), (5, (0, 1, 0))])
    assert JUDGE.path(system) is None
    assert JUDGE.estimate(system, 40).unresolved.sum() > 0


def test_a_block_inside_a_ring_cannot_leave():
    ring = [(x, y, 0) for x in range(3) for y in range(3) if (x, y) != (1, 1)]
    system = system_of([*ring, (1, 1, 0)], [0] * 8 + [1], [((0, 1, 0), (1, 1, 0), (0, 1, 0), 1)])
    assert stuck_counts(system)[0] == 1
    assert JUDGE.path(system) is None


@pytest.mark.slow
@pytest.mark.parametrize(("shape", "quarter"), [((2, 2, 2), 2), ((4, 2, 1), 0)])
def test_planner_and_closure_agree_with_brute_force(shape, quarter):
    folding = 0
    for seed in range(30):
        system = random_system(shape, 5, seed, quarter)
        goal = system.turns.astype(int)
        want = brute_force(system)
        found = find_path(system)
        assert (found.path is not None) == want, seed
        expected = (stuck(system, 0 * goal, 1), stuck(system, goal, -1))
        assert stuck_counts(system) == expected, seed
        if want:
            folding += 1
            assert stuck_counts(system) == (0, 0)
            assert count_free_moves(system, found.path) == len(found.path)
            assert max(path_overlap(system, found.path)) <= TOUCH
            turned = np.zeros(len(goal), dtype=int)
            np.add.at(turned, found.path[:, 0], found.path[:, 1])
            assert (turned == goal).all()
    assert folding >= 3


@pytest.mark.slow
def test_links_without_cells_fold_as_brute_force_says():
    folding = 0
    for seed in range(40):
        system = with_links(random_system((3, 2, 1), 3, seed, 0), seed)
        want = brute_force(system)
        path = JUDGE.path(system)
        assert (path is not None) == want, seed
        goal = system.turns.astype(int)
        assert stuck_counts(system) == (stuck(system, 0 * goal, 1), stuck(system, goal, -1)), seed
        folding += want
    assert folding >= 5


@pytest.mark.slow
def test_larger_random_systems_have_the_closure_of_the_reference():
    for seed in range(12):
        system = random_system((3, 3, 3), 9, seed, 0)
        zero = np.zeros(8, dtype=int)
        assert stuck_counts(system)[0] == stuck(system, zero, 1), seed


def test_barrels_may_not_share_a_lattice_edge():
    # Closing the middle hinge alone lays the third hinge's barrel onto the first one's.
    system = strip(4, [(0, (0, 1, 0)), (1, (0, 1, 0)), (2, (0, 1, 0))])
    assert not state_is_valid(system, np.array([0, 2, 0]))
    assert turn_overlap(system, np.zeros(3, dtype=int), 1, 2).max() <= TOUCH
    assert count_free_moves(system, np.array([[1, 1]])) == 1
    assert count_free_moves(system, np.array([[1, 2]])) == 0
    assert JUDGE.path(system) is None


def test_whole_cells_cut_into_eighths_fold_as_before():
    for seed in range(20):
        system = random_system((2, 2, 2), 4, seed)
        fine = refined(system, np.ones((len(system.cells), 2, 2, 2), dtype=bool))
        # Barrels may come a little nearer to each other there, so a few more systems fold.
        assert np.all(np.subtract(stuck_counts(system), stuck_counts(fine)) >= 0)
        if JUDGE.path(system) is not None:
            assert JUDGE.path(fine) is not None


def test_missing_eighths_set_a_hinge_free():
    # The third cell stands in the corner that the second one sweeps.
    cells = [(0, 0, 0), (1, 0, 0), (1, 1, 0)]
    system = system_of(cells, [0, 1, 0], [((0, 0, 0), (1, 0, 0), (0, 1, 0), 1)])
    assert stuck_counts(system)[0] == 1
    octants = np.zeros((3, 2, 2, 2), dtype=bool)
    octants[0] = True
    octants[1, 0, 1] = True  # of the flap, what is near the axis
    octants[2, 1, 1] = True  # of the obstacle, what is far from it
    assert stuck_counts(refined(system, octants)) == (0, 0)
    finer = LatticeFoldability(octants=octants)
    assert not finer.stuck_hinges(system).any()
    assert finer.path(system).tolist() == [[0, int(system.turns[0])]]
    octants[2, 1, 0] = True
    assert stuck_counts(refined(system, octants))[0] == 1


def test_octants_hold_any_material():
    subvoxels = np.zeros((2, 20, 20, 20), dtype=bool)
    subvoxels[1, 19, 0, 9] = True
    octants = octants_of(subvoxels)
    assert np.argwhere(octants).tolist() == [[1, 1, 0, 0]]
    with pytest.raises(ValueError, match="octants"):
        LatticeFoldability(octants=octants).stuck_hinges(strip(4, [(1, (0, 1, 0))]))


def test_answers_do_not_depend_on_the_order_of_voxels_and_survive_pickling():
    system = random_system((2, 2, 2), 5, 2)
    order = np.random.default_rng(0).permutation(len(system.cells))
    other = system._replace(cells=system.cells[order], body=system.body[order])
    judge = pickle.loads(pickle.dumps(JUDGE))
    assert judge == JUDGE
    assert np.array_equal(judge.path(system), JUDGE.path(other))
    assert (
        judge.estimate(system, 40).unresolved.tolist()
        == JUDGE.estimate(other, 40).unresolved.tolist()
    )


def test_systems_that_are_not_on_the_lattice_are_refused():
    system = strip(4, [(1, (0, 1, 0))])
    with pytest.raises(ValueError, match="lattice edge"):
        stuck_counts(system._replace(point2=system.point2 + np.array([[0, 1, 0]], dtype=np.int32)))
    with pytest.raises(ValueError, match="270"):
        stuck_counts(system._replace(turns=np.array([4], dtype=np.int8)))


def test_no_hinges_means_nothing_to_fold():
    system = system_of([(0, 0, 0)], [0], [])
    assert stuck_counts(system) == (0, 0)
    assert JUDGE.estimate(system, 40).unresolved.shape == (0,)
    assert JUDGE.path(system).shape == (0, 2)


def double_hinge(cells, groups, joint, turns):
    """Parent at 0, child at +x; axis edges as offsets in the face; bodies 0, link 1, child 2."""
    points = [np.array([1, 0, 0]) + side for side in np.array(joint)]
    lines = [np.cross([1, 0, 0], side) for side in np.array(joint)]
    return HingeSystem(
        np.array(cells, dtype=np.int32),
        np.array(groups, dtype=np.int32),
        np.array([0, 1], dtype=np.int32),
        np.array(points, dtype=np.int32),
        np.array([int(np.abs(line).argmax()) for line in lines], dtype=np.int8),
        np.array([q * int(line.sum()) for q, line in zip(turns, lines, strict=True)], np.int8),
    )


def test_a_plate_cannot_swing_through_a_cell():
    # The child turns away, then the link would pass through the cell beside the parent.
    edges = [(0, 1, 0), (0, -1, 0)]
    free = double_hinge([(0, 0, 0), (1, 0, 0)], [0, 2], edges, (2, 2))
    assert JUDGE.path(free) is not None
    for wall, folds in (((1, 1, 0), False), ((0, 1, 1), True)):
        cells = [(0, 0, 0), (1, 0, 0), wall]
        system = double_hinge(cells, [0, 2, 0], edges, (2, 2))
        assert (JUDGE.path(system) is not None) == folds, wall
        assert brute_force(system) == folds, wall


@pytest.mark.slow
def test_plates_meet_what_the_reference_says():
    checked = met = 0
    for seed in range(24):
        system = with_links(random_system((3, 2, 1), 4, seed, 0), seed)
        if len(plates(system)) == 0:
            continue
        rng = np.random.default_rng(seed)
        for _ in range(4):
            q = np.array([rng.integers(abs(t) + 1) * np.sign(t) for t in system.turns])
            if not state_is_valid(system, q):
                continue
            for h, t in enumerate(system.turns.tolist()):
                way = int(np.sign(t))
                if abs(q[h] + way) > abs(t):
                    continue
                after = q.copy()
                after[h] += way
                seen = plate_meetings(system, q, h, way, 1.0)
                free = (
                    not seen
                    and state_is_valid(system, after)
                    and turn_overlap(system, q, h, way).max(initial=0) <= TOUCH
                    and not barrel_meetings(system, q, h, way)
                )
                assert turn_free(system, q, h, way) == free, (seed, q, h, way, seen)
                checked += 1
                met += bool(seen)
    assert checked > 50 and met >= 3


def turn_free(system, quarters, hinge, way):
    """Whether the kernels let a hinge make a step from a state."""
    mech, scene, table = kernel_inputs(system)
    place = int(np.flatnonzero(mech.origin == hinge)[0])
    steps = np.abs(quarters)[mech.origin].astype(np.int8)
    assert pose_scene(mech, scene, steps)
    step = 1 if way * int(system.turns[hinge]) > 0 else -1
    return obstacles(mech, scene, table, place, step, turn_buffers(0)) == 0
