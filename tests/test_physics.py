"""Forces that unfold A and B until they meet: the forces, what helps them, and the path."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import pairwise

import joinery_models
import numpy as np
import pytest
from tree_cases import QUICK, animal

from fabfold.cli.app import main
from fabfold.errors import NoFoldError, RecipeError
from fabfold.fold.core_sweep import CORE_HALF_SIDE
from fabfold.fold.lattice_foldability import LatticeFoldability
from fabfold.fold.lattice_planner import count_free_moves
from fabfold.physics.actions import (
    Carve,
    Match,
    PinVoxel,
    Push,
    Release,
    Unfold,
    Wait,
    actions_json,
    read_actions,
)
from fabfold.physics.forced_path import physics_path
from fabfold.physics.lattice_path import lattice_path, steps_of
from fabfold.physics.unfolding import Unfolding, cell_boxes, repulsion
from fabfold.tree.solve import solve
from fabfold.tree.system import hinge_system


def strip():
    """Four bodies of two voxels, hinges by turns above and below."""
    return joinery_models.strip_tree(8, [1, -1, 1])


def curled(angles):
    """The strip's unfolding after both copies were let alone for no time at all."""
    unfolding = Unfolding(strip())
    assert np.allclose(unfolding.angles_deg("A"), 0)
    assert np.allclose(unfolding.angles_deg("B"), angles)
    return unfolding


def test_force_falls_with_the_square_and_both_feel_the_same():
    force = repulsion(np.array([[0.0, 0, 0], [2, 0, 0]]))
    near = repulsion(np.array([[0.0, 0, 0], [1, 0, 0]]))
    assert np.allclose(force[0], -force[1])
    assert force[1, 0] > 0
    assert np.allclose(force * 4, near)
    assert np.allclose(force[:, 1:], 0)
    crowd = repulsion(np.random.default_rng(1).normal(size=(9, 3)))
    assert np.allclose(crowd.sum(axis=0), 0)


def test_copies_begin_in_a_and_b():
    curled([180, -180, 180])


def test_forces_unfold_both_until_they_meet():
    unfolding = Unfolding(strip())
    unfolding.do(Unfold(steps=2000))
    # What was folded flat upon itself in B is spread out, and A has left the straight line or not:
    # its cells are as far apart as they get.
    assert np.abs(unfolding.angles_deg("B")).max() < 100
    assert not unfolding.met
    unfolding.do(Match(steps=1500))
    assert unfolding.met
    assert unfolding.difference_deg < 0.5
    for shape, first in (("A", 0.0), ("B", strip().fold_angles)):
        way = unfolding.way_deg(shape)
        assert np.allclose(way[0], first)
        # Nothing jumps: between two records a hinge turns by a few degrees at most.
        assert max(np.abs(b - a).max() for a, b in pairwise(way)) < 20
        low, high = np.minimum(strip().fold_angles, 0), np.maximum(strip().fold_angles, 0)
        assert (way > low - 3).all()
        assert (way < high + 3).all()


def test_the_path_is_free_and_ends_in_the_box():
    tree = strip()
    found = physics_path(tree)
    system = hinge_system(tree)
    carve = CORE_HALF_SIDE if found.carved else None
    assert count_free_moves(system, found.path, carve=carve) == len(found.path)
    turned = np.zeros(3, dtype=int)
    np.add.at(turned, found.path[:, 0], found.path[:, 1])
    assert (turned == system.turns).all()
    again = physics_path(tree)
    assert (again.path == found.path).all()
    assert again.actions == found.actions
    # The same actions, given by hand, find the same path.
    replayed = physics_path(tree, found.actions)
    assert (replayed.path == found.path).all()


def test_a_pinned_body_stays_and_a_pushed_one_goes():
    alone, pinned, pushed = (Unfolding(strip()) for _ in range(3))
    pinned.do(PinVoxel(shape="B", voxel=7))
    pushed.do(Push(shape="A", voxel=7, force=(0.0, 60.0, 0.0)))
    for unfolding in (alone, pinned, pushed):
        unfolding.do(Unfold(steps=400))
    start = strip().fold_angles
    end = strip().body_poses(start)[3] @ [7, 0, 0, 1]
    held = strip().body_poses(pinned.angles_deg("B"))[3] @ [7, 0, 0, 1]
    free = strip().body_poses(alone.angles_deg("B"))[3] @ [7, 0, 0, 1]
    assert np.linalg.norm(held - end) < 0.25
    assert np.linalg.norm(free - end) > 1.0
    up = strip().body_poses(pushed.angles_deg("A"))[3] @ [7, 0, 0, 1]
    rest = strip().body_poses(alone.angles_deg("A"))[3] @ [7, 0, 0, 1]
    assert up[1] > rest[1] + 0.5
    pinned.do(Release(shape="B"))
    pinned.do(Unfold(steps=800))
    let = strip().body_poses(pinned.angles_deg("B"))[3] @ [7, 0, 0, 1]
    assert np.linalg.norm(let - end) > 1.0


