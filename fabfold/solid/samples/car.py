"""A chunky little car."""

from __future__ import annotations

from typing import Any

from fabfold.solid.samples.shapes import both_sides, cylinder_y, ellipsoid, fuse, limb

__all__ = ["draw"]

WHEELS = (-18.0, 18.5)
WHEEL_RADIUS = 8.6


def draw() -> Any:
    """Draw the car: 10 mm a voxel, looking along +x."""
    from build123d import Axis, Box, Plane, Polyline, Pos, extrude, fillet, make_face

    side = make_face(
        Polyline(
            [(-30, 6), (30, 6), (31, 14), (27, 19), (10, 21), (-22, 21), (-29, 18), (-31, 13)],
            close=True,
        )
    )
    side = fillet(side.vertices(), 3.5)
    hull = extrude(Plane.XZ * side, 14, both=True)
    hull = fillet(hull.faces().filter_by(Axis.Y).edges(), 3.2)

    cabin = _cabin(0.0)
    glass = [
        Plane.XZ * _pane([(-17.5, 22.5), (-4.5, 22.5), (-4.5, 31), (-11.5, 31), (-15, 28)]),
        Plane.XZ * _pane([(-2.0, 22.5), (11.0, 22.5), (7, 28.5), (3.5, 31), (-2.0, 31)]),
    ]
    cutters = [extrude(pane, 40, both=True) for pane in glass]
    cutters += [Pos(30, 0, 27) * Box(50, 17, 8.0), Pos(-36, 0, 27) * Box(46, 15, 7.0)]
    inner = _cabin(0.9)
    for cutter in cutters:
        cabin = cabin - (cutter - inner)

    parts = [hull, cabin]
    for x in WHEELS:
        arch = cylinder_y((x, 11.2, 9), WHEEL_RADIUS + 3.2, 8, 2.0)
        well = cylinder_y((x, 14, 8.6), WHEEL_RADIUS + 1.0, 4.0)
        tyre = cylinder_y((x, 12.2, 8.6), WHEEL_RADIUS, 8.4, 1.6)
        dish = cylinder_y((x, 16.6, 8.6), WHEEL_RADIUS - 3.0, 1.6)
        hub = ellipsoid((x, 15.0, 8.6), (2.8, 2.0, 2.8))
        for one, hole, wheel, cut, cap in zip(
            both_sides(arch), both_sides(well), both_sides(tyre), both_sides(dish), both_sides(hub),
            strict=True,
        ):
            parts += [one - hole, wheel - cut, cap]
    parts += both_sides(ellipsoid((28.6, 9.0, 15.2), (3.4, 3.4, 3.4)))
    parts += both_sides(ellipsoid((-29.2, 9.5, 15.5), (2.4, 2.4, 2.4)))
    for x in (30.4, -30.4):
        parts.append(limb([(x, -12.0, 9.2), (x, 12.0, 9.2)], [2.9, 2.9]))
    floor = Pos(0, 0, -20) * Box(200, 200, 40)
    return fuse([fuse(parts) - floor])


def _cabin(inset: float) -> Any:
    """The cabin, smaller by `inset` on all sides: what the windows are sunk into."""
    from build123d import Axis, Pos, Rectangle, fillet, loft

    base = Pos(-3, 0, 19) * Rectangle(42 - 2 * inset, 25 - 2 * inset)
    top = Pos(-4, 0, 34 - inset) * Rectangle(22 - 2 * inset, 18.5 - 2 * inset)
    body = loft([base, top])
    rims = body.edges() - body.faces().sort_by(Axis.Z)[0].edges()
    return fillet(rims, 3.4 - inset)


def _pane(points: list[tuple[float, float]]) -> Any:
    from build123d import Polyline, fillet, make_face

    pane = make_face(Polyline(points, close=True))
    return fillet(pane.vertices(), 1.2)
