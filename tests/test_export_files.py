"""STL, 3MF, GLB, colours and report: content, and the same bytes from run to run."""

from __future__ import annotations

import hashlib
import itertools
import json
import subprocess
import sys
import xml.etree.ElementTree as ET
import zipfile
from pathlib import Path
from types import SimpleNamespace

import lib3mf
import manifold3d as m3
import numpy as np
import pygltflib
import pytest
import trimesh
from export_kits import ROW, VOXEL_MM, row_joinery, row_motion, row_tree

from fabfold.errors import GeometryError
from fabfold.export.colours import _oklab, body_colours, palette
from fabfold.export.glb import keyframe_times, write_glb
from fabfold.export.report import write_report
from fabfold.export.shading import corner_normals, split_vertices
from fabfold.export.stl import write_stl
from fabfold.export.threemf import posed, write_3mf
from fabfold.export.weld import printable_mesh, weld_rounded
from fabfold.joinery.bodies import BodyMesh
from fabfold.meshes import is_closed
from fabfold.printing.checks import Check
from fabfold.srgb import hex_of_colour


@pytest.fixture(scope="module")
def kit():
    tree = row_tree()
    return SimpleNamespace(tree=tree, joinery=row_joinery(tree), motion=row_motion(tree))


def _mesh(solid: m3.Manifold) -> tuple[np.ndarray, np.ndarray]:
    mesh = solid.to_mesh64()
    return np.array(mesh.vert_properties[:, :3]), np.array(mesh.tri_verts, dtype=np.int32)


# weld -----------------------------------------------------------------------------------------


def test_weld_joins_what_rounds_to_one_point():
    vertices, faces = _mesh(m3.Manifold.cube((1, 1, 1)))
    soup = vertices[faces].reshape(-1, 3) + np.linspace(0, 1e-5, 36)[:, None]
    points, triangles = weld_rounded(soup, np.arange(36, dtype=np.int32).reshape(-1, 3), 3)
    assert len(points) == 8
    assert len(triangles) == 12
    assert is_closed(triangles)


def test_is_closed_sees_a_hole_and_a_flipped_triangle():
    _, faces = _mesh(m3.Manifold.cube((1, 1, 1)))
    assert is_closed(faces)
    assert not is_closed(faces[1:])
    flipped = faces.copy()
    flipped[0] = flipped[0, ::-1]
    assert not is_closed(flipped)
    assert not is_closed(np.empty((0, 3), dtype=np.int32))


def test_printable_mesh_closes_a_sliver_that_rounding_pinches():
    # Two blocks a tenth of a nanometre apart but joined elsewhere: rounding closes the slit.
    slit = m3.Manifold.cube((10, 10, 10)) - m3.Manifold.cube((5, 1e-7, 20)).translate((-1, 5, -5))
    vertices, faces = _mesh(slit)
    assert not is_closed(weld_rounded(vertices, faces)[1])
    points, triangles = printable_mesh(BodyMesh("body-00", vertices, faces))
    assert is_closed(triangles)
    assert points.dtype == np.float32


def test_printable_mesh_says_which_body_cannot_be_closed():
    vertices, faces = _mesh(m3.Manifold.cube((1, 1, 1)))
    with pytest.raises(GeometryError, match="body-07"):
        printable_mesh(BodyMesh("body-07", vertices * 1e-7 + 10, faces))


# STL ------------------------------------------------------------------------------------------


def test_stl_bodies_are_closed_and_keep_their_volume(tmp_path, kit):
    paths = write_stl(tmp_path / "bodies", kit.joinery)
    assert [p.name for p in paths] == [f"body-{i:02d}.stl" for i in range(4)]
    for path, body in zip(paths, kit.joinery.bodies, strict=True):
        mesh = trimesh.load_mesh(path)
        assert mesh.is_watertight and mesh.is_winding_consistent
        assert mesh.volume == pytest.approx(body.volume, rel=1e-4)
        assert mesh.bounds == pytest.approx(
            np.array([body.vertices.min(axis=0), body.vertices.max(axis=0)]), abs=1e-4
        )


# 3MF ------------------------------------------------------------------------------------------


def _read_3mf(path: Path):
    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(path))
    assert reader.GetWarningCount() == 0
    objects = []
    iterator = model.GetMeshObjects()
    while iterator.MoveNext():
        objects.append(iterator.GetCurrentMeshObject())
    return model, objects


def _items(model) -> int:
    return model.GetBuildItems().Count()


