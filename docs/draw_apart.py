"""Draw the pictures of docs/apart.md: python docs/draw_apart.py [KIT SCREWED].

KIT is the folder of a kit printed apart and SCREWED that of one with ``--pin m2``; without them the
sample car's are made, in some minutes.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import manifold3d
import numpy as np

from fabfold.export.camera import View
from fabfold.export.colours import body_colours
from fabfold.export.render import png_bytes, render
from fabfold.files import write_bytes
from fabfold.joinery.cells import as_manifold
from fabfold.joinery.loose_pins import meshes_with_pins
from fabfold.kit.kit import Kit, open_kit
from fabfold.kit.stages import BuiltTree
from fabfold.solid.convert import to_mesh

PICTURES = Path(__file__).parent / "pictures"
PIN = np.array([[40, 40, 45]], dtype=np.uint8)


def plates(built: BuiltTree) -> None:
    """All bodies on the first plate, on the plate's outline."""
    joinery, apart = built.joinery, built.apart
    assert apart is not None
    wide, deep, _ = apart.plates.bed_mm
    bed = manifold3d.Manifold.cube((wide, deep, 1.0)).translate((0, 0, -1.0))
    meshes, colours = [to_mesh(bed)], [(214, 214, 218)]
    for index in np.flatnonzero(apart.plates.plate == 0):
        body, pose = joinery.bodies[index], apart.plates.poses[index]
        meshes.append((body.vertices @ pose[:3, :3].T + pose[:3, 3], body.faces))
        colours.append(tuple(body_colours(built.planned.tree)[index].tolist()))
    view = View(azimuth_deg=-75.0, elevation_deg=48.0, size=(900, 620), ground=False)
    image = render(meshes, np.array(colours, dtype=np.uint8), None, view)
    write_bytes(PICTURES / "plates.png", png_bytes(image))


def hinge(built: BuiltTree, picture: str) -> None:
    """One hinge cut open along its axis: bores, pin or screw, and the way in."""
    joinery, tree = built.joinery, built.planned.tree
    pin = next(p for p in joinery.pins if abs(p.tail_mm[2] - p.tip_mm[2]) > 1.0)
    hinged = tree.hinges[pin.hinge]
    middle = (np.array(pin.tip_mm) + np.array(pin.tail_mm)) / 2
    colours = body_colours(tree)
    # What lies before the plane through the axis is taken away; the rest is cropped to a block.
    block = manifold3d.Manifold.cube((16.0, 16.0, 22.0), True).translate(tuple(middle))
    outwards = middle - np.mean([joinery.bodies[b].vertices.mean(axis=0) for b in
                                 (hinged.parent, hinged.child)], axis=0)  # fmt: skip
    axis = int(np.abs(outwards[:2]).argmax())
    shift = np.zeros(3)
    shift[axis] = np.sign(outwards[axis]) * 10.0
    front = manifold3d.Manifold.cube((20.0, 20.0, 30.0), True).translate(tuple(middle + shift))
    meshes, paints = [], []
    bare = replace(joinery, pins=())
    start = len(meshes_with_pins(bare)[pin.owner][0])
    alone = meshes_with_pins(replace(joinery, pins=(pin,)))[pin.owner]
    faces = alone[1][len(joinery.bodies[pin.owner].faces) :] - start
    meshes.append((alone[0][start:], faces.astype(np.int32)))
    paints.append(PIN[0])
    for body in (hinged.parent, hinged.child):
        mesh = joinery.bodies[body]
        solid = (as_manifold(mesh.vertices, mesh.faces, mesh.name) ^ block) - front
        meshes.append(to_mesh(solid))
        paints.append(colours[body])
    look = np.degrees(np.arctan2(shift[1], shift[0]))
    view = View(azimuth_deg=float(look) + 20.0, elevation_deg=18.0, size=(520, 520), ground=False)
    write_bytes(PICTURES / picture, png_bytes(render(meshes, np.array(paints), None, view)))


def main() -> None:
    """Draw all three."""
    with tempfile.TemporaryDirectory() as folder:
        if len(sys.argv) > 2:
            plain, screwed = (open_kit(path).join() for path in sys.argv[1:3])
        else:
            options = {"folder": folder, "profile": "fdm-pla-0.4", "effort": "quick", "seed": 1}
            plain, screwed = (
                Kit.from_model("sample:car", pin=pin, **options).join() for pin in ("1.75", "m2")
            )
    plates(plain)
    hinge(plain, "pin.png")
    hinge(screwed, "screw.png")


if __name__ == "__main__":
    main()
