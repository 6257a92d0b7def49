"""The cubic lattice: cells, faces, the 24 rotations, templates.

Lattice coordinates count voxels: the centre of cell ``(i, j, k)`` is the point
``(i, j, k)`` and a voxel's side is 1.
"""

from __future__ import annotations

import itertools
import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import TemplateError
from fabfold.files import data_folder

__all__ = [
    "FACES",
    "ROTATIONS",
    "ROTATION_INVERSE",
    "ROTATION_PRODUCT",
    "Crease",
    "Template",
    "load_template",
    "parity",
    "rotation_about",
    "rotation_index",
    "rotation_of_degrees",
    "template_names",
]

IntArray = NDArray[np.int32]

#: The six face normals, shape (6, 3): +x, -x, +y, -y, +z, -z. Face ``f`` is opposite ``f ^ 1``.
FACES: IntArray = np.array(
    [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=np.int32
)


def _proper_rotations() -> IntArray:
    found = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1, -1), repeat=3):
            matrix = np.zeros((3, 3), dtype=np.int32)
            for row, (column, sign) in enumerate(zip(order, signs, strict=True)):
                matrix[row, column] = sign
            if round(float(np.linalg.det(matrix))) == 1:
                found.append(matrix)
    return np.array(found, dtype=np.int32)


#: The 24 proper rotations of the cube, shape (24, 3, 3); index 0 is the identity.
ROTATIONS: IntArray = _proper_rotations()


def rotation_of_degrees(degrees: tuple[float, float, float]) -> NDArray[np.float64]:
    """Rotation about x, then y, then z of the fixed axes, as a (3, 3) matrix."""
    origin = np.zeros(3)
    turns = [
        rotation_about(origin, axis, angle)[:3, :3]
        for axis, angle in zip(np.eye(3), degrees, strict=True)
    ]
    return turns[2] @ turns[1] @ turns[0]


def rotation_index(matrix: NDArray[np.generic]) -> int:
    """Index in :data:`ROTATIONS` of a 3 by 3 axis-aligned rotation.

    Parameters
    ----------
    matrix : (3, 3) array
        A proper rotation with entries near -1, 0 and 1.

    Raises
    ------
    ValueError
        If the matrix is none of the 24.
    """
    rounded = np.rint(np.asarray(matrix, dtype=float)).astype(np.int32)
    hits = np.flatnonzero((rounded == ROTATIONS).all(axis=(1, 2)))
    if len(hits) != 1 or np.abs(np.asarray(matrix, dtype=float) - rounded).max() > 1e-6:
        raise ValueError(f"not one of the 24 lattice rotations: {np.asarray(matrix).tolist()}")
    return int(hits[0])


#: ``ROTATIONS[ROTATION_PRODUCT[a, b]] == ROTATIONS[a] @ ROTATIONS[b]``, shape (24, 24).
ROTATION_PRODUCT: IntArray = np.array(
    [[rotation_index(a @ b) for b in ROTATIONS] for a in ROTATIONS], dtype=np.int32
)
#: ``ROTATIONS[ROTATION_INVERSE[a]] == ROTATIONS[a].T``, shape (24,).
ROTATION_INVERSE: IntArray = np.array([rotation_index(a.T) for a in ROTATIONS], dtype=np.int32)


def rotation_about(
    point: NDArray[np.generic], direction: NDArray[np.generic], angle_deg: float
) -> NDArray[np.float64]:
    """Rigid transform that turns space about a line.

    Parameters
    ----------
    point : (3,) array
        A point on the axis.
    direction : (3,) array
        The direction of the axis; its length does not matter.
    angle_deg : float
        Right-handed angle about `direction` in degrees.

    Returns
    -------
    (4, 4) float64 array
        Homogeneous transform (Rodrigues' formula); exact for multiples of 90 degrees.
    """
    unit = np.asarray(direction, dtype=float)
    unit = unit / np.linalg.norm(unit)
    quarter = angle_deg / 90.0
    if quarter == round(quarter):
        sine, cosine = ((0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0))[int(quarter) % 4]
    else:
        radians = np.radians(angle_deg)
        sine, cosine = float(np.sin(radians)), float(np.cos(radians))
    cross = np.array([[0.0, -unit[2], unit[1]], [unit[2], 0.0, -unit[0]], [-unit[1], unit[0], 0.0]])
    transform = np.eye(4)
    transform[:3, :3] += sine * cross + (1.0 - cosine) * (cross @ cross)
    origin = np.asarray(point, dtype=float)
    transform[:3, 3] = origin - transform[:3, :3] @ origin
    return transform


