"""The tree search's input as plain arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import NoTreeError
from fabfold.lattice.rotations import FACES, ROTATION_PRODUCT, ROTATIONS, parity
from fabfold.lattice.template import Template
from fabfold.tree.catalogue import Joint, JointSet, joint_rows, ways
from fabfold.tree.sharing import WHOLE, beside, most_shared, octant_masks, seen_depths, turned_masks

if TYPE_CHECKING:
    from fabfold.voxels.features import Features
    from fabfold.voxels.voxel_model import Voxels

__all__ = [
    "Tables",
    "TreeProblem",
    "Weights",
    "cost_table",
    "from_features",
    "joint_table",
    "tree_problem",
]


@dataclass(frozen=True)
class Weights:
    """Weights of the energy (paper section 6)."""

    surface: float = 0.3
    rigid: float = 0.0
    single: float = 0.1
    double: float = 0.12


class Tables(NamedTuple):
    """What the kernels read. ``n`` voxels, ``m`` template cells, ``J`` joint types.

    A pose is ``24 * cell + rotation`` with ``cell`` an index into the template's cells.

    Attributes
    ----------
    neighbour : (n, 6) int32 array
        Voxel across each face, -1 where there is none or no joint is possible.
    allowed : (n, 6, J) bool array
        Whether a joint type can be made there.
    step : (6, J, 24 m) int32 array
        Pose of the child from the face, the joint and the parent's pose; -1 outside the template.
    weight : (J,) float64 array
        Energy of each joint type.
    single : int
        Joint types 1 to ``single`` are single hinges, those after them double ones.
    way_start : (6, J + 1) int32 array
        Joint j of face f is made by the rows ``way_start[f, j]`` to ``way_start[f, j + 1] - 1``
        of `way`.
    way : (w, 4) int32 array
        Side and quarter turns of both axes, see :func:`fabfold.tree.catalogue.ways`.
    cost : (n, 24 m) float32 array
        Weighted energy of each voxel at each pose: Eq. 8 of the faces that the box shows, and
        whatever else was asked for (see `bias` of :func:`tree_problem`).
    centre : (n, m) float32 array
        Expected `cost` of each voxel in each cell, subtracted while states of unlike cells are
        compared.
    stiff : (n, 6) bool array
        Pairs that no cut may part: both voxels must keep their relative pose. No rows where
        there is no such pair.
    hinged : (a, b, c) int32 array
        Lattice edges of the template by twice the middle plus 1: a number for the edge on which a
        hinge there comes to rest in the end, -1 where none may lie. Of no size where all may be
        used and rest where they are.
    exposed : (m,) uint8 array
        Bit ``f`` set where the template ends at face ``f`` of a cell.
    around : (m, 6) int32 array
        Template cell across each face, -1 outside.
    source : (n, 3) int32 array
    cells : (m, 3) int32 array
    rotations : (24, 3, 3) int32 array
    mask : (n, 24) uint8 array
        Eighths of its cell that a voxel must have in each rotation, see
        :mod:`fabfold.tree.sharing`; all 255 where no voxel may share.
    shares : int
        Most cells that may hold two voxels; 0 where none may.
    seen : (n, 24, 6, 4) float32 array
        Weighted ray depth of each quarter of each face, in each rotation; no rows where no voxel
        may share.
    beside : (6, 6) uint8 array
        Eighths beside the edge of two faces of a cell.
    """

    neighbour: NDArray[np.int32]
    allowed: NDArray[np.bool_]
    step: NDArray[np.int32]
    weight: NDArray[np.float64]
    single: int
    way_start: NDArray[np.int32]
    way: NDArray[np.int32]
    cost: NDArray[np.float32]
    centre: NDArray[np.float32]
    stiff: NDArray[np.bool_]
    hinged: NDArray[np.int32]
    exposed: NDArray[np.uint8]
    around: NDArray[np.int32]
    source: NDArray[np.int32]
    cells: NDArray[np.int32]
    rotations: NDArray[np.int32]
    mask: NDArray[np.uint8]
    shares: int
    seen: NDArray[np.float32]
    beside: NDArray[np.uint8]


@dataclass(frozen=True)
class TreeProblem:
    """Voxels, the joints they allow, and the template they shall fill.

    Attributes
    ----------
    template : Template
    source : (n, 3) int32 array
        Cells in shape A.
    fill : (n,) float64 array
        Share of each cell that is material.
    weights : Weights
    joints : tuple of J tuples of 6 Joint
        Joint types by index, one for each face of the parent; index 0 is the rigid joint.
    tables : Tables
    bias : (n, 24 m) float32 array or None
        What was added to the surface's energy of each voxel at each pose.
    roots : (k, 2) int32 array or None
        Voxels and their poses that growing may start from; None for all.
    """

    template: Template
    source: NDArray[np.int32]
    fill: NDArray[np.float64]
    weights: Weights
    joints: tuple[tuple[Joint, ...], ...]
    tables: Tables
    bias: NDArray[np.float32] | None = None
    roots: NDArray[np.int32] | None = None

    def __len__(self) -> int:
        return len(self.source)

    def wished(self, pose: NDArray[np.int32]) -> float:
        """The part of the energy of a full set of poses that is `bias`."""
        if self.bias is None:
            return 0.0
        return float(self.bias[np.arange(len(pose)), pose].sum(dtype=np.float64))

    @property
    def empty_face(self) -> float:
        """Weighted surface energy of one boundary face of an empty template cell."""
        return self.weights.surface

    @cached_property
    def single_tables(self) -> Tables:
        """The tables without double hinges."""
        tables, last = self.tables, self.tables.single + 1
        if last == len(self.joints):
            return tables
        return tables._replace(
            allowed=np.ascontiguousarray(tables.allowed[:, :, :last]),
            step=np.ascontiguousarray(tables.step[:, :last]),
            weight=tables.weight[:last].copy(),
            way_start=np.ascontiguousarray(tables.way_start[:, : last + 1]),
        )

    def shareable(self, colour: NDArray[np.integer]) -> tuple[int, int]:
        """Most pairs of voxels of each colour that may share a cell."""
        partial = self.tables.mask[:, 0] != WHOLE
        pairs = [int((partial & (colour == c)).sum()) // 2 for c in (0, 1)]
        return min(pairs[0], self.tables.shares), min(pairs[1], self.tables.shares)

    @property
    def keeps_colour(self) -> bool:
        """Whether every joint in use keeps the checkerboard colour of a cell."""
        return all(sum(joint.offset) % 2 for by_face in self.joints for joint in by_face)

    def colourings(self) -> list[int]:
        """Colours (0, 1) of template cells that voxels of source colour 0 can take.

        Rigid joints, 180° single hinges and double hinges onto a face neighbour keep the
        checkerboard colouring; where other joints are in use, every cell can be taken.

        Raises
        ------
        NoTreeError
            If the colours of the voxels fit into the template in neither way.
        """
        if not self.keeps_colour:
            return [0, 1]
        colour = parity(self.source)
        odd = int(colour.sum())
        voxels = (len(self.source) - odd, odd)
        cells = self.template.colours
        # Two voxels that share a cell are of one colour.
        spare = self.shareable(colour)
        short = [(voxels[0] - cells[c], voxels[1] - cells[1 - c]) for c in (0, 1)]
        fits = [
            c
            for c, (first, second) in enumerate(short)
            if first <= spare[0]
            and second <= spare[1]
            and max(first, 0) + max(second, 0) <= self.tables.shares
        ]
        if not fits:
            raise NoTreeError(
                f"the voxels have {voxels[0]} cells of one checkerboard colour and {voxels[1]} of "
                f"the other, template {self.template.name!r} has {cells[0]} and {cells[1]}: hinges "
                "keep the colour of a cell, so no tree fits; take another voxelization, a template "
                "with room for both colours, or all joints"
            )
        return fits


def joint_table(
    template: Template, joints: Sequence[Sequence[Joint]]
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.uint8]]:
    """Where joints carry a child, for every pose of the parent.

    Returns
    -------
    step : (6, J, 24 m) int32 array
    around : (m, 6) int32 array
    exposed : (m,) uint8 array
        As in :class:`Tables`.
    """
    cells = template.cells
    pad = 2
    grid = np.full(np.array(template.shape) + 2 * pad, -1, dtype=np.int32)
    grid[tuple((cells + pad).T)] = np.arange(len(cells), dtype=np.int32)
    step = np.full((6, len(joints), 24 * len(cells)), -1, dtype=np.int32)
    parents = 24 * np.arange(len(cells), dtype=np.int32)
    for index, by_face in enumerate(joints):
        for face, joint in enumerate(by_face):
            for rotation in range(24):
                moved = cells + ROTATIONS[rotation] @ np.array(joint.offset, dtype=np.int32) + pad
                landing = grid[tuple(moved.T)]
                turned = ROTATION_PRODUCT[rotation, joint.rotation]
                step[face, index, parents + rotation] = np.where(
                    landing >= 0, 24 * landing + turned, -1
                )
    around = np.stack([grid[tuple((cells + d + pad).T)] for d in FACES], axis=1)
    exposed = ((around < 0) << np.arange(6)).sum(axis=1).astype(np.uint8)
    return step, np.ascontiguousarray(around), exposed


def _way_table(
    joints: Sequence[Sequence[Joint]],
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    found: list[tuple[int, int, int, int]] = []
    start = np.zeros((6, len(joints) + 1), dtype=np.int32)
    for face in range(6):
        for index, by_face in enumerate(joints):
            start[face, index] = len(found)
            found += ways(by_face[face])
        start[face, len(joints)] = len(found)
    return start, np.array(found, dtype=np.int32).reshape(-1, 4)


def cost_table(
    depth: NDArray[np.float64],
    exposed: NDArray[np.uint8],
    weight: float,
    bias: NDArray[np.floating] | None,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """``Tables.cost`` and ``Tables.centre`` of voxels with ray depths (n, 6)."""
    # Face f of the cell in B is face turned[r, f] of the voxel in A.
    turned = np.array(
        [[int(np.flatnonzero((d @ r == FACES).all(axis=1))[0]) for d in FACES] for r in ROTATIONS]
    )
    bits = (exposed[:, None] >> np.arange(6)) & 1
    by_face = np.asarray(depth, dtype=float)[:, turned]
    cost = weight * np.einsum("nrf,mf->nmr", by_face, bits)
    if bias is not None:
        cost += np.asarray(bias, dtype=float).reshape(cost.shape)
    by_cell = cost.mean(axis=2)
    cell_mean = by_cell.mean(axis=0)
    voxel_mean = (by_cell - cell_mean).mean(axis=1)
    centre = cell_mean[None, :] + voxel_mean[:, None]
    return (
        np.ascontiguousarray(cost.reshape(len(cost), -1), dtype=np.float32),
        np.ascontiguousarray(centre, dtype=np.float32),
    )


def tree_problem(
    cells: NDArray[np.int32],
    template: Template,
    *,
    pairs: NDArray[np.int32],
    rigid: NDArray[np.bool_],
    hinge: NDArray[np.bool_],
    depth: NDArray[np.float64],
    fill: NDArray[np.float64] | None = None,
    weights: Weights | None = None,
    bias: NDArray[np.floating] | None = None,
    stiff: NDArray[np.bool_] | None = None,
    double: NDArray[np.bool_] | None = None,
    joints: JointSet = "S",
    share: NDArray[np.bool_] | None = None,
) -> TreeProblem:
    """Problem from plain arrays; :func:`from_features` takes the voxel stage's results.

    Parameters
    ----------
    cells : (n, 3) int array
        Source cells.
    template : Template
    pairs : (k, 2) int array
        Voxels ``i, j`` that share a face.
    rigid : (k,) bool array
        Whether the pair can be one printed piece.
    hinge : (k, 4) bool array
        Whether each edge of the shared face can hold a single hinge, in the order of
        :func:`fabfold.tree.catalogue.edge_sides`.
    depth : (n, 6) float array
        Mean ray depth into each voxel from each of its faces, 0 to 1 (Eq. 8).
    fill : (n,) float array, optional
        Share of each cell that is material.
    weights : Weights, optional
    bias : (n, 24 m) float array, optional
        Energy added for a voxel at a pose, on top of the surface's.
    stiff : (k,) bool array, optional
        Pairs that no cut may part; `rigid` must hold for them.
    double : (k,) bool array, optional
        Whether the shared face has room for the link plate of a double hinge; by default none has.
    joints : str
        Joint types in use, see :data:`fabfold.tree.catalogue.JOINT_SETS`.
    share : (n, s, s, s) bool array, optional
        Material in each cell: two voxels may take one template cell where their eighths allow it.
        Without it every voxel has a cell of its own.

    Raises
    ------
    NoTreeError
        If there are more voxels than template cells, or no tree can join the voxels at all.
    """
    weights = weights or Weights()
    cells = np.asarray(cells, dtype=np.int32).reshape(-1, 3)
    count = len(cells)
    masks = np.full(count, WHOLE, np.uint8) if share is None else octant_masks(share)
    shares = 0 if share is None else min(most_shared(count), int((masks != WHOLE).sum()) // 2)
    if count == 0 or count > len(template) + shares:
        raise NoTreeError(
            f"{count} voxels cannot go into template {template.name!r} of {len(template)} cells: "
            "take a larger template or a coarser grid"
        )
    rows = joint_rows(joints)
    step, around, exposed = joint_table(template, rows)
    way_start, way = _way_table(rows)
    singles = sum(by_face[0].kind == "S" for by_face in rows)
    roomy = np.zeros(len(pairs), dtype=bool) if double is None else np.asarray(double, dtype=bool)
    neighbour = np.full((count, 6), -1, dtype=np.int32)
    allowed = np.zeros((count, 6, len(rows)), dtype=bool)
    for (i, j), solid, edges, plate in zip(pairs, rigid, hinge, roomy, strict=True):
        face = int(np.flatnonzero((cells[j] - cells[i] == FACES).all(axis=1))[0])
        # Both faces list the same edges in the same order, so one row serves either parent.
        for parent, child, side in ((i, j, face), (j, i, face ^ 1)):
            allowed[parent, side, 0] = solid
            allowed[parent, side, 1 : singles + 1] = np.tile(edges, singles // 4)
            allowed[parent, side, singles + 1 :] = plate
            if allowed[parent, side].any():
                neighbour[parent, side] = child
    _require_connected(neighbour)
    cost, centre = cost_table(depth, exposed, weights.surface, bias)
    whole = np.zeros((count, 6), dtype=bool)
    if stiff is not None and np.any(stiff):
        for i, j in np.asarray(pairs)[np.asarray(stiff, dtype=bool)].tolist():
            face = int(np.flatnonzero((cells[j] - cells[i] == FACES).all(axis=1))[0])
            whole[i, face] = whole[j, face ^ 1] = True
            allowed[i, face, 1:] = allowed[j, face ^ 1, 1:] = False
    hinged = np.zeros((0, 0, 0), dtype=np.int32)
    if template.joints == "inside":
        inside = template.inside_edges()
        number = np.arange(inside.size, dtype=np.int32).reshape(inside.shape)
        hinged = np.where(inside, number, np.int32(-1))
    tables = Tables(
        neighbour=neighbour,
        allowed=allowed,
        step=step,
        weight=np.array(
            [
                {"R": weights.rigid, "S": weights.single, "D": weights.double}[r[0].kind]
                for r in rows
            ]
        ),
        single=singles,
        way_start=way_start,
        way=way,
        cost=cost,
        centre=centre,
        stiff=whole if whole.any() else whole[:0],
        hinged=hinged,
        exposed=exposed,
        around=around,
        source=cells,
        # A template's own cells are read-only, which would be another signature to the kernels.
        cells=template.cells.copy(),
        rotations=ROTATIONS,
        mask=turned_masks(masks) if shares else np.full((count, 24), WHOLE, np.uint8),
        shares=shares,
        seen=(
            seen_depths(share, weights.surface)
            if shares and share is not None
            else np.zeros((0, 24, 6, 4), np.float32)
        ),
        beside=beside().copy(),
    )
    return TreeProblem(
        template=template,
        source=cells,
        fill=np.ones(count) if fill is None else np.asarray(fill, dtype=float),
        weights=weights,
        joints=rows,
        tables=tables,
        bias=None if bias is None else np.asarray(bias, dtype=np.float32).reshape(count, -1),
    )


def from_features(
    voxels: Voxels,
    features: Features,
    template: Template,
    weights: Weights | None = None,
    *,
    bias: NDArray[np.floating] | None = None,
    stiff: NDArray[np.bool_] | None = None,
    joints: JointSet = "S",
    share: bool = False,
) -> TreeProblem:
    """Problem from a voxelization, its printable joints and a template.

    Parameters
    ----------
    voxels, features, template, weights
    bias : (n, 24 m) float array, optional
    stiff : (k,) bool array, optional
        See :func:`tree_problem`; ``k`` are the pairs of `features`.
    joints : str
        Joint types in use, see :data:`fabfold.tree.catalogue.JOINT_SETS`.
    share : bool
        Whether two voxels may take one cell where their material allows it.

    Raises
    ------
    NoTreeError
        As for :func:`tree_problem`.
    """
    return tree_problem(
        voxels.cells,
        template,
        pairs=features.pairs,
        rigid=features.rigid,
        hinge=features.hinge,
        depth=features.depth,
        fill=voxels.fill,
        weights=weights,
        bias=bias,
        stiff=stiff,
        double=features.double,
        joints=joints,
        share=voxels.subvoxels if share else None,
    )


def _require_connected(neighbour: NDArray[np.int32]) -> None:
    seen = np.zeros(len(neighbour), dtype=bool)
    seen[0] = True
    queue = [0]
    while queue:
        for other in neighbour[queue.pop()].tolist():
            if other >= 0 and not seen[other]:
                seen[other] = True
                queue.append(other)
    if not seen.all():
        raise NoTreeError(
            f"{int((~seen).sum())} of {len(seen)} voxels (first: number "
            f"{int(np.flatnonzero(~seen)[0])}) have no printable joint to the others: take "
            "another voxelization, or a larger voxel"
        )
