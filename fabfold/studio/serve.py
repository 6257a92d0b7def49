"""Start the studio, and end it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from fabfold.recipe.start import set_up_project
from fabfold.studio.gate import Gate, quiet_stop, start_server
from fabfold.studio.page import StudioPage
from fabfold.studio.steps import StudioSteps, with_folder

__all__ = ["Studio", "serve"]


@dataclass(frozen=True)
class Studio:
    """A studio that is being served.

    Attributes
    ----------
    gate : Gate
        Its address and its key.
    page : StudioPage
        What it shows; ``page.tasks.run()`` does what the page asks for, ``page.tasks.end()`` lets
        it return.
    steps : StudioSteps
        The kit.
    close : callable
        Stops serving; leaving a ``with`` does so too.
    """

    gate: Gate
    page: StudioPage
    steps: StudioSteps
    close: Callable[[], None]

    def run(self, *, browser: bool = False) -> None:
        """Do what the page asks for, until it is ended; with `browser` open it first."""
        import webbrowser

        if browser:
            webbrowser.open(self.gate.address)
        self.page.tasks.run()

    def __enter__(self) -> Studio:
        return self

    def __exit__(self, *_: object) -> None:
        """Stop serving."""
        self.close()


def serve(source: str, folder: str | None = None, port: int = 0) -> Studio:
    """Serve the studio of a kit or a model, on this machine only.

    Parameters
    ----------
    source : str
        Kit folder, recipe, model file or ``sample:NAME``.
    folder : str, optional
        Kit folder; that of the kit, or one named after the model.
    port : int
        Wanted; 0 takes a free one.

    Returns
    -------
    Studio
        Its address is there at once; the model is read as its first task.

    Raises
    ------
    InputError
        If viser is not installed.
    ModelError, KitError, RecipeError
        If there is no such file, or the recipe is wrong.
    """
    from pathlib import Path

    start = with_folder(set_up_project(source, None if folder is None else Path(folder), {}))
    steps = StudioSteps(start)
    steps.kit()  # What is wrong with the recipe or the folder is said before anything is served.
    gate = Gate()
    server = start_server(gate, port)
    page = StudioPage(server, steps)
    page.tasks.start("Opening", page.begin)

    def close() -> None:
        page.fold.close()
        quiet_stop(server)

    return Studio(gate, page, steps, close)
