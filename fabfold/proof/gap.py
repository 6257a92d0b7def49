"""Lower bounds of the gap between triangles while one set of them turns about the z axis.

This is the arithmetic of the swept proof (:mod:`fabfold.proof.certify`). For a pair of pieces
(boxes or triangles) and a range of angles, a *lower bound* of their distance over all angles in
the range comes from any of these, whichever is best:

* quantities that the turn does not change: z, r, (z + r) / √2, (z - r) / √2, or, for a pair of
  triangles, the combination of z and r that the nearest points suggest;
* a plane that stands still: the turning piece's coordinate along its normal is a sinusoid of the
  angle for each corner, so its least value over the range is exact;
* a plane that turns along: the same with the roles exchanged;
* in a pose, the plane of either of two triangles.

A pair that is not proven is divided: larger boxes into their children, and angles in two.
For triangles the normals come from the nearest points at the middle of the range, so the bound
misses the distance only by a second-order term, and few divisions are needed.
"""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return"

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fabfold.proof.bvh import BoxTrees, PlacedBodies, fit
from fabfold.proof.triangles import plane_gap, triangle_distance

__all__ = ["DONE", "FAILED", "UNPROVEN", "prove_gap", "prove_pairs"]

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]

#: Verdicts of :func:`prove_gap`.
DONE, FAILED, UNPROVEN = 0, 1, 2
#: Ranges of angles (radians) are not divided below this.
FINEST = 1e-6


@njit(cache=True)
def _still_plane(
    moving: F64, still: F64, nx: float, ny: float, nz: float,
    c0: float, s0: float, c1: float, s1: float,
) -> float:  # fmt: skip
    """Least of ``n . R(angle) v`` over corners v and angles, less the most of ``n . w``.

    The angles run over at most half a turn between those with cosine and sine (c0, s0), (c1, s1).
    """
    least = np.inf
    for k in range(3):
        x = moving[k, 0]
        y = moving[k, 1]
        a = nx * x + ny * y
        b = ny * x - nx * y
        low = min(a * c0 + b * s0, a * c1 + b * s1)
        if b * c0 - a * s0 < 0.0 and b * c1 - a * s1 > 0.0:
            low = -np.hypot(a, b)
        least = min(least, low + nz * moving[k, 2])
    most = -np.inf
    for k in range(3):
        most = max(most, nx * still[k, 0] + ny * still[k, 1] + nz * still[k, 2])
    return least - most


@njit(cache=True)
def _profile(outer: F64, inner: F64, a: float, b: float) -> float:
    """Least of ``a z + b r`` on one triangle, from below, less its most on the other; b >= 0."""
    ex = outer[0, 0] + outer[1, 0] + outer[2, 0]
    ey = outer[0, 1] + outer[1, 1] + outer[2, 1]
    length = np.hypot(ex, ey)
    ex, ey = (ex / length, ey / length) if length > 0 else (1.0, 0.0)
    least = np.inf
    most = -np.inf
    for k in range(3):
        least = min(least, a * outer[k, 2] + b * (ex * outer[k, 0] + ey * outer[k, 1]))
        most = max(most, a * inner[k, 2] + b * np.hypot(inner[k, 0], inner[k, 1]))
    return least - most


@njit(cache=True)
def _invariant_gap(one: F64, two: F64) -> float:
    """Best separation by a quantity that the turn does not change."""
    best = -np.inf
    for i in range(0, 8, 2):
        best = max(best, one[i] - two[i + 1], two[i] - one[i + 1])
    dz = max(one[0] - two[1], two[0] - one[1])
    dr = max(one[2] - two[3], two[2] - one[3])
    if dz > 0.0 and dr > 0.0:
        best = max(best, np.hypot(dz, dr))
    return best


@njit(cache=True)
def _swept_box_gap(moving: F64, still: F64, c0: float, s0: float, c1: float, s1: float) -> float:
    """Distance of a box from the box about all places of another box that turns."""
    x0 = np.inf
    x1 = -np.inf
    y0 = np.inf
    y1 = -np.inf
    for i in range(0, 4, 3):
        for j in range(1, 5, 3):
            x = moving[i]
            y = moving[j]
            f0 = x * c0 - y * s0
            g0 = x * s0 + y * c0
            f1 = x * c1 - y * s1
            g1 = x * s1 + y * c1
            x0 = min(x0, f0, f1)
            x1 = max(x1, f0, f1)
            y0 = min(y0, g0, g1)
            y1 = max(y1, g0, g1)
            if g0 > 0.0 and g1 < 0.0:
                x0 = min(x0, -np.hypot(x, y))
            if g0 < 0.0 and g1 > 0.0:
                x1 = max(x1, np.hypot(x, y))
            if f0 < 0.0 and f1 > 0.0:
                y0 = min(y0, -np.hypot(x, y))
            if f0 > 0.0 and f1 < 0.0:
                y1 = max(y1, np.hypot(x, y))
    dx = max(0.0, x0 - still[3], still[0] - x1)
    dy = max(0.0, y0 - still[4], still[1] - y1)
    dz = max(0.0, moving[2] - still[5], still[2] - moving[5])
    return np.sqrt(dx * dx + dy * dy + dz * dz)


