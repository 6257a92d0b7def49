"""Plan the carving: which cells lose material so that a path of cores is free, and where.

A path planned with the cores of cells (:mod:`fabfold.fold.core_sweep`) drives some whole cells into
each other (:mod:`fabfold.fold.clashes`): on some rings about the axis, a point of the second cell
lies at no smaller an angle than a point of the first.

So every ring of such a clash is freed in one of two ways: the first loses all that lies behind
the farthest point of the second, or the second loses all that lies ahead of the nearest point of
the first. A cell that turns beside its neighbour is rounded to radius 1 in this way, and loses
1 - π/4 of its volume, 21 %. Only material counts: where a cell is empty, nothing must give way.

The choice is a weighted set cover. Its cost is the volume that is lost, counted once however many
clashes want it; what shows on the model's surface and the cells' cores cost more, and the brackets
that carry hinges are not to be had. It is solved greedily, the costliest clash first, and then
improved clash by clash (:mod:`fabfold.fold.carving_choice`). It is made on the 20 x 20 x 20
subvoxels; what is cut in the end is worked out on the solids (:mod:`fabfold.joinery.carving`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fabfold.fold.carving_choice import ClashArrays, choose_carving
from fabfold.fold.clashes import Clash, clashes_on
from fabfold.fold.core_sweep import CORE_HALF_SIDE
from fabfold.tree.system import HingeSystem

__all__ = ["BRACKET", "CarvingPlan", "carved_path", "plan_carving", "skin_of"]

F64 = NDArray[np.float64]

#: Side of a hinge's bracket across the axis and how far it stays from the ends of the lattice
#: edge, in voxel sides, with a little to spare: 4 of 20 mm and 2.8 of 20 mm.
BRACKET = (0.235, 0.12)
#: What a subvoxel of the model's surface, of a cell's core, and of a hinge costs; 1 elsewhere.
SKIN_COST, CORE_COST, HINGE_COST = 3.0, 2.0, 1e6
#: Subvoxels that count as surface, counted from the outside.
_SKIN_DEPTH = 2
#: Radii at which the voxel that gives way may change, in one clash.
_SPLITS = 11
#: Meetings that may be worked out anew to improve a first choice.
_IMPROVEMENTS = 60_000
#: Prices of a clash, in steps, with which the planner is asked.
_PRICES = (0.3, 1.0, 0.05)


@dataclass(frozen=True)
class CarvingPlan:
    """What is to be carved, clash by clash in this order.

    Attributes
    ----------
    clashes : tuple of m Clash
        Pairs of voxels that run into each other.
    rings : (m, 2) float64 array
        Between these two radii, in lattice units, the first voxel of a clash gives way, elsewhere
        the second.
    lost : (n,) float64 array
        Share of a full cell that each voxel loses, 0 to 1, estimated on subvoxels.
    skin : (n,) float64 array
        The part of it that lies at the model's surface.
    blocked : tuple of (int, int)
        Pairs of voxels whose clash cannot be carved: a hinge bracket is in the way.
    jammed : tuple of int
        Hinges whose turns make them clash.
    """

    clashes: tuple[Clash, ...]
    rings: F64
    lost: F64
    skin: F64
    blocked: tuple[tuple[int, int], ...] = ()
    jammed: tuple[int, ...] = ()

    @property
    def cost(self) -> float:
        """Cells lost, surface counted threefold; infinite where a bracket is in the way."""
        if self.blocked:
            return float("inf")
        return float(self.lost.sum() + (SKIN_COST - 1.0) * self.skin.sum())


@dataclass(frozen=True)
class _PolarView:
    """The two cells of a clash, seen along its axis: their columns of subvoxels in rings.

    Attributes
    ----------
    rows : list of 2 int
        Rows of the two voxels among those that clash.
    strides : list of 2 lists of 4 int
        As ``ClashArrays.stride``.
    radii, angles : lists of 2 (s * s,) float64 arrays
        Polar coordinates of each column, lattice units and radians.
    rings : int
        Number of rings in which both cells may have a part.
    low : float
        Radius at which the first ring begins, lattice units.
    """

    rows: list[int]
    strides: list[list[int]]
    radii: list[F64]
    angles: list[F64]
    rings: int
    low: float


def _polar_view(clash: Clash, system: HingeSystem, row: dict[int, int], size: int) -> _PolarView:
    """See the two cells of a clash along its axis; `size` subvoxels along a side."""
    rows, strides, radii, angles = [], [], [], []
    for voxel, to in ((clash.first, clash.to_first), (clash.second, clash.to_second)):
        centre = to[:, :3] @ np.asarray(system.cells)[voxel] + to[:, 3]
        base, stride = 0, []
        for r in range(3):
            axis = int(np.abs(to[r, :3]).argmax())
            one = (size * size, size, 1)[axis]
            if to[r, axis] < 0:
                base += (size - 1) * one
                one = -one
            stride.append(one)
        steps = (np.arange(size) + 0.5) / size - 0.5
        u, v = np.meshgrid(centre[0] + steps, centre[1] + steps, indexing="ij")
        rows.append(row[voxel])
        strides.append([base, *stride])
        radii.append(np.hypot(u, v).ravel())
        angles.append(np.arctan2(v, u).ravel())
    low = max(radii[0].min(), radii[1].min()) - 0.5 / size
    count = int(np.ceil((min(radii[0].max(), radii[1].max()) - low) * size + 0.5))
    return _PolarView(rows, strides, radii, angles, max(1, count), float(low))


def _clash_arrays(views: list[_PolarView], size: int) -> ClashArrays:
    """All clashes as arrays for the kernel."""
    rings = np.array([view.rings for view in views], dtype=np.int32)
    ring = np.empty((len(views), 2, size * size), dtype=np.int32)
    for e, view in enumerate(views):
        for side in range(2):
            number = np.floor((view.radii[side] - view.low) * size).astype(np.int32)
            ring[e, side] = np.where((number >= 0) & (number < rings[e]), number, -1)
    return ClashArrays(
        np.array([view.rows for view in views], dtype=np.int32),
        np.array([view.strides for view in views], dtype=np.int32),
        ring,
        np.array([view.angles for view in views]),
        rings,
    )


# --- material ----------------------------------------------------------------------------------


def skin_of(cells: NDArray[np.int32], material: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Subvoxels of material that lie at the model's surface.

    Parameters
    ----------
    cells : (n, 3) int32 array
        Cells of shape A.
    material : (n, s, s, s) bool array
        Material of each cell.

    Returns
    -------
    (n, s, s, s) bool array
        Material within two subvoxels of the outside.
    """
    from scipy import ndimage

    size = material.shape[1]
    low = cells.min(axis=0)
    shape = (cells.max(axis=0) - low + 1) * size + 2
    whole = np.zeros(tuple(shape), dtype=bool)
    at = [tuple(slice(s, s + size) for s in (c - low) * size + 1) for c in cells]
    for where, part in zip(at, material, strict=True):
        whole[where] = part
    inner = ndimage.binary_erosion(whole, iterations=_SKIN_DEPTH)
    return np.array([whole[where] & ~inner[where] for where in at])


