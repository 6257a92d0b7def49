"""A folded kit as a linkage: small motions of its points, linear in those of its hinges.

What holds a box shut asks how fast points move when hinges turn; what play does to it asks how far
they go when hinges shift and tilt too. Both are columns of the same rows.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from fabfold.joinery.bodies import Joinery
from fabfold.joinery.box_faces import FaceMeeting, across
from fabfold.tree.fold_tree import FoldTree

__all__ = ["NUMBERS", "Linkage"]

Floats = NDArray[np.float64]

#: Numbers of one hinge: shift across (2) and along the axis, turns across (2) and about it.
NUMBERS: Final = 6


class Linkage:
    """Motions of points of a kit in one pose.

    Parameters
    ----------
    tree : FoldTree
        The bodies and their hinges.
    joinery : Joinery
        It tells the voxel's side and the origin.
    poses : (b, 4, 4) float64 array
        Where the bodies are, :func:`fabfold.joinery.body_poses.poses_in_mm`.
    """

    def __init__(self, tree: FoldTree, joinery: Joinery, poses: Floats) -> None:
        origin = np.asarray(joinery.origin_mm)
        self.hinges = len(tree.hinges)
        self._side = joinery.voxel_mm
        self._way: dict[int, tuple[int, ...]] = {0: ()}
        self._frames: list[tuple[Floats, Floats]] = []
        for index, hinge in enumerate(tree.hinges):
            pose = poses[hinge.parent]
            point = origin + joinery.voxel_mm * np.asarray(hinge.point, dtype=float)
            axis = pose[:3, :3] @ np.asarray(hinge.direction, dtype=float)
            frame = np.array([*across(axis), axis])
            self._frames.append((pose[:3, :3] @ point + pose[:3, 3], frame))
            self._way[hinge.child] = (*self._way[hinge.parent], index)

    def motion(self, body: int, point: Floats) -> Floats:
        """Motion of a point by all numbers of the hinges.

        Parameters
        ----------
        body : int
            Index of the body that the point moves with.
        point : (3,) float64 array
            Where it is in the pose, mm.

        Returns
        -------
        (3, 6 h) float64 array
            mm of motion for each mm of shift and each radian of turn.
        """
        rows = np.zeros((3, NUMBERS * self.hinges))
        for index in self._way[body]:
            place, frame = self._frames[index]
            shifts = slice(NUMBERS * index, NUMBERS * index + 3)
            rows[:, shifts] = frame.T
            rows[:, shifts.stop : shifts.stop + 3] = np.cross(frame, point - place).T
        return rows

    def together(self, bodies: tuple[int, int], point: Floats) -> Floats:
        """Speed of one body against another at a point, by the speeds of the hinges.

        Parameters
        ----------
        bodies : (int, int)
            Indices of the two.
        point : (3,) float64 array
            Where it is in the pose, mm.

        Returns
        -------
        (3, h) float64 array
            Voxel sides for each radian; 0 where the two do not move against each other.
        """
        # A hinge that only turns has the last of its numbers.
        one, other = (self.motion(b, point)[:, NUMBERS - 1 :: NUMBERS] for b in bodies)
        return np.asarray((other - one) / self._side)

    def parting(self, meeting: FaceMeeting) -> Floats:
        """Speeds at which two faces part at four places, by the speeds of the hinges.

        Parameters
        ----------
        meeting : FaceMeeting
            The two faces.

        Returns
        -------
        (4, h) float64 array
            Not below 0 where they do not run into each other.
        """
        u, v = across(meeting.normal)
        rows = []
        for i, j in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            corner = meeting.middle + 0.3 * self._side * (i * u + j * v)
            rows.append(meeting.normal @ self.together(meeting.bodies, corner))
        return np.array(rows)
