"""``report.json`` and ``report.html``: every check with its figure, limit and verdict.

Nothing here depends on the clock or the machine: the same kit gives the same report.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fabfold.export.report_page import report_page
from fabfold.files import write_json, write_text
from fabfold.printing.checks import Check

__all__ = ["report_data", "write_report"]


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
    where: Mapping[str, bytes] | None = None,
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
    where : mapping of str to bytes, optional
        PNG of where a figure was found, by the name of its check.
    """
    data = report_data(checks, summary)
    write_json(folder / "report.json", data)
    write_text(
        folder / "report.html", report_page(data, title=title, pictures=pictures, where=where)
    )
