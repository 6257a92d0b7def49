"""The closed manifold that every later stage works on."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import manifold3d
    import trimesh

__all__ = ["Paint", "Solid"]


@dataclass(frozen=True)
class Paint:
    """Faces of the model's file that have another colour than most of its surface.

    Attributes
    ----------
    corners : (k, 3, 3) float64 array
        Of each triangle, model units.
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
        Corner indices, counter-clockwise seen from outside.
    notes : tuple of str
        What was repaired or assumed on the way, in a maker's words.
    sha256 : str
        Digest of the input file (of the sample's name and version for samples).
    paint : Paint or None
        Painted faces; None where the file has one colour or none.
    """

    name: str
    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    notes: tuple[str, ...] = field(default=())
    sha256: str = ""
    paint: Paint | None = None

    @property
    def volume(self) -> float:
        """Enclosed volume in cubic model units."""
        corners = self.vertices[self.faces] - self.vertices.mean(axis=0)
        return float(
            np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
        )

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Smallest and largest corner of the bounding box, shape (2, 3), model units."""
        return np.array([self.vertices.min(axis=0), self.vertices.max(axis=0)])

    def to_manifold(self) -> manifold3d.Manifold:
        """The same solid as a manifold3d object (double precision)."""
        import manifold3d

        return manifold3d.Manifold(
            manifold3d.Mesh64(
                np.ascontiguousarray(self.vertices, dtype=np.float64),
                np.ascontiguousarray(self.faces, dtype=np.uint64),
            )
        )

    def to_trimesh(self) -> trimesh.Trimesh:
        """The same solid as a trimesh object, vertices untouched."""
        import trimesh

        return trimesh.Trimesh(self.vertices, self.faces, process=False)