def test_while_waiting_only_pushes_act():
    unfolding = Unfolding(strip())
    unfolding.do(Wait(steps=200))
    assert np.allclose(unfolding.angles_deg("A"), 0, atol=1e-6)
    assert np.allclose(unfolding.angles_deg("B"), strip().fold_angles, atol=0.5)
    unfolding.do(Push(shape="A", voxel=7, force=(0.0, 30.0, 0.0)))
    unfolding.do(Wait(steps=100))
    moved = unfolding.angles_deg("A")
    assert np.abs(moved).max() > 5
    # A push of nothing ends it; what is joined is one action.
    unfolding.do(Push(shape="A", voxel=7, force=(0.0, 0.0, 0.0)))
    unfolding.do(Wait(steps=100))
    unfolding.do(Wait(steps=300), joined=True)
    assert unfolding.actions[-1] == Wait(steps=400)
    rest = unfolding.angles_deg("A")
    unfolding.do(Wait(steps=100))
    assert np.allclose(unfolding.angles_deg("A"), rest, atol=0.05)


def test_carving_leaves_the_core_in_both_shapes():
    tree = strip()
    boxes, voxels = cell_boxes(tree, {3})
    assert voxels == list(range(8))
    sides = np.array([box.high - box.low for box in boxes])
    assert np.allclose(sides[3], 2 * CORE_HALF_SIDE)
    assert np.allclose(np.delete(sides, 3, axis=0), 0.98)
    unfolding = Unfolding(tree)
    unfolding.do(Unfold(steps=100))
    before = unfolding.angles_deg("B")
    unfolding.do(Carve(voxel=3))
    assert unfolding.carved == {3}
    assert np.allclose(unfolding.angles_deg("B"), before)


def test_undo_takes_back_each_action():
    unfolding = Unfolding(strip())
    unfolding.do(Unfold(steps=300))
    records, angles = len(unfolding.way_deg("A")), unfolding.angles_deg("B")
    unfolding.do(Carve(voxel=2))
    unfolding.do(PinVoxel(shape="A", voxel=4))
    unfolding.do(Unfold(steps=200))
    assert not np.allclose(unfolding.angles_deg("B"), angles)
    for _ in range(3):
        assert unfolding.undo()
    assert np.allclose(unfolding.angles_deg("B"), angles, atol=1e-12)
    assert len(unfolding.way_deg("A")) == records
    assert unfolding.carved == set()
    assert unfolding.actions == [Unfold(steps=300)]
    # What is done after it is as if the others had never been.
    other = Unfolding(strip())
    other.do(Unfold(steps=300))
    for one in (unfolding, other):
        one.do(Unfold(steps=100))
    assert np.allclose(unfolding.angles_deg("B"), other.angles_deg("B"), atol=1e-6)
    assert unfolding.undo()
    assert unfolding.undo()
    assert not unfolding.undo()


def test_what_follows_an_undo_is_what_its_actions_do():
    """To the last bit: the actions that are kept find the same path again."""
    one = Unfolding(strip())
    one.do(Unfold(steps=302))  # Not a whole number of records.
    one.do(Unfold(steps=101))
    one.do(Carve(voxel=3))
    one.undo()
    one.undo()
    one.do(Match(steps=250))
    one.do(Match(steps=253), joined=True)
    other = Unfolding(strip())
    for action in one.actions:
        other.do(action)
    for shape in "AB":
        assert np.array_equal(one.way_deg(shape), other.way_deg(shape))


def test_steps_are_counted_where_a_hinge_passes_the_middle():
    way = np.array([[0.0, 0], [50, 0], [40, -46], [95, -100], [140, -130], [170, -136]])
    assert steps_of(way, detours=True) == [
        (0, 1), (0, -1), (1, 1), (0, 1), (0, 1), (1, 1)
    ]  # fmt: skip
    assert steps_of(way, detours=False) == [(1, 1), (0, 1), (0, 1), (1, 1)]


@pytest.fixture(scope="module")
def dog(animal_trees):
    """A tree of many hinges whose moves get into each other's way."""
    return animal_trees[0]


def put_right(candidate, moves):
    """Check that a tree's moves are put right that were made in an order that cells forbid."""
    tree, system = candidate.tree, hinge_system(candidate.tree)
    assert count_free_moves(system, candidate.path) == len(candidate.path)
    assert count_free_moves(system, moves, carve=CORE_HALF_SIDE) < len(moves)
    way = np.zeros((len(moves) + 1, len(system.turns)))
    sign = np.sign(tree.fold_angles)
    for row, (hinge, quarters) in enumerate(moves.tolist(), start=1):
        way[row] = way[row - 1]
        way[row, hinge] += 90 * quarters * int(np.sign(system.turns[hinge])) * sign[hinge]
    path, left = lattice_path(tree, way, way[-1:])
    assert left == 0
    assert path is not None
    assert count_free_moves(system, path, carve=CORE_HALF_SIDE) == len(path)


