"""Pictures of models and kits, drawn in software: no display, no graphics driver, no network.

A small rasteriser with soft light: an overcast sky and a low sun are many distant lights, each
with its own shadow map, so that corners darken, gaps between bodies show, and the kit stands on a
ground that takes its shadow. The same input gives the same bytes.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import RecipeError
from fabfold.export.colours import body_colours
from fabfold.export.shading import corner_normals
from fabfold.files import write_bytes
from fabfold.fold.model import Motion
from fabfold.joinery.model import Joinery
from fabfold.lattice import ROTATIONS
from fabfold.solid.model import Solid
from fabfold.tree.model import FoldTree

__all__ = [
    "View",
    "halfway",
    "picture_of_kit",
    "picture_of_solid",
    "png_bytes",
    "render",
    "strip",
    "write_strip",
]

Image = NDArray[np.uint8]
Mesh = tuple[NDArray[np.floating], NDArray[np.int32]]

_MODEL_COLOUR = (0x8F, 0xA9, 0xC4)
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
    lights: int = 48
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
class _Camera:
    """`frame` has rows right, up and towards the camera; `eye` is its place."""

    eye: NDArray[np.float64]
    frame: NDArray[np.float64]
    focal: float
    centre: tuple[float, float]


def _linear(colour: NDArray[np.generic] | Sequence[int]) -> NDArray[np.float64]:
    unit = np.asarray(colour, dtype=float) / 255.0
    return np.asarray(np.where(unit <= 0.04045, unit / 12.92, ((unit + 0.055) / 1.055) ** 2.4))


def _srgb(light: NDArray[np.floating]) -> Image:
    unit = np.clip(light, 0.0, 1.0)
    curved = np.where(unit <= 0.0031308, unit * 12.92, 1.055 * unit ** (1 / 2.4) - 0.055)
    return np.asarray(np.rint(curved * 255.0), dtype=np.uint8)


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


def _camera(
    points: NDArray[np.float64], view: View, pixels: tuple[int, int], distance: float | None
) -> _Camera:
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
    return _Camera(eye, frame, float(focal), (width / 2, height / 2))


def _project(points: NDArray[np.float64], camera: _Camera) -> NDArray[np.float64]:
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


@dataclass(frozen=True)
class _Scene:
    """What casts shadows, and the side of a shadow map in texels."""

    vertices: NDArray[np.float64]
    corners: NDArray[np.int32]
    view: View
    resolution: int

    def at(self, points: NDArray[np.float32], normals: NDArray[np.float32]) -> NDArray[np.float32]:
        """Light that falls on each point, about 1 on an open floor."""
        from fabfold.export.raster import cast_light, fill_depth

        light = np.zeros(len(points), dtype=np.float32)
        for direction, strength in _lights(self.view.lights, self.view.azimuth_deg):
            azimuth = np.degrees(np.arctan2(direction[1], direction[0]))
            frame = _frame(float(azimuth), float(np.degrees(np.arcsin(direction[2]))))
            placed = self.vertices @ frame.T
            low, high = placed.min(axis=0), placed.max(axis=0)
            scale = (self.resolution - 4) / float(max(high[0] - low[0], high[1] - low[1]))
            offset = low[:2] - 2.0 / scale
            flat = np.column_stack([(placed[:, :2] - offset) * scale, placed[:, 2]])
            depth = fill_depth(flat, self.corners, self.resolution)
            cast_light(
                light, points, normals, depth, frame, offset, scale, 1.0 / scale, strength, 1.2
            )
        return light


def _shadow(
    vertices: NDArray[np.float64], camera: _Camera, scene: _Scene, view: View
) -> NDArray[np.float32]:
    """How much of the background's light is left at each pixel of a floor under the model."""
    width, height = view.size
    right, up, away = camera.frame
    across, down = np.arange(width) + 0.5, np.arange(height) + 0.5
    x = (across * view.samples - camera.centre[0]) / camera.focal
    y = (camera.centre[1] - down * view.samples) / camera.focal
    rays = x[None, :, None] * right + y[:, None, None] * up - away
    drop = vertices[:, 2].min() - camera.eye[2]
    falls = rays[..., 2] < -1e-6
    places = (
        camera.eye
        + rays * np.where(falls, drop / np.where(falls, rays[..., 2], -1.0), 0)[..., None]
    )
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    size = 2.5 * float((high - low).max())
    apart = np.hypot(*(places - (low + high) / 2)[..., :2].transpose(2, 0, 1))
    falls &= apart < size
    ground = places[falls].astype(np.float32)
    straight = np.tile(np.array([0, 0, 1], dtype=np.float32), (len(ground), 1))
    open_sky = sum(
        strength * light[2] for light, strength in _lights(view.lights, view.azimuth_deg)
    )
    shade = np.clip(scene.at(ground, straight) / open_sky, 0.0, 1.0)
    # The shadow fades with distance and towards the rim, so that pictures stand beside each other.
    rim = np.minimum(
        np.minimum(across, width - across)[None, :], np.minimum(down, height - down)[:, None]
    )
    fade = np.sqrt(1.0 - apart[falls] / size) * np.clip(rim[falls] / (0.12 * height), 0, 1)
    left = np.ones((height, width), dtype=np.float32)
    left[falls] = 1.0 - 0.75 * fade * (1.0 - shade)
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
    camera = _camera(vertices, view, pixels, distance)
    screen = _project(vertices, camera)
    near, triangle = fill_triangles(screen, corners, *pixels)
    points, facing = surface_points(triangle, screen, corners, vertices, normals)
    covered = triangle >= 0
    light = np.zeros(triangle.shape, dtype=np.float32)
    resolution = int(np.clip(max(pixels) * 0.6, 256, 1400))
    lit = _Scene(vertices, corners, view, resolution)
    light[covered] = lit.at(points[covered], facing[covered])
    image = np.empty((*triangle.shape, 3), dtype=np.float32)
    image[:] = _linear(view.background)
    if view.ground and view.elevation_deg > 0:
        image *= np.repeat(
            np.repeat(_shadow(vertices, camera, lit, view), samples, axis=0), samples, axis=1
        )[..., None]
    paint = _linear(colours)[owner]
    image[covered] = _painted(
        paint[triangle[covered]], light[covered], points[covered], facing[covered], camera, view
    )
    lines = _lines(triangle, near, facing * covered[..., None], owner)
    image *= (1.0 - view.edges * lines)[..., None]
    height, width = view.size[1], view.size[0]
    return _srgb(image.reshape(height, samples, width, samples, 3).mean(axis=(1, 3)))


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
    camera: _Camera,
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


