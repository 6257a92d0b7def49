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
    "Template",
    "load_template",
    "parity",
    "rotation_about",
    "rotation_index",
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
class Template:
    """A target shape made of cells.

    Attributes
    ----------
    name : str
        Such as ``"box-4x4x4"``.
    cells : (m, 3) int32 array
        The cells in lattice coordinates, sorted, smallest coordinate 0 on every axis.
    """

    name: str
    cells: IntArray

    def __post_init__(self) -> None:
        cells = np.asarray(self.cells, dtype=np.int32).reshape(-1, 3)
        if len(cells) == 0:
            raise TemplateError(f"template {self.name!r} has no cells")
        cells = np.unique(cells - cells.min(axis=0), axis=0)
        cells.setflags(write=False)
        object.__setattr__(self, "cells", cells)

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

    def occupancy(self, pad: int = 0) -> NDArray[np.bool_]:
        """Boolean grid of the cells with `pad` empty cells on every side."""
        grid = np.zeros(np.array(self.shape) + 2 * pad, dtype=bool)
        grid[tuple((self.cells + pad).T)] = True
        return grid


_BOX = re.compile(r"box-(\d+)x(\d+)x(\d+)")


def templates_folder() -> Path:
    """Folder that holds the template files, in a checkout as in an installed wheel."""
    return data_folder("templates")


def template_names() -> list[str]:
    """Names of the templates that come as files; boxes of any size need no file."""
    return sorted(path.stem for path in templates_folder().glob("*.toml"))


@cache
def load_template(name: str) -> Template:
    """Template by name: ``box-AxBxC`` of any size, a shipped name, or a ``.toml`` file.

    A file has ``name = "..."`` and either ``cells = [[i, j, k], ...]`` or ``layers``, a list of
    layers from z = 0 upwards, each a list of strings (rows along y, characters along x) in which
    ``#`` is a cell and ``.`` is none.

    Raises
    ------
    TemplateError
        If there is no such template, or the file cannot be used.
    """
    import tomllib

    box = _BOX.fullmatch(name)
    if box:
        size = [int(group) for group in box.groups()]
        if min(size) < 1 or max(size) > 32 or int(np.prod(size)) > 4096:
            raise TemplateError(
                f"template {name!r}: each side must be 1 to 32 cells, the whole at most 4096"
            )
        return Template(name, np.argwhere(np.ones(size, dtype=bool)).astype(np.int32))
    path = Path(name)
    if path.suffix != ".toml":
        path = templates_folder() / f"{name}.toml"
    if not path.is_file():
        known = ", ".join(template_names()) or "none"
        raise TemplateError(
            f"no template {name!r}: use box-AxBxC (for example box-4x4x4), "
            f"the path of a .toml file, or one of: {known}"
        )
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise TemplateError(f"template file {path}: cannot be read: {error}") from error
    unknown = set(data) - {"name", "cells", "layers", "description"}
    if unknown or ("cells" in data) == ("layers" in data):
        raise TemplateError(
            f"template file {path}: wants a name and either cells or layers"
            + (f"; unknown keys: {', '.join(sorted(unknown))}" if unknown else "")
        )
    return Template(str(data.get("name", path.stem)), _cells_of(data, path))


def _cells_of(data: dict[str, object], path: Path) -> IntArray:
    try:
        if "cells" in data:
            cells = np.array(data["cells"])
            if cells.ndim != 2 or cells.shape[1] != 3 or cells.dtype.kind != "i":
                raise ValueError("cells must be a list of [i, j, k] integers")
            return cells.astype(np.int32)
        layers = data["layers"]
        if not isinstance(layers, list):
            raise ValueError("layers must be a list of lists of strings")
        found = [
            (x, y, z)
            for z, layer in enumerate(layers)
            for y, row in enumerate(layer)
            for x, character in enumerate(row)
            if character == "#"
        ]
        return np.array(found, dtype=np.int32).reshape(-1, 3)
    except (ValueError, TypeError, OverflowError) as error:
        raise TemplateError(f"template file {path}: {error}") from error
