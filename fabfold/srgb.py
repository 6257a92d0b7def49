"""sRGB colours: from bytes to linear light and back, and as text.

References
----------
IEC 61966-2-1, the transfer function of sRGB.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["bytes_of_light", "colour_of_hex", "hex_of_colour", "linear_light"]

_HEX = re.compile(r"#?([0-9a-f]{2})([0-9a-f]{2})([0-9a-f]{2})", re.IGNORECASE)


def linear_light(colour: NDArray[np.generic] | Sequence[int]) -> NDArray[np.float64]:
    """Linear light of sRGB bytes.

    Parameters
    ----------
    colour : array or sequence of int, of any shape
        Red, green and blue as bytes, 0 to 255.

    Returns
    -------
    float64 array of the same shape
        From 0 (dark) to 1 (full light).
    """
    unit = np.asarray(colour, dtype=float) / 255.0
    return np.asarray(np.where(unit <= 0.04045, unit / 12.92, ((unit + 0.055) / 1.055) ** 2.4))


def bytes_of_light(light: NDArray[np.floating[Any]]) -> NDArray[np.uint8]:
    """SRGB bytes of linear light.

    Parameters
    ----------
    light : float array of any shape
        From 0 (dark) to 1 (full light); what lies outside is clipped.

    Returns
    -------
    uint8 array of the same shape
        Red, green and blue as bytes, 0 to 255.
    """
    unit = np.clip(light, 0.0, 1.0)
    curved = np.where(unit <= 0.0031308, unit * 12.92, 1.055 * unit ** (1 / 2.4) - 0.055)
    return np.asarray(np.rint(curved * 255.0), dtype=np.uint8)


def hex_of_colour(colour: Sequence[int]) -> str:
    """Write a colour as ``#rrggbb``.

    Parameters
    ----------
    colour : three int
        Red, green and blue as bytes, 0 to 255.

    Returns
    -------
    str
        In lower case, such as ``"#4e8fd6"``.
    """
    red, green, blue = colour
    return f"#{red:02x}{green:02x}{blue:02x}"


def colour_of_hex(text: str) -> tuple[int, int, int] | None:
    """Read a colour that is written ``#rrggbb`` or ``rrggbb``.

    Parameters
    ----------
    text : str
        In lower or upper case; blanks around it do not matter.

    Returns
    -------
    (int, int, int) or None
        Red, green and blue as bytes, 0 to 255; None if the text is no such colour.
    """
    match = _HEX.fullmatch(text.strip())
    if match is None:
        return None
    red, green, blue = (int(part, 16) for part in match.groups())
    return red, green, blue
