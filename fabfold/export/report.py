"""``report.json`` and ``report.html``: every check with its figure, limit and verdict.

Nothing here depends on the clock or the machine: the same kit gives the same report.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from fabfold.files import write_json, write_text
from fabfold.printing.checks import Check

__all__ = ["report_data", "report_page", "write_report"]


def _plain(value: Any) -> Any:
    """Numbers as JSON can hold them: rounded to six digits, never NaN or infinite."""
    if hasattr(value, "item"):
        value = value.item()
    if isinstance(value, bool) or value is None or isinstance(value, int | str):
        return value
    if isinstance(value, float):
        return float(f"{value:.6g}") if math.isfinite(value) else str(value)
    if isinstance(value, Mapping):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, Sequence):
        return [_plain(entry) for entry in value]
    return str(value)


def report_data(checks: Sequence[Check], summary: Mapping[str, Any]) -> dict[str, Any]:
    """The content of ``report.json`` (format ``fabfold-report``, version 1).

    Parameters
    ----------
    checks : sequence of Check
        The checks, in the order in which they are to be read.
    summary : mapping
        Facts about the kit: plain numbers, text, lists and mappings.

    Returns
    -------
    dict
        Content for JSON; ``verdict`` is ``"ok"`` when every check passed, else ``"failed"``.
    """
    return {
        "format": "fabfold-report",
        "version": 1,
        "verdict": "ok" if all(check.ok for check in checks) else "failed",
        "summary": _plain(summary),
        "checks": [
            {
                "name": check.name,
                "figure": _plain(check.figure),
                "limit": _plain(check.limit),
                "unit": check.unit,
                "verdict": "ok" if check.ok else "failed",
                "note": check.note,
            }
            for check in checks
        ],
    }


def write_report(
    folder: Path,
    checks: Sequence[Check],
    summary: Mapping[str, Any],
    *,
    title: str = "kit",
    pictures: Sequence[tuple[str, bytes]] = (),
) -> None:
    """Write ``report.json`` and ``report.html``, a page to read.

    Parameters
    ----------
    folder : Path
        The kit folder.
    checks : sequence of Check
        The checks, in the order in which they are to be read.
    summary : mapping
        Facts about the kit, see :func:`report_data`.
    title : str
        Heading of the page.
    pictures : sequence of (str, bytes)
        Caption and PNG of each picture that the page shows, inside the file.
    """
    data = report_data(checks, summary)
    write_json(folder / "report.json", data)
    write_text(folder / "report.html", report_page(data, title=title, pictures=pictures))


_STYLE = """
:root { color-scheme: light dark; --ok: #1d7a46; --bad: #b3261e; --line: #8884; }
body { font: 16px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 64rem; padding: 0 1rem; }
h1 { font-weight: 600; margin-bottom: .2rem; }
table { border-collapse: collapse; width: 100%; margin: 1rem 0 2rem; }
th, td { border-bottom: 1px solid var(--line); padding: .35rem .6rem; text-align: left;
  vertical-align: top; }
td.n { font-variant-numeric: tabular-nums; text-align: right; white-space: nowrap; }
.ok { color: var(--ok); font-weight: 600; } .failed { color: var(--bad); font-weight: 600; }
figure { display: inline-block; margin: 0 1rem 1rem 0; } img { max-width: 100%; height: auto; }
figcaption { color: #777; font-size: .9rem; }
@media print { body { margin: 0; max-width: none; } }
"""


def _cell(value: Any) -> str:
    """Text of a value for a cell of a table."""
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}" if 1e-3 <= abs(value) < 1e5 or value == 0 else f"{value:.2e}"
    if isinstance(value, dict):
        return ", ".join(f"{key} {_cell(entry)}" for key, entry in value.items())
    if isinstance(value, list):
        return ", ".join(_cell(entry) for entry in value)
    return str(value)


def report_page(
    data: Mapping[str, Any], *, title: str = "kit", pictures: Sequence[tuple[str, bytes]] = ()
) -> str:
    """A page that shows the report, with nothing outside the one file.

    Parameters
    ----------
    data : mapping
        The report, from :func:`report_data`.
    title : str
        Heading of the page.
    pictures : sequence of (str, bytes)
        Caption and PNG of each picture that the page shows.

    Returns
    -------
    str
        The page as HTML.
    """
    checks = data["checks"]
    failed = sum(check["verdict"] != "ok" for check in checks)
    verdict = (
        f'<p class="ok">All {len(checks)} checks passed.</p>'
        if not failed
        else f'<p class="failed">{failed} of {len(checks)} checks failed.</p>'
    )
    figures = "".join(
        f'<figure><img alt="{escape(caption)}" '
        f'src="data:image/png;base64,{base64.b64encode(png).decode()}">'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
        for caption, png in pictures
    )
    facts = "".join(
        f"<tr><th>{escape(str(key).replace('_', ' '))}</th><td>{escape(_cell(value))}</td></tr>"
        for key, value in data["summary"].items()
    )
    rows = "".join(
        f'<tr><td class="{check["verdict"]}">{"✓" if check["verdict"] == "ok" else "✗"} '
        f"{check['verdict']}</td><td>{escape(check['name'])}</td>"
        f'<td class="n">{escape(_cell(check["figure"]))}</td>'
        f'<td class="n">{escape(_cell(check["limit"]))}</td>'
        f"<td>{escape(check['unit'])}</td><td>{escape(check['note'])}</td></tr>"
        for check in checks
    )
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}: report</title><style>{_STYLE}</style></head><body>"
        f"<h1>{escape(title)}</h1>{verdict}{figures}"
        f"<h2>The kit</h2><table>{facts}</table>"
        "<h2>Checks</h2><table><thead><tr><th>Verdict</th><th>Check</th><th>Figure</th>"
        f"<th>Limit</th><th>Unit</th><th>Note</th></tr></thead><tbody>{rows}</tbody></table>"
        "</body></html>\n"
    )
