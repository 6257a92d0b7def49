"""Bodies on the printer's plates: which way up, and where."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import CheckError
from fabfold.export.threemf import posed
from fabfold.joinery.bodies import Joinery
from fabfold.joinery.loose_pins import PinBore
from fabfold.lattice.rotations import ROTATIONS
from fabfold.meshes import centre_of_mass, vector_areas
from fabfold.printing.profiles import Profile
from fabfold.printing.standing import stands_over

__all__ = ["RIM_MM", "LaidBody", "Plates", "lay_out", "lay_out_plates", "on_plate"]

Floats = NDArray[np.float64]

#: Least contact with the plate that holds a body without help, mm².
CONTACT_MM2 = 60.0
#: Faces this near to the lowest point are in contact with the plate, mm.
_FLAT_MM = 0.05
#: A barrel stands at most this share of a voxel below a body's flat face.
_BARREL_SHARE = 0.2
#: Room along the rim of the plate, and between two bodies, mm.
RIM_MM = 5.0
_ROOM_MM = 4.0
_QUARTER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


@dataclass(frozen=True)
class LaidBody:
    """How a body lies on its plate.

    Attributes
    ----------
    body : int
        Index of the body.
    rotation : (3, 3) float64 array
        From shape A to the plate.
    size_mm : (3,) float64 array
        Its extent there, mm.
    contact_mm2 : float
        Area that touches the plate.
    overhang_mm2 : float
        Area that hangs over more than the profile allows, contact left out.
    supported : bool
        Whether it needs support under it, since a barrel stands below its flat face.
    topples : bool
        Whether its centre of mass is not over its contact: a brim holds it.
    """

    body: int
    rotation: Floats
    size_mm: Floats
    contact_mm2: float
    overhang_mm2: float
    supported: bool
    topples: bool


@dataclass(frozen=True)
class Plates:
    """All bodies on plates.

    Attributes
    ----------
    laid : tuple of LaidBody
        How each body lies, in the order of the bodies.
    plate : (b,) int array
        Plate of each body, from 0.
    poses : (b, 4, 4) float64 array
        From shape A to the body's own plate, whose corner is the origin, mm.
    bed_mm : (float, float, float)
        Size of a plate and height above it.
    """

    laid: tuple[LaidBody, ...]
    plate: NDArray[np.int_]
    poses: Floats
    bed_mm: tuple[float, float, float]

    def to_json(self) -> dict[str, Any]:
        """Ready for a JSON file."""
        return {
            "bed_mm": list(self.bed_mm),
            "bodies": [
                {
                    "plate": int(plate),
                    "pose": pose.tolist(),
                    "contact_mm2": entry.contact_mm2,
                    "overhang_mm2": entry.overhang_mm2,
                    "supported": entry.supported,
                    "topples": entry.topples,
                    "size_mm": entry.size_mm.tolist(),
                }
                for entry, plate, pose in zip(self.laid, self.plate, self.poses, strict=True)
            ],
        }

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> Plates:
        """Plates from what :meth:`to_json` wrote."""
        poses = np.array([entry["pose"] for entry in data["bodies"]]).reshape(-1, 4, 4)
        laid = tuple(
            LaidBody(
                body,
                poses[body, :3, :3],
                np.array(entry["size_mm"]),
                entry["contact_mm2"],
                entry["overhang_mm2"],
                entry["supported"],
                entry["topples"],
            )
            for body, entry in enumerate(data["bodies"])
        )
        wide, deep, high = data["bed_mm"]
        plate = np.array([entry["plate"] for entry in data["bodies"]], dtype=int)
        return cls(laid, plate, poses, (wide, deep, high))

    @property
    def supported(self) -> list[int]:
        """Indices of the bodies that need support under them."""
        return [entry.body for entry in self.laid if entry.supported]

    @property
    def leaning(self) -> list[int]:
        """Indices of the bodies that would topple without a brim, and have no support."""
        return [entry.body for entry in self.laid if entry.topples and not entry.supported]

    @property
    def count(self) -> int:
        """Number of plates."""
        return int(self.plate.max()) + 1 if len(self.plate) else 0


def lay_out(
    body: int, joinery: Joinery, bores: Sequence[PinBore], overhang_deg: float | None
) -> LaidBody:
    """The best of the six lattice faces of a body to print it on.

    A face lies flat with at least :data:`CONTACT_MM2` and nothing below it; of several, the one
    with the least overhang, and of those the one with most bores upright. Where there is none, the
    flat face with the least overhang whose barrels stand below it: then it needs support.

    Parameters
    ----------
    body : int
        Index of the body.
    joinery : Joinery
        The bodies as they are printed.
    bores : sequence of PinBore
        Where the pins go.
    overhang_deg : float or None
        Steepest overhang that prints without support, degrees from the vertical.

    Returns
    -------
    LaidBody
        How it lies.
    """
    mesh = joinery.bodies[body]
    deep = _BARREL_SHARE * joinery.voxel_mm
    limit = -np.sin(np.radians(45.0 if overhang_deg is None else overhang_deg))
    axes = [bore.axis for bore in bores if body in bore.bodies]
    best: tuple[tuple[float, ...], LaidBody] | None = None
    for rotation in _six_faces():
        points = mesh.vertices @ rotation.T
        corners = points[mesh.faces]
        areas = vector_areas(corners)
        size = np.linalg.norm(areas, axis=1)
        down = areas[:, 2] / np.maximum(size, 1e-12)
        low = corners[..., 2].min()
        flat = (down < -0.999) & (np.ptp(corners[..., 2], axis=1) < _FLAT_MM)
        touching = flat & (corners[..., 2].max(axis=1) < low + _FLAT_MM)
        contact = float(size[touching].sum())
        supported = contact < CONTACT_MM2
        if supported:
            # The flat face over the barrels that stand below it.
            touching = flat & (corners[..., 2].max(axis=1) < low + deep)
            contact = float(size[touching].sum())
        hangs = (down < limit - 1e-6) & ~touching
        overhang = float(size[hangs].sum())
        upright = sum(abs(float(rotation[2] @ axis)) > 0.5 for axis in axes)
        extent = np.ptp(points, axis=0)
        laid = LaidBody(
            body, rotation, extent, round(contact, 2), round(overhang, 2), supported,
            not stands_over(centre_of_mass(corners), corners[touching].reshape(-1, 3)[:, :2]),
        )  # fmt: skip
        key = (supported, contact < CONTACT_MM2, round(overhang), -upright, extent[2])
        if best is None or key < best[0]:
            best = key, laid
    assert best is not None
    return best[1]


def _six_faces() -> list[Floats]:
    """One lattice rotation for each of the six directions that can point down."""
    found: dict[tuple[int, ...], Floats] = {}
    for rotation in ROTATIONS:
        found.setdefault(tuple(rotation[2].tolist()), rotation.astype(np.float64))
    return [found[key] for key in sorted(found)]


def lay_out_plates(joinery: Joinery, bores: Sequence[PinBore], profile: Profile) -> Plates:
    """Lay all bodies on as few plates as the packing finds.

    Parameters
    ----------
    joinery : Joinery
        The bodies as they are printed.
    bores : sequence of PinBore
        Where the pins go.
    profile : Profile
        The printer's build volume; 220 × 220 × 250 mm where it names none.

    Returns
    -------
    Plates
        The same for the same bodies.

    Raises
    ------
    CheckError
        If a body fits no plate; it names the voxel size that does.
    """
    from rectpack import MaxRectsBl, PackingMode, newPacker

    bed = profile.bed_mm or (220.0, 220.0, 250.0)
    laid = [
        lay_out(index, joinery, bores, profile.max_overhang_deg)
        for index in range(len(joinery.bodies))
    ]
    free = np.array([bed[0] - 2 * RIM_MM, bed[1] - 2 * RIM_MM, bed[2]])
    for entry in laid:
        _require_fit(joinery, entry, free, bed)
    packer = newPacker(mode=PackingMode.Offline, pack_algo=MaxRectsBl, rotation=True)
    for entry in laid:
        packer.add_rect(*(_tenths(size + _ROOM_MM) for size in entry.size_mm[:2]), entry.body)
    packer.add_bin(*(_tenths(size + _ROOM_MM) for size in free[:2]), float("inf"))
    packer.pack()
    plate = np.zeros(len(laid), dtype=int)
    corner = np.zeros((len(laid), 3))
    for index, x, y, wide, _, body in packer.rect_list():
        entry = laid[body]
        if wide != _tenths(entry.size_mm[0] + _ROOM_MM):
            laid[body] = replace(
                entry, rotation=_QUARTER @ entry.rotation, size_mm=entry.size_mm[[1, 0, 2]]
            )
        plate[body], corner[body, :2] = index, (x / 10, y / 10)
    poses = np.tile(np.eye(4), (len(laid), 1, 1))
    for index in range(int(plate.max()) + 1):
        # What stands on a plate stands in its middle.
        on = np.flatnonzero(plate == index)
        ends = corner[on] + [laid[body].size_mm for body in on]
        corner[on, :2] += np.array(bed[:2]) / 2 - (ends.max(axis=0) / 2)[:2]
    for body, entry in enumerate(laid):
        points = joinery.bodies[body].vertices @ entry.rotation.T
        poses[body, :3, :3] = entry.rotation
        poses[body, :3, 3] = corner[body] - points.min(axis=0)
    return Plates(tuple(laid), plate, poses, bed)


def _tenths(length_mm: float) -> int:
    """Tenths of a millimetre, rounded up: the packing knows whole numbers only."""
    return int(np.ceil(10 * length_mm))


def _require_fit(joinery: Joinery, entry: LaidBody, free: Floats, bed: Sequence[float]) -> None:
    size = entry.size_mm
    flat = max(min(free[0] / size[0], free[1] / size[1]), min(free[0] / size[1], free[1] / size[0]))
    share = min(flat, free[2] / size[2])
    if share < 1.0:
        name = joinery.bodies[entry.body].name
        wanted = np.floor(10 * share * joinery.voxel_mm) / 10
        raise CheckError(
            f"{name} is {size[0]:.0f} × {size[1]:.0f} × {size[2]:.0f} mm and fits no plate of "
            f"{bed[0]:g} × {bed[1]:g} × {bed[2]:g} mm; --voxel-mm {wanted:g} does"
        )


def on_plate(joinery: Joinery, plates: Plates, index: int) -> Joinery:
    """The bodies of one plate, in their places on it.

    Parameters
    ----------
    joinery : Joinery
        The bodies as they are printed.
    plates : Plates
        Where they lie.
    index : int
        Which plate, from 0.

    Returns
    -------
    Joinery
        Those bodies alone.
    """
    laid = posed(joinery, plates.poses)
    on = np.flatnonzero(plates.plate == index)
    return replace(laid, bodies=tuple(laid.bodies[body] for body in on), pins=())
