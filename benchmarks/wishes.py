"""What wishes cost and bring on the sample car, which folds into a box of 3 x 4 x 4.

``python benchmarks/wishes.py [--pictures FOLDER]`` prints a table: joints, surface energy (Eq. 8),
how much of the car's front lies on the side +x of the box, in how many bodies the four wheels are,
and where empty space is. One round of quick seeds for each line.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from fabfold.export.render import png_bytes
from fabfold.export.sketch import picture_of_tree
from fabfold.files import write_bytes
from fabfold.kit.kit import Kit
from fabfold.lattice.rotations import FACES
from fabfold.solid.regions import parse_region, sample_region, sample_surface
from fabfold.voxels.region_cells import containing_voxels
from fabfold.wishes.keep import Keep
from fabfold.wishes.wish_list import Wishes

#: Axles and tracks of the sample's wheels.
WHEELS = tuple(f"sphere({x},{y},9.8,10)" for x in (-21.5, 21.5) for y in (-13.3, 13.3))
#: The car looks along its +x.
FRONT = "right:+x"
RUNS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("no wish", {}),
    ("front kept", {"keep": (FRONT,)}),
    ("front kept, weight 1", {"keep": (FRONT,), "keep_weight": 1.0}),
    ("wheels whole", {"protect": WHEELS}),
    ("front and wheels", {"protect": WHEELS, "keep": (FRONT,), "keep_weight": 1.0}),
    ("joints inside", {"joints_inside": True}),
    ("prefer hinges", {"prefer": "hinges"}),
    ("prefer surface", {"prefer": "surface"}),
)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pictures", type=Path, help="folder for a picture of each")
    parser.add_argument("--only", help="text that the names of the lines to run contain")
    options = parser.parse_args()
    print(f"{'wish':22} {'joints':>6} {'surface':>8} {'front at +x':>12} {'bodies of a wheel':>18}")
    for name, wishes in RUNS:
        if options.only and options.only not in name:
            continue
        kit = Kit.from_model("sample:car", effort="quick", seed=1, **wishes)
        planned = kit.fold()
        tree, voxels, solid = planned.tree, planned.voxels, kit.solid()
        keep = Keep(FRONT, sample_surface(solid, 0), int((FACES == [1, 0, 0]).all(axis=1).argmax()))
        (kept,) = Wishes(keeps=(keep,)).kept(voxels, tree)
        parts = []
        for text in WHEELS:
            (points,) = sample_region(solid, parse_region(text, "wheel")).pieces
            holder = containing_voxels(voxels, points)
            body = tree.voxel_body[holder[holder >= 0]]
            parts.append(sum((body == b).mean() >= 0.01 for b in set(body.tolist())))
        surface = tree.energy["surface"]
        print(
            f"{name:22} {sum(tree.joints.values()):6} {surface:8.2f} {kept.share:12.0%} "
            f"{', '.join(map(str, parts)):>18}",
            flush=True,
        )
        if options.pictures:
            image = picture_of_tree(voxels, tree)
            path = options.pictures / f"wish-{name.replace(', ', '-').replace(' ', '-')}.png"
            write_bytes(path, png_bytes(image))


if __name__ == "__main__":
    main()
