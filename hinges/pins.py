"""Pins: what holds the knuckles of a hinge on their axis.

A pin says how it shapes every knuckle, what it takes out of the bodies beside them, and whether
the result can be printed. Printed pins (:mod:`hinges.printed_pins`) grow on the knuckles of the
layout's pin owner, which is the parent of a single hinge. Loose ones (:mod:`hinges.hardware`) are
put in after printing.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from math import cos, radians
from typing import ClassVar, Literal

from .clearance import Clearance
from .exceptions import HingeError
from .fit import at_least
from .knuckles import Knuckle, KnuckleLayout
from .shapes import Bored, Point, Prism, Shape, Turned, bounds, regular, teardrop

__all__ = ["BoreForm", "ContactCircle", "OwnedShape", "Pin", "barrel_end", "turned_knuckle"]

OwnedShape = tuple[int, Shape]


@dataclass(frozen=True)
class BoreForm:
    """Form of the bores of hinges: how those that lie while printing are closed above.

    Attributes
    ----------
    style : {"round", "teardrop", "octagon"}
        Round for an axis that stands upright, the others print without support lying down.
    up : tuple of float
        Direction of printing for each owner, in degrees about the axis from +x, in the pose at
        angle 0.
    """

    style: Literal["round", "teardrop", "octagon"] = "round"
    up: tuple[float, ...] = (90.0, 90.0, 90.0)

    def __post_init__(self) -> None:
        """Refuse an unknown style."""
        if self.style not in ("round", "teardrop", "octagon"):
            raise HingeError(f"bore style {self.style!r}: use round, teardrop or octagon")

    @property
    def factor(self) -> float:
        """Largest radius of the bore over the radius of the round one."""
        return {"round": 1.0, "teardrop": 1.219, "octagon": 1.0 / cos(radians(22.5))}[self.style]

    def roof(self, radius: float, knuckle: Knuckle) -> tuple[Prism, ...]:
        """Plan what to cut besides the round bore of a knuckle.

        Parameters
        ----------
        radius : float
            Radius of the bore in mm.
        knuckle : Knuckle
            The knuckle that the bore goes through.

        Returns
        -------
        tuple of Prism
            The roof; empty for a round bore.
        """
        up = self.up[knuckle.owner]
        if self.style == "teardrop":
            return (teardrop(radius, knuckle.start, knuckle.end, up),)
        if self.style == "octagon":
            return (regular(8, 2.0 * radius, knuckle.start, knuckle.end, up + 22.5),)
        return ()


@dataclass(frozen=True)
class ContactCircle:
    """A circle on a pin and how near the bore around it is.

    Attributes
    ----------
    z : float
        Plane of the circle along the axis in mm.
    radius : float
        Radius of the circle in mm.
    normal : (radial, axial) float
        Outward unit normal of the pin's surface there.
    gap : float
        Distance to the facing surface in mm.
    arc : (float, float)
        First and last direction of the circle's part that faces anything, in degrees from +x.
    """

    z: float
    radius: float
    normal: tuple[float, float]
    gap: float
    arc: tuple[float, float] = (0.0, 360.0)


class Pin(ABC):
    """What every kind of pin tells the hinge.

    Attributes
    ----------
    printed : bool
        Whether it grows on its knuckles, so that all bodies are printed together.
    """

    printed: ClassVar[bool] = False

    @abstractmethod
    def largest_radius(self, layout: KnuckleLayout, bore_form: BoreForm) -> float:
        """Measure how far from the axis the pin, its bore or its recess reaches in a barrel.

        Parameters
        ----------
        layout : KnuckleLayout
            The knuckles of the axis.
        bore_form : BoreForm
            How bores are closed above.

        Returns
        -------
        float
            Radius in mm.
        """

    @abstractmethod
    def check(self, layout: KnuckleLayout, wall: float, bore_form: BoreForm) -> None:
        """Refuse a layout that this pin cannot hold.

        Parameters
        ----------
        layout : KnuckleLayout
            The knuckles of the axis.
        wall : float
            Thinnest wall in mm.
        bore_form : BoreForm
            How bores are closed above.

        Raises
        ------
        FitError
            If a wall or the pin is too thin, or the child can leave along the axis.
        """

    @abstractmethod
    def knuckle_shapes(self, layout: KnuckleLayout, chamfer: float) -> tuple[OwnedShape, ...]:
        """Shape every knuckle, its round bores and recesses included.

        Parameters
        ----------
        layout : KnuckleLayout
            The knuckles of the axis.
        chamfer : float
            Leg in mm of the 45° chamfer on the ends of barrels; 0 for none.

        Returns
        -------
        tuple of (int, Shape)
            Number of the owner and shape of each.
        """

    @abstractmethod
    def thinnest_barrel(self, clearance: Clearance, wall: float, knuckles: int) -> float:
        """Find the smallest barrel that leaves a wall around the pin.

        Parameters
        ----------
        clearance : Clearance
            Room between pin and bore.
        wall : float
            Thinnest wall in mm.
        knuckles : int
            Number of knuckles.

        Returns
        -------
        float
            Radius of the barrel in mm.
        """

    @abstractmethod
    def contact_circles(self, layout: KnuckleLayout) -> tuple[ContactCircle, ...]:
        """Find where pin and bores face one another, for :func:`hinges.joint_play.play`.

        Parameters
        ----------
        layout : KnuckleLayout
            The knuckles of the axis.

        Returns
        -------
        tuple of ContactCircle
            Circles on the pin.
        """

    def bore_cuts(self, layout: KnuckleLayout, bore_form: BoreForm) -> tuple[OwnedShape, ...]:
        """Plan what is cut out of single knuckles: roofs of bores, pockets of nuts.

        Parameters
        ----------
        layout : KnuckleLayout
            The knuckles of the axis.
        bore_form : BoreForm
            How bores are closed above.

        Returns
        -------
        tuple of (int, Shape)
            Number of the owner of the knuckle and shape of each cut, between its ends.
        """
        del layout, bore_form
        return ()

    def knuckles(
        self, layout: KnuckleLayout, chamfer: float, bore_form: BoreForm
    ) -> tuple[OwnedShape, ...]:
        """Shape every knuckle with all that is cut out of it.

        Parameters
        ----------
        layout : KnuckleLayout
            The knuckles of the axis.
        chamfer : float
            Leg in mm of the 45° chamfer on the ends of barrels; 0 for none.
        bore_form : BoreForm
            How bores are closed above.

        Returns
        -------
        tuple of (int, Shape)
            Number of the owner and shape of each.
        """
        cuts = [
            (owner, 0.5 * sum(bounds(cut)[2]), cut)
            for owner, cut in self.bore_cuts(layout, bore_form)
        ]
        made: list[OwnedShape] = []
        for owner, shape in self.knuckle_shapes(layout, chamfer):
            low, high = bounds(shape)[2]
            own = tuple(cut for who, middle, cut in cuts if who == owner and low < middle < high)
            made.append((owner, Bored(shape, own) if own else shape))
        return tuple(made)

    def insertion_cuts(self, layout: KnuckleLayout, edge: float) -> tuple[Shape, ...]:
        """Plan what both bodies give up beyond the knuckles so that a loose pin can go in.

        Parameters
        ----------
        layout : KnuckleLayout
            The knuckles of the axis.
        edge : float
            Half the length of the edge in mm.

        Returns
        -------
        tuple of Shape
            What to cut from both bodies.
        """
        del layout, edge
        return ()

    def travel_cuts(self, layout: KnuckleLayout, edge: float) -> tuple[OwnedShape, ...]:
        """Plan what each body gives up so that the child can be moved along the axis.

        Parameters
        ----------
        layout : KnuckleLayout
            The knuckles of the axis.
        edge : float
            Half the length of the edge in mm.

        Returns
        -------
        tuple of (int, Shape)
            Number of the body and shape of each cut; empty for a pin that holds it.
        """
        del layout, edge
        return ()

    def hardware(self, layout: KnuckleLayout, bore_form: BoreForm) -> tuple[Shape, ...]:
        """Draw the loose pin itself.

        Parameters
        ----------
        layout : KnuckleLayout
            The knuckles of the axis.
        bore_form : BoreForm
            How bores are closed above; pockets of nuts lie by it.

        Returns
        -------
        tuple of Shape
            Pin, screw and nut in their places; empty for a printed pin.
        """
        del layout, bore_form
        return ()

    def _check_common(self, layout: KnuckleLayout, wall: float, bore_form: BoreForm) -> None:
        at_least(
            "wall",
            "the barrel wall around the pin's recess or bore",
            layout.radius - self.largest_radius(layout, bore_form),
            wall,
            "use a wider barrel, a thinner pin or a smaller clearance",
        )
        at_least(
            "knuckle",
            "the length of a knuckle",
            min(knuckle.length for knuckle in layout.knuckles),
            2.0 * wall,
            "use fewer knuckles or a longer edge",
        )


def barrel_end(radius: float, chamfer: float, face: float, inward: float) -> list[Point]:
    """Draw the outer corners of a barrel's end.

    Parameters
    ----------
    radius : float
        Radius of the barrel in mm.
    chamfer : float
        Leg of its 45° chamfer in mm; 0 for none.
    face : float
        End plane, z in mm.
    inward : float
        Direction along z from the end into the barrel: 1 or -1.

    Returns
    -------
    list of (radius, z)
        In mm: the chamfer's two corners, or one.
    """
    if chamfer <= 0.0:
        return [(radius, face)]
    return [(radius - chamfer, face), (radius, face + inward * chamfer)]


def turned_knuckle(
    layout: KnuckleLayout, knuckle: Knuckle, chamfer: float, start: list[Point], end: list[Point]
) -> Turned:
    """Turn a knuckle with the bore or recess that is given at its two ends.

    Parameters
    ----------
    layout : KnuckleLayout
        The knuckles of the axis.
    knuckle : Knuckle
        The one to turn.
    chamfer : float
        Leg in mm of the 45° chamfer on its outer rims; 0 for none.
    start, end : list of (radius, z)
        Inner outline at either end in mm, from the inside outwards.

    Returns
    -------
    Turned
        The knuckle.
    """
    first = start + barrel_end(layout.radius, chamfer, knuckle.start, 1.0)
    second = end + barrel_end(layout.radius, chamfer, knuckle.end, -1.0)
    return Turned((*first, *reversed(second)))
