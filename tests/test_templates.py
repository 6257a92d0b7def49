"""Template files, templates that fold once more, and meshes as targets."""

from itertools import islice

import numpy as np
import pytest
import trimesh
from tree_cases import solid_problem, strip

from fabfold.errors import ModelError, NoTreeError, RecipeError, TemplateError
from fabfold.export.flat import flat_poses
from fabfold.fold.crease_hinges import add_crease_hinges
from fabfold.fold.lattice_foldability import LatticeFoldability
from fabfold.fold.lattice_planner import count_free_moves
from fabfold.fold.motion import end_pose_error, motion_of
from fabfold.joinery.bodies import Joinery
from fabfold.lattice.creases import folded_template, parts_of
from fabfold.lattice.rotations import ROTATIONS
from fabfold.lattice.shipped import load_template, template_names
from fabfold.lattice.template_files import read_template
from fabfold.recipe.targets import find_input, load_target, named_target
from fabfold.solid.closed_solid import Solid
from fabfold.tree.assembly import hinge_choice
from fabfold.tree.effort import Effort
from fabfold.tree.initial_poses import grow
from fabfold.tree.kinematics_check import check_tree
from fabfold.tree.solve import solve
from fabfold.tree.system import HingeSystem, hinge_system
from fabfold.tree.template_parts import restrict_to_parts
from fabfold.voxels.mesh_template import template_of_solid

BOOK = """
name = "book"
[[box]]
from = [0, 0, 0]
to = [8, 2, 1]
[[fold]]
from = [4, 0, 1]
to = [4, 2, 1]
angle = -180
moves = { from = [4, 0, 0], to = [8, 2, 1] }
"""


def written(folder, text, name="mine.toml"):
    path = folder / name
    path.write_text(text)
    return str(path)


def blocks(*boxes):
    """Solid of axis-parallel boxes that touch nowhere but in whole faces, as one mesh."""
    import manifold3d

    whole = manifold3d.Manifold()
    for low, high in boxes:
        size = np.array(high, dtype=float) - low
        whole += manifold3d.Manifold.cube(tuple(size)).translate(tuple(float(x) for x in low))
    mesh = whole.to_mesh64()
    vertices = np.array(mesh.vert_properties)[:, :3]
    return Solid("blocks", vertices, np.array(mesh.tri_verts, np.int32))


def write_stl(path, solid):
    trimesh.Trimesh(solid.vertices, solid.faces, process=False).export(path)
    return path


# --- files ------------------------------------------------------------------------------------


def test_blocks_are_added_and_removed(tmp_path):
    ring = load_template(
        written(
            tmp_path,
            "[[box]]\nfrom = [5, 5, 5]\nto = [8, 8, 6]\n[[box]]\nfrom = [8, 5, 5]\nto = [9, 6, 6]\n"
            "[[remove]]\nfrom = [6, 6, 5]\nto = [7, 7, 6]\n",
        )
    )
    assert ring.name == "mine"
    assert len(ring) == 9
    assert ring.shape == (4, 3, 1)
    assert [1, 1, 0] not in ring.cells.tolist()


def test_shipped_templates_are_what_their_names_say():
    for name in template_names():
        template = load_template(name)
        assert template.name == name
        assert len(template) == int(name.rsplit("-", 1)[1])
    hollow = load_template("hollow-56")
    assert not hollow.occupancy()[1:3, 1:3, 1:3].any()
    assert load_template("sheet-64").shape == (8, 8, 1)


