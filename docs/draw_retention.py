"""Draw the pictures of docs/joinery.md: python docs/draw_retention.py [HELD] [BLOCKS].

HELD is the folder of a kit whose magnets are enclosed, BLOCKS that of one with --skin lattice;
without them the sample car's are made, in some minutes.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import manifold3d
import numpy as np

from fabfold.export.camera import View
from fabfold.export.kit_picture import nearest_lattice, strip
from fabfold.export.render import Image, png_bytes, render
from fabfold.files import write_bytes
from fabfold.guide.magnet_pictures import MAGNET_PIXELS, magnet_pictures
from fabfold.joinery.bodies import Joinery
from fabfold.joinery.box_hold import Retention
from fabfold.joinery.cells import as_manifold
from fabfold.joinery.loose_pins import cylinder_between
from fabfold.joinery.magnets import MAGNETS
from fabfold.kit.kit import Kit, open_kit
from fabfold.kit.stages import BuiltTree
from fabfold.solid.convert import to_mesh

PICTURES = Path(__file__).parent / "pictures"


def pocket(joinery: Joinery, retention: Retention, stand: np.ndarray) -> Image:
    """An enclosed pocket that stands on its rim, cut open: skin, vent, magnet and square roof."""
    magnet = MAGNETS[retention.magnet]
    for pair in retention.pairs:
        for body, point, inward in zip(pair.bodies, pair.points_mm, pair.inwards, strict=True):
            up, into, mouth = stand[body][2, :3], np.array(inward), np.array(point)
            if abs(float(up @ into)) < 0.5:
                break
        else:
            continue
        break
    side = np.cross(up, into)
    # The plane through the axis of the magnet, and a block about it.
    frame = np.column_stack([side, into, up])
    block = manifold3d.Manifold.cube((6.0, 5.0, 8.0), True).translate((3.0, 2.0, 0.0))
    mesh = joinery.bodies[body]
    placed = block.transform(np.column_stack([frame, mouth]))
    piece = as_manifold(mesh.vertices, mesh.faces, mesh.name) ^ placed
    start = mouth + (retention.skin_mm + 0.1) * into
    disc = cylinder_between(
        start, start + magnet.thick_mm * into, magnet.diameter_mm / 2, outside=False
    )
    back = np.column_stack([frame.T, -frame.T @ mouth])
    meshes = [to_mesh(solid.transform(back)) for solid in (piece, disc ^ placed)]
    colours = np.array([(226, 224, 219), (205, 40, 40)], dtype=np.uint8)
    # A bigger picture for the same width of paper.
    size = (2 * MAGNET_PIXELS[0], 2 * MAGNET_PIXELS[1])
    return render(meshes, colours, None, View(-165.0, 18.0, size=size, ground=False))


def magnets(built: BuiltTree, stand: np.ndarray) -> None:
    """Parts with their magnets as the manual shows them, and a pocket cut open."""
    assert built.retention is not None
    rows = [picture.image for picture in magnet_pictures(built.joinery, built.retention, stand)]
    apart = built.apart
    assert apart is not None
    # Of parts with either pole out.
    left, right = (np.concatenate(rows[i : i + 2], axis=0) for i in (4, 6))
    shown = np.concatenate([left, right], axis=1)
    cut = pocket(built.joinery, built.retention, apart.plates.poses)
    write_bytes(PICTURES / "magnets.png", png_bytes(np.concatenate([shown, cut], axis=1)))


def main() -> None:
    """Draw both pictures."""
    held, blocks = (Path(a) for a in sys.argv[1:3]) if len(sys.argv) > 2 else (None, None)
    with tempfile.TemporaryDirectory() as home:
        if held is None or blocks is None:
            held, blocks = Path(home) / "held", Path(home) / "blocks"
            Kit.from_model(
                "sample:car", folder=held, effort="quick", profile="fdm-pla-0.4",
                retention="magnet", magnet_fit="enclosed",
            ).join()  # fmt: skip
            Kit.from_model("sample:car", folder=blocks, effort="quick", skin="lattice").join()
        built = open_kit(str(held)).join()
        magnets(built, nearest_lattice(built.planned.voxels.rotation.T))
        built = open_kit(str(blocks)).join()
        upright = built.planned.voxels.rotation.T
        image = strip(built.joinery, built.planned.tree, built.planned.motion, upright=upright)
        write_bytes(PICTURES / "lattice-skin.png", png_bytes(image))


if __name__ == "__main__":
    main()
