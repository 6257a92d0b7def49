"""From voxels, tree and folding path to printed bodies (paper section 4.3)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import GeometryError
from fabfold.fold.model import Motion
from fabfold.joinery.cells import eroded_cells, model_manifold
from fabfold.joinery.grooves import Passage, groove_tools, passages
from fabfold.joinery.model import BodyMesh, Joinery
from fabfold.joinery.placement import HingePieces, hinge_pieces, knuckle_zone
from fabfold.joinery.sizes import HingeSize, hinge_size, strut_width
from fabfold.joinery.soundness import finish_mesh
from fabfold.joinery.struts import bar_solid, grid_of, plan_struts
from fabfold.progress import Progress, SilentProgress
from fabfold.tree.model import FoldTree
from fabfold.voxels.model import Voxels

if TYPE_CHECKING:
    import manifold3d

__all__ = ["CRUMB_SHARE", "build_bodies"]

#: Loose pieces below this share of a full cell's volume are left out.
CRUMB_SHARE = 0.005
#: A groove may not take more than this from the knuckles of a hinge, in mm³.
_ZONE_LOSS_MM3 = 0.01
_STRUT_ROUNDS = 3


@dataclass
class _Tally:
    """What the stages of one kit took away and added."""

    carved_cells: int = 0
    carved_mm3: float = 0.0
    dropped_mm3: float = 0.0
    crumbs: int = 0
    struts: int = 0
    strutted: list[str] = field(default_factory=list)


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
    model = model_manifold(voxels, voxel_mm)
    hinges = hinge_pieces(tree, size, voxel_mm)
    ways: list[list[Passage]] = [[] for _ in tree.bodies]
    for passage in passages(tree, motion, np.ones(len(tree.hinges), dtype=bool)):
        ways[passage.body].append(passage)
    tally = _Tally()
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


def _notes(tally: _Tally, voxel_mm: float) -> tuple[str, ...]:
    notes = []
    if tally.carved_cells:
        notes.append(
            f"{tally.carved_mm3:.0f} mm³ taken out of {tally.carved_cells} cells "
            "so that hinge barrels can pass"
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


def _body(
    index: int,
    tree: FoldTree,
    model: manifold3d.Manifold,
    hinges: list[HingePieces],
    ways: list[Passage],
    size: HingeSize,
    voxel_mm: float,
    tally: _Tally,
) -> manifold3d.Manifold:
    """One body as one connected solid, lattice origin at zero."""
    import manifold3d

    body = tree.bodies[index]
    cells = tree.source[list(body.voxels)]
    room = eroded_cells(cells, voxel_mm, size.clearance_mm / 2)
    own = [
        (h, pieces.parent_half, pieces.parent_carve)
        for h, pieces in enumerate(hinges)
        if tree.hinges[h].parent == index
    ]
    own += [
        (h, pieces.child_half, pieces.child_carve)
        for h, pieces in enumerate(hinges)
        if tree.hinges[h].child == index
    ]
    material = model ^ room
    tools = groove_tools(
        ways,
        *_material_boxes(material, cells, own, voxel_mm),
        voxel_mm=voxel_mm,
        radius_mm=size.reach_mm,
        trim_mm=size.barrel_radius_mm,
    )
    carves = [carve for _, _, carve in own]
    free, material = _less(room, carves), _less(material, carves)
    halves = [_less(half, [carve for other, _, carve in own if other != h]) for h, half, _ in own]
    if tools:
        groove = manifold3d.Manifold.batch_boolean(tools, manifold3d.OpType.Add)
        _protect_zones(index, tree, groove, [h for h, _, _ in own], ways, size, voxel_mm)
        lost = material ^ groove
        volume = lost.volume()
        if volume > 0.01:
            tally.carved_mm3 += volume
            tally.carved_cells += _cells_of(lost, cells, voxel_mm)
        free, material = free - groove, material - groove
        halves = [half - groove for half in halves]
    return _one_piece(body.name, cells, free, material, halves, voxel_mm, tally)


def _less(solid: manifold3d.Manifold, tools: list[manifold3d.Manifold]) -> manifold3d.Manifold:
    import manifold3d

    if not tools:
        return solid
    return manifold3d.Manifold.batch_boolean([solid, *tools], manifold3d.OpType.Subtract)


def _material_boxes(
    material: manifold3d.Manifold,
    cells: NDArray[np.int32],
    own: list[tuple[int, manifold3d.Manifold, manifold3d.Manifold]],
    voxel_mm: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Boxes in lattice units that hold all that a groove could meet: material, then knuckles."""
    low, high = [], []
    for cell in cells:
        corner = (cell - 0.5) * voxel_mm
        low.append(corner)
        high.append(corner + voxel_mm)
    if not material.is_empty():
        box = np.array(material.bounding_box())
        low = [np.maximum(corner, box[:3]) for corner in low]
        high = [np.minimum(corner, box[3:]) for corner in high]
    for _, half, _ in own:
        box = np.array(half.bounding_box())
        low.append(box[:3])
        high.append(box[3:])
    lows, highs = np.array(low), np.array(high)
    held = (lows < highs).all(axis=1)
    return lows[held] / voxel_mm, highs[held] / voxel_mm


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
    groove: manifold3d.Manifold,
    own: list[int],
    ways: list[Passage],
    size: HingeSize,
    voxel_mm: float,
) -> None:
    """Refuse a groove that would cut into the knuckles of one of the body's own hinges."""
    for h in own:
        zone = knuckle_zone(tree.hinges[h], size, voxel_mm)
        if (zone ^ groove).volume() <= _ZONE_LOSS_MM3:
            continue
        culprit = _culprit(zone, ways, size, voxel_mm)
        whose = "another hinge" if culprit is None else tree.hinges[culprit].name
        raise GeometryError(
            f"{tree.bodies[index].name}: the barrel of {whose} passes through the knuckles of "
            f"{tree.hinges[h].name} on the folding path"
        )


