"""Pins that are pushed in after printing: where they go, and what each end of their bore gets.

A body printed by itself has open bores. At the end where the pin goes in, the two bodies that it
joins are cleared along the axis; at the other end a thin web with a hole closes the bore, so that
the pin stops there and a needle pushes it out again. A screw needs no web: its head is sunk into
the first knuckle, which is as wide as those that turn, and its thread cuts itself into the last.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import GeometryError
from fabfold.joinery.bodies import BodyMesh, Joinery, PlacedPin
from fabfold.joinery.booleans import subtract, union
from fabfold.joinery.cells import as_manifold
from fabfold.joinery.pin_kinds import SHORT_MM, PinFit
from fabfold.joinery.soundness import printable_body
from fabfold.tree.fold_tree import FoldTree

if TYPE_CHECKING:
    import manifold3d

__all__ = [
    "CHANNEL_MM",
    "PUSHER_MM",
    "PinBore",
    "barrel_around",
    "cylinder_between",
    "entry_channel",
    "meshes_with_pins",
    "pin_bores",
    "pin_rod",
    "pin_way",
    "with_pins",
]

Floats = NDArray[np.float64]

#: A rod that pushes the pin in reaches this far beyond the barrel, mm.
PUSHER_MM = 60.0
#: The channel for the pin is this much wider than its loosest bore, in radius, mm.
CHANNEL_MM = 0.025
#: Web that closes the far end of a bore, and the diameter of the hole through it, mm.
WEB_MM = 0.8
PUSH_OUT_MM = 1.0
#: The web reaches this far into the wall around the bore, mm.
_BITE_MM = 0.2
_CORNERS = 24


@dataclass(frozen=True)
class PinBore:
    """The knuckles that one loose pin goes through, in shape A.

    Attributes
    ----------
    hinge : int
        Index of the hinge.
    bodies : (int, int)
        Indices of the bodies that have knuckles here.
    owner : int
        Index of the body that grips the pin; the outer knuckles are its.
    middle : (3,) float64 array
        Middle of the barrel, mm.
    axis : (3,) float64 array
        Unit vector along the axis.
    half_mm : float
        Half of the length of the barrel, mm.
    """

    hinge: int
    bodies: tuple[int, int]
    owner: int
    middle: Floats
    axis: Floats
    half_mm: float

    def face(self, end: int) -> Floats:
        """Middle of the barrel's end face, mm; `end` is 1 where `axis` points to, else -1."""
        return np.asarray(self.middle + end * self.half_mm * self.axis)


def pin_bores(tree: FoldTree, joinery: Joinery) -> list[PinBore]:
    """Every line of knuckles of a kit, in the order of the hinges.

    Parameters
    ----------
    tree : FoldTree
        The bodies and their hinges.
    joinery : Joinery
        The printed bodies; it tells the sizes.

    Returns
    -------
    list of PinBore
        One for each hinge.

    Raises
    ------
    GeometryError
        If both axes of a double hinge lie on one edge.
    """
    reach = joinery.barrel_radius_mm + joinery.clearance_mm
    origin = np.asarray(joinery.origin_mm)
    found = []
    for edge in tree.edges:
        if len({tree.hinges[h].point for h in edge.hinges}) < len(edge.hinges):
            raise GeometryError(
                f"{' and '.join(tree.hinges[h].name for h in edge.hinges)}: both axes lie on one "
                "edge, and one loose pin does not hold three bodies"
            )
        for place, index in enumerate(edge.hinges):
            hinge = tree.hinges[index]
            axis = np.asarray(hinge.direction, dtype=float)
            found.append(
                PinBore(
                    index,
                    (hinge.parent, hinge.child),
                    # The second axis of a double hinge is laid out from the child's side.
                    hinge.child if place == 1 else hinge.parent,
                    origin + joinery.voxel_mm * np.asarray(hinge.point, dtype=float),
                    axis / np.linalg.norm(axis),
                    joinery.voxel_mm / 2 - reach,
                )
            )
    return sorted(found, key=lambda bore: bore.hinge)


def cylinder_between(
    start: Floats, end: Floats, radius: float, *, outside: bool
) -> manifold3d.Manifold:
    """A cylinder between two points.

    Parameters
    ----------
    start, end : (3,) float64 array
        Middles of its ends, mm.
    radius : float
        Radius, mm.
    outside : bool
        Whether its facets lie outside the true cylinder, or inside.

    Returns
    -------
    manifold3d.Manifold
        In mm.
    """
    import manifold3d

    along = end - start
    length = float(np.linalg.norm(along))
    z = along / length
    x = np.eye(3)[int(np.abs(z).argmin())]
    x = x - (x @ z) * z
    x /= np.linalg.norm(x)
    if outside:
        radius /= np.cos(np.pi / _CORNERS)
    rod = manifold3d.Manifold.cylinder(length, radius, radius, _CORNERS)
    return rod.transform(np.column_stack([x, np.cross(z, x), z, start]))