def _brackets(system: HingeSystem, size: int, bracket: tuple[float, float]) -> NDArray[np.bool_]:
    """Subvoxels where the brackets of hinges sit, (n, s, s, s)."""
    cells = np.asarray(system.cells, dtype=float)
    out = np.zeros((len(cells), size, size, size), dtype=bool)
    steps = (np.arange(size) + 0.5) / size - 0.5
    for h, parent in enumerate(system.parent.tolist()):
        axis = int(system.axis[h])
        away = np.asarray(system.point2)[h] / 2.0 - cells
        beside = (np.abs(np.abs(away) - 0.5) < 1e-9) | (np.arange(3) == axis)
        beside = beside.all(axis=1) & (np.abs(away[:, axis]) < 1e-9)
        for voxel in np.flatnonzero(beside & np.isin(system.body, (parent, h + 1))).tolist():
            inside = []
            for i in range(3):
                if i == axis:
                    inside.append(np.abs(steps) < 0.5 - bracket[1])
                else:
                    inside.append(np.abs(steps - away[voxel, i]) < bracket[0])
            out[voxel] |= inside[0][:, None, None] & inside[1][:, None] & inside[2]
    return out


def _weights(
    material: NDArray[np.bool_], skin: NDArray[np.bool_], held: NDArray[np.bool_]
) -> NDArray[np.float32]:
    """Cost of each subvoxel, (n, s, s, s), from material, surface and brackets of that shape."""
    size = material.shape[1]
    weight = np.ones(material.shape, dtype=np.float32)
    middle = np.abs((np.arange(size) + 0.5) / size - 0.5) < CORE_HALF_SIDE
    weight[:, middle[:, None, None] & middle[:, None] & middle] = CORE_COST
    weight[skin] = SKIN_COST
    weight[held] = HINGE_COST
    return weight


