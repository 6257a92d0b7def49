"""How fluent the studio is: python benchmarks/studio.py KIT ...

Each kit is opened by `fabfold studio` in Chromium and played. Told: processor time of the program
for a picture (poses of all bodies, packed and sent), and the time between two pictures in the
browser beside that of the same page at rest, which draws nothing new. Writes benchmarks/studio.md.
"""

from __future__ import annotations

import shutil
import sys
import threading
import time
from pathlib import Path

import numpy as np

from fabfold.studio.serve import Studio, serve

HERE = Path(__file__).parent
GRAPHICS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader"]
GRAPHICS += ["--enable-unsafe-swiftshader"]
FRAMES = """async seconds => { const times = []; let end = performance.now() + 1000 * seconds;
  await new Promise(done => { const tick = now => { times.push(now);
    if (now < end) requestAnimationFrame(tick); else done(); }; requestAnimationFrame(tick); });
  return times; }"""


def measured(studio: Studio, row: dict[str, float]) -> None:
    """Drive the page, in a thread of its own; ends the studio."""
    from playwright.sync_api import sync_playwright

    page = studio.page
    try:
        with sync_playwright() as play:
            browser = play.chromium.launch(executable_path=shutil.which("chromium"), args=GRAPHICS)
            shown = browser.new_page(viewport={"width": 1300, "height": 850})
            shown.goto(studio.gate.address)
            shown.get_by_text("Opening: done.").wait_for(timeout=120_000)
            shown.wait_for_timeout(3000)
            still = np.diff(shown.evaluate(FRAMES, 4))
            shown.get_by_role("button", name="play", exact=True).click()
            playing = np.diff(shown.evaluate(FRAMES, 8))
            row["rest"], row["play"] = float(np.median(still)), float(np.median(playing))
            shown.get_by_role("button", name="play", exact=True).click()
            browser.close()
        moments = np.linspace(0, len(page.fold.motion.moves) - 1, 300)
        start = time.process_time()
        for moment in moments:
            page.fold.set_moment(float(moment))
        row["pose"] = 1000 * (time.process_time() - start) / len(moments)
    finally:
        page.tasks.end()


def main() -> None:
    """Measure the kits given, and write the table."""
    lines = [
        "# How fluent the studio is",
        "",
        "`python benchmarks/studio.py KIT ...`. Milliseconds a picture; Chromium without graphics",
        "card (SwiftShader) on the same two cores, 1300 x 850 pixels. `poses` is the program's own",
        "processor time for a picture: all bodies posed, packed, and the table of hinges.",
        "",
        "| kit | voxels | bodies | triangles | poses, ms | page at rest, ms | playing, ms |",
        "|---|---|---|---|---|---|---|",
    ]
    for path in sys.argv[1:]:
        studio = serve(path)
        row: dict[str, float] = {}
        thread = threading.Thread(target=measured, args=(studio, row))
        thread.start()
        studio.page.tasks.run()
        thread.join()
        built = studio.steps.kit().join()
        studio.close()
        triangles = sum(len(body.faces) for body in built.joinery.bodies)
        tree = built.planned.tree
        lines.append(
            f"| {studio.steps.recipe.name} | {len(tree.source)} | {len(tree.bodies)} | "
            f"{triangles:,} | {row['pose']:.1f} | {row['rest']:.0f} | {row['play']:.0f} |"
        )
        print(lines[-1])
    (HERE / "studio.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
