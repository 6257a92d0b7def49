"""The light of a picture: an overcast sky and a low sun as many distant lights with shadow maps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fabfold.export.camera import PinholeCamera, View, direction_frame

__all__ = ["ShadowFloor", "light_at", "sun_frame"]


def sun_frame(azimuth_deg: float) -> NDArray[np.float64]:
    """Frame of the sun, which stands over the camera's left shoulder.

    Parameters
    ----------
    azimuth_deg : float
        Direction of the camera in degrees, see :class:`~fabfold.export.camera.View`.

    Returns
    -------
    (3, 3) float64 array
        Rows: two directions across, and the direction to the middle of the sun.
    """
    return direction_frame(azimuth_deg - 48.0, 52.0)


def _lights(count: int, azimuth_deg: float) -> list[tuple[NDArray[np.float64], float]]:
    """Directions and strengths of the lights of the sky, evenly spread, and of a soft sun."""
    lights = []
    turn = np.pi * (3.0 - np.sqrt(5.0))  # the golden angle
    for i in range(count):
        height = 0.06 + 0.94 * (i + 0.5) / count
        across = np.sqrt(1.0 - height * height)
        lights.append(
            (np.array([across * np.cos(i * turn), across * np.sin(i * turn), height]), 1.0)
        )
    total = sum(direction[2] for direction, _ in lights)
    lights = [(direction, 0.62 / total) for direction, _ in lights]
    suns = max(4, count // 2)
    frame = sun_frame(azimuth_deg)
    for i in range(suns):
        spread = 0.16 * np.sqrt((i + 0.5) / suns)
        offset = spread * (np.cos(i * turn) * frame[0] + np.sin(i * turn) * frame[1])
        direction = frame[2] + offset
        lights.append((direction / np.linalg.norm(direction), 0.78 / suns))
    return lights


def light_at(
    points: NDArray[np.float32],
    normals: NDArray[np.float32],
    vertices: NDArray[np.float64],
    corners: NDArray[np.int32],
    view: View,
) -> NDArray[np.float32]:
    """Light that falls on each point of a scene, with the shadows of all lights.

    Parameters
    ----------
    points : (n, 3) float32 array
        Points of surfaces.
    normals : (n, 3) float32 array
        Unit normals there.
    vertices : (v, 3) float64 array
        Vertices of what casts shadows.
    corners : (f, 3) int32 array
        Its triangles as indices into `vertices`.
    view : View
        Direction of the camera, and number of lights.

    Returns
    -------
    (n,) float32 array
        Linear light, about 1 on an open floor.
    """
    from fabfold.export.raster import cast_light, fill_depth

    texels = int(np.clip(max(view.size) * view.samples * 0.5, 256, 1000))
    light = np.zeros(len(points), dtype=np.float32)
    for direction, strength in _lights(view.lights, view.azimuth_deg):
        azimuth = np.degrees(np.arctan2(direction[1], direction[0]))
        frame = direction_frame(float(azimuth), float(np.degrees(np.arcsin(direction[2]))))
        placed = vertices @ frame.T
        low, high = placed.min(axis=0), placed.max(axis=0)
        scale = (texels - 4) / float(max(high[0] - low[0], high[1] - low[1]))
        offset = low[:2] - 2.0 / scale
        placed[:, :2] = (placed[:, :2] - offset) * scale
        depth = fill_depth(placed, corners, texels)
        lift = 1.0 / scale
        cast_light(light, points, normals, depth, frame, offset, scale, lift, strength, 1.2)
    return light


class ShadowFloor:
    """The floor under a model, which shows nothing but the model's shadow.

    Its shadows are soft, so the light is found for every second pixel along both sides.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        Vertices of the model.
    camera : PinholeCamera
        The camera of the picture.
    view : View
        Size of the picture, and whether there is a floor.

    Attributes
    ----------
    points : (n, 3) float32 array
        Points of the floor where the light is wanted: one for each square of two by two pixels
        that look at it.
    normals : (n, 3) float32 array
        Unit normals there: upwards.
    """

    def __init__(self, vertices: NDArray[np.float64], camera: PinholeCamera, view: View) -> None:
        width, height = view.size
        right, up, away = camera.frame
        self._size = (height, width)
        across, down = (np.arange((side + 1) // 2) * 2.0 + 1.0 for side in (width, height))
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

    def darkened(self, light: NDArray[np.float32]) -> NDArray[np.float32]:
        """Share of the background's light that the shadow leaves at each pixel.

        Parameters
        ----------
        light : (n,) float32 array
            Light at `points`, from :func:`light_at`.

        Returns
        -------
        (height, width) float32 array
            1 where no shadow falls.
        """
        shade = np.clip(light / self._open, 0.0, 1.0)
        left = np.ones(self._seen.shape, dtype=np.float32)
        left[self._seen] = 1.0 - 0.75 * self._fade * (1.0 - shade)
        return _twice_as_fine(left)[: self._size[0], : self._size[1]]


def _twice_as_fine(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Values at twice as many places along both axes, linear in between."""
    for axis in (0, 1):
        each = np.repeat(values, 2, axis=axis)
        around = np.pad(each, [(1, 1) if a == axis else (0, 0) for a in (0, 1)], mode="edge")
        before, after = np.split(around, [2], axis=axis)[1], np.split(around, [-2], axis=axis)[0]
        values = (before + 2.0 * each + after) / np.float32(4.0)
    return values
