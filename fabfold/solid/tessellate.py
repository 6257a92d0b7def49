"""Triangles of a CAD solid, for STEP files and the samples."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["tessellate"]

#: Largest distance of a triangle from the true surface, as a share of the longest side.
CHORD_SHARE = 0.0005
#: Largest turn between neighbouring triangles, radians.
CHORD_ANGLE = 0.2


def tessellate(
    shape: Any, longest: float, chord: float = CHORD_SHARE, angle: float = CHORD_ANGLE
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Cut the faces of a build123d shape into triangles.

    Parameters
    ----------
    shape : build123d.Shape
        A solid, or faces.
    longest : float
        The longest side of the whole model, model units; accuracy goes by it.
    chord : float, optional
        Largest distance from the true surface as a share of `longest`.
    angle : float, optional
        Largest turn between neighbouring triangles in radians.

    Returns
    -------
    vertices : (v, 3) float64 array
        Corner coordinates in the unit of `shape`.
    faces : (f, 3) int64 array
        Counter-clockwise seen from outside; corners are repeated along the edges of faces, with
        the same coordinates up to rounding.
    """
    points, triangles = shape.tessellate(chord * longest, angle)
    vertices = np.array([[p.X, p.Y, p.Z] for p in points], dtype=np.float64).reshape(-1, 3)
    return vertices, np.array(triangles, dtype=np.int64).reshape(-1, 3)