def entry_channel(bore: PinBore, end: int, joinery: Joinery, fit: PinFit) -> manifold3d.Manifold:
    """What the two bodies of a pin give up beyond its barrel so that it can go in.

    Parameters
    ----------
    bore : PinBore
        The knuckles.
    end : int
        1 or -1: the end at which the pin goes in.
    joinery : Joinery
        It tells the pin's radius.
    fit : PinFit
        How the pin sits; the way is as wide as its loosest bore, or as the pocket of its head.

    Returns
    -------
    manifold3d.Manifold
        In mm, shape A.
    """
    face = bore.face(end)
    radius = max(joinery.pin_radius_mm + fit.slip_mm, fit.pocket_mm) + CHANNEL_MM
    return cylinder_between(face, face + end * PUSHER_MM * bore.axis, radius, outside=True)


def barrel_around(bore: PinBore, joinery: Joinery) -> manifold3d.Manifold:
    """The barrel of a pin, all of its knuckles, with the wall that its bores want.

    Parameters
    ----------
    bore : PinBore
        The knuckles.
    joinery : Joinery
        It tells the barrel's radius.

    Returns
    -------
    manifold3d.Manifold
        In mm, shape A.
    """
    return cylinder_between(bore.face(-1), bore.face(1), joinery.barrel_radius_mm, outside=True)


def pin_rod(bore: PinBore, end: int, radius_mm: float) -> manifold3d.Manifold:
    """The space beyond the barrel that a pin and its pusher go through, in shape A.

    Parameters
    ----------
    bore : PinBore
        The knuckles.
    end : int
        1 or -1: the end at which the pin goes in.
    radius_mm : float
        Radius of the rod, mm.

    Returns
    -------
    manifold3d.Manifold
        In mm.
    """
    face = bore.face(end)
    return cylinder_between(face, face + end * PUSHER_MM * bore.axis, radius_mm, outside=True)


def pin_way(bore: PinBore, end: int, pin: PlacedPin, fit: PinFit) -> manifold3d.Manifold:
    """All the space that a placed pin, its head and its pusher go through, in shape A.

    Parameters
    ----------
    bore : PinBore
        The knuckles.
    end : int
        1 or -1: the end at which the pin goes in.
    pin : PlacedPin
        The pin in its place.
    fit : PinFit
        How it sits; where its thread cuts itself in, only the core of the screw counts.

    Returns
    -------
    manifold3d.Manifold
        In mm.
    """
    radius, face = pin.diameter_mm / 2, bore.face(end)
    tip, tail = np.array(pin.tip_mm), np.array(pin.tail_mm)
    bitten = tip + end * pin.thread_mm * bore.axis
    parts = [
        cylinder_between(bitten, tail, radius, outside=True),
        cylinder_between(tail, face + end * bore.axis, max(radius, pin.head_mm), outside=True),
        pin_rod(bore, end, max(radius, pin.head_mm)),
    ]
    if pin.thread_mm > 0:
        parts.append(cylinder_between(tip, bitten, radius + fit.grip_mm, outside=False))
    return union(parts)


def with_pins(
    joinery: Joinery, bores: Sequence[PinBore], ends: Sequence[int], fit: PinFit
) -> Joinery:
    """Clear each pin's way in, close its other end, and put the pins where they go.

    Parameters
    ----------
    joinery : Joinery
        Bodies with open bores.
    bores : sequence of PinBore
        Where the pins go.
    ends : sequence of int
        For each, the end at which it goes in: 1 or -1.
    fit : PinFit
        How the pins sit in their bores.

    Returns
    -------
    Joinery
        The bodies as they are printed, with their pins.

    Raises
    ------
    GeometryError
        If a channel cuts a body apart.
    RecipeError
        If no screw is sold in a length that fits the hinges.
    """
    cuts: dict[int, list[manifold3d.Manifold]] = {}
    webs: dict[int, list[manifold3d.Manifold]] = {}
    pins = []
    for bore, end in zip(bores, ends, strict=True):
        channel = entry_channel(bore, end, joinery, fit)
        for body in bore.bodies:
            cuts.setdefault(body, []).append(channel)
        if fit.threaded:
            pin, wide = _screw(joinery, bore, end, fit)
            cuts[bore.owner].append(wide)
        else:
            pin, web = _plain_pin(joinery, bore, end, fit)
            webs.setdefault(bore.owner, []).append(web)
        pins.append(pin)
    bodies = []
    for index, mesh in enumerate(joinery.bodies):
        if index not in cuts:
            bodies.append(mesh)
            continue
        solid = subtract(as_manifold(mesh.vertices, mesh.faces, mesh.name), cuts[index])
        solid = union([solid, *webs.get(index, [])])
        parts = [part for part in solid.decompose() if part.volume() > 1.0]
        if len(parts) != 1:
            raise GeometryError(f"{mesh.name}: the way of a pin cuts it into {len(parts)} pieces")
        bodies.append(BodyMesh(mesh.name, *printable_body(parts[0], mesh.name, np.zeros(3))))
    return replace(joinery, bodies=tuple(bodies), pins=tuple(pins))


