"""The tolerance coupon: a strip of hinges at several clearances, to find what a printer needs.

A row of small hinges and a row of hexagonal sockets hang on one frame that carries their clearances
in raised numbers; a loose hexagonal plug lies beside it. The strip prints lying, without support,
in well under an hour. One turns every flap and notes the smallest number whose flap moves freely;
the plug tells the same for fits that do not turn. :func:`write_coupon` writes the strip for a
slicer or for CAD, and a page that tells how to read it. In files for a slicer the first layer
stands back from every gap, so that it is not the elephant's foot that is measured.
"""

from __future__ import annotations

import struct
import uuid
from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from build123d import Align, BasePartObject, Color, Mode, Part, Plane, Solid

from .clearance import Clearance
from .digits import raised_number
from .exact_solids import build_half, build_shape, one_part, solids_of
from .exceptions import FitError, HingeError
from .leaf import Leaf
from .mesh import MeshPart, half_manifolds, manifold_of, mesh_part
from .plan_double import Matrix
from .plan_single import SinglePlan, SingleSpec, plan_single
from .shapes import HalfPlan, Prism, Shape, box, regular

if TYPE_CHECKING:
    from build123d import RotationLike

__all__ = ["DEFAULT_CLEARANCES", "FINE_STEP", "Coupon", "fine_clearances", "write_coupon"]

DEFAULT_CLEARANCES: Final[tuple[float, ...]] = (0.15, 0.20, 0.25, 0.30, 0.35, 0.40, 0.45, 0.50)
"""Clearances of a coupon in mm."""

FINE_STEP: Final = 0.025
"""Step of a second coupon in mm."""

_COLUMNS = 3  # how many clearances the page shows

# Sizes of a coupon with barrels of 2.5 mm radius, in mm; larger clearances want larger barrels.
_RADIUS = 2.5
_LENGTH = 12.0  # of a hinge
_SCALES = (1.0, 1.2, 1.4, 1.7, 2.0)
_THICK = 1.0  # of frame and flaps
_SPINE = 5.6  # width of the frame
_STAND = 3.4  # from the frame to the axis
_FLAP = 4.6  # from the axis to the end of a flap
_PLUG, _PLUG_HIGH = 5.0, 5.0  # across flats and height of the hexagonal plug
_RING, _RING_HIGH = 0.85, 1.8  # wall and height of a socket
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


def plan_coupon(clearances: Sequence[float], wall: float = 0.8) -> tuple[CouponBody, ...]:
    """Plan every body of the coupon.

    Parameters
    ----------
    clearances : sequence of float
        Clearances in mm, at most three digits each.
    wall : float
        Thinnest wall in mm.

    Returns
    -------
    tuple of CouponBody
        The frame first, then the flap of each clearance, and the plug.

    Raises
    ------
    HingeError
        If there are no clearances, or two alike.
    FitError
        If a clearance is too large for the coupon's hinges.
    """
    if not clearances or len(set(clearances)) != len(clearances):
        raise HingeError("a coupon needs at least one clearance, and each only once")
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
        shapes.append(_socket(x, edge + reach - 0.4, clearance))
        # Without the nought, so that there is room between two numbers.
        digits = 2 if round(clearance, 2) == clearance else 3
        text = f"{clearance:.{digits}f}".removeprefix("0")
        shapes += raised_number(text, x, 0.0, _THICK, high=4.0, raised=0.4)
    plug = regular(6, _PLUG, 0.0, _PLUG_HIGH, 0.0)
    beside = tuple((px + half + _PLUG, py) for px, py in plug.outline)
    loose = CouponBody("plug", (), (Prism(beside, 0.0, _PLUG_HIGH),))
    return (CouponBody("frame", tuple(halves), tuple(shapes)), *flaps, loose)


