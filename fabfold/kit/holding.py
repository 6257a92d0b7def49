"""How a kit is held shut, as its recipe asks: what is cut, lined and told."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.fold.motion import Motion
from fabfold.joinery.bodies import Joinery
from fabfold.joinery.box_hold import Retention, hinges_that_move, hold_by_magnets
from fabfold.joinery.friction_pins import pin_friction, with_friction
from fabfold.joinery.loose_pins import pin_bores
from fabfold.joinery.magnets import MAGNETS, Pocket
from fabfold.printing.print_mode import Hold, PrintMode
from fabfold.printing.profiles import load_profile
from fabfold.progress import Progress
from fabfold.recipe.recipe import Recipe
from fabfold.tree.fold_tree import FoldTree

if TYPE_CHECKING:
    from fabfold.apart.apart_kit import ApartKit

__all__ = ["hold_kit", "mode_of"]

#: Material between an enclosed magnet and the face, mm: a line of a 0.4 nozzle, or two layers.
_SKIN_MM = 0.4


def mode_of(recipe: Recipe) -> PrintMode:
    """How a recipe's kit is printed and held.

    Parameters
    ----------
    recipe : Recipe
        Every choice that the kit depends on.

    Raises
    ------
    RecipeError
        If the profile is unknown, or this way of printing cannot do what is asked for.
    """
    from fabfold.printing.print_mode import print_mode

    asked = recipe.retention.split("+")
    hold = Hold(
        magnet=recipe.magnet if "magnet" in asked else "",
        friction="friction" in asked,
        in_a=recipe.retention_in_a,
        enclosed=recipe.magnet_fit == "enclosed",
    )
    profile = load_profile(recipe.profile)
    return print_mode(
        profile,
        recipe.print,
        recipe.pin,
        recipe.clearance_mm,
        hold,
        blocks=recipe.skin == "lattice",
        fill=recipe.fill,
        pose=recipe.pose,
    )


def hold_kit(
    tree: FoldTree,
    motion: Motion,
    joinery: Joinery,
    apart: ApartKit | None,
    mode: PrintMode,
    progress: Progress,
) -> tuple[Joinery, ApartKit | None, Retention | None]:
    """Cut pockets for magnets, and line bores for pins that rub.

    Parameters
    ----------
    tree, motion, joinery
        The bodies, with their pins, and the folding path.
    apart : ApartKit or None
        Order and plates of a kit that is printed body by body.
    mode : PrintMode
        How it is printed, and what is to hold it.
    progress : Progress
        Hears what is being done.

    Returns
    -------
    joinery : Joinery
        The bodies as they are printed.
    apart : ApartKit or None
        The same, played through again where bores were lined.
    retention : Retention or None
        None where nothing is to hold the kit.
    """
    hold = mode.hold
    if not (hold.magnet or hold.friction):
        return joinery, apart, None
    if hold.magnet:
        progress.update(None, "places for magnets")
        pocket = Pocket(MAGNETS[hold.magnet], _SKIN_MM if hold.enclosed else 0.0)
        stand = _stand(joinery, apart)
        joinery, retention = hold_by_magnets(tree, motion, joinery, pocket, stand, in_a=hold.in_a)
    else:
        moving = tuple(hinges_that_move(tree, motion, joinery))
        retention = Retention(moving, moving)
    if hold.friction and apart is not None and retention.free_before:
        joinery, apart, retention = _with_friction(tree, motion, joinery, apart, mode, retention)
    return joinery, apart, retention


def _with_friction(
    tree: FoldTree,
    motion: Motion,
    joinery: Joinery,
    apart: ApartKit,
    mode: PrintMode,
    retention: Retention,
) -> tuple[Joinery, ApartKit, Retention]:
    from fabfold.apart.pin_replay import replay_assembly

    # In hinges that magnets hold too: a pair takes hold once its faces lie on each other, and what
    # tilts a box open pulls them apart.
    fit, bores = mode.profile.apart, pin_bores(tree, joinery)
    joinery = with_friction(joinery, bores, retention.free_before, fit.grip_mm, fit.slip_mm)
    # Linings add material: what was played through is played through again.
    apart = replace(apart, replay=replay_assembly(tree, joinery, bores, apart.steps, mode.pin_fit))
    friction = pin_friction(
        tree,
        joinery,
        motion.angles_deg[-1],
        retention.free_before,
        material=mode.profile.material,
        density_g_cm3=mode.profile.density_g_cm3,
        grip_mm=fit.grip_mm,
    )
    return joinery, apart, replace(retention, friction=friction)


def _stand(joinery: Joinery, apart: ApartKit | None) -> NDArray[np.float64]:
    """Where each body is printed (b, 4, 4), from shape A, the plate at z = 0, mm."""
    if apart is not None:
        return apart.plates.poses
    stand = np.tile(np.eye(4), (len(joinery.bodies), 1, 1))
    low = np.min([body.vertices.min(axis=0) for body in joinery.bodies], axis=0)
    stand[:, :3, 3] = -low
    return stand
