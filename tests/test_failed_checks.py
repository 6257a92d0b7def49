"""A kit that is wrong in one thing fails the check of that thing, with the right figure."""

from dataclasses import replace

import manifold3d
import numpy as np
import pytest
import trimesh
from joinery_models import box_mesh, box_strip, motion_of_order, strip_tree, voxels_of

from fabfold.fold.motion import motion_of
from fabfold.joinery.bodies import BodyMesh
from fabfold.joinery.build import build_bodies
from fabfold.joinery.cells import solids_of
from fabfold.joinery.soundness import printable_body
from fabfold.kit.checking import FUSED_LIMIT_MM2, run_checks
from fabfold.kit.stages import BuiltTree, PlannedTree
from fabfold.printing.body_checks import check_bodies
from fabfold.printing.file_checks import check_file
from fabfold.printing.print_mode import print_mode
from fabfold.printing.print_pose import posed_kit, print_pose
from fabfold.printing.profiles import load_profile
from fabfold.progress import SilentProgress
from fabfold.tree.fold_tree import Hinge
from fabfold.tree.kinematics_check import check_tree

MJF, PLA = load_profile("mjf-pa12"), load_profile("fdm-pla-0.4")


def certified(motion, gap=0.45, end=0.0):
    told = {"geometry": "test", "min_gap_mm": gap, "end_pose_error": end, "moves": []}
    return replace(motion, certificate=told)


@pytest.fixture(scope="module")
def strip():
    """Two bodies of two cells, one hinge: the smallest kit there is."""
    tree = strip_tree(4, [1])
    motion = motion_of_order(tree, [0])
    voxels = voxels_of(tree.source, box_strip(4))
    joinery = build_bodies(voxels, tree, motion, voxel_mm=20.0, clearance_mm=0.5)
    return BuiltTree(PlannedTree(voxels, tree, certified(motion)), joinery, ())


def checks_of(built, mode=None):
    mode = print_mode(MJF) if mode is None else mode
    return {check.name: check for check in run_checks(built, mode, SilentProgress())}


def failed(checks):
    return {name for name, check in checks.items() if not check.ok}


def test_the_kit_itself_passes_every_check(strip):
    assert failed(checks_of(strip)) == set()


@pytest.mark.slow
def test_what_the_certificate_says_is_held_against_the_printer(strip):
    tight = replace(strip.planned, motion=certified(strip.planned.motion, gap=0.31, end=0.25))
    checks = checks_of(replace(strip, planned=tight))
    assert failed(checks) == {"smallest gap on the folding path", "end of the path is the box"}
    gap = checks["smallest gap on the folding path"]
    assert (gap.figure, gap.limit) == (0.31, 0.4)
    assert checks["end of the path is the box"].figure == 0.25


@pytest.mark.slow
def test_too_much_that_was_rounded_off_fails(strip):
    full = sum(body.volume for body in strip.joinery.bodies)
    rounded = replace(
        strip.joinery,
        rounded_cells=2,
        rounded_skin_mm3=0.06 * full,
        rounded_inside_mm3=0.04 * full,
    )
    checks = checks_of(replace(strip, joinery=rounded))
    name = "corners rounded off so that cells pass"
    assert failed(checks) == {name}
    assert (checks[name].figure, checks[name].limit) == (
        pytest.approx(100 * 0.1 / 1.1, abs=0.01),
        5,
    )


@pytest.mark.slow
def test_a_tree_that_goes_elsewhere_is_found_voxel_by_voxel(strip):
    tree = strip.planned.tree
    target = tree.target.copy()
    target[3] = target[2]
    wrong = replace(tree, target=target)
    checks = checks_of(replace(strip, planned=replace(strip.planned, tree=wrong)))
    check = checks["tree folds the model into the template"]
    assert not check.ok
    assert check.figure == len(check_tree(wrong)) >= 1


