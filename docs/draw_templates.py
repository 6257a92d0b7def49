"""Draw the pictures of docs/templates.md: python docs/draw_templates.py [--kit]."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fabfold.export.camera import View
from fabfold.export.colours import palette
from fabfold.export.kit_picture import picture_of_kit
from fabfold.export.render import Image, Mesh, png_bytes, render
from fabfold.files import write_bytes
from fabfold.lattice.creases import folded_template, parts_of
from fabfold.lattice.shipped import load_template
from fabfold.lattice.template import Template

HOME = Path(__file__).parent / "pictures"
VIEW = View(azimuth_deg=-60.0, elevation_deg=30.0, size=(340, 300), lights=30)
#: Side of a cell as it is drawn; the gap shows the grid.
SIDE = 0.94


def cube(centre: NDArray[np.floating]) -> Mesh:
    """One cell."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    quads = [
        (0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3),
    ]  # fmt: skip
    faces = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return centre + 0.5 * SIDE * corners, np.array(faces, dtype=np.int32)


def is_hollow(template: Template) -> bool:
    """Whether there are empty cells that no way leads to from outside."""
    from scipy.ndimage import binary_fill_holes

    grid = template.occupancy()
    return bool((binary_fill_holes(grid) != grid).any())


def drawn(template: Template, part: NDArray[np.int32]) -> Image:
    """A template; one that is hollow is cut open."""
    cells = template.cells
    middle = (np.array(template.shape) - 1) / 2
    seen = np.ones(len(cells), dtype=bool)
    if is_hollow(template):
        seen = ~((cells[:, 0] > middle[0]) & (cells[:, 1] < middle[1]))
    colours = np.array(palette(8), dtype=np.uint8)
    return render(
        [cube(cell) for cell in cells[seen].astype(float)], colours[part[seen]], None, VIEW
    )


def row(images: list[Image]) -> Image:
    """Pictures of one height side by side."""
    return np.concatenate(images, axis=1)


def templates() -> None:
    """Every shipped template; one that folds as it lies flat and folded."""
    for name in (
        "box-4x4x4", "u-112", "l-64", "t-64", "hollow-56", "hollow-98", "sheet-64", "book-64",
        "map-48",
    ):  # fmt: skip
        template = load_template(name)
        part = np.zeros(len(template), dtype=np.int32)
        images = []
        if template.creases:
            parts = parts_of(template)
            part = parts.part
            landed = parts.landed(template.cells)
            folded = folded_template(template)
            # Colours go with the cells: sorted as the folded template sorts its own.
            order = np.lexsort(landed.T[::-1])
            images = [drawn(folded, part[order])]
        write_bytes(HOME / f"template-{name}.png", png_bytes(row([drawn(template, part), *images])))


def kit() -> None:
    """A printed object as model, as flat template, and as box."""
    from fabfold.kit.kit import Kit

    built = Kit.from_model("sample:car", template="map-48", seed=1, effort="quick").join()
    tree, motion = built.planned.tree, built.planned.motion
    folds = len(load_template("map-48").creases)
    view = View(azimuth_deg=-60.0, elevation_deg=30.0, size=(480, 380))
    states = [motion.angles_deg[0], motion.angles_deg[-1 - folds], motion.angles_deg[-1]]
    images = [picture_of_kit(built.joinery, tree, angles, view) for angles in states]
    write_bytes(HOME / "car-map-48.png", png_bytes(row(images)))


if __name__ == "__main__":
    if "--kit" in sys.argv:
        kit()
    else:
        templates()
