"""Primitive shapes as data, so that exact solids and meshes come from the same numbers."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Prism", "Shape", "Turned", "cylinder"]

Point = tuple[float, float]


@dataclass(frozen=True)
class Turned:
    """A closed (radius, z) outline turned about the z axis.

    Attributes
    ----------
    outline : tuple of (radius, z)
        In mm, at least three corners, all radii at or above 0.
    """

    outline: tuple[Point, ...]


@dataclass(frozen=True)
class Prism:
    """A closed (x, y) outline drawn out along z.

    Attributes
    ----------
    outline : tuple of (x, y)
        In mm, convex.
    start, end : float
        z of the two flat ends in mm.
    """

    outline: tuple[Point, ...]
    start: float
    end: float


Shape = Turned | Prism


def cylinder(radius: float, start: float, end: float) -> Turned:
    """Turn a plain cylinder on the z axis from `start` to `end` (mm)."""
    return Turned(((0.0, start), (radius, start), (radius, end), (0.0, end)))
