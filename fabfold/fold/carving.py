"""Which cells must lose material so that a path of cores is free, and which side gives way.

A path planned with the cores of cells (:mod:`fabfold.fold.cores`) drives some whole cells into each
other. Two cells that meet in a quarter turn lie in the same layer along its axis. Turned into one
quadrant of the plane across it, they run into each other exactly where, on one circle about the
axis, a point of the one, called *second* here, lies at no smaller an angle than a point of the
other, the *first*. Which of the two moves no longer matters.

So every ring of such a meeting is freed in one of two ways: the first loses all that lies behind
the farthest point of the second, or the second loses all that lies ahead of the nearest point of
the first. A cell that turns beside its neighbour is rounded to radius 1 in this way, and loses
1 - π/4 of its volume, 21 %. Only material counts: where a cell is empty, nothing must give way.

The choice is a covering problem. Its cost is the volume that is lost, counted once however many
meetings want it; what shows on the model's surface and the cells' cores cost more, and the brackets
that carry hinges are not to be had. It is solved greedily, the costliest meeting first, and then
improved meeting by meeting. The sides are chosen on the 20 x 20 x 20 subvoxels; what is cut in the
end is worked out on the solids (:mod:`fabfold.joinery.carving`).
"""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.fold.cores import CORE
from fabfold.fold.reference import poses, subtree
from fabfold.fold.sweep import arcs_overlap
from fabfold.tree.system import HingeSystem

__all__ = ["BRACKET", "Carving", "Meeting", "carved_path", "meetings_on", "plan_carving", "skin_of"]

F64 = NDArray[np.float64]

#: Side of a hinge's bracket across the axis and how far it stays from the ends of the lattice
#: edge, in voxel sides, with a little to spare: 4 of 20 mm and 2.8 of 20 mm.
BRACKET = (0.22, 0.12)
#: What a subvoxel of the model's surface, of a cell's core, and of a hinge costs; 1 elsewhere.
SKIN_COST, CORE_COST, HINGE_COST = 3.0, 2.0, 1e6
#: Subvoxels that count as surface, counted from the outside.
_SKIN_DEPTH = 2
#: Radii at which a meeting may change sides.
_SPLITS = 11
#: Meetings that may be worked out anew to improve a first choice.
_IMPROVEMENTS = 60_000
#: Prices of carving with which the planner is asked, see :func:`fabfold.fold.planner.plan`.
_PRICES = (0.3, 1.0, 0.05)


@dataclass(frozen=True)
class Meeting:
    """Two whole cells that run into each other in a quarter turn.

    The frame of a meeting has the axis of the turn as its third axis. Both cells are placed in
    the first quadrant across it, and run into each other where, on one circle, a point of the
    second lies at no smaller an angle than a point of the first.

    Attributes
    ----------
    move, hinge : int
        Row of the path, and the hinge that turns (the first, if this happens several times).
    first, second : int
        Voxels.
    to_first, to_second : (3, 4) float64 arrays
        From shape A to the frame, with the body of each voxel; lattice units.
    """

    move: int
    hinge: int
    first: int
    second: int
    to_first: F64
    to_second: F64


@dataclass(frozen=True)
class Carving:
    """What is to be carved, meeting by meeting in this order.

    Attributes
    ----------
    meetings : tuple of Meeting
    rings : (m, 2) float64 array
        Between these two radii the first voxel of a meeting gives way, elsewhere the second.
    lost : (n,) float64 array
        Share of a full cell that each voxel loses, estimated on subvoxels.
    skin : (n,) float64 array
        The part of it that lies at the model's surface.
    blocked : tuple of (int, int)
        Pairs of voxels whose meeting cannot be carved: a hinge bracket is in the way.
    """

    meetings: tuple[Meeting, ...]
    rings: F64
    lost: F64
    skin: F64
    blocked: tuple[tuple[int, int], ...]

    @property
    def cost(self) -> float:
        """Cells lost, surface counted threefold; infinite where a bracket is in the way."""
        if self.blocked:
            return float("inf")
        return float(self.lost.sum() + (SKIN_COST - 1.0) * self.skin.sum())


