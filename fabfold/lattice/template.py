"""Target shapes that a model folds into.

A :class:`Template` is a set of lattice cells. It may have creases, along which it is folded once
more when it is filled.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import TemplateError
from fabfold.lattice.rotations import FACES, IntArray, parity

__all__ = ["MAX_CELLS", "MAX_SIDE", "Crease", "Template"]

#: Most cells of a template, and most along an axis.
MAX_CELLS = 4096
MAX_SIDE = 64


@dataclass(frozen=True)
class Crease:
    """A hinge line of a template that is folded once more when it is filled.

    Attributes
    ----------
    start, end : tuple of 3 int
        Corners of cells, between which the line runs: the corner ``(i, j, k)`` is the point
        ``(i, j, k) - 0.5`` of the lattice.
    angle_deg : int
        Right-handed fold angle about the direction from `start` to `end`: 90, 180, -90 or -180
        degrees.
    moves : (k, 3) int32 array
        The cells that turn, as the template lies before any fold.
    """

    start: tuple[int, int, int]
    end: tuple[int, int, int]
    angle_deg: int
    moves: IntArray

    def shifted(self, by: NDArray[np.integer]) -> Crease:
        """The same crease moved by whole cells.

        Parameters
        ----------
        by : (3,) int array
            Cells along x, y and z.

        Returns
        -------
        Crease
            With line and cells moved.
        """
        x, y, z = (int(value) for value in by)
        return Crease(
            (self.start[0] + x, self.start[1] + y, self.start[2] + z),
            (self.end[0] + x, self.end[1] + y, self.end[2] + z),
            self.angle_deg,
            np.asarray(self.moves + np.array([x, y, z]), dtype=np.int32),
        )


@dataclass(frozen=True)
class Template:
    """A target shape made of cells.

    Attributes
    ----------
    name : str
        Such as ``"box-4x4x4"``.
    cells : (m, 3) int32 array
        The cells in lattice coordinates, sorted, smallest coordinate 0 on every axis.
    creases : tuple of Crease
        Folds that the filled template makes in the end, in this order; most have none. See
        :mod:`fabfold.lattice.creases`.
    joints : str
        Where hinges may lie: ``"any"``, or ``"inside"`` where none may lie on the surface of the
        folded shape.

    Raises
    ------
    TemplateError
        If there is no cell.
    """

    name: str
    cells: IntArray
    creases: tuple[Crease, ...] = ()
    joints: str = "any"

    def __post_init__(self) -> None:
        cells = np.asarray(self.cells, dtype=np.int32).reshape(-1, 3)
        if len(cells) == 0:
            raise TemplateError(f"template {self.name!r} has no cells")
        low = cells.min(axis=0)
        cells = np.unique(cells - low, axis=0)
        cells.setflags(write=False)
        object.__setattr__(self, "cells", cells)
        object.__setattr__(self, "creases", tuple(c.shifted(-low) for c in self.creases))

    def __len__(self) -> int:
        return len(self.cells)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Extent of the bounding box in cells."""
        x, y, z = (self.cells.max(axis=0) + 1).tolist()
        return (x, y, z)

    @property
    def colours(self) -> tuple[int, int]:
        """Number of cells of checkerboard colour 0 and 1."""
        odd = int(parity(self.cells).sum())
        return (len(self.cells) - odd, odd)

    @property
    def content(self) -> list[object]:
        """Its shape and its folds, as lists (JSON-ready)."""
        folds = [[c.start, c.end, c.angle_deg, c.moves.tolist()] for c in self.creases]
        return [self.cells.tolist(), *folds]

    def inside_edges(self) -> NDArray[np.bool_]:
        """Lattice edges that lie inside the shape: all four cells around them belong to it.

        Returns
        -------
        (2 x + 1, 2 y + 1, 2 z + 1) bool array
            Whether each edge lies inside, indexed by twice its middle plus 1, where x, y and z are
            the sides of the bounding box in cells.
        """
        near = self.occupancy(pad=1)
        inside = np.zeros(2 * np.array(self.shape) + 1, dtype=bool)
        for axis in range(3):
            one, other = (k for k in range(3) if k != axis)
            around = near & np.roll(near, -1, axis=one)
            around &= np.roll(around, -1, axis=other)
            # Entry e of a padded grid is cell e - 1; the edge lies on its upper side.
            at = np.argwhere(around)
            middle = 2 * (at - 1) + 1
            middle[:, one] += 1
            middle[:, other] += 1
            inside[tuple(middle.T)] = True
        return inside

    def occupancy(self, pad: int = 0) -> NDArray[np.bool_]:
        """Grid of the bounding box that tells which cells there are.

        Parameters
        ----------
        pad : int
            Empty cells added on every side.

        Returns
        -------
        (x + 2 pad, y + 2 pad, z + 2 pad) bool array
            True for cells of the template.
        """
        grid = np.zeros(np.array(self.shape) + 2 * pad, dtype=bool)
        grid[tuple((self.cells + pad).T)] = True
        return grid

    def outer_faces(self) -> NDArray[np.bool_]:
        """Which faces of the cells lie on the outside.

        Returns
        -------
        (m, 6) bool array
            For each cell, and each face in the order of :data:`fabfold.lattice.rotations.FACES`.
        """
        grid = self.occupancy(pad=1)
        return np.stack([~grid[tuple((self.cells + 1 + d).T)] for d in FACES], axis=1)
