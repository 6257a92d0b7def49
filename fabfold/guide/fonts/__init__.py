"""The font of manuals: DejaVu Sans, cut down to Latin, Greek and Cyrillic (see its licence)."""

from __future__ import annotations

from pathlib import Path

__all__ = ["font_file"]


def font_file(*, bold: bool = False) -> Path:
    """The TTF file of the font.

    Parameters
    ----------
    bold : bool
        The heavier of the two.
    """
    return Path(__file__).parent / ("DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf")
