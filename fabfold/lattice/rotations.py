"""The cubic lattice: its faces and its 24 rotations.

Lattice coordinates count voxels: the centre of cell ``(i, j, k)`` is the point
``(i, j, k)`` and a voxel's side is 1.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "FACES",
    "FACE_BEFORE",
    "ROTATIONS",
    "ROTATION_INVERSE",
    "ROTATION_PRODUCT",
    "parity",
    "rotation_about",
    "rotation_index",
    "rotation_of_degrees",
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
    """Rotation about x, then y, then z of the fixed axes.

    Parameters
    ----------
    degrees : tuple of 3 float
        Right-handed angles about x, y and z, degrees.

    Returns
    -------
    (3, 3) float64 array
        The rotation matrix.
    """
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

    Returns
    -------
    int
        From 0 to 23.

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


#: Face that each rotation turns towards each face, shape (24, 6): rotation ``r`` carries
#: ``FACES[FACE_BEFORE[r, f]]`` to ``FACES[f]``.
FACE_BEFORE: NDArray[np.int64] = np.array(
    [[int(np.flatnonzero((d @ r == FACES).all(axis=1))[0]) for d in FACES] for r in ROTATIONS]
)


def rotation_about(
    point: NDArray[np.generic], direction: NDArray[np.generic], angle_deg: float
) -> NDArray[np.float64]:
    """Rigid transform that turns space about a line.

    Parameters
    ----------
    point : (3,) array
        A point on the axis, in any unit of length.
    direction : (3,) array
        The direction of the axis; its length does not matter.
    angle_deg : float
        Right-handed angle about `direction` in degrees.

    Returns
    -------
    (4, 4) float64 array
        Homogeneous transform (Rodrigues' formula), in the unit of `point`; exact for multiples of
        90 degrees.
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
    """Checkerboard colour of cells.

    Parameters
    ----------
    cells : (..., 3) int array
        Lattice coordinates.

    Returns
    -------
    (...) int32 array
        0 or 1 for each cell: the sum of its coordinates modulo 2.
    """
    return np.asarray(np.asarray(cells, dtype=np.int32).sum(axis=-1) % 2, dtype=np.int32)
