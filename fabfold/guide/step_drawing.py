"""The picture of a step: what moves in colour, where it goes as a pale image, and an arrow.

It reads in black and white too: what moves is darker than what stays, where it ends has an outline,
and the arrow is black with a white rim.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import cycle

import numpy as np
from numpy.typing import NDArray

from fabfold.export.camera import PinholeCamera, View, camera_for, project
from fabfold.export.render import Image, Mesh, posed_points, render
from fabfold.guide.fold_steps import FoldStep
from fabfold.guide.fonts import font_file
from fabfold.guide.step_views import StepView
from fabfold.lattice.rotations import rotation_about

__all__ = ["ARROW_SHARES", "MOVING", "STAYING", "StepPicture", "arrow_points", "draw_step"]

#: Colours of what moves, by the turns of a step; all about as dark, and darker than what stays.
MOVING = ((222, 88, 28), (24, 118, 168), (132, 78, 168))
STAYING = (226, 224, 219)
#: Share of the pale image in its picture, and of the colour in it.
_PALE, _TINT = 0.42, 0.5
#: From where to where on the turn the arrow goes.
ARROW_SHARES = (0.06, 0.94)
#: The arrow's distance from the hinge, in voxel sides.
_REACH = (0.75, 1.6)
#: Cut-outs are taken from a picture so many times larger.
_LARGER = 1.5
#: Lines and letters are drawn this many times larger, and made smaller, so that they are smooth.
_FINER = 3


#: Left, top, right and bottom.
Box2 = tuple[float, float, float, float]


@dataclass(frozen=True)
class StepPicture:
    """A step drawn, and where in the picture what is.

    Attributes
    ----------
    image : (h, w, 3) uint8 array
        sRGB.
    camera : PinholeCamera
        That it was taken with, in pixels of the image.
    arrows : tuple of (n, 2) float64 arrays
        The line of each turn's arrow, from its tail to its head, in pixels.
    labels : tuple of four floats each
        Left, top, right and bottom of the angle that is written beside each, in pixels.
    panels : tuple of StepPicture
        Of turns that follow one after the other: the picture of each, of which a cut-out is shown.
    """

    image: Image
    camera: PinholeCamera
    arrows: tuple[NDArray[np.float64], ...]
    labels: tuple[Box2, ...]
    panels: tuple[StepPicture, ...] = ()


def arrow_points(
    step: FoldStep, meshes: Sequence[Mesh], voxel_mm: float, count: int = 33
) -> NDArray[np.float64]:
    """Points of the arc on which the middle of what moves goes, mm.

    Parameters
    ----------
    step : FoldStep
        The step.
    meshes : sequence of (vertices, faces)
        Bodies in shape A, mm.
    voxel_mm : float
        Side of a voxel; the arc keeps about so far from the hinge.
    count : int
        Number of points.

    Returns
    -------
    (count, 3) float64 array
        From where it is to where it goes.
    """
    moving = list(step.moving)
    points = posed_points([meshes[body] for body in moving], step.before[moving])
    # The part of it that is near the hinge: there the hand takes hold, and the arrow begins.
    near = points[np.linalg.norm(points - step.point, axis=1) < 2.5 * voxel_mm]
    middle = (near if len(near) else points).mean(axis=0)
    along = float((middle - step.point) @ step.axis)
    along = float(np.clip(along, -0.5 * voxel_mm, 0.5 * voxel_mm))
    foot = step.point + along * step.axis
    out = middle - step.point - ((middle - step.point) @ step.axis) * step.axis
    length = float(np.linalg.norm(out))
    if length < 1e-9:
        out, length = np.cross(step.axis, [0.577, 0.577, 0.577]), 1.0
    radius = float(np.clip(length, _REACH[0] * voxel_mm, _REACH[1] * voxel_mm))
    start = foot + out / length * radius
    shares = np.linspace(*ARROW_SHARES, count)
    turns = [rotation_about(step.point, step.axis, float(s) * step.degrees) for s in shares]
    return np.array([turn[:3, :3] @ start + turn[:3, 3] for turn in turns])


def draw_step(
    meshes: Sequence[Mesh],
    step: FoldStep,
    view: StepView,
    voxel_mm: float,
    size: tuple[int, int],
    smooth: Sequence[NDArray[np.float64]] | None = None,
) -> StepPicture:
    """Draw a step.

    Parameters
    ----------
    meshes : sequence of (vertices, faces)
        Bodies in shape A, mm.
    step : FoldStep
        The step.
    view : StepView
        From where it is seen.
    voxel_mm : float
        Side of a voxel.
    size : (int, int)
        Width and height in pixels.
    smooth : sequence of (f, 3, 3) float64 array, optional
        Normals of the meshes, see :func:`fabfold.export.render.render`.

    Returns
    -------
    StepPicture
        The picture, and where its arrow and label are.
    """
    if step.then:
        return _draw_callout(meshes, step, view, voxel_mm, size, smooth)
    arcs = [arrow_points(turn, meshes, voxel_mm) for turn in step.turns]
    after = posed_points(meshes, step.after)
    within = np.concatenate([after, *arcs])
    look = View(
        view.azimuth_deg, view.elevation_deg, size=size, ground=False, lights=4, margin=0.05
    )
    colours = np.tile(np.array(STAYING, np.uint8), (len(meshes), 1))
    for turn, colour in zip(step.turns, cycle(MOVING), strict=False):
        colours[list(turn.moving)] = colour
    image = render(meshes, colours, step.before, look, within=within, smooth=smooth)
    before = posed_points(meshes, step.before)
    camera = camera_for(np.concatenate([before, within]), look, size, None)
    image = _with_ghost(image, meshes, step, camera)
    arrows: list[NDArray[np.float64]] = []
    labels: list[Box2] = []
    for turn, arc in zip(step.turns, arcs, strict=True):
        arrow = project(arc, camera)[:, :2]
        axis = turn.point + np.outer([-0.9, 0.9], turn.axis) * voxel_mm
        image, label = _with_marks(
            image, arrow, project(axis, camera)[:, :2], f"{turn.degrees:g}°", labels
        )
        arrows.append(arrow)
        labels.append(label)
    return StepPicture(image, camera, tuple(arrows), tuple(labels))


def _draw_callout(
    meshes: Sequence[Mesh],
    step: FoldStep,
    view: StepView,
    voxel_mm: float,
    size: tuple[int, int],
    smooth: Sequence[NDArray[np.float64]] | None,
) -> StepPicture:
    """Turns of a small part one after the other, each as a cut-out of a larger picture."""
    from PIL import Image as PillowImage
    from PIL import ImageDraw, ImageFont

    count = len(step.phases)
    across = 1 if count == 2 else 2
    cell = (size[0] // across, size[1] // -(-count // across))
    large = (round(_LARGER * size[0]), round(_LARGER * size[1]))
    sheet = PillowImage.new("RGB", size, (255, 255, 255))
    draw = ImageDraw.Draw(sheet)
    font = ImageFont.truetype(str(font_file(bold=True)), round(size[1] / 20))
    panels = []
    for number, phase in enumerate(step.phases):
        panel = draw_step(meshes, phase, view, voxel_mm, large, smooth)
        panels.append(panel)
        left, top = cell[0] * (number % across), cell[1] * (number // across)
        window = _cut_out(panel, meshes, phase, cell)
        shown = PillowImage.fromarray(panel.image).crop(window)
        sheet.paste(shown.resize(cell, PillowImage.Resampling.LANCZOS), (left, top))
        frame = (left + 2, top + 2, left + cell[0] - 3, top + cell[1] - 3)
        draw.rounded_rectangle(frame, radius=9, outline=(150, 150, 150), width=2)
        draw.text((left + 12, top + 6), "abcd"[number], font=font, fill=(20, 20, 20))
    return StepPicture(np.asarray(sheet), panels[0].camera, (), (), tuple(panels))


def _cut_out(
    panel: StepPicture, meshes: Sequence[Mesh], step: FoldStep, cell: tuple[int, int]
) -> tuple[int, int, int, int]:
    """Window of a panel about what moves, its arrow and its angle, in the shape of a cell."""
    moving = list(step.moving)
    parts = [meshes[body] for body in moving]
    points = [
        project(posed_points(parts, poses[moving]), panel.camera)[:, :2]
        for poses in (step.before, step.after)
    ]
    labels = np.array(panel.labels).reshape(-1, 2)
    spots = np.concatenate([*points, *panel.arrows, labels])
    height, width = panel.image.shape[:2]
    low, high = spots.min(axis=0), spots.max(axis=0)
    middle = (low + high) / 2
    wide, tall = (high - low) * 1.5
    # No nearer than life size, no farther than the whole picture.
    scale = min(max(wide / cell[0], tall / cell[1], 1.0), width / cell[0], height / cell[1])
    wide, tall = scale * cell[0], scale * cell[1]
    x = float(np.clip(middle[0] - wide / 2, 0, width - wide))
    y = float(np.clip(middle[1] - tall / 2, 0, height - tall))
    return round(x), round(y), round(x + wide), round(y + tall)


def _owners(
    meshes: Sequence[Mesh], poses: NDArray[np.float64], camera: PinholeCamera, size: tuple[int, int]
) -> NDArray[np.int64]:
    """Which body is seen at each pixel (h, w); -1 where there is none."""
    from fabfold.export.raster import fill_triangles

    counts = [len(faces) for _, faces in meshes]
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in meshes)])
    faces = np.concatenate(
        [faces + start for (_, faces), start in zip(meshes, starts, strict=False)]
    ).astype(np.int32)
    screen = project(posed_points(meshes, poses), camera)
    _, nearest = fill_triangles(screen, faces, *size)
    owner = np.repeat(np.arange(len(meshes)), counts)
    return np.where(nearest >= 0, owner[nearest], -1)


def _with_ghost(
    image: Image, meshes: Sequence[Mesh], step: FoldStep, camera: PinholeCamera
) -> Image:
    """A pale image of where the moving bodies end, with an outline."""
    size = (image.shape[1], image.shape[0])
    after = _owners(meshes, step.after, camera, size)
    here = np.isin(_owners(meshes, step.before, camera, size), step.all_moving)
    result = image.astype(np.float64)
    for turn, colour in zip(step.turns, cycle(MOVING), strict=False):
        ends = np.isin(after, turn.moving)
        ghost = ends & ~here
        pale = 255 - _TINT * (255 - np.array(colour, dtype=float))
        result[ghost] += _PALE * (pale - result[ghost])
        inner = ends.copy()
        for axis in (0, 1):
            for shift in (-1, 1):
                inner &= np.roll(ends, shift, axis=axis)
        line = ends & ~inner & ~here
        # Dashed, so that in black and white too it is not taken for a thing that is there.
        rows, columns = np.indices(line.shape)
        line &= (rows + columns) // 5 % 3 < 2
        result[line] = np.array(colour) * 0.8
    return np.asarray(np.rint(result), dtype=np.uint8)


def _with_marks(
    image: Image,
    arrow: NDArray[np.float64],
    axis: NDArray[np.float64],
    text: str,
    taken: Sequence[Box2],
) -> tuple[Image, Box2]:
    """The hinge's line, the arrow, and the angle beside it; bounds of the angle.

    The angle is written where none of those in `taken` is.
    """
    from PIL import Image as PillowImage
    from PIL import ImageDraw, ImageFont

    height, width = image.shape[:2]
    layer = PillowImage.new("RGBA", (width * _FINER, height * _FINER), (0, 0, 0, 0))
    draw = ImageDraw.Draw(layer)
    unit = _FINER * height / 420
    _dashes(draw, axis * _FINER, unit)
    line = arrow * _FINER
    head = _head(line, 17 * unit)
    body = line[: max(2, int(np.ceil(len(line) * 0.97)))]
    for wide, colour in ((10.5, (255, 255, 255, 235)), (5.5, (20, 20, 20, 255))):
        draw.line(
            [tuple(p) for p in body.tolist()], fill=colour, width=round(wide * unit), joint="curve"
        )
        rim = (wide - 5.5) * unit / 2
        middle = head.mean(axis=0)
        grown = middle + (head - middle) * (1 + 2.2 * rim / (17 * unit))
        draw.polygon([tuple(p) for p in grown.tolist()], fill=colour)
    font = ImageFont.truetype(str(font_file(bold=True)), round(19 * unit))
    bounds = draw.textbbox((0, 0), text, font=font)
    finer = [tuple(_FINER * value for value in box) for box in taken]
    label = _label_place(line, bounds, layer.size, unit, finer)
    draw.rounded_rectangle(label, radius=7 * unit, fill=(255, 255, 255, 225))
    draw.text(
        ((label[0] + label[2]) / 2, (label[1] + label[3]) / 2),
        text,
        font=font,
        fill=(20, 20, 20, 255),
        anchor="mm",
    )
    small = layer.resize((width, height), PillowImage.Resampling.BOX)
    base = PillowImage.fromarray(image).convert("RGBA")
    base.alpha_composite(small)
    x0, y0, x1, y1 = (value / _FINER for value in label)
    return np.asarray(base.convert("RGB")), (x0, y0, x1, y1)


def _dashes(draw: object, ends: NDArray[np.float64], unit: float) -> None:
    """The line of the hinge as draughtsmen draw an axis: a dash and a dot."""
    length = float(np.linalg.norm(ends[1] - ends[0]))
    if length < 1.0:
        return
    way = (ends[1] - ends[0]) / length
    for rim, colour in ((2.2, (255, 255, 255, 200)), (0.0, (20, 20, 20, 255))):
        at = 0.0
        for number in range(200):
            dash = (11 if number % 2 == 0 else 2) * unit
            if at >= length:
                break
            stop = min(at + dash, length)
            draw.line(  # type: ignore[attr-defined]
                [tuple(ends[0] + at * way), tuple(ends[0] + stop * way)],
                fill=colour,
                width=round((1.8 + rim) * unit),
            )
            at += dash + 5 * unit


def _head(line: NDArray[np.float64], size: float) -> NDArray[np.float64]:
    """Corners of the arrow's head."""
    tip = line[-1]
    far = line[np.linalg.norm(line - tip, axis=1) > 0.7 * size]
    tail = far[-1] if len(far) else line[0]
    way = tip - tail
    length = float(np.linalg.norm(way))
    way = way / length if length > 1e-9 else np.array([1.0, 0.0])
    side = np.array([-way[1], way[0]])
    return np.array(
        [tip, tip - way * size + side * size * 0.55, tip - way * size - side * size * 0.55]
    )


