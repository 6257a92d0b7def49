"""The pins that one can buy for a kit printed body by body, and how they sit in their bores."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from fabfold.errors import RecipeError
from hinges.hardware import SCREWS

__all__ = ["PINS", "PinFit", "PinKind"]

#: Pin and screw end at least this far inside the barrel, so that nothing sticks out, mm.
SHORT_MM: Final = 0.2
#: Room around a screw's head in its pocket, in radius, and least material behind the pocket, mm.
HEAD_ROOM_MM: Final = 0.15
_BEHIND_MM: Final = 0.8


@dataclass(frozen=True)
class PinKind:
    """One sort of loose pin.

    Attributes
    ----------
    diameter_mm : float
        Diameter, or that of the thread, mm.
    what : str
        What one buys.
    screw : str
        Name of the screw in :data:`hinges.hardware.SCREWS`; empty for a plain pin.
    lengths_mm : tuple of float
        Lengths in which screws are sold, mm, those to be taken first in front.
    tool : str
        What turns the screw.
    """

    diameter_mm: float
    what: str
    screw: str = ""
    lengths_mm: tuple[float, ...] = ()
    tool: str = ""

    def fit(self, grip_mm: float, slip_mm: float) -> PinFit:
        """How this pin sits where plain ones have a grip and a slip, radii in mm."""
        if not self.screw:
            return PinFit(grip_mm, slip_mm)
        screw = SCREWS[self.screw]
        bite = (screw.tap - screw.diameter) / 2
        return PinFit(bite, slip_mm, screw.cap / 2, screw.cap_height, self.lengths_mm)


#: Pins that a kit can be joined with, by name.
PINS: Final[dict[str, PinKind]] = {
    "1.75": PinKind(1.75, "filament of 1.75 mm"),
    "2.85": PinKind(2.85, "filament of 2.85 mm"),
    "rod-2": PinKind(2.0, "round rod of 2 mm"),
    # Lengths of ISO 4762; shops have 14 too, which is taken where no other one fits.
    "m2": PinKind(
        2.0,
        "screw M2, cylinder head (ISO 4762)",
        "M2",
        (20.0, 16.0, 12.0, 10.0, 8.0, 6.0, 5.0, 4.0, 3.0, 14.0),
        "hex key of 1.5 mm",
    ),
}


@dataclass(frozen=True)
class PinFit:
    """How a loose pin sits in its bores, mm.

    Attributes
    ----------
    grip_mm : float
        How much wider than the pin the bore is that holds it, in radius; below 0 where a thread
        cuts itself in.
    slip_mm : float
        The same of the bores that turn on it.
    head_mm : float
        Radius of the head, which is sunk into the end of the barrel; 0 for a pin without one.
    head_height_mm : float
        Height of the head.
    lengths_mm : tuple of float
        Lengths in which it is sold, those to be taken first in front; none for what is cut to
        length.
    """

    grip_mm: float
    slip_mm: float
    head_mm: float = 0.0
    head_height_mm: float = 0.0
    lengths_mm: tuple[float, ...] = ()

    @property
    def threaded(self) -> bool:
        """Whether it is a screw that holds by its thread."""
        return self.grip_mm < 0.0

    @property
    def pocket_mm(self) -> float:
        """Radius of the pocket for the head, mm; 0 where there is none."""
        return self.head_mm + HEAD_ROOM_MM if self.head_mm else 0.0

    @property
    def sunk_mm(self) -> float:
        """Depth of that pocket, mm."""
        return self.head_height_mm + SHORT_MM

    def screw_length(self, barrel_mm: float, knuckle_mm: float, diameter_mm: float) -> float:
        """The length of screw to buy: it ends inside the barrel and holds by a diameter or more.

        Parameters
        ----------
        barrel_mm : float
            Length of all knuckles with the gaps between them, mm.
        knuckle_mm : float
            Length of the knuckles at the ends; the head is sunk into the one, and the thread cuts
            itself into the other, mm.
        diameter_mm : float
            Diameter of the thread, mm.

        Returns
        -------
        float
            mm, below the head.

        Raises
        ------
        RecipeError
            If no length that is sold does so, or the knuckle is too short for the head.
        """
        least = barrel_mm - self.sunk_mm - knuckle_mm + diameter_mm
        most = barrel_mm - self.sunk_mm - SHORT_MM
        if knuckle_mm >= self.sunk_mm + _BEHIND_MM:
            for length in self.lengths_mm:
                if least <= length <= most:
                    return length
        raise RecipeError(
            f"--pin m2: hinges of this size want a screw of {least:.1f} to {most:.1f} mm and "
            f"knuckles of {self.sunk_mm + _BEHIND_MM:g} mm (they have {knuckle_mm:.1f}), and none "
            "is sold; --voxel-mm 20 takes one, or a pin of filament does: --pin 1.75"
        )
