"""The readers that are fuzzed, and what their files begin from: nothing here needs a fuzzer."""

from __future__ import annotations

import io
import json
import struct
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from unittest import mock

import numpy as np

from fabfold.errors import ModelError
from fabfold.lattice.template_files import read_template
from fabfold.printing.profiles import load_profile
from fabfold.recipe.recipe import read_recipe
from fabfold.solid.load import read_mesh, solid_from_mesh
from fabfold.solid.raw import RawMesh
from fabfold.solid.read_step import check_step
from fabfold.store import StageStore

__all__ = ["READERS", "Reader"]

ROOT = Path(__file__).resolve().parent.parent
POINTS = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
FACES = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3))


@dataclass(frozen=True)
class Reader:
    """One reader of files.

    Attributes
    ----------
    file : str
        Name of the file that the reader is given.
    seeds : tuple of bytes
        What the fuzzer begins from.
    read : callable
        Takes the path; raises an error of ours, or returns.
    wrap : callable
        Makes the file of what the fuzzer gives: an archive of a text, for one.
    words : tuple of str
        Words that mean something to the reader.
    files : int
        How many files the fuzzer tries where every run is to try the same.
    """

    file: str
    seeds: tuple[bytes, ...]
    read: Callable[[Path], object]
    wrap: Callable[[bytes], bytes] = bytes
    words: tuple[str, ...] = ()
    files: int = 20_000


def _binary_stl() -> bytes:
    rows = b"".join(
        struct.pack("<12fH", 0, 0, 0, *(c for i in face for c in POINTS[i]), 0) for face in FACES
    )
    return b"COLOR=\x80\x40\x20\xff".ljust(80) + struct.pack("<I", len(FACES)) + rows


def _ascii_stl() -> bytes:
    facets = "".join(
        "facet normal 0 0 0\nouter loop\n"
        + "".join("vertex {} {} {}\n".format(*POINTS[i]) for i in face)
        + "endloop\nendfacet\n"
        for face in FACES
    )
    return f"solid thing\n{facets}endsolid thing\n".encode()


def _obj() -> bytes:
    lines = [*("v {} {} {}".format(*p) for p in POINTS), "vt 0 0", "vn 0 0 1", "usemtl red"]
    lines += ["f {}/1/1 {}/1/1 {}//1".format(*(i + 1 for i in face)) for face in FACES]
    return "\n".join([*lines, "f -1 -2 -3 \\", " -4", ""]).encode()


def _off() -> bytes:
    lines = ["COFF # colours", "4 4 6", *("{} {} {} 255 0 0 255".format(*p) for p in POINTS)]
    return "\n".join([*lines, *("3 {} {} {} 0.5 0.5 0".format(*f) for f in FACES), ""]).encode()


def ply_file(form: str) -> bytes:
    head = (
        f"ply\nformat {form} 1.0\ncomment x\nelement vertex 4\nproperty float x\n"
        "property float y\nproperty float z\nproperty uchar red\nproperty uchar green\n"
        "property uchar blue\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n"
    ).encode()
    if form == "ascii":
        rows = [
            *("{} {} {} 9 9 9".format(*p) for p in POINTS),
            *("3 {} {} {}".format(*f) for f in FACES),
        ]
        return head + "\n".join([*rows, ""]).encode()
    order = "<" if "little" in form else ">"
    return (
        head
        + b"".join(struct.pack(f"{order}3f3B", *p, 9, 9, 9) for p in POINTS)
        + b"".join(struct.pack(f"{order}B3i", 3, *f) for f in FACES)
    )


def ply_strips() -> bytes:
    return (
        b"ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
        b"property float z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n"
        b"0 0 0\n1 0 0\n0 1 0\n0 0 1\n9 0 1 2 3 -1 0 2 1 3\n"
    )


def gltf_scene() -> bytes:
    return json.dumps(
        {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0, "scale": [1, 1, 1], "children": []}],
            "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}}],
            "meshes": [
                {"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}
            ],
            "accessors": [
                {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
                {"bufferView": 1, "componentType": 5125, "count": 12, "type": "SCALAR"},
            ],
            "bufferViews": [
                {"buffer": 0, "byteLength": 48},
                {"buffer": 0, "byteOffset": 48, "byteLength": 48},
            ],
            "buffers": [{"byteLength": 96}],
        }
    ).encode()


def glb_file(scene: bytes) -> bytes:
    scene += b" " * (-len(scene) % 4)
    blob = np.array(POINTS, "<f4").tobytes() + np.array(FACES, "<u4").tobytes()
    parts = struct.pack("<II", len(scene), 0x4E4F534A) + scene
    parts += struct.pack("<II", len(blob), 0x004E4942) + blob
    return struct.pack("<4sII", b"glTF", 2, 12 + len(parts)) + parts


def _model() -> bytes:
    points = "".join('<vertex x="{}" y="{}" z="{}"/>'.format(*p) for p in POINTS)
    faces = "".join('<triangle v1="{}" v2="{}" v3="{}" pid="3" p1="0"/>'.format(*f) for f in FACES)
    return (
        '<?xml version="1.0"?><model unit="millimeter" '
        'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>'
        '<basematerials id="3"><base name="red" displaycolor="#FF0000"/></basematerials>'
        f'<object id="1" type="model" name="thing"><mesh><vertices>{points}</vertices>'
        f"<triangles>{faces}</triangles></mesh></object>"
        '<object id="2"><components><component objectid="1" transform="1 0 0 0 1 0 0 0 1 5 0 0"/>'
        '</components></object></resources><build><item objectid="2"/></build></model>'
    ).encode()