def _plain_pin(
    joinery: Joinery, bore: PinBore, end: int, fit: PinFit
) -> tuple[PlacedPin, manifold3d.Manifold]:
    """A pin in its place, and the web with a hole that it stands on."""
    inner = -end * bore.axis
    outside, inside = bore.face(-end), bore.face(-end) - WEB_MM * inner
    plug = cylinder_between(
        inside, outside, joinery.pin_radius_mm + fit.grip_mm + _BITE_MM, outside=False
    )
    hole = cylinder_between(inside - inner, outside + inner, PUSH_OUT_MM / 2, outside=True)
    tail = bore.face(end) - end * SHORT_MM * bore.axis
    diameter = 2 * joinery.pin_radius_mm
    pin = PlacedPin(bore.hinge, bore.owner, _triple(inside), _triple(tail), diameter)
    return pin, plug - hole


def _screw(
    joinery: Joinery, bore: PinBore, end: int, fit: PinFit
) -> tuple[PlacedPin, manifold3d.Manifold]:
    """A screw in its place, and what is cut out of the knuckle that its head is sunk into."""
    barrel, count, gap = 2 * bore.half_mm, joinery.knuckles, joinery.clearance_mm
    knuckle = (barrel - (count - 1) * gap) / count
    radius = joinery.pin_radius_mm
    length = fit.screw_length(barrel, knuckle, 2 * radius)
    face, inner = bore.face(end), -end * bore.axis
    seat = face + fit.sunk_mm * inner
    pin = PlacedPin(
        bore.hinge,
        bore.owner,
        _triple(seat + length * inner),
        _triple(seat),
        2 * radius,
        fit.head_mm,
        fit.head_height_mm,
        round(fit.sunk_mm + length - (barrel - knuckle), 6),
    )
    pocket = cylinder_between(seat, face - inner, fit.pocket_mm, outside=True)
    wide = cylinder_between(
        seat - inner, face + (knuckle + gap / 2) * inner, radius + fit.slip_mm, outside=True
    )
    return pin, pocket + wide


def _triple(point: Floats) -> tuple[float, float, float]:
    x, y, z = (round(float(value), 6) for value in point)
    return x, y, z


def meshes_with_pins(
    joinery: Joinery, *, tight: bool = True
) -> list[tuple[Floats, NDArray[np.int32]]]:
    """The bodies with the pins that they grip, as they move.

    Parameters
    ----------
    joinery : Joinery
        The printed bodies and their pins.
    tight : bool
        Whether pins are there too that both of their bodies grip; they lie inside their barrels.

    Returns
    -------
    list of ((v, 3) float64 array, (f, 3) int32 array)
        Vertices in mm, shape A, and triangles of each body; a pin is a piece of its own.
    """
    meshes = [(body.vertices, body.faces) for body in joinery.bodies]
    for pin in joinery.pins:
        if pin.tight and not tight:
            continue
        tip, tail = np.array(pin.tip_mm), np.array(pin.tail_mm)
        solid = cylinder_between(tip, tail, pin.diameter_mm / 2, outside=True)
        if pin.head_mm > 0:
            out = (tail - tip) / pin.length_mm
            solid += cylinder_between(
                tail, tail + pin.head_height_mm * out, pin.head_mm, outside=True
            )
        made = solid.to_mesh64()
        vertices, faces = meshes[pin.owner]
        points = np.asarray(made.vert_properties, dtype=np.float64)[:, :3]
        corners = np.asarray(made.tri_verts, dtype=np.int32) + np.int32(len(vertices))
        meshes[pin.owner] = (
            np.concatenate([vertices, points]),
            np.concatenate([faces, corners]).astype(np.int32),
        )
    return meshes
