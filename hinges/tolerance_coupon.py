"""The tolerance coupon: a plate of hinges at several clearances, to find what a printer needs.

One row of single hinges and one of double hinges (two axes in a row) hang on one frame that carries
their clearances in raised numbers. The plate prints lying, without support. One turns every flap
and notes the smallest number whose flaps move freely. :func:`write_coupon` writes the plate for a
slicer or for CAD, and a page that tells how to read it.
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
from .shapes import HalfPlan, Shape, box

if TYPE_CHECKING:
    from build123d import RotationLike

__all__ = ["DEFAULT_CLEARANCES", "Coupon", "write_coupon"]

DEFAULT_CLEARANCES: Final[tuple[float, ...]] = (0.15, 0.20, 0.25, 0.30, 0.35, 0.40, 0.45, 0.50)
"""Clearances of a coupon in mm."""

_COLUMNS = 3  # how many clearances the page shows

_THICK = 1.9  # of frame, leaves and flaps, mm
_SPINE = 14.0  # width of the frame, mm
_STAND = 5.0  # from the frame to the first axis, mm
_FLAP = 7.0  # from an axis to the end of a flap, mm
_LINK = 12.0  # between the two axes of a double hinge, mm


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


def _plan(clearance: float, length: float, width: float, wall: float) -> SinglePlan:
    return plan_single(
        SingleSpec.read(
            length,
            radius=3.0,
            clearance=Clearance(clearance),
            leaf=Leaf(width, _THICK, flat=True),
            wall=wall,
            chamfer=0.2,
        )
    )


def plan_coupon(clearances: Sequence[float], length: float, wall: float) -> tuple[CouponBody, ...]:
    """Plan every body of the coupon.

    Parameters
    ----------
    clearances : sequence of float
        Clearances in mm, at most three digits each.
    length : float
        Length of each hinge in mm.
    wall : float
        Thinnest wall in mm.

    Returns
    -------
    tuple of CouponBody
        The frame first, then a flap, a link and the link's flap for each clearance.

    Raises
    ------
    HingeError
        If there are no clearances, or two alike.
    FitError
        If a clearance is too large for the coupon's hinges.
    """
    if not clearances or len(set(clearances)) != len(clearances):
        raise HingeError("a coupon needs at least one clearance, and each only once")
    pitch = length + 2.0
    start = -0.5 * pitch * (len(clearances) - 1)
    half = 0.5 * pitch * len(clearances)
    spine = box(-half, half, -0.5 * _SPINE, 0.5 * _SPINE, 0.0, _THICK)
    shapes: list[Shape] = [spine]
    halves: list[tuple[HalfPlan, Matrix]] = []
    flaps: list[CouponBody] = []
    for index, clearance in enumerate(clearances):
        x = start + index * pitch
        try:
            first = _plan(clearance, length, _FLAP, wall)
            linked = _plan(clearance, length, 0.5 * _LINK + 1.0, wall)
        except FitError as error:
            raise FitError(
                error.rule,
                f"coupon hinge at {clearance:g} mm: {error.rule}",
                error.value,
                error.limit,
                "leave this clearance out, or use longer hinges",
                error.unit,
            ) from error
        level = first.spec.leaf.limits(first.layout, first.spec.gap)[3]
        near = 0.5 * _SPINE + _STAND
        single = _frame(x, -near, level, -1.0)
        lower = _frame(x, near, level, 1.0)
        upper = _frame(x, near + _LINK, level, 1.0)
        halves += [(first.parent, single), (linked.parent, lower)]
        name = f"{clearance:.2f}"
        flaps += [
            CouponBody(f"single {name}", ((first.child, single),)),
            CouponBody(f"link {name}", ((linked.child, lower), (linked.parent, upper))),
            CouponBody(f"double {name}", ((first.child, upper),)),
        ]
        shapes += raised_number(name, x, 0.0, _THICK)
    return (CouponBody("frame", tuple(halves), tuple(shapes)), *flaps)


class Coupon(BasePartObject):  # type: ignore[misc]
    """A plate of single and double hinges at several clearances, on one frame.

    The bed is the plane z = 0, the numbers are raised on the frame along x.

    Parameters
    ----------
    clearances : sequence of float
        Clearances in mm, each only once.
    length : float
        Length of each hinge in mm.
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
    ('frame', 'single 0.20', 'link 0.20', 'double 0.20', 'single 0.30', 'link 0.30', 'double 0.30')
    """

    def __init__(
        self,
        clearances: Sequence[float] = DEFAULT_CLEARANCES,
        length: float = 20.0,
        wall: float = 0.8,
        rotation: RotationLike = (0, 0, 0),
        align: Align | tuple[Align, Align, Align] | None = None,
        mode: Mode = Mode.ADD,
    ) -> None:
        self.clearances = tuple(clearances)
        self._bodies = plan_coupon(self.clearances, length, wall)
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
    length_mm: float = 20.0,
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
    length_mm : float
        Length of each hinge in mm.
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
    bodies = plan_coupon(clearances, length_mm, wall_mm)
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
            columns = plan_coupon(clearances[:_COLUMNS], length_mm, wall_mm)
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


def _joined(bodies: Sequence[CouponBody]) -> MeshPart:
    """All bodies in one mesh, so that no slicer moves them apart."""
    vertices, faces, count = [], [], 0
    for mesh in coupon_meshes(bodies):
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
