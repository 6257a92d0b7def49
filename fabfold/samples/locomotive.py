"""A small tank locomotive, six voxels of 12 mm long, three wide and four high."""

from __future__ import annotations

from typing import Any

from fabfold.samples.round_shapes import both_sides, cylinder_y, ellipsoid, fuse

__all__ = ["draw"]

#: Where the axles are along x, and the radius of their wheels.
AXLES = ((-25.0, 9.5), (-1.5, 9.5), (20.5, 8.0))
BOILER_HEIGHT = 24.0


def draw() -> Any:
    """Draw the locomotive: 12 mm a voxel, looking along +x."""
    from build123d import Box, Pos, fillet

    tank = Pos(0.5, 14.0, 25.5) * Box(25, 6.4, 11.5)
    tank = fillet(tank.edges(), 1.8)
    return fuse([*_frame(), *_boiler(), *_cab(), *both_sides(tank), *_wheels()])


def _frame() -> list[Any]:
    from build123d import Axis, Box, Plane, Polyline, Pos, extrude, fillet, make_face

    frame = Pos(-2, 0, 10.5) * Box(67, 27, 10)
    beam = Pos(29.5, 0, 12) * Box(5, 34, 7)
    prow = make_face(Polyline([(26, -14), (37, 0), (26, 14)], close=True))
    return [
        fillet(frame.edges().filter_by(Axis.Z), 2),
        fillet(beam.edges().filter_by(Axis.X), 2),
        extrude(Plane.XY.offset(1) * prow, 9, taper=8),
    ]


def _boiler() -> list[Any]:
    """Boiler along x with its door, bands, dome, lamp and chimney."""
    from build123d import Axis, Cone, Cylinder, Pos, Rot, fillet

    def rounded(radius: float, length: float, round_by: float) -> Any:
        body = Cylinder(radius, length)
        return fillet(body.edges().group_by(Axis.Z)[-1], round_by)

    def lying(x: float, z: float) -> Any:
        return Pos(x, 0, z) * Rot(0, 90, 0)

    mouth = Pos(19, 0, 46.5) * Cylinder(4.4, 8)
    chimney = Pos(19, 0, 38) * Cylinder(4.8, 10)
    crown = Pos(19, 0, 42) * Cone(4.8, 7.4, 5)
    rim = Pos(19, 0, 45.5) * rounded(7.4, 3.2, 1.2)
    return [
        lying(8.5, BOILER_HEIGHT) * rounded(13.2, 46, 3.0),
        lying(31.5, BOILER_HEIGHT) * rounded(9.0, 4, 1.4),
        ellipsoid((33.6, 0, BOILER_HEIGHT), (2.0, 2.6, 2.6)),
        lying(16.5, BOILER_HEIGHT) * Cylinder(13.9, 2.4),
        lying(26.0, BOILER_HEIGHT) * Cylinder(13.9, 2.4),
        lying(28.5, 38.5) * rounded(4.2, 7, 0.8),
        ellipsoid((1, 0, 36), (6.4, 6.4, 9.0)),
        chimney - mouth,
        crown - mouth,
        rim - mouth,
    ]


def _cab() -> list[Any]:
    """Cab with windows, its roof and the coal bunker."""
    from build123d import Axis, Box, Cylinder, Pos, Rot, fillet

    cab = Pos(-22.5, 0, 27) * Box(22, 32, 30)
    cab = fillet(cab.edges().filter_by(Axis.Z), 2.5)
    opening = fillet(Box(11, 60, 9.5).edges().filter_by(Axis.Y), 2)
    solid_inside = Pos(-22.5, 0, 32) * Box(40, 25, 40)
    window = Pos(-22.5, 0, 33) * opening - solid_inside
    roof = Pos(-22.5, 0, 10.2) * Rot(0, 90, 0) * Cylinder(37.3, 27)
    roof = roof & (Pos(-22.5, 0, 57.9) * Box(27, 36, 36))
    bunker = fillet(Box(6, 28, 14).edges().filter_by(Axis.Z), 2)
    return [cab - window, fillet(roof.edges().filter_by(Axis.X), 1.0), Pos(-33, 0, 19) * bunker]


def _wheels() -> list[Any]:
    from build123d import Axis, Box, Pos, fillet

    parts: list[Any] = []
    for x, radius in AXLES:
        wheel = cylinder_y((x, 14.0, radius), radius, 7, 1.4)
        dish = cylinder_y((x, 17.6, radius), radius - 2.8, 2.4)
        hub = cylinder_y((x, 15.6, radius), 3.0, 4.2, 0.8)
        parts += [*both_sides(wheel - dish), *both_sides(hub)]
    (rear, radius), (front, _), _ = AXLES
    rod = Box(front - rear + 5, 2.2, 3.6)
    rod = Pos((front + rear) / 2, 17.0, radius) * fillet(rod.edges().filter_by(Axis.Y), 1.6)
    return [*parts, *both_sides(rod)]
