"""Faces of cells that lie on each other in the box: where bodies meet, and what is flush there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.joinery.bodies import Joinery
from fabfold.joinery.loose_pins import cylinder_between
from fabfold.tree.fold_tree import FoldTree

if TYPE_CHECKING:
    import manifold3d

__all__ = [
    "FaceMeeting",
    "across",
    "are_flush",
    "face_meetings",
    "is_material",
    "meeting_sides",
]

Floats = NDArray[np.float64]

#: Share of a disc below a face that has to be material.
_FILLED = 0.985
#: Radius and depth of the disc of material in the middle of a face that makes it flat, mm.
_PATCH_MM, _SKIN_MM = 2.0, 0.4


@dataclass(frozen=True)
class FaceMeeting:
    """Two cell faces that lie on each other in the box.

    Attributes
    ----------
    voxels, bodies : (int, int)
        Their voxels, and the bodies that these belong to.
    middle : (3,) float64 array
        Middle of the faces, mm, in the box with the root body where it is in shape A.
    normal : (3,) float64 array
        Unit vector from the first body to the second, there.
    """

    voxels: tuple[int, int]
    bodies: tuple[int, int]
    middle: Floats
    normal: Floats


def face_meetings(tree: FoldTree, joinery: Joinery, poses: Floats) -> list[FaceMeeting]:
    """Faces of cells of two bodies that lie on each other in the box.

    Parameters
    ----------
    tree, joinery
        The bodies.
    poses : (b, 4, 4) float64 array
        Where they are in the box, :func:`fabfold.joinery.body_poses.poses_in_mm`.

    Returns
    -------
    list of FaceMeeting
        By the numbers of the two voxels.
    """
    origin, side = np.asarray(joinery.origin_mm), joinery.voxel_mm
    owner = tree.voxel_body
    middles = np.array(
        [
            poses[owner[i]][:3, :3] @ (origin + side * cell) + poses[owner[i]][:3, 3]
            for i, cell in enumerate(tree.source.astype(float))
        ]
    )
    found = []
    for i in range(len(middles)):
        for j in range(i + 1, len(middles)):
            apart = middles[j] - middles[i]
            if owner[i] == owner[j] or abs(float(np.linalg.norm(apart)) - side) > 1e-3 * side:
                continue
            normal = np.round(apart / side, 9)
            found.append(
                FaceMeeting((i, j), (int(owner[i]), int(owner[j])), middles[i] + apart / 2, normal)
            )
    return found


def across(normal: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors along a face with a normal along an axis, (3,) each."""
    u = np.eye(3)[(int(np.abs(normal).argmax()) + 1) % 3]
    return u, np.cross(normal, u)


def meeting_sides(
    meeting: FaceMeeting, place: Floats, joinery: Joinery, poses: Floats
) -> list[tuple[int, Floats, Floats]]:
    """Both sides of a place of a meeting.

    Parameters
    ----------
    meeting : FaceMeeting
        The two faces.
    place : (3,) float64 array
        A point of them, mm, in the box.
    joinery, poses
        As of :func:`face_meetings`.

    Returns
    -------
    list of two (body, mouth, inward)
        Index of the body; the point on its face and the direction into it, in shape A.
    """
    sides = []
    for body, inward in zip(meeting.bodies, (-meeting.normal, meeting.normal), strict=True):
        pose = poses[body]
        into = pose[:3, :3].T @ inward
        point = pose[:3, :3].T @ (place - pose[:3, 3]) + joinery.gap_mm / 2 * into
        sides.append((body, point, into))
    return sides


def is_material(
    solid: manifold3d.Manifold, point: Floats, into: Floats, radius: float, deep: float
) -> bool:
    """Whether a disc of `radius` at a point is filled `deep` into a solid, mm."""
    disc = cylinder_between(point, point + deep * into, radius, outside=False)
    return bool((solid ^ disc).volume() >= _FILLED * disc.volume())


def are_flush(
    meeting: FaceMeeting, joinery: Joinery, solids: Sequence[manifold3d.Manifold], poses: Floats
) -> bool:
    """Whether both faces of a meeting are flat in their middle, so that they touch when shut."""
    return all(
        is_material(solids[body], point + 0.02 * into, into, _PATCH_MM, _SKIN_MM)
        for body, point, into in meeting_sides(meeting, meeting.middle, joinery, poses)
    )
