"""From voxels, tree and folding path to printed bodies (paper section 4.3)."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import GeometryError
from fabfold.fold.barrel_collisions import first_barrel_collision
from fabfold.fold.motion import Motion
from fabfold.joinery.bodies import BodyMesh, Joinery
from fabfold.joinery.carving import Carved, carve
from fabfold.joinery.cells import eroded_cells, eroded_room, model_manifold
from fabfold.joinery.cutting import Cut, less, meeting, united
from fabfold.joinery.grooves import Passage, passages
from fabfold.joinery.hinge_placement import fittings
from fabfold.joinery.links import link_body
from fabfold.joinery.one_piece import CRUMB_SHARE, MendTally, one_piece
from fabfold.joinery.pockets import plate_passages
from fabfold.joinery.sizes import HingeSize, hinge_size, strut_width
from fabfold.joinery.soundness import finish_mesh
from fabfold.progress import Progress, SilentProgress
from fabfold.tree.fold_tree import FoldTree
from fabfold.tree.sharing import WHOLE
from fabfold.voxels.voxel_model import Voxels

if TYPE_CHECKING:
    import manifold3d

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
    progress: Progress | None = None,
) -> Joinery:
    """Make the printed bodies of a kit.

    Each body is the warped model inside its own cells, inset by half the clearance from every cell
    that is not its own, with its hinge halves added, with grooves and pockets wherever the barrel
    or the link plate of another hinge passes on the folding path, with corners rounded off where
    cells would run into each other, and with struts where the cut left its material in pieces. The
    link of a double hinge is a body too.

    Parameters
    ----------
    voxels : Voxels
        In the order of the voxels of `tree`.
    tree : FoldTree
    motion : Motion
        The folding path from A to B, one hinge a move.
    voxel_mm : float
        Side of a voxel.
    clearance_mm : float
        Gap between bodies, and normal clearance in the hinges.
    barrel_radius_mm, pin_radius_mm, knuckles : optional
        Of the hinges; derived from `voxel_mm` and `clearance_mm` when left out.
    progress : Progress, optional

    Returns
    -------
    Joinery

    Raises
    ------
    RecipeError
        If no hinge fits the voxel size and clearance.
    GeometryError
        If this tree cannot be built: a barrel passes through the knuckles of another hinge, a
        double hinge does not fit, a link is cut apart, cells cannot pass each other without
        cutting a hinge, or a body cannot be made one piece. The
        message names the bodies.

    References
    ----------
    Zhou et al., "Boxelization: folding 3D objects into boxes", section 4.3.
    """
    told = progress or SilentProgress()
    _check_inputs(voxels, tree, motion, voxel_mm, clearance_mm)
    size = hinge_size(voxel_mm, clearance_mm, barrel_radius_mm, pin_radius_mm, knuckles)
    told.update(0.0, "preparing the model and the hinges")
    _refuse_encounters(tree, motion, size, voxel_mm)
    model = model_manifold(voxels, voxel_mm)
    fitted = fittings(tree, motion, size, voxel_mm)
    ways: list[list[Passage]] = [[] for _ in tree.bodies]
    for passage in passages(tree, motion, 1.05 * size.reach_mm / voxel_mm):
        ways[passage.body].append(passage)
    plate_ways: list[list[Passage]] = [[] for _ in tree.bodies]
    for passage in plate_passages(
        tree, motion, fitted.plates, voxel_mm=voxel_mm, clearance_mm=clearance_mm
    ):
        plate_ways[passage.body].append(passage)
    rounded = carve(
        voxels,
        tree,
        motion,
        model,
        [[(item.half, item.carve) for item in own] for own in fitted.halves],
        voxel_mm=voxel_mm,
        clearance_mm=clearance_mm,
    )
    tally = MendTally()
    origin = voxel_mm * (0.5 - tree.source.min(axis=0).astype(float))
    meshes = []
    for index, body in enumerate(tree.bodies):
        told.update(index / len(tree.bodies), f"cutting {body.name}")
        cut = Cut(index, tree, fitted, ways[index], plate_ways[index], size, voxel_mm)
        solid = (
            link_body(cut, tally) if index in fitted.plates else _body(cut, model, rounded, tally)
        )
        vertices, faces = finish_mesh(solid, body.name, origin)
        meshes.append(BodyMesh(body.name, vertices, faces))
    told.update(1.0, f"{len(meshes)} bodies, {tally.struts} struts")
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
        notes=(*rounded.notes(), *_notes(tally, voxel_mm, len(fitted.plates))),
        rounded_cells=rounded.cells,
        rounded_skin_mm3=round(rounded.skin_mm3, 3),
        rounded_inside_mm3=round(rounded.inside_mm3, 3),
    )


def _notes(tally: MendTally, voxel_mm: float, links: int) -> tuple[str, ...]:
    notes = []
    if tally.carved_cells:
        notes.append(
            f"{tally.carved_mm3:.0f} mm³ taken out of {tally.carved_cells} cells so that hinge "
            + ("barrels and link plates can pass" if links else "barrels can pass")
        )
    if tally.links_mm3 > 0.01:
        notes.append(
            f"{tally.links_mm3:.0f} mm³ taken out of {tally.links_cut} of {links} link plates so "
            "that hinge barrels and other links can pass"
        )
    if tally.shared_cells:
        notes.append(
            f"{tally.shared_cells} voxels share {tally.shared_cells // 2} cells of the box, two "
            f"and two; {tally.shared_mm3:.0f} mm³ cut off them so that each keeps to its eighths"
        )
    if tally.hollows:
        notes.append(
            f"{tally.hollows} closed hollows filled, {tally.filled_mm3:.0f} mm³ in all: "
            "nothing could be cleaned out of them"
        )
    if tally.crumbs:
        notes.append(
            f"{tally.crumbs} loose crumbs left out, {tally.dropped_mm3:.0f} mm³ in all "
            f"(each below {CRUMB_SHARE * voxel_mm**3:.0f} mm³)"
        )
    if tally.struts:
        notes.append(
            f"{tally.struts} struts of {strut_width(voxel_mm):.1f} mm added in "
            + ", ".join(tally.strutted)
        )
    return tuple(notes)


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


def _refuse_encounters(tree: FoldTree, motion: Motion, size: HingeSize, voxel_mm: float) -> None:
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


def _body(
    cut: Cut, model: manifold3d.Manifold, rounded: Carved, tally: MendTally
) -> manifold3d.Manifold:
    """One body as one connected solid, lattice origin at zero."""
    voxel_mm = cut.voxel_mm
    cells = cut.tree.source[list(cut.tree.bodies[cut.index].voxels)]
    room = _room(cut, cells, model, tally)
    own = cut.fitted.halves[cut.index]
    carves = [item.carve for item in own]
    rounds = rounded.tools.get(cut.index, [])
    material = less(model ^ room, [*carves, *rounds])
    halves = [
        less(item.half, [other.carve for other in own if other.hinge != item.hinge]) for item in own
    ]
    grooves = cut.grooves(*cut.boxes(cells, halves))
    # Plates keep off knuckles, and all else is inside the cells.
    pockets = cut.pockets(*cut.boxes(cells, []))
    in_material = meeting([*grooves, *pockets], material)
    if in_material:
        lost, material = material.split(united(in_material))
        volume = lost.volume()
        if volume > 0.01:
            tally.carved_mm3 += volume
            names = [cut.tree.hinges[h].name for h, _ in grooves]
            names += [cut.tree.bodies[b].name for b, _ in pockets]
            tally.carved_cells += _count_cells(cut, lost, cells, names)
    halves = [less(cut.half(half, grooves, pockets), rounds) for half in halves]

    @cache
    def free() -> manifold3d.Manifold:
        shut = [*rounds, *rounded.shut.get(cut.index, [])]
        return less(room, [*carves, *shut, *meeting([*grooves, *pockets], room)])

    return one_piece(cut.name, cells, free, material, halves, voxel_mm, tally)


def _room(
    cut: Cut, cells: NDArray[np.int32], model: manifold3d.Manifold, tally: MendTally
) -> manifold3d.Manifold:
    """Where the body may be: its cells, and of those that are shared in B its own eighths."""
    inset = cut.size.clearance_mm / 2
    whole = eroded_cells(cells, cut.voxel_mm, inset)
    if cut.tree.octants is None:
        return whole
    octants = cut.tree.octants[list(cut.tree.bodies[cut.index].voxels)]
    if (octants == WHOLE).all():
        return whole
    room = eroded_room(cells, octants, cut.voxel_mm, inset)
    tally.shared_cells += int((octants != WHOLE).sum())
    tally.shared_mm3 += (model ^ (whole - room)).volume()
    return room


def _count_cells(
    cut: Cut, lost: manifold3d.Manifold, cells: NDArray[np.int32], culprits: Iterable[str]
) -> int:
    """Number of cells in which a lost solid has volume.

    Raises
    ------
    GeometryError
        If it is most of a cell: the path runs through the body instead of past it.
    """
    import manifold3d

    count = 0
    side = cut.voxel_mm
    cube = manifold3d.Manifold.cube((side, side, side), True)
    for cell in cells:
        volume = (lost ^ cube.translate(tuple(cell * side))).volume()
        if volume > _MOST_OF_A_CELL * side**3:
            raise GeometryError(
                f"{cut.name}: {', '.join(dict.fromkeys(culprits))} would take "
                f"{100 * volume / side**3:.0f} % of its cell {cell.tolist()} on the folding path"
            )
        count += volume > 0.01
    return int(count)