# --- meetings ----------------------------------------------------------------------------------


@njit(cache=True)
def _overlaps(first: NDArray[np.int64], second: NDArray[np.int64]) -> NDArray[np.bool_]:
    out = np.zeros(len(first), np.bool_)
    for i in range(len(first)):
        out[i] = arcs_overlap(first[i, 0], first[i, 1], second[i, 0], second[i, 1])
    return out


def _quarter(turns: int) -> F64:
    """Rotation about the third axis by quarter turns, (3, 3), exact."""
    cosine, sine = ((1, 0), (0, 1), (-1, 0), (0, -1))[turns % 4]
    return np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]], dtype=float)


def _placed(pose: F64, frame: F64) -> F64:
    """Frame (3, 4) after pose (4, 4), exact."""
    return np.asarray(np.rint(2 * frame @ pose) / 2 + 0.0)


def meetings_on(system: HingeSystem, path: NDArray[np.integer]) -> list[Meeting]:
    """Every distinct way in which two whole cells run into each other on a path.

    Parameters
    ----------
    system : HingeSystem
    path : (m, 2) integer array
        From A: hinge and signed quarter turns about its positive axis.
    """
    q = np.zeros(len(system.parent))
    body = np.asarray(system.body, dtype=int)
    found: dict[tuple[object, ...], Meeting] = {}
    for move, (hinge, turns) in enumerate(np.asarray(path, dtype=int).reshape(-1, 2).tolist()):
        carried = subtree(system, hinge)[body]
        way = 1 if turns > 0 else -1
        for _ in range(abs(turns)):
            # A turn back sweeps what the turn forth from its end sweeps.
            pose = poses(system, q if way > 0 else q - np.eye(len(q))[hinge])
            q[hinge] += way
            frame = _axis_frame(system, pose, hinge)
            for meeting in _meetings_in_turn(system, pose, frame, carried, move, hinge):
                found.setdefault(_key(meeting), meeting)
    return list(found.values())


def _axis_frame(system: HingeSystem, pose: F64, hinge: int) -> F64:
    """From the world to a frame whose third axis is the hinge's, (3, 4)."""
    world = pose[system.parent[hinge]]
    point = (world @ np.append(np.asarray(system.point2)[hinge] / 2.0, 1.0))[:3]
    along = np.rint(world[:3, :3] @ np.eye(3)[system.axis[hinge]])
    u = np.eye(3)[(int(np.abs(along).argmax()) + 1) % 3]
    frame = np.empty((3, 4))
    frame[:, :3] = np.array([u, np.cross(along, u), along])
    frame[:, 3] = -frame[:, :3] @ point
    return frame


def _meetings_in_turn(
    system: HingeSystem,
    pose: F64,
    frame: F64,
    carried: NDArray[np.bool_],
    move: int,
    hinge: int,
) -> list[Meeting]:
    body = np.asarray(system.body, dtype=int)
    world = np.einsum("nij,nj->ni", pose[body][:, :3, :3], system.cells) + pose[body][:, :3, 3]
    corner = np.rint(2 * (world @ frame[:, :3].T + frame[:, 3])).astype(int)
    # Lower corners of the squares, and the quadrant they lie in.
    corner[:, :2] = (corner[:, :2] - 1) // 2
    positive = corner[:, :2] >= 0
    quadrant = np.where(positive[:, 1], np.where(positive[:, 0], 0, 1), 2 + positive[:, 0])
    square = np.empty((len(corner), 2), dtype=np.int64)
    for k in range(4):
        mine = quadrant == k
        a, b = corner[mine, 0], corner[mine, 1]
        square[mine] = np.column_stack([(a, b), (b, -a - 1), (-a - 1, -b - 1), (-b - 1, a)][k])
    movers, rests = np.flatnonzero(carried), np.flatnonzero(~carried)
    level = corner[movers, 2][:, None] == corner[rests, 2][None, :]
    ahead = (quadrant[rests][None, :] - quadrant[movers][:, None]) % 4
    out = []
    for step in (0, 1):
        i, j = np.nonzero(level & (ahead == step))
        one, other = movers[i], rests[j]
        if step == 1:  # what rests in the next quadrant is hit from behind
            one, other = other, one
        hit = _overlaps(square[one], square[other])
        for first, second in zip(one[hit].tolist(), other[hit].tolist(), strict=True):
            out.append(
                Meeting(
                    move,
                    hinge,
                    first,
                    second,
                    _placed(pose[body[first]], _quarter(-int(quadrant[first])) @ frame),
                    _placed(pose[body[second]], _quarter(-int(quadrant[second])) @ frame),
                )
            )
    return out


