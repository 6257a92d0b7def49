"""What a model file is, in a second or two, before anything is made of it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fabfold.files import sha256_of
from fabfold.solid.closed_solid import Solid
from fabfold.solid.load import read_mesh, solid_from_mesh
from fabfold.solid.raw import RawMesh
from fabfold.solid.thicken import thin_share

__all__ = ["Inspection", "inspect_model", "inspect_solid"]

#: Boxes of about equal sides, by their cells.
_BOXES = {
    27: "3x3x3",
    36: "3x3x4",
    48: "3x4x4",
    64: "4x4x4",
    80: "4x4x5",
    100: "4x5x5",
    125: "5x5x5",
}
#: A part thinner than this share of a voxel carries no hinge and is thickened or lost.
_THIN = 0.5
#: Up to this share of thin surface a model takes voxels of that size as it is.
_FEW = 0.1
#: At most so many colours are listed, by the area that they cover.
_COLOURS = 16


@dataclass(frozen=True)
class Inspection:
    """What there is to say of a model.

    Attributes
    ----------
    file : str
        Name of the file or of the sample.
    format : str
        Such as ``"STL"``.
    units : str
        Unit that the file names; ``"none"`` where it names none. All figures are in it.
    triangles : int
        Triangles of the file.
    pieces : int
        Separate pieces of material in it.
    size : tuple of float
        Sides of the bounding box of what was made of it.
    volume : float
        Its volume.
    painted : list of str or bool
        Colours found, ``#rrggbb``, those of most area first; False where there is one or none.
    objects : list of str
        Names of the objects of a file that can have several.
    thin_share : float
        Share of the surface on parts thinner than half a voxel of a box of 64 cells.
    templates : list of str
        Boxes that suit it.
    notes : list of str
        What was repaired or assumed.
    """

    file: str
    format: str
    units: str
    triangles: int
    pieces: int
    size: tuple[float, float, float]
    volume: float
    painted: list[str] | bool
    objects: list[str]
    thin_share: float
    templates: list[str]
    notes: list[str]

    def to_json(self) -> dict[str, Any]:
        """All of it, JSON-ready."""
        return {**vars(self), "size": list(self.size)}


def inspect_model(path: Path, wanted: str = "") -> Inspection:
    """Look at a model file.

    Parameters
    ----------
    path : Path
        The file.
    wanted : str
        Name or number of the one object of a 3MF file to take; empty takes all.

    Returns
    -------
    Inspection
        What it is.

    Raises
    ------
    ModelError
        If it cannot be used; the message says why, and what to do.
    """
    raw = read_mesh(path, wanted)
    solid = solid_from_mesh(path.stem, raw, sha256_of(path), label=path.name)
    kind = path.suffix[1:].upper()
    return _inspection(path.name, "STEP" if kind == "STP" else kind, raw, solid)


def inspect_solid(solid: Solid, name: str) -> Inspection:
    """Look at a solid that was not read from a file, such as a sample, in mm.

    Parameters
    ----------
    solid : Solid
        The solid.
    name : str
        What to call it.
    """
    raw = RawMesh(solid.vertices, solid.faces.astype(np.int64), unit="mm")
    return _inspection(name, "sample", raw, solid)


def _inspection(name: str, kind: str, raw: RawMesh, solid: Solid) -> Inspection:
    low, high = solid.bounds
    share, templates = _suitable(solid)
    return Inspection(
        file=name,
        format=kind,
        units=raw.unit or "none",
        triangles=len(raw.faces),
        pieces=solid.pieces,
        size=(float(high[0] - low[0]), float(high[1] - low[1]), float(high[2] - low[2])),
        volume=float(solid.volume),
        painted=_colours(raw),
        objects=list(raw.objects),
        thin_share=round(share, 4),
        templates=[f"box-{_BOXES[cells]}" for cells in templates],
        notes=list(solid.notes),
    )


def _suitable(solid: Solid) -> tuple[float, list[int]]:
    """Thin share with 64 voxels, and the cells of boxes that suit a model, best first.

    The paper asks for voxels no larger than the parts that are to be kept (section 3): a chunky
    model takes few of them, one with thin limbs many.
    """

    def thin(cells: int) -> float:
        return thin_share(solid, _THIN * float(np.cbrt(solid.volume / cells)))

    share = thin(64)
    if share > _FEW:
        return share, [125, 100, 80]
    return share, [36, 48, 64] if thin(36) <= _FEW / 2 else [64, 48, 80]


def _colours(raw: RawMesh) -> list[str] | bool:
    """Colours of a file, those of most area first."""
    from fabfold.meshes import face_areas

    if raw.colours is None:
        return False
    areas = face_areas(raw.vertices[raw.faces])
    known, which = np.unique(raw.colours, axis=0, return_inverse=True)
    if len(known) < 2:
        return False
    covered = np.bincount(which.reshape(-1), weights=areas)
    order = np.argsort(-covered, kind="stable")[:_COLOURS]
    return ["#{:02x}{:02x}{:02x}".format(*known[index]) for index in order]
