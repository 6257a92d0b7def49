"""Colours of the bodies: clearly different, and most of all between neighbours."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from fabfold.srgb import linear_light
from fabfold.tree.fold_tree import FoldTree

__all__ = ["body_colours", "palette"]

#: The first colours of every palette, chosen by eye.
_FIRST = (
    (0x4E, 0x8F, 0xD6),
    (0xF2, 0xA2, 0x3A),
    (0x5B, 0xB5, 0x74),
    (0xE0, 0x5A, 0x5A),
    (0x9A, 0x78, 0xD0),
    (0x2F, 0xB5, 0xB8),
    (0xF4, 0xCF, 0x4B),
    (0xE6, 0x83, 0xB3),
)


def _oklab(rgb: NDArray[np.generic]) -> NDArray[np.float64]:
    """Oklab coordinates of (n, 3) sRGB bytes: equal distances look about equally different."""
    cones = linear_light(rgb) @ np.array(
        [
            [0.4122214708, 0.2119034982, 0.0883024619],
            [0.5363325363, 0.6806995451, 0.2817188376],
            [0.0514459929, 0.1073969566, 0.6299787005],
        ]
    )
    return np.asarray(
        np.cbrt(cones)
        @ np.array(
            [
                [0.2104542553, 1.9779984951, 0.0259040371],
                [0.7936177850, -2.4285922050, 0.7827717662],
                [-0.0040720468, 0.4505937099, -0.8086757660],
            ]
        )
    )


def _candidates() -> NDArray[np.uint8]:
    """Colours neither too dark, too pale nor too dull to stand on a light page."""
    steps = np.arange(24, 256, 12)
    grid = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    lab = _oklab(grid)
    chroma = np.hypot(lab[:, 1], lab[:, 2])
    keep = (lab[:, 0] > 0.52) & (lab[:, 0] < 0.87) & (chroma > 0.06) & (chroma < 0.165)
    return grid[keep].astype(np.uint8)


@cache
def _ranked(count: int) -> tuple[tuple[int, int, int], ...]:
    chosen = [np.array(colour, dtype=np.uint8) for colour in _FIRST[:count]]
    if count > len(chosen):
        candidates = _candidates()
        lab = _oklab(candidates)
        chroma = np.hypot(lab[:, 1], lab[:, 2])
        strange = ((lab[:, 0] - 0.70) / 0.17) ** 2 + ((chroma - 0.12) / 0.05) ** 2
        liking = 1.0 / (1.0 + 0.35 * strange)
        nearest = np.full(len(candidates), np.inf)
        for colour in chosen:
            distance = np.linalg.norm(lab - _oklab(colour[None])[0], axis=1)
            nearest = np.minimum(nearest, distance)
        while len(chosen) < count:
            # Mild colours before dark, pale, dull and shrill ones, where they are as far apart.
            # Rounding makes ties fall to the first candidate on every machine.
            best = int(np.round(nearest * liking, 9).argmax())
            chosen.append(candidates[best])
            nearest = np.minimum(nearest, np.linalg.norm(lab - lab[best], axis=1))
    return tuple((int(r), int(g), int(b)) for r, g, b in chosen)


def palette(count: int) -> NDArray[np.uint8]:
    """The first `count` colours, each as far as can be from those before it.

    Parameters
    ----------
    count : int
        Any number; about 60 can still be told apart side by side.

    Returns
    -------
    (count, 3) uint8 array
        sRGB.
    """
    return np.array(_ranked(count), dtype=np.uint8).reshape(count, 3)


def _neighbours(tree: FoldTree) -> NDArray[np.bool_]:
    """Bodies that share a hinge, or whose cells share a face in A or in B, or are one."""
    count = len(tree.bodies)
    beside = np.zeros((count, count), dtype=bool)
    for hinge in tree.hinges:
        beside[hinge.parent, hinge.child] = True
    owner = tree.voxel_body
    for cells in (tree.source, tree.target):
        apart = np.abs(cells[:, None].astype(int) - cells[None]).sum(axis=2)
        first, second = np.nonzero(apart <= 1)
        beside[owner[first], owner[second]] = True
    beside |= beside.T
    np.fill_diagonal(beside, False)
    return beside


def body_colours(tree: FoldTree) -> NDArray[np.uint8]:
    """One colour a body, given out so that neighbours in A and in B look different.

    Parameters
    ----------
    tree : FoldTree
        Says which bodies are neighbours, as the model (A) and as the box (B).

    Returns
    -------
    (b, 3) uint8 array
        sRGB, in the order of ``tree.bodies``; no two alike.
    """
    count = len(tree.bodies)
    colours = palette(count)
    lab = _oklab(colours)
    apart = np.linalg.norm(lab[:, None] - lab[None], axis=2)
    np.fill_diagonal(apart, 1.0)
    clash = np.round(1.0 / apart**3, 6)
    np.fill_diagonal(clash, 0.0)
    beside = _neighbours(tree).astype(float)
    given = np.arange(count)
    # Swap pairs of colours while that parts neighbours further; every swap lowers a sum.
    for _ in range(30):
        changed = False
        for i in range(count):
            for j in range(i + 1, count):
                before = beside[i] @ clash[given[i], given] + beside[j] @ clash[given[j], given]
                given[i], given[j] = given[j], given[i]
                after = beside[i] @ clash[given[i], given] + beside[j] @ clash[given[j], given]
                if after < before - 1e-6:
                    changed = True
                else:
                    given[i], given[j] = given[j], given[i]
        if not changed:
            break
    return np.asarray(colours[given], dtype=np.uint8)