def _key(meeting: Meeting) -> tuple[object, ...]:
    """Equal for meetings that are the same seen from the two bodies."""
    one, other = meeting.to_first.copy(), meeting.to_second.copy()
    first, second = meeting.first, meeting.second
    if first > second:
        # Seen from the other end of the axis, angles run back from 90° and the two change places.
        flip = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]])
        one, other, first, second = flip @ other, flip @ one, second, first
    level = one[2, 3]
    one[2, 3] -= level
    other[2, 3] -= level
    return (first, second, tuple((one + 0.0).ravel()), tuple((other + 0.0).ravel()))


# --- the choice of sides -----------------------------------------------------------------------


class _Views(NamedTuple):
    """Meetings as arrays; ``m`` meetings, ``s`` subvoxels along a side.

    Attributes
    ----------
    cell : (m, 2) int32 array
        Row of `claims` of the first and the second voxel.
    stride : (m, 2, 4) int32 array
        Subvoxel ``(u, v, w)`` of the frame is entry ``stride[0] + u stride[1] + v stride[2] + w
        stride[3]`` of the row.
    ring : (m, 2, s * s) int32 array
        Ring in which each column ``u s + v`` lies; -1 where the other cell has nothing.
    angle : (m, 2, s * s) float64 array
    rings : (m,) int32 array
        Number of rings.
    """

    cell: NDArray[np.int32]
    stride: NDArray[np.int32]
    ring: NDArray[np.int32]
    angle: F64
    rings: NDArray[np.int32]


def _view(
    meeting: Meeting, system: HingeSystem, row: dict[int, int], size: int
) -> tuple[list[int], list[list[int]], list[F64], list[F64], int, float]:
    cells, strides, radii, angles = [], [], [], []
    for voxel, to in ((meeting.first, meeting.to_first), (meeting.second, meeting.to_second)):
        centre = to[:, :3] @ np.asarray(system.cells)[voxel] + to[:, 3]
        base, stride = 0, []
        for r in range(3):
            axis = int(np.abs(to[r, :3]).argmax())
            one = (size * size, size, 1)[axis]
            if to[r, axis] < 0:
                base += (size - 1) * one
                one = -one
            stride.append(one)
        steps = (np.arange(size) + 0.5) / size - 0.5
        u, v = np.meshgrid(centre[0] + steps, centre[1] + steps, indexing="ij")
        cells.append(row[voxel])
        strides.append([base, *stride])
        radii.append(np.hypot(u, v).ravel())
        angles.append(np.arctan2(v, u).ravel())
    low = max(radii[0].min(), radii[1].min()) - 0.5 / size
    count = int(np.ceil((min(radii[0].max(), radii[1].max()) - low) * size + 0.5))
    return cells, strides, radii, angles, max(1, count), float(low)


