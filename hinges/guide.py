"""The page that tells how to read a coupon."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .hidden_lines import visible_edges
from .shape_meshes import MeshPart

if TYPE_CHECKING:
    from fpdf import FPDF

__all__ = ["write_guide"]

_FROM = (-25.0, -95.0, 110.0)  # where the coupon is seen from, mm
_WIDTH, _HEIGHT = 174.0, 58.0  # largest size of the drawing on the page, mm
_LINE, _ROW = 5.2, 5.8  # height of a line of words, and of a row of the table, mm


def _draw(pdf: FPDF, lines: Sequence[NDArray[np.float64]]) -> None:
    """Draw lines across the page, below what is there, and go on below them."""
    points = np.concatenate(lines)
    low, high = points.min(axis=0), points.max(axis=0)
    wide, tall = high - low
    scale = min(_WIDTH / wide, _HEIGHT / tall)
    left, top = pdf.l_margin + 0.5 * (_WIDTH - scale * wide), pdf.get_y()
    pdf.set_line_width(0.12)
    for line in lines:
        placed = np.column_stack(
            [left + scale * (line[:, 0] - low[0]), top + scale * (high[1] - line[:, 1])]
        )
        pdf.polyline([(float(x), float(y)) for x, y in placed.round(3)])
    pdf.set_line_width(0.2)
    pdf.set_y(top + scale * tall)


def _which_number(pdf: FPDF, clearances: Sequence[float]) -> None:
    """Draw an example: how the flaps turned, and which number to type."""
    shown = sorted(clearances)[:8]
    count = len(shown)
    free = max(0, count - 1) if count < 3 else (count + 1) // 2
    wide = _WIDTH / max(count, 4)
    left, top = pdf.l_margin + 0.5 * (_WIDTH - wide * count), pdf.get_y()
    pdf.set_font("Helvetica", "", 9)
    for index, clearance in enumerate(shown):
        x = left + index * wide
        turns = index >= free
        said = "turns" if turns else "stiff" if index == free - 1 else "fused"
        pdf.set_fill_color(*((214, 236, 214) if turns else (238, 238, 238)))
        pdf.rect(x + 0.8, top, wide - 1.6, 12, style="DF")
        pdf.set_xy(x, top + 0.5)
        pdf.set_font("Helvetica", "B", 10)
        pdf.cell(wide, 5.5, f"{clearance:g}", align="C")
        pdf.set_xy(x, top + 6)
        pdf.set_font("Helvetica", "", 9)
        pdf.cell(wide, 5, said, align="C")
    middle = left + (free + 0.5) * wide
    pdf.set_line_width(0.6)
    pdf.line(middle, top + 19, middle, top + 13.5)
    pdf.set_fill_color(0, 0, 0)
    pdf.polygon(
        [(middle, top + 12.6), (middle - 1.4, top + 15.2), (middle + 1.4, top + 15.2)], style="F"
    )
    pdf.set_line_width(0.2)
    pdf.set_xy(pdf.l_margin, top + 19)
    pdf.set_font("Helvetica", "B", 10.5)
    text = f"An example: type {shown[free]:g}, the smallest number that turns."
    half = 0.5 * pdf.get_string_width(text) + 2
    at = min(max(middle, pdf.l_margin + half), pdf.l_margin + _WIDTH - half)
    pdf.set_x(at - half)
    pdf.cell(2 * half, 6, text, align="C", new_x="LMARGIN", new_y="NEXT")
    pdf.ln(2)


def write_guide(
    path: Path,
    clearances: Sequence[float],
    columns: Sequence[MeshPart],
    title: str,
    pin_mm: float = 1.75,
) -> None:
    """Write the one-page PDF.

    Parameters
    ----------
    path : Path
        File to write.
    clearances : sequence of float
        Clearances of the coupon in mm.
    columns : sequence of MeshPart
        What is drawn: the bodies of the first columns of the coupon, lying on z = 0.
    title : str
        Head of the page.
    pin_mm : float
        Diameter in mm of the pin that the bores are for.
    """
    from fpdf import FPDF

    pdf = FPDF(format="A4")
    pdf.set_creation_date(datetime(2000, 1, 1, tzinfo=UTC))  # the same bytes from run to run
    pdf.set_title(title)
    pdf.set_margin(18)
    pdf.add_page()
    pdf.set_font("Helvetica", "B", 18)
    pdf.cell(0, 10, _plain(title), new_x="LMARGIN", new_y="NEXT")
    pdf.ln(2)
    _draw(pdf, visible_edges(columns, _FROM))
    pdf.set_font("Helvetica", "", 10.5)
    pdf.ln(2)
    caption = "The first columns: flaps on hinges before the numbers, sockets and bores behind."
    pdf.cell(0, 6, caption, new_x="LMARGIN", new_y="NEXT", align="C")
    pdf.ln(2)
    _which_number(pdf, clearances)
    filament = pin_mm in (1.75, 2.85)
    pin = f"filament of {pin_mm:g} mm" if filament else f"the rod of {pin_mm:g} mm"
    call = f"{'FilamentPin' if filament else 'RodPin'}({pin_mm:g}, grip=0.1, slip=0.2)"
    steps = [
        "Print it lying as it is, without supports, in the material and with the settings of the "
        "real part. Switch off 'slice gap closing' above 0.05 mm, beam interlocking and brims "
        "inside gaps: they fuse hinges.",
        "Let it cool, then take it off the plate. Hold the frame and turn each flap to and fro, "
        "beginning at the largest number. A first crack is normal; do not force a flap.",
        f"The numbers are clearances in mm: {', '.join(f'{c:g}' for c in clearances)}. Note the "
        "smallest of which the flap turns freely with one finger.",
        "Tell it to fabfold with:  fabfold calibrate --turns-freely 0.3 --profile NAME   (with "
        "your number and profile), or in CAD with:  SingleHinge(40, clearance=0.3). A second "
        "coupon in finer steps:  fabfold coupon --around 0.3",
        "Push the plug into the sockets from the largest number down. The smallest that it goes "
        "into by hand is the clearance for parts that are put together and do not turn.",
        f"For hinges with loose pins push a piece of {pin}, cut square, into the bores from the "
        "largest number down. Note the smallest that it goes into by hand and stays in, for "
        "--pin-grip, and the smallest in which it turns and slides by itself, for --pin-slip:  "
        "fabfold calibrate --turns-freely 0.3 --pin-grip 0.2 --pin-slip 0.4 --profile NAME.  In "
        f"CAD half of each goes into the pin:  {call}.",
        "If only the largest turns freely, clean the nozzle, check the flow, and print again. If "
        "the smallest does, you have an excellent printer: print a coupon with smaller ones.",
    ]
    for index, step in enumerate(steps, 1):
        pdf.set_font("Helvetica", "B", 10.5)
        pdf.cell(8, _LINE, f"{index}.")
        pdf.set_font("Helvetica", "", 10.5)
        pdf.multi_cell(0, _LINE, _plain(step), new_x="LMARGIN", new_y="NEXT")
        pdf.ln(1)
    pdf.ln(1)
    widths = (28, 28, 30, 32, 56)
    heads = ("Number", "flap turns", "plug goes in", "pin stays / turns", "note")
    pdf.set_font("Helvetica", "B", 10)
    for head, width in zip(heads, widths, strict=True):
        pdf.cell(width, _ROW, head, border=1)
    pdf.ln()
    pdf.set_font("Helvetica", "", 10)
    for clearance in clearances:
        pdf.cell(widths[0], _ROW, f"{clearance:g} mm", border=1)
        for width in widths[1:]:
            pdf.cell(width, _ROW, "", border=1)
        pdf.ln()
    pdf.output(str(path))


def _plain(text: str) -> str:
    """Keep to what the PDF's built-in font can show."""
    return text.encode("latin-1", "replace").decode("latin-1")
