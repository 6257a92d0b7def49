"""Regions and sides of a model by name: boxes, spheres, painted faces, front, top and so on.

A region is written ``box(x0,y0,z0,x1,y1,z1)``, ``sphere(x,y,z,r)``, ``painted`` or
``painted(#rrggbb)``. Numbers are in the model's own units and axes; a number with ``%`` is a share
of the model's extent along its axis, counted from its lower corner, and of its longest side for a
radius. A side is ``front``, ``back``, ``left``, ``right``, ``bottom`` or ``top`` (the model's -y,
+y, -x, +x, -z, +z), or such an axis itself.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import RecipeError
from fabfold.lattice.rotations import FACES
from fabfold.meshes import face_areas, face_normals
from fabfold.solid.closed_solid import Solid
from fabfold.solid.paint import SAME_COLOUR
from fabfold.srgb import colour_of_hex, hex_of_colour

__all__ = [
    "Region",
    "RegionText",
    "SurfaceSamples",
    "parse_keep",
    "parse_region",
    "parse_side",
    "sample_region",
    "sample_surface",
]

#: Coordinates, shape (k, 3).
Points = NDArray[np.float64]

#: Sides by name, as indices of :data:`fabfold.lattice.rotations.FACES`.
_SIDES = {
    "right": 0, "left": 1, "back": 2, "front": 3, "top": 4, "bottom": 5,
    "+x": 0, "-x": 1, "+y": 2, "-y": 3, "+z": 4, "-z": 5,
}  # fmt: skip
#: Samples along the longest side of a region, and of a model seen from one side.
_REGION_STEPS = 40
_VIEW_STEPS = 160
#: Pieces of a region with less than this share of its material are left out.
MIN_PIECE_SHARE = 0.01
#: Most of the samples of painted faces along the model's longest side.
_PAINT_STEPS = 400

_SHAPE = re.compile(r"(box|sphere|painted)\s*(?:\(([^()]*)\))?")
_NUMBER = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(%?)")


@dataclass(frozen=True)
class RegionText:
    """A region as it is written; its numbers may be shares of a model not yet known.

    Attributes
    ----------
    text : str
        What was written.
    kind : str
        ``"box"``, ``"sphere"`` or ``"painted"``.
    numbers : tuple of (float, bool)
        Each number, in model units or per cent, and whether it is per cent.
    colour : (int, int, int) or None
        sRGB of painted faces; None for any colour.
    """

    text: str
    kind: str
    numbers: tuple[tuple[float, bool], ...] = ()
    colour: tuple[int, int, int] | None = None

    def in_model_units(self, bounds: Points) -> NDArray[np.float64]:
        """The numbers of a box or a sphere, percentages worked out.

        Parameters
        ----------
        bounds : (2, 3) float64 array
            Smallest and largest corner of the model's bounding box, model units.

        Returns
        -------
        (6,) or (4,) float64 array
            In model units, in the order in which they are written.
        """
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

    def contains(self, points: Points, bounds: Points) -> NDArray[np.bool_]:
        """Which points lie in a box or a sphere.

        Parameters
        ----------
        points : (k, 3) float64 array
            Model units.
        bounds : (2, 3) float64 array
            Smallest and largest corner of the model's bounding box, model units.

        Returns
        -------
        (k,) bool array
            True on the border, too.
        """
        numbers = self.in_model_units(bounds)
        if self.kind == "sphere":
            return np.asarray(np.linalg.norm(points - numbers[:3], axis=1) <= numbers[3])
        corners = numbers.reshape(2, 3)
        low, high = corners.min(axis=0), corners.max(axis=0)
        return np.asarray(((points >= low) & (points <= high)).all(axis=1))

    def bounding_box(self, bounds: Points) -> Points:
        """Bounding box of a box or a sphere.

        Parameters
        ----------
        bounds : (2, 3) float64 array
            Smallest and largest corner of the model's bounding box, model units.

        Returns
        -------
        (2, 3) float64 array
            Smallest and largest corner, model units.
        """
        numbers = self.in_model_units(bounds)
        if self.kind == "sphere":
            return np.array([numbers[:3] - numbers[3], numbers[:3] + numbers[3]])
        corners = numbers.reshape(2, 3)
        return np.array([corners.min(axis=0), corners.max(axis=0)])


def parse_side(text: str, option: str) -> int:
    """Read the name of a side of a model or a box, or of an axis.

    Parameters
    ----------
    text : str
        Such as ``"front"`` or ``"-y"``.
    option : str
        What the error message calls the option that the text was given to.

    Returns
    -------
    int
        Index in :data:`fabfold.lattice.rotations.FACES`.

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