def plan_carving(
    system: HingeSystem,
    path: NDArray[np.integer],
    material: NDArray[np.bool_],
    *,
    bracket: tuple[float, float] = BRACKET,
    improve: bool = True,
) -> CarvingPlan:
    """Choose what to carve so that a path of cores becomes free.

    Parameters
    ----------
    system : HingeSystem
        What folds, on whole cells.
    path : (m, 2) integer array
        From A: hinge and signed quarter turns about its positive axis, one row a move.
    material : (n, s, s, s) bool array
        Material of each cell in shape A, as in :class:`fabfold.voxels.voxel_model.Voxels`.
    bracket : (float, float)
        Side of the hinges' brackets across the axis, and how far they stay from the ends of the
        lattice edge, lattice units; never carved.
    improve : bool
        Improve the first choice, which is good enough to see whether hinges are in the way.

    Returns
    -------
    CarvingPlan
        Without clashes where whole cells pass each other.

    Raises
    ------
    ValueError
        If `material` has not one entry a voxel.
    """
    material = np.asarray(material, dtype=bool)
    count = len(system.cells)
    if material.ndim != 4 or len(material) != count or len(set(material.shape[1:])) != 1:
        raise ValueError(f"material: wants shape ({count}, s, s, s), found {material.shape}")
    size = material.shape[1]
    nothing = np.zeros(count)
    found = clashes_on(system, path)
    if not found:
        return CarvingPlan((), np.zeros((0, 2)), nothing, nothing)
    used = sorted({voxel for m in found for voxel in (m.first, m.second)})
    row = {voxel: i for i, voxel in enumerate(used)}
    skin = skin_of(np.asarray(system.cells), material)
    held = _brackets(system, size, bracket)
    weight = _weights(material, skin, held)
    claims = (material | held)[used].reshape(len(used), -1).astype(np.uint8)
    before = claims.copy()
    views = [_polar_view(clash, system, row, size) for clash in found]
    arrays = _clash_arrays(views, size)
    choice, order, paid = choose_carving(
        arrays,
        claims,
        weight[used].reshape(len(used), -1),
        size,
        _SPLITS,
        _IMPROVEMENTS if improve else 0,
    )
    gone = (before & ~claims.astype(bool)).reshape(-1, size, size, size) & material[used]
    lost, surface = nothing.copy(), nothing.copy()
    lost[used] = gone.mean(axis=(1, 2, 3))
    surface[used] = (gone & skin[used]).mean(axis=(1, 2, 3))
    low = np.array([view.low for view in views])
    # Where all rings give way, no radius is a bound.
    inner = np.where(choice[:, 0] == 0, 0.0, low + choice[:, 0] / size)
    outer = np.where(choice[:, 1] == arrays.rings, np.inf, low + choice[:, 1] / size)
    none = choice[:, 0] == choice[:, 1]
    bounds = np.where(none[:, None], 0.0, np.column_stack([inner, outer]))
    bad = [found[e] for e in order.tolist() if paid[e] >= HINGE_COST]
    return CarvingPlan(
        tuple(found[e] for e in order.tolist()),
        bounds[order],
        lost,
        surface,
        tuple(dict.fromkeys((m.first, m.second) for m in bad)),
        tuple(sorted({m.hinge for m in bad})),
    )


def carved_path(
    system: HingeSystem,
    material: NDArray[np.bool_],
    expansions: int = 2500,
    patience: int = 400,
    *,
    carve: float = CORE_HALF_SIDE,
) -> tuple[NDArray[np.int32], CarvingPlan] | None:
    """The path of cores that costs least to carve, of those that several searches find.

    Parameters
    ----------
    system : HingeSystem
        What folds, on whole cells.
    material : (n, s, s, s) bool array
        Material of each cell in shape A.
    expansions, patience : int
        Budget of each search, see :func:`fabfold.fold.lattice_planner.find_path`.
    carve : float
        Half the side of a cell's core, lattice units.

    Returns
    -------
    (path, CarvingPlan) or None
        The path as for :func:`plan_carving`; None where none is found that spares the hinges.
    """
    from fabfold.fold.lattice_planner import find_path

    best: tuple[NDArray[np.int32], CarvingPlan] | None = None
    seen: set[bytes] = set()
    for price in _PRICES:
        for tried in (patience, patience // 4):
            path = find_path(system, expansions, tried, carve=carve, price=price).path
            if path is None or path.tobytes() in seen:
                continue
            seen.add(path.tobytes())
            carving = plan_carving(system, path, material)
            if not carving.blocked and (best is None or carving.cost < best[1].cost - 1e-9):
                best = path, carving
    return best
