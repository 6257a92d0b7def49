import numpy as np
import pytest

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


def test_rotations_are_the_rotation_group_of_the_cube():
    assert len({r.tobytes() for r in ROTATIONS}) == 24
    assert (np.rint(np.linalg.det(ROTATIONS)) == 1).all()
    assert (ROTATIONS[0] == np.eye(3)).all()
    for a in range(24):
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
