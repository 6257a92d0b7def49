"""The order in which a kit of single bodies is put together, pin by pin.

It is found backwards. The whole kit is taken apart: a pin may be drawn where its rod is free of
everything that still hangs together, and where the two sides then come apart along a straight
line; each side goes on by itself. Both may need the kit half folded, so poses of the certified path
are tried, shape A first. Taking something away never blocks anything, so nothing has to be undone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import GeometryError
from fabfold.export.raster import fill_depth
from fabfold.fold.motion import Motion
from fabfold.joinery.bodies import Joinery
from fabfold.joinery.body_poses import poses_in_mm
from fabfold.joinery.cells import solids_of
from fabfold.joinery.loose_pins import (
    PinBore,
    barrel_around,
    entry_channel,
    pin_rod,
)
from fabfold.joinery.pin_kinds import PinFit
from fabfold.progress import Progress
from fabfold.tree.fold_tree import FoldTree

if TYPE_CHECKING:
    import manifold3d

__all__ = ["AssemblyStep", "find_order", "poses_to_try"]

Floats = NDArray[np.float64]

#: The rod that has to be free is this much wider than the pin or its head, in radius, mm.
ROD_ROOM_MM = 0.1
#: Bodies hit a rod where they share more than this with it, mm³.
_TOUCH_MM3 = 1e-3
#: Texels of the height maps that tell whether two sides come apart, mm.
_TEXEL_MM = 0.25
#: Heights that differ by less count as apart: facets and rounding, mm.
_HEIGHT_MM = 0.05


@dataclass(frozen=True)
class AssemblyStep:
    """One pin on the way from single bodies to the kit.

    Attributes
    ----------
    pin : int
        Index of the pin.
    end : int
        The end of its axis, as of :meth:`fabfold.joinery.loose_pins.PinBore.face`, at which it
        goes in.
    angles_deg : (h,) tuple of float
        Pose of the path in which both sides are brought together; only the hinges that are
        there already count.
    sides : tuple of tuple of int
        Bodies of the side that rests, and of the side that is brought.
    away : (3,) tuple of float
        Unit vector in the world of the pose, along which the second side leaves; it comes the
        other way.
    """

    pin: int
    end: int
    angles_deg: tuple[float, ...]
    sides: tuple[tuple[int, ...], tuple[int, ...]]
    away: tuple[float, float, float]

    def to_json(self) -> dict[str, Any]:
        """Ready for a JSON file."""
        return {
            "pin": self.pin,
            "end": self.end,
            "angles_deg": list(self.angles_deg),
            "sides": [list(side) for side in self.sides],
            "away": list(self.away),
        }

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> AssemblyStep:
        """A step from what :meth:`to_json` wrote."""
        rests, comes = (tuple(side) for side in data["sides"])
        x, y, z = data["away"]
        return cls(data["pin"], data["end"], tuple(data["angles_deg"]), (rests, comes), (x, y, z))


def poses_to_try(motion: Motion) -> list[Floats]:
    """Poses of the path in the order in which they are tried: by quarter turns, then by eighths.

    Parameters
    ----------
    motion : Motion
        The folding path.

    Returns
    -------
    list of (h,) float64 array
        Angles of all hinges in degrees, shape A first, none twice.
    """
    found: dict[bytes, Floats] = {}
    for step in (90.0, 45.0):
        for before, after in zip(motion.angles_deg[:-1], motion.angles_deg[1:], strict=True):
            parts = max(1, round(float(np.abs(after - before).max()) / step))
            for part in range(parts + 1):
                pose = before + (after - before) * part / parts
                found.setdefault(np.round(pose, 6).tobytes(), pose)
    if not found:
        found[b""] = np.zeros(motion.angles_deg.shape[1])
    return list(found.values())


def find_order(
    tree: FoldTree,
    motion: Motion,
    joinery: Joinery,
    bores: Sequence[PinBore],
    fit: PinFit,
    progress: Progress,
) -> list[AssemblyStep]:
    """Find an order in which all pins can be pushed in.

    Parameters
    ----------
    tree : FoldTree
        The bodies and their hinges.
    motion : Motion
        The certified path.
    joinery : Joinery
        Bodies with open bores.
    bores : sequence of PinBore
        Where the pins go.
    fit : PinFit
        How the pins sit in their bores.
    progress : Progress
        Hears how many pins have their place in the order.

    Returns
    -------
    list of AssemblyStep
        In the order in which the kit is put together.

    Raises
    ------
    GeometryError
        If some pins cannot be pushed in, in no pose and from no end; it names their hinges.
    """
    search = _Disassembly(tree, motion, joinery, bores, fit)
    steps: list[AssemblyStep] = []
    todo = [(frozenset(range(len(tree.bodies))), 0)]
    while todo:
        whole, pose = todo.pop()
        pins = [i for i, bore in enumerate(bores) if whole.issuperset(bore.bodies)]
        if not pins:
            continue
        found = search.next_pin(whole, pins, pose)
        if found is None:
            names = ", ".join(tree.hinges[bores[pin].hinge].name for pin in pins)
            raise GeometryError(f"no order of assembly: no pin of {names} can be pushed in")
        step, pose = found
        steps.append(step)
        todo += [(frozenset(side), pose) for side in step.sides]
        progress.update(len(steps) / len(bores), f"{len(steps)} of {len(bores)} pins")
    return steps[::-1]


class _Disassembly:
    """What is known while a kit is taken apart."""

    def __init__(
        self,
        tree: FoldTree,
        motion: Motion,
        joinery: Joinery,
        bores: Sequence[PinBore],
        fit: PinFit,
    ) -> None:
        self._tree, self._joinery, self._bores = tree, joinery, bores
        self._angles = poses_to_try(motion)
        self._solids = solids_of(joinery.bodies)
        self._placed: dict[int, Floats] = {}
        self._posed: dict[tuple[int, int], manifold3d.Manifold] = {}
        widest = max(joinery.pin_radius_mm, fit.head_mm)
        self._rods = [
            {e: pin_rod(bore, e, widest + ROD_ROOM_MM) for e in (1, -1)} for bore in bores
        ]
        self._ends = [self._cheap_ends(bore, fit) for bore in bores]

    def _cheap_ends(self, bore: PinBore, fit: PinFit) -> list[int]:
        """Ends at which a pin may go in as far as its own bodies are concerned, cheapest first.

        Its bodies give way to it, but for knuckles of theirs on other axes.
        """
        costs = []
        barrels = [
            barrel_around(other, self._joinery)
            for other in self._bores
            if other is not bore and set(other.bodies) & set(bore.bodies)
        ]
        for end in (1, -1):
            channel = entry_channel(bore, end, self._joinery, fit)
            taken = [self._solids[body] ^ channel for body in bore.bodies]
            if any((part ^ barrel).volume() > _TOUCH_MM3 for part in taken for barrel in barrels):
                continue
            cost = sum(float(part.volume()) for part in taken)
            costs.append((round(cost, 3), -end, end))
        return [end for _, _, end in sorted(costs)]

    def next_pin(
        self, whole: frozenset[int], pins: list[int], pose: int
    ) -> tuple[AssemblyStep, int] | None:
        """A pin that can be drawn, and the pose in which it can."""
        order = sorted(pins, key=lambda pin: (self._smaller_side(whole, pin), pin))
        poses = self._distinct_poses(whole, pose)
        for choice in (0, 1):  # the cheaper end in every pose before the dearer one in any
            for at in poses:
                for pin in order:
                    if choice >= len(self._ends[pin]):
                        continue
                    end = self._ends[pin][choice]
                    if not self._rod_is_free(whole, pin, end, at):
                        continue
                    sides = self._sides(whole, pin)
                    away = self._apart(sides, pin, at)
                    if away is None:
                        continue
                    angles = tuple(float(angle) for angle in self._angles[at])
                    return AssemblyStep(pin, end, angles, sides, away), at
        return None

    def _distinct_poses(self, whole: frozenset[int], first: int) -> list[int]:
        """Poses that differ in what hangs together, the given one first."""
        inside = [
            index
            for index, hinge in enumerate(self._tree.hinges)
            if hinge.parent in whole and hinge.child in whole
        ]
        found: dict[bytes, int] = {}
        for pose in (first, *range(len(self._angles))):
            found.setdefault(np.round(self._angles[pose][inside], 6).tobytes(), pose)
        return list(found.values())

    def _sides(self, whole: frozenset[int], pin: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """The two parts that a pin holds together, the larger first."""
        cut = self._bores[pin].hinge
        parent = {body: body for body in whole}

        def root(body: int) -> int:
            while parent[body] != body:
                body = parent[body]
            return body

        for index, hinge in enumerate(self._tree.hinges):
            if index != cut and hinge.parent in whole and hinge.child in whole:
                parent[root(hinge.parent)] = root(hinge.child)
        parts: dict[int, list[int]] = {}
        for body in sorted(whole):
            parts.setdefault(root(body), []).append(body)
        ordered = sorted(parts.values(), key=lambda part: (-len(part), part))
        rests, comes = ordered
        return tuple(rests), tuple(comes)

    def _smaller_side(self, whole: frozenset[int], pin: int) -> int:
        return len(self._sides(whole, pin)[1])

    def _poses(self, at: int) -> Floats:
        if at not in self._placed:
            self._placed[at] = poses_in_mm(self._tree, self._joinery, self._angles[at])
        return self._placed[at]

    def _solid(self, body: int, at: int) -> manifold3d.Manifold:
        if (body, at) not in self._posed:
            self._posed[body, at] = self._solids[body].transform(self._poses(at)[body][:3])
        return self._posed[body, at]

    def _rod_is_free(self, whole: frozenset[int], pin: int, end: int, at: int) -> bool:
        """Whether pin and pusher pass all bodies but the pin's own, which give way to them."""
        bore = self._bores[pin]
        rod = self._rods[pin][end].transform(self._poses(at)[bore.bodies[0]][:3])
        box = np.reshape(rod.bounding_box(), (2, 3))
        for body in sorted(whole.difference(bore.bodies)):
            low, high = np.reshape(self._solid(body, at).bounding_box(), (2, 3))
            if (low > box[1]).any() or (high < box[0]).any():
                continue
            if (rod ^ self._solid(body, at)).volume() > _TOUCH_MM3:
                return False
        return True

    def _apart(
        self, sides: tuple[tuple[int, ...], tuple[int, ...]], pin: int, at: int
    ) -> tuple[float, float, float] | None:
        """A direction across the axis in which the second side leaves the first."""
        bore, poses = self._bores[pin], self._poses(at)
        axis = poses[bore.bodies[0]][:3, :3] @ bore.axis
        x = np.eye(3)[(int(np.abs(bore.axis).argmax()) + 1) % 3]
        x = poses[bore.bodies[0]][:3, :3] @ x
        meshes = [self._gathered(side, at) for side in sides]
        for eighth in (0, 4, 2, 6, 1, 3, 5, 7):
            turn = np.pi / 4 * eighth
            away = np.cos(turn) * x + np.sin(turn) * np.cross(axis, x)
            if comes_away(meshes[0], meshes[1], away, axis):
                u, v, w = np.round(away, 9).tolist()
                return u, v, w
        return None

    def _gathered(self, side: Sequence[int], at: int) -> tuple[Floats, NDArray[np.int32]]:
        points, corners, start = [], [], 0
        for body in side:
            pose, mesh = self._poses(at)[body], self._joinery.bodies[body]
            points.append(mesh.vertices @ pose[:3, :3].T + pose[:3, 3])
            corners.append(mesh.faces + np.int32(start))
            start += len(mesh.vertices)
        return np.concatenate(points), np.concatenate(corners).astype(np.int32)


