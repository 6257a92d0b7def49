"""Bodies as chamfered blocks, and walls behind the faces that a cut makes."""

import joinery_models
import manifold3d
import numpy as np
import pytest

from fabfold.fold.motion import Motion
from fabfold.joinery.build import build_bodies
from fabfold.joinery.cells import eroded_cells, model_manifold, solids_of
from fabfold.joinery.cut_walls import with_cut_walls
from fabfold.joinery.lattice_skin import blocks_of
from fabfold.meshes import face_normals
from fabfold.printing.profiles import load_profile
from fabfold.printing.wall_checks import thin_share
from fabfold.proof.certify import certify

SIDE, INSET, LEG = 20.0, 0.25, 1.0


def filled(solid, points):
    """Which points lie inside a solid."""
    tiny = manifold3d.Manifold.cube((1e-3,) * 3, True)
    return [(solid ^ tiny.translate(tuple(map(float, p)))).volume() > 5e-10 for p in points]


def cells(*rows):
    return np.array(rows, dtype=np.int32)


def test_a_single_cell_is_a_cube_with_twelve_chamfers():
    solid = eroded_cells(cells((0, 0, 0)), SIDE, INSET, chamfer_mm=LEG)
    a = SIDE - 2 * INSET
    cube = manifold3d.Manifold.cube((a, a, a), True)
    for axis in range(3):
        for i, j in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            normal = np.insert(np.array([i, j], dtype=float), axis, 0.0) / np.sqrt(2)
            cube = cube.trim_by_plane(tuple(-normal), -(a - LEG) / np.sqrt(2))
    # A corner of the hull is cut off once more, by the plane through its three points.
    for corner in np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, -1).T:
        normal = corner / np.sqrt(3)
        cube = cube.trim_by_plane(tuple(-normal), -(1.5 * a - 2 * LEG) / np.sqrt(3))
    assert solid.volume() == pytest.approx(cube.volume(), rel=1e-9)
    assert (solid - cube).volume() < 1e-6
    assert solid.num_tri() <= 44


def test_blocks_have_no_dents_where_their_cells_meet():
    corner = cells((0, 0, 0), (1, 0, 0), (0, 1, 0))
    solid = eroded_cells(corner, SIDE, INSET, chamfer_mm=LEG)
    plain = eroded_cells(corner, SIDE, INSET)
    assert (solid - plain).volume() < 1e-6
    top = SIDE / 2 - INSET - 1e-2
    on_top = [(x, y, top) for x in (8.0, 10.0, 12.0) for y in (-8.0, 0.0, 8.0)]
    on_top += [(x, y, top) for x in (-8.0, 0.0, 8.0) for y in (10.0, 12.0)]
    assert all(filled(solid, on_top))
    edge = SIDE / 2 - INSET
    outer = [(10.0, -edge + 0.3, edge - 0.3), (-edge + 0.3, 10.0, edge - 0.3)]
    inner = [(20.0, edge - 0.3, edge - 0.3), (edge - 0.3, 20.0, edge - 0.3)]
    assert not any(filled(solid, [*outer, *inner]))
    # Inside the corner of the three cells the two chamfers meet in a mitre.
    assert filled(solid, [(edge - 1.1, edge - 1.1, top), (edge - 0.5, edge - 0.5, top)]) == [
        True,
        False,
    ]


@pytest.fixture(scope="module")
def blocks():
    """A strip of thin bars, as blocks."""
    tree = joinery_models.strip_tree(4, [1])
    solid = manifold3d.Manifold.cube((3.9, 0.4, 0.4), True).translate((1.5, 0.25, 0.0))
    voxels = joinery_models.voxels_of(tree.source, solid)
    motion: Motion = joinery_models.motion_of_order(tree, [0])
    joinery = build_bodies(
        blocks_of(voxels), tree, motion, voxel_mm=SIDE, clearance_mm=0.5, chamfer_mm=LEG
    )
    return tree, motion, joinery, voxels


def test_blocks_fill_their_cells_and_have_plane_faces_only(blocks):
    tree, _, joinery, voxels = blocks
    assert blocks_of(voxels).subvoxels.all()
    assert len(blocks_of(voxels)) == len(voxels)
    whole = eroded_cells(tree.source[:2], SIDE, INSET, chamfer_mm=LEG).volume()
    assert all(0.93 * whole < body.volume < 1.01 * whole for body in joinery.bodies)
    for body in joinery.bodies:
        normals, areas = face_normals(body.vertices[body.faces])
        straight = np.sort(np.abs(normals), axis=1)
        plane = (straight[:, 2] > 0.9999) | (np.abs(straight[:, 1] - straight[:, 2]) < 1e-3)
        # The rest is the hinge.
        assert areas[plane].sum() > 0.9 * areas.sum()


