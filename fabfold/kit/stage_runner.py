"""How a stage is run: once, with its progress shown and its cost counted, and kept."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

from fabfold.progress import Listener, Progress, SilentListener, processor_seconds
from fabfold.store import StageStore
from fabfold.toml_files import TomlError, read_toml
from fabfold.version import __version__

__all__ = ["StageRunner"]

Result = TypeVar("Result")


def _made_by_another(store: StageStore) -> str:
    """A sentence about a kit that another version of this program has made; empty otherwise."""
    if store.folder is None:
        return ""
    path = store.folder.parent / "kit.toml"
    try:
        version = read_toml(path)[0].get("fabfold", __version__) if path.is_file() else __version__
    except (TomlError, OSError):  # Told where it is read as a recipe.
        return ""
    if version == __version__:
        return ""
    return (
        f"{path}: made by fabfold {version}, this is {__version__}; what this one makes otherwise "
        "is made again, and the kit may come out different"
    )


class StageRunner:
    """Runs stages and keeps their results, in memory and in the kit folder.

    Parameters
    ----------
    store : StageStore
        Finished stages in the kit folder.

    Attributes
    ----------
    listener : Listener
        Is shown the progress of each stage.
    processor_seconds : dict of str to float
        What each stage that was made, and not read from the folder, has cost so far, with the
        processes that it started.
    """

    def __init__(self, store: StageStore) -> None:
        self.listener: Listener = SilentListener()
        self.processor_seconds: dict[str, float] = {}
        self._store = store
        self._stranger = _made_by_another(store)
        self._results: dict[str, Any] = {}
        self._unsaved: list[Callable[[], None]] = []
        # The first kit's thread accepts too.
        self._accepting = threading.RLock()

    @property
    def damage(self) -> str:
        """What of the kit folder cannot be used and is made again; empty where all can."""
        return "; ".join(text for text in (self._store.damage, self._stranger) if text)

    def _accept(self) -> None:
        """Change the kit folder for what was made; called once its input is known to be good."""
        with self._accepting:
            while self._unsaved:
                self._unsaved.pop(0)()

    def _spent(self) -> float:
        """Processor seconds so far that a stage may have cost."""
        return processor_seconds()

    @contextmanager
    def _open_progress(self, name: str) -> Iterator[Progress]:
        """Progress of a stage that is about to be made."""
        start = self._spent()
        try:
            with self.listener.stage(name) as progress:
                yield progress
        finally:
            stage = name.partition("-")[0]  # the rounds of the search are numbered
            spent = self.processor_seconds.get(stage, 0.0)
            self.processor_seconds[stage] = spent + self._spent() - start

    def _once(self, name: str, make: Callable[[], Result]) -> Result:
        """What `make` gives, made the first time and kept in memory."""
        if name not in self._results:
            self._results[name] = make()
        result: Result = self._results[name]
        return result

    def _is_done(self, name: str, key: str) -> bool:
        """Whether the result of a stage is in memory or in the kit folder."""
        return name in self._results or self._store.holds(name, key)

    def _stage(
        self,
        name: str,
        key: str,
        make: Callable[[Progress], Result],
        save: Callable[[StageStore, Result], list[str]],
        load: Callable[[StageStore, list[str]], Result],
        *,
        on_trial: bool = False,
    ) -> Result:
        """Result of a stage: from memory, from the kit folder, or made now and kept.

        One `on_trial` is kept once a later one has shown that something can be made of it.
        """
        if name in self._results:
            result: Result = self._results[name]
            return result
        if self._is_done(name, key):
            result = load(self._store, self._store.files(name))
        else:
            with self._open_progress(name) as progress:
                result = make(progress)
            if self._store.folder is not None:
                self._unsaved.append(
                    lambda: self._store.record(name, key, save(self._store, result))
                )
        if not on_trial:
            self._accept()
        self._results[name] = result
        return result
