"""What keeps folded bodies together: magnets, and snap tongues.

Frame of all parts: the face that meets its partner is the plane z = 0, the body that owns the
feature lies below it (z < 0), and z points towards the partner. Cutters for the partner are given
in the same frame, in the closed pose.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, hypot, pi, radians, sin, tan
from typing import TYPE_CHECKING, Final, Literal

from build123d import (
    Align,
    BasePartObject,
    Mode,
    Part,
    RigidJoint,
)

from .clearance import number
from .exact_solids import build_shape, one_part, solids_of
from .exceptions import HingeError
from .fit import at_least, at_most
from .shapes import Moved, Prism, Shape, box, cylinder

if TYPE_CHECKING:
    from build123d import RotationLike

__all__ = ["STRAIN_LIMITS", "Magnet", "MagnetPocket", "SnapDimple", "SnapSpec", "SnapTongue"]

STRAIN_LIMITS: Final[dict[str, float]] = {
    "pla": 0.008,
    "petg": 0.015,
    "abs": 0.012,
    "resin": 0.010,
    "pa12": 0.020,
    "pp": 0.030,
}
"""Strain, as a share of 1, that printed material bears again and again: about half of its strain at
yield, layers along the tongue. PLA takes no more than 0.8 %."""


@dataclass(frozen=True)
class Magnet:
    """A round or square magnet.

    Parameters
    ----------
    across : float
        Diameter, or side of the square, in mm.
    height : float
        Height in mm.
    shape : {"round", "square"}
        Form of the magnet as seen from above.
    """

    across: float
    height: float
    shape: Literal["round", "square"] = "round"

    def __post_init__(self) -> None:
        """Refuse what is no magnet."""
        if self.across <= 0.0 or self.height <= 0.0 or self.shape not in ("round", "square"):
            raise HingeError(
                f"magnet: {self.across:g} mm across, {self.height:g} mm high, {self.shape!r}: "
                "sizes must be above 0 and the shape round or square"
            )

    def outline(self, room: float, bottom: float, top: float) -> Shape:
        """Draw the magnet, or the room that it takes.

        Parameters
        ----------
        room : float
            How much wider it is drawn on every side, in mm.
        bottom, top : float
            Its two ends, z in mm.

        Returns
        -------
        Shape
            The shape on the z axis.
        """
        half = 0.5 * self.across + room
        if self.shape == "round":
            return cylinder(half, bottom, top)
        return box(-half, half, -half, half, bottom, top)


class MagnetPocket(BasePartObject):  # type: ignore[misc]
    """The cutter of a pocket for a magnet below the face z = 0.

    Parameters
    ----------
    magnet : Magnet
        Form and size of the magnet.
    fit : {"press", "captured"}
        How it is held: pressed in from the face and gripped by ribs, or laid in while the print is
        paused and closed in.
    room : float, optional
        Distance in mm between magnet and pocket on every side; negative for more grip. When left
        out 0.05 for a pressed magnet, 0.15 for a captured one.
    skin : float
        Thickness in mm of the material between a captured magnet and the face.
    wall : float
        Thinnest skin in mm that the process prints.
    rotation, align, mode
        As for every build123d part; subtracted from the part under construction by default.

    Attributes
    ----------
    pause_below : float
        How far below the face (mm) the print has to pause for a captured magnet, printing with the
        face up: lay the magnet in when this level is reached. With the face down pause at the
        pocket's other end, `pause_below` + `deep`.
    deep : float
        Depth of the pocket in mm.
    magnet_part : Part
        The magnet in its place, for drawings.

    Raises
    ------
    FitError
        If the skin is thinner than `wall`.
    HingeError
        If the fit is unknown.
    """

    def __init__(
        self,
        magnet: Magnet,
        fit: Literal["press", "captured"] = "press",
        *,
        room: float | None = None,
        skin: float = 0.6,
        wall: float = 0.4,
        rotation: RotationLike = (0, 0, 0),
        align: Align | tuple[Align, Align, Align] | None = None,
        mode: Mode = Mode.SUBTRACT,
    ) -> None:
        if fit not in ("press", "captured"):
            raise HingeError(f"magnet pocket: fit {fit!r}: use 'press' or 'captured'")
        self.magnet, self.fit = magnet, fit
        self.room = (0.05 if fit == "press" else 0.15) if room is None else room
        captured = fit == "captured"
        if captured:
            at_least("wall", "the skin over a captured magnet", skin, wall, "use a thicker skin")
        self.skin = skin if captured else 0.0
        # A pressed magnet sits 0.1 below the face; a captured one has 0.2 of air above.
        self.deep = magnet.height + (0.2 if captured else 0.1)
        self.pause_below = self.skin if captured else 0.0
        super().__init__(part=self._built(), rotation=rotation, align=align, mode=mode)
        self.label = f"magnet pocket {magnet.across:g} x {magnet.height:g}"
        RigidJoint("magnet", self)

    def _built(self) -> Part:
        """Build the cutter; a pressed magnet is gripped by three (four) ribs of 0.15 mm."""
        bottom, top = -self.skin - self.deep, -self.skin
        over = 0.01 if self.fit == "press" else 0.0
        if self.fit == "captured":
            return one_part([build_shape(self.magnet.outline(self.room, bottom, top))])
        ribs_room = 0.15
        pocket = build_shape(self.magnet.outline(self.room + ribs_room, bottom, top + over))
        half = 0.5 * self.magnet.across + self.room
        count = 3 if self.magnet.shape == "round" else 4
        ribs = []
        for index in range(count):
            rib = box(half, half + ribs_room + 0.2, -0.4, 0.4, bottom, top - 0.4)
            angle = 2.0 * pi * index / count
            frame = (cos(angle), sin(angle), 0.0)
            ribs.append(build_shape(Moved(rib, x_dir=frame)))
        return one_part(solids_of(pocket.cut(*ribs)))

    @property
    def magnet_part(self) -> Part:
        """The magnet in its place, for drawings."""
        bottom = -self.skin - self.deep
        return one_part(
            [build_shape(self.magnet.outline(0.0, bottom, bottom + self.magnet.height))]
        )


@dataclass(frozen=True)
class SnapSpec:
    """A tongue that stands out of one face and snaps into a mortise of its partner.

    Parameters
    ----------
    length : float
        Length of the tongue above the face in mm.
    thickness, width : float
        Its two other sizes in mm; it bends across its thickness.
    catch : float
        Height in mm of the ridge that drops into the dimple.
    clearance : float
        Distance between tongue and mortise in mm.
    gap : float
        Distance between the two faces in the closed pose, in mm.
    material : str
        What it is printed in: one of ``STRAIN_LIMITS``.
    lead : float
        Lead angle of the ridge, from the tongue, in degrees: how steeply it goes in and comes
        out.
    wall : float
        Thinnest tongue in mm.
    arc : float, optional
        Distance in mm from the tongue to the axis about which it closes, as on a lid with a hinge;
        the tongue bends in the plane of that arc. It closes straight when left out.
    inwards : bool
        Whether the ridge looks towards that axis.
    """

    length: float = 8.0
    thickness: float = 1.2
    width: float = 5.0
    catch: float = 0.5
    clearance: float = 0.3
    gap: float = 0.3
    material: str = "pla"
    lead: float = 45.0
    wall: float = 0.8
    arc: float | None = None
    inwards: bool = False

    def shift(self, height: float) -> float:
        """How far the tongue stands aside in the mouth of its mortise as it closes on an arc.

        Parameters
        ----------
        height : float
            Height above the face, in mm, of the point of the tongue that is in the mouth.

        Returns
        -------
        float
            Away from the axis of the arc, in mm; 0 where it closes straight.
        """
        # On its way through the plane of the mouth a point is as far from the axis as ever.
        return 0.0 if self.arc is None else hypot(self.arc, height) - self.arc

    @property
    def deflection(self) -> float:
        """How far the tongue bends as its ridge goes in: ridge less clearance, in mm.

        On an arc the tongue stands outwards by then. A ridge that looks outwards is pressed by that
        much more, most of all in the mouth of the mortise. One that looks towards the axis is
        pressed less, most of all just before it drops into its dimple.
        """
        if self.arc is None or not self.inwards:
            return max(0.0, self.catch - self.clearance + self.shift(self.ridge_at))
        turn = (self._foot + self.clearance) / self.arc  # from there to the closed pose
        aside = self.ridge_at * sin(turn) - self.arc * (1.0 - cos(turn))
        return max(0.0, self.catch - self.clearance - aside)

    @property
    def strain(self) -> float:
        """Largest strain while it goes in: a cantilever, 1.5 t δ / l².

        It is bent at its ridge; and, on an arc, at its tip, which comes in aside of the mortise.
        """
        at_tip = max(0.0, self.shift(self.length) - self.clearance) / self.length**2
        return 1.5 * self.thickness * max(self.deflection / self.ridge_at**2, at_tip)

    @property
    def ridge_at(self) -> float:
        """Height of the ridge's top above the face in mm."""
        return self.length - self._foot - 0.4

    @property
    def _foot(self) -> float:
        """Half the ridge's length along the tongue in mm."""
        return self.catch / tan(radians(self.lead)) + 0.1

    def check(self) -> None:
        """Refuse a tongue that would not hold, or break.

        Raises
        ------
        FitError
            If a rule of fit fails; it names the rule and what to change.
        HingeError
            If the material is unknown.
        """
        if self.material.lower() not in STRAIN_LIMITS:
            raise HingeError(
                f"material {self.material!r} is unknown: use one of {', '.join(STRAIN_LIMITS)}"
            )
        if not 20.0 <= self.lead <= 60.0:
            raise HingeError(f"snap tongue: lead {self.lead:g}° is outside 20° to 60°")
        at_least(
            "wall", "the tongue's thickness", self.thickness, self.wall, "use a thicker tongue"
        )
        at_least("wall", "the tongue's width", self.width, 2.0 * self.wall, "use a wider tongue")
        if self.arc is not None and number(self.arc, "arc") <= self.length:
            raise HingeError(
                f"snap tongue: arc {self.arc:g} mm must be above the tongue's length "
                f"{self.length:g} mm"
            )
        at_least(
            "retention",
            "what the ridge catches behind after its clearance",
            self.catch - self.clearance,
            0.1,
            "use a higher catch or a smaller clearance",
        )
        at_least(
            "retention",
            "how far the ridge is pressed on its way",
            self.deflection,
            0.05,
            "use a higher catch, a smaller clearance or a tongue farther from the axis",
        )
        at_least(
            "retention",
            "the tongue below its ridge",
            self.ridge_at - self._foot - self.gap,
            self.thickness,
            "use a longer tongue or a lower catch",
        )
        at_most(
            "strain",
            f"the strain of the tongue in {self.material}",
            100.0 * self.strain,
            100.0 * STRAIN_LIMITS[self.material.lower()],
            "use a longer or thinner tongue, a lower catch or a tougher material"
            if self.arc is None
            else "use a shorter or thinner tongue farther from the axis, more clearance or a "
            "tougher material",
            "%",
        )

    def tongue(self, room: float, over: float) -> tuple[Shape, ...]:
        """Draw tongue and ridge, or the room that they take.

        Parameters
        ----------
        room : float
            How much larger they are drawn on every side, in mm.
        over : float
            How far below the face they begin, in mm.

        Returns
        -------
        tuple of Shape
            Tongue and ridge.
        """
        half, side = 0.5 * self.thickness + room, 0.5 * self.width + room
        high = self.length + room
        beam = box(-half, half, -side, side, -over, high)
        foot, top = self._foot + room, self.ridge_at
        # The ridge lies along y on the side +x: an outline in (x, z) drawn out along y.
        ridge = Moved(
            Prism(
                (
                    (half - 0.05, top - foot),
                    (half, top - foot),
                    (half + self.catch, top - 0.1 - room),
                    (half + self.catch, top + 0.1 + room),
                    (half, top + foot),
                    (half - 0.05, top + foot),
                ),
                -side,
                side,
            ),
            z_dir=(0.0, -1.0, 0.0),
            x_dir=(1.0, 0.0, 0.0),
        )
        return beam, ridge


