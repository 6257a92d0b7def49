"""The swept proof on printed bodies: known gaps, known collisions, an independent sampling."""

from __future__ import annotations

import json
from dataclasses import replace

import fcl
import joinery_models
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fabfold.errors import CheckError
from fabfold.fold.motion import Motion
from fabfold.proof.bvh import fit, new_bodies, place
from fabfold.proof.certify import certify
from fabfold.proof.gap import DONE, FAILED, prove_gap, prove_pairs
from fabfold.proof.triangles import plane_gap, triangle_distance

VOXEL = 10.0
ORIGIN = (3.0, -2.0, 7.0)


def mm(point):
    return np.array(ORIGIN) + VOXEL * np.asarray(point, dtype=float)


def cell_box(low, high, inset):
    """Box about the cells low..high, inset by some mm on every side."""
    return joinery_models.box_mesh(
        mm(np.array(low) - 0.5) + inset, mm(np.array(high) + 0.5) - inset
    )


def strip_kit(gap):
    """Strip of eight cells in four plain boxes, faces `gap` apart, and its folding path."""
    tree = joinery_models.strip_tree(8, [1, -1, 1])
    meshes = [cell_box((2 * b, 0, 0), (2 * b + 1, 0, 0), gap / 2) for b in range(4)]
    return tree, joinery_models.motion_of_order(tree, [0, 1, 2]), meshes


def cylinder_mesh(radius, length, sides=48):
    import manifold3d

    solid = manifold3d.Manifold.cylinder(length, radius, radius, sides, True)
    mesh = solid.to_mesh64()
    return np.array(mesh.vert_properties[:, :3]), np.array(mesh.tri_verts, dtype=np.int32)


def run(kit, wanted, **more):
    tree, motion, meshes = kit
    return certify(tree, motion, meshes, VOXEL, ORIGIN, wanted, **more)


def test_boxes_with_a_known_gap_pass_below_and_fail_above_it():
    kit = strip_kit(0.3)
    certificate = run(kit, 0.29)
    assert 0.29 <= certificate["min_gap_mm"] <= 0.3
    assert certificate["seen_gap_mm"] == pytest.approx(0.3, abs=1e-6)
    assert certificate["end_pose_error"] == 0.0
    assert [m["hinge"] for m in certificate["moves"]] == [
        f"hinge-{h:02d}" for h in (0, 0, 1, 1, 2, 2)
    ]
    assert all(0.29 <= m["min_gap_mm"] <= 0.3 for m in certificate["moves"])
    assert json.loads(json.dumps(certificate)) == certificate
    with pytest.raises(CheckError, match=r"shape A: body-0\d and body-0\d come within 0.3000 mm"):
        run(kit, 0.31)


def test_the_bound_comes_as_close_as_asked():
    certificate = run(strip_kit(0.3), 0.2, slack_mm=0.0005)
    assert 0.2994 <= certificate["min_gap_mm"] <= 0.3
    assert run(strip_kit(0.3), 0.2999)["min_gap_mm"] >= 0.2999


def test_a_collision_between_the_keyframes_is_found_and_named():
    tree, motion, meshes = strip_kit(0.3)
    # A post that stands on the first body where only the middle of the first turn passes.
    post = joinery_models.box_mesh(mm((1.9, 1.9, -0.2)), mm((2.1, 2.1, 0.2)))
    root = (
        np.concatenate([meshes[0][0], post[0]]),
        np.concatenate([meshes[0][1], post[1] + len(meshes[0][0])]),
    )
    with pytest.raises(
        CheckError, match=r"move 1 of 6 \(hinge-00\): body-0\d and body-00"
    ) as error:
        certify(tree, motion, [root, *meshes[1:]], VOXEL, ORIGIN, 0.25)
    angle = float(str(error.value).split(" at ")[1].split("°")[0])
    assert 0 < angle < 90


