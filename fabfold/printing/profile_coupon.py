"""The tolerance coupon of a printer profile."""

from __future__ import annotations

from pathlib import Path

from fabfold.errors import RecipeError
from fabfold.joinery.pin_kinds import PINS
from fabfold.printing.profiles import DEFAULT_PROFILE, load_profile
from fabfold.toml_files import nearest

__all__ = ["coupon_clearances", "make_coupon"]


def make_coupon(
    path: Path,
    profile: str | None = None,
    clearances: str | None = None,
    around: float | None = None,
    pin: str = "1.75",
) -> list[Path]:
    """Write a coupon whose walls suit a profile, with the page that tells how to read it.

    Parameters
    ----------
    path : Path
        File to write, ending in ``.3mf``, ``.step`` or ``.stl``.
    profile : str, optional
        Name or file of a printer profile; the default profile if left out.
    clearances : str, optional
        Clearances of the coupon's hinges in mm, with commas between.
    around : float, optional
        What a first coupon gave, mm: a second one in finer steps about it.
    pin : str
        Name of the loose pin that its bores are for, of :data:`fabfold.joinery.pin_kinds.PINS`.

    Returns
    -------
    list of Path
        The files that were written.

    Raises
    ------
    RecipeError
        If a value is wrong, or the hinges cannot be made with it.
    """
    from hinges.coupon_files import write_coupon
    from hinges.exceptions import HingeError

    if pin not in PINS:
        raise RecipeError(f"--pin {pin}: {nearest(pin, list(PINS))}")
    if PINS[pin].screw:
        raise RecipeError(
            f"--pin {pin}: a coupon's bores are for plain pins, and a screw cuts its own thread; "
            "leave --pin out"
        )
    known = load_profile(profile or DEFAULT_PROFILE)
    values = coupon_clearances(clearances, around)
    title = f"Hinge coupon, {known.name}"
    try:
        bed = None if known.bed_mm is None else known.bed_mm[:2]
        wall = max(0.8, known.min_wall_mm)
        return write_coupon(
            path, values, wall_mm=wall, pin_mm=PINS[pin].diameter_mm, title=title, bed_mm=bed
        )
    except HingeError as error:
        raise RecipeError(str(error)) from None


def coupon_clearances(text: str | None, around: float | None = None) -> tuple[float, ...]:
    """Clearances of a coupon in mm.

    Parameters
    ----------
    text : str or None
        As given with ``--clearances``; None for the default coupon.
    around : float, optional
        Middle of a second coupon in finer steps, mm.

    Raises
    ------
    RecipeError
        If these are no numbers, or both are given.
    """
    from hinges.coupon_plan import DEFAULT_CLEARANCES, FINE_STEP, fine_clearances

    if around is not None:
        if text is not None:
            raise RecipeError("--around and --clearances both say what to try: give one of them")
        if not 3 * FINE_STEP < around <= 2.0:
            raise RecipeError(f"--around {around:g}: give what the first coupon told, 0.1 to 2 mm")
        return fine_clearances(around)
    if text is None:
        return DEFAULT_CLEARANCES
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise RecipeError(
            f"--clearances wants numbers such as 0.2,0.3,0.4, found {text!r}"
        ) from None
