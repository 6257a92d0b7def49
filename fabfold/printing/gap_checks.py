"""Check of the gaps between bodies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from fabfold.joinery.bodies import BodyMesh
from fabfold.printing.checks import Check
from fabfold.printing.profiles import Profile

if TYPE_CHECKING:
    import manifold3d

__all__ = ["check_gaps", "smallest_gap"]

#: Facets of the round surfaces and single precision take this much off a gap at most, mm.
_GAP_TOLERANCE_MM = 0.002
#: Bodies may overlap by this much before it is more than rounding, mm³.
_OVERLAP_MM3 = 1e-3


def smallest_gap(
    first: manifold3d.Manifold, second: manifold3d.Manifold, reach_mm: float
) -> tuple[float, float]:
    """Gap and overlap of two solids.

    Parameters
    ----------
    first : manifold3d.Manifold
        The one solid, mm.
    second : manifold3d.Manifold
        The other solid, mm.
    reach_mm : float
        Gaps are looked for up to this width, mm.

    Returns
    -------
    gap : float
        Smallest distance of the two surfaces in mm, at most `reach_mm`; 0 if they overlap.
    overlap : float
        Common volume in mm³.
    """
    overlap = float((first ^ second).volume())
    gap = 0.0 if overlap > _OVERLAP_MM3 else float(first.min_gap(second, reach_mm))
    return gap, overlap


def check_gaps(
    bodies: Sequence[BodyMesh],
    solids: Sequence[manifold3d.Manifold],
    profile: Profile,
    reach_mm: float,
    hinged: Mapping[tuple[int, int], str] | None = None,
) -> list[Check]:
    """Check the gaps between all neighbouring bodies in shape A.

    Parameters
    ----------
    bodies : sequence of BodyMesh
        The printed bodies.
    solids : sequence of manifold3d.Manifold
        The bodies as solids, in the same order, mm.
    profile : Profile
        Limits of the printer and material.
    reach_mm : float
        Gaps are looked for up to this width, mm.
    hinged : mapping of (int, int) to str, optional
        Name of the hinge between two bodies, by their indices.

    Returns
    -------
    list of Check
        The smallest gap, and the common volume of bodies.
    """
    reach, hinged = reach_mm, hinged or {}
    names = [body.name for body in bodies]
    lows = [body.vertices.min(axis=0) for body in bodies]
    highs = [body.vertices.max(axis=0) for body in bodies]
    best, where, pairs, overlap, fused = reach, "", 0, 0.0, []
    for i in range(len(solids)):
        for j in range(i + 1, len(solids)):
            if (lows[i] > highs[j] + reach).any() or (lows[j] > highs[i] + reach).any():
                continue
            pairs += 1
            gap, common = smallest_gap(solids[i], solids[j], reach)
            if common > _OVERLAP_MM3:
                overlap += common
                fused.append(f"{names[i]} and {names[j]}")
            if gap < best:
                best = gap
                where = f"{names[i]} and {names[j]}"
                if (i, j) in hinged:
                    where += f", at {hinged[i, j]}"
    if pairs == 0 or not where:
        note = f"no two bodies are nearer than {reach:g} mm"
    else:
        note = f"between {where}; {pairs} pairs of neighbours measured in shape A"
    if best < profile.min_gap_mm - _GAP_TOLERANCE_MM:
        note += f"; {profile.process} may fuse it: kits want a --clearance-mm above {best:.2f}"
    return [
        Check(
            "smallest gap between bodies",
            best,
            profile.min_gap_mm,
            "mm",
            best >= profile.min_gap_mm - _GAP_TOLERANCE_MM,
            note,
        ),
        Check(
            "bodies overlap",
            overlap,
            _OVERLAP_MM3,
            "mm³",
            overlap <= _OVERLAP_MM3,
            ", ".join(fused[:5]) or "no body reaches into another",
        ),
    ]
