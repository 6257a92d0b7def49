"""Parts of a model that somebody points at: boxes, spheres, painted faces, and sides.

A region is written ``box(x0,y0,z0,x1,y1,z1)``, ``sphere(x,y,z,r)``, ``painted`` or
``painted(#rrggbb)``. Numbers are in the model's own units and axes; a number with ``%`` is a share
of the model's extent along its axis, counted from its lower corner, and of its longest side for a
radius. A side is ``front``, ``back``, ``left``, ``right``, ``bottom`` or ``top`` (the model's -y,
+y, -x, +x, -z, +z), or such an axis itself.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import RecipeError
from fabfold.lattice.rotations import FACES
from fabfold.solid.closed_solid import Solid

if TYPE_CHECKING:
    pass

__all__ = [
    "Area",
    "Region",
    "Shape",
    "area_of",
    "face_named",
    "parse_keep",
    "parse_shape",
    "region_of",
]

Points = NDArray[np.float64]

#: Sides by name, as indices of :data:`fabfold.lattice.rotations.FACES`.
_SIDES = {
    "right": 0, "left": 1, "back": 2, "front": 3, "top": 4, "bottom": 5,
    "+x": 0, "-x": 1, "+y": 2, "-y": 3, "+z": 4, "-z": 5,
}  # fmt: skip
#: Samples along the longest side of a region, and of a model seen from one side.
_REGION_STEPS = 40
_VIEW_STEPS = 160
#: Pieces of a region with less than this share of its material are no pieces of their own.
CRUMB = 0.01
#: Most of the samples of painted faces along the model's longest side.
_PAINT_STEPS = 400

_SHAPE = re.compile(r"(box|sphere|painted)\s*(?:\(([^()]*)\))?")
_NUMBER = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(%?)")


@dataclass(frozen=True)
class Shape:
    """A region as it is written.

    Attributes
    ----------
    text : str
        What was written.
    kind : str
        ``"box"``, ``"sphere"`` or ``"painted"``.
    numbers : tuple of (float, bool)
        Each number, and whether it is a percentage.
    colour : (int, int, int) or None
        sRGB of painted faces; None for any colour.
    """

    text: str
    kind: str
    numbers: tuple[tuple[float, bool], ...] = ()
    colour: tuple[int, int, int] | None = None

    def placed(self, bounds: Points) -> NDArray[np.float64]:
        """The numbers in model units, given the model's bounds (2, 3)."""
        extent = bounds[1] - bounds[0]
        out = []
        for place, (number, share) in enumerate(self.numbers):
            if not share:
                out.append(number)
            elif self.kind == "sphere" and place == 3:
                out.append(number / 100 * float(extent.max()))
            else:
                axis = place % 3
                out.append(float(bounds[0, axis] + number / 100 * extent[axis]))
        return np.array(out)

    def holds(self, points: Points, bounds: Points) -> NDArray[np.bool_]:
        """Which of the points (k, 3) lie in a box or a sphere."""
        numbers = self.placed(bounds)
        if self.kind == "sphere":
            return np.asarray(np.linalg.norm(points - numbers[:3], axis=1) <= numbers[3])
        corners = numbers.reshape(2, 3)
        low, high = corners.min(axis=0), corners.max(axis=0)
        return np.asarray(((points >= low) & (points <= high)).all(axis=1))

    def hull(self, bounds: Points) -> Points:
        """Box around a box or a sphere, (2, 3)."""
        numbers = self.placed(bounds)
        if self.kind == "sphere":
            return np.array([numbers[:3] - numbers[3], numbers[:3] + numbers[3]])
        corners = numbers.reshape(2, 3)
        return np.array([corners.min(axis=0), corners.max(axis=0)])


