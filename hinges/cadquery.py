"""Hinges for CadQuery: methods of ``Workplane``, and plain functions for ``invoke`` and ``apply``.

Importing this module registers the methods; a name that ``Workplane`` already has is left alone.

>>> import cadquery as cq
>>> import hinges.cadquery
>>> hinge = cq.Workplane().singleHinge(20, clearance=0.3)
>>> hinge.solids().size()
2

==================================  ===============================================================
method                              what it does at every point of the stack
==================================  ===============================================================
``singleHinge(length, ...)``        adds both halves
``doubleHinge(size, ...)``          adds all three bodies
``hingeParent(length, ...)``        lets the parent's half into the solid under construction
``hingeChild(length, ...)``         lets the child's half into it
``hingeHalf(side, length, ...)``    adds one half without cutting
``cutHinge(side, length, ...)``     cuts what one body gives up
==================================  ===============================================================

Where the stack holds solids instead of points, the place is the origin of the workplane. Where it
holds edges, ``edges(">Y and >Z").hingeParent(60, outwards=(0, 0, 1))`` lays the hinge along them:
half a gap off the edge, y in the direction ``outwards``. Its axis is tagged "hinge", so that an
assembly closes by constraints: ``constrain("box?hinge", "lid?hinge", "Axis", 0)`` and "Point".
For points the axis is the local z of each point, x points from parent to child and y out of the
face that they share; see :class:`hinges.SingleHinge` for the other parameters. Shapes pass both
ways as handles of the one kernel: nothing is copied or written to disk.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Unpack

from .exceptions import HingeError
from .kernel import check_kernel
from .options import DoubleHingeKeywords, SingleHingeKeywords

check_kernel(cadquery=True)

import cadquery as cq  # noqa: E402

from .cadquery_shapes import edge_place, from_cadquery, to_cadquery  # noqa: E402

__all__ = [
    "METHODS",
    "child_of",
    "from_cadquery",
    "hinge_at",
    "parent_of",
    "to_cadquery",
]


def _single(length: float, options: SingleHingeKeywords) -> Any:
    from build123d import Mode

    from .single import SingleHinge

    return SingleHinge(length, mode=Mode.PRIVATE, **options)


def _whole(hinge: Any) -> cq.Compound:
    return cq.Compound.makeCompound([cq.Solid(solid.wrapped) for solid in hinge.solids()])


def _pieces(part: Any) -> list[cq.Shape]:
    return [cq.Solid(solid.wrapped) for solid in part.solids()]


def _half_and_carve(side: str, length: float, options: SingleHingeKeywords) -> tuple[Any, Any]:
    hinge = _single(length, options)
    if side == "parent":
        return hinge.parent_half, hinge.parent_carve
    if side == "child":
        return hinge.child_half, hinge.child_carve
    raise HingeError(f"side {side!r}: use 'parent' or 'child'")


def _points(self: cq.Workplane) -> cq.Workplane:
    """Take the stack as points; solids on it stand for the origin of the workplane.

    After ``box()`` the stack holds the body itself, and its centre is no place for a hinge.
    """
    if self.objects and all(isinstance(one, cq.Solid | cq.Compound) for one in self.objects):
        return self.newObject([self.plane.origin])
    return self


def single_hinge(
    self: cq.Workplane,
    length: float,
    combine: bool = True,
    clean: bool = True,
    **options: Unpack[SingleHingeKeywords],
) -> cq.Workplane:
    """Add both halves of a single hinge at every point of the stack.

    Parameters
    ----------
    self : Workplane
        The workplane that it is a method of.
    length : float
        Length in mm of the edge that the hinge is for.
    combine : bool
        Whether to unite it with the solid under construction.
    clean : bool
        Whether CadQuery merges faces that lie in one surface.
    **options
        The other keywords of :class:`hinges.SingleHinge`.

    Returns
    -------
    Workplane
        The workplane with the new solids on its stack.

    Raises
    ------
    HingeError
        If the hinge cannot be made.
    """
    whole = _whole(_single(length, options))
    return _points(self).eachpoint(whole.moved, True, combine, clean)


def double_hinge(
    self: cq.Workplane,
    size: float,
    combine: bool = True,
    clean: bool = True,
    **options: Unpack[DoubleHingeKeywords],
) -> cq.Workplane:
    """Add the three bodies of a double hinge at every point of the stack.

    Parameters
    ----------
    self : Workplane
        The workplane that it is a method of.
    size : float
        Side of the shared face in mm.
    combine : bool
        Whether to unite it with the solid under construction.
    clean : bool
        Whether CadQuery merges faces that lie in one surface.
    **options
        The other keywords of :class:`hinges.DoubleHinge`.

    Returns
    -------
    Workplane
        The workplane with the new solids on its stack.

    Raises
    ------
    HingeError
        If the hinge cannot be made.
    """
    from build123d import Mode

    from .double import DoubleHinge

    whole = _whole(DoubleHinge(size, mode=Mode.PRIVATE, **options))
    return _points(self).eachpoint(whole.moved, True, combine, clean)


def hinge_half(
    self: cq.Workplane,
    side: str,
    length: float,
    combine: bool = True,
    clean: bool = True,
    **options: Unpack[SingleHingeKeywords],
) -> cq.Workplane:
    """Add one half at every point of the stack, without cutting.

    Parameters
    ----------
    self : Workplane
        The workplane that it is a method of.
    side : {"parent", "child"}
        Which of the two bodies it is for.
    length : float
        Length in mm of the edge that the hinge is for.
    combine : bool
        Whether to unite it with the solid under construction.
    clean : bool
        Whether CadQuery merges faces that lie in one surface.
    **options
        The other keywords of :class:`hinges.SingleHinge`.

    Returns
    -------
    Workplane
        The workplane with the new solids on its stack.

    Raises
    ------
    HingeError
        If the hinge cannot be made.
    """
    half = to_cadquery(_half_and_carve(side, length, options)[0])
    return _points(self).eachpoint(half.moved, True, combine, clean)


def cut_hinge(
    self: cq.Workplane,
    side: str,
    length: float,
    clean: bool = True,
    **options: Unpack[SingleHingeKeywords],
) -> cq.Workplane:
    """Cut what a body gives up to a hinge at every point of the stack.

    Parameters
    ----------
    self : Workplane
        The workplane that it is a method of.
    side : {"parent", "child"}
        Which of the two bodies it is for.
    length : float
        Length in mm of the edge that the hinge is for.
    clean : bool
        Whether CadQuery merges faces that lie in one surface.
    **options
        The other keywords of :class:`hinges.SingleHinge`.

    Returns
    -------
    Workplane
        The workplane with the new solids on its stack.

    Raises
    ------
    HingeError
        If the hinge cannot be made.
    """
    pieces = _pieces(_half_and_carve(side, length, options)[1])
    cutter = cq.Compound.makeCompound(pieces)
    return _points(self).eachpoint(cutter.moved, True, "cut", clean)


def _fitted(
    self: cq.Workplane,
    side: str,
    length: float | None,
    outwards: tuple[float, float, float] | None,
    options: SingleHingeKeywords,
) -> cq.Workplane:
    edges = [one for one in self.objects if isinstance(one, cq.Edge)]
    if length is None:
        if not edges:
            raise HingeError("give the length: only an edge on the stack tells it")
        length = edges[0].Length()
    half, carve = _half_and_carve(side, length, options)
    corner = _single(length, options).corners[0 if side == "parent" else 1]
    cutters, added = _pieces(carve), _pieces(half)
    body = self.findSolid()
    before = len(body.Solids())
    if edges:
        places = [edge_place(body, edge, side, outwards, corner) for edge in edges]
    else:
        # Each point of the stack, in global coordinates, as a place for the hinge.
        places = [
            location
            for shape in _points(self)
            .eachpoint(lambda place: cq.Vertex.makeVertex(0, 0, 0).moved(place), True)
            .vals()
            for location in [shape.location()]
        ]
    for place in places:
        body = body.cut(*(piece.moved(place) for piece in cutters))
        body = body.fuse(*(piece.moved(place) for piece in added))
    if len(body.Solids()) != before:
        raise HingeError(
            f"the {side} body came out in {len(body.Solids())} pieces instead of {before}: it must "
            "reach the bracket or arm of its half, and the carve must not cut it in two"
        )
    solids = body.Solids()
    # The line of each axis, for constraints of an assembly; both halves have it the same way round.
    axes = [
        cq.Edge.makeLine(cq.Vector(0, 0, -0.5 * length), cq.Vector(0, 0, 0.5 * length)).moved(place)
        for place in places
    ]
    for number, axis in enumerate(axes, start=1):
        self.newObject([axis]).tag("hinge" if number == 1 else f"hinge {number}")
    return self.newObject([solids[0] if len(solids) == 1 else body])


def hinge_parent(
    self: cq.Workplane,
    length: float | None = None,
    outwards: tuple[float, float, float] | None = None,
    **options: Unpack[SingleHingeKeywords],
) -> cq.Workplane:
    """Let the parent's half into the solid under construction at every point of the stack.

    Parameters
    ----------
    self : Workplane
        The workplane that it is a method of.
    length : float, optional
        Length in mm of the edge that the hinge is for; that of the edge on the stack when left out.
    outwards : (float, float, float), optional
        Where the stack holds edges: direction out of both bodies.
    **options
        The other keywords of :class:`hinges.SingleHinge`.

    Returns
    -------
    Workplane
        The workplane with the new solids on its stack.

    Raises
    ------
    HingeError
        If the hinge cannot be made, or the body does not reach its half.
    """
    return _fitted(self, "parent", length, outwards, options)


def hinge_child(
    self: cq.Workplane,
    length: float | None = None,
    outwards: tuple[float, float, float] | None = None,
    **options: Unpack[SingleHingeKeywords],
) -> cq.Workplane:
    """Let the child's half into the solid under construction at every point of the stack.

    Parameters
    ----------
    self : Workplane
        The workplane that it is a method of.
    length : float, optional
        Length in mm of the edge that the hinge is for; that of the edge on the stack when left out.
    outwards : (float, float, float), optional
        Where the stack holds edges: direction out of both bodies.
    **options
        The other keywords of :class:`hinges.SingleHinge`.

    Returns
    -------
    Workplane
        The workplane with the new solids on its stack.

    Raises
    ------
    HingeError
        If the hinge cannot be made, or the body does not reach its half.
    """
    return _fitted(self, "child", length, outwards, options)


def parent_of(
    length: float, **options: Unpack[SingleHingeKeywords]
) -> Callable[[cq.Workplane], cq.Workplane]:
    """Make a function for ``Workplane.invoke`` that lets the parent's half in.

    Parameters
    ----------
    length : float
        Length in mm of the edge that the hinge is for.
    **options
        The other keywords of :class:`hinges.SingleHinge`.

    Returns
    -------
    callable
        A function from a workplane to a workplane.
    """
    return lambda workplane: hinge_parent(workplane, length, **options)


def child_of(
    length: float, **options: Unpack[SingleHingeKeywords]
) -> Callable[[cq.Workplane], cq.Workplane]:
    """Make a function for ``Workplane.invoke`` that lets the child's half in.

    Parameters
    ----------
    length : float
        Length in mm of the edge that the hinge is for.
    **options
        The other keywords of :class:`hinges.SingleHinge`.

    Returns
    -------
    callable
        A function from a workplane to a workplane.
    """
    return lambda workplane: hinge_child(workplane, length, **options)


def hinge_at(
    length: float, **options: Unpack[SingleHingeKeywords]
) -> Callable[[Iterable[Any]], list[cq.Shape]]:
    """Make a function for ``Workplane.apply``: every object on the stack becomes a hinge.

    Parameters
    ----------
    length : float
        Length in mm of the edge that the hinge is for.
    **options
        The other keywords of :class:`hinges.SingleHinge`.

    Returns
    -------
    callable
        A function from objects to shapes. It takes a location as it is, and any other object by its
        centre.
    """

    def build(objects: Iterable[Any]) -> list[cq.Shape]:
        whole = _whole(_single(length, options))
        places = (
            one if isinstance(one, cq.Location) else cq.Location(one.Center()) for one in objects
        )
        return [whole.moved(place) for place in places]

    return build


METHODS: dict[str, Callable[..., cq.Workplane]] = {
    "singleHinge": single_hinge,
    "doubleHinge": double_hinge,
    "hingeHalf": hinge_half,
    "hingeParent": hinge_parent,
    "hingeChild": hinge_child,
    "cutHinge": cut_hinge,
}

for _name, _method in METHODS.items():
    if not hasattr(cq.Workplane, _name):
        setattr(cq.Workplane, _name, _method)
