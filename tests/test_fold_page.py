"""``fold.html`` in a real browser: it plays, and bodies are where the path has them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from browsers import chromium

from fabfold.export.glb import pivots_mm
from fabfold.guide.fold_steps import turned
from fabfold.guide.manual import plan_steps

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as opened:
        yield opened


@pytest.fixture
def page(browser: Any, bar_kit: Any) -> Iterator[Any]:
    """The page, opened from its file; what it says and asks for is kept."""
    shown = browser.new_page(viewport={"width": 900, "height": 700})
    shown.said, shown.asked = [], []
    shown.on("console", lambda message: shown.said.append(message.text))
    shown.on("pageerror", lambda error: shown.said.append(str(error)))
    shown.on("request", lambda request: shown.asked.append(request.url))
    shown.goto((bar_kit.folder / "fold.html").as_uri())
    shown.wait_for_selector("body[data-ready=yes]", timeout=60_000)
    yield shown
    assert [text for text in shown.said if "GPU stall" not in text] == []
    assert [url for url in shown.asked if not url.startswith("file:")] == []
    shown.close()


def places(page: Any) -> np.ndarray:
    """World matrices (b, 4, 4) of the bodies on the page, which stand at their hinges."""
    found = page.evaluate(
        "() => fold.nodes.map(node => { node.updateWorldMatrix(true, false); "
        "return node.matrixWorld.elements.slice(); })"
    )
    return np.array(found, dtype=float).reshape(-1, 4, 4).transpose(0, 2, 1)


def test_bodies_are_where_the_path_has_them(page: Any, bar_kit: Any) -> None:
    built = bar_kit.join()
    joinery, tree = built.joinery, built.planned.tree
    plan = plan_steps(joinery, tree, built.planned.motion, built.planned.voxels.rotation.T)
    pivots = pivots_mm(joinery, tree)
    for index, step in enumerate(plan.steps):
        for share in (0.0, 0.4, 0.999):
            page.evaluate("time => fold.show(time)", index + share)
            wanted = turned(step, share)
            wanted[:, :3, 3] += np.einsum("bij,bj->bi", wanted[:, :3, :3], pivots)
            assert np.abs(places(page) - wanted).max() < 1e-3
    page.evaluate("time => fold.show(time)", len(plan.steps))
    assert page.inner_text("#step") == "Done"


def wait(page: Any, seen: Callable[[], bool]) -> None:
    """Until something is seen; the page forbids code of strings, as others wait by."""
    for _ in range(300):
        if seen():
            return
        page.wait_for_timeout(100)
    raise AssertionError("it was not seen within 30 s")


def test_buttons_keys_and_slider(page: Any, bar_kit: Any) -> None:
    count = len(bar_kit.join().planned.motion.moves) - 1
    assert page.inner_text("#step") == "The model"
    page.click("#next")
    wait(page, lambda: page.inner_text("#step").startswith("Step 2"))
    page.keyboard.press("ArrowLeft")
    wait(page, lambda: page.inner_text("#step") == "The model")
    page.keyboard.press("End")
    assert page.inner_text("#step") == "Done"
    page.evaluate(
        "() => { const s = document.getElementById('time'); s.value = 0.01; "
        "s.oninput({ target: s }); }"
    )
    assert page.inner_text("#step") == f"Step 1 of {count}"
    page.keyboard.press("Home")
    page.click("#play")
    wait(page, lambda: float(page.input_value("#time")) > 0.02)
    page.click("#play")
    assert page.inner_text("#play") == "Play"


def test_the_kit_is_drawn_and_turns_under_a_finger(page: Any) -> None:
    def picture() -> bytes:
        page.wait_for_timeout(400)
        return bytes(page.screenshot(clip={"x": 100, "y": 100, "width": 700, "height": 380}))

    page.evaluate("() => { fold.show(0); fold.settle(); }")
    first = picture()
    colours = page.evaluate(
        "() => { const c = document.querySelector('canvas'); return [c.width, c.height]; }"
    )
    assert min(colours) > 100
    page.mouse.move(450, 300)
    page.mouse.down()
    page.mouse.move(560, 340, steps=4)
    page.mouse.up()
    second = picture()
    assert first != second
    assert page.get_attribute("#follow", "aria-pressed") == "false"