class Coupon(BasePartObject):  # type: ignore[misc]
    """A strip of hinges and sockets at several clearances, on one frame, and a plug.

    The bed is the plane z = 0, the numbers are raised on the frame along x.

    Parameters
    ----------
    clearances : sequence of float
        Clearances in mm, each only once.
    wall : float
        Thinnest wall in mm.
    rotation, align, mode
        As for every build123d part.

    Attributes
    ----------
    clearances : tuple of float
        The clearances in mm.
    names : tuple of str
        Names of the bodies, in the order of the solids.
    meshes : tuple of MeshPart
        The bodies as meshes that never take room from a clearance.

    Raises
    ------
    FitError
        If a clearance is too large for the coupon's hinges.
    HingeError
        If there are no clearances, or two alike.

    Examples
    --------
    >>> coupon = Coupon([0.2, 0.3])
    >>> coupon.names
    ('frame', 'flap 0.2', 'flap 0.3', 'plug')
    """

    def __init__(
        self,
        clearances: Sequence[float] = DEFAULT_CLEARANCES,
        wall: float = 0.8,
        rotation: RotationLike = (0, 0, 0),
        align: Align | tuple[Align, Align, Align] | None = None,
        mode: Mode = Mode.ADD,
    ) -> None:
        self.clearances = tuple(clearances)
        self._bodies = plan_coupon(self.clearances, wall)
        self.names = tuple(body.name for body in self._bodies)
        super().__init__(part=self._built(), rotation=rotation, align=align, mode=mode)
        self.label = "hinge coupon"
        self.color = Color(0.2, 0.45, 0.7)

    def _built(self) -> Part:
        """Build every body."""
        return one_part(coupon_solids(self._bodies))

    @cached_property
    def meshes(self) -> tuple[MeshPart, ...]:
        """The bodies as meshes, in the order of `names`."""
        return coupon_meshes(self._bodies)


def coupon_solids(bodies: Sequence[CouponBody]) -> list[Solid]:
    """Build every body exactly.

    Parameters
    ----------
    bodies : sequence of CouponBody
        The planned bodies.

    Returns
    -------
    list of Solid
        One a body, in mm.

    Raises
    ------
    HingeError
        If a body is not one solid.
    """
    built: dict[HalfPlan, Solid] = {}
    solids = []
    for body in bodies:
        parts = [build_shape(shape) for shape in body.shapes]
        for plan, matrix in body.halves:
            if plan not in built:
                built[plan] = build_half(plan, body.name).solid()
            origin, x_dir, z_dir = (tuple(map(float, matrix[:3, k])) for k in (3, 0, 2))
            frame = Plane(origin=origin, x_dir=x_dir, z_dir=z_dir)
            parts.append(built[plan].moved(frame.location))
        whole = solids_of(parts[0].fuse(*parts[1:]) if len(parts) > 1 else parts[0])
        if len(whole) != 1:
            raise HingeError(f"coupon: {body.name} came out in {len(whole)} pieces")
        solids += whole
    return solids


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


def write_coupon(
    path: Path | str,
    clearances: Sequence[float] = DEFAULT_CLEARANCES,
    *,
    wall_mm: float = 0.8,
    title: str = "Hinge coupon",
    guide: bool = True,
    bed_mm: tuple[float, float] | None = None,
) -> list[Path]:
    """Write a coupon for the slicer or for CAD, and the page that tells how to read it.

    Parameters
    ----------
    path : Path or str
        File to write; its suffix decides the format: .3mf, .step, .stp or .stl.
    clearances : sequence of float
        Clearances in mm, each only once.
    wall_mm : float
        Thinnest wall in mm.
    title : str
        Title for the file's metadata and the page's head, such as the name of the profile.
    guide : bool
        Whether to write a one-page PDF too, ``<name>-guide.pdf`` beside the file, that tells how to
        read the coupon.
    bed_mm : (float, float), optional
        Size of the printer's bed in mm.

    Returns
    -------
    list of Path
        The files that were written.

    Raises
    ------
    HingeError
        If the suffix is unknown, the clearances cannot be used, or the coupon is larger than the
        bed.
    """
    from .guide import write_guide

    target = Path(path)
    writers = {".3mf": _write_3mf, ".stl": _write_stl, ".step": _write_step, ".stp": _write_step}
    writer = writers.get(target.suffix.lower())
    if writer is None:
        raise HingeError(
            f"coupon file {target.name!r}: use a name that ends in {', '.join(sorted(writers))}"
        )
    bodies = plan_coupon(clearances, wall_mm)
    if bed_mm is not None:
        _require_bed(bodies, bed_mm)
    target.parent.mkdir(parents=True, exist_ok=True)
    part = target.with_name(f".part-{target.name}")
    written = [target]
    try:
        writer(part, bodies, title)
        part.replace(target)
    finally:
        part.unlink(missing_ok=True)
    if guide:
        page = target.with_name(f"{target.stem}-guide.pdf")
        part = page.with_name(f".part-{page.name}")
        try:
            columns = plan_coupon(clearances[:_COLUMNS], wall_mm)
            write_guide(part, tuple(clearances), one_part(coupon_solids(columns)), title)
            part.replace(page)
        finally:
            part.unlink(missing_ok=True)
        written.append(page)
    return written


