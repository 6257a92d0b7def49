"""From poses to trees: the choice of hinges, the hinge system, and the finished tree.

:func:`hinge_choice` finds the hinges that could join the rigid clusters of a set of poses,
:meth:`HingeChoice.tree` draws a spanning tree of them with its
:class:`~fabfold.tree.system.HingeSystem`, and :func:`fold_tree` makes the
:class:`~fabfold.tree.fold_tree.FoldTree` of the result.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fabfold.lattice.rotations import ROTATIONS
from fabfold.tree.fold_tree import Body, Edge, FoldTree, Hinge
from fabfold.tree.pose_energy import doubles_needed, energy_of
from fabfold.tree.possible_hinges import HINGE_ROW, HingeRows, find_hinges, max_hinge_rows
from fabfold.tree.problem import TreeProblem
from fabfold.tree.sharing import shared_octants, unpacked
from fabfold.tree.spanning_trees import mark_kept, root_tree, spanning_tree
from fabfold.tree.swept_cells import hinge_tables
from fabfold.tree.system import HingeSystem

__all__ = ["HingeChoice", "SpanningTree", "axes_array", "fold_tree", "hinge_choice"]


@dataclass(frozen=True)
class SpanningTree:
    """A choice of hinges for a set of poses.

    Attributes
    ----------
    system : HingeSystem
        The bodies and hinges for the folding kernels.
    joints : (h, 3) int32 array
        Parent voxel, child voxel and joint type of each hinge; a double hinge has two, one after
        the other.
    """

    system: HingeSystem
    joints: NDArray[np.int32]

    @cached_property
    def axes(self) -> NDArray[np.int32]:
        """Voxels (smaller first), place in A (doubled) and turns, seen from the first voxel.

        Returns
        -------
        (h, 6) int32 array
            One row a hinge axis, as :func:`axes_array` makes them.
        """
        return axes_array(self.joints[:, :2], self.system.point2, self.system.turns)

    @cached_property
    def hinges(self) -> frozenset[tuple[int, ...]]:
        """The rows of :attr:`axes`, in no order."""
        return frozenset(map(tuple, self.axes.tolist()))

    @cached_property
    def hinged_pairs(self) -> set[tuple[int, int]]:
        """Voxel pairs that carry a hinge, smaller voxel first."""
        return {(min(a, b), max(a, b)) for a, b in self.joints[:, :2].tolist()}


def axes_array(ends: ArrayLike, point2: ArrayLike, turns: ArrayLike) -> NDArray[np.int32]:
    """Axes of hinges in a form that does not depend on which voxel is the parent.

    Parameters
    ----------
    ends : (h, 2) array of int
        Parent and child voxel of each axis.
    point2 : (h, 3) array of int
        Twice the middle of its lattice edge in A.
    turns : (h,) array of int
        Signed quarter turns of the child about the positive axis.

    Returns
    -------
    (h, 6) int32 array
        Both voxels, the smaller number first, `point2`, and the turns of the second one.
    """
    pair = np.asarray(ends, np.int32).reshape(-1, 2)
    turned = np.asarray(turns, np.int32) * np.where(pair[:, 0] < pair[:, 1], 1, -1)
    place = np.asarray(point2, np.int32).reshape(-1, 3)
    return np.column_stack([np.sort(pair, axis=1), place, turned]).astype(np.int32)


@dataclass(frozen=True)
class HingeChoice:
    """Rigid clusters of a set of poses and every hinge that could join them.

    Attributes
    ----------
    problem : TreeProblem
        Voxels, joints and template.
    label : (n,) int32 array
        Cluster of each voxel.
    clusters : int
        Number of rigid clusters.
    rows : (k,) array of :data:`fabfold.tree.possible_hinges.HINGE_ROW`
        Possible hinges.
    octants : (n,) uint8 array or None
        See :func:`fabfold.tree.sharing.shared_octants`.
    """

    problem: TreeProblem
    label: NDArray[np.int32]
    clusters: int
    rows: HingeRows
    octants: NDArray[np.uint8] | None = None

    def kept(self, axes: NDArray[np.int32] | None, exact: bool = True) -> NDArray[np.float64]:
        """Preference for hinges that a tree had before.

        Parameters
        ----------
        axes : (h, 6) int32 array or None
            :attr:`SpanningTree.axes` of that tree.
        exact : bool
            Whether edges and turns are kept, or the voxels alone.

        Returns
        -------
        (k,) float64 array
            For each possible hinge: -1 for those, else 0.
        """
        preference = np.zeros(len(self.rows))
        if axes is not None:
            tables = self.problem.tables
            mark_kept(tables, self.rows, hinge_tables(), axes, exact, preference)
        return preference

    def tree(
        self, preference: NDArray[np.float64], generator: NDArray[np.uint64]
    ) -> SpanningTree | None:
        """Draw one random spanning tree.

        Parameters
        ----------
        preference : (k,) float64 array
            For each possible hinge, against a uniform(0, 1); smaller is sooner.
        generator : (1,) uint64 array
            Random state, advanced.

        Returns
        -------
        SpanningTree or None
            None where the hinges drawn do not join all the clusters.
        """
        chosen = np.empty(self.clusters - 1, np.int32)
        left = spanning_tree(self.rows, self.clusters, preference, generator, chosen)
        if left > 1:
            return None
        hinges = self.clusters - 1 + int(self.rows["double"][chosen].sum())
        body = np.empty(len(self.label), np.int32)
        parent, joints = np.empty(hinges, np.int32), np.empty((hinges, 3), np.int32)
        point2 = np.empty((hinges, 3), np.int32)
        axis, turns = np.empty(hinges, np.int8), np.empty(hinges, np.int8)
        root_tree(
            self.problem.tables, self.rows, chosen, self.label, self.clusters, hinge_tables(),
            body, parent, point2, axis, turns, joints,
        )  # fmt: skip
        system = HingeSystem(
            cells=self.problem.source,
            body=body,
            parent=parent,
            point2=point2,
            axis=axis,
            turns=turns,
            octants=None if self.octants is None else unpacked(self.octants),
        )
        return SpanningTree(system, joints)

    def trees(
        self,
        axes: NDArray[np.int32] | None,
        count: int,
        generator: NDArray[np.uint64],
        *,
        exact: bool = True,
    ) -> Iterator[SpanningTree]:
        """Different random spanning trees; the first ones keep most hinges of `axes`.

        Parameters
        ----------
        axes : (h, 6) int32 array or None
            :attr:`SpanningTree.axes` of the tree that came before.
        count : int
            Most trees drawn.
        generator : (1,) uint64 array
            Random state, advanced.
        exact : bool
            Whether edges and turns are kept, or the voxels alone, so that each draw may join them
            otherwise; trees then differ in voxels.

        Yields
        ------
        SpanningTree
            None of them twice.
        """
        seen: list[SpanningTree] = []
        kept = self.kept(axes, exact)
        for k in range(count):
            bonus = (2.0, 0.7, 0.0)[min(k, 2)]
            for _ in range(8):
                # Hinges on one lattice edge exclude each other, so a random choice may not span.
                tree = self.tree(bonus * kept, generator)
                if tree is not None:
                    break
            else:
                continue
            # The first one is mostly taken, and its hinges then never asked for.
            if exact:
                fresh = all(tree.hinges != other.hinges for other in seen)
            else:
                fresh = all(tree.hinged_pairs != other.hinged_pairs for other in seen)
            if fresh:
                seen.append(tree)
                yield tree


def hinge_choice(problem: TreeProblem, pose: NDArray[np.int32]) -> HingeChoice:
    """Clusters and possible hinges of a full set of poses.

    Parameters
    ----------
    problem : TreeProblem
        Voxels, joints and template.
    pose : (n,) int32 array
        ``24 * template cell + rotation`` of each voxel.

    Returns
    -------
    HingeChoice
        What spanning trees are drawn from.
    """
    label = np.empty(len(problem), np.int32)
    rows = np.empty(max_hinge_rows(problem.tables), HINGE_ROW)
    clusters, count = find_hinges(problem.tables, pose, hinge_tables(), label, rows)
    return HingeChoice(problem, label, clusters, rows[:count], _octants(problem, pose))


def _octants(problem: TreeProblem, pose: NDArray[np.int32]) -> NDArray[np.uint8] | None:
    if problem.tables.max_shared == 0:
        return None
    return shared_octants(pose, problem.tables.octant_mask[:, 0])


def fold_tree(problem: TreeProblem, pose: NDArray[np.int32], tree: SpanningTree) -> FoldTree:
    """The finished tree of a set of poses and a choice of hinges.

    Parameters
    ----------
    problem : TreeProblem
        Voxels, joints and template.
    pose : (n,) int32 array
        ``24 * template cell + rotation`` of each voxel.
    tree : SpanningTree
        A spanning tree of the poses' clusters.

    Returns
    -------
    FoldTree
        With the energies of the poses and the tree.
    """
    system = tree.system
    target = problem.template.cells[pose // 24].astype(np.int32)
    orientation = ROTATIONS[pose % 24]
    edges = _rigid_edges(problem, pose, system.body)
    hinges = []
    holding = set(system.body.tolist())
    links: dict[int, int] = {}
    for h, (parent, child, _) in enumerate(tree.joints.tolist()):
        if h + 1 not in holding:
            links[h + 1] = len(edges)
            edges.append(Edge(parent, child, "D", (h, h + 1)))
        elif int(system.parent[h]) in holding:
            edges.append(Edge(parent, child, "S", (h,)))
        direction = [0, 0, 0]
        direction[int(system.axis[h])] = 1
        x, y, z = (system.point2[h] / 2.0).tolist()
        hinges.append(
            Hinge(
                name=f"hinge-{h:02d}",
                parent=int(system.parent[h]),
                child=h + 1,
                point=(x, y, z),
                direction=(direction[0], direction[1], direction[2]),
                angle_deg=90.0 * int(system.turns[h]),
            )
        )
    first = int(np.flatnonzero(system.body == 0)[0])
    root = orientation[first]
    total, clusters = energy_of(problem.tables, pose, problem.empty_face)
    weights = problem.weights
    least = weights.single * (clusters - 1)
    if problem.tables.last_single + 1 < len(problem.joints):
        least += (weights.double - weights.single) * int(doubles_needed(problem.tables, pose))
    singles = sum(edge.kind == "S" for edge in edges)
    count = weights.single * singles + weights.double * len(links)
    total += count - least  # a hinge that cannot turn may have made a double one necessary
    weight = weights.surface
    extra = problem.extra_energy(pose)
    return FoldTree(
        template=problem.template,
        source=problem.source,
        target=target,
        orientation=orientation.astype(np.int32),
        fill=problem.fill,
        edges=tuple(edges),
        bodies=_bodies(system, links),
        hinges=tuple(hinges),
        root_rotation=root.astype(np.int32),
        root_translation=(target[first] - root @ problem.source[first]).astype(np.int32),
        energy={
            "surface": float((total - count - extra) / weight) if weight else 0.0,
            "count": float(count),
            "total": float(total),
            **({} if problem.extra_cost is None else {"wishes": extra}),
        },
        octants=_octants(problem, pose),
    )


def _bodies(system: HingeSystem, links: dict[int, int]) -> tuple[Body, ...]:
    """Bodies by number; `links` has the edge of each link plate."""
    out: list[Body] = []
    for b in range(len(system.parent) + 1):
        plates = sum(body.edge is not None for body in out)
        if b in links:
            out.append(Body(f"link-{plates:02d}", (), links[b]))
        else:
            held = tuple(np.flatnonzero(system.body == b).tolist())
            out.append(Body(f"body-{b - plates:02d}", held))
    return tuple(out)


def _rigid_edges(
    problem: TreeProblem, pose: NDArray[np.int32], body: NDArray[np.int32]
) -> list[Edge]:
    """Spanning forest of the rigid joints, breadth first from each body's first voxel."""
    tables = problem.tables
    seen = np.zeros(len(pose), dtype=bool)
    edges: list[Edge] = []
    for start in range(len(pose)):
        if seen[start]:
            continue
        seen[start] = True
        queue = [start]
        for u in queue:
            for face in range(6):
                v = int(tables.neighbour[u, face])
                if v < 0 or seen[v] or not tables.allowed[u, face, 0] or body[v] != body[u]:
                    continue
                if tables.child_pose[face, pose[u], 0] == pose[v]:
                    seen[v] = True
                    queue.append(v)
                    edges.append(Edge(u, v, "R"))
    return edges
