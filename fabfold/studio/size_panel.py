"""Size and printer in the studio: what a voxel, a clearance and a profile mean for hinges and time.

Everything here follows the controls at once; nothing is built for it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fabfold.errors import FabfoldError
from fabfold.joinery.pin_kinds import PINS
from fabfold.joinery.sizes import MIN_WALL_MM, hinge_size
from fabfold.printing.print_mode import print_mode
from fabfold.printing.profiles import load_profile, profile_names
from fabfold.recipe.recipe import Recipe
from hinges.exceptions import HingeError
from hinges.mesh import single_hinge_play

if TYPE_CHECKING:
    import viser

__all__ = ["HingeOutlook", "SizePanel", "hinge_outlook"]

#: Grams of filament an hour: kits of PLA in PrusaSlicer at its defaults took 9 to 17 hours for 99
#: to 219 g.
_GRAMS_AN_HOUR = 12.0
#: Share of a solid voxel that a printed one holds with default infill.
_PRINTED_SHARE = 0.35


@dataclass(frozen=True)
class HingeOutlook:
    """What a size and a printer mean, before anything is built.

    Attributes
    ----------
    clearance_mm, barrel_mm, pin_mm, wall_mm : float
        Clearance in the hinges, diameters of barrel and pin, and the wall about the pin's recess.
    shift_mm, tilt_deg : float
        Play of one hinge: largest shift across its axis, and tilt.
    grams : float
        Weight of all voxels as they are printed.
    hours : float or None
        Of printing, where a filament printer makes it.
    """

    clearance_mm: float
    barrel_mm: float
    pin_mm: float
    wall_mm: float
    shift_mm: float
    tilt_deg: float
    grams: float
    hours: float | None


def hinge_outlook(
    voxel_mm: float, clearance_mm: float | None, profile: str, pin: str, solid_voxels: float
) -> HingeOutlook:
    """Work out what a size and a printer mean.

    Parameters
    ----------
    voxel_mm : float
        Side of a voxel.
    clearance_mm : float or None
        In the hinges; None takes the profile's.
    profile, pin : str
        As in the recipe.
    solid_voxels : float
        Material of the kit in full voxels.

    Returns
    -------
    HingeOutlook
        Its figures.

    Raises
    ------
    FabfoldError
        If no hinge fits, saying which voxel would do.
    """
    mode = print_mode(load_profile(profile), "auto", pin, clearance_mm)
    clearance, loose = mode.profile.clearance_mm, mode.loose_pin()
    size = hinge_size(voxel_mm, clearance, gap_mm=mode.face_gap_mm, pin=loose)
    play = single_hinge_play(
        voxel_mm, clearance, 180.0, knuckles=size.knuckles, wall_mm=MIN_WALL_MM,
        barrel_radius_mm=size.barrel_radius_mm, pin_radius_mm=size.pin_radius_mm,
        gap_mm=size.gap_mm, pin=loose,
    )  # fmt: skip
    apart = mode.apart
    share = _PRINTED_SHARE if apart else 1.0
    grams = solid_voxels * (voxel_mm / 10.0) ** 3 * mode.profile.density_g_cm3 * share
    return HingeOutlook(
        clearance,
        2 * size.barrel_radius_mm,
        2 * size.pin_radius_mm,
        size.barrel_radius_mm - size.pin_radius_mm,
        play.radial,
        play.tilt,
        grams,
        grams / _GRAMS_AN_HOUR if apart else None,
    )


class SizePanel:
    """Controls of size and printer.

    Parameters
    ----------
    server : viser.ViserServer
        Whose page it is; the controls come into the container that is open.
    change : callable
        Takes a title and fields of the recipe.
    solid_voxels : callable
        Gives the material of the kit in full voxels, and the cells of the box along each side.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        change: Callable[..., None],
        solid_voxels: Callable[[], tuple[float, tuple[int, ...]]],
    ) -> None:
        self._change, self._solid_voxels = change, solid_voxels
        gui: Any = server.gui
        names = tuple(profile_names())
        self._profile = gui.add_dropdown("printer", names, initial_value=names[0])
        self._voxel = gui.add_slider("voxel, mm", 8.0, 60.0, 0.5, 20.0)
        self._own = gui.add_checkbox("own clearance", False)
        self._clearance = gui.add_slider("clearance, mm", 0.1, 1.0, 0.01, 0.3)
        self._pin = gui.add_dropdown("loose pin", tuple(PINS), initial_value="1.75")
        self._told = gui.add_markdown("")
        gui.add_button("Take this size").on_click(lambda _: self._take())
        for control in (self._profile, self._voxel, self._own, self._clearance, self._pin):
            control.on_update(lambda _: self.tell())

    def begin(self, recipe: Recipe) -> None:
        """Show the size of a recipe."""
        if recipe.profile in profile_names():
            self._profile.value = recipe.profile
        self._voxel.value = min(max(recipe.voxel_mm, 8.0), 60.0)
        self._own.value = recipe.clearance_mm is not None
        if recipe.clearance_mm is not None:
            self._clearance.value = recipe.clearance_mm
        self._pin.value = recipe.pin
        self.tell()

    def _fields(self) -> dict[str, Any]:
        return {
            "profile": self._profile.value,
            "voxel_mm": float(self._voxel.value),
            "clearance_mm": float(self._clearance.value) if self._own.value else None,
            "pin": self._pin.value,
        }

    def _take(self) -> None:
        fields = self._fields()
        self._change(f"{fields['voxel_mm']:g} mm voxels, {fields['profile']}", **fields)

    def tell(self) -> None:
        """Say what the controls mean."""
        fields = self._fields()
        voxels, shape = self._solid_voxels()
        try:
            found = hinge_outlook(
                fields["voxel_mm"], fields["clearance_mm"], fields["profile"], fields["pin"], voxels
            )
        except (FabfoldError, HingeError) as error:
            self._told.content = f"**No hinge:** {error}"
            return
        box = " × ".join(f"{side * fields['voxel_mm']:g}" for side in shape)
        time = "" if found.hours is None else f", about {found.hours:.0f} h of printing"
        self._told.content = (
            f"Box {box} mm, about {found.grams:.0f} g{time}.\n\n"
            f"Barrel {found.barrel_mm:.2f}, pin {found.pin_mm:.2f}, wall {found.wall_mm:.2f}, "
            f"clearance {found.clearance_mm:.2f} mm.\n\n"
            f"Play of a hinge: {found.shift_mm:.2f} mm across, {found.tilt_deg:.1f}° of tilt."
        )
