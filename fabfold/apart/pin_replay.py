"""An order of assembly played through: real bodies, real pins, everything that is already there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fabfold.apart.pin_order import AssemblyStep
from fabfold.joinery.bodies import Joinery
from fabfold.joinery.body_poses import poses_in_mm
from fabfold.joinery.booleans import evaluated
from fabfold.joinery.cells import solids_of
from fabfold.joinery.loose_pins import PinBore, meshes_with_pins, pin_way
from fabfold.joinery.pin_kinds import PinFit
from fabfold.tree.fold_tree import FoldTree

if TYPE_CHECKING:
    import manifold3d

__all__ = ["PinReplay", "replay_assembly"]

Floats = NDArray[np.float64]

#: Two looks at a side on its way in are this far apart, mm: less than the thinnest wall.
STEP_MM = 0.5
#: Volume that pin and bodies may share before it is more than rounding, mm³.
_TOUCH_MM3 = 0.02


@dataclass(frozen=True)
class PinReplay:
    """What was seen while a kit was put together.

    Attributes
    ----------
    done : int
        Number of pins that could be pushed in.
    pins : int
        Number of all pins.
    looks : int
        Number of positions that were looked at.
    faults : tuple of str
        What was in the way, one line for each pin that could not be pushed in.
    """

    done: int
    pins: int
    looks: int
    faults: tuple[str, ...]


def replay_assembly(
    tree: FoldTree,
    joinery: Joinery,
    bores: Sequence[PinBore],
    steps: Sequence[AssemblyStep],
    fit: PinFit,
) -> PinReplay:
    """Put a kit together in an order, with FCL looking for collisions.

    Every step brings two parts together in their pose along their straight line, with the pins that
    they already have, and pushes its pin in from beyond the pusher's length. Nothing of the search
    for the order is used but its result.

    Parameters
    ----------
    tree : FoldTree
        The bodies and their hinges.
    joinery : Joinery
        The bodies as they are printed, with their pins.
    bores : sequence of PinBore
        Where the pins go.
    steps : sequence of AssemblyStep
        The order.
    fit : PinFit
        How the pins sit in their bores.

    Returns
    -------
    PinReplay
        What was seen.
    """
    import fcl

    solids = solids_of(joinery.bodies)
    placed: list[int] = []
    faults, looks = [], 0
    for step in steps:
        bore, pin = bores[step.pin], joinery.pins[step.pin]
        name = tree.hinges[bore.hinge].name
        poses = poses_in_mm(tree, joinery, np.array(step.angles_deg))
        there = replace(joinery, pins=tuple(joinery.pins[i] for i in placed))
        meshes = meshes_with_pins(there)
        rests, comes = (
            [_object(fcl, meshes[body], poses[body]) for body in side] for side in step.sides
        )
        far = _way_out(_around(rests), _around(comes), np.array(step.away))
        hit = None
        for count in range(int(np.ceil(far / STEP_MM)), -1, -1):
            looks += 1
            shift = STEP_MM * count * np.array(step.away)
            hit = _collision(fcl, rests, comes, shift)
            if hit is not None:
                one = joinery.bodies[step.sides[0][hit[0]]].name
                other = joinery.bodies[step.sides[1][hit[1]]].name
                faults.append(
                    f"{name}: {other} meets {one} {STEP_MM * count:.1f} mm before its place"
                )
                break
        way = pin_way(bore, step.end, pin, fit).transform(poses[bore.bodies[0]][:3])
        blocking = _in_the_way(joinery, solids, step, way, poses)
        if hit is None and blocking:
            faults.append(f"{name}: {blocking} is in the way of the pin")
        placed.append(step.pin)
    missing = len(joinery.pins) - len({step.pin for step in steps})
    if missing:
        faults.append(f"{missing} pins are in no step")
    return PinReplay(len(joinery.pins) - len(faults), len(joinery.pins), looks, tuple(faults))


def _object(fcl: Any, mesh: tuple[Floats, NDArray[np.int32]], pose: Floats) -> tuple[Any, Floats]:
    vertices, faces = mesh
    model = fcl.BVHModel()
    model.beginModel(len(vertices), len(faces))
    points = vertices @ pose[:3, :3].T + pose[:3, 3]
    model.addSubModel(points, faces)
    model.endModel()
    return fcl.CollisionObject(model), np.array([points.min(axis=0), points.max(axis=0)])


def _around(side: Sequence[tuple[Any, Floats]]) -> Floats:
    """Lowest and highest corner of all bodies of a side, mm."""
    boxes = np.array([box for _, box in side])
    return np.array([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])


def _way_out(rests: Floats, comes: Floats, away: Floats) -> float:
    """How far a box has to go in a direction until it is beside another, mm."""
    ways = []
    for axis in range(3):
        if away[axis] > 1e-6:
            ways.append((rests[1, axis] - comes[0, axis]) / away[axis])
        elif away[axis] < -1e-6:
            ways.append((rests[0, axis] - comes[1, axis]) / away[axis])
    return max(0.0, float(min(ways)))


def _collision(
    fcl: Any, rests: list[tuple[Any, Floats]], comes: list[tuple[Any, Floats]], shift: Floats
) -> tuple[int, int] | None:
    for j, (moving, box) in enumerate(comes):
        moving.setTranslation(shift)
        for i, (resting, other) in enumerate(rests):
            if (box[0] + shift > other[1]).any() or (box[1] + shift < other[0]).any():
                continue
            if fcl.collide(resting, moving, fcl.CollisionRequest(), fcl.CollisionResult()):
                return i, j
    return None


def _in_the_way(
    joinery: Joinery,
    solids: list[manifold3d.Manifold],
    step: AssemblyStep,
    way: manifold3d.Manifold,
    poses: Floats,
) -> str:
    """First body that the pin or its pusher meets on the way in; empty where there is none."""
    rod = evaluated(way)
    box = np.reshape(rod.bounding_box(), (2, 3))
    for body in sorted([*step.sides[0], *step.sides[1]]):
        solid = solids[body].transform(poses[body][:3])
        low, high = np.reshape(solid.bounding_box(), (2, 3))
        if (low > box[1]).any() or (high < box[0]).any():
            continue
        if (rod ^ solid).volume() > _TOUCH_MM3:
            return joinery.bodies[body].name
    return ""