def _package(**parts: bytes) -> bytes:
    """A 3MF package of texts: its model, and the settings of a slicer."""
    names = {"model": "3D/3dmodel.model", "settings": "Metadata/model_settings.config"}
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr(
            "_rels/.rels",
            '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
            '<Relationship Target="/3D/3dmodel.model" Id="r" '
            'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>',
        )
        for key, content in parts.items():
            archive.writestr(names[key], content)
    return stream.getvalue()


def slicer_file() -> bytes:
    return (
        b'<config><object id="2"><metadata key="name" value="x"/>'
        b'<part id="1" subtype="negative_part">'
        b'<metadata key="name" value="hole"/></part></object><plate><model_instance>'
        b'<metadata key="object_id" value="2"/></model_instance></plate></config>'
    )


def _step() -> bytes:
    return (
        b"ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n#1=ADVANCED_FACE('',(),#2,.T.);\nENDSEC;\n"
        b"END-ISO-10303-21;\n"
    )


def _solid(path: Path) -> object:
    """Small meshes of any kind, right through to the closed solid, but for CGAL's wrap of 5 s."""
    data = np.frombuffer(path.read_bytes()[:400], dtype=np.int8)
    count = 3 * int(len(data) // 6)
    points = data[:count].reshape(-1, 3).astype(float)
    faces = data[count : 2 * count].reshape(-1, 3).astype(np.int64) % max(len(points), 1)
    if len(points) < 4 or len(faces) < 4:
        raise ModelError("too little for a mesh")
    with mock.patch("fabfold.solid.wrap.wrap", side_effect=ModelError("too open to be capped")):
        return solid_from_mesh("fuzz", RawMesh(points, faces))


def _solid_seeds() -> tuple[bytes, ...]:
    cube = np.array([(x, y, z) for x in (0, 9) for y in (0, 9) for z in (0, 9)], dtype=np.int8)
    faces = "012 132 465 675 041 451 263 673 024 264 153 375".replace(" ", "")
    rows = np.array([int(c) for c in faces], dtype=np.int8)
    points = np.vstack([cube, np.full((4, 3), 5, dtype=np.int8)])
    return (points.tobytes() + rows.tobytes(),)


def _journal(path: Path) -> object:
    """The journal of a kit that nobody works in, with all that is asked of it."""
    store = StageStore(path.parent)
    for stage in ("solid", "voxelize", "export"):
        if store.holds(stage, "key"):
            store.files(stage)
    return store.names, store.delivered, store.damage


def _texts(folder: str) -> tuple[bytes, ...]:
    return tuple(path.read_bytes() for path in sorted((ROOT / folder).glob("*.toml")))


def _readers() -> Iterator[tuple[str, Reader]]:
    yield (
        "STL",
        Reader(
            "x.stl", (_binary_stl(), _ascii_stl()), read_mesh, words=("facet", "vertex", "solid")
        ),
    )
    yield (
        "OBJ",
        Reader(
            "x.obj", (_obj(),), read_mesh, words=("usemtl", "mtllib", "f ", "v ", "1e999", "nan")
        ),
    )
    yield "OFF", Reader("x.off", (_off(),), read_mesh, words=("OFF", "COFF", "NOFF", "STOFF"))
    yield (
        "PLY",
        Reader(
            "x.ply",
            (*map(ply_file, ("ascii", "binary_little_endian", "binary_big_endian")), ply_strips()),
            read_mesh,
            words=("element", "property", "list", "uchar", "double", "tristrips", "end_header"),
        ),
    )
    yield "GLB, the file", Reader("x.glb", (glb_file(gltf_scene()),), read_mesh)
    yield (
        "GLB, its scene",
        Reader(
            "x.glb",
            (gltf_scene(),),
            read_mesh,
            glb_file,
            ("extensionsRequired", "sparse", "byteStride", "children", "matrix", "mode", "5123"),
        ),
    )
    yield "3MF, the archive", Reader("x.3mf", (_package(model=_model()),), read_mesh)
    yield (
        "3MF, its model",
        Reader(
            "x.3mf",
            (_model(),),
            read_mesh,
            lambda data: _package(model=data),
            ("<component ", "objectid=", "transform=", "requiredextensions=", "paint_color=", "&#"),
        ),
    )
    yield (
        "3MF, a slicer's settings",
        Reader(
            "x.3mf",
            (slicer_file(),),
            read_mesh,
            lambda data: _package(model=_model(), settings=data),
            ("subtype=", "modifier_part", "printable", "extruder"),
        ),
    )
    yield (
        "STEP, before the kernel",
        Reader("x.step", (_step(),), check_step, words=("ISO-10303-21", "/*", "FACE")),
    )
    yield "meshes to solids", Reader("x.bin", _solid_seeds(), _solid, files=1_000)
    yield (
        "recipe",
        Reader("kit.toml", (b'model = "x.stl"\nseed = 1\nvoxel_mm = 12.5\n',), read_recipe),
    )
    yield (
        "template",
        Reader("mine.toml", _texts("templates"), read_template, words=("[[box]]", "cells")),
    )
    yield "profile", Reader("mine.toml", _texts("prints"), lambda path: load_profile(str(path)))
    entry = {"key": "key", "files": {"solid.npz": "0" * 64}}
    journal = {
        "format": "fabfold-stages",
        "version": 1,
        "stages": {"solid": entry},
        "names": ["x"],
        "delivered": {"x.3mf": "0" * 64},
    }
    yield "journal", Reader("stages/journal.json", (json.dumps(journal).encode(),), _journal)


#: Name of each reader, as the table tells it.
READERS: dict[str, Reader] = dict(_readers())