def picture_of_solid(
    solid: Solid,
    view: View | None = None,
    *,
    colour: tuple[int, int, int] = _MODEL_COLOUR,
) -> Image:
    """Draw a model as it came in.

    Parameters
    ----------
    solid : Solid
    view : View, optional
    colour : (int, int, int)
        sRGB.

    Returns
    -------
    (height, width, 3) uint8 array
    """
    return render([(solid.vertices, solid.faces)], np.array([colour], dtype=np.uint8), None, view)


def _poses_mm(
    joinery: Joinery,
    tree: FoldTree,
    angles_deg: NDArray[np.float64],
    upright: NDArray[np.float64] | None,
) -> NDArray[np.float64]:
    to_mm = np.eye(4)
    to_mm[:3, :3] *= joinery.voxel_mm
    to_mm[:3, 3] = joinery.origin_mm
    poses = to_mm @ tree.body_poses(angles_deg) @ np.linalg.inv(to_mm)
    if upright is not None:
        turn = np.eye(4)
        turn[:3, :3] = upright
        poses = turn @ poses
    return np.asarray(poses)


def picture_of_kit(
    joinery: Joinery,
    tree: FoldTree,
    angles_deg: NDArray[np.float64] | None = None,
    view: View | None = None,
    *,
    colours: NDArray[np.uint8] | None = None,
    upright: NDArray[np.float64] | None = None,
    distance: float | None = None,
) -> Image:
    """Draw a kit in any state of its motion.

    Parameters
    ----------
    joinery : Joinery
    tree : FoldTree
    angles_deg : (h,) float64 array, optional
        Angle of every hinge; shape A by default.
    view : View, optional
    colours : (b, 3) uint8 array, optional
        sRGB, one a body; by default :func:`~fabfold.export.colours.body_colours`.
    upright : (3, 3) float64 array, optional
        Rotation from shape A's axes to the picture's, whose z is up: ``voxels.rotation.T`` shows
        the model as it came in.
    distance : float, optional
        See :func:`render`, mm.

    Returns
    -------
    (height, width, 3) uint8 array
    """
    angles = np.zeros(len(tree.hinges)) if angles_deg is None else angles_deg
    return render(
        [(body.vertices, body.faces) for body in joinery.bodies],
        body_colours(tree) if colours is None else colours,
        _poses_mm(joinery, tree, angles, upright),
        view,
        distance=distance,
    )


