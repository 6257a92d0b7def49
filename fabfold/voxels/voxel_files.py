"""Voxels on disk: one npz file, the same bytes for the same voxels."""

from __future__ import annotations

import zipfile
import zlib
from pathlib import Path

import numpy as np

from fabfold.errors import KitError
from fabfold.files import write_npz
from fabfold.voxels.voxel_model import SUBDIVISION, Voxels

__all__ = ["load_voxels", "save_voxels"]

_FORMAT = "fabfold-voxels 1"
#: What numpy and zipfile raise over files that are cut off, damaged or something else.
_UNREADABLE = (
    AttributeError,
    EOFError,
    KeyError,
    OSError,
    TypeError,
    ValueError,
    zipfile.BadZipFile,
    zlib.error,
)


def save_voxels(path: Path, voxels: Voxels) -> None:
    """Write voxels to `path` in one step.

    Parameters
    ----------
    path : Path
        Ends in ``.npz``; the file is an ordinary compressed npz with fixed time stamps.
    voxels : Voxels
        What to write.
    """
    names = sorted(voxels.energy)
    arrays = {
        "format": np.array(_FORMAT),
        "cells": voxels.cells,
        "subvoxels": np.packbits(voxels.subvoxels),
        "fill": voxels.fill,
        "vertices": voxels.vertices,
        "faces": voxels.faces,
        "rotation": voxels.rotation,
        "origin": voxels.origin,
        "pitch": np.array(voxels.pitch),
        "offsets_x": voxels.plane_offsets[0],
        "offsets_y": voxels.plane_offsets[1],
        "offsets_z": voxels.plane_offsets[2],
        "lost_volume": np.array(voxels.lost_volume),
        "energy_names": np.array(names, dtype=np.str_),
        "energy_values": np.array([voxels.energy[name] for name in names], dtype=np.float64),
        **({"bosses": np.array(True)} if voxels.bosses else {}),
    }
    write_npz(Path(path), arrays)


def load_voxels(path: Path) -> Voxels:
    """Read voxels that :func:`save_voxels` wrote.

    Parameters
    ----------
    path : Path
        The npz file.

    Returns
    -------
    Voxels
        With the same arrays, bit for bit.

    Raises
    ------
    KitError
        If the file is missing, damaged, or something else.
    """
    try:
        with np.load(Path(path), allow_pickle=False) as data:
            if str(data["format"]) != _FORMAT:
                raise KitError(f"{path}: not a {_FORMAT} file; make the voxels again")
            cells = data["cells"].astype(np.int32)
            size = len(cells) * SUBDIVISION**3
            subvoxels = np.unpackbits(data["subvoxels"], count=size).astype(bool)
            names = [str(name) for name in data["energy_names"]]
            return Voxels(
                cells=cells,
                subvoxels=subvoxels.reshape(len(cells), SUBDIVISION, SUBDIVISION, SUBDIVISION),
                fill=data["fill"],
                vertices=data["vertices"],
                faces=data["faces"],
                rotation=data["rotation"],
                origin=data["origin"],
                pitch=float(data["pitch"]),
                plane_offsets=(data["offsets_x"], data["offsets_y"], data["offsets_z"]),
                lost_volume=float(data["lost_volume"]),
                energy=dict(zip(names, data["energy_values"].tolist(), strict=True)),
                bosses="bosses" in data.files,
            )
    except _UNREADABLE as error:
        raise KitError(
            f"{path}: cannot be read as voxels ({error}); delete it and make the voxels again"
        ) from error
