"""Bodies on hinges as a MuJoCo model: boxes that push each other, all frames at shape A's origin.

The rehearsal of a path (:mod:`fabfold.proof.replay`) and the unfolding by forces
(:mod:`fabfold.physics.unfolding`) simulate the same rig, one with motors, one with limits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.tree.fold_tree import FoldTree

if TYPE_CHECKING:
    import mujoco

__all__ = ["Box", "Motor", "hinge_joints", "rig_model"]

F64 = NDArray[np.float64]

#: Of a body without a box, so that every body weighs something: a ball that touches nothing.
_BALL = 0.2


@dataclass(frozen=True)
class Box:
    """A box of material that a body carries.

    Attributes
    ----------
    body : int
        Index of the body in ``FoldTree.bodies``.
    low, high : (3,) float64 array
        Corners in lattice units of shape A.
    """

    body: int
    low: F64
    high: F64


@dataclass(frozen=True)
class Motor:
    """A position motor on every hinge.

    Attributes
    ----------
    gain, brake : float
        Torque for an angle of 1 rad, and for a speed of 1 rad/s.
    """

    gain: float
    brake: float


def rig_model(
    tree: FoldTree,
    boxes: Sequence[Box],
    *,
    time_step: float,
    density: float,
    damping: float,
    motor: Motor | None = None,
    limits_deg: tuple[F64, F64] | None = None,
    gravity: Sequence[float] = (0.0, 0.0, 0.0),
    friction: float = 0.0,
) -> mujoco.MjModel:
    """Model of a tree's bodies; the root is held.

    Parameters
    ----------
    tree : FoldTree
        Bodies and hinges; a hinge's joint has its name.
    boxes : sequence of Box
        What collides; the geom of box ``i`` is called ``box-i``.
    time_step : float
        Seconds.
    density : float
        Mass of a unit cube.
    damping : float
        Of every hinge, torque for 1 rad/s.
    motor : Motor, optional
        Motors of the hinges' names.
    limits_deg : two (h,) float64 arrays, optional
        Least and largest angle of every hinge, degrees.
    gravity : (3,) sequence of float
        Voxel sides / s².
    friction : float
        Coefficient between bodies that touch; 0 lets them slide.

    Returns
    -------
    mujoco.MjModel
        Bodies joined by a hinge touch each other too.
    """
    import mujoco

    spec = mujoco.MjSpec()
    spec.option.gravity = list(gravity)
    spec.option.timestep = time_step
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    # A rigid group must not pass through the body that it hangs on.
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_FILTERPARENT)
    bodies = [spec.worldbody.add_body(name=tree.bodies[0].name)]
    for number, hinge in enumerate(tree.hinges):
        body = bodies[hinge.parent].add_body(name=tree.bodies[hinge.child].name)
        joint = body.add_joint(
            name=hinge.name,
            type=mujoco.mjtJoint.mjJNT_HINGE,
            pos=list(hinge.point),
            axis=[float(x) for x in hinge.direction],
            armature=0.02,
            damping=[damping, 0.0, 0.0],
        )
        if limits_deg is not None:
            joint.limited = True
            joint.range = [float(limits_deg[0][number]), float(limits_deg[1][number])]
        if motor is not None:
            actuator = spec.add_actuator(name=hinge.name, target=hinge.name)
            actuator.trntype = mujoco.mjtTrn.mjTRN_JOINT
            actuator.set_to_position(kp=motor.gain, kv=motor.brake)
        bodies.append(body)
    for number, box in enumerate(boxes):
        bodies[box.body].add_geom(
            name=f"box-{number}",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=(0.5 * (box.low + box.high)).tolist(),
            size=(0.5 * (box.high - box.low)).tolist(),
            density=density,
            condim=3 if friction else 1,
            friction=[friction, 0.0, 0.0],
            solref=[0.02, 1.0],
        )
    for index in sorted(set(range(len(bodies))) - {box.body for box in boxes}):
        centre = tree.hinges[index - 1].point if index else (0.0, 0.0, 0.0)
        bodies[index].add_geom(
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            pos=list(centre),
            size=[_BALL, 0.0, 0.0],
            density=density,
            contype=0,
            conaffinity=0,
        )
    return spec.compile()


def hinge_joints(
    model: mujoco.MjModel, tree: FoldTree
) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
    """Where the hinges of a rig are in ``qpos`` and in ``qvel``, (h,) each.

    The compiler numbers bodies depth first, so places are asked for by name.
    """
    joints = [model.joint(hinge.name) for hinge in tree.hinges]
    position = np.array([int(joint.qposadr[0]) for joint in joints], dtype=int)
    return position, np.array([int(joint.dofadr[0]) for joint in joints], dtype=int)
