"""Sizes of hinges and struts, all derived from the side of a voxel and the clearance."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from fabfold.errors import RecipeError

if TYPE_CHECKING:
    from hinges.mesh import DoubleHingeMeshes, HingeMeshes

__all__ = ["MIN_WALL_MM", "HingeSize", "hinge_size", "smallest_voxel", "strut_width"]

#: Thinnest wall in a hinge: barrel around the pin, web between two recesses.
MIN_WALL_MM = 0.8
#: Barrels thicker than this share of the voxel would eat too much of the cells around them.
_LARGEST_BARREL = 0.18
_DEFAULT_KNUCKLES = 3


@dataclass(frozen=True)
class HingeSize:
    """Size of every hinge of a kit, in mm.

    Attributes
    ----------
    barrel_radius_mm, pin_radius_mm, clearance_mm : float
    knuckles : int
    voxel_mm : float
        Length of the edge.
    meshes : hinges.mesh.HingeMeshes
        The four pieces of a single hinge in its own frame.
    """

    barrel_radius_mm: float
    pin_radius_mm: float
    clearance_mm: float
    knuckles: int
    voxel_mm: float
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
            90, 180 or 270 degrees each.

        Raises
        ------
        hinges.exceptions.FitError
            If it does not fit, with the rule that failed.
        """
        from hinges.exceptions import FitError
        from hinges.mesh import double_hinge_meshes

        knuckles = 5 if second == "+y" else self.knuckles
        pins = [self.pin_radius_mm]
        if second == "+y":
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
                    knuckles=knuckles,
                    wall_mm=MIN_WALL_MM,
                )
            except FitError as error:
                refusal = refusal or error
        raise refusal if refusal is not None else ValueError("no pin to try")


def strut_width(voxel_mm: float) -> float:
    """Side of the square bars that join loose material, in mm: 15 % of a voxel, at least 1.6."""
    return max(1.6, 0.15 * voxel_mm)


def hinge_size(
    voxel_mm: float,
    clearance_mm: float,
    barrel_radius_mm: float | None = None,
    pin_radius_mm: float | None = None,
    knuckles: int | None = None,
) -> HingeSize:
    """Choose the hinge for an edge of a voxel.

    The barrel starts at an eighth of the edge and grows until every rule of :mod:`hinges.fit`
    holds; the pin is 60 % of it, or what the wall leaves.

    Parameters
    ----------
    voxel_mm : float
        Length of the edge.
    clearance_mm : float
        Normal clearance in the hinge.
    barrel_radius_mm, pin_radius_mm, knuckles : optional
        Used as they are when given.

    Raises
    ------
    RecipeError
        If no hinge fits, with the rule that failed and the smallest voxel that would do.
    """
    found, reason = _first_fit(
        float(voxel_mm), float(clearance_mm), barrel_radius_mm, pin_radius_mm, knuckles
    )
    if found is None:
        least = smallest_voxel(clearance_mm)
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
    pin: float | None,
    knuckles: int | None,
) -> tuple[HingeSize | None, str]:
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
                pin_radius_mm=thick if pin is None else pin,
                knuckles=count,
                wall_mm=MIN_WALL_MM,
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
                meshes,
            ),
            "",
        )
    return None, reason


@lru_cache(maxsize=32)
def smallest_voxel(clearance_mm: float) -> float | None:
    """Smallest voxel in whole mm that holds a hinge of this clearance; None above 60 mm.

    Parameters
    ----------
    clearance_mm : float
    """
    for side in range(4, 61):
        if _first_fit(float(side), clearance_mm, None, None, None)[0] is not None:
            return float(side)
    return None
