"""From poses to joints: rigid clusters, possible hinges, and random spanning trees of them."""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.tree.cell_occupancy import find_guests
from fabfold.tree.grow import clusters, pieces
from fabfold.tree.problem import Tables
from fabfold.tree.rng import random_float
from fabfold.tree.swept_cells import HingeTables, blocked, double_blocked

__all__ = [
    "COLUMNS",
    "apart",
    "candidates",
    "hinge_rows",
    "loose_pieces",
    "rooted",
    "spanning_tree",
]

#: Columns of the table of possible hinges, see :func:`candidates`.
COLUMNS = 24
#: How much later than single ones double hinges are tried, against a uniform(0, 1).
_LATER = 0.5


@njit(cache=True)
def relation(tables: Tables, u: int, f: int, v: int, pose: NDArray[np.int32]) -> int:
    """Joint type that carries `v`, across face `f` of `u`, to its pose; -1 for none."""
    for j in range(tables.step.shape[1]):
        if tables.allowed[u, f, j] and tables.step[f, j, pose[u]] == pose[v]:
            return j
    return -1


@njit(cache=True)
def apart(tables: Tables, pose: NDArray[np.int32]) -> int:
    """Voxels without a place, plus the pieces, less one, that the possible joints leave.

    Zero for a full set of poses that some tree joins.
    """
    left = pieces(tables, pose, tables.step.shape[1] - 1, np.empty(len(pose), np.int32))
    for v in range(len(pose)):
        if pose[v] < 0:
            left += 1
    return left - 1


@njit(cache=True)
def hinge_rows(tables: Tables) -> int:
    """Most rows that :func:`candidates` can fill."""
    most = 1
    for f in range(6):
        for j in range(tables.step.shape[1]):
            most = max(most, tables.way_start[f, j + 1] - tables.way_start[f, j])
    return 3 * len(tables.source) * most


