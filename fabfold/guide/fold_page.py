"""``fold.html``: the fold as one page that plays anywhere, without a network.

The page holds three.js (MIT licence, as trimesh brings it with its viewer), the bodies with
positions of 16 bits, and the steps of :mod:`fabfold.guide.fold_steps`.
"""

from __future__ import annotations

import base64
import io
import json
import re
import zipfile
import zlib
from html import escape
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import GeometryError
from fabfold.export.glb import pivots_mm
from fabfold.export.shading import split_vertices
from fabfold.export.weld import printable_mesh
from fabfold.fold.motion import Motion
from fabfold.guide.manual import StepPlan
from fabfold.guide.wording import step_text
from fabfold.joinery.bodies import Joinery
from fabfold.srgb import hex_of_colour
from fabfold.tree.fold_tree import FoldTree

__all__ = ["fold_page", "three_js"]


def three_js() -> str:
    """The source of three.js, with its licence, as trimesh ships it.

    Raises
    ------
    GeometryError
        If this trimesh brings none.
    """
    try:
        packed = (_trimesh_folder() / "resources/templates/viewer.zip").read_bytes()
        with zipfile.ZipFile(io.BytesIO(packed)) as archive:
            page = archive.read(archive.namelist()[0]).decode("utf-8")
    except (OSError, zipfile.BadZipFile, UnicodeDecodeError) as error:
        raise GeometryError(f"fold.html: trimesh's viewer cannot be read: {error}") from error
    # Its licence and then one long line; the parts of the viewer follow in the same element.
    found = re.search(
        r"<script>(/\*\*\s*\* @license[^/]*Three\.js Authors[^/]*\*/\s*\n[^\n]+)", page
    )
    if found is None:
        raise GeometryError("fold.html: this version of trimesh brings no three.js; install 4.5")
    return found[1]


def _trimesh_folder() -> Path:
    """Where trimesh is installed; found without loading it, which takes half a second."""
    spec = find_spec("trimesh")
    if spec is None or spec.origin is None:
        raise FileNotFoundError("trimesh is not installed")
    return Path(spec.origin).parent


def _aligned(array: NDArray[Any]) -> bytes:
    """Bytes of an array, filled up to eight."""
    data = array.tobytes()
    return data + b"\0" * (-len(data) % 8)


def _packed(joinery: Joinery, pivots: NDArray[np.float64]) -> tuple[list[dict[str, Any]], bytes]:
    """Place and bounds of each body in the data, and the data."""
    entries: list[dict[str, Any]] = []
    data = bytearray()
    for index, body in enumerate(joinery.bodies):
        vertices, faces = printable_mesh(body)
        points, normals, triangles = split_vertices(vertices.astype(float) - pivots[index], faces)
        low = points.min(axis=0).astype(float)
        size = np.maximum(np.ptp(points.astype(float), axis=0), 1e-9)
        steps = np.rint((points - low) / size * 65535).astype("<u2")
        turned = np.zeros((len(points), 4), dtype=np.int8)
        turned[:, :3] = np.rint(normals * 127)
        entries.append(
            {
                "at": [len(data), len(points), len(triangles)],
                "low": [round(float(value), 5) for value in low],
                "size": [round(float(value), 5) for value in size],
            }
        )
        data += _aligned(steps) + _aligned(turned) + _aligned(triangles.astype("<u4"))
    return entries, bytes(data)


def fold_page(
    joinery: Joinery,
    tree: FoldTree,
    motion: Motion,
    plan: StepPlan,
    *,
    title: str,
    facts: str,
    colours: NDArray[np.uint8],
) -> str:
    """The page.

    Parameters
    ----------
    joinery : Joinery
        The printed bodies in shape A.
    tree : FoldTree
        The bodies and hinges, in the same order.
    motion : Motion
        The certified path.
    plan : StepPlan
        Its steps, and from where each is seen.
    title, facts : str
        Heading, and a line below it.
    colours : (b, 3) uint8 array
        Colour of each body, sRGB.

    Returns
    -------
    str
        HTML, the same for the same input.
    """
    pivots = pivots_mm(joinery, tree)
    hinge_of = {hinge.child: column for column, hinge in enumerate(tree.hinges)}
    entries, data = _packed(joinery, pivots)
    for index, entry in enumerate(entries):
        column = hinge_of.get(index, -1)
        parent = -1 if column < 0 else tree.hinges[column].parent
        offset = pivots[index] - (pivots[parent] if parent >= 0 else 0.0)
        entry |= {
            "name": joinery.bodies[index].name,
            "colour": hex_of_colour(colours[index]),
            "parent": parent,
            "hinge": column,
            "axis": [0, 0, 1] if column < 0 else list(tree.hinges[column].direction),
            "offset": [round(float(value), 6) for value in offset],
        }
    angles = motion.angles_deg[0].copy()
    told: list[dict[str, Any]] = []
    for step, view in zip(plan.steps, plan.views, strict=False):
        # The page's own nodes stand at their pivots.
        held = step.before[step.held].copy()
        held[:3, 3] += held[:3, :3] @ pivots[step.held]
        told.append(
            {
                "hinge": step.hinge,
                "before": [float(value) for value in angles],
                "turn": step.change_deg,
                "moving": list(step.moving),
                "held": step.held,
                "held_pose": [round(float(value), 9) for value in held.T.ravel()],
                "view": [view.azimuth_deg, view.elevation_deg],
                "text": step_text(step),
            }
        )
        angles[step.hinge] += step.change_deg
    kit = {
        "view": [plan.views[-1].azimuth_deg, plan.views[-1].elevation_deg],
        "bodies": entries,
        "steps": told,
    }
    parts = {
        "TITLE": escape(title),
        "FACTS": escape(facts),
        "THREE": three_js(),
        "KIT": json.dumps(kit, separators=(",", ":")).replace("<", "\\u003c"),
        "MESHES": base64.b64encode(zlib.compress(data, 9)).decode("ascii"),
    }
    page = files("fabfold.guide").joinpath("fold_page.html").read_text("utf-8")
    return re.sub(r"\{\{([A-Z]+)\}\}", lambda found: parts[found[1]], page)
