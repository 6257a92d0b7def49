"""STEP: one valid named solid a body, round where the hinges are, the same bytes every time."""

from __future__ import annotations

import hashlib
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import manifold3d as m3
import numpy as np
import pytest
import trimesh
from build123d import import_step
from export_kits import BARREL_MM, CLEARANCE_MM, row_joinery, row_tree

from fabfold.errors import GeometryError
from fabfold.export.body_brep import brep_of
from fabfold.export.round_faces import round_regions
from fabfold.export.step import write_step
from fabfold.export.steptext import StepSolid, _string, step_text
from fabfold.export.surfaces import Axis, Plane, Round, flat_regions
from fabfold.export.thin import thinned
from fabfold.export.weld import without_needles
from fabfold.joinery.bodies import BodyMesh, Joinery
from fabfold.meshes import is_closed, mesh_volume


def _mesh(solid: m3.Manifold) -> tuple[np.ndarray, np.ndarray]:
    mesh = solid.to_mesh64()
    return np.array(mesh.vert_properties[:, :3]), np.array(mesh.tri_verts, dtype=np.int32)


def _joinery(*solids: m3.Manifold) -> Joinery:
    return _joinery_of(*(BodyMesh(f"body-{i:02d}", *_mesh(s)) for i, s in enumerate(solids)))


def _joinery_of(*bodies: BodyMesh) -> Joinery:
    return Joinery(bodies, 20.0, (0.0, 0.0, 0.0), 0.3, 2.5, 1.5, 3)


def _read(path: Path):
    return import_step(path)


def _valid(solid) -> bool:
    return bool(solid.is_valid() if callable(solid.is_valid) else solid.is_valid)


@pytest.fixture(scope="module")
def row(tmp_path_factory):
    path = tmp_path_factory.mktemp("step") / "row.step"
    tree = row_tree()
    joinery = row_joinery(tree)
    facts = write_step(path, joinery, tree, title="Row")
    return SimpleNamespace(path=path, joinery=joinery, facts=facts, shape=_read(path))


def test_one_valid_named_solid_a_body(row):
    assert [child.label for child in row.shape.children] == [b.name for b in row.joinery.bodies]
    solids = row.shape.solids()
    assert len(solids) == row.facts.solids == 4
    for solid, body in zip(solids, row.joinery.bodies, strict=True):
        assert _valid(solid)
        assert solid.volume == pytest.approx(body.volume, rel=2e-3)
        box = solid.bounding_box()
        assert tuple(box.min) == pytest.approx(body.vertices.min(axis=0), abs=0.02)
        assert tuple(box.max) == pytest.approx(body.vertices.max(axis=0), abs=0.02)
    assert row.facts.plain == ()


def test_barrels_and_grooves_are_true_cylinders(row):
    radii = sorted(
        {
            round(face.radius, 2)
            for solid in row.shape.solids()
            for face in solid.faces()
            if face.geom_type.name == "CYLINDER"
        }
    )
    assert radii == [BARREL_MM, BARREL_MM + CLEARANCE_MM]
    # The first body has a box's faces and two whole barrels, cut in halves, with their grooves.
    assert len(row.shape.solids()[0].faces()) < 30


@pytest.mark.slow
def test_without_a_tree_every_face_is_flat(tmp_path, row):
    facts = write_step(tmp_path / "flat.step", row.joinery)
    assert facts.round_faces == 0
    shape = _read(tmp_path / "flat.step")
    assert all(f.geom_type.name == "PLANE" for f in shape.faces())
    assert sum(s.volume for s in shape.solids()) == pytest.approx(
        sum(b.volume for b in row.joinery.bodies), rel=1e-6
    )


