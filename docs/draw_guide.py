"""Draw the pictures of docs/guide.md: python docs/draw_guide.py [KIT].

KIT is a kit folder; without it the sample car's is made, in some minutes. The page is drawn by
Chromium, which must be installed, as must playwright.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path

import numpy as np

from fabfold.export.render import png_bytes
from fabfold.export.shading import corner_normals
from fabfold.files import write_bytes
from fabfold.guide.manual import STEP_PIXELS, plan_steps
from fabfold.guide.step_drawing import draw_step
from fabfold.kit.kit import Kit, open_kit

PICTURES = Path(__file__).parent / "pictures"


def page_at(path: Path, time: float) -> None:
    """The page that plays, at a time counted in steps."""
    from playwright.sync_api import sync_playwright

    graphics = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    with sync_playwright() as play:
        browser = play.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox", *graphics]
        )
        page = browser.new_page(viewport={"width": 1000, "height": 700})
        page.goto(path.resolve().as_uri())
        page.wait_for_selector("body[data-ready=yes]")
        page.evaluate("time => { fold.show(time); fold.settle(); }", time)
        page.wait_for_timeout(500)
        page.screenshot(path=PICTURES / "fold-page.png")
        browser.close()


def main() -> None:
    """Draw all pictures of the page."""
    if len(sys.argv) > 1:
        kit = open_kit(sys.argv[1])
    else:
        kit = Kit.from_model("sample:car", folder=Path(tempfile.mkdtemp()) / "car-kit")
    built = kit.join()
    joinery, tree, motion = built.joinery, built.planned.tree, built.planned.motion
    plan = plan_steps(joinery, tree, motion, built.planned.voxels.rotation.T)
    meshes = [(body.vertices, body.faces) for body in joinery.bodies]
    smooth = [corner_normals(v, f) for v, f in meshes]
    steps = list(zip(plan.groups, plan.group_views, strict=False))
    shown = [steps[0], *[pair for pair in steps[1:] if pair[1].turned][:1], steps[-1]]
    images = [
        draw_step(meshes, step, view, joinery.voxel_mm, STEP_PIXELS, smooth).image
        for step, view in shown
    ]
    write_bytes(PICTURES / "manual-steps.png", png_bytes(np.concatenate(images, axis=1)))
    assert kit.folder is not None
    if not (kit.folder / "fold.html").is_file():
        kit.export()
    page_at(kit.folder / "fold.html", 2.5)


if __name__ == "__main__":
    main()
