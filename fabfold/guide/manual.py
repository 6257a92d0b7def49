"""What a folding manual says and shows, whatever it is printed on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fabfold.export.camera import View
from fabfold.export.kit_picture import nearest_lattice, picture_of_kit
from fabfold.export.render import Image, render
from fabfold.export.shading import corner_normals
from fabfold.fold.motion import Motion
from fabfold.guide.fold_steps import FoldStep, fold_steps, gathered, grouped
from fabfold.guide.magnet_pictures import MagnetPicture, magnet_pictures
from fabfold.guide.step_drawing import StepPicture, draw_step
from fabfold.guide.step_views import LEAST_SEEN, StepView, step_views
from fabfold.guide.wording import step_text
from fabfold.joinery.bodies import Joinery
from fabfold.joinery.box_hold import Retention
from fabfold.progress import Progress, SilentProgress
from fabfold.tree.fold_tree import FoldTree

__all__ = ["Manual", "ManualStep", "StepPlan", "draw_manual", "plan_steps"]

#: Size of the picture of a step in pixels.
STEP_PIXELS = (600, 450)
#: Size of the picture of a part.
PART_PIXELS = (200, 150)


@dataclass(frozen=True)
class StepPlan:
    """The steps of a kit, and from where each is seen.

    Attributes
    ----------
    stand : (3, 3) float64 array
        Rotation from shape A's axes to how the kit lies on the table.
    steps : tuple of FoldStep
        One a move of the path.
    views : tuple of StepView
        One for each, and one for the end.
    groups : tuple of FoldStep
        The same with those merged that may be made in any order, and those gathered that follow
        each other on one small part: the pictures of a manual.
    group_views : tuple of StepView
        One for each of these, and one for the end.
    """

    stand: NDArray[np.float64]
    steps: tuple[FoldStep, ...]
    views: tuple[StepView, ...]
    groups: tuple[FoldStep, ...]
    group_views: tuple[StepView, ...]


@dataclass(frozen=True)
class ManualStep:
    """A step of the manual.

    Attributes
    ----------
    number : int
        From 1.
    text, brief : str
        How far, and which parts; and only how many parts.
    turned : bool
        Whether the whole is turned before it.
    picture : StepPicture
        The picture.
    """

    number: int
    text: str
    brief: str
    turned: bool
    picture: StepPicture


@dataclass(frozen=True)
class Manual:
    """A manual, ready to be laid out.

    Attributes
    ----------
    title : str
        Name of the kit.
    subtitle : str
        What it folds into, in how many steps.
    cover : (h, w, 3) uint8 array
        A, half-way and B.
    contents : tuple of str
        What is in the box.
    advice : tuple of str
        How to print it.
    assembly : tuple of str
        How single bodies are put together; empty where it is printed in place.
    steps : tuple of ManualStep
        The steps.
    end : (h, w, 3) uint8 array
        The closed box.
    parts : tuple of (h, w, 3) uint8 arrays
        Each part by itself, in the order of their numbers.
    names : tuple of str
        What the files call each part.
    magnets : tuple of MagnetPicture
        Where magnets go; empty where there are none.
    """

    title: str
    subtitle: str
    cover: Image
    contents: tuple[str, ...]
    advice: tuple[str, ...]
    assembly: tuple[str, ...]
    steps: tuple[ManualStep, ...]
    end: Image
    parts: tuple[Image, ...]
    names: tuple[str, ...]
    magnets: tuple[MagnetPicture, ...] = ()


def plan_steps(
    joinery: Joinery, tree: FoldTree, motion: Motion, upright: NDArray[np.float64]
) -> StepPlan:
    """Steps and views of a certified path.

    Parameters
    ----------
    joinery : Joinery
        The printed bodies in shape A.
    tree : FoldTree
        The bodies and hinges, in the same order.
    motion : Motion
        The path.
    upright : (3, 3) float64 array
        Rotation from shape A's axes to the model's own; the nearest of the lattice is taken, so
        that the box stands straight.
    """
    stand = nearest_lattice(upright)
    steps = fold_steps(joinery, tree, motion, stand)
    volume = np.array([body.volume for body in joinery.bodies])
    merged = [tuple(pair) for pair in motion.certificate.get("any_order", ())]
    groups = gathered(grouped(steps, merged), volume)
    seen = step_views(joinery, tree, groups)
    at, hidden = 1, []
    for group, view in zip(groups, seen, strict=False):
        if group.also and view.seen < LEAST_SEEN:
            hidden.append((at, at + len(group.also)))
        at += len(group.turns) + len(group.then)
    if hidden:  # No view shows all that moves: each turn gets a picture of its own.
        merged = [pair for pair in merged if pair not in hidden]
        groups = gathered(grouped(steps, merged), volume)
        seen = step_views(joinery, tree, groups)
    views = [
        replace(view, turned=view.turned and number == 0)
        for group, view in zip(groups, seen, strict=False)
        for number in range(len(group.turns) + len(group.then))
    ]
    return StepPlan(stand, tuple(steps), (*views, seen[-1]), tuple(groups), tuple(seen))


def draw_manual(
    joinery: Joinery,
    tree: FoldTree,
    motion: Motion,
    plan: StepPlan,
    *,
    title: str,
    cover: Image,
    colours: NDArray[np.uint8],
    contents: Sequence[str],
    advice: Sequence[str],
    assembly: Sequence[str] = (),
    retention: Retention | None = None,
    progress: Progress | None = None,
) -> Manual:
    """Draw all pictures of a manual.

    Parameters
    ----------
    joinery : Joinery
        The printed bodies in shape A.
    tree : FoldTree
        The bodies and hinges, in the same order.
    motion : Motion
        The path.
    plan : StepPlan
        Its steps and views.
    title : str
        Name of the kit.
    cover : (h, w, 3) uint8 array
        A, half-way and B, see :func:`fabfold.export.kit_picture.strip`.
    colours : (b, 3) uint8 array
        Colour of each body, sRGB.
    contents, advice, assembly : sequence of str
        See :class:`Manual`.
    retention : Retention, optional
        Magnets that are drawn.
    progress : Progress, optional
        Hears of every step.

    Returns
    -------
    Manual
        To be laid out by :mod:`fabfold.guide.manual_pdf` or :mod:`fabfold.guide.manual_html`.
    """
    progress = progress or SilentProgress()
    meshes = joinery.drawn
    smooth = [corner_normals(vertices, faces) for vertices, faces in meshes]
    drawn = []
    for step, view in zip(plan.groups, plan.group_views, strict=False):
        picture = draw_step(meshes, step, view, joinery.voxel_mm, STEP_PIXELS, smooth)
        words = step_text(step), step_text(step, brief=True)
        drawn.append(ManualStep(step.number, *words, view.turned, picture))
        progress.update(step.number / (len(plan.groups) + 1), f"step {step.number}")
    lying = np.eye(4)[None].copy()
    lying[0, :3, :3] = plan.stand
    alone = View(size=PART_PIXELS, lights=3, ground=False, margin=0.04)
    parts = [
        render([mesh], colours[index : index + 1], lying, alone, smooth=[smooth[index]])
        for index, mesh in enumerate(meshes)
    ]
    count, turns = len(plan.groups), len(plan.steps)
    last = plan.views[-1]
    end = View(last.azimuth_deg, last.elevation_deg, size=STEP_PIXELS, lights=12)
    box = "a box" if tree.template.name.startswith("box-") else tree.template.name
    return Manual(
        title=title,
        subtitle=f"folds into {box} in {count} step{'s' if count != 1 else ''}"
        + (f" of {turns} turns" if turns > count else ""),
        cover=cover,
        contents=tuple(contents),
        advice=tuple(advice),
        assembly=tuple(assembly),
        steps=tuple(drawn),
        end=picture_of_kit(
            joinery, tree, motion.angles_deg[-1], end, colours=colours, upright=plan.stand
        ),
        parts=tuple(parts),
        names=tuple(body.name for body in joinery.bodies),
        magnets=tuple(magnet_pictures(joinery, retention, plan.stand)),
    )
