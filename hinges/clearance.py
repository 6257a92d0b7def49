"""Clearances: how much room moving printed surfaces need.

A clearance here is always measured *normal* to the two surfaces that face one another. For a cone
pin this matters: a gap of 0.2 mm along the axis of a 45° cone is only 0.14 mm across it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from math import isfinite, nan
from typing import Final

from .exceptions import HingeError

__all__ = ["PROCESSES", "Clearance", "Process", "millimetres"]

#: Smallest clearance in mm: resin printers hold a few hundredths at best.
LEAST: Final = 0.05
_UNITS: Final[dict[str, float]] = {
    "mm": 1.0,
    "um": 0.001,
    "µm": 0.001,
    "μm": 0.001,
    "cm": 10.0,
    "in": 25.4,
    '"': 25.4,
    "thou": 0.0254,
    "mil": 0.0254,
}
_LENGTH: Final = re.compile(
    r"^\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)\s*([a-zµμ\"]*)\s*$", re.I
)


def number(value: object, name: str) -> float:
    """Read a number, and refuse what is none.

    Parameters
    ----------
    value : object
        What was given.
    name : str
        What it is, for the message.

    Returns
    -------
    float
        The number.

    Raises
    ------
    HingeError
        If it is no finite number.
    """
    try:
        read = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        read = nan
    if isinstance(value, (bool, str)) or not isfinite(read):
        raise HingeError(f"{name} is {value!r}: give a finite number")
    return read


def millimetres(value: float | str, name: str = "length") -> float:
    """Read a length: a number is in mm, a text may name its unit.

    Parameters
    ----------
    value : float or str
        The length: ``0.3``, ``"0.3 mm"``, ``"300 um"``, ``"12 thou"`` or ``"0.012 in"``.
    name : str
        What it is, for messages.

    Returns
    -------
    float
        Length in mm.

    Raises
    ------
    HingeError
        If the text is no length or its unit is unknown.

    Examples
    --------
    >>> millimetres("300 um")
    0.3
    >>> round(millimetres("12 thou"), 4)
    0.3048
    """
    if not isinstance(value, str):
        return number(value, name)
    found = _LENGTH.match(value)
    unit = found.group(2).lower() or "mm" if found else ""
    if found is None or unit not in _UNITS:
        known = ", ".join(name for name in _UNITS if name not in ('"', "μm"))
        raise HingeError(f"{name} {value!r} cannot be read: write a number and one of {known}")
    return round(float(found.group(1)) * _UNITS[unit], 12)


@dataclass(frozen=True)
class Process:
    """What one printing process needs between surfaces that must not fuse.

    Attributes
    ----------
    name : str
        Short name.
    radial, axial : float
        Default clearances across and along the axis in mm, per side, normal to the surface.
    low, high : float
        Range of clearances that makers and vendors report for printed-in-place joints, in mm.
    wall : float
        Thinnest wall in mm that carries load.
    source : str
        Where the figures come from.
    """

    name: str
    radial: float
    axial: float
    low: float
    high: float
    wall: float
    source: str


PROCESSES: Final[dict[str, Process]] = {
    process.name: process
    for process in (
        Process(
            "fdm",
            0.40,
            0.40,
            0.30,
            0.50,
            0.80,
            "makers' reports of printed-in-place hinges, 0.3 to 0.5 a side; print services ask for "
            "0.4 (makelab.com) to 0.5 (arti90.com/en/design-clues) between moving parts",
        ),
        Process(
            "sla",
            0.30,
            0.30,
            0.20,
            0.30,
            0.60,
            "0.25 for parts that fit (help.makelab.com), 0.3 for loose ones (hycubeworks.in)",
        ),
        Process(
            "sls",
            0.60,
            0.60,
            0.50,
            0.60,
            0.80,
            "0.5 between moving parts (arti90.com/en/design-clues), 0.6 in makers' hinges",
        ),
        Process(
            "mjf",
            0.50,
            0.50,
            0.30,
            0.70,
            0.80,
            "at least 0.5 printed together (solidlines.no); HP's guide: 0.7, down to 0.3 beside "
            "walls under 3 mm (amuse3d.in)",
        ),
        Process(
            "polyjet",
            0.35,
            0.35,
            0.30,
            0.40,
            0.80,
            "0.3 to 0.4 on all sides of moving parts and hinges (forgelabs.ca/guidelines)",
        ),
    )
}
"""Defaults by process. Print a coupon (:class:`hinges.Coupon`) for a figure of your own."""


@dataclass(frozen=True)
class Clearance:
    """Room between the surfaces of a hinge that move past one another.

    Parameters
    ----------
    radial : float or str
        Between barrel and groove, pin and bore, cone and recess: always normal to the surface.
        A number is in mm; a text may name its unit (``"300 um"``).
    axial : float or str, optional
        Between the flat ends of neighbouring knuckles; `radial` when left out.
    source : str
        Where the figure comes from; for reports.

    Raises
    ------
    HingeError
        If a value is not a length of 0.05 to 5 mm.

    Examples
    --------
    >>> Clearance(0.3)
    Clearance(radial=0.3, axial=0.3, source='given')
    >>> Clearance.of("sls").radial
    0.6
    """

    radial: float
    axial: float = 0.0
    source: str = "given"

    def __init__(
        self, radial: float | str, axial: float | str | None = None, source: str = "given"
    ) -> None:
        across = millimetres(radial, "radial clearance")
        along = across if axial is None else millimetres(axial, "axial clearance")
        for name, value in (("radial", across), ("axial", along)):
            if not LEAST <= value <= 5.0:
                raise HingeError(
                    f"{name} clearance is {value:g} mm: give {LEAST:g} to 5 mm; with less no "
                    "printer keeps surfaces apart"
                )
        object.__setattr__(self, "radial", across)
        object.__setattr__(self, "axial", along)
        object.__setattr__(self, "source", source)

    @classmethod
    def of(cls, process: str) -> Clearance:
        """Take the default of a printing process.

        Parameters
        ----------
        process : str
            "fdm", "sla", "sls", "mjf" or "polyjet", in small or capital letters.

        Returns
        -------
        Clearance
            The process's default, with the source of the figure.

        Raises
        ------
        HingeError
            If the process is unknown.
        """
        try:
            found = PROCESSES[process.lower()]
        except KeyError:
            known = ", ".join(PROCESSES)
            raise HingeError(f"process {process!r} is unknown: use one of {known}") from None
        return cls(found.radial, found.axial, source=f"{found.name}: {found.source}")

    @classmethod
    def read(cls, value: Clearance | float | str) -> Clearance:
        """Read a clearance however it was given.

        Parameters
        ----------
        value : Clearance, float or str
            A `Clearance`, a number in mm, a length with a unit such as "300 um", or a process.

        Returns
        -------
        Clearance
            The clearance that was meant.

        Raises
        ------
        HingeError
            If the text is neither a length nor a process, or the length is out of range.
        """
        if isinstance(value, Clearance):
            return value
        if isinstance(value, str) and value.lower() in PROCESSES:
            return cls.of(value)
        return cls(value)

    @property
    def least(self) -> float:
        """The smaller of the two, in mm: the gap that two halves keep at every angle."""
        return min(self.radial, self.axial)
