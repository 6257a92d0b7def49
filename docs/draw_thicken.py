"""Draw the picture of docs/solid.md: python docs/draw_thicken.py."""

from __future__ import annotations

from pathlib import Path

import manifold3d
import numpy as np

from fabfold.export.camera import View
from fabfold.export.render import png_bytes, render
from fabfold.files import write_bytes
from fabfold.solid.closed_solid import Solid
from fabfold.solid.convert import to_mesh
from fabfold.solid.thicken import thickened

PICTURE = Path(__file__).parent / "pictures" / "thicken.png"
VIEW = View(azimuth_deg=-60.0, elevation_deg=20.0, size=(360, 320), lights=30)
COLOUR = np.array([[90, 140, 190]], dtype=np.uint8)


def rod(one: tuple[float, ...], other: tuple[float, ...], radius: float) -> manifold3d.Manifold:
    """A rod with round ends."""
    ball = manifold3d.Manifold.sphere(radius, 24)
    return manifold3d.Manifold.batch_hull([ball.translate(one), ball.translate(other)])


def figure() -> Solid:
    """A figure of thin limbs with a head on a stone."""
    parts = [
        manifold3d.Manifold.sphere(11, 64).translate((0, 0, 96)),
        manifold3d.Manifold.cube((60, 36, 18), True).translate((0, 0, -4)),
        rod((0, 0, 45), (0, 0, 90), 2),
        *(rod((0, 0, 45), (side * 16, 0, 4), 2) for side in (-1, 1)),
        *(rod((0, 0, 76), (side * 30, 0, 62), 1.5) for side in (-1, 1)),
    ]
    vertices, faces = to_mesh(manifold3d.Manifold.batch_boolean(parts, manifold3d.OpType.Add))
    return Solid("figure", vertices, faces.astype(np.int32))


def main() -> None:
    """The figure as it is, and with all limbs at least 10 thick."""
    thin = figure()
    thick = thickened(thin, 10.0).solid
    images = [
        render([(solid.vertices, solid.faces)], COLOUR, None, VIEW, distance=330.0)
        for solid in (thin, thick)
    ]
    write_bytes(PICTURE, png_bytes(np.concatenate(images, axis=1)))


if __name__ == "__main__":
    main()
