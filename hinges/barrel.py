"""The barrel of a hinge: its sizes and its pin, and the defaults for those left out."""

from __future__ import annotations

from dataclasses import dataclass
from math import floor

from .clearance import PROCESSES, Clearance
from .exceptions import HingeError
from .fit import at_least
from .knuckles import lay_out_knuckles
from .options import BarrelOptions
from .pins import BoreForm, Pin
from .printed_pins import ConePin

__all__ = [
    "BarrelSpec",
    "barrel_spec",
    "check_gap",
    "default_pin_radius",
    "default_radii",
    "wall_of",
]

DEFAULT_WALL = 0.8


@dataclass(frozen=True, kw_only=True)
class BarrelSpec:
    """Sizes that single and double hinges have alike, defaults filled in.

    Attributes
    ----------
    knuckles : int
        Number of knuckles on an axis.
    radius : float
        Radius of the barrel in mm.
    pin : Pin
        What holds the knuckles on their axis.
    clearance : Clearance
        Room between surfaces that move past one another.
    gap : float
        Distance between the two bodies in mm.
    chamfer : float
        Leg of the 45° chamfer on the ends of barrels in mm; 0 for none.
    margin : float
        Length in mm left free at each end of the edge.
    wall : float
        Thinnest wall in mm that the process prints.
    bore_form : BoreForm
        How bores are closed above.
    """

    knuckles: int
    radius: float
    pin: Pin
    clearance: Clearance
    gap: float
    chamfer: float
    margin: float
    wall: float
    bore_form: BoreForm


def barrel_spec(
    options: BarrelOptions, length: float, knuckles: int, drawn: tuple[float, ...]
) -> BarrelSpec:
    """Fill in the defaults.

    The default margin keeps hinges on two edges that meet at a corner clear of one another.

    Parameters
    ----------
    options : BarrelOptions
        What was asked for.
    length : float
        Length of the edge in mm.
    knuckles : int
        Number of knuckles on the axis.
    drawn : tuple of float
        Angles in degrees by which the owners of knuckles stand turned in the drawn pose.

    Returns
    -------
    BarrelSpec
        All sizes, not yet checked against the rules of fit.

    Raises
    ------
    HingeError
        If the clearance cannot be read or the form of the bores is unknown.
    """
    room = Clearance.read(options.clearance)
    wall = wall_of(options.clearance) if options.wall is None else options.wall
    radius, pin = options.radius, options.pin
    if radius is None:
        if pin is None:
            radius, _ = default_radii(length, room, wall, knuckles, options.margin)
        else:
            radius = max(2.0, 0.1 * -floor(-10.0 * pin.thinnest_barrel(room, wall, knuckles)))
    if pin is None:
        pin = ConePin(max(default_pin_radius(radius, room, wall), 0.3))
    return BarrelSpec(
        knuckles=knuckles,
        radius=float(radius),
        pin=pin,
        clearance=room,
        gap=room.radial if options.gap is None else float(options.gap),
        chamfer=float(options.chamfer),
        margin=radius + room.radial if options.margin is None else float(options.margin),
        wall=wall,
        bore_form=BoreForm(options.bore, tuple(options.up - angle for angle in drawn)),
    )


def check_gap(spec: BarrelSpec) -> None:
    """Refuse bodies that lie nearer to one another than what moves in their hinge.

    Parameters
    ----------
    spec : BarrelSpec
        Sizes of the hinge.

    Raises
    ------
    FitError
        If the hinge is printed as a whole, where such bodies fuse.
    """
    if spec.pin.printed:
        at_least(
            "gap",
            "the gap between two bodies that are printed together",
            spec.gap,
            spec.clearance.least,
            "use a larger gap, or a loose pin and print the bodies apart",
        )


def wall_of(clearance: Clearance | float | str) -> float:
    """Look up the thinnest wall of the process that a clearance names.

    Parameters
    ----------
    clearance : Clearance, float or str
        As for :meth:`hinges.Clearance.read`.

    Returns
    -------
    float
        Wall in mm; 0.8 where the clearance names no process.
    """
    name = clearance.source.split(":")[0] if isinstance(clearance, Clearance) else clearance
    if isinstance(name, str) and name.lower() in PROCESSES:
        return PROCESSES[name.lower()].wall
    return DEFAULT_WALL


def default_pin_radius(barrel: float, clearance: Clearance, wall: float = DEFAULT_WALL) -> float:
    """Choose the radius at the foot of a cone pin.

    Parameters
    ----------
    barrel : float
        Radius of the barrel in mm.
    clearance : Clearance
        Room between cone and recess.
    wall : float
        Thinnest wall in mm around the recess.

    Returns
    -------
    float
        Radius in mm: 60 % of the barrel, or as much as the wall leaves.
    """
    widening = ConePin(1.0).widening(clearance)
    return floor(1000.0 * min(0.6 * barrel, barrel - wall - widening) + 1e-6) / 1000.0


def default_radii(
    length: float,
    clearance: Clearance,
    wall: float = DEFAULT_WALL,
    knuckles: int = 3,
    margin: float | None = None,
    widest: float = 3.0,
) -> tuple[float, float]:
    """Choose a barrel and pin radius for a cone-pinned hinge on an edge.

    Parameters
    ----------
    length : float
        Length of the edge in mm.
    clearance : Clearance
        Room between the parts of the hinge.
    wall : float
        Thinnest wall in mm.
    knuckles : int
        Number of knuckles.
    margin : float, optional
        Length in mm left free at each end of the edge; barrel plus clearance when left out.
    widest : float
        Largest barrel radius to aim at, in mm.

    Returns
    -------
    barrel, pin : float
        Radii in mm: the barrel nearest to an eighth of the edge (at most `widest`) that the rules
        of fit accept, and 60 % of it or as much as the wall leaves; 2.5 and 1.5 on an edge of 20 mm
        with 0.3 mm clearance. Where no barrel fits, those of an eighth of the edge.
    """
    wanted = min(length / 8.0, widest)
    wider = range(21, 61)  # on a short edge a barrel is as wide as its walls ask for
    for step in (0, *(sign * n for n in range(1, 21) for sign in (1, -1)), *wider):
        barrel = round(wanted * (1.0 + 0.02 * step), 3)
        free = barrel + clearance.radial if margin is None else margin
        try:
            pin = ConePin(default_pin_radius(barrel, clearance, wall))
            pin.check(lay_out_knuckles(length, knuckles, barrel, clearance, free), wall, BoreForm())
        except HingeError:
            continue
        return barrel, pin.radius
    return wanted, default_pin_radius(wanted, clearance, wall)