@njit(cache=True)
def _edge_in_template(
    tables: Tables,
    q: int,
    first: NDArray[np.int32],
    second: NDArray[np.int32],
    out: NDArray[np.int32],
) -> None:
    """Where half-way to ``first + second`` from the voxel at pose q comes, doubled."""
    rotation = tables.rotations[q % 24]
    cell = tables.cells[q // 24]
    for x in range(3):
        out[x] = 2 * cell[x]
        for y in range(3):
            out[x] += rotation[x, y] * (first[y] + second[y])


@njit(cache=True)
def _hinge_fits(
    tables: Tables, guest: NDArray[np.bool_], u: int, v: int, f: int, side: int, double: bool
) -> bool:
    """Whether a hinge leaves alone what its voxels share: see :func:`candidates`."""
    if not guest[u] and not guest[v]:
        return True
    if double:
        return False
    # Rotation 0 is shape A.
    first = tables.beside[f, side]
    second = tables.beside[f ^ 1, side]
    if guest[u] and (tables.mask[u, 0] & first) != first:
        return False
    return not guest[v] or (tables.mask[v, 0] & second) == second


@njit(cache=True)
def _resting_edge(
    tables: Tables,
    q: int,
    d: NDArray[np.int32],
    n: NDArray[np.int32],
    out: NDArray[np.int32],
) -> bool:
    """The edge on side n of face d of the voxel at pose q; whether a hinge may lie there.

    `out` gets its middle in B, doubled; where the template folds once more, a number for the edge
    on which it ends.
    """
    _edge_in_template(tables, q, d, n, out)
    if tables.hinged.shape[0] == 0:
        return True
    out[0] = tables.hinged[out[0] + 1, out[1] + 1, out[2] + 1]
    out[1] = 0
    out[2] = 0
    return out[0] >= 0


@njit(cache=True)
def candidates(  # noqa: PLR0912, PLR0915 - one row of the table after the other
    tables: Tables,
    pose: NDArray[np.int32],
    hinges: HingeTables,
    label: NDArray[np.int32],
    found: NDArray[np.int32],
) -> tuple[int, int]:
    """Rigid clusters and the hinges that could join them.

    Hinges whose turn would run the two clusters into each other are left out. So are those of a
    voxel that shares its cell, but for single hinges in its own eighths: knuckles and bracket need
    the two beside the edge.

    Parameters
    ----------
    tables, pose
        A full set of poses.
    hinges : HingeTables
    label : (n,) int32 array
        Filled with the cluster of each voxel.
    found : (:func:`hinge_rows`, 24) int32 array
        Filled with one row a hinge: 0, 1 voxels u and v; 2, 3 their clusters; 4 face of u; 5 joint
        type; 6 to 8 twice the middle of its lattice edge in A, 9 to 11 in B (or the number in
        ``Tables.hinged``, and zeros); 12 its row of
        ``Tables.way``; 13 whether it is double, and if so, 14 to 19 the edge of the second axis in
        A and B, and 20 to 22 twice the middle of the link plate in B.

    Returns
    -------
    number_of_clusters, number_of_hinges : int
    """
    count = len(pose)
    total = clusters(tables, pose, label)
    start = np.zeros(total + 1, np.int32)
    for v in range(count):
        start[label[v] + 1] += 1
    for c in range(total):
        start[c + 1] += start[c]
    member = np.empty(count, np.int32)
    at = start.copy()
    for v in range(count):
        member[at[label[v]]] = v
        at[label[v]] += 1
    plate = np.empty(3, np.int32)
    first = np.empty(3, np.int32)
    second = np.empty(3, np.int32)
    guest = np.zeros(count, np.bool_)
    sharing = tables.shares > 0
    if sharing:
        find_guests(tables, pose, guest)
    rows = 0
    for u in range(count):
        for f in range(0, 6, 2):
            v = tables.neighbour[u, f]
            if v < 0 or label[u] == label[v]:
                continue
            j = relation(tables, u, f, v, pose)
            if j < 1:
                continue
            a, b = label[u], label[v]
            ours = member[start[a] : start[a + 1]]
            theirs = member[start[b] : start[b + 1]]
            d = hinges.faces[f]
            back = hinges.faces[f ^ 1]
            for w in range(tables.way_start[f, j], tables.way_start[f, j + 1]):
                n = hinges.faces[hinges.sides[f, tables.way[w, 0]]]
                turns = tables.way[w, 1]
                double = tables.way[w, 2] >= 0
                if not _resting_edge(tables, pose[u], d, n, first):
                    continue
                side = hinges.sides[f, tables.way[w, 0]]
                if sharing and not _hinge_fits(tables, guest, u, v, f, side, double):
                    continue
                if not double:
                    table = hinges.swept if turns == 2 else hinges.quarter
                    if blocked(tables.source, ours, theirs, tables.source[u], d, n, table):
                        continue
                else:
                    m = hinges.faces[hinges.sides[f, tables.way[w, 2]]]
                    if not _resting_edge(tables, pose[v], back, m, second):
                        continue
                    if double_blocked(
                        tables.source,
                        ours,
                        theirs,
                        tables.source[u],
                        d,
                        n,
                        turns,
                        m,
                        tables.way[w, 3],
                        hinges.quarter,
                    ):
                        continue
                row = found[rows]
                row[0] = u
                row[1] = v
                row[2] = a
                row[3] = b
                row[4] = f
                row[5] = j
                row[12] = w
                row[13] = double
                for x in range(3):
                    row[6 + x] = 2 * tables.source[u, x] + d[x] + n[x]
                    row[9 + x] = first[x]
                if double:
                    for x in range(3):
                        row[14 + x] = 2 * tables.source[u, x] + d[x] + m[x]
                        row[17 + x] = second[x]
                        # The plate reaches from its first axis along -n, d, n, -d by turns.
                        plate[x] = n[x] + (n[x] if turns == 2 else (2 - turns) * d[x])
                    _edge_in_template(tables, pose[u], d, plate, row[20:23])
                rows += 1
    return total, rows


@njit(cache=True)
def _root(link: NDArray[np.int32], a: int) -> int:
    while link[a] != a:
        link[a] = link[link[a]]
        a = link[a]
    return a


@njit(cache=True)
def _alike(row: NDArray[np.int32], a: int, other: NDArray[np.int32], b: int) -> bool:
    return row[a] == other[b] and row[a + 1] == other[b + 1] and row[a + 2] == other[b + 2]


@njit(cache=True)
def _clash(row: NDArray[np.int32], other: NDArray[np.int32]) -> bool:
    """Whether two hinges want one lattice edge in A or in the end, one plate's face, one voxel."""
    if _alike(row, 6, other, 6) or _alike(row, 9, other, 9):
        return True
    if row[13] != 0 and (_alike(row, 14, other, 6) or _alike(row, 17, other, 9)):
        return True
    if other[13] == 0:
        return False
    if _alike(row, 6, other, 14) or _alike(row, 9, other, 17):
        return True
    if row[13] == 0:
        return False
    return (
        row[0] == other[0]
        or row[0] == other[1]
        or row[1] == other[0]
        or row[1] == other[1]
        or _alike(row, 14, other, 14)
        or _alike(row, 17, other, 17)
        or _alike(row, 20, other, 20)
    )


@njit(cache=True)
def spanning_tree(
    found: NDArray[np.int32],
    rows: int,
    total: int,
    wanted: NDArray[np.float64],
    generator: NDArray[np.uint64],
    chosen: NDArray[np.int32],
) -> int:
    """Random spanning tree of the clusters.

    No two of its hinges share a lattice edge segment in A or in the end, and no voxel has two
    double hinges (paper section 4.1, joint collision). Single hinges are preferred.

    Parameters
    ----------
    found : (k, 24) int32 array
        From :func:`candidates`; the first `rows` rows count.
    total : int
        Number of clusters.
    wanted : (k,) float64 array
        Hinges are tried by ascending ``wanted + uniform(0, 1)``, double ones 0.5 later.
    chosen : (total - 1,) int32 array
        Filled with rows of `found`.

    Returns
    -------
    int
        Number of pieces that remain: 1 when the tree spans.
    """
    link = np.arange(total).astype(np.int32)
    order = np.empty(rows)
    for i in range(rows):
        order[i] = wanted[i] + random_float(generator)
        if found[i, 13] != 0:
            order[i] += _LATER
    kept = 0
    for row in np.argsort(order):
        if kept == total - 1:
            break
        a = _root(link, found[row, 2])
        b = _root(link, found[row, 3])
        if a == b:
            continue
        clash = False
        for i in range(kept):
            if _clash(found[row], found[chosen[i]]):
                clash = True
                break
        if clash:
            continue
        link[a] = b
        chosen[kept] = row
        kept += 1
    return total - kept


@njit(cache=True)
def rooted(
    tables: Tables,
    found: NDArray[np.int32],
    chosen: NDArray[np.int32],
    label: NDArray[np.int32],
    total: int,
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
    tables, found, chosen, label, total
        From :func:`candidates` and :func:`spanning_tree`.
    body : (n,) int32 array
        Filled with the body of each voxel; body 0 is the root.
    parent, point2, axis, turns : (h,), (h, 3), (h,), (h,) arrays
        Filled for each axis: parent body, twice the middle of its lattice edge, axis 0 to 2,
        signed quarter turns about the positive axis. ``h`` is ``total - 1`` and one more for each
        double hinge.
    joint : (h, 3) int32 array
        Filled with the parent voxel, the child voxel and the joint type.
    """
    size = np.zeros(total, np.int32)
    for v in range(len(label)):
        size[label[v]] += 1
    index = np.full(total, -1, np.int32)
    queue = np.empty(total, np.int32)
    first = 0
    for c in range(total):
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
        for i in range(total - 1):
            row = found[chosen[i]]
            if row[2] == here and index[row[3]] < 0:
                other = row[3]
                turned = False
            elif row[3] == here and index[row[2]] < 0:
                other = row[2]
                turned = True
            else:
                continue
            queue[tail] = other
            tail += 1
            axes = 2 if row[13] != 0 else 1
            below = index[here]
            d = hinges.faces[row[4]]
            d_axis = row[4] >> 1
            for k in range(axes):
                # Seen from v the second axis comes first.
                which = axes - 1 - k if turned else k
                side = hinges.sides[row[4], tables.way[row[12], 2 * which]]
                quarters = tables.way[row[12], 2 * which + 1]
                n_axis = side >> 1
                h = bodies - 1
                parent[h] = below
                axis[h] = 3 - d_axis - n_axis
                # Component of d x n along the positive axis; seen from v the same edge turns back.
                sign = d[d_axis] * hinges.faces[side, n_axis]
                if (d_axis + 1) % 3 != n_axis:
                    sign = -sign
                turns[h] = -quarters * sign if turned else quarters * sign
                for x in range(3):
                    point2[h, x] = row[6 + 8 * which + x]
                joint[h, 0] = row[1] if turned else row[0]
                joint[h, 1] = row[0] if turned else row[1]
                joint[h, 2] = row[5]
                below = bodies
                bodies += 1
            index[other] = below
    for v in range(len(label)):
        body[v] = index[label[v]]


@njit(cache=True)
def loose_pieces(
    found: NDArray[np.int32],
    rows: int,
    total: int,
    tries: int,
    generator: NDArray[np.uint64],
) -> int:
    """Fewest pieces that a few random choices of hinges leave, less one."""
    wanted = np.zeros(rows)
    chosen = np.empty(total, np.int32)
    least = total
    for _ in range(tries):
        least = min(least, spanning_tree(found, rows, total, wanted, generator, chosen))
        if least == 1:
            break
    return least - 1