def halfway(motion: Motion) -> NDArray[np.float64]:
    """Angles when half of all turning is done, shape (h,)."""
    turns = np.abs(np.diff(motion.angles_deg, axis=0)).sum(axis=1)
    done = np.concatenate([[0.0], np.cumsum(turns)])
    if done[-1] <= 0.0:
        return np.asarray(motion.angles_deg[0])
    move = int(np.searchsorted(done, done[-1] / 2, side="right")) - 1
    move = min(move, len(turns) - 1)
    share = (done[-1] / 2 - done[move]) / turns[move]
    return np.asarray(
        motion.angles_deg[move] + share * (motion.angles_deg[move + 1] - motion.angles_deg[move])
    )


def _nearest_lattice(rotation: NDArray[np.float64]) -> NDArray[np.float64]:
    """The lattice rotation that turns least from a rotation."""
    traces = np.einsum("rij,ij->r", ROTATIONS, rotation)
    return np.asarray(ROTATIONS[int(np.round(traces, 9).argmax())], dtype=np.float64)


def _reach(points: NDArray[np.float64], view: View) -> float:
    """Distance from which points fill the height of a picture."""
    tall = replace(view, size=(8192, 64))
    camera = _camera(points, tall, tall.size, None)
    z = points @ camera.frame[2]
    return float(camera.eye @ camera.frame[2] - (z.max() + z.min()) / 2)


def _width(points: NDArray[np.float64], view: View, distance: float) -> int:
    """Pixels that points take across, with the margins, from a distance."""
    wide = replace(view, size=(8192, view.size[1]))
    screen = _project(points, _camera(points, wide, wide.size, distance))
    room = 2 * view.margin * view.size[1]
    return int(np.clip(np.ceil(np.ptp(screen[:, 0]) + room), 64, 8192))


def strip(
    joinery: Joinery,
    tree: FoldTree,
    motion: Motion,
    view: View | None = None,
    *,
    colours: NDArray[np.uint8] | None = None,
    upright: NDArray[np.float64] | None = None,
) -> Image:
    """Shape A, the kit half-way, and shape B side by side, at one scale.

    Parameters
    ----------
    joinery : Joinery
    tree : FoldTree
    motion : Motion
    view : View, optional
        The height of its size is the strip's; each part is as wide as it needs.
    colours : (b, 3) uint8 array, optional
    upright : (3, 3) float64 array, optional
        See :func:`picture_of_kit`. After A the nearest rotation along the lattice is taken, so
        that the box stands straight.

    Returns
    -------
    (height, width, 3) uint8 array
    """
    view = view or View(size=(560, 560))
    stand = None if upright is None else _nearest_lattice(upright)
    states = [
        (motion.angles_deg[0], upright),
        (halfway(motion), stand),
        (motion.angles_deg[-1], stand),
    ]
    clouds = []
    for angles, turn in states:
        poses = _poses_mm(joinery, tree, angles, turn)
        clouds.append(
            np.concatenate(
                [
                    body.vertices @ pose[:3, :3].T + pose[:3, 3]
                    for body, pose in zip(joinery.bodies, poses, strict=True)
                ]
            )
        )
    distance = max(_reach(cloud, view) for cloud in clouds)
    pictures = []
    for (angles, turn), cloud in zip(states, clouds, strict=True):
        part = replace(view, size=(_width(cloud, view, distance), view.size[1]))
        pictures.append(
            picture_of_kit(
                joinery, tree, angles, part, colours=colours, upright=turn, distance=distance
            )
        )
    return np.concatenate(pictures, axis=1)


def write_strip(
    path: Path,
    joinery: Joinery,
    tree: FoldTree,
    motion: Motion,
    view: View | None = None,
    *,
    colours: NDArray[np.uint8] | None = None,
    upright: NDArray[np.float64] | None = None,
) -> None:
    """Write :func:`strip` as a PNG file."""
    image = strip(joinery, tree, motion, view, colours=colours, upright=upright)
    write_bytes(path, png_bytes(image))


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
