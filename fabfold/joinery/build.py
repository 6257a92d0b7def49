"""From voxels, tree and folding path to printed bodies (paper section 4.3)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import GeometryError
from fabfold.fold.barrels import first_encounter
from fabfold.fold.model import Motion
from fabfold.joinery.cells import eroded_cells, model_manifold
from fabfold.joinery.grooves import Passage, groove_tools, passages
from fabfold.joinery.model import BodyMesh, Joinery
from fabfold.joinery.placement import HingePieces, hinge_pieces, knuckle_zone
from fabfold.joinery.sizes import HingeSize, hinge_size, strut_width
from fabfold.joinery.soundness import finish_mesh
from fabfold.joinery.unite import CRUMB_SHARE, Tally, one_piece
from fabfold.progress import Progress, SilentProgress
from fabfold.tree.model import FoldTree
from fabfold.voxels.model import Voxels

if TYPE_CHECKING:
    import manifold3d

__all__ = ["build_bodies"]

#: A groove may not take more than this from the knuckles of a hinge, in mm³.
_ZONE_LOSS_MM3 = 0.01


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
    that is not its own, with its hinge halves added, with grooves wherever the barrel of another
    hinge passes on the folding path, and with struts where the cut left its material in pieces.

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
        If this tree cannot be built: a barrel passes through the knuckles of another hinge, or a
        body cannot be made one piece. The message names the bodies.

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
    hinges = hinge_pieces(tree, size, voxel_mm)
    ways: list[list[Passage]] = [[] for _ in tree.bodies]
    for passage in passages(tree, motion, 1.05 * size.reach_mm / voxel_mm):
        ways[passage.body].append(passage)
    tally = Tally()
    origin = voxel_mm * (0.5 - tree.source.min(axis=0).astype(float))
    meshes = []
    for index, body in enumerate(tree.bodies):
        told.update(index / len(tree.bodies), f"cutting {body.name}")
        solid = _body(index, tree, model, hinges, ways[index], size, voxel_mm, tally)
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
        notes=_notes(tally, voxel_mm),
    )


def _notes(tally: Tally, voxel_mm: float) -> tuple[str, ...]:
    notes = []
    if tally.carved_cells:
        notes.append(
            f"{tally.carved_mm3:.0f} mm³ taken out of {tally.carved_cells} cells "
            "so that hinge barrels can pass"
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
    for edge in tree.edges:
        if edge.kind == "D":
            raise GeometryError(
                f"the joint between voxels {edge.parent} and {edge.child} is a double hinge, "
                "which cannot be printed yet; use single hinges"
            )


def _refuse_encounters(tree: FoldTree, motion: Motion, size: HingeSize, voxel_mm: float) -> None:
    """Refuse a path on which two barrels run into each other, before anything is cut."""
    found = first_encounter(
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
    index: int,
    tree: FoldTree,
    model: manifold3d.Manifold,
    hinges: list[HingePieces],
    ways: list[Passage],
    size: HingeSize,
    voxel_mm: float,
    tally: Tally,
) -> manifold3d.Manifold:
    """One body as one connected solid, lattice origin at zero."""
    body = tree.bodies[index]
    cells = tree.source[list(body.voxels)]
    room = eroded_cells(cells, voxel_mm, size.clearance_mm / 2)
    own = [
        (h, pieces.parent_half, pieces.parent_carve)
        if tree.hinges[h].parent == index
        else (h, pieces.child_half, pieces.child_carve)
        for h, pieces in enumerate(hinges)
        if index in (tree.hinges[h].parent, tree.hinges[h].child)
    ]
    carves = [carve for _, _, carve in own]
    material = _less(model ^ room, carves)
    halves = [_less(half, [carve for other, _, carve in own if other != h]) for h, half, _ in own]
    tools = groove_tools(
        ways,
        *_boxes(cells, halves, voxel_mm),
        voxel_mm=voxel_mm,
        radius_mm=size.reach_mm,
        trim_mm=size.barrel_radius_mm,
    )
    _protect_zones(index, tree, tools, [h for h, _, _ in own], size, voxel_mm)
    in_material = _meeting(tools, material)
    if in_material:
        lost, material = material.split(_united(in_material))
        volume = lost.volume()
        if volume > 0.01:
            tally.carved_mm3 += volume
            tally.carved_cells += _cells_of(lost, cells, voxel_mm)
    halves = [_less(half, _meeting(tools, half)) for half in halves]

    def free() -> manifold3d.Manifold:
        return _less(room, [*carves, *(tool for _, tool in tools)])

    return one_piece(body.name, cells, free, material, halves, voxel_mm, tally)


def _evaluated(solid: manifold3d.Manifold) -> manifold3d.Manifold:
    """The same solid, worked out now.

    Booleans are lazy; one that is used twice before it is worked out may be worked out twice.
    """
    solid.num_tri()
    return solid


def _united(solids: list[manifold3d.Manifold]) -> manifold3d.Manifold:
    import manifold3d

    return _evaluated(manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add))


def _less(solid: manifold3d.Manifold, tools: list[manifold3d.Manifold]) -> manifold3d.Manifold:
    if not tools:
        return _evaluated(solid)
    return _evaluated(_evaluated(solid) - _united(tools))


def _meeting(
    tools: list[tuple[int, manifold3d.Manifold]], solid: manifold3d.Manifold
) -> list[manifold3d.Manifold]:
    """The tools that take something off a solid: most pass by where a cell is empty."""
    low, high = _corners(solid)
    found = []
    for _, tool in tools:
        start, end = _corners(tool)
        if (start < high).all() and (low < end).all() and (solid ^ tool).volume() > 1e-6:
            found.append(tool)
    return found


def _corners(solid: manifold3d.Manifold) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    box = np.array(solid.bounding_box())
    return box[:3], box[3:]


def _boxes(
    cells: NDArray[np.int32],
    halves: list[manifold3d.Manifold],
    voxel_mm: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Boxes in lattice units that hold all that a groove could meet, struts included."""
    lows = list((cells - 0.5) * voxel_mm)
    highs = list((cells + 0.5) * voxel_mm)
    for half in halves:
        box = np.array(half.bounding_box())
        lows.append(box[:3])
        highs.append(box[3:])
    return np.array(lows) / voxel_mm, np.array(highs) / voxel_mm


def _cells_of(solid: manifold3d.Manifold, cells: NDArray[np.int32], voxel_mm: float) -> int:
    """Number of cells in which a solid has volume."""
    import manifold3d

    count = 0
    cube = manifold3d.Manifold.cube((voxel_mm, voxel_mm, voxel_mm), True)
    for cell in cells:
        count += (solid ^ cube.translate(tuple(cell * voxel_mm))).volume() > 0.01
    return int(count)


def _protect_zones(
    index: int,
    tree: FoldTree,
    tools: list[tuple[int, manifold3d.Manifold]],
    own: list[int],
    size: HingeSize,
    voxel_mm: float,
) -> None:
    """Refuse a groove that would cut into the knuckles of one of the body's own hinges."""
    for h in own:
        zone = knuckle_zone(tree.hinges[h], size, voxel_mm)
        low, high = _corners(zone)
        for culprit, tool in tools:
            start, end = _corners(tool)
            if (start >= high).any() or (low >= end).any():
                continue
            if (zone ^ tool).volume() > _ZONE_LOSS_MM3:
                raise GeometryError(
                    f"{tree.bodies[index].name}: the barrel of {tree.hinges[culprit].name} passes "
                    f"through the knuckles of {tree.hinges[h].name} on the folding path"
                )
