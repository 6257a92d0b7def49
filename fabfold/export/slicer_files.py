"""3MF files of a kit that is printed as one object, each for the slicer that reads it so."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fabfold.export.threemf import write_3mf
from fabfold.joinery.bodies import Joinery
from hinges.slicer_parts import BAMBU, PRUSA

__all__ = ["SLICER_ENDINGS", "remove_slicer_files", "slicer_endings", "write_slicer_files"]

#: Ending of the file for each slicer; Bambu Studio and OrcaSlicer read the same one.
SLICER_ENDINGS: Final = {
    "prusa": "-prusa.3mf",
    "prusa3": "-prusa3.3mf",
    "orca": "-bambu.3mf",
    "bambu": "-bambu.3mf",
}


def slicer_endings(slicer: str) -> list[str]:
    """Endings of the files that a recipe asks for, beside ``NAME.3mf``.

    Parameters
    ----------
    slicer : {"any", "prusa", "prusa3", "orca", "bambu", "all"}
        The recipe's choice; any is ``NAME.3mf``, and the file for Bambu Studio and OrcaSlicer.
    """
    if slicer == "all":
        return sorted(set(SLICER_ENDINGS.values()))
    return [SLICER_ENDINGS["bambu" if slicer == "any" else slicer]]


def remove_slicer_files(folder: Path, name: str, keep: Sequence[str]) -> None:
    """Remove the files for slicers that an earlier export wrote, but those with some endings."""
    for ending in sorted({*SLICER_ENDINGS.values()} - {*keep}):
        (folder / f"{name}{ending}").unlink(missing_ok=True)


def write_slicer_files(
    folder: Path,
    name: str,
    joinery: Joinery,
    slicer: str,
    *,
    title: str,
    metadata: Mapping[str, str],
    colours: NDArray[np.uint8],
    thumbnail: bytes | None = None,
    auxiliaries: Mapping[str, bytes] | None = None,
) -> None:
    """Write the files that open as one object with named parts in the kit's colours.

    Parameters
    ----------
    folder : Path
        Kit folder; files for slicers that are not asked for go.
    name : str
        Stem of the files' names.
    joinery : Joinery
        The bodies in the pose in which they are printed.
    slicer : str
        As of :func:`slicer_endings`.
    title : str
        Name of the object.
    metadata : mapping of str to str
        Facts about the files.
    colours : (b, 3) uint8 array
        Colour of each body, sRGB.
    thumbnail : bytes, optional
        A PNG that is shown for the file.
    auxiliaries : mapping of str to bytes, optional
        Files that Bambu Studio shows beside the model.
    """
    wanted = slicer_endings(slicer)
    remove_slicer_files(folder, name, wanted)
    application = {
        SLICER_ENDINGS["bambu"]: {"Application": BAMBU},
        SLICER_ENDINGS["prusa3"]: {"Application": PRUSA},
    }
    for ending in wanted:
        bambu = ending == SLICER_ENDINGS["bambu"]
        write_3mf(
            folder / f"{name}{ending}",
            joinery,
            title=title,
            metadata={**metadata, **application.get(ending, {})},
            colours=colours,
            layout="assembly" if bambu else "kit",
            thumbnail=thumbnail,
            coloured_parts=not bambu,
            auxiliaries=auxiliaries if bambu else None,
        )
