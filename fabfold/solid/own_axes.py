"""Axes that a model has of itself, however it lies in its file.

A search that starts from these axes finds the same voxels for a model that was turned or mirrored:
it sees the same points, up to rounding.
"""

from __future__ import annotations

from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray

from fabfold.meshes import vector_areas

__all__ = ["own_axes"]

#: Starts of the ascent towards the axes that most of the surface faces, and its sweeps at most.
_STARTS = 24
_SWEEPS = 60
#: Of moments of the unit normals, and of lengths in a model of size 1: below it there is nothing.
#: Well above what rounding leaves of zero, coordinates of four bytes included.
_NOTHING = 1e-7
#: A turn that changes nothing any more, rad.
_STILL = 1e-15

_PLANES = ((0, 1), (1, 2), (2, 0))


def own_axes(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.float64]:
    """Axes that turn, and mirror, with the model.

    They are the three perpendicular directions that its surface faces most: of all frames the one
    with the largest sum of the fourth powers of the normals' components, weighted by area (the
    quartimax criterion). A part made of blocks gets the axes of its blocks, also where it is as
    long as it is wide and has no principal axes. Where the surface does not tell one direction
    from another, as about the axis of a wheel, they point to where the model reaches farthest.

    The axes are numbered and directed by how the surface spreads along them, so they may be
    left-handed; those of the mirrored model then are right-handed.

    Parameters
    ----------
    vertices : (v, 3) float64 array
        Corners of the model, any unit.
    faces : (f, 3) int32 array
        Its triangles.

    Returns
    -------
    (3, 3) float64 array
        One axis a row: an orthogonal matrix from model axes to own axes, of determinant 1 or -1.

    References
    ----------
    Neuhaus, Wrigley: The quartimax method, British J. of Statistical Psychology 7 (1954).
    """
    corners = vertices[faces]
    normals = vector_areas(corners)
    areas = np.linalg.norm(normals, axis=1)
    seen = areas > 0
    if not seen.any():
        return np.eye(3)
    weights = areas[seen] / areas[seen].sum()
    normals = normals[seen] / areas[seen, None]
    middles = corners[seen].mean(axis=1)
    centre = np.einsum("i,ij->j", weights, middles)
    spread = middles - centre
    size = max(float(np.abs(spread).max()), 1e-300)
    reach = (vertices - centre) / size
    # einsum, since a matrix product may sum in an order that depends on the number of threads.
    squares = np.einsum("ij,ik->ijk", normals, normals)
    moment = np.einsum("i,ijk,ilm->jklm", weights, squares, squares)
    axes = _settled(moment, reach)
    ends = np.einsum("ij,kj->ik", reach, axes)
    points = np.einsum("ij,kj->ik", spread / size, axes)
    return _directed(axes, weights, points, np.array([ends.max(axis=0), ends.min(axis=0)])) @ axes


def _turned(moment: NDArray[np.float64], axes: NDArray[np.float64]) -> NDArray[np.float64]:
    """The fourth moment in other axes."""
    pairs = np.einsum("ai,bj->abij", axes, axes).reshape(9, 9)
    turned = np.einsum("ai,bj,ij->ab", pairs, pairs, moment.reshape(9, 9))
    return np.asarray(turned.reshape(3, 3, 3, 3))


def _wave(moment: NDArray[np.float64], i: int, j: int) -> complex:
    """Sum of the fourth powers of the normals' parts in a plane, as complex numbers."""
    real = moment[i, i, i, i] - 6 * moment[i, i, j, j] + moment[j, j, j, j]
    return complex(real, 4 * (moment[i, i, i, j] - moment[i, j, j, j]))


def _in_plane(i: int, j: int, angle: float) -> NDArray[np.float64]:
    """Rows of axes turned from axis i towards axis j."""
    turn = np.eye(3)
    turn[[i, j], [i, j]] = np.cos(angle)
    turn[i, j] = np.sin(angle)
    turn[j, i] = -turn[i, j]
    return turn


def _settled(moment: NDArray[np.float64], reach: NDArray[np.float64]) -> NDArray[np.float64]:
    """The axes that most of the surface faces; (3, 3), right-handed."""
    rng = np.random.default_rng(0)
    best, most = np.eye(3), -1.0
    for start in range(_STARTS):
        axes = np.linalg.qr(rng.normal(size=(3, 3)))[0] if start else np.eye(3)
        axes = _climbed(moment, axes * np.linalg.det(axes))
        facing = float(np.einsum("iiii->", _turned(moment, axes)))
        if facing > most + _NOTHING:
            best, most = axes, facing
    here = _turned(moment, best)
    blind = [abs(_wave(here, i, j)) < _NOTHING for i, j in _PLANES]
    if all(blind):
        # No direction is like another only to the normals: take the one that reaches farthest.
        far = reach[np.argmax(np.einsum("ij,ij->i", reach, reach))]
        best = np.linalg.qr(np.column_stack([far, best.T]))[0][:, [1, 2, 0]].T
        blind = [True, False, False]
    for (i, j), unseen in zip(_PLANES, blind, strict=True):
        if unseen:
            x, y = np.einsum("ij,kj->ki", reach, best[[i, j]])
            far = np.argmax(x * x + y * y)
            best = _in_plane(i, j, float(np.arctan2(y[far], x[far]))) @ best
            break
    return np.asarray(best)


def _climbed(moment: NDArray[np.float64], axes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Turn in one plane after another, each time to the best angle, until nothing moves."""
    for _ in range(_SWEEPS):
        largest = 0.0
        for i, j in _PLANES:
            wave = _wave(_turned(moment, axes), i, j)
            if abs(wave) < _NOTHING:
                continue
            angle = float(np.angle(wave)) / 4
            axes = _in_plane(i, j, angle) @ axes
            largest = max(largest, abs(angle))
        if largest < _STILL:
            break
    return axes


def _directed(
    axes: NDArray[np.float64],
    weights: NDArray[np.float64],
    points: NDArray[np.float64],
    ends: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Number and direct three axes by the moments of the points along them.

    Longest first, the heavier tail of each towards its positive end. What this leaves open is
    decided by how far the model reaches (`ends`, largest and smallest along each axis) and by the
    mixed moments. What these leave open is a symmetry of the model, and does not matter.

    Returns
    -------
    (3, 3) float64 array
        A signed permutation, to be multiplied from the left.
    """
    second = np.einsum("i,ij,ik->jk", weights, points, points)
    third = np.einsum("i,ij,ik,il->jkl", weights, points, points, points)
    square = np.einsum("ij,ik->ijk", points, points)
    fourth = np.einsum("i,ijk,ilm->jklm", weights, square, square)
    found = []
    for order in map(list, permutations(range(3))):
        for signs in map(np.array, product((1.0, -1.0), repeat=3)):
            step = np.zeros((3, 3))
            step[range(3), order] = signs
            two = step @ second @ step.T
            three = np.einsum("ai,bj,ck,ijk->abc", step, step, step, third)
            four = _turned(fourth, step)
            found.append(
                (
                    [
                        *np.diag(two),
                        *three[range(3), range(3), range(3)],
                        *np.where(signs > 0, ends[0, order], -ends[1, order]),
                        three[0, 1, 2],
                        *(four[i, i, i, j] - four[i, j, j, j] for i, j in _PLANES),
                        *(two[i, j] for i, j in _PLANES),
                        np.linalg.det(step @ axes),
                    ],
                    step,
                )
            )
    left = list(range(len(found)))
    for column in range(len(found[0][0])):
        top = max(found[index][0][column] for index in left)
        left = [index for index in left if found[index][0][column] > top - _NOTHING]
    return found[left[0]][1]
