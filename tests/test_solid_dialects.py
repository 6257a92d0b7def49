"""Files as users' programs write them: each is made here, and what it holds is known."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np
import pytest

from fabfold.errors import ModelError
from fabfold.solid.closed_solid import Solid
from fabfold.solid.load import load_solid, read_mesh

#: A cube of 20 mm.
SIDE = 20.0
CORNERS = SIDE * np.array([(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
QUADS = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
FACES = np.array([t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))])


def volume(solid: Solid) -> float:
    a, b, c = solid.vertices[solid.faces].transpose(1, 0, 2)
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def binary_stl(
    faces: np.ndarray = FACES, header: bytes = b"", attributes: object = 0, after: bytes = b""
) -> bytes:
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    records = np.zeros(len(faces), record)
    records["corners"] = CORNERS[faces]
    records["attribute"] = attributes
    return header.ljust(80, b"\0") + struct.pack("<I", len(faces)) + records.tobytes() + after


def words_of_ascii_stl(name: str = "cube") -> list[str]:
    lines = [f"solid {name}"]
    for face in FACES:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += ["vertex {} {} {}".format(*CORNERS[corner]) for corner in face]
        lines += ["endloop", "endfacet"]
    return [*lines, f"endsolid {name}"]


@pytest.mark.parametrize("name", ["cube", "", "my solid facet of the outer vertex 3"])
@pytest.mark.parametrize("between", ["\n", " ", "\r\n", "\n\n\t"])
def test_ascii_stl_is_words_and_not_lines(tmp_path: Path, name: str, between: str) -> None:
    path = tmp_path / "cube.stl"
    path.write_bytes(between.join(words_of_ascii_stl(name)).encode())
    assert volume(load_solid(path)) == pytest.approx(SIDE**3)


@pytest.mark.parametrize("word", ["end solid cube", "END SOLID", "end solid facet", "endsolid"])
def test_ascii_stl_may_end_in_two_words(tmp_path: Path, word: str) -> None:
    path = tmp_path / "cube.stl"
    path.write_text("\n".join([*words_of_ascii_stl()[:-1], word]))
    assert volume(load_solid(path)) == pytest.approx(SIDE**3)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
@pytest.mark.parametrize("kind", ["stl", "obj"])
def test_text_with_a_byte_order_mark_is_read(tmp_path: Path, encoding: str, kind: str) -> None:
    rows = ["v {} {} {}".format(*corner) for corner in CORNERS]
    rows += ["f " + " ".join(str(corner + 1) for corner in face) for face in FACES]
    path = tmp_path / f"cube.{kind}"
    path.write_text("\n".join(words_of_ascii_stl() if kind == "stl" else rows), encoding=encoding)
    assert volume(load_solid(path)) == pytest.approx(SIDE**3)


def test_a_cut_ascii_stl_still_names_its_line(tmp_path: Path) -> None:
    path = tmp_path / "cut.stl"
    path.write_text("\n".join(words_of_ascii_stl()[:11]))
    with pytest.raises(ModelError, match="line 11"):
        load_solid(path)


@pytest.mark.parametrize("after", [bytes(1), bytes(512), bytes(500), b"made by a program" * 40])
def test_bytes_after_the_last_triangle_are_told(tmp_path: Path, after: bytes) -> None:
    path = tmp_path / "cube.stl"
    path.write_bytes(binary_stl(after=after))
    solid = load_solid(path)
    assert volume(solid) == pytest.approx(SIDE**3)
    assert f"{len(after)} bytes after the last triangle were ignored" in solid.notes


def test_triangles_after_the_last_one_are_no_padding(tmp_path: Path) -> None:
    data = bytearray(binary_stl())
    data[80:84] = struct.pack("<I", 5)
    path = tmp_path / "lies.stl"
    path.write_bytes(bytes(data))
    with pytest.raises(ModelError, match="header says 5 triangles"):
        load_solid(path)


RED, BLUE = (255, 0, 0), (0, 0, 255)


def test_colours_of_a_binary_stl_in_both_conventions(tmp_path: Path) -> None:
    viscam = np.full(12, 0x8000 | 31 << 10)  # red in the highest bits
    viscam[:2] = 0x8000 | 31
    path = tmp_path / "viscam.stl"
    path.write_bytes(binary_stl(attributes=viscam))
    shades = read_mesh(path).colours
    assert shades is not None
    assert [tuple(row) for row in shades[[0, 1, 2, 11]]] == [BLUE, BLUE, RED, RED]
    magics = np.full(12, 0x8000)  # as the whole
    magics[:2] = 31  # red in the lowest bits
    path.write_bytes(binary_stl(header=b"made so COLOR=\x00\x00\xff\xff", attributes=magics))
    shades = read_mesh(path).colours
    assert shades is not None
    assert [tuple(row) for row in shades[[0, 1, 2, 11]]] == [RED, RED, BLUE, BLUE]
    path.write_bytes(binary_stl())
    assert read_mesh(path).colours is None


def test_colours_of_obj_materials(tmp_path: Path) -> None:
    rows = ["mtllib my colours.mtl", *("v {} {} {}".format(*corner) for corner in CORNERS)]
    for index, quad in enumerate(QUADS):
        rows += ["usemtl red" if index == 0 else "usemtl blue"] if index < 2 else []
        rows.append("f " + " ".join(str(corner + 1) for corner in quad))
    path = tmp_path / "cube.obj"
    path.write_text("\n".join(rows))
    assert read_mesh(path).colours is None  # the materials are missing, which is no fault
    (tmp_path / "my colours.mtl").write_text("newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1.0\n")
    shades = read_mesh(path).colours
    assert shades is not None
    assert [tuple(row) for row in shades[[0, 1, 2, 11]]] == [RED, RED, BLUE, BLUE]
    paint = load_solid(path).paint
    assert paint is not None
    assert len(paint.corners) == 2


def pentagon_prism() -> tuple[np.ndarray, list[list[int]]]:
    """A house-like prism, 4 x 3 (roof at 5) x 2, of volume 32, of pentagons and quads."""
    outline = [(0, 0), (4, 0), (4, 3), (2, 5), (0, 3)]
    points = np.array([(x, y, z) for z in (0, 2) for x, y in outline], float)
    sides = [[i, (i + 1) % 5, 5 + (i + 1) % 5, 5 + i] for i in range(5)]
    return points, [[4, 3, 2, 1, 0], [5, 6, 7, 8, 9], *sides]


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_ply_polygons_of_any_size(tmp_path: Path, form: str) -> None:
    points, polygons = pentagon_prism()
    head = f"ply\nformat {form} 1.0\nelement vertex {len(points)}\n"
    head += "property float x\nproperty float y\nproperty float z\n"
    head += f"element face {len(polygons)}\nproperty list uchar int vertex_indices\n"
    head += "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n"
    order = ">" if form.endswith("big_endian") else "<"
    body = b""
    if form == "ascii":
        rows = [" ".join(map(str, point)) for point in points]
        rows += [f"{len(p)} {' '.join(map(str, p))} 255 0 {len(p)}" for p in polygons]
        body = "\n".join(rows).encode()
    else:
        body = points.astype(order + "f4").tobytes()
        for polygon in polygons:
            body += struct.pack(f"{order}B{len(polygon)}i", len(polygon), *polygon)
            body += bytes((255, 0, len(polygon)))
    path = tmp_path / "house.ply"
    path.write_bytes(head.encode() + body)
    raw = read_mesh(path)
    assert len(raw.faces) == 2 * 3 + 5 * 2
    assert raw.colours is not None
    assert raw.colours[:, 2].tolist() == [5] * 6 + [4] * 10
    assert volume(load_solid(path)) == pytest.approx(32.0)
    path.write_bytes((head.encode() + body)[:-20])
    with pytest.raises(ModelError, match="ends early"):
        load_solid(path)


def test_ply_strips(tmp_path: Path) -> None:
    # A tetrahedron as one strip that goes round it, and its first triangle's partner.
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
    strip = [0, 2, 1, 3, 0, 2, -1]
    head = "ply\nformat binary_little_endian 1.0\nelement vertex 4\n"
    head += "property float x\nproperty float y\nproperty float z\n"
    head += "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
    body = points.astype("<f4").tobytes() + struct.pack("<8i", len(strip), *strip)
    path = tmp_path / "strip.ply"
    path.write_bytes(head.encode() + body)
    assert len(read_mesh(path).faces) == 4
    assert volume(load_solid(path)) == pytest.approx(1 / 6)


@pytest.mark.slow
def test_a_step_file_may_begin_with_comments(tmp_path: Path) -> None:
    import build123d as bd

    path = tmp_path / "cube.step"
    bd.export_step(bd.Box(4, 3, 2), path)
    plain = path.read_bytes()
    for data in (
        b"/* one\n * two ISO */ \n/**/" + plain,
        b"\xef\xbb\xbf" + plain,
        plain + b"\n" * 4000 + b"/* signed */\n",
    ):
        path.write_bytes(data)
        assert volume(load_solid(path)) == pytest.approx(24.0)


def glb(content: dict[str, object]) -> bytes:
    text = json.dumps(content).encode()
    text = text.ljust(-(-len(text) // 4) * 4)
    return b"glTF" + struct.pack("<III4s", 2, 20 + len(text), len(text), b"JSON") + text


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ({"extensionsRequired": ["KHR_draco_mesh_compression"]}, "compressed with Draco"),
        ({"extensionsRequired": ["XYZ_unknown"]}, "XYZ_unknown"),
        ({"nodes": [{"extensions": {"EXT_mesh_gpu_instancing": {}}}]}, "real copies"),
    ],
)
def test_glb_extensions_are_refused_by_name(
    tmp_path: Path, content: dict[str, object], words: str, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "model.glb"
    path.write_bytes(glb({"asset": {"version": "2.0"}, **content}))
    with pytest.raises(ModelError, match=words):
        load_solid(path)
    assert capfd.readouterr() == ("", "")


def test_pieces_that_stand_apart_say_by_how_much(tmp_path: Path) -> None:
    import trimesh

    two = [trimesh.creation.box((20, 20, 20)), trimesh.creation.box((20, 20, 20))]
    two[1].apply_translation((20.005, 0, 0))
    path = tmp_path / "two.stl"
    trimesh.util.concatenate(two).export(path)
    with pytest.raises(ModelError, match=r"apart, the two largest by 0\.005 in the model's units"):
        load_solid(path)


@pytest.mark.slow
def test_many_pieces_that_stand_apart_by_a_hair(tmp_path: Path) -> None:
    import trimesh

    box = trimesh.creation.box((1, 1, 1))
    places = 1.001 * np.stack(np.meshgrid(*[np.arange(5)] * 3, indexing="ij"), -1).reshape(-1, 3)
    path = tmp_path / "cubes.stl"
    trimesh.util.concatenate([box.copy().apply_translation(place) for place in places]).export(path)
    solid = load_solid(path)
    assert any(note.startswith("124 pieces were free of the body") for note in solid.notes)
    assert 115 < volume(solid) < 125
