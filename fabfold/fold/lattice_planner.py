"""Plan folding paths on the lattice: the door to the search kernels for a hinge system.

Every hinge axis is an edge of the lattice, so every state in which all hinges stand at multiples
of 90° has its cubes on the lattice. A move turns one hinge by 90°, and whether it collides is
read from a table of the cells that a turning cube sweeps (:mod:`fabfold.lattice.sweep`).

A state is valid when no two cells coincide and no two hinge barrels lie on one lattice edge. A turn
is free when no cell and no barrel that it carries runs into one that stays.

Where voxels share cells of B, eighths of cells count in place of cells (:func:`refined`), and
nothing is carved.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fabfold.fold.bidirectional_search import bidirectional_search
from fabfold.fold.closure_test import stuck_at_both_ends
from fabfold.fold.core_sweep import core_sweep_table
from fabfold.fold.mechanism import Mechanism, mechanism
from fabfold.fold.scene import Scene, empty_scene
from fabfold.fold.shortcut import follow, shorten
from fabfold.lattice.sweep import SweepTable, sweep_table, with_plates
from fabfold.tree.system import HingeSystem

__all__ = [
    "CLASH_PRICE",
    "NO_GUIDE",
    "REPULSION",
    "PlannerResult",
    "count_free_moves",
    "find_path",
    "kernel_inputs",
    "moves_of_steps",
    "refined",
    "stuck_hinges",
]

#: Weight of the repulsion between bodies against one step, see
#: :func:`fabfold.fold.bidirectional_search.bidirectional_search`.
REPULSION = 0.02
#: What a pair of cells that clash costs in the key of a state, in steps.
CLASH_PRICE = 0.3


class PlannerResult(NamedTuple):
    """What the planner found.

    Attributes
    ----------
    remaining : int
        Quarter turns by which the two ends of the search still differ; 0 when they met.
    total : int
        Quarter turns from A to B.
    expansions : int
        States expanded.
    path : (m, 2) int32 array or None
        Hinge index and signed quarter turns about its positive axis, one row a move; None where
        the two ends did not meet.
    apart : (h,) int32 array
        Quarter turns of each hinge by which the two ends still differ; they add up to `remaining`.
    guide : (g, 5) int32 array
        The steps found, complete or not, for the planning of a similar system: twice the middle
        of the hinge's edge in A, its axis, and 1 or -1 for a step forth or back.
    """

    remaining: int
    total: int
    expansions: int
    path: NDArray[np.int32] | None
    apart: NDArray[np.int32]
    guide: NDArray[np.int32]


#: No steps to be guided by.
NO_GUIDE: NDArray[np.int32] = np.zeros((0, 5), dtype=np.int32)


def _steps_of_guide(
    system: HingeSystem, mech: Mechanism, guide: NDArray[np.int32]
) -> NDArray[np.int16]:
    """Steps of a guide whose hinges the system has, in the mechanism's numbers, (m, 2)."""
    place = np.argsort(mech.origin)
    known = {
        (*point, axis): int(place[hinge])
        for hinge, (point, axis) in enumerate(
            zip(system.point2.tolist(), system.axis.tolist(), strict=True)
        )
    }
    steps = [
        (known[x, y, z, axis], way)
        for x, y, z, axis, way in guide.tolist()
        if (x, y, z, axis) in known
    ]
    return np.array(steps, dtype=np.int16).reshape(-1, 2)


def _guide_of_steps(
    system: HingeSystem, mech: Mechanism, steps: NDArray[np.int16]
) -> NDArray[np.int32]:
    """Steps of the mechanism as a guide for other systems, (g, 5)."""
    hinges = mech.origin[steps[:, 0]]
    return np.concatenate(
        [
            np.asarray(system.point2, dtype=np.int32).reshape(-1, 3)[hinges],
            np.asarray(system.axis, dtype=np.int32)[hinges, None],
            steps[:, 1:].astype(np.int32),
        ],
        axis=1,
    )


def _sweeps(mech: Mechanism, carve: float | None) -> SweepTable:
    """What turns sweep, up to a mechanism's span: cells or their cores, barrels and link plates."""
    halves = len(mech.barrel) != len(mech.up)
    if carve is None:
        table = sweep_table(mech.span, halves=halves)
    elif halves:
        raise ValueError("carve: wants a system of whole cells")
    else:
        table = core_sweep_table(mech.span, carve)
    return with_plates(table, halves=halves) if len(mech.plate) else table


def kernel_inputs(
    system: HingeSystem, carve: float | None = None
) -> tuple[Mechanism, Scene, SweepTable]:
    """What every kernel of the search takes.

    Parameters
    ----------
    system : HingeSystem
        What is to fold.
    carve : float, optional
        Let only the cores of cells count, cubes of this half side in lattice units; see
        :mod:`fabfold.fold.core_sweep`. Without effect where the system has octants.

    Returns
    -------
    mech : Mechanism
        The system hung on its middle body, on the lattice of half cells where it has octants.
    scene : Scene
        Its scene, empty.
    table : SweepTable
        What turns sweep, up to the mechanism's span.

    Raises
    ------
    ValueError
        If the system's hinges are not on lattice edges, or cells that are to be carved are halves.
    """
    mech, table = _mechanism_and_sweeps(system, carve)
    return mech, empty_scene(mech), table


def _mechanism_and_sweeps(system: HingeSystem, carve: float | None) -> tuple[Mechanism, SweepTable]:
    """The first and the last of what :func:`kernel_inputs` makes."""
    if system.octants is not None:
        # Hinges keep their numbers, so that what comes out is of the system as it was.
        system, carve = refined(system, system.octants), None
    mech = mechanism(system)
    return mech, _sweeps(mech, carve)