def _points(mesh_object) -> np.ndarray:
    return np.array([list(p.Coordinates) for p in mesh_object.GetVertices()])


@pytest.mark.parametrize("layout", ["kit", "assembly", "apart"])
def test_3mf_one_named_coloured_object_a_body(tmp_path, kit, layout):
    path = tmp_path / "kit.3mf"
    colours = body_colours(kit.tree)
    write_3mf(path, kit.joinery, title="Row", colours=colours, layout=layout)
    model, objects = _read_3mf(path)
    names = [b.name for b in kit.joinery.bodies]
    assert [o.GetName() for o in objects] == ([*names, "Row"] if layout == "kit" else names)
    assert _items(model) == (4 if layout == "apart" else 1)
    for found, body, colour in zip(objects, kit.joinery.bodies, colours, strict=False):
        assert found.IsManifoldAndOriented()
        points = _points(found)
        assert points.min(axis=0) == pytest.approx(body.vertices.min(axis=0), abs=1e-4)
        assert len(np.unique(points, axis=0)) == len(points)
        group, property_id, has = found.GetObjectLevelProperty()
        assert has
        shown = model.GetBaseMaterialGroupByID(group).GetDisplayColor(property_id)
        assert (shown.Red, shown.Green, shown.Blue) == tuple(int(c) for c in colour)
    box = model.GetOutbox()
    assert list(box.MinCoordinate) == pytest.approx([0, 0, 0], abs=1e-3)


def test_3mf_kit_names_the_parts_for_prusaslicer(tmp_path, kit):
    path = tmp_path / "kit.3mf"
    write_3mf(path, kit.joinery, title='Row <of "4">', thumbnail=b"png")
    _, (*_, whole) = _read_3mf(path)
    assert whole.IsManifoldAndOriented()
    config = ET.fromstring(zipfile.ZipFile(path).read("Metadata/Slic3r_PE_model.config"))
    assert zipfile.ZipFile(path).read("Metadata/thumbnail.png") == b"png"
    (entry,) = config.findall("object")
    assert int(entry.get("id")) == whole.GetModelResourceID()
    assert entry.find("metadata").get("value") == 'Row <of "4">'
    ranges = [(int(v.get("firstid")), int(v.get("lastid"))) for v in entry.findall("volume")]
    assert ranges[0][0] == 0
    assert ranges[-1][1] == whole.GetTriangleCount() - 1
    assert all(a[1] + 1 == b[0] for a, b in itertools.pairwise(ranges))
    names = [v.find("metadata[@key='name']").get("value") for v in entry.findall("volume")]
    assert names == [b.name for b in kit.joinery.bodies]


def test_3mf_metadata_is_given_back(tmp_path, kit):
    path = tmp_path / "kit.3mf"
    write_3mf(path, kit.joinery, title="Row", metadata={"Designer": "Ada & Co", "seed": "7"})
    model, _ = _read_3mf(path)
    group = model.GetMetaDataGroup()
    found = {}
    for i in range(group.GetMetaDataCount()):
        entry = group.GetMetaData(i)
        found[entry.GetName()] = entry.GetValue()
    assert found["Title"] == "Row"
    assert found["Designer"] == "Ada & Co"
    assert found["Application"].startswith("fabfold ")
    assert found["seed"] == "7"


def test_posed_moves_bodies_only(kit):
    poses = np.tile(np.eye(4), (4, 1, 1))
    poses[2, :3, 3] = (1, 2, 3)
    moved = posed(kit.joinery, poses)
    assert np.allclose(moved.bodies[2].vertices - kit.joinery.bodies[2].vertices, (1, 2, 3))
    assert np.array_equal(moved.bodies[1].vertices, kit.joinery.bodies[1].vertices)


# GLB ------------------------------------------------------------------------------------------


def _turn(quaternion: np.ndarray) -> np.ndarray:
    x, y, z, w = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def _read(gltf, index: int) -> np.ndarray:
    accessor = gltf.accessors[index]
    view = gltf.bufferViews[accessor.bufferView]
    width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor.type]
    dtype = {5126: "<f4", 5125: "<u4"}[accessor.componentType]
    assert view.byteOffset + view.byteLength <= gltf.buffers[0].byteLength
    assert view.byteLength == accessor.count * width * 4
    assert view.byteOffset % 4 == 0
    data = np.frombuffer(
        gltf.binary_blob(), dtype, count=accessor.count * width, offset=view.byteOffset
    ).reshape(-1, width)
    if accessor.min:
        assert np.array_equal(data.min(axis=0), np.array(accessor.min, dtype=dtype))
        assert np.array_equal(data.max(axis=0), np.array(accessor.max, dtype=dtype))
    return data


