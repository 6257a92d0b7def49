"""``fold.glb``: the fold as an animation, one node a body.

The nodes stand in the hierarchy of the hinges: a body's node is a child of its parent body's, its
origin is the middle of its hinge, and only its rotation is animated. Turning a node about its own
origin is turning the body about its hinge, so a player that interpolates the rotation keys
linearly on the sphere shows the certified path itself and not something near it.

glTF counts in metres with y up. The node at the top carries the change from millimetres with z up,
so everything below it reads in mm and shape A's axes.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import GeometryError
from fabfold.export.colours import body_colours
from fabfold.export.shading import split_vertices
from fabfold.export.weld import printable_mesh
from fabfold.files import write_bytes
from fabfold.fold.motion import Motion
from fabfold.joinery.bodies import Joinery
from fabfold.srgb import linear_light
from fabfold.tree.fold_tree import FoldTree

__all__ = ["SECONDS_PER_QUARTER", "glb_bytes", "keyframe_times", "pivots_mm", "write_glb"]

#: How long a turn of 90 degrees takes.
SECONDS_PER_QUARTER = 0.6
#: How long the animation rests at A and at B.
_REST_SECONDS = 1.0
#: A turn is cut into pieces of at most this angle, eased in and out.
_STEP_DEG = 15.0

#: Numbers of the glTF specification: types of components, and uses of buffer views.
_FLOAT, _UINT = 5126, 5125
_ARRAY, _ELEMENTS = 34962, 34963


def keyframe_times(motion: Motion) -> NDArray[np.float64]:
    """When the animation reaches each keyframe of the motion, in seconds.

    Parameters
    ----------
    motion : Motion
        The folding path.

    Returns
    -------
    (k,) float64 array
        Seconds from the start of the animation. The first keyframe comes after the rest in shape
        A, and the animation ends one rest after the last.
    """
    turns = np.abs(np.diff(motion.angles_deg, axis=0)).max(axis=1, initial=0.0)
    durations = np.maximum(turns / 90.0, 0.25) * SECONDS_PER_QUARTER
    return np.asarray(_REST_SECONDS + np.concatenate([[0.0], np.cumsum(durations)]))


def write_glb(
    path: Path,
    joinery: Joinery,
    tree: FoldTree,
    motion: Motion,
    *,
    title: str = "kit",
    colours: NDArray[np.uint8] | None = None,
) -> None:
    """Write the animated kit as binary glTF 2.0; the same input gives the same bytes.

    Parameters
    ----------
    path : Path
        File to write, ending in ``.glb``.
    joinery : Joinery
        The printed bodies in shape A.
    tree : FoldTree
        The bodies and hinges; its bodies are the joinery's, in the same order.
    motion : Motion
        The folding path of the tree's hinges; see :func:`keyframe_times` for the animation's
        clock.
    title : str
        Name of the scene and of the animation.
    colours : (b, 3) uint8 array, optional
        Colour of each body, sRGB; by default :func:`~fabfold.export.colours.body_colours`.

    Raises
    ------
    GeometryError
        If joinery, tree and motion do not belong together.
    """
    write_bytes(path, glb_bytes(joinery, tree, motion, title=title, colours=colours))


class _Buffer:
    """The binary part of the file, with the accessors and buffer views that read it."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(self, array: NDArray[Any], kind: str, target: int | None, bounds: bool = False) -> int:
        """Append an array and return the index of its accessor.

        Parameters
        ----------
        array : (n, ...) float or integer array
            Written in single precision, or as unsigned 32-bit integers.
        kind : str
            Type of an element in glTF's words, such as ``"VEC3"``.
        target : int or None
            Use of the buffer view in glTF's numbers; None for animations.
        bounds : bool
            Whether the accessor states the least and the greatest values.

        Returns
        -------
        int
            Index of the new accessor.
        """
        component = _FLOAT if array.dtype.kind == "f" else _UINT
        plain = np.ascontiguousarray(array, dtype="<f4" if component == _FLOAT else "<u4")
        view: dict[str, Any] = {
            "buffer": 0,
            "byteOffset": len(self.data),
            "byteLength": plain.nbytes,
        }
        if target is not None:
            view["target"] = target
        self.data += plain.tobytes()
        self.views.append(view)
        accessor: dict[str, Any] = {
            "bufferView": len(self.views) - 1,
            "componentType": component,
            "count": len(plain),
            "type": kind,
        }
        if bounds:
            rows = plain.reshape(len(plain), -1)
            accessor["min"] = [float(v) for v in rows.min(axis=0)]
            accessor["max"] = [float(v) for v in rows.max(axis=0)]
        self.accessors.append(accessor)
        return len(self.accessors) - 1


