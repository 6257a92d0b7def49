"""The certified path as steps for people: what stays in one hand, and what the other turns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fabfold.fold.motion import Motion
from fabfold.joinery.barrel_sweeps import lighter_sides
from fabfold.joinery.bodies import Joinery
from fabfold.joinery.body_poses import poses_in_mm
from fabfold.lattice.rotations import rotation_about
from fabfold.tree.fold_tree import FoldTree

__all__ = ["FoldStep", "fold_steps", "gathered", "grouped", "turned"]

#: Share of the kit's material up to which a part is small, and turns that are gathered at most.
_SMALL_SHARE, _MOST_GATHERED = 0.15, 4


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
    also : tuple of FoldStep
        Turns of other parts that belong to the step and may be made in any order with this one;
        all begin where it begins.
    then : tuple of FoldStep
        Further turns of the same small part, which follow one after the other.
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
    also: tuple[FoldStep, ...] = ()
    then: tuple[FoldStep, ...] = ()

    @property
    def phases(self) -> tuple[FoldStep, ...]:
        """What follows one after the other in the step, its own turns first."""
        return (replace(self, then=()), *self.then)

    @property
    def turns(self) -> tuple[FoldStep, ...]:
        """All turns of the step, this one first."""
        return (self, *self.also)

    @property
    def all_moving(self) -> tuple[int, ...]:
        """Bodies that move in any turn of the step."""
        return tuple(body for turn in self.turns for body in turn.moving)


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
    poses = step.before.copy()
    for one in step.turns:
        turn = rotation_about(one.point, one.axis, share * one.degrees)
        poses[list(one.moving)] = turn @ poses[list(one.moving)]
    return np.asarray(poses)


def grouped(steps: Sequence[FoldStep], any_order: Sequence[Sequence[int]]) -> list[FoldStep]:
    """Steps with those merged that may be made in any order.

    Parameters
    ----------
    steps : sequence of FoldStep
        One a move, see :func:`fold_steps`.
    any_order : sequence of (first, last)
        Numbers of moves, as :func:`fabfold.proof.certify.certify_orders` proves them.

    Returns
    -------
    list of FoldStep
        Numbered from 1; the turns of a merged one begin together.
    """
    last_of = {int(first): int(last) for first, last in any_order}
    out: list[FoldStep] = []
    at = 0
    while at < len(steps):
        first = steps[at]
        end = max(last_of.get(first.number, first.number) - first.number + at, at)
        group = steps[at : end + 1]
        also = tuple(
            replace(turn, before=first.before, after=turned(replace(turn, before=first.before), 1))
            for turn in group[1:]
        )
        out.append(replace(first, number=len(out) + 1, after=group[-1].after, also=also))
        at = end + 1
    return out


def gathered(steps: Sequence[FoldStep], volume: NDArray[np.float64]) -> list[FoldStep]:
    """Steps with those that follow one another on one small part gathered in one.

    Parameters
    ----------
    steps : sequence of FoldStep
        See :func:`grouped`.
    volume : (b,) float64 array
        Of every body.

    Returns
    -------
    list of FoldStep
        Numbered from 1.
    """
    most = _SMALL_SHARE * float(volume.sum())
    out: list[FoldStep] = []
    at = 0
    while at < len(steps):
        part: set[int] = set()
        end = at
        while end < len(steps) and end - at < _MOST_GATHERED and not steps[end].also:
            wider = part | set(steps[end].moving)
            if part and not part & set(steps[end].moving):
                break
            if volume[sorted(wider)].sum() > most:
                break
            part, end = wider, end + 1
        end = max(end, at + 1)
        out.append(replace(steps[at], number=len(out) + 1, then=tuple(steps[at + 1 : end])))
        at = end
    return out


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
    sides = lighter_sides(tree, volume)
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
            held, sign = hinge.parent, np.sign(turn)
            if sides[column, hinge.parent]:
                held, sign = hinge.child, -sign
            moving = tuple(np.flatnonzero(sides[column]).tolist())
            step = FoldStep(
                *(len(steps) + 1, column, abs(turn), turn, moving, held),
                *(point, sign * axis, poses, poses),
            )
            poses = turned(step, 1.0)
            steps.append(replace(step, after=poses))
            angles[column] = motion.angles_deg[row, column]
    return steps
