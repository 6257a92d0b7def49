"""Bodies, hinges and grooves on small strips, measured in every pose of the folding path."""

from __future__ import annotations

import io
from itertools import combinations

import fcl
import manifold3d
import numpy as np
import pytest
import trimesh
from joinery_models import (
    box_strip,
    corner_solid,
    corner_tree,
    motion_of_order,
    posed,
    strip_tree,
    voxels_of,
)

from fabfold.errors import GeometryError, RecipeError
from fabfold.fold.motion import Motion
from fabfold.joinery.build import build_bodies
from fabfold.joinery.sizes import hinge_size, smallest_voxel
from fabfold.joinery.tally import FRAGMENT_SHARE
from fabfold.lattice.template import Template
from fabfold.tree.fold_tree import Body, Edge, FoldTree, Hinge

VOXEL = 20.0
CLEARANCE = 0.3


@pytest.fixture(scope="module")
def strip8():
    tree = strip_tree(8, [1, -1, 1])
    motion = motion_of_order(tree, [2, 1, 0])
    voxels = voxels_of(tree.source, box_strip(8))
    joinery = build_bodies(voxels, tree, motion, voxel_mm=VOXEL, clearance_mm=CLEARANCE)
    return tree, motion, joinery


@pytest.fixture(scope="module")
def corner():
    tree = corner_tree()
    motion = motion_of_order(tree, [0, 1])
    voxels = voxels_of(tree.source, corner_solid())
    joinery = build_bodies(voxels, tree, motion, voxel_mm=VOXEL, clearance_mm=CLEARANCE)
    return tree, motion, joinery


def states(motion: Motion, steps: int):
    for start, end in zip(motion.angles_deg[:-1], motion.angles_deg[1:], strict=True):
        for share in np.linspace(0.0, 1.0, steps):
            yield (1.0 - share) * start + share * end


@pytest.mark.slow
@pytest.mark.parametrize("case", ["strip8", "corner"])
def test_gap_is_the_clearance_in_every_pose(case, request):
    tree, motion, joinery = request.getfixturevalue(case)
    for angles in states(motion, 4):
        bodies = posed(joinery, tree, angles)
        gaps = []
        for one, other in combinations(bodies, 2):
            assert (one ^ other).volume() < 1e-3
            gaps.append(one.min_gap(other, 2.0))
        assert min(gaps) == pytest.approx(CLEARANCE, abs=0.005)


def test_gap_agrees_with_another_library(strip8):
    tree, motion, joinery = strip8

    def tree_of(solid):
        mesh = solid.to_mesh64()
        model = fcl.BVHModel()
        model.beginModel(len(mesh.vert_properties), len(mesh.tri_verts))
        model.addSubModel(
            np.array(mesh.vert_properties[:, :3]), np.array(mesh.tri_verts, dtype=np.int64)
        )
        model.endModel()
        return fcl.CollisionObject(model)

    for angles in (motion.angles_deg[0], 0.7 * motion.angles_deg[1], motion.angles_deg[-1]):
        bodies = posed(joinery, tree, angles)
        first, second = bodies[2], bodies[3]
        request, result = fcl.DistanceRequest(), fcl.DistanceResult()
        found = fcl.distance(tree_of(first), tree_of(second), request, result)
        assert found == pytest.approx(first.min_gap(second, 2.0), abs=1e-3)


@pytest.mark.parametrize("case", ["strip8", "corner"])
def test_every_body_is_one_sound_piece_as_an_stl_reader_sees_it(case, request):
    tree, _, joinery = request.getfixturevalue(case)
    assert [body.name for body in joinery.bodies] == [body.name for body in tree.bodies]
    for body in joinery.bodies:
        written = trimesh.Trimesh(body.vertices, body.faces, process=False).export(file_type="stl")
        read = trimesh.load(io.BytesIO(written), file_type="stl")
        assert read.is_watertight
        assert read.is_winding_consistent
        assert read.body_count == 1
        assert read.volume == pytest.approx(body.volume, rel=1e-6)
        assert (body.vertices == body.vertices.astype(np.float32)).all()