@pytest.mark.parametrize(
    ("text", "where"),
    [
        ("cells = [[0, 0, 0], [2, 0, 0]]", "2 pieces"),
        ("cells = [[0, 0, 0], [0, 0, 0]]", r"cells\[1\]"),
        ("cells = [[0, 0, 0], [0, 0, 0.5]]", r"cells\[1\]: wants three whole numbers"),
        ("layers = [['##'], ['#x']]", r"layers\[1\]\[0\]"),
        ("layers = [['##'], 3]", r"layers\[1\]"),
        ("[[box]]\nfrom = [0, 0, 0]\nto = [0, 1, 1]", r"box\[0\]"),
        ("[[box]]\nfrom = [0, 0, 0]", r"box\[0\]"),
        ("[[box]]\nfrom = [0, 0, 0]\nto = [900, 1, 1]", r"box\[0\]: 900 cells"),
        ("[[box]]\nfrom=[0,0,0]\nto=[2,2,2]\n[[remove]]\nfrom=[5,5,5]\nto=[6,6,6]", r"remove\[0\]"),
        ("cells = [[0, 0, 0]]\n[[remove]]\nfrom = [0, 0, 0]\nto = [1, 1, 1]", "remove: goes with"),
        ("cells = [[0, 0, 0]]\nlayers = [['#']]", "cells and layers"),
        ("name = 3\ncells = [[0, 0, 0]]", "name"),
        ("cells = [[0, 0, 0]\n", "line 2|end of document"),
        (BOOK.replace("angle = -180", "angle = 45"), r"fold\[0\].angle"),
        (BOOK.replace("to = [4, 2, 1]", "to = [4, 2, 0]"), r"fold\[0\]: from and to"),
        (BOOK.replace("from = [4, 0, 1]\nto = [4, 2, 1]", "from=[3,0,1]\nto=[3,2,1]"), "hinge"),
        (BOOK.replace("from = [4, 0, 0], to = [8", "from = [0, 0, 0], to = [8"), "not all"),
        (BOOK + "[[fold]]\nfrom=[4,0,0]\nto=[4,2,0]\nmoves={from=[4,0,0],to=[8,2,1]}", "parts"),
    ],
)
def test_what_is_wrong_is_told_with_file_and_field(tmp_path, text, where):
    path = written(tmp_path, text)
    with pytest.raises(TemplateError, match=where) as caught:
        load_template(path)
    assert "mine.toml" in str(caught.value)


def test_a_changed_file_is_read_again(tmp_path):
    path = written(tmp_path, "cells = [[0, 0, 0]]")
    assert len(load_template(path)) == 1
    written(tmp_path, "cells = [[0, 0, 0], [1, 0, 0]]")
    assert len(load_template(path)) == 2


# --- templates that fold once more ----------------------------------------------------------------