def test_a_body_inside_another_is_found():
    tree, motion, meshes = strip_kit(0.3)
    small = joinery_models.box_mesh(mm((0, 0, 0)) - 1, mm((0, 0, 0)) + 1)
    inside = (
        np.concatenate([meshes[3][0], small[0]]),
        np.concatenate([meshes[3][1], small[1] + len(meshes[3][0])]),
    )
    with pytest.raises(CheckError, match="body-03 lies inside body-00"):
        certify(tree, motion, [*meshes[:3], inside], VOXEL, ORIGIN, 0.25)


def test_bodies_that_cross_are_found():
    tree, motion, meshes = strip_kit(0.3)
    wide = cell_box((2, 0, 0), (3, 0, 0), -0.2)
    with pytest.raises(CheckError, match="body-00 and body-01 run into each other"):
        certify(tree, motion, [meshes[0], wide, *meshes[2:]], VOXEL, ORIGIN, 0.25)


def test_a_path_that_stops_early_or_turns_two_hinges_is_refused():
    tree, motion, meshes = strip_kit(0.3)
    early = Motion(motion.hinges, motion.angles_deg[:-1], motion.moves[:-1])
    with pytest.raises(CheckError, match="away from shape B"):
        certify(tree, early, meshes, VOXEL, ORIGIN, 0.25)
    both = Motion(motion.hinges, motion.angles_deg[[0, -1]], ((), (0, 1, 2)))
    with pytest.raises(ValueError, match="3 hinges turn"):
        certify(tree, both, meshes, VOXEL, ORIGIN, 0.25)
    with pytest.raises(ValueError, match="4 bodies, but 3 meshes"):
        certify(tree, motion, meshes[:3], VOXEL, ORIGIN, 0.25)


def test_one_move_by_180_degrees_is_as_good_as_two_by_90():
    tree, motion, meshes = strip_kit(0.3)
    halves = Motion(motion.hinges, motion.angles_deg[::2], ((), (0,), (1,), (2,)))
    one = certify(tree, halves, meshes, VOXEL, ORIGIN, 0.25)
    two = certify(tree, motion, meshes, VOXEL, ORIGIN, 0.25)
    assert len(one["moves"]) == 3
    assert abs(one["min_gap_mm"] - two["min_gap_mm"]) < 0.01


def test_order_of_triangles_does_not_matter_and_runs_repeat():
    tree, motion, meshes = strip_kit(0.3)
    rng = np.random.default_rng(0)
    shuffled = [(v, f[rng.permutation(len(f))]) for v, f in meshes]
    first = certify(tree, motion, meshes, VOXEL, ORIGIN, 0.25)
    assert certify(tree, motion, meshes, VOXEL, ORIGIN, 0.25) == first
    other = certify(tree, motion, shuffled, VOXEL, ORIGIN, 0.25)
    assert abs(other["min_gap_mm"] - first["min_gap_mm"]) < 0.01


def fitted(meshes):
    return fitted_triangles([np.asarray(v, float)[f] for v, f in meshes])


def fitted_triangles(triangles):
    boxes, bodies = new_bodies(triangles)
    for body in range(len(triangles)):
        fit(boxes, bodies, body)
    return boxes


@pytest.mark.slow
def test_a_barrel_in_its_sleeve_keeps_the_radial_gap():
    import manifold3d

    pin = cylinder_mesh(2.5, 8.0)
    outer = manifold3d.Manifold.cylinder(6.0, 5.0, 5.0, 48, True)
    bore = manifold3d.Manifold.cylinder(9.0, 2.8, 2.8, 48, True)
    mesh = (outer - bore).to_mesh64()
    sleeve = np.array(mesh.vert_properties[:, :3]), np.array(mesh.tri_verts, dtype=np.int32)
    # Facets of the bore come nearer to the axis than its corners, and corners of the pin pass.
    true = 2.8 * np.cos(np.pi / 48) - 2.5
    result = np.array([1.0, np.inf, 0.0])
    assert prove_gap(fitted([pin, sleeve]), 0, 1, 0.0, np.pi, 0.25, 0.005, result) == DONE
    assert true - 0.006 <= result[1] <= true + 1e-9
    assert prove_gap(fitted([pin, sleeve]), 0, 1, 0.0, np.pi, true + 0.01, 0.005, result) == FAILED


