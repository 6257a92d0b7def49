"""A living hinge: a web of the plate itself that bends, cut free by a groove.

A web of thickness w that bends by the angle θ over a land of length L lies on an arc about its
middle, so its outer fibres are stretched by w θ / 2 L. The land is made as long as the material
asks for: short of what it bears again and again where the hinge is to be used, or of what it bears
a few times where a box is folded once.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import radians, sin, tan
from typing import TYPE_CHECKING, Final, Literal

from build123d import (
    Align,
    BasePartObject,
    BuildPart,
    BuildSketch,
    Mode,
    Plane,
    Polygon,
    extrude,
)

from .clearance import millimetres, number
from .exceptions import HingeError
from .fit import at_least, at_most
from .retention import STRAIN_LIMITS

if TYPE_CHECKING:
    from build123d import RotationLike

__all__ = ["FLEX_LIVES", "FlexLife", "LivingHinge"]


@dataclass(frozen=True)
class FlexLife:
    """What a printed material bears when it is bent.

    Attributes
    ----------
    again : float
        Strain, as a share of 1, that it bears again and again; of :data:`STRAIN_LIMITS`.
    few : float
        Strain that it bears a few times: about its strain at break along the layers.
    words : str
        What to expect, for people.
    """

    again: float
    few: float
    words: str


FLEX_LIVES: Final[dict[str, FlexLife]] = {
    "pla": FlexLife(STRAIN_LIMITS["pla"], 0.04, "a few folds; it whitens and breaks"),
    "petg": FlexLife(STRAIN_LIMITS["petg"], 0.08, "tens of folds"),
    "abs": FlexLife(STRAIN_LIMITS["abs"], 0.06, "tens of folds"),
    "pa12": FlexLife(STRAIN_LIMITS["pa12"], 0.15, "hundreds of folds"),
    "pp": FlexLife(
        STRAIN_LIMITS["pp"], 0.5, "thousands of folds; fold it to its end once while it is warm"
    ),
    "tpu": FlexLife(0.25, 2.0, "does not wear out in use"),
}
"""Materials by name. The strains at break are the low end of makers' data sheets for printed bars
along the layers; the folds to be expected are makers' experience, not measured here."""


class LivingHinge(BasePartObject):  # type: ignore[misc]
    """The cutter of a living hinge, with its groove above a web at the plate's lower face.

    The fold runs along z through the origin. The plate's lower face, which is printed first, is
    y = 0; it folds upwards, so that its upper faces come together. Subtract it from the plate.

    Parameters
    ----------
    length : float
        Length of the fold in mm; what is cut is 0.02 longer at each end.
    thickness : float
        Thickness of the plate in mm.
    angle : float
        How far it folds, degrees, above 0 and below 170. The sides of the groove lean by half of
        it each, so that they stand side by side when it is folded.
    web : float
        Thickness of the web in mm; two or three layers.
    material : str
        A name of :data:`FLEX_LIVES`.
    use : {"again", "few"}
        Whether it is folded again and again, or a few times.
    land : float, optional
        Length of the web across the fold in mm; the shortest that the material bears by default,
        and not below two webs.
    nozzle : float
        The land is no shorter than two of these, or the slicer leaves it out, mm.
    rotation, align, mode
        As for every build123d part; subtracted from the part under construction by default.

    Attributes
    ----------
    strain : float
        Of the outer fibres when it is folded, as a share of 1.
    radius : float
        Of the bent web at its middle, mm.
    gap : float
        Distance of the groove's sides when it is folded, mm.
    outside : float
        How far beyond the middle of the fold the lower faces of both sides meet when it is folded,
        mm.
    life : FlexLife
        What to expect of the material.

    Raises
    ------
    FitError
        If the land strains the web by more than the material bears, or the web is too thin or
        thicker than a third of the plate.
    HingeError
        If a parameter makes no sense.

    Examples
    --------
    >>> from build123d import Box
    >>> fold = LivingHinge(40, 2.0, angle=90, material="pp")
    >>> round(fold.land, 2), round(fold.strain, 3)
    (7.85, 0.03)
    """

    def __init__(
        self,
        length: float | str,
        thickness: float | str,
        *,
        angle: float = 90.0,
        web: float = 0.3,
        material: str = "pp",
        use: Literal["again", "few"] = "again",
        land: float | None = None,
        nozzle: float = 0.4,
        rotation: RotationLike = (0, 0, 0),
        align: Align | tuple[Align, Align, Align] | None = None,
        mode: Mode = Mode.SUBTRACT,
    ) -> None:
        self.length, self.thickness = millimetres(length, "length"), millimetres(thickness)
        self.angle, self.web = number(angle, "angle"), number(web, "web")
        if not 0.0 < self.angle < 170.0:
            raise HingeError(f"angle is {self.angle:g}: a living hinge folds by 1 to 169 degrees")
        if self.length <= 0.0 or self.thickness <= 0.0:
            raise HingeError("length and thickness must be above 0")
        if material.lower() not in FLEX_LIVES:
            raise HingeError(
                f"material {material!r} is unknown: use one of {', '.join(FLEX_LIVES)}"
            )
        if use not in ("again", "few"):
            raise HingeError(f"use {use!r}: give 'again' or 'few'")
        self.printed_in, self.use = material.lower(), use
        self.life = FLEX_LIVES[self.printed_in]
        bears = self.life.again if use == "again" else self.life.few
        at_least("web", "the web of a living hinge", self.web, 0.15, "print at least one layer")
        most = self.thickness / 3.0
        at_most("web", "the web of a living hinge", self.web, most, "take a thicker plate")
        needed = max(self.web * radians(self.angle) / (2.0 * bears), 2.0 * self.web, 2.0 * nozzle)
        self.land = needed if land is None else number(land, "land")
        if self.land <= 0.0:
            raise HingeError(f"land is {self.land:g} mm: give a length above 0")
        at_most(
            "strain",
            f"the strain of the web in {self.printed_in}",
            100.0 * self.strain,
            100.0 * bears + 1e-9,
            f"use a land of {needed:.2f} mm, a thinner web or another material",
            unit="%",
        )
        super().__init__(part=self._mask(), rotation=rotation, align=align, mode=mode)
        self.label = "living hinge"

    @property
    def strain(self) -> float:
        """Strain of the outer fibres when it is folded, as a share of 1."""
        return self.web * radians(self.angle) / (2.0 * self.land)

    @property
    def radius(self) -> float:
        """Radius of the bent web at its middle, mm."""
        return self.land / radians(self.angle)

    @property
    def outside(self) -> float:
        """How far beyond the middle of the fold the lower faces meet when it is folded, mm."""
        return (self.radius + 0.5 * self.web) * tan(0.5 * radians(self.angle)) - 0.5 * self.land

    @property
    def gap(self) -> float:
        """Distance of the groove's sides when it is folded, mm."""
        return 2.0 * (self.radius - 0.5 * self.web) * sin(radians(self.angle) / 2.0)

    def _mask(self) -> object:
        """The groove: its floor is the web, its sides lean by half of the angle."""
        lean = tan(radians(self.angle) / 2.0)
        over = 0.02
        top = self.thickness + over
        foot, mouth = 0.5 * self.land, 0.5 * self.land + (top - self.web) * lean
        with BuildPart(mode=Mode.PRIVATE) as mask:
            with BuildSketch(Plane.XY):
                Polygon(
                    (-foot, self.web), (foot, self.web), (mouth, top), (-mouth, top), align=None
                )
            extrude(amount=0.5 * self.length + over, both=True)
        return mask.part
