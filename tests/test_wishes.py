"""Wishes: sides kept, regions protected, hinges inside, empty space, preferences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from tree_cases import face_pairs, strip
from typer.testing import CliRunner

from fabfold.cli.app import app
from fabfold.errors import NoTreeError, RecipeError
from fabfold.fold.lattice_foldability import LatticeFoldability
from fabfold.kit.stage_files import load_solid as read_solid
from fabfold.kit.stage_files import save_solid
from fabfold.lattice.rotations import FACES, ROTATIONS, rotation_about
from fabfold.lattice.shipped import load_template
from fabfold.recipe.recipe import make_recipe
from fabfold.recipe.recipe_wishes import default_weights, make_wishes, weights_of, wished
from fabfold.search.voxelization_problems import usable
from fabfold.solid.load import load_solid, solid_from_mesh
from fabfold.solid.raw import RawMesh
from fabfold.solid.regions import (
    parse_keep,
    parse_region,
    parse_side,
    sample_region,
    sample_surface,
)
from fabfold.store import StageStore
from fabfold.tree.effort import EFFORTS
from fabfold.tree.kinematics_check import check_tree
from fabfold.tree.problem import Weights, from_features, tree_problem
from fabfold.tree.solve import solve
from fabfold.voxels.features import features
from fabfold.voxels.region_cells import containing_voxels, to_lattice
from fabfold.voxels.voxelize import voxelize
from fabfold.wishes.joints_inside import count_surface_hinges
from fabfold.wishes.keep import Keep, keep_root_poses
from fabfold.wishes.protect import rank_by_cuts, rigid_pairs
from fabfold.wishes.wish_list import Wishes

EFFORT = replace(EFFORTS["quick"], polish_best=200, restarts=6)


def bar(length=8.0, width=2.0, height=2.0):
    """A solid bar from the origin, one unit a voxel."""
    mesh = trimesh.creation.box((length, width, height))
    mesh.apply_translation((length / 2, width / 2, height / 2))
    return solid_from_mesh("bar", RawMesh(mesh.vertices, mesh.faces.astype(np.int64)))


def cut(solid, template, rotation=None):
    turn = np.eye(3) if rotation is None else rotation
    low = (np.asarray(solid.vertices) @ turn.T).min(axis=0)
    (voxels, *_) = voxelize(
        solid, load_template(template), rotation=turn, origin=low + 0.5, pitch=1.0
    )
    return voxels


def search(voxels, template, wishes, seed=0):
    shape, found = load_template(template), features(voxels)
    protected = wishes.protected(voxels, found, shape)
    problem = from_features(
        voxels,
        found,
        shape,
        default_weights(),
        extra_cost=wishes.extra_cost(voxels, shape),
        always_rigid=rigid_pairs(protected, found),
    )
    problem = wishes.with_roots(problem, voxels, shape)
    return solve(problem, seed, LatticeFoldability(), EFFORT)[0].tree, protected


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("sphere(1,2,3)", "sphere wants 4 numbers"),
        ("sphere(1,2,3,-1)", "radius"),
        ("box(1,2,3,4,5,x)", "box wants 6 numbers"),
        ("cone(1,2,3)", "cannot read"),
        ("painted(#12345)", "a colour is written"),
    ],
)
def test_regions_that_cannot_be_read(text, part):
    with pytest.raises(RecipeError, match=part):
        parse_region(text, "--protect")


def test_recipe_refuses_wishes_it_cannot_read():
    with pytest.raises(RecipeError, match="no side is called"):
        make_recipe(model="sample:car", template="box-3x4x4", keep=("front:+w",))
    with pytest.raises(RecipeError, match="where, such as"):
        make_recipe(model="sample:car", template="box-3x4x4", keep=("front",))
    with pytest.raises(RecipeError, match="prefer"):
        make_recipe(model="sample:car", template="box-3x4x4", prefer="speed")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["fit", "sample:car", "--keep", "front:+w"], "no side is called '+w'"),
        (["fit", "sample:car", "--protect", "ball(1,2,3)"], "a region is box"),
        (["fit", "sample:car", "--prefer", "speed"], "prefer = 'speed'"),
        (["fold", "sample:car", "--pareto"], "--pareto goes with 'fabfold fit'"),
    ],
)
def test_command_line_says_what_is_wrong(arguments, words, tmp_path):
    found = CliRunner().invoke(app, [*arguments, "-o", str(tmp_path / "kit"), "-q"])
    assert found.exit_code == 2
    assert words in found.output
    assert "Traceback" not in found.output


def test_words_are_numbers_and_move_the_weights():
    recipe = make_recipe(model="sample:car", template="box-3x4x4")
    assert weights_of(recipe) == Weights(surface=0.3, single=0.1, double=0.12)
    assert wished(recipe) == []
    # What shares cells depends on it, what does not keeps the results that it has.
    assert wished(recipe.model_copy(update={"share": True})) == [["share", True]]
    few = weights_of(recipe.model_copy(update={"prefer": 0.0}))
    fine = weights_of(make_recipe(model="sample:car", template="box-3x4x4", prefer="surface"))
    assert few.single / few.surface == pytest.approx(16 * 0.1 / 0.3)
    assert fine.surface / fine.single == pytest.approx(16 * 0.3 / 0.1)
    assert make_recipe(model="a", template="box-2x2x2", void="inside").void == 1.0


def test_region_that_does_not_touch_the_model():
    with pytest.raises(RecipeError, match="no material"):
        sample_region(bar(), parse_region("sphere(20,0,0,3)", "--protect"))


def test_shares_of_the_extent():
    region = sample_region(bar(), parse_region("box(50%,0%,0%,100%,100%,50%)", "--protect"))
    (points,) = region.pieces
    assert points[:, 0].min() > 4.0
    assert points[:, 2].max() < 1.0


def test_points_follow_the_grid():
    turn = rotation_about(np.zeros(3), np.array([0, 0, 1]), 90.0)[:3, :3]
    voxels = cut(bar(), "box-4x4x2", turn)
    inside = np.array([[7.5, 0.5, 1.5], [0.5, 1.5, 0.5]])
    cells = voxels.cells[containing_voxels(voxels, inside)]
    wanted = np.rint(to_lattice(voxels, inside)).astype(int)
    assert (cells == wanted).all()
    assert containing_voxels(voxels, np.array([[9.0, 0.5, 0.5]])) == [-1]
    # The grid lies across: the front (-y) of the model is on a lattice face of x.
    keep = Keep("front:+x", sample_surface(bar(), parse_side("front", "")), 0)
    share, whole = keep.area_by_face(voxels)
    face = int(np.flatnonzero((turn @ [0, -1, 0] == FACES).all(axis=1))[0])
    assert whole == pytest.approx(16.0, rel=0.03)
    assert share[:, face].sum() == pytest.approx(16.0, rel=0.03)
    assert np.delete(share, face, axis=1).sum() == pytest.approx(0.0, abs=1e-9)


@pytest.mark.slow
def test_protected_voxels_are_one_body():
    solid = bar()
    voxels = cut(solid, "box-4x4x2")
    region = sample_region(solid, parse_region("sphere(4,1,1,1.05)", "--protect"))
    wishes = Wishes(regions=(region,))
    plain = [search(voxels, "box-4x4x2", Wishes(), seed)[0] for seed in range(4)]
    before = [wishes.report(voxels, tree)[0]["share"] for tree in plain]
    tree, protected = search(voxels, "box-4x4x2", wishes)
    (group,) = protected[0].groups
    assert len(group) == 8
    assert check_tree(tree) == []
    assert len(set(tree.voxel_body[list(group)].tolist())) == 1
    (after,) = wishes.report(voxels, tree)
    assert after["share"] > 0.99
    assert min(before) < 0.9


def test_protected_region_too_long_for_the_template():
    solid = bar()
    voxels = cut(solid, "box-4x4x2")
    region = sample_region(solid, parse_region("box(1,0,0,7,2,2)", "--protect"))
    with pytest.raises(NoTreeError, match="fit template 'box-4x4x2' nowhere"):
        rank_by_cuts([region], [(voxels, features(voxels))], load_template("box-4x4x2"))


def test_protected_region_held_by_too_little():
    # Two blocks that touch in a thin bridge: contact, but no rigid one.
    boxes = [((0, 0, 0), (2, 1, 1)), ((2, 0, 0), (4, 1, 1))]
    mesh = trimesh.util.concatenate(
        [trimesh.creation.box(bounds=(np.array(a), np.array(b))) for a, b in boxes]
    )
    voxels = cut(
        solid_from_mesh("two", RawMesh(mesh.vertices, mesh.faces.astype(int))), "box-4x1x1"
    )
    found = features(voxels)
    weak = replace(found, rigid=np.array([True, False, True]))
    solid = bar(4, 1, 1)
    region = sample_region(solid, parse_region("box(1.2,0,0,2.8,1,1)", "--protect"))
    with pytest.raises(NoTreeError, match="cannot be printed as one piece"):
        Wishes(regions=(region,)).protected(voxels, weak, load_template("box-4x1x1"))


def test_grids_with_few_cuts_come_first():
    solid = bar()
    region = sample_region(solid, parse_region("sphere(4.5,0.5,0.5,0.45)", "--protect"))
    shape = load_template("box-4x4x4")
    low = np.zeros(3)
    across, within = (
        voxelize(solid, shape, rotation=np.eye(3), origin=low + shift, pitch=1.0)[0]
        for shift in ((0.0, 0.5, 0.5), (0.5, 0.5, 0.5))
    )
    options = [(voxels, features(voxels)) for voxels in (across, within)]
    assert rank_by_cuts([region], options, shape) == [1, 0]


@pytest.mark.slow
def test_kept_share_rises():
    solid = bar(4.0, 3.0, 2.0)
    voxels = cut(solid, "box-3x4x2")
    what, side = parse_keep("left:+z", "--keep")
    keep = Keep("left:+z", sample_surface(solid, what), side)
    plain = replace(Wishes(keeps=(keep,)), keep_weight=0.0)
    strong = Wishes(keeps=(keep,), keep_weight=1.0)
    before = [strong.kept(voxels, search(voxels, "box-3x4x2", plain, s)[0])[0] for s in range(3)]
    trees = [search(voxels, "box-3x4x2", strong, seed)[0] for seed in range(3)]
    after = [strong.kept(voxels, tree)[0] for tree in trees]
    assert np.mean([kept.share for kept in after]) > np.mean([k.share for k in before]) + 0.1
    for tree, kept in zip(trees, after, strict=True):
        # The same by hand: the voxels of x = 0 whose -x face looks to +z on the top layer.
        there = (tree.target[:, 2] == 1) & (voxels.cells[:, 0] == 0)
        there &= (tree.orientation @ np.array([-1, 0, 0]) == [0, 0, 1]).all(axis=1)
        assert kept.share == pytest.approx(there.sum() / 6, abs=0.02)
        assert "wishes" in tree.energy
        assert tree.energy["wishes"] == pytest.approx(6 - there.sum(), abs=0.15)


def test_empty_space_is_priced_as_it_lies():
    solid = bar(4.0, 3.0, 2.0)
    voxels = replace(cut(solid, "box-3x4x2"), fill=np.linspace(0.1, 1.0, 24))
    shape = load_template("box-3x3x3")
    rng = np.random.default_rng(5)
    visible = (shape.cells != 1).any(axis=1)
    for void in (1.0, -0.5):
        wishes = Wishes(void=void)
        cost = wishes.extra_cost(voxels, shape)
        costs, emptiness = [], []
        for _ in range(4):
            cells = rng.permutation(27)[:24]
            costs.append(cost[np.arange(24), 24 * cells + rng.integers(24, size=24)].sum())
            full = np.zeros(27)
            full[cells] = voxels.fill
            dear = visible if void > 0 else ~visible
            emptiness.append(abs(void) * wishes.void_weight * (1 - full)[dear].sum())
        assert np.ptp(np.array(costs) - emptiness) == pytest.approx(0.0, abs=1e-5)


def small_problem(template):
    cells = np.array(strip(6), dtype=np.int32)
    pairs = face_pairs(cells)
    return tree_problem(
        cells,
        template,
        pairs=pairs,
        rigid=np.ones(len(pairs), dtype=bool),
        hinge=np.ones((len(pairs), 4), dtype=bool),
        depth=np.zeros((len(cells), 6)),
        weights=default_weights(),
    )


@pytest.mark.slow
def test_hinges_inside_are_inside():
    anywhere = load_template("box-3x3x3")
    inside = replace(anywhere, joints="inside")
    loose = solve(small_problem(anywhere), 0, LatticeFoldability(), EFFORT)[0].tree
    tree = solve(small_problem(inside), 0, LatticeFoldability(), EFFORT)[0].tree
    assert count_surface_hinges(loose) > 0
    assert count_surface_hinges(tree) == 0
    assert check_tree(tree) == []
    # By hand: in B every hinge's edge lies strictly within the box.
    root = tree.root_rotation, tree.root_translation
    poses = tree.body_poses(tree.fold_angles)
    for hinge in tree.hinges:
        pose = poses[hinge.parent]
        point = root[0] @ (pose[:3, :3] @ np.array(hinge.point) + pose[:3, 3]) + root[1]
        along = np.abs(root[0] @ pose[:3, :3] @ np.array(hinge.direction)).round() == 1
        assert ((point[~along] > -0.4) & (point[~along] < 2.4)).all()


def test_edges_inside_a_template():
    edges = load_template("box-2x2x2").inside_edges()
    assert edges.sum() == 6
    assert load_template("box-4x4x4").inside_edges().sum() == 3 * 9 * 4
    assert not load_template("box-8x1x1").inside_edges().any()


def test_hinges_inside_need_a_cell_to_spare():
    voxels = cut(bar(), "box-4x4x2")
    with pytest.raises(NoTreeError, match="needs an empty cell beside it"):
        usable([voxels], replace(load_template("box-4x4x2"), joints="inside"), Wishes())


def test_template_file_with_hinges_inside(tmp_path):
    text = 'name = "block"\njoints = "{}"\n[[box]]\nfrom = [0, 0, 0]\nto = [3, 3, 3]\n'
    path = tmp_path / "block.toml"
    path.write_text(text.format("inside"), encoding="utf-8")
    assert load_template(str(path)).joints == "inside"


def test_painted_faces_are_a_region(tmp_path):
    mesh = trimesh.creation.box((8, 2, 2))
    for _ in range(4):
        mesh = mesh.subdivide()
    middles = mesh.triangles_center
    colours = np.tile(np.array([[210, 205, 200, 255]], dtype=np.uint8), (len(mesh.faces), 1))
    for x, colour in ((-2.0, (255, 0, 0, 255)), (2.0, (0, 0, 255, 255))):
        near = (np.abs(middles[:, 0] - x) < 0.8) & (middles[:, 2] > 0.99)
        colours[near] = colour
    mesh.visual.face_colors = colours
    mesh.export(tmp_path / "eyes.ply")
    solid = load_solid(tmp_path / "eyes.ply")
    store = StageStore(tmp_path)
    (tmp_path / "stages").mkdir()
    solid = read_solid(store, save_solid(store, solid))
    assert len(sample_region(solid, parse_region("painted", "")).pieces) == 2
    (eye,) = sample_region(solid, parse_region("painted(#ff0000)", "")).pieces
    assert eye[:, 0].max() < -1.0
    voxels = cut(solid, "box-4x4x2")
    recipe = make_recipe(model="eyes.ply", template="box-4x4x2", protect=("painted",))
    wishes = make_wishes(recipe, solid)
    (protected,) = wishes.protected(voxels, features(voxels), load_template("box-4x4x2"))
    for group in protected.groups:
        assert (voxels.cells[list(group), 2] == 1).all()
    assert len(protected.groups) == 2
    with pytest.raises(RecipeError, match="#0000ff"):
        sample_region(solid, parse_region("painted(#00ff00)", ""))
    with pytest.raises(RecipeError, match="no face of the model is painted"):
        sample_region(bar(), parse_region("painted", ""))


def test_root_poses_show_the_kept_part_on_its_side():
    voxels = cut(bar(), "box-4x4x2")
    shape = load_template("box-4x4x2")
    keep = Keep("left:-y", sample_surface(bar(), parse_side("left", "")), 3)
    for voxel, pose in keep_root_poses([keep], voxels, shape, [0]).tolist():
        cell, rotation = shape.cells[pose // 24], ROTATIONS[pose % 24]
        assert voxels.cells[voxel, 0] == 0
        assert cell[1] == 0
        assert (rotation @ [-1, 0, 0] == [0, -1, 0]).all()
        assert (voxels.cells[voxel].sum() - cell.sum()) % 2 == 0
