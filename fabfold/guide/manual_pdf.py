"""``manual.pdf``: the manual on paper."""

from __future__ import annotations

import io
from collections.abc import Sequence
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Final

from fabfold.export.render import Image, jpeg_bytes
from fabfold.guide.advice import WAY_BACK
from fabfold.guide.fonts import font_file
from fabfold.guide.magnet_pictures import POLES
from fabfold.guide.manual import Manual, ManualStep

if TYPE_CHECKING:
    from fpdf import FPDF

__all__ = ["PAPERS", "manual_pdf", "page_count"]

#: Papers: name for fpdf2, width and height in mm.
PAPERS: Final = {"a4": (210.0, 297.0), "letter": (215.9, 279.4)}
#: Margin and gap between pictures, mm; columns and rows of steps on a page.
_MARGIN, _GAP, _COLUMNS, _ROWS = 14.0, 6.0, 2, 3
#: Lines below a step's picture that have room in any case, and their distance, mm.
_LINES, _LEADING = 2, 4.4
_ACCENT, _INK, _SOFT, _LINE = (190, 70, 20), (25, 25, 28), (105, 105, 110), (215, 213, 208)


def manual_pdf(manual: Manual, paper: str = "a4") -> bytes:
    """Lay a manual out on paper.

    Parameters
    ----------
    manual : Manual
        What it says and shows.
    paper : str
        One of :data:`PAPERS`.

    Returns
    -------
    bytes
        A PDF with its font inside, the same for the same manual.
    """
    from fpdf import FPDF

    pdf = FPDF(format=paper, unit="mm")
    pdf.set_creation_date(datetime(2000, 1, 1, tzinfo=UTC))
    pdf.set_title(f"{manual.title}: folding manual")
    pdf.set_creator("fabfold")
    pdf.set_auto_page_break(False)
    pdf.set_margin(_MARGIN)
    pdf.add_font("sans", "", font_file())
    pdf.add_font("sans", "B", font_file(bold=True))
    _cover(pdf, manual)
    _before(pdf, manual)
    _parts(pdf, manual)
    if manual.magnets:
        _magnets(pdf, manual)
    per_page = _COLUMNS * _ROWS
    for start in range(0, len(manual.steps), per_page):
        _page(pdf, manual)
        for place, step in enumerate(manual.steps[start : start + per_page]):
            _step(pdf, step, place)
    _end(pdf, manual)
    return bytes(pdf.output())


def _text(pdf: FPDF, size: float, colour: Sequence[int] = _INK, style: str = "") -> None:
    pdf.set_font("sans", style, size)
    pdf.set_text_color(*colour)


def _page(pdf: FPDF, manual: Manual) -> None:
    """A new page with its foot."""
    pdf.add_page()
    _text(pdf, 8, _SOFT)
    pdf.set_xy(_MARGIN, pdf.h - 10)
    pdf.cell(pdf.epw / 2, 5, manual.title[:60])
    pdf.cell(pdf.epw / 2, 5, str(pdf.page_no()), align="R")


def _picture(pdf: FPDF, image: Image, x: float, y: float, width: float, height: float) -> float:
    """A picture in the middle of a place; its lower edge."""
    tall, wide = image.shape[:2]
    scale = min(width / wide, height / tall)
    w, h = wide * scale, tall * scale
    pdf.image(io.BytesIO(jpeg_bytes(image)), x + (width - w) / 2, y, w, h)
    return float(y + h)


def _cover(pdf: FPDF, manual: Manual) -> None:
    pdf.add_page()
    pdf.set_fill_color(*_ACCENT)
    pdf.rect(0, 0, pdf.w, 3, style="F")
    pdf.set_xy(_MARGIN, 32)
    _text(pdf, 30, style="B")
    pdf.multi_cell(0, 13, _breakable(manual.title), new_x="LMARGIN", new_y="NEXT")
    _text(pdf, 14, _SOFT)
    pdf.multi_cell(0, 8, manual.subtitle, new_x="LMARGIN", new_y="NEXT")
    top = max(pdf.get_y() + 14, 88)
    below = _picture(pdf, manual.cover, _MARGIN, top, pdf.epw, 130)
    pdf.set_xy(_MARGIN, below + 8)
    _text(pdf, 11, _SOFT)
    pdf.cell(0, 6, "as it is printed   →   half-way   →   folded", align="C")
    pdf.set_xy(_MARGIN, pdf.h - 34)
    _text(pdf, 46, _ACCENT, "B")
    number = str(len(manual.steps))
    pdf.cell(pdf.get_string_width(number) + 3, 16, number)
    _text(pdf, 14, _INK)
    pdf.cell(0, 19, "steps" if len(manual.steps) != 1 else "step")