def test_blocks_fold_with_the_gap(blocks):
    tree, motion, joinery, _ = blocks
    meshes = [(body.vertices, body.faces) for body in joinery.bodies]
    proof = certify(tree, motion, meshes, SIDE, joinery.origin_mm, 0.4)
    assert proof["min_gap_mm"] >= 0.4


def notch(*outline):
    """What a notch with an outline in x and z takes from a bar."""
    tool = manifold3d.CrossSection([list(outline)]).extrude(2.0).translate((0.0, 0.0, -1.0))
    return tool.transform(np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0]], dtype=float))


def blade():
    """A bar of four cells; right of the cut at x = 1.5 a blade stands, 0 to 1 mm thick."""
    cut = notch((1.5, 0.0), (2.3, 0.0), (2.3, 0.6), (1.56, 0.6))
    return joinery_models.box_strip(4) - cut


def test_a_blade_at_a_cut_gets_its_wall_and_nothing_else_changes():
    tree = joinery_models.strip_tree(4, [1])
    voxels = joinery_models.voxels_of(tree.source, blade())
    model = model_manifold(voxels, SIDE)
    wall = 0.8
    thick, added = with_cut_walls(model, tree, SIDE, INSET, wall)
    face = 1.5 * SIDE + INSET
    right = eroded_cells(tree.source[2:], SIDE, INSET)
    left = eroded_cells(tree.source[:2], SIDE, INSET)
    # The blade is 0.1 z thick from the cut on; the body begins 0.25 mm behind it.
    heights = np.array([4.0, 6.0, 9.0])
    before = [(face + 0.7, 0.0, z) for z in heights]
    assert filled(model ^ right, before) == [False, False, False]
    assert filled(thick ^ right, before) == [True, True, True]
    beyond = [(face + wall + 0.02, 0.0, z) for z in heights]
    assert not any(filled(thick ^ right, beyond))
    # All that is new lies within a wall of the cut, in the body's own cells.
    new = (thick ^ right) - (model ^ right)
    assert new.volume() == pytest.approx(added, rel=1e-3)
    low_x, *_, high_x, _, _ = new.bounding_box()
    assert face - 1e-6 <= low_x
    assert high_x <= face + wall + 0.011
    assert ((thick ^ left) - model).volume() < 1e-6
    assert (model - thick).volume() < 1e-6


def test_a_bar_without_blades_is_left_as_it_is():
    tree = joinery_models.strip_tree(4, [1])
    voxels = joinery_models.voxels_of(tree.source, joinery_models.box_strip(4))
    model = model_manifold(voxels, SIDE)
    same, added = with_cut_walls(model, tree, SIDE, INSET, 0.8)
    assert same is model
    assert added == 0.0


def test_bodies_with_walls_are_sound_and_say_so():
    tree = joinery_models.strip_tree(4, [1])
    voxels = joinery_models.voxels_of(tree.source, blade())
    motion = joinery_models.motion_of_order(tree, [0])
    joinery = build_bodies(voxels, tree, motion, voxel_mm=SIDE, clearance_mm=0.5, wall_mm=0.8)
    assert any("less than a wall of 0.8 mm" in note for note in joinery.notes)
    assert all(len(solid.decompose()) == 1 for solid in solids_of(joinery.bodies))


def test_the_check_of_thin_surface_passes_where_blades_made_it_fail():
    """Blades on both sides of the cut, 0.3 to 0.7 mm thick where they begin and end."""
    tree = joinery_models.strip_tree(4, [-1])
    solid = joinery_models.box_strip(4)
    for way in (1.0, -1.0):
        corners = [(0.03, -0.3), (1.2, -0.3), (1.2, 0.6), (0.055, 0.6)]
        outline = [(1.5 + way * x, z) for x, z in corners]
        solid -= notch(*outline[:: int(way)])
    voxels = joinery_models.voxels_of(tree.source, solid)
    motion = joinery_models.motion_of_order(tree, [0])
    profile = load_profile("fdm-pla-0.4")
    checks = []
    for wall in (0.0, profile.min_wall_mm):
        joinery = build_bodies(voxels, tree, motion, voxel_mm=SIDE, clearance_mm=0.5, wall_mm=wall)
        checks.append(thin_share(joinery.bodies, solids_of(joinery.bodies), profile))
    assert [check.ok for check in checks] == [False, True]
    assert checks[1].figure < 0.3 * checks[0].figure
