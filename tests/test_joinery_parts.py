"""The steps of joinery one by one: cells, grooves, sound meshes."""

from __future__ import annotations

import itertools

import manifold3d
import numpy as np
import pytest
from joinery_models import corner_tree, motion_of_order, strip_tree

from fabfold.errors import GeometryError
from fabfold.joinery.barrel_sweeps import Sweep, barrel_sweeps, descendants
from fabfold.joinery.cells import as_manifold, eroded_cells, occupancy
from fabfold.joinery.grooves import groove_tools
from fabfold.joinery.hinge_placement import hinge_frames
from fabfold.joinery.soundness import (
    mesh_faults,
    piece_count,
    printable_body,
    stl_mesh,
)
from fabfold.lattice.rotations import rotation_about
from fabfold.meshes import mesh_volume
from fabfold.solid.crossing import crossing_triangles

CELLS = {
    "one": [[0, 0, 0]],
    "pair": [[0, 0, 0], [1, 0, 0]],
    "corner": [[0, 0, 0], [1, 0, 0], [0, 1, 0]],
    "square": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]],
    "twisted": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1]],
    "cube": list(map(list, itertools.product((0, 1), repeat=3))),
    "cube less one": list(map(list, itertools.product((0, 1), repeat=3)))[:-1],
}


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(CELLS))
def test_eroded_cells_are_the_points_far_from_foreign_cells(name):
    cells = np.array(CELLS[name], dtype=np.int32)
    inset, side = 0.8, 10.0
    solid = eroded_cells(cells, side, inset)
    assert len(solid.decompose()) == 1
    rng = np.random.default_rng(0)
    points = rng.uniform(-0.6, 1.6, (3000, 3))
    own = {tuple(c) for c in cells.tolist()}
    # In L-infinity, a point is inside if the whole cube about it lies in the body's cells.
    shifts = np.array(list(itertools.product((-inset / side, inset / side), repeat=3)))
    corners = np.rint(points[:, None] + shifts).astype(int)
    wanted = np.array([all(tuple(c) in own for c in row) for row in corners.tolist()])
    for point, inside in zip(points[:300], wanted[:300], strict=True):
        tiny = manifold3d.Manifold.cube((1e-3,) * 3, True).translate(tuple(side * point))
        assert ((tiny ^ solid).volume() > 0.5e-9) == inside
    share = solid.volume() / (2.2 * side) ** 3
    assert share == pytest.approx(wanted.mean(), abs=4 * np.sqrt(wanted.mean() / len(points)))


def test_occupancy_agrees_with_a_known_solid():
    ball = manifold3d.Manifold.sphere(4.0, 64) - manifold3d.Manifold.sphere(2.0, 64)
    grid = occupancy(ball, np.full(3, -4.75), 0.5, (20, 20, 20))
    axis = -4.75 + 0.5 * np.arange(20)
    radius = np.linalg.norm(np.stack(np.meshgrid(axis, axis, axis, indexing="ij")), axis=0)
    clear = (np.abs(radius - 4.0) > 0.05) & (np.abs(radius - 2.0) > 0.05)
    assert (grid == ((radius < 4.0) & (radius > 2.0)))[clear].all()


