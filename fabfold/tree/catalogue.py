"""The joints between two voxels that share a face, derived from their geometry.

A child cell stands beside its parent's face ``d``. A single hinge lies on one of the 4 edges of
that face. A double hinge has a thin link plate in the face: axis 1 on one of its edges joins it to
the parent, axis 2 on one of its edges joins it to the child. Every axis is a lattice edge, so any
number of quarter turns carries the child to a lattice pose.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fabfold.lattice.rotations import FACES, rotation_about, rotation_index

__all__ = [
    "JOINT_SETS",
    "Joint",
    "JointChoice",
    "JointSet",
    "double_joints",
    "edge_sides",
    "edge_turn",
    "face_transforms",
    "joint_types",
    "realizations",
    "single_joints",
]

JointSet = Literal["S", "S90", "S+D", "all"]
#: Joints that a search may use beside rigid ones: half-turn hinges; quarter turns as well; half
#: turns and the double hinges that keep the checkerboard colour of a cell; everything.
JOINT_SETS: tuple[JointSet, ...] = ("S", "S90", "S+D", "all")
#: What may be asked for: one of the sets, or ``auto``, which searches with the first set and lets
#: double hinges in where they make the best trees better.
JointChoice = Literal["auto", "S", "S90", "S+D", "all"]


@dataclass(frozen=True)
class Joint:
    """One joint type across face `face` of the parent.

    Attributes
    ----------
    kind : str
        ``"R"`` rigid, ``"S"`` single hinge, or ``"D"`` double hinge.
    face : int
        Face of the parent that the child stands on, index in
        :data:`fabfold.lattice.rotations.FACES`.
    sides : tuple of int
        For each axis, which edge of the face it lies on: 0 to 3, see :func:`edge_sides`.
    turns : tuple of int
        For each axis, quarter turns (right-handed about ``FACES[face] x side``; a positive turn
        opens the face and goes around the outside of the edge).
    offset : tuple of int
        Where the child's cell goes, relative to the parent's, in the parent's frame.
    rotation : int
        The child's turn in the parent's frame, index in
        :data:`fabfold.lattice.rotations.ROTATIONS`.
    """

    kind: str
    face: int
    sides: tuple[int, ...]
    turns: tuple[int, ...]
    offset: tuple[int, int, int]
    rotation: int


def edge_sides(face: int) -> tuple[int, int, int, int]:
    """The 4 in-plane directions of a face, as indices of ``FACES`` in ascending order.

    Edge ``k`` of the face is the one towards ``FACES[edge_sides(face)[k]]``.

    Parameters
    ----------
    face : int
        Index in :data:`fabfold.lattice.rotations.FACES`.

    Returns
    -------
    tuple of 4 int
        Indices in ``FACES``.
    """
    first, second, third, fourth = (f for f in range(6) if f >> 1 != face >> 1)
    return (first, second, third, fourth)


def edge_turn(face: int, side: int, quarters: int) -> NDArray[np.float64]:
    """Transform of a turn about an edge of the cell at the origin.

    Parameters
    ----------
    face : int
        Face of the cell, index in :data:`fabfold.lattice.rotations.FACES`.
    side : int
        Edge of the face, 0 to 3, see :func:`edge_sides`.
    quarters : int
        Quarter turns; a positive number opens the face.

    Returns
    -------
    (4, 4) float64 array
        Homogeneous transform in the parent's frame, lattice units.
    """
    d = FACES[face]
    n = FACES[edge_sides(face)[side]]
    return rotation_about((d + n) / 2.0, np.cross(d, n), 90.0 * quarters)


def _landing(face: int, transform: NDArray[np.float64]) -> tuple[tuple[int, int, int], int]:
    """Cell and rotation that a transform gives the cell beside `face`."""
    moved = np.rint(transform[:3, :3] @ FACES[face] + transform[:3, 3]).astype(int)
    x, y, z = moved.tolist()
    return (x, y, z), rotation_index(transform[:3, :3])


@cache
def face_transforms(face: int) -> tuple[Joint, ...]:
    """Every distinct transform that a link plate in `face` allows, fewest turning axes first.

    There are 97: the rigid one, 12 of one axis (4 of them, the turns of 270 degrees, put the child
    on its own parent) and 84 that need two real turns.

    Parameters
    ----------
    face : int
        Index in :data:`fabfold.lattice.rotations.FACES`.

    Returns
    -------
    tuple of Joint
        One joint for each transform.
    """
    found: dict[tuple[tuple[int, int, int], int], Joint] = {}
    cell, rotation = _landing(face, np.eye(4))
    found[cell, rotation] = Joint("R", face, (), (), cell, rotation)
    for side in range(4):
        for quarters in (1, 2, 3):
            cell, rotation = _landing(face, edge_turn(face, side, quarters))
            joint = Joint("S", face, (side,), (quarters,), cell, rotation)
            found.setdefault((cell, rotation), joint)
    for first in range(4):
        for second in range(4):
            for q1 in (1, 2, 3):
                for q2 in (1, 2, 3):
                    # Axis 2 rides on the link, hence stands on the right.
                    transform = edge_turn(face, first, q1) @ edge_turn(face, second, q2)
                    cell, rotation = _landing(face, transform)
                    joint = Joint("D", face, (first, second), (q1, q2), cell, rotation)
                    found.setdefault((cell, rotation), joint)
    return tuple(found.values())


@cache
def single_joints(face: int, quarters: int = 2) -> tuple[Joint, ...]:
    """The 4 single hinges of a face with the given turn.

    Parameters
    ----------
    face : int
        Index in :data:`fabfold.lattice.rotations.FACES`.
    quarters : int
        Quarter turns of the hinge, 1 to 3.

    Returns
    -------
    tuple of 4 Joint
        In the order of :func:`edge_sides`.
    """
    return tuple(j for j in face_transforms(face) if j.kind == "S" and j.turns == (quarters,))


@cache
def double_joints(face: int, neighbours_only: bool = True) -> tuple[Joint, ...]:
    """The double hinges of a face.

    Parameters
    ----------
    face : int
        Index in :data:`fabfold.lattice.rotations.FACES`.
    neighbours_only : bool
        Whether the child must land on a face neighbour of the parent.

    Returns
    -------
    tuple of Joint
        The 32 that do, or all 84.
    """
    return tuple(
        j
        for j in face_transforms(face)
        if j.kind == "D" and (not neighbours_only or sum(map(abs, j.offset)) == 1)
    )


@cache
def realizations(joint: Joint) -> tuple[tuple[int, int, int, int], ...]:
    """Every hinge that makes the transform of a joint, simplest first.

    Two axes on one edge turn like a single hinge and are left out. 24 of the 84 double hinges have
    two realizations: opposite turns about two neighbouring edges, for one, come to the same.

    Parameters
    ----------
    joint : Joint
        A joint type.

    Returns
    -------
    tuple of (side, turns, side, turns)
        Side and quarter turns of both axes, parent's first; the second side is -1 for a single
        hinge. A rigid joint has none.
    """
    if joint.kind == "R":
        return ()
    if joint.kind == "S":
        return ((joint.sides[0], joint.turns[0], -1, 0),)
    found = _two_axes(joint.face).get((joint.offset, joint.rotation), [])
    return tuple(sorted(found, key=lambda row: (row[1] + row[3], row)))


@cache
def _two_axes(
    face: int,
) -> dict[tuple[tuple[int, int, int], int], list[tuple[int, int, int, int]]]:
    """Sides and turns of every two axes on different edges of a face, by where they take a cell."""
    found: dict[tuple[tuple[int, int, int], int], list[tuple[int, int, int, int]]] = {}
    for first, second, q1, q2 in product(range(4), range(4), (1, 2, 3), (1, 2, 3)):
        if first != second:
            transform = edge_turn(face, first, q1) @ edge_turn(face, second, q2)
            found.setdefault(_landing(face, transform), []).append((first, q1, second, q2))
    return found


@cache
def joint_types(joints: JointSet) -> tuple[tuple[Joint, ...], ...]:
    """Joint types of a search by index, one for each face: rigid, half turns, then the others.

    Parameters
    ----------
    joints : str
        One of :data:`JOINT_SETS`.

    Returns
    -------
    tuple of tuples of 6 Joint
        One row for each joint type, one joint for each face of the parent.
    """
    by_face = []
    for face in range(6):
        row = [
            *(joint for joint in face_transforms(face) if joint.kind == "R"),
            *single_joints(face),
        ]
        if joints in ("S90", "all"):
            row += single_joints(face, 1)
        if joints in ("S+D", "all"):
            row += double_joints(face, joints == "S+D")
        by_face.append(row)
    return tuple(zip(*by_face, strict=True))
