"""Pins, screws and magnets of a kit as exact turned solids for CAD."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fabfold.export.body_brep import Brep, BrepEdge, Face
from fabfold.export.steptext import StepSolid
from fabfold.export.surfaces import Axis, Plane, Round
from fabfold.joinery.bodies import Joinery, PlacedPin
from fabfold.joinery.box_hold import Retention
from fabfold.joinery.magnets import DEEP_MM, MAGNETS
from fabfold.tree.fold_tree import FoldTree

__all__ = ["hardware_solids", "turned_brep"]

#: Colours of filament, of steel and of magnets, sRGB.
_FILAMENT = (226, 220, 204)
_STEEL = (158, 162, 168)
_MAGNET = (104, 108, 116)


def turned_brep(
    point: Sequence[float], direction: int, sections: Sequence[tuple[float, float, float]]
) -> Brep:
    """Cylinders that stand on each other, as one solid with true round faces.

    Parameters
    ----------
    point : (3,) sequence of float
        A point of the axis, mm.
    direction : int
        0, 1 or 2: the axis runs along +x, +y or +z.
    sections : sequence of (float, float, float)
        Radius, start and end of each cylinder along the axis from `point`, mm; each begins where
        the one before ends, with another radius.

    Returns
    -------
    Brep
        Every round face in two halves, so that no face meets itself in a seam.
    """
    x, y, z = (float(value) for value in point)
    length = max(abs(end) for _, *ends in sections for end in ends)
    axis = Axis((x, y, z), direction, length, max(radius for radius, _, _ in sections))
    along, across = np.eye(3)[direction], np.eye(3)[(direction + 1) % 3]
    vertices: list[np.ndarray] = []
    edges: list[BrepEdge] = []
    faces: list[Face] = []

    def circle(radius: float, height: float) -> tuple[int, int]:
        """Two vertices and two half circles, counter-clockwise; numbers of vertex and edge."""
        first = len(vertices)
        middle = np.array([x, y, z]) + height * along
        vertices.extend([middle + radius * across, middle - radius * across])
        edges.append(BrepEdge(first, first + 1, axis, radius, height))
        edges.append(BrepEdge(first + 1, first, axis, radius, height))
        return first, len(edges) - 2

    def disc(height: float, up: bool, rim: int, hole: int | None = None) -> None:
        """A flat face within a circle, with another as its hole."""
        sign = 1.0 if up else -1.0
        middle = np.array([x, y, z]) + height * along
        ring = ((rim, True), (rim + 1, True)), ((rim + 1, False), (rim, False))
        loops = [ring[0] if up else ring[1]]
        if hole is not None:
            inner = ((hole, True), (hole + 1, True)), ((hole + 1, False), (hole, False))
            loops.append(inner[1] if up else inner[0])
        a, b, c = (sign * along).tolist()
        faces.append(Face(Plane((*middle.tolist(),), (a, b, c)), tuple(loops)))  # type: ignore[arg-type]

    above: tuple[float, int] | None = None
    for radius, start, end in sections:
        low, bottom = circle(radius, start)
        high, top = circle(radius, end)
        seams = len(edges)
        edges.extend([BrepEdge(low, high), BrepEdge(low + 1, high + 1)])
        surface = Round(axis, radius, 0.0, True)
        for half in (0, 1):
            loop = (
                (bottom + half, True),
                (seams + 1 - half, True),
                (top + half, False),
                (seams + half, False),
            )
            faces.append(Face(surface, (loop,)))
        if above is None:
            disc(start, False, bottom)
        elif above[0] > radius:
            disc(start, True, above[1], bottom)
        else:
            disc(start, False, bottom, above[1])
        above = radius, top
    assert above is not None
    disc(sections[-1][2], True, above[1])
    return Brep(np.array(vertices), tuple(edges), tuple(faces))


def hardware_solids(
    joinery: Joinery, tree: FoldTree, retention: Retention | None = None
) -> list[StepSolid]:
    """What is put into the printed bodies, in its place in shape A.

    Parameters
    ----------
    joinery : Joinery
        The bodies with their pins.
    tree : FoldTree
        It names the hinges.
    retention : Retention, optional
        The magnets.

    Returns
    -------
    list of StepSolid
        A pin or screw a hinge, such as ``pin-00`` of ``hinge-00``, and two magnets a pair.
    """
    solids = []
    for pin in joinery.pins:
        number = tree.hinges[pin.hinge].name.removeprefix("hinge-")
        metal = pin.diameter_mm not in (1.75, 2.85)  # what filament is sold in
        name = f"{'screw' if pin.thread_mm > 0 else 'pin'}-{number}"
        solids.append(StepSolid(name, _pin(pin), _STEEL if metal else _FILAMENT))
    if retention is not None and retention.pairs:
        magnet = MAGNETS[retention.magnet]
        for index, pair in enumerate(retention.pairs):
            for pole, mouth, inwards in zip(
                ("north", "south"), pair.points_mm, pair.inwards, strict=True
            ):
                into = np.array(inwards)
                face = np.array(mouth) + (retention.skin_mm or DEEP_MM) * into
                disc = [(magnet.diameter_mm / 2, magnet.thick_mm)]
                made = _between(face, face + magnet.thick_mm * into, disc)
                solids.append(StepSolid(f"magnet-{index:02d}-{pole}-out", made, _MAGNET))
    return solids


def _pin(pin: PlacedPin) -> Brep:
    tip, tail = np.array(pin.tip_mm), np.array(pin.tail_mm)
    parts = [(pin.diameter_mm / 2, pin.length_mm)]
    if pin.head_mm > 0:
        parts.append((pin.head_mm, pin.head_height_mm))
    return _between(tip, tail, parts)


def _between(start: np.ndarray, end: np.ndarray, parts: list[tuple[float, float]]) -> Brep:
    """Cylinders of given radius and length from a point along a lattice axis towards another."""
    along = int(np.abs(end - start).argmax())
    lengths = np.concatenate([[0.0], np.cumsum([length for _, length in parts])])
    sections = [
        (radius, float(low), float(high))
        for (radius, _), low, high in zip(parts, lengths[:-1], lengths[1:], strict=True)
    ]
    if end[along] < start[along]:
        sections = [(radius, -high, -low) for radius, low, high in reversed(sections)]
    return turned_brep(start.tolist(), along, sections)
