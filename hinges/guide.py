"""The page that tells how to read a coupon."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import build123d as bd
    from fpdf import FPDF

__all__ = ["projected_edges", "write_guide"]

Vector = tuple[float, float, float]

_FROM = (-25.0, -95.0, 110.0)  # where the coupon is seen from, mm
_WIDTH, _HEIGHT = 174.0, 58.0  # largest size of the drawing on the page, mm
_CHORD = 0.5  # longest chord of a curve in the drawing, mm of the part


def projected_edges(
    shape: bd.Shape, eye: Vector, up: Vector = (0.0, 0.0, 1.0)
) -> list[NDArray[np.float64]]:
    """Draw the visible edges of a part in parallel projection.

    Parameters
    ----------
    shape : Shape
        The part in mm.
    eye : (float, float, float)
        Point in mm from which it is seen, looking at the origin.
    up : (float, float, float)
        Direction that stands upright in the drawing.

    Returns
    -------
    list of (n, 2) float64 array
        Points along each edge in mm, to the right and upwards from the origin.
    """
    visible, _ = shape.project_to_viewport(eye, up, (0.0, 0.0, 0.0))
    lines = []
    for edge in visible:
        count = 2 if edge.geom_type.name == "LINE" else int(edge.length / _CHORD) + 3
        points = edge.positions(np.linspace(0.0, 1.0, count).tolist())
        lines.append(np.array([(point.X, point.Y) for point in points]))
    return lines


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


def write_guide(path: Path, clearances: Sequence[float], columns: bd.Shape, title: str) -> None:
    """Write the one-page PDF.

    Parameters
    ----------
    path : Path
        File to write.
    clearances : sequence of float
        Clearances of the coupon in mm.
    columns : Shape
        What is drawn: the first columns of the coupon, lying on z = 0.
    title : str
        Head of the page.
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
    _draw(pdf, projected_edges(columns, _FROM))
    pdf.set_font("Helvetica", "", 10.5)
    pdf.ln(2)
    caption = "The first columns: flaps on hinges below the numbers, sockets for the plug above."
    pdf.cell(0, 6, caption, new_x="LMARGIN", new_y="NEXT", align="C")
    pdf.ln(2)
    _which_number(pdf, clearances)
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
        "If only the largest turns freely, clean the nozzle, check the flow, and print again. If "
        "the smallest does, you have an excellent printer: print a coupon with smaller ones.",
    ]
    for index, step in enumerate(steps, 1):
        pdf.set_font("Helvetica", "B", 10.5)
        pdf.cell(8, 6, f"{index}.")
        pdf.set_font("Helvetica", "", 10.5)
        pdf.multi_cell(0, 6, _plain(step), new_x="LMARGIN", new_y="NEXT")
        pdf.ln(1)
    pdf.ln(2)
    widths = (30, 35, 35, 74)
    pdf.set_font("Helvetica", "B", 10)
    for head, width in zip(
        ("Clearance", "flap turns", "plug goes in", "note"), widths, strict=True
    ):
        pdf.cell(width, 7, head, border=1)
    pdf.ln()
    pdf.set_font("Helvetica", "", 10)
    for clearance in clearances:
        pdf.cell(widths[0], 7, f"{clearance:g} mm", border=1)
        for width in widths[1:]:
            pdf.cell(width, 7, "", border=1)
        pdf.ln()
    pdf.output(str(path))


def _plain(text: str) -> str:
    """Keep to what the PDF's built-in font can show."""
    return text.encode("latin-1", "replace").decode("latin-1")
