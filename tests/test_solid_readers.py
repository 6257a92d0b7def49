"""Readers of model files, on files made at random: what is written is read, garbage is refused."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fabfold.errors import ModelError
from fabfold.solid.closed_solid import Solid
from fabfold.solid.load import load_solid
from fabfold.solid.raw import RawMesh
from fabfold.solid.read_3mf import read_3mf
from fabfold.solid.read_binary import read_glb, read_ply
from fabfold.solid.read_stl import read_stl
from fabfold.solid.read_text import read_obj, read_off

#: The same examples in every run, and no folder for those that failed.
QUICK = settings(deadline=None, max_examples=30, derandomize=True, database=None)

Mesh = tuple[np.ndarray, np.ndarray]


@st.composite
def meshes(draw: st.DrawFn) -> Mesh:
    """Up to 12 vertices and up to 12 triangles, which need not be a surface."""
    count = draw(st.integers(3, 12))
    number = st.floats(-1e6, 1e6, width=32)
    vertices = draw(arrays(np.float32, (count, 3), elements=number))
    triangle = st.lists(st.integers(0, count - 1), min_size=3, max_size=3)
    return vertices, np.array(draw(st.lists(triangle, min_size=1, max_size=12)))


# ---- writers -----------------------------------------------------------------------------------


def numbers(row: np.ndarray) -> str:
    """Decimals that read back as the very same floats."""
    return " ".join(repr(float(value)) for value in row)


def binary_stl(vertices: np.ndarray, faces: np.ndarray) -> bytes:
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    records = np.zeros(len(faces), record)
    records["corners"] = vertices[faces]
    return bytes(80) + struct.pack("<I", len(faces)) + records.tobytes()


def ascii_stl(vertices: np.ndarray, faces: np.ndarray) -> bytes:
    lines = ["solid random"]
    for face in faces:
        lines += ["facet normal 0 0 1", "outer loop"]
        lines += [f"vertex {numbers(vertices[corner])}" for corner in face]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid random", ""]).encode()


def obj(vertices: np.ndarray, faces: np.ndarray) -> bytes:
    lines = [f"v {numbers(vertex)}" for vertex in vertices]
    lines += ["f " + " ".join(f"{corner + 1}//1" for corner in face) for face in faces]
    return "\n".join([*lines, ""]).encode()


def off(vertices: np.ndarray, faces: np.ndarray) -> bytes:
    lines = ["OFF", f"{len(vertices)} {len(faces)} 0", *map(numbers, vertices)]
    lines += ["3 " + " ".join(map(str, face)) for face in faces]
    return "\n".join([*lines, ""]).encode()


def ply_header(form: str, vertices: np.ndarray, faces: np.ndarray) -> str:
    axes = "".join(f"property float {axis}\n" for axis in "xyz")
    return (
        f"ply\nformat {form} 1.0\nelement vertex {len(vertices)}\n{axes}"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )


def ascii_ply(vertices: np.ndarray, faces: np.ndarray) -> bytes:
    lines = [*map(numbers, vertices), *("3 " + " ".join(map(str, face)) for face in faces), ""]
    return (ply_header("ascii", vertices, faces) + "\n".join(lines)).encode()


def binary_ply(vertices: np.ndarray, faces: np.ndarray) -> bytes:
    rows = b"".join(struct.pack("<Biii", 3, *face.tolist()) for face in faces)
    header = ply_header("binary_little_endian", vertices, faces).encode()
    return header + vertices.astype("<f4").tobytes() + rows


WRITERS: dict[str, tuple[Callable[[np.ndarray, np.ndarray], bytes], Callable[[Path], RawMesh]]] = {
    "binary.stl": (binary_stl, read_stl),
    "ascii.stl": (ascii_stl, read_stl),
    "text.obj": (obj, read_obj),
    "text.off": (off, read_off),
    "ascii.ply": (ascii_ply, read_ply),
    "binary.ply": (binary_ply, read_ply),
}
TETRAHEDRON = (
    np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=np.float32),
    np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]),
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One folder for all examples of a test, which overwrite each other."""
    return tmp_path_factory.mktemp("readers")


