"""Wrap a closed skin round a surface that is too open to be capped."""

from __future__ import annotations

import numpy as np

from fabfold.errors import ModelError
from fabfold.meshes import face_areas, mesh_volume, weld
from fabfold.solid.convert import from_mesh_set, to_mesh_set
from fabfold.solid.surface import Shell
from fabfold.solid.topology import Faces, Points

__all__ = ["wrap", "wrap_surface"]

#: Gaps up to this share of the diagonal are bridged.
ALPHA_PERCENT = 2.0
#: Distance of the wrap from the surface, as a share of the diagonal.
OFFSET_PERCENT = 0.1
#: A wrap whose mean thickness is less than this many offsets went inside through a hole.
MIN_OFFSETS = 10.0


def wrap(vertices: Points, faces: Faces) -> tuple[Points, Faces]:
    """A closed skin round any triangles, by alpha wrapping (CGAL).

    Parameters
    ----------
    vertices : (v, 3) float64 array
        Corner coordinates, in any unit.
    faces : (f, 3) int64 array
        Three vertex indices for each triangle; they need not be joined.

    Returns
    -------
    vertices : (w, 3) float64 array
        Corner coordinates of the skin, in the same unit.
    faces : (g, 3) int64 array
        Its triangles, a closed manifold.

    References
    ----------
    Portaneri et al. (2022), "Alpha wrapping with an offset".
    """
    import pymeshlab

    meshes = to_mesh_set(vertices, faces)
    meshes.generate_alpha_wrap(
        alpha=pymeshlab.PercentageValue(ALPHA_PERCENT),
        offset=pymeshlab.PercentageValue(OFFSET_PERCENT),
    )
    return from_mesh_set(meshes)


def wrap_surface(
    name: str, vertices: Points, faces: Faces, reason: str
) -> tuple[list[Shell], list[str]]:
    """Wrap a closed skin round a surface that encloses something.

    Parameters
    ----------
    name : str
        Name of the file, for messages.
    vertices : (v, 3) float64 array
        Corner coordinates; the longest side is about 1.
    faces : (f, 3) int64 array
        Three vertex indices for each triangle.
    reason : str
        Why the surface cannot be used as it is.

    Returns
    -------
    shells : list of Shell
        The one skin.
    notes : list of str
        A sentence for the maker that says what was done.

    Raises
    ------
    ModelError
        If the skin follows both sides of the surface, which then encloses nothing.
    """
    vertices, faces = weld(vertices, faces)
    skin, triangles = wrap(vertices, faces)
    diagonal = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    area = float(face_areas(skin[triangles]).sum())
    volume = mesh_volume(skin, triangles)
    if 2 * volume < MIN_OFFSETS * OFFSET_PERCENT / 100 * diagonal * area:
        raise ModelError(
            f"{name} is not a closed surface: {reason}, and a skin wrapped round it encloses next "
            "to nothing; close the surface in your modelling program"
        )
    return [Shell(skin, triangles)], [
        f"the surface is not closed ({reason}): it was wrapped in a skin that bridges gaps of up "
        f"to {ALPHA_PERCENT:g} % of the model's diagonal and lies {OFFSET_PERCENT:g} % outside it"
    ]
