"""Printed bodies: what the joinery stage hands on."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fabfold.meshes import mesh_volume

__all__ = ["BodyMesh", "Joinery"]


@dataclass(frozen=True)
class BodyMesh:
    """One printed body in shape A.

    Attributes
    ----------
    name : str
        Name of the body in ``tree.json``.
    vertices : (v, 3) float64 array
        In mm, shape A.
    faces : (f, 3) int32 array
        One closed, outward-oriented two-manifold piece.
    """

    name: str
    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]

    @property
    def volume(self) -> float:
        """Enclosed volume in mm³."""
        return mesh_volume(self.vertices, self.faces)


@dataclass(frozen=True)
class Joinery:
    """All printed bodies of a kit and how they were made.

    Attributes
    ----------
    bodies : tuple of BodyMesh
        In the order of ``FoldTree.bodies``.
    voxel_mm : float
        Side of a voxel in mm.
    origin_mm : (3,) tuple of float
        ``origin_mm + voxel_mm * lattice`` gives mm in shape A.
    clearance_mm : float
        Gap between bodies and normal clearance in the hinges.
    barrel_radius_mm, pin_radius_mm : float
        Of every single hinge.
    knuckles : int
        Knuckles on a hinge.
    carved_cells : int
        Cells of bodies that lost material to grooves for the barrels of other hinges.
    carved_mm3 : float
        That material.
    dropped_mm3 : float
        Loose crumbs of material that were left out because nothing carried them.
    struts : int
        Bars added inside cells to join material that the cut left apart.
    notes : tuple of str
        What else was done, in a maker's words.
    rounded_cells : int
        Cells that lost corners so that they pass each other on the folding path.
    rounded_skin_mm3, rounded_inside_mm3 : float
        What they lost, at the model's surface and inside it.
    """

    bodies: tuple[BodyMesh, ...]
    voxel_mm: float
    origin_mm: tuple[float, float, float]
    clearance_mm: float
    barrel_radius_mm: float
    pin_radius_mm: float
    knuckles: int
    carved_cells: int = 0
    carved_mm3: float = 0.0
    dropped_mm3: float = 0.0
    struts: int = 0
    notes: tuple[str, ...] = field(default=())
    rounded_cells: int = 0
    rounded_skin_mm3: float = 0.0
    rounded_inside_mm3: float = 0.0
