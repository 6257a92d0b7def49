"""A hinge's frame from an edge of a body."""

from __future__ import annotations

from typing import Any

from build123d import (
    BuildPart,
    CenterOf,
    Edge,
    GeomType,
    Location,
    Part,
    Plane,
    Solid,
    Vector,
    VectorLike,
)

from .exceptions import HingeError

__all__ = ["edge_frame", "faces_at", "hinge_location"]

#: How far an edge may lie off an edge of its body, in mm.
_NEAR = 1e-3
#: How far bodies may lie off what their arms reach, in mm.
_OFF = 0.01


def hinge_location(origin: VectorLike, along: VectorLike, outwards: VectorLike) -> Location:
    """Lay the hinge's frame on an edge of a part.

    Parameters
    ----------
    origin : VectorLike
        Middle of the edge, in mm.
    along : VectorLike
        Direction along the edge. The child's material is on the side ``outwards × along``.
    outwards : VectorLike
        Direction out of the two bodies, in the face that they share.

    Returns
    -------
    Location
        Where the hinge's frame lies: z along the edge, y outwards.

    Raises
    ------
    HingeError
        If the two directions are not at right angles.
    """
    z_dir, y_dir = Vector(*along).normalized(), Vector(*outwards).normalized()
    if abs(z_dir.dot(y_dir)) > 1e-6:
        raise HingeError("the outward direction must be at right angles to the edge")
    return Plane(origin=origin, x_dir=y_dir.cross(z_dir), z_dir=z_dir).location


def faces_at(body: Part | Solid, edge: Edge) -> list[Vector]:
    """Directions out of a body on both sides of one of its edges.

    Parameters
    ----------
    body : Part or Solid
        The body.
    edge : Edge
        An edge of it.

    Returns
    -------
    list of Vector
        Normals of the two faces that meet there, in its middle.

    Raises
    ------
    HingeError
        If the edge is not straight, or no edge of the body.
    """
    if edge.geom_type != GeomType.LINE:
        raise HingeError("a hinge needs a straight edge; this one is curved")
    middle = edge.position_at(0.5)
    normals: list[Vector] = []
    for face in body.faces():
        if face.distance_to(middle) < _NEAR and all(
            face.distance_to(edge.position_at(at)) < _NEAR for at in (0.1, 0.9)
        ):
            normal = face.normal_at(middle)
            if not any((normal - known).length < 1e-6 for known in normals):
                normals.append(normal)
    if len(normals) != 2:
        raise HingeError(
            f"the edge lies on {len(normals)} faces of the body, not on two: give an edge of the "
            "body itself, such as body.edges().group_by(Axis.Z)[-1].sort_by(Axis.Y)[-1]"
        )
    return normals


def edge_frame(
    parent: Any,
    child: Any,
    edge: Edge,
    gap: float,
    corners: tuple[tuple[float, float], tuple[float, float]] | None = None,
) -> Location:
    """Lay a hinge on an edge of one body, beside the other.

    Parameters
    ----------
    parent, child : Part or Solid
        The two bodies as they lie side by side, or on top of one another, at angle 0.
    edge : Edge
        The straight edge of either at which they shall turn.
    gap : float
        Distance between the bodies in mm, for the outer faces: half of it from the edge.
    corners : ((float, float), (float, float)), optional
        For an axis on arms: how far aside of the axis and below it the edges of parent and child
        lie, in mm.

    Returns
    -------
    Location
        The hinge's frame: z along the edge, x from the parent to the child, y outwards.

    Raises
    ------
    HingeError
        If it is no edge of either body, its faces are not square to one another, or the other body
        does not lie beside it, or not where its arms reach.
    """
    bodies = [body.part if isinstance(body, BuildPart) else body for body in (parent, child)]
    middle = edge.position_at(0.5)
    own = min(range(2), key=lambda index: bodies[index].distance_to(middle))
    normals = faces_at(bodies[own], edge)
    if abs(normals[0].dot(normals[1])) > 1e-6:
        raise HingeError("the two faces at the edge must be square to one another")
    other = bodies[1 - own].center(CenterOf.BOUNDING_BOX) - middle
    towards, outwards = sorted(normals, key=lambda normal: -normal.dot(other))
    if towards.dot(other) <= 0.0:
        raise HingeError(
            "neither face at the edge looks at the other body: draw both beside one another, or "
            "one on the other, as they lie when the hinge is closed or flat"
        )
    x_dir = towards if own == 0 else -towards
    frame = Plane(origin=middle, x_dir=x_dir, z_dir=x_dir.cross(outwards))
    # The axis lies in the middle between the faces that look at one another.
    box = bodies[1 - own].moved(frame.location.inverse()).bounding_box()
    between = box.min.X if own == 0 else -box.max.X
    if between < 0.0:
        raise HingeError(
            f"the bodies overlap by {-between:.3g} mm beside the edge: leave a gap of {gap:g} mm "
            "between them"
        )
    if corners is not None:
        aside, below = corners[own]
        _require_reach(box.max.Y, between, corners, own)
        origin = middle + towards * aside + outwards * below
        return Plane(origin=origin, x_dir=x_dir, z_dir=x_dir.cross(outwards)).location
    shift = 0.5 * between if between < 4.0 * gap else 0.5 * gap
    origin = middle + towards * shift + outwards * (0.5 * gap)
    return Plane(origin=origin, x_dir=x_dir, z_dir=x_dir.cross(outwards)).location


def _require_reach(
    top: float, between: float, corners: tuple[tuple[float, float], tuple[float, float]], own: int
) -> None:
    """Refuse bodies that do not lie as their arms hold them.

    `top` is how far the other body's top lies above that of the body with the edge, `between` how
    far apart their walls are, in mm.
    """
    apart = corners[0][0] + corners[1][0]
    higher = corners[own][1] - corners[1 - own][1]
    if abs(between - apart) > _OFF:
        raise HingeError(
            f"the walls of the bodies are {between:.4g} mm apart and their arms hold them "
            f"{apart:.4g} mm apart: move one, or give the arms offsets that add up to {between:.4g}"
        )
    if abs(top - higher) > _OFF:
        step = top if own == 1 else -top
        raise HingeError(
            f"the top of the {('child', 'parent')[own]} lies {top:.4g} mm above that of the other "
            f"body and the arms hold it {higher:.4g} mm above: give leaf=Arm.pair({step:.4g})"
        )