@njit(cache=True)
def _give_way(  # noqa: PLR0912 - one pass, kept whole for speed
    views: _Views,
    e: int,
    low: int,
    high: int,
    claims: NDArray[np.uint8],
    weight: NDArray[np.float32],
    size: int,
    apply: bool,
) -> float:
    """Cost of freeing a meeting: the first voxel gives way in rings low to high - 1."""
    one, other = views.cell[e, 0], views.cell[e, 1]
    s1, s2 = views.stride[e, 0], views.stride[e, 1]
    rings = views.rings[e]
    begin = np.empty(rings)
    end = np.empty(rings)
    cost = 0.0
    for w in range(size):
        begin[:] = 9.0
        end[:] = -9.0
        for u in range(size):
            for v in range(size):
                p = u * size + v
                r = views.ring[e, 0, p]
                if r >= 0 and claims[one, s1[0] + u * s1[1] + v * s1[2] + w * s1[3]] != 0:
                    begin[r] = min(begin[r], views.angle[e, 0, p])
                r = views.ring[e, 1, p]
                if r >= 0 and claims[other, s2[0] + u * s2[1] + v * s2[2] + w * s2[3]] != 0:
                    end[r] = max(end[r], views.angle[e, 1, p])
        free = True
        for r in range(rings):
            if end[r] > begin[r]:
                free = False
                break
        if free:
            continue
        for u in range(size):
            for v in range(size):
                p = u * size + v
                r = views.ring[e, 0, p]
                if low <= r < high and views.angle[e, 0, p] <= end[r] and begin[r] < end[r]:
                    at = s1[0] + u * s1[1] + v * s1[2] + w * s1[3]
                    if claims[one, at] != 0:
                        cost += weight[one, at]
                        if apply:
                            claims[one, at] = 0
                r = views.ring[e, 1, p]
                outside = r >= 0 and not low <= r < high
                if outside and views.angle[e, 1, p] >= begin[r] and begin[r] < end[r]:
                    at = s2[0] + u * s2[1] + v * s2[2] + w * s2[3]
                    if claims[other, at] != 0:
                        cost += weight[other, at]
                        if apply:
                            claims[other, at] = 0
    return cost


