"""Two copies of a kit, one in A and one in B, unfolded by forces until they meet.

The paper's section 5: voxels of one shape repel each other with a force ∝ 1/r², in both shapes at
once; then the forces change, and each voxel is drawn to where it is in the other shape. Where both
copies have the same angles, the way of the one and the way of the other backwards are a path from
A to B. A person may push and pin voxels and carve them; every action is recorded, and the same
actions give the same motion.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import RecipeError
from fabfold.fold.core_sweep import CORE_HALF_SIDE
from fabfold.physics.actions import Action, Match, PinVoxel, Push, Release, Unfold, Wait
from fabfold.physics.rig import Box, hinge_joints, rig_model
from fabfold.tree.fold_tree import FoldTree
from fabfold.tree.sharing import WHOLE, unpacked

if TYPE_CHECKING:
    import mujoco

__all__ = ["Unfolding", "cell_boxes", "repulsion"]

F64 = NDArray[np.float64]

#: Half side of a cell's box: neighbours begin 2 % of a voxel apart.
_HALF_SIDE = 0.49
_TIME_STEP = 0.01
#: Repulsion of two voxels one voxel side apart, attraction of two voxels for one side between
#: them, and what slows a voxel down; a voxel weighs 1. Critically damped where A meets B.
_REPULSION, _ATTRACTION, _DRAG, _HINGE_DRAG = 20.0, 10.0, 2.0, 2.0
#: Stiffness of what holds a pinned voxel.
_PIN: Final = 300.0
#: Time steps between two records of the angles.
_EVERY = 5
#: A and B have met when no hinge differs by more, degrees.
_MET_DEG = 0.5


def cell_boxes(tree: FoldTree, carved: Collection[int]) -> tuple[list[Box], list[int]]:
    """Boxes that stand for the voxels in the simulation.

    Parameters
    ----------
    tree : FoldTree
        Its voxels; of one that shares its cell in B, the eighths that it keeps to.
    carved : collection of int
        Voxels of which only the core is left.

    Returns
    -------
    boxes : list of Box
        In lattice units of shape A.
    voxels : list of int
        Voxel of each box.
    """
    boxes, voxels = [], []
    for voxel, body in enumerate(tree.voxel_body.tolist()):
        cell = tree.source[voxel].astype(float)
        parts = [(cell, CORE_HALF_SIDE if voxel in carved else _HALF_SIDE)]
        if tree.octants is not None and tree.octants[voxel] != WHOLE:
            sides = np.argwhere(unpacked(tree.octants[voxel : voxel + 1])[0])
            parts = [(cell + side / 2 - 0.25, parts[0][1] - 0.25) for side in sides]
        for middle, half in parts:
            boxes.append(Box(body, middle - half, middle + half))
            voxels.append(voxel)
    return boxes, voxels


def repulsion(place: F64) -> F64:
    """Force on every voxel: ∝ 1/r² from each other voxel (paper section 5).

    Parameters
    ----------
    place : (n, 3) float64 array
        Centres of the voxels, voxel sides.

    Returns
    -------
    (n, 3) float64 array
        Forces; 20 between two voxels one side apart.
    """
    away = place[:, None] - place[None, :]
    square = np.einsum("nmi,nmi->nm", away, away)
    np.fill_diagonal(square, 1.0)
    return np.asarray(np.einsum("nmi,nm->ni", away, _REPULSION / square**1.5))


@dataclass
class _Copy:
    """One of the two copies, and what a person does to it."""

    data: mujoco.MjData
    place: F64  # of all voxels, at the last step
    pushes: dict[int, F64] = field(default_factory=dict)
    pins: dict[int, F64] = field(default_factory=dict)


@dataclass(frozen=True)
class _State:
    """All that the motion of a copy goes on from."""

    position: F64  # of all hinges, radians
    speed: F64
    place: F64
    pushes: dict[int, F64]
    pins: dict[int, F64]


@dataclass(frozen=True)
class _Snapshot:
    """All that an action may change."""

    states: dict[str, _State]
    carved: frozenset[int]
    records: int
    actions: int
    steps: int


class Unfolding:
    """A simulation in MuJoCo of two copies of a kit that do not see each other.

    Parameters
    ----------
    tree : FoldTree
        What folds; its root body is held in both copies.

    Attributes
    ----------
    actions : list of Action
        What was done so far.
    carved : set of int
        Voxels that were carved.
    """

    def __init__(self, tree: FoldTree) -> None:
        self.tree = tree
        self.actions: list[Action] = []
        self.carved: set[int] = set()
        self._steps = 0
        self._track: dict[str, list[F64]] = {"A": [], "B": []}
        self._snapshots: list[_Snapshot] = []
        self._load()
        self._copies = {
            shape: self._copy(np.radians(angles), np.zeros(len(tree.hinges)))
            for shape, angles in (("A", np.zeros(len(tree.hinges))), ("B", tree.fold_angles))
        }
        self._record()

    # What there is --------------------------------------------------------------------------

    def angles_deg(self, shape: str) -> F64:
        """Angles of all hinges in one copy, degrees, shape (h,)."""
        return np.asarray(np.degrees(self._copies[shape].data.qpos[self._joint]))

    @property
    def difference_deg(self) -> float:
        """Furthest that any hinge is apart in the two copies, degrees."""
        return float(np.abs(self.angles_deg("A") - self.angles_deg("B")).max(initial=0.0))

    @property
    def met(self) -> bool:
        """Whether the two copies have the same angles."""
        return bool(self.difference_deg <= _MET_DEG)

    def way_deg(self, shape: str) -> F64:
        """Angles of all hinges on the way of one copy, degrees, shape (t, h)."""
        return np.asarray(np.degrees(np.array(self._track[shape])))

    def pressed(self) -> list[tuple[float, int, int]]:
        """Pairs of voxels of different bodies that press on each other, hardest first.

        Returns
        -------
        list of (force, voxel, voxel)
            Of both copies; in the simulator's unit of force.
        """
        import mujoco

        found: dict[tuple[int, int], float] = {}
        force = np.zeros(6)
        for copy in self._copies.values():
            for number, contact in enumerate(copy.data.contact):
                pair = self._voxel[list(contact.geom)]
                if (pair < 0).any():
                    continue
                mujoco.mj_contactForce(self._model, copy.data, number, force)
                key = (int(pair.min()), int(pair.max()))
                found[key] = found.get(key, 0.0) + abs(float(force[0]))
        return sorted(((f, *pair) for pair, f in found.items()), key=lambda e: (-e[0], e[1:]))

    # What can be done -----------------------------------------------------------------------

    def do(self, action: Action, *, joined: bool = False) -> None:
        """Do one action, and record it.

        Parameters
        ----------
        action : Action
            What to do.
        joined : bool
            Record more steps of the same force as one action with those before.

        Raises
        ------
        RecipeError
            If the tree has no such voxel.
        """
        voxel = getattr(action, "voxel", None)
        if voxel is not None and voxel >= len(self.tree.source):
            raise RecipeError(
                f"actions: there is no voxel {voxel}; this kit has 0 to {len(self.tree.source) - 1}"
            )
        last = self.actions[-1] if self.actions and joined else None
        if isinstance(action, Unfold | Match | Wait) and last is not None and last.do == action.do:
            self.actions[-1] = action.model_copy(update={"steps": last.steps + action.steps})
        else:
            before = self._snapshot()
            # An action goes on from what a snapshot holds and from nothing else, so that what is
            # done after an undo is what its list of actions does.
            self._restore(before.states)
            self._snapshots.append(before)
            self.actions.append(action)
        if isinstance(action, Unfold | Match | Wait):
            for _ in range(action.steps):
                self._step(action)
        elif isinstance(action, Push):
            pushes = self._copies[action.shape].pushes
            pushes[action.voxel] = np.array(action.force)
            if not any(action.force):
                del pushes[action.voxel]
        elif isinstance(action, PinVoxel):
            copy = self._copies[action.shape]
            body = self.tree.voxel_body[action.voxel]
            for other in self.tree.bodies[body].voxels:
                copy.pins[other] = copy.place[other].copy()
        elif isinstance(action, Release):
            self._copies[action.shape].pushes.clear()
            self._copies[action.shape].pins.clear()
        else:
            self.carved.add(action.voxel)
            states = self._snapshot().states
            self._load()
            self._restore(states)

    def undo(self) -> bool:
        """Take back the last action; False where there is none."""
        if not self._snapshots:
            return False
        last = self._snapshots.pop()
        if last.carved != self.carved:
            self.carved = set(last.carved)
            self._load()
        self._restore(last.states)
        self._steps = last.steps
        for track in self._track.values():
            del track[last.records :]
        del self.actions[last.actions :]
        return True

    # How it is done -------------------------------------------------------------------------

    def _load(self) -> None:
        """Make the model of the rig with what is carved now."""
        boxes, voxels = cell_boxes(self.tree, self.carved)
        end = self.tree.fold_angles
        self._model = rig_model(
            self.tree, boxes, time_step=_TIME_STEP, density=1.0, damping=_HINGE_DRAG,
            limits_deg=(np.minimum(end, 0.0), np.maximum(end, 0.0)),
        )  # fmt: skip
        model = self._model
        self._joint, self._speed = hinge_joints(model, self.tree)
        body = [model.body(self.tree.bodies[b].name).id for b in self.tree.voxel_body]
        self._body = np.array(body, dtype=int)
        self._voxel = np.full(model.ngeom, -1)
        for number, voxel in enumerate(voxels):
            self._voxel[model.geom(f"box-{number}").id] = voxel

    def _copy(self, position: F64, speed: F64) -> _Copy:
        import mujoco

        data = mujoco.MjData(self._model)
        data.qpos[self._joint], data.qvel[self._speed] = position, speed
        mujoco.mj_forward(self._model, data)
        return _Copy(data, self._places(data))

    def _restore(self, states: dict[str, _State]) -> None:
        """Let both copies go on from a state."""
        for shape, state in states.items():
            copy = self._copy(state.position, state.speed)
            copy.place = state.place
            copy.pushes, copy.pins = dict(state.pushes), dict(state.pins)
            self._copies[shape] = copy

    def _places(self, data: mujoco.MjData) -> F64:
        """Centres of all voxels, (n, 3); frames of bodies are at shape A's origin."""
        turn = data.xmat[self._body].reshape(-1, 3, 3)
        return np.asarray(np.einsum("nij,nj->ni", turn, self.tree.source) + data.xpos[self._body])

    def _step(self, action: Unfold | Match | Wait) -> None:
        """One time step of both copies."""
        import mujoco

        places = {shape: self._places(copy.data) for shape, copy in self._copies.items()}
        for shape, other in (("A", "B"), ("B", "A")):
            copy, place = self._copies[shape], places[shape]
            force = np.zeros_like(place)
            if isinstance(action, Match):
                force = _ATTRACTION * (places[other] - place)
            elif isinstance(action, Unfold):
                force = repulsion(place)
            force -= _DRAG * (place - copy.place) / _TIME_STEP
            for voxel, push in copy.pushes.items():
                force[voxel] += push
            for voxel, anchor in copy.pins.items():
                force[voxel] += _PIN * (anchor - place[voxel])
            copy.data.qfrc_applied[:] = 0.0
            for voxel in range(len(place)):
                mujoco.mj_applyFT(
                    self._model, copy.data, force[voxel], np.zeros(3), place[voxel],
                    self._body[voxel], copy.data.qfrc_applied,
                )  # fmt: skip
            copy.place = place
        for copy in self._copies.values():
            mujoco.mj_step(self._model, copy.data)
        self._steps += 1
        if self._steps % _EVERY == 0:
            self._record()

    def _record(self) -> None:
        for shape, copy in self._copies.items():
            self._track[shape].append(copy.data.qpos[self._joint].copy())

    def _snapshot(self) -> _Snapshot:
        states = {
            shape: _State(
                copy.data.qpos[self._joint].copy(),
                copy.data.qvel[self._speed].copy(),
                copy.place.copy(),
                dict(copy.pushes),
                dict(copy.pins),
            )
            for shape, copy in self._copies.items()
        }
        records, actions = len(self._track["A"]), len(self.actions)
        return _Snapshot(states, frozenset(self.carved), records, actions, self._steps)
