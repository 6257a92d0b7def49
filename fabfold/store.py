"""What a kit folder remembers of the stages that are done, so that a stopped run goes on."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
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

    Parameters
    ----------
    folder : Path or None
        The kit folder; None keeps nothing.
    """

    def __init__(self, folder: Path | None) -> None:
        self.folder = None if folder is None else folder / "stages"
        self._journal: dict[str, dict[str, Any]] = {}
        if self.folder is not None:
            self._journal = self._read(self.folder / "journal.json")

    @staticmethod
    def _read(path: Path) -> dict[str, dict[str, Any]]:
        if not path.is_file():
            return {}
        try:
            data = json.loads(path.read_text(encoding="utf-8"))
            if data["format"] == _FORMAT and data["version"] == 1:
                return dict(data["stages"])
        except (OSError, ValueError, KeyError, TypeError):
            pass
        raise KitError(f"{path}: not a journal of stages; remove the folder {path.parent} to go on")

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
        self._journal[stage] = {
            "key": key,
            "files": {name: sha256_of(self.folder / name) for name in sorted(files)},
        }
        stages = {name: self._journal[name] for name in sorted(self._journal)}
        write_json(
            self.folder / "journal.json", {"format": _FORMAT, "version": 1, "stages": stages}
        )
