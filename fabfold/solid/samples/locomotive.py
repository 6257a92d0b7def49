"""A small steam locomotive."""

from __future__ import annotations

from typing import Any

from fabfold.solid.samples.shapes import both_sides, cylinder_y, ellipsoid, fuse

__all__ = ["draw"]

def draw() -> Any:
    """Draw the locomotive: 10 mm a voxel, looking along +x."""
    from build123d import (
        Axis,
        Box,
        Cylinder,
        Plane,
        Polyline,
        Pos,
        Rot,
        extrude,
        fillet,
        loft,
        make_face,
    )

    frame = Pos(-1, 0, 11) * Box(60, 22, 8)
    frame = fillet(frame.edges().filter_by(Axis.Z), 2)
    boiler = Cylinder(11.5, 40)
    boiler = Pos(9, 0, 25) * Rot(0, 90, 0) * fillet(boiler.edges().group_by(Axis.Z)[-1], 2.5)
    door = Pos(29, 0, 25) * Rot(0, 90, 0) * fillet(
        Cylinder(8, 3).edges().group_by(Axis.Z)[-1], 1.2
    )
    knob = ellipsoid((30.8, 0, 25), (1.8, 2.4, 2.4))
    lamp = Pos(27, 0, 37) * Rot(0, 90, 0) * Cylinder(4, 8)
    bands = [
        Pos(x, 0, 25) * Rot(0, 90, 0) * Cylinder(12.2, 2.2) for x in (2.0, 14.0)
    ]
    chimney = Pos(19, 0, 40) * Cylinder(4.6, 14)
    crown = loft([Pos(19, 0, 44) * _circle(4.6), Pos(19, 0, 50) * _circle(8)])
    rim = Pos(19, 0, 51) * fillet(Cylinder(8.0, 3).edges().group_by(Axis.Z)[-1], 1.2)
    mouth = Pos(19, 0, 51) * Cylinder(5, 6)
    dome = ellipsoid((4, 0, 35), (6, 6, 8.5))

    cab = Pos(-20, 0, 28) * Box(20, 27, 30)
    cab = fillet(cab.edges().filter_by(Axis.Z), 2.5)
    opening = Pos(-20, 0, 33) * fillet(Box(11, 60, 11).edges().filter_by(Axis.Y), 2)
    cab = cab - (opening - Pos(-20, 0, 30) * Box(40, 21.5, 40))
    roof = Pos(-20, 0, 22) * Rot(0, 90, 0) * Cylinder(26, 25)
    roof = roof & (Pos(-20, 0, 60) * Box(25, 33, 35))
    roof = fillet(roof.edges().filter_by(Axis.X), 1.2)
    bunker = Pos(-29, 0, 20) * fillet(Box(9, 24, 12).edges().filter_by(Axis.Z), 2)

    catcher = extrude(
        Plane.XY.offset(1.5) * make_face(Polyline([(24, -12), (36, 0), (24, 12)], close=True)),
        11,
        taper=12,
    )
    slots = [
        Pos(30, y, 6) * Rot(0, 0, 45 if y > 0 else -45) * Box(2, 8, 20) for y in (-11, -7.5, 7.5, 11)
    ]
    del slots
    parts = [frame, boiler, door, knob, lamp, *bands, chimney, crown, rim, dome, cab, roof]
    parts += [bunker, catcher]
    for x, radius in ((-21.0, 9.0), (-1.5, 9.0), (15.5, 6.5)):
        wheel = cylinder_y((x, 12.5, radius), radius, 7, 1.2)
        dish = cylinder_y((x, 16.2, radius), radius - 2.4, 1.8)
        hub = cylinder_y((x, 14.5, radius), 2.6, 4.5, 0.8)
        parts += both_sides(wheel - dish)
        parts += both_sides(hub)
    rod = Pos(-11.2, 16.2, 9) * fillet(Box(24, 2.4, 3.4).edges().filter_by(Axis.Y), 1.5)
    parts += both_sides(rod)
    return fuse([fuse(parts) - mouth])


def _circle(radius: float) -> Any:
    from build123d import Circle

    return Circle(radius)
