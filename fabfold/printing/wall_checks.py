"""Check of wall thickness, in the hinges and all over the bodies."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fabfold.joinery.bodies import Joinery
from fabfold.printing.checks import Check
from fabfold.printing.profiles import Profile
from fabfold.printing.thickness import ray_thickness, surface_area

if TYPE_CHECKING:
    import manifold3d

__all__ = ["check_walls"]

#: Share of the surface that may be thinner than the profile's wall. Organic models that are cut by
#: planes end in knife edges, which print rounded and do no harm; whole blades do.
_THIN_SHARE_LIMIT = 0.10
#: Points at which thickness is measured, over all bodies.
_THICKNESS_POINTS = 12_000


def check_walls(
    joinery: Joinery, solids: list[manifold3d.Manifold], profile: Profile
) -> list[Check]:
    """Check the walls of the hinges and the thickness of the bodies.

    Parameters
    ----------
    joinery : Joinery
        The printed bodies.
    solids : list of manifold3d.Manifold
        The bodies as solids, in the same order, mm.
    profile : Profile
        Limits of the printer and material.

    Returns
    -------
    list of Check
        The thinnest wall in a hinge, and the share of the surface that is too thin.
    """
    # At 45 degrees the mouth of a recess is 0.414 clearances wider than the foot of its cone.
    ring = (
        joinery.barrel_radius_mm
        - joinery.pin_radius_mm
        - (np.sqrt(2.0) - 1.0) * joinery.clearance_mm
    )
    areas = np.array([surface_area(body) for body in joinery.bodies])
    counts = np.maximum(30, np.rint(_THICKNESS_POINTS * areas / areas.sum())).astype(int)
    limit = profile.min_wall_mm
    thin = np.array(
        [
            ray_thickness(solid, body.vertices, body.faces, int(count), 4.0 * limit).share_below(
                limit
            )
            for solid, body, count in zip(solids, joinery.bodies, counts, strict=True)
        ]
    )
    share = float((thin * areas).sum() / areas.sum())
    worst = int(np.argmax(thin))
    return [
        Check(
            "thinnest wall in a hinge",
            float(ring),
            limit,
            "mm",
            bool(ring >= limit - 1e-9),
            f"barrel of {joinery.barrel_radius_mm:g} mm radius around a recess for a pin of "
            f"{joinery.pin_radius_mm:g} mm radius; the same in every hinge",
        ),
        Check(
            "surface thinner than the printer's wall",
            100.0 * share,
            100.0 * _THIN_SHARE_LIMIT,
            "%",
            share <= _THIN_SHARE_LIMIT,
            f"share of the surface with less than {limit:g} mm of material behind it; the most on "
            f"{joinery.bodies[worst].name} ({100 * thin[worst]:.0f} %). Knife edges where a plane "
            "cuts the model count too; they print rounded",
        ),
    ]
