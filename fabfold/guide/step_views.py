"""From where a step is seen best: all that moves, before and after, and the sense of its turn.

After Agrawala et al. (2003), "Designing effective step-by-step assembly instructions": views are
planned together, and the reader turns the object only where something would be hidden otherwise.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fabfold.export.camera import View, camera_for, project
from fabfold.guide.fold_steps import FoldStep
from fabfold.joinery.bodies import Joinery
from fabfold.meshes import box_triangles
from fabfold.tree.fold_tree import FoldTree

__all__ = ["FIRST_VIEW", "LEAST_SEEN", "StepView", "step_views", "visible_share"]

#: Pixels of the small pictures in which it is counted what can be seen.
_PIXELS = (112, 84)
#: Directions that are tried: degrees about z, and above the horizon.
_AZIMUTHS = tuple(range(-60, 300, 45))
_HEIGHTS = (24, 48, -24)
#: A reader turns the object where what follows is so many times better seen, all steps together.
_WORTH_TURNING = 3.0
#: What a hidden part costs, as a logarithm: no turn is saved for it.
_HIDDEN = 20.0
#: Least share of what moves that must be seen in a view that is kept.
LEAST_SEEN = 0.3
#: Seen from below counts less: nobody likes to look there.
_FROM_BELOW = 0.75


@dataclass(frozen=True)
class StepView:
    """From where a step is seen.

    Attributes
    ----------
    azimuth_deg, elevation_deg : float
        As of :class:`fabfold.export.camera.View`.
    turned : bool
        Whether the object is turned for it, against the step before.
    seen : float
        Share of what moves that is seen, of the turn of which least is seen.
    """

    azimuth_deg: float
    elevation_deg: float
    turned: bool = False
    seen: float = 1.0


#: The view that a model is shown in, if nothing speaks against it.
FIRST_VIEW = StepView(-60.0, 24.0)


@dataclass(frozen=True)
class _Blocks:
    """The voxels of all bodies as cubes: little to draw, and nearly what is seen."""

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    body: NDArray[np.int32]

    def posed(self, poses: NDArray[np.float64]) -> NDArray[np.float64]:
        """Vertices (v, 3) where the bodies are."""
        mine = poses[self.body]
        return np.asarray(np.einsum("vij,vj->vi", mine[:, :3, :3], self.vertices) + mine[:, :3, 3])


def _blocks(joinery: Joinery, tree: FoldTree) -> _Blocks:
    """Cubes of the voxels; a body without voxels is a plate in its bounds."""
    cubes, owners = [], []
    middles = np.asarray(joinery.origin_mm, dtype=float) + joinery.voxel_mm * tree.source
    half = joinery.voxel_mm / 2
    for index, body in enumerate(tree.bodies):
        bounds = [(middles[voxel] - half, middles[voxel] + half) for voxel in body.voxels]
        if not bounds:
            points = joinery.bodies[index].vertices
            bounds = [(points.min(axis=0), points.max(axis=0))]
        cubes += [box_triangles(low, high) for low, high in bounds]
        owners += [index] * len(bounds)
    vertices = np.concatenate([corners for corners, _ in cubes])
    faces = np.concatenate([faces + 8 * number for number, (_, faces) in enumerate(cubes)])
    owner = np.repeat(np.array(owners, dtype=np.int32), 8)
    return _Blocks(vertices, faces.astype(np.int32), owner)


def visible_share(
    points: NDArray[np.float64],
    faces: NDArray[np.int32],
    moving: NDArray[np.bool_],
    view: View,
    within: NDArray[np.float64],
) -> float:
    """Which share of what moves is not hidden.

    Parameters
    ----------
    points : (v, 3) float64 array
        Vertices of everything.
    faces : (f, 3) int32 array
        Its triangles.
    moving : (f,) bool array
        Those of what moves.
    view : View
        From where.
    within : (n, 3) float64 array
        What the picture holds.

    Returns
    -------
    float
        Pixels of it that are seen, of those that it would cover alone; 0 to 1.
    """
    from fabfold.export.raster import fill_triangles

    camera = camera_for(within, view, view.size, None)
    screen = project(points, camera)
    _, nearest = fill_triangles(screen, faces, *view.size)
    _, alone = fill_triangles(screen, faces[moving], *view.size)
    wanted = int((alone >= 0).sum())
    seen = int((moving[nearest] & (nearest >= 0)).sum())
    return seen / wanted if wanted else 0.0


def _directions() -> Iterator[tuple[float, float]]:
    for height in _HEIGHTS:
        for azimuth in _AZIMUTHS:
            yield float(azimuth), float(height)


def _score(blocks: _Blocks, step: FoldStep, direction: tuple[float, float]) -> tuple[float, float]:
    """How well a step is seen from a direction, and how much of what moves is seen."""
    before, after = blocks.posed(step.before), blocks.posed(step.after)
    view = View(*direction, size=_PIXELS)
    within = np.concatenate([before, after])
    first = last = 1.0
    for turn in step.turns:
        moving = np.isin(blocks.body, turn.moving)[blocks.faces[:, 0]]
        first = min(first, visible_share(before, blocks.faces, moving, view, within))
        last = min(last, visible_share(after, blocks.faces, moving, view, within))
    azimuth, height = np.radians(direction)
    away = np.array(
        [np.cos(azimuth) * np.cos(height), np.sin(azimuth) * np.cos(height), np.sin(height)]
    )
    # Along its axis a turn is seen as it is; square to it, as a stroke.
    sense = 0.45 + 0.55 * min(abs(float(turn.axis @ away)) for turn in step.turns)
    score = (0.1 + 0.9 * first) * (0.4 + 0.6 * last) * sense
    return score * (_FROM_BELOW if height < 0 else 1.0), min(first, 2 * last)


def step_views(joinery: Joinery, tree: FoldTree, steps: Sequence[FoldStep]) -> list[StepView]:
    """A view for each step, and one for the end.

    Parameters
    ----------
    joinery : Joinery
        The printed bodies in shape A.
    tree : FoldTree
        The bodies and hinges, in the same order.
    steps : sequence of FoldStep
        The steps.

    Returns
    -------
    list of StepView
        One more than there are steps.
    """
    blocks = _blocks(joinery, tree)
    directions = list(_directions())
    scores, seen = np.zeros((2, len(steps), len(directions)))
    for row, step in enumerate(steps):
        for column, direction in enumerate(directions):
            found = [_score(blocks, phase, direction) for phase in step.phases]
            scores[row, column] = min(score for score, _ in found)
            seen[row, column] = min(share for _, share in found)
    first = directions.index((FIRST_VIEW.azimuth_deg, FIRST_VIEW.elevation_deg))
    chosen = _planned(scores, seen, first)
    views = []
    for row, (before, now) in enumerate(pairwise([first, *chosen])):
        views.append(StepView(*directions[now], now != before, float(seen[row, now])))
    azimuth, height = directions[chosen[-1] if chosen else first]
    return [*views, StepView(azimuth, abs(height), turned=height < 0)]


def _planned(scores: NDArray[np.float64], seen: NDArray[np.float64], first: int) -> list[int]:
    """Direction of each step: all of them well seen, with few turns of the whole.

    The best sequence by dynamic programming: a turn is worth it where it makes what follows, all
    steps until the next turn together, so many times better seen. A direction in which a part
    hides counts where no other shows it either.

    Parameters
    ----------
    scores, seen : (s, d) float64 arrays
        How well each step is seen from each direction, and how much of what moves.
    first : int
        Direction in which the whole lies before the first step.

    Returns
    -------
    list of s int
        Directions.
    """
    if not len(scores):
        return []
    gain = np.log(np.maximum(scores, 1e-9))
    hidden = (seen < LEAST_SEEN) & (seen.max(axis=1, keepdims=True) >= LEAST_SEEN)
    gain[hidden] -= _HIDDEN
    turn = np.log(_WORTH_TURNING)
    best = np.where(np.arange(scores.shape[1]) == first, 0.0, -turn) + gain[0]
    came: list[NDArray[np.int64]] = []
    for row in gain[1:]:
        top = int(best.argmax())
        stays = best >= best[top] - turn
        came.append(np.where(stays, np.arange(len(best)), top))
        best = np.maximum(best, best[top] - turn) + row
    at = int(best.argmax())
    path = [at]
    for step in reversed(came):
        at = int(step[at])
        path.append(at)
    return path[::-1]