def face_named(text: str, option: str) -> int:
    """Index in :data:`fabfold.lattice.rotations.FACES` of a side or an axis by its name.

    Raises
    ------
    RecipeError
        If there is no such side.
    """
    name = text.strip().lower()
    if name not in _SIDES:
        raise RecipeError(
            f"{option}: no side is called {text.strip()!r}; there are {', '.join(_SIDES)}"
        )
    return _SIDES[name]


def parse_keep(text: str, option: str) -> tuple[Shape | int, int]:
    """Read ``WHAT:SIDE``: a side or region of the model, and a side of the box.

    Raises
    ------
    RecipeError
        Saying what is wrong with the text.
    """
    what, colon, side = text.rpartition(":")
    if not colon:
        raise RecipeError(
            f"{option}: wants what to keep and where, such as front:+x, found {text!r}"
        )
    target = face_named(side, option)
    if what.strip().lower() in _SIDES:
        return face_named(what, option), target
    if "(" not in what and what.strip().lower() != "painted":
        raise RecipeError(
            f"{option}: {what.strip()!r} is neither a side of the model "
            f"({', '.join(_SIDES)}) nor a region such as box(x0,y0,z0,x1,y1,z1)"
        )
    return parse_shape(what, option), target


def parse_shape(text: str, option: str) -> Shape:
    """Read a region.

    Raises
    ------
    RecipeError
        Saying what is wrong with the text.
    """
    match = _SHAPE.fullmatch(text.strip().lower())
    if match is None:
        raise RecipeError(
            f"{option}: cannot read {text!r}; a region is box(x0,y0,z0,x1,y1,z1), "
            "sphere(x,y,z,r), painted or painted(#rrggbb)"
        )
    kind, inner = match.group(1), match.group(2)
    if kind == "painted":
        return Shape(text, kind, colour=None if inner is None else _colour(inner, option))
    wanted = {"box": 6, "sphere": 4}[kind]
    parts = [] if inner is None else [part.strip() for part in inner.split(",")]
    numbers = [_NUMBER.fullmatch(part) for part in parts]
    if len(parts) != wanted or not all(numbers):
        raise RecipeError(
            f"{option}: {kind} wants {wanted} numbers, in model units or with % of the model's "
            f"extent, found {text!r}"
        )
    read = tuple((float(n.group(1)), n.group(2) == "%") for n in numbers if n is not None)
    if kind == "sphere" and read[3][0] <= 0:
        raise RecipeError(f"{option}: the radius of {text!r} must be greater than 0")
    return Shape(text, kind, read)


def _colour(text: str, option: str) -> tuple[int, int, int]:
    match = re.fullmatch(r"#?([0-9a-f]{2})([0-9a-f]{2})([0-9a-f]{2})", text.strip())
    if match is None:
        raise RecipeError(f"{option}: a colour is written #rrggbb, found {text!r}")
    red, green, blue = (int(part, 16) for part in match.groups())
    return (red, green, blue)


@dataclass(frozen=True)
class Region:
    """A region of a model, sampled.

    Attributes
    ----------
    text : str
        As it was written.
    pieces : tuple of (k, 3) float64 arrays
        Sample points, model units: of the material in a box or a sphere, or of painted faces;
        one array for each piece that hangs together within the region.
    """

    text: str
    pieces: tuple[Points, ...]


@dataclass(frozen=True)
class Area:
    """A part of the model's surface, sampled.

    Attributes
    ----------
    points : (k, 3) float64 array
        Just inside the material, model units.
    outward : (k, 3) float64 array
        Which way each sample shall be seen from, model axes, unit length.
    weight : (k,) float64 array
        Area of each sample, square model units.
    """

    points: Points
    outward: Points
    weight: NDArray[np.float64]


def _material(
    solid: Solid, low: Points, step: float, shape: NDArray[np.int64]
) -> NDArray[np.bool_]:
    from fabfold.solid.scan import occupancy

    x, y, z = shape.tolist()
    vertices = (np.asarray(solid.vertices, dtype=np.float64) - low) / step
    return np.asarray(occupancy(vertices, np.asarray(solid.faces, dtype=np.int32), (x, y, z)))


