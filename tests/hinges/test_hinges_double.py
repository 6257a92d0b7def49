"""The double hinge as a build123d part, and both kinds as meshes for joinery."""

import numpy as np
import pytest
from build123d import Box, BuildPart, Mode, Pos
from hinge_measure import boxes_apart, gap, overlap

from hinges import DoubleHinge, DoubleHingeCarve, DoubleHingePart, HingeError
from hinges.mesh import double_hinge_meshes, single_hinge_meshes
from hinges.plan_double import DoubleSpec, child_pose, plan_double

EDGE_PAIRS = [("+y", "-y"), ("+y", "+z"), ("-z", "+y"), ("-z", "-z")]


def shells_apart(one, other):
    return one.solid().shells()[0].distance_to(other.solid().shells()[0])


@pytest.mark.slow
@pytest.mark.parametrize(("first", "second"), EDGE_PAIRS)
def test_the_chain_of_joints_follows_the_poses(first, second):
    options = {"first": first, "second": second, "turns": (180, 90), "clearance": 0.3}
    hinge = DoubleHinge(30, **options)
    parent, link, child = hinge.parent_half, hinge.link, hinge.child_half
    for angles in ((0, 0), (90, 0), (180, 60)):
        parent.joints["link"].connect_to(link.joints["parent"], angle=angles[0])
        link.joints["child"].connect_to(child.joints["link"], angle=angles[1])
        drawn = DoubleHinge(30, angles=angles, **options)
        for body, wanted in zip((parent, link, child), drawn.solids(), strict=True):
            assert (body.center() - wanted.center()).length == pytest.approx(0.0, abs=1e-6)
        assert shells_apart(parent, link) == pytest.approx(0.3, abs=1e-6)
        assert shells_apart(link, child) == pytest.approx(0.3, abs=1e-6)
    assert parent.joints["link"].angular_range == (0.0, 180.0)
    assert link.joints["child"].angular_range == (0.0, 90.0)


def test_three_solids_in_every_pose_and_builder():
    for angles in ((0, 0), (90, 180), (180, 180)):
        assert len(DoubleHinge(20, angles=angles, clearance=0.3).solids()) == 3
    hinge = DoubleHinge(20, clearance=0.3)
    with BuildPart() as built:
        DoubleHingePart(hinge, "link")
    assert len(built.part.solids()) == 1
    with pytest.raises(HingeError, match="body of its own"):
        DoubleHingeCarve(hinge, "link", mode=Mode.PRIVATE)


@pytest.mark.slow
def test_let_into_two_boxes():
    side = 19.7
    boxes = [Pos(x, 0, 0) * Box(side, side, side) for x in (-10, 10)]
    parent, link, child = DoubleHinge(20, second="+z", turns=(180, 270), clearance=0.3).fit(*boxes)
    assert len(parent.solids()) == len(link.solids()) == len(child.solids()) == 1
    assert shells_apart(parent, link) == pytest.approx(0.3, abs=1e-6)
    assert shells_apart(parent, child) == pytest.approx(0.3, abs=1e-6)
    parent.joints["link"].connect_to(link.joints["parent"], angle=120)
    link.joints["child"].connect_to(child.joints["link"], angle=0)
    assert shells_apart(link, child) == pytest.approx(0.3, abs=1e-6)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"first": "+x"}, "edge"),
        ({"turns": (120, 90)}, "turn"),
        ({"angles": (100, 0), "turns": (90, 90)}, "outside its turn"),
        ({"second": "+y", "knuckles": 4}, "knuckles"),
        ({"plate": 0.5}, "plate"),
        ({"plate": 4.4}, "plate"),
        ({"size": 6.0}, "web|plate|fit|cone|wall"),
    ],
    ids=str,
)
def test_refusals(changes, message):
    with pytest.raises(HingeError, match=message):
        plan_double(DoubleSpec.read(**{"size": 20.0, "clearance": 0.3, **changes}))


def test_child_goes_where_the_lattice_says():
    """Two turns of 180° about opposite edges carry the child's box past the parent's."""
    spec = DoubleSpec.read(20, clearance=0.3)
    centre = child_pose(spec, 180, 0) @ (10, 0, 0, 1)
    np.testing.assert_allclose(centre[:3], (-10, 20, 0), atol=1e-9)
    centre = child_pose(spec, 180, 180) @ (10, 0, 0, 1)
    np.testing.assert_allclose(centre[:3], (10, 40, 0), atol=1e-9)
    spec = DoubleSpec.read(20, first="+y", second="+z", turns=(90, 90), clearance=0.3)
    centre = child_pose(spec, 90, 90) @ (10, 0, 0, 1)
    np.testing.assert_allclose(centre[:3], (10, 20, 20), atol=1e-9)


