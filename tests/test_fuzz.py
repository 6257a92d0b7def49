"""Readers on files that are damaged at random, and on those that a fuzzer once found."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from fuzz_readers import POINTS, READERS, glb_file, gltf_scene, ply_file, ply_strips, slicer_file
from hypothesis import given, settings
from hypothesis import strategies as st

from fabfold.errors import FabfoldError, ModelError
from fabfold.solid.load import read_mesh

#: The same examples in every run, and no folder for those that failed.
QUICK = settings(deadline=None, max_examples=40, derandomize=True, database=None)
#: The slow one closes surfaces.
NAMES = [name for name in READERS if name != "meshes to solids"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One folder for all examples of a test, which overwrite each other."""
    return tmp_path_factory.mktemp("fuzz")


@pytest.mark.parametrize("name", NAMES)
@QUICK
@given(data=st.data())
def test_a_damaged_file_is_read_or_refused(name: str, folder: Path, data: st.DataObject) -> None:
    reader = READERS[name]
    content = bytearray(data.draw(st.sampled_from(reader.seeds)))
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, len(content)))
        words = [word.encode() for word in reader.words]
        new = data.draw(st.one_of(st.binary(max_size=4), st.sampled_from([b"", b"-1", *words])))
        content[place : place + data.draw(st.integers(0, 9))] = new
    path = folder / reader.file
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(reader.wrap(bytes(content)))
    try:
        reader.read(path)
    except FabfoldError as error:
        assert "that cannot be told" not in str(error)


def flat_points() -> bytes:
    """A scene whose points are one number each."""
    scene = json.loads(gltf_scene())
    scene["accessors"][0]["type"] = "SCALAR"
    return glb_file(json.dumps(scene).encode())


def ply_with(line: str) -> bytes:
    """A PLY file with another first property."""
    return ply_file("ascii").replace(b"property float x", line.encode(), 1)


FOUND = {
    "points of one number.glb": (flat_points(), "not three numbers each"),
    "no name of a property.ply": (ply_with("property float"), "line 5"),
    "no element.ply": (ply_file("ascii").replace(b"element vertex 4\n", b""), "line 4"),
    "list without a type.ply": (ply_with("property list uchar"), "line 5 of its header"),
    "strip of large numbers.ply": (
        ply_strips().replace(b"9 0 1 2 3", b"9 0 1 2 " + 80 * b"6"),
        "a strip names a vertex",
    ),
    "blanks instead of a face.off": (
        b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n\\\n\\\n\n",
        "only 3 lines follow",
    ),
    "x named twice.ply": (
        b"ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
        b"property float z\nproperty float x\nelement face 1\n"
        b"property list uchar int vertex_indices\nend_header\n0 0 0 0\n1 0 0 0\n5 0 1 0 1 0\n",
        "vertex has 'x' twice",
    ),
    "a strip is a number.ply": (
        ply_strips().replace(b"list int int", b"float").replace(b"9 0 1 2 3 -1 0 2 1 3", b"2.5"),
        "'vertex_indices' of a tristrips is a number",
    ),
    "a face is a number.ply": (
        ply_file("ascii").replace(b"list uchar int vert", b"int vert").replace(b"3 0 2 1", b"4 0"),
        "'vertex_indices' of a face is a number",
    ),
    "a shade is a list.ply": (
        b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        b"property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
        b"property list uchar uchar red\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 2 9 9\n",
        "'red' of a face is a list",
    ),
    "a corner is nan.ply": (
        ply_strips().replace(b"9 0 1 2 3", b"9 0 1 nan 3"),
        "no number of a vertex",
    ),
    "a corner is inf.ply": (
        ply_strips().replace(b"9 0 1 2 3", b"9 0 1 1e999 3"),
        "no number of a vertex",
    ),
    "list of a vertex.ply": (
        ply_with("property list uchar float x").replace(b"4 4", b"5 4"),
        "'x' of a vertex is a list",
    ),
}


@pytest.mark.parametrize("name", FOUND)
def test_what_was_found_is_named(name: str, tmp_path: Path) -> None:
    content, words = FOUND[name]
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(ModelError, match=words) as caught:
        read_mesh(path)
    assert name in str(caught.value)


def test_a_list_at_a_vertex_is_passed_over(tmp_path: Path) -> None:
    content = ply_file("ascii").replace(
        b"element face", b"property list int int tags\nelement face"
    )
    path = tmp_path / "tags.ply"
    path.write_bytes(content.replace(b" 9 9 9\n", b" 9 9 9 2 7 7\n"))
    assert read_mesh(path).vertices.tolist() == [list(map(float, p)) for p in POINTS]


def test_rare_blanks_of_an_obj_are_blanks(tmp_path: Path) -> None:
    path = tmp_path / "blanks.obj"
    path.write_bytes(b"v 0 0 0\nv 1 0 0\nv 0 1 0\n\x0b\\\n\nf 1 2 3\n")
    assert read_mesh(path).faces.tolist() == [[0, 1, 2]]


def test_a_material_that_is_no_number_is_black(tmp_path: Path) -> None:
    (tmp_path / "x.mtl").write_text("newmtl dark\nKd nan -1e999 2\n")
    path = tmp_path / "x.obj"
    path.write_text("mtllib x.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl dark\nf 1 2 3\n")
    assert read_mesh(path).colours.tolist() == [[0, 0, 255]]


def test_a_vertex_of_very_many_digits_is_not_there(tmp_path: Path) -> None:
    reader = READERS["3MF, its model"]
    path = tmp_path / "x.3mf"
    path.write_bytes(reader.wrap(reader.seeds[0].replace(b'v1="0"', b'v1="' + 40 * b"9" + b'"')))
    with pytest.raises(ModelError, match="names a vertex that is not there"):
        read_mesh(path)


def test_settings_that_are_no_numbers_belong_to_no_part(tmp_path: Path) -> None:
    reader = READERS["3MF, a slicer's settings"]
    path = tmp_path / "x.3mf"
    path.write_bytes(reader.wrap(slicer_file().replace(b'id="1"', b'id="one"')))
    assert len(read_mesh(path).faces) == 4


@pytest.mark.parametrize(
    ("limit", "words"),
    [("MAX_FILE_BYTES", "are the most that is read"), ("MAX_TRIANGLES_READ", "4 triangles")],
)
def test_files_that_are_too_large_are_refused(
    limit: str, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(f"fabfold.solid.load.{limit}", 3)
    path = tmp_path / "large.ply"
    path.write_bytes(ply_file("ascii"))
    with pytest.raises(ModelError, match=words):
        read_mesh(path)
