"""Struts: bars that make one printable piece out of what the cut left of a body.

A cell may hold several pieces of material (two legs), the material of two rigidly joined cells may
meet in a neck too thin to hold, and a hinge's bracket may stand where its cell has no material. The
paper put struts in by hand; here a strut is laid along the shortest path through the body's own
cells that prefers existing material.

The path is found on the grid of subvoxels. A grid point is *free* if it lies in the body's eroded
cells outside every groove and hinge cutout, *solid* if material is there, and *core* if a cube of
two by two by two points about it lies in the material: two parts that are connected through core
points are joined by a neck of a tenth of a voxel or more. What must be connected are *terminals*,
as in a Steiner tree; the nearest terminal is joined first.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.joinery.cells import occupancy

if TYPE_CHECKING:
    import manifold3d

__all__ = ["BodyGrid", "Strut", "grid_over", "plan_struts", "strut_solid"]

#: Grid points along the side of a voxel.
RESOLUTION = 20
#: Cost of a step through air; a step through material costs 1.
_AIR_COST = 6.0
#: Added cost of a step beside the wall of the free space, where a strut would be trimmed.
_WALL_COST = 15.0
#: Added cost of a step at the wall of the free space; it falls with the depth below the wall.
_DEPTH_COST = 3.0
#: Core parts smaller than this many points are no terminals (a 64th of a cell).
_LEAST_CORE = RESOLUTION**3 // 64
#: One of each two opposite steps to the 26 neighbours of a grid point.
_HALF_NEIGHBOURS = [
    (dx, dy, dz)
    for dx in (-1, 0, 1)
    for dy in (-1, 0, 1)
    for dz in (-1, 0, 1)
    if (dx, dy, dz) > (0, 0, 0)
]

Bools = NDArray[np.bool_]
Strut = NDArray[np.float64]
"""Corners of a strut's middle line in mm, shape (k, 3)."""


@dataclass(frozen=True)
class BodyGrid:
    """The points of a regular grid over the cells of one body.

    Attributes
    ----------
    corner : (3,) float64 array
        First grid point in mm.
    pitch : float
        Spacing of the points in mm.
    cell : (x, y, z) int32 array
        Index into the body's cells of the cell that holds each point, -1 outside.
    """

    corner: NDArray[np.float64]
    pitch: float
    cell: NDArray[np.int32]

    def sample(self, solid: manifold3d.Manifold) -> Bools:
        """Which grid points lie in a solid."""
        x, y, z = self.cell.shape
        return occupancy(solid, self.corner, self.pitch, (x, y, z))

    def points(self, nodes: NDArray[np.int64]) -> NDArray[np.float64]:
        """Coordinates in mm of grid points given by flat index."""
        index = np.stack(np.unravel_index(nodes, self.cell.shape), axis=-1)
        return np.asarray(self.corner + self.pitch * index, dtype=np.float64)


def grid_over(cells: NDArray[np.int32], voxel_mm: float) -> BodyGrid:
    """Grid of subvoxel centres over the bounding box of a body's cells.

    Parameters
    ----------
    cells : (m, 3) int32 array
        Cells of the body, lattice units.
    voxel_mm : float
        Side of a voxel in mm.

    Returns
    -------
    BodyGrid
        With `RESOLUTION` points along the side of a voxel.
    """
    low = cells.min(axis=0)
    shape = (cells.max(axis=0) - low + 1) * RESOLUTION
    owner = np.full(tuple(shape), -1, dtype=np.int32)
    for index, cell in enumerate(cells - low):
        x, y, z = cell * RESOLUTION
        owner[x : x + RESOLUTION, y : y + RESOLUTION, z : z + RESOLUTION] = index
    pitch = voxel_mm / RESOLUTION
    return BodyGrid((low - 0.5) * voxel_mm + pitch / 2, pitch, owner)