# ---- what is written is read -------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("name", WRITERS)
@QUICK
@given(mesh=meshes())
def test_triangles_come_back_exactly(name: str, folder: Path, mesh: Mesh) -> None:
    write, read = WRITERS[name]
    vertices, faces = mesh
    path = folder / name
    path.write_bytes(write(vertices, faces))
    found = read(path)
    assert np.array_equal(found.vertices[found.faces], vertices[faces])
    if not name.endswith("stl"):
        assert np.array_equal(found.vertices, vertices)
        assert np.array_equal(found.faces, faces)


@pytest.mark.slow
@pytest.mark.parametrize("name", WRITERS)
@QUICK
@given(
    factors=arrays(np.float64, 3, elements=st.floats(0.25, 4)),
    shift=arrays(np.float64, 3, elements=st.floats(-10, 10)),
)
def test_a_closed_mesh_is_loaded_as_it_is(
    name: str, folder: Path, factors: np.ndarray, shift: np.ndarray
) -> None:
    vertices = (TETRAHEDRON[0] * factors + shift).astype(np.float32)
    path = folder / name
    path.write_bytes(WRITERS[name][0](vertices, TETRAHEDRON[1]))
    solid = load_solid(path)
    assert solid.notes == ()
    assert solid.volume == pytest.approx(factors.prod() / 6, rel=1e-4)
    assert solid.bounds == pytest.approx(np.array([vertices.min(axis=0), vertices.max(axis=0)]))


# ---- garbage is refused ------------------------------------------------------------------------

READERS: dict[str, tuple[Callable[[Path], RawMesh], tuple[bytes, ...]]] = {
    "garbage.stl": (read_stl, (b"solid x\n", b"solid x\nfacet normal 0 0 1\nouter loop\n")),
    "garbage.obj": (read_obj, (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n",)),
    "garbage.off": (read_off, (b"OFF\n", b"OFF\n4 1 0\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n")),
    "garbage.ply": (read_ply, (b"ply\n", ply_header("ascii", *TETRAHEDRON).encode())),
    "garbage.glb": (read_glb, (b"glTF" + struct.pack("<II", 2, 20),)),
    "garbage.3mf": (read_3mf, (b"PK\x03\x04",)),
}
VOCABULARY = (
    r"v f vn l OFF facet normal vertex outer loop endloop endfacet element property list uchar "
    r"0 1 2 3 4 5 -1 -9 1/2 1//2 9999999999999999999999 1e400 nan inf 0x1 ² , # \ ;"
)
WORDS = st.sampled_from(VOCABULARY.split())
LINES = st.lists(st.lists(WORDS, max_size=7).map(" ".join), max_size=12).map("\n".join)


@pytest.mark.slow
@pytest.mark.parametrize("name", READERS)
@QUICK
@given(data=st.data())
def test_garbage_ends_in_a_message(name: str, folder: Path, data: st.DataObject) -> None:
    read, beginnings = READERS[name]
    begin = data.draw(st.sampled_from((b"", *beginnings)))
    rest = data.draw(st.one_of(st.binary(max_size=300), LINES.map(str.encode)))
    path = folder / name
    path.write_bytes(begin + rest)
    try:
        found = read(path)
    except ModelError as error:
        assert name in str(error)
        assert "\n" not in str(error)
    else:
        assert found.faces.shape[1:] == (3,)
        assert len(found.faces) > 0


@pytest.mark.slow
@pytest.mark.parametrize("name", WRITERS)
@QUICK
@given(data=st.data())
def test_a_damaged_file_is_loaded_or_refused(name: str, folder: Path, data: st.DataObject) -> None:
    content = bytearray(WRITERS[name][0](*TETRAHEDRON))
    for _ in range(data.draw(st.integers(1, 3))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path = folder / name
    path.write_bytes(content[: data.draw(st.integers(1, len(content)))])
    try:
        assert isinstance(load_solid(path), Solid)
    except ModelError as error:
        assert name in str(error)
        assert "\n" not in str(error)