def test_knuckles_lock_in_every_pose(strip8):
    # Pulled a millimetre along or across its axis, a hinge must jam: its pin holds.
    tree, motion, joinery = strip8
    for angles in (motion.angles_deg[0], motion.angles_deg[-1]):
        bodies = posed(joinery, tree, angles)
        for hinge in tree.hinges:
            for pull in np.eye(3):
                moved = bodies[hinge.child].translate(tuple(1.2 * pull))
                back = bodies[hinge.child].translate(tuple(-1.2 * pull))
                parent = bodies[hinge.parent]
                assert (moved ^ parent).volume() > 0.1
                assert (back ^ parent).volume() > 0.1


def test_body_keeps_half_the_gap_from_foreign_cells(corner):
    tree, _, joinery = corner
    origin = np.array(joinery.origin_mm)
    for index, body in enumerate(joinery.bodies):
        # Only barrels leave the eroded cells: none of the material off the hinges does.
        lattice = (body.vertices - origin) / joinery.voxel_mm
        axes = [
            (np.array(h.point), np.abs(np.array(h.direction)).argmax())
            for h in tree.hinges
            if index in (h.parent, h.child)
        ]
        off = np.ones(len(lattice), dtype=bool)
        for point, axis in axes:
            across = np.delete(lattice - point, axis, axis=1)
            off &= np.linalg.norm(across, axis=1) > 2.51 / VOXEL
        inset = CLEARANCE / 2 / VOXEL
        distance = np.abs(lattice - tree.source[tree.bodies[index].voxels[0]]).max(axis=1)
        assert distance[off].max() <= 0.5 - inset + 1e-6


def test_groove_gives_a_resting_barrel_its_clearance(corner):
    tree, motion, joinery = corner
    resting = Motion(motion.hinges, motion.angles_deg[:1], motion.moves[:1])
    voxels = voxels_of(tree.source, corner_solid())
    without = build_bodies(voxels, tree, resting, voxel_mm=VOXEL, clearance_mm=CLEARANCE)
    assert without.carved_cells == 1  # the second barrel rests beside the first body in A
    assert joinery.carved_cells == 2
    # A quarter of a cylinder of radius r + c in each, less the inset faces.
    length = VOXEL - 2 * joinery.barrel_radius_mm
    radius = joinery.barrel_radius_mm + CLEARANCE
    assert 0.8 < joinery.carved_mm3 / (2 * np.pi / 4 * radius**2 * length) < 1.0
    assert without.bodies[2].volume - joinery.bodies[2].volume == pytest.approx(
        joinery.carved_mm3 / 2, rel=0.01
    )
    # Without the groove the third body hits the first hinge in the box.
    first, _, third = posed(without, tree, motion.angles_deg[-1])
    assert (first ^ third).volume() > 10.0
    first, _, third = posed(joinery, tree, motion.angles_deg[-1])
    assert first.min_gap(third, 2.0) >= CLEARANCE - 1e-3


def two_hinges_on_one_edge() -> tuple[FoldTree, Motion]:
    source = np.array([[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0]], dtype=np.int32)
    hinges = (
        Hinge("hinge-00", 0, 1, (0.5, 0.5, 0.0), (0, 0, 1), 180.0),
        Hinge("hinge-01", 0, 2, (0.5, 0.5, 0.0), (0, 0, 1), -180.0),
    )
    tree = FoldTree(
        template=Template("square", source),
        source=source,
        target=source,
        orientation=np.tile(np.eye(3, dtype=np.int32), (4, 1, 1)),
        fill=np.ones(4),
        edges=(Edge(0, 1, "R"), Edge(0, 2, "S", (0,)), Edge(1, 3, "S", (1,))),
        bodies=(Body("body-00", (0, 1)), Body("body-01", (2,)), Body("body-02", (3,))),
        hinges=hinges,
        root_rotation=np.eye(3, dtype=np.int32),
        root_translation=np.zeros(3, dtype=np.int32),
        energy={},
    )
    return tree, Motion(("hinge-00", "hinge-01"), np.zeros((1, 2)), ((),))


