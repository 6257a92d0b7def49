"""Draw meshes in software: no display, no graphics driver, no network.

A small rasteriser with soft light: an overcast sky and a low sun are many distant lights, each
with its own shadow map, so that corners darken, gaps between bodies show, and the kit stands on a
ground that takes its shadow. The same input gives the same bytes.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import RecipeError
from fabfold.export.shading import corner_normals
from fabfold.srgb import bytes_of_light, linear_light

__all__ = ["Camera", "Image", "Mesh", "View", "camera_for", "png_bytes", "project", "render"]

Image = NDArray[np.uint8]
Mesh = tuple[NDArray[np.floating], NDArray[np.int32]]

#: Height of the camera's field of view.
_FIELD_DEG = 24.0


@dataclass(frozen=True)
class View:
    """Where the camera stands and how the picture is made.

    Attributes
    ----------
    azimuth_deg, elevation_deg : float
        Of the camera as seen from the model: 0 is +x, 90 is +y; z is up.
    size : (int, int)
        Width and height in pixels.
    margin : float
        Share of the picture left free at each side.
    samples : int
        Squared, the samples a pixel.
    lights : int
        Of the sky; the sun takes half as many again.
    ground : bool
        Whether the model stands on a ground that takes its shadow.
    edges : float
        Strength of the lines along edges, 0 to 1.
    background : (int, int, int)
        sRGB.
    """

    azimuth_deg: float = -60.0
    elevation_deg: float = 24.0
    size: tuple[int, int] = (1200, 900)
    margin: float = 0.06
    samples: int = 2
    lights: int = 40
    ground: bool = True
    edges: float = 0.55
    background: tuple[int, int, int] = (255, 255, 255)

    def __post_init__(self) -> None:
        if min(self.size) < 8 or max(self.size) > 8192 or not 1 <= self.samples <= 4:
            raise RecipeError(
                f"a picture of {self.size[0]} x {self.size[1]} pixels with {self.samples} samples: "
                "sizes are 8 to 8192 and samples 1 to 4"
            )
        if not 0.0 <= self.margin < 0.45 or abs(self.elevation_deg) > 89.0:
            raise RecipeError(
                f"picture margin {self.margin:g}, elevation {self.elevation_deg:g}°: the margin is "
                "0 to 0.45 and the elevation -89° to 89°"
            )


@dataclass(frozen=True)
class Camera:
    """Where a picture is taken from.

    Attributes
    ----------
    eye : (3,) float64 array
    frame : (3, 3) float64 array
        Rows: the picture's right, its up, and the direction from the model to the camera.
    focal : float
        Pixels at distance 1.
    centre : (float, float)
        Pixel on the axis.
    """

    eye: NDArray[np.float64]
    frame: NDArray[np.float64]
    focal: float
    centre: tuple[float, float]


def _frame(azimuth_deg: float, elevation_deg: float) -> NDArray[np.float64]:
    azimuth, elevation = np.radians(azimuth_deg), np.radians(elevation_deg)
    away = np.array(
        [
            np.cos(azimuth) * np.cos(elevation),
            np.sin(azimuth) * np.cos(elevation),
            np.sin(elevation),
        ]
    )
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    return np.array([right, np.cross(away, right), away])


def camera_for(
    points: NDArray[np.float64], view: View, pixels: tuple[int, int], distance: float | None
) -> Camera:
    """Nearest camera in the view's direction that has all points inside the margins.

    With a `distance`, the camera stands that far from the middle of the points instead.
    """
    frame = _frame(view.azimuth_deg, view.elevation_deg)
    width, height = pixels
    focal = 0.5 * height / np.tan(np.radians(_FIELD_DEG) / 2)
    x, y, z = frame @ points.T
    half = (0.5 - view.margin) * np.array([width, height]) / focal
    # A point (x, y, z) is inside when |x - cx| <= half * (d - z): linear in cx and the distance d.
    need = []
    middle = []
    for across, room in ((x, half[0]), (y, half[1])):
        high, low = (across + room * z).max(), (across - room * z).min()
        need.append((high - low) / (2 * room))
        middle.append((high + low) / 2)
    far = max(*need, z.max() + 1e-3 * np.ptp(points, axis=0).max())
    if distance is not None:
        far = (z.max() + z.min()) / 2 + distance
    eye = frame.T @ np.array([middle[0], middle[1], far])
    return Camera(eye, frame, float(focal), (width / 2, height / 2))


def project(points: NDArray[np.float64], camera: Camera) -> NDArray[np.float64]:
    """Pixel x, pixel y and inverse depth of each of (n, 3) points, shape (n, 3)."""
    seen = (points - camera.eye) @ camera.frame.T
    near = -1.0 / seen[:, 2]
    return np.column_stack(
        [
            camera.centre[0] + camera.focal * seen[:, 0] * near,
            camera.centre[1] - camera.focal * seen[:, 1] * near,
            near,
        ]
    )


def _lights(count: int, azimuth_deg: float) -> list[tuple[NDArray[np.float64], float]]:
    """Directions and strengths of the sky and of a soft sun over the camera's left shoulder."""
    lights = []
    turn = np.pi * (3.0 - np.sqrt(5.0))
    for i in range(count):
        height = 0.06 + 0.94 * (i + 0.5) / count
        across = np.sqrt(1.0 - height * height)
        lights.append(
            (np.array([across * np.cos(i * turn), across * np.sin(i * turn), height]), 1.0)
        )
    total = sum(direction[2] for direction, _ in lights)
    lights = [(direction, 0.62 / total) for direction, _ in lights]
    suns = max(4, count // 2)
    frame = _frame(azimuth_deg - 48.0, 52.0)
    for i in range(suns):
        spread = 0.16 * np.sqrt((i + 0.5) / suns)
        offset = spread * (np.cos(i * turn) * frame[0] + np.sin(i * turn) * frame[1])
        direction = frame[2] + offset
        lights.append((direction / np.linalg.norm(direction), 0.78 / suns))
    return lights


def _light_at(
    points: NDArray[np.float32],
    normals: NDArray[np.float32],
    vertices: NDArray[np.float64],
    corners: NDArray[np.int32],
    view: View,
) -> NDArray[np.float32]:
    """Light that falls on each point of a scene, about 1 on an open floor."""
    from fabfold.export.raster import cast_light, fill_depth

    texels = int(np.clip(max(view.size) * view.samples * 0.5, 256, 1000))
    light = np.zeros(len(points), dtype=np.float32)
    for direction, strength in _lights(view.lights, view.azimuth_deg):
        azimuth = np.degrees(np.arctan2(direction[1], direction[0]))
        frame = _frame(float(azimuth), float(np.degrees(np.arcsin(direction[2]))))
        placed = vertices @ frame.T
        low, high = placed.min(axis=0), placed.max(axis=0)
        scale = (texels - 4) / float(max(high[0] - low[0], high[1] - low[1]))
        offset = low[:2] - 2.0 / scale
        placed[:, :2] = (placed[:, :2] - offset) * scale
        depth = fill_depth(placed, corners, texels)
        lift = 1.0 / scale
        cast_light(light, points, normals, depth, frame, offset, scale, lift, strength, 1.2)
    return light


class _Floor:
    """The floor under a model, which shows nothing but its shadow.

    Attributes
    ----------
    points, normals : (n, 3) float32 arrays
        Where the light is wanted: one point a pixel that looks at the floor.
    """

    def __init__(self, vertices: NDArray[np.float64], camera: Camera, view: View) -> None:
        width, height = view.size
        right, up, away = camera.frame
        across, down = np.arange(width) + 0.5, np.arange(height) + 0.5
        x = (across * view.samples - camera.centre[0]) / camera.focal
        y = (camera.centre[1] - down * view.samples) / camera.focal
        rays = x[None, :, None] * right + y[:, None, None] * up - away
        falls = (rays[..., 2] < -1e-6) & (view.ground and view.elevation_deg > 0)
        reach = (vertices[:, 2].min() - camera.eye[2]) / np.where(falls, rays[..., 2], -1.0)
        places = camera.eye + rays * reach[..., None]
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        size = 2.5 * float((high - low).max())
        offset = places - (low + high) / 2
        apart = np.hypot(offset[..., 0], offset[..., 1])
        self._seen = falls & (apart < size)
        self.points = places[self._seen].astype(np.float32)
        self.normals = np.zeros_like(self.points)
        self.normals[:, 2] = 1.0
        # The shadow fades with distance and towards the rim: pictures can stand side by side.
        rim = np.minimum(
            np.minimum(across, width - across)[None, :],
            np.minimum(down, height - down)[:, None],
        )
        self._fade = np.sqrt(1.0 - apart[self._seen] / size)
        self._fade *= np.clip(rim[self._seen] / (0.12 * height), 0.0, 1.0)
        lights = _lights(view.lights, view.azimuth_deg)
        self._open = sum(float(strength * direction[2]) for direction, strength in lights)

    def left(self, light: NDArray[np.float32]) -> NDArray[np.float32]:
        """Share of the background's light that is left at each pixel, shape (height, width)."""
        shade = np.clip(light / self._open, 0.0, 1.0)
        left = np.ones(self._seen.shape, dtype=np.float32)
        left[self._seen] = 1.0 - 0.75 * self._fade * (1.0 - shade)
        return left


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
        line = np.where(both & (step > 0.004), 0.7, line)
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
) -> Image:
    """Draw meshes.

    Parameters
    ----------
    meshes : sequence of ((v, 3) float array, (f, 3) int32 array)
        Closed, outward-oriented.
    colours : (b, 3) uint8 array
        sRGB, one a mesh.
    transforms : (b, 4, 4) float64 array, optional
        Rigid transform of each mesh.
    view : View, optional
    distance : float, optional
        Of the camera from the middle of the meshes; the nearest that has them all by default.

    Returns
    -------
    (height, width, 3) uint8 array
        sRGB.

    Raises
    ------
    RecipeError
        If there is nothing to draw.
    """
    from fabfold.export.raster import fill_triangles, surface_points

    view = view or View()
    if not meshes or not sum(len(faces) for _, faces in meshes):
        raise RecipeError("a picture needs at least one triangle")
    vertices, corners, normals, owner = _gathered(meshes, transforms)
    samples = view.samples
    pixels = (view.size[0] * samples, view.size[1] * samples)
    camera = camera_for(vertices, view, pixels, distance)
    screen = project(vertices, camera)
    near, triangle = fill_triangles(screen, corners, *pixels)
    points, facing = surface_points(triangle, screen, corners, vertices, normals)
    covered = triangle >= 0
    floor = _Floor(vertices, camera, view)
    light = _light_at(
        np.concatenate([points[covered], floor.points]),
        np.concatenate([facing[covered], floor.normals]),
        vertices,
        corners,
        view,
    )
    image = np.empty((*triangle.shape, 3), dtype=np.float32)
    image[:] = linear_light(view.background)
    onto = int(covered.sum())
    left = floor.left(light[onto:])
    image *= np.repeat(np.repeat(left, samples, axis=0), samples, axis=1)[..., None]
    paint = linear_light(colours)[owner]
    image[covered] = _painted(
        paint[triangle[covered]], light[:onto], points[covered], facing[covered], camera, view
    )
    lines = _lines(triangle, near, facing * covered[..., None], owner)
    image *= (1.0 - view.edges * lines)[..., None]
    height, width = view.size[1], view.size[0]
    return bytes_of_light(image.reshape(height, samples, width, samples, 3).mean(axis=(1, 3)))


