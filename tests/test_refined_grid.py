"""Which grids are unlike each other."""

import warnings

import numpy as np

from fabfold.voxels.grid_placement import GridFit
from fabfold.voxels.refined_grid import RefinedGrid, unlike


def grid(*fills: float, excess: int = 0) -> RefinedGrid:
    kept = len(fills)
    fit = GridFit(
        score=float(sum(fills)), kept=kept, fill=float(sum(fills)), slivers=0, lost=0.0,
        excess=excess, fills=np.sort(np.array(fills, dtype=float)),
        cells=np.zeros((kept, 3), dtype=np.int64),
    )  # fmt: skip
    return RefinedGrid(fit, 0, None)


def test_grids_of_the_same_fills_are_alike_and_those_of_other_sizes_are_not():
    found = [grid(0.5, 0.9), grid(0.505, 0.9), grid(0.7, 0.9), grid(0.5, 0.9, 0.9)]
    assert unlike(found, [], 9) == [found[0], found[2], found[3]]
    assert unlike(found, [found[2]], 9) == [found[0], found[3]]
    assert unlike(found, [], 1) == [found[0]]


def test_grids_that_do_not_fit_or_keep_nothing_are_left_out():
    found = [grid(0.5, excess=1), grid(), grid(), grid(0.5)]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert unlike(found, [], 9) == [found[3]]