def comes_away(
    rests: tuple[Floats, NDArray[np.int32]],
    leaves: tuple[Floats, NDArray[np.int32]],
    away: Floats,
    axis: Floats,
) -> bool:
    """Whether one part leaves another along a straight line, to any distance.

    On every line of a grid of parallel lines, the top of what rests lies below the bottom of what
    leaves. What is finer than the grid is left to :mod:`fabfold.apart.pin_replay`.

    Parameters
    ----------
    rests, leaves : ((v, 3) float64 array, (f, 3) int32 array)
        Vertices in mm and triangles of the two parts.
    away : (3,) float64 array
        Unit vector along which the second part leaves.
    axis : (3,) float64 array
        Any unit vector across it.

    Returns
    -------
    bool
        True where it leaves freely.
    """
    frame = np.stack([axis, np.cross(away, axis), away])
    first, second = rests[0] @ frame.T, leaves[0] @ frame.T
    low = np.maximum(first.min(axis=0), second.min(axis=0))[:2] - _TEXEL_MM
    high = np.minimum(first.max(axis=0), second.max(axis=0))[:2] + _TEXEL_MM
    if (high <= low).any():
        return True
    size = int(np.ceil((high - low).max() / _TEXEL_MM)) + 1
    top = _heights(first, rests[1], low, size)
    # Seen from below, one axis runs the other way.
    mirrored = second * np.array([-1.0, 1.0, -1.0])
    corner = np.array([-(low[0] + size * _TEXEL_MM), low[1]])
    bottom = -_heights(mirrored, leaves[1], corner, size)[:, ::-1]
    return bool((top <= bottom + _HEIGHT_MM).all())


def _heights(points: Floats, corners: NDArray[np.int32], low: Floats, size: int) -> Floats:
    """Greatest height of a mesh over each texel of a square; -1e30 where there is nothing."""
    flat = points.copy()
    flat[:, :2] = (points[:, :2] - low) / _TEXEL_MM
    return np.asarray(fill_depth(flat, corners, size), dtype=np.float64)
