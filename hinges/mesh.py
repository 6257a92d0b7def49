"""Hinges as triangle meshes, ready for mesh booleans.

A :class:`MeshPart` holds vertices in mm and triangles. :func:`single_hinge_meshes` gives the four
pieces of a single hinge, :func:`double_hinge_meshes` the five of a double one.

Use it as ``body - carve + half`` on each of the two bodies, in that order; nothing needs to be
subtracted after.

Frame: the axis is z through the origin and the edge is centred on it (z from -voxel/2 to +voxel/2).
At angle 0 the parent's material is in the quadrant x < 0, y < 0 and the child's in x > 0, y < 0:
x points from the parent's cell to the child's, y outwards from the shared face at the hinged edge.
A positive turn of the child about +z takes it through x > 0, y > 0 to x < 0, y > 0 at 180°.

Frame of a double hinge: the face that both cells share is |y|, |z| ≤ voxel/2 of the plane x = 0,
the parent's cell lies at x < 0 and the child's at x > 0. `first` and `second` name the edges of
that face on which the parent-link and the link-child axis run: "+y", "-y", "+z" or "-z". A positive
first angle turns link and child about the direction ``x × edge``, a positive second angle the child
about ``x × edge`` of its own edge: both carry the child away from the face and around the edge.
`link` is a body of its own. The carves hold the pockets for the link plate at 0 and, for a turn of
270, where it comes to lie on the other face; no material of the bodies may lie within gap/2 of the
faces of their cells.

The meshes are built from polygons of `segments` corners that lie inside the true circle on barrels
and cones and outside it on grooves and recesses, so a gap between meshes is never below the exact
one and at most 0.0024 (r + c) above it for 64 segments (0.007 mm at r + c = 2.8 mm).
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple, Unpack

from .barrel import default_pin_radius, default_radii
from .clearance import Clearance
from .exceptions import HingeError
from .joint_play import Play, play
from .leaf import Bracket
from .options import BarrelKeywords, MeshKeywords, MeshOptions
from .plan_double import DoubleSpec, plan_double, plate_shape
from .plan_single import SinglePlan, SingleSpec, plan_single
from .printed_pins import ConePin
from .shape_meshes import MeshPart, half_manifolds, manifold_of, mesh_part

if TYPE_CHECKING:
    pass

__all__ = [
    "DoubleHingeMeshes",
    "HingeMeshes",
    "double_hinge_meshes",
    "single_hinge_meshes",
    "single_hinge_play",
]


class HingeMeshes(NamedTuple):
    """The four pieces of one single hinge, and the sizes that were used.

    Attributes
    ----------
    parent_half, child_half : MeshPart
        To add to each body after its carve was subtracted. One connected piece each.
    parent_carve, child_carve : MeshPart
        To subtract from each body first.
    barrel_radius_mm : float
        Radius of the barrels in mm.
    pin_radius_mm : float
        Radius at the foot of the cone pins, or of the loose pin, in mm.
    knuckles : int
        Number of knuckles.
    reach_mm : float
        Radius in mm of the groove that a barrel needs in any other body: barrel plus clearance.
    """

    parent_half: MeshPart
    child_half: MeshPart
    parent_carve: MeshPart
    child_carve: MeshPart
    barrel_radius_mm: float
    pin_radius_mm: float
    knuckles: int
    reach_mm: float


class DoubleHingeMeshes(NamedTuple):
    """The pieces of one double hinge, and the sizes that were used.

    Attributes
    ----------
    parent_half, child_half : MeshPart
        To add to each body after its carve was subtracted. One connected piece each.
    link : MeshPart
        The link plate with its knuckles: a body of its own.
    parent_carve, child_carve : MeshPart
        To subtract from each body first.
    plate : MeshPart
        The link plate alone, without knuckles and grooves. Along edges without an axis it keeps the
        margin free, so that another hinge's barrel on such an edge does not meet it.
    barrel_radius_mm : float
        Radius of the barrels in mm.
    pin_radius_mm : float
        Radius at the foot of the cone pins, or of the loose pin, in mm.
    knuckles : int
        Number of knuckles on each axis; of both together when they share an edge.
    reach_mm : float
        Radius in mm of the groove that a barrel needs in any other body: barrel plus clearance.
    plate_mm : float
        Thickness of the link plate in mm.
    """

    parent_half: MeshPart
    link: MeshPart
    child_half: MeshPart
    parent_carve: MeshPart
    child_carve: MeshPart
    plate: MeshPart
    barrel_radius_mm: float
    pin_radius_mm: float
    knuckles: int
    reach_mm: float
    plate_mm: float


def single_hinge_meshes(
    voxel_mm: float, clearance_mm: float, *, knuckles: int = 3, **options: Unpack[MeshKeywords]
) -> HingeMeshes:
    """Build the four pieces of a single hinge for the edge of a voxel.

    Parameters
    ----------
    voxel_mm : float
        Length of the edge in mm.
    clearance_mm : float
        Normal clearance in the hinge in mm.
    knuckles : int
        Number of knuckles; with an odd count the parent has one more than the child.
    **options
        Sizes that :class:`MeshOptions` names.

    Returns
    -------
    HingeMeshes
        The pieces and the sizes that were used. The work is cached by the arguments; the arrays
        are the caller's own copies.

    Raises
    ------
    FitError
        If the hinge cannot be printed at this size, naming the rule and what to change.
    HingeError
        If a size makes no sense.

    Examples
    --------
    >>> pieces = single_hinge_meshes(20, 0.3)
    >>> pieces.barrel_radius_mm, pieces.pin_radius_mm
    (2.5, 1.5)
    """
    made = _single(float(voxel_mm), float(clearance_mm), knuckles, MeshOptions(**options))
    return made._replace(
        parent_half=made.parent_half.copied(),
        child_half=made.child_half.copied(),
        parent_carve=made.parent_carve.copied(),
        child_carve=made.child_carve.copied(),
    )


class _Sizes(NamedTuple):
    """Sizes in mm that both kinds of hinges derive alike, and the same as keywords of a hinge."""

    barrel: float
    pin_radius: float
    groove: float
    bracket: Bracket
    keywords: BarrelKeywords


def _sizes(voxel_mm: float, clearance_mm: float, knuckles: int, options: MeshOptions) -> _Sizes:
    room = Clearance(clearance_mm)
    wall, margin = options.wall_mm, options.margin_mm
    barrel, radius = options.barrel_radius_mm, options.pin_radius_mm
    if barrel is None:
        barrel, _ = default_radii(voxel_mm, room, wall, knuckles, margin, widest=5.0)
    if options.pin is not None:
        radius = 0.5 * options.pin.diameter
    elif radius is None:
        radius = default_pin_radius(barrel, room, wall)
    groove = barrel + room.radial
    bracket = options.bracket_mm
    return _Sizes(
        barrel,
        radius,
        groove,
        Bracket(max(0.15 * voxel_mm, groove + 1.2) if bracket is None else bracket),
        {
            "radius": barrel,
            "pin": ConePin(radius) if options.pin is None else options.pin,
            "clearance": room,
            "gap": options.gap_mm,
            "margin": margin,
            "wall": wall,
        },
    )


def _plan(voxel_mm: float, knuckles: int, sizes: _Sizes, options: MeshOptions) -> SinglePlan:
    leaf = sizes.bracket if options.leaf is None else options.leaf
    spec = SingleSpec.read(voxel_mm, knuckles=knuckles, leaf=leaf, **sizes.keywords)
    return plan_single(spec)


def single_hinge_play(
    voxel_mm: float,
    clearance_mm: float,
    angle: float,
    *,
    knuckles: int = 3,
    **options: Unpack[MeshKeywords],
) -> Play:
    """Play of the hinge that :func:`single_hinge_meshes` builds.

    Parameters
    ----------
    voxel_mm, clearance_mm, knuckles, **options
        As of :func:`single_hinge_meshes`.
    angle : float
        Angle of the hinge in degrees.

    Returns
    -------
    Play
        How far its child shifts and tilts.

    Raises
    ------
    FitError, HingeError
        As of :func:`single_hinge_meshes`.

    Examples
    --------
    >>> round(single_hinge_play(20, 0.3, 180).axial[1], 3)
    0.3
    """
    asked = MeshOptions(**options)
    sizes = _sizes(float(voxel_mm), float(clearance_mm), knuckles, asked)
    return play(_plan(float(voxel_mm), knuckles, sizes, asked), angle)


@lru_cache(maxsize=64)
def _single(
    voxel_mm: float, clearance_mm: float, knuckles: int, options: MeshOptions
) -> HingeMeshes:
    sizes = _sizes(voxel_mm, clearance_mm, knuckles, options)
    plan = _plan(voxel_mm, knuckles, sizes, options)
    parent, parent_carve = half_manifolds(plan.parent, options.segments)
    child, child_carve = half_manifolds(plan.child, options.segments)
    return HingeMeshes(
        mesh_part(parent),
        mesh_part(child),
        mesh_part(parent_carve),
        mesh_part(child_carve),
        sizes.barrel,
        sizes.pin_radius,
        knuckles,
        sizes.groove,
    )


def double_hinge_meshes(
    voxel_mm: float,
    clearance_mm: float,
    first: str = "+y",
    second: str = "-y",
    turns: tuple[float, float] = (180.0, 180.0),
    *,
    knuckles: int | None = None,
    plate_mm: float | None = None,
    **options: Unpack[MeshKeywords],
) -> DoubleHingeMeshes:
    """Build the five pieces of a double hinge for the face between two voxels.

    Parameters
    ----------
    voxel_mm : float
        Side of the face in mm.
    clearance_mm : float
        Normal clearance in the hinge, and room around the link plate, in mm.
    first, second : {"+y", "-y", "+z", "-z"}
        Edges of the parent-link and of the link-child axis.
    turns : (float, float)
        How far each axis turns: 90, 180 or 270 degrees.
    knuckles : int, optional
        Number of knuckles on each axis. 3 when left out, or 5 when both axes share an edge.
    plate_mm : float, optional
        Thickness of the link plate in mm; 2, or thinner where a small barrel asks for it.
    **options
        Sizes that :class:`MeshOptions` names.

    Returns
    -------
    DoubleHingeMeshes
        The pieces and the sizes that were used. The work is cached by the arguments; the arrays
        are the caller's own copies.

    Raises
    ------
    FitError
        If the hinge cannot be printed at this size, naming the rule and what to change.
    HingeError
        If an edge or a turn is unknown.
    """
    made = _double(
        float(voxel_mm),
        float(clearance_mm),
        first,
        second,
        (float(turns[0]), float(turns[1])),
        knuckles or (5 if first == second else 3),
        plate_mm,
        MeshOptions(**options),
    )
    return made._replace(
        parent_half=made.parent_half.copied(),
        link=made.link.copied(),
        child_half=made.child_half.copied(),
        parent_carve=made.parent_carve.copied(),
        child_carve=made.child_carve.copied(),
        plate=made.plate.copied(),
    )


@lru_cache(maxsize=256)
def _double(
    voxel_mm: float,
    clearance_mm: float,
    first: str,
    second: str,
    turns: tuple[float, float],
    knuckles: int,
    plate_mm: float | None,
    options: MeshOptions,
) -> DoubleHingeMeshes:
    if options.leaf is not None:
        raise HingeError("a double hinge stands on brackets: leave leaf out")
    sizes = _sizes(voxel_mm, clearance_mm, knuckles, options)
    spec = DoubleSpec.read(
        voxel_mm,
        first=first,
        second=second,
        turns=turns,
        knuckles=knuckles,
        plate=plate_mm,
        bracket=sizes.bracket,
        **sizes.keywords,
    )
    plan = plan_double(spec)
    parent, parent_carve = half_manifolds(plan.parent, options.segments)
    child, child_carve = half_manifolds(plan.child, options.segments)
    link, _ = half_manifolds(plan.link, options.segments)
    return DoubleHingeMeshes(
        mesh_part(parent),
        mesh_part(link),
        mesh_part(child),
        mesh_part(parent_carve),
        mesh_part(child_carve),
        mesh_part(manifold_of(plate_shape(spec), options.segments, outside=False)),
        sizes.barrel,
        sizes.pin_radius,
        knuckles,
        sizes.groove,
        spec.plate,
    )