@njit(cache=True)
def _turned(triangle: F64, cosine: float, sine: float, out: F64) -> None:
    """Triangle turned about the z axis; `out` gets it."""
    for k in range(3):
        x = triangle[k, 0]
        y = triangle[k, 1]
        out[k, 0] = x * cosine - y * sine
        out[k, 1] = x * sine + y * cosine
        out[k, 2] = triangle[k, 2]


@njit(cache=True)
def _triangles(  # noqa: PLR0912, PLR0915 - one proof, its cases in order of cost
    boxes: BoxTrees, t: int, s: int, low: float, high: float, wanted: float, slack: float,
    result: F64,
) -> int:  # fmt: skip
    """Prove the gap of two triangles over a range of angles; see :func:`prove_gap`."""
    moving = boxes.triangle[t]
    still = boxes.triangle[s]
    bound = _invariant_gap(boxes.own_invariant[t], boxes.own_invariant[s])
    goal = max(wanted, result[0] - slack)
    if bound >= goal:
        result[1] = min(result[1], bound)
        return DONE
    turned = np.empty((3, 3))
    nearest = np.empty((2, 3))
    ranges = np.empty((64, 2))
    ranges[0, 0] = low
    ranges[0, 1] = high
    depth = 1
    while depth > 0:
        depth -= 1
        begin = ranges[depth, 0]
        end = ranges[depth, 1]
        middle = 0.5 * (begin + end)
        cosine = np.cos(middle)
        sine = np.sin(middle)
        _turned(moving, cosine, sine, turned)
        if end == begin:
            # Where nothing turns, the plane of one of the triangles settles most pairs.
            bound = plane_gap(turned, still)
            if bound >= max(wanted, result[0] - slack):
                result[1] = min(result[1], bound)
                continue
        distance = triangle_distance(turned, still, nearest)
        if distance < result[0]:
            result[0] = distance
            result[2] = middle
        if distance < wanted:
            return FAILED
        goal = max(wanted, result[0] - slack)
        if end == begin:
            result[1] = min(result[1], distance)
            continue
        nx = (nearest[0, 0] - nearest[1, 0]) / distance
        ny = (nearest[0, 1] - nearest[1, 1]) / distance
        nz = (nearest[0, 2] - nearest[1, 2]) / distance
        c0 = np.cos(begin)
        s0 = np.sin(begin)
        c1 = np.cos(end)
        s1 = np.sin(end)
        bound = _still_plane(moving, still, nx, ny, nz, c0, s0, c1, s1)
        if bound < goal:
            # The same plane fixed to the turning triangle: the still one turns back past it.
            mx = -(nx * cosine + ny * sine)
            my = -(ny * cosine - nx * sine)
            bound = max(bound, _still_plane(still, moving, mx, my, -nz, c1, -s1, c0, -s0))
        if bound < goal:
            dz = nearest[0, 2] - nearest[1, 2]
            dr = np.hypot(nearest[0, 0], nearest[0, 1]) - np.hypot(nearest[1, 0], nearest[1, 1])
            length = np.hypot(dz, dr)
            if length > 0.0:
                if dr >= 0.0:
                    whole = _profile(moving, still, dz / length, dr / length)
                else:
                    whole = _profile(still, moving, -dz / length, -dr / length)
                if whole >= goal:  # at every angle
                    result[1] = min(result[1], whole)
                    return DONE
        if bound >= goal:
            result[1] = min(result[1], bound)
        elif end - begin <= FINEST or depth + 2 > len(ranges):
            if bound < wanted:
                result[2] = middle
                return UNPROVEN
            result[1] = min(result[1], bound)
        else:
            ranges[depth, 0] = middle
            ranges[depth, 1] = end
            ranges[depth + 1, 0] = begin
            ranges[depth + 1, 1] = middle
            depth += 2
    return DONE


@njit(cache=True)
def _node_gap(boxes: BoxTrees, a: int, b: int, begin: float, end: float, goal: float) -> float:
    """Lower bound of the gap of two nodes; what costs more is left out once it reaches `goal`."""
    bound = _invariant_gap(boxes.invariant[a], boxes.invariant[b])
    if bound < goal:
        c0 = np.cos(begin)
        s0 = np.sin(begin)
        c1 = np.cos(end)
        s1 = np.sin(end)
        bound = max(bound, _swept_box_gap(boxes.box[a], boxes.box[b], c0, s0, c1, s1))
        if bound < goal and end > begin:
            bound = max(bound, _swept_box_gap(boxes.box[b], boxes.box[a], c1, -s1, c0, -s0))
    return bound