def test_open_mesh_is_refused():
    box = manifold3d.Manifold.cube((1, 1, 1)).to_mesh64()
    faces = np.array(box.tri_verts)[:-1]
    with pytest.raises(GeometryError, match="torn: not a closed two-manifold"):
        as_manifold(np.array(box.vert_properties), faces, "torn")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("start", "direction"),
    [
        ([[2.0, -0.5, 0.0], [2.0, 0.5, 0.0]], [0.0, 1.0, 0.0]),  # barrel along the axis
        ([[2.0, 0.0, -0.5], [2.0, 0.0, 0.5]], [0.0, 1.0, 0.0]),  # across, on the rim
        ([[1.5, 0.0, 0.0], [2.5, 0.0, 0.0]], [0.0, 1.0, 0.0]),  # across, like a spoke
        ([[0.5, 0.0, -0.5], [0.5, 0.0, 0.5]], [0.0, 0.0, 1.0]),
    ],
)
@pytest.mark.parametrize("angle", [90.0, -180.0])
def test_groove_holds_the_swept_barrel_and_little_more(start, direction, angle):
    side, radius, trim = 20.0, 2.8, 2.5
    sweep = Sweep(0, 0, np.array(start), np.zeros(3), np.array(direction), angle)
    box = np.full((1, 3), 4.0)
    tools = groove_tools([sweep], -box, box, voxel_mm=side, radius_mm=radius, trim_mm=trim)
    groove = manifold3d.Manifold.batch_boolean([tool for _, tool in tools], manifold3d.OpType.Add)

    def distance(points, angles):
        """From points to the barrel's groove cylinder at each angle, shape (points, angles)."""
        ends = side * sweep.placements(angles)
        along = ends[:, 1] - ends[:, 0]
        length = np.linalg.norm(along, axis=1)
        along = along / length[:, None]
        away = points[:, None] - ends.mean(axis=1)
        height = (away * along).sum(axis=2)
        across = np.linalg.norm(away - height[..., None] * along, axis=2)
        beyond = np.abs(height) - (length / 2 - trim)
        return np.hypot(np.maximum(across - radius, 0), np.maximum(beyond, 0))

    angles = np.linspace(0.0, angle, 361)
    rng = np.random.default_rng(1)
    low, high = np.array(groove.bounding_box()).reshape(2, 3)
    points = rng.uniform(low, high, (2000, 3))
    inside = np.array([_inside(groove, point) for point in points])
    nearest = distance(points, angles).min(axis=1)
    assert (nearest == 0.0).sum() > 50
    assert inside[nearest == 0.0].all()
    # A barrel along the axis is followed to hundredths of a millimetre; one across it turns on
    # itself between two steps, and the groove spares what lies between.
    parallel = abs(float(np.dot(sweep.axis, sweep.points[1] - sweep.points[0]))) > 0.5
    assert nearest[inside].max() < (0.06 if parallel else 0.06 + 0.02 * side)


def _inside(solid, point) -> bool:
    hits = solid.ray_cast(tuple(point), (point[0], point[1], 1000.0))
    return len(hits) % 2 == 1


def test_placements_turn_about_the_axis():
    start = np.array([[1.0, 2.0, 3.0], [1.0, 3.0, 3.0]])
    sweep = Sweep(0, 0, start, np.array([0.5, 0.5, 0.5]), np.array([0.0, 0.0, 1.0]), 90.0)
    for angle, ends in zip((30.0, 90.0), sweep.placements(np.array([30.0, 90.0])), strict=True):
        turn = rotation_about(sweep.axis_point, sweep.axis, angle)
        assert ends == pytest.approx(start @ turn[:3, :3].T + turn[:3, 3])


def test_sweeps_find_every_barrel_that_comes_near():
    """Compare with brute force: dense poses, every barrel against every cell."""
    tree = corner_tree()
    motion = motion_of_order(tree, [0, 1])
    reach = 0.14
    found = {(s.body, s.owner) for s in barrel_sweeps(tree, motion, reach)}
    wanted = set()
    for start, end in itertools.pairwise(motion.angles_deg):
        for share in np.linspace(0, 1, 46):
            poses = tree.body_poses((1 - share) * start + share * end)
            for h, hinge in enumerate(tree.hinges):
                ends = np.array(
                    [
                        np.array(hinge.point) + s * 0.5 * np.array(hinge.direction)
                        for s in np.linspace(-1, 1, 41)
                    ]
                )
                placed = ends @ poses[hinge.parent][:3, :3].T + poses[hinge.parent][:3, 3]
                for b in range(len(tree.bodies)):
                    if b in (hinge.parent, hinge.child):
                        continue
                    local = (placed - poses[b][:3, 3]) @ poses[b][:3, :3]
                    away = np.maximum(np.abs(local - tree.source[b]) - 0.5, 0.0)
                    if np.linalg.norm(away, axis=1).min() < reach - 1e-9:
                        wanted.add((b, h))
    assert wanted
    assert wanted <= found
    assert all(b not in (tree.hinges[h].parent, tree.hinges[h].child) for b, h in found)


def test_descendants_of_a_chain():
    carried = descendants(strip_tree(8, [1, -1, 1]))
    assert carried.tolist() == [
        [False, True, True, True],
        [False, False, True, True],
        [False, False, False, True],
    ]


