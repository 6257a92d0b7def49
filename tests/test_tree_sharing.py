"""Two partly filled voxels in one template cell: eighths, search, checker, path and bodies."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from double_models import RIGID, hand_tree
from joinery_models import posed, voxels_of
from tree_cases import face_pairs, solid_problem, strip

from fabfold.errors import NoTreeError
from fabfold.fold.lattice_foldability import LatticeFoldability
from fabfold.fold.lattice_planner import count_free_moves
from fabfold.fold.motion import motion_of
from fabfold.joinery.build import build_bodies
from fabfold.joinery.cells import eroded_cells
from fabfold.lattice.rotations import FACES, ROTATIONS
from fabfold.lattice.shipped import load_template
from fabfold.proof.certify import certify
from fabfold.proof.replay import replay
from fabfold.recipe.recipe_wishes import default_weights
from fabfold.tree.assembly import hinge_choice
from fabfold.tree.beam import fill_beam
from fabfold.tree.catalogue import edge_sides
from fabfold.tree.effort import Effort
from fabfold.tree.fold_tree import FoldTree
from fabfold.tree.initial_poses import grow
from fabfold.tree.kinematics_check import check_tree
from fabfold.tree.pose_energy import energy_of
from fabfold.tree.problem import from_features, tree_problem
from fabfold.tree.rng import generator
from fabfold.tree.sharing import (
    octant_masks,
    quarter_depths,
    shared_octants,
    turned_masks,
    unpacked,
)
from fabfold.tree.solve import solve
from fabfold.tree.system import hinge_system
from fabfold.voxels.features import features

SIZE = 20
HALVES = (slice(0, SIZE // 2), slice(SIZE // 2, SIZE))


def block(*octants):
    """Material in some octants of a cell, each by its side along x, y and z."""
    out = np.zeros((SIZE, SIZE, SIZE), dtype=bool)
    for x, y, z in octants:
        out[HALVES[x], HALVES[y], HALVES[z]] = True
    return out


def turned(material, rotation):
    """Material of a cell after a rotation, subvoxel by subvoxel."""
    steps = 2 * np.indices(material.shape).reshape(3, -1).T - (SIZE - 1)
    moved = (steps @ np.asarray(rotation).T + SIZE - 1) // 2
    out = np.zeros_like(material)
    out[tuple(moved.T)] = material.reshape(-1)
    return out


def some_material(count, seed=0):
    """Cells with random blocks of material that hang together, some of them ragged."""
    rng = np.random.default_rng(seed)
    out = rng.random((count, SIZE, SIZE, SIZE)) < 0.9
    for ragged in out:
        low = rng.integers(0, 12, 3)
        high = low + rng.integers(4, 20, 3)
        box = np.zeros_like(ragged)
        box[tuple(slice(a, b) for a, b in zip(low, high, strict=True))] = True
        ragged[~box] = False
    return out


def test_masks_turn_like_the_material():
    material = some_material(12)
    masks = octant_masks(material)
    table = turned_masks(masks)
    assert (table[:, 0] == masks).all()
    for r, rotation in enumerate(ROTATIONS):
        again = octant_masks(np.array([turned(cell, rotation) for cell in material]))
        assert (table[:, r] == again).all()


def test_an_eighth_counts_from_four_per_cent_of_material():
    cell = block((0, 0, 0), (0, 0, 1))
    cell[10:20, 0, 0:3] = True  # 30 of 1000 subvoxels
    assert unpacked(octant_masks(cell[None]))[0].sum() == 2
    cell[10:20, 1, 0] = True
    assert unpacked(octant_masks(cell[None]))[0].sum() == 3


def test_eighths_that_do_not_hang_together_take_the_whole_cell():
    assert octant_masks(block((0, 0, 0), (1, 1, 0))[None])[0] == 255
    assert octant_masks(block((0, 0, 0), (1, 1, 1), (1, 0, 0))[None])[0] == 255
    assert octant_masks(block((0, 0, 0), (1, 0, 0), (1, 1, 0))[None])[0] != 255
    assert octant_masks(block()[None])[0] == 255


def test_depth_of_quarters_is_that_of_the_rays():
    material = some_material(5, seed=3)
    found = quarter_depths(material, 0.3)
    for r, rotation in enumerate(ROTATIONS):
        for v, cell in enumerate(material):
            here = turned(cell, rotation)
            for f in range(6):
                axis = f // 2
                rays = np.flip(here, axis) if f % 2 == 0 else here
                depth = np.where(rays.any(axis), rays.argmax(axis), SIZE) / SIZE
                quarters = depth.reshape(2, SIZE // 2, 2, SIZE // 2).mean(axis=(1, 3)).reshape(4)
                assert found[v, r, f] == pytest.approx(0.3 / 4 * quarters, abs=1e-6)


def crowd(count=24, template="box-3x3x3", seed=0):
    """A comb of cells, every third of them full and the others in part, with any joint allowed."""
    rng = np.random.default_rng(seed)
    cells = {(x, y, z) for x in range(3) for y in range(3) for z in range(3)}
    cells = np.array(sorted(cells)[:count], dtype=np.int32)
    kinds = [
        block(*[(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]),
        block((0, 0, 0), (0, 0, 1), (0, 1, 0), (0, 1, 1)),
        block((0, 0, 0), (0, 0, 1)),
    ]
    material = np.array([kinds[int(rng.integers(3))] for _ in cells])
    pairs = face_pairs(cells)
    return tree_problem(
        cells,
        load_template(template),
        pairs=pairs,
        rigid=np.ones(len(pairs), dtype=bool),
        hinge=np.ones((len(pairs), 4), dtype=bool),
        depth=rng.random((len(cells), 6)),
        weights=default_weights(),
        share=material,
    ), material


def grown(problem, material, limit=60):
    """Poses found by taking some voxels out of grown ones and putting them back loosely."""
    state = generator(7)
    rng = np.random.default_rng(1)
    out = np.empty((8, len(problem)), np.int32)
    for number, pose in enumerate(grow(problem, 2, root_poses=40)):
        yield pose
        for _ in range(limit):
            start = pose.copy()
            start[rng.permutation(len(pose))[:12]] = -1
            if (start < 0).all():
                continue
            todo = np.flatnonzero(start < 0).astype(np.int32)
            rows, _ = fill_beam(problem.tables, start, todo, 8, 2.0, 0.0, False, state, out)
            yield from out[:rows].copy()
        if number == 3:
            return


def together(pose):
    """Pairs of voxels in one cell."""
    cells = Counter((pose // 24).tolist())
    assert max(cells.values()) <= 2
    return [np.flatnonzero(pose // 24 == c) for c, n in cells.items() if n == 2]


@pytest.mark.slow
def test_voxels_share_only_where_their_eighths_differ():
    problem, material = crowd()
    shared = 0
    for pose in grown(problem, material):
        pairs = together(pose)
        assert len(pairs) <= problem.tables.max_shared == 2
        for u, v in pairs:
            one, two = (turned(material[w], ROTATIONS[pose[w] % 24]) for w in (u, v))
            assert not (one & two).any()
            shared += 1
    assert shared > 20


@pytest.mark.slow
def test_nearer_material_is_seen_in_a_shared_cell():
    problem, material = crowd()
    tables = problem.tables
    checked = 0
    for pose in grown(problem, material, limit=20):
        pairs = together(pose)
        if not pairs:
            continue
        checked += 1
        sums = float(sum(tables.cost[v, q] for v, q in enumerate(pose.tolist())))
        energy, number = energy_of(tables, pose, 0.0)
        wanted = 0.0
        for u, v in pairs:
            cell = pose[u] // 24
            both = [turned(material[w], ROTATIONS[pose[w] % 24]) for w in (u, v)]
            for f in range(6):
                if not tables.exposed[cell] >> f & 1:
                    continue
                quarters = []
                for here in both:
                    rays = np.flip(here, f // 2) if f % 2 == 0 else here
                    first = np.where(rays.any(f // 2), rays.argmax(f // 2), SIZE) / SIZE
                    quarters.append(first.reshape(2, 10, 2, 10).mean(axis=(1, 3)))
                wanted += 0.3 * float(np.maximum(*quarters).mean())
        # The farther of the two depths of each quarter was counted beside the nearer one.
        assert energy == pytest.approx(sums + 0.1 * (number - 1) - wanted, abs=1e-4)
    assert checked > 3


def test_hinges_of_guests_lie_in_their_own_eighths():
    problem, material = crowd()
    masks = problem.tables.octant_mask[:, 0]
    seen = 0
    for pose in grown(problem, material, limit=20):
        guests = {int(v) for pair in together(pose) for v in pair}
        octants = shared_octants(pose, masks)
        assert (octants is None) == (not guests)
        for row in hinge_choice(problem, pose).rows:
            for v, face in ((row["u"], row["face"]), (row["v"], row["face"] ^ 1)):
                if int(v) not in guests:
                    continue
                seen += 1
                middle = row["edge_a"] - 2 * problem.source[v]
                assert (middle * FACES[face]).sum() == 1
                own = unpacked(masks[v : v + 1])[0]
                beside = np.ones((2, 2, 2), dtype=bool)
                for axis in np.flatnonzero(middle):
                    keep = [slice(None)] * 3
                    keep[axis] = 0 if middle[axis] > 0 else 1
                    beside[tuple(keep)] = False
                assert own[beside].all()
    assert seen > 0


def test_without_sharing_there_is_nothing_of_it():
    problem = solid_problem(strip(8), "box-2x2x2")
    assert problem.tables.max_shared == 0 and (problem.tables.octant_mask == 255).all()
    for pose in grow(problem, 1, root_poses=5):
        assert hinge_choice(problem, pose).octants is None
    full = np.ones((8, SIZE, SIZE, SIZE), dtype=bool)
    cells = np.array(strip(8))
    pairs = face_pairs(cells)
    arguments = {
        "pairs": pairs,
        "rigid": np.ones(len(pairs), dtype=bool),
        "hinge": np.ones((len(pairs), 4), dtype=bool),
        "depth": np.zeros((8, 6)),
        "weights": default_weights(),
    }
    full_problem = tree_problem(cells, load_template("box-2x2x2"), share=full, **arguments)
    assert full_problem.tables.max_shared == 0
    with pytest.raises(NoTreeError, match="cannot go into"):
        tree_problem(cells, load_template("box-2x2x1"), share=full, **arguments)


# --- a model that fits only if two voxels share --------------------------------------------------


def bar():
    """Eleven cells in a row, both ends half as thick as the rest, on opposite sides of y."""
    import manifold3d

    cells = np.array(strip(11), dtype=np.int32)

    def box(low, high):
        size = np.subtract(high, low)
        return manifold3d.Manifold.cube(tuple(size)).translate(tuple(map(float, low)))

    body = box((0.48, -0.49, -0.49), (9.52, 0.49, 0.49))
    first = box((-0.49, -0.49, -0.49), (0.55, 0.0, 0.49))
    last = box((9.45, 0.0, -0.49), (10.49, 0.49, 0.49))
    solid = manifold3d.Manifold.batch_boolean([body, first, last], manifold3d.OpType.Add)
    return voxels_of(cells, solid)


@pytest.fixture(scope="module")
def folded():
    """The bar in a box of ten cells: the two thin ends must share one."""
    voxels = bar()
    template = load_template("box-5x2x1")
    with pytest.raises(NoTreeError, match="cannot go into"):
        from_features(voxels, features(voxels), template, default_weights())
    problem = from_features(voxels, features(voxels), template, default_weights(), share=True)
    found = solve(problem, 0, LatticeFoldability(), Effort(polish_best=10, restarts=10))
    return voxels, problem, found[0]


@pytest.fixture(scope="module")
def built(folded):
    voxels, _, candidate = folded
    motion = motion_of(candidate.tree, candidate.path)
    joinery = build_bodies(voxels, candidate.tree, motion, voxel_mm=20.0, clearance_mm=0.3)
    return candidate.tree, motion, joinery


@pytest.mark.slow
def test_thin_ends_share_a_cell(folded):
    _, _, candidate = folded
    tree = candidate.tree
    assert check_tree(tree) == []
    assert len({tuple(cell) for cell in tree.target.tolist()}) == 10
    assert (np.flatnonzero(tree.octants != 255) == [0, 10]).all()
    assert tree.target[0].tolist() == tree.target[10].tolist()
    again = FoldTree.from_json(tree.to_json(20.0, (0.0, 0.0, 0.0)))
    assert (again.octants == tree.octants).all() and check_tree(again) == []


def test_path_is_free_for_eighths_and_not_for_cells(folded):
    tree, path = folded[2].tree, folded[2].path
    system = hinge_system(tree)
    assert count_free_moves(system, path) == len(path)
    assert count_free_moves(system._replace(octants=None), path) < len(path)
    judge = LatticeFoldability()
    assert not judge.stuck_hinges(system).any()
    assert not judge.estimate(system, 400).unresolved.any()


def test_checker_refuses_what_must_not_share(folded):
    tree = folded[2].tree

    def said(octants, text):
        return any(text in line for line in check_tree(replace(tree, octants=octants)))

    assert said(None, "share target cell")
    wide = tree.octants.copy()
    wide[0] = 255
    assert said(wide, "share target cell")
    lone = tree.octants.copy()
    lone[5] = 15
    assert said(lone, "nobody shares")


def test_checker_wants_hinges_in_the_eighths_of_their_voxels():
    # The second voxel stands on the first, and the third turns up beside it onto the second.
    faces = FACES.tolist()
    side = edge_sides(faces.index([1, 0, 0])).index(faces.index([0, 0, 1]))
    joints = [(0, 1, RIGID), (0, 2, ("S", (side,), (2,)))]
    tree = hand_tree([[0, 0, 0], [0, 0, 1], [1, 0, 0]], joints, share=True)
    assert tree.target[1].tolist() == tree.target[2].tolist()
    low, high = 0b00001111, 0b11110000  # sides along x; the half turn swaps them
    beside = replace(tree, octants=np.array([255, low, low], dtype=np.uint8))
    assert check_tree(beside) == []
    away = replace(tree, octants=np.array([255, high, high], dtype=np.uint8))
    assert check_tree(away) == [f"{tree.hinges[0].name}: voxel 2 shares the eighths beside it"]


def test_bodies_of_a_shared_cell_keep_apart(built):
    tree, motion, joinery = built
    certificate = certify(
        tree,
        motion,
        [(body.vertices, body.faces) for body in joinery.bodies],
        voxel_mm=joinery.voxel_mm,
        origin_mm=joinery.origin_mm,
        min_gap_mm=0.28,
    )
    assert certificate["min_gap_mm"] >= 0.28
    assert any("share 1 cells" in note for note in joinery.notes)
    bodies = posed(joinery, tree, motion.angles_deg[-1])
    for one, other in combinations(bodies, 2):
        assert (one ^ other).volume() < 1e-3
    owner = tree.voxel_body
    first, last = bodies[owner[0]], bodies[owner[10]]
    assert first.min_gap(last, 2.0) == pytest.approx(0.3, abs=0.01)


def test_replay_knows_eighths(built):
    tree, motion, joinery = built
    meshes = [(body.vertices, body.faces) for body in joinery.bodies]
    report = replay(tree, motion, meshes, 20.0, joinery.origin_mm, gap_mm=0.3)
    assert report.max_penetration_mm < 0.1
    assert report.max_angle_error_deg < 1.0


def test_room_of_a_body_with_half_a_cell():
    cells = np.array([[0, 0, 0], [1, 0, 0]], dtype=np.int32)
    low = octant_masks(block(*[(x, 0, z) for x in (0, 1) for z in (0, 1)])[None])[0]
    room = eroded_cells(cells, 20.0, 0.15, np.array([255, low], dtype=np.uint8))
    # Of the second cell the lower half is left, less half the gap above and below.
    wanted = 19.7**3 + 20.0 * (10 - 0.3) * 19.7
    assert room.volume() == pytest.approx(wanted, rel=1e-6)
    assert np.allclose(room.bounding_box(), [-9.85, -9.85, -9.85, 29.85, 9.85, 9.85])
