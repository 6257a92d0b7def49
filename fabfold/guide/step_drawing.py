"""The picture of a step: what moves in colour, where it goes as a pale image, and an arrow.

It reads in black and white too: what moves is darker than what stays, where it ends has an outline,
and the arrow is black with a white rim.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import cycle
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.export.camera import PinholeCamera, View, camera_for, project
from fabfold.export.render import Image, Mesh, posed_points, render
from fabfold.guide.fold_steps import FoldStep
from fabfold.guide.fonts import font_file
from fabfold.guide.step_views import StepView
from fabfold.lattice.rotations import rotation_about

if TYPE_CHECKING:
    from PIL import ImageFont

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


#: Left, top, right and bottom: of a label, and of what is drawn.
Box2 = tuple[float, float, float, float]
Window = tuple[int, int, int, int]


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


@dataclass(frozen=True)
class _Layout:
    """Where in the picture of turns that are made at once everything is, before it is drawn."""

    meshes: Sequence[Mesh]
    step: FoldStep
    look: View
    within: NDArray[np.float64]
    camera: PinholeCamera
    axes: tuple[NDArray[np.float64], ...]
    arrows: tuple[NDArray[np.float64], ...]
    labels: tuple[Box2, ...]

    def drawn(
        self, smooth: Sequence[NDArray[np.float64]] | None, only: Window | None = None
    ) -> StepPicture:
        """The picture, or the part of it that is wanted."""
        step = self.step
        colours = np.tile(np.array(STAYING, np.uint8), (len(self.meshes), 1))
        for turn, colour in zip(step.turns, cycle(MOVING), strict=False):
            colours[list(turn.moving)] = colour
        image = render(
            self.meshes, colours, step.before, self.look,
            within=self.within, smooth=smooth, only=only,
        )  # fmt: skip
        left, top, right, bottom = only or (0, 0, *self.look.size)
        ghost = _with_ghost(image[top:bottom, left:right], self, (left, top))
        image[top:bottom, left:right] = ghost
        for turn, axis, arrow, label in zip(
            step.turns, self.axes, self.arrows, self.labels, strict=True
        ):
            image = _with_marks(image, arrow, axis, _angle(turn), label)
        return StepPicture(image, self.camera, self.arrows, self.labels)


def _laid_out(
    meshes: Sequence[Mesh],
    step: FoldStep,
    view: StepView,
    voxel_mm: float,
    size: tuple[int, int],
) -> _Layout:
    arcs = [arrow_points(turn, meshes, voxel_mm) for turn in step.turns]
    within = np.concatenate([posed_points(meshes, step.after), *arcs])
    look = View(
        view.azimuth_deg, view.elevation_deg, size=size, ground=False, lights=4, margin=0.05
    )
    before = posed_points(meshes, step.before)
    camera = camera_for(np.concatenate([before, within]), look, size, None)
    axes: list[NDArray[np.float64]] = []
    arrows: list[NDArray[np.float64]] = []
    labels: list[Box2] = []
    for turn, arc in zip(step.turns, arcs, strict=True):
        axis = turn.point + np.outer([-0.9, 0.9], turn.axis) * voxel_mm
        axes.append(project(axis, camera)[:, :2])
        arrows.append(project(arc, camera)[:, :2])
        labels.append(_label_place(arrows[-1], _angle(turn), size, labels))
    return _Layout(meshes, step, look, within, camera, tuple(axes), tuple(arrows), tuple(labels))


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
    return _laid_out(meshes, step, view, voxel_mm, size).drawn(smooth)


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
        layout = _laid_out(meshes, phase, view, voxel_mm, large)
        window = _cut_out(layout, cell)
        panel = layout.drawn(smooth, window)
        panels.append(panel)
        left, top = cell[0] * (number % across), cell[1] * (number // across)
        shown = PillowImage.fromarray(panel.image).crop(window)
        sheet.paste(shown.resize(cell, PillowImage.Resampling.LANCZOS), (left, top))
        frame = (left + 2, top + 2, left + cell[0] - 3, top + cell[1] - 3)
        draw.rounded_rectangle(frame, radius=9, outline=(150, 150, 150), width=2)
        draw.text((left + 12, top + 6), "abcd"[number], font=font, fill=(20, 20, 20))
    return StepPicture(np.asarray(sheet), panels[0].camera, (), (), tuple(panels))


def _cut_out(layout: _Layout, cell: tuple[int, int]) -> Window:
    """Window of a picture about what moves, its arrow and its angle, in the shape of a cell."""
    moving = list(layout.step.moving)
    parts = [layout.meshes[body] for body in moving]
    points = [
        project(posed_points(parts, poses[moving]), layout.camera)[:, :2]
        for poses in (layout.step.before, layout.step.after)
    ]
    labels = np.array(layout.labels).reshape(-1, 2)
    spots = np.concatenate([*points, *layout.arrows, labels])
    width, height = layout.look.size
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
    layout: _Layout, poses: NDArray[np.float64], corner: tuple[int, int], size: tuple[int, int]
) -> NDArray[np.int64]:
    """Which body is seen at each pixel (h, w) of a window; -1 where there is none."""
    from fabfold.export.raster import fill_triangles

    counts = [len(faces) for _, faces in layout.meshes]
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in layout.meshes)])
    faces = np.concatenate(
        [faces + start for (_, faces), start in zip(layout.meshes, starts, strict=False)]
    ).astype(np.int32)
    screen = project(posed_points(layout.meshes, poses), layout.camera)
    screen[:, :2] -= corner
    _, nearest = fill_triangles(screen, faces, *size)
    owner = np.repeat(np.arange(len(counts)), counts)
    return np.where(nearest >= 0, owner[nearest], -1)


def _with_ghost(image: Image, layout: _Layout, corner: tuple[int, int]) -> Image:
    """A pale image of where the moving bodies end, with an outline, in a window of the picture."""
    step, size = layout.step, (image.shape[1], image.shape[0])
    after = _owners(layout, step.after, corner, size)
    here = np.isin(_owners(layout, step.before, corner, size), step.all_moving)
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


def _angle(turn: FoldStep) -> str:
    return f"{turn.degrees:g}°"


def _unit(size: tuple[int, int]) -> float:
    """Scale of lines and letters in a picture, in pixels; 1 where it is 420 high."""
    return size[1] / 420


def _letters(unit: float) -> ImageFont.FreeTypeFont:
    from PIL import ImageFont

    return ImageFont.truetype(str(font_file(bold=True)), round(_FINER * 19 * unit))


def _with_marks(
    image: Image, arrow: NDArray[np.float64], axis: NDArray[np.float64], text: str, label: Box2
) -> Image:
    """The hinge's line, the arrow, and the angle in its place."""
    from PIL import Image as PillowImage
    from PIL import ImageDraw

    height, width = image.shape[:2]
    unit = _FINER * _unit((width, height))
    line = arrow * _FINER
    head = _head(line, 17 * unit)
    # Only what the marks cover is drawn finer.
    spots = np.concatenate([arrow, axis, head / _FINER, np.array(label).reshape(-1, 2)])
    rim = int(np.ceil(12 * unit / _FINER))
    left, top = np.clip(np.floor(spots.min(axis=0)).astype(int) - rim, 0, [width, height])
    right, bottom = np.clip(np.ceil(spots.max(axis=0)).astype(int) + rim, 0, [width, height])
    if right <= left or bottom <= top:
        return image
    shift = _FINER * np.array([left, top])
    layer = PillowImage.new("RGBA", tuple(_FINER * np.array([right - left, bottom - top])))
    draw = ImageDraw.Draw(layer)
    _dashes(draw, axis * _FINER - shift, unit)
    line, head = line - shift, head - shift
    body = line[: max(2, int(np.ceil(len(line) * 0.97)))]
    for wide, colour in ((10.5, (255, 255, 255, 235)), (5.5, (20, 20, 20, 255))):
        draw.line(
            [tuple(p) for p in body.tolist()], fill=colour, width=round(wide * unit), joint="curve"
        )
        edge = (wide - 5.5) * unit / 2
        middle = head.mean(axis=0)
        grown = middle + (head - middle) * (1 + 2.2 * edge / (17 * unit))
        draw.polygon([tuple(p) for p in grown.tolist()], fill=colour)
    plate = _FINER * np.array(label) - np.tile(shift, 2)
    draw.rounded_rectangle(plate.tolist(), radius=7 * unit, fill=(255, 255, 255, 225))
    draw.text(
        ((plate[0] + plate[2]) / 2, (plate[1] + plate[3]) / 2),
        text,
        font=_letters(unit / _FINER),
        fill=(20, 20, 20, 255),
        anchor="mm",
    )
    small = layer.resize((right - left, bottom - top), PillowImage.Resampling.BOX)
    base = PillowImage.fromarray(image[top:bottom, left:right]).convert("RGBA")
    base.alpha_composite(small)
    result = image.copy()
    result[top:bottom, left:right] = np.asarray(base.convert("RGB"))
    return result


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
    arrow: NDArray[np.float64], text: str, size: tuple[int, int], taken: Sequence[Box2]
) -> Box2:
    """Where the angle is written: beside the middle of the arrow, on its outer side, inside.

    It is written where none of those in `taken` is; all in pixels.
    """
    unit = _unit(size)
    left, top, right, bottom = (value / _FINER for value in _letters(unit).getbbox(text))
    wide, tall = right - left + 12 * unit, bottom - top + 10 * unit
    middle = arrow[len(arrow) // 2]
    out = middle - (arrow[0] + arrow[-1]) / 2
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