@njit(cache=True)
def _option(rings: int, option: int, splits: int) -> tuple[int, int]:
    """Rings in which the first voxel gives way: none, all, the inner ones or the outer ones."""
    if option == 0:
        return 0, 0
    if option == 1:
        return 0, rings
    at = (option - 2) // 2 + 1
    middle = max(1, min(rings - 1, at * rings // (splits + 1)))
    return (0, middle) if option % 2 == 0 else (middle, rings)


@njit(cache=True)
def _choose(
    views: _Views,
    claims: NDArray[np.uint8],
    weight: NDArray[np.float32],
    size: int,
    splits: int,
    budget: int,
) -> tuple[NDArray[np.int32], NDArray[np.int64], NDArray[np.float64]]:
    """Choose sides.

    Returns
    -------
    choice : (m, 2) int32 array
        Rings in which the first voxel of each meeting gives way.
    order : (m,) int64 array
        In which meetings are carved.
    paid : (m,) float64 array
        What each meeting costs in this order.
    """
    count = len(views.cell)
    options = 2 + 2 * splits
    choice = np.zeros((count, 2), np.int32)
    least = np.empty(count)
    for e in range(count):
        least[e] = np.inf
        for option in range(options):
            low, high = _option(views.rings[e], option, splits)
            least[e] = min(least[e], _give_way(views, e, low, high, claims, weight, size, False))
    order = np.argsort(-least, kind="mergesort")
    now = claims.copy()
    total = 0.0
    for e in order:
        best = np.inf
        for option in range(options):
            low, high = _option(views.rings[e], option, splits)
            cost = _give_way(views, e, low, high, now, weight, size, False)
            if cost < best - 1e-9:
                best = cost
                choice[e] = low, high
        total += _give_way(views, e, choice[e, 0], choice[e, 1], now, weight, size, True)
    used = 0
    better = True
    while better and used < budget:
        better = False
        before = claims.copy()
        spent = 0.0
        for place in range(count):
            e = order[place]
            kept = choice[e].copy()
            for option in range(options):
                low, high = _option(views.rings[e], option, splits)
                if (low == kept[0] and high == kept[1]) or least[e] == 0.0 or used >= budget:
                    continue
                now[:] = before
                cost = spent + _give_way(views, e, low, high, now, weight, size, True)
                used += 1
                for later in range(place + 1, count):
                    if cost >= total - 1e-9:
                        break
                    g = order[later]
                    cost += _give_way(views, g, choice[g, 0], choice[g, 1], now, weight, size, True)
                    used += 1
                if cost < total - 1e-6:
                    total = cost
                    choice[e] = low, high
                    better = True
            spent += _give_way(views, e, choice[e, 0], choice[e, 1], before, weight, size, True)
    now[:] = claims
    paid = np.zeros(count)
    for e in order:
        paid[e] = _give_way(views, e, choice[e, 0], choice[e, 1], now, weight, size, True)
    claims[:] = now
    return choice, order, paid


# --- material ----------------------------------------------------------------------------------


def skin_of(cells: NDArray[np.int32], material: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Subvoxels of material within `_SKIN_DEPTH` of the model's outside."""
    from scipy import ndimage

    size = material.shape[1]
    low = cells.min(axis=0)
    shape = (cells.max(axis=0) - low + 1) * size + 2
    whole = np.zeros(tuple(shape), dtype=bool)
    at = [tuple(slice(s, s + size) for s in (c - low) * size + 1) for c in cells]
    for where, part in zip(at, material, strict=True):
        whole[where] = part
    inner = ndimage.binary_erosion(whole, iterations=_SKIN_DEPTH)
    return np.array([whole[where] & ~inner[where] for where in at])


def _brackets(system: HingeSystem, size: int, bracket: tuple[float, float]) -> NDArray[np.bool_]:
    """Subvoxels where the brackets of hinges sit, (n, s, s, s)."""
    cells = np.asarray(system.cells, dtype=float)
    out = np.zeros((len(cells), size, size, size), dtype=bool)
    steps = (np.arange(size) + 0.5) / size - 0.5
    for h, parent in enumerate(system.parent.tolist()):
        axis = int(system.axis[h])
        away = np.asarray(system.point2)[h] / 2.0 - cells
        beside = (np.abs(np.abs(away) - 0.5) < 1e-9) | (np.arange(3) == axis)
        beside = beside.all(axis=1) & (np.abs(away[:, axis]) < 1e-9)
        for voxel in np.flatnonzero(beside & np.isin(system.body, (parent, h + 1))).tolist():
            inside = []
            for i in range(3):
                if i == axis:
                    inside.append(np.abs(steps) < 0.5 - bracket[1])
                else:
                    inside.append(np.abs(steps - away[voxel, i]) < bracket[0])
            out[voxel] |= inside[0][:, None, None] & inside[1][:, None] & inside[2]
    return out


def plan_carving(
    system: HingeSystem,
    path: NDArray[np.integer],
    material: NDArray[np.bool_],
    *,
    bracket: tuple[float, float] = BRACKET,
) -> Carving:
    """Choose what to carve so that a path of cores becomes free.

    Parameters
    ----------
    system : HingeSystem
    path : (m, 2) integer array
        From A: hinge and signed quarter turns about its positive axis.
    material : (n, s, s, s) bool array
        Material of each cell in shape A, as in :class:`fabfold.voxels.model.Voxels`.
    bracket : (float, float)
        Side of the hinges' brackets across the axis, and how far they stay from the ends of the
        lattice edge; never carved.

    Returns
    -------
    Carving
        Without meetings where whole cells pass each other.

    Raises
    ------
    ValueError
        If `material` has not one entry a voxel.
    """
    material = np.asarray(material, dtype=bool)
    count = len(system.cells)
    if material.ndim != 4 or len(material) != count or len(set(material.shape[1:])) != 1:
        raise ValueError(f"material: wants shape ({count}, s, s, s), found {material.shape}")
    size = material.shape[1]
    nothing = np.zeros(count)
    found = meetings_on(system, path)
    if not found:
        return Carving((), np.zeros((0, 2)), nothing, nothing, ())
    used = sorted({voxel for m in found for voxel in (m.first, m.second)})
    row = {voxel: i for i, voxel in enumerate(used)}
    skin = skin_of(np.asarray(system.cells), material)
    held = _brackets(system, size, bracket)
    weight = np.ones(material.shape, dtype=np.float32)
    middle = np.abs((np.arange(size) + 0.5) / size - 0.5) < CORE
    weight[:, middle[:, None, None] & middle[:, None] & middle] = CORE_COST
    weight[skin] = SKIN_COST
    weight[held] = HINGE_COST
    claims = (material | held)[used].reshape(len(used), -1).astype(np.uint8)
    before = claims.copy()
    parts = [_view(m, system, row, size) for m in found]
    rings = np.array([part[4] for part in parts], dtype=np.int32)
    ring = np.empty((len(found), 2, size * size), dtype=np.int32)
    for e, part in enumerate(parts):
        for side in range(2):
            number = np.floor((part[2][side] - part[5]) * size).astype(np.int32)
            ring[e, side] = np.where((number >= 0) & (number < rings[e]), number, -1)
    views = _Views(
        np.array([part[0] for part in parts], dtype=np.int32),
        np.array([part[1] for part in parts], dtype=np.int32),
        ring,
        np.array([part[3] for part in parts]),
        rings,
    )
    choice, order, paid = _choose(
        views, claims, weight[used].reshape(len(used), -1), size, _SPLITS, _IMPROVEMENTS
    )
    gone = (before & ~claims.astype(bool)).reshape(-1, size, size, size) & material[used]
    lost, surface = nothing.copy(), nothing.copy()
    lost[used] = gone.mean(axis=(1, 2, 3))
    surface[used] = (gone & skin[used]).mean(axis=(1, 2, 3))
    low = np.array([part[5] for part in parts])
    # Where all rings give way, no radius is a bound.
    inner = np.where(choice[:, 0] == 0, 0.0, low + choice[:, 0] / size)
    outer = np.where(choice[:, 1] == rings, np.inf, low + choice[:, 1] / size)
    none = choice[:, 0] == choice[:, 1]
    bounds = np.where(none[:, None], 0.0, np.column_stack([inner, outer]))
    blocked = [(found[e].first, found[e].second) for e in order.tolist() if paid[e] >= HINGE_COST]
    return Carving(
        tuple(found[e] for e in order.tolist()),
        bounds[order],
        lost,
        surface,
        tuple(dict.fromkeys(blocked)),
    )


def carved_path(
    system: HingeSystem,
    material: NDArray[np.bool_],
    expansions: int = 2500,
    patience: int = 400,
    *,
    carve: float = CORE,
) -> tuple[NDArray[np.int32], Carving] | None:
    """The path of cores that costs least to carve, of those that several searches find.

    Parameters
    ----------
    system : HingeSystem
    material : (n, s, s, s) bool array
    expansions, patience : int
        Of each search, see :func:`fabfold.fold.lattice.find_path`.
    carve : float
        Half the side of a cell's core.

    Returns
    -------
    (path, Carving) or None
        None where no path is found, or none that spares the hinges.
    """
    from fabfold.fold.lattice import find_path

    best: tuple[NDArray[np.int32], Carving] | None = None
    seen: set[bytes] = set()
    for price in _PRICES:
        for tried in (patience, patience // 4):
            path = find_path(system, expansions, tried, carve=carve, price=price).path
            if path is None or path.tobytes() in seen:
                continue
            seen.add(path.tobytes())
            carving = plan_carving(system, path, material)
            if not carving.blocked and (best is None or carving.cost < best[1].cost - 1e-9):
                best = path, carving
    return best
