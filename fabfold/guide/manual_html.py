"""``manual.html``: the manual as one page, for a screen beside the printer."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from html import escape

from fabfold.export.render import Image, jpeg_bytes
from fabfold.guide.advice import WAY_BACK
from fabfold.guide.magnet_pictures import POLES
from fabfold.guide.manual import Manual, ManualStep

__all__ = ["manual_html"]

_STYLE = """
:root { color-scheme: light; --ink: #1d1d1f; --soft: #6b6b70; --line: #d8d6d0; --accent: #be4614; }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 72rem; padding: 2rem 1.2rem; background: #fff; color: var(--ink);
  font: 17px/1.5 system-ui, sans-serif; }
h1 { font-size: 2.4rem; line-height: 1.15; margin: 0; } h2 { margin: 2.5rem 0 .6rem; }
.sub { color: var(--soft); font-size: 1.2rem; margin: .2rem 0 1.5rem; }
img { max-width: 100%; height: auto; display: block; }
.cover { margin: 0 auto; }
.steps { display: grid; grid-template-columns: repeat(auto-fill, minmax(19rem, 1fr)); gap: 1.6rem;
  list-style: none; padding: 0; }
.parts { display: grid; grid-template-columns: repeat(auto-fill, minmax(8rem, 1fr)); gap: .6rem;
  list-style: none; padding: 0; color: var(--soft); font-size: .85rem; }
.parts strong { color: var(--ink); font-size: 1.1rem; }
.steps li { border-top: 1px solid var(--line); padding-top: .5rem; break-inside: avoid; }
.number { font-size: 1.7rem; font-weight: 700; margin-right: .6rem; }
.turn { color: var(--accent); font-weight: 600; }
.text { color: var(--soft); font-size: .95rem; }
@media print { body { padding: 0; font-size: 12px; } }
"""


def _image(image: Image, alt: str, css: str = "") -> str:
    data = base64.b64encode(jpeg_bytes(image)).decode("ascii")
    height, width = image.shape[:2]
    return (
        f'<img class="{css}" width="{width}" height="{height}" alt="{escape(alt)}" '
        f'src="data:image/jpeg;base64,{data}">'
    )


def _list(title: str, lines: Sequence[str], tag: str = "ul") -> str:
    if not lines:
        return ""
    entries = "".join(f"<li>{escape(line)}</li>" for line in lines)
    return f"<h2>{escape(title)}</h2><{tag}>{entries}</{tag}>"


def _step(step: ManualStep) -> str:
    turn = '<span class="turn">&#x21bb; turn the whole</span>' if step.turned else ""
    return (
        f'<li id="step-{step.number}"><span class="number">{step.number}</span>{turn}'
        f"{_image(step.picture.image, f'Step {step.number}: {step.text}')}"
        f'<div class="text">{escape(step.text)}</div></li>'
    )


def _parts(manual: Manual) -> str:
    return "".join(
        f"<li>{_image(image, f'Part {number}')}<strong>{number}</strong> {escape(name)}</li>"
        for number, (image, name) in enumerate(
            zip(manual.parts, manual.names, strict=True), start=1
        )
    )


def _magnets(manual: Manual) -> str:
    if not manual.magnets:
        return ""
    pictures = "".join(
        f"<li>{_image(picture.image, f'Magnets of part {picture.body + 1}')}"
        f"<strong>{picture.body + 1}</strong></li>"
        for picture in manual.magnets
    )
    return f'<h2>The magnets</h2><p>{escape(POLES)}</p><ul class="parts">{pictures}</ul>'


def manual_html(manual: Manual) -> str:
    """The manual as a page with nothing outside it.

    Parameters
    ----------
    manual : Manual
        What it says and shows.

    Returns
    -------
    str
        HTML, the same for the same manual.
    """
    title = escape(manual.title)
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; '
        "img-src data:; style-src 'unsafe-inline'\">"
        f"<title>{title}: folding manual</title><style>{_STYLE}</style></head><body>"
        f'<h1>{title}</h1><p class="sub">{escape(manual.subtitle)}</p>'
        f"{_image(manual.cover, 'The model, half-way, and folded', 'cover')}"
        f"{_list('What is in the box', manual.contents)}{_list('Printing', manual.advice)}"
        f'<h2>The parts</h2><ul class="parts">{_parts(manual)}</ul>'
        f"{_magnets(manual)}{_list('Putting it together', manual.assembly, 'ol')}"
        "<h2>Folding</h2><p>Hold what is light. Turn what is dark along the arrow, as far as the "
        "number says; the dashed outline shows where it ends. Where a step has more than one "
        "colour, each is a turn by itself, in any order. The line of dashes and dots is the "
        "hinge. To see it move, open <em>fold.html</em>.</p>"
        f'<ol class="steps">{"".join(_step(step) for step in manual.steps)}</ol>'
        f"<h2>Done: the box is closed</h2>{_image(manual.end, 'The closed box', 'cover')}"
        f"<h2>The way back</h2><p>{escape(WAY_BACK)}</p></body></html>\n"
    )
