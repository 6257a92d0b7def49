"""The tolerance coupon as data and as meshes, without the CAD kernel.

A row of small hinges, a row of hexagonal sockets and a row of bores for a loose pin hang on one
frame that carries their numbers, raised; a loose hexagonal plug lies beside it. A number is the
clearance in mm of the hinge before it and of the socket behind it, and how much wider than the pin
the bore is, in diameter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from .clearance import Clearance
from .digits import raised_number
from .exceptions import FitError, HingeError
from .leaf import Leaf
from .plan_double import Matrix
from .plan_single import SinglePlan, SingleSpec, plan_single
from .shape_meshes import MeshPart, half_manifolds, manifold_of, mesh_part
from .shapes import HalfPlan, Moved, Prism, Shape, Turned, box, regular

__all__ = [
    "DEFAULT_CLEARANCES",
    "FINE_STEP",
    "PIN_MM",
    "CouponBody",
    "coupon_meshes",
    "fine_clearances",
    "plan_coupon",
    "relieved",
    "require_bed",
]

DEFAULT_CLEARANCES: Final[tuple[float, ...]] = (0.15, 0.20, 0.25, 0.30, 0.35, 0.40, 0.45, 0.50)
"""Clearances of a coupon in mm."""

FINE_STEP: Final = 0.025
"""Step of a second coupon in mm."""

PIN_MM: Final = 1.75
"""Diameter in mm of the loose pin that the bores are for: filament."""

# Sizes of a coupon with barrels of 2.5 mm radius, in mm; larger clearances want larger barrels.
_RADIUS = 2.5
_LENGTH = 12.0  # of a hinge
_SCALES = (1.0, 1.2, 1.4, 1.7, 2.0)
_THICK = 1.0  # of frame and flaps
_SPINE = 5.6  # width of the frame
_STAND = 3.4  # from the frame to the axis
_FLAP = 4.6  # from the axis to the end of a flap
_PLUG, _PLUG_HIGH = 5.0, 4.0  # across flats and height of the hexagonal plug
_RING, _RING_HIGH = 0.85, 1.4  # wall and height of a socket
_BORE_HIGH = 3.0  # height of a bore for the pin; its wall is that of a socket
_SEAM = 0.4  # how far sockets and bores reach into what they hang on
#: How far the first layers stand back, and how high.
_RELIEF, _RELIEF_HIGH = 0.25, 0.3


@dataclass(frozen=True)
class CouponBody:
    """One printed body of a coupon: halves of hinges in their places, and plain shapes.

    Attributes
    ----------
    name : str
        Name of the body, such as "link 0.30".
    halves : tuple of (HalfPlan, (4, 4) float64 array)
        Halves of hinges and the frames in mm that they are laid into.
    shapes : tuple of Shape
        Other shapes in mm: the frame's plate and its numbers.
    """

    name: str
    halves: tuple[tuple[HalfPlan, Matrix], ...]
    shapes: tuple[Shape, ...] = ()


def _frame(x: float, y: float, z: float, side: float) -> Matrix:
    """Lay a hinge's frame down: its axis along ±X, its upper side up, its child towards ±Y."""
    matrix = np.eye(4)
    matrix[:3, 0] = (0.0, side, 0.0)
    matrix[:3, 1] = (0.0, 0.0, 1.0)
    matrix[:3, 2] = (side, 0.0, 0.0)
    matrix[:3, 3] = (x, y, z)
    return matrix


def fine_clearances(around: float) -> tuple[float, ...]:
    """Clearances of a second coupon, about what the first one gave.

    Parameters
    ----------
    around : float
        The middle one, in mm.

    Returns
    -------
    tuple of float
        Seven of them, in steps of 0.025 mm.
    """
    return tuple(round(around + FINE_STEP * step, 3) for step in range(-3, 4))


def _plan(clearance: float, scale: float, wall: float) -> SinglePlan:
    return plan_single(
        SingleSpec.read(
            _LENGTH * scale,
            radius=_RADIUS * scale,
            clearance=Clearance(clearance),
            leaf=Leaf(_FLAP * scale, _THICK, flat=True),
            wall=wall,
            chamfer=0.2,
        )
    )


def _plans(clearances: Sequence[float], wall: float) -> tuple[float, list[SinglePlan]]:
    """Plans of all hinges, and the scale at which the largest clearance still fits."""
    refusal: FitError | None = None
    for scale in _SCALES:
        plans = []
        for clearance in clearances:
            try:
                plans.append(_plan(clearance, scale, wall))
            except FitError as error:
                refusal = FitError(
                    error.rule,
                    f"coupon hinge at {clearance:g} mm: {error.rule}",
                    error.value,
                    error.limit,
                    "leave this clearance out",
                    error.unit,
                )
                break
        else:
            return scale, plans
    assert refusal is not None
    raise refusal


def _socket(x: float, y: float, clearance: float) -> Prism:
    """A hexagonal ring about the plug, with its flats across y."""
    hole = regular(6, _PLUG + 2.0 * clearance, 0.0, 1.0, 0.0).outline
    rim = regular(6, _PLUG + 2.0 * (clearance + _RING), 0.0, 1.0, 0.0).outline
    place = [tuple((px + x, py + y) for px, py in outline) for outline in (rim, hole)]
    return Prism(place[0], 0.0, _RING_HIGH, (place[1][::-1],))


