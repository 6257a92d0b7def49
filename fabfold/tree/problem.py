"""The input of the tree search: voxels, printable joints and template as plain arrays.

:func:`from_features` makes a :class:`TreeProblem` from the voxel stage's results. Its
:class:`Tables` are what the compiled kernels read.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import NoTreeError
from fabfold.lattice.rotations import (
    FACES,
    ROTATIONS,
    parity,
)
from fabfold.lattice.template import Template
from fabfold.tree.catalogue import Joint, JointSet, joint_types
from fabfold.tree.sharing import (
    WHOLE,
    edge_octants,
    max_shared_cells,
    octant_masks,
    quarter_depths,
    turned_masks,
)
from fabfold.tree.tables import Tables, cost_table, joint_table, realization_table

if TYPE_CHECKING:
    from fabfold.voxels.features import Features
    from fabfold.voxels.voxel_model import Voxels

__all__ = [
    "TreeProblem",
    "Weights",
    "from_features",
    "tree_problem",
]


@dataclass(frozen=True)
class Weights:
    """Weights of the energy (paper section 6).

    Attributes
    ----------
    surface : float
        Weight of the surface's energy (Eq. 8), the sum of mean ray depths.
    single : float
        Weight of a single hinge (Eq. 9).
    double : float
        Weight of a double hinge (Eq. 9).
    rigid : float
        Weight of a rigid joint.
    """

    surface: float
    single: float
    double: float
    rigid: float = 0.0


@dataclass(frozen=True)
class TreeProblem:
    """Voxels, the joints they allow, and the template they shall fill.

    Attributes
    ----------
    template : Template
        The shape to fill.
    source : (n, 3) int32 array
        Cell of each voxel in shape A.
    fill : (n,) float64 array
        Share of each cell that is material, 0 to 1.
    weights : Weights
        Weights of the energy.
    joints : tuple of J tuples of 6 Joint
        Joint types by index, one for each face of the parent; index 0 is the rigid joint.
    tables : Tables
        What the kernels read.
    extra_cost : (n, 24 m) float32 array or None
        Energy that was added to the surface's for each voxel at each pose.
    roots : (k, 2) int32 array or None
        Voxels, and their poses, that growing may start from; None for all.
    """

    template: Template
    source: NDArray[np.int32]
    fill: NDArray[np.float64]
    weights: Weights
    joints: tuple[tuple[Joint, ...], ...]
    tables: Tables
    extra_cost: NDArray[np.float32] | None = None
    roots: NDArray[np.int32] | None = None

    def __len__(self) -> int:
        return len(self.source)

    def extra_energy(self, pose: NDArray[np.int32]) -> float:
        """The part of the energy that is `extra_cost`.

        Parameters
        ----------
        pose : (n,) int32 array
            Full set of poses, ``24 * template cell + rotation``.

        Returns
        -------
        float
            Weighted energy; 0 where nothing was added.
        """
        if self.extra_cost is None:
            return 0.0
        return float(self.extra_cost[np.arange(len(pose)), pose].sum(dtype=np.float64))

    @property
    def empty_face(self) -> float:
        """Weighted surface energy of one boundary face of an empty template cell."""
        return self.weights.surface

    @cached_property
    def single_tables(self) -> Tables:
        """The tables without double hinges."""
        tables, last = self.tables, self.tables.last_single + 1
        if last == len(self.joints):
            return tables
        return tables._replace(
            allowed=np.ascontiguousarray(tables.allowed[:, :, :last]),
            child_pose=np.ascontiguousarray(tables.child_pose[:, :, :last]),
            joint_weight=tables.joint_weight[:last].copy(),
            realization_start=np.ascontiguousarray(tables.realization_start[:, : last + 1]),
        )

    def shareable(self, colour: NDArray[np.integer]) -> tuple[int, int]:
        """Most pairs of voxels of each colour that may share a cell.

        Parameters
        ----------
        colour : (n,) int array
            Checkerboard colour of each voxel, 0 or 1.

        Returns
        -------
        (int, int)
            Pairs of colour 0, and of colour 1.
        """
        partial = self.tables.octant_mask[:, 0] != WHOLE
        pairs = [int((partial & (colour == c)).sum()) // 2 for c in (0, 1)]
        return min(pairs[0], self.tables.max_shared), min(pairs[1], self.tables.max_shared)

    @property
    def keeps_colour(self) -> bool:
        """Whether every joint in use keeps the checkerboard colour of a cell."""
        return all(sum(joint.offset) % 2 for by_face in self.joints for joint in by_face)

    def colourings(self) -> list[int]:
        """Checkerboard colours of template cells that voxels of source colour 0 can take.

        Rigid joints, 180° single hinges and double hinges onto a face neighbour keep the
        checkerboard colouring; where other joints are in use, every cell can be taken.

        Returns
        -------
        list of int
            0, 1 or both.

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
            and max(first, 0) + max(second, 0) <= self.tables.max_shared
        ]
        if not fits:
            raise NoTreeError(
                f"the voxels have {voxels[0]} cells of one checkerboard colour and {voxels[1]} of "
                f"the other, template {self.template.name!r} has {cells[0]} and {cells[1]}: hinges "
                "keep the colour of a cell, so no tree fits; take another voxelization, a template "
                "with room for both colours, or all joints"
            )
        return fits


