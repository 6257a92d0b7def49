"""Still pictures of parts: a small z-buffer renderer that needs no graphics driver.

Parallel projection, shaded faces, and dark lines where the part, the depth or the direction of the
surface changes. The same input gives the same picture on every machine.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .errors import HingeError

if TYPE_CHECKING:
    from PIL.Image import Image

__all__ = ["PALETTE", "Body", "Camera", "bodies_of", "render", "save", "sheet"]

Floats = NDArray[np.float64]

PALETTE: tuple[tuple[float, float, float], ...] = (
    (0.36, 0.56, 0.78),
    (0.95, 0.66, 0.32),
    (0.52, 0.74, 0.48),
    (0.72, 0.72, 0.75),
    (0.80, 0.45, 0.45),
    (0.62, 0.52, 0.74),
)


@dataclass(frozen=True)
class Body:
    """One coloured mesh.

    Attributes
    ----------
    vertices : (v, 3) float64 array
    faces : (f, 3) int array
    color : (r, g, b)
        0 to 1.
    """

    vertices: Floats
    faces: NDArray[np.int32]
    color: tuple[float, float, float]


@dataclass(frozen=True)
class Camera:
    """Where the picture is taken from.

    Parameters
    ----------
    azimuth, elevation : float
        In degrees: around z from +x, and above the xy plane.
    zoom : float
        1 fills the picture.
    up : (x, y, z)
        Which direction stands upright.
    """

    azimuth: float = -60.0
    elevation: float = 30.0
    zoom: float = 1.0
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)

    def axes(self) -> Floats:
        """Right, up and towards the viewer as the rows of a (3, 3) matrix."""
        up = np.array(self.up) / np.linalg.norm(self.up)
        side = np.array((1.0, 0.0, 0.0)) if abs(up[0]) < 0.9 else np.array((0.0, 1.0, 0.0))
        east = side - up * np.dot(side, up)
        east /= np.linalg.norm(east)
        north = np.cross(up, east)
        around, above = np.radians(self.azimuth), np.radians(self.elevation)
        flat = np.cos(around) * east + np.sin(around) * north
        towards = np.cos(above) * flat + np.sin(above) * up
        right = np.cross(up, towards)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(towards, right), towards])


def bodies_of(
    shapes: Sequence[Any],
    colors: Sequence[tuple[float, float, float]] = PALETTE,
    tolerance: float = 0.02,
) -> list[Body]:
    """Tessellate build123d shapes, one body a solid.

    Parameters
    ----------
    shapes : sequence of Shape
    colors : sequence of (r, g, b)
        Taken in turn, one a shape.
    tolerance : float
        In mm.

    Returns
    -------
    list of Body
    """
    made = []
    for index, shape in enumerate(shapes):
        for solid in shape.solids():
            points, triangles = solid.tessellate(tolerance, 0.2)
            vertices = np.array([(p.X, p.Y, p.Z) for p in points], dtype=np.float64)
            faces = np.array(triangles, dtype=np.int32)
            made.append(Body(vertices, faces, colors[index % len(colors)]))
    return made


def _fill(
    projected: Floats,
    faces: NDArray[np.int32],
    width: int,
    height: int,
    tag: int,
    depth: Floats,
    owner: NDArray[np.int32],
) -> None:
    """Draw triangles into the depth and owner buffers; `tag` plus the face's index is stored."""
    for index, triangle in enumerate(projected[faces]):
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = triangle
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area <= 1e-9:  # seen from behind, or edge on
            continue
        left, right = int(max(min(ax, bx, cx), 0.0)), int(min(max(ax, bx, cx), width - 1.0))
        low, high = int(max(min(ay, by, cy), 0.0)), int(min(max(ay, by, cy), height - 1.0))
        if left > right or low > high:
            continue
        x = np.arange(left, right + 1) + 0.5
        y = (np.arange(low, high + 1) + 0.5)[:, None]
        first = ((bx - x) * (cy - y) - (by - y) * (cx - x)) / area
        second = ((cx - x) * (ay - y) - (cy - y) * (ax - x)) / area
        third = 1.0 - first - second
        inside = (first >= -1e-9) & (second >= -1e-9) & (third >= -1e-9)
        level = first * az + second * bz + third * cz
        view = depth[low : high + 1, left : right + 1]
        nearer = inside & (level > view)
        view[nearer] = level[nearer]
        owner[low : high + 1, left : right + 1][nearer] = tag + index


