import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fabfold.errors import TemplateError
from fabfold.lattice.rotations import (
    FACE_BEFORE,
    FACES,
    ROTATION_INVERSE,
    ROTATION_PRODUCT,
    ROTATIONS,
    parity,
    rotation_about,
    rotation_index,
)
from fabfold.lattice.shipped import load_template, template_names
from fabfold.lattice.template import Template

#: The same examples every time, few, and no clock.
same = settings(derandomize=True, deadline=None, database=None, max_examples=40)
cells = st.lists(st.tuples(*[st.integers(-5, 5)] * 3), min_size=1, max_size=40).map(
    lambda found: np.array(found, dtype=np.int32)
)
points = arrays(float, 3, elements=st.floats(-100, 100))
directions = points.filter(lambda direction: np.linalg.norm(direction) > 0.1)
angles = st.floats(-720, 720)


def test_rotations_are_the_rotation_group_of_the_cube():
    assert len({r.tobytes() for r in ROTATIONS}) == 24
    assert (np.rint(np.linalg.det(ROTATIONS)) == 1).all()
    assert (ROTATIONS[0] == np.eye(3)).all()
    assert (ROTATIONS[ROTATION_PRODUCT] == ROTATIONS[:, None] @ ROTATIONS[None]).all()
    for a in range(24):
        assert rotation_index(ROTATIONS[a]) == a
        assert ROTATION_PRODUCT[a, ROTATION_INVERSE[a]] == 0
        assert sorted(ROTATION_PRODUCT[a]) == list(range(24))


def test_opposite_faces_differ_in_the_last_bit():
    for f in range(6):
        assert (FACES[f] == -FACES[f ^ 1]).all()


def test_rotations_carry_the_face_before_to_the_face():
    for r, rotation in enumerate(ROTATIONS):
        assert (FACES[FACE_BEFORE[r]] @ rotation.T == FACES).all()


@pytest.mark.parametrize("angle", [-270, -180, -90, 0, 90, 180, 270, 450])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_quarter_turns_are_exact_lattice_rotations(axis, angle):
    turn = rotation_about(np.array([0.5, 0.0, 0.5]), np.eye(3)[axis], angle)
    assert (turn[:3, :3] == ROTATIONS[rotation_index(turn[:3, :3])]).all()


def test_rotation_about_keeps_the_axis_and_turns_right_handed():
    point, direction = np.array([1.0, 2.0, 3.0]), np.array([0.0, 0.0, 2.0])
    turn = rotation_about(point, direction, 30.0)
    on_axis = np.append(point + 5 * direction, 1.0)
    np.testing.assert_allclose(turn @ on_axis, on_axis, atol=1e-12)
    moved = turn @ np.array([2.0, 2.0, 3.0, 1.0])
    np.testing.assert_allclose(moved[:3], [1 + np.cos(np.pi / 6), 2.5, 3.0], atol=1e-12)


@pytest.mark.slow
@same
@given(points, directions, angles, angles)
def test_turns_about_one_line_add_up(point, direction, one, other):
    both = rotation_about(point, direction, one) @ rotation_about(point, direction, other)
    np.testing.assert_allclose(both, rotation_about(point, direction, one + other), atol=1e-9)


