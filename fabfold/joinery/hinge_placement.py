"""Put the hinges of a tree on their lattice edges."""

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

    from hinges.shape_meshes import MeshPart

__all__ = [
    "LinkPlate",
    "PlacedHalf",
    "PlacedHinges",
    "barrel_solid",
    "double_layout",
    "hinge_frames",
    "place_hinges",
]

#: Quarter turns are whole to this many degrees.
_ANGLE_TOLERANCE = 1e-6


class PlacedHalf(NamedTuple):
    """Half of a hinge in its place in A, lattice origin at zero.

    Attributes
    ----------
    hinge : int
        Index of the hinge.
    half : manifold3d.Manifold
        What the hinge adds to the body, mm.
    cutout : manifold3d.Manifold
        What the hinge takes from the body before that, mm.
    """

    hinge: int
    half: manifold3d.Manifold
    cutout: manifold3d.Manifold


@dataclass(frozen=True)
class LinkPlate:
    """The link plate of a double hinge in its place in A, lattice origin at zero.

    Attributes
    ----------
    hinges : (int, int)
        Indices of the hinge to the parent and of the hinge to the child.
    bodies : (int, int)
        Indices of the parent and of the child, which the hinge itself lets the plate into.
    cells : (2, 3) int32 array
        The cells on both sides of the plate: the parent's and the child's voxel, lattice units.
    solid : manifold3d.Manifold
        Plate and knuckles, mm.
    corners : (k, 3) float64 array
        Corners of the plate without knuckles, mm.
    frame : (3, 3) float64 array
        Columns: unit vectors along the plate's normal and along its two directions in the face.
    """

    hinges: tuple[int, int]
    bodies: tuple[int, int]
    cells: NDArray[np.int32]
    solid: manifold3d.Manifold
    corners: NDArray[np.float64]
    frame: NDArray[np.float64]


@dataclass(frozen=True)
class PlacedHinges:
    """All hinges of a tree in their places.

    Attributes
    ----------
    halves : list of list of PlacedHalf
        The halves of each body, by index of the body; a link has none.
    plates : dict of int to LinkPlate
        The plate of each link, by index of the link.
    """

    halves: list[list[PlacedHalf]]
    plates: dict[int, LinkPlate]