@pytest.mark.slow
def test_a_post_in_the_way_is_met_on_the_path_and_in_the_box(strip):
    solids = solids_of(strip.joinery.bodies)
    hinge = strip.planned.tree.hinges[0]
    # The two bodies close like a book: a post on one page stands where the other comes to lie.
    top = np.array(strip.joinery.bodies[0].vertices).max(axis=0)
    axis = np.array(hinge.point) * 20.0 + np.array(strip.joinery.origin_mm)
    up = int(np.argmax([abs(axis[k] - strip.joinery.origin_mm[k]) for k in (1, 2)])) + 1
    sign = np.sign(axis[up] - strip.joinery.origin_mm[up])
    post = manifold3d.Manifold.cube((4.0, 4.0, 4.0), True)
    place = np.array([10.0, strip.joinery.origin_mm[1], strip.joinery.origin_mm[2]])
    place[up] = axis[up] + sign * 1.0
    assert top.max() > 0
    joined = solids[0] + post.translate(tuple(place))
    body = strip.joinery.bodies[0]
    made = BodyMesh(body.name, *printable_body(joined, body.name, np.zeros(3)))
    joinery = replace(strip.joinery, bodies=(made, *strip.joinery.bodies[1:]))
    checks = checks_of(replace(strip, joinery=joinery))
    hits = checks["moves with a collision, a look every 2°"]
    assert not hits.ok
    assert (hits.figure, hits.limit) == (1.0, 0.0)  # the path has one move
    gap = checks["smallest gap seen on the folding path, every 30°"]
    assert not gap.ok
    assert gap.figure <= 0.0


def test_a_fold_through_the_other_body_is_felt_in_the_replay(strip):
    tree = strip.planned.tree
    hinges = tuple(
        Hinge(h.name, h.parent, h.child, h.point, h.direction, -h.angle_deg) for h in tree.hinges
    )
    wrong = replace(tree, hinges=hinges)
    motion = certified(motion_of(wrong, np.array([[0, -2 * np.sign(tree.hinges[0].angle_deg)]])))
    planned = replace(strip.planned, tree=wrong, motion=motion)
    checks = checks_of(replace(strip, planned=planned))
    depth, error = checks["replay: deepest penetration"], checks["replay: largest angle error"]
    assert not depth.ok
    assert depth.figure > depth.limit == 0.5
    assert not error.ok
    assert error.figure > 10.0


@pytest.mark.slow
def test_filament_is_refused_for_the_area_that_would_fuse(bar_kit):
    built = bar_kit.join()
    check = checks_of(built, print_mode(PLA, "in-place", pose="b"))["prints as it lies"]
    # The same otherwise: how much of each body comes into another when it sinks by the gap.
    pose = print_pose(built.planned.tree, built.planned.motion, built.joinery, PLA, "b")
    solids = solids_of(posed_kit(built.joinery, pose).bodies)
    gap, thin = built.joinery.clearance_mm, 0.02
    area = 0.0
    for i, upper in enumerate(solids):
        for j, lower in enumerate(solids):
            if i != j:
                area += (upper.translate((0, 0, -gap - thin)) ^ lower).volume() / thin
    assert not check.ok
    assert check.limit == FUSED_LIMIT_MM2
    assert check.figure == pytest.approx(area, rel=0.25)


# Bodies -----------------------------------------------------------------------------------------


def with_second(strip, vertices, faces):
    body = BodyMesh("body-01", np.asarray(vertices, float), np.asarray(faces, np.int32))
    return replace(strip.joinery, bodies=(strip.joinery.bodies[0], body))


def body_checks(strip, joinery, profile=MJF):
    tree, motion = strip.planned.tree, strip.planned.motion
    return {check.name: check for check in check_bodies(joinery, tree, motion, profile)}


def test_a_body_too_small_to_find_fails(strip):
    checks = body_checks(strip, with_second(strip, *box_mesh([90, 0, 0], [91.4, 1.4, 1.4])))
    small = checks["smallest body"]
    assert not small.ok
    assert (small.figure, small.limit) == (pytest.approx(1.4**3), pytest.approx(1.5**3))
    assert small.note.startswith("body-01")