def _require_bed(bodies: Sequence[CouponBody], bed_mm: tuple[float, float]) -> None:
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


def _relieved(meshes: Sequence[MeshPart]) -> list[MeshPart]:
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


def _joined(bodies: Sequence[CouponBody]) -> MeshPart:
    """All bodies in one mesh, so that no slicer moves them apart."""
    vertices, faces, count = [], [], 0
    for mesh in _relieved(coupon_meshes(bodies)):
        vertices.append(mesh.vertices)
        faces.append(mesh.faces + count)
        count += len(mesh.vertices)
    return MeshPart(np.concatenate(vertices), np.concatenate(faces).astype(np.int32))


def _write_3mf(path: Path, bodies: Sequence[CouponBody], title: str) -> None:
    import lib3mf

    from .package import package_bytes

    mesh = _joined(bodies)
    wrapper = lib3mf.get_wrapper()
    model = wrapper.CreateModel()
    model.SetUnit(lib3mf.ModelUnit.MilliMeter)
    model.GetMetaDataGroup().AddMetaData("", "Title", title, "xs:string", True)
    whole = model.AddMeshObject()
    whole.SetName(title)
    corners = [lib3mf.Position(tuple(map(float, point))) for point in mesh.vertices]
    triangles = [lib3mf.Triangle(tuple(map(int, face))) for face in mesh.faces]
    whole.SetGeometry(corners, triangles)
    space = uuid.uuid5(uuid.NAMESPACE_URL, f"hinges/{title}")
    whole.SetUUID(str(uuid.uuid5(space, "coupon")))
    item = model.AddBuildItem(whole, wrapper.GetIdentityTransform())
    item.SetUUID(str(uuid.uuid5(space, "item")))
    model.SetBuildUUID(str(uuid.uuid5(space, "build")))
    path.write_bytes(package_bytes(model.QueryWriter("3mf")))


def _write_stl(path: Path, bodies: Sequence[CouponBody], title: str) -> None:
    mesh = _joined(bodies)
    corners = mesh.vertices[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    layout = [("normal", "<f4", 3), ("corner", "<f4", (3, 3)), ("extra", "<u2")]
    rows = np.zeros(len(corners), dtype=layout)
    rows["normal"], rows["corner"] = normals, corners
    head = title.encode("ascii", "replace")[:79].ljust(80)
    path.write_bytes(head + struct.pack("<I", len(rows)) + rows.tobytes())


def _write_step(path: Path, bodies: Sequence[CouponBody], title: str) -> None:
    from build123d import Compound, export_step

    named = []
    for body, solid in zip(bodies, coupon_solids(bodies), strict=True):
        own = deepcopy(solid)  # equal flaps share one shape in memory, and so would share a name
        own.label = body.name
        named.append(own)
    export_step(Compound(label=title, children=named), path, timestamp="2000-01-01T00:00:00")
