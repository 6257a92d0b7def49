"""``fabfold check FILE``: any model file for a printer, without making a kit of it."""

from __future__ import annotations

from pathlib import Path

import typer

from fabfold.errors import CheckError

__all__ = ["check_model_file", "is_model_file"]


def is_model_file(source: str) -> bool:
    """Whether a name is that of a file that is no recipe."""
    path = Path(source)
    return path.is_file() and path.suffix != ".toml"


def check_model_file(path: Path, profile: str | None, *, as_json: bool, quiet: bool) -> None:
    """Check a file and show what was found.

    Parameters
    ----------
    path : Path
        The file.
    profile : str or None
        Printer and material; None for the default.
    as_json : bool
        Whether to print JSON and nothing else.
    quiet : bool
        Whether to show no progress.

    Raises
    ------
    typer.Exit
        With the exit code of a failed check, if one failed.
    """
    from fabfold.cli.console import ConsoleListener, show_checks
    from fabfold.printing.file_checks import check_file
    from fabfold.printing.profiles import DEFAULT_PROFILE, load_profile
    from fabfold.progress import SilentListener

    listener = SilentListener() if quiet or as_json else ConsoleListener()
    chosen = load_profile(profile or DEFAULT_PROFILE)
    with listener.stage("check") as progress:
        checks = check_file(path, chosen, progress)
    show_checks(checks, {"file": path.name, "profile": chosen.name}, as_json=as_json)
    if not all(check.ok for check in checks):
        raise typer.Exit(CheckError.exit_code)