def parity(cells: NDArray[np.generic]) -> IntArray:
    """Checkerboard colour, 0 or 1, of each cell of an (n, 3) integer array, shape (n,)."""
    return np.asarray(np.asarray(cells, dtype=np.int32).sum(axis=-1) % 2, dtype=np.int32)


@dataclass(frozen=True)
class Crease:
    """A hinge line of a template that is folded once more when it is filled.

    Attributes
    ----------
    start, end : three int
        Corners of cells, between which the line runs: the corner ``(i, j, k)`` is the point
        ``(i, j, k) - 0.5`` of the lattice.
    angle_deg : int
        Right-handed about the direction from `start` to `end`: 90, 180, -90 or -180.
    moves : (k, 3) int32 array
        The cells that turn, as the template lies before any fold.
    """

    start: tuple[int, int, int]
    end: tuple[int, int, int]
    angle_deg: int
    moves: IntArray

    def shifted(self, by: NDArray[np.integer]) -> Crease:
        """The same crease moved by whole cells."""
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
        :mod:`fabfold.creases`.
    joints : str
        ``"any"``, or ``"inside"`` where no hinge may lie on the surface of the folded shape.
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
            By twice the middle of the edge, plus 1.
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
        """Boolean grid of the cells with `pad` empty cells on every side."""
        grid = np.zeros(np.array(self.shape) + 2 * pad, dtype=bool)
        grid[tuple((self.cells + pad).T)] = True
        return grid


_BOX = re.compile(r"box-(\d+)x(\d+)x(\d+)")
#: Most cells of a template, and most along an axis.
MAX_CELLS = 4096
MAX_SIDE = 64


def templates_folder() -> Path:
    """Folder that holds the template files, in a checkout as in an installed wheel."""
    return data_folder("templates")


def template_names() -> list[str]:
    """Names of the templates that come as files; boxes of any size need no file."""
    return sorted(path.stem for path in templates_folder().glob("*.toml"))


def load_template(name: str) -> Template:
    """Template by name: ``box-AxBxC`` of any size, a shipped name, or a ``.toml`` file.

    The format of a file is described in :mod:`fabfold.templates`. A mesh as the target is
    :func:`fabfold.voxels.target.template_of_solid`.

    Raises
    ------
    TemplateError
        If there is no such template, or the file cannot be used.
    """
    if Path(name).suffix == ".toml":
        return _read(Path(name), name)
    return _shipped(name)


@cache
def _shipped(name: str) -> Template:
    box = _BOX.fullmatch(name)
    if box:
        size = [int(group) for group in box.groups()]
        if min(size) < 1 or max(size) > MAX_SIDE or int(np.prod(size)) > MAX_CELLS:
            raise TemplateError(
                f"template {name!r}: each side must be 1 to {MAX_SIDE} cells, the whole at most "
                f"{MAX_CELLS}"
            )
        return Template(name, np.argwhere(np.ones(size, dtype=bool)).astype(np.int32))
    return _read(templates_folder() / f"{name}.toml", name)


def _read(path: Path, name: str) -> Template:
    # The file format stands below the lattice, which it is written in terms of.
    from fabfold.templates import read_template

    if not path.is_file():
        known = ", ".join(template_names()) or "none"
        raise TemplateError(
            f"no template {name!r}: use box-AxBxC (for example box-4x4x4), "
            f"the path of a .toml file or of a mesh, or one of: {known}"
        )
    return read_template(path)