def tree_problem(
    cells: NDArray[np.int32],
    template: Template,
    *,
    pairs: NDArray[np.int32],
    rigid: NDArray[np.bool_],
    hinge: NDArray[np.bool_],
    depth: NDArray[np.float64],
    weights: Weights,
    fill: NDArray[np.float64] | None = None,
    extra_cost: NDArray[np.floating] | None = None,
    always_rigid: NDArray[np.bool_] | None = None,
    double: NDArray[np.bool_] | None = None,
    joints: JointSet = "S",
    share: NDArray[np.bool_] | None = None,
) -> TreeProblem:
    """Problem from plain arrays; :func:`from_features` takes the voxel stage's results.

    Parameters
    ----------
    cells : (n, 3) int array
        Cell of each voxel in shape A.
    template : Template
        The shape to fill.
    pairs : (k, 2) int array
        Voxels ``i, j`` that share a face.
    rigid : (k,) bool array
        Whether the pair can be one printed piece.
    hinge : (k, 4) bool array
        Whether each edge of the shared face can hold a single hinge, in the order of
        :func:`fabfold.tree.catalogue.edge_sides`.
    depth : (n, 6) float array
        Mean ray depth into each voxel from each of its faces, 0 to 1 (Eq. 8).
    weights : Weights
        Weights of the energy.
    fill : (n,) float array, optional
        Share of each cell that is material.
    extra_cost : (n, 24 m) float array, optional
        Energy added for a voxel at a pose, on top of the surface's.
    always_rigid : (k,) bool array, optional
        Pairs that no cut may part; `rigid` must hold for them.
    double : (k,) bool array, optional
        Whether the shared face has room for the link plate of a double hinge; by default none has.
    joints : str
        Joint types in use, see :data:`fabfold.tree.catalogue.JOINT_SETS`.
    share : (n, s, s, s) bool array, optional
        Material in each cell: two voxels may take one template cell where their eighths allow it.
        Without it every voxel has a cell of its own.

    Returns
    -------
    TreeProblem
        What :func:`fabfold.tree.solve.solve` takes.

    Raises
    ------
    NoTreeError
        If there are more voxels than template cells, or no tree can join the voxels at all.
    """
    cells = np.asarray(cells, dtype=np.int32).reshape(-1, 3)
    count = len(cells)
    masks = np.full(count, WHOLE, np.uint8) if share is None else octant_masks(share)
    max_shared = (
        0 if share is None else min(max_shared_cells(count), int((masks != WHOLE).sum()) // 2)
    )
    if count == 0 or count > len(template) + max_shared:
        raise NoTreeError(
            f"{count} voxels cannot go into template {template.name!r} of {len(template)} cells: "
            "take a larger template or a coarser grid"
        )
    rows = joint_types(joints)
    child_pose, cell_neighbour, exposed = joint_table(template, rows)
    realization_start, realization = realization_table(rows)
    last_single = sum(by_face[0].kind == "S" for by_face in rows)
    has_plate_room = (
        np.zeros(len(pairs), dtype=bool) if double is None else np.asarray(double, dtype=bool)
    )
    neighbour = np.full((count, 6), -1, dtype=np.int32)
    allowed = np.zeros((count, 6, len(rows)), dtype=bool)
    for (i, j), solid, edges, plate in zip(pairs, rigid, hinge, has_plate_room, strict=True):
        face = int(np.flatnonzero((cells[j] - cells[i] == FACES).all(axis=1))[0])
        # Both faces list the same edges in the same order, so one row serves either parent.
        for parent, child, side in ((i, j, face), (j, i, face ^ 1)):
            allowed[parent, side, 0] = solid
            allowed[parent, side, 1 : last_single + 1] = np.tile(edges, last_single // 4)
            allowed[parent, side, last_single + 1 :] = plate
            if allowed[parent, side].any():
                neighbour[parent, side] = child
    _require_connected(neighbour)
    cost, expected_cost = cost_table(depth, exposed, weights.surface, extra_cost)
    rigid_faces = np.zeros((count, 6), dtype=bool)
    if always_rigid is not None and np.any(always_rigid):
        for i, j in np.asarray(pairs)[np.asarray(always_rigid, dtype=bool)].tolist():
            face = int(np.flatnonzero((cells[j] - cells[i] == FACES).all(axis=1))[0])
            rigid_faces[i, face] = rigid_faces[j, face ^ 1] = True
            allowed[i, face, 1:] = allowed[j, face ^ 1, 1:] = False
    final_edge = np.zeros((0, 0, 0), dtype=np.int32)
    if template.joints == "inside":
        inside = template.inside_edges()
        number = np.arange(inside.size, dtype=np.int32).reshape(inside.shape)
        final_edge = np.where(inside, number, np.int32(-1))
    tables = Tables(
        neighbour=neighbour,
        allowed=allowed,
        child_pose=child_pose,
        joint_weight=np.array(
            [
                {"R": weights.rigid, "S": weights.single, "D": weights.double}[r[0].kind]
                for r in rows
            ]
        ),
        last_single=last_single,
        realization_start=realization_start,
        realization=realization,
        cost=cost,
        expected_cost=expected_cost,
        always_rigid=rigid_faces if rigid_faces.any() else rigid_faces[:0],
        final_edge=final_edge,
        exposed=exposed,
        cell_neighbour=cell_neighbour,
        source=cells,
        # A template's own cells are read-only, which would be another signature to the kernels.
        cells=template.cells.copy(),
        rotations=ROTATIONS,
        octant_mask=turned_masks(masks) if max_shared else np.full((count, 24), WHOLE, np.uint8),
        max_shared=max_shared,
        quarter_depth=(
            quarter_depths(share, weights.surface)
            if max_shared and share is not None
            else np.zeros((0, 24, 6, 4), np.float32)
        ),
        edge_octants=edge_octants().copy(),
    )
    return TreeProblem(
        template=template,
        source=cells,
        fill=np.ones(count) if fill is None else np.asarray(fill, dtype=float),
        weights=weights,
        joints=rows,
        tables=tables,
        extra_cost=None
        if extra_cost is None
        else np.asarray(extra_cost, dtype=np.float32).reshape(count, -1),
    )


def from_features(
    voxels: Voxels,
    features: Features,
    template: Template,
    weights: Weights,
    *,
    extra_cost: NDArray[np.floating] | None = None,
    always_rigid: NDArray[np.bool_] | None = None,
    joints: JointSet = "S",
    share: bool = False,
) -> TreeProblem:
    """Problem from a voxelization, its printable joints and a template.

    Parameters
    ----------
    voxels : Voxels
        The voxelization.
    features : Features
        Its printable joints and ray depths.
    template : Template
        The shape to fill.
    weights : Weights
        Weights of the energy.
    extra_cost : (n, 24 m) float array, optional
        Energy added for a voxel at a pose, on top of the surface's.
    always_rigid : (k,) bool array, optional
        Which of the k pairs of `features` no cut may part.
    joints : str
        Joint types in use, see :data:`fabfold.tree.catalogue.JOINT_SETS`.
    share : bool
        Whether two voxels may take one cell where their material allows it.

    Returns
    -------
    TreeProblem
        What :func:`fabfold.tree.solve.solve` takes.

    Raises
    ------
    NoTreeError
        If there are more voxels than template cells, or no tree can join the voxels at all.
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
        extra_cost=extra_cost,
        always_rigid=always_rigid,
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
