"""Check of the ways out for powder and resin."""

from __future__ import annotations

from collections.abc import Sequence

from fabfold.joinery.bodies import BodyMesh
from fabfold.printing.chambers import find_chambers
from fabfold.printing.checks import Check
from fabfold.printing.profiles import Profile

__all__ = ["check_escape"]

#: So many chambers are named.
_NAMED = 3


def check_escape(
    bodies: Sequence[BodyMesh], profile: Profile, placed: Sequence[BodyMesh] | None = None
) -> list[Check]:
    """Check that what the process leaves in hollows can come out again.

    Parameters
    ----------
    bodies : sequence of BodyMesh
        The parts; a chamber inside one of them is a fault.
    profile : Profile
        Names the least way out; None where the process leaves nothing in hollows.
    placed : sequence of BodyMesh, optional
        The parts as they are printed together. Chambers between them open when the parts move, so
        they are told and no fault.

    Returns
    -------
    list of Check
        One, or none for a process that leaves nothing.
    """
    least = profile.escape_mm
    if least is None:
        return []
    found = [(body.name, find_chambers([body], least)) for body in bodies]
    inside = [(name, chamber) for name, chambers in found for chamber in chambers]
    told = [
        f"{chamber.volume_mm3:.0f} mm³ in {name} around "
        + ", ".join(f"{value:.0f}" for value in chamber.middle_mm)
        for name, chamber in sorted(inside, key=lambda item: -item[1].volume_mm3)[:_NAMED]
    ]
    note = f"every hollow of a part has a way out of {least:g} mm or more"
    if inside:
        note = (
            f"{'; '.join(told)} mm: what {profile.process} leaves there comes out only by ways "
            f"narrower than {least:g} mm; widen one, or open a second"
        )
    if placed is not None and len(placed) > 1:
        between = sum(chamber.volume_mm3 for chamber in find_chambers(placed, least))
        between -= sum(chamber.volume_mm3 for _, chamber in inside)
        if between > 1.0:
            note += f". {between:.0f} mm³ between parts come out when the parts move"
    return [
        Check("chambers with no way out", float(len(inside)), 0.0, "chambers", not inside, note)
    ]