def _nothing_there(shape: Shape, bounds: Points, option: str) -> RecipeError:
    low, high = (", ".join(f"{value:.4g}" for value in corner) for corner in bounds)
    return RecipeError(
        f"{option} {shape.text}: there is no material of the model in it; the model reaches from "
        f"({low}) to ({high}) in its own units"
    )


def region_of(solid: Solid, shape: Shape, option: str = "--protect") -> Region:
    """Sample a region of a model.

    Raises
    ------
    RecipeError
        If the region does not touch the model, or the model has no such paint.
    """
    if shape.kind == "painted":
        return Region(shape.text, _painted_pieces(solid, shape, option))
    from scipy import ndimage

    bounds = solid.bounds
    hull = shape.hull(bounds)
    low, high = np.maximum(hull[0], bounds[0]), np.minimum(hull[1], bounds[1])
    if not (high > low).all():
        raise _nothing_there(shape, bounds, option)
    step = float((high - low).max()) / _REGION_STEPS
    # A wall much thinner than the region must not fall between the samples.
    step = min(step, float((bounds[1] - bounds[0]).max()) / _VIEW_STEPS)
    step = max(step, float(np.cbrt(np.prod(high - low) / 4_000_000)))
    size = np.ceil((high - low) / step).astype(np.int64)
    material = _material(solid, low, step, size)
    middles = low + step * (np.argwhere(material) + 0.5)
    inside = shape.holds(middles, bounds)
    material[tuple(np.argwhere(material)[~inside].T)] = False
    if not material.any():
        raise _nothing_there(shape, bounds, option)
    labels, count = ndimage.label(material)
    sizes = np.bincount(labels.ravel(), minlength=count + 1)
    sizes[0] = 0
    pieces = tuple(
        low + step * (np.argwhere(labels == piece) + 0.5)
        for piece in np.argsort(-sizes, kind="stable")[:count].tolist()
        if sizes[piece] >= CRUMB * sizes.sum()
    )
    return Region(shape.text, pieces)


def _painted(solid: Solid, shape: Shape, option: str) -> Points:
    """Corners of the painted triangles of a colour, (k, 3, 3)."""
    paint = solid.paint
    if paint is None:
        raise RecipeError(
            f"{option} {shape.text}: no face of the model is painted; colours are read from PLY, "
            "OBJ, GLB and 3MF files, faces in another colour than most of the surface count"
        )
    if shape.colour is None:
        return paint.corners
    near = np.abs(paint.colours.astype(int) - np.array(shape.colour)).max(axis=1) <= 8
    if not near.any():
        known, times = np.unique(paint.colours, axis=0, return_counts=True)
        most = known[np.argsort(-times, kind="stable")[:6]]
        names = ", ".join("#{:02x}{:02x}{:02x}".format(*colour) for colour in most.tolist())
        raise RecipeError(f"{option} {shape.text}: no face has this colour; there are {names}")
    return np.asarray(paint.corners[near])


def _samples(corners: Points, step: float) -> tuple[Points, Points, NDArray[np.float64]]:
    """Points about `step` apart on triangles, the triangles' normals and the area of each."""
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    parts = np.clip(np.ceil(edges / step), 1, 400).astype(int)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    twice = np.linalg.norm(cross, axis=1)
    normal = cross / np.maximum(twice, 1e-300)[:, None]
    points, normals, weight = [], [], []
    for count in np.unique(parts).tolist():
        these = np.flatnonzero(parts == count)
        # Middles of the small triangles into which a triangle of `count` parts a side falls.
        i, j = np.meshgrid(np.arange(count), np.arange(count), indexing="ij")
        up = np.stack([i + 1 / 3, j + 1 / 3], axis=-1)[i + j < count]
        down = np.stack([i + 2 / 3, j + 2 / 3], axis=-1)[i + j < count - 1]
        share = np.concatenate([up, down]) / count
        a, b, c = corners[these, 0], corners[these, 1], corners[these, 2]
        here = (
            a[:, None]
            + share[None, :, :1] * (b - a)[:, None]
            + share[None, :, 1:] * (c - a)[:, None]
        )
        points.append(here.reshape(-1, 3))
        normals.append(np.repeat(normal[these], len(share), axis=0))
        weight.append(np.repeat(twice[these] / 2 / count**2, len(share)))
    return np.concatenate(points), np.concatenate(normals), np.concatenate(weight)


