"""The oracle of the lattice kernels: the plain meaning of every question, by another way.

It runs no line of fabfold, so it shares no fault with it: poses are 4 by 4 matrices made by SciPy,
the root body stays still, a turn is looked at every degree with separating axes instead of a table,
and the sizes of barrels and link plates are written down here once more. It is slow.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

if TYPE_CHECKING:
    from fabfold.tree.system import HingeSystem

__all__ = [
    "BARREL_INSET",
    "BARREL_LEAST",
    "TOUCH",
    "barrel_meetings",
    "path_overlap",
    "plate_meetings",
    "plates",
    "poses",
    "segment_distance",
    "state_is_valid",
    "stuck",
    "subtree",
    "turn_overlap",
]

#: Overlaps below this, in voxel sides, are faces that touch.
TOUCH = 1e-9
#: What the least distances give way for rounding, in voxel sides.
ROUNDING = 1e-3
#: The definition, in voxel sides (20 mm): a barrel has a radius of 2.5 mm and ends 2.8 mm from the
#: end of its lattice edge, a plate is 2 mm thick, and parts keep 0.3 mm from each other.
BARREL_INSET = (2.8 + 2.5) / 20
BARREL_LEAST = (2 * 2.5 + 0.3) / 20
PLATE_THICK, PLATE_ROOM = 0.1, 0.14
PLATE_LEAST = PLATE_THICK + 0.015


def turn_about(
    point: NDArray[np.float64], direction: NDArray[np.float64], degrees: float
) -> NDArray[np.float64]:
    """Rigid transform (4, 4) that turns space about a line."""
    out = np.eye(4)
    out[:3, :3] = Rotation.from_rotvec(
        np.asarray(direction, float) * degrees, degrees=True
    ).as_matrix()
    out[:3, 3] = np.asarray(point, float) - out[:3, :3] @ point
    return out


def segment_distance(one: NDArray[np.float64], two: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance of pairs of segments, each (..., 2, 3) end points.

    Two segments are nearest at an end of one of them, or where the line across both meets both.
    """
    best = np.minimum(
        np.minimum(_to_segment(one[..., 0, :], two), _to_segment(one[..., 1, :], two)),
        np.minimum(_to_segment(two[..., 0, :], one), _to_segment(two[..., 1, :], one)),
    )
    u, v = one[..., 1, :] - one[..., 0, :], two[..., 1, :] - two[..., 0, :]
    across = np.cross(u, v)
    square = (across**2).sum(-1)
    slanted = square > 1e-12
    square = np.where(slanted, square, 1.0)
    away = two[..., 0, :] - one[..., 0, :]
    s = (np.cross(away, v) * across).sum(-1) / square
    t = (np.cross(away, u) * across).sum(-1) / square
    inside = slanted & (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
    lines = np.abs((away * across).sum(-1)) / np.sqrt(square)
    return np.where(inside, np.minimum(best, lines), best)


def _to_segment(point: NDArray[np.float64], segment: NDArray[np.float64]) -> NDArray[np.float64]:
    along = segment[..., 1, :] - segment[..., 0, :]
    away = point - segment[..., 0, :]
    share = np.clip((away * along).sum(-1) / (along * along).sum(-1), 0, 1)
    return np.linalg.norm(away - share[..., None] * along, axis=-1)


def subtree(system: HingeSystem, hinge: int) -> NDArray[np.bool_]:
    """Bodies that a hinge carries, shape (b,) bool."""
    inside = []
    for body in range(len(system.parent) + 1):
        above = body
        while above > 0 and above != hinge + 1:
            above = int(system.parent[above - 1])
        inside.append(above == hinge + 1)
    return np.array(inside)


def poses(system: HingeSystem, quarters: NDArray[np.floating]) -> NDArray[np.float64]:
    """Transforms (b, 4, 4) of all bodies with hinge ``h`` turned by ``quarters[h]`` times 90°."""
    out = [np.eye(4)]
    for h, parent in enumerate(system.parent):
        middle, axis = np.asarray(system.point2)[h] / 2.0, np.eye(3)[system.axis[h]]
        out.append(out[parent] @ turn_about(middle, axis, 90.0 * quarters[h]))
    return np.array(out)


def _cells(system: HingeSystem, pose: NDArray[np.float64]) -> NDArray[np.float64]:
    mine = pose[np.asarray(system.body)]
    return np.asarray(np.einsum("nij,nj->ni", mine[:, :3, :3], system.cells) + mine[:, :3, 3])


def _barrels(system: HingeSystem, pose: NDArray[np.float64]) -> list[tuple[float, ...]]:
    """Axis and middle of the unit edges that each hinge covers."""
    found = []
    for h in range(len(system.parent)):
        axis = np.eye(3)[system.axis[h]]
        shifts = (0.0,) if system.point2[h][system.axis[h]] % 2 == 0 else (-0.5, 0.5)
        for shift in shifts:
            middle = pose[h + 1] @ np.append(np.asarray(system.point2)[h] / 2 + shift * axis, 1.0)
            along = int(np.abs(pose[h + 1][:3, :3] @ axis).argmax())
            found.append((along, *np.round(2 * middle[:3]).tolist()))
    return found


def plates(system: HingeSystem) -> dict[int, tuple[NDArray[np.float64], int]]:
    """Middle and axis of the normal, in A, of each body that is a link plate; on whole cells.

    A link plate has no cells, and its two hinges lie on two edges of one lattice face.
    """
    found = {}
    for h in range(len(system.parent)):
        body = h + 1
        children = np.flatnonzero(np.asarray(system.parent) == body)
        if body in set(np.asarray(system.body).tolist()) or len(children) != 1:
            continue
        ends = np.asarray(system.point2)[[h, int(children[0])]] / 2.0
        lines = np.eye(3)[np.asarray(system.axis)[[h, int(children[0])]].astype(int)]
        for normal in range(3):
            across = [i for i in range(3) if i != normal]
            # The middle of a face is half a side from the middles of its edges, across them.
            for x, y in np.ndindex(2, 2):
                middle = ends[0].copy()
                middle[across[0]] += (x - 0.5) * (1 - lines[0, across[0]])
                middle[across[1]] += (y - 0.5) * (1 - lines[0, across[1]])
                away = middle - ends
                fits = [
                    np.isclose(np.abs(a).sum(), 0.5)
                    and a[normal] == 0
                    and abs(float(a @ line)) < 1e-9
                    and line[normal] == 0
                    for a, line in zip(away, lines, strict=True)
                ]
                if all(fits) and not np.allclose(ends[0], ends[1]):
                    found[body] = (middle, normal)
    return found


def state_is_valid(system: HingeSystem, quarters: NDArray[np.integer]) -> bool:
    """Whether no two cells coincide, no barrels lie on one lattice edge, no plates on one face."""
    pose = poses(system, np.asarray(quarters, dtype=float))
    cells = [tuple(cell) for cell in np.round(_cells(system, pose)).astype(int).tolist()]
    barrels = _barrels(system, pose)
    faces = [
        tuple(np.round(2 * (pose[body] @ np.append(middle, 1.0))[:3]).astype(int).tolist())
        for body, (middle, _) in plates(system).items()
    ]
    return all(len(set(things)) == len(things) for things in (cells, barrels, faces))


def turn_overlap(
    system: HingeSystem,
    quarters: NDArray[np.integer],
    hinge: int,
    turn: int,
    step_deg: float = 1.0,
) -> NDArray[np.float64]:
    """How deep cubes run into each other while one hinge turns.

    Parameters
    ----------
    quarters : (h,) integer array
        State at the start of the turn.
    hinge : int
    turn : int
        Signed quarter turns.
    step_deg : float
        The turn is looked at this often.

    Returns
    -------
    (n, n) float64 array
        For a moving cell i and a still cell j, the greatest separating-axis overlap on the way,
        in voxel sides; 0 and less where they stay apart or touch, minus infinity elsewhere.
    """
    start = np.asarray(quarters, dtype=float)
    pose = poses(system, start)
    centre = _cells(system, pose)
    moving = subtree(system, hinge)[np.asarray(system.body)]
    parent = pose[system.parent[hinge]]
    axis = np.rint(parent[:3, :3] @ np.eye(3)[system.axis[hinge]])
    point = (parent @ np.append(np.asarray(system.point2)[hinge] / 2.0, 1.0))[:3]
    along = int(np.abs(axis).argmax())
    u, v = [i for i in range(3) if i != along]
    depth = np.full((len(centre), len(centre)), -np.inf)
    pairs = np.argwhere(
        moving[:, None]
        & ~moving[None, :]
        & (np.abs(centre[:, None, along] - centre[None, :, along]) < 0.5)
    )
    if len(pairs) == 0:
        return depth
    still = centre[pairs[:, 1]][:, (u, v)]
    count = max(1, round(90.0 * abs(turn) / step_deg))
    for share in np.linspace(0.0, 1.0, count + 1):
        angle = 90.0 * turn * share
        spin = turn_about(point, axis, angle)
        moved = (centre[pairs[:, 0]] @ spin[:3, :3].T + spin[:3, 3])[:, (u, v)]
        cosine, sine = spin[u, u], spin[v, u]
        half = 0.5 * (1.0 + abs(cosine) + abs(sine))
        apart = still - moved
        gap = np.maximum(
            np.abs(apart).max(axis=1),
            np.maximum(
                np.abs(apart @ np.array([cosine, sine])), np.abs(apart @ np.array([-sine, cosine]))
            ),
        )
        deep = half - gap
        depth[pairs[:, 0], pairs[:, 1]] = np.maximum(depth[pairs[:, 0], pairs[:, 1]], deep)
    return depth


def path_overlap(
    system: HingeSystem, path: NDArray[np.integer], step_deg: float = 1.0
) -> list[float]:
    """Greatest overlap in each move of a path from A, voxel sides; see :func:`turn_overlap`.

    A move that passes through a state that is not valid, or on which barrels or link plates meet
    something, counts as infinite.
    """
    q = np.zeros(len(system.parent), dtype=int)
    found = []
    for hinge, turn in np.asarray(path, dtype=int).reshape(-1, 2).tolist():
        deep = float(turn_overlap(system, q, hinge, turn, step_deg).max(initial=-np.inf))
        if barrel_meetings(system, q, hinge, turn) or plate_meetings(system, q, hinge, turn):
            deep = np.inf
        for _ in range(abs(turn)):
            q[hinge] += 1 if turn > 0 else -1
            if not state_is_valid(system, q):
                deep = np.inf
        found.append(deep)
    return found


def barrel_meetings(
    system: HingeSystem, quarters: NDArray[np.integer], hinge: int, turn: int, step_deg: float = 0.5
) -> list[tuple[int, int]]:
    """Pairs of hinges (carried, staying) whose barrels come too near while one hinge turns.

    Parameters
    ----------
    system : HingeSystem
        On whole cells.
    quarters, hinge, turn, step_deg
        As for :func:`turn_overlap`.
    """
    pose = poses(system, np.asarray(quarters, dtype=float))
    inside = subtree(system, hinge)
    middles = np.asarray(system.point2) / 2.0
    half = (0.5 - BARREL_INSET) * np.eye(3)[np.asarray(system.axis, dtype=int)]
    ends = np.stack([middles - half, middles + half], axis=1)
    frame = pose[1:]
    ends = np.einsum("hij,hkj->hki", frame[:, :3, :3], ends) + frame[:, None, :3, 3]
    carried = [g for g in range(len(ends)) if inside[g + 1] and g != hinge]
    staying = [g for g in range(len(ends)) if not inside[g + 1]]
    parent = pose[system.parent[hinge]]
    axis = parent[:3, :3] @ np.eye(3)[system.axis[hinge]]
    point = (parent @ np.append(middles[hinge], 1.0))[:3]
    shares = np.linspace(0.0, 1.0, max(1, round(90.0 * abs(turn) / step_deg)) + 1)
    spins = np.array([turn_about(point, axis, 90.0 * turn * share) for share in shares])
    found = set()
    for g in carried:
        moved = np.einsum("aij,kj->aki", spins[:, :3, :3], ends[g]) + spins[:, None, :3, 3]
        for other in staying:
            if segment_distance(moved, ends[other][None]).min() < BARREL_LEAST - ROUNDING:
                found.add((g, other))
    return sorted(found)


def _plane_overlap(
    middle: NDArray[np.float64],
    half: tuple[float, float],
    spin: NDArray[np.float64],
    other: NDArray[np.float64],
    other_half: tuple[float, float],
) -> float:
    """How deep a rectangle, turned by a 2 by 2 matrix, lies in another one (separating axes)."""
    centre = spin @ middle
    deep = np.inf
    for normal in (*np.eye(2), spin[:, 0], spin[:, 1]):
        reach = half[0] * abs(normal @ spin[:, 0]) + half[1] * abs(normal @ spin[:, 1])
        reach += other_half[0] * abs(normal[0]) + other_half[1] * abs(normal[1])
        deep = min(deep, reach - abs(float(normal @ (centre - other))))
    return float(deep)


def _plane_distance(
    middle: NDArray[np.float64],
    half: tuple[float, float],
    spin: NDArray[np.float64],
    other: NDArray[np.float64],
    other_half: tuple[float, float],
) -> float:
    """Distance of two rectangles that do not overlap, one of them turned; of their corners."""

    def outline(
        at: NDArray[np.float64], size: tuple[float, float], turn: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
        points = (at + signs * np.array(size)) @ turn.T
        return np.stack([points, np.roll(points, -1, axis=0)], axis=1)

    def apart(point: NDArray[np.float64], side: NDArray[np.float64]) -> float:
        along = side[1] - side[0]
        length = float(along @ along)
        share = 0.0 if length == 0 else float(np.clip((point - side[0]) @ along / length, 0, 1))
        return float(np.linalg.norm(point - side[0] - share * along))

    one, two = outline(middle, half, spin), outline(other, other_half, np.eye(2))
    ends = [(a[0], b) for a in one for b in two] + [(b[0], a) for a in one for b in two]
    return min(apart(point, side) for point, side in ends)


def plate_meetings(
    system: HingeSystem, quarters: NDArray[np.integer], hinge: int, turn: int, step_deg: float = 0.5
) -> list[tuple[int, int]]:
    """Pairs of bodies (carried, staying) of which a link plate meets the other in a turn.

    A plate runs into cells, into the inside of another plate, or into a barrel; a barrel counts as
    that one of its two bodies that is nearer in the tree.

    Parameters
    ----------
    system : HingeSystem
        On whole cells.
    quarters, hinge, turn, step_deg
        As for :func:`turn_overlap`.
    """
    pose = poses(system, np.asarray(quarters, dtype=float))
    inside = subtree(system, hinge)
    frame = pose[system.parent[hinge]]
    axis = frame[:3, :3] @ np.eye(3)[system.axis[hinge]]
    point = (frame @ np.append(np.asarray(system.point2)[hinge] / 2.0, 1.0))[:3]
    along = int(np.abs(axis).argmax())
    plane = [(along + 1) % 3, (along + 2) % 3]
    way = float(np.sign(turn) * np.sign(axis[along]))
    angles = np.radians(np.linspace(0.0, 90.0 * abs(turn), round(90 * abs(turn) / step_deg) + 1))
    # One kind of thing: body, (body if it is a barrel: its other one), middle, normal or line.
    boxes: list[tuple[str, int, NDArray[np.float64], int]] = [
        ("cell", int(body), centre, -1)
        for body, centre in zip(np.asarray(system.body), _cells(system, pose), strict=True)
    ]
    flat = []
    for body, (middle, normal) in plates(system).items():
        where = (pose[body] @ np.append(middle, 1.0))[:3]
        flat.append(("plate", body, where, int(np.abs(pose[body][:3, normal]).argmax())))
    for g in range(len(system.parent)):
        if g == hinge:
            continue
        where = (pose[g + 1] @ np.append(np.asarray(system.point2)[g] / 2.0, 1.0))[:3]
        line = int(np.abs(pose[g + 1][:3, int(system.axis[g])]).argmax())
        # Towards the hinge: what it carries is nearer from above, all else from below.
        near = int(system.parent[g])
        if not inside[g + 1] and subtree(system, g)[hinge + 1]:
            near = g + 1
        boxes.append(("barrel", near, where, line))
    found = set()
    for _, body, where, normal in flat:
        for other_kind, other, there, line in boxes + flat:
            moves = inside[body]
            if other_kind == "barrel":
                # Both of its bodies stay or both move, unless it is the hinge that turns.
                if inside[other] == moves:
                    continue
            elif inside[other] == moves:
                continue
            if other_kind == "plate" and not moves:
                continue
            pair = (body, other) if moves else (other, body)
            if pair in found:
                continue
            sense = way if moves else -way
            if _plate_meets(
                (where - point)[[*plane, along]],
                [*plane, along].index(normal),
                other_kind,
                (there - point)[[*plane, along]],
                -1 if line < 0 else [*plane, along].index(line),
                sense * angles,
            ):
                found.add(pair)
    return sorted(found)


def _plate_meets(  # noqa: PLR0911 - one kind of thing after the other
    plate: NDArray[np.float64],
    normal: int,
    kind: str,
    other: NDArray[np.float64],
    line: int,
    angles: NDArray[np.float64],
) -> bool:
    """Whether a plate that turns about the third axis meets something that stays.

    Parameters
    ----------
    plate, other : (3,) float64 arrays
        Middles; the axis of the turn is the third one, through the origin.
    normal : int
        Of the plate.
    kind : str
        "cell", "plate" (`line` is its normal) or "barrel" (`line` is its direction).
    angles : (a,) float64 array
    """
    upright = normal == 2
    least = 0.0
    if abs(plate[2] - other[2]) > 1e-9 or np.linalg.norm(plate[:2]) > np.linalg.norm(other[:2]) + 3:
        return False
    if kind == "cell":
        if upright:
            return False
        mine, theirs = [0.5, 0.5], (0.5, 0.5)
        mine[normal] = 0.0
    elif kind == "barrel":
        if (line == 2) == upright:
            return False
        # A ball about any point of the plate's core, as wide as the plate is thick, lies in it.
        least = PLATE_ROOM + PLATE_THICK / 2 - ROUNDING
        core = 0.5 - PLATE_ROOM - PLATE_THICK / 2
        mine = [core, core]
        theirs = (0.0, 0.0)
        if upright:
            half = 0.5 - BARREL_INSET
            theirs = (half * (line == 0), half * (line == 1))
        else:
            mine[normal] = 0.0
    else:
        if (line == 2) != upright:
            return False
        if upright:
            mine, theirs = [0.5, 0.5], (0.5, 0.5)
        else:
            least = PLATE_LEAST - ROUNDING
            half = 0.5 - PLATE_ROOM
            mine = [half, half]
            mine[normal] = 0.0
            theirs = (half * (line != 0), half * (line != 1))
    size = (mine[0], mine[1])
    for angle in angles:
        cosine, sine = np.cos(angle), np.sin(angle)
        spin = np.array([[cosine, -sine], [sine, cosine]])
        if least == 0.0:
            if _plane_overlap(plate[:2], size, spin, other[:2], theirs) > TOUCH:
                return True
        elif (
            _plane_overlap(plate[:2], size, spin, other[:2], theirs) > TOUCH
            or _plane_distance(plate[:2], size, spin, other[:2], theirs) < least
        ):
            return True
    return False


def stuck(system: HingeSystem, quarters: NDArray[np.integer], way: int) -> int:
    """Hinges that the closure test finds stuck, counted by its definition."""
    hinges = len(system.parent)
    if not state_is_valid(system, quarters):
        return hinges
    chain: list[set[int]] = [set()]
    for h in range(hinges):
        chain.append(chain[system.parent[h]] | {h})
    blocked: list[list[set[int]]] = []
    for h in range(hinges):
        turn = int(np.sign(system.turns[h])) * way
        deep = turn_overlap(system, quarters, h, turn)
        body = np.asarray(system.body)
        ways = [chain[body[i]] ^ chain[body[j]] for i, j in np.argwhere(deep > TOUCH)]
        for g, other in barrel_meetings(system, quarters, h, turn):
            # Each barrel goes with both of its bodies: take the two that are nearest.
            ends = [
                chain[a] ^ chain[b]
                for a in (g + 1, int(system.parent[g]))
                for b in (other + 1, int(system.parent[other]))
            ]
            ways.append(min(ends, key=len))
        ways += [chain[a] ^ chain[b] for a, b in plate_meetings(system, quarters, h, turn)]
        blocked.append(ways)
    movable: set[int] = set()
    while True:
        more = {
            h
            for h in range(hinges)
            if h not in movable and all(way & movable for way in blocked[h])
        }
        if not more:
            return hinges - len(movable)
        movable |= more
