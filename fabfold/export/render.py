"""Draw meshes in software: no display, no graphics driver, no network.

A small rasteriser with soft light (:mod:`fabfold.export.lighting`), so that corners darken, gaps
between bodies show, and the kit stands on a ground that takes its shadow. The same input gives the
same bytes.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import RecipeError
from fabfold.export.camera import PinholeCamera, View, camera_for, project
from fabfold.export.lighting import ShadowFloor, light_at, sun_frame
from fabfold.export.shading import corner_normals
from fabfold.srgb import bytes_of_light, linear_light

__all__ = ["Image", "Mesh", "jpeg_bytes", "png_bytes", "posed_points", "render", "thumbnail"]

#: A picture, (height, width, 3) uint8 array, sRGB.
Image = NDArray[np.uint8]
#: Vertices (v, 3) and triangles (f, 3) of a mesh.
Mesh = tuple[NDArray[np.floating], NDArray[np.int32]]

#: Share of its depth by which a surface is cut off and another one begins.
_STEP = 0.004
#: Cosine of the most by which normals within a pixel differ where it is lit as one.
_TURN = 0.97


def _lines(
    triangle: NDArray[np.int32],
    near: NDArray[np.float32],
    normals: NDArray[np.float32],
    owner: NDArray[np.int32],
) -> NDArray[np.float32]:
    """Strength of the line at each pixel: outlines strong, bodies' borders less, creases least."""
    height, width = triangle.shape
    body = np.where(triangle >= 0, owner[triangle], -1)
    strength = np.zeros((height, width), dtype=np.float32)
    for axis in (0, 1):
        one = (slice(None, -1), slice(None)) if axis == 0 else (slice(None), slice(None, -1))
        two = (slice(1, None), slice(None)) if axis == 0 else (slice(None), slice(1, None))
        step = np.abs(near[one] - near[two]) / np.maximum(np.maximum(near[one], near[two]), 1e-12)
        turn = np.einsum("ijk,ijk->ij", normals[one], normals[two])
        both = (body[one] >= 0) & (body[two] >= 0)
        line = np.where(both & (turn < 0.85), 0.35, 0.0)
        line = np.where(both & (step > _STEP), 0.7, line)
        line = np.where(body[one] != body[two], np.where(both, 0.7, 1.0), line)
        nearer = near[one] >= near[two]
        strength[one] = np.maximum(strength[one], np.where(nearer, line, 0.0))
        strength[two] = np.maximum(strength[two], np.where(nearer, 0.0, line))
    return strength