def _culprit(
    zone: manifold3d.Manifold, ways: list[Passage], size: HingeSize, voxel_mm: float
) -> int | None:
    import manifold3d

    box = np.array(zone.bounding_box()) / voxel_mm
    for passage in ways:
        tools = groove_tools(
            [passage],
            box[None, :3],
            box[None, 3:],
            voxel_mm=voxel_mm,
            radius_mm=size.reach_mm,
            trim_mm=size.barrel_radius_mm,
        )
        if not tools:
            continue
        groove = manifold3d.Manifold.batch_boolean(tools, manifold3d.OpType.Add)
        if (zone ^ groove).volume() > _ZONE_LOSS_MM3:
            return passage.hinge
    return None


def _one_piece(
    name: str,
    cells: NDArray[np.int32],
    free: manifold3d.Manifold,
    material: manifold3d.Manifold,
    halves: list[manifold3d.Manifold],
    voxel_mm: float,
    tally: _Tally,
) -> manifold3d.Manifold:
    """Material and hinge halves as one piece, with struts where it takes them."""
    import manifold3d

    add = manifold3d.OpType.Add
    solid = manifold3d.Manifold.batch_boolean([material, *halves], add)
    grid = grid_of(cells, voxel_mm)
    crumb = CRUMB_SHARE * voxel_mm**3
    open_room = grid.sample(free)
    brackets = [grid.sample(half) for half in halves]
    for _ in range(_STRUT_ROUNDS):
        pieces, crumbs = _sorted_pieces(solid, halves, crumb)
        if not pieces:
            raise GeometryError(
                f"{name}: its {len(cells)} cells hold no piece of material above {crumb:.0f} mm³ "
                "and no hinge"
            )
        if crumbs:
            tally.crumbs += len(crumbs)
            tally.dropped_mm3 += sum(piece.volume() for piece in crumbs)
            solid = manifold3d.Manifold.batch_boolean(pieces, add)
        filled = grid.sample(solid)
        samples = [grid.sample(piece) for piece in pieces] if len(pieces) > 1 else []
        bars = plan_struts(grid, open_room, filled, samples, brackets)
        if bars is None:
            raise GeometryError(
                f"{name}: {len(pieces)} pieces of material lie apart in its cells, and grooves and "
                "hinges leave no way for a strut between them"
            )
        if not bars:
            if len(pieces) == 1:
                return pieces[0]
            break
        tally.struts += len(bars)
        if name not in tally.strutted:
            tally.strutted.append(name)
        width = strut_width(voxel_mm)
        solids = [bar_solid(bar, width) ^ free for bar in bars]
        solid = manifold3d.Manifold.batch_boolean([solid, *solids], add)
    pieces, crumbs = _sorted_pieces(solid, halves, crumb)
    if len(pieces) != 1:
        raise GeometryError(
            f"{name}: still {len(pieces)} pieces after struts were added; "
            "another tree or a larger voxel may do"
        )
    tally.crumbs += len(crumbs)
    tally.dropped_mm3 += sum(piece.volume() for piece in crumbs)
    return pieces[0]


def _sorted_pieces(
    solid: manifold3d.Manifold, halves: list[manifold3d.Manifold], crumb: float
) -> tuple[list[manifold3d.Manifold], list[manifold3d.Manifold]]:
    """Pieces worth keeping, the largest first, and crumbs; a piece with a hinge is kept."""
    pieces = sorted(solid.decompose(), key=lambda piece: -piece.volume())
    if len(pieces) == 1:
        return pieces, []
    kept, crumbs = [], []
    for piece in pieces:
        small = piece.volume() < crumb
        if small and not any((piece ^ half).volume() > 1e-3 for half in halves):
            crumbs.append(piece)
        else:
            kept.append(piece)
    return kept, crumbs