def plan_struts(
    grid: BodyGrid, free: Callable[[], Bools], pieces: list[Bools], brackets: list[Bools]
) -> list[Strut] | None:
    """Struts that tie all pieces, brackets and cells of a body together.

    Parameters
    ----------
    grid : BodyGrid
        The grid over the body's cells.
    free : callable
        Gives the (x, y, z) bool array of where a strut may run; called only when one is needed.
    pieces : list of (x, y, z) bool arrays
        Grid points in each separate piece of the material.
    brackets : list of (x, y, z) bool arrays
        Grid points in each hinge half.

    Returns
    -------
    list of (k, 3) float64 arrays, or None
        Corners of the middle line of each strut in mm; None if no way leads from one part to
        another.
    """
    from scipy import ndimage

    label = _core_parts(pieces)
    terminals = _terminals(grid, label, pieces, brackets)
    if len(terminals) < 2:
        return []
    # Terminals in the same core part are connected already.
    groups = _merge_by_core(terminals, label)
    if len(groups) < 2:
        return []
    solid = np.logical_or.reduce(pieces)
    paths = _GridPaths(free(), solid)
    inner = ndimage.binary_erosion(solid, np.ones((3, 3, 3), dtype=bool)).reshape(-1)
    struts: list[Strut] = []
    while len(groups) > 1:
        path = paths.shortest(
            _inner_points(groups[0], inner), [_inner_points(g, inner) for g in groups[1:]]
        )
        if path is None:
            return None
        nodes, reached = path
        struts.append(grid.points(paths.straightened(nodes)))
        joined = groups.pop(reached + 1)
        groups[0] = np.unique(np.concatenate([groups[0], joined, nodes]))
    return struts


def _core_parts(pieces: list[Bools]) -> NDArray[np.int32]:
    """Number, from 1, of the core part that each grid point belongs to; 0 outside.

    A core part is a connected set of points that belong to a cube of two by two by two points in
    one piece of the material. Pieces are taken one by one: the gap between two of them may be too
    narrow for the grid to show.
    """
    from scipy import ndimage

    cube = np.ones((2, 2, 2), dtype=bool)
    parts = np.zeros(pieces[0].shape, dtype=np.int32)
    count = 0
    for piece in pieces:
        label, found = ndimage.label(ndimage.binary_opening(piece, cube))
        parts = np.where(label > 0, label + count, parts)
        count += found
    return parts


def _terminals(
    grid: BodyGrid, label: NDArray[np.int32], pieces: list[Bools], brackets: list[Bools]
) -> list[NDArray[np.int64]]:
    """Flat point indices of every part that must be connected to the others.

    These are the hinge brackets, the pieces and what fills each cell most, each by the core part
    that holds most of it: a piece of two lumps with a thread between them must not make the lumps
    one. Of a part without any core (a thin blade) all points are taken.
    """
    flat_label, flat_cell = label.reshape(-1), grid.cell.reshape(-1)
    found = []
    for part in [*brackets, *pieces]:
        nodes = np.flatnonzero(part)
        labels = flat_label[nodes]
        if (labels > 0).any():
            nodes = nodes[labels == np.bincount(labels[labels > 0]).argmax()]
        if len(nodes):
            found.append(nodes)
    for cell in range(int(grid.cell.max()) + 1):
        inside = np.flatnonzero((flat_cell == cell) & (flat_label > 0))
        if len(inside) == 0:
            continue
        sizes = np.bincount(flat_label[inside])
        largest = int(sizes.argmax())
        if sizes[largest] >= _LEAST_CORE:
            found.append(inside[flat_label[inside] == largest])
    return found


def _merge_by_core(
    terminals: list[NDArray[np.int64]], label: NDArray[np.int32]
) -> list[NDArray[np.int64]]:
    """Unite terminals that lie in the same core part, or share points where they have none."""
    import networkx as nx

    flat = label.reshape(-1)
    graph = nx.Graph()
    graph.add_nodes_from(range(len(terminals)))
    owner: dict[tuple[str, int], int] = {}
    for index, nodes in enumerate(terminals):
        parts = flat[nodes]
        if (parts > 0).any():
            keys = [("core", int(parts.max()))]
        else:
            keys = [("point", int(node)) for node in nodes]
        for key in keys:
            if key in owner:
                graph.add_edge(owner[key], index)
            else:
                owner[key] = index
    groups = []
    for members in sorted((sorted(c) for c in nx.connected_components(graph)), key=lambda c: c[0]):
        groups.append(np.unique(np.concatenate([terminals[i] for i in members])))
    return sorted(groups, key=len, reverse=True)


def _inner_points(nodes: NDArray[np.int64], inner: NDArray[np.bool_]) -> NDArray[np.int64]:
    """The points of a part that lie a grid step inside it; all of them for a thin part."""
    chosen = nodes[inner[nodes]]
    return chosen if len(chosen) else nodes