def test_barrel_on_foreign_knuckles_is_refused():
    tree, motion = two_hinges_on_one_edge()
    block = manifold3d.Manifold.cube((1.98, 1.98, 0.98), True).translate((0.5, 0.5, 0.0))
    with pytest.raises(GeometryError, match=r"hinge-0\d passes through the knuckles of hinge-0\d"):
        build_bodies(
            voxels_of(tree.source, block), tree, motion, voxel_mm=VOXEL, clearance_mm=CLEARANCE
        )


def legs(gap: float, roof: bool):
    """Strip of two cells whose second cell holds two legs apart, with or without a roof."""
    cube = manifold3d.Manifold.cube
    parts = [cube((0.98, 0.98, 0.98), True)]
    width = (0.98 - gap) / 2
    for side in (-1, 1):
        middle = side * (gap + width) / 2
        parts.append(cube((1.1, 0.9, width), True).translate((0.9, 0.0, middle)))
    if roof:
        parts.append(cube((1.1, 0.05, 0.98), True).translate((0.9, 0.3, 0.0)))
    return manifold3d.Manifold.batch_boolean(parts, manifold3d.OpType.Add)


def one_hinge(model, angle_side: int = 1):
    tree = strip_tree(2, [angle_side], run=1)
    motion = motion_of_order(tree, [0])
    return build_bodies(
        voxels_of(tree.source, model), tree, motion, voxel_mm=VOXEL, clearance_mm=CLEARANCE
    )


def test_pieces_that_the_cut_leaves_apart_get_a_strut():
    # The second hinge half spans both legs at the hinge's edge, so the legs end short of it.
    model = legs(0.5, roof=False)
    model -= manifold3d.Manifold.cube((0.5, 0.6, 1.2), True).translate((0.7, 0.5, 0.0))
    joinery = one_hinge(model)
    assert joinery.struts >= 1
    assert any("struts" in note and "body-01" in note for note in joinery.notes)
    for body in joinery.bodies:
        read = trimesh.Trimesh(body.vertices, body.faces)
        assert read.is_watertight
        assert read.body_count == 1


def test_full_cells_get_no_strut(strip8):
    assert strip8[2].struts == 0
    assert strip8[2].dropped_mm3 == 0.0


def test_thin_neck_between_rigid_cells_gets_a_strut():
    tree = strip_tree(4, [1])
    motion = motion_of_order(tree, [0])
    whole = box_strip(4)
    slot = manifold3d.Manifold.cube((0.3, 1.2, 1.2), True).translate((0.5, 0.0, 0.0))
    thread = manifold3d.Manifold.cube((0.5, 0.04, 0.04), True).translate((0.5, 0.2, 0.0))
    joined = build_bodies(
        voxels_of(tree.source, (whole - slot) + thread),
        tree,
        motion,
        voxel_mm=VOXEL,
        clearance_mm=CLEARANCE,
    )
    assert joined.struts == 1
    # The strut is 3 mm square and bridges a slot of 6 mm.
    origin = np.array(joined.origin_mm)
    body = joined.bodies[0]
    solid = manifold3d.Manifold(
        manifold3d.Mesh64(body.vertices - origin, body.faces.astype(np.uint64))
    )
    middle = manifold3d.Manifold.cube((1.0, VOXEL, VOXEL), True).translate((0.5 * VOXEL, 0, 0))
    assert (solid ^ middle).volume() == pytest.approx(9.0, rel=0.35)


def test_fragments_are_left_out_and_reported():
    crumb = manifold3d.Manifold.cube((0.1, 0.1, 0.1), True).translate((-0.35, -0.35, -0.35))
    notch = manifold3d.Manifold.cube((0.4, 0.4, 0.4), True).translate((-0.35, -0.35, -0.35))
    joinery = one_hinge((box_strip(2) - notch) + crumb)
    assert joinery.dropped_mm3 == pytest.approx(0.001 * VOXEL**3, rel=1e-3)
    assert joinery.dropped_mm3 < FRAGMENT_SHARE * VOXEL**3
    assert any("1 loose crumbs left out, 8 mm³" in note for note in joinery.notes)


