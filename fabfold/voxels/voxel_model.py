"""The voxelized model: cells, their material, and the warped mesh they cut."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

__all__ = ["BOSSES_NOTE", "SUBDIVISION", "Voxels"]

#: Subvoxels along the side of a voxel (paper section 3: 20 x 20 x 20).
SUBDIVISION = 20
#: What `bosses` mean, in a maker's words.
BOSSES_NOTE = (
    "the model is thin where voxels touch: hinges may stand on bosses beside it, which struts tie "
    "to it"
)


@dataclass(frozen=True)
class Voxels:
    """A model cut into voxels (paper section 3).

    Everything is in lattice units of shape A: cell ``(i, j, k)`` is the cube of side 1 about the
    point ``(i, j, k)``; subvoxel ``(a, b, c)`` of it is the cube of side 1/20 whose smallest
    corner is ``(i, j, k) - 0.5 + (a, b, c) / 20``.

    Attributes
    ----------
    cells : (n, 3) int32 array
        Lattice coordinates of the kept cells, sorted lexicographically, smallest coordinate 0 on
        every axis.
    subvoxels : (n, 20, 20, 20) bool array
        Which subvoxels of each cell are material, after the warp.
    fill : (n,) float64 array
        Share of each cell that is material (mean of `subvoxels`).
    vertices : (v, 3) float64 array
        The warped model in lattice units.
    faces : (f, 3) int32 array
        Its triangles; a closed, outward-oriented two-manifold.
    rotation : (3, 3) float64 array
        From model axes to lattice axes, before the warp.
    origin : (3,) float64 array
        The point that becomes lattice (0, 0, 0): lattice axes, model units.
    pitch : float
        Side of a voxel in model units.
    plane_offsets : tuple of three (m,) float64 arrays
        How far each grid plane of x, y and z was moved before the warp, in voxel sides.
    lost_volume : float
        Share of the model's volume in cells that were dropped.
    energy : dict of str to float
        The terms of the placement's score, by name (``"fullness"`` is Eq. 1).
    bosses : bool
        Whether a hinge may also stand where the model does not reach the edge: between voxels whose
        material touches, on bosses that the join stage ties to it.
    """

    cells: NDArray[np.int32]
    subvoxels: NDArray[np.bool_]
    fill: NDArray[np.float64]
    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    rotation: NDArray[np.float64]
    origin: NDArray[np.float64]
    pitch: float
    plane_offsets: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
    lost_volume: float
    energy: dict[str, float]
    bosses: bool = False

    def __len__(self) -> int:
        return len(self.cells)

    @property
    def notes(self) -> tuple[str, ...]:
        """What people should know of these voxels."""
        return (BOSSES_NOTE,) if self.bosses else ()

    def in_axes(self, axes: NDArray[np.float64]) -> Voxels:
        """The same voxels of the model in the axes that it had before.

        Parameters
        ----------
        axes : (3, 3) float64 array
            The orthogonal matrix by which the model's corners were multiplied before it was cut.
            Where it mirrors, the voxels of the unmirrored model are mirrored along x.

        Returns
        -------
        Voxels
            With cells in their own order.
        """
        rotation = np.einsum("ij,jk->ik", self.rotation, axes)
        if np.linalg.det(axes) > 0:
            return replace(self, rotation=rotation)
        sign = np.array([-1.0, 1.0, 1.0])
        far = int(self.cells[:, 0].max())
        shift = np.array([far, 0, 0])
        cells = self.cells.copy()
        cells[:, 0] = far - cells[:, 0]
        order = np.lexsort(cells.T[::-1])
        offsets_x, offsets_y, offsets_z = self.plane_offsets
        return replace(
            self,
            cells=cells[order],
            subvoxels=np.ascontiguousarray(self.subvoxels[order, ::-1]),
            fill=self.fill[order],
            vertices=self.vertices * sign + shift,
            faces=np.ascontiguousarray(self.faces[:, ::-1]),
            rotation=sign[:, None] * rotation,
            origin=sign * (self.origin + self.pitch * shift),
            plane_offsets=(-offsets_x[::-1], offsets_y, offsets_z),
        )