def _slerp(times: np.ndarray, keys: np.ndarray, at: float) -> np.ndarray:
    i = int(np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2))
    share = np.clip((at - times[i]) / (times[i + 1] - times[i]), 0, 1)
    a, b = keys[i].astype(float), keys[i + 1].astype(float)
    angle = np.arccos(np.clip(a @ b, -1, 1))
    if angle < 1e-7:
        return a
    return (np.sin((1 - share) * angle) * a + np.sin(share * angle) * b) / np.sin(angle)


def _world(gltf, at: float) -> dict[str, np.ndarray]:
    """World matrix of each node, by name, as a glTF player computes it."""
    rotation = {i: np.array(n.rotation or [0, 0, 0, 1.0]) for i, n in enumerate(gltf.nodes)}
    animation = gltf.animations[0]
    for channel in animation.channels:
        assert channel.target.path == "rotation"
        sampler = animation.samplers[channel.sampler]
        assert sampler.interpolation == "LINEAR"
        times = _read(gltf, sampler.input)[:, 0].astype(float)
        assert (np.diff(times) > 0).all()
        keys = _read(gltf, sampler.output)
        rotation[channel.target.node] = _slerp(times, keys, at)
    found = {}

    def visit(index: int, above: np.ndarray) -> None:
        node = gltf.nodes[index]
        local = np.eye(4)
        local[:3, :3] = _turn(rotation[index]) * np.array(node.scale or [1, 1, 1])
        local[:3, 3] = node.translation or [0, 0, 0]
        found[node.name] = above @ local
        for child in node.children or []:
            visit(child, found[node.name])

    visit(gltf.scenes[0].nodes[0], np.eye(4))
    return found


@pytest.fixture(scope="module")
def glb(tmp_path_factory, kit):
    path = tmp_path_factory.mktemp("glb") / "fold.glb"
    write_glb(path, kit.joinery, kit.tree, kit.motion, title="Row")
    return pygltflib.GLTF2().load(str(path))


def test_glb_has_a_node_a_body_with_sound_meshes(glb, kit):
    assert [n.name for n in glb.nodes] == ["Row"] + [b.name for b in kit.tree.bodies]
    assert len(glb.materials) == 4
    for mesh, body in zip(glb.meshes, kit.joinery.bodies, strict=True):
        (primitive,) = mesh.primitives
        points = _read(glb, primitive.attributes.POSITION)
        normals = _read(glb, primitive.attributes.NORMAL)
        faces = _read(glb, primitive.indices).reshape(-1, 3)
        assert faces.max() == len(points) - 1
        assert np.linalg.norm(normals, axis=1) == pytest.approx(1.0, abs=1e-5)
        corners = points[faces].astype(float)
        volume = np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
        assert volume == pytest.approx(body.volume, rel=1e-3)


def test_glb_animation_is_the_motion(glb, kit):
    rest = _world(glb, 0.0)
    origin = np.asarray(kit.joinery.origin_mm)
    to_mm = np.eye(4)
    to_mm[:3, :3] *= VOXEL_MM
    to_mm[:3, 3] = origin
    times = keyframe_times(kit.motion)
    assert times.tolist() == pytest.approx(glb.animations[0].extras["keyframe_times_s"])
    halves = [
        (
            (times[i] + times[i + 1]) / 2,
            (kit.motion.angles_deg[i] + kit.motion.angles_deg[i + 1]) / 2,
        )
        for i in range(len(times) - 1)
    ]
    for at, angles in [*zip(times, kit.motion.angles_deg, strict=True), *halves]:
        poses = kit.tree.body_poses(angles)
        world = _world(glb, float(at))
        for body, pose in zip(kit.tree.bodies, poses, strict=True):
            # A point of the body, given in shape A, seen by the player before and after.
            pose_mm = to_mm @ pose @ np.linalg.inv(to_mm)
            expected = world["Row"] @ pose_mm @ np.linalg.inv(world["Row"])
            found = world[body.name] @ np.linalg.inv(rest[body.name])
            assert found == pytest.approx(expected, abs=2e-6)