def _painted_pieces(solid: Solid, shape: Shape, option: str) -> tuple[Points, ...]:
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    corners = _painted(solid, shape, option)
    extent = float((solid.bounds[1] - solid.bounds[0]).max())
    # Triangles that share a corner are one piece; files may store the corner more than once.
    keys = np.rint(corners.reshape(-1, 3) / (1e-6 * extent)).astype(np.int64)
    corner = np.unique(keys, axis=0, return_inverse=True)[1].reshape(-1, 3)
    ends = np.stack([corner[:, [0, 1]], corner[:, [1, 2]]]).reshape(-1, 2)
    size = int(corner.max()) + 1
    graph = coo_array((np.ones(len(ends), dtype=np.int8), tuple(ends.T)), shape=(size, size))
    label = connected_components(graph, directed=False)[1][corner[:, 0]]
    areas = np.bincount(
        label,
        np.linalg.norm(
            np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
        ),
    )
    pieces = []
    for piece in np.argsort(-areas, kind="stable").tolist():
        if areas[piece] >= CRUMB * areas.sum():
            points, normals, _ = _samples(corners[label == piece], extent / _PAINT_STEPS)
            pieces.append(points - 1e-3 * extent * normals)
    return tuple(pieces)


def area_of(solid: Solid, shape: Shape | int, option: str = "--keep") -> Area:
    """Sample the surface of a model that is seen from a side, or that lies in a region.

    Parameters
    ----------
    solid : Solid
    shape : Shape or int
        A region, or a side as an index of :data:`fabfold.lattice.rotations.FACES`.

    Raises
    ------
    RecipeError
        If the region has none of the model's surface.
    """
    if isinstance(shape, int):
        return _seen_from(solid, shape)
    bounds = solid.bounds
    extent = float((bounds[1] - bounds[0]).max())
    if shape.kind == "painted":
        points, normals, weight = _samples(_painted(solid, shape, option), extent / _VIEW_STEPS)
    else:
        corners = np.asarray(solid.vertices)[solid.faces]
        points, normals, weight = _samples(corners, extent / _VIEW_STEPS)
        inside = shape.holds(points, bounds)
        if not inside.any():
            raise _nothing_there(shape, bounds, option)
        points, normals, weight = points[inside], normals[inside], weight[inside]
    return Area(points - 1e-3 * extent * normals, normals, weight)


def _seen_from(solid: Solid, side: int) -> Area:
    """What a look along an axis of the model meets first."""
    bounds = solid.bounds
    extent = bounds[1] - bounds[0]
    step = float(extent.max()) / _VIEW_STEPS
    size = np.maximum(np.ceil(extent / step).astype(np.int64), 1)
    low = bounds[0] - (size * step - extent) / 2
    material = _material(solid, low, step, size)
    axis = side >> 1
    looked = np.flip(material, axis=axis) if side % 2 == 0 else material
    hit = looked.any(axis=axis)
    first = looked.argmax(axis=axis)
    if side % 2 == 0:
        first = int(size[axis]) - 1 - first
    at = np.argwhere(hit)
    cells = np.insert(at, axis, first[hit], axis=1)
    return Area(
        low + step * (cells + 0.5),
        np.tile(FACES[side].astype(float), (len(cells), 1)),
        np.full(len(cells), step**2),
    )
