"""A half as it is cut from a blank: a leaf or bar with one barrel along it, then its notches.

A smith rolls the whole edge of a leaf to a barrel and cuts the knuckles out of it. So does the
kernel: blank and notches are drawn in one outline each, and one boolean makes the half. Welding
turned knuckles to a notched web takes two, the second with surfaces that lie in one another.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from itertools import pairwise
from math import hypot, sqrt

from .shapes import Blank, Point, Prism, Shape, Turned, bounds, meet

__all__ = ["cut_from_blank", "notches", "rim"]

#: Sides of a rim shorter than this, in mm, are left to the slower way.
_SHORT = 1e-3
#: Decimals of a mm to which corners of outlines are one.
_DIGITS = 9


def rim(blank: Blank) -> tuple[Point, ...]:
    """Draw the outline of a blank across its axis.

    Parameters
    ----------
    blank : Blank
        The blank.

    Returns
    -------
    tuple of (x, y)
        Corners in mm, counter-clockwise, from where the web leaves the barrel to where it comes
        back; an arc about the axis closes it. Empty where they do not meet so, once.
    """
    radius, outline = blank.radius, blank.web.outline
    chains: list[list[Point]] = []
    for (x, y), (u, v) in zip(outline, (*outline[1:], outline[0]), strict=True):
        marks = [0.0, *_crossings((x, y), (u - x, v - y), radius), 1.0]
        for first, last in pairwise(marks):
            start = (x + first * (u - x), y + first * (v - y))
            end = (u, v) if last == 1.0 else (x + last * (u - x), y + last * (v - y))
            if hypot(0.5 * (start[0] + end[0]), 0.5 * (start[1] + end[1])) <= radius:
                continue
            if chains and first == 0.0 and chains[-1][-1] == (x, y):
                chains[-1].append(end)
            else:
                chains.append([start, end])
    if len(chains) == 2 and chains[1][-1] == chains[0][0]:  # it began outside of the barrel
        chains = [chains[1] + chains[0][1:]]
    if len(chains) != 1 or chains[0][0] == chains[0][-1]:
        return ()
    corners = tuple(chains[0])
    short = any(hypot(u - x, v - y) < _SHORT for (x, y), (u, v) in pairwise((*corners, corners[0])))
    return () if short else corners


def _crossings(start: Point, along: Point, radius: float) -> list[float]:
    """Where a side of an outline crosses a circle about the origin, as shares of its length."""
    square = along[0] ** 2 + along[1] ** 2
    middle = -(start[0] * along[0] + start[1] * along[1]) / square
    inside = radius**2 - (start[0] + middle * along[0]) ** 2 - (start[1] + middle * along[1]) ** 2
    if inside <= 0.0:
        return []
    half = sqrt(inside / square)
    return [at for at in (middle - half, middle + half) if 0.0 < at < 1.0]


def notches(row: Turned, knuckles: Sequence[Turned]) -> tuple[Turned, ...]:
    """Turn what a row of knuckles leaves free of the room about it.

    Parameters
    ----------
    row : Turned
        The room of the row: the barrels of the half's own knuckles, and the grooves of the others.
    knuckles : sequence of Turned
        The half's own knuckles with their pins, bores and recesses, all inside the room.

    Returns
    -------
    tuple of Turned
        The notches, in order along z; empty where outlines meet in single points.
    """
    sides: dict[Point, Point] = {}
    level: dict[float, list[Point]] = defaultdict(list)  # sides across the axis, by their z
    for outline in (row.outline, *(knuckle.outline[::-1] for knuckle in knuckles)):
        corners = [(round(radius, _DIGITS), round(z, _DIGITS)) for radius, z in outline]
        for start, end in zip(corners, (*corners[1:], corners[0]), strict=True):
            if start[1] == end[1]:
                level[start[1]].append((start[0], end[0]))
            elif sides.get(end) == start:  # there and back: room and knuckle have it in common
                del sides[end]
            elif start[0] or end[0]:
                sides[start] = end
    for z, spans in level.items():
        for inner, outer in pairwise(sorted({radius for span in spans for radius in span})):
            out = sum(start <= inner and outer <= end for start, end in spans)
            back = sum(end <= inner and outer <= start for start, end in spans)
            if out != back:
                start, end = (inner, z), (outer, z)
                if out < back:
                    start, end = end, start
                if start in sides:
                    return ()
                sides[start] = end
    made = []
    while sides:
        begun = min(sides.keys() - sides.values(), default=min(sides), key=lambda corner: corner[1])
        corners = [begun]
        while corners[-1] in sides:
            corners.append(sides.pop(corners[-1]))
        if corners[-1] == begun:
            del corners[-1]
        elif begun[0] or corners[-1][0]:
            return ()
        made.append(Turned(_straightened(corners)))
    return tuple(sorted(made, key=lambda notch: min(z for _, z in notch.outline)))


def _straightened(corners: list[Point]) -> tuple[Point, ...]:
    """An outline without the corners between two sides of one direction along or across z."""
    around = zip((corners[-1], *corners[:-1]), corners, (*corners[1:], corners[0]), strict=True)
    return tuple(
        corner
        for before, corner, after in around
        if not any(before[axis] == corner[axis] == after[axis] for axis in (0, 1))
    )


def cut_from_blank(
    web: Sequence[Shape],
    add: Sequence[Shape],
    row: Turned,
    room: Sequence[Shape],
    place: Callable[[Shape], Shape] = lambda shape: shape,
) -> tuple[Shape | None, tuple[Shape, ...]]:
    """Plan a half as a blank and its notches, where it can be cut so.

    Parameters
    ----------
    web, add : sequence of Shape
        What joins the knuckles, and the knuckles, as :class:`hinges.shapes.HalfPlan` has them, with
        their axis along z.
    row : Turned
        The room of the row, as for :func:`notches`.
    room : sequence of Shape
        What else the web gives up, in its place.
    place : callable
        Lays a shape of the row in its place; it stays where it is when left out.

    Returns
    -------
    blank : Shape or None
        None where the web is no single prism along the axis that meets the barrel once, or where
        something that is added is no plain knuckle: a roof over a bore is cut sooner from its own
        knuckle than beside all notches.
    notches : tuple of Shape
        What is cut from it.
    """
    knuckles = [shape for shape in add if isinstance(shape, Turned)]
    if len(web) != 1 or not isinstance(web[0], Prism) or len(knuckles) < len(add):
        return None, ()
    blank = Blank(web[0], max(radius for shape in knuckles for radius, _ in shape.outline))
    cut = notches(row, knuckles)
    given = [shape for shape in room if meet(bounds(shape), bounds(place(web[0])))]
    in_way = any(meet(bounds(shape), bounds(place(own))) for shape in given for own in knuckles)
    if not rim(blank) or not cut or in_way:
        return None, ()
    return place(blank), (*map(place, cut), *given)