def _label_place(
    line: NDArray[np.float64],
    bounds: tuple[float, float, float, float],
    size: tuple[int, int],
    unit: float,
    taken: Sequence[tuple[float, ...]],
) -> Box2:
    """Where the angle is written: beside the middle of the arrow, on its outer side, inside."""
    wide, tall = bounds[2] - bounds[0] + 12 * unit, bounds[3] - bounds[1] + 10 * unit
    middle = line[len(line) // 2]
    out = middle - (line[0] + line[-1]) / 2
    length = float(np.linalg.norm(out))
    out = out / length if length > unit else np.array([0.0, -1.0])
    x, y = middle + out * (0.5 * max(wide, tall) + 8 * unit)
    x = float(np.clip(x, wide / 2 + unit, size[0] - wide / 2 - unit))
    y = float(np.clip(y, tall / 2 + unit, size[1] - tall / 2 - unit))
    # Past those that are there, up or down, whichever is nearer and still in the picture.
    for shift in sorted(range(-12, 13), key=abs):
        at = y + shift * tall / 3
        box = (x - wide / 2, at - tall / 2, x + wide / 2, at + tall / 2)
        inside = box[1] >= unit and box[3] <= size[1] - unit
        if inside and not any(_overlap(box, other) for other in taken):
            return box
    return (x - wide / 2, y - tall / 2, x + wide / 2, y + tall / 2)


def _overlap(one: Sequence[float], other: Sequence[float]) -> bool:
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]