def hinge_frames(tree: FoldTree) -> NDArray[np.float64]:
    """Frame of every hinge on its lattice edge.

    Parameters
    ----------
    tree : FoldTree
        The bodies and their hinges.

    Returns
    -------
    (h, 3, 4) float64 array
        Columns: unit vectors x (from the parent's cell to the child's), y (outwards, from the
        middle of the shared face to the hinged edge) and z = x × y (the axis), and the origin in
        the middle of the edge, lattice units.

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


def place_hinges(tree: FoldTree, motion: Motion, size: HingeSize, voxel_mm: float) -> PlacedHinges:
    """The solids of all hinges of a tree, each on its lattice edge.

    Parameters
    ----------
    tree : FoldTree
        The bodies and their hinges.
    motion : Motion
        The folding path; it tells how far each axis of a double hinge turns.
    size : HingeSize
        Size and pieces of the hinges.
    voxel_mm : float
        Side of a voxel in mm.

    Returns
    -------
    PlacedHinges
        Halves of all bodies and plates of all links, mm.

    Raises
    ------
    GeometryError
        If a hinge is off its edge, an axis turns against its face, or a double hinge does not fit.
    """
    single = size.meshes
    pieces = [
        _solid(part)
        for part in (
            single.parent_half,
            single.child_half,
            single.parent_carve,
            single.child_carve,
        )
    ]
    frames = hinge_frames(tree)
    placed = PlacedHinges([[] for _ in tree.bodies], {})
    for edge in tree.edges:
        if edge.kind == "S":
            (h,) = edge.hinges
            transform = frames[h].copy()
            transform[:, 3] *= voxel_mm
            half, other, cutout, other_cutout = (piece.transform(transform) for piece in pieces)
            placed.halves[tree.hinges[h].parent].append(PlacedHalf(h, half, cutout))
            placed.halves[tree.hinges[h].child].append(PlacedHalf(h, other, other_cutout))
        elif edge.kind == "D":
            _place_double(tree, motion, edge, frames, size, voxel_mm, placed)
    for halves in placed.halves:
        halves.sort(key=lambda item: item.hinge)
    return placed


def _solid(part: MeshPart) -> manifold3d.Manifold:
    return as_manifold(part.vertices, part.faces, "hinge piece")


def _place_double(
    tree: FoldTree,
    motion: Motion,
    edge: Edge,
    frames: NDArray[np.float64],
    size: HingeSize,
    voxel_mm: float,
    placed: PlacedHinges,
) -> None:
    """Place the pieces of one double hinge."""
    from hinges.exceptions import HingeError

    joint = f"the double hinge between voxels {edge.parent} and {edge.child}"
    first, second = edge.hinges
    link = tree.hinges[first].child
    if tree.hinges[second].parent != link or tree.bodies[link].voxels:
        raise GeometryError(f"{joint} has no link between its two hinges")
    second_edge, turns = double_layout(tree, motion, edge, frames)
    try:
        meshes = size.double(second_edge, turns)
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
    half, cutout, other, other_cutout = (_solid(part).transform(frame) for part in parts)
    placed.halves[parent].append(PlacedHalf(first, half, cutout))
    placed.halves[child].append(PlacedHalf(second, other, other_cutout))
    placed.plates[link] = LinkPlate(
        hinges=(first, second),
        bodies=(parent, child),
        cells=tree.source[[edge.parent, edge.child]],
        solid=_solid(meshes.link).transform(frame),
        corners=meshes.plate.vertices @ frame[:, :3].T + frame[:, 3],
        frame=frame[:, :3],
    )


def double_layout(
    tree: FoldTree, motion: Motion, edge: Edge, frames: NDArray[np.float64]
) -> tuple[str, tuple[float, float]]:
    """How a double hinge lies in the frame of :mod:`hinges.mesh`, its first axis on "+y".

    Parameters
    ----------
    tree : FoldTree
        The bodies and their hinges.
    motion : Motion
        The folding path; it tells how far each axis turns.
    edge : Edge
        The edge of the double hinge, of kind "D".
    frames : (h, 3, 4) float64 array
        Frame of every hinge, from :func:`hinge_frames`.

    Returns
    -------
    second : str
        Edge of the second axis: "+y", "-y", "+z" or "-z".
    turns : (float, float)
        How far each axis turns on the path: 90, 180 or 270 degrees.

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


def barrel_solid(
    hinge: Hinge, size: HingeSize, voxel_mm: float, inset_mm: float = 0.08
) -> manifold3d.Manifold:
    """The barrel of a hinge, all of its knuckles, as one cylinder that is a little smaller.

    A groove that only just reaches a knuckle's end or skin (by the thickness that groove tools
    have to spare) must not count as a cut.

    Parameters
    ----------
    hinge : Hinge
        The hinge in shape A.
    size : HingeSize
        Size of the hinge.
    voxel_mm : float
        Side of a voxel in mm.
    inset_mm : float
        How much smaller the cylinder is than the barrel on every side, mm; larger when negative.

    Returns
    -------
    manifold3d.Manifold
        In mm, lattice origin at zero.
    """
    import manifold3d

    length = voxel_mm - 2 * (size.reach_mm + inset_mm)
    radius = size.barrel_radius_mm - inset_mm
    if inset_mm < 0.0:
        radius /= np.cos(np.pi / 32)
    rod = manifold3d.Manifold.cylinder(length, radius, -1.0, 32, True)
    axis = np.array(hinge.direction, dtype=float)
    # Any rotation that takes z to the axis will do: cyclic permutation of the unit vectors.
    turn = {0: [1, 2, 0], 1: [2, 0, 1], 2: [0, 1, 2]}[int(np.abs(axis).argmax())]
    rotation = np.eye(3)[:, turn]
    return rod.transform(np.column_stack([rotation, np.array(hinge.point) * voxel_mm]))
