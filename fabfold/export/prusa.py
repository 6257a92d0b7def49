"""The settings by which PrusaSlicer and SuperSlicer see named, coloured parts in a 3MF.

They read ``Metadata/Slic3r_PE_model.config``: one entry an object, with the range of triangles of
each part. PrusaSlicer 3 does so only where the file's ``Application`` is PrusaSlicer of up to
2.99.1. A part has the colour of its extruder, which ``Metadata/Slic3r_PE.config`` names; it counts
where the file is opened as a project.
"""

from __future__ import annotations

from collections.abc import Sequence
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from fabfold.export.bambu import UNIT_MATRIX

__all__ = ["PRUSA", "prusa_model", "prusa_project"]

#: What ``Application`` says to PrusaSlicer 3: the release whose form is written.
PRUSA = "PrusaSlicer-2.9.2"


def prusa_model(
    whole: int, title: str, parts: Sequence[tuple[str, int]], *, coloured: bool = False
) -> str:
    """``Slic3r_PE_model.config`` of one object with named parts.

    Parameters
    ----------
    whole : int
        Number of the object.
    title : str
        Its name.
    parts : sequence of (str, int)
        Name and number of triangles of each part, in the order of the object's triangles.
    coloured : bool
        Whether each part has an extruder of its own.

    Returns
    -------
    str
        XML.
    """
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        "<config>",
        f' <object id="{whole}" instances_count="1">',
        f'  <metadata type="object" key="name" value={quoteattr(title)}/>',
    ]
    start = 0
    for index, (name, count) in enumerate(parts, start=1):
        lines += [
            f'  <volume firstid="{start}" lastid="{start + count - 1}">',
            f'   <metadata type="volume" key="name" value={quoteattr(name)}/>',
            '   <metadata type="volume" key="volume_type" value="ModelPart"/>',
            f'   <metadata type="volume" key="matrix" value="{UNIT_MATRIX}"/>',
        ]
        if coloured:
            lines.append(f'   <metadata type="volume" key="extruder" value="{index}"/>')
        lines.append("  </volume>")
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