@same
@given(points, directions, angles)
def test_a_turn_moves_rigidly_and_back_about_the_opposite_line(point, direction, angle):
    turn = rotation_about(point, direction, angle)
    np.testing.assert_allclose(turn[:3, :3] @ turn[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(turn) == pytest.approx(1.0)
    back = rotation_about(point, -direction, angle)
    np.testing.assert_allclose(back @ turn, np.eye(4), atol=1e-9)


@same
@given(cells, st.tuples(*[st.integers(-50, 50)] * 3), st.randoms(use_true_random=False))
def test_a_template_does_not_depend_on_order_place_or_repeats(found, shift, random):
    order = list(range(len(found)))
    random.shuffle(order)
    template = Template("t", found)
    other = Template("t", np.concatenate([found[order], found[:1]]) + np.array(shift))
    assert (template.cells == other.cells).all()
    assert template.content == other.content
    assert template.shape == tuple((np.ptp(found, axis=0) + 1).tolist())


@same
@given(cells)
def test_cells_of_a_template_are_counted_alike_everywhere(found):
    template = Template("t", found)
    assert len(template) == len(np.unique(found, axis=0)) == sum(template.colours)
    grid = template.occupancy()
    assert grid.shape == template.shape
    assert (np.argwhere(grid) == template.cells).all()


@same
@given(cells, st.integers(0, 23))
def test_turned_cells_keep_number_colours_and_inside_edges(found, turn):
    template = Template("t", found)
    turned = Template("t", found @ ROTATIONS[turn].T)
    assert len(turned) == len(template)
    assert sorted(turned.colours) == sorted(template.colours)
    assert sorted(turned.shape) == sorted(template.shape)
    assert turned.inside_edges().sum() == template.inside_edges().sum()


def test_rotation_index_refuses_what_is_no_lattice_rotation():
    with pytest.raises(ValueError, match="not one of"):
        rotation_index(rotation_about(np.zeros(3), np.eye(3)[2], 45)[:3, :3])
    with pytest.raises(ValueError, match="not one of"):
        rotation_index(-np.eye(3))


def test_box_templates():
    box = load_template("box-3x4x4")
    assert len(box) == 48
    assert box.shape == (3, 4, 4)
    assert box.colours == (24, 24)
    assert load_template("box-3x3x3").colours == (14, 13)
    assert box.occupancy(pad=1).shape == (5, 6, 6)
    assert box.occupancy(pad=1).sum() == 48
    assert parity(box.cells).sum() == 24


def test_outer_faces_of_a_box():
    box = load_template("box-2x3x4")
    outer = box.outer_faces()
    assert outer.sum() == 2 * (2 * 3 + 2 * 4 + 3 * 4)
    for f, face in enumerate(FACES):
        axis = f // 2
        last = 0 if face.sum() < 0 else box.shape[axis] - 1
        assert (outer[:, f] == (box.cells[:, axis] == last)).all()


@pytest.mark.parametrize("name", ["box-0x4x4", "box-99x99x99", "box-4x4", "nonsense", "a/b.toml"])
def test_unknown_templates_are_refused_by_name(name):
    with pytest.raises(TemplateError, match="template"):
        load_template(name)


def test_template_files(tmp_path):
    good = tmp_path / "u.toml"
    good.write_text('name = "u"\nlayers = [["###", "#.#"], ["###", "#.#"]]\n')
    u = load_template(str(good))
    assert (u.name, len(u), u.shape) == ("u", 10, (3, 2, 2))
    cells = tmp_path / "cells.toml"
    cells.write_text("cells = [[5, 5, 5], [6, 5, 5]]\n")
    assert load_template(str(cells)).cells.tolist() == [[0, 0, 0], [1, 0, 0]]


@pytest.mark.parametrize(
    "text",
    [
        "name = 'x'",
        "cells = 3",
        "cells = [[1, 2]]",
        "cells = [[0.5, 0, 0]]",
        "layers = 'abc'",
        "layers = [['..']]",
        "colour = 'red'\ncells = [[0, 0, 0]]",
        "not toml at all",
    ],
)
def test_broken_template_files_name_the_file(tmp_path, text):
    path = tmp_path / "broken.toml"
    path.write_text(text)
    with pytest.raises(TemplateError, match="template"):
        load_template(str(path))


def test_every_shipped_template_loads_in_one_piece():
    from scipy.ndimage import label

    for name in template_names():
        template = load_template(name)
        assert label(template.occupancy())[1] == 1, name


def test_a_template_is_moved_to_the_origin_and_made_unique():
    template = Template("t", np.array([[2, 2, 2], [2, 2, 2], [3, 2, 2]]))
    assert template.cells.tolist() == [[0, 0, 0], [1, 0, 0]]
    with pytest.raises(TemplateError, match="no cells"):
        Template("none", np.zeros((0, 3)))
