"""At which heights a print pauses so that magnets can be laid in."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from fabfold.joinery.box_hold import Retention

if TYPE_CHECKING:
    from fabfold.apart.apart_kit import ApartKit

__all__ = ["PrintPause", "print_pauses"]


@dataclass(frozen=True)
class PrintPause:
    """A pause of a print.

    Attributes
    ----------
    plate : int or None
        Plate, from 1; None where the kit is printed in place.
    z_mm : float
        Height above the plate, mm: the first layer above it closes the pocket.
    north, south : tuple of int
        Indices of the bodies that get a magnet then, once for each magnet, by the pole that looks
        to the face.
    """

    plate: int | None
    z_mm: float
    north: tuple[int, ...]
    south: tuple[int, ...]


def print_pauses(retention: Retention | None, apart: ApartKit | None) -> list[PrintPause]:
    """All pauses of a kit's print.

    Parameters
    ----------
    retention : Retention or None
        The magnets.
    apart : ApartKit or None
        The plates of a kit that is printed body by body.

    Returns
    -------
    list of PrintPause
        By plate and height; none where no magnet is enclosed.
    """
    at: dict[tuple[int, float], tuple[list[int], list[int]]] = {}
    for pair in () if retention is None else retention.pairs:
        for pole, (body, height) in enumerate(zip(pair.bodies, pair.pauses_mm or (), strict=False)):
            plate = 0 if apart is None else int(apart.plates.plate[body]) + 1
            at.setdefault((plate, height), ([], []))[pole].append(body)
    return [
        PrintPause(plate or None, height, tuple(sorted(north)), tuple(sorted(south)))
        for (plate, height), (north, south) in sorted(at.items())
    ]
