"""Checks of a kit that is printed body by body: the pins, and how the bodies lie."""

from __future__ import annotations

from fabfold.apart.apart_kit import ApartKit
from fabfold.joinery.bodies import Joinery
from fabfold.printing.checks import Check

__all__ = ["check_apart"]


def check_apart(joinery: Joinery, kit: ApartKit) -> list[Check]:
    """Tell how the kit went together with its real pins, and how its bodies lie on their plates.

    Parameters
    ----------
    joinery : Joinery
        The bodies as they are printed, with their pins.
    kit : ApartKit
        Order, plates, and what was seen when the order was played through. Pockets for magnets,
        which are cut later, only take away.

    Returns
    -------
    list of Check
        Pins that can be pushed in, and two figures for information.
    """
    seen = kit.replay
    names = [body.name for body in joinery.bodies]
    propped = [names[body] for body in kit.plates.supported]
    leaning = [names[body] for body in kit.plates.leaning]
    bed = " × ".join(f"{size:g}" for size in kit.plates.bed_mm)
    return [
        Check(
            "pins that can be pushed in",
            float(seen.done),
            float(seen.pins),
            f"of {seen.pins} pins",
            seen.done == seen.pins,
            "; ".join(seen.faults[:3])
            or f"put together in {len(kit.steps)} steps with the real pins, {seen.looks} positions "
            "looked at (FCL), nothing in the way",
        ),
        Check(
            "plates",
            float(kit.plates.count),
            None,
            "plates",
            True,
            f"{len(names)} bodies, each by itself, on a bed of {bed} mm",
        ),
        Check(
            "bodies that want support",
            float(len(propped)),
            None,
            f"of {len(names)} bodies",
            True,
            (
                f"{', '.join(propped)}: a hinge stands below the flat face; "
                "support from the plate only, and block it in the bores"
                if propped
                else "every body lies on a flat face"
            )
            + (f"; a brim holds {', '.join(leaning)}, which would topple" if leaning else ""),
        ),
    ]