def render(
    meshes: Sequence[Mesh],
    colours: NDArray[np.uint8],
    transforms: NDArray[np.float64] | None = None,
    view: View | None = None,
    *,
    distance: float | None = None,
    within: NDArray[np.float64] | None = None,
    smooth: Sequence[NDArray[np.float64]] | None = None,
    only: tuple[int, int, int, int] | None = None,
) -> Image:
    """Draw meshes.

    Parameters
    ----------
    meshes : sequence of ((v, 3) float array, (f, 3) int32 array)
        Vertices and triangles of each mesh; closed, counter-clockwise seen from outside.
    colours : (b, 3) uint8 array
        Colour of each mesh, sRGB.
    transforms : (b, 4, 4) float64 array, optional
        Rigid transform of each mesh.
    view : View, optional
        Direction, size and light of the picture.
    distance : float, optional
        Distance of the camera from the middle of the meshes, in their unit; the nearest that has
        them all by default.
    within : (n, 3) float64 array, optional
        Points that the picture is to hold besides the meshes.
    smooth : sequence of (f, 3, 3) float64 array, optional
        What :func:`~fabfold.export.shading.corner_normals` gives for each mesh, for those who draw
        many pictures.
    only : (int, int, int, int), optional
        Left, top, right and bottom pixel of what is drawn; the rest of the picture stays empty.

    Returns
    -------
    (height, width, 3) uint8 array
        The picture, sRGB.

    Raises
    ------
    RecipeError
        If there is nothing to draw.
    """
    from fabfold.export.raster import fill_triangles, surface_points

    view = view or View()
    if not meshes or not sum(len(faces) for _, faces in meshes):
        raise RecipeError("a picture needs at least one triangle")
    vertices, corners, normals, owner = _gathered(meshes, transforms, smooth)
    samples = view.samples
    pixels = (view.size[0] * samples, view.size[1] * samples)
    held = vertices if within is None else np.concatenate([vertices, within])
    camera = camera_for(held, view, pixels, distance)
    left, top, right, bottom = only or (0, 0, *view.size)
    screen = project(vertices, camera) - np.array([left * samples, top * samples, 0.0])
    near, triangle = fill_triangles(
        screen, corners, (right - left) * samples, (bottom - top) * samples
    )
    # What is drawn sample by sample is the model; around it there is a page, or a floor.
    window, framed = _window(triangle, samples)
    first = np.array([[window[1].start, window[0].start, 0.0]])
    near, triangle = near[window], triangle[window]
    points, facing = surface_points(triangle, screen - first, corners, vertices, normals)
    whole = _whole_pixels(triangle, near, facing, owner, samples)
    parts = (triangle >= 0) & ~np.repeat(np.repeat(whole, samples, axis=0), samples, axis=1)
    mean = _mean(facing, whole, samples)
    mean /= np.linalg.norm(mean, axis=1, keepdims=True)
    places = np.concatenate([_mean(points, whole, samples), points[parts]])
    directions = np.concatenate([mean, facing[parts]])
    width, height = view.size
    sheet = np.empty((height, width, 3), dtype=np.float32)
    sheet[:] = linear_light(view.background)
    page = sheet[top:bottom, left:right]
    if view.ground:
        floor = ShadowFloor(vertices, camera, view)
        light = light_at(
            np.concatenate([places, floor.points]),
            np.concatenate([directions, floor.normals]),
            vertices, corners, view,
        )  # fmt: skip
        sheet *= floor.darkened(light[len(places) :])[..., None]
    else:
        light = light_at(places, directions, vertices, corners, view)
    seen_of = np.concatenate([triangle[::samples, ::samples][whole], triangle[parts]])
    paint = linear_light(colours)[owner[seen_of]]
    painted = _painted(paint, light[: len(places)], places, directions, camera, view)
    count = int(whole.sum())
    image = np.repeat(np.repeat(page[framed], samples, axis=0), samples, axis=1)
    for part in _places(image, samples):
        part[whole] = painted[:count]
    image[parts] = painted[count:]
    image *= (1.0 - view.edges * _lines(triangle, near, facing, owner))[..., None]
    of_pixel = _places(image, samples)
    page[framed] = sum(of_pixel[1:], of_pixel[0]) / np.float32(samples**2)
    return bytes_of_light(sheet)


def _places(samples: NDArray[Any], each: int) -> list[NDArray[Any]]:
    """The samples of all pixels by their place in the pixel: `each` ² views of a picture's size."""
    return [samples[i::each, j::each] for i in range(each) for j in range(each)]


def _mean(values: NDArray[np.float32], wanted: NDArray[np.bool_], each: int) -> NDArray[np.float32]:
    """Mean of the samples of some pixels, (n, 3)."""
    parts = [part[wanted] for part in _places(values, each)]
    return np.asarray(sum(parts[1:], parts[0]) / np.float32(len(parts)))


def _whole_pixels(
    triangle: NDArray[np.int32],
    near: NDArray[np.float32],
    facing: NDArray[np.float32],
    owner: NDArray[np.int32],
    each: int,
) -> NDArray[np.bool_]:
    """Pixels whose samples all see one smooth stretch of one body: their light is found once."""
    bodies = _places(np.where(triangle >= 0, owner[triangle], -1), each)
    depths, normals = _places(near, each), _places(facing, each)
    found = bodies[0] >= 0
    for body in bodies[1:]:
        found &= body == bodies[0]
    nearest = reduce(np.maximum, depths)
    found &= nearest - reduce(np.minimum, depths) <= _STEP * nearest
    first = normals[0][found]
    smooth = np.ones(len(first), dtype=np.bool_)
    for normal in normals[1:]:
        smooth &= np.einsum("ij,ij->i", normal[found], first) > _TURN
    found[found] = smooth
    return found