@pytest.mark.slow
def test_steps_that_are_not_free_yet_wait():
    """A motion made backwards is put right."""
    pup = solve(animal(30, "box-3x4x4", 3), 0, LatticeFoldability(), QUICK)[0]
    put_right(pup, pup.path[::-1])


@pytest.mark.slow
def test_moves_that_come_too_soon_wait(dog):
    """Each two moves in the wrong order are put right, on a tree of more hinges."""
    twos = [dog.path[first : first + 2] for first in range(0, len(dog.path), 2)]
    put_right(dog, np.concatenate([two[::-1] for two in twos]))


@pytest.mark.slow
def test_an_animal_folds_by_forces(animal_trees):
    for candidate in animal_trees:  # Forces alone do not fold every tree.
        try:
            found = physics_path(candidate.tree)
        except NoFoldError:
            continue
        system = hinge_system(candidate.tree)
        carve = CORE_HALF_SIDE if found.carved else None
        assert count_free_moves(system, found.path, carve=carve) == len(found.path)
        return
    pytest.fail(f"forces fold none of {len(animal_trees)} trees")


def test_what_cannot_meet_is_told():
    tree = strip()
    with pytest.raises(NoFoldError, match="A and B do not meet: a hinge stands 180°"):
        physics_path(tree, [Unfold(steps=1)])
    with pytest.raises(RecipeError, match="there is no voxel 8; this kit has 0 to 7"):
        physics_path(tree, [PinVoxel(shape="A", voxel=8)])


def test_actions_come_back_from_their_file(tmp_path):
    actions = (
        Unfold(steps=10),
        Push(shape="A", voxel=1, force=(0.0, 1.5, -2.0)),
        PinVoxel(shape="B", voxel=0),
        Carve(voxel=3),
        Release(shape="A"),
        Match(steps=20),
        Wait(steps=5),
    )
    path = tmp_path / "session.json"
    path.write_text(json.dumps(actions_json(actions)), encoding="utf-8")
    assert read_actions(path) == actions
    for content, told in (
        ("{", "no JSON"),
        ("[1]", "no list of actions"),
        ('{"format": "fabfold-actions", "version": 2, "actions": []}', "version"),
        ('{"format": "fabfold-actions", "version": 1, "actions": [{"do": "fly"}]}', "fly"),
        (
            '{"format": "fabfold-actions", "version": 1, "actions": '
            '[{"do": "unfold", "steps": 0}]}',
            "greater than or equal to 1",
        ),
    ):
        path.write_text(content, encoding="utf-8")
        with pytest.raises(RecipeError, match=told):
            read_actions(path)


@pytest.mark.slow
def test_the_command_folds_by_forces(bar, bar_kit, tmp_path, capsys):
    """A kit by forces has another path, keeps the actions, and goes on by its recipe alone."""
    import shutil

    from fabfold.kit.kit import open_kit

    kit = tmp_path / "kit"
    shutil.copytree(bar_kit.folder, kit)
    session = tmp_path / "session.json"
    found = physics_path(bar_kit.fold().tree)
    session.write_text(json.dumps(actions_json(found.actions)), encoding="utf-8")
    assert _run(["fold", str(kit), "--actions", str(session), "-q", "-j", "1"]) == 0
    session.unlink()
    opened = open_kit(str(kit), workers=1)
    assert opened.recipe.method == "physics"
    assert opened.recipe.actions == "session.json"
    motion = opened.fold().motion
    assert [moving[0] for moving in motion.moves[1:]] == found.path[:, 0].tolist()
    assert _run(["join", str(kit), "-q", "-j", "1"]) == 0
    built = open_kit(str(kit), workers=1).join()
    assert built.planned.motion.certificate["min_gap_mm"] > 0.4
    assert built.planned.motion.moves == motion.moves
    capsys.readouterr()
    assert _run(["fold", str(kit), "--actions", "nothing.json", "-q"]) == 2
    assert "--actions nothing.json: there is no such file" in capsys.readouterr().err
    assert _run(["fold", str(kit), "--method", "magic", "-q"]) == 2
    assert "planner" in capsys.readouterr().err


def _run(arguments):
    with pytest.raises(SystemExit) as stopped:
        main(arguments)
    return stopped.value.code or 0


def test_a_wrong_turn_does_not_meet():
    """Where A and B are kept from each other, it is said, not looked for for ever."""
    tree = strip()
    stuck = replace(tree)
    unfolding = Unfolding(stuck)
    for voxel in range(8):
        unfolding.do(PinVoxel(shape="A", voxel=voxel))
        unfolding.do(PinVoxel(shape="B", voxel=voxel))
    unfolding.do(Match(steps=300))
    assert not unfolding.met
    assert unfolding.difference_deg > 150
