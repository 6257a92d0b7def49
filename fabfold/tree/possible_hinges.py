"""Which hinges could join the rigid clusters of a full set of poses.

Two voxels that share a face in the source, and that lie in different clusters, can carry a hinge
where a joint type leads from one pose to the other. :func:`find_hinges` lists every such hinge as a
record of type :data:`HINGE_ROW`, but for those that cannot turn or would lie on material that two
voxels share. Spanning trees are chosen from these records (:mod:`fabfold.tree.spanning_trees`).
"""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.tree.cell_occupancy import mark_sharing_voxels
from fabfold.tree.pose_energy import label_clusters
from fabfold.tree.swept_cells import HingeTables, double_blocked, single_blocked
from fabfold.tree.tables import Tables

__all__ = ["HINGE_ROW", "HingeRows", "find_hinges", "max_hinge_rows"]

#: One possible hinge.
#:
#: - ``u``, ``v``: its two voxels. ``cluster_u``, ``cluster_v``: their rigid clusters.
#: - ``face``: the face of u that v stands on. ``joint``: the joint type.
#: - ``realization``: the row of ``Tables.realization`` with its sides and turns.
#: - ``edge_a``, ``edge_b``: twice the middle of the lattice edge of its axis in A and in B. Where
#:   the template folds once more or keeps hinges inside, ``edge_b`` is the number of the edge in
#:   ``Tables.final_edge`` and two zeros.
#: - ``double``: whether it has a second axis. Only then the last three are defined:
#: - ``second_edge_a``, ``second_edge_b``: the same for the second axis.
#: - ``plate_b``: twice the middle of the link plate in B.
HINGE_ROW = np.dtype(
    [
        ("u", np.int32),
        ("v", np.int32),
        ("cluster_u", np.int32),
        ("cluster_v", np.int32),
        ("face", np.int32),
        ("joint", np.int32),
        ("edge_a", np.int32, (3,)),
        ("edge_b", np.int32, (3,)),
        ("realization", np.int32),
        ("double", np.bool_),
        ("second_edge_a", np.int32, (3,)),
        ("second_edge_b", np.int32, (3,)),
        ("plate_b", np.int32, (3,)),
    ],
    align=True,
)

#: Array of records of type :data:`HINGE_ROW`.
HingeRows = NDArray[np.void]


@njit(cache=True)
def max_hinge_rows(tables: Tables) -> int:
    """Most hinges that :func:`find_hinges` can find.

    Parameters
    ----------
    tables : Tables
        Tables of the problem.

    Returns
    -------
    int
        Number of records to make room for.
    """
    most = 1
    for f in range(6):
        for j in range(tables.child_pose.shape[2]):
            most = max(most, tables.realization_start[f, j + 1] - tables.realization_start[f, j])
    return 3 * len(tables.source) * most


@njit(cache=True)
def _joint_between(tables: Tables, u: int, f: int, v: int, pose: NDArray[np.int32]) -> int:
    """Joint type that carries `v`, across face `f` of `u`, to its pose; -1 for none."""
    for j in range(tables.child_pose.shape[2]):
        if tables.allowed[u, f, j] and tables.child_pose[f, pose[u], j] == pose[v]:
            return j
    return -1


