"""The folding path rehearsed in a physics simulator (MuJoCo), as a maker's hands would fold.

Motors turn the hinges along the path, contacts push back, and the report says how far bodies were
pressed into each other and how far the hinges lagged behind. The motors know what the bodies weigh:
hands are slow, and what lags shall do so since something is in its way, not since a long arm is
heavy. This is a rehearsal, not a proof, and not independent of it: each body is a set of boxes, the
boxes of neighbouring cells are as far apart as the certificate says, and which cells are only seen
by their cores comes from the planner. The proof is :mod:`fabfold.proof.certify`, the independent
opinion :mod:`fabfold.proof.sampled`.

References
----------
Siciliano, Sciavicco, Villani, Oriolo: Robotics (2009), section 8.5.2, for the torque that a course
asks for.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import CheckError
from fabfold.fold.clashes import clashes_on
from fabfold.fold.core_sweep import CORE_HALF_SIDE
from fabfold.fold.motion import Motion, end_pose_error, quarter_path
from fabfold.physics.rig import Box, Motor, hinge_joints, rig_model
from fabfold.progress import Progress, SilentProgress
from fabfold.tree.fold_tree import FoldTree
from fabfold.tree.sharing import WHOLE, unpacked
from fabfold.tree.system import hinge_system

if TYPE_CHECKING:
    import mujoco

__all__ = ["ReplayReport", "course", "material_boxes", "replay", "require_finite"]

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]

_TIME_STEP = 0.005
#: Most seconds that motors hold still after a move, and how near their angles (degrees) all hinges
#: are then before it is over: a link plate that was pushed aside comes back slowly.
_HOLD_S, _AT_REST_DEG = 1.0, 0.5
_GAIN = 2000.0
_BRAKE = 60.0
_DAMPING = 1.0


@dataclass(frozen=True)
class ReplayReport:
    """What the simulator saw.

    Attributes
    ----------
    max_penetration_mm : float
        Deepest that two boxes were pressed into each other, mm.
    max_angle_error_deg : float
        Furthest that any hinge was from where it should be at the end of any move, degrees; up to a
        second after it, where something was pushed aside.
    max_lag_deg : float
        The same at any instant, degrees.
    end_pose_error_mm : float
        Furthest that any voxel's corner was from its place in the template at the end, mm.
    contact_steps : int
        Time steps in which anything touched.
    steps : int
        All time steps.
    geometry : str
        What was simulated, in words.
    """

    max_penetration_mm: float
    max_angle_error_deg: float
    max_lag_deg: float
    end_pose_error_mm: float
    contact_steps: int
    steps: int
    geometry: str


def material_boxes(
    tree: FoldTree,
    meshes: Sequence[tuple[F64, I32]],
    voxel_mm: float,
    origin_mm: Sequence[float],
    gap_mm: float,
    carved: Collection[int] = (),
) -> list[Box]:
    """Boxes about the material that each body has in each of its cells.

    Of a voxel that shares its cell in B there is a box about the material in each eighth.

    Parameters
    ----------
    tree, meshes, voxel_mm, origin_mm
        As for :func:`fabfold.proof.certify.certify`.
    gap_mm : float
        Boxes of neighbouring cells end this far apart, mm.
    carved : collection of int
        Voxels that were carved so that they pass each other: a box cannot follow a round, so the
        box is about what lies in the core of the cell.

    Returns
    -------
    list of Box
        Cells without material are left out. A link plate is a
        sheet of a third of the gap in the middle of its face: its pockets do not show in boxes.
    """
    import manifold3d

    half = 0.5 - 0.5 * gap_mm / voxel_mm
    found = []
    for index, (body, (vertices, faces)) in enumerate(zip(tree.bodies, meshes, strict=True)):
        if body.edge is not None:
            found.append(Box(index, *_sheet(tree, index, vertices, voxel_mm, origin_mm, gap_mm)))
            continue
        lattice = (np.asarray(vertices, dtype=float) - np.asarray(origin_mm, float)) / voxel_mm
        solid = manifold3d.Manifold(
            manifold3d.Mesh64(
                np.ascontiguousarray(lattice),
                np.ascontiguousarray(faces, dtype=np.uint64),
            )
        )
        for voxel in body.voxels:
            reach = CORE_HALF_SIDE if voxel in carved else half
            for middle, most in _parts(tree, voxel, reach):
                piece = solid
                for axis in range(3):
                    for sign in (1.0, -1.0):
                        normal = [0.0, 0.0, 0.0]
                        normal[axis] = sign
                        piece = piece.trim_by_plane(normal, float(sign * middle[axis]) - most)
                if piece.is_empty():
                    continue
                box = np.array(piece.bounding_box())
                if (box[3:] - box[:3]).min() > 1e-6:
                    found.append(Box(index, box[:3], box[3:]))
    return found


def _parts(tree: FoldTree, voxel: int, reach: float) -> list[tuple[F64, float]]:
    """Middle and half side of the cubes that hold a voxel's material: its cell, or eighths."""
    cell = tree.source[voxel].astype(float)
    if tree.octants is None or tree.octants[voxel] == WHOLE:
        return [(cell, reach)]
    sides = np.argwhere(unpacked(tree.octants[voxel : voxel + 1])[0])
    return [(cell + side / 2 - 0.25, reach - 0.25) for side in sides]