def test_holes_and_cavities_keep_their_volume(tmp_path):
    plate = m3.Manifold.cube((30, 20, 5)) - m3.Manifold.cube((5, 5, 9)).translate((5, 5, -1))
    plate -= m3.Manifold.cylinder(9, 3, 3, 24).translate((20, 10, -1))
    write_step(tmp_path / "plate.step", _joinery(plate))
    (solid,) = _read(tmp_path / "plate.step").solids()
    assert _valid(solid)
    assert solid.volume == pytest.approx(plate.volume(), rel=1e-6)
    assert len(solid.faces()) == 6 + 4 + 24


@pytest.mark.slow
def test_a_body_that_the_kernel_refuses_is_written_flat(tmp_path, monkeypatch):
    from fabfold.export import step

    tree = row_tree()
    joinery = row_joinery(tree, bump=False)
    measured = step._measured
    refused = []

    def strict(text: str) -> tuple[bool, float]:
        if "'body-01'" in text and "CYLINDRICAL_SURFACE" in text:
            refused.append(text)
            return False, 0.0
        return measured(text)

    monkeypatch.setattr(step, "_measured", strict)
    facts = write_step(tmp_path / "row.step", joinery, tree)
    assert len(refused) == 4  # thinned, the same simplified and without slivers, and not thinned
    assert facts.plain == ("body-01",)
    solids = _read(tmp_path / "row.step").solids()
    assert all(_valid(solid) for solid in solids)
    kinds = [{face.geom_type.name for face in solid.faces()} for solid in solids]
    assert kinds[1] == {"PLANE"}
    assert kinds[2] == {"PLANE", "CYLINDER"}


@pytest.mark.slow
def test_triangles_alone_make_a_valid_solid(tmp_path, monkeypatch):
    from fabfold.export import step

    monkeypatch.setattr(step, "_LEVELS", (("triangles", 0.0, False),))
    ball = m3.Manifold.sphere(10, 24) - m3.Manifold.cube((10, 10, 10))
    write_step(tmp_path / "ball.step", _joinery(ball))
    (solid,) = _read(tmp_path / "ball.step").solids()
    assert _valid(solid)
    assert len(solid.faces()) == ball.num_tri()
    assert solid.volume == pytest.approx(ball.volume(), rel=1e-4)


def test_a_face_that_crosses_itself_by_less_than_a_thousandth_is_mended(tmp_path):
    from fabfold.export import step

    rim = [(0, 0), (10, 0), (10, 10), (5, 10), (5.0006, 9.9997), (4.9998, 10.0003), (0, 10)]
    count = len(rim)
    vertices = np.array([(x, y, z) for z in (0.0, 4.0) for x, y in [*rim, (4.0, 4.0)]])
    faces = []
    for k in range(count):
        a, b, up = k, (k + 1) % count, count + 1
        faces += [(b, a, count), (a + up, b + up, count + up), (a, b, b + up), (a, b + up, a + up)]
    body = BodyMesh("body-00", vertices, np.array(faces, dtype=np.int32))
    wanted = mesh_volume(body.vertices, body.faces)
    crossing = step._brep(*without_needles(vertices, body.faces, 2e-5), [], "flat", 0.0)
    assert not step._measured(step_text([StepSolid("a", crossing, (0, 0, 0))], "a", "b"))[0]
    facts = write_step(tmp_path / "mended.step", _joinery_of(body))
    (solid,) = _read(tmp_path / "mended.step").solids()
    assert _valid(solid)
    assert solid.volume == pytest.approx(wanted, rel=1e-4)
    assert facts.plain == ()
    assert len(solid.faces()) < len(faces)


