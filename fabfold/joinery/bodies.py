"""The printed bodies of a kit as meshes, and the figures of how they were made."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fabfold.meshes import mesh_volume
from fabfold.solid.convert import to_manifold, to_mesh

__all__ = ["BodyMesh", "Joinery", "PlacedPin"]

#: Pictures keep to the surface within this share of the voxel side: a third of a pixel of a manual.
_DRAWN_SHARE = 0.005


@dataclass(frozen=True)
class BodyMesh:
    """One printed body in shape A.

    Attributes
    ----------
    name : str
        Name of the body in ``tree.json``.
    vertices : (v, 3) float64 array
        Corners of the mesh in mm, shape A.
    faces : (f, 3) int32 array
        Triangles as indices into `vertices`: one closed two-manifold, counter-clockwise seen from
        outside.
    """

    name: str
    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]

    @property
    def volume(self) -> float:
        """Enclosed volume in mm³."""
        return mesh_volume(self.vertices, self.faces)


@dataclass(frozen=True)
class PlacedPin:
    """A pin that is pushed in after printing, in shape A.

    Attributes
    ----------
    hinge : int
        Index of the hinge that turns on it.
    owner : int
        Index of the body that grips it.
    tip_mm : (3,) tuple of float
        Middle of the end that goes in first, mm.
    tail_mm : (3,) tuple of float
        Middle of its other end, mm.
    diameter_mm : float
        Diameter, mm.
    head_mm : float
        Radius of the head at its tail, mm; 0 where it has none.
    head_height_mm : float
        Height of that head, mm.
    thread_mm : float
        Length at its tip that cuts itself into the body that grips it, mm; 0 for a plain pin.
    tight : bool
        Whether the body that turns on it grips it too, so that the hinge rubs.
    """

    hinge: int
    owner: int
    tip_mm: tuple[float, float, float]
    tail_mm: tuple[float, float, float]
    diameter_mm: float
    head_mm: float = 0.0
    head_height_mm: float = 0.0
    thread_mm: float = 0.0
    tight: bool = False

    @property
    def length_mm(self) -> float:
        """Length without a head, mm."""
        return float(np.linalg.norm(np.subtract(self.tail_mm, self.tip_mm)))


@dataclass(frozen=True)
class Joinery:
    """All printed bodies of a kit and how they were made.

    Attributes
    ----------
    bodies : tuple of BodyMesh
        The meshes, in the order of ``FoldTree.bodies``.
    voxel_mm : float
        Side of a voxel in mm.
    origin_mm : (3,) tuple of float
        Where the lattice origin lies in shape A, mm: ``origin_mm + voxel_mm * lattice`` gives mm.
    clearance_mm : float
        Normal clearance in the hinges, and gap between bodies where `face_gap_mm` is not given, mm.
    barrel_radius_mm : float
        Radius of every barrel, mm.
    pin_radius_mm : float
        Radius of the pin of every single hinge, mm.
    knuckles : int
        Number of knuckles of every single hinge.
    carved_cells : int
        Number of cells that lost material to grooves for barrels and pockets for link plates.
    carved_mm3 : float
        Volume of that material in mm³.
    dropped_mm3 : float
        Volume in mm³ of the loose fragments that were left out because nothing carried them.
    struts : int
        Number of bars added inside cells to join material that the cut left apart.
    notes : tuple of str
        What else was done, in a maker's words.
    rounded_cells : int
        Number of cells that lost corners so that they pass each other on the folding path.
    rounded_skin_mm3 : float
        Volume in mm³ that these corners had at the model's surface.
    rounded_inside_mm3 : float
        Volume in mm³ that these corners had inside the model.
    face_gap_mm : float or None
        Gap between the faces of two bodies, mm, where it is not the clearance.
    pins : tuple of PlacedPin
        Pins that are pushed in after printing; none where pins are printed.
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
    face_gap_mm: float | None = None
    pins: tuple[PlacedPin, ...] = ()

    @property
    def gap_mm(self) -> float:
        """Gap between the faces of two bodies, mm."""
        return self.clearance_mm if self.face_gap_mm is None else self.face_gap_mm

    @cached_property
    def drawn(self) -> list[tuple[NDArray[np.float64], NDArray[np.int32]]]:
        """Vertices (v, 3), mm, and triangles (f, 3) of each body as pictures show it.

        A third as many triangles as the printed body has, and none of them off its surface by more
        than a two-hundredth of a voxel.
        """
        meshes = []
        for body in self.bodies:
            mesh = body.vertices, body.faces
            # What is no closed manifold, such as a sketch of voxels, is drawn as it is.
            if len(body.faces):
                solid = to_manifold(*mesh).simplify(_DRAWN_SHARE * self.voxel_mm)
                if not solid.is_empty():
                    points, triangles = to_mesh(solid)
                    mesh = points, triangles.astype(np.int32)
            meshes.append(mesh)
        return meshes
