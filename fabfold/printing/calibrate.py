"""A maker's own profile from what a printed tolerance coupon says."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import tomlkit

from fabfold.errors import RecipeError
from fabfold.files import write_text
from fabfold.printing.profile_coupon import coupon_clearances
from fabfold.printing.profiles import ApartFit, Profile

__all__ = ["calibrate", "write_profile"]


def calibrate(
    profile: Profile,
    turns_freely_mm: float,
    *,
    fuses_mm: float | None = None,
    pin_grip_mm: float | None = None,
    pin_slip_mm: float | None = None,
    name: str = "",
    clearances: Sequence[float] | None = None,
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
    pin_grip_mm, pin_slip_mm : float, optional
        Numbers of the smallest bore that the pin goes into by hand and stays in, and of the
        smallest in which it turns by itself, mm: how much wider than the pin they are, in diameter.
        The profile's own bores are kept where they are left out.
    name : str, optional
        Name of the new profile; ``my-`` and the name of the shipped one by default.
    clearances : sequence of float, optional
        What the coupon was made with, mm; the default coupon's if left out.

    Returns
    -------
    Profile
        The new profile; its first source says what was read off the coupon.

    Raises
    ------
    RecipeError
        If the figures contradict each other or are none of the coupon's, or the name is none.
    """
    values = coupon_clearances(None) if clearances is None else clearances
    for option, figure, what in (
        ("--turns-freely", turns_freely_mm, "hinge"),
        ("--fuses", fuses_mm, "hinge"),
        ("--pin-grip", pin_grip_mm, "bore"),
        ("--pin-slip", pin_slip_mm, "bore"),
    ):
        if figure is not None and not any(abs(figure - value) < 1e-6 for value in values):
            listed = ", ".join(f"{value:g}" for value in values)
            raise RecipeError(
                f"{option} {figure:g}: give the number beside the {what}; this coupon has {listed} "
                "(--clearances or --around tells of another)"
            )
    if name and not re.fullmatch(r"[\w.-]+", name):
        raise RecipeError(f"{name!r} is no name for a profile: use letters, digits, - and _")
    if fuses_mm is not None and not 0.0 <= fuses_mm < turns_freely_mm:
        raise RecipeError(
            f"--fuses {fuses_mm:g}: must be below --turns-freely {turns_freely_mm:g}, a hinge "
            "cannot be fused and turn freely"
        )
    gap = profile.min_gap_mm / profile.clearance_mm * turns_freely_mm
    if fuses_mm is not None:
        gap = (fuses_mm + turns_freely_mm) / 2.0
    grip, slip = _bores(profile.apart, pin_grip_mm, pin_slip_mm)
    smallest = min(profile.apart.min_gap_mm, turns_freely_mm / 2.0, slip / 2.0)
    apart = profile.apart.model_copy(
        update={
            "clearance_mm": round(turns_freely_mm, 4),
            "min_gap_mm": round(smallest, 4),
            "grip_mm": grip,
            "slip_mm": slip,
        }
    )
    read = f"clearance: read off a tolerance coupon, {turns_freely_mm:g} mm turns freely"
    if fuses_mm is not None:
        read += f", {fuses_mm:g} mm fuses"
    sources = [read]
    if pin_grip_mm is not None or pin_slip_mm is not None:
        told = [
            f"{words} in a bore {number:g} mm wider"
            for number, words in ((pin_grip_mm, "stays"), (pin_slip_mm, "turns"))
            if number is not None
        ]
        sources.append(f"apart: read off a tolerance coupon, the pin {' and '.join(told)}")
    return profile.model_copy(
        update={
            "name": name or f"my-{Path(profile.name).name}",
            "description": f"{profile.description} (calibrated by a coupon)".strip(),
            "clearance_mm": round(turns_freely_mm, 4),
            "min_gap_mm": round(gap, 4),
            "sources": (*sources, *profile.sources),
            "apart": apart,
        }
    )


def _bores(
    apart: ApartFit, grip_number: float | None, slip_number: float | None
) -> tuple[float, float]:
    """How much wider than the pin both kinds of bores are, in radius, mm."""
    grip = apart.grip_mm if grip_number is None else round(grip_number / 2.0, 4)
    slip = apart.slip_mm if slip_number is None else round(slip_number / 2.0, 4)
    if grip >= slip:
        kept = "" if None not in (grip_number, slip_number) else "; the other is the profile's own"
        raise RecipeError(
            f"--pin-grip {2.0 * grip:g} must be below --pin-slip {2.0 * slip:g}: a pin cannot turn "
            f"by itself in a bore that grips it{kept}"
        )
    return grip, slip


def write_profile(path: Path, profile: Profile) -> None:
    """Write a profile as TOML that :func:`~fabfold.printing.profiles.load_profile` reads.

    Parameters
    ----------
    path : Path
        File to write, ending in ``.toml``.
    profile : Profile
        The profile; fields that are None are left out.

    Raises
    ------
    RecipeError
        If there is a file of that name, or it does not end in ``.toml``.
    """
    if path.suffix != ".toml":
        raise RecipeError(f"{path}: a profile's file ends in .toml")
    if path.exists():
        raise RecipeError(f"{path} is there already: remove it, or give another with --output")
    document = tomlkit.document()
    for key, value in profile.model_dump(exclude_none=True).items():
        item = tomlkit.item(list(value) if isinstance(value, tuple) else value)
        if isinstance(item, tomlkit.items.Array) and key == "sources":
            item.multiline(True)
        document.add(key, item)
    write_text(path, tomlkit.dumps(document))
