"""Shrink-wrap a surface that is too open to be capped."""

from __future__ import annotations

import numpy as np

from fabfold.errors import ModelError
from fabfold.meshes import mesh_volume
from fabfold.solid.surface import Shell
from fabfold.solid.topology import Faces, Points, face_areas, weld

__all__ = ["wrap_surface"]

#: Gaps up to this share of the diagonal are bridged.
ALPHA_PERCENT = 2.0
#: Distance of the wrap from the surface, as a share of the diagonal.
OFFSET_PERCENT = 0.2
#: A wrap whose mean thickness is less than this many offsets went inside through a hole.
MIN_OFFSETS = 8.0


def wrap_surface(
    label: str, vertices: Points, faces: Faces, reason: str
) -> tuple[list[Shell], list[str]]:
    """Wrap a closed skin round a surface (alpha wrapping).

    Parameters
    ----------
    label : str
        Name of the file, for messages.
    vertices : (v, 3) float64 array
        Longest side about 1.
    faces : (f, 3) int64 array
    reason : str
        Why the surface cannot be used as it is.

    Returns
    -------
    shells : list of Shell
        The one skin.
    notes : list of str

    Raises
    ------
    ModelError
        If the skin follows both sides of the surface, which then encloses nothing.

    References
    ----------
    Portaneri et al. (2022), "Alpha wrapping with an offset".
    """
    import pymeshlab

    vertices, faces = weld(vertices, faces)
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(vertices, faces.astype(np.int32)))
    meshes.generate_alpha_wrap(
        alpha=pymeshlab.PercentageValue(ALPHA_PERCENT),
        offset=pymeshlab.PercentageValue(OFFSET_PERCENT),
    )
    found = meshes.current_mesh()
    skin = np.asarray(found.vertex_matrix(), dtype=np.float64)
    triangles = np.asarray(found.face_matrix(), dtype=np.int64)
    diagonal = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    area = float(face_areas(skin, triangles).sum())
    volume = mesh_volume(skin, triangles.astype(np.int32))
    thickness = 2 * volume / area
    if thickness < MIN_OFFSETS * OFFSET_PERCENT / 100 * diagonal:
        raise ModelError(
            f"{label} is not a closed surface: {reason}, and what is left encloses no volume; "
            "close its surface in your modelling program"
        )
    return [Shell(skin, triangles)], [
        f"the surface is not closed ({reason}): it was wrapped in a closed skin that bridges gaps "
        f"up to {ALPHA_PERCENT:g} % of the model's diagonal and lies {OFFSET_PERCENT:g} % outside"
    ]
