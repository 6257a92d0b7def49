"""Thicken what is too thin of a solid; what is thick enough keeps its surface.

The surface is sampled, and each sample gets the largest ball inside the solid that touches it
there. Balls that are smaller than wanted mark what is thin, but for those beside a larger ball: at
every convex edge the balls become small, and edges shall stay sharp. About the centres of the balls
that are left, the medial axis of the thin parts, a solid of the wanted thickness is laid, and
united with the model.

References
----------
Ma, Bae, Choi: 3D medial axis point approximation using nearest neighbors and the normal field
(2012), for the shrinking balls.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.solid.closed_solid import Solid
from fabfold.solid.convert import decimated, to_manifold, to_mesh
from fabfold.solid.own_axes import own_axes
from fabfold.solid.round_solid import round_solid
from fabfold.solid.union import MAX_TRIANGLES

if TYPE_CHECKING:
    import manifold3d

__all__ = ["InnerBalls", "Thickened", "inner_balls", "thickened", "thin_share"]

Floats = NDArray[np.float64]

#: Samples are this share of the wanted half thickness apart, as long as there are not too many.
_SPACING = 0.4
_LEAST_SAMPLES = 20_000
_MOST_SAMPLES = 120_000
#: Shortest chord between the two touching points of a ball, in radii: they are 45 degrees apart.
_LEAST_CHORD = 0.77
#: A ball counts as too small where it lacks more than this share of the wanted radius.
_SLACK = 0.04
#: A small ball whose centre is nearer than this to that of a ball that is large enough, in radii of
#: the large one, fills its edge. A right-angled corner is 1.73 radii from the ball that fits in.
_EDGE = 1.8
#: So does a ball where the balls grow by more than this share of the way to a larger one: by 0.58
#: towards a right-angled corner, by 0.71 towards an edge.
_GROWTH = 0.45
#: Balls are compared with those of so many sizes, each smaller by this factor.
_SIZES = 26
_STEP = 0.89


@dataclass(frozen=True)
class InnerBalls:
    """Largest balls inside a solid that touch samples of its surface.

    Attributes
    ----------
    points : (n, 3) float64 array
        Samples of the surface, model units.
    centres : (n, 3) float64 array
        Centre of the ball that touches each sample.
    radii : (n,) float64 array
        Radius of each ball, at most the one that was asked for.
    """

    points: Floats
    centres: Floats
    radii: Floats


@dataclass(frozen=True)
class Thickened:
    """What came of thickening a solid.

    Attributes
    ----------
    solid : Solid
        The thicker one; the same object where nothing was too thin.
    least : float
        Thickness of the thinnest parts before, model units (a fiftieth of the thin samples are
        thinner); infinite where nothing was too thin.
    share : float
        Share of the surface that was too thin.
    """

    solid: Solid
    least: float
    share: float


def inner_balls(vertices: Floats, faces: NDArray[np.int32], radius: float) -> InnerBalls:
    """Largest balls inside a solid, up to a radius, that touch its surface.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        Corner coordinates, any unit.
    faces : (f, 3) int32 array
        Three vertex indices for each triangle; closed, outward-oriented.
    radius : float
        Largest radius to look for, in the same unit.

    Returns
    -------
    InnerBalls
        Of samples spread evenly over the surface. The same mesh gives the same samples.
    """
    from scipy.spatial import cKDTree

    points, normals = _samples(vertices, faces, radius)
    tree = cKDTree(points)
    radii = np.full(len(points), radius)
    active = np.arange(len(points))
    for _ in range(30):
        centre = points[active] - radii[active, None] * normals[active]
        gap, near = tree.query(centre)
        step = points[near] - points[active]
        # A sample well inside the ball: the ball shrinks until it touches the surface there.
        inside = gap < radii[active] * (1 - 1e-3)
        active, near, step = active[inside], near[inside], step[inside]
        if not len(active):
            break
        mine, other = normals[active], normals[near]
        towards = -np.einsum("ij,ij->i", step, mine)
        squared = np.einsum("ij,ij->i", step, step)
        facing = np.einsum("ij,ij->i", mine, other)
        shrunk = squared / np.maximum(2 * towards, 1e-12)
        # Off to the side of that sample the surface goes on as a plane, which touches sooner.
        plane = np.einsum("ij,ij->i", step, other) / np.maximum(1 - facing, 1e-12)
        shrunk = np.where((facing < 0.5) & (plane > 0), np.minimum(shrunk, plane), shrunk)
        # Where both touch the ball on one side of it, they only show a facet of a round surface.
        across = squared > (_LEAST_CHORD * shrunk) ** 2
        active, shrunk = active[across], shrunk[across]
        radii[active] = np.clip(shrunk, 1e-3 * radius, radii[active] * (1 - 1e-3))
        active = active[radii[active] > 1e-3 * radius]
    return InnerBalls(points, points - radii[:, None] * normals, radii)


def thickened(solid: Solid, thickness: float) -> Thickened:
    """A solid with no part thinner than wanted; what is thick enough keeps its surface.

    Parameters
    ----------
    solid : Solid
        The model.
    thickness : float
        Least thickness that is wanted, model units.

    Returns
    -------
    Thickened
        The thicker solid and what was thin. Thin parts get round edges, and grow on all sides. A
        cavity that closes is filled.
    """
    radius = thickness / 2
    # Balls of flat faces are set side by side, so in axes that turn with the model.
    axes = own_axes(solid.vertices, solid.faces)
    given, solid = solid, solid.in_axes(axes)
    balls = inner_balls(solid.vertices, solid.faces, radius)
    thin = _thin(balls, radius)
    if not thin.any():
        return Thickened(given, float("inf"), 0.0)
    centres = _spread(balls.centres[thin], radius / 5)
    skin = round_solid(centres, radius)
    whole = _filled(to_manifold(solid.vertices, solid.faces) + skin)
    scale = float(np.ptp(solid.vertices, axis=0).max())
    whole = decimated(whole.scale((1 / scale,) * 3), MAX_TRIANGLES).scale((scale,) * 3)
    points, faces = to_mesh(whole)
    return Thickened(
        replace(solid, vertices=points, faces=np.ascontiguousarray(faces, dtype=np.int32)).in_axes(
            axes.T
        ),
        2 * _least(balls.centres[thin], balls.radii[thin], radius),
        float(thin.mean()),
    )


def thin_share(solid: Solid, thickness: float) -> float:
    """Share of a solid's surface that lies on parts thinner than wanted.

    Parameters
    ----------
    solid : Solid
        The model.
    thickness : float
        Least thickness that is wanted, model units.
    """
    radius = thickness / 2
    return float(_thin(inner_balls(solid.vertices, solid.faces, radius), radius).mean())


def _samples(vertices: Floats, faces: NDArray[np.int32], radius: float) -> tuple[Floats, Floats]:
    """Points spread evenly over a surface, and the normals there, both (n, 3)."""
    corners = vertices[faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(cross, axis=1)
    ends = np.cumsum(length / 2)
    wanted = float(ends[-1]) / (_SPACING * radius) ** 2
    count = int(np.clip(wanted, _LEAST_SAMPLES, _MOST_SAMPLES))
    face = np.searchsorted(ends, (np.arange(count) + 0.5) * (ends[-1] / count), side="right")
    face = np.minimum(face, len(faces) - 1)
    # The two-dimensional golden ratio: no two numbers in a row are near each other.
    u, v = (np.arange(count)[:, None] * [0.7548776662466927, 0.5698402909980532] % 1.0).T
    over = u + v > 1
    u, v = np.where(over, 1 - u, u), np.where(over, 1 - v, v)
    here = corners[face]
    points = here[:, 0] + u[:, None] * (here[:, 1] - here[:, 0])
    points += v[:, None] * (here[:, 2] - here[:, 0])
    return points, cross[face] / np.maximum(length[face], 1e-300)[:, None]


def _thin(balls: InnerBalls, radius: float) -> NDArray[np.bool_]:
    """Mask of the samples whose balls lie on the medial axis of a thin part, and on no edge."""
    from scipy.spatial import cKDTree

    size = (1 - _SLACK) * radius
    thin = balls.radii < size
    for place in range(_SIZES):
        large = balls.radii >= size
        small = np.flatnonzero(thin & ~large)
        if large.any() and len(small):
            reach = _EDGE * radius if place == 0 else size / _GROWTH
            gap, _ = cKDTree(balls.centres[large]).query(
                balls.centres[small], distance_upper_bound=reach
            )
            steep = np.isfinite(gap)
            if place > 0:
                steep &= balls.radii[small] < size - _GROWTH * gap
            thin[small[steep]] = False
        size *= _STEP
    return np.asarray(thin)


def _spread(points: Floats, spacing: float) -> Floats:
    """One point of each cube of a grid, in the middle of those that lie in it."""
    cube = np.floor(points / spacing).astype(np.int64)
    _, owner = np.unique(cube, axis=0, return_inverse=True)
    count = np.bincount(owner.ravel())
    sums = [np.bincount(owner.ravel(), weights=points[:, axis]) for axis in range(3)]
    return np.stack(sums, axis=1) / count[:, None]


def _least(centres: Floats, radii: Floats, radius: float) -> float:
    """Half thickness of the thinnest part: of all places, the least of the largest balls."""
    cube = np.floor(centres / radius).astype(np.int64)
    _, owner = np.unique(cube, axis=0, return_inverse=True)
    owner = owner.ravel()
    largest = np.zeros(int(owner.max()) + 1)
    np.maximum.at(largest, owner, radii)
    places = largest[owner]  # A place counts by its samples: a corner of a cube has few.
    return float(np.quantile(places, 0.05))


def _filled(body: manifold3d.Manifold) -> manifold3d.Manifold:
    """The largest piece of a solid without its cavities."""
    # Cavities are pieces of negative volume.
    pieces = sorted(body.decompose(), key=lambda piece: -piece.volume())
    return pieces[0]
