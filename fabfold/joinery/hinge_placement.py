"""Putting hinges on their lattice edges."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import GeometryError
from fabfold.fold.motion import Motion
from fabfold.joinery.cells import as_manifold
from fabfold.joinery.sizes import HingeSize
from fabfold.tree.fold_tree import Edge, FoldTree, Hinge

if TYPE_CHECKING:
    import manifold3d

    from hinges.mesh import MeshPart

__all__ = ["Fittings", "Half", "Plate", "hinge_frames", "knuckle_zone"]

#: Quarter turns are whole to this many degrees.
_ANGLE_TOLERANCE = 1e-6


class Half(NamedTuple):
    """What one hinge adds to a body and takes from it first; mm, lattice origin at zero."""

    hinge: int
    half: manifold3d.Manifold
    carve: manifold3d.Manifold


@dataclass(frozen=True)
class Plate:
    """The link plate of a double hinge, in its place in A, lattice origin at zero.

    Attributes
    ----------
    body : int
        Index of the link.
    hinges : tuple of int
        The hinge to its parent and the hinge to its child.
    bodies : tuple of int
        The parent and the child, which the hinge itself lets the plate into.
    cells : (2, 3) int32 array
        The cells on both sides of the plate: the parent's and the child's voxel, lattice units.
    link : manifold3d.Manifold
        Plate and knuckles, mm.
    corners : (k, 3) float64 array
        Of the plate alone, mm.
    frame : (3, 3) float64 array
        Columns: the plate's normal and its two directions in the face.
    thickness_mm : float
    one_line : bool
        Whether both axes lie on one edge of the face.
    """

    body: int
    hinges: tuple[int, int]
    bodies: tuple[int, int]
    cells: NDArray[np.int32]
    link: manifold3d.Manifold
    corners: NDArray[np.float64]
    frame: NDArray[np.float64]
    thickness_mm: float
    one_line: bool


@dataclass(frozen=True)
class Fittings:
    """All hinges of a tree in their places.

    Attributes
    ----------
    halves : list of lists of Half
        Of each body; links have none, they are `plates`.
    plates : dict of int to Plate
        By index of the link.
    """

    halves: list[list[Half]]
    plates: dict[int, Plate]


def hinge_frames(tree: FoldTree) -> NDArray[np.float64]:
    """Frame of every hinge on its lattice edge.

    Parameters
    ----------
    tree : FoldTree

    Returns
    -------
    (h, 3, 4) float64 array
        Columns x (from the parent's cell to the child's), y (outwards, from the middle of the
        shared face to the hinged edge), z = x × y (the axis) and the origin in the middle of the
        edge, lattice units.

    Raises
    ------
    GeometryError
        If a hinge does not lie on an edge of the face that its two voxels share.
    """
    frames = np.zeros((len(tree.hinges), 3, 4))
    for edge in tree.edges:
        for h in edge.hinges:
            hinge = tree.hinges[h]
            parent = tree.source[edge.parent].astype(float)
            ahead = tree.source[edge.child] - parent
            out = 2.0 * (np.array(hinge.point) - parent - ahead / 2)
            axis = np.cross(ahead, out)
            # Every one of these is a unit vector along an axis, or the hinge is misplaced.
            if (
                np.abs(ahead).sum() != 1.0
                or np.abs(out).sum() != 1.0
                or np.abs(axis).tolist() != np.abs(np.array(hinge.direction, dtype=float)).tolist()
            ):
                raise GeometryError(
                    f"{hinge.name} does not lie on an edge of the face between voxels "
                    f"{edge.parent} and {edge.child}"
                )
            frames[h] = np.column_stack([ahead, out, axis, np.array(hinge.point)])
    return frames


def fittings(tree: FoldTree, motion: Motion, size: HingeSize, voxel_mm: float) -> Fittings:
    """The solids of all hinges of a tree.

    Parameters
    ----------
    tree : FoldTree
    motion : Motion
        Tells how far each axis of a double hinge turns.
    size : HingeSize
    voxel_mm : float

    Returns
    -------
    Fittings

    Raises
    ------
    GeometryError
        If a hinge is off its edge, an axis turns against its face, or a double hinge does not fit.
    """
    single = size.meshes
    blanks = [
        _solid(part)
        for part in (
            single.parent_half,
            single.child_half,
            single.parent_carve,
            single.child_carve,
        )
    ]
    frames = hinge_frames(tree)
    made = Fittings([[] for _ in tree.bodies], {})
    for edge in tree.edges:
        if edge.kind == "S":
            (h,) = edge.hinges
            transform = frames[h].copy()
            transform[:, 3] *= voxel_mm
            half, other, carve, other_carve = (blank.transform(transform) for blank in blanks)
            made.halves[tree.hinges[h].parent].append(Half(h, half, carve))
            made.halves[tree.hinges[h].child].append(Half(h, other, other_carve))
        elif edge.kind == "D":
            _double(tree, motion, edge, frames, size, voxel_mm, made)
    for halves in made.halves:
        halves.sort(key=lambda item: item.hinge)
    return made


def _solid(part: MeshPart) -> manifold3d.Manifold:
    return as_manifold(part.vertices, part.faces, "hinge piece")


def _double(
    tree: FoldTree,
    motion: Motion,
    edge: Edge,
    frames: NDArray[np.float64],
    size: HingeSize,
    voxel_mm: float,
    made: Fittings,
) -> None:
    """Place the pieces of one double hinge."""
    from hinges.exceptions import HingeError

    joint = f"the double hinge between voxels {edge.parent} and {edge.child}"
    first, second = edge.hinges
    link = tree.hinges[first].child
    if tree.hinges[second].parent != link or tree.bodies[link].voxels:
        raise GeometryError(f"{joint} has no link between its two hinges")
    name, turns = double_layout(tree, motion, edge, frames)
    try:
        meshes = size.double(name, turns)
    except HingeError as error:
        degrees = " and ".join(f"{turn:g}°" for turn in turns)
        raise GeometryError(
            f"{joint} ({tree.bodies[link].name}, {degrees}) cannot be printed: {error}"
        ) from error
    # In the face's middle; y points to the first axis.
    frame = frames[first].copy()
    frame[:, 3] = voxel_mm * (tree.source[edge.parent] + frame[:, 0] / 2)
    parent, child = tree.hinges[first].parent, tree.hinges[second].child
    parts = (meshes.parent_half, meshes.parent_carve, meshes.child_half, meshes.child_carve)
    half, carve, other, other_carve = (_solid(part).transform(frame) for part in parts)
    made.halves[parent].append(Half(first, half, carve))
    made.halves[child].append(Half(second, other, other_carve))
    made.plates[link] = Plate(
        body=link,
        hinges=(first, second),
        bodies=(parent, child),
        cells=tree.source[[edge.parent, edge.child]],
        link=_solid(meshes.link).transform(frame),
        corners=meshes.plate.vertices @ frame[:, :3].T + frame[:, 3],
        frame=frame[:, :3],
        thickness_mm=meshes.plate_mm,
        one_line=name == "+y",
    )


def double_layout(
    tree: FoldTree, motion: Motion, edge: Edge, frames: NDArray[np.float64]
) -> tuple[str, tuple[float, float]]:
    """How a double hinge lies in the frame of :mod:`hinges.mesh`, its first axis on "+y".

    Parameters
    ----------
    tree : FoldTree
    motion : Motion
    edge : Edge
        Of kind "D".
    frames : (h, 3, 4) float64 array
        From :func:`hinge_frames`.

    Returns
    -------
    second : str
        Edge of the second axis: "+y", "-y", "+z" or "-z".
    turns : (float, float)
        How far each axis turns on the path, in degrees: 90, 180 or 270.

    Raises
    ------
    GeometryError
        If an axis turns into the face instead of away from it, or by more than 270 degrees.
    """
    first, second = edge.hinges
    turns = []
    for h in (first, second):
        hinge = tree.hinges[h]
        # Right-handed about x × y of its own frame, a turn opens the face.
        sign = float(frames[h][:, 2] @ np.array(hinge.direction, dtype=float))
        angles = sign * np.append(motion.angles_deg[:, h], hinge.angle_deg)
        turn = 90.0 * np.ceil((angles.max() - _ANGLE_TOLERANCE) / 90.0)
        if angles.min() < -_ANGLE_TOLERANCE or not 90.0 <= turn <= 270.0:
            raise GeometryError(
                f"{hinge.name}, of the double hinge between voxels {edge.parent} and "
                f"{edge.child}, turns from {angles.min():g}° to {angles.max():g}°; an axis of a "
                "double hinge turns away from the shared face, by 90°, 180° or 270°"
            )
        turns.append(float(turn))
    out = frames[second][:, 1] @ frames[first][:, :3]
    axis = int(np.abs(out).argmax())
    return ("-" if out[axis] < 0 else "+") + "xyz"[axis], (turns[0], turns[1])


def knuckle_zone(
    hinge: Hinge, size: HingeSize, voxel_mm: float, spare_mm: float = 0.08
) -> manifold3d.Manifold:
    """The barrel of a hinge as one cylinder, a little smaller than it is.

    A groove that only just reaches a knuckle's end or skin (by the thickness that groove tools
    have to spare) must not count as a cut.

    Parameters
    ----------
    hinge : Hinge
    size : HingeSize
    voxel_mm : float
    spare_mm : float
        How much smaller; larger when negative.
    """
    import manifold3d

    length = voxel_mm - 2 * (size.reach_mm + spare_mm)
    radius = size.barrel_radius_mm - spare_mm
    if spare_mm < 0.0:
        radius /= np.cos(np.pi / 32)
    rod = manifold3d.Manifold.cylinder(length, radius, -1.0, 32, True)
    axis = np.array(hinge.direction, dtype=float)
    # Any rotation that takes z to the axis will do: cyclic permutation of the unit vectors.
    turn = {0: [1, 2, 0], 1: [2, 0, 1], 2: [0, 1, 2]}[int(np.abs(axis).argmax())]
    rotation = np.eye(3)[:, turn]
    return rod.transform(np.column_stack([rotation, np.array(hinge.point) * voxel_mm]))
