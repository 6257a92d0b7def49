"""PLY and GLB: checked for length first, then read by the library that knows them."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

from fabfold.errors import ModelError
from fabfold.solid.paint import colours_of_mesh
from fabfold.solid.ply_polygons import read_ply_polygons, triangles_only
from fabfold.solid.raw import RawMesh, head_of, no_faces, what_is_it

__all__ = ["read_glb", "read_ply"]

_PLY_BYTES = {
    "char": 1, "uchar": 1, "int8": 1, "uint8": 1,
    "short": 2, "ushort": 2, "int16": 2, "uint16": 2,
    "int": 4, "uint": 4, "int32": 4, "uint32": 4, "float": 4, "float32": 4,
    "double": 8, "float64": 8, "int64": 8, "uint64": 8,
}  # fmt: skip


def read_ply(path: Path) -> RawMesh:
    """Read a PLY file, ASCII or binary.

    Parameters
    ----------
    path : Path
        A file that is not empty.

    Returns
    -------
    RawMesh
        With the colours of faces or vertices, where the file has them.

    Raises
    ------
    ModelError
        If the file is no PLY, is shorter than its header says, or has no faces.
    """
    counts, single = _check_ply(path)
    if not counts.get("face") and not counts.get("tristrips"):
        raise no_faces(path.name, f" ({counts.get('vertex', 0)} points only)")
    if counts.get("tristrips") or not triangles_only(path):
        return read_ply_polygons(path, single)
    mesh = _load_with_trimesh(path, "ply")
    if len(mesh.vertices) < counts.get("vertex", 0) or len(mesh.faces) < counts["face"]:
        raise ModelError(
            f"{path.name} is damaged: its header says {counts.get('vertex', 0)} vertices and "
            f"{counts['face']} faces, but {len(mesh.vertices)} and {len(mesh.faces)} could be "
            "read; export it again"
        )
    return RawMesh(
        np.asarray(mesh.vertices, dtype=np.float64),
        np.asarray(mesh.faces, dtype=np.int64),
        float32=single,
        colours=colours_of_mesh(mesh),
    )


def _check_ply(path: Path) -> tuple[dict[str, int], bool]:
    """Element counts of a PLY header, compared with the size of the file."""
    with path.open("rb") as stream:
        if stream.readline(16).strip() != b"ply":
            raise ModelError(
                f"{path.name} is not a PLY file but {what_is_it(head_of(path))}; "
                "export the model as PLY, or give the file its right suffix"
            )
        counts: dict[str, int] = {}
        widths: dict[str, int] = {}
        form, single, element = "", False, ""
        for number in range(2, 1000):
            words = stream.readline(4096).decode("ascii", "replace").split()
            if words[:1] == ["end_header"]:
                break
            if words[:1] == ["format"] and len(words) > 1:
                form = words[1]
            elif words[:1] == ["element"] and len(words) == 3 and words[2].isdigit():
                element = words[1]
                counts[element], widths[element] = int(words[2]), 0
            elif words[:1] == ["property"] and element and len(words) > 2:
                # A list takes at least its own count.
                kind = words[2] if len(words) > 4 and words[1] == "list" else words[1]
                widths[element] += _PLY_BYTES.get(kind, 1)
                single = single or (words[-1] == "x" and kind in ("float", "float32"))
            elif words[:1] not in (["comment"], ["obj_info"]):
                raise ModelError(
                    f"{path.name}, line {number}: not a line of a PLY header; export it again"
                )
        else:
            raise ModelError(f"{path.name}: the PLY header has no end; export it again")
        body = path.stat().st_size - stream.tell()
        binary = form.startswith("binary")
        least = sum(n * (widths[kind] if binary else 2) for kind, n in counts.items())
        if body + 1 < least:
            raise ModelError(
                f"{path.name} ends early: its header asks for at least {least:,} bytes of data, "
                f"and {body:,} follow; export or download it again"
            )
    return counts, single and binary


def read_glb(path: Path) -> RawMesh:
    """Read every mesh of a binary glTF scene, placed by its node, turned from y up to z up.

    Parameters
    ----------
    path : Path
        A file that is not empty.

    Returns
    -------
    RawMesh
        All meshes in one, with their colours; z points up.

    Raises
    ------
    ModelError
        If the file is no GLB, is cut off, or has no triangles.
    """
    head = head_of(path)
    if head[:4] != b"glTF":
        raise ModelError(
            f"{path.name} is not a GLB file but {what_is_it(head)}; export the model as GLB"
        )
    length, size = int.from_bytes(head[8:12], "little"), path.stat().st_size
    if length > size:
        raise ModelError(
            f"{path.name} ends early: its header says {length:,} bytes, the file has {size:,}; "
            "export or download it again"
        )
    _check_extensions(path)
    mesh = _load_with_trimesh(path, "glb")
    x, y, z = np.asarray(mesh.vertices, dtype=np.float64).T
    return RawMesh(
        np.column_stack([x, -z, y]),
        np.asarray(mesh.faces, dtype=np.int64),
        ("turned from the y-up of GLB files to z up",),
        float32=True,
        colours=colours_of_mesh(mesh),
        unit="m",
    )


#: Extensions of glTF that change how a model looks, not where its triangles are.
_HARMLESS = ("KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_", "KHR_xmp")
#: Extensions that we read, beside those.
_UNDERSTOOD = ("KHR_mesh_quantization",)
#: What to do about those that people meet.
_ADVICE = {
    "KHR_draco_mesh_compression": "the meshes are compressed with Draco; export it without",
    "EXT_meshopt_compression": "the meshes are compressed with meshopt; export it without",
    "EXT_mesh_gpu_instancing": "copies are made when it is drawn; export it with real copies",
}


def _check_extensions(path: Path) -> None:
    """Refuse, by its name, an extension without which the triangles are not what is meant."""
    with path.open("rb") as stream:
        stream.seek(12)
        size, kind = struct.unpack("<I4s", stream.read(8).ljust(8, b"\0"))
        try:
            content = json.loads(stream.read(size)) if kind == b"JSON" else None
        except (ValueError, RecursionError):
            content = None
    if not isinstance(content, dict):
        raise ModelError(
            f"{path.name} cannot be read as GLB: its table of contents is damaged; export the "
            "model again"
        )
    required = content.get("extensionsRequired")
    needed = {str(name) for name in required} if isinstance(required, list) else set()
    nodes = content.get("nodes")
    for node in nodes if isinstance(nodes, list) else ():
        more = node.get("extensions") if isinstance(node, dict) else None
        if isinstance(more, dict) and "EXT_mesh_gpu_instancing" in more:
            needed.add("EXT_mesh_gpu_instancing")  # Left out, all copies but one would be gone.
    for name in sorted(needed):
        if not name.startswith(_HARMLESS) and name not in _UNDERSTOOD:
            advice = _ADVICE.get(name, "export it without, or as another format")
            raise ModelError(f"{path.name} needs the glTF extension {name}: {advice}")


def _load_with_trimesh(path: Path, kind: str) -> Any:
    import trimesh

    try:
        with path.open("rb") as stream:
            mesh = trimesh.load_mesh(stream, file_type=kind, process=False)
    except Exception as error:  # readers of damaged files fail in every way there is
        raise ModelError(
            f"{path.name} cannot be read as {kind.upper()} ({type(error).__name__}: "
            f"{str(error)[:120]}); export the model again"
        ) from error
    if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) == 0:
        raise no_faces(path.name)
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    if vertices.shape[1:] != (3,) or faces.shape[1:] != (3,):
        raise ModelError(
            f"{path.name} is damaged: its points are not three numbers each; export it again"
        )
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise ModelError(
            f"{path.name}: a face names a vertex that is not there, the file has {len(vertices)}; "
            "export it again"
        )
    return mesh
