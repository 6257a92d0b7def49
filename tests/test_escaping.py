"""Names from somebody's files stay names: in pages, in XML, in STEP and on the terminal."""

from __future__ import annotations

import contextlib
import io
import json
import re
import xml.etree.ElementTree as ET
import zipfile
from html.parser import HTMLParser

import pytest
from test_robust import command

from fabfold.errors import harmless
from fabfold.kit.kit import Kit, open_kit
from fabfold.printing.checks import Check
from fabfold.recipe.recipe import make_recipe

#: A file may be called so; a name of a part may hold what a file's cannot.
NAME = "a'<b onload=x>&amp;\"]]>[red]b[red]#1=X('');ü漢\x1b[31m\u202e\nz"
PLAIN = "".join(c if c.isprintable() else "_" for c in NAME)


@pytest.fixture(scope="module")
def folder(searched, bar, bar_options, tmp_path_factory):
    """The kit of a model with such a name."""
    home = tmp_path_factory.mktemp("named")
    model = home / f"{NAME}.stl"
    model.write_bytes(bar.read_bytes())
    kit = Kit.from_model(model, folder=searched(home / "kit"), workers=1, **bar_options)
    kit.export()
    return kit.folder


@pytest.mark.slow
def test_the_kit_is_whole_and_opens_again(folder):
    assert (folder / f"{PLAIN}.step").is_file()
    assert all(check.ok for check in open_kit(folder).check())


@pytest.mark.slow
def test_xml_holds_the_name_as_a_text(folder):
    for ending in (".3mf", "-bambu.3mf"):
        with zipfile.ZipFile(folder / f"{PLAIN}{ending}") as archive:
            texts = [archive.read(name) for name in archive.namelist()]
        for text in texts:
            if text.lstrip()[:1] == b"<":
                ET.fromstring(text)
        assert any(b"&lt;b onload=x&gt;" in text for text in texts)
        assert not any(b"<b onload" in text for text in texts)
    assert ET.parse(folder / f"{PLAIN}.urdf").getroot().get("name") == PLAIN


@pytest.mark.slow
def test_step_holds_the_name_as_a_string(folder):
    import build123d

    text = (folder / f"{PLAIN}.step").read_text("ascii")  # Others are written as \X2\...\X0\.
    strings = re.findall(r"'(?:[^']|'')*'", text)
    assert not any("X(" in line for line in re.sub(r"'(?:[^']|'')*'", "", text).splitlines())
    assert any("a''<b onload=x>" in string for string in strings)
    assert any("X(\\X\\27\\X\\27);" in string or "X(''\\X\\27);" in string for string in strings)
    with contextlib.redirect_stdout(io.StringIO()):
        solids = build123d.import_step(folder / f"{PLAIN}.step").solids()
    assert (
        len(solids) == json.loads((folder / "report.json").read_text("utf-8"))["summary"]["bodies"]
    )


class Tags(HTMLParser):
    """The tags of a page, and what their attributes are called."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: set[str] = set()
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found |= {tag, *(name for name, _ in attrs)}


@pytest.mark.slow
def test_pages_hold_the_name_as_a_text(folder):
    pages = sorted(folder.glob("*.html"))
    assert pages
    for page in pages:
        assert not {"b", "onload", "red"} & Tags(page.read_text("utf-8")).found, page.name


def test_the_terminal_shows_commands_instead_of_obeying():
    assert harmless("a\x1b[31mb\x07\u202ec\nd\te") == r"a\x1b[31mb\x07\u202ec" + "\nd\te"
    assert harmless("ü漢 [red]") == "ü漢 [red]"


def test_what_is_refused_is_shown_as_it_is(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "[red]\x1b[31m.stl").write_bytes(b"nothing")
    done = command("inspect", "[red]\x1b[31m.stl")
    assert done.exit_code == 2
    assert r"[red]\x1b[31m.stl" in done.stderr
    assert "\x1b" not in done.stderr + done.stdout


def test_brackets_in_notes_are_no_markup(capsys):
    from fabfold.cli.console import show_checks

    show_checks(
        [Check("[bold]x[/]", 1.0, 2.0, "mm", True, "a[/b]\x1b[0m")], {"f": "[/c]"}, as_json=False
    )
    shown = capsys.readouterr().out
    assert "[bold]x[/]" in shown
    assert r"a[/b]\x1b[0m" in shown
    assert "[/c]: 1 of 1" in shown


def test_files_are_called_without_line_ends():
    assert make_recipe(model="x\ny\x1b.stl", template="box-2x2x2").name == "x_y_"
