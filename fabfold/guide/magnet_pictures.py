"""Pictures of the parts that get magnets: where each goes, and which pole looks out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.export.camera import View, camera_for, project
from fabfold.export.render import Image, render
from fabfold.guide.fonts import font_file
from fabfold.guide.step_drawing import STAYING
from fabfold.joinery.bodies import Joinery
from fabfold.joinery.box_hold import Retention
from fabfold.joinery.cells import as_manifold
from fabfold.joinery.loose_pins import cylinder_between
from fabfold.joinery.magnets import MAGNETS

if TYPE_CHECKING:
    import manifold3d

__all__ = ["MAGNET_PIXELS", "POLES", "MagnetPicture", "magnet_pictures"]

Floats = NDArray[np.float64]

#: Size of a picture in pixels.
MAGNET_PIXELS = (300, 225)
#: What the colours and letters say.
POLES = (
    "Red, with an N: the north pole looks out of the part. Blue, with an S: the south pole looks "
    "out. Find out which pole is which with one magnet that is marked, and keep to it: then the "
    "parts hold together one way round."
)
#: Colours of a magnet whose north, and whose south pole looks out.
_COLOURS = ((205, 40, 40), (40, 80, 200))
#: A magnet is drawn this far out of its face, mm, and is seen where it looks so much to the eye.
_PROUD_MM, _FACING = 0.4, 0.3
#: Where the eye may stand: azimuth and height in degrees.
_VIEWS = tuple((float(a), float(e)) for e in (28, -28) for a in range(-60, 300, 90))


@dataclass(frozen=True)
class MagnetPicture:
    """A part with its magnets, from one side.

    Attributes
    ----------
    body : int
        Index of the body.
    image : (h, w, 3) uint8 array
        The picture.
    """

    body: int
    image: Image


@dataclass(frozen=True)
class _Spot:
    """Middle of the mouth, unit vector out of the part, and 0 for north or 1 for south out."""

    point: Floats
    out: Floats
    pole: int


def magnet_pictures(
    joinery: Joinery, retention: Retention | None, stand: NDArray[np.float64]
) -> list[MagnetPicture]:
    """Every part that gets magnets, from as many sides as it takes to see them all.

    Parameters
    ----------
    joinery : Joinery
        The printed bodies.
    retention : Retention or None
        The magnets.
    stand : (3, 3) float64 array
        Rotation from shape A's axes to how the kit lies on the table.

    Returns
    -------
    list of MagnetPicture
        By part; none without magnets.
    """
    if retention is None or not retention.pairs:
        return []
    spots: dict[int, list[_Spot]] = {}
    for pair in retention.pairs:
        for pole, (body, point, inward) in enumerate(
            zip(pair.bodies, pair.points_mm, pair.inwards, strict=True)
        ):
            spot = _Spot(stand @ np.array(point), -(stand @ np.array(inward)), pole)
            spots.setdefault(body, []).append(spot)
    radius = MAGNETS[retention.magnet].diameter_mm / 2
    pictures = []
    for body, there in sorted(spots.items()):
        mesh = joinery.bodies[body]
        turned = mesh.vertices @ stand.T
        solid = as_manifold(turned, mesh.faces, mesh.name)
        for view in _views_of(solid, there):
            seen = [spot for spot in there if _is_seen(solid, spot, view)]
            image = _picture((turned, mesh.faces), seen, radius, view)
            pictures.append(MagnetPicture(body, image))
    return pictures


def _views_of(solid: manifold3d.Manifold, spots: Sequence[_Spot]) -> list[tuple[float, float]]:
    """Views that show all that can be seen, the one that shows most first."""
    left, chosen = list(spots), []
    while left:
        shown = [sum(_is_seen(solid, spot, view) for spot in left) for view in _VIEWS]
        best = int(np.argmax(shown))
        if not shown[best]:
            break
        chosen.append(_VIEWS[best])
        left = [spot for spot in left if not _is_seen(solid, spot, chosen[-1])]
    return chosen or [_VIEWS[0]]


def _is_seen(solid: manifold3d.Manifold, spot: _Spot, view: tuple[float, float]) -> bool:
    azimuth, height = np.radians(view)
    eye = np.array(
        [np.cos(height) * np.cos(azimuth), np.cos(height) * np.sin(azimuth), np.sin(height)]
    )
    if float(spot.out @ eye) < _FACING:
        return False
    start = spot.point + _PROUD_MM * spot.out
    return not solid.ray_cast(tuple(start), tuple(start + 1e4 * eye))


def _picture(
    mesh: tuple[Floats, NDArray[np.int32]],
    spots: Sequence[_Spot],
    radius: float,
    view: tuple[float, float],
) -> Image:
    """The part with its magnets as discs, a letter on each."""
    from PIL import Image as PillowImage
    from PIL import ImageDraw, ImageFont

    meshes, colours = [mesh], [STAYING]
    for spot in spots:
        top = spot.point + _PROUD_MM * spot.out
        made = cylinder_between(spot.point - spot.out, top, radius, outside=False).to_mesh64()
        corners = np.asarray(made.vert_properties, dtype=np.float64)[:, :3]
        meshes.append((corners, np.asarray(made.tri_verts, dtype=np.int32)))
        colours.append(_COLOURS[spot.pole])
    look = View(*view, size=MAGNET_PIXELS, lights=3, ground=False, margin=0.05)
    image = render(meshes, np.array(colours, dtype=np.uint8), None, look)
    camera = camera_for(np.concatenate([points for points, _ in meshes]), look, MAGNET_PIXELS, None)
    sheet = PillowImage.fromarray(image)
    draw = ImageDraw.Draw(sheet)
    font = ImageFont.truetype(str(font_file(bold=True)), 14)
    for spot in spots:
        x, y = project((spot.point + _PROUD_MM * spot.out)[None], camera)[0, :2]
        draw.text(
            (float(x), float(y)), "NS"[spot.pole], font=font, anchor="mm", fill=(255, 255, 255),
            stroke_width=2, stroke_fill=_COLOURS[spot.pole],
        )  # fmt: skip
    return np.asarray(sheet)
