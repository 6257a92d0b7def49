"""Check of wall thickness, in the hinges and all over the bodies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fabfold.joinery.bodies import BodyMesh, Joinery
from fabfold.joinery.pin_kinds import HEAD_ROOM_MM
from fabfold.printing.checks import Check
from fabfold.printing.profiles import Profile
from fabfold.printing.thickness import ray_thickness, surface_area

if TYPE_CHECKING:
    import manifold3d

__all__ = ["check_walls", "thin_share"]

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
    return [_hinge_wall(joinery, profile), thin_share(joinery.bodies, solids, profile)]


def _hinge_wall(joinery: Joinery, profile: Profile) -> Check:
    if joinery.face_gap_mm is not None:  # a round bore for a loose pin
        bore = joinery.pin_radius_mm + profile.apart.slip_mm
        head = max((pin.head_mm for pin in joinery.pins), default=0.0)
        ring = joinery.barrel_radius_mm - max(bore, head + HEAD_ROOM_MM if head else 0.0)
        around = "the head of a screw as" if head else "the bore of"
    else:
        # At 45 degrees the mouth of a recess is 0.414 clearances wider than the foot of its cone.
        cone = joinery.pin_radius_mm + (np.sqrt(2.0) - 1.0) * joinery.clearance_mm
        ring, around = joinery.barrel_radius_mm - cone, "a recess for"
    limit = profile.min_wall_mm
    return Check(
        "thinnest wall in a hinge",
        float(ring),
        limit,
        "mm",
        bool(ring >= limit - 1e-9),
        f"barrel of {joinery.barrel_radius_mm:g} mm radius around {around} a pin of "
        f"{joinery.pin_radius_mm:g} mm radius; the same in every hinge",
    )


def thin_share(
    bodies: Sequence[BodyMesh], solids: Sequence[manifold3d.Manifold], profile: Profile
) -> Check:
    """Check how much of the surface has less than the printer's wall behind it.

    Parameters
    ----------
    bodies : sequence of BodyMesh
        The printed bodies.
    solids : sequence of manifold3d.Manifold
        The bodies as solids, in the same order, mm.
    profile : Profile
        Limits of the printer and material.

    Returns
    -------
    Check
        The share, over all bodies.
    """
    areas = np.array([surface_area(body) for body in bodies])
    counts = np.maximum(30, np.rint(_THICKNESS_POINTS * areas / areas.sum())).astype(int)
    limit = profile.min_wall_mm
    thin = np.array(
        [
            ray_thickness(solid, body.vertices, body.faces, int(count), 4.0 * limit).share_below(
                limit
            )
            for solid, body, count in zip(solids, bodies, counts, strict=True)
        ]
    )
    share = float((thin * areas).sum() / areas.sum())
    worst = int(np.argmax(thin))
    return Check(
        "surface thinner than the printer's wall",
        100.0 * share,
        100.0 * _THIN_SHARE_LIMIT,
        "%",
        share <= _THIN_SHARE_LIMIT,
        f"share of the surface with less than {limit:g} mm of material behind it; the most on "
        f"{bodies[worst].name} ({100 * thin[worst]:.0f} %). Knife edges where a plane "
        "cuts the model count too; they print rounded",
    )
