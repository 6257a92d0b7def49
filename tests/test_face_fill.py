"""Plates that close open faces of the box."""

from __future__ import annotations

import manifold3d
import numpy as np
import pytest

from fabfold.errors import RecipeError
from fabfold.joinery.face_fill import (
    FaceFill,
    covered_faces,
    plate_before,
    with_filled_faces,
)
from fabfold.lattice.rotations import FACES
from fabfold.lattice.shipped import load_template
from fabfold.printing.print_mode import print_mode
from fabfold.printing.profiles import load_profile

SIDE, INSET, WALL = 20.0, 0.25, 0.8


@pytest.fixture(scope="module")
def tree(bar_kit):
    return bar_kit.fold().tree


def test_covered_faces_are_between_voxels_in_a_and_outside_in_b(tree):
    faces = covered_faces(tree)
    assert len(faces)
    model = {tuple(c) for c in tree.source.tolist()}
    box = {tuple(c) for c in tree.target.tolist()}
    # Eight cells in a row have 14 sides between them; a rigid contact stays inside the box.
    hinged = sum(len(h_pair) for h_pair in [[h.parent, h.child] for h in tree.hinges])
    assert len(faces) == hinged
    for voxel, face in faces:
        assert tuple((tree.source[voxel] + FACES[face]).tolist()) in model
        outward = tree.orientation[voxel] @ FACES[face]
        assert tuple((tree.target[voxel] + outward).tolist()) not in box


def test_a_hollow_face_gets_a_plate_and_a_full_one_does_not(tree):
    """The model is a thin rod along the cells: every covered face is open but for its middle."""
    length = SIDE * (np.ptp(tree.source, axis=0) + 1)
    thin = np.where(length > SIDE, length, 4.0)
    middle = SIDE * (tree.source.min(axis=0) + tree.source.max(axis=0)) / 2
    rod = manifold3d.Manifold.cube(thin.tolist(), True).translate(middle.tolist())
    faces = covered_faces(tree)
    depth = np.zeros((len(tree.source), 6))
    same, fill = with_filled_faces(rod, tree, depth, voxel_mm=SIDE, inset_mm=INSET, wall_mm=WALL)
    assert fill.faces == 0
    assert same.volume() == pytest.approx(rod.volume())
    depth[:] = 0.96
    model, fill = with_filled_faces(rod, tree, depth, voxel_mm=SIDE, inset_mm=INSET, wall_mm=WALL)
    assert (fill.faces, fill.left_open) == (len(faces), 0)
    plate = (2 * (SIDE / 2 - INSET)) ** 2 - 16.0
    assert fill.added_mm3 == pytest.approx(len(faces) * plate * (WALL + 0.01), rel=1e-9)
    assert fill.after - fill.before == pytest.approx(0.96 * len(faces) / 24)
    # Each plate ends half a gap before its face: nothing stands in the gap itself.
    for voxel, face in faces:
        centre = SIDE * tree.source[voxel] + FACES[face] * (SIDE / 2 - INSET / 2)
        size = np.where(FACES[face] == 0, SIDE, INSET)
        slab = manifold3d.Manifold.cube(size.tolist(), True).translate(centre.tolist())
        assert (slab ^ (model - rod)).volume() < 1e-6


def test_a_face_with_nothing_behind_it_stays_open(tree):
    crumb = manifold3d.Manifold.cube((0.1, 0.1, 0.1), True)
    depth = np.ones((len(tree.source), 6))
    _, fill = with_filled_faces(crumb, tree, depth, voxel_mm=SIDE, inset_mm=INSET, wall_mm=WALL)
    assert (fill.faces, fill.added_mm3) == (0, 0.0)
    assert fill.left_open == len(covered_faces(tree))


def test_the_plate_before_a_hollow_stays_away(tree):
    """The plate that is nearest to a point of its own body, until none is left near it."""
    depth = np.ones((len(tree.source), 6))
    voxel, face = covered_faces(tree)[0].tolist()
    body = next(i for i, found in enumerate(tree.bodies) if voxel in found.voxels)
    inside = tree.source[voxel] + 0.4 * FACES[face]
    assert plate_before(tree, depth, body, inside, ()) == (voxel, face)
    assert plate_before(tree, depth, body, inside + 1.2 * FACES[face], ()) is None
    others = {tuple(plate) for plate in covered_faces(tree).tolist() if plate[0] == voxel}
    assert plate_before(tree, depth, body, inside, others - {(voxel, face)}) == (voxel, face)
    assert plate_before(tree, 0.0 * depth, body, inside, ()) is None
    assert plate_before(tree, depth, body + 1, inside, ()) != (voxel, face)
    crowd = manifold3d.Manifold.cube((200.0, 200.0, 200.0), True)
    sizes = {"voxel_mm": SIDE, "inset_mm": INSET, "wall_mm": WALL}
    _, whole = with_filled_faces(crowd, tree, depth, **sizes)
    _, fill = with_filled_faces(crowd, tree, depth, **sizes, without={(voxel, face)})
    assert (fill.faces, fill.unshut) == (whole.faces - 1, 1)
    assert fill.after == pytest.approx(whole.after - 1 / 24)
    assert fill.note(WALL, 1.0).endswith(
        "; 1 stay open so that powder comes out of a hollow behind"
    )


def test_where_it_means_nothing_it_is_refused():
    profile = load_profile("mjf-pa12")
    with pytest.raises(RecipeError, match="no open faces"):
        print_mode(profile, fill=True, blocks=True)
    mode = print_mode(profile, fill=True)
    mode.require_template(load_template("box-4x4x4"))
    with pytest.raises(RecipeError, match="'book-64' folds once more"):
        mode.require_template(load_template("book-64"))


def test_the_note_says_faces_grams_and_shares():
    fill = FaceFill(12, 3, 4000.0, 0.61, 0.84)
    assert fill.note(0.8, 1.25) == (
        "12 open faces of the box have plates of 0.8 mm, 5.0 g in all: it is closed to 84 % "
        "instead of 61 %; 3 more have no material to hold one"
    )
