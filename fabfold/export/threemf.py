"""3MF: what goes to the slicer, with a name and a colour for each body.

The bodies are grouped in one of the layouts "kit", "assembly" and "apart" of :mod:`hinges.package`,
which writes the file.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import GeometryError
from fabfold.export.colours import palette
from fabfold.export.weld import printable_mesh
from fabfold.files import write_bytes
from fabfold.joinery.bodies import Joinery

__all__ = ["Layout", "posed", "write_3mf"]

Layout = Literal["kit", "assembly", "apart"]


def posed(joinery: Joinery, poses_mm: NDArray[np.float64]) -> Joinery:
    """The same bodies, each moved from its place in shape A.

    Parameters
    ----------
    joinery : Joinery
        The printed bodies in shape A.
    poses_mm : (b, 4, 4) float64 array
        Rigid transform of each body, mm.

    Returns
    -------
    Joinery
        The moved bodies, for a print pose or a plate.
    """
    bodies = tuple(
        replace(body, vertices=body.vertices @ pose[:3, :3].T + pose[:3, 3])
        for body, pose in zip(joinery.bodies, np.asarray(poses_mm, dtype=float), strict=True)
    )
    return replace(joinery, bodies=bodies)


def write_3mf(
    path: Path,
    joinery: Joinery,
    *,
    title: str,
    metadata: Mapping[str, str] | None = None,
    colours: NDArray[np.uint8] | None = None,
    layout: Layout = "kit",
    thumbnail: bytes | None = None,
    keep_place: bool = False,
    coloured_parts: bool = False,
    settings: Callable[[list[int]], Mapping[str, str]] | None = None,
    auxiliaries: Mapping[str, bytes] | None = None,
) -> None:
    """Write the bodies as one 3MF file; the same input gives the same bytes.

    Parameters
    ----------
    path : Path
        File to write, ending in ``.3mf``.
    joinery : Joinery
        The bodies in the place where they are to be printed; see :func:`posed`.
    title : str
        Title of the file and name of the whole.
    metadata : mapping of str to str, optional
        Facts about the file, written as given. Names that the 3MF core specification does not know
        are put into the name space ``urn:fabfold:kit``. ``Application`` is ``fabfold`` unless
        given.
    colours : (b, 3) uint8 array, optional
        Colour of each body, sRGB.
    layout : {"kit", "assembly", "apart"}
        How the bodies are grouped, as :mod:`hinges.package` tells.
    thumbnail : bytes, optional
        A PNG that file managers and slicers show for the file.
    keep_place : bool
        Whether the bodies stay where they are; otherwise they are moved so that all coordinates
        begin at 0.
    coloured_parts : bool
        With the layout "kit": whether PrusaSlicer, where it opens the file as a project, shows each
        body in its colour, as of an extruder of its own.
    settings : callable, optional
        Files of slicer settings by name, in place of the layout's own; it is given the number of
        each body's object.
    auxiliaries : mapping of str to bytes, optional
        Files that come with the model, by folder and name: Bambu Studio shows those in
        ``Assembly Guide``, ``Bill of Materials`` and ``Model Pictures``.

    Raises
    ------
    GeometryError
        If a body does not stay closed in the file's precision, or lib3mf finds it not manifold.
    """
    from fabfold.version import __version__
    from hinges.exceptions import HingeError
    from hinges.package import DECIMALS, PackagePart, package_3mf

    if colours is None:
        colours = palette(len(joinery.bodies))
    parts = []
    for body, (red, green, blue) in zip(joinery.bodies, colours.tolist(), strict=True):
        parts.append(
            PackagePart(body.name, *printable_mesh(body, DECIMALS), colour=(red, green, blue))
        )
    lowest = np.min([part.vertices.min(axis=0) for part in parts], axis=0)
    east, north, high = -np.round(lowest.astype(float), DECIMALS)
    try:
        package = package_3mf(
            parts,
            title=title,
            facts={"Title": title, "Application": f"fabfold {__version__}", **(metadata or {})},
            layout=layout,
            owner="fabfold",
            filaments=coloured_parts,
            closed=True,
            move=(0.0, 0.0, 0.0) if keep_place else (east, north, high),
            thumbnail=thumbnail,
            settings=settings,
            auxiliaries=auxiliaries,
        )
    except HingeError as error:
        raise GeometryError(f"{error}; make the kit with another seed") from None
    write_bytes(path, package)
