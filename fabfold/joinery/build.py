"""From voxels, tree and folding path to printed bodies (paper section 4.3)."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import GeometryError
from fabfold.fold.barrel_collisions import first_barrel_collision
from fabfold.fold.motion import Motion
from fabfold.joinery.barrel_sweeps import Sweep, barrel_sweeps
from fabfold.joinery.bodies import BodyMesh, Joinery
from fabfold.joinery.booleans import effective_tools, subtract, union
from fabfold.joinery.carving import CarvedMaterial, carve
from fabfold.joinery.cells import eroded_cells, model_manifold
from fabfold.joinery.cut_walls import with_cut_walls
from fabfold.joinery.cutting import BodyCutter
from fabfold.joinery.face_fill import with_filled_faces
from fabfold.joinery.hinge_placement import place_hinges
from fabfold.joinery.links import link_body
from fabfold.joinery.one_piece import connect_pieces
from fabfold.joinery.pockets import plate_sweeps
from fabfold.joinery.sizes import HingeSize, hinge_size
from fabfold.joinery.soundness import printable_body
from fabfold.joinery.tally import BuildTally
from fabfold.progress import Progress, SilentProgress
from fabfold.tree.fold_tree import FoldTree
from fabfold.tree.sharing import WHOLE
from fabfold.voxels.features import features
from fabfold.voxels.voxel_model import Voxels

if TYPE_CHECKING:
    import manifold3d

    from hinges.hardware import LoosePin

__all__ = ["build_bodies"]

#: Barrels and plates pass a cell at its faces; what takes more than this share runs through it.
_MOST_OF_A_CELL = 0.5


def build_bodies(
    voxels: Voxels,
    tree: FoldTree,
    motion: Motion,
    *,
    voxel_mm: float,
    clearance_mm: float,
    barrel_radius_mm: float | None = None,
    pin_radius_mm: float | None = None,
    knuckles: int | None = None,
    face_gap_mm: float | None = None,
    pin: LoosePin | None = None,
    wall_mm: float = 0.0,
    chamfer_mm: float = 0.0,
    fill_g_cm3: float | None = None,
    unfilled: Collection[tuple[int, int]] = (),
    progress: Progress | None = None,
) -> Joinery:
    """Make the printed bodies of a kit.

    Each body is the warped model inside its own cells, inset by half the gap from every cell
    that is not its own, with its hinge halves added, with grooves and pockets wherever the barrel
    or the link plate of another hinge passes on the folding path, with corners rounded off where
    cells would run into each other, and with struts where the cut left its material in pieces. The
    link of a double hinge is a body too.

    Parameters
    ----------
    voxels : Voxels
        The voxels and the warped model, in the order of the voxels of `tree`.
    tree : FoldTree
        The bodies and the hinges between them.
    motion : Motion
        The folding path from A to B, one hinge a move.
    voxel_mm : float
        Side of a voxel in mm.
    clearance_mm : float
        Normal clearance in the hinges, and room around what passes, mm.
    barrel_radius_mm : float, optional
        Radius of the barrels in mm; derived from `voxel_mm` and `clearance_mm` by default.
    pin_radius_mm : float, optional
        Radius of the pins in mm; derived in the same way by default.
    knuckles : int, optional
        Number of knuckles of a single hinge; 3 by default.
    face_gap_mm : float, optional
        Gap between the faces of two bodies, mm; the clearance by default.
    pin : hinges.hardware.LoosePin, optional
        Pin that is pushed in after printing, in place of printed cones. Its bores are open at both
        ends; :mod:`fabfold.joinery.loose_pins` clears one and closes the other.
    wall_mm : float
        Least thickness of the material behind the faces that the cut makes, mm.
    chamfer_mm : float
        Leg of the chamfer on the edges of the bodies' cells, mm; for bodies that are blocks.
    fill_g_cm3 : float, optional
        Density of the material of plates of `wall_mm` that close open faces of the box from inside;
        without it these stay open.
    unfilled : collection of (int, int)
        Voxels and their faces that get no such plate.
    progress : Progress, optional
        Is told how far the work is.

    Returns
    -------
    Joinery
        The bodies in mm, shape A, with the figures of how they were made.

    Raises
    ------
    RecipeError
        If no hinge fits the voxel size and clearance.
    GeometryError
        If this tree cannot be built: a barrel passes through the knuckles of another hinge, a
        double hinge does not fit, a link is cut apart, cells cannot pass each other without
        cutting a hinge, or a body cannot be made one piece. The message names the bodies.

    References
    ----------
    Zhou et al., "Boxelization: folding 3D objects into boxes", section 4.3.
    """
    progress = progress or SilentProgress()
    _check_inputs(voxels, tree, motion, voxel_mm, clearance_mm)
    size = hinge_size(
        voxel_mm, clearance_mm, barrel_radius_mm, pin_radius_mm, knuckles, face_gap_mm, pin
    )
    progress.update(0.0, "preparing the model and the hinges")
    _refuse_colliding_barrels(tree, motion, size, voxel_mm)
    model = model_manifold(voxels, voxel_mm)
    walls_mm3 = 0.0
    if wall_mm > 0.0:
        model, walls_mm3 = with_cut_walls(model, tree, voxel_mm, size.gap_mm / 2, wall_mm)
    filled: tuple[str, ...] = ()
    if fill_g_cm3 is not None:
        model, fill = with_filled_faces(
            model,
            tree,
            features(voxels).depth,
            voxel_mm=voxel_mm,
            inset_mm=size.gap_mm / 2,
            wall_mm=wall_mm,
            without=unfilled,
        )
        filled = (fill.note(wall_mm, fill_g_cm3),)
    hinges = place_hinges(tree, motion, size, voxel_mm)
    past_barrels = _by_body(tree, barrel_sweeps(tree, motion, 1.05 * size.reach_mm / voxel_mm))
    past_plates = _by_body(
        tree,
        plate_sweeps(tree, motion, hinges.plates, voxel_mm=voxel_mm, clearance_mm=clearance_mm),
    )
    carved = carve(
        voxels,
        tree,
        motion,
        model,
        hinges.halves,
        voxel_mm=voxel_mm,
        clearance_mm=size.gap_mm,
    )
    tally = BuildTally()
    origin = voxel_mm * (0.5 - tree.source.min(axis=0).astype(float))
    meshes = []
    for index, body in enumerate(tree.bodies):
        progress.update(index / len(tree.bodies), f"cutting {body.name}")
        cutter = BodyCutter(
            index, tree, hinges, past_barrels[index], past_plates[index], size, voxel_mm
        )
        solid = (
            link_body(cutter, tally)
            if index in hinges.plates
            else _voxel_body(cutter, model, carved, tally, chamfer_mm)
        )
        vertices, faces = printable_body(solid, body.name, origin)
        meshes.append(BodyMesh(body.name, vertices, faces))
    progress.update(1.0, f"{len(meshes)} bodies, {tally.struts} struts")
    x, y, z = origin.tolist()
    return Joinery(
        bodies=tuple(meshes),
        voxel_mm=float(voxel_mm),
        origin_mm=(x, y, z),
        clearance_mm=float(clearance_mm),
        barrel_radius_mm=size.barrel_radius_mm,
        pin_radius_mm=size.pin_radius_mm,
        knuckles=size.knuckles,
        carved_cells=tally.carved_cells,
        carved_mm3=round(tally.carved_mm3, 3),
        dropped_mm3=round(tally.dropped_mm3, 3),
        struts=tally.struts,
        notes=(
            *filled,
            *_wall_notes(walls_mm3, wall_mm),
            *carved.notes(),
            *tally.notes(voxel_mm, len(hinges.plates)),
        ),
        rounded_cells=carved.cells,
        rounded_skin_mm3=round(carved.skin_mm3, 3),
        rounded_inside_mm3=round(carved.inside_mm3, 3),
        face_gap_mm=None if face_gap_mm is None else float(face_gap_mm),
    )


def _wall_notes(added_mm3: float, wall_mm: float) -> tuple[str, ...]:
    if added_mm3 < 0.5:
        return ()
    return (
        f"{added_mm3:.0f} mm³ added where the cut left less than a wall of {wall_mm:g} mm behind "
        "its face",
    )


def _by_body(tree: FoldTree, sweeps: Iterable[Sweep]) -> list[list[Sweep]]:
    """The sweeps past each body, by index of the body."""
    found: list[list[Sweep]] = [[] for _ in tree.bodies]
    for sweep in sweeps:
        found[sweep.body].append(sweep)
    return found


def _check_inputs(
    voxels: Voxels, tree: FoldTree, motion: Motion, voxel_mm: float, clearance_mm: float
) -> None:
    if not 1.0 <= voxel_mm <= 1000.0 or not 0.01 <= clearance_mm < 0.2 * voxel_mm:
        raise GeometryError(
            f"voxel of {voxel_mm:g} mm with {clearance_mm:g} mm clearance: a voxel is 1 to 1000 mm "
            "and the clearance 0.01 mm to a fifth of it"
        )
    if len(voxels.cells) != len(tree.source) or (voxels.cells != tree.source).any():
        raise GeometryError("the tree's source cells are not the voxels' cells")
    if motion.angles_deg.shape[1] != len(tree.hinges):
        raise GeometryError(
            f"the path has {motion.angles_deg.shape[1]} hinges, the tree {len(tree.hinges)}"
        )
    for step, moving in enumerate(motion.moves):
        if len(moving) > 1:
            raise GeometryError(
                f"move {step} turns {len(moving)} hinges at once; "
                "grooves need a path that turns one hinge at a time"
            )


def _refuse_colliding_barrels(
    tree: FoldTree, motion: Motion, size: HingeSize, voxel_mm: float
) -> None:
    """Refuse a path on which two barrels run into each other, before anything is cut."""
    found = first_barrel_collision(
        tree,
        motion,
        inset=(size.reach_mm + size.barrel_radius_mm) / voxel_mm,
        least=(size.reach_mm + size.barrel_radius_mm) / voxel_mm,
    )
    if found is not None:
        one, other = tree.hinges[found.moving], tree.hinges[found.resting]
        raise GeometryError(
            f"the barrel of {one.name} runs into the barrel of {other.name} while "
            f"{tree.hinges[found.turning].name} turns, after {found.angle_deg:.0f}° of move "
            f"{found.move}"
        )


def _voxel_body(
    cutter: BodyCutter,
    model: manifold3d.Manifold,
    carved: CarvedMaterial,
    tally: BuildTally,
    chamfer_mm: float,
) -> manifold3d.Manifold:
    """A body of voxels as one connected solid, mm, lattice origin at zero."""
    cells = cutter.tree.source[list(cutter.tree.bodies[cutter.index].voxels)]
    space = _body_space(cutter, cells, model, tally, chamfer_mm)
    own = cutter.hinges.halves[cutter.index]
    cutouts = [placed.cutout for placed in own]
    carving_tools = carved.tools.get(cutter.index, [])
    material = subtract(model ^ space, [*cutouts, *carving_tools])
    halves = [
        subtract(placed.half, [other.cutout for other in own if other.hinge != placed.hinge])
        for placed in own
    ]
    grooves = cutter.groove_tools(*cutter.boxes(cells, halves))
    # Plates keep off knuckles, and all else is inside the cells.
    pockets = cutter.pocket_tools(*cutter.boxes(cells, []))
    tools = effective_tools([*grooves, *pockets], material)
    if tools:
        lost, material = material.split(union(tools))
        volume = lost.volume()
        if volume > 0.01:
            tally.carved_mm3 += volume
            names = [cutter.tree.hinges[h].name for h, _ in grooves]
            names += [cutter.tree.bodies[b].name for b, _ in pockets]
            tally.carved_cells += _count_cells(cutter, lost, cells, names)
    halves = [subtract(cutter.cut_half(half, grooves, pockets), carving_tools) for half in halves]

    @cache
    def strut_space() -> manifold3d.Manifold:
        """Where struts of the body may run."""
        keep_outs = [*carving_tools, *carved.strut_keep_outs.get(cutter.index, [])]
        passing = effective_tools([*grooves, *pockets], space)
        return subtract(space, [*cutouts, *keep_outs, *passing])

    return connect_pieces(cutter.name, cells, strut_space, material, halves, cutter.voxel_mm, tally)


def _body_space(
    cutter: BodyCutter,
    cells: NDArray[np.int32],
    model: manifold3d.Manifold,
    tally: BuildTally,
    chamfer_mm: float,
) -> manifold3d.Manifold:
    """Where the body may be: its cells, and of those that are shared in B its own octants."""
    inset = cutter.size.gap_mm / 2
    whole = eroded_cells(cells, cutter.voxel_mm, inset, chamfer_mm=chamfer_mm)
    if cutter.tree.octants is None:
        return whole
    octants = cutter.tree.octants[list(cutter.tree.bodies[cutter.index].voxels)]
    if (octants == WHOLE).all():
        return whole
    own = eroded_cells(cells, cutter.voxel_mm, inset, octants, chamfer_mm)
    tally.shared_cells += int((octants != WHOLE).sum())
    tally.shared_mm3 += (model ^ (whole - own)).volume()
    return own


def _count_cells(
    cutter: BodyCutter, lost: manifold3d.Manifold, cells: NDArray[np.int32], culprits: Iterable[str]
) -> int:
    """Number of cells (m, 3) in which a lost solid has volume.

    Most of a cell is refused: the path then runs through the body instead of past it.
    """
    import manifold3d

    count = 0
    side = cutter.voxel_mm
    cube = manifold3d.Manifold.cube((side, side, side), True)
    for cell in cells:
        volume = (lost ^ cube.translate(tuple(cell * side))).volume()
        if volume > _MOST_OF_A_CELL * side**3:
            raise GeometryError(
                f"{cutter.name}: {', '.join(dict.fromkeys(culprits))} would take "
                f"{100 * volume / side**3:.0f} % of its cell {cell.tolist()} on the folding path"
            )
        count += volume > 0.01
    return int(count)