def render(
    bodies: Sequence[Body],
    size: tuple[int, int] = (640, 480),
    camera: Camera | None = None,
    *,
    oversample: int = 2,
) -> Image:
    """Draw bodies on white.

    Parameters
    ----------
    bodies : sequence of Body
    size : (width, height)
        In pixels.
    camera : Camera, optional
    oversample : int
        Drawn so many times larger and then reduced.

    Returns
    -------
    Image
        Of Pillow.

    Raises
    ------
    HingeError
        If there is nothing to draw.
    """
    from PIL import Image as Pillow

    if not bodies:
        raise HingeError("there is nothing to draw")
    camera = camera or Camera()
    axes = camera.axes()
    width, height = size[0] * oversample, size[1] * oversample
    seen = [body.vertices @ axes.T for body in bodies]
    low = np.min([points.min(axis=0) for points in seen], axis=0)
    high = np.max([points.max(axis=0) for points in seen], axis=0)
    scale = camera.zoom * 0.92 * min(width / (high[0] - low[0]), height / (high[1] - low[1]))
    shift = np.array([0.5 * width, 0.5 * height]) - 0.5 * scale * (low + high)[:2]
    depth = np.full((height, width), -np.inf)
    owner = np.full((height, width), -1, dtype=np.int32)
    tag = 0
    normals, colors, parts = [], [], []
    for part, (body, points) in enumerate(zip(bodies, seen, strict=True)):
        flat = np.column_stack([points[:, :2] * scale + shift, points[:, 2]])
        _fill(flat, body.faces, width, height, tag, depth, owner)
        corners = points[body.faces]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        normals.append(normal / np.where(length > 0.0, length, 1.0))
        colors.append(np.repeat([body.color], len(body.faces), axis=0))
        parts.append(np.full(len(body.faces), part))
        tag += len(body.faces)
    normal_of, color_of = np.concatenate(normals), np.concatenate(colors)
    part_of = np.concatenate(parts)
    light = np.array([-0.35, 0.65, 0.68])
    shade = 0.42 + 0.50 * np.clip(normal_of @ light, 0.0, 1.0) + 0.10 * normal_of[:, 2]
    image = np.ones((height, width, 3))
    drawn = owner >= 0
    face = owner[drawn]
    image[drawn] = np.clip(color_of[face] * shade[face, None] * 1.12, 0.0, 1.0)
    image[_lines(owner, depth, drawn, part_of, normal_of, scale)] = (0.10, 0.12, 0.16)
    pixels = np.round(image[::-1] * 255.0).astype(np.uint8)
    return Pillow.fromarray(pixels).resize(size, Pillow.Resampling.LANCZOS)


def _lines(
    owner: NDArray[np.int32],
    depth: Floats,
    drawn: NDArray[np.bool_],
    part_of: NDArray[np.int64],
    normal_of: Floats,
    scale: float,
) -> NDArray[np.bool_]:
    """Mark the pixels where the part, the depth or the direction of the surface changes."""
    part = np.where(drawn, part_of[np.maximum(owner, 0)], -1)
    normal = np.where(drawn[..., None], normal_of[np.maximum(owner, 0)], 0.0)
    lines = np.zeros_like(drawn)
    for axis in (0, 1):
        here: list[Any] = [slice(None), slice(None)]
        there: list[Any] = [slice(None), slice(None)]
        here[axis], there[axis] = slice(None, -1), slice(1, None)
        one, other = tuple(here), tuple(there)
        both = drawn[one] & drawn[other]
        slope = np.minimum(np.abs(normal[one][..., 2]), np.abs(normal[other][..., 2]))
        with np.errstate(invalid="ignore"):
            step = np.where(both, np.abs(depth[one] - depth[other]), 0.0) * scale
        jump = step * np.maximum(slope, 0.08) > 4.0
        bend = np.einsum("ijk,ijk->ij", normal[one], normal[other]) < 0.87
        lines[one] |= (part[one] != part[other]) | (both & (jump | bend))
    return lines


def sheet(pictures: Sequence[Image], captions: Sequence[str], columns: int = 3) -> Image:
    """Lay pictures of one size out in rows, each with its caption below.

    Parameters
    ----------
    pictures : sequence of Image
    captions : sequence of str
    columns : int

    Returns
    -------
    Image
    """
    from PIL import Image as Pillow
    from PIL import ImageDraw, ImageFont

    wide, high = pictures[0].size
    rows = -(-len(pictures) // columns)
    band = 26
    whole = Pillow.new("RGB", (wide * min(columns, len(pictures)), (high + band) * rows), "white")
    pen = ImageDraw.Draw(whole)
    font = ImageFont.load_default(15)
    for index, (picture, caption) in enumerate(zip(pictures, captions, strict=True)):
        x, y = wide * (index % columns), (high + band) * (index // columns)
        whole.paste(picture, (x, y))
        pen.text((x + wide // 2, y + high + band // 2), caption, "black", font=font, anchor="mm")
    return whole


def save(image: Image, path: Path) -> None:
    """Write a PNG with 128 colours, so that a picture stays small."""
    from PIL import Image as Pillow

    path.parent.mkdir(parents=True, exist_ok=True)
    image.quantize(128, dither=Pillow.Dither.NONE).save(path, optimize=True)