def _linear(colour: NDArray[np.generic]) -> list[float]:
    """Colour factors of glTF are linear light, not sRGB."""
    return [round(float(value), 6) for value in linear_light(colour)]


def _eased_samples(motion: Motion) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times (s,) in seconds and angles (s, h) in degrees: eased turns, in small steps."""
    reached = keyframe_times(motion)
    times, angles = [0.0, float(reached[0])], [motion.angles_deg[0], motion.angles_deg[0]]
    for i in range(1, len(reached)):
        start, end = motion.angles_deg[i - 1], motion.angles_deg[i]
        count = max(1, int(np.ceil(np.abs(end - start).max(initial=0.0) / _STEP_DEG)))
        for k in range(1, count + 1):
            share = k / count
            eased = float(np.arccos(1.0 - 2.0 * share) / np.pi)
            times.append(float(reached[i - 1] + (reached[i] - reached[i - 1]) * eased))
            angles.append(start + (end - start) * share)
    times.append(float(reached[-1]) + _REST_SECONDS)
    angles.append(motion.angles_deg[-1])
    return np.array(times), np.array(angles)


def _refuse_strangers(joinery: Joinery, tree: FoldTree, motion: Motion) -> None:
    """Refuse bodies or a path that are not the tree's."""
    if [b.name for b in joinery.bodies] != [b.name for b in tree.bodies]:
        raise GeometryError("fold.glb: the joinery's bodies are not the tree's; make the kit again")
    if list(motion.hinges) != [h.name for h in tree.hinges]:
        raise GeometryError("fold.glb: the motion's hinges are not the tree's; make the kit again")


def glb_bytes(
    joinery: Joinery,
    tree: FoldTree,
    motion: Motion,
    *,
    title: str = "kit",
    colours: NDArray[np.uint8] | None = None,
) -> bytes:
    """The content of a binary glTF file, see :func:`write_glb`.

    Parameters
    ----------
    joinery : Joinery
        The printed bodies in shape A.
    tree : FoldTree
        The bodies and hinges; its bodies are the joinery's, in the same order.
    motion : Motion
        The folding path of the tree's hinges.
    title : str
        Name of the scene and of the animation.
    colours : (b, 3) uint8 array, optional
        Colour of each body, sRGB; by default :func:`~fabfold.export.colours.body_colours`.

    Returns
    -------
    bytes
        The same for the same input.

    Raises
    ------
    GeometryError
        If joinery, tree and motion do not belong together.
    """
    _refuse_strangers(joinery, tree, motion)
    if colours is None:
        colours = body_colours(tree)
    buffer = _Buffer()
    nodes, meshes, materials = _scene(joinery, tree, colours, buffer, title)
    animation = _animation(tree, motion, buffer, title)
    document: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": "fabfold"},
        "extras": {"length_unit": "m", "up": "y", "voxel_mm": float(joinery.voxel_mm)},
        "scene": 0,
        "scenes": [{"name": title, "nodes": [0]}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": materials,
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.data)}],
    }
    if animation["channels"]:
        document["animations"] = [animation]
    text = json.dumps(document, separators=(",", ":"), ensure_ascii=False).encode("utf-8")
    text += b" " * (-len(text) % 4)
    data = bytes(buffer.data) + b"\0" * (-len(buffer.data) % 4)
    total = 12 + 8 + len(text) + 8 + len(data)
    return b"".join(
        [
            struct.pack("<4sII", b"glTF", 2, total),
            struct.pack("<I4s", len(text), b"JSON"),
            text,
            struct.pack("<I4s", len(data), b"BIN\0"),
            data,
        ]
    )


def pivots_mm(joinery: Joinery, tree: FoldTree) -> NDArray[np.float64]:
    """Where the nodes of an animation stand: each body at its hinge, the root amid its own voxels.

    Parameters
    ----------
    joinery : Joinery
        It tells the voxel's side and the origin.
    tree : FoldTree
        The bodies and hinges.

    Returns
    -------
    (b, 3) float64 array
        In shape A, mm.
    """
    origin = np.asarray(joinery.origin_mm, dtype=float)
    pivots = np.zeros((len(tree.bodies), 3))
    pivots[0] = origin + joinery.voxel_mm * tree.source[list(tree.bodies[0].voxels)].mean(axis=0)
    for hinge in tree.hinges:
        pivots[hinge.child] = origin + joinery.voxel_mm * np.asarray(hinge.point)
    return pivots


