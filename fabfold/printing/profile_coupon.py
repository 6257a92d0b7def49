"""The tolerance coupon of a printer profile."""

from __future__ import annotations

from pathlib import Path

from fabfold.errors import RecipeError
from fabfold.printing.profiles import DEFAULT_PROFILE, load_profile

__all__ = ["make_coupon"]


def make_coupon(
    path: Path, profile: str | None = None, clearances: str | None = None
) -> list[Path]:
    """Write a coupon whose walls suit a profile, with the page that tells how to read it.

    Parameters
    ----------
    path : Path
        Ends in ``.3mf``, ``.step`` or ``.stl``.
    profile : str, optional
        Name or file of a printer profile.
    clearances : str, optional
        Numbers with commas between, in mm.

    Raises
    ------
    RecipeError
        If a value is wrong, or the hinges cannot be made with it.
    """
    from hinges.exceptions import HingeError
    from hinges.tolerance_coupon import DEFAULT_CLEARANCES, write_coupon

    known = load_profile(profile or DEFAULT_PROFILE)
    values = DEFAULT_CLEARANCES
    if clearances is not None:
        try:
            values = tuple(float(part) for part in clearances.split(","))
        except ValueError:
            raise RecipeError(
                f"--clearances wants numbers such as 0.2,0.3,0.4, found {clearances!r}"
            ) from None
    title = f"Hinge coupon, {known.name}"
    try:
        return write_coupon(path, values, wall_mm=max(0.8, known.min_wall_mm), title=title)
    except HingeError as error:
        raise RecipeError(str(error)) from None
