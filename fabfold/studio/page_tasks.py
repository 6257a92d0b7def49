"""Work that a page asks for, one after another in the first thread, with a bar and a stop button.

Callbacks of the page run in threads of its server. What takes long, and all that MeshLab does, runs
in the thread that the studio was started in.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from fabfold.errors import FabfoldError, harmless, system_message
from fabfold.progress import Progress

if TYPE_CHECKING:
    import viser

__all__ = ["PageTasks", "StoppedError", "escaped", "table"]

_TITLES = {
    "solid": "Reading the model",
    "voxelize": "Cutting voxels",
    "fit": "Searching trees that fold",
    "pareto": "Searching the Pareto list",
    "pictures": "Drawing the solutions",
    "early": "A first kit",
    "fold": "Taking the path",
    "join": "Making bodies and hinges",
    "check": "Checking",
    "export": "Writing the kit",
}


class StoppedError(Exception):
    """The stop button was pressed."""


class PageTasks:
    """A queue of work, and what the page shows of it.

    Parameters
    ----------
    server : viser.ViserServer
        Whose page it is.
    """

    def __init__(self, server: viser.ViserServer) -> None:
        self._queue: queue.Queue[tuple[str, Callable[[], None]] | None] = queue.Queue()
        self._stop = threading.Event()
        self._server = server
        gui: Any = server.gui
        self._line = gui.add_markdown("Ready.")
        self._bar = gui.add_progress_bar(0.0, visible=False)
        self._button = gui.add_button("Stop", visible=False)
        self._button.on_click(lambda _: self.stop())
        self.busy = False

    def start(self, title: str, work: Callable[[], None]) -> None:
        """Put work at the end of the queue."""
        self._queue.put((title, work))

    def go_on(self) -> None:
        """Let what is left of stopped work be done: to keep what it has found."""
        self._stop.clear()

    def stop(self) -> None:
        """Stop the work that is going on at its next word of progress."""
        self._stop.set()

    def end(self) -> None:
        """Let :meth:`run` return once it is done with what it does."""
        self.stop()
        self._queue.put(None)

    @property
    def stopping(self) -> bool:
        """Whether the work that is going on should end."""
        return self._stop.is_set()

    def run(self, *, idle: Callable[[], None] = lambda: None, every: float = 0.25) -> None:
        """Do all work, until :meth:`end`.

        Parameters
        ----------
        idle : callable
            Called while there is nothing to do.
        every : float
            How often, seconds.
        """
        while True:
            try:
                entry = self._queue.get(timeout=every)
            except queue.Empty:
                idle()
                continue
            if entry is None:
                return
            self._do(*entry)

    def _do(self, title: str, work: Callable[[], None]) -> None:
        self._stop.clear()
        self.busy = True
        self.say(f"{title} …")
        self._button.visible = True
        try:
            work()
        except StoppedError:
            self.say(f"{title}: stopped. What is done is kept.")
        except FabfoldError as error:
            self.say(f"**{title}:** {escaped(harmless(str(error)))}")
        except OSError as error:
            self.say(f"**{title}:** {escaped(harmless(system_message(error)))}")
        else:
            self.say(f"{title}: done.")
        finally:
            self.busy = False
            self._bar.visible = self._button.visible = False

    def say(self, text: str) -> None:
        """Show a line of Markdown."""
        self._line.content = text

    def tell(self, share: float | None, message: str) -> None:
        """Show how far the work is; raises where it was stopped."""
        if self._stop.is_set():
            raise StoppedError
        self._bar.visible = share is not None
        if share is not None:
            self._bar.value = 100.0 * min(max(share, 0.0), 1.0)
        if message:
            self.say(escaped(message))

    @contextmanager
    def stage(self, name: str) -> Iterator[Progress]:
        """Progress of a stage of the kit (:class:`fabfold.progress.Listener`)."""
        base, _, number = name.partition("-")
        title = _TITLES.get(base, base) + (f", round {int(number) + 1}" if number else "")
        if threading.current_thread() is not threading.main_thread():
            yield _Elsewhere()  # The early kit; the search beside it has the line.
            return
        yield _OnPage(self, title)


class _OnPage:
    def __init__(self, tasks: PageTasks, title: str) -> None:
        self._tasks, self._title = tasks, title

    def update(self, share: float | None, message: str = "") -> None:
        """Show it."""
        self._tasks.tell(share, f"{self._title}: {message}" if message else self._title)


class _Elsewhere:
    def update(self, share: float | None, message: str = "") -> None:
        """Show nothing."""


def escaped(text: str) -> str:
    """Text whose signs mean nothing to Markdown and HTML."""
    for sign, name in (("&", "&amp;"), ("<", "&lt;"), (">", "&gt;")):
        text = text.replace(sign, name)
    for sign in "\\`*_{}[]#|~":
        text = text.replace(sign, f"\\{sign}")
    return text


def table(head: list[str], rows: list[list[Any]]) -> str:
    """An HTML table of plain texts."""
    from html import escape

    cell = "padding:2px 8px 2px 0;text-align:left;font-size:13px"
    lines = ["".join(f'<th style="{cell}">{escape(str(text))}</th>' for text in head)]
    lines += ["".join(f'<td style="{cell}">{escape(str(text))}</td>' for text in r) for r in rows]
    body = "".join(f"<tr>{line}</tr>" for line in lines)
    return f'<div style="max-height:300px;overflow:auto"><table>{body}</table></div>'
