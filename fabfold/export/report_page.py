"""``report.html``: what a maker wants to know first, then every check, then the internals."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

__all__ = ["report_page"]

_STYLE = """
:root { color-scheme: light dark; --ok: #1d7a46; --bad: #b3261e; --line: #8884; --soft: #777;
  --card: #8881; }
@media (prefers-color-scheme: dark) { :root { --ok: #5fcf92; --bad: #ff8a80; --soft: #aaa; } }
* { box-sizing: border-box; }
body { font: 17px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 64rem; padding: 0 1rem; }
h1 { font-weight: 700; font-size: 2.2rem; line-height: 1.15; margin: 0; }
h2 { margin: 2.4rem 0 .6rem; }
.verdict { font-size: 1.25rem; margin: .3rem 0 1.2rem; }
img { max-width: 100%; height: auto; border-radius: 10px; background: #fff; }
.answers { display: grid; grid-template-columns: repeat(auto-fit, minmax(14rem, 1fr)); gap: .8rem;
  margin: 1.2rem 0; padding: 0; list-style: none; }
.answers li { background: var(--card); border-radius: 12px; padding: .8rem 1rem; }
.answers h3 { margin: 0; font-size: .95rem; font-weight: 600; color: var(--soft); }
.answers .big { font-size: 1.7rem; font-weight: 700; line-height: 1.2; margin: .15rem 0; }
.answers p { margin: 0; font-size: .95rem; }
table { border-collapse: collapse; width: 100%; margin: .6rem 0 1.4rem; font-size: .95rem; }
th, td { border-bottom: 1px solid var(--line); padding: .35rem .6rem; text-align: left;
  vertical-align: top; }
td.n { font-variant-numeric: tabular-nums; white-space: nowrap; }
img.where { float: right; width: 150px; margin: 0 0 .3rem .8rem; border-radius: 6px; }
td small { color: var(--soft); display: block; }
.ok { color: var(--ok); font-weight: 600; } .failed { color: var(--bad); font-weight: 600; }
figure { margin: 0 0 1rem; } figcaption, .soft { color: var(--soft); font-size: .92rem; }
summary { cursor: pointer; font-weight: 600; margin: 1.5rem 0 .5rem; }
@media print { body { margin: 0; max-width: none; } details { display: none; } }
"""

#: Checks that say whether it folds; all others are of printing.
_FOLDING = ("tree folds", "path", "replay", "moves with", "pins that", "hinges that")
_PATH = "smallest gap on the folding path"
_PLAY = "play of the box pressed together"


def _cell(value: Any) -> str:
    """Text of a value for a cell of a table."""
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        plain = 1e-3 <= abs(value) < 1e4 or value == 0
        large = 1e4 <= abs(value) < 1e9
        return f"{value:,.0f}" if large else f"{value:.4g}" if plain else f"{value:.2e}"
    if isinstance(value, dict):
        return ", ".join(f"{key} {_cell(entry)}" for key, entry in value.items())
    if isinstance(value, list):
        return ", ".join(_cell(entry) for entry in value)
    return str(value)


def _is_of_folding(check: Mapping[str, Any]) -> bool:
    return any(word in check["name"] for word in _FOLDING)


def _passed(checks: Sequence[Mapping[str, Any]]) -> bool:
    return all(check["verdict"] == "ok" for check in checks)


def _answer(question: str, big: str, text: str, css: str = "") -> str:
    return (
        f'<li><h3>{escape(question)}</h3><div class="big {css}">{escape(big)}</div>'
        f"<p>{escape(text)}</p></li>"
    )


def _answers(data: Mapping[str, Any]) -> str:
    """What is asked first: does it fold, does it print, how does it look, how large is it."""
    summary, checks = data["summary"], data["checks"]
    folding = [check for check in checks if _is_of_folding(check)]
    printing = [check for check in checks if not _is_of_folding(check)]
    cards = []
    path = next((check for check in checks if check["name"] == _PATH), None)
    if folding:
        good = _passed(folding)
        text = "A check of the folding failed; see below."
        if good:
            text = "All checks of the folding passed."
            if path is not None:
                text = (
                    f"Proven on the printed parts: on the whole way to the box no two come nearer "
                    f"than {_cell(path['figure'])} {path['unit']}."
                )
        cards.append(
            _answer("Does it fold?", "Yes" if good else "No", text, "ok" if good else "failed")
        )
    if printing:
        good = _passed(printing)
        bad = [check["name"] for check in printing if check["verdict"] != "ok"]
        profile = summary.get("profile")
        on = f" with {profile}" if profile else ""
        text = (
            f"Gaps, walls and surfaces suit a print{on}."
            if good
            else f"{'; '.join(bad)}: see below."
        )
        cards.append(
            _answer("Will it print?", "Yes" if good else "No", text, "ok" if good else "failed")
        )
    closed, most = summary.get("box_closed"), summary.get("box_closed_at_most")
    if closed is not None:
        text = "of the outside of the box is there; the rest are recesses where the model has none."
        if most is not None:
            text += f" These voxels allow {most:.0%}."
        cards.append(_answer("How closed is the box?", f"{closed:.0%}", text))
    play = next((check for check in checks if check["name"] == _PLAY), None)
    if play is not None:
        text = f"Pressed together: {play['note']}."
        cards.append(_answer("How loose is the box?", f"{_cell(play['figure'])} mm", text))
    if "box_mm" in summary:
        size = " × ".join(_cell(float(side)) for side in summary["box_mm"])
        pieces = f"{summary['bodies']} parts, {sum(summary['joints'].values())} joints"
        cards.append(
            _answer(
                "How large?", f"{size} mm", f"closed; {pieces}, folded in {summary['moves']} moves."
            )
        )
    return f'<ul class="answers">{"".join(cards)}</ul>' if cards else ""


def _next_steps(summary: Mapping[str, Any]) -> str:
    """What to do with the files."""
    model = summary.get("model")
    if not model or "print" not in summary:
        return ""
    apart = summary["print"] == "apart"
    what = "plate-1.3mf" + (" and the others" if summary.get("plates", 1) > 1 else "")
    first = what if apart else f"{model}.3mf"
    lines = [
        f"Print <strong>{escape(first)}</strong> as it lies, without scaling "
        f"(Bambu Studio and OrcaSlicer: {escape(str(model))}-bambu.3mf).",
        'See it fold: <a href="fold.html">fold.html</a>.',
        'Fold it by the manual: <a href="manual.pdf">manual.pdf</a>, '
        '<a href="manual-letter.pdf">on Letter</a>, <a href="manual.html">on a screen</a>.',
    ]
    if apart:
        lines.insert(1, "Put the parts together with pins, in the order of the manual.")
    supported = summary.get("bodies_with_support") or []
    if supported:
        lines.insert(1, f"Support from the plate only, for: {escape(', '.join(supported))}.")
    return f"<h2>What to do next</h2><ol>{''.join(f'<li>{line}</li>' for line in lines)}</ol>"


def _limit(check: Mapping[str, Any]) -> str:
    """Figure, and limit in words: whether it may be more or less is seen from the verdict."""
    figure, limit = check["figure"], check["limit"]
    if not check["unit"] and limit == 1.0:
        return "yes" if figure == 1.0 else "no"
    text = f"{_cell(figure)} {check['unit']}".strip()
    if limit is None or isinstance(figure, str):
        return text
    good = check["verdict"] == "ok"
    least = (figure >= limit) == good and figure != limit
    words = "exactly" if figure == limit and good else "at least" if least else "at most"
    return f"{text} <small>{words} {_cell(limit)}</small>"


def _where(check: Mapping[str, Any], pictures: Mapping[str, bytes]) -> str:
    """Picture of where a figure was found, where there is one."""
    png = pictures.get(check["name"])
    if png is None:
        return ""
    return (
        f'<img class="where" alt="where: {escape(check["name"])}" '
        f'src="data:image/png;base64,{base64.b64encode(png).decode()}">'
    )


def _table(title: str, checks: Sequence[Mapping[str, Any]], pictures: Mapping[str, bytes]) -> str:
    if not checks:
        return ""
    order = sorted(checks, key=lambda check: check["verdict"] == "ok")
    rows = "".join(
        f'<tr><td class="{check["verdict"]}">{"✓" if check["verdict"] == "ok" else "✗"}</td>'
        f"<td>{_where(check, pictures)}{escape(check['name'])}"
        f"<small>{escape(check['note'])}</small></td>"
        f'<td class="n">{_limit(check)}</td></tr>'
        for check in order
    )
    return f"<h3>{escape(title)}</h3><table>{rows}</table>"


def report_page(
    data: Mapping[str, Any],
    *,
    title: str = "kit",
    pictures: Sequence[tuple[str, bytes]] = (),
    where: Mapping[str, bytes] | None = None,
) -> str:
    """A page that shows the report, with nothing outside the one file.

    Parameters
    ----------
    data : mapping
        The report, from :func:`fabfold.export.report.report_data`.
    title : str
        Heading of the page.
    pictures : sequence of (str, bytes)
        Caption and PNG of each picture that the page shows.
    where : mapping of str to bytes, optional
        PNG of where a figure was found, by the name of its check.

    Returns
    -------
    str
        The page as HTML.
    """
    checks, summary, places = data["checks"], data["summary"], where or {}
    failed = sum(check["verdict"] != "ok" for check in checks)
    verdict = (
        f'<p class="verdict ok">All {len(checks)} checks passed.</p>'
        if not failed
        else f'<p class="verdict failed">{failed} of {len(checks)} checks failed.</p>'
    )
    figures = "".join(
        f'<figure><img alt="{escape(caption)}" '
        f'src="data:image/png;base64,{base64.b64encode(png).decode()}">'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
        for caption, png in pictures
    )
    notes = [str(note) for key in ("repairs", "notes") for note in summary.get(key, [])]
    wishes = [str(wish.get("text", wish)) for wish in summary.get("wishes", [])]
    told = "".join(f"<li>{escape(note)}</li>" for note in [*wishes, *notes])
    facts = "".join(
        f"<tr><th>{escape(str(key).replace('_', ' '))}</th><td>{escape(_cell(value))}</td></tr>"
        for key, value in summary.items()
    )
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; '
        "img-src data:; style-src 'unsafe-inline'\">"
        f"<title>{escape(title)}: report</title><style>{_STYLE}</style></head><body>"
        f"<h1>{escape(title)}</h1>{verdict}{figures}{_answers(data)}{_next_steps(summary)}"
        f"{f'<h2>What was done to the model</h2><ul>{told}</ul>' if told else ''}"
        f"<h2>Checks</h2>{_table('Folding', [c for c in checks if _is_of_folding(c)], places)}"
        f"{_table('Printing', [c for c in checks if not _is_of_folding(c)], places)}"
        f"<details><summary>All figures of the kit</summary><table>{facts}</table></details>"
        "</body></html>\n"
    )
