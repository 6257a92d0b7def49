"""What a terminal shows of stages, also of those of several threads."""

import io
import threading

import pytest
from rich.console import Console

from fabfold.cli.console import ConsoleListener


@pytest.fixture
def shown():
    """A listener, and what it has written to a terminal."""
    listener, screen = ConsoleListener(), io.StringIO()
    listener._console = Console(file=screen, force_terminal=True, width=120)
    return listener, screen


def test_a_stage_that_outlasts_another_stays_on_the_screen(shown):
    listener, screen = shown
    begun, cut, searching = threading.Event(), threading.Event(), threading.Event()

    def early():
        with listener.stage("early") as progress:
            begun.set()
            assert cut.wait(timeout=60)
            assert searching.wait(timeout=60)
            progress.update(1.0, "13 hinges")

    thread = threading.Thread(target=early)
    with listener.stage("voxelize") as progress:
        thread.start()
        assert begun.wait(timeout=60)
        progress.update(1.0, "48 voxels")
    cut.set()
    with listener.stage("fit-0") as progress:
        progress.update(0.5, "best folding tree 20 hinges")
        searching.set()
        thread.join(timeout=60)
        progress.update(1.0, "best folding tree 16 hinges")
    assert listener._bars is None
    last = screen.getvalue().rpartition("Cutting voxels")[2]
    assert "48 voxels" in last
    assert "13 hinges" in last
    assert "best folding tree 16 hinges" in last


def test_a_display_ends_with_its_stage_and_the_next_has_its_own(shown):
    listener, screen = shown
    for name, message in (("solid", "12 triangles"), ("join", "two bodies")):
        with listener.stage(name) as progress:
            assert listener._bars is not None
            progress.update(1.0, message)
        assert listener._bars is None
    with pytest.raises(KeyboardInterrupt), listener.stage("check"):
        raise KeyboardInterrupt
    assert listener._bars is None
    assert "12 triangles" in screen.getvalue()
    assert "two bodies" in screen.getvalue()