def test_a_triangle_whose_corners_lie_on_one_line_is_taken_away(tmp_path):
    from fabfold.export import step

    vertices, faces = _mesh(m3.Manifold.cube((10, 20, 30)))
    # One face of an edge meets it in its middle, the other does not: a triangle of no area is left.
    a, b = faces[0, 0], faces[0, 1]
    middle, corner = len(vertices), faces[0, 2]
    vertices = np.vstack([vertices, (vertices[a] + vertices[b]) / 2])
    split = [(a, middle, corner), (middle, b, corner), (a, b, middle)]
    faces = np.vstack([faces[1:], np.array(split, faces.dtype)])
    body = BodyMesh("body-00", vertices, faces.astype(np.int32))
    assert mesh_volume(vertices, body.faces) == pytest.approx(6000.0)
    as_it_is = step._brep(vertices, body.faces, [], "triangles", 0.0)
    assert not step._measured(step_text([StepSolid("a", as_it_is, (0, 0, 0))], "a", "b"))[0]
    facts = write_step(tmp_path / "box.step", _joinery_of(body))
    (solid,) = _read(tmp_path / "box.step").solids()
    assert _valid(solid)
    assert solid.volume == pytest.approx(6000.0)
    assert facts.plain == ()
    assert len(solid.faces()) == 6


def test_a_mesh_that_is_no_solid_is_named(tmp_path):
    vertices, faces = _mesh(m3.Manifold.cube((1, 1, 1)))
    inside_out = BodyMesh("body-03", vertices, np.ascontiguousarray(faces[:, ::-1]))
    with pytest.raises(GeometryError, match="body-03"):
        write_step(tmp_path / "x.step", _joinery_of(inside_out))
    assert not (tmp_path / "x.step").exists()


def test_header_holds_no_clock_and_text_is_ascii(row):
    text = row.path.read_text(encoding="ascii")
    assert "'1970-01-01T00:00:00'" in text
    assert "FILE_NAME('Row'" in text
    assert _string("Bär's") == "'B\\X4\\000000E4\\X0\\r''s'"