def test_cubes_that_share_an_edge_are_not_two_manifold(strip):
    one, faces = box_mesh([90, 0, 0], [100, 10, 10])
    other, more = box_mesh([100, 10, 0], [110, 20, 10])
    points, index = np.unique(np.concatenate([one, other]), axis=0, return_inverse=True)
    both = index.reshape(-1)[np.concatenate([faces, more + len(one)])]
    check = body_checks(strip, with_second(strip, points, both))["two-manifold surfaces"]
    assert not check.ok
    assert check.figure == 1.0  # the edge that four triangles share
    assert "body-01 (1)" in check.note


def test_a_crossing_counts_its_triangles(strip):
    one, faces = box_mesh([50, 5, 5], [70, 15, 15])
    other, more = box_mesh([60, 7, 7], [90, 12, 12])
    crossing = with_second(
        strip, np.concatenate([one, other]), np.concatenate([faces, more + len(one)])
    )
    check = body_checks(strip, crossing)["surfaces that cross themselves"]
    assert not check.ok
    assert check.figure == 10.0  # two of the face that is pierced, eight of the sides that pierce
    assert "body-01 (10)" in check.note


def test_an_overlap_is_a_volume(strip):
    joinery = with_second(strip, *box_mesh([30, 5, 5], [50, 15, 15]))
    solids = solids_of(joinery.bodies)
    check = body_checks(strip, joinery)["bodies overlap"]
    assert not check.ok
    assert check.figure == pytest.approx((solids[0] ^ solids[1]).volume(), rel=1e-6)


def test_walls_and_gaps_are_refused_by_their_millimetres(strip):
    thick = MJF.model_copy(update={"min_wall_mm": 1.2, "min_gap_mm": 0.49})
    checks = body_checks(strip, strip.joinery, thick)
    joinery = strip.joinery
    cone = joinery.pin_radius_mm + (np.sqrt(2) - 1) * joinery.clearance_mm
    wall = checks["thinnest wall in a hinge"]
    assert (wall.ok, wall.figure) == (False, pytest.approx(joinery.barrel_radius_mm - cone))
    assert checks["smallest gap between bodies"].ok
    strict = MJF.model_copy(update={"min_gap_mm": 0.55})
    gap = body_checks(strip, strip.joinery, strict)["smallest gap between bodies"]
    assert (gap.ok, gap.figure) == (False, pytest.approx(0.5, abs=0.003))


# Any file ---------------------------------------------------------------------------------------


def file_checks(tmp_path, mesh, profile=MJF):
    path = tmp_path / "part.stl"
    mesh.export(path)
    return {check.name: check for check in check_file(path, profile, SilentProgress())}


def test_an_open_file_is_refused_by_its_open_edges(tmp_path):
    mesh = trimesh.creation.box((10, 10, 10))
    mesh.update_faces(np.arange(len(mesh.faces)) != 0)
    checks = file_checks(tmp_path, mesh)
    assert (checks["closed surfaces"].ok, checks["closed surfaces"].figure) == (False, 3.0)
    assert not checks["parts are solids"].ok


def test_a_file_of_paper_is_refused_by_its_share(tmp_path):
    checks = file_checks(tmp_path, trimesh.creation.box((60, 60, 0.3)))
    thin = checks["surface thinner than the printer's wall"]
    assert (thin.ok, thin.limit) == (False, 10.0)
    assert thin.figure > 95.0
    wall = checks["thinnest wall"]
    assert (wall.ok, wall.figure) == (False, pytest.approx(0.3, rel=0.02))


def test_a_file_too_large_is_refused_by_its_per_cent(tmp_path):
    check = file_checks(tmp_path, trimesh.creation.box((760, 10, 10)))["fits the printer"]
    assert (check.ok, check.figure) == (False, pytest.approx(200.0))