def _window(
    triangle: NDArray[np.int32], samples: int
) -> tuple[tuple[slice, slice], tuple[slice, slice]]:
    """The samples, and the pixels, that hold all of the model and its outline."""
    covered = triangle >= 0
    pixels = []
    for axis in (1, 0):
        found = np.flatnonzero(covered.any(axis=axis))
        size = covered.shape[1 - axis] // samples
        first, last = (int(found[0]), int(found[-1])) if len(found) else (0, 0)
        low = max(0, first - 1) // samples
        high = min(size, -(-(last + 2) // samples))
        pixels.append(slice(low, high))
    rows, columns = (slice(part.start * samples, part.stop * samples) for part in pixels)
    return (rows, columns), (pixels[0], pixels[1])


def _gathered(
    meshes: Sequence[Mesh],
    transforms: NDArray[np.float64] | None,
    known: Sequence[NDArray[np.float64]] | None,
) -> tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.float32], NDArray[np.int32]]:
    """All vertices, triangles, corner normals, and the mesh that each triangle is of."""
    points, corners, normals, owner = [], [], [], []
    start = 0
    for index, (vertices, faces) in enumerate(meshes):
        turned = np.asarray(vertices, dtype=np.float64)
        smooth = corner_normals(turned, faces) if known is None else known[index]
        if transforms is not None:
            pose = np.asarray(transforms[index], dtype=float)
            turned = turned @ pose[:3, :3].T + pose[:3, 3]
            smooth = smooth @ pose[:3, :3].T
        points.append(turned)
        corners.append(np.asarray(faces, dtype=np.int32) + start)
        normals.append(smooth.astype(np.float32))
        owner.append(np.full(len(faces), index, dtype=np.int32))
        start += len(turned)
    return (
        np.concatenate(points),
        np.concatenate(corners),
        np.concatenate(normals),
        np.concatenate(owner),
    )


def _painted(
    paint: NDArray[np.float64],
    light: NDArray[np.float32],
    points: NDArray[np.float32],
    facing: NDArray[np.float32],
    camera: PinholeCamera,
    view: View,
) -> NDArray[np.float64]:
    """Colour of lit surfaces: matt plastic over a pale floor."""
    bounce = 0.16 * (1.0 - facing[:, 2]) + 0.05
    towards = camera.eye - points
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    # Specular light after Blinn: the normal against the direction between camera and sun.
    between = towards + sun_frame(view.azimuth_deg)[2]
    between /= np.linalg.norm(between, axis=1, keepdims=True)
    shine = np.clip(np.einsum("ij,ij->i", between, facing), 0.0, 1.0) ** 40 * 0.10
    lit = paint * (light + bounce)[:, None] + (shine * np.clip(light, 0, 1))[:, None]
    # A soft shoulder, so that bright colours keep their hue.
    return np.asarray(np.where(lit > 0.8, 0.8 + 0.2 * np.tanh((lit - 0.8) / 0.2), lit))


def posed_points(meshes: Sequence[Mesh], transforms: NDArray[np.float64]) -> NDArray[np.float64]:
    """Vertices of meshes where their transforms put them, one mesh after another.

    Parameters
    ----------
    meshes : sequence of ((v, 3) float array, (f, 3) int32 array)
        Vertices and triangles of each mesh.
    transforms : (b, 4, 4) float64 array
        Rigid transform of each mesh.

    Returns
    -------
    (n, 3) float64 array
        In the unit of the meshes.
    """
    return np.concatenate(
        [
            vertices @ pose[:3, :3].T + pose[:3, 3]
            for (vertices, _), pose in zip(meshes, transforms, strict=True)
        ]
    )


def thumbnail(meshes: Sequence[Mesh], colours: NDArray[np.uint8]) -> bytes:
    """A small picture for file managers and slicers, as PNG.

    Parameters
    ----------
    meshes : sequence of ((v, 3) float array, (f, 3) int32 array)
        Vertices and triangles of each mesh.
    colours : (b, 3) uint8 array
        Colour of each mesh, sRGB.

    Returns
    -------
    bytes
        256 × 256 pixels.
    """
    view = View(size=(256, 256), lights=8)
    return png_bytes(render(meshes, colours, None, view))


def png_bytes(image: Image) -> bytes:
    """An RGB picture as PNG, the same bytes for the same picture.

    Parameters
    ----------
    image : (h, w, 3) uint8 array
        sRGB.

    Returns
    -------
    bytes
        With an sRGB chunk, so that viewers show the colours that were meant.
    """
    from PIL import Image as PillowImage
    from PIL.PngImagePlugin import PngInfo

    about = PngInfo()
    about.add(b"sRGB", b"\0")
    buffer = io.BytesIO()
    PillowImage.fromarray(image).save(buffer, "PNG", pnginfo=about)
    return buffer.getvalue()


def jpeg_bytes(image: Image) -> bytes:
    """An RGB picture as JPEG, the same bytes for the same picture.

    Parameters
    ----------
    image : (h, w, 3) uint8 array
        sRGB.

    Returns
    -------
    bytes
        A few times smaller than as PNG, for pages with many pictures.
    """
    from PIL import Image as PillowImage

    buffer = io.BytesIO()
    PillowImage.fromarray(image).save(buffer, "JPEG", quality=88, subsampling=0)
    return buffer.getvalue()
