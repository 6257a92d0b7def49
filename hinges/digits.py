"""Raised numbers of seven bars, so that no font is needed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .exceptions import HingeError
from .shapes import Prism, Shape

__all__ = ["raised_number"]

_BARS = {
    "top": (0.0, 1.0, 1.0, 1.0),
    "middle": (0.0, 1.0, 0.5, 0.5),
    "bottom": (0.0, 1.0, 0.0, 0.0),
    "upper left": (0.0, 0.0, 0.5, 1.0),
    "upper right": (1.0, 1.0, 0.5, 1.0),
    "lower left": (0.0, 0.0, 0.0, 0.5),
    "lower right": (1.0, 1.0, 0.0, 0.5),
}
_DIGITS = {
    digit: names.split(", ")
    for digit, names in {
        "0": "top, bottom, upper left, upper right, lower left, lower right",
        "1": "upper right, lower right",
        "2": "top, middle, bottom, upper right, lower left",
        "3": "top, middle, bottom, upper right, lower right",
        "4": "middle, upper left, upper right, lower right",
        "5": "top, middle, bottom, upper left, lower right",
        "6": "top, middle, bottom, upper left, lower left, lower right",
        "7": "top, upper right, lower right",
        "8": "top, middle, bottom, upper left, upper right, lower left, lower right",
        "9": "top, middle, bottom, upper left, upper right, lower right",
    }.items()
}


def _united(bars: list[tuple[float, float, float, float]], start: float, end: float) -> Prism:
    """Unite bars (west, east, south, north) that hang together into one prism with its holes."""
    from manifold3d import CrossSection, FillRule

    rims = [[(w, s), (e, s), (e, n), (w, n)] for w, e, s, n in bars]
    outlines = CrossSection(rims, FillRule.NonZero).to_polygons()

    def area(rim: NDArray[np.float64]) -> float:
        ahead = np.roll(rim, -1, axis=0)
        return float(np.sum(rim[:, 0] * ahead[:, 1] - rim[:, 1] * ahead[:, 0]))

    points = [tuple((float(x), float(y)) for x, y in rim) for rim in outlines]
    outer = [rim for rim, line in zip(points, outlines, strict=True) if area(line) > 0.0]
    holes = tuple(rim for rim, line in zip(points, outlines, strict=True) if area(line) < 0.0)
    return Prism(outer[0], start, end, holes)


def raised_number(
    text: str,
    x: float,
    y: float,
    z: float,
    *,
    high: float = 4.6,
    stroke: float = 0.8,
    raised: float = 0.6,
) -> list[Shape]:
    """Draw a number, centred on (x, y) and standing on the plane z.

    Parameters
    ----------
    text : str
        The number: digits and points.
    x, y : float
        Middle of the number in mm.
    z : float
        Height in mm of the plane that it stands on.
    high : float
        Height of a digit in mm.
    stroke : float
        Width of a bar in mm.
    raised : float
        Height above the plane in mm; the bars reach 0.2 mm into it.

    Returns
    -------
    list of Shape
        One prism a character, in mm.

    Raises
    ------
    HingeError
        If a character is neither a digit nor a point.
    """
    wide, space, point = 0.45 * high, 2.0 * stroke, stroke
    widths = [point if letter == "." else wide for letter in text]
    left = x - 0.5 * (sum(widths) + space * (len(text) - 1))
    low = y - 0.5 * (high - stroke)
    half = 0.5 * stroke
    made: list[Shape] = []
    for letter, width in zip(text, widths, strict=True):
        if letter != "." and letter not in _DIGITS:
            raise HingeError(f"cannot raise {letter!r}: a number has digits and points only")
        bars = [(0.5, 0.5, 0.0, 0.0)] if letter == "." else [_BARS[n] for n in _DIGITS[letter]]
        reach = 0.0 if letter == "." else width
        corners = [
            (
                left + (half if letter == "." else x0 * reach) - half,
                left + (half if letter == "." else x1 * reach) + half,
                low + y0 * (high - stroke) - half,
                low + y1 * (high - stroke) + half,
            )
            for x0, x1, y0, y1 in bars
        ]
        made.append(_united(corners, z - 0.2, z + raised))
        left += width + space
    return made
