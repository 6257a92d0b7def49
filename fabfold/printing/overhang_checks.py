"""Check of overhangs: how much of the surface needs support in the print."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fabfold.joinery.bodies import BodyMesh, Joinery
from fabfold.meshes import face_normals
from fabfold.printing.checks import Check
from fabfold.printing.profiles import Profile
from fabfold.printing.thickness import surface_area

__all__ = ["check_overhang"]


def check_overhang(joinery: Joinery, profile: Profile) -> Check:
    """Report the share of the surface that hangs over, in the best of six print directions.

    Parameters
    ----------
    joinery : Joinery
        The printed bodies.
    profile : Profile
        Limits of the printer and material.

    Returns
    -------
    Check
        The share with every body laid its best way; it has no limit.
    """
    if profile.max_overhang_deg is None:
        return Check(
            "overhang",
            0.0,
            None,
            "%",
            True,
            f"{profile.process} needs no support: powder or support material carries every face",
        )
    steepest = profile.max_overhang_deg
    per_body = np.array([_overhang_areas(body, steepest) for body in joinery.bodies])
    areas = np.array([surface_area(body) for body in joinery.bodies])
    whole = per_body.sum(axis=0) / areas.sum()
    laid = float(per_body.min(axis=1).sum() / areas.sum())
    worst = int(np.argmax(per_body.min(axis=1) / areas))
    up = ("+x", "-x", "+y", "-y", "+z", "-z")
    best = int(np.argmin(whole))
    return Check(
        "overhang",
        100.0 * laid,
        None,
        "%",
        True,
        f"share of the surface steeper than {steepest:g}° with every body laid its best way down; "
        f"the most on {joinery.bodies[worst].name}. All in one pose: {100 * whole[best]:.0f} % "
        f"with {up[best]} up. Supports may not stand in hinges",
    )


def _overhang_areas(body: BodyMesh, steepest_deg: float) -> NDArray[np.float64]:
    """Area of the faces that hang over, by print direction +x, -x, +y, -y, +z, -z, mm²."""
    corners = body.vertices[body.faces]
    unit, area = face_normals(corners)
    hang = np.sin(np.radians(steepest_deg))
    found = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            down = -sign * unit[:, axis]
            # Faces that lie on the plate are carried by it.
            height = sign * corners[:, :, axis]
            lying = (height < height.min() + 0.05).all(axis=1)
            found.append(float(area[(down > hang + 1e-9) & ~lying].sum()))
    return np.array(found)
