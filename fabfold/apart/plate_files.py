"""Files of a kit that is printed body by body: plates, the order of assembly, and what to buy."""

from __future__ import annotations

import csv
import io
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fabfold.apart.apart_kit import ApartKit
from fabfold.apart.plates import Plates, on_plate
from fabfold.export.render import thumbnail
from fabfold.export.threemf import posed, write_3mf
from fabfold.files import write_json, write_text
from fabfold.joinery.bodies import Joinery, PlacedPin
from fabfold.joinery.box_hold import Retention
from fabfold.joinery.pin_kinds import PINS, PinKind
from fabfold.tree.fold_tree import FoldTree
from hinges.hardware import SCREWS
from hinges.slicer_parts import BAMBU, bambu_plates, bambu_project

__all__ = ["assembly_data", "bill_rows", "remove_plates", "write_bill", "write_plates"]

#: Between two plates Bambu Studio leaves a fifth of a plate.
_STRIDE = 1.2


def write_plates(
    folder: Path,
    name: str,
    tree: FoldTree,
    joinery: Joinery,
    kit: ApartKit,
    colours: NDArray[np.uint8],
    metadata: Mapping[str, str],
    auxiliaries: Mapping[str, bytes] | None = None,
) -> None:
    """Write the plates for any slicer, all of them for Bambu Studio, and the order of assembly.

    Parameters
    ----------
    folder : Path
        Kit folder.
    name : str
        Stem of the files' names.
    tree : FoldTree
        The bodies and their hinges.
    joinery : Joinery
        The bodies as they are printed, with their pins.
    kit : ApartKit
        Order and plates.
    colours : (b, 3) uint8 array
        Colour of each body, sRGB.
    metadata : mapping of str to str
        Facts about the files.
    auxiliaries : mapping of str to bytes, optional
        Files that Bambu Studio shows beside the model.
    """
    plates = kit.plates
    remove_plates(folder, keep=plates.count)
    for index in range(plates.count):
        on = plates.plate == index
        bodies = on_plate(joinery, plates, index)
        write_3mf(
            folder / f"plate-{index + 1}.3mf",
            bodies,
            thumbnail=thumbnail(bodies.drawn, colours[on]),
            title=f"{name}, plate {index + 1} of {plates.count}",
            metadata=metadata,
            colours=colours[on],
            layout="apart",
            keep_place=True,
        )
    spread = _side_by_side(joinery, plates)
    picture = thumbnail(spread.drawn, colours)
    names = [body.name for body in joinery.bodies]
    write_3mf(
        folder / f"{name}.3mf",
        spread,
        title=f"{name}, all plates",
        thumbnail=picture,
        metadata=metadata,
        colours=colours,
        layout="apart",
        keep_place=True,
    )
    write_3mf(
        folder / f"{name}-bambu.3mf",
        spread,
        title=name,
        thumbnail=picture,
        metadata={**metadata, "Application": BAMBU},
        colours=colours,
        layout="apart",
        keep_place=True,
        settings=lambda ids: {
            "model_settings.config": bambu_plates(
                list(zip(ids, names, strict=True)), plates.plate, plates.count
            ),
            "project_settings.config": bambu_project(plates.bed_mm),
        },
        auxiliaries=auxiliaries,
    )
    write_json(folder / "assembly.json", assembly_data(tree, joinery, kit))


def remove_plates(folder: Path, keep: int = 0) -> None:
    """Remove files of plates that an earlier kit in the folder had and this one has not.

    Parameters
    ----------
    folder : Path
        Kit folder.
    keep : int
        Number of plates that there are now; 0 where the kit is printed in place.
    """
    for path in folder.glob("plate-*.3mf"):
        number = path.stem.removeprefix("plate-")
        if number.isdigit() and int(number) > keep:
            path.unlink()
    if keep == 0:
        (folder / "assembly.json").unlink(missing_ok=True)


def _corner(plates: Plates, index: int) -> NDArray[np.float64]:
    """Where a plate begins when all lie side by side, mm: as Bambu Studio places them."""
    across = math.ceil(math.sqrt(plates.count))
    row, column = divmod(index, across)
    return np.array([column * _STRIDE * plates.bed_mm[0], -row * _STRIDE * plates.bed_mm[1], 0.0])


def _side_by_side(joinery: Joinery, plates: Plates) -> Joinery:
    poses = plates.poses.copy()
    for body, plate in enumerate(plates.plate.tolist()):
        poses[body, :3, 3] += _corner(plates, plate)
    return replace(posed(joinery, poses), pins=())