def _bore(x: float, y: float, clearance: float, pin: float) -> Moved:
    """A bore wider than the pin by a clearance, standing, with its wall; y is the near side."""
    inner = 0.5 * (pin + clearance)
    outer = inner + _RING
    rim = ((inner, 0.0), (outer, 0.0), (outer, _BORE_HIGH), (inner, _BORE_HIGH))
    return Moved(Turned(rim), (x, y + outer, 0.0))


def plan_coupon(
    clearances: Sequence[float], wall: float = 0.8, pin: float = PIN_MM
) -> tuple[CouponBody, ...]:
    """Plan every body of the coupon.

    Parameters
    ----------
    clearances : sequence of float
        Clearances in mm, at most three digits each.
    wall : float
        Thinnest wall in mm.
    pin : float
        Diameter in mm of the loose pin that the bores are for.

    Returns
    -------
    tuple of CouponBody
        The frame first, then the flap of each clearance, and the plug.

    Raises
    ------
    HingeError
        If there are no clearances or two alike, or the pin is none of 0.5 to 6 mm.
    FitError
        If a clearance is too large for the coupon's hinges.
    """
    if not clearances or len(set(clearances)) != len(clearances):
        raise HingeError("a coupon needs at least one clearance, and each only once")
    if not 0.5 <= pin <= 6.0:
        raise HingeError(f"a pin of {pin:g} mm: give its diameter, 0.5 to 6 mm")
    scale, plans = _plans(clearances, wall)
    pitch = _LENGTH * scale + 1.2
    start = -0.5 * pitch * (len(clearances) - 1)
    half = 0.5 * pitch * len(clearances)
    edge = 0.5 * _SPINE
    shapes: list[Shape] = [box(-half, half, -edge, edge, 0.0, _THICK)]
    halves: list[tuple[HalfPlan, Matrix]] = []
    flaps: list[CouponBody] = []
    for index, (clearance, plan) in enumerate(zip(clearances, plans, strict=True)):
        x = start + index * pitch
        level = plan.spec.leaf.limits(plan.layout, plan.spec.gap)[3]
        frame = _frame(x, -edge - _STAND * scale, level, -1.0)
        halves.append((plan.parent, frame))
        flaps.append(CouponBody(f"flap {clearance:g}", ((plan.child, frame),)))
        # The flats of the socket lie across y; it reaches a little into the frame.
        reach = 0.5 * _PLUG + clearance + _RING
        shapes.append(_socket(x, edge + reach - _SEAM, clearance))
        shapes.append(_bore(x, edge + 2.0 * (reach - _SEAM), clearance, pin))
        # Without the nought, so that there is room between two numbers.
        digits = 2 if round(clearance, 2) == clearance else 3
        text = f"{clearance:.{digits}f}".removeprefix("0")
        shapes += raised_number(text, x, 0.0, _THICK, high=4.0, raised=0.4)
    plug = regular(6, _PLUG, 0.0, _PLUG_HIGH, 0.0)
    beside = tuple((px + half + _PLUG, py) for px, py in plug.outline)
    loose = CouponBody("plug", (), (Prism(beside, 0.0, _PLUG_HIGH),))
    return (CouponBody("frame", tuple(halves), tuple(shapes)), *flaps, loose)


def coupon_meshes(bodies: Sequence[CouponBody], segments: int = 64) -> tuple[MeshPart, ...]:
    """Build every body as a mesh.

    Parameters
    ----------
    bodies : sequence of CouponBody
        The planned bodies.
    segments : int
        Number of corners of a full circle.

    Returns
    -------
    tuple of MeshPart
        One a body, in mm.
    """
    from manifold3d import Manifold, OpType

    made = []
    for body in bodies:
        parts = [manifold_of(shape, segments, outside=False) for shape in body.shapes]
        for plan, matrix in body.halves:
            parts.append(half_manifolds(plan, segments)[0].transform(matrix[:3]))
        whole = Manifold.batch_boolean(parts, OpType.Add) if len(parts) > 1 else parts[0]
        made.append(mesh_part(whole))
    return tuple(made)


def require_bed(bodies: Sequence[CouponBody], bed_mm: tuple[float, float]) -> None:
    """Refuse a coupon whose frame is larger than the bed, also turned by a quarter."""
    boxes = [
        manifold_of(shape, 16, outside=False).bounding_box()
        for body in bodies
        for shape in body.shapes
    ]
    low, high = np.min(boxes, axis=0)[:2], np.max(boxes, axis=0)[3:5]
    wide, deep = sorted(high - low)
    if wide > min(bed_mm) or deep > max(bed_mm):
        raise HingeError(
            f"the coupon is {high[0] - low[0]:.0f} x {high[1] - low[1]:.0f} mm, and the bed "
            f"{bed_mm[0]:g} x {bed_mm[1]:g} mm: give fewer clearances"
        )


def relieved(meshes: Sequence[MeshPart]) -> list[MeshPart]:
    """The same bodies with their first layers standing back from every edge."""
    import manifold3d as m3

    made = []
    for mesh in meshes:
        solid = m3.Manifold(m3.Mesh64(mesh.vertices, mesh.faces.astype(np.uint64)))
        foot = solid.slice(0.5 * _RELIEF_HIGH).offset(-_RELIEF, m3.JoinType.Miter)
        low, high = np.array(solid.bounding_box()).reshape(2, 3)
        wide = m3.CrossSection.square((high - low)[:2] + 2.0).translate(low[:2] - 1.0)
        skirt = (wide - foot).extrude(_RELIEF_HIGH + 0.5).translate((0.0, 0.0, -0.5))
        made.append(mesh_part((solid - skirt).simplify(1e-3)))
    return made
