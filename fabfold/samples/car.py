"""A chunky little car, six voxels of 12 mm long, three wide and three high."""

from __future__ import annotations

from typing import Any

from fabfold.samples.round_shapes import both_sides, cylinder_y, ellipsoid, fuse

__all__ = ["draw"]

#: Where the axles are along x, and the size of the wheels.
AXLES = (-21.5, 21.5)
WHEEL_RADIUS = 9.8


def draw() -> Any:
    """Draw the car: 12 mm a voxel, looking along +x."""
    from build123d import Pos

    wheel = _wheel()
    wheels = [side for x in AXLES for side in both_sides(Pos(x, 0, 0) * wheel)]
    lamps = [
        *both_sides(ellipsoid((32.2, 10.4, 17.6), (3.6, 3.6, 3.6))),
        *both_sides(ellipsoid((-33.2, 11, 17.6), (2.6, 2.6, 2.6))),
    ]
    bumpers = [cylinder_y((x, 0, 9.6), 3.0, 30, 2.5) for x in (33.0, -33.0)]
    # In groups: the kernel takes half the time of one union of all.
    whole = fuse([_hull(), _cabin_with_windows()])
    for group in (wheels, lamps, bumpers):
        whole = fuse([whole, *group])
    return whole


def _hull() -> Any:
    """Bonnet, sills and boot in one."""
    from build123d import Axis, Plane, Polyline, extrude, fillet, make_face

    outline = [(-34, 4), (34, 4), (35, 15), (31, 21.5), (14, 24), (-26, 24), (-33, 21), (-35, 15)]
    side = make_face(Polyline(outline, close=True))
    side = fillet(side.vertices(), 4.0)
    hull = extrude(Plane.XZ * side, 16.2, both=True)
    return fillet(hull.faces().filter_by(Axis.Y).edges(), 3.2)


def _cabin(inset: float, round_by: float = 0.0) -> Any:
    """The cabin, a truncated pyramid, smaller by `inset` on all sides."""
    from build123d import Pos, Rot, Wedge, fillet

    base, top = 48 - 2 * inset, 30 - 2 * inset
    left = (base - top) / 2 - 2
    width, roof = 30 - 2 * inset, 24 - 2 * inset
    side = (width - roof) / 2
    height = 15 - inset
    wedge = Wedge(base, height, width, left, side, left + top, side + roof)
    body = Pos(-4, 0, 20.8 + height / 2) * Rot(90, 0, 0) * wedge
    if round_by:
        # A list, in the kernel's order: the difference of two edge sets has none.
        lowest = body.bounding_box().min.Z
        rims = [edge for edge in body.edges() if lowest + 1 < edge.center().Z]
        body = fillet(rims, round_by)
    return body


def _cabin_with_windows() -> Any:
    from build123d import Box, Plane, Polyline, Pos, extrude, fillet, make_face

    cutters = [Pos(32, 0, 28.8) * Box(60, 21, 7.6), Pos(-38, 0, 29) * Box(50, 20, 7.0)]
    for outline in (
        [(-21.5, 25), (-6.2, 25), (-6.2, 32.8), (-15, 32.8), (-19, 29.5)],
        [(-3.4, 25), (12.5, 25), (8.5, 30.5), (5, 32.8), (-3.4, 32.8)],
    ):
        pane = make_face(Polyline(outline, close=True))
        cutters.append(extrude(Plane.XZ * fillet(pane.vertices(), 1.3), 40, both=True))
    inner = _cabin(1.4)
    panes = [cutter - inner for cutter in cutters]
    return _cabin(0.0, round_by=3.4).cut(*panes)


def _wheel() -> Any:
    """Arch and wheel of the left side, axle at x = 0."""
    from build123d import Box, Pos

    arch = cylinder_y((0, 12.7, WHEEL_RADIUS), WHEEL_RADIUS + 3.4, 9, 2.2)
    arch = arch - cylinder_y((0, 16, WHEEL_RADIUS), WHEEL_RADIUS + 1.2, 5.0)
    arch = arch - Pos(0, 12, -5) * Box(50, 20, 20)
    tyre = cylinder_y((0, 13.3, WHEEL_RADIUS), WHEEL_RADIUS, 9.4, 2.0)
    tyre = tyre - cylinder_y((0, 18.6, WHEEL_RADIUS), WHEEL_RADIUS - 3.2, 3.0)
    return fuse([arch, tyre, ellipsoid((0, 16.4, WHEEL_RADIUS), (3.2, 2.2, 3.2))])
