"""What holds a kit shut: magnets where they take most of what still moves, friction for the rest.

To first order a folded kit is a linkage: the speed of every point is linear in the speeds of the
hinges. Faces that meet may only part, which bounds some of these speeds; a pair of magnets holds
two bodies together where it sits, which takes up to three. Pairs are chosen one by one, each the
one that leaves the fewest ways to move, until nothing moves or no pair helps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from fabfold.fold.motion import Motion
from fabfold.joinery.bodies import Joinery
from fabfold.joinery.body_poses import poses_in_mm
from fabfold.joinery.box_faces import are_flush, face_meetings
from fabfold.joinery.cells import solids_of
from fabfold.joinery.free_motions import free_hinges, null_space, rank_of
from fabfold.joinery.friction_pins import PinFriction
from fabfold.joinery.linkage import Linkage
from fabfold.joinery.magnets import MagnetPair, Pocket, pair_place, with_pockets
from fabfold.tree.fold_tree import FoldTree

if TYPE_CHECKING:
    import manifold3d

__all__ = ["Retention", "hinges_that_move", "hold_by_magnets"]

Floats = NDArray[np.float64]

#: Magnets of two pairs feel each other where they come nearer than this many diameters.
_NEAR = 3.0


@dataclass(frozen=True)
class Retention:
    """What holds a kit shut.

    Attributes
    ----------
    free_before : tuple of int
        Indices of the hinges that move, to first order, when the box's faces are shut and nothing
        holds them.
    free_after : tuple of int
        The same with the magnets: these are held by friction only.
    magnet : str
        Name of the magnets, of :data:`fabfold.joinery.magnets.MAGNETS`; empty where there are none.
    skin_mm : float
        Material between a magnet and the face, mm; 0 where pockets are open.
    pairs : tuple of MagnetPair
        Where they are.
    in_a : (tuple of int, tuple of int) or None
        As `free_before` and `free_after`, of the model before it is folded; None where nothing
        holds that.
    repelling : int
        Pairs of magnets of different pairs that come near each other in A or B and repel.
    friction : PinFriction or None
        Pins that both bodies grip, and how well they hold.
    """

    free_before: tuple[int, ...]
    free_after: tuple[int, ...]
    magnet: str = ""
    skin_mm: float = 0.0
    pairs: tuple[MagnetPair, ...] = ()
    in_a: tuple[tuple[int, ...], tuple[int, ...]] | None = None
    repelling: int = 0
    friction: PinFriction | None = None

    def to_json(self) -> dict[str, Any]:
        """Ready for a JSON file."""
        return {
            "free_before": list(self.free_before),
            "free_after": list(self.free_after),
            "magnet": self.magnet,
            "skin_mm": self.skin_mm,
            "pairs": [pair.to_json() for pair in self.pairs],
            "in_a": None if self.in_a is None else [list(row) for row in self.in_a],
            "repelling": self.repelling,
            "friction": None if self.friction is None else self.friction.to_json(),
        }

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> Retention:
        """Retention from what :meth:`to_json` wrote."""
        in_a, friction = data["in_a"], data["friction"]
        return cls(
            tuple(data["free_before"]),
            tuple(data["free_after"]),
            data["magnet"],
            data["skin_mm"],
            tuple(MagnetPair.from_json(entry) for entry in data["pairs"]),
            None if in_a is None else (tuple(in_a[0]), tuple(in_a[1])),
            data["repelling"],
            None if friction is None else PinFriction.from_json(friction),
        )


class _Shut:
    """A kit in one of its two shapes, its faces shut."""

    def __init__(
        self, tree: FoldTree, joinery: Joinery, angles_deg: Floats, shape: Literal["A", "B"]
    ) -> None:
        self.shape, self.joinery = shape, joinery
        self.poses = poses_in_mm(tree, joinery, angles_deg)
        self.linkage = Linkage(tree, joinery, self.poses)
        self.solids: list[manifold3d.Manifold] = solids_of(joinery.bodies)
        self.meetings = face_meetings(tree, joinery, self.poses)
        shut = [
            self.linkage.parting(meeting)
            for meeting in self.meetings
            if are_flush(meeting, joinery, self.solids, self.poses)
        ]
        self.bounds = np.concatenate([np.zeros((0, len(tree.hinges))), *shut])

    def held(self, pairs: Sequence[MagnetPair]) -> Floats:
        """Rows that are 0 where all pairs hold."""
        none = np.zeros((0, self.bounds.shape[1]))
        return np.concatenate([none, *(self._rows(pair) for pair in pairs)])

    def free(self, pairs: Sequence[MagnetPair]) -> list[int]:
        """Hinges that move with these pairs."""
        return free_hinges(self.bounds, self.held(pairs))

    def choose(self, pocket: Pocket) -> tuple[list[MagnetPair], list[int], list[int]]:
        """Pairs, and the hinges that move without and with them."""
        free = before = self.free([])
        places = (
            pair_place(meeting, self.joinery, self.solids, self.poses, pocket, self.shape)
            for meeting in self.meetings
        )
        candidates = [(pair, self._rows(pair)) for pair in places if pair is not None]
        chosen: list[MagnetPair] = []
        while free and candidates:
            still = null_space(self.held(chosen))
            ranks = [rank_of(rows @ still) for _, rows in candidates]
            best = int(np.argmax(ranks))
            if ranks[best] == 0:
                break
            chosen.append(candidates.pop(best)[0])
            free = self.free(chosen)
        return self._without_idle(chosen, free), before, free

    def _without_idle(self, chosen: list[MagnetPair], free: list[int]) -> list[MagnetPair]:
        """Pairs without which more would move; later ones may have made earlier ones idle."""
        kept = list(chosen)
        for pair in chosen:
            rest = [other for other in kept if other is not pair]
            if len(self.free(rest)) <= len(free):
                kept = rest
        return kept

    def _rows(self, pair: MagnetPair) -> Floats:
        pose = self.poses[pair.bodies[0]]
        place = pose[:3, :3] @ np.array(pair.points_mm[0]) + pose[:3, 3]
        return self.linkage.together(pair.bodies, place)


def hinges_that_move(tree: FoldTree, motion: Motion, joinery: Joinery) -> list[int]:
    """Hinges of the box that move, to first order, when its faces are shut and nothing holds it.

    Parameters
    ----------
    tree, motion, joinery
        The bodies, their hinges, and the path whose end is the box.

    Returns
    -------
    list of int
        Their indices.
    """
    return _Shut(tree, joinery, motion.angles_deg[-1], "B").free([])


def hold_by_magnets(
    tree: FoldTree,
    motion: Motion,
    joinery: Joinery,
    pocket: Pocket,
    stand: Floats | None = None,
    *,
    in_a: bool = False,
) -> tuple[Joinery, Retention]:
    """Choose pairs of magnets and cut their pockets.

    Parameters
    ----------
    tree : FoldTree
        The bodies and their hinges.
    motion : Motion
        The folding path; its end is the box.
    joinery : Joinery
        The printed bodies.
    pocket : Pocket
        What is to be put in, and how.
    stand : (b, 4, 4) float64 array, optional
        From shape A to where each body is printed, the plate at z = 0, mm; as it is by default.
    in_a : bool
        Whether magnets hold the model before it is folded too.

    Returns
    -------
    joinery : Joinery
        The bodies with pockets.
    retention : Retention
        Where the pairs are, and what moves before and after.
    """
    if stand is None:
        stand = np.tile(np.eye(4), (len(joinery.bodies), 1, 1))
    found: dict[str, tuple[list[MagnetPair], list[int], list[int]]] = {}
    pairs: list[MagnetPair] = []
    ends: tuple[tuple[Literal["A", "B"], int], ...] = (("B", -1), ("A", 0))
    for shape, end in ends[: 2 if in_a else 1]:
        # Places in A keep off the pockets for B, which are cut by then.
        found[shape] = _Shut(tree, joinery, motion.angles_deg[end], shape).choose(pocket)
        joinery, made = with_pockets(joinery, found[shape][0], pocket, stand)
        pairs += made
    pairs, repelling = _with_poles(tree, motion, joinery, pairs, pocket)
    _, before, after = found["B"]
    unfolded = None
    if "A" in found:
        unfolded = (tuple(found["A"][1]), tuple(found["A"][2]))
    return joinery, Retention(
        tuple(before), tuple(after), pocket.magnet.name, pocket.skin_mm, tuple(pairs), unfolded,
        repelling,
    )  # fmt: skip


def _with_poles(
    tree: FoldTree, motion: Motion, joinery: Joinery, pairs: list[MagnetPair], pocket: Pocket
) -> tuple[list[MagnetPair], int]:
    """Turn pairs so that no magnets of two pairs push each other apart in A or B, if it can be.

    Each pair is turned in its turn as those before it want most; returned with the number of
    meetings that still repel.
    """
    reach = _NEAR * pocket.magnet.diameter_mm
    deep = pocket.skin_mm + pocket.magnet.thick_mm / 2
    force = np.zeros((len(pairs), len(pairs)))
    meet: list[tuple[int, int, float]] = []
    for angles in (motion.angles_deg[0], motion.angles_deg[-1]):
        poses = poses_in_mm(tree, joinery, angles)
        placed = [_placed(pair, poses, deep) for pair in pairs]
        for one in range(len(pairs)):
            for other in range(one):
                for a, b in product(range(2), repeat=2):
                    if pairs[one].bodies[a] == pairs[other].bodies[b]:
                        continue
                    energy = _energy(placed[one][a], placed[other][b], reach)
                    if energy:
                        force[one, other] += energy
                        meet.append((one, other, energy))
    sign = np.ones(len(pairs))
    for one in range(len(pairs)):
        if float(force[one, :one] @ sign[:one]) > 0:
            sign[one] = -1.0
    repelling = sum(energy * sign[one] * sign[other] > 0 for one, other, energy in meet)
    turned = [pair if s > 0 else pair.turned() for pair, s in zip(pairs, sign, strict=True)]
    return turned, int(repelling)


def _placed(pair: MagnetPair, poses: Floats, deep: float) -> list[tuple[Floats, Floats]]:
    """Middle of each magnet in a pose, and where its north pole looks."""
    found = []
    for body, point, inward, out in zip(
        pair.bodies, pair.points_mm, pair.inwards, (-1.0, 1.0), strict=True
    ):
        turn, shift = poses[body][:3, :3], poses[body][:3, 3]
        into = turn @ np.array(inward)
        found.append((turn @ np.array(point) + shift + deep * into, out * into))
    return found


def _energy(one: tuple[Floats, Floats], other: tuple[Floats, Floats], reach: float) -> float:
    """Energy of two dipoles, 1 where they are one unit apart side by side; 0 out of reach."""
    way = other[0] - one[0]
    apart = float(np.linalg.norm(way))
    if not 1e-6 < apart < reach:
        return 0.0
    way = way / apart
    size = float(one[1] @ other[1] - 3.0 * (one[1] @ way) * (other[1] @ way)) / apart**3
    return size if abs(size) > 1e-9 else 0.0