def test_hinge_frames_point_from_parent_to_child_and_outwards():
    frames = hinge_frames(corner_tree())
    assert frames[0, :, 0].tolist() == [1, 0, 0]
    assert frames[0, :, 1].tolist() == [0, 1, 0]
    assert frames[1, :, 0].tolist() == [0, 0, 1]
    assert frames[1, :, 1].tolist() == [-1, 0, 0]
    assert np.linalg.det(frames[:, :, :3]) == pytest.approx([1.0, 1.0])


def two_cubes(shift: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Two unit cubes as triangles with the corners that they share merged."""
    one = manifold3d.Manifold.cube((1, 1, 1)).to_mesh64()
    vertices = np.array(one.vert_properties)
    faces = np.array(one.tri_verts, dtype=np.int32)
    return stl_mesh(
        np.concatenate([vertices, vertices + shift]), np.concatenate([faces, faces + len(vertices)])
    )


def test_faults_of_meshes():
    vertices, faces = two_cubes((3, 0, 0))
    assert len(mesh_faults(vertices, faces)) == 0
    assert piece_count(vertices, faces) == 2
    vertices, faces = two_cubes((1, 1, 1))  # one corner in common
    assert vertices[mesh_faults(vertices, faces)].tolist() == [[[1, 1, 1]] * 2]
    vertices, faces = two_cubes((1, 1, 0))  # an edge in common
    assert vertices[mesh_faults(vertices, faces)].tolist() == [[[1, 1, 0], [1, 1, 1]]]
    assert len(mesh_faults(vertices, faces[1:])) > 0


def test_stl_mesh_merges_what_single_precision_cannot_tell_apart():
    vertices = np.array([[100, 0, 0], [100 + 1e-7, 0, 0], [0, 1, 0], [0, 0, 1], [-0.0, 0, 1]])
    faces = np.array([[0, 2, 3], [1, 2, 4], [0, 1, 2]])
    merged, kept = stl_mesh(vertices, faces)
    assert len(merged) == 3
    assert len(kept) == 2  # the third triangle had lost a corner


def test_body_that_touches_itself_is_nicked_apart():
    # A C-shaped body whose two ends meet along an edge.
    cube = manifold3d.Manifold.cube
    parts = [
        cube((10, 10, 10)),
        cube((10, 10, 10)).translate((10, 10, 0)),
        cube((30, 5, 10)).translate((-5, -5, 0)),
        cube((5, 30, 10)).translate((20, -5, 0)),
    ]
    body = manifold3d.Manifold.batch_boolean(parts, manifold3d.OpType.Add)
    vertices, faces = printable_body(body, "body-00", np.zeros(3))
    assert len(mesh_faults(vertices, faces)) == 0
    assert piece_count(vertices, faces) == 1
    solid = as_manifold(vertices, faces, "body-00")
    assert solid.volume() == pytest.approx(body.volume(), rel=1e-3)
    with pytest.raises(GeometryError, match="nothing is left"):
        printable_body(manifold3d.Manifold(), "body-00", np.zeros(3))


def test_slivers_that_cross_once_they_are_rounded_are_collapsed():
    # Cylinders that all but coincide leave slivers of micrometres.
    rng = np.random.default_rng(2)
    parts = []
    for _ in range(12):
        tilt, shift = rng.uniform(-0.2, 0.2, 3).tolist(), rng.uniform(-0.004, 0.004, 3).tolist()
        turned = manifold3d.Manifold.cylinder(10.0, 3.0, 3.0, 64).rotate(tuple(tilt))
        parts.append(turned.translate(tuple(shift)))
    solid = manifold3d.Manifold.batch_boolean(parts, manifold3d.OpType.Add)
    origin = np.array([3000.0, 3000.0, 3000.0])  # where single precision is coarse
    rough = solid.as_original().simplify(0.001).translate(tuple(origin)).to_mesh64()
    assert len(crossing_triangles(*stl_mesh(rough.vert_properties[:, :3], rough.tri_verts))) > 0
    vertices, faces = printable_body(solid, "body", origin)
    assert len(crossing_triangles(vertices, faces)) == 0
    assert mesh_volume(vertices, faces) == pytest.approx(solid.volume(), rel=1e-3)
