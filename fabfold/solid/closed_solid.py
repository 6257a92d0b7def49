"""The closed solid that every later stage works on, and its painted faces."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from fabfold.meshes import mesh_volume

__all__ = ["Paint", "Solid"]


@dataclass(frozen=True)
class Paint:
    """Faces of the model's file that have another colour than most of its surface.

    Attributes
    ----------
    corners : (k, 3, 3) float64 array
        Coordinates of the three corners of each triangle, in model units.
    colours : (k, 3) uint8 array
        sRGB of each triangle.
    """

    corners: NDArray[np.float64]
    colours: NDArray[np.uint8]


@dataclass(frozen=True)
class Solid:
    """One closed, outward-oriented, two-manifold triangle mesh.

    Attributes
    ----------
    name : str
        Stem of the file or of the sample, used to name the kit's files.
    vertices : (v, 3) float64 array
        Corner coordinates in model units.
    faces : (f, 3) int32 array
        Three vertex indices for each triangle, counter-clockwise seen from outside.
    notes : tuple of str
        What was repaired or assumed on the way, in a maker's words.
    sha256 : str
        Digest of the input file (of the sample's name and version for samples).
    paint : Paint or None
        Painted faces; None where the file has one colour or none.
    pieces : int
        Separate pieces of material that the file had; what was made of them is one.
    """

    name: str
    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    notes: tuple[str, ...] = field(default=())
    sha256: str = ""
    paint: Paint | None = None
    pieces: int = 1

    @property
    def volume(self) -> float:
        """Enclosed volume in cubic model units."""
        return mesh_volume(self.vertices, self.faces)

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Smallest and largest corner of the bounding box, shape (2, 3), model units."""
        return np.array([self.vertices.min(axis=0), self.vertices.max(axis=0)])

    def in_axes(self, axes: NDArray[np.float64]) -> Solid:
        """The solid as it lies in other axes.

        Parameters
        ----------
        axes : (3, 3) float64 array
            One axis a row: an orthogonal matrix; of determinant -1 it mirrors the solid.

        Returns
        -------
        Solid
            With the same corners in the same order.
        """
        paint = self.paint
        if paint is not None:
            paint = replace(paint, corners=np.einsum("ijk,lk->ijl", paint.corners, axes))
        mirrored = np.linalg.det(axes) < 0
        return replace(
            self,
            vertices=np.einsum("ij,kj->ik", self.vertices, axes),
            faces=np.ascontiguousarray(self.faces[:, ::-1]) if mirrored else self.faces,
            paint=paint,
        )
