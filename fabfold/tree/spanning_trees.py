"""Random spanning trees of rigid clusters, drawn from the hinges that could join them.

A tree joins all clusters by hinges that do not get in each other's way. :func:`spanning_tree` draws
one, :func:`root_tree` puts its bodies and hinges in order from the root outwards.
"""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.tree.pose_energy import count_defects, energy_of
from fabfold.tree.possible_hinges import HingeRows, find_hinges
from fabfold.tree.rng import random_float
from fabfold.tree.swept_cells import HingeTables
from fabfold.tree.tables import Tables

__all__ = ["energy_if_joined", "loose_pieces", "root_tree", "spanning_tree"]

#: Added to the random order of double hinges, a uniform(0, 1): single ones are tried first.
_DOUBLE_DELAY = 0.5


@njit(cache=True)
def _root(link: NDArray[np.int32], a: int) -> int:
    while link[a] != a:
        link[a] = link[link[a]]
        a = link[a]
    return a


@njit(cache=True)
def _same(one: NDArray[np.int32], other: NDArray[np.int32]) -> bool:
    return one[0] == other[0] and one[1] == other[1] and one[2] == other[2]


@njit(cache=True)
def _collide(one: np.void, other: np.void) -> bool:
    """Whether two hinges want one lattice edge in A or in B, one face for a plate, or one voxel."""
    if _same(one["edge_a"], other["edge_a"]) or _same(one["edge_b"], other["edge_b"]):
        return True
    if one["double"] and (
        _same(one["second_edge_a"], other["edge_a"]) or _same(one["second_edge_b"], other["edge_b"])
    ):
        return True
    if not other["double"]:
        return False
    if _same(one["edge_a"], other["second_edge_a"]) or _same(one["edge_b"], other["second_edge_b"]):
        return True
    if not one["double"]:
        return False
    return (
        one["u"] == other["u"]
        or one["u"] == other["v"]
        or one["v"] == other["u"]
        or one["v"] == other["v"]
        or _same(one["second_edge_a"], other["second_edge_a"])
        or _same(one["second_edge_b"], other["second_edge_b"])
        or _same(one["plate_b"], other["plate_b"])
    )


@njit(cache=True)
def spanning_tree(
    rows: HingeRows,
    clusters: int,
    preference: NDArray[np.float64],
    generator: NDArray[np.uint64],
    chosen: NDArray[np.int32],
) -> int:
    """Draw a random spanning tree of the clusters.

    No two of its hinges share a lattice edge segment in A or in B, and no voxel has two double
    hinges (paper section 4.1, joint collision). Single hinges are preferred.

    Parameters
    ----------
    rows : (k,) array of :data:`fabfold.tree.possible_hinges.HINGE_ROW`
        Possible hinges.
    clusters : int
        Number of rigid clusters.
    preference : (k,) float64 array
        Hinges are tried by ascending ``preference + uniform(0, 1)``, double ones 0.5 later.
    generator : (1,) uint64 array
        Random state, advanced.
    chosen : (clusters - 1,) int32 array
        Filled with indices of `rows`.

    Returns
    -------
    int
        Number of pieces that remain: 1 when the tree spans.
    """
    link = np.arange(clusters).astype(np.int32)
    order = np.empty(len(rows))
    for i in range(len(rows)):
        order[i] = preference[i] + random_float(generator)
        if rows[i]["double"]:
            order[i] += _DOUBLE_DELAY
    kept = 0
    for row in np.argsort(order):
        if kept == clusters - 1:
            break
        a = _root(link, rows[row]["cluster_u"])
        b = _root(link, rows[row]["cluster_v"])
        if a == b:
            continue
        collision = False
        for i in range(kept):
            if _collide(rows[row], rows[chosen[i]]):
                collision = True
                break
        if collision:
            continue
        link[a] = b
        chosen[kept] = row
        kept += 1
    return clusters - kept