def _gathered(
    meshes: Sequence[Mesh], transforms: NDArray[np.float64] | None
) -> tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.float32], NDArray[np.int32]]:
    """All vertices, triangles, corner normals, and the mesh that each triangle is of."""
    points, corners, normals, owner = [], [], [], []
    start = 0
    for index, (vertices, faces) in enumerate(meshes):
        turned = np.asarray(vertices, dtype=np.float64)
        smooth = corner_normals(turned, faces)
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
    camera: Camera,
    view: View,
) -> NDArray[np.float64]:
    """Colour of lit surfaces: matt plastic over a pale floor."""
    bounce = 0.16 * (1.0 - facing[:, 2]) + 0.05
    towards = camera.eye - points
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    sun = _frame(view.azimuth_deg - 48.0, 52.0)[2]
    halfway_ = towards + sun
    halfway_ /= np.linalg.norm(halfway_, axis=1, keepdims=True)
    shine = np.clip(np.einsum("ij,ij->i", halfway_, facing), 0.0, 1.0) ** 40 * 0.10
    lit = paint * (light + bounce)[:, None] + (shine * np.clip(light, 0, 1))[:, None]
    # A soft shoulder, so that bright colours keep their hue.
    return np.asarray(np.where(lit > 0.8, 0.8 + 0.2 * np.tanh((lit - 0.8) / 0.2), lit))


def png_bytes(image: Image) -> bytes:
    """An RGB picture as PNG.

    Parameters
    ----------
    image : (h, w, 3) uint8 array

    Returns
    -------
    bytes
    """
    height, width, _ = image.shape
    wide = image.astype(np.int16)
    # Each row is stored as its difference from the row above: small numbers, small file.
    rows = np.concatenate([wide[:1], np.diff(wide, axis=0)]).astype(np.uint8).reshape(height, -1)
    kind = np.full((height, 1), 2, dtype=np.uint8)
    data = zlib.compress(np.concatenate([kind, rows], axis=1).tobytes(), 9)

    def chunk(name: bytes, content: bytes) -> bytes:
        check = zlib.crc32(name + content)
        return struct.pack(">I", len(content)) + name + content + struct.pack(">I", check)

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        (
            chunk(b"IHDR", header),
            chunk(b"sRGB", b"\0"),
            chunk(b"IDAT", data),
            chunk(b"IEND", b""),
        )
    )