@pytest.mark.parametrize("name", ["book-64", "map-48"])
def test_shipped_folding_templates_fold_into_a_box_without_collision(name):
    template = load_template(name)
    parts = parts_of(template)
    folded = folded_template(template)
    assert folded.name.startswith("box-")
    assert len(folded) == len(template)
    # The parts as bodies, each on one edge of its crease: they must turn one after the other.
    point2, parent, axis, turns = [], [], [], []
    for part in range(1, len(parts.above)):
        crease = template.creases[parts.crease[part]]
        along = int(np.flatnonzero(np.array(crease.start) != crease.end)[0])
        at = 2 * np.array(crease.start) - 1
        at[along] += 1
        point2.append(at)
        parent.append(parts.above[part])
        axis.append(along)
        sign = np.sign(crease.end[along] - crease.start[along])
        turns.append(sign * crease.angle_deg // 90)
    system = HingeSystem(
        template.cells.copy(),
        parts.part,
        np.array(parent, np.int32),
        np.array(point2, np.int32),
        np.array(axis, np.int8),
        np.array(turns, np.int8),
    )
    order = sorted(range(len(turns)), key=lambda h: parts.crease[h + 1])
    path = np.array([(h, turns[h]) for h in order])
    assert count_free_moves(system, path) == len(path)


@pytest.mark.slow
def test_a_model_folds_into_the_flat_template_and_then_shut(tmp_path):
    template = load_template(written(tmp_path, BOOK))
    problem = solid_problem(strip(16), written(tmp_path, BOOK))
    ready = restrict_to_parts(problem, 3, np.zeros((16, 6)))
    found = []
    for seed in range(6):
        found += solve(ready, seed, LatticeFoldability(), Effort(polish_best=20))
        folded = [add_crease_hinges(candidate, template) for candidate in found]
        shut = [c for c in folded if c is not None]
        if shut:
            break
    tree = shut[0].tree
    assert check_tree(tree) == []
    assert tree.template.name == "box-4x2x2"
    motion = motion_of(tree, shut[0].path)
    assert end_pose_error(tree, motion.angles_deg[-1]) < 1e-9
    assert count_free_moves(hinge_system(tree), shut[0].path) == len(shut[0].path)
    # The crease's hinge rests until all the others are done; then the whole lies flat.
    crease, quarters = shut[0].path[-1].tolist()
    assert abs(quarters) == 2
    assert crease not in shut[0].path[:-1, 0]
    poses = tree.body_poses(motion.angles_deg[-2])[tree.voxel_body]
    flat = np.einsum("nij,nj->ni", poses[:, :3, :3], tree.source) + poses[:, :3, 3]
    assert sorted(np.ptp(np.rint(flat), axis=0).astype(int).tolist()) == [0, 1, 7]
    kit = Joinery((), 20.0, (0.0, 0.0, 0.0), 0.3, 2.5, 1.5, 3)
    laid = flat_poses(kit, tree, motion, template)[tree.voxel_body]
    flat = np.einsum("nij,nj->ni", laid[:, :3, :3], 20.0 * tree.source) + laid[:, :3, 3]
    assert np.ptp(flat, axis=0).round(6).tolist() == [140.0, 20.0, 0.0]
    assert (np.linalg.det(laid[:, :3, :3]) > 0).all()
    # Nothing else joins the two halves.
    half = tree.target[:, 2] == tree.target[0, 2]
    crossing = [edge for edge in tree.edges if half[edge.parent] != half[edge.child]]
    assert [edge.hinges for edge in crossing] == [(crease,)]


def test_hinges_that_meet_only_when_the_template_is_shut_clash(tmp_path):
    thick = BOOK.replace("2, 1]", "2, 2]").replace("0, 1]", "0, 2]")
    template = load_template(written(tmp_path, thick))
    parts = parts_of(template)
    cells = [(x, y, z) for x in range(4) for y in range(4) for z in range(2)]
    problem = solid_problem(cells, written(tmp_path, thick))
    ready = restrict_to_parts(problem, 3, np.zeros((32, 6)))
    met = 0
    for pose in islice(grow(ready, 1), 10):
        choice = hinge_choice(ready, pose)
        at = choice.rows["u"]
        local = choice.rows["edge_a"] / 2.0 - problem.source[at]
        flat = template.cells[pose[at] // 24]
        flat = flat + np.einsum("kij,kj->ki", ROTATIONS[pose[at] % 24], local)
        turn = parts.poses[parts.part[pose[at] // 24]]
        shut = np.einsum("kij,kj->ki", turn[:, :3, :3], flat) + turn[:, :3, 3]
        same = (np.abs(shut[:, None] - shut) < 1e-9).all(axis=2)
        number = choice.rows["edge_b"]
        assert ((number[:, None] == number).all(axis=2) == same).all()
        met += int((same & (np.abs(flat[:, None] - flat) > 1e-9).any(axis=2)).sum())
    assert met > 0


@pytest.mark.slow
def test_voxels_that_cannot_be_shared_out_are_refused(tmp_path):
    problem = solid_problem(strip(16), written(tmp_path, BOOK), hinge=np.zeros((15, 4), bool))
    with pytest.raises(NoTreeError, match="8 \\+ 8 cells"):
        restrict_to_parts(problem, 0, np.zeros((16, 6)))


# --- meshes --------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_mesh_of_blocks_becomes_exactly_its_blocks():
    u = blocks(((0, 0, 0), (12, 8, 4)), ((0, 0, 4), (4, 8, 12)), ((8, 0, 4), (12, 8, 12)))
    template = template_of_solid(u)
    assert (len(template), template.shape) == (112, (6, 4, 6))
    assert template.colours == (56, 56)
    assert not template.occupancy()[2:4, :, 2:].any()
    assert len(template_of_solid(u, 14)) == 14


@pytest.mark.slow
def test_the_number_of_cells_is_met_about():
    box = blocks(((0, 0, 0), (30, 20, 11)))
    for wanted in (27, 100, 400):
        assert abs(len(template_of_solid(box, wanted)) - wanted) <= 0.1 * wanted + 1


def test_a_mesh_that_cells_cannot_show_is_refused():
    thin = blocks(((0, 0, 0), (100, 100, 0.5)))
    with pytest.raises(TemplateError, match="ask for more cells"):
        template_of_solid(thin, 8)


def test_a_number_of_cells_needs_a_mesh(tmp_path):
    with pytest.raises(RecipeError, match="template_cells"):
        load_target("box-4x4x4", None, 60)


# --- kits --------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["toml", "stl"])
def test_a_kit_makes_itself_again_without_the_files_it_came_from(tmp_path, kind):
    from fabfold.kit.kit import open_kit

    solid = blocks(((0, 0, 0), (4, 2, 2)))
    model = write_stl(tmp_path / "bar.stl", solid)
    if kind == "toml":
        target = tmp_path / "target.toml"
        written(tmp_path, "[[box]]\nfrom = [0, 0, 0]\nto = [2, 2, 4]\n", "target.toml")
        more = {}
    else:
        target = write_stl(tmp_path / "target.stl", solid)
        more = {"template_cells": 16}
    options = {"rotation": (0, 0, 0), "origin": (0.5, 0.5, 0.5), "pitch": 1.0, **more}
    kit = open_kit(str(model), folder=tmp_path / "kit", template=str(target), **options)
    first = kit.voxelize()
    model.unlink()
    target.unlink()
    again = open_kit(str(tmp_path / "kit"))
    assert again.recipe == kit.recipe
    assert again.recipe.template == target.name
    moved = (tmp_path / "kit").rename(tmp_path / "elsewhere")
    (moved / "stages" / "journal.json").unlink(missing_ok=True)
    assert [len(v) for v in open_kit(str(moved)).voxelize()] == [len(v) for v in first]


def test_missing_template_files_are_named(tmp_path):
    with pytest.raises(TemplateError, match=r"gone\.toml"):
        named_target(str(tmp_path / "gone.toml"))
    with pytest.raises(ModelError, match="digest 0123"):
        find_input("gone.stl", "0123" * 16, tmp_path, "template")


def test_blocks_are_bounded_before_they_are_filled(tmp_path):
    blocks = "".join(
        f"[[box]]\nfrom = [{64 * k}, 0, 0]\nto = [{64 * k + 64}, 64, 64]\n" for k in range(60)
    )
    path = tmp_path / "huge.toml"
    path.write_text(blocks)
    with pytest.raises(TemplateError, match="they span 3840 cells along an axis"):
        read_template(path)
    path.write_text("[[box]]\nfrom = [0, 0, 0]\nto = [64, 64, 64]\n" * 60)
    with pytest.raises(TemplateError, match="262144 cells, 64 along an axis"):
        read_template(path)
    hollow = "[[box]]\nfrom = [0, 0, 0]\nto = [20, 20, 20]\n"
    hollow += "[[remove]]\nfrom = [1, 1, 1]\nto = [19, 19, 19]\n"
    path.write_text(hollow)
    assert len(read_template(path)) == 20**3 - 18**3


def test_every_wrong_key_of_a_template_is_told_with_its_line(tmp_path):
    path = tmp_path / "wrong.toml"
    path.write_bytes(
        b'\xef\xbb\xbfnam = 3\njoints = "all"\n[[boxx]]\nfrom = [0, 0, 0]\nto = [1, 1, 1]\n'
    )
    with pytest.raises(TemplateError) as caught:
        read_template(path)
    told = str(caught.value)
    for words in (
        "line 1: nam is no key; did you mean name?",
        "line 2: joints: wants",
        "line 3: boxx is no key; did you mean box?",
        "one of cells, layers or [[box]], found none",
    ):
        assert words in told, told
