"""The settings by which slicers see named, coloured parts and plates in a 3MF.

PrusaSlicer and SuperSlicer read ``Metadata/Slic3r_PE_model.config``: which triangles of one object
are which part. PrusaSlicer 3 does so only where the file's ``Application`` is PrusaSlicer of up to
2.99.1. A part has the colour of its extruder, which ``Metadata/Slic3r_PE.config`` names; it counts
where the file is opened as a project. Bambu Studio and OrcaSlicer read
``Metadata/model_settings.config`` whoever wrote the file: one entry an object, with its parts.
Plates and colours count only where the file's ``Application`` is Bambu Studio and
``Metadata/project_settings.config`` is not empty. Few fields are written, all of them such as the
slicers' own files have.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "BAMBU",
    "PRUSA",
    "bambu_model",
    "bambu_plates",
    "bambu_project",
    "prusa_model",
    "prusa_project",
]

#: What ``Application`` says: the release whose form is written.
BAMBU = "BambuStudio-01.09.00.00"
PRUSA = "PrusaSlicer-2.9.2"
#: Matrix of a part that stays where it is, as both families of slicers write it.
_UNIT_MATRIX = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"
_HEAD = ['<?xml version="1.0" encoding="UTF-8"?>', "<config>"]


def _part(number: int, name: str, filament: int) -> list[str]:
    return [
        f'    <part id="{number}" subtype="normal_part">',
        f'      <metadata key="name" value={quoteattr(name)}/>',
        f'      <metadata key="matrix" value="{_UNIT_MATRIX}"/>',
        f'      <metadata key="extruder" value="{filament}"/>',
        "    </part>",
    ]


def prusa_model(
    whole: int, title: str, parts: Sequence[tuple[str, int]], *, filaments: bool
) -> str:
    """``Slic3r_PE_model.config`` of one object with named parts.

    Parameters
    ----------
    whole : int
        Number of the object whose mesh holds the parts, one after another.
    title : str
        Its name.
    parts : sequence of (str, int)
        Name of each part, and how many triangles it has.
    filaments : bool
        Whether each part is printed in a filament of its own.

    Returns
    -------
    str
        XML.
    """
    lines = [
        *_HEAD,
        f' <object id="{whole}" instances_count="1">',
        f'  <metadata type="object" key="name" value={quoteattr(title)}/>',
    ]
    start = 0
    for index, (name, count) in enumerate(parts):
        facts = {"name": name, "volume_type": "ModelPart", "matrix": _UNIT_MATRIX}
        if filaments:
            facts["extruder"] = str(index + 1)
        lines += [
            f'  <volume firstid="{start}" lastid="{start + count - 1}">',
            *(
                f'   <metadata type="volume" key="{key}" value={quoteattr(value)}/>'
                for key, value in facts.items()
            ),
            "  </volume>",
        ]
        start += count
    return "\n".join([*lines, " </object>", "</config>", ""])


def prusa_project(colours: NDArray[np.uint8]) -> str:
    """``Slic3r_PE.config``: a printer with an extruder for each colour.

    Parameters
    ----------
    colours : (n, 3) uint8 array
        sRGB of each extruder.

    Returns
    -------
    str
        Lines of ``; key = value``, as PrusaSlicer writes them.
    """
    named = ";".join("#{:02X}{:02X}{:02X}".format(*colour) for colour in colours.tolist())
    lines = [
        f"; extruder_colour = {named}",
        f"; filament_colour = {named}",
        f"; nozzle_diameter = {','.join(['0.4'] * len(colours))}",
        "; printer_technology = FFF",
    ]
    return "\n".join([*lines, ""])


def bambu_model(whole: int, title: str, parts: Sequence[tuple[int, str]]) -> str:
    """``model_settings.config`` of one object with named parts, each in its own filament.

    Parameters
    ----------
    whole : int
        Number of the object that holds the parts.
    title : str
        Its name.
    parts : sequence of (int, str)
        Number and name of each part.

    Returns
    -------
    str
        XML.
    """
    lines = [
        *_HEAD,
        f'  <object id="{whole}">',
        f'    <metadata key="name" value={quoteattr(title)}/>',
        '    <metadata key="extruder" value="1"/>',
    ]
    for index, (number, name) in enumerate(parts):
        lines += _part(number, name, index + 1)
    return "\n".join([*lines, "  </object>", "</config>", ""])


def bambu_plates(objects: Sequence[tuple[int, str]], plate: NDArray[np.int_], count: int) -> str:
    """``model_settings.config`` of objects of one part each, on plates, all in one filament.

    Parameters
    ----------
    objects : sequence of (int, str)
        Number and name of each object.
    plate : (n,) int array
        Plate of each, from 0.
    count : int
        Number of plates.

    Returns
    -------
    str
        XML.
    """
    lines = list(_HEAD)
    for number, name in objects:
        lines += [
            f'  <object id="{number}">',
            f'    <metadata key="name" value={quoteattr(name)}/>',
            '    <metadata key="extruder" value="1"/>',
            *_part(number, name, 1),
            "  </object>",
        ]
    for index in range(count):
        lines += [
            "  <plate>",
            f'    <metadata key="plater_id" value="{index + 1}"/>',
            f'    <metadata key="plater_name" value="plate {index + 1}"/>',
            '    <metadata key="locked" value="false"/>',
        ]
        for member in np.flatnonzero(plate == index).tolist():
            lines += [
                "    <model_instance>",
                f'      <metadata key="object_id" value="{objects[member][0]}"/>',
                '      <metadata key="instance_id" value="0"/>',
                "    </model_instance>",
            ]
        lines.append("  </plate>")
    return "\n".join([*lines, "</config>", ""])


def bambu_project(bed_mm: Sequence[float], filaments: NDArray[np.uint8] | None = None) -> str:
    """``project_settings.config``: the bed, and a colour for each filament.

    Parameters
    ----------
    bed_mm : sequence of float
        Size of the bed, and height above it, mm.
    filaments : (n, 3) uint8 array, optional
        sRGB of each filament; one grey one by default.

    Returns
    -------
    str
        JSON.
    """
    wide, deep, high = bed_mm
    colours = [(128, 128, 128)] if filaments is None else filaments.tolist()
    settings = {
        "filament_colour": ["#{:02X}{:02X}{:02X}".format(*colour) for colour in colours],
        "printable_area": ["0x0", f"{wide:g}x0", f"{wide:g}x{deep:g}", f"0x{deep:g}"],
        "printable_height": f"{high:g}",
    }
    return json.dumps(settings, indent=1) + "\n"
