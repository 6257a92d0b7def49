"""A search that is over at once, to have the compiled kernels in memory before the clock starts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fabfold.fold.lattice_foldability import LatticeFoldability
from fabfold.lattice.shipped import load_template
from fabfold.recipe.recipe_wishes import default_weights
from fabfold.search.seeds import Job
from fabfold.tree.catalogue import JointSet
from fabfold.tree.effort import EFFORTS
from fabfold.tree.problem import tree_problem

__all__ = ["warm_up_job"]


def warm_up_job(joints: JointSet = "S") -> Job:
    """A strip of 8 voxels that folds into 2 x 2 x 2, every joint printable.

    Its search calls all kernels that the search of a model with these joints calls: those of
    growing, closing, planning and shortening.

    Parameters
    ----------
    joints : str
        Joint types in use, see :data:`fabfold.tree.catalogue.JOINT_SETS`.

    Returns
    -------
    Job
        With little effort; each seed finds a tree.
    """
    cells = np.array([(i, 0, 0) for i in range(8)], np.int32)
    count = len(cells) - 1
    strip = tree_problem(
        cells,
        load_template("box-2x2x2"),
        pairs=np.array([(i, i + 1) for i in range(count)], np.int32),
        rigid=np.ones(count, np.bool_),
        hinge=np.ones((count, 4), np.bool_),
        depth=np.zeros((len(cells), 6)),
        weights=default_weights(),
        double=np.ones(count, np.bool_),
        joints=joints,
    )
    return Job(strip, LatticeFoldability(), replace(EFFORTS["quick"], restarts=2, polish_best=20))