def _manifold(part):
    import manifold3d

    return manifold3d.Manifold(manifold3d.Mesh64(part.vertices, part.faces.astype(np.uint64)))


@pytest.mark.slow
@pytest.mark.parametrize(("voxel", "knuckles"), [(15, 3), (20, 3), (25, 5), (40, 7)])
def test_single_meshes_keep_the_clearance(voxel, knuckles):
    found = single_hinge_meshes(voxel, 0.3, knuckles=knuckles)
    parent, child, parent_carve, child_carve = (_manifold(part) for part in found[:4])
    box = _box(voxel, 0.3)
    parent = box.translate((-voxel, -0.5 * voxel, 0.0)) - parent_carve + parent
    child = box.translate((0.0, -0.5 * voxel, 0.0)) - child_carve + child
    assert len(parent.decompose()) == len(child.decompose()) == 1
    for angle in range(0, 181, 20):
        posed = child.rotate((0, 0, angle))
        assert overlap(parent, posed) == pytest.approx(0.0, abs=1e-9)
        assert 0.3 - 1e-6 <= gap(parent, posed, 0.4) <= 0.31
    assert found.reach_mm == pytest.approx(found.barrel_radius_mm + 0.3)


def _box(voxel, gap_mm):
    """A cell at x > 0, centred in y and z, inset by half the gap."""
    import manifold3d

    side = voxel - gap_mm
    return manifold3d.Manifold.cube((side, side, side)).translate(
        (0.5 * gap_mm, 0.5 * (gap_mm - voxel), 0.5 * (gap_mm - voxel))
    )


@pytest.mark.parametrize(("first", "second"), EDGE_PAIRS)
def test_double_meshes_keep_the_clearance(first, second):
    voxel, turns = 30.0, (270, 180)
    found = double_hinge_meshes(voxel, 0.3, first, second, turns)
    parent, link, child, parent_carve, child_carve = (_manifold(part) for part in found[:5])
    parent = _box(voxel, 0.3).translate((-voxel, 0, 0)) - parent_carve + parent
    child = _box(voxel, 0.3) - child_carve + child
    spec = DoubleSpec.read(voxel, first=first, second=second, turns=turns, clearance=0.3)
    plan = plan_double(spec)
    assert len(parent.decompose()) == len(link.decompose()) == len(child.decompose()) == 1
    for a in (0, 90, 200, 270):
        turned = link.transform(plan_pose(spec, a))
        assert overlap(parent, turned) == pytest.approx(0.0, abs=1e-9)
        assert 0.3 - 1e-6 <= gap(parent, turned, 0.4) <= 0.31
        for b in (0, 180):
            if boxes_apart(plan, a, b):
                posed = child.transform(child_pose(spec, a, b)[:3])
                assert gap(parent, posed, 0.4) >= 0.3 - 1e-6


def plan_pose(spec, angle):
    from hinges.plan_double import link_pose

    return link_pose(spec, angle)[:3]


def test_meshes_are_deterministic_copies():
    one, other = single_hinge_meshes(20, 0.3), single_hinge_meshes(20, 0.3)
    np.testing.assert_array_equal(one.parent_half.vertices, other.parent_half.vertices)
    one.parent_half.vertices[:] = 0.0
    assert single_hinge_meshes(20, 0.3).parent_half.vertices.any()
    assert one.parent_half.faces.dtype == np.int32
    assert (one.barrel_radius_mm, one.pin_radius_mm) == (2.5, 1.5)


@pytest.mark.parametrize(
    ("keywords", "poses"),
    [
        ({}, ()),
        ({"second": "+z", "turns": (180, 90)}, ()),
        ({"turns": (270, 180)}, ((270.0, 0.0),)),
        ({"second": "+y", "turns": (180, 90), "knuckles": 5}, ((180.0, 90.0),)),
    ],
)
def test_poses_in_which_the_boxes_meet_are_told(keywords, poses):
    hinge = DoubleHinge(40, clearance=0.3, **keywords)
    assert set(poses) <= set(hinge.colliding_poses)
    for first in range(0, int(hinge.spec.turns[0]) + 1, 90):
        for second in range(0, int(hinge.spec.turns[1]) + 1, 90):
            apart = boxes_apart(hinge.plan, first, second)
            assert ((first, second) in hinge.colliding_poses) == (not apart)
