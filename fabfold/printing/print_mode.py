"""How a kit is printed: in place as one object, or body by body with pins that are pushed in."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from fabfold.errors import RecipeError
from fabfold.joinery.pin_kinds import PINS, PinFit
from fabfold.printing.profiles import Profile

if TYPE_CHECKING:
    from fabfold.lattice.template import Template
    from hinges.hardware import LoosePin

__all__ = ["Hold", "PrintMode", "print_mode"]


#: Processes that can pause for a magnet: no powder or resin stands where it goes.
_PAUSING: Final = ("FDM", "PolyJet")


@dataclass(frozen=True)
class Hold:
    """What is to hold a kit shut.

    Attributes
    ----------
    magnet : str
        Name of the magnets, of :data:`fabfold.joinery.magnets.MAGNETS`; empty for none.
    friction : bool
        Whether hinges that nothing else holds get pins that both bodies grip.
    in_a : bool
        Whether magnets hold the model too, before it is folded.
    enclosed : bool
        Whether magnets are laid in while the print pauses, and closed in.
    """

    magnet: str = ""
    friction: bool = False
    in_a: bool = False
    enclosed: bool = False

    def check(self, profile: Profile, *, apart: bool) -> None:
        """Refuse what a way of printing cannot hold.

        Parameters
        ----------
        profile : Profile
            Printer and material.
        apart : bool
            Whether the bodies are printed one by one.

        Raises
        ------
        RecipeError
            With what to do instead.
        """
        if self.friction and not apart:
            raise RecipeError(
                "--retention friction: it takes pins that both bodies grip, and a kit that is "
                "printed in place has printed cones, which have to stay free of each other; take "
                "--retention magnet, or --print apart"
            )
        if not self.magnet and (self.in_a or self.enclosed):
            option = "--retention-in-a" if self.in_a else "--magnet-fit enclosed"
            raise RecipeError(f"{option} is about magnets: add --retention magnet")
        if self.enclosed and profile.process not in _PAUSING:
            raise RecipeError(
                f"--magnet-fit enclosed: a {profile.process} print cannot pause with an empty "
                "pocket; take --magnet-fit glued, or a filament profile such as fdm-pla-0.4"
            )


@dataclass(frozen=True)
class PrintMode:
    """How a kit is printed, and the gaps that this wants.

    Attributes
    ----------
    apart : bool
        Whether the bodies are printed one by one.
    why : str
        Who chose it.
    profile : Profile
        Printer and material, with the clearance and the smallest gap of this way.
    pin : str
        Name of the loose pin, of :data:`fabfold.joinery.pin_kinds.PINS`.
    hold : Hold
        What holds the kit shut.
    blocks : bool
        Whether bodies are blocks of cells, without the model's surface.
    fill : bool
        Whether plates close open faces of the box from inside.
    pose : str
        Pose in which it is printed in place, as of :func:`fabfold.printing.print_pose.print_pose`.
    """

    apart: bool
    why: str
    profile: Profile
    pin: str
    hold: Hold = Hold()
    blocks: bool = False
    fill: bool = False
    pose: str = "a"

    @property
    def name(self) -> str:
        """``"apart"`` or ``"in-place"``."""
        return "apart" if self.apart else "in-place"

    @property
    def face_gap_mm(self) -> float | None:
        """Gap between the faces of two bodies in mm; None where it is the clearance."""
        return self.profile.apart.face_gap_mm if self.apart else None

    def loose_pin(self) -> LoosePin | None:
        """The pin that is pushed in after printing; None where pins are printed."""
        if not self.apart:
            return None
        from hinges.hardware import LoosePin

        fit = self.pin_fit
        return LoosePin(
            PINS[self.pin].diameter_mm,
            fit.grip_mm,
            fit.slip_mm,
            entry="none",
            pocket=fit.pocket_mm,
        )

    @property
    def pin_fit(self) -> PinFit:
        """How loose pins sit in their bores."""
        apart = self.profile.apart
        return PINS[self.pin].fit(apart.grip_mm, apart.slip_mm)

    def require_template(self, template: Template) -> None:
        """Refuse a template whose faces cannot be treated as asked for.

        Parameters
        ----------
        template : Template
            The target shape.

        Raises
        ------
        RecipeError
            If open faces are to be closed, and the template shows others once it is folded again.
        """
        if self.fill and template.creases:
            raise RecipeError(
                f"--fill: template {template.name!r} folds once more, and shows other faces then; "
                "leave --fill out, or take a box"
            )

    def require_hinge(self, voxel_mm: float) -> None:
        """Refuse a size of voxels that holds no hinge.

        Parameters
        ----------
        voxel_mm : float
            Printed side of a voxel, mm.

        Raises
        ------
        RecipeError
            With the smallest voxel that would do; or if no screw is sold in the length that it
            wants.
        """
        from fabfold.joinery.sizes import hinge_size

        clearance, pin = self.profile.clearance_mm, self.loose_pin()
        size = hinge_size(voxel_mm, clearance, gap_mm=self.face_gap_mm, pin=pin)
        if pin is not None and self.pin_fit.threaded:
            barrel = voxel_mm - 2 * size.reach_mm
            knuckle = (barrel - (size.knuckles - 1) * clearance) / size.knuckles
            self.pin_fit.screw_length(barrel, knuckle, pin.diameter)


def print_mode(
    profile: Profile,
    asked: str = "auto",
    pin: str = "1.75",
    clearance_mm: float | None = None,
    hold: Hold | None = None,
    *,
    blocks: bool = False,
    fill: bool = False,
    pose: str = "a",
) -> PrintMode:
    """Choose how a kit is printed.

    Parameters
    ----------
    profile : Profile
        Printer and material.
    asked : {"auto", "in-place", "apart"}
        What the recipe asks for; auto leaves it to the profile.
    pin : str
        Name of the loose pin, of :data:`fabfold.joinery.pin_kinds.PINS`.
    clearance_mm : float, optional
        Clearance in the hinges, mm, in place of the profile's.
    hold : Hold, optional
        What is to hold the kit shut; nothing by default.
    blocks : bool
        Whether bodies are blocks of cells, without the model's surface.
    fill : bool
        Whether plates close open faces of the box from inside.
    pose : str
        Pose in which it is printed in place.

    Returns
    -------
    PrintMode
        With the gaps of this way.

    Raises
    ------
    RecipeError
        If a clearance is not above the smallest gap that the profile asks for, or this way of
        printing cannot hold the kit as asked.
    """
    apart = asked == "apart" or (asked == "auto" and not profile.in_place)
    if asked != "auto":
        why = f"asked for with --print {asked}"
    elif apart:
        why = f"{profile.name} does not hold open the gaps of a kit that is printed closed"
    else:
        why = f"{profile.name} holds open the gaps of a kit that is printed closed"
    gaps = profile.apart if apart else profile
    clearance = gaps.clearance_mm if clearance_mm is None else clearance_mm
    if clearance <= gaps.min_gap_mm:
        raise RecipeError(
            f"--clearance-mm {clearance:g}: {profile.name} asks for gaps of {gaps.min_gap_mm:g} mm "
            f"at least; give more than that (its own clearance is {gaps.clearance_mm:g} mm)"
        )
    gapped = profile.model_copy(update={"clearance_mm": clearance, "min_gap_mm": gaps.min_gap_mm})
    hold = hold or Hold()
    hold.check(profile, apart=apart)
    if hold.friction and PINS[pin].screw:
        raise RecipeError(
            f"--retention friction: a screw rubs as hard as it is driven in, so --pin {pin} needs "
            "no friction pins; take --retention magnet, or a plain pin such as --pin 1.75"
        )
    if fill and blocks:
        raise RecipeError(
            "--fill: blocks of cells have no open faces; leave --fill or --skin lattice out"
        )
    if hold.enclosed and not apart and pose != "a":
        raise RecipeError(
            f"--pose {pose}: magnets are enclosed at heights that are known for the model's pose; "
            "leave --pose out, or take --magnet-fit glued"
        )
    return PrintMode(apart, why, gapped, pin, hold, blocks, fill, pose)
