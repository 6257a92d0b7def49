"""``fabfold studio`` as a person uses it: the command, and its page in a real browser."""

from __future__ import annotations

import json
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from browsers import chromium

from fabfold.kit.kit import open_kit

pytestmark = pytest.mark.slow

WAIT_MS = 60_000


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as opened:
        yield opened


@pytest.fixture
def studio(bar_kit: Any, tmp_path: Any, browser: Any) -> Iterator[Any]:
    """The page of a copy of the bar's kit, with its folder; what it says and asks for is kept."""
    folder = tmp_path / "bar-kit"
    shutil.copytree(bar_kit.folder, folder)
    command = [sys.executable, "-m", "fabfold", "studio", str(folder), "--no-browser"]
    run = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert run.stdout is not None
    line = run.stdout.readline()
    address = re.search(r"http://127\.0\.0\.1:\d+/\?token=\S+", line)
    assert address is not None, line
    page = browser.new_page(viewport={"width": 1300, "height": 850})
    page.said, page.asked = [], []
    page.on("pageerror", lambda error: page.said.append(str(error)))
    page.on("request", lambda request: page.asked.append(request.url))
    page.on("websocket", lambda socket: page.asked.append(socket.url))
    page.goto(address[0])
    page.get_by_text("Opening: done.").wait_for(timeout=WAIT_MS)
    yield page, folder, address[0]
    page.close()
    run.send_signal(signal.SIGTERM)  # a shell may have its children ignore SIGINT
    _, told = run.communicate(timeout=30)
    assert run.returncode == 130, told
    assert page.said == []
    here = address[0].split("/?")[0].removeprefix("http://")
    for url in page.asked:
        assert re.match(rf"(blob:)?(http|ws)://{re.escape(here)}/|data:", url), url