@njit(cache=True)
def axis_of(tables: Tables, row: np.void, which: int, hinges: HingeTables) -> tuple[int, int]:
    """Direction and turn of an axis of a possible hinge, seen from its voxel u.

    Parameters
    ----------
    tables : Tables
        Tables of the problem.
    row : record of :data:`fabfold.tree.possible_hinges.HINGE_ROW`
        The hinge.
    which : int
        0 for its first axis, 1 for the second one of a double hinge.
    hinges : HingeTables
        From :func:`fabfold.tree.swept_cells.hinge_tables`.

    Returns
    -------
    axis : int
        0, 1 or 2: it runs along x, y or z.
    turns : int
        Signed quarter turns about the positive axis.
    """
    d = hinges.faces[row["face"]]
    d_axis = row["face"] >> 1
    side = hinges.sides[row["face"], tables.realization[row["realization"], 2 * which]]
    quarters = tables.realization[row["realization"], 2 * which + 1]
    n_axis = side >> 1
    # Component of d x n along the positive axis.
    sign = d[d_axis] * hinges.faces[side, n_axis]
    if (d_axis + 1) % 3 != n_axis:
        sign = -sign
    return 3 - d_axis - n_axis, quarters * sign


@njit(cache=True)
def mark_kept(
    tables: Tables,
    rows: HingeRows,
    hinges: HingeTables,
    kept: NDArray[np.int32],
    exact: bool,
    preference: NDArray[np.float64],
) -> None:
    """Lower to -1 the preference of possible hinges that are kept.

    Two voxels may be joined about one edge or another, and turn either way; a tree folds by one of
    these.

    Parameters
    ----------
    tables : Tables
        Tables of the problem.
    rows : (k,) array of :data:`fabfold.tree.possible_hinges.HINGE_ROW`
        Possible hinges.
    hinges : HingeTables
        From :func:`fabfold.tree.swept_cells.hinge_tables`.
    kept : (h, 6) int32 array
        Axes, as :attr:`fabfold.tree.assembly.SpanningTree.axes`.
    exact : bool
        Whether all axes of a hinge must be among them, or its voxels alone.
    preference : (k,) float64 array
        Changed for these rows.
    """
    for r in range(len(rows)):
        row = rows[r]
        turned = row["u"] > row["v"]
        first, last = (row["v"], row["u"]) if turned else (row["u"], row["v"])
        left = 2 if row["double"] else 1
        for i in range(len(kept)):
            if kept[i, 0] != first or kept[i, 1] != last:
                continue
            if not exact:
                left = 0
                break
            for which in range(2 if row["double"] else 1):
                edge = row["edge_a"] if which == 0 else row["second_edge_a"]
                if edge[0] != kept[i, 2] or edge[1] != kept[i, 3] or edge[2] != kept[i, 4]:
                    continue
                _, quarters = axis_of(tables, row, which, hinges)
                if (-quarters if turned else quarters) == kept[i, 5]:
                    left -= 1
        if left == 0:
            preference[r] = -1.0


@njit(cache=True)
def root_tree(
    tables: Tables,
    rows: HingeRows,
    chosen: NDArray[np.int32],
    label: NDArray[np.int32],
    clusters: int,
    hinges: HingeTables,
    body: NDArray[np.int32],
    parent: NDArray[np.int32],
    point2: NDArray[np.int32],
    axis: NDArray[np.int8],
    turns: NDArray[np.int8],
    joint: NDArray[np.int32],
) -> None:
    """Order a spanning tree from its largest cluster outwards (ties: the lower number).

    The link plate of a double hinge is a body of its own, just before the child's.

    Parameters
    ----------
    tables : Tables
        Tables of the problem.
    rows : (k,) array of :data:`fabfold.tree.possible_hinges.HINGE_ROW`
        Possible hinges.
    chosen : (clusters - 1,) int32 array
        From :func:`spanning_tree`.
    label : (n,) int32 array
        Rigid cluster of each voxel.
    clusters : int
        Number of rigid clusters.
    hinges : HingeTables
        From :func:`fabfold.tree.swept_cells.hinge_tables`.
    body : (n,) int32 array
        Filled with the body of each voxel; body 0 is the root.
    parent : (h,) int32 array
        Filled with the parent body of each axis. ``h`` is ``clusters - 1`` and one more for each
        double hinge.
    point2 : (h, 3) int32 array
        Filled with twice the middle of each axis' lattice edge in A.
    axis : (h,) int8 array
        Filled with 0, 1 or 2: the axis runs along x, y or z.
    turns : (h,) int8 array
        Filled with signed quarter turns about the positive axis.
    joint : (h, 3) int32 array
        Filled with the parent voxel, the child voxel and the joint type.
    """
    size = np.zeros(clusters, np.int32)
    for v in range(len(label)):
        size[label[v]] += 1
    index = np.full(clusters, -1, np.int32)
    queue = np.empty(clusters, np.int32)
    first = 0
    for c in range(clusters):
        if size[c] > size[first]:
            first = c
    index[first] = 0
    queue[0] = first
    bodies = 1
    tail = 1
    head = 0
    while head < tail:
        here = queue[head]
        head += 1
        for i in range(clusters - 1):
            row = rows[chosen[i]]
            if row["cluster_u"] == here and index[row["cluster_v"]] < 0:
                other = row["cluster_v"]
                turned = False
            elif row["cluster_v"] == here and index[row["cluster_u"]] < 0:
                other = row["cluster_u"]
                turned = True
            else:
                continue
            queue[tail] = other
            tail += 1
            axes = 2 if row["double"] else 1
            below = index[here]
            for k in range(axes):
                # Seen from v the second axis comes first.
                which = axes - 1 - k if turned else k
                h = bodies - 1
                parent[h] = below
                axis[h], quarters = axis_of(tables, row, which, hinges)
                # Seen from v the same edge turns back.
                turns[h] = -quarters if turned else quarters
                for x in range(3):
                    point2[h, x] = row["edge_a"][x] if which == 0 else row["second_edge_a"][x]
                joint[h, 0] = row["v"] if turned else row["u"]
                joint[h, 1] = row["u"] if turned else row["v"]
                joint[h, 2] = row["joint"]
                below = bodies
                bodies += 1
            index[other] = below
    for v in range(len(label)):
        body[v] = index[label[v]]