def parse_keep(text: str, option: str) -> tuple[RegionText | int, int]:
    """Read ``WHAT:SIDE``: a side or region of the model, and a side of the box.

    Parameters
    ----------
    text : str
        Such as ``"front:+x"``.
    option : str
        What the error message calls the option that the text was given to.

    Returns
    -------
    what : RegionText or int
        A region of the model, or a side as an index of
        :data:`fabfold.lattice.rotations.FACES`.
    side : int
        The side of the box, as such an index.

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
    target = parse_side(side, option)
    if what.strip().lower() in _SIDES:
        return parse_side(what, option), target
    if "(" not in what and what.strip().lower() != "painted":
        raise RecipeError(
            f"{option}: {what.strip()!r} is neither a side of the model "
            f"({', '.join(_SIDES)}) nor a region such as box(x0,y0,z0,x1,y1,z1)"
        )
    return parse_region(what, option), target


def parse_region(text: str, option: str) -> RegionText:
    """Read a region.

    Parameters
    ----------
    text : str
        Such as ``"sphere(10,0,50%,4)"``.
    option : str
        What the error message calls the option that the text was given to.

    Returns
    -------
    RegionText
        To be sampled by :func:`sample_region` or :func:`sample_surface`.

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
        return RegionText(text, kind, colour=None if inner is None else _colour(inner, option))
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
    return RegionText(text, kind, read)


def _colour(text: str, option: str) -> tuple[int, int, int]:
    colour = colour_of_hex(text)
    if colour is None:
        raise RecipeError(f"{option}: a colour is written #rrggbb, found {text!r}")
    return colour


@dataclass(frozen=True)
class Region:
    """A region of a model as sample points.

    Attributes
    ----------
    text : str
        As it was written.
    pieces : tuple of (k, 3) float64 arrays
        Sample points, model units: of the material in a box or a sphere, or just under painted
        faces; one array for each connected piece of the region, the largest first.
    """

    text: str
    pieces: tuple[Points, ...]


@dataclass(frozen=True)
class SurfaceSamples:
    """A part of a model's surface as sample points.

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


def _material(solid: Solid, low: Points, step: float, size: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which cubes of side `step` from the corner `low` on have their centre in the model."""
    # Imported here: numba is slow to import, and reading a recipe does not need it.
    from fabfold.solid.scan import scan_mesh

    x, y, z = size.tolist()
    vertices = (np.asarray(solid.vertices, dtype=np.float64) - low) / step
    return scan_mesh(vertices, np.asarray(solid.faces, dtype=np.int32), (x, y, z))


def _nothing_there(shape: RegionText, bounds: Points, option: str) -> RecipeError:
    low, high = (", ".join(f"{value:.4g}" for value in corner) for corner in bounds)
    return RecipeError(
        f"{option} {shape.text}: there is no material of the model in it; the model reaches from "
        f"({low}) to ({high}) in its own units"
    )


