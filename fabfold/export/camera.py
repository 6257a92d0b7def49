"""The camera of a picture: which way it looks, how near it stands, and where points appear."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import RecipeError

__all__ = ["PinholeCamera", "View", "camera_for", "direction_frame", "project"]

#: Height of the camera's field of view in degrees.
_FIELD_DEG = 24.0


@dataclass(frozen=True)
class View:
    """Where the camera stands and how the picture is made.

    Attributes
    ----------
    azimuth_deg : float
        Direction of the camera as seen from the model, in degrees about z: 0 is +x, 90 is +y.
    elevation_deg : float
        Height of the camera above the horizon, in degrees; z is up.
    size : (int, int)
        Width and height in pixels.
    margin : float
        Share of the picture left free at each side.
    samples : int
        Samples along each side of a pixel, 1 to 4.
    lights : int
        Number of lights of the sky; the sun takes half as many again.
    ground : bool
        Whether the model stands on a ground that takes its shadow.
    edges : float
        Strength of the lines along edges, 0 to 1.
    background : (int, int, int)
        Colour behind the model, sRGB bytes.
    """

    azimuth_deg: float = -60.0
    elevation_deg: float = 24.0
    size: tuple[int, int] = (1200, 900)
    margin: float = 0.06
    samples: int = 2
    lights: int = 16
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
class PinholeCamera:
    """Where a picture is taken from, in perspective.

    Attributes
    ----------
    eye : (3,) float64 array
        Place of the camera, in the unit of the model.
    frame : (3, 3) float64 array
        Rows: unit vectors to the picture's right, to its top, and from the model to the camera.
    focal : float
        Pixels across a length of 1 at distance 1.
    centre : (float, float)
        Pixel x and y on the camera's axis.
    """

    eye: NDArray[np.float64]
    frame: NDArray[np.float64]
    focal: float
    centre: tuple[float, float]


def direction_frame(azimuth_deg: float, elevation_deg: float) -> NDArray[np.float64]:
    """Frame of a plane that is seen from a direction.

    Parameters
    ----------
    azimuth_deg : float
        Direction to the viewer in degrees about z, from +x.
    elevation_deg : float
        Height of the viewer above the horizon in degrees.

    Returns
    -------
    (3, 3) float64 array
        Rows: unit vectors to the right, upwards, and to the viewer.
    """
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
) -> PinholeCamera:
    """Nearest camera in the view's direction that has all points inside the margins.

    Parameters
    ----------
    points : (n, 3) float64 array
        What the picture is to show.
    view : View
        Direction and margins.
    pixels : (int, int)
        Width and height of the picture in samples.
    distance : float or None
        Distance of the camera from the middle of the points, in their unit; the nearest that will
        do if None.

    Returns
    -------
    PinholeCamera
        Looks at the middle of the points.
    """
    frame = direction_frame(view.azimuth_deg, view.elevation_deg)
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
    return PinholeCamera(eye, frame, float(focal), (width / 2, height / 2))


def project(points: NDArray[np.float64], camera: PinholeCamera) -> NDArray[np.float64]:
    """Perspective projection of points.

    Parameters
    ----------
    points : (n, 3) float64 array
        Points in front of the camera.
    camera : PinholeCamera
        The camera.

    Returns
    -------
    (n, 3) float64 array
        Pixel x, pixel y and the inverse of the depth of each point.
    """
    seen = (points - camera.eye) @ camera.frame.T
    near = -1.0 / seen[:, 2]
    return np.column_stack(
        [
            camera.centre[0] + camera.focal * seen[:, 0] * near,
            camera.centre[1] - camera.focal * seen[:, 1] * near,
            near,
        ]
    )