@njit(cache=True)
def _middle_in_template(
    tables: Tables,
    q: int,
    first: NDArray[np.int32],
    second: NDArray[np.int32],
    out: NDArray[np.int32],
) -> None:
    """Where the point half-way to ``first + second`` from a voxel at pose q comes, doubled."""
    rotation = tables.rotations[q % 24]
    cell = tables.cells[q // 24]
    for x in range(3):
        out[x] = 2 * cell[x]
        for y in range(3):
            out[x] += rotation[x, y] * (first[y] + second[y])


@njit(cache=True)
def _final_edge(
    tables: Tables,
    q: int,
    d: NDArray[np.int32],
    n: NDArray[np.int32],
    out: NDArray[np.int32],
) -> bool:
    """The edge on side n of face d of the voxel at pose q; whether a hinge may lie there.

    `out` gets what ``edge_b`` of :data:`HINGE_ROW` holds.
    """
    _middle_in_template(tables, q, d, n, out)
    if tables.final_edge.shape[0] == 0:
        return True
    out[0] = tables.final_edge[out[0] + 1, out[1] + 1, out[2] + 1]
    out[1] = 0
    out[2] = 0
    return out[0] >= 0


@njit(cache=True)
def _lies_in_own_octants(
    tables: Tables, shares_cell: NDArray[np.bool_], u: int, v: int, f: int, side: int, double: bool
) -> bool:
    """Whether a hinge keeps to the octants of its voxels, where one of them shares its cell."""
    if not shares_cell[u] and not shares_cell[v]:
        return True
    if double:
        return False
    # Rotation 0 is shape A.
    first = tables.edge_octants[f, side]
    second = tables.edge_octants[f ^ 1, side]
    if shares_cell[u] and (tables.octant_mask[u, 0] & first) != first:
        return False
    return not shares_cell[v] or (tables.octant_mask[v, 0] & second) == second


@njit(cache=True)
def _members(
    label: NDArray[np.int32], clusters: int
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Voxels sorted by cluster, and where each cluster starts; (n,) and (clusters + 1,)."""
    count = len(label)
    start = np.zeros(clusters + 1, np.int32)
    for v in range(count):
        start[label[v] + 1] += 1
    for c in range(clusters):
        start[c + 1] += start[c]
    member = np.empty(count, np.int32)
    at = start.copy()
    for v in range(count):
        member[at[label[v]]] = v
        at[label[v]] += 1
    return member, start


@njit(cache=True)
def find_hinges(
    tables: Tables,
    pose: NDArray[np.int32],
    hinges: HingeTables,
    label: NDArray[np.int32],
    found: HingeRows,
) -> tuple[int, int]:
    """Rigid clusters and the hinges that could join them.

    Hinges whose turn would run the two clusters into each other are left out. So are those of a
    voxel that shares its cell, but for single hinges in its own octants: knuckles and bracket need
    the two beside the edge.

    Parameters
    ----------
    tables : Tables
        Tables of the problem.
    pose : (n,) int32 array
        Full set of poses.
    hinges : HingeTables
        From :func:`fabfold.tree.swept_cells.hinge_tables`.
    label : (n,) int32 array
        Filled with the cluster of each voxel.
    found : (:func:`max_hinge_rows`,) array of :data:`HINGE_ROW`
        Its first records are filled, one for each hinge.

    Returns
    -------
    clusters : int
        Number of rigid clusters.
    rows : int
        Number of records filled.
    """
    clusters = label_clusters(tables, pose, label)
    member, start = _members(label, clusters)
    first = np.empty(3, np.int32)
    second = np.empty(3, np.int32)
    shares_cell = np.zeros(len(pose), np.bool_)
    sharing = tables.max_shared > 0
    if sharing:
        mark_sharing_voxels(tables, pose, shares_cell)
    rows = 0
    for u in range(len(pose)):
        for f in range(0, 6, 2):
            v = tables.neighbour[u, f]
            if v < 0 or label[u] == label[v]:
                continue
            j = _joint_between(tables, u, f, v, pose)
            if j < 1:
                continue
            ours = member[start[label[u]] : start[label[u] + 1]]
            theirs = member[start[label[v]] : start[label[v] + 1]]
            at = tables.source[u]
            d = hinges.faces[f]
            for w in range(tables.realization_start[f, j], tables.realization_start[f, j + 1]):
                side = hinges.sides[f, tables.realization[w, 0]]
                n = hinges.faces[side]
                turns = tables.realization[w, 1]
                double = tables.realization[w, 2] >= 0
                if not _final_edge(tables, pose[u], d, n, first):
                    continue
                if sharing and not _lies_in_own_octants(tables, shares_cell, u, v, f, side, double):
                    continue
                if double:
                    m = hinges.faces[hinges.sides[f, tables.realization[w, 2]]]
                    if not _final_edge(tables, pose[v], hinges.faces[f ^ 1], m, second):
                        continue
                    if double_blocked(
                        tables.source, ours, theirs, at, d, n, turns, m, tables.realization[w, 3],
                        hinges.quarter_turn,
                    ):  # fmt: skip
                        continue
                    _fill_second_axis(tables, pose[u], at, d, n, turns, m, second, found[rows])
                else:
                    swept = hinges.half_turn if turns == 2 else hinges.quarter_turn
                    if single_blocked(tables.source, ours, theirs, at, d, n, swept):
                        continue
                row = found[rows]
                row["u"] = u
                row["v"] = v
                row["cluster_u"] = label[u]
                row["cluster_v"] = label[v]
                row["face"] = f
                row["joint"] = j
                row["realization"] = w
                row["double"] = double
                for x in range(3):
                    row["edge_a"][x] = 2 * at[x] + d[x] + n[x]
                    row["edge_b"][x] = first[x]
                rows += 1
    return clusters, rows


@njit(cache=True)
def _fill_second_axis(
    tables: Tables,
    q: int,
    at: NDArray[np.int32],
    d: NDArray[np.int32],
    n: NDArray[np.int32],
    turns: int,
    m: NDArray[np.int32],
    final_edge: NDArray[np.int32],
    row: np.void,
) -> None:
    """Fill the second axis and the link plate of a double hinge.

    Parameters
    ----------
    tables : Tables
        Tables of the problem.
    q : int
        Pose of the parent voxel.
    at : (3,) int32 array
        Source cell of the parent voxel.
    d, n, m : (3,) int32 arrays
        Direction to the child voxel, side of the first axis, side of the second axis.
    turns : int
        Quarter turns about the first axis, 1 to 3.
    final_edge : (3,) int32 array
        What ``second_edge_b`` is to hold.
    row : record of :data:`HINGE_ROW`
        Filled in place.
    """
    plate = np.empty(3, np.int32)
    for x in range(3):
        row["second_edge_a"][x] = 2 * at[x] + d[x] + m[x]
        row["second_edge_b"][x] = final_edge[x]
        # The plate reaches from its first axis along -n, d, n, -d by turns.
        plate[x] = n[x] + (n[x] if turns == 2 else (2 - turns) * d[x])
    _middle_in_template(tables, q, d, plate, row["plate_b"])