def test_closed_hollows_are_filled():
    crumb = manifold3d.Manifold.cube((0.1, 0.1, 0.1), True)
    hollow = manifold3d.Manifold.cube((0.3, 0.3, 0.3), True)
    hollowed, full = one_hinge((box_strip(2) - hollow) + crumb), one_hinge(box_strip(2))
    assert hollowed.bodies[0].volume == pytest.approx(full.bodies[0].volume, rel=1e-6)
    assert hollowed.dropped_mm3 == 0.0
    assert any("1 closed hollows filled, 216 mm³" in note for note in hollowed.notes)


@pytest.mark.slow
def test_same_input_gives_the_same_bytes(corner):
    tree, motion, joinery = corner
    voxels = voxels_of(tree.source, corner_solid())
    again = build_bodies(voxels, tree, motion, voxel_mm=VOXEL, clearance_mm=CLEARANCE)
    for one, other in zip(joinery.bodies, again.bodies, strict=True):
        assert one.vertices.tobytes() == other.vertices.tobytes()
        assert one.faces.tobytes() == other.faces.tobytes()


@pytest.mark.slow
@pytest.mark.parametrize(("voxel_mm", "clearance_mm"), [(15.0, 0.3), (20.0, 0.6), (40.0, 0.4)])
def test_other_sizes_keep_their_clearance(voxel_mm, clearance_mm):
    tree = strip_tree(4, [1])
    motion = motion_of_order(tree, [0])
    voxels = voxels_of(tree.source, box_strip(4))
    joinery = build_bodies(voxels, tree, motion, voxel_mm=voxel_mm, clearance_mm=clearance_mm)
    for angles in states(motion, 4):
        one, other = posed(joinery, tree, angles)
        assert one.min_gap(other, 3.0) == pytest.approx(clearance_mm, abs=0.008)


def test_proven_hinge_at_twenty_millimetres():
    size = hinge_size(20.0, 0.3)
    assert (size.barrel_radius_mm, size.pin_radius_mm, size.knuckles) == (2.5, 1.5, 3)


@pytest.mark.parametrize("clearance", [0.2, 0.3, 0.4, 0.5, 0.6])
def test_a_hinge_fits_twenty_millimetres_with_every_clearance(clearance):
    size = hinge_size(20.0, clearance)
    mouth = size.pin_radius_mm + (np.sqrt(2) - 1) * clearance
    assert size.barrel_radius_mm - mouth >= 0.8 - 1e-9
    assert smallest_voxel(clearance) <= 20.0


def test_too_small_a_voxel_names_the_smallest_that_works():
    with pytest.raises(RecipeError, match=f"smallest voxel .* {smallest_voxel(0.4):g} mm"):
        hinge_size(8.0, 0.4)
    least = smallest_voxel(0.4)
    assert hinge_size(least, 0.4).barrel_radius_mm >= least / 8
    with pytest.raises(RecipeError, match="leave barrel, pin and knuckles"):
        hinge_size(20.0, 0.3, barrel_radius_mm=1.0)


def test_inputs_that_do_not_belong_together_are_refused(strip8):
    tree, motion, _ = strip8
    other = strip_tree(4, [1])
    voxels = voxels_of(other.source, box_strip(4))
    with pytest.raises(GeometryError, match="source cells"):
        build_bodies(voxels, tree, motion, voxel_mm=VOXEL, clearance_mm=CLEARANCE)
    with pytest.raises(GeometryError, match="hinges"):
        build_bodies(voxels, other, motion, voxel_mm=VOXEL, clearance_mm=CLEARANCE)
    both = Motion(motion.hinges, motion.angles_deg[[0, -1]], ((), (0, 1, 2)))
    full = voxels_of(tree.source, box_strip(8))
    with pytest.raises(GeometryError, match="at once"):
        build_bodies(full, tree, both, voxel_mm=VOXEL, clearance_mm=CLEARANCE)
