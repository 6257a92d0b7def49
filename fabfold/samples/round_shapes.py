"""Round shapes that the samples are made of: ellipsoids, limbs, cylinders with rounded rims."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

__all__ = ["both_sides", "cylinder_y", "ellipsoid", "fuse", "limb"]

Triple = tuple[float, float, float]


def ellipsoid(centre: Triple, radii: Triple, turn: Triple = (0, 0, 0)) -> Any:
    """Ellipsoid, turned about its centre.

    Parameters
    ----------
    centre : (float, float, float)
        In mm.
    radii : (float, float, float)
        Along x, y and z before the turn, mm.
    turn : (float, float, float)
        Euler angles, intrinsic XYZ, degrees.

    Returns
    -------
    build123d.Part
        With two equal radii a surface of revolution, with three a sphere: the kernel unites these
        several times faster than general ellipsoids.
    """
    from build123d import (
        Axis,
        Ellipse,
        Location,
        Plane,
        Pos,
        Rectangle,
        Rot,
        Sphere,
        revolve,
        scale,
    )

    x, y, z = radii
    place = Location(centre, turn)
    if x == y == z:
        return place * Sphere(x)
    if len({x, y, z}) == 3:
        return place * scale(Sphere(1.0), by=radii)
    radius, half, upright = (y, x, Rot(0, 90, 0)) if y == z else (x, y, Rot(90, 0, 0))
    if x == y:
        radius, half, upright = x, z, Rot(0, 0, 0)
    outline = Ellipse(radius, half) & Pos(radius, 0) * Rectangle(2 * radius, 3 * half)
    return place * upright * revolve(Plane.XZ * outline, Axis.Z)


def limb(points: Sequence[Triple], radii: Sequence[float]) -> Any:
    """Round limb through points: circles lofted along a curve, with ball ends.

    Parameters
    ----------
    points : sequence of (x, y, z)
        Where the middle line passes, mm; two make a straight limb.
    radii : sequence of float
        Radius at each point, mm.

    Returns
    -------
    build123d.Part
        One solid.
    """
    from build123d import Circle, Plane, Pos, Solid, Sphere, Spline, Vector, loft

    ends = [Pos(*points[end]) * Sphere(radii[end]) for end in (0, -1)]
    if len(points) == 2:
        tangent = Vector(*points[1]) - Vector(*points[0])
        plane = Plane(origin=points[0], z_dir=tangent)
        if radii[0] == radii[1]:
            stem = Solid.make_cylinder(radii[0], tangent.length, plane)
        else:
            stem = Solid.make_cone(radii[0], radii[1], tangent.length, plane)
        return stem.fuse(*ends)
    line = Spline(*points)
    sections = []
    for point, radius in zip(points, radii, strict=True):
        tangent = line.tangent_at(Vector(*point))
        sections.append(Plane(origin=point, x_dir=_across(tangent), z_dir=tangent) * Circle(radius))
    return loft(sections).fuse(*ends)


def _across(tangent: Any) -> Any:
    from build123d import Vector

    side = Vector(0, 1, 0).cross(tangent)
    return side if side.length > 1e-6 else Vector(1, 0, 0)


def both_sides(shape: Any) -> list[Any]:
    """A shape and its mirror image in the plane y = 0.

    Parameters
    ----------
    shape : build123d.Part
        On either side of the plane.

    Returns
    -------
    list of build123d.Part
        The shape itself and its mirror image.
    """
    from build123d import Plane, mirror

    return [shape, mirror(shape, about=Plane.XZ)]


def fuse(parts: Sequence[Any]) -> Any:
    """Unite parts.

    Parameters
    ----------
    parts : sequence of build123d.Part
        At least one.

    Returns
    -------
    build123d.Part
        The solids of the union.
    """
    from build123d import Compound, Part

    whole = parts[0].fuse(*parts[1:]) if len(parts) > 1 else parts[0]
    return Part(Compound(list(whole.solids())).wrapped)


def cylinder_y(centre: Triple, radius: float, width: float, round_by: float = 0.0) -> Any:
    """Cylinder along y, with rounded rims.

    Parameters
    ----------
    centre : (float, float, float)
        In mm.
    radius : float
        In mm.
    width : float
        Length along y, mm.
    round_by : float
        Radius of the rims, mm; 0 leaves them sharp.

    Returns
    -------
    build123d.Part
        One solid.
    """
    from build123d import Cylinder, Location, fillet

    body = Cylinder(radius, width)
    if round_by:
        body = fillet(
            body.edges().filter_by(lambda edge: edge.geom_type.name == "CIRCLE"), round_by
        )
    return Location(centre, (90, 0, 0)) * body
