"""What a kit folder remembers of the stages that are done, so that a stopped run goes on."""

from __future__ import annotations

import hashlib
import json
import os
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from fabfold.errors import KitError
from fabfold.files import sha256_of, write_bytes, write_json

__all__ = ["StageStore", "stage_key"]

_FORMAT = "fabfold-stages"


def stage_key(*parts: Any) -> str:
    """Digest of everything that a stage's result depends on (JSON-ready values)."""
    text = json.dumps(parts, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


class StageStore:
    """The folder ``stages/`` of a kit and its journal.

    A stage is done when the journal holds its key and every file that it wrote still has the
    digest it had then; anything else, a half-finished run or a file changed by hand, is done again.
    Several threads may use it.

    Parameters
    ----------
    folder : Path or None
        The kit folder; None keeps nothing.

    Attributes
    ----------
    folder : Path or None
        The folder ``stages``.
    damage : str
        A sentence about a journal that could not be read whole; empty where there is none.

    Raises
    ------
    KitError
        If the journal was written by another version.
    """

    def __init__(self, folder: Path | None) -> None:
        self.folder = None if folder is None else folder / "stages"
        self.damage = ""
        self._journal: dict[str, dict[str, Any]] = {}
        self._names: list[str] = []
        self._delivered: dict[str, str] = {}
        self._lock: int | None = None
        self._users = 0
        self._changing = threading.RLock()
        if self.folder is not None:
            self._read(self.folder / "journal.json")

    def _read(self, path: Path) -> None:
        """Take what is whole in a journal; what is not is done again, and said."""
        try:
            text = path.read_text(encoding="utf-8")
        except FileNotFoundError:
            return
        except UnicodeDecodeError:
            text = ""
        try:
            data = json.loads(text)
        except (ValueError, RecursionError):
            data = None
        if not isinstance(data, dict) or data.get("format") != _FORMAT:
            self.damage = f"{path} was damaged: what it kept is made again"
            return
        if data.get("version") != 1:
            raise KitError(
                f"{path}: written by another version of fabfold (version {data.get('version')!r} "
                "of the journal, this one reads 1); use that one, or give a new folder"
            )
        stages = data.get("stages")
        for stage, entry in stages.items() if isinstance(stages, dict) else ():
            if _is_entry(entry):
                self._journal[stage] = entry
        if not isinstance(stages, dict) or len(self._journal) < len(stages):
            self.damage = f"{path} was damaged in places: what those kept is made again"
        names, digests = data.get("names", []), data.get("delivered", {})
        if isinstance(names, list):
            self._names = [name for name in names if isinstance(name, str)]
        if isinstance(digests, dict) and all(isinstance(one, str) for one in digests.values()):
            self._delivered = digests

    @contextmanager
    def locked(self) -> Iterator[None]:
        """While it is open, no other run may change the kit folder; it may be opened twice.

        A folder that is not there yet is locked by :meth:`take` once it is.

        Raises
        ------
        KitError
            If another run is at work in the folder.
        """
        self._users += 1
        try:
            if self.folder is not None and self.folder.parent.is_dir():
                self.take()
            yield
        finally:
            self._users -= 1
            if self._users == 0 and self._lock is not None:
                os.close(self._lock)
                self._lock = None

    def take(self) -> None:
        """Make the kit folder where it is missing, lock it, and sweep what a killed run left.

        Raises
        ------
        KitError
            If another run is at work in the folder.
        """
        with self._changing:
            if self.folder is None or self._lock is not None or self._users == 0:
                return
            kit = self.folder.parent
            kit.mkdir(parents=True, exist_ok=True)
            try:
                self._lock = _lock_folder(kit)
            except BlockingIOError:
                raise KitError(
                    f"{kit}: another run is at work in this folder; wait until it ends, or give "
                    "another folder with --output"
                ) from None
            for left in sorted(kit.rglob(".part-*")):
                left.unlink(missing_ok=True)

    def path(self, name: str) -> Path:
        """Path of the file `name` in the store.

        Raises
        ------
        KitError
            If this store keeps nothing.
        """
        if self.folder is None:
            raise KitError("this kit has no folder to keep stages in")
        return self.folder / name

    def keep(self, file: Path, sha256: str, name: str) -> Path:
        """Copy an input into folder `name` of the store, so that the recipe alone makes the kit.

        Returns
        -------
        Path
            The copy; `file` itself if this store keeps nothing.
        """
        if self.folder is None:
            return file
        kept = self.path(name) / file.name
        if not (kept.is_file() and sha256_of(kept) == sha256):
            write_bytes(kept, file.read_bytes())
        return kept

    def files(self, stage: str) -> list[str]:
        """Names of the files that `stage` wrote, sorted."""
        return sorted(self._journal[stage]["files"])

    def holds(self, stage: str, key: str) -> bool:
        """Whether `stage` was done with `key` and its files are as it left them."""
        entry = self._journal.get(stage)
        if self.folder is None or entry is None or entry.get("key") != key:
            return False
        files: dict[str, str] = entry["files"]
        return all(
            (self.folder / name).is_file() and sha256_of(self.folder / name) == digest
            for name, digest in files.items()
        )

    def record(self, stage: str, key: str, files: Iterable[str]) -> None:
        """Note that `stage` is done with `key` and wrote `files` (names in the store)."""
        if self.folder is None:
            return
        entry = {
            "key": key,
            "files": {name: sha256_of(self.folder / name) for name in sorted(files)},
        }
        with self._changing:
            self._journal[stage] = entry
            self._write()

    @property
    def names(self) -> tuple[str, ...]:
        """Names under which kits were written into this folder."""
        return tuple(self._names)

    def record_names(self, names: Iterable[str]) -> None:
        """Note under which names kits are written into this folder."""
        wanted = sorted(set(names))
        with self._changing:
            if self.folder is not None and wanted != self._names:
                self._names = wanted
                self._write()

    @property
    def delivered(self) -> dict[str, str]:
        """Digests of files of the exported kit, by name; empty before an export."""
        return dict(self._delivered)

    def record_delivered(self, digests: dict[str, str]) -> None:
        """Note the digests of files of the exported kit."""
        if self.folder is not None:
            with self._changing:
                self._delivered = dict(digests)
                self._write()

    def _write(self) -> None:
        assert self.folder is not None
        stages = {name: self._journal[name] for name in sorted(self._journal)}
        content: dict[str, Any] = {"format": _FORMAT, "version": 1, "stages": stages}
        if self._names:
            content["names"] = self._names
        if self._delivered:
            content["delivered"] = self._delivered
        write_json(self.folder / "journal.json", content)


def _lock_folder(folder: Path) -> int | None:
    """Lock a folder itself, so that no file tells of it; None where the system has no such locks.

    The lock ends with the process, however that ends.
    """
    try:
        import fcntl
    except ImportError:  # Windows
        return None
    handle = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(handle)
        raise
    except OSError:  # A file system without locks.
        os.close(handle)
        return None
    return handle


def _is_entry(entry: Any) -> bool:
    """Whether an entry of the journal has a key and the digest of at least one file."""
    if not isinstance(entry, dict) or not isinstance(entry.get("key"), str):
        return False
    files = entry.get("files")
    return (
        isinstance(files, dict)
        and len(files) > 0
        and all(
            isinstance(digest, str) and Path(name).name == name for name, digest in files.items()
        )
    )
