"""The kit in its maker's hands, in MuJoCo: with weight and friction, folded, and let go when shut.

The replay (:mod:`fabfold.proof.replay`) folds without weight, to see whether anything is in the
way. Here the bodies weigh what they weigh, in a chosen pose: motors fold the kit, and tell what
torque each hinge takes. Then the box is let go, with gravity from each of six sides and only its
magnets and friction pins to hold it, to see whether it stays shut.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from fabfold.fold.motion import Motion
from fabfold.joinery.bodies import Joinery
from fabfold.joinery.box_hold import Retention
from fabfold.joinery.magnets import MAGNETS
from fabfold.physics.rig import Box, Motor, hinge_joints, rig_model
from fabfold.progress import Progress, ProgressPart, SilentProgress
from fabfold.proof.replay import course, material_boxes, require_finite
from fabfold.tree.fold_tree import FoldTree

if TYPE_CHECKING:
    import mujoco

__all__ = ["SIDES", "Rehearsal", "let_go", "rehearse"]

F64 = NDArray[np.float64]

#: Directions that can be up, by name, in the axes of shape A.
SIDES: Final[dict[str, tuple[int, int, int]]] = {
    "+x": (1, 0, 0),
    "-x": (-1, 0, 0),
    "+y": (0, 1, 0),
    "-y": (0, -1, 0),
    "+z": (0, 0, 1),
    "-z": (0, 0, -1),
}

_TIME_STEP = 0.005
_GRAVITY_MM = 9810.0
#: Strong enough to lift; hinges do not rub, and turn slowly.
_MOTOR = Motor(40_000.0, 1200.0)
_DAMPING = 0.5
#: Seconds for which the box is let go, and the angle from which on it counts as open, degrees.
_LET_GO_S, _OPEN_DEG = 1.5, 5.0
#: A hinge opens no wider while it is let go, degrees: then it has fallen open.
_FALL_DEG = 30.0
#: The pull of two magnets falls to a third where they are this share of their diameter apart.
_PULL_REACH = 0.3


@dataclass(frozen=True)
class Rehearsal:
    """What was felt.

    Attributes
    ----------
    up : str
        Side of shape A that was up while folding; the root body was held.
    friction : float
        Coefficient of friction between bodies.
    weight_g : float
        Weight of all bodies.
    torque_nmm : tuple of float
        Largest torque that each hinge took in a move of its own, in the order of the hinges, N mm.
    held_nmm : tuple of float
        Largest torque that held each hinge while others moved, N mm.
    opens_deg : dict of str to float
        How far the widest hinge of the box opens when it is let go, by the side that is up.
    """

    up: str
    friction: float
    weight_g: float
    torque_nmm: tuple[float, ...]
    held_nmm: tuple[float, ...]
    opens_deg: dict[str, float]

    @property
    def stays_shut(self) -> tuple[str, ...]:
        """Sides that can be up without the box opening."""
        return tuple(side for side, angle in self.opens_deg.items() if angle < _OPEN_DEG)

    def to_json(self) -> dict[str, Any]:
        """Ready for JSON."""
        return {
            "up": self.up,
            "friction": self.friction,
            "weight_g": self.weight_g,
            "torque_nmm": list(self.torque_nmm),
            "held_nmm": list(self.held_nmm),
            "opens_deg": dict(self.opens_deg),
            "stays_shut": list(self.stays_shut),
        }


def rehearse(
    tree: FoldTree,
    motion: Motion,
    joinery: Joinery,
    density_g_cm3: float,
    *,
    up: str = "+z",
    friction: float = 0.3,
    retention: Retention | None = None,
    progress: Progress | None = None,
) -> Rehearsal:
    """Fold a kit with weight and friction, and let the box go.

    Parameters
    ----------
    tree, motion, joinery
        What folds, and its certified path.
    density_g_cm3 : float
        Of the material.
    up : str
        Side of shape A that is up while folding, a key of :data:`SIDES`.
    friction : float
        Coefficient between bodies that touch.
    retention : Retention, optional
        Magnets and friction pins that hold the box.
    progress : Progress, optional
        Hears of moves and sides.

    Returns
    -------
    Rehearsal
        The same for the same arguments.

    Raises
    ------
    CheckError
        If the simulation diverges.
    """
    progress = progress or SilentProgress()
    scene, weight_g = _scene(tree, motion, joinery, density_g_cm3, friction)
    turned, held = scene.fold(motion, up, progress)
    later = ProgressPart(progress, 0.7, 1.0)
    return Rehearsal(
        up,
        friction,
        round(weight_g, 1),
        tuple(np.round(turned, 1).tolist()),
        tuple(np.round(held, 1).tolist()),
        scene.on_all_sides(motion, joinery, retention, later),
    )


def let_go(
    tree: FoldTree,
    motion: Motion,
    joinery: Joinery,
    density_g_cm3: float,
    *,
    friction: float = 0.3,
    retention: Retention | None = None,
) -> dict[str, float]:
    """Let the box go without folding it first; parameters as of :func:`rehearse`.

    Returns
    -------
    dict of str to float
        How far its widest hinge opens, degrees, by the side that is up.
    """
    scene, _ = _scene(tree, motion, joinery, density_g_cm3, friction)
    return scene.on_all_sides(motion, joinery, retention, SilentProgress())


def _scene(
    tree: FoldTree, motion: Motion, joinery: Joinery, density_g_cm3: float, friction: float
) -> tuple[_Scene, float]:
    """A kit that weighs something, and how much, g."""
    meshes = [(body.vertices, body.faces) for body in joinery.bodies]
    gap = float(motion.certificate.get("min_gap_mm", joinery.clearance_mm))
    boxes = material_boxes(tree, meshes, joinery.voxel_mm, joinery.origin_mm, gap)
    room = sum(float((box.high - box.low).prod()) for box in boxes)
    weight_g = sum(body.volume for body in joinery.bodies) * density_g_cm3 / 1000.0
    return _Scene(tree, boxes, weight_g / 1000.0 / room, joinery.voxel_mm, friction), weight_g


class _Scene:
    """A kit that weighs something; lengths are voxel sides, masses kilograms."""

    def __init__(
        self, tree: FoldTree, boxes: Sequence[Box], density: float, side_mm: float, friction: float
    ) -> None:
        self._tree, self._boxes, self._density = tree, boxes, density
        self._side, self._friction = side_mm, friction

    def _gravity(self, up: str) -> list[float]:
        return [-_GRAVITY_MM / self._side * part for part in SIDES[up]]

    def fold(self, motion: Motion, up: str, progress: Progress) -> tuple[F64, F64]:
        """Largest torque of every hinge while it turns and while it is held, N mm, (h,) each."""
        import mujoco

        tree = self._tree
        model = rig_model(
            tree, self._boxes, time_step=_TIME_STEP, density=self._density, damping=_DAMPING,
            motor=_MOTOR, gravity=self._gravity(up), friction=self._friction,
        )  # fmt: skip
        data = mujoco.MjData(model)
        motor = np.array([model.actuator(h.name).id for h in tree.hinges], dtype=int)
        _, dof = hinge_joints(model, tree)
        # kg · side² / s² to N mm: a newton is kg · m / s².
        unit = self._side**2 / 1000.0
        turned, held = np.zeros(len(tree.hinges)), np.zeros(len(tree.hinges))
        moves = len(motion.moves) - 1
        for number, goal, rate in course(motion, 2.0, _TIME_STEP):
            if rate is None:
                require_finite(data, f"move {number} of {moves}, with {up} up")
                progress.update(0.7 * number / moves, f"folding move {number} of {moves}")
                continue
            data.ctrl[motor] = goal + rate * (_MOTOR.brake + _DAMPING) / _MOTOR.gain
            mujoco.mj_step(model, data)
            # What weight and contact ask for; hands are slow, so what speeds bodies up is left out.
            torque = np.abs(data.qfrc_bias[dof] - data.qfrc_constraint[dof]) * unit
            turning = rate != 0.0
            turned[turning] = np.maximum(turned, torque)[turning]
            held[~turning] = np.maximum(held, torque)[~turning]
        return turned, held

    def on_all_sides(
        self, motion: Motion, joinery: Joinery, retention: Retention | None, progress: Progress
    ) -> dict[str, float]:
        """How far the widest hinge opens with each side up, degrees."""
        opens = {}
        for number, side in enumerate(SIDES):
            progress.update(number / len(SIDES), f"letting the box go, {side} up")
            opens[side] = round(self._opens(motion.angles_deg[-1], side, joinery, retention), 1)
        return opens

    def _opens(
        self, angles_deg: F64, up: str, joinery: Joinery, retention: Retention | None
    ) -> float:
        """How far the widest hinge opens when only its retention holds the box, degrees."""
        import mujoco

        tree = self._tree
        model = rig_model(
            tree, self._boxes, time_step=0.002, density=self._density, damping=0.02,
            limits_deg=(angles_deg - _FALL_DEG, angles_deg + _FALL_DEG),
            gravity=self._gravity(up), friction=self._friction,
        )  # fmt: skip
        data = mujoco.MjData(model)
        joint, dof = hinge_joints(model, tree)
        data.qpos[joint] = np.radians(angles_deg)
        if retention is not None and retention.friction is not None:
            rubs, nmm = retention.friction, 1000.0 / self._side**2  # in kg · side² / s²
            rubbing = dof[list(rubs.hinges)]
            model.dof_frictionloss[rubbing] = rubs.torque_nmm * nmm
            # Dry friction creeps in MuJoCo unless it is made stiff.
            model.dof_solref[rubbing, 0], model.dof_solimp[rubbing, :2] = 0.004, 0.9999
        mujoco.mj_forward(model, data)
        pulls = self._pulls(model, joinery, retention) if retention and retention.magnet else []
        for _ in range(round(_LET_GO_S / 0.002)):
            data.qfrc_applied[:] = 0.0
            for pull in pulls:
                pull.apply(model, data)
            mujoco.mj_step(model, data)
        require_finite(data, f"the box let go with {up} up")
        return float(np.degrees(np.abs(data.qpos[joint] - np.radians(angles_deg))).max(initial=0))

    def _pulls(self, model: mujoco.MjModel, joinery: Joinery, retention: Retention) -> list[_Pull]:
        magnet = MAGNETS[retention.magnet]
        origin = np.asarray(joinery.origin_mm)
        found = []
        deep = retention.skin_mm + magnet.thick_mm / 2
        for pair in retention.pairs:
            if pair.shape != "B":
                continue
            bodies = [model.body(self._tree.bodies[body].name).id for body in pair.bodies]
            # Seen from the middles of the magnets, which never meet, the pull has a direction.
            places = [
                (np.array(point) + deep * np.array(inward) - origin) / self._side
                for point, inward in zip(pair.points_mm, pair.inwards, strict=True)
            ]
            force = magnet.pull_n * 1000.0 / self._side
            reach = _PULL_REACH * magnet.diameter_mm / self._side
            found.append(_Pull(bodies, places, force, reach, magnet.thick_mm / self._side))
        return found


@dataclass(frozen=True)
class _Pull:
    """Two magnets that draw each other: middles in lattice units of shape A, force kg side / s²."""

    bodies: list[int]
    places: list[F64]
    force: float
    reach: float
    thick: float

    def apply(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        import mujoco

        one, other = (
            data.xmat[body].reshape(3, 3) @ place + data.xpos[body]
            for body, place in zip(self.bodies, self.places, strict=True)
        )
        apart = float(np.linalg.norm(other - one))
        size = self.force * np.exp(-max(apart - self.thick, 0.0) / self.reach)
        force = (other - one) / apart * size
        for body, point, sign in zip(self.bodies, (one, other), (1.0, -1.0), strict=True):
            mujoco.mj_applyFT(
                model, data, sign * force, np.zeros(3), point, body, data.qfrc_applied
            )