@njit(cache=True)
def loose_pieces(rows: HingeRows, clusters: int, tries: int, generator: NDArray[np.uint64]) -> int:
    """Fewest pieces that a few random choices of hinges leave, less one.

    Parameters
    ----------
    rows : (k,) array of :data:`fabfold.tree.possible_hinges.HINGE_ROW`
        Possible hinges.
    clusters : int
        Number of rigid clusters.
    tries : int
        Most spanning trees drawn.
    generator : (1,) uint64 array
        Random state, advanced.

    Returns
    -------
    int
        0 where some choice joins all clusters.
    """
    preference = np.zeros(len(rows))
    chosen = np.empty(clusters, np.int32)
    least = clusters
    for _ in range(tries):
        least = min(least, spanning_tree(rows, clusters, preference, generator, chosen))
        if least == 1:
            break
    return least - 1


@njit(cache=True)
def energy_if_joined(
    tables: Tables,
    pose: NDArray[np.int32],
    empty_face: float,
    hinges: HingeTables,
    piece_penalty: float,
    threshold: float,
    best: float,
    generator: NDArray[np.uint64],
    label: NDArray[np.int32],
    hinge_rows: HingeRows,
) -> tuple[float, int]:
    """Energy of changed poses with the penalty for loose pieces, where they are worth a look.

    Parameters
    ----------
    tables : Tables
        Tables of the problem.
    pose : (n,) int32 array
        Full set of poses.
    empty_face : float
        Weighted energy of one boundary face of an empty template cell.
    hinges : HingeTables
        From :func:`fabfold.tree.swept_cells.hinge_tables`.
    piece_penalty : float
        Energy added for each piece, after the first, into which hinges that can turn leave the
        whole.
    threshold : float
        Greatest energy that counts.
    best : float
        Only less than this counts.
    generator : (1,) uint64 array
        Random state, advanced.
    label : (n,) int32 array
        Room for the cluster of each voxel.
    hinge_rows : (k,) array of :data:`fabfold.tree.possible_hinges.HINGE_ROW`
        Room for the possible hinges.

    Returns
    -------
    energy : float
        With the penalty; infinite where it does not count, or no tree can join the poses.
    left : int
        Pieces, less one, that the penalty counts.
    """
    energy, _ = energy_of(tables, pose, empty_face)
    if energy > threshold or energy >= best or count_defects(tables, pose) > 0:
        return np.inf, 0
    clusters, rows = find_hinges(tables, pose, hinges, label, hinge_rows)
    left = loose_pieces(hinge_rows[:rows], clusters, 4, generator)
    energy += piece_penalty * left
    if energy > threshold or energy >= best:
        return np.inf, 0
    return energy, left
