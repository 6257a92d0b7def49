"""The pages and the docstrings say what is true: their code runs, their files are there."""

from __future__ import annotations

import doctest
import importlib
import re
import shutil
from pathlib import Path

import pytest

HOME = Path(__file__).parents[1]
PAGES = [HOME / "README.md", *sorted((HOME / "docs").glob("*.md"))]
#: What takes minutes, or a cluster, and what stands in for it here.
STAND_INS = {
    ', effort="quick"': "",
    'from_model("sample:car"': 'from_model("bar.stl", template="box-2x2x2", effort="quick"',
    'load_template("box-4x4x4")': 'load_template("box-2x2x2")',
    "size=(1600, 1200), samples=3": "size=(320, 240)",
    'seconds=60, scheduler="tcp://host:8786"': "seconds=0",
}
WITH_EXAMPLES = sorted(
    path
    for room in ("fabfold", "hinges")
    for path in (HOME / room).rglob("*.py")
    if ">>> " in path.read_text(encoding="utf-8")
)


def code_of(page: Path) -> str:
    """The page's Python blocks, one after the other, each on the lines where it stands."""
    lines, inside = [], False
    for line in page.read_text(encoding="utf-8").splitlines():
        fence = line.startswith("```")
        lines.append(line if inside and not fence else "")
        inside = line == "```python" or (inside and not fence)
    return "\n".join(lines)


@pytest.mark.slow
@pytest.mark.parametrize(
    "page", [page for page in PAGES if code_of(page).strip()], ids=lambda page: page.name
)
def test_the_code_of_a_page_runs(page, bar, bar_kit, tmp_path, monkeypatch):
    shutil.copy(bar, tmp_path / "bar.stl")
    shutil.copy(bar, tmp_path / "bunny.stl")
    shutil.copytree(bar_kit.folder, tmp_path / "car-kit")
    monkeypatch.chdir(tmp_path)
    code = code_of(page)
    for original, stand_in in STAND_INS.items():
        code = code.replace(original, stand_in)
    exec(compile(code, page, "exec"), {"__name__": "__main__"})


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, marks=[pytest.mark.slow] * (path.stem == "cadquery"))
        for path in WITH_EXAMPLES
    ],
    ids=lambda path: str(path.relative_to(HOME)),
)
def test_the_examples_of_a_module_are_right(path):
    parts = path.relative_to(HOME).with_suffix("").parts
    module = importlib.import_module(".".join(part for part in parts if part != "__init__"))
    failed, tried = doctest.testmod(module, optionflags=doctest.NORMALIZE_WHITESPACE)
    assert failed == 0
    assert tried > 0


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_what_a_page_links_to_is_there(page):
    targets = re.findall(r"\]\((?!https?:)([^)#]*)(#[^)]*)?\)", page.read_text(encoding="utf-8"))
    missing = []
    for path, anchor in targets:
        target = page.parent / path if path else page
        if not target.exists() or (anchor and anchor not in anchors_of(target)):
            missing.append(path + anchor)
    assert missing == []


def anchors_of(page: Path) -> set[str]:
    """Anchors of a page's headings, as a forge makes them."""
    heads = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {"#" + re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


def test_files_named_in_the_pages_are_there():
    """Paths in backticks that begin with a folder of the checkout."""
    folders = "|".join(sorted(p.name for p in HOME.iterdir() if p.is_dir() and p.name[0] != "."))
    missing = []
    for page in PAGES:
        named = re.findall(rf"`((?:{folders})/[\w./-]*)`", page.read_text(encoding="utf-8"))
        missing += [f"{page.name}: {name}" for name in named if not (HOME / name).exists()]
    assert missing == []