def test_roots_are_large_enough_for_where_bodies_are_placed():
    rng = np.random.default_rng(3)
    meshes = [rng.normal(size=(7, 3, 3)) + rng.normal(size=3) * 4 for _ in range(5)]
    boxes, bodies = new_bodies(meshes)
    poses = np.tile(np.eye(4), (5, 1, 1))
    for pose in poses:
        pose[:3, :3] = Rotation.random(rng=rng).as_matrix()
        pose[:3, 3] = rng.normal(size=3)
    place(boxes, bodies, poses)
    root = boxes.root[:-1]
    rough_box, rough = boxes.box[root].copy(), boxes.invariant[root].copy()
    for body, (pose, mesh) in enumerate(zip(poses, meshes, strict=True)):
        assert not bodies.fitted[body]
        corners = (mesh @ pose[:3, :3].T + pose[:3, 3]).reshape(-1, 3)
        assert (rough_box[body, :3] <= corners.min(axis=0)).all()
        assert (rough_box[body, 3:] >= corners.max(axis=0)).all()
        fit(boxes, bodies, body)
        assert np.allclose(boxes.box[root[body], :3], corners.min(axis=0), atol=1e-12)
        assert np.allclose(boxes.box[root[body], 3:], corners.max(axis=0), atol=1e-12)
        assert (rough[body, 0::2] <= boxes.invariant[root[body], 0::2] + 1e-12).all()
        assert (rough[body, 1::2] >= boxes.invariant[root[body], 1::2] - 1e-12).all()


def test_only_bodies_near_to_others_are_fitted_and_the_proof_is_the_same():
    triangle = np.array([[[0, 2, 0], [1, 2, 0], [0, 3, 0.5]]])
    row = [triangle + np.array([x, 0, 0]) for x in (0, 1.5, 3, 30, 34)]
    boxes, bodies = new_bodies(row)
    low, high, pair = 0.0, 0.3, np.zeros(2, dtype=np.int32)
    turning, resting = np.array([0, 3], dtype=np.int32), np.array([1, 2, 4], dtype=np.int32)
    result = np.array([2.0, np.inf, 0.0])
    place(boxes, bodies, np.tile(np.eye(4), (5, 1, 1)))
    question = turning, resting, low, high, 0.01, 0.001
    assert prove_pairs(boxes, bodies, *question, result, pair) == DONE
    assert bodies.fitted.tolist() == [True, True, False, False, False]
    assert pair.tolist() == [0, 1]
    everything = fitted_triangles(row)
    whole = np.array([2.0, np.inf, 0.0])
    assert prove_pairs(everything, bodies, *question, whole, pair) == DONE
    assert np.array_equal(result, whole)