def _breakable(text: str) -> str:
    """Underscores and dots may end a line, as blanks do."""
    return text.replace("_", " ").strip() or "kit"


def _heading(pdf: FPDF, text: str) -> None:
    _text(pdf, 15, _INK, "B")
    pdf.cell(0, 10, text, new_x="LMARGIN", new_y="NEXT")


def _lines(pdf: FPDF, manual: Manual, lines: Sequence[str], *, numbered: bool = False) -> None:
    for number, line in enumerate(lines, start=1):
        if pdf.get_y() > pdf.h - 32:
            _page(pdf, manual)
            pdf.set_xy(_MARGIN, _MARGIN)
        _text(pdf, 10.5, _ACCENT, "B")
        pdf.cell(9, 6, f"{number}" if numbered else "•")
        _text(pdf, 10.5)
        pdf.multi_cell(pdf.epw - 9, 6, line, align="L", new_x="LMARGIN", new_y="NEXT")
        pdf.ln(1)


def _before(pdf: FPDF, manual: Manual) -> None:
    """What is in the box, how to print it, how to put it together, how to read the pictures."""
    _page(pdf, manual)
    pdf.set_xy(_MARGIN, _MARGIN + 4)
    _heading(pdf, "What is in the box")
    _lines(pdf, manual, manual.contents)
    pdf.ln(4)
    _heading(pdf, "Printing")
    _lines(pdf, manual, manual.advice)
    if manual.assembly:
        pdf.ln(4)
        _heading(pdf, "Putting it together")
        _lines(pdf, manual, manual.assembly, numbered=True)
    pdf.ln(4)
    if pdf.get_y() > pdf.h - 90:
        _page(pdf, manual)
        pdf.set_xy(_MARGIN, _MARGIN)
    _heading(pdf, "How to read the pictures")
    _lines(
        pdf,
        manual,
        [
            "Hold what is light. Turn what is dark along the arrow, as far as the number says. The "
            "dashed outline shows where it ends.",
            "The line of dashes and dots is the hinge.",
            "Where a step has more than one colour, each colour is a turn by itself: make them one "
            "after the other, in any order.",
            "Where a step says “turn the whole”, the picture is seen from another side than the "
            "one before: turn the kit in your hands until it looks the same.",
        ],
    )


def _parts(pdf: FPDF, manual: Manual) -> None:
    """All parts with their numbers."""
    columns, gap = 5, 4.0
    width = (pdf.epw - (columns - 1) * gap) / columns
    height = 0.75 * width + 9
    pdf.ln(4)
    if pdf.get_y() + 12 + height > pdf.h - 16:
        _page(pdf, manual)
        pdf.set_xy(_MARGIN, _MARGIN)
    _heading(pdf, "The parts")
    top, row = pdf.get_y() + 1, 0
    for index, image in enumerate(manual.parts):
        column = index % columns
        if column == 0 and index:
            row += 1
        if column == 0 and top + (row + 1) * height > pdf.h - 14:
            _page(pdf, manual)
            top, row = _MARGIN + 2, 0
        x, y = _MARGIN + column * (width + gap), top + row * height
        _picture(pdf, image, x, y, width, 0.75 * width)
        pdf.set_xy(x, y + 0.75 * width)
        _text(pdf, 11, _INK, "B")
        number = str(index + 1)
        pdf.cell(pdf.get_string_width(number) + 3, 5, number)
        _text(pdf, 7, _SOFT)
        pdf.cell(0, 5.4, manual.names[index])
    pdf.set_xy(_MARGIN, top + (row + 1) * height)