class _GridPaths:
    """Shortest paths on the grid, through material where possible."""

    def __init__(self, free: Bools, solid: Bools) -> None:
        from scipy import ndimage, sparse

        self.shape = free.shape
        passable = free | solid
        roomy = ndimage.binary_erosion(passable, np.ones((3, 3, 3), dtype=bool))
        depth = ndimage.distance_transform_cdt(np.pad(passable, 1), metric="chessboard")
        cost = np.where(solid, 1.0, _AIR_COST) + np.where(roomy, 0.0, _WALL_COST)
        # Of equal paths, the one in the middle of the room.
        cost = cost + _DEPTH_COST / depth[1:-1, 1:-1, 1:-1].clip(1)
        self.passable, self.roomy = passable, roomy
        number = np.full(self.shape, -1, dtype=np.int64)
        self.nodes = np.flatnonzero(passable)
        number.reshape(-1)[self.nodes] = np.arange(len(self.nodes))
        self.number = number.reshape(-1)
        rows, columns, weights = [], [], []
        for offset in _HALF_NEIGHBOURS:
            extent = list(zip(offset, self.shape, strict=True))
            here = tuple(slice(max(0, -d), s - max(0, d)) for d, s in extent)
            there = tuple(slice(max(0, d), s - max(0, -d)) for d, s in extent)
            both = passable[here] & passable[there]
            rows.append(number[here][both])
            columns.append(number[there][both])
            length = float(np.linalg.norm(offset))
            weights.append(length * (cost[here][both] + cost[there][both]) / 2)
        count = len(self.nodes)
        self.graph = sparse.coo_matrix(
            (np.concatenate(weights), (np.concatenate(rows), np.concatenate(columns))),
            shape=(count, count),
        ).tocsr()

    def shortest(
        self, start: NDArray[np.int64], ends: list[NDArray[np.int64]]
    ) -> tuple[NDArray[np.int64], int] | None:
        """Cheapest path from one part to the nearest of several others, by Dijkstra's algorithm.

        Parameters
        ----------
        start : (n,) int64 array
            Flat grid indices of the part.
        ends : list of (m,) int64 arrays
            Flat grid indices of the others.

        Returns
        -------
        nodes : (k,) int64 array
            Flat grid indices along the path.
        reached : int
            Index of the part in `ends` where it ends.
        """
        from scipy.sparse.csgraph import dijkstra

        sources = self.number[start]
        distance, before, _ = dijkstra(
            self.graph,
            directed=False,
            indices=sources[sources >= 0],
            min_only=True,
            return_predecessors=True,
        )
        best: tuple[float, int, int] | None = None
        for index, end in enumerate(ends):
            numbers = self.number[end]
            numbers = numbers[numbers >= 0]
            if len(numbers) == 0:
                continue
            nearest = int(numbers[np.argmin(distance[numbers])])
            if np.isfinite(distance[nearest]) and (
                best is None or distance[nearest] < best[0] - 1e-9
            ):
                best = (float(distance[nearest]), index, nearest)
        if best is None:
            return None
        path = [best[2]]
        while before[path[-1]] >= 0:
            path.append(int(before[path[-1]]))
        return self.nodes[np.array(path[::-1])], best[1]

    def straightened(self, nodes: NDArray[np.int64]) -> NDArray[np.int64]:
        """Corner points of a path with as few corners as line of sight allows."""
        index = np.stack(np.unravel_index(nodes, self.shape), axis=-1)
        kept = [0]
        while kept[-1] < len(nodes) - 1:
            here = kept[-1]
            step = next(
                there
                for there in range(len(nodes) - 1, here, -1)
                if there == here + 1 or self._sees(index[here], index[there])
            )
            kept.append(step)
        return nodes[kept]

    def _sees(self, first: NDArray[np.int64], last: NDArray[np.int64]) -> bool:
        """Whether a strut may run straight from one grid point (3,) to another."""
        count = 2 * int(np.abs(last - first).max()) + 1
        line = np.rint(np.linspace(first, last, count)).astype(int)
        inside = self.roomy[tuple(line.T)]
        # The two ends may stand at a wall; the strut is trimmed there.
        return bool(inside[2:-2].all()) and bool(self.passable[tuple(line.T)].all())


def strut_solid(strut: Strut, width_mm: float) -> manifold3d.Manifold:
    """Solid of a strut: the hull of a cube at both ends of each stretch of its middle line.

    Parameters
    ----------
    strut : (k, 3) float64 array
        Corners of the middle line in mm.
    width_mm : float
        Side of the cube in mm.

    Returns
    -------
    manifold3d.Manifold
        In mm.
    """
    import manifold3d

    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / 2.0
    points = strut if len(strut) > 1 else np.repeat(strut, 2, axis=0)
    stretches = [
        manifold3d.Manifold.hull_points(
            np.concatenate([a + width_mm * corners, b + width_mm * corners])
        )
        for a, b in itertools.pairwise(points)
    ]
    return manifold3d.Manifold.batch_boolean(stretches, manifold3d.OpType.Add)
