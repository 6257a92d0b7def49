"""What moves in a linkage whose faces may part but not press together, to first order."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["free_hinges", "null_space", "rank_of"]

Floats = NDArray[np.float64]

#: Speeds below this count as none; a hinge turns at most at 1.
_STILL = 1e-6


def free_hinges(bounds: Floats, held: Floats) -> list[int]:
    """Hinges that can move to first order.

    Parameters
    ----------
    bounds : (m, h) float64 array
        Rows r with r · q >= 0 for every possible vector q of the hinges' speeds.
    held : (k, h) float64 array
        Rows r with r · q = 0.

    Returns
    -------
    list of int
        Indices of hinges whose speed is not bound to 0.
    """
    from scipy.optimize import linprog

    count = bounds.shape[1]
    moving: set[int] = set()
    for hinge in range(count):
        if hinge in moving:
            continue
        for sign in (1.0, -1.0):
            cost = np.zeros(count)
            cost[hinge] = -sign
            found = linprog(
                cost,
                A_ub=-bounds if len(bounds) else None,
                b_ub=np.zeros(len(bounds)) if len(bounds) else None,
                A_eq=held if len(held) else None,
                b_eq=np.zeros(len(held)) if len(held) else None,
                bounds=(-1.0, 1.0),
                method="highs",
            )
            if found.status == 0 and -found.fun > 1e-5:
                moving.update(np.flatnonzero(np.abs(found.x) > 1e-5).tolist())
                break
    return sorted(moving)


def null_space(rows: Floats) -> Floats:
    """What rows leave alone.

    Parameters
    ----------
    rows : (k, h) float64 array
        Rows r with r · q = 0.

    Returns
    -------
    (h, f) float64 array
        Orthonormal columns that span all such q.
    """
    if not len(rows):
        return np.eye(rows.shape[1])
    _, sizes, axes = np.linalg.svd(rows)
    rank = int((sizes > _STILL * max(1.0, float(sizes.max()))).sum())
    return np.asarray(axes[rank:].T)


def rank_of(rows: Floats) -> int:
    """Number of independent rows of (k, f), sizes below 0.001 not counted."""
    return int(np.linalg.matrix_rank(rows, tol=1e-3)) if rows.size else 0