def _magnets(pdf: FPDF, manual: Manual) -> None:
    """Where magnets go."""
    columns, gap = 3, 5.0
    width = (pdf.epw - (columns - 1) * gap) / columns
    height = 0.75 * width + 9
    _page(pdf, manual)
    pdf.set_xy(_MARGIN, _MARGIN + 4)
    _heading(pdf, "The magnets")
    _lines(pdf, manual, [POLES])
    top, row = pdf.get_y() + 2, 0
    for index, picture in enumerate(manual.magnets):
        row, column = (row + 1 if index % columns == 0 and index else row), index % columns
        if column == 0 and top + (row + 1) * height > pdf.h - 14:
            _page(pdf, manual)
            top, row = _MARGIN + 2, 0
        x, y = _MARGIN + column * (width + gap), top + row * height
        _picture(pdf, picture.image, x, y, width, 0.75 * width)
        pdf.set_xy(x, y + 0.75 * width)
        _text(pdf, 11, _INK, "B")
        pdf.cell(width, 5, f"part {picture.body + 1}")


def _step(pdf: FPDF, step: ManualStep, place: int) -> None:
    width = (pdf.epw - (_COLUMNS - 1) * _GAP) / _COLUMNS
    height = (pdf.h - 2 * _MARGIN - 4) / _ROWS
    row, column = divmod(place, _COLUMNS)
    x, y = _MARGIN + column * (width + _GAP), _MARGIN + row * height
    pdf.set_draw_color(*_LINE)
    pdf.set_line_width(0.3)
    pdf.line(x, y, x + width, y)
    pdf.set_xy(x, y + 2)
    _text(pdf, 20, _INK, "B")
    number = str(step.number)
    pdf.cell(pdf.get_string_width(number) + 4, 9, number)
    if step.turned:
        _turn_mark(pdf, pdf.get_x() + 4, y + 6.5)
        pdf.set_xy(pdf.get_x() + 9, y + 2)
        _text(pdf, 9, _ACCENT, "B")
        pdf.cell(0, 9, "turn the whole")
    _text(pdf, 9, _SOFT)
    text = step.text
    lines = pdf.multi_cell(width, _LEADING, text, dry_run=True, output="LINES")
    if len(lines) > _LINES:
        text = step.brief
        lines = pdf.multi_cell(width, _LEADING, text, dry_run=True, output="LINES")
    # The picture gives way to words that are long even so.
    room = height - 11 - 4.2 - _LEADING * max(_LINES, len(lines))
    below = _picture(pdf, step.picture.image, x, y + 11, width, room)
    pdf.set_xy(x, min(below, y + 11 + room) + 0.5)
    pdf.multi_cell(width, _LEADING, text, align="L")


def _turn_mark(pdf: FPDF, x: float, y: float) -> None:
    """Two arrows that chase each other round: turn the whole."""
    pdf.set_draw_color(*_ACCENT)
    pdf.set_fill_color(*_ACCENT)
    pdf.set_line_width(0.7)
    for start in (20, 200):
        pdf.arc(x - 2.6, y - 2.6, 5.2, start, start + 125)
    for sign in (1, -1):
        tip: list[tuple[float, float]] = [
            (x - sign * 1.4, y - sign * 3.3),
            (x - sign * 3.2, y - sign * 2.0),
            (x - sign * 1.2, y - sign * 1.0),
        ]
        pdf.polygon(tip, style="F")


def _end(pdf: FPDF, manual: Manual) -> None:
    _page(pdf, manual)
    pdf.set_xy(_MARGIN, _MARGIN + 4)
    _heading(pdf, "Done: the box is closed")
    below = _picture(pdf, manual.end, _MARGIN, pdf.get_y() + 4, pdf.epw, 120)
    pdf.set_xy(_MARGIN, below + 10)
    _heading(pdf, "The way back")
    _text(pdf, 10.5)
    pdf.multi_cell(0, 6, WAY_BACK, align="L")


def page_count(content: bytes) -> int:
    """Pages of a PDF that :func:`manual_pdf` has made."""
    return content.count(b"/Type /Page\n")
