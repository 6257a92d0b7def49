"""What joints voxels can carry, and voxels on disk."""

import numpy as np
import pytest
from voxel_cases import material_voxels

from fabfold.errors import KitError
from fabfold.lattice.rotations import FACES
from fabfold.voxels.features import contact_counts, face_pairs, features, largest_pieces
from fabfold.voxels.voxel_files import load_voxels, save_voxels
from fabfold.voxels.voxel_model import Voxels

PAIRS = [[(0, 0, 0), (1, 0, 0)], [(0, 0, 0), (0, 1, 0)], [(0, 0, 0), (0, 0, 1)]]


def test_pairs_are_the_faces_that_cells_share():
    cells = np.array([[0, 0, 0], [0, 0, 1], [0, 1, 1], [1, 0, 1], [2, 0, 0]], dtype=np.int32)
    assert face_pairs(cells).tolist() == [[0, 1], [1, 2], [1, 3]]


@pytest.mark.parametrize("cells", PAIRS)
def test_two_full_cubes_carry_every_joint(cells):
    found = features(material_voxels(cells))
    assert found.rigid.all()
    assert found.hinge.all()
    assert found.double.all()
    assert found.depth.tolist() == [[0.0] * 6] * 2


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("edge", range(4))
def test_a_wall_along_one_edge_holds_that_hinge_only(axis, edge):
    directions = [d for d in FACES if d[axis] == 0]
    direction = directions[edge]
    across = int(np.argmax(np.abs(direction)))
    material = np.zeros((2, 20, 20, 20), dtype=bool)
    wall = [slice(None)] * 4
    wall[across + 1] = slice(17, 20) if direction[across] > 0 else slice(0, 3)
    material[tuple(wall)] = True
    found = features(material_voxels(PAIRS[axis], material))
    # The wall is 3 deep: it carries its own edge along its whole length, and the ends of the
    # two edges across it, at 3 positions of 20 each: too short.
    assert found.hinge[0].tolist() == [i == edge for i in range(4)]
    assert found.double[0]


def test_hinge_wants_material_on_both_sides_and_a_third_of_the_edge():
    material = np.zeros((2, 20, 20, 20), dtype=bool)
    material[0] = True
    material[1, :3, :, :6] = True
    found = features(material_voxels(PAIRS[0], material))
    # Edges +y, -y, +z, -z of a face across x.
    assert found.hinge[0].tolist() == [True, True, False, True]
    material[1, :, :, 5] = False
    found = features(material_voxels(PAIRS[0], material))
    assert found.hinge[0].tolist() == [False, False, False, True]


def test_contact_needs_material_on_both_sides():
    material = np.zeros((2, 20, 20, 20), dtype=bool)
    material[0, :, :10] = True
    material[1, :, 9:] = True
    found = features(material_voxels(PAIRS[0], material))
    assert found.rigid.tolist() == [True]
    assert found.double.tolist() == [False]
    material[1, :, 9, 0] = False
    found = features(material_voxels(PAIRS[0], material))
    assert found.rigid.tolist() == [False]


def test_a_second_leg_in_a_cell_holds_nothing():
    material = np.zeros((2, 20, 20, 20), dtype=bool)
    material[0, :, :8] = True
    material[0, :, 15:] = True  # the second, smaller leg
    material[1, :, 15:] = True
    found = features(material_voxels(PAIRS[0], material))
    assert not found.rigid[0]
    assert not found.hinge.any()
    assert not found.double.any()


def test_the_largest_piece_is_found_within_each_cell():
    material = np.zeros((4, 20, 20, 20), dtype=bool)
    material[0] = True
    material[1, 0, 0, 0] = material[1, 1, 1, 1] = True  # touch at a corner only
    material[2, ::2] = True
    main = largest_pieces(material)
    assert main.sum(axis=(1, 2, 3)).tolist() == [8000, 1, 400, 0]
    assert main[1, 0, 0, 0]
    assert not main[~material].any()


@pytest.mark.parametrize("axis", range(3))
def test_contacts_are_counted_across_the_shared_face(axis):
    cells = np.array(PAIRS[axis], dtype=np.int32)
    material = np.random.default_rng(axis).random((2, 20, 20, 20)) < 0.5
    first, second = material[0].take(-1, axis), material[1].take(0, axis)
    assert contact_counts(cells, face_pairs(cells), material).tolist() == [(first & second).sum()]


def test_depth_is_the_mean_ray_to_the_first_material():
    material = np.zeros((1, 20, 20, 20), dtype=bool)
    material[0, 4:10, :, :10] = True
    depth = features(material_voxels([(0, 0, 0)], material)).depth[0]
    # Through x, half of the rays meet the slab; the others run through.
    assert depth[0] == pytest.approx(0.5 * 10 / 20 + 0.5)
    assert depth[1] == pytest.approx(0.5 * 4 / 20 + 0.5)
    filled = (6 * 10) / 400
    assert depth[2] == pytest.approx(1 - filled)
    assert depth[3] == pytest.approx(1 - filled)
    assert depth[4] == pytest.approx(0.3 * 0.5 + 0.7)
    assert depth[5] == pytest.approx(0.3 * 0.0 + 0.7)


def test_one_voxel_has_no_pairs():
    found = features(material_voxels([(0, 0, 0)]))
    assert found.pairs.shape == (0, 2)
    assert found.hinge.shape == (0, 4)


def same(one: Voxels, other: Voxels) -> bool:
    arrays = ("cells", "subvoxels", "fill", "vertices", "faces", "rotation", "origin")
    return (
        all(
            np.array_equal(getattr(one, name), getattr(other, name))
            and getattr(one, name).dtype == getattr(other, name).dtype
            for name in arrays
        )
        and all(map(np.array_equal, one.plane_offsets, other.plane_offsets))
        and (one.pitch, one.lost_volume, one.energy)
        == (other.pitch, other.lost_volume, other.energy)
    )


def test_voxels_come_back_from_disk_and_bytes_repeat(tmp_path):
    material = np.random.default_rng(0).random((3, 20, 20, 20)) < 0.3
    voxels = material_voxels([(0, 0, 0), (0, 0, 1), (2, 1, 0)], material)
    save_voxels(tmp_path / "a.npz", voxels)
    save_voxels(tmp_path / "b.npz", voxels)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    assert same(load_voxels(tmp_path / "a.npz"), voxels)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.npz", "b.npz"]


@pytest.mark.parametrize("content", [b"", b"not a zip", b"PK\x03\x04broken"])
def test_a_damaged_file_is_named(tmp_path, content):
    path = tmp_path / "voxels.npz"
    path.write_bytes(content)
    with pytest.raises(KitError, match=r"voxels\.npz"):
        load_voxels(path)


def test_a_truncated_file_and_a_foreign_npz_are_refused(tmp_path):
    path = tmp_path / "voxels.npz"
    save_voxels(path, material_voxels([(0, 0, 0)]))
    path.write_bytes(path.read_bytes()[:300])
    with pytest.raises(KitError):
        load_voxels(path)
    np.savez(path, cells=np.zeros((1, 3)))
    with pytest.raises(KitError):
        load_voxels(path)
    with pytest.raises(KitError):
        load_voxels(tmp_path / "missing.npz")