def _scene(
    joinery: Joinery, tree: FoldTree, colours: NDArray[np.uint8], buffer: _Buffer, title: str
) -> tuple[list[dict[str, Any]], list[dict[str, Any]], list[dict[str, Any]]]:
    """Nodes, meshes and materials of the scene.

    Node 0 is the kit; body ``i`` is node ``i + 1``, mesh ``i`` and material ``i``.
    """
    pivots = pivots_mm(joinery, tree)
    everything = np.concatenate([body.vertices for body in joinery.bodies])
    low, high = everything.min(axis=0), everything.max(axis=0)
    stand = np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]])
    # x, y, z in mm -> x, z, -y in m, with the middle of the kit's foot at the origin.
    half = float(np.sqrt(0.5))
    foot = 0.001 * np.array([-stand[0], -stand[2], stand[1]])
    nodes: list[dict[str, Any]] = [
        {
            "name": title,
            "rotation": [-half, 0.0, 0.0, half],
            "scale": [0.001, 0.001, 0.001],
            "translation": _floats(foot),
            "children": [1],
        }
    ]
    meshes, materials = [], []
    parents = [-1] + [hinge.parent for hinge in tree.hinges]
    for index, body in enumerate(joinery.bodies):
        vertices, faces = printable_mesh(body)
        local = vertices.astype(np.float64) - pivots[index]
        points, normals, triangles = split_vertices(local, faces)
        primitive = {
            "attributes": {
                "POSITION": buffer.add(points, "VEC3", _ARRAY, bounds=True),
                "NORMAL": buffer.add(normals, "VEC3", _ARRAY),
            },
            "indices": buffer.add(triangles.reshape(-1), "SCALAR", _ELEMENTS),
            "material": index,
            "mode": 4,
        }
        meshes.append({"name": body.name, "primitives": [primitive]})
        materials.append(
            {
                "name": body.name,
                "pbrMetallicRoughness": {
                    "baseColorFactor": [*_linear(colours[index]), 1.0],
                    "metallicFactor": 0.0,
                    "roughnessFactor": 0.7,
                },
            }
        )
        offset = pivots[index] - (pivots[parents[index]] if index else 0.0)
        node: dict[str, Any] = {
            "name": body.name,
            "mesh": index,
            "translation": _floats(offset),
        }
        if index:
            node["rotation"] = [0.0, 0.0, 0.0, 1.0]
        children = [hinge.child + 1 for hinge in tree.hinges if hinge.parent == index]
        if children:
            node["children"] = children
        nodes.append(node)
    return nodes, meshes, materials


def _floats(values: Sequence[float] | NDArray[np.float64]) -> list[float]:
    """Numbers for JSON, rounded to nine digits; minus zero becomes zero."""
    return [float(np.round(value, 9)) + 0.0 for value in values]


def _animation(tree: FoldTree, motion: Motion, buffer: _Buffer, title: str) -> dict[str, Any]:
    """The animation: one channel of rotations for each hinge that turns."""
    times, angles = _eased_samples(motion)
    samplers: list[dict[str, Any]] = []
    channels: list[dict[str, Any]] = []
    clock: dict[bytes, int] = {}
    for column, hinge in enumerate(tree.hinges):
        if not np.abs(angles[:, column]).max() > 0.0:
            continue
        # Keys only where this hinge turns, and at both ends.
        change = np.diff(angles[:, column]) != 0.0
        keep = np.concatenate([[True], change]) | np.concatenate([change, [True]])
        half = np.radians(angles[keep, column]) / 2.0
        axis = np.asarray(hinge.direction, dtype=float)
        turns = np.column_stack([np.sin(half)[:, None] * axis, np.cos(half)])
        mine = times[keep].astype("<f4")
        key = mine.tobytes()
        if key not in clock:
            clock[key] = buffer.add(mine, "SCALAR", None, bounds=True)
        samplers.append(
            {
                "input": clock[key],
                "interpolation": "LINEAR",
                "output": buffer.add(turns.astype("<f4"), "VEC4", None),
            }
        )
        channels.append(
            {
                "sampler": len(samplers) - 1,
                "target": {"node": hinge.child + 1, "path": "rotation"},
            }
        )
    reached = [round(float(value), 6) for value in keyframe_times(motion)]
    return {
        "name": f"{title}: fold",
        "samplers": samplers,
        "channels": channels,
        "extras": {"keyframe_times_s": reached, "hinges": list(motion.hinges)},
    }
