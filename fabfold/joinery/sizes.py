"""Sizes of hinges and struts, all derived from the side of a voxel and the clearance."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from fabfold.errors import RecipeError

if TYPE_CHECKING:
    from hinges.hardware import LoosePin
    from hinges.mesh import DoubleHingeMeshes, HingeMeshes

__all__ = ["MIN_WALL_MM", "HingeSize", "hinge_size", "smallest_voxel", "strut_width"]

#: Thinnest wall in a hinge: barrel around the pin, web between two recesses.
MIN_WALL_MM = 0.8
#: Barrels thicker than this share of the voxel would eat too much of the cells around them.
_LARGEST_BARREL = 0.18
#: Knuckles of a single hinge where nothing else is asked for.
_DEFAULT_KNUCKLES = 3


@dataclass(frozen=True)
class HingeSize:
    """Size of every hinge of a kit, in mm.

    Attributes
    ----------
    barrel_radius_mm : float
        Radius of the barrel.
    pin_radius_mm : float
        Radius of the pin of a single hinge.
    clearance_mm : float
        Normal clearance between the surfaces that turn on each other.
    knuckles : int
        Number of knuckles of a single hinge.
    voxel_mm : float
        Length of the hinged edge, the side of a voxel.
    gap_mm : float
        Gap between the faces of two bodies.
    pin : hinges.hardware.LoosePin or None
        Pin that is pushed in after printing; None for cones that are printed.
    meshes : hinges.mesh.HingeMeshes
        The four pieces of a single hinge in its own frame.
    """

    barrel_radius_mm: float
    pin_radius_mm: float
    clearance_mm: float
    knuckles: int
    voxel_mm: float
    gap_mm: float
    pin: LoosePin | None
    meshes: HingeMeshes

    @property
    def reach_mm(self) -> float:
        """Radius of the groove that a barrel needs in any other body."""
        return self.barrel_radius_mm + self.clearance_mm

    def double(self, second: str, turns: tuple[float, float]) -> DoubleHingeMeshes:
        """The double hinge with barrels of the same radius, its first axis on "+y".

        Both axes on one edge want five knuckles in place of three, which take a thinner pin.

        Parameters
        ----------
        second : str
            Edge of the second axis, as in :func:`hinges.mesh.double_hinge_meshes`.
        turns : (float, float)
            How far each axis turns: 90, 180 or 270 degrees.

        Returns
        -------
        hinges.mesh.DoubleHingeMeshes
            The pieces of the hinge in its own frame, mm.

        Raises
        ------
        hinges.exceptions.FitError
            If it does not fit, with the rule that failed.
        """
        from hinges.exceptions import FitError
        from hinges.mesh import double_hinge_meshes

        knuckles = 5 if second == "+y" else self.knuckles
        pins = [self.pin_radius_mm]
        if second == "+y" and self.pin is None:
            pins += [float(pin) for pin in np.arange(self.pin_radius_mm - 0.1, 0.75, -0.1)]
        refusal: FitError | None = None
        for pin in pins:
            try:
                return double_hinge_meshes(
                    self.voxel_mm,
                    self.clearance_mm,
                    "+y",
                    second,
                    turns,
                    barrel_radius_mm=self.barrel_radius_mm,
                    pin_radius_mm=round(pin, 4),
                    gap_mm=self.gap_mm,
                    knuckles=knuckles,
                    wall_mm=MIN_WALL_MM,
                    pin=self.pin,
                )
            except FitError as error:
                refusal = refusal or error
        raise refusal if refusal is not None else ValueError("no pin to try")


def strut_width(voxel_mm: float) -> float:
    """Side in mm of the square bars that join loose material: 15 % of a voxel, at least 1.6."""
    return max(1.6, 0.15 * voxel_mm)


def hinge_size(
    voxel_mm: float,
    clearance_mm: float,
    barrel_radius_mm: float | None = None,
    pin_radius_mm: float | None = None,
    knuckles: int | None = None,
    gap_mm: float | None = None,
    pin: LoosePin | None = None,
) -> HingeSize:
    """Choose the hinge for an edge of a voxel.

    The barrel starts at an eighth of the edge and grows until every rule of :mod:`hinges.fit`
    holds; the pin is 60 % of it, or what the wall leaves.

    Parameters
    ----------
    voxel_mm : float
        Length of the edge in mm.
    clearance_mm : float
        Normal clearance in the hinge in mm.
    barrel_radius_mm : float, optional
        Radius of the barrel in mm, used as it is.
    pin_radius_mm : float, optional
        Radius of the pin in mm, used as it is.
    knuckles : int, optional
        Number of knuckles; 3 by default.
    gap_mm : float, optional
        Gap between the faces of two bodies in mm; the clearance by default.
    pin : hinges.hardware.LoosePin, optional
        Pin that is pushed in after printing; its radius is then the pin's.

    Returns
    -------
    HingeSize
        The first size that fits.

    Raises
    ------
    RecipeError
        If no hinge fits, with the rule that failed and the smallest voxel that would do.
    """
    gap = float(clearance_mm if gap_mm is None else gap_mm)
    found, reason = _first_fit(
        float(voxel_mm), float(clearance_mm), barrel_radius_mm, pin_radius_mm, knuckles, gap, pin
    )
    if found is None:
        least = smallest_voxel(clearance_mm, gap, pin)
        advice = (
            f"the smallest voxel for this clearance is {least:g} mm"
            if barrel_radius_mm is pin_radius_mm is knuckles is None and least is not None
            else "leave barrel, pin and knuckles to fabfold, or choose a larger voxel"
        )
        raise RecipeError(
            f"no hinge fits a voxel of {voxel_mm:g} mm with {clearance_mm:g} mm clearance: "
            f"{reason}; {advice}"
        )
    return found


def _first_fit(
    voxel_mm: float,
    clearance_mm: float,
    barrel: float | None,
    pin_radius: float | None,
    knuckles: int | None,
    gap_mm: float,
    pin: LoosePin | None,
) -> tuple[HingeSize | None, str]:
    """The first size that fits, or None and the rule that the first try broke."""
    from hinges.exceptions import HingeError
    from hinges.mesh import single_hinge_meshes

    reason = ""
    count = _DEFAULT_KNUCKLES if knuckles is None else knuckles
    if barrel is not None:
        barrels = [barrel]
    else:
        smallest = min(voxel_mm / 8.0, 5.0)
        largest = max(smallest, min(_LARGEST_BARREL * voxel_mm, 6.0))
        barrels = [float(r) for r in np.round(np.arange(smallest, largest + 1e-9, 0.05), 4)]
    for radius in barrels:
        # At 45 degrees the mouth of a recess is 0.414 c wider than the foot of its cone.
        widest = radius - MIN_WALL_MM - (np.sqrt(2.0) - 1.0) * clearance_mm
        thick = float(np.floor(100 * min(0.6 * radius, widest) + 1e-9) / 100)
        try:
            meshes = single_hinge_meshes(
                voxel_mm,
                clearance_mm,
                barrel_radius_mm=radius,
                pin_radius_mm=thick if pin_radius is None else pin_radius,
                gap_mm=gap_mm,
                knuckles=count,
                wall_mm=MIN_WALL_MM,
                pin=pin,
            )
        except HingeError as error:
            reason = reason or str(error)
            continue
        return (
            HingeSize(
                meshes.barrel_radius_mm,
                meshes.pin_radius_mm,
                clearance_mm,
                count,
                voxel_mm,
                gap_mm,
                pin,
                meshes,
            ),
            "",
        )
    return None, reason


@lru_cache(maxsize=32)
def smallest_voxel(
    clearance_mm: float, gap_mm: float | None = None, pin: LoosePin | None = None
) -> float | None:
    """Smallest voxel in whole mm that holds a hinge of this clearance; None above 60 mm.

    Parameters
    ----------
    clearance_mm : float
        Normal clearance in the hinge in mm.
    gap_mm : float, optional
        Gap between the faces of two bodies in mm; the clearance by default.
    pin : hinges.hardware.LoosePin, optional
        Pin that is pushed in after printing.

    Returns
    -------
    float or None
        Side of the voxel in mm.
    """
    gap = clearance_mm if gap_mm is None else gap_mm
    for side in range(4, 61):
        if _first_fit(float(side), clearance_mm, None, None, None, gap, pin)[0] is not None:
            return float(side)
    return None
