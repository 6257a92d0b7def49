"""Chambers from which powder or resin does not come out: a ball fits inside, but not through.

The space beside the material is flooded from outside by a ball of the least diameter that a way out
must have. Where the ball fits and the flood does not come, there is a chamber. The first look is
coarse and takes ways for narrower than they are; what it suspects is measured on a fine grid.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fabfold.joinery.bodies import BodyMesh
from fabfold.solid.scan import scan_mesh

__all__ = ["Chamber", "find_chambers"]

#: Cells to the diameter of the ball at the first look. The three by three cells around one whose
#: material keeps off them are as wide as the ball.
_COARSE = 3
#: Cells to the diameter at the second look, and the most cells that it takes.
_FINE, _MOST = 10, 15_000_000
#: Chambers of less than so many balls hold next to nothing.
_LEAST = 3.0


@dataclass(frozen=True)
class Chamber:
    """Space that opens only by ways narrower than the ball.

    Attributes
    ----------
    volume_mm3 : float
        What the ball can sweep inside, mm³.
    middle_mm : (3,) tuple of float
        Its middle, mm.
    """

    volume_mm3: float
    middle_mm: tuple[float, float, float]


def find_chambers(bodies: Sequence[BodyMesh], escape_mm: float) -> list[Chamber]:
    """Chambers in and between bodies, the largest first.

    Parameters
    ----------
    bodies : sequence of BodyMesh
        What is printed, where it lies; mm.
    escape_mm : float
        Least diameter of a way out, mm.

    Returns
    -------
    list of Chamber
        Ways are told apart to a tenth of the diameter, or a little more where the bodies are
        large. Chambers of less than three balls are passed over: they hold next to nothing.
    """
    from scipy import ndimage

    low = np.min([body.vertices.min(axis=0) for body in bodies], axis=0)
    high = np.max([body.vertices.max(axis=0) for body in bodies], axis=0)
    side = escape_mm / _COARSE
    # Material is looked for at eight points of a cell, so that no wall slips through.
    material = _material(bodies, low, high, side / 2, 2)
    blocked = ndimage.maximum_filter(_pooled(material), size=3, mode="constant", cval=0)
    if not _shut_in(~blocked)[1]:
        return []
    cells = np.prod((high - low + 4 * escape_mm) / (escape_mm / _FINE))
    side = escape_mm / _FINE * max(1.0, float(np.cbrt(cells / _MOST)))
    material = _material(bodies, low, high, side, 1)
    labels, shut = _shut_in(~_within(material, escape_mm / 2 / side, short=True))
    found = []
    margin = int(np.ceil(escape_mm / side)) + 1
    boxes = ndimage.find_objects(labels)
    for label in shut:
        box = tuple(
            slice(max(0, part.start - margin), part.stop + margin) for part in boxes[label - 1]
        )
        swept = _within(labels[box] == label, escape_mm / 2 / side) & ~material[box]
        start = np.array([part.start for part in box])
        volume = float(swept.sum()) * side**3
        if volume < _LEAST * np.pi / 6 * escape_mm**3:
            continue
        middle = low + side * (start + np.argwhere(swept).mean(axis=0) + 0.5 - _border(1))
        x, y, z = middle.tolist()
        found.append(Chamber(volume, (x, y, z)))
    return sorted(found, key=lambda chamber: -chamber.volume_mm3)


def _within(cells: NDArray[np.bool_], radius: float, *, short: bool = False) -> NDArray[np.bool_]:
    """Cells whose middle is no further than `radius` from that of a cell; `short` of it only.

    The square of the distance, one axis after another, as far as it counts: a transform that
    tells every distance takes some times as long.
    """
    square = radius * radius
    most = int(np.floor(radius))
    beyond = int(np.floor(square)) + 1
    kind = np.uint8 if 2 * beyond < 256 else np.uint32
    away: NDArray[Any] = np.where(cells, 0, beyond).astype(kind)
    for axis in range(cells.ndim):
        line = np.moveaxis(away, axis, 0)
        nearest = line.copy()
        for step in range(1, min(most, len(line) - 1) + 1):
            for to, by in ((nearest[step:], line[:-step]), (nearest[:-step], line[step:])):
                np.minimum(to, by + kind(step * step), out=to)
        away = np.moveaxis(np.minimum(nearest, kind(beyond)), 0, axis)
    return np.asarray(away < square if short else away <= square)


def _border(pool: int) -> int:
    """Free cells around the material on each side, before pooling."""
    return 4 * pool if pool > 1 else 2 * _FINE


def _material(
    bodies: Sequence[BodyMesh],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    side: float,
    pool: int,
) -> NDArray[np.bool_]:
    """Cells with their middle in a body, with free cells all around; a multiple of `pool` each."""
    border = _border(pool)
    shape = np.ceil((high - low) / side).astype(int) + 2 * border
    shape += -shape % pool
    material = np.zeros(tuple(shape), dtype=bool)
    for body in bodies:
        points = (body.vertices - low) / side + border
        first = np.floor(points.min(axis=0)).astype(int)
        extent = np.ceil(points.max(axis=0)).astype(int) - first
        nx, ny, nz = extent.tolist()
        inside = scan_mesh(points - first, body.faces, (nx, ny, nz))
        material[tuple(slice(a, a + n) for a, n in zip(first, extent, strict=True))] |= inside
    return material


def _pooled(material: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Cells of two by two by two, with material where one of the eight has it."""
    nx, ny, nz = (n // 2 for n in material.shape)
    return np.asarray(material.reshape(nx, 2, ny, 2, nz, 2).any(axis=(1, 3, 5)))


def _shut_in(fits: NDArray[np.bool_]) -> tuple[NDArray[np.int32], list[int]]:
    """Labels of where the ball fits, and those that the outside does not reach."""
    from scipy import ndimage

    # Steps along diagonals too: a ball crosses no wall in one of them.
    labels, count = ndimage.label(fits, np.ones((3, 3, 3), dtype=bool))
    outside = labels[0, 0, 0]
    return labels, [label for label in range(1, count + 1) if label != outside]