def _sheet(
    tree: FoldTree,
    link: int,
    vertices: F64,
    voxel_mm: float,
    origin_mm: Sequence[float],
    gap_mm: float,
) -> tuple[F64, F64]:
    """Corners of the sheet that stands for a link plate, lattice units of shape A."""
    number = tree.bodies[link].edge
    edge = tree.edges[-1 if number is None else number]
    parent, child = tree.source[edge.parent].astype(float), tree.source[edge.child].astype(float)
    lattice = (np.asarray(vertices, dtype=float) - np.asarray(origin_mm, float)) / voxel_mm
    flat = child == parent
    # Knuckles stand out of the face beyond the axes.
    room = 0.5 - 0.5 * gap_mm / voxel_mm
    middle, thick = (parent + child) / 2, gap_mm / voxel_mm / 6
    low = np.where(flat, np.maximum(lattice.min(axis=0), middle - room), middle - thick)
    high = np.where(flat, np.minimum(lattice.max(axis=0), middle + room), middle + thick)
    return low, high


def _carved_voxels(tree: FoldTree, motion: Motion) -> set[int]:
    """Voxels that clash as whole cells, on a path from state to state of the lattice."""
    path = quarter_path(tree, motion)
    if path is None or tree.octants is not None:
        return set()
    return {
        voxel
        for clash in clashes_on(hinge_system(tree), path)
        for voxel in (clash.first, clash.second)
    }


def course(
    motion: Motion, seconds_per_quarter: float, time_step: float
) -> Iterator[tuple[int, F64, F64 | None]]:
    """Angles that motors follow, speeding up and slowing down smoothly in every move.

    Parameters
    ----------
    motion : Motion
        The path.
    seconds_per_quarter : float
        For 90°, seconds.
    time_step : float
        Seconds.

    Yields
    ------
    number : int
        Of the move, from 1.
    goal : (h,) float64 array
        Angles, radians.
    rate : (h,) float64 array or None
        Their speed, rad/s; None once after each move, with the angles that it ends at.
    """
    for number in range(1, len(motion.moves)):
        start, end = np.radians(motion.angles_deg[number - 1 : number + 1])
        quarters = float(np.abs(end - start).max() / (np.pi / 2))
        count = max(1, round(seconds_per_quarter * quarters / time_step))
        for step in range(1, count + 1):
            share = step / count
            rate = 30.0 * (share * (1.0 - share)) ** 2 / (count * time_step)
            share = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
            yield number, start + (end - start) * share, (end - start) * rate
        yield number, end, None


def require_finite(data: mujoco.MjData, where: str) -> None:
    """Raise :class:`CheckError` where a simulation diverged, saying where that was."""
    if not np.isfinite(data.qpos).all():
        raise CheckError(
            f"replay: the simulation diverged in {where}; the bodies press against each other"
        )


