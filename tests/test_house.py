"""The house rules: one name for one thing, modules of one job, parameters said in words."""

from __future__ import annotations

import ast
import inspect
import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest

HOME = Path(__file__).parents[1]
MODULES = sorted(path for room in ("fabfold", "hinges") for path in (HOME / room).rglob("*.py"))
#: Files that Python itself gives their names.
PYTHONS_OWN = {"__init__", "__main__"}
SECTIONS = {"Parameters", "Attributes", "Returns", "Yields", "Raises"}


def place_of(path: Path) -> str:
    return str(path.relative_to(HOME))


def nodes_of(path: Path, *kinds: type[ast.AST]) -> Iterator[ast.AST]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return (node for node in ast.walk(tree) if isinstance(node, kinds))


def undescribed(docstring: str) -> list[str]:
    """Entries of a numpydoc docstring's sections under which no description stands."""
    lines = [*inspect.cleandoc(docstring).splitlines(), "", "End", "---"]
    section, entry, found = "", "", []
    for line, below in zip(lines, [*lines[1:], ""], strict=True):
        if re.fullmatch("-{3,}", below):
            section = line
        if line[:1] not in ("", " ", "-"):
            if entry:
                found.append(entry)
            entry = line if section in SECTIONS and line != section else ""
        elif re.search(r"[^\W\d_]{2}", line):
            entry = ""
    return found


def repeated(places: dict[str, list[str]]) -> dict[str, list[str]]:
    return {name: where for name, where in places.items() if len(where) > 1}


def test_no_two_modules_share_a_name() -> None:
    places = defaultdict(list)
    for path in MODULES:
        if path.stem not in PYTHONS_OWN:
            places[path.stem].append(place_of(path))
    assert repeated(places) == {}


def test_no_two_classes_share_a_name() -> None:
    places = defaultdict(list)
    for path in MODULES:
        for node in nodes_of(path, ast.ClassDef):
            places[node.name].append(place_of(path))
    assert repeated(places) == {}


def test_no_module_is_longer_than_500_lines() -> None:
    lengths = {place_of(path): len(path.read_text("utf-8").splitlines()) for path in MODULES}
    assert {place: length for place, length in lengths.items() if length > 500} == {}


@pytest.mark.parametrize(
    ("section", "missing"),
    [
        ("Parameters\n----------\na : int\n    Number of cells.\nb : int\n", ["b : int"]),
        ("Parameters\n----------\na, b : int\nc : float\n    Its size, mm.\n", ["a, b : int"]),
        ("Returns\n-------\nndarray\n\nNotes\n-----\nNothing more.\n", ["ndarray"]),
        ("Yields\n------\nint\n    Numbers.\n", []),
        ("Raises\n------\nModelError\n\n    If it is gone.\nKitError\n", ["KitError"]),
        ("Attributes\n----------\nx : float\n    .\n", ["x : float"]),
        ("Notes\n-----\nwords\n", []),
    ],
)
def test_an_entry_without_description_is_found(section: str, missing: list[str]) -> None:
    indented = "    " + section.replace("\n", "\n    ")
    assert undescribed(f"One line.\n\n{indented}") == missing


def test_every_documented_entry_is_described_in_words() -> None:
    bare = []
    for path in MODULES:
        for node in nodes_of(path, ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef):
            entries = undescribed(ast.get_docstring(node, clean=False) or "")
            name = getattr(node, "name", "the module")
            bare += [f"{place_of(path)}: {name}: {entry}" for entry in entries]
    assert bare == [], "\n" + "\n".join(bare)