def picture(page: Any, until: Callable[[np.ndarray], bool]) -> np.ndarray:
    """What the scene shows, pixels left of the panel, once that is so and it stands still."""
    import io

    from PIL import Image

    def shot() -> np.ndarray:
        image = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
        return np.asarray(image)[:, :920].astype(int)

    # A busy machine draws late; what does not come at all is for the caller to say.
    before = shot()
    for _ in range(WAIT_MS // 250):
        page.wait_for_timeout(250)
        now = shot()
        if np.array_equal(before, now) and until(now):
            break
        before = now
    return now


def changed(pixels: np.ndarray, before: np.ndarray) -> int:
    """Pixels of clearly another colour."""
    return int((np.abs(pixels - before).max(axis=2) > 40).sum())


def is_drawn(pixels: np.ndarray) -> bool:
    """Whether bodies are seen, and not the empty scene alone."""
    return coloured(pixels) > 10_000


def coloured(pixels: np.ndarray) -> int:
    """Pixels of clear colour."""
    return int((pixels.max(axis=2) - pixels.min(axis=2) > 40).sum())


def middle(pixels: np.ndarray, left_half: bool = False) -> tuple[int, int]:
    """Place (x, y) of the coloured pixel nearest to the middle of all, or of those to the left."""
    # Five more around it are coloured too: no edge and no gap between two bodies.
    found = pixels.max(axis=2) - pixels.min(axis=2) > 40
    inner = np.minimum.reduce(
        [np.roll(found, (i, j), (0, 1)) for i in range(-5, 6) for j in range(-5, 6)]
    )
    rows, columns = np.nonzero(inner)
    if left_half:
        keep = columns < np.median(columns)
        rows, columns = rows[keep], columns[keep]
    away = np.hypot(rows - np.median(rows), columns - np.median(columns))
    return int(columns[away.argmin()]), int(rows[away.argmin()])


def press(page: Any, name: str) -> None:
    page.get_by_role("button", name=name, exact=True).click()


def tab(page: Any, name: str) -> None:
    page.get_by_role("tab", name=name, exact=True).click()


def test_it_is_scrubbed_and_stepped_and_bodies_are_clicked(studio: Any) -> None:
    page, _, _ = studio
    closed = picture(page, is_drawn)
    assert is_drawn(closed)
    press(page, "B")
    box = picture(page, lambda now: changed(now, closed) > 5_000)
    assert changed(box, closed) > 5_000
    press(page, "◀")
    assert page.get_by_text(re.compile(r"Move \d of \d")).is_visible()
    press(page, "A")
    again = picture(page, lambda now: changed(now, closed) < 500)
    assert changed(again, closed) < 500
    # A click in the middle of the bar meets a body, and greys the others.
    page.mouse.click(*middle(closed))
    page.get_by_text(re.compile(r"body-\d\d: \d voxels, voxel \d clicked")).wait_for(
        timeout=WAIT_MS
    )
    grey = picture(page, lambda now: coloured(now) < coloured(closed))
    assert coloured(grey) < coloured(closed)


def test_a_region_is_painted_and_undone(studio: Any) -> None:
    page, folder, _ = studio
    tab(page, "Wish")
    press(page, "Model")
    page.get_by_text("brush", exact=True).click()
    page.wait_for_timeout(500)
    page.mouse.click(460, 425)
    page.get_by_text(re.compile(r"protected: sphere\(")).wait_for(timeout=WAIT_MS)
    kept = (folder / "stages" / "studio.json").read_text(encoding="utf-8")
    assert "sphere(" in kept
    page.get_by_text("Steps").click()
    press(page, "undo")
    page.get_by_text("nothing protected").wait_for(timeout=WAIT_MS)


def test_a_grid_is_placed_by_hand_and_searched(studio: Any) -> None:
    page, folder, _ = studio
    tab(page, "Grid")
    press(page, "Grid")
    page.get_by_text(re.compile(r"\d+ cells for 8")).wait_for(timeout=WAIT_MS)
    for place, value in ((6, "10"), (3, "5")):  # pitch, and the origin along x
        page.locator("input").filter(visible=True).nth(place).fill(value)
        page.keyboard.press("Enter")
    page.get_by_text(re.compile(r"8 cells for 8, 8 full")).wait_for(timeout=WAIT_MS)
    press(page, "Use this grid")
    page.get_by_text("grid by hand: done.").wait_for(timeout=WAIT_MS)
    tab(page, "Search")
    press(page, "Search")
    page.get_by_text("Search: done.").wait_for(timeout=WAIT_MS)
    told = page.get_by_text(re.compile(r"\d hinges, \d moves, box closed to \d+ %"))
    assert told.filter(visible=True).count() >= 1
    recipe = open_kit(str(folder)).recipe
    assert recipe.pitch == 10.0
    assert len(open_kit(str(folder)).fold().tree.hinges) >= 1


def test_forces_fold_it_with_a_persons_help(studio: Any) -> None:
    page, folder, _ = studio
    before = open_kit(str(folder)).fold().motion
    kit = picture(page, is_drawn)
    tab(page, "Force")
    press(page, "Begin")
    press(page, "Forces")
    page.get_by_text("0 actions; A and B are up to 180° apart").wait_for(timeout=WAIT_MS)
    shown = picture(page, lambda now: coloured(now) > 1_000 and changed(now, kit) > 5_000)
    x, y = middle(shown, left_half=True)
    page.mouse.click(x, y)
    page.get_by_text(re.compile(r"Voxel \d of A chosen")).wait_for(timeout=WAIT_MS)
    # A drag pulls at once, and is recorded.
    page.mouse.move(x, y)
    page.mouse.down()
    for step in range(1, 9):
        page.mouse.move(x, y - 12 * step)
        page.wait_for_timeout(150)
    page.mouse.up()
    page.get_by_text("Pulling: done.").wait_for(timeout=WAIT_MS)
    told = page.get_by_text(re.compile(r"\d+ actions?; A and B are up to \d+° apart")).inner_text()
    assert int(told.split()[0]) >= 3  # a push, a wait, and the end of the push
    press(page, "push")
    press(page, "carve")
    press(page, "unfold")
    page.get_by_text("Unfolding: done.").wait_for(timeout=WAIT_MS)
    unfolded = picture(page, lambda now: changed(now, shown) > 5_000)
    assert changed(unfolded, shown) > 5_000
    press(page, "Release pushes and pins")
    press(page, "match")
    page.get_by_text(re.compile(r"A and B have met")).wait_for(timeout=WAIT_MS)
    press(page, "Use this path")
    page.get_by_text("Path: done.").wait_for(timeout=WAIT_MS)
    opened = open_kit(str(folder))
    assert opened.recipe.method == "physics"
    assert np.allclose(opened.fold().motion.angles_deg[-1], before.angles_deg[-1])


def test_it_is_checked_and_exported(studio: Any) -> None:
    page, folder, _ = studio
    shutil.rmtree(folder / "bodies")
    tab(page, "Size")
    assert page.get_by_text(re.compile(r"Box 40 × 40 × 40 mm")).is_visible()
    tab(page, "Check")
    press(page, "Export the kit")
    page.get_by_text(re.compile(r"Export: done\.")).wait_for(timeout=WAIT_MS)
    assert page.get_by_text(re.compile(r"All \d+ passed")).is_visible()
    assert len(list((folder / "bodies").iterdir())) == len(open_kit(str(folder)).fold().tree.bodies)


def test_a_person_chooses_how_it_is_printed_and_held_shut(studio: Any) -> None:
    page, folder, _ = studio
    tab(page, "Print")
    for label, value in (("in place, as", "the box"), ("held shut by", "magnet")):
        page.get_by_label(label, exact=True).click()
        page.get_by_role("option", name=value, exact=True).click()
    press(page, "Print it like this")
    page.get_by_text("printed auto, held by magnet: done.").wait_for(timeout=WAIT_MS)
    kept = json.loads((folder / "stages" / "studio.json").read_text())
    recipe = kept["steps"][kept["place"]]["recipe"]
    assert (recipe["pose"], recipe["retention"]) == ("b", "magnet")
    # What a printer cannot do is said where it was asked for.
    page.get_by_label("held shut by", exact=True).click()
    page.get_by_role("option", name="friction", exact=True).click()
    press(page, "Print it like this")
    page.get_by_text(re.compile("--print apart")).first.wait_for(timeout=WAIT_MS)


def test_without_the_key_there_is_no_page(studio: Any, browser: Any) -> None:
    _, _, address = studio
    stranger = browser.new_context().new_page()
    answer = stranger.goto(address.split("?")[0])
    assert answer.status == 403
    stranger.close()