@njit(cache=True)
def prove_gap(
    boxes: BoxTrees, moving: int, still: int, low: float, high: float, wanted: float, slack: float,
    result: F64,
) -> int:  # fmt: skip
    """Prove that a turning body keeps a gap from a still one.

    Parameters
    ----------
    boxes : BoxTrees
        Fitted in the frame of the axis.
    moving, still : int
        Numbers of the two bodies in `boxes`.
    low, high : float
        Range of angles in radians, at most half a turn; equal to look at one pose only.
    wanted : float
        The gap to be proven, mm.
    slack : float
        How far the proven bound may stay below the smallest distance seen, mm; the larger, the
        quicker.
    result : (3,) float64 array
        In and out: smallest distance seen and least bound proven, mm; angle of that distance, or
        where the proof ended, radians.

    Returns
    -------
    int
        DONE, FAILED (a distance below `wanted` was seen) or UNPROVEN (neither proven nor refuted
        at the finest division).
    """
    room = 256
    pair = np.empty((room, 2), np.int32)
    span = np.empty((room, 2))
    pair[0, 0] = boxes.root[moving]
    pair[0, 1] = boxes.root[still]
    span[0, 0] = low
    span[0, 1] = high
    depth = 1
    while depth > 0:
        depth -= 1
        a = pair[depth, 0]
        b = pair[depth, 1]
        begin = span[depth, 0]
        end = span[depth, 1]
        goal = max(wanted, result[0] - slack)
        bound = _node_gap(boxes, a, b, begin, end, goal)
        if bound >= goal:
            result[1] = min(result[1], bound)
            continue
        leaf_a = boxes.child[a, 0] < 0
        leaf_b = boxes.child[b, 0] < 0
        if leaf_a and leaf_b:
            for t in range(boxes.leaf[a, 0], boxes.leaf[a, 0] + boxes.leaf[a, 1]):
                for s in range(boxes.leaf[b, 0], boxes.leaf[b, 0] + boxes.leaf[b, 1]):
                    verdict = _triangles(boxes, t, s, begin, end, wanted, slack, result)
                    if verdict != DONE:
                        return verdict
            continue
        if depth + 2 > room:
            room *= 2
            more_pair = np.empty((room, 2), np.int32)
            more_pair[:depth] = pair[:depth]
            pair = more_pair
            more_span = np.empty((room, 2))
            more_span[:depth] = span[:depth]
            span = more_span
        size_a = 0.0
        size_b = 0.0
        for i in range(3):
            size_a = max(size_a, boxes.box[a, 3 + i] - boxes.box[a, i])
            size_b = max(size_b, boxes.box[b, 3 + i] - boxes.box[b, i])
        # Turn or shape: divide what smears the pair more.
        lever = min(boxes.invariant[a, 3], boxes.invariant[b, 3])
        if lever * (end - begin) > 2.0 * max(size_a, size_b):
            middle = 0.5 * (begin + end)
            for way in range(2):
                pair[depth, 0] = a
                pair[depth, 1] = b
                span[depth, 0] = begin if way == 1 else middle
                span[depth, 1] = middle if way == 1 else end
                depth += 1
        else:
            first = leaf_b or (not leaf_a and size_a >= size_b)
            for way in range(2):
                pair[depth, 0] = boxes.child[a, way] if first else a
                pair[depth, 1] = b if first else boxes.child[b, way]
                span[depth, 0] = begin
                span[depth, 1] = end
                depth += 1
    return DONE


@njit(cache=True)
def prove_pairs(
    boxes: BoxTrees, bodies: PlacedBodies, moving: I32, still: I32, low: float, high: float,
    wanted: float, slack: float, result: F64, pair: I32,
) -> int:  # fmt: skip
    """Prove that every turning body keeps a gap from every still one.

    Parameters
    ----------
    boxes, bodies : BoxTrees, PlacedBodies
        Placed in the frame of the axis. The trees of those that are near to others are fitted.
    moving, still : (m,), (s,) int32 arrays
        Bodies; a body in both is not paired with itself or twice with another.
    low, high, wanted, slack, result
        As for :func:`prove_gap`, for all pairs together.
    pair : (2,) int32 array
        Out: the two bodies with the smallest distance seen, or those where the proof failed.

    Returns
    -------
    int
        DONE, or the verdict of the pair where the proof ended.
    """
    for a in moving:
        for b in still:
            if a == b or (low == high and a > b):
                continue
            seen = result[0]
            goal = max(wanted, seen - slack)
            bound = _node_gap(boxes, boxes.root[a], boxes.root[b], low, high, goal)
            if bound >= goal:
                result[1] = min(result[1], bound)
                continue
            fit(boxes, bodies, a)
            fit(boxes, bodies, b)
            verdict = prove_gap(boxes, a, b, low, high, wanted, slack, result)
            if verdict != DONE or result[0] < seen:
                pair[0] = a
                pair[1] = b
            if verdict != DONE:
                return verdict
    return DONE