def replay(
    tree: FoldTree,
    motion: Motion,
    meshes: Sequence[tuple[F64, I32]],
    voxel_mm: float,
    origin_mm: Sequence[float],
    progress: Progress | None = None,
    *,
    gap_mm: float | None = None,
    seconds_per_quarter: float = 3.0,
) -> ReplayReport:
    """Fold the bodies in MuJoCo along the path.

    Each body is a set of boxes, one about its material in each cell (hinge barrels that stand out
    of the cell are not simulated); a link plate is a sheet between them. The root body is held; a
    position motor on every hinge follows the path, speeding up and slowing down smoothly in every
    move; it is given the torque that the bodies' inertia asks for.

    Parameters
    ----------
    tree, motion, meshes, voxel_mm, origin_mm
        As for :func:`fabfold.proof.certify.certify`.
    progress : Progress, optional
        Hears of every move.
    gap_mm : float, optional
        Gap between the boxes of neighbouring cells, mm; the certified gap of `motion` if it has
        one, else 1.5 % of a voxel.
    seconds_per_quarter : float
        Simulated time for 90°, seconds.

    Returns
    -------
    ReplayReport
        What was seen; the same for the same arguments.

    Raises
    ------
    CheckError
        If the simulation diverges.
    """
    import mujoco

    progress = progress or SilentProgress()
    if gap_mm is None:
        gap_mm = float(motion.certificate.get("min_gap_mm", 0.015 * voxel_mm))
    carved = _carved_voxels(tree, motion)
    boxes = material_boxes(tree, meshes, voxel_mm, origin_mm, gap_mm, carved)
    model = rig_model(
        tree, boxes, time_step=_TIME_STEP, density=0.02, damping=_DAMPING,
        motor=Motor(_GAIN, _BRAKE),
    )  # fmt: skip
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    joint, dof = hinge_joints(model, tree)
    motor = np.array([model.actuator(h.name).id for h in tree.hinges], dtype=int)

    worst = lag = 0.0
    deepest = 0.0
    touching = steps = 0
    moves = len(motion.moves) - 1

    still = before = np.zeros(len(dof))
    acceleration, torque = np.zeros(model.nv), np.zeros(model.nv)

    def step(wanted: F64, rate: F64) -> None:
        nonlocal steps, touching, deepest, before
        acceleration[dof] = (rate - before) / _TIME_STEP
        before = rate
        mujoco.mj_mulM(model, data, torque, acceleration)
        data.qfrc_applied[:] = torque + data.qfrc_bias
        # The motor brakes by its own damping; ask for a little more, to be there on time.
        data.ctrl[motor] = wanted + rate * (_BRAKE + _DAMPING) / _GAIN
        mujoco.mj_step(model, data)
        steps += 1
        if data.ncon:
            touching += 1
            deepest = max(deepest, -float(data.contact.dist.min()))

    def error(goal: F64) -> float:
        return float(np.abs(data.qpos[joint] - goal).max(initial=0.0))

    for number, goal, rate in course(motion, seconds_per_quarter, _TIME_STEP):
        if rate is None:
            until = steps + round(_HOLD_S / _TIME_STEP)
            while error(goal) > np.radians(_AT_REST_DEG) and steps < until:
                step(goal, still)
            worst = max(worst, error(goal))
            require_finite(data, f"move {number} of {moves}")
            progress.update(number / moves, f"replayed move {number} of {moves}")
            continue
        step(goal, rate)
        lag = max(lag, error(goal))
    angles = np.degrees(data.qpos[joint])
    progress.update(1.0, f"deepest contact {deepest * voxel_mm:.3f} mm")
    links = sum(body.edge is not None for body in tree.bodies)
    cores = f", {len(carved)} carved cells by their cores" if carved else ""
    sheets = f", {links} link plates as sheets between them" if links else ""
    return ReplayReport(
        max_penetration_mm=round(deepest * voxel_mm, 4),
        max_angle_error_deg=round(float(np.degrees(worst)), 4),
        max_lag_deg=round(float(np.degrees(lag)), 4),
        end_pose_error_mm=round(end_pose_error(tree, angles) * voxel_mm, 4),
        contact_steps=touching,
        steps=steps,
        geometry=(
            f"{len(boxes) - links} boxes about the material of {len(tree.bodies) - links} bodies "
            f"in each cell, {gap_mm:g} mm apart{cores}{sheets}, hinge barrels left out; root "
            "held, no gravity, "
            f"{seconds_per_quarter:g} s for 90°"
        ),
    )