def _fused(shapes: tuple[Shape, ...]) -> Part:
    built = [build_shape(shape) for shape in shapes]
    return one_part(solids_of(built[0].fuse(*built[1:])))


class SnapTongue(BasePartObject):  # type: ignore[misc]
    """A tongue with a ridge, standing on the face z = 0; it bends along x.

    Parameters
    ----------
    spec : SnapSpec, optional
        Sizes of the tongue; the defaults when left out.
    rotation, align, mode
        As for every build123d part.

    Raises
    ------
    FitError
        If it would break, or not hold.
    """

    def __init__(
        self,
        spec: SnapSpec | None = None,
        rotation: RotationLike = (0, 0, 0),
        align: Align | tuple[Align, Align, Align] | None = None,
        mode: Mode = Mode.ADD,
    ) -> None:
        self.spec = spec or SnapSpec()
        self.spec.check()
        super().__init__(
            part=_fused(self.spec.tongue(0.0, 0.5)), rotation=rotation, align=align, mode=mode
        )
        self.label = "snap tongue"
        RigidJoint("snap", self)


class SnapDimple(BasePartObject):  # type: ignore[misc]
    """The cutter of the mortise and dimple for a :class:`SnapTongue`, in the closed pose.

    Parameters
    ----------
    spec : SnapSpec, optional
        Sizes of the tongue that goes in; the defaults when left out.
    rotation, align, mode
        As for every build123d part; subtracted from the part under construction by default.

    Raises
    ------
    FitError
        If the tongue would break, or not hold.
    """

    def __init__(
        self,
        spec: SnapSpec | None = None,
        rotation: RotationLike = (0, 0, 0),
        align: Align | tuple[Align, Align, Align] | None = None,
        mode: Mode = Mode.SUBTRACT,
    ) -> None:
        self.spec = spec or SnapSpec()
        self.spec.check()
        part = _fused(self.spec.tongue(self.spec.clearance, 0.0))
        super().__init__(part=part, rotation=rotation, align=align, mode=mode)
        self.label = "snap dimple"
        RigidJoint("snap", self)
