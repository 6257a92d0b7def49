"""Draw the picture of docs/studio.md: python docs/draw_studio.py [KIT].

KIT is a kit folder whose bodies are made; without it the sample car's is made, in some minutes. The
page is drawn by Chromium, which must be installed, as must playwright.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
import threading
from pathlib import Path

from fabfold.kit.kit import Kit
from fabfold.studio.serve import Studio, serve

PICTURES = Path(__file__).parent / "pictures"


def draw(studio: Studio) -> None:
    """Open the page, fold half way, and keep what is seen; ends the studio."""
    from playwright.sync_api import sync_playwright

    graphics = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    try:
        with sync_playwright() as play:
            browser = play.chromium.launch(
                executable_path=shutil.which("chromium"), args=["--no-sandbox", *graphics]
            )
            page = browser.new_page(viewport={"width": 1300, "height": 760})
            page.goto(studio.gate.address)
            page.get_by_text("Opening: done.").wait_for(timeout=120_000)
            # The browser's note about its software graphics.
            page.locator(".mantine-Notification-closeButton").click()
            motion = studio.page.fold.motion
            studio.page.fold.set_moment(0.3 * (len(motion.moves) - 1) if motion else 0.0)
            page.get_by_text("Hinges", exact=True).click()
            page.wait_for_timeout(4000)
            page.screenshot(path=PICTURES / "studio.png")
            browser.close()
    finally:
        studio.page.tasks.end()


def main() -> None:
    """Draw the picture."""
    if len(sys.argv) > 1:
        folder = sys.argv[1]
    else:
        folder = str(Path(tempfile.mkdtemp()) / "car-kit")
        Kit.from_model("sample:car", folder=folder).join()
    studio = serve(folder)
    thread = threading.Thread(target=draw, args=(studio,))
    thread.start()
    studio.page.tasks.run()
    thread.join()
    studio.close()


if __name__ == "__main__":
    main()
