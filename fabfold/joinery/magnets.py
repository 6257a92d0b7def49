"""Disc magnets: the pairs that hold two bodies together, where there is room, and their pockets.

A pocket is open at the face, and the magnet is glued in; or it lies below a thin skin, and the
magnet is laid in while the print pauses. Such a pocket keeps a hair-wide vent to the face: it shows
whether the magnet is in, and the body stays one closed surface without a hollow.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from fabfold.joinery.bodies import BodyMesh, Joinery
from fabfold.joinery.booleans import subtract, union
from fabfold.joinery.box_faces import FaceMeeting, across, is_material, meeting_sides
from fabfold.joinery.cells import solids_of
from fabfold.joinery.loose_pins import cylinder_between
from fabfold.joinery.soundness import printable_body

if TYPE_CHECKING:
    import manifold3d

__all__ = ["MAGNETS", "DiscMagnet", "MagnetPair", "Pocket", "pair_place", "with_pockets"]

Floats = NDArray[np.float64]
Triple = tuple[float, float, float]

#: A magnet lies so far below the mouth of its pocket, mm.
DEEP_MM = 0.2
#: Room around a magnet, in diameter, and the wall around its pocket, mm.
_ROOM_MM, _WALL_MM = 0.2, 0.8
#: Places on a face that are tried, in voxel sides from its middle.
_PLACES = (0.0, 0.22, -0.22)
#: Diameter of the vent of an enclosed pocket, mm.
_VENT_MM = 0.6


@dataclass(frozen=True)
class DiscMagnet:
    """A disc magnet.

    Attributes
    ----------
    name : str
        Diameter and thickness in mm, such as ``"3x1"``.
    diameter_mm, thick_mm : float
        The same as numbers.
    pull_n : float
        What pulls two of them apart that touch, N: the low end of what dealers of N42 discs give.
    """

    name: str
    diameter_mm: float
    thick_mm: float
    pull_n: float


MAGNETS: Final[dict[str, DiscMagnet]] = {
    magnet.name: magnet
    for magnet in (
        DiscMagnet("3x1", 3.0, 1.0, 1.5),
        DiscMagnet("4x2", 4.0, 2.0, 4.0),
        DiscMagnet("5x2", 5.0, 2.0, 6.0),
    )
}
"""Magnets that kits can be made with, by name."""


@dataclass(frozen=True)
class Pocket:
    """Form of the pockets of a kit.

    Attributes
    ----------
    magnet : DiscMagnet
        What goes in.
    skin_mm : float
        Material between the magnet and the face, mm; 0 where the pocket is open.
    """

    magnet: DiscMagnet
    skin_mm: float = 0.0

    @property
    def radius_mm(self) -> float:
        """Radius of the pocket, mm."""
        return (self.magnet.diameter_mm + _ROOM_MM) / 2

    @property
    def end_mm(self) -> float:
        """How far below the face the pocket ends, mm."""
        return self.skin_mm + self.magnet.thick_mm + DEEP_MM

    def fits(self, solid: manifold3d.Manifold, point: Floats, into: Floats) -> bool:
        """Whether a body has room for the pocket and its wall at a point of a face."""
        # An enclosed pocket may have a square roof, whichever side is up.
        wide = self.radius_mm * (2.0**0.5 if self.skin_mm else 1.0)
        deep = self.end_mm + _WALL_MM
        return is_material(solid, point + 0.02 * into, into, wide + _WALL_MM, deep)

    def cutter(self, mouth: Floats, into: Floats, upwards: Floats) -> manifold3d.Manifold:
        """What the pocket takes from a body.

        Parameters
        ----------
        mouth, into : (3,) float64 array
            Point on the face, mm, and unit vector into the body.
        upwards : (3,) float64 array
            Unit vector that points up while the body is printed.

        Returns
        -------
        manifold3d.Manifold
            In mm, where `mouth` is.
        """
        start = mouth + (self.skin_mm or -1.0) * into
        hole = cylinder_between(start, mouth + self.end_mm * into, self.radius_mm, outside=True)
        if not self.skin_mm:
            return hole
        parts = [hole, cylinder_between(mouth - into, start + into, _VENT_MM / 2, outside=True)]
        if abs(float(upwards @ into)) < 0.5:
            parts.append(self._roof(mouth, into, upwards))
        return union(parts)

    def _roof(self, mouth: Floats, into: Floats, upwards: Floats) -> manifold3d.Manifold:
        """Above the middle of a pocket that stands on its rim: else the magnet could not go in."""
        import manifold3d

        high, wide = self.radius_mm, 2 * self.radius_mm
        box = manifold3d.Manifold.cube((self.end_mm - self.skin_mm, wide, high))
        frame = np.column_stack([into, np.cross(upwards, into), upwards])
        corner = mouth + self.skin_mm * into - frame[:, 1] * wide / 2
        return box.transform(np.column_stack([frame, corner]))

    def top_mm(self, mouth: Floats, into: Floats, stand: Floats) -> float:
        """Height above the plate at which an enclosed pocket is closed, mm.

        Parameters
        ----------
        mouth, into : (3,) float64 array
            As of :meth:`cutter`.
        stand : (4, 4) float64 array
            From shape A to where the body is printed, the plate at z = 0, mm.
        """
        rise = float(stand[2, :3] @ into)
        foot = float(stand[2, :3] @ mouth + stand[2, 3])
        if abs(rise) < 0.5:
            return foot + self.radius_mm
        return foot + max(rise * self.skin_mm, rise * self.end_mm)


@dataclass(frozen=True)
class MagnetPair:
    """Two magnets that meet when a kit is shut.

    Attributes
    ----------
    bodies : (int, int)
        Indices of the two bodies. The north pole of the first looks out, that of the second in.
    points_mm : (2, 3) tuple of float
        Middle of the mouth of each pocket, on the face, mm, shape A.
    inwards : (2, 3) tuple of float
        Unit vector into each body, shape A.
    shape : {"B", "A"}
        Where they meet: in the box, or in the model.
    pauses_mm : (float, float) or None
        Height above the plate at which the print pauses for each, mm; None where they are glued in.
    """

    bodies: tuple[int, int]
    points_mm: tuple[Triple, Triple]
    inwards: tuple[Triple, Triple]
    shape: Literal["A", "B"] = "B"
    pauses_mm: tuple[float, float] | None = None

    def turned(self) -> MagnetPair:
        """The same pair with its poles the other way round."""
        pauses = self.pauses_mm
        return MagnetPair(
            self.bodies[::-1],
            self.points_mm[::-1],
            self.inwards[::-1],
            self.shape,
            None if pauses is None else pauses[::-1],
        )

    def to_json(self) -> dict[str, Any]:
        """Ready for a JSON file."""
        return {
            "bodies": list(self.bodies),
            "points_mm": [list(point) for point in self.points_mm],
            "inwards": [list(inward) for inward in self.inwards],
            "shape": self.shape,
            "pauses_mm": None if self.pauses_mm is None else list(self.pauses_mm),
        }

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> MagnetPair:
        """A pair from what :meth:`to_json` wrote."""
        one, other = data["bodies"]
        points, inwards = ([tuple(row) for row in data[k]] for k in ("points_mm", "inwards"))
        pauses = data["pauses_mm"]
        return cls(
            (one, other),
            (points[0], points[1]),
            (inwards[0], inwards[1]),
            data["shape"],
            None if pauses is None else (pauses[0], pauses[1]),
        )


def pair_place(
    meeting: FaceMeeting,
    joinery: Joinery,
    solids: Sequence[manifold3d.Manifold],
    poses: Floats,
    pocket: Pocket,
    shape: Literal["A", "B"],
) -> MagnetPair | None:
    """A pair at the first place on a meeting with room for a pocket and its wall on both sides.

    Parameters
    ----------
    meeting : FaceMeeting
        The two faces.
    joinery : Joinery
        The bodies.
    solids : sequence of manifold3d.Manifold
        The same as solids, mm.
    poses : (b, 4, 4) float64 array
        Where they meet, mm.
    pocket : Pocket
        Form of the pockets.
    shape : {"B", "A"}
        What the poses are.

    Returns
    -------
    MagnetPair or None
        None where there is no room.
    """
    u, v = across(meeting.normal)
    for i in _PLACES:
        for j in _PLACES:
            place = meeting.middle + joinery.voxel_mm * (i * u + j * v)
            sides = meeting_sides(meeting, place, joinery, poses)
            if all(pocket.fits(solids[body], point, into) for body, point, into in sides):
                (_, one, first), (_, other, second) = sides
                return MagnetPair(
                    meeting.bodies,
                    (_triple(one), _triple(other)),
                    (_triple(first), _triple(second)),
                    shape,
                )
    return None


def _triple(vector: Floats) -> Triple:
    x, y, z = (round(float(value), 6) + 0.0 for value in vector)
    return x, y, z


def with_pockets(
    joinery: Joinery, pairs: Sequence[MagnetPair], pocket: Pocket, stand: Floats
) -> tuple[Joinery, list[MagnetPair]]:
    """The bodies with a pocket for every magnet.

    Parameters
    ----------
    joinery : Joinery
        The bodies without pockets.
    pairs : sequence of MagnetPair
        Where the magnets go.
    pocket : Pocket
        Form of the pockets.
    stand : (b, 4, 4) float64 array
        From shape A to where each body is printed, the plate at z = 0, mm.

    Returns
    -------
    joinery : Joinery
        The bodies with pockets.
    pairs : list of MagnetPair
        The same, with the heights at which the print pauses where the pockets are enclosed.
    """
    tools: dict[int, list[manifold3d.Manifold]] = {}
    told = []
    for pair in pairs:
        pauses = []
        for body, point, inward in zip(pair.bodies, pair.points_mm, pair.inwards, strict=True):
            mouth, into = np.array(point), np.array(inward)
            tools.setdefault(body, []).append(pocket.cutter(mouth, into, stand[body][2, :3]))
            pauses.append(round(pocket.top_mm(mouth, into, stand[body]), 3))
        one, other = pauses
        told.append(replace(pair, pauses_mm=(one, other) if pocket.skin_mm else None))
    bodies = list(joinery.bodies)
    solids = solids_of(bodies)
    for body, cuts in sorted(tools.items()):
        name = bodies[body].name
        solid = subtract(solids[body], cuts)
        bodies[body] = BodyMesh(name, *printable_body(solid, name, np.zeros(3)))
    return replace(joinery, bodies=tuple(bodies)), told
