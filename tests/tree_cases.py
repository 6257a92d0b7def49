"""Small tree problems for the tests of the search."""

from __future__ import annotations

import numpy as np

from fabfold.fold.lattice_foldability import LatticeFoldability
from fabfold.lattice.rotations import FACES, parity
from fabfold.lattice.shipped import load_template
from fabfold.recipe.recipe_wishes import default_weights
from fabfold.tree.effort import Effort
from fabfold.tree.problem import TreeProblem, tree_problem
from fabfold.tree.solve import solve

#: Less than `fabfold` ever spends on a seed.
QUICK = Effort(polish_best=100, polish_each=60, starts=3, restarts=10)


def face_pairs(cells):
    index = {tuple(cell): i for i, cell in enumerate(np.asarray(cells).tolist())}
    return np.array(
        [
            (i, index[other])
            for cell, i in index.items()
            for f in (0, 2, 4)
            if (other := tuple((np.array(cell) + FACES[f]).tolist())) in index
        ],
        dtype=np.int32,
    ).reshape(-1, 2)


def solid_problem(cells, template, *, hinge=None, rigid=None, depth=None, weights=None, joints="S"):
    """Every joint possible, all cells full, unless told otherwise."""
    cells = np.array(cells, dtype=np.int32)
    pairs = face_pairs(cells)
    return tree_problem(
        cells,
        load_template(template),
        pairs=pairs,
        rigid=np.ones(len(pairs), dtype=bool) if rigid is None else rigid,
        hinge=np.ones((len(pairs), 4), dtype=bool) if hinge is None else hinge,
        depth=np.zeros((len(cells), 6)) if depth is None else depth,
        weights=weights or default_weights(),
        joints=joints,
    )


def strip(length):
    return [(i, 0, 0) for i in range(length)]


def animal(count, template, seed, printable=0.85):
    """A body with four legs, grown at random to `count` cells of the right colours."""
    rng = np.random.default_rng(seed)
    colours = load_template(template).colours
    while True:
        long = max(2, round((0.5 * count) ** (1 / 3) * 1.3))
        wide = max(2, round((0.4 * count / long) ** 0.5))
        cells = {(x, y, z) for x in range(long) for y in range(wide) for z in range(wide)}
        for x in (0, long - 1):
            cells |= {(x, y, -z) for y in (0, wide - 1) for z in (1, 2)}
        order = sorted(cells)
        while len(order) < count:
            near = np.array(order[rng.integers(len(order))]) + FACES[rng.integers(6)]
            cell = tuple(near.tolist())
            if cell not in cells:
                cells.add(cell)
                order.append(cell)
        found = np.array(sorted(cells))
        odd = int(parity(found).sum())
        even = len(found) - odd
        if len(found) == count and (
            (even <= colours[0] and odd <= colours[1]) or (even <= colours[1] and odd <= colours[0])
        ):
            break
    pairs = face_pairs(found)
    return solid_problem(
        found - found.min(axis=0),
        template,
        hinge=rng.random((len(pairs), 4)) < printable,
        depth=rng.random((len(found), 6)),
    )


def large_animal():
    """The animal whose trees the tests share."""
    return animal(46, "box-3x4x4", 8)


def searched_animal():
    """Its trees, best first, as one seed finds them."""
    return solve(large_animal(), 0, LatticeFoldability(), QUICK)


__all__ = [
    "QUICK",
    "TreeProblem",
    "animal",
    "face_pairs",
    "large_animal",
    "searched_animal",
    "solid_problem",
    "strip",
]
