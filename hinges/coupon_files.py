"""Files of the tolerance coupon, and the page that tells how to read it.

Files for a slicer hold one object, so that no slicer moves the flaps apart, and their first layer
stands back from every gap, so that it is not the elephant's foot that is measured.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from copy import deepcopy
from pathlib import Path

import numpy as np

from .coupon_plan import (
    DEFAULT_CLEARANCES,
    PIN_MM,
    CouponBody,
    coupon_meshes,
    plan_coupon,
    relieved,
    require_bed,
)
from .exceptions import HingeError
from .shape_meshes import MeshPart

__all__ = ["write_coupon"]

_COLUMNS = 3  # how many clearances the page shows


def write_coupon(
    path: Path | str,
    clearances: Sequence[float] = DEFAULT_CLEARANCES,
    *,
    wall_mm: float = 0.8,
    pin_mm: float = PIN_MM,
    title: str = "Hinge coupon",
    guide: bool = True,
    bed_mm: tuple[float, float] | None = None,
) -> list[Path]:
    """Write a coupon for the slicer or for CAD, and the page that tells how to read it.

    Parameters
    ----------
    path : Path or str
        File to write; its suffix decides the format: .3mf, .step, .stp or .stl.
    clearances : sequence of float
        Clearances in mm, each only once.
    wall_mm : float
        Thinnest wall in mm.
    pin_mm : float
        Diameter in mm of the loose pin that its bores are for.
    title : str
        Title for the file's metadata and the page's head, such as the name of the profile.
    guide : bool
        Whether to write a one-page PDF too, ``<name>-guide.pdf`` beside the file, that tells how to
        read the coupon.
    bed_mm : (float, float), optional
        Size of the printer's bed in mm.

    Returns
    -------
    list of Path
        The files that were written.

    Raises
    ------
    HingeError
        If the suffix is unknown, the clearances cannot be used, or the coupon is larger than the
        bed.
    """
    from .guide import write_guide

    target = Path(path)
    writers = {".3mf": _write_3mf, ".stl": _write_stl, ".step": _write_step, ".stp": _write_step}
    writer = writers.get(target.suffix.lower())
    if writer is None:
        raise HingeError(
            f"coupon file {target.name!r}: use a name that ends in {', '.join(sorted(writers))}"
        )
    bodies = plan_coupon(clearances, wall_mm, pin_mm)
    if bed_mm is not None:
        require_bed(bodies, bed_mm)
    target.parent.mkdir(parents=True, exist_ok=True)
    part = target.with_name(f".part-{target.name}")
    written = [target]
    try:
        writer(part, bodies, title)
        part.replace(target)
    finally:
        part.unlink(missing_ok=True)
    if guide:
        page = target.with_name(f"{target.stem}-guide.pdf")
        part = page.with_name(f".part-{page.name}")
        try:
            columns = coupon_meshes(plan_coupon(clearances[:_COLUMNS], wall_mm, pin_mm))
            write_guide(part, tuple(clearances), columns, title, pin_mm)
            part.replace(page)
        finally:
            part.unlink(missing_ok=True)
        written.append(page)
    return written


def _joined(bodies: Sequence[CouponBody]) -> MeshPart:
    """All bodies in one mesh, so that no slicer moves them apart."""
    vertices, faces, count = [], [], 0
    for mesh in relieved(coupon_meshes(bodies)):
        vertices.append(mesh.vertices)
        faces.append(mesh.faces + count)
        count += len(mesh.vertices)
    return MeshPart(np.concatenate(vertices), np.concatenate(faces).astype(np.int32))


def _write_3mf(path: Path, bodies: Sequence[CouponBody], title: str) -> None:
    from .package import PackagePart, package_3mf

    whole = PackagePart(title, *_joined(bodies), (78, 143, 214))
    facts = {"Title": title}
    path.write_bytes(package_3mf([whole], title=title, facts=facts, layout="whole"))


def _write_stl(path: Path, bodies: Sequence[CouponBody], title: str) -> None:
    mesh = _joined(bodies)
    corners = mesh.vertices[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    layout = [("normal", "<f4", 3), ("corner", "<f4", (3, 3)), ("extra", "<u2")]
    rows = np.zeros(len(corners), dtype=layout)
    rows["normal"], rows["corner"] = normals, corners
    head = title.encode("ascii", "replace")[:79].ljust(80)
    path.write_bytes(head + struct.pack("<I", len(rows)) + rows.tobytes())


def _write_step(path: Path, bodies: Sequence[CouponBody], title: str) -> None:
    from build123d import Compound, export_step

    from .tolerance_coupon import coupon_solids

    named = []
    for body, solid in zip(bodies, coupon_solids(bodies), strict=True):
        own = deepcopy(solid)  # equal flaps share one shape in memory, and so would share a name
        own.label = body.name
        named.append(own)
    export_step(Compound(label=title, children=named), path, timestamp="2000-01-01T00:00:00")