def test_bounds_hold_the_distances_of_an_independent_sampling():
    rng = np.random.default_rng(7)

    def model(triangles):
        mesh = fcl.BVHModel()
        mesh.beginModel(len(triangles), 3 * len(triangles))
        mesh.addSubModel(triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3))
        mesh.endModel()
        return mesh

    proven = 0
    for trial in range(12):
        one = rng.normal(size=(12, 1, 3)) * 3 + rng.normal(size=(12, 3, 3)) * (0.3 + trial % 3)
        two = rng.normal(size=(9, 1, 3)) * 3 + rng.normal(size=(9, 3, 3)) + [0, 0, 4 + trial]
        boxes = fitted_triangles([one, two])
        low, high = sorted(rng.uniform(-3, 3, 2))
        high = min(high, low + np.pi)
        moving, still = fcl.CollisionObject(model(one)), fcl.CollisionObject(model(two))
        sampled = np.inf
        for angle in np.linspace(low, high, 400):
            spin = np.array(
                [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
            )
            moving.setTransform(fcl.Transform(spin, np.zeros(3)))
            sampled = min(sampled, fcl.distance(moving, still))
        result = np.array([100.0, np.inf, 0.0])
        verdict = prove_gap(boxes, 0, 1, low, high, 1e-3, 1e-3, result)
        if sampled <= 1e-3:
            assert verdict == FAILED
        elif verdict == DONE:
            assert result[1] <= sampled + 1e-9
            assert result[0] - 1e-3 - 1e-12 <= result[1] <= result[0]
            assert sampled - result[0] < 0.01
            proven += 1
    assert proven >= 6


def test_triangle_distance_against_fcl():
    rng = np.random.default_rng(1)
    for trial in range(200):
        one = rng.normal(size=(3, 3))
        two = rng.normal(size=(3, 3)) + rng.normal(size=3) * (trial % 3)
        if trial % 5 == 0:
            one, two = np.round(one), np.round(two)
        models = []
        for corners in (one, two):
            mesh = fcl.BVHModel()
            mesh.beginModel(1, 3)
            mesh.addSubModel(corners, np.array([[0, 1, 2]]))
            mesh.endModel()
            models.append(fcl.CollisionObject(mesh))
        nearest = np.zeros((2, 3))
        found = triangle_distance(one, two, nearest)
        assert found == pytest.approx(max(0.0, fcl.distance(*models)), abs=1e-7)
        assert np.linalg.norm(nearest[0] - nearest[1]) == pytest.approx(found, abs=1e-9)
        assert plane_gap(one, two) <= found + 1e-12
    # Of a corner over a face, and of two parallel faces, it is the distance itself.
    face = np.array([(0.0, 0, 0), (3, 0, 0), (0, 3, 0)])
    over = np.array([(0.5, 0.5, 0.7), (1, 1, 2), (0, 1, 3)])
    assert plane_gap(face, over) == plane_gap(over, face) == pytest.approx(0.7, abs=1e-12)
    assert plane_gap(face, face - (0.2, 0.1, 0.4)) == pytest.approx(0.4, abs=1e-12)
    assert plane_gap(face, over[:, [2, 1, 0]]) < 0.5


def test_printed_hinges_keep_their_clearance_on_the_whole_path():
    import manifold3d

    from fabfold.joinery.build import build_bodies

    tree = joinery_models.strip_tree(6, [1, -1])
    motion = joinery_models.motion_of_order(tree, [1, 0])
    voxels = joinery_models.voxels_of(tree.source, joinery_models.box_strip(6))
    made = build_bodies(voxels, tree, motion, voxel_mm=20.0, clearance_mm=0.3)
    meshes = [(body.vertices, body.faces) for body in made.bodies]
    certificate = certify(tree, motion, meshes, 20.0, made.origin_mm, 0.27)
    assert certificate["min_gap_mm"] >= 0.27
    # Another library, some poses: nothing nearer than what is certified.
    solids = [manifold3d.Manifold(manifold3d.Mesh64(v, f.astype(np.uint64))) for v, f in meshes]
    origin = np.array(made.origin_mm)
    for angles in ((0, 0), (0, -37), (0, -180), (52, -180), (180, -180)):
        placed = []
        for solid, pose in zip(solids, tree.body_poses(np.array(angles, float)), strict=True):
            shift = 20.0 * pose[:3, 3] + origin - pose[:3, :3] @ origin
            placed.append(solid.transform(np.column_stack([pose[:3, :3], shift])))
        for i in range(3):
            for j in range(i):
                assert placed[i].min_gap(placed[j], 1.0) >= certificate["min_gap_mm"] - 1e-6
    # With a coarser demand the same bodies fail, and the message names hinge and bodies.
    with pytest.raises(CheckError, match="body-0"):
        certify(tree, motion, meshes, 20.0, made.origin_mm, 0.32)


def test_wrong_orientation_in_the_tree_is_not_certified():
    tree, motion, meshes = strip_kit(0.3)
    turned = replace(tree, orientation=np.tile(np.eye(3, dtype=np.int32), (8, 1, 1)))
    with pytest.raises(CheckError, match="away from shape B"):
        certify(turned, motion, meshes, VOXEL, ORIGIN, 0.25)
