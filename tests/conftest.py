"""What many tests share: one small model, and its kit, which is made once a session.

Whoever changes a kit copies its folder. Imports stand inside the fixtures, since the tests of
`hinges` also run where nothing else is installed.
"""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from fabfold.kit.kit import Kit

#: Length and thickness of the bar, in its own units: eight chunky voxels in a row.
BAR = (80.0, 9.6, 9.6)


#: Files that take longest: a process that begins with one is not the last to end.
_LONGEST = ("test_studio_page", "test_examples", "test_faults", "test_robust", "test_retention")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run the longest files first; the others keep their order."""
    items.sort(key=lambda item: item.path.stem not in _LONGEST)


@pytest.fixture(autouse=True)
def _own_environment() -> Iterator[None]:
    """What a test, or the command line that it calls, sets in the environment ends with it."""
    before = dict(os.environ)
    yield
    if dict(os.environ) != before:
        os.environ.clear()
        os.environ.update(before)


@pytest.fixture(scope="session")
def bar(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Model file of a chunky bar that is eight voxels long."""
    import trimesh

    path = tmp_path_factory.mktemp("model") / "bar.stl"
    trimesh.creation.box(BAR).export(path)
    return path


@pytest.fixture(scope="session")
def bar_options() -> dict[str, Any]:
    """Recipe of the bar's kit."""
    return {"template": "box-2x2x2", "effort": "quick", "seed": 1}


@pytest.fixture(scope="session")
def bar_kit(
    bar: Path, bar_options: dict[str, Any], tmp_path_factory: pytest.TempPathFactory
) -> Kit:
    """The bar's kit, exported; read only."""
    from fabfold.kit.kit import Kit

    # The processes of one session have folders of their own in one folder, and share the kit.
    home = tmp_path_factory.getbasetemp()
    home = home.parent if home.name.startswith("popen-") else home
    folder = home / "bar-kit"
    with (home / "bar-kit.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        kit = Kit.from_model(bar, folder=folder, workers=1, **bar_options)
        if not (folder / "report.json").is_file():
            kit.export()
    return kit