_WRITE = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[2])
from export_kits import row_joinery, row_tree
from fabfold.export.step import write_step
tree = row_tree()
write_step(Path(sys.argv[1]), row_joinery(tree), tree, title="Row")
"""


@pytest.mark.slow
def test_another_process_writes_the_same_bytes(tmp_path, row):
    path = tmp_path / "other.step"
    subprocess.run(
        [sys.executable, "-c", _WRITE, str(path), str(Path(__file__).parent)], check=True
    )
    assert (
        hashlib.sha256(path.read_bytes()).digest() == hashlib.sha256(row.path.read_bytes()).digest()
    )


# regions and edges ----------------------------------------------------------------------------


def test_flat_regions_of_a_box_and_the_edges_they_share():
    vertices, faces = _mesh(m3.Manifold.cube((3, 4, 5)).refine(3))
    labels, planes = flat_regions(vertices, faces)
    assert len(planes) == 6
    brep = brep_of(vertices, faces, labels, planes)
    assert len(brep.edges) == 12
    assert all(len(face.loops) == 1 and len(face.loops[0]) == 4 for face in brep.faces)


def test_round_regions_find_a_barrel_with_a_cone():
    barrel = m3.Manifold.cylinder(6, 2.5, 2.5, 64) + m3.Manifold.cylinder(
        1.3, 1.5, 0.2, 64
    ).translate((0, 0, 6))
    vertices, faces = _mesh(barrel)
    labels, planes = flat_regions(vertices, faces)
    axis = Axis((0.0, 0.0, 3.0), 2, 10.0, 4.2)
    labels, surfaces = round_regions(vertices, faces, labels, planes, [axis])
    rounds = [s for s in surfaces if isinstance(s, Round)]
    assert sorted((round(s.radius, 2), round(s.slope, 2)) for s in rounds) == [
        (2.5, 0.0),
        (2.5, 0.0),
        (4.5, -1.0),
        (4.5, -1.0),
    ]
    assert all(s.outward for s in rounds)
    assert sum(isinstance(s, Plane) for s in surfaces) == 3


def test_round_regions_leave_a_slanted_cut_flat():
    barrel = m3.Manifold.cylinder(6, 2.5, 2.5, 64)
    cut = barrel.trim_by_plane((0.3, 0.2, -1.0), -4.0)
    vertices, faces = _mesh(cut)
    labels, planes = flat_regions(vertices, faces)
    axis = Axis((0.0, 0.0, 3.0), 2, 10.0, 4.2)
    _, surfaces = round_regions(vertices, faces, labels, planes, [axis])
    assert not any(isinstance(s, Round) for s in surfaces)


def test_a_chamfer_is_no_barrel():
    block = m3.Manifold.cube((10, 10, 10)).trim_by_plane((-1, -1, 0), -16)
    vertices, faces = _mesh(block)
    labels, planes = flat_regions(vertices, faces)
    axes = [Axis((10.0, 10.0, 5.0), 2, 10.0, 8.0)]
    _, surfaces = round_regions(vertices, faces, labels, planes, axes)
    assert not any(isinstance(s, Round) for s in surfaces)


def test_thinned_keeps_the_rest_and_the_shape():
    ball = m3.Manifold.sphere(10, 96)
    vertices, faces = _mesh(ball.trim_by_plane((0, 0, 1), -4))
    flat = np.abs(vertices[faces][:, :, 2] + 4).max(axis=1) < 1e-9
    points, triangles = thinned(vertices, faces, ~flat, 0.1)
    assert is_closed(triangles)
    assert len(triangles) < 0.5 * len(faces)
    assert mesh_volume(points, triangles) == pytest.approx(mesh_volume(vertices, faces), rel=3e-3)
    rim = np.unique(vertices[np.abs(vertices[:, 2] + 4) < 1e-9].round(9), axis=0)
    kept = np.unique(points[np.abs(points[:, 2] + 4) < 1e-9].round(9), axis=0)
    assert np.array_equal(rim, kept)
    assert (np.linalg.norm(points, axis=1) < 10.1).all()


@pytest.mark.parametrize("tolerance", [0.02, 0.05, 0.2])
def test_thinned_stays_within_its_bound(tolerance):
    # A ball in a thin disc: few triangles change the volume little and the shape much.
    shape = m3.Manifold.sphere(10, 96) + m3.Manifold.cylinder(0.6, 14, 13.5, 96, True)
    vertices, faces = _mesh(shape)
    points, triangles = thinned(vertices, faces, np.ones(len(faces), dtype=bool), tolerance)
    assert len(triangles) < len(faces)
    for one, other in (((vertices, faces), points), ((points, triangles), vertices)):
        away = trimesh.proximity.closest_point(trimesh.Trimesh(*one, process=False), other)[1]
        assert away.max() <= tolerance + 1e-4  # MeshLab measures in single precision


def test_thinned_gives_back_what_it_cannot_thin():
    vertices, faces = _mesh(m3.Manifold.cube((1, 1, 1)))
    points, triangles = thinned(vertices, faces, np.ones(12, dtype=bool), 0.1)
    assert points is vertices and triangles is faces


def test_an_edge_of_one_last_digit_is_joined_and_longer_ones_stay():
    vertices, faces = _mesh(m3.Manifold.cube((1, 1, 1)))
    a, b, c = faces[0].tolist()
    (d,) = set(next(f for f in faces.tolist() if b in f and a in f and c not in f)) - {a, b}
    p, q = len(vertices), len(vertices) + 1
    middle = (vertices[a] + vertices[b]) / 2
    for length in (4e-6, 4e-3):
        points = np.vstack([vertices, middle, middle + length * (vertices[b] - vertices[a])])
        others = [f for f in faces.tolist() if not (a in f and b in f)]
        split = [[a, p, c], [p, q, c], [q, b, c], [b, q, d], [q, p, d], [p, a, d]]
        mesh = np.array(others + split)
        assert is_closed(mesh)
        joined, triangles = without_needles(points, mesh, 2e-5)
        gone = 2 if length < 2e-5 else 0
        assert len(triangles) == len(mesh) - gone and is_closed(triangles)
        assert len(joined) == len(points) - gone // 2
        assert mesh_volume(joined, triangles) == pytest.approx(1.0, abs=1e-12)
