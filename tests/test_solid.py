"""Loading models: what is repaired, what is refused, and in which words."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from fabfold.errors import ModelError
from fabfold.meshes import is_closed
from fabfold.solid.closed_solid import Solid
from fabfold.solid.convert import to_manifold
from fabfold.solid.load import load_solid, solid_from_mesh
from fabfold.solid.raw import RawMesh

MODELS = Path(__file__).parents[2] / "shared" / "models"

# ---- small meshes ------------------------------------------------------------------------------

CUBE_V = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
CUBE_F = np.array(
    [
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ]
)  # fmt: skip


def cube(side: float = 1.0, at: tuple[float, float, float] = (0, 0, 0)) -> np.ndarray:
    """Twelve triangles, shape (12, 3, 3)."""
    return CUBE_V[CUBE_F] * side + np.array(at)


def ball(radius: float = 1.0, at: tuple[float, float, float] = (0, 0, 0)) -> np.ndarray:
    import trimesh

    mesh = trimesh.creation.icosphere(subdivisions=3, radius=radius)
    return np.asarray(mesh.triangles) + np.array(at)


def raw(triangles: np.ndarray) -> RawMesh:
    triangles = np.asarray(triangles, dtype=float)
    return RawMesh(triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3))


def solid(*parts: np.ndarray) -> Solid:
    return solid_from_mesh("model", raw(np.concatenate(parts)))


def write_stl(path: Path, triangles: np.ndarray, count: int | None = None) -> Path:
    records = np.zeros(
        len(triangles), np.dtype([("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")])
    )
    records["v"] = triangles
    header = b"solid but binary".ljust(80) + struct.pack(
        "<I", len(triangles) if count is None else count
    )
    path.write_bytes(header + records.tobytes())
    return path


def write_obj(path: Path, vertices: np.ndarray, faces: np.ndarray) -> Path:
    lines = [f"v {x} {y} {z}" for x, y, z in vertices] + [
        f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces
    ]
    path.write_text("\n".join(lines) + "\n")
    return path


def is_sound(result: Solid) -> bool:
    """Closed, outward, and accepted by Manifold without a change."""
    import manifold3d

    manifold = to_manifold(result.vertices, result.faces)
    return (
        manifold.status() == manifold3d.Error.NoError
        and manifold.num_tri() == len(result.faces)
        and manifold.volume() > 0
        and is_closed(result.faces)
        and len(manifold.decompose()) == 1
    )


def refusal(path: Path) -> str:
    """The message of the ModelError that a file is refused with: one line that names the file."""
    with pytest.raises(ModelError) as caught:
        load_solid(path)
    message = str(caught.value)
    assert path.name in message
    assert "\n" not in message
    return message


# ---- formats -----------------------------------------------------------------------------------


@pytest.mark.slow
def test_every_format_gives_the_same_solid(tmp_path: Path) -> None:
    import build123d
    import trimesh

    mesh = trimesh.Trimesh(CUBE_V * (4, 3, 2), CUBE_F)
    for suffix in ("stl", "ply", "off", "obj", "glb"):
        mesh.export(tmp_path / f"box.{suffix}")
    mesh.export(tmp_path / "ascii.stl", file_type="stl_ascii")
    mesh.export(tmp_path / "ascii.ply", file_type="ply", encoding="ascii")
    write_3mf(tmp_path / "box.3mf", CUBE_V * (4, 3, 2), CUBE_F)
    build123d.export_step(build123d.Box(4, 3, 2), tmp_path / "box.step")
    for path in sorted(tmp_path.iterdir()):
        result = load_solid(path)
        assert is_sound(result), path
        assert result.volume == pytest.approx(24), path
        extent = np.ptp(result.bounds, axis=0)
        # GLB files are y up and are turned.
        expected = (4, 2, 3) if path.suffix == ".glb" else (4, 3, 2)
        assert extent == pytest.approx(expected), path
        assert result.name == path.stem
        assert len(result.sha256) == 64


def write_3mf(path: Path, vertices: np.ndarray, faces: np.ndarray) -> None:
    import lib3mf

    wrapper = lib3mf.get_wrapper()
    model = wrapper.CreateModel()
    mesh = model.AddMeshObject()
    for point in vertices:
        position = lib3mf.Position()
        position.Coordinates[:] = [float(c) for c in point]
        mesh.AddVertex(position)
    for face in faces:
        triangle = lib3mf.Triangle()
        triangle.Indices[:] = [int(c) for c in face]
        mesh.AddTriangle(triangle)
    model.AddBuildItem(mesh, wrapper.GetIdentityTransform())
    model.QueryWriter("3mf").WriteToFile(str(path))


def test_3mf_build_items_are_placed(tmp_path: Path) -> None:
    import lib3mf

    wrapper = lib3mf.get_wrapper()
    model = wrapper.CreateModel()
    mesh = model.AddMeshObject()
    for point in CUBE_V:
        position = lib3mf.Position()
        position.Coordinates[:] = [float(c) for c in point]
        mesh.AddVertex(position)
    for face in CUBE_F:
        triangle = lib3mf.Triangle()
        triangle.Indices[:] = [int(c) for c in face]
        mesh.AddTriangle(triangle)
    components = model.AddComponentsObject()
    components.AddComponent(mesh, wrapper.GetTranslationTransform(0.5, 0, 0))
    model.AddBuildItem(mesh, wrapper.GetIdentityTransform())
    model.AddBuildItem(components, wrapper.GetTranslationTransform(0.25, 0, 0))
    model.QueryWriter("3mf").WriteToFile(str(tmp_path / "two.3mf"))
    result = load_solid(tmp_path / "two.3mf")
    assert result.volume == pytest.approx(1.75)
    assert np.ptp(result.bounds, axis=0) == pytest.approx([1.75, 1, 1])


def test_result_is_the_same_every_time(tmp_path: Path) -> None:
    path = write_stl(tmp_path / "two.stl", np.concatenate([ball(), ball(0.9, (0.7, 0.2, 0))]))
    first, second = load_solid(path), load_solid(path)
    assert first.vertices.tobytes() == second.vertices.tobytes()
    assert first.faces.tobytes() == second.faces.tobytes()


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_size_does_not_matter(tmp_path: Path, scale: float) -> None:
    path = write_stl(tmp_path / "ball.stl", ball() * scale)
    result = load_solid(path)
    assert is_sound(result)
    assert result.volume / scale**3 == pytest.approx(4.15, rel=0.02)


def test_place_and_units_are_kept() -> None:
    result = solid(cube(25.4, (100, -50, 7)))
    assert result.bounds == pytest.approx(np.array([[100, -50, 7], [125.4, -24.6, 32.4]]))


def test_obj_reader(tmp_path: Path) -> None:
    path = tmp_path / "cube.obj"
    path.write_text(
        "mtllib none.mtl\n# quads, a pentagon's cousin, negative numbers, joined lines\n"
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1 1.0\nv 1 1 1 0.5 0.5 0.5\nv 0 1 1\n"
        "vn 0 0 1\nvt 0 0\n"
        "f 1/1/1 4/1/1 3/1/1 2/1/1\nf 5 6 7 8\nf 1//1 2//1 6//1 5//1\nf -7 -6 -2 -3\n"
        "f 3 4 \\\n 8 7\nf 4 1 5\nf 4 5 8\nl 1 2\n"
    )
    result = load_solid(path)
    assert is_sound(result)
    assert result.volume == pytest.approx(1)


def test_concave_polygon_is_cut_inside_itself(tmp_path: Path) -> None:
    # An L-shaped prism whose two end faces are hexagons with a notch.
    outline = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
    lines = [f"v {x} {y} {z}" for z in (0, 1) for x, y in outline]
    lines += ["f 6 5 4 3 2 1", "f 7 8 9 10 11 12"]
    for k in range(6):
        a, b = k + 1, (k + 1) % 6 + 1
        lines.append(f"f {a} {b} {b + 6} {a + 6}")
    path = tmp_path / "ell.obj"
    path.write_text("\n".join(lines))
    result = load_solid(path)
    assert is_sound(result)
    assert result.volume == pytest.approx(3)
    assert result.notes == ()


@pytest.mark.slow
def test_step_with_two_touching_solids(tmp_path: Path) -> None:
    import build123d as b

    two = b.Compound([b.Solid.make_box(2, 2, 2), b.Pos(2, 0.5, 0.5) * b.Solid.make_box(1, 1, 1)])
    b.export_step(two, tmp_path / "two.step")
    result = load_solid(tmp_path / "two.step")
    assert is_sound(result)
    assert result.volume == pytest.approx(9)
    assert any("2 separate solids" in note for note in result.notes)


# ---- repairs -----------------------------------------------------------------------------------


def test_overlapping_shells_are_united() -> None:
    result = solid(cube(2), cube(2, (1, 1, 1)))
    assert is_sound(result)
    assert result.volume == pytest.approx(15)
    assert any("2 closed shells" in note for note in result.notes)


def test_shells_are_turned_one_by_one() -> None:
    result = solid(cube(2)[:, ::-1], cube(2, (1, 1, 1)))
    assert result.volume == pytest.approx(15)
    assert any("inside out" in note for note in result.notes)


def test_inside_out_model_is_turned() -> None:
    result = solid(ball()[:, ::-1])
    assert result.volume == pytest.approx(solid(ball()).volume)
    assert result.notes == ("the model was inside out and was turned",)


def test_mixed_winding_is_made_alike() -> None:
    triangles = ball()
    flip = np.random.default_rng(3).random(len(triangles)) < 0.5
    result = solid(np.where(flip[:, None, None], triangles[:, ::-1], triangles))
    assert is_sound(result)
    assert result.volume == pytest.approx(solid(ball()).volume)


def test_cavity_is_filled_and_told() -> None:
    result = solid(ball(2), ball(1)[:, ::-1])
    assert result.volume == pytest.approx(solid(ball(2)).volume)
    assert any("cavity" in note for note in result.notes)


def test_void_between_united_shells_is_filled() -> None:
    walls = [
        CUBE_V[CUBE_F] * size + np.array(at)
        for size, at in (
            ((4, 4, 1), (0, 0, 0)),
            ((4, 4, 1), (0, 0, 3)),
            ((4, 1, 4), (0, 0, 0)),
            ((4, 1, 4), (0, 3, 0)),
            ((1, 4, 4), (0, 0, 0)),
            ((1, 4, 4), (3, 0, 0)),
        )
    ]
    result = solid(*walls)
    assert is_sound(result)
    assert result.volume == pytest.approx(64)


def test_nested_shells_facing_outwards_are_a_full_body() -> None:
    assert solid(ball(2), ball(1)).volume == pytest.approx(solid(ball(2)).volume)


@pytest.mark.slow
def test_self_crossing_tube_has_its_overlap_once() -> None:
    # A thick tube along one and a quarter turns: its two ends run into each other.
    turns = np.linspace(0, 2.5 * np.pi, 81)
    round_about = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    out = np.stack([np.cos(turns), np.sin(turns), 0 * turns], axis=1)
    ring = [
        10 * a + 3 * (np.cos(b) * a + np.sin(b) * np.array([0, 0, 1])) + [0, 0, 0.004 * i]
        for i, a in enumerate(out)
        for b in round_about
    ]
    points = np.array(ring).reshape(81, 16, 3)
    grid = []
    for i in range(80):
        for j in range(16):
            k = (j + 1) % 16
            a, b, c, d = points[i, j], points[i, k], points[i + 1, k], points[i + 1, j]
            grid += [[a, b, c], [a, c, d]]
    for j in range(1, 15):
        grid += [[points[0, 0], points[0, j + 1], points[0, j]]]
        grid += [[points[80, 0], points[80, j], points[80, j + 1]]]
    result = solid(np.array(grid))
    assert is_sound(result)
    section = 8 * 9 * np.sin(np.pi / 8)
    assert result.volume == pytest.approx(section * 2 * np.pi * 10, rel=0.02)
    assert any("passes through itself" in note for note in result.notes)


def test_repeated_triangles_are_dropped() -> None:
    result = solid(ball(), ball()[10:60], ball()[10:60])
    assert is_sound(result)
    assert any("100 repeated" in note for note in result.notes)


def test_surface_written_on_both_sides() -> None:
    result = solid(cube(), cube()[:, ::-1])
    assert is_sound(result)
    assert result.volume == pytest.approx(1)


def test_inner_wall_is_dropped() -> None:
    # Two cubes in a row that share the wall between them, written once and twice.
    outer = [t for t in cube() if not (t[:, 0] == 1).all()]
    outer += [t for t in cube(1, (1, 0, 0)) if not (t[:, 0] == 1).all()]
    wall = [t for t in cube() if (t[:, 0] == 1).all()]
    for triangles in (outer + wall, outer + wall + [t[::-1] for t in wall]):
        result = solid(np.array(triangles))
        assert is_sound(result)
        assert result.volume == pytest.approx(2)


def test_cubes_that_share_a_face_with_other_diagonals() -> None:
    turned = cube(1, (1, 0, 0))
    turned[:, :, 1] = 1 - turned[:, :, 1]
    result = solid(cube(), turned[:, ::-1])
    assert is_sound(result)
    assert result.volume == pytest.approx(2)


def test_degenerate_faces_and_fins_are_dropped() -> None:
    point = np.zeros((1, 3, 3))
    line = np.array([[[0, 0, 0], [0.5, 0, 0], [1, 0, 0]]], dtype=float)
    fin = np.array([[[0, 0, 1], [1, 0, 1], [0.5, 0, 1.7]]], dtype=float)
    result = solid(cube(), point, line, fin)
    assert is_sound(result)
    assert result.volume == pytest.approx(1)
    assert result.bounds[1] == pytest.approx([1, 1, 1])


def test_small_holes_are_capped() -> None:
    triangles = ball()
    keep = (triangles[:, :, 2] < 0.8).all(axis=1) & (triangles[:, :, 0] < 0.9).all(axis=1)
    result = solid(triangles[keep])
    assert is_sound(result)
    assert any("2 holes were capped" in note for note in result.notes)
    assert 0.85 < result.volume / solid(ball()).volume < 1


def test_open_bottom_is_capped() -> None:
    triangles = ball()
    result = solid(triangles[(triangles[:, :, 2] > -0.3).all(axis=1)])
    assert is_sound(result)
    assert any("1 hole was capped" in note for note in result.notes)


def test_rims_with_rounding_gaps_are_joined() -> None:
    triangles = ball()
    noise = np.random.default_rng(1).uniform(-1, 1, triangles.shape) * 2e-7
    result = solid(triangles + noise)
    assert is_sound(result)
    assert result.volume == pytest.approx(solid(ball()).volume, rel=1e-4)


def test_vertex_on_a_neighbours_edge() -> None:
    # The face z = 1 is cut in four, its neighbours are not: cracks without width.
    rest = [t for t in cube() if not (t[:, 2] == 1).all()]
    corners = np.array([[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], dtype=float)
    middle = np.array([0.5, 0.5, 1.0])
    top = []
    for k in range(4):
        a, b = corners[k], corners[(k + 1) % 4]
        half = (a + b) / 2
        top += [[a, half, middle], [half, b, middle]]
    result = solid(np.array(rest), np.array(top))
    assert is_sound(result)
    assert result.volume == pytest.approx(1)


@pytest.mark.slow
def test_surface_with_big_openings_is_wrapped() -> None:
    # A cage of loose plates with gaps between them: no rim to cap, but a clear inside.
    plates = []
    for t in cube(10):
        middle = t.mean(axis=0)
        plates.append(middle + (t - middle) * 0.995)
    fine = np.array(plates)
    for _ in range(2):
        a, b, c = fine[:, 0], fine[:, 1], fine[:, 2]
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        fine = np.concatenate(
            [np.stack(s, axis=1) for s in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
        )
    result = solid(fine)
    assert is_sound(result)
    assert result.volume == pytest.approx(1000, rel=0.05)
    assert any("wrapped in a skin" in note for note in result.notes)


def test_small_loose_pieces() -> None:
    near = solid(cube(10), cube(1, (10.02, 4, 4)))
    assert is_sound(near)
    assert near.volume == pytest.approx(1001, rel=1e-4)
    assert any("by a hair" in note for note in near.notes)
    far = solid(cube(10), cube(1, (11, 4, 4)))
    assert is_sound(far)
    assert far.volume == pytest.approx(1000)
    assert any("1 loose piece was dropped" in note for note in far.notes)


@pytest.mark.slow
def test_dense_mesh_is_thinned() -> None:
    import trimesh

    mesh = trimesh.creation.icosphere(subdivisions=7)
    assert len(mesh.faces) > 200_000
    result = solid_from_mesh("ball", RawMesh(np.asarray(mesh.vertices), np.asarray(mesh.faces)))
    assert is_sound(result)
    assert len(result.faces) <= 200_000
    assert result.volume == pytest.approx(mesh.volume, rel=1e-3)
    assert any("thinned" in note for note in result.notes)


# ---- refusals ----------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ([ball(), ball(1, (3, 0, 0)), ball(1, (6, 0, 0))], "3 pieces that stand apart"),
        ([cube(), cube(1, (1, 1, 0))], "touch in an edge or a corner"),
        ([cube(), cube(1, (1, 1, 1))], "touch in an edge or a corner"),
        ([cube()[:1]], "volume is zero"),
        ([cube() * (1, 1, 0)], "volume is zero"),
        ([cube() * (100, 100, 0.01)], "too thin"),
        ([cube() * (1e6, 1, 1)], "too thin"),
        ([np.zeros((4, 3, 3))], "one point"),
        ([np.random.default_rng(0).random((300, 3, 3))], "hardly joined"),
    ],
)
def test_what_is_no_solid_is_refused(parts: list[np.ndarray], words: str) -> None:
    with pytest.raises(ModelError, match=words):
        solid(*parts)


def test_turned_plate_is_refused() -> None:
    from fabfold.lattice.rotations import rotation_about

    turn = rotation_about(np.zeros(3), np.array([1, 2, 3]), 40.0)[:3, :3]
    with pytest.raises(ModelError, match="too thin"):
        solid(cube() * (100, 100, 0.5) @ turn.T)


@pytest.mark.slow
def test_one_sided_strip_is_refused() -> None:
    angle = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    rims = []
    for side in (-0.3, 0.3):
        r = 1 + side * np.cos(angle / 2)
        rims.append(
            np.stack([r * np.cos(angle), r * np.sin(angle), side * np.sin(angle / 2)], axis=1)
        )
    low, high = rims
    strip = []
    for k in range(60):
        a, b = low[k], high[k]
        c, d = (low[k + 1], high[k + 1]) if k < 59 else (high[0], low[0])
        strip += [[a, b, c], [b, d, c]]
    with pytest.raises(ModelError, match="not a closed surface"):
        solid(np.array(strip))


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_numbers_that_are_none(tmp_path: Path, bad: float) -> None:
    triangles = ball()
    triangles[5, 1, 2] = bad
    message = refusal(write_stl(tmp_path / "bad.stl", triangles))
    assert "1 triangles" in message
    assert "triangle 5" in message


def test_precision_lost_far_from_the_origin(tmp_path: Path) -> None:
    path = write_stl(tmp_path / "far.stl", ball(50, (1e9, 0, 0)))
    assert "precision is lost" in refusal(path)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("empty.stl", b"", "is empty"),
        ("none.stl", b"header".ljust(80) + bytes(4), "no triangles"),
        ("name.stl", b"solid nothing\nendsolid nothing\n", "no triangles"),
        ("letter.stl", b"Dear workshop,\nthe lid should close.\n" * 9, "plain text"),
        ("picture.obj", b"\x89PNG\r\n\x1a\n" + bytes(200), "a PNG picture"),
        ("picture.stl", b"\x89PNG\r\n\x1a\n" + bytes(200), "a PNG picture"),
        ("comma.stl", b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 1,5 0 0\n", "line 4"),
        ("cut.stl", b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 1 0 0\n", "line 4"),
        ("cut2.stl", b"solid a\nfacet normal 0 0 1\nouter loop\nvert", "line 4"),
        ("two.stl", b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 1 0\n", "line 4"),
        ("short.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n", "line 4"),
        ("range.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 9\n", "line 5.*vertex 9"),
        ("zero.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "line 4"),
        ("minus.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf -9 1 2\n", "line 4"),
        ("word.obj", b"v 0 0 zero\n", "line 1"),
        ("lines.obj", b"v 0 0 0\nv 1 0 0\nl 1 2\n", "no triangles"),
        ("nothing.obj", b"# just a comment\n", "no vertices"),
        ("early.off", b"OFF\n100 4 0\n0 0 0\n1 0 0\n", "ends early"),
        ("index.off", b"OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n", "line 5"),
        ("head.off", b"OOPS\n", "starts with OFF"),
        ("count.off", b"OFF\nmany\n", "line 2"),
        ("power.off", "OFF\n3² 1 0\n".encode(), "line 2"),
        ("points.ply", b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n"
         b"property float y\nproperty float z\nend_header\n0 0 0\n", "no triangles"),
        ("early.ply", b"ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\n"
         b"property float x\nproperty float y\nproperty float z\nelement face 4\n"
         b"property list uchar int vertex_indices\nend_header\n\x00\x00", "ends early"),
        ("odd.ply", b"ply\nhello\n", "line 2"),
        ("property.ply", b"ply\nformat ascii 1.0\nelement vertex 1\nproperty\n", "line 4"),
        ("endless.ply", b"ply\nformat ascii 1.0\n", "PLY header"),
        ("text.ply", b"once upon a time", "plain text"),
        ("text.glb", b"once upon a time", "plain text"),
        ("cut.glb", b"glTF" + struct.pack("<II", 2, 99999), "ends early"),
        ("junk.glb", b"glTF" + struct.pack("<II", 2, 20) + bytes(8), "cannot be read as GLB"),
        ("text.3mf", b"once upon a time", "plain text"),
        ("junk.3mf", b"PK\x03\x04 not really a zip", "cannot be read as 3MF"),
        ("text.step", b"once upon a time", "plain text"),
        ("cut.step", b"ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n#1=ADV", "incomplete"),
        ("none.step", b"ISO-10303-21;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n", "no solid"),
        ("what.xyz", b"0 0 0", "cannot be read"),
        ("what", b"0 0 0", "cannot be read"),
    ],
)  # fmt: skip
def test_files_that_are_refused(tmp_path: Path, name: str, content: bytes, words: str) -> None:
    import re

    path = tmp_path / name
    path.write_bytes(content)
    assert re.search(words, refusal(path))


def test_binary_stl_whose_count_lies(tmp_path: Path) -> None:
    message = refusal(write_stl(tmp_path / "lies.stl", ball()[:10], count=2**32 - 1))
    assert "4,294,967,295" in message
    whole = write_stl(tmp_path / "ball.stl", ball()).read_bytes()
    (tmp_path / "cut.stl").write_bytes(whole[: len(whole) // 2])
    assert "has room for" in refusal(tmp_path / "cut.stl")
    (tmp_path / "tail.stl").write_bytes(whole + b"tail")
    assert any("4 bytes" in note for note in load_solid(tmp_path / "tail.stl").notes)


def test_missing_file_and_folder(tmp_path: Path) -> None:
    assert "no such file" in refusal(tmp_path / "nowhere.stl")
    (tmp_path / "folder.stl").mkdir()
    assert "is a folder" in refusal(tmp_path / "folder.stl")


# ---- the collection of sound and broken models ---------------------------------------------------

#: What must come of each broken file: the volume in the file's unit, or words of the refusal.
BAD: dict[str, float | str] = {
    "real_open_airplane.stl": 32.5,
    "real_overlapping_shells_rabbit.obj": 6.54,
    "real_disconnected_robot.stl": "6 pieces that stand apart",
    "real_inside_out_car.stl": 6.55e6,
    "real_assembly_10_solids.step": 2.635e5,
    "real_multishell_office_chair.stl": 8.43e4,
    "real_short_face_line.obj": "line 9",
    "obj_missing_mtl.obj": 4.528,
    "open_cut_feet.stl": 1.16e5,
    "inverted_normals.stl": 1.216e5,
    "mixed_orientation.stl": 1.216e5,
    "duplicated_faces.stl": 1.216e5,
    "nan_vertex.ply": "vertex 100",
    "inf_nan_binary.stl": "3 triangles",
    "truncated.stl": "says 1,654 triangles.*room for 827.5",
    "count_lies.stl": "4,294,967,295",
    "solid_header_binary.stl": 1.216e5,
    "huge_1e9.stl": 1.216e26,
    "huge_offset_1e9.stl": "precision is lost",
    "tiny_1e-9.stl": 1.216e-28,
    "index_out_of_range.obj": "line 8.*vertex 99",
    "self_intersecting_coil.stl": 2.78e4,
    "nonmanifold_edge.stl": "touch in an edge",
    "nonmanifold_vertex.stl": "touch in an edge or a corner",
    "nonmanifold_fin.stl": 1000.0,
    "disconnected_spheres.stl": "3 pieces that stand apart",
    "hollow_sphere.stl": 4153.0,
    "nested_same_orientation.stl": 4153.0,
    "zero_volume_plate.stl": "volume is zero",
    "thin_plate.stl": "too thin",
    "needle.stl": "too thin",
    "single_triangle.stl": "not a solid",
    "degenerate_faces.stl": 1000.0,
    "triangle_soup.stl": "not a closed surface",
    "empty.stl": "is empty",
    "zero_triangles.stl": "no triangles",
    "solid_name_only.stl": "no triangles",
    "ascii_cut.stl": "line 6",
    "ascii_bad_number.stl": "line 5",
    "text_renamed.stl": "not an STL file",
    "png_renamed.obj": "a PNG picture",
    "step_cut.step": "incomplete",
    "step_no_solid.step": "no solid",
    "points_only.ply": "no triangles",
    "lines_only.obj": "no triangles",
    "wrong_counts.off": "ends early",
    "ngon_quads.obj": 1.0,
}


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(BAD))
def test_broken_models(name: str, capfd: pytest.CaptureFixture[str]) -> None:
    path = MODELS / "bad" / name
    if not path.is_file():
        pytest.skip("the collection of broken models is not beside this checkout")
    expected = BAD[name]
    if isinstance(expected, str):
        with pytest.raises(ModelError, match=expected) as caught:
            load_solid(path)
        assert name in str(caught.value)
        assert "\n" not in str(caught.value)
    else:
        result = load_solid(path)
        assert is_sound(result)
        assert result.volume == pytest.approx(expected, rel=0.01)
    assert capfd.readouterr().out == ""


def _sound_models() -> list[str]:
    return sorted(
        str(path.relative_to(MODELS))
        for folder in ("paper", "dev")
        for path in (MODELS / folder).glob("*.*")
    )


@pytest.mark.slow
@pytest.mark.skipif(
    not _sound_models(), reason="the collection of models is not beside this checkout"
)
@pytest.mark.parametrize("name", _sound_models() or ["none"])
def test_sound_models_are_left_alone(name: str) -> None:
    import trimesh

    result = load_solid(MODELS / name)
    assert is_sound(result)
    assert result.notes == ()
    if not name.endswith(".step"):
        before = trimesh.load_mesh(MODELS / name)
        assert len(result.faces) == len(before.faces)
        assert result.volume == pytest.approx(before.volume, rel=1e-6)
        assert result.bounds == pytest.approx(before.bounds, rel=1e-9, abs=1e-9)