def stuck_hinges(system: HingeSystem, *, carve: float | None = None) -> NDArray[np.bool_]:
    """Closure test: which hinges nothing can ever set free.

    Necessary, not sufficient: a system without stuck hinges need not fold.

    Parameters
    ----------
    system : HingeSystem
        What is to fold.
    carve : float, optional
        Let only the cores of cells count, cubes of this half side in lattice units; see
        :mod:`fabfold.fold.core_sweep`.

    Returns
    -------
    (2, h) bool array
        Hinges that are stuck in shape A, and in shape B.

    See Also
    --------
    fabfold.fold.closure_test.movable_hinges : the test at one end.
    """
    mech, table = _mechanism_and_sweeps(system, carve)
    stuck: NDArray[np.bool_] = stuck_at_both_ends(mech, table)
    return stuck


def moves_of_steps(
    system: HingeSystem, mech: Mechanism, steps: NDArray[np.int16]
) -> NDArray[np.int32]:
    """Steps of the mechanism as moves of the system, neighbours of one hinge in one move."""
    moves: list[list[int]] = []
    for k, way in steps.tolist():
        hinge = int(mech.origin[k])
        quarter = way if system.turns[hinge] > 0 else -way
        if moves and moves[-1][0] == hinge:
            moves[-1][1] += quarter
            if moves[-1][1] == 0:
                moves.pop()
        else:
            moves.append([hinge, quarter])
    return np.array(moves, dtype=np.int32).reshape(-1, 2)


def find_path(
    system: HingeSystem,
    expansions: int = 2500,
    patience: int = 400,
    *,
    repulsion: float = REPULSION,
    short: bool = True,
    carve: float | None = None,
    price: float = CLASH_PRICE,
    guide: NDArray[np.int32] | None = None,
) -> PlannerResult:
    """Search a folding path, one hinge at a time.

    Parameters
    ----------
    system : HingeSystem
        What is to fold.
    expansions : int
        States that may be expanded in all.
    patience : int
        Expansions without progress after which a side of the search gives way to the other.
    repulsion : float
        Weight of the preference for open states, in steps.
    short : bool
        Shorten the path afterwards.
    carve : float, optional
        Let only the cores of cells count, cubes of this half side in lattice units: the path is
        free once what :func:`fabfold.fold.carving_plan.plan_carving` says is taken out.
    price : float
        With `carve`: what a turn costs, in steps, for each pair of whole cells that it drives
        into each other.
    guide : (g, 5) int32 array, optional
        :attr:`PlannerResult.guide` of a similar system: its steps are tried first.

    Returns
    -------
    PlannerResult
        The path, or how near the search came.
    """
    if system.octants is not None:
        carve = None
    mech, scene, table = kernel_inputs(system, carve)
    whole = table if carve is None else _sweeps(mech, None)
    total = int(mech.steps.sum())
    hint = _steps_of_guide(system, mech, NO_GUIDE if guide is None else guide)
    cost = 0.0 if carve is None else price
    remaining, used, steps, differ = bidirectional_search(
        mech, scene, table, expansions, patience, repulsion, whole, cost, hint
    )
    apart = np.zeros(len(system.parent), dtype=np.int32)
    apart[mech.origin] = differ
    found = _guide_of_steps(system, mech, steps)
    if remaining > 0:
        return PlannerResult(int(remaining), total, int(used), None, apart, found)
    if short:
        steps = shorten(mech, scene, table, whole, carve is not None, steps)
    return PlannerResult(0, total, int(used), moves_of_steps(system, mech, steps), apart, found)


def count_free_moves(
    system: HingeSystem, path: NDArray[np.integer], *, carve: float | None = None
) -> int:
    """How many moves of a path from A are free of collision, by the table.

    Parameters
    ----------
    system : HingeSystem
        What folds.
    path : (m, 2) integer array
        Hinge and signed quarter turns about its positive axis, one row a move.
    carve : float, optional
        As for :func:`find_path`.

    Returns
    -------
    int
        ``len(path)`` when the whole path is free.
    """
    mech, scene, table = kernel_inputs(system, carve)
    place = np.argsort(mech.origin)
    q = np.zeros(len(mech.up), dtype=np.int8)
    for count, (hinge, turns) in enumerate(np.asarray(path, dtype=int).reshape(-1, 2).tolist()):
        way = 1 if turns * int(system.turns[hinge]) > 0 else -1
        part = np.tile(np.array([[place[hinge], way]], dtype=np.int16), (abs(turns), 1))
        if follow(mech, scene, table, q, part) < len(part):
            return count
    return len(path)


def refined(system: HingeSystem, octants: NDArray[np.bool_]) -> HingeSystem:
    """The same system on the lattice of half cells, with only the octants that hold material.

    Parameters
    ----------
    system : HingeSystem
        On the lattice of whole cells.
    octants : (n, 2, 2, 2) bool array
        Which eighths of each cell, in shape A, are to count.

    Returns
    -------
    HingeSystem
        Cell ``x`` becomes the half cells ``2 x`` and ``2 x + 1``; lengths double.

    Raises
    ------
    ValueError
        If `octants` has not one entry a voxel.
    """
    if np.shape(octants) != (len(system.cells), 2, 2, 2):
        raise ValueError(
            f"octants: wants shape ({len(system.cells)}, 2, 2, 2), found {np.shape(octants)}"
        )
    kept = np.argwhere(np.asarray(octants, dtype=bool))
    return HingeSystem(
        cells=(2 * np.asarray(system.cells)[kept[:, 0]] + kept[:, 1:]).astype(np.int32),
        body=np.asarray(system.body)[kept[:, 0]].astype(np.int32),
        parent=system.parent,
        point2=(2 * np.asarray(system.point2) + 1).astype(np.int32),
        axis=system.axis,
        turns=system.turns,
    )