def test_glb_is_in_metres_with_y_up_and_stands_on_the_ground(glb, kit):
    world = _world(glb, 0.0)
    points = []
    for mesh, node in zip(glb.meshes, glb.nodes[1:], strict=True):
        local = _read(glb, mesh.primitives[0].attributes.POSITION)
        points.append(local @ world[node.name][:3, :3].T + world[node.name][:3, 3])
    low, high = np.concatenate(points).min(axis=0), np.concatenate(points).max(axis=0)
    everything = np.concatenate([b.vertices for b in kit.joinery.bodies])
    x, y, z = np.ptp(everything, axis=0) / 1000
    assert high - low == pytest.approx([x, z, y], abs=1e-6)
    assert low[1] == pytest.approx(0, abs=1e-6)


def test_glb_refuses_a_joinery_of_another_tree(tmp_path, kit):
    other = row_joinery(kit.tree)
    object.__setattr__(other, "bodies", other.bodies[:3])
    with pytest.raises(GeometryError, match="bodies"):
        write_glb(tmp_path / "x.glb", other, kit.tree, kit.motion)
    assert not (tmp_path / "x.glb").exists()


# shading, colours, report ---------------------------------------------------------------------


def test_corner_normals_are_smooth_on_a_ball_and_flat_on_a_box():
    vertices, faces = _mesh(m3.Manifold.sphere(10, 64))
    normals = corner_normals(vertices, faces)
    outward = vertices[faces] / 10
    assert (np.einsum("ijk,ijk->ij", normals, outward) > 0.995).all()
    vertices, faces = _mesh(m3.Manifold.cube((1, 2, 3)))
    normals = corner_normals(vertices, faces)
    assert np.allclose(np.sort(np.abs(normals), axis=2), [0, 0, 1])
    points, _, _ = split_vertices(vertices, faces)
    assert len(points) == 24


def test_palette_colours_differ_and_do_not_change_with_their_number():
    colours = palette(64)
    lab = _oklab(colours)
    apart = np.linalg.norm(lab[:, None] - lab[None], axis=2) + np.eye(64)
    assert apart.min() > 0.05
    assert np.array_equal(palette(20), colours[:20])
    assert hex_of_colour(colours[0].tolist()) == "#4e8fd6"
    assert palette(0).shape == (0, 3)


def test_body_colours_part_neighbours(kit):
    colours = body_colours(kit.tree)
    lab = _oklab(colours)
    for hinge in kit.tree.hinges:
        assert np.linalg.norm(lab[hinge.parent] - lab[hinge.child]) > 0.1
    assert len(np.unique(colours, axis=0)) == len(kit.tree.bodies)


def test_report_json_and_page(tmp_path):
    checks = [
        Check("least gap", np.float64(0.3), 0.2, "mm", True, "bodies stay apart"),
        Check("bodies", 4.0, 4.0, "", True, ""),
        Check("wall <thin>", float("nan"), 0.8, "mm", False, "use a larger voxel"),
    ]
    write_report(
        tmp_path,
        checks,
        {"model": "row", "hinges": len(ROW)},
        title="Row",
        pictures=[("A", b"png")],
    )
    data = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    assert (data["format"], data["version"], data["verdict"]) == ("fabfold-report", 1, "failed")
    assert [c["verdict"] for c in data["checks"]] == ["ok", "ok", "failed"]
    assert data["checks"][0] == {
        "name": "least gap",
        "figure": 0.3,
        "limit": 0.2,
        "unit": "mm",
        "verdict": "ok",
        "note": "bodies stay apart",
    }
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "1 of 3 checks failed" in page
    assert "wall &lt;thin&gt;" in page and "://" not in page


# the same bytes -------------------------------------------------------------------------------

_WRITE_ALL = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[2])
from export_kits import row_joinery, row_motion, row_tree
from fabfold.export.glb import write_glb
from fabfold.export.stl import write_stl
from fabfold.export.threemf import write_3mf
folder = Path(sys.argv[1])
tree = row_tree()
joinery = row_joinery(tree)
write_stl(folder / "bodies", joinery)
for layout in ("kit", "assembly", "apart"):
    write_3mf(folder / f"{layout}.3mf", joinery, title="Row", metadata={"seed": "1"}, layout=layout)
write_glb(folder / "fold.glb", joinery, tree, row_motion(tree))
"""


@pytest.mark.slow
def test_two_processes_write_the_same_bytes(tmp_path):
    digests = []
    for name in ("one", "two"):
        folder = tmp_path / name
        folder.mkdir()
        subprocess.run(
            [sys.executable, "-c", _WRITE_ALL, str(folder), str(Path(__file__).parent)], check=True
        )
        digests.append(
            {
                str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest()
                for p in sorted(folder.rglob("*"))
                if p.is_file()
            }
        )
    assert len(digests[0]) == 8
    assert digests[0] == digests[1]
