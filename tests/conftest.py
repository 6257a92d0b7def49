"""What many tests share: one small model with its kit, and trees, each made once a session.

Whoever changes a kit copies its folder. Imports stand inside the fixtures, since the tests of
`hinges` also run where nothing else is installed.
"""

from __future__ import annotations

import fcntl
import os
import pickle
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from fabfold.kit.kit import Kit
    from fabfold.tree.candidate import Candidate

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


@contextmanager
def _in_turn(factory: pytest.TempPathFactory, name: str) -> Iterator[Path]:
    """A place that the processes of a session share; one at a time looks whether it is filled."""
    # Each process has a folder of its own, all of them in one folder.
    home = factory.getbasetemp()
    home = home.parent if home.name.startswith("popen-") else home
    with (home / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield home / name


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

    with _in_turn(tmp_path_factory, "bar-kit") as folder:
        kit = Kit.from_model(bar, folder=folder, workers=1, **bar_options)
        if not (folder / "report.json").is_file():
            kit.export()
    return kit


@pytest.fixture(scope="session")
def searched(bar_kit: Kit) -> Callable[[Path], Path]:
    """Begins a folder with the stages of the bar's kit, so that another kit need not search."""

    def begin(folder: Path) -> Path:
        assert bar_kit.folder is not None
        shutil.copytree(bar_kit.folder / "stages", folder / "stages")
        return folder

    return begin


@pytest.fixture(scope="session")
def animal_trees(tmp_path_factory: pytest.TempPathFactory) -> list[Candidate]:
    """Trees of an animal of many hinges, best first; read only."""
    from tree_cases import searched_animal

    with _in_turn(tmp_path_factory, "animal-trees") as path:
        if not path.is_file():
            path.write_bytes(pickle.dumps(searched_animal()))
        return list(pickle.loads(path.read_bytes()))