def sample_region(solid: Solid, shape: RegionText, option: str = "--protect") -> Region:
    """Sample a region of a model.

    Parameters
    ----------
    solid : Solid
        The model.
    shape : RegionText
        The region.
    option : str
        What the error message calls the option that the region was given to.

    Returns
    -------
    Region
        Pieces with less than 1 % of the material are left out.

    Raises
    ------
    RecipeError
        If the region does not touch the model, or the model has no such paint.
    """
    if shape.kind == "painted":
        return Region(shape.text, _painted_pieces(solid, shape, option))
    from scipy import ndimage

    bounds = solid.bounds
    box = shape.bounding_box(bounds)
    low, high = np.maximum(box[0], bounds[0]), np.minimum(box[1], bounds[1])
    if not (high > low).all():
        raise _nothing_there(shape, bounds, option)
    step = float((high - low).max()) / _REGION_STEPS
    # A wall much thinner than the region must not fall between the samples.
    step = min(step, float((bounds[1] - bounds[0]).max()) / _VIEW_STEPS)
    step = max(step, float(np.cbrt(np.prod(high - low) / 4_000_000)))
    size = np.ceil((high - low) / step).astype(np.int64)
    material = _material(solid, low, step, size)
    middles = low + step * (np.argwhere(material) + 0.5)
    inside = shape.contains(middles, bounds)
    material[tuple(np.argwhere(material)[~inside].T)] = False
    if not material.any():
        raise _nothing_there(shape, bounds, option)
    labels, count = ndimage.label(material)
    sizes = np.bincount(labels.ravel(), minlength=count + 1)
    sizes[0] = 0
    pieces = tuple(
        low + step * (np.argwhere(labels == piece) + 0.5)
        for piece in np.argsort(-sizes, kind="stable")[:count].tolist()
        if sizes[piece] >= MIN_PIECE_SHARE * sizes.sum()
    )
    return Region(shape.text, pieces)


def _painted(solid: Solid, shape: RegionText, option: str) -> Points:
    """Corners of the painted triangles of a colour, (k, 3, 3)."""
    paint = solid.paint
    if paint is None:
        raise RecipeError(
            f"{option} {shape.text}: no face of the model is painted; colours are read from PLY, "
            "OBJ, GLB and 3MF files, faces in another colour than most of the surface count"
        )
    if shape.colour is None:
        return paint.corners
    near = np.abs(paint.colours.astype(int) - np.array(shape.colour)).max(axis=1) <= SAME_COLOUR
    if not near.any():
        known, times = np.unique(paint.colours, axis=0, return_counts=True)
        most = known[np.argsort(-times, kind="stable")[:6]]
        names = ", ".join(hex_of_colour(colour) for colour in most.tolist())
        raise RecipeError(f"{option} {shape.text}: no face has this colour; there are {names}")
    return np.asarray(paint.corners[near])


def _samples(corners: Points, step: float) -> tuple[Points, Points, NDArray[np.float64]]:
    """Points about `step` apart on triangles, the triangles' normals and the area of each."""
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    parts = np.clip(np.ceil(edges / step), 1, 400).astype(int)
    normal, area = face_normals(corners)
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
        weight.append(np.repeat(area[these] / count**2, len(share)))
    return np.concatenate(points), np.concatenate(normals), np.concatenate(weight)


def _painted_pieces(solid: Solid, shape: RegionText, option: str) -> tuple[Points, ...]:
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
    areas = np.bincount(label, face_areas(corners))
    pieces = []
    for piece in np.argsort(-areas, kind="stable").tolist():
        if areas[piece] >= MIN_PIECE_SHARE * areas.sum():
            points, normals, _ = _samples(corners[label == piece], extent / _PAINT_STEPS)
            pieces.append(points - 1e-3 * extent * normals)
    return tuple(pieces)


def sample_surface(solid: Solid, shape: RegionText | int, option: str = "--keep") -> SurfaceSamples:
    """Sample the surface of a model that is seen from a side, or that lies in a region.

    Parameters
    ----------
    solid : Solid
        The model.
    shape : RegionText or int
        A region, or a side as an index of :data:`fabfold.lattice.rotations.FACES`.
    option : str
        What the error message calls the option that the region was given to.

    Returns
    -------
    SurfaceSamples
        About 160 along the model's longest side.

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
        inside = shape.contains(points, bounds)
        if not inside.any():
            raise _nothing_there(shape, bounds, option)
        points, normals, weight = points[inside], normals[inside], weight[inside]
    return SurfaceSamples(points - 1e-3 * extent * normals, normals, weight)


def _seen_from(solid: Solid, side: int) -> SurfaceSamples:
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
    return SurfaceSamples(
        low + step * (cells + 0.5),
        np.tile(FACES[side].astype(float), (len(cells), 1)),
        np.full(len(cells), step**2),
    )
