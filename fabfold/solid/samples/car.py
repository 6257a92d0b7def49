"""A chunky little car."""

from __future__ import annotations

from typing import Any

from fabfold.solid.samples.shapes import both_sides, cylinder_y, ellipsoid, fuse

__all__ = ["draw"]

#: Where the axles are along x, and the size of the wheels.
AXLES = (-18.0, 18.5)
WHEEL_RADIUS = 8.6


def draw() -> Any:
    """Draw the car: 10 mm a voxel, looking along +x."""
    from build123d import Pos

    parts = [_hull(), _cabin_with_windows()]
    for part in _wheel():
        for x in AXLES:
            parts += both_sides(Pos(x, 0, 0) * part)
    parts += both_sides(ellipsoid((28.6, 8.8, 15.2), (3.4, 3.4, 3.4)))
    parts += both_sides(ellipsoid((-29.2, 9.5, 15.5), (2.4, 2.4, 2.4)))
    parts += [cylinder_y((x, 0, 9.6), 2.9, 27, 2.4) for x in (30.0, -30.0)]
    return fuse(parts)


def _hull() -> Any:
    """Bonnet, sills and boot in one."""
    from build123d import Axis, Plane, Polyline, extrude, fillet, make_face

    outline = [(-30, 6), (30, 6), (31, 14), (27, 19), (10, 21), (-22, 21), (-29, 18), (-31, 13)]
    side = make_face(Polyline(outline, close=True))
    side = fillet(side.vertices(), 3.5)
    hull = extrude(Plane.XZ * side, 14, both=True)
    return fillet(hull.faces().filter_by(Axis.Y).edges(), 3.2)


def _cabin(inset: float) -> Any:
    """The cabin, smaller by `inset` on all sides: what the windows are sunk into."""
    from build123d import Axis, Pos, Rectangle, fillet, loft

    base = Pos(-3, 0, 19) * Rectangle(42 - 2 * inset, 25 - 2 * inset)
    top = Pos(-4, 0, 34 - inset) * Rectangle(22 - 2 * inset, 18.5 - 2 * inset)
    body = loft([base, top])
    rims = body.edges() - body.faces().sort_by(Axis.Z)[0].edges()
    return fillet(rims, 3.4 - inset)


def _cabin_with_windows() -> Any:
    from build123d import Box, Plane, Polyline, Pos, extrude, fillet, make_face

    cutters = [Pos(30, 0, 26.7) * Box(50, 17, 8.4), Pos(-36, 0, 26.7) * Box(46, 16, 7.4)]
    for outline in (
        [(-18.0, 22.5), (-4.5, 22.5), (-4.5, 31), (-11.5, 31), (-15.2, 28)],
        [(-2.0, 22.5), (11.5, 22.5), (7.5, 28.5), (3.5, 31), (-2.0, 31)],
    ):
        pane = make_face(Polyline(outline, close=True))
        cutters.append(extrude(Plane.XZ * fillet(pane.vertices(), 1.2), 40, both=True))
    inner = _cabin(1.3)
    panes = [cutter - inner for cutter in cutters]
    return _cabin(0.0).cut(*panes)


def _wheel() -> list[Any]:
    """Arch and wheel of the left side, axle at x = 0."""
    from build123d import Box, Pos

    arch = cylinder_y((0, 11.2, 9), WHEEL_RADIUS + 3.2, 8, 2.0)
    arch = arch - cylinder_y((0, 14, WHEEL_RADIUS), WHEEL_RADIUS + 1.2, 4.4)
    arch = arch - Pos(0, 11, -3) * Box(40, 20, 20)
    tyre = cylinder_y((0, 12.0, WHEEL_RADIUS), WHEEL_RADIUS, 9.0, 1.8)
    tyre = tyre - cylinder_y((0, 16.8, WHEEL_RADIUS), WHEEL_RADIUS - 2.8, 2.2)
    return [arch, tyre, ellipsoid((0, 15.0, WHEEL_RADIUS), (2.8, 2.2, 2.8))]
