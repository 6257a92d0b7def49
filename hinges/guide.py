"""The page that tells how to read a coupon."""

from __future__ import annotations

import io
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from .mesh import MeshPart
from .picture import PALETTE, Body, Camera, render

__all__ = ["guide_picture", "write_guide"]


def guide_picture(meshes: Sequence[MeshPart], width: int = 1500, height: int = 640) -> bytes:
    """Draw the coupon from above at an angle.

    Parameters
    ----------
    meshes : sequence of MeshPart
        The frame first, then three bodies a clearance.
    width, height : int
        In pixels.

    Returns
    -------
    bytes
        A PNG.
    """
    bodies = [
        Body(mesh.vertices, mesh.faces, PALETTE[3] if not index else PALETTE[(index - 1) % 3])
        for index, mesh in enumerate(meshes)
    ]
    image = render(bodies, (width, height), Camera(-75.0, 48.0))
    stream = io.BytesIO()
    image.quantize(128).save(stream, "PNG", optimize=True)
    return stream.getvalue()


def write_guide(
    path: Path, clearances: Sequence[float], meshes: Sequence[MeshPart], title: str
) -> None:
    """Write the one-page PDF.

    Parameters
    ----------
    path : Path
    clearances : sequence of float
        In mm.
    meshes : sequence of MeshPart
        As :attr:`hinges.Coupon.meshes`.
    title : str
    """
    from fpdf import FPDF

    pdf = FPDF(format="A4")
    pdf.set_creation_date(datetime(2000, 1, 1, tzinfo=UTC))  # the same bytes from run to run
    pdf.set_title(title)
    pdf.set_margin(18)
    pdf.add_page()
    pdf.set_font("Helvetica", "B", 18)
    pdf.cell(0, 10, _plain(title), new_x="LMARGIN", new_y="NEXT")
    pdf.set_font("Helvetica", "", 10.5)
    pdf.image(io.BytesIO(guide_picture(meshes)), w=174)
    pdf.ln(3)
    steps = [
        "Print it lying as it is, without supports, in the material and with the settings of the "
        "real part. Switch off 'slice gap closing' above 0.05 mm, beam interlocking and brims "
        "inside gaps: they fuse hinges.",
        "Let it cool, then take it off the plate. Hold the frame and turn each flap to and fro, "
        "beginning at the largest number. A first crack is normal; do not force a flap.",
        f"The numbers are clearances in mm: {', '.join(f'{c:.2f}' for c in clearances)}. The row "
        "on one side has one axis a hinge, the row on the other two.",
        "Note the smallest number of which both rows turn freely with one finger. That is the "
        "clearance for this printer and material.",
        "If only the largest turns freely, clean the nozzle, check the flow, and print again. If "
        "the smallest does, you have an excellent printer: print a coupon with smaller ones.",
        "Tell it to fabfold with:  fabfold calibrate --turns-freely 0.30 --profile NAME   (with "
        "your number and profile), or in CAD with:  SingleHinge(40, clearance=0.30).",
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
        ("Clearance", "single turns", "double turns", "note"), widths, strict=True
    ):
        pdf.cell(width, 7, head, border=1)
    pdf.ln()
    pdf.set_font("Helvetica", "", 10)
    for clearance in clearances:
        pdf.cell(widths[0], 7, f"{clearance:.2f} mm", border=1)
        for width in widths[1:]:
            pdf.cell(width, 7, "", border=1)
        pdf.ln()
    pdf.output(str(path))


def _plain(text: str) -> str:
    """Keep to what the PDF's built-in font can show."""
    return text.encode("latin-1", "replace").decode("latin-1")
