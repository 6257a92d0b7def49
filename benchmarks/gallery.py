"""Make the six kits of the gallery, in place and apart, and write what is shown of them.

    python benchmarks/gallery.py [--kits gallery-kits]

Exports each kit to ``KITS/NAME``, where finished stages of an earlier run are taken. Writes
``prints/gallery/NAME/`` (the recipe, a picture of what is printed, and figures),
``docs/pictures/NAME.png`` (A, half-way, B as ``fabfold export`` drew them) and ``docs/gallery.md``.
"""

from __future__ import annotations

import argparse
import json
import shutil
from pathlib import Path
from typing import Any, Final

import manifold3d
import numpy as np

from fabfold.export.camera import View
from fabfold.export.colours import body_colours
from fabfold.export.render import png_bytes, render
from fabfold.files import write_bytes, write_json, write_text
from fabfold.kit.kit import Kit, open_kit
from fabfold.printing.print_pose import posed_kit, print_pose
from fabfold.samples.builtin import sample
from fabfold.solid.convert import to_mesh

ROOT = Path(__file__).resolve().parents[1]
GALLERY = ROOT / "prints" / "gallery"

#: Every kit with its model and what is asked for besides; searched quickly but for the first.
KITS: Final[dict[str, dict[str, str]]] = {
    "car": {"model": "sample:car", "profile": "mjf-pa12", "pose": "b", "effort": "normal"},
    "duck": {"model": "sample:duck", "profile": "mjf-pa12"},
    "elephant": {"model": "sample:elephant", "profile": "sls-pa12", "pose": "b"},
    "locomotive": {"model": "sample:locomotive", "profile": "fdm-pla-0.4"},
    "rabbit": {"model": "sample:rabbit", "profile": "fdm-petg-0.4", "retention": "magnet"},
    "car-screws": {"model": "sample:car", "profile": "fdm-pla-0.4", "pin": "m2"},
}


def picture(kit: Kit) -> bytes:
    """What lies on the plates, side by side; or the kit in the pose in which it is printed."""
    built, mode = kit.join(), kit.print_mode()
    tree, joinery = built.planned.tree, built.joinery
    colours = body_colours(tree)
    meshes, paints = [], []
    if built.apart is None:
        pose = print_pose(tree, built.planned.motion, joinery, mode.profile, mode.pose)
        meshes = [(body.vertices, body.faces) for body in posed_kit(joinery, pose).bodies]
        view = View(size=(640, 440))
        return png_bytes(render(meshes, colours, None, view))
    wide, deep, _ = built.apart.plates.bed_mm
    for index in range(built.apart.plates.count):
        aside = index * 1.1 * wide
        bed = manifold3d.Manifold.cube((wide, deep, 1.0)).translate((aside, 0, -1.0))
        meshes.append(to_mesh(bed))
        paints.append((214, 214, 218))
        for number in np.flatnonzero(built.apart.plates.plate == index):
            body, pose = joinery.bodies[number], built.apart.plates.poses[number]
            points = body.vertices @ pose[:3, :3].T + pose[:3, 3] + [aside, 0, 0]
            meshes.append((points, body.faces))
            paints.append(tuple(colours[number].tolist()))
    view = View(azimuth_deg=-75.0, elevation_deg=48.0, size=(640, 440), ground=False)
    return png_bytes(render(meshes, np.array(paints, dtype=np.uint8), None, view))


def figures(folder: Path) -> dict[str, Any]:
    """What the report of a kit says, in short."""
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    summary, checks = report["summary"], report["checks"]
    wanted = (
        "template", "voxels", "bodies", "joints", "moves", "box_closed", "print", "profile",
        "voxel_mm", "clearance_mm", "volume_mm3", "pins", "pin_mm", "plates",
        "bodies_with_support", "magnet_pairs",
    )  # fmt: skip
    gap = next(c for c in checks if c["name"] == "smallest gap on the folding path")
    return {
        "format": "fabfold-gallery",
        "version": 1,
        **{key: summary[key] for key in wanted if key in summary},
        "min_gap_mm": gap["figure"],
        "checks_passed": [sum(check["verdict"] == "ok" for check in checks), len(checks)],
    }


def section(name: str, options: dict[str, str], told: dict[str, Any]) -> list[str]:
    """A kit's part of the page."""
    title = sample(options["model"].removeprefix("sample:")).title
    good, every = told["checks_passed"]
    hinges = told["joints"]["S"] + 2 * told["joints"]["D"]
    size = f"{told['volume_mm3'] / 1000:.0f} cm³"
    way = f"Printed in place with `{told['profile']}`, {size}"
    if told["print"] == "apart":
        plates = f"{told['plates']} plate{'s' if told['plates'] > 1 else ''}"
        pins = f"{told['pins']} {'screws M2' if options.get('pin') == 'm2' else 'pins'}"
        way = f"Printed apart with `{told['profile']}`: {plates}, {pins}, {size}"
        if told.get("magnet_pairs"):
            way += f", {told['magnet_pairs']} pairs of magnets"
    elif options.get("pose") == "b":
        way += ", as the box"
    lines = [
        "",
        f"## {name}",
        "",
        f"{title[0].upper()}{title[1:]}: {told['voxels']} voxels, {told['bodies']} bodies, "
        f"{hinges} hinges, folds into {told['template']} in {told['moves']} moves.",
        f"{way}. Smallest gap on the path {told['min_gap_mm']:.3f} mm, {good} of {every} checks "
        "passed.",
        "",
    ]
    if name in options["model"]:
        lines += [f"![{name}: model, half-way, box](pictures/{name}.png)", ""]
    return [*lines, f"![{name}: as it is printed](../prints/gallery/{name}/plates.png)"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kits", type=Path, default=Path("gallery-kits"))
    kits = parser.parse_args().kits
    lines = [
        "# Gallery",
        "",
        "Every built-in sample as the model (A), half-way, and folded (B), and as it is printed:",
        "three kits in place, three body by body. `python benchmarks/gallery.py` makes all of it",
        "again. Recipe, picture and figures of each are in `prints/gallery/`:",
        "`fabfold export prints/gallery/car/kit.toml -o car-kit` makes the same kit. All but the",
        "car are searched with `--effort quick`.",
    ]
    for name, asked in KITS.items():
        options = {key: value for key, value in asked.items() if key != "model"}
        kit = open_kit(asked["model"], folder=kits / name, **{"effort": "quick", **options})
        folder = kit.export()
        place = GALLERY / name
        place.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(folder / "kit.toml", place / "kit.toml")
        write_bytes(place / "plates.png", picture(kit))
        told = figures(folder)
        write_json(place / "figures.json", told)
        if name in asked["model"]:
            shutil.copyfile(folder / "fold.png", ROOT / "docs" / "pictures" / f"{name}.png")
        lines += section(name, asked, told)
        print(f"{name}: {told['checks_passed']}", flush=True)
    write_text(ROOT / "docs" / "gallery.md", "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
