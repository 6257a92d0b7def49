"""Simulated annealing of poses by swaps: two voxels change places, or one takes an empty cell.

In a phase (:mod:`fabfold.tree.phases`) the cell of a voxel gives its rotation, or leaves a few. So
a set of poses is a permutation of cells, and changing two places is the least step there is. It
costs a microsecond, and what no joint joins meanwhile is a penalty and no obstacle.
"""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.tree.possible_hinges import HINGE_ROW, find_hinges, max_hinge_rows
from fabfold.tree.rng import random_below, random_float
from fabfold.tree.spanning_trees import loose_pieces
from fabfold.tree.swept_cells import HingeTables
from fabfold.tree.tables import Tables

__all__ = ["anneal_swaps"]

#: Share of swaps that bring a voxel beside a source neighbour, as a joint would.
_BESIDE_NEIGHBOUR = 0.7
#: Penalty for each voxel that is not in the largest piece, as a share of that for a piece: so large
#: pieces are worn down by what lies at their rims.
_OUTSIDE = 0.1
#: What could join two voxels where they lie.
_NONE, _RIGID, _SINGLE, _DOUBLE = 0, 1, 2, 3
#: Rounding of a bound, so that it never rules out what the sum itself would let pass.
_EVEN = 1e-9


@njit(cache=True)
def _face_pairs(
    neighbour: NDArray[np.int32],
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Source neighbours as pairs (u, v, face of u), and the pair of each voxel and face, or -1."""
    count = len(neighbour)
    pairs = np.empty((3 * count, 3), np.int32)
    pair_at = np.full((count, 6), -1, np.int32)
    size = 0
    for u in range(count):
        for f in range(0, 6, 2):
            v = neighbour[u, f]
            if v >= 0:
                pairs[size, 0], pairs[size, 1], pairs[size, 2] = u, v, f
                pair_at[u, f] = pair_at[v, f ^ 1] = size
                size += 1
    return pairs[:size], pair_at


@njit(cache=True)
def _joint_kind(
    allowed: NDArray[np.bool_],
    child_pose: NDArray[np.int32],
    last_single: int,
    u: int,
    f: int,
    here: int,
    there: int,
) -> int:
    """What could join voxel u to what lies behind its face: `_NONE`, `_RIGID` and so on."""
    for j in range(allowed.shape[2]):
        if child_pose[f, here, j] == there and allowed[u, f, j]:
            if j == 0:
                return _RIGID
            return _DOUBLE if j > last_single else _SINGLE
    return _NONE


@njit(cache=True)
def _look_anew(
    v: int,
    but: int,
    pairs: NDArray[np.int32],
    pair_at: NDArray[np.int32],
    allowed: NDArray[np.bool_],
    child_pose: NDArray[np.int32],
    pose: NDArray[np.int32],
    last_single: int,
    kept: NDArray[np.int8],
    kind: NDArray[np.int8],
) -> tuple[int, int, int, int]:
    """Bring `kind` of the pairs of a voxel up to date, but for that with `but`.

    Returns
    -------
    rigid, joined, new_rigid, new_joined : int
        Of these pairs those that could be rigid, and those that any joint could join: by `kept`,
        and as they are now.
    """
    rigid = joined = new_rigid = new_joined = 0
    for f in range(6):
        e = pair_at[v, f]
        if e < 0:
            continue
        a, b = pairs[e, 0], pairs[e, 1]
        if a + b - v != but:
            new = _joint_kind(allowed, child_pose, last_single, a, pairs[e, 2], pose[a], pose[b])
            kind[e] = new
            rigid += kept[e] == _RIGID
            joined += kept[e] != _NONE
            new_rigid += new == _RIGID
            new_joined += new != _NONE
    return rigid, joined, new_rigid, new_joined


@njit(cache=True)
def _copy_kinds(
    v: int, pair_at: NDArray[np.int32], source: NDArray[np.int8], target: NDArray[np.int8]
) -> None:
    """Copy what could join the pairs of a voxel: to work it out again takes longer."""
    for f in range(6):
        e = pair_at[v, f]
        if e >= 0:
            target[e] = source[e]


@njit(cache=True)
def _join(
    ends: NDArray[np.uint32], kind: NDArray[np.int8], wanted: int, link: NDArray[np.uint32]
) -> int:
    """Join all pairs of one kind; by how much that lessens the number of pieces."""
    joined = 0
    for e in range(len(kind)):
        if kind[e] == wanted:
            a, b = ends[e, 0], ends[e, 1]
            while link[a] != a:
                link[a] = link[link[a]]
                a = link[a]
            while link[b] != b:
                link[b] = link[link[b]]
                b = link[b]
            if a != b:
                link[a] = b
                joined += 1
    return joined


@njit(cache=True, inline="always")  # a call would cost a sixth of the swap
def _count(
    ends: NDArray[np.uint32],
    kind: NDArray[np.int8],
    doubles: bool,
    link: NDArray[np.uint32],
    size: NDArray[np.int32],
) -> tuple[int, int, int, int]:
    """Rigid clusters, pieces that single hinges leave and that all joints leave, voxels outside.

    The last are those that are not in the largest piece. `link` and `size` are work space.
    """
    count = len(link)
    for v in range(count):
        link[v] = v
    clusters = count - _join(ends, kind, _RIGID, link)
    singles = clusters - _join(ends, kind, _SINGLE, link)
    pieces = singles - (_join(ends, kind, _DOUBLE, link) if doubles else 0)
    if pieces == 1:
        return clusters, singles, pieces, 0
    size[:] = 0
    most = 0
    for above in link:
        root = above
        while link[root] != root:
            root = link[root]
        size[root] += 1
        most = max(most, size[root])
    return clusters, singles, pieces, count - most


@njit(cache=True)
def _propose(
    neighbour: NDArray[np.int32],
    allowed: NDArray[np.bool_],
    child_pose: NDArray[np.int32],
    pose: NDArray[np.int32],
    occupant: NDArray[np.int32],
    turns: NDArray[np.int8],
    v: int,
    generator: NDArray[np.uint64],
) -> tuple[int, int, int]:
    """Another pose for voxel v, who sits there (-1 for nobody), and the pose that one would get.

    The first is -1 where the draw came to nothing.
    """
    most = turns.shape[2]
    here = pose[v] // 24
    q = -1
    if random_float(generator) < _BESIDE_NEIGHBOUR:
        f = random_below(generator, 6)
        u = neighbour[v, f]
        if u < 0:
            return -1, -1, -1
        j = random_below(generator, child_pose.shape[2])
        if allowed[u, f ^ 1, j]:
            q = child_pose[f ^ 1, pose[u], j]
    else:
        c = random_below(generator, len(occupant))
        r = turns[v, c, random_below(generator, most) if most > 1 else 0]
        if r >= 0:
            q = 24 * c + r
    if q < 0 or q == pose[v]:
        return -1, -1, -1
    w = occupant[q // 24]
    if w < 0 or w == v:
        return q, -1, -1
    r = turns[w, here, random_below(generator, most) if most > 1 else 0]
    if r < 0:
        return -1, -1, -1
    return q, w, 24 * here + r


@njit(cache=True)
def _torn_pairs(tables: Tables, pose: NDArray[np.int32]) -> int:
    """Number of faces across which voxels that must stay rigid are not."""
    torn = 0
    for v in range(len(tables.always_rigid)):
        for f in range(0, 6, 2):
            if tables.always_rigid[v, f]:
                u = tables.neighbour[v, f]
                torn += tables.child_pose[f, pose[v], 0] != pose[u]
    return torn


@njit(cache=True)
def _loose(
    tables: Tables,
    pose: NDArray[np.int32],
    hinges: HingeTables,
    hinge_rows: NDArray[np.void],
    label: NDArray[np.int32],
    generator: NDArray[np.uint64],
) -> int:
    """Pieces, less one, that hinges that can turn leave."""
    clusters, rows = find_hinges(tables, pose, hinges, label, hinge_rows)
    return loose_pieces(hinge_rows[:rows], clusters, 4, generator)


@njit(cache=True)
def _surface_energy(tables: Tables, pose: NDArray[np.int32], empty_face: float) -> float:
    """Weighted energy of the surface, and of whatever else ``Tables.cost`` holds."""
    total = 0.0
    occupant = _occupants(pose, len(tables.cells))
    for cell in range(len(occupant)):
        v = occupant[cell]
        if v >= 0:
            total += np.float64(tables.cost[v, pose[v]])
            continue
        for f in range(6):
            if tables.cell_neighbour[cell, f] < 0:
                total += empty_face
    return total


@njit(cache=True)
def _occupants(pose: NDArray[np.int32], cells: int) -> NDArray[np.int32]:
    """The voxel in each cell, -1 for none."""
    occupant = np.full(cells, -1, np.int32)
    for v in range(len(pose)):
        occupant[pose[v] // 24] = v
    return occupant


@njit(cache=True)
def anneal_swaps(  # noqa: PLR0912, PLR0915 - one loop, kept whole for speed
    tables: Tables,
    pose: NDArray[np.int32],
    turns: NDArray[np.int8],
    empty_face: float,
    hinges: HingeTables,
    piece_penalty: float,
    threshold: float,
    focus: NDArray[np.int32],
    steps: int,
    hot: float,
    cold: float,
    turning_from: float,
    generator: NDArray[np.uint64],
    out: NDArray[np.int32],
) -> tuple[int, float, int]:
    """Swap voxels: by simulated annealing, or until the energy is at most a threshold.

    Parameters
    ----------
    tables : Tables
        Tables of a problem in which no two voxels share a cell.
    pose : (n,) int32 array
        Full set of poses to start from.
    turns : (n, m, k) int8 array
        Rotations of each voxel in each cell, one of :func:`fabfold.tree.phases.phase_rotations`.
    empty_face : float
        Weighted energy of one boundary face of an empty template cell.
    hinges : HingeTables
        From :func:`fabfold.tree.swept_cells.hinge_tables`.
    piece_penalty : float
        Energy added for each piece, after the first, that hinges leave.
    threshold : float
        Greatest energy, with the penalty, of a result: the first swap that leads there is the
        answer. Infinite to anneal.
    focus : (k,) int32 array
        Voxels to swap; empty for all.
    steps : int
        Swaps drawn.
    hot, cold : float
        First and last temperature of an annealing.
    turning_from : float
        Share of an annealing after which only hinges that can turn count as joints.
    generator : (1,) uint64 array
        Random state, advanced.
    out : (n,) int32 array
        Filled with the new poses.

    Returns
    -------
    used : int
        Swaps drawn.
    energy : float
        Of `out`, with the penalty; infinite when nothing was found.
    left : int
        Pieces of `out`, less one, that hinges that can turn leave.
    """
    neighbour, allowed, child_pose = tables.neighbour, tables.allowed, tables.child_pose
    cost, cell_neighbour = tables.cost, tables.cell_neighbour
    count = len(pose)
    label = np.empty(count, np.int32)
    link, size = np.empty(count, np.uint32), np.empty(count, np.int32)
    hinge_rows = np.empty(max_hinge_rows(tables), HINGE_ROW)
    now = pose.copy()
    occupant = _occupants(now, len(tables.cells))
    surface = _surface_energy(tables, now, empty_face)
    last_single = tables.last_single
    weight = tables.joint_weight[1]
    more = 0.0
    doubles = last_single + 1 < len(tables.joint_weight)
    if doubles:
        more = tables.joint_weight[last_single + 1] - weight
    annealing = threshold == np.inf
    rigid_pairs = len(tables.always_rigid) > 0
    turning = not annealing
    pairs, pair_at = _face_pairs(neighbour)
    ends = pairs[:, :2].astype(np.uint32)
    kind = np.empty(len(pairs), np.int8)
    for e in range(len(pairs)):
        a, b = pairs[e, 0], pairs[e, 1]
        kind[e] = _joint_kind(allowed, child_pose, last_single, a, pairs[e, 2], now[a], now[b])
    kept = kind.copy()  # `kind` before the swap that is looked at
    clusters, singles, pieces, outside = _count(ends, kind, doubles, link, size)
    joints = weight * (clusters - 1) + more * (singles - 1)
    left = pieces - 1 + (_torn_pairs(tables, now) if rigid_pairs else 0)
    best, best_left = np.inf, count
    limit = threshold
    draw = 0.0
    for step in range(steps):
        done = step / steps
        if annealing:
            if not turning and done >= turning_from:
                turning = True
                if left == 0:
                    left = _loose(tables, now, hinges, hinge_rows, label, generator)
                best_left, best = left, surface + joints + (piece_penalty + count) * left
                out[:] = now
            draw = random_float(generator)
        v = random_below(generator, count)
        if len(focus) > 0:
            v = focus[random_below(generator, len(focus))]
        q, w, p = _propose(neighbour, allowed, child_pose, now, occupant, turns, v, generator)
        if q < 0:
            continue
        if annealing:
            # Only now: most draws come to nothing, and powers and logarithms cost the most.
            limit = surface + joints + piece_penalty * (left + _OUTSIDE * outside)
            limit -= hot * (cold / hot) ** done * np.log(1.0 - draw)
        before, other = now[v], now[w] if w >= 0 else -1
        fresh = surface + np.float64(cost[v, q]) - np.float64(cost[v, before])
        if w >= 0:
            fresh += np.float64(cost[w, p]) - np.float64(cost[w, other])
        else:
            for f in range(6):
                if cell_neighbour[before // 24, f] < 0:
                    fresh += empty_face
                if cell_neighbour[q // 24, f] < 0:
                    fresh -= empty_face
        if fresh > limit:
            continue
        now[v] = q
        if w >= 0:
            now[w] = p
        # Taken out, a voxel leaves no fewer clusters and pieces, but for one where it was all
        # alone; put back, it is one more, less its joints. So there are at least so many:
        rigid, joined, new_rigid, new_joined = _look_anew(
            v, -1, pairs, pair_at, allowed, child_pose, now, last_single, kept, kind
        )
        least_clusters = clusters + (rigid > 0) - new_rigid
        least_pieces = pieces + (joined > 0) - new_joined
        if w >= 0:
            rigid, joined, new_rigid, new_joined = _look_anew(
                w, v, pairs, pair_at, allowed, child_pose, now, last_single, kept, kind
            )
            least_clusters += (rigid > 0) - new_rigid
            least_pieces += (joined > 0) - new_joined
        taken = False
        fresh_clusters = fresh_pieces = fresh_outside = fresh_left = 0
        fresh_joints = 0.0
        penalty = piece_penalty * max(least_pieces - 1, 0)
        if more < 0.0 or fresh + weight * max(least_clusters - 1, 0) + penalty <= limit + _EVEN:
            fresh_clusters, singles, fresh_pieces, fresh_outside = _count(
                ends, kind, doubles, link, size
            )
            fresh_joints = weight * (fresh_clusters - 1) + more * (singles - 1)
            fresh_left = fresh_pieces - 1
            extra = piece_penalty * _OUTSIDE * fresh_outside if annealing else 0.0
            if fresh + fresh_joints + piece_penalty * fresh_left + extra <= limit:
                if rigid_pairs:
                    fresh_left += _torn_pairs(tables, now)
                if turning and fresh_left == 0:
                    fresh_left = _loose(tables, now, hinges, hinge_rows, label, generator)
                taken = fresh + fresh_joints + piece_penalty * fresh_left + extra <= limit
        if not taken:
            now[v] = before
            if w >= 0:
                now[w] = other
                _copy_kinds(w, pair_at, kept, kind)
            _copy_kinds(v, pair_at, kept, kind)
            continue
        _copy_kinds(v, pair_at, kind, kept)
        if w >= 0:
            _copy_kinds(w, pair_at, kind, kept)
        clusters, pieces = fresh_clusters, fresh_pieces
        surface, joints, left, outside = fresh, fresh_joints, fresh_left, fresh_outside
        occupant[before // 24] = w
        occupant[q // 24] = v
        value = surface + joints + piece_penalty * left
        if not annealing:
            out[:] = now
            return step + 1, value, left
        # What does not hang together is worth less than anything that does.
        value += count * left
        if turning and value < best:
            best, best_left = value, left
            out[:] = now
    return steps, best - count * best_left if annealing else np.inf, best_left
