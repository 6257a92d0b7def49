"""The certified path as steps for people: what stays in one hand, and what the other turns."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fabfold.fold.motion import Motion
from fabfold.joinery.barrel_sweeps import descendants
from fabfold.joinery.bodies import Joinery
from fabfold.joinery.body_poses import poses_in_mm
from fabfold.lattice.rotations import rotation_about
from fabfold.tree.fold_tree import FoldTree

__all__ = ["FoldStep", "fold_steps", "turned"]


@dataclass(frozen=True)
class FoldStep:
    """One turn about one hinge.

    Attributes
    ----------
    number : int
        From 1.
    hinge : int
        Index of the hinge.
    degrees : float
        How far the moving part turns, above 0.
    change_deg : float
        Change of the hinge's own angle, whose sign is that of the tree.
    moving : tuple of int
        Bodies that turn: the lighter side of the hinge.
    held : int
        A body of the other side, which stays where it is.
    point, axis : (3,) float64 array
        Line of the hinge where it lies in this step, mm; the part turns about it right-handed.
    before, after : (b, 4, 4) float64 array
        Where all bodies are before and after the step, from shape A, mm.
    """

    number: int
    hinge: int
    degrees: float
    change_deg: float
    moving: tuple[int, ...]
    held: int
    point: NDArray[np.float64]
    axis: NDArray[np.float64]
    before: NDArray[np.float64]
    after: NDArray[np.float64]


def turned(step: FoldStep, share: float) -> NDArray[np.float64]:
    """Where all bodies are when a share of a step is done.

    Parameters
    ----------
    step : FoldStep
        The step.
    share : float
        From 0 to 1.

    Returns
    -------
    (b, 4, 4) float64 array
        Poses from shape A, mm.
    """
    turn = rotation_about(step.point, step.axis, share * step.degrees)
    poses = step.before.copy()
    poses[list(step.moving)] = turn @ poses[list(step.moving)]
    return np.asarray(poses)


def fold_steps(
    joinery: Joinery, tree: FoldTree, motion: Motion, stand: NDArray[np.float64] | None = None
) -> list[FoldStep]:
    """The moves of a path as steps, in each of which the heavier side stays where it is.

    Parameters
    ----------
    joinery : Joinery
        The printed bodies in shape A.
    tree : FoldTree
        The bodies and hinges, in the same order.
    motion : Motion
        The path.
    stand : (3, 3) float64 array, optional
        Rotation from shape A's axes to how the model stands at the beginning.

    Returns
    -------
    list of FoldStep
        One a turn of a hinge; where a move turns several, they follow one another.
    """
    volume = np.array([body.volume for body in joinery.bodies])
    whole = np.eye(4)
    if stand is not None:
        whole[:3, :3] = stand
    poses = whole @ poses_in_mm(tree, joinery, motion.angles_deg[0])
    angles = motion.angles_deg[0].copy()
    origin = np.asarray(joinery.origin_mm, dtype=float)
    carries = descendants(tree)
    steps: list[FoldStep] = []
    for row, columns in enumerate(motion.moves):
        for column in columns:
            turn = float(motion.angles_deg[row, column] - angles[column])
            if abs(turn) < 1e-9:
                continue
            hinge = tree.hinges[column]
            parent = poses[hinge.parent]
            point = parent[:3, :3] @ (origin + joinery.voxel_mm * np.asarray(hinge.point))
            point = point + parent[:3, 3]
            axis = parent[:3, :3] @ np.asarray(hinge.direction, dtype=float)
            carried, held, sign = carries[column], hinge.parent, np.sign(turn)
            if volume[carried].sum() > volume[~carried].sum():
                carried, held, sign = ~carried, hinge.child, -np.sign(turn)
            moving = tuple(np.flatnonzero(carried).tolist())
            step = FoldStep(
                *(len(steps) + 1, column, abs(turn), turn, moving, held),
                *(point, sign * axis, poses, poses),
            )
            poses = turned(step, 1.0)
            steps.append(replace(step, after=poses))
            angles[column] = motion.angles_deg[row, column]
    return steps
