"""A tree on its way to being built: what the fold and join stages return, and the way between."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from fabfold.errors import CheckError, GeometryError, NoFoldError
from fabfold.fold.motion import Motion
from fabfold.joinery.bodies import Joinery
from fabfold.progress import Progress
from fabfold.tree.fold_tree import FoldTree
from fabfold.voxels.voxel_model import Voxels

if TYPE_CHECKING:
    from fabfold.apart.apart_kit import ApartKit
    from fabfold.joinery.box_hold import Retention
    from fabfold.printing.print_mode import PrintMode

__all__ = ["BuiltTree", "PlannedTree", "build", "build_first"]


@dataclass(frozen=True)
class PlannedTree:
    """A tree with its path on the lattice: what the fold stage returns."""

    voxels: Voxels
    tree: FoldTree
    motion: Motion


@dataclass(frozen=True)
class BuiltTree:
    """A tree that was built and certified: what the join stage returns.

    Attributes
    ----------
    planned : PlannedTree
        Voxels, tree, and the motion with its certificate on the real bodies.
    joinery : Joinery
        The printed bodies.
    refused : tuple of str
        Why each better-ranked tree was passed over.
    apart : ApartKit or None
        Order of assembly and plates of a kit that is printed body by body.
    retention : Retention or None
        What holds the kit shut, where that was asked for.
    """

    planned: PlannedTree
    joinery: Joinery
    refused: tuple[str, ...]
    apart: ApartKit | None = None
    retention: Retention | None = None


def build(
    planned: PlannedTree,
    mode: PrintMode,
    voxel_mm: float,
    refused: tuple[str, ...],
    progress: Progress,
    *,
    orders: bool = True,
) -> BuiltTree:
    """Make the bodies of a tree, and certify its path on them.

    Parameters
    ----------
    planned : PlannedTree
        The tree, its voxels and its path on the lattice.
    mode : PrintMode
        How it is printed; clearance of the hinges, and the gap to certify.
    voxel_mm : float
        Printed side of a voxel.
    refused : tuple of str
        Why each better-ranked tree was passed over.
    progress : Progress
        Hears which body is cut and which move is proven.
    orders : bool
        Whether it is also proven which moves may come in any order, for the manual.

    Raises
    ------
    GeometryError
        If this tree cannot be built, or not put together.
    CheckError
        If its bodies come too near to each other on the path, or fit no plate.
    """
    from fabfold.joinery.loose_pins import meshes_with_pins
    from fabfold.kit.holding import hold_kit
    from fabfold.proof.certify import certify, certify_orders

    profile, apart = mode.profile, None
    joinery = _bodies(planned, mode, voxel_mm, progress)
    if mode.apart:
        from fabfold.apart.apart_kit import prepare_apart

        joinery, apart = prepare_apart(planned.tree, planned.motion, joinery, mode, progress)
    tree, motion = planned.tree, planned.motion
    joinery, apart, retention = hold_kit(tree, motion, joinery, apart, mode, progress)
    # A pin that both bodies grip touches them on purpose, and lies inside its barrel.
    meshes = meshes_with_pins(joinery, tight=False)
    certificate = certify(
        tree,
        motion,
        meshes,
        voxel_mm=joinery.voxel_mm,
        origin_mm=joinery.origin_mm,
        min_gap_mm=profile.min_gap_mm,
        progress=progress,
    )
    if orders:
        certificate["any_order"] = certify_orders(
            tree,
            motion,
            meshes,
            voxel_mm=joinery.voxel_mm,
            origin_mm=joinery.origin_mm,
            min_gap_mm=profile.min_gap_mm,
            progress=progress,
            volume=np.array([body.volume for body in joinery.bodies]),
        )
    tight = [tree.hinges[pin.hinge].name for pin in joinery.pins if pin.tight]
    if tight:
        certificate["geometry"] += (
            f"; the pins of {', '.join(tight)}, which both of their bodies grip, are left out: "
            "they lie inside their barrels"
        )
    motion = replace(motion, certificate=certificate)
    return BuiltTree(replace(planned, motion=motion), joinery, refused, apart, retention)


def _bodies(planned: PlannedTree, mode: PrintMode, voxel_mm: float, progress: Progress) -> Joinery:
    """The bodies, without the plates that would keep powder in a hollow behind them."""
    from fabfold.joinery.build import build_bodies
    from fabfold.joinery.face_fill import plate_before
    from fabfold.joinery.lattice_skin import CHAMFER_SHARE, blocks_of
    from fabfold.printing.chambers import find_chambers
    from fabfold.voxels.features import features

    profile = mode.profile
    unfilled: set[tuple[int, int]] = set()
    while True:
        joinery = build_bodies(
            blocks_of(planned.voxels) if mode.blocks else planned.voxels,
            planned.tree,
            planned.motion,
            voxel_mm=voxel_mm,
            clearance_mm=profile.clearance_mm,
            face_gap_mm=mode.face_gap_mm,
            pin=mode.loose_pin(),
            wall_mm=profile.min_wall_mm,
            chamfer_mm=CHAMFER_SHARE * voxel_mm if mode.blocks else 0.0,
            fill_g_cm3=profile.density_g_cm3 if mode.fill else None,
            unfilled=unfilled,
            progress=progress,
        )
        if not mode.fill or profile.escape_mm is None:
            return joinery
        depth = features(planned.voxels).depth
        shut: set[tuple[int, int]] = set()
        for index, body in enumerate(joinery.bodies):
            for chamber in find_chambers([body], profile.escape_mm):
                middle = np.subtract(chamber.middle_mm, joinery.origin_mm) / joinery.voxel_mm
                plate = plate_before(planned.tree, depth, index, middle, unfilled)
                if plate is not None:
                    shut.add(plate)
        if not shut:
            return joinery
        progress.update(None, f"{len(shut)} plates would keep powder in: without them")
        unfilled |= shut


def build_first(
    trees: Iterable[PlannedTree], mode: PrintMode, voxel_mm: float, progress: Progress
) -> BuiltTree:
    """Build the first of several trees that survives on real bodies.

    Parameters
    ----------
    trees : iterable of PlannedTree
        Best first.
    mode : PrintMode
        How it is printed.
    voxel_mm : float
        Printed side of a voxel, mm.
    progress : Progress
        Hears of each that is refused.

    Returns
    -------
    BuiltTree
        With the reasons why those before it were passed over.

    Raises
    ------
    NoFoldError
        If every tree was refused; it says why.
    """
    refused: list[str] = []
    for planned in trees:
        try:
            return _build_for_hands(planned, mode, voxel_mm, tuple(refused), progress)
        except (GeometryError, CheckError) as error:
            refused.append(str(error))
            progress.update(None, f"tree {len(refused)} refused: {error}")
    raise NoFoldError(
        f"none of the {len(refused)} trees that fold as cubes could be built; "
        f"the last one: {refused[-1]}. Try another --seed, a larger --voxel-mm or a "
        "smaller --clearance-mm"
    )


def _build_for_hands(
    planned: PlannedTree,
    mode: PrintMode,
    voxel_mm: float,
    refused: tuple[str, ...],
    progress: Progress,
) -> BuiltTree:
    """Build a tree for its path in an order that suits hands, or in the planner's own."""
    from fabfold.fold.motion import motion_of, quarter_path
    from fabfold.fold.tidy import tidied
    from fabfold.tree.system import hinge_system

    path = quarter_path(planned.tree, planned.motion)
    if path is not None:
        motion = motion_of(planned.tree, tidied(hinge_system(planned.tree), path))
        if motion.moves != planned.motion.moves:
            try:
                return build(replace(planned, motion=motion), mode, voxel_mm, refused, progress)
            except (GeometryError, CheckError) as error:
                progress.update(None, f"in the planner's order: {error}")
    return build(planned, mode, voxel_mm, refused, progress)