def assembly_data(tree: FoldTree, joinery: Joinery, kit: ApartKit) -> dict[str, Any]:
    """The order of assembly with names (JSON-ready).

    Parameters
    ----------
    tree : FoldTree
        The bodies and their hinges.
    joinery : Joinery
        The bodies with their pins.
    kit : ApartKit
        Order and plates.

    Returns
    -------
    dict
        What ``assembly.json`` holds.
    """
    names = [body.name for body in joinery.bodies]
    steps = []
    for step in kit.steps:
        pin = joinery.pins[step.pin]
        inside = set(step.sides[0]) | set(step.sides[1])
        steps.append(
            {
                "hinge": tree.hinges[pin.hinge].name,
                "angles_deg": {
                    hinge.name: angle
                    for hinge, angle in zip(tree.hinges, step.angles_deg, strict=True)
                    if hinge.parent in inside and hinge.child in inside
                },
                "rests": [names[body] for body in step.sides[0]],
                "comes": [names[body] for body in step.sides[1]],
                "comes_along": [-value + 0.0 for value in step.away],
                "pin": {
                    "diameter_mm": pin.diameter_mm,
                    "length_mm": round(pin.length_mm, 2),
                    "tip_mm": list(pin.tip_mm),
                    "tail_mm": list(pin.tail_mm),
                    "gripped_by": names[pin.owner],
                    **(
                        {
                            "head_diameter_mm": 2 * pin.head_mm,
                            "head_height_mm": pin.head_height_mm,
                            "thread_mm": pin.thread_mm,
                        }
                        if pin.thread_mm > 0
                        else {}
                    ),
                },
            }
        )
    return {
        "format": "fabfold-assembly",
        "version": 1,
        "steps": steps,
        "supported": [names[body] for body in kit.plates.supported],
        "plates": [
            [names[body] for body in np.flatnonzero(kit.plates.plate == index)]
            for index in range(kit.plates.count)
        ],
    }


def bill_rows(
    joinery: Joinery, material: str, pin: str, retention: Retention | None = None
) -> list[tuple[str, int, str, str]]:
    """What a kit is made of and what it takes to put it together.

    Parameters
    ----------
    joinery : Joinery
        The bodies with their pins.
    material : str
        What is printed.
    pin : str
        Name of the loose pin, of :data:`fabfold.joinery.pin_kinds.PINS`.
    retention : Retention, optional
        The magnets.

    Returns
    -------
    list of (str, int, str, str)
        Item, count, size, and what it is for.
    """
    volume = sum(body.volume for body in joinery.bodies) / 1000.0
    rows = [
        (f"{material or 'material'}, printed", len(joinery.bodies), f"{volume:.1f} cm³ in all",
         "bodies; with infill it takes less"),
    ]  # fmt: skip
    if retention is not None and retention.pairs:
        size = " × ".join(retention.magnet.split("x")) + " mm"
        count = 2 * len(retention.pairs)
        rows.append(("disc magnet, neodymium", count, size, "hold the box shut"))
        if not retention.skin_mm:
            rows.append(("glue", 1, "", "for the magnets"))
    if not joinery.pins:
        return rows
    kind = PINS[pin]
    if kind.screw:
        return rows + _screw_rows(joinery.pins, kind)
    lengths = Counter(round(p.length_mm, 1) for p in joinery.pins)
    for length, count in sorted(lengths.items()):
        rows.append((f"pin, {kind.what}", count, f"{length:g} mm long", "one a hinge"))
    bore = max(p.diameter_mm for p in joinery.pins)
    rows += [
        (f"drill or reamer of {bore + 0.2:.2f} mm", 1, "", "for bores that came out too tight"),
        ("needle or wire of at most 1 mm", 1, "", "pushes a pin out again"),
        (f"rod of {bore:g} mm", 1, "80 mm long", "pushes pins home"),
    ]
    return rows


def _screw_rows(pins: Sequence[PlacedPin], kind: PinKind) -> list[tuple[str, int, str, str]]:
    """Screws by their length, and what drives them."""
    screw = SCREWS[kind.screw]
    lengths = Counter(pin.length_mm for pin in pins)
    return [
        *(
            (f"{kind.what}", count, f"{kind.screw} × {length:g} mm", "one a hinge")
            for length, count in sorted(lengths.items())
        ),
        (kind.tool, 1, "", "drives the screws"),
        (f"drill of {screw.clear:g} mm", 1, "", "for bores that turn and came out too tight"),
        (f"drill of {screw.tap:g} mm", 1, "", "for bores that the thread does not go into"),
    ]


def write_bill(
    folder: Path,
    joinery: Joinery,
    material: str,
    pin: str,
    retention: Retention | None = None,
) -> None:
    """Write ``bom.csv``; parameters as of :func:`bill_rows`."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["item", "count", "size", "what for"])
    writer.writerows(bill_rows(joinery, material, pin, retention))
    write_text(folder / "bom.csv", text.getvalue())
