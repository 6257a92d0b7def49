"""Hollows that powder and resin do not come out of: found, measured, and told."""

from dataclasses import replace

import manifold3d
import numpy as np
import pytest
import trimesh
from export_kits import row_joinery, row_motion, row_tree
from scipy import ndimage

from fabfold.joinery.bodies import BodyMesh
from fabfold.joinery.cells import solids_of
from fabfold.printing.body_checks import check_bodies
from fabfold.printing.chambers import _within, find_chambers
from fabfold.printing.file_checks import check_file
from fabfold.printing.print_pose import print_pose
from fabfold.printing.profiles import load_profile
from fabfold.progress import SilentProgress

MJF, SLS, PLA = (load_profile(name) for name in ("mjf-pa12", "sls-pa12", "fdm-pla-0.4"))
NAME = "chambers with no way out"


def block(low, high):
    size = np.subtract(high, low).astype(float)
    return manifold3d.Manifold.cube(tuple(size)).translate(tuple(map(float, low)))


def bored(hole, *, holes=1, turn=(0.0, 0.0, 0.0)):
    """A cube of 24 mm with a hollow of 12 mm and holes of a diameter through its top."""
    solid = block((0, 0, 0), (24, 24, 24)) - block((6, 6, 6), (18, 18, 18))
    for index in range(holes):
        drill = manifold3d.Manifold.cylinder(10.0, hole / 2, hole / 2, 48)
        solid -= drill.translate((9.0 + 5.0 * index, 11.0, 16.0))
    return solid.rotate(turn)


def body(solid, name="body-00"):
    mesh = solid.to_mesh64()
    points = np.array(mesh.vert_properties)[:, :3].astype(float)
    return BodyMesh(name, points, np.array(mesh.tri_verts, dtype=np.int32))


@pytest.mark.slow
@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), (31.0, 17.0, 8.0)])
def test_a_hollow_is_a_chamber_where_the_ball_does_not_pass_its_hole(turn):
    (chamber,) = find_chambers([body(bored(1.6, turn=turn))], 2.0)
    # The ball does not reach into the edges and corners of the hollow.
    edges = 12 * (1 - np.pi / 4) * 1.0**2 * 10.0
    assert chamber.volume_mm3 == pytest.approx(12.0**3 - edges, rel=0.05)
    middle = manifold3d.Manifold.cube((1.0, 1.0, 1.0)).translate((11.5, 11.5, 11.5)).rotate(turn)
    low, high = np.reshape(middle.bounding_box(), (2, 3))
    assert chamber.middle_mm == pytest.approx((low + high) / 2, abs=0.2)
    assert find_chambers([body(bored(2.4, turn=turn))], 2.0) == []


@pytest.mark.slow
def test_two_narrow_holes_are_no_wide_one_and_a_bent_way_counts():
    assert len(find_chambers([body(bored(1.6, holes=2))], 2.0)) == 1
    bent = block((0, 0, 0), (24, 24, 24)) - block((6, 6, 6), (18, 18, 18))
    bent -= block((10, 10, 17), (13, 13, 22)) + block((10, 10, 19), (13, 30, 22))
    assert find_chambers([body(bent)], 2.0) == []
    # The same way with a place of 1.5 mm in it.
    narrow = bent + block((9, 20, 18), (14, 22, 20.5))
    assert len(find_chambers([body(narrow)], 2.0)) == 1


def test_gaps_and_nooks_that_the_ball_does_not_fit_are_no_chambers():
    slot = block((0, 0, 0), (24, 24, 24)) - block((6, 11.5, 6), (18, 12.3, 30))
    assert find_chambers([body(slot)], 2.0) == []
    assert find_chambers([body(block((0, 0, 0), (24, 24, 24)))], 3.5) == []


@pytest.mark.slow
def test_thin_walls_keep_powder_in():
    can = block((0, 0, 0), (20, 20, 20)) - block((0.5, 0.5, 0.5), (19.5, 19.5, 19.5))
    assert len(find_chambers([body(can)], 2.0)) == 1


def test_the_larger_way_of_laser_sintering_is_asked_for(tmp_path):
    part = trimesh.Trimesh(*_arrays(bored(2.6)), process=False)
    part.export(tmp_path / "part.stl")

    def checked(profile):
        found = check_file(tmp_path / "part.stl", profile, SilentProgress())
        return {check.name: check for check in found}

    assert checked(MJF)[NAME].ok
    assert NAME not in checked(PLA)
    sls = checked(SLS)[NAME]
    assert not sls.ok
    assert (sls.figure, sls.limit) == (1.0, 0.0)
    assert "narrower than 3.5 mm" in sls.note
    assert "in part-01 around 12, 12, 12" in sls.note


def _arrays(solid):
    made = body(solid)
    return made.vertices, made.faces


@pytest.mark.slow
def test_chambers_between_parts_are_told_and_no_fault(tmp_path):
    cup = block((0, 0, 0), (24, 24, 20)) - block((4, 4, 4), (20, 20, 30))
    lid = block((0, 0, 20.5), (24, 24, 24))
    meshes = [trimesh.Trimesh(*_arrays(solid), process=False) for solid in (cup, lid)]
    trimesh.util.concatenate(meshes).export(tmp_path / "cup.stl")
    found = check_file(tmp_path / "cup.stl", MJF, SilentProgress())
    check = next(check for check in found if check.name == NAME)
    assert check.ok
    told = float(check.note.split(" mm³ between parts")[0].split()[-1])
    assert told == pytest.approx(16.0 * 16.0 * 16.5, rel=0.05)


@pytest.mark.slow
def test_a_kit_whose_body_is_hollow_fails():
    tree, joinery = row_tree(), row_joinery(row_tree(), bump=False)
    motion = row_motion(tree)
    middle = np.array(joinery.origin_mm)
    hollow = manifold3d.Manifold.cube((8.0, 8.0, 8.0), True).translate(tuple(middle))
    drill = manifold3d.Manifold.cylinder(30.0, 0.7, 0.7, 32).translate(tuple(middle))
    cut = solids_of(joinery.bodies)[0] - hollow - drill
    broken = replace(joinery, bodies=(body(cut), *joinery.bodies[1:]))

    def checked(kit):
        pose = print_pose(tree, motion, kit, MJF, "a")
        found = check_bodies(kit, tree, motion, MJF, pose=pose)
        return next(check for check in found if check.name == NAME)

    assert checked(joinery).ok
    check = checked(broken)
    assert not check.ok
    assert check.figure == 1.0
    assert "in body-00 around 1" in check.note
    told = float(check.note.split(" mm³")[0])
    assert told == pytest.approx(512.0, rel=0.1)


@pytest.mark.parametrize("radius", [0.4, 1.0, 1.5, 4.37, 5.0, 12.2])
def test_the_reach_of_a_ball_is_that_of_the_exact_distance(radius):
    cells = np.random.default_rng(0).random((30, 24, 18)) < 0.003
    distance = ndimage.distance_transform_edt(~cells)
    assert (_within(cells, radius) == (distance <= radius)).all()
    assert (_within(cells, radius, short=True) == (distance < radius)).all()
