"""A maker's own profile from what a printed tolerance coupon says."""

from __future__ import annotations

from pathlib import Path

import tomlkit

from fabfold.errors import RecipeError
from fabfold.files import write_text
from fabfold.printing.profiles import Profile

__all__ = ["calibrate", "write_profile"]


def calibrate(
    profile: Profile, turns_freely_mm: float, *, fuses_mm: float | None = None, name: str = ""
) -> Profile:
    """Profile with the clearance that a coupon of this printer needs.

    Parameters
    ----------
    profile : Profile
        The shipped profile that the coupon was made with.
    turns_freely_mm : float
        Smallest clearance on the coupon whose hinge turns freely, mm: the new clearance.
    fuses_mm : float, optional
        Largest clearance on the coupon whose hinge came out fused, mm. The smallest gap that
        counts as open lies half-way between the two; without it, the profile's own share of the
        clearance is kept.
    name : str, optional
        Name of the new profile; ``my-`` and the name of the shipped one by default.

    Returns
    -------
    Profile
        The new profile; its first source says what was read off the coupon.

    Raises
    ------
    RecipeError
        If the figures contradict each other.
    """
    if not 0.0 < turns_freely_mm <= 5.0:
        raise RecipeError(
            f"--turns-freely {turns_freely_mm:g}: give the number beside the hinge, 0.01 to 5 mm"
        )
    if fuses_mm is not None and not 0.0 <= fuses_mm < turns_freely_mm:
        raise RecipeError(
            f"--fuses {fuses_mm:g}: must be below --turns-freely {turns_freely_mm:g}, a hinge "
            "cannot be fused and turn freely"
        )
    gap = profile.min_gap_mm / profile.clearance_mm * turns_freely_mm
    if fuses_mm is not None:
        gap = (fuses_mm + turns_freely_mm) / 2.0
    apart = profile.apart.model_copy(
        update={
            "clearance_mm": round(turns_freely_mm, 4),
            "min_gap_mm": round(min(profile.apart.min_gap_mm, turns_freely_mm / 2.0), 4),
        }
    )
    read = f"clearance: read off a tolerance coupon, {turns_freely_mm:g} mm turns freely"
    if fuses_mm is not None:
        read += f", {fuses_mm:g} mm fuses"
    return profile.model_copy(
        update={
            "name": name or f"my-{profile.name}",
            "description": f"{profile.description} (calibrated by a coupon)".strip(),
            "clearance_mm": round(turns_freely_mm, 4),
            "min_gap_mm": round(gap, 4),
            "sources": (read, *profile.sources),
            "apart": apart,
        }
    )


def write_profile(path: Path, profile: Profile) -> None:
    """Write a profile as TOML that :func:`~fabfold.printing.profiles.load_profile` reads.

    Parameters
    ----------
    path : Path
        File to write, ending in ``.toml``.
    profile : Profile
        The profile; fields that are None are left out.
    """
    document = tomlkit.document()
    for key, value in profile.model_dump(exclude_none=True).items():
        item = tomlkit.item(list(value) if isinstance(value, tuple) else value)
        if isinstance(item, tomlkit.items.Array) and key == "sources":
            item.multiline(True)
        document.add(key, item)
    write_text(path, tomlkit.dumps(document))
