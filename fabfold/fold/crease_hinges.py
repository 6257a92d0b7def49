"""Hinges on the creases of a template: from a tree that fills it flat to one that ends folded.

A template with creases is filled as it lies flat (:mod:`fabfold.lattice.creases`). Each crease then
becomes a hinge of the tree, and its turn is the last of the folding path.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fabfold.fold.lattice_planner import count_free_moves
from fabfold.lattice.creases import Parts, folded_template, line_of, parts_of, rim_of
from fabfold.lattice.template import Template
from fabfold.tree.candidate import Candidate
from fabfold.tree.fold_tree import Body, Edge, FoldTree, Hinge
from fabfold.tree.system import hinge_system

__all__ = ["add_crease_hinges"]


class _HingeEnds(NamedTuple):
    """A hinge before it is numbered.

    Attributes
    ----------
    edge : int
        Edge of the tree that it belongs to.
    hinge : int
        Hinge of the tree that it is, or ``-1 - part`` for the crease that carries a part.
    near, far : int
        Nodes that it joins: groups of voxels, and after them the link plates.
    point : (float, float, float)
        Middle of its lattice edge in A, lattice units.
    direction : (int, int, int)
        Axis, a positive unit vector.
    angle_deg : float
        Angle in B of the far node against the near one.
    """

    edge: int
    hinge: int
    near: int
    far: int
    point: tuple[float, float, float]
    direction: tuple[int, int, int]
    angle_deg: float


def add_crease_hinges(candidate: Candidate, template: Template) -> Candidate | None:
    """Let a candidate fold along the creases of its template in the end.

    Parameters
    ----------
    candidate : Candidate
        Its tree fills `template` as it lies flat.
    template : Template
        With the creases.

    Returns
    -------
    Candidate or None
        With one hinge more for each crease, and its turn at the end of the path. The candidate
        itself where the template has no crease; None where the tree has any other joint across a
        crease, or the last moves run into something.
    """
    if not template.creases:
        return candidate
    tree = candidate.tree
    parts = parts_of(template)
    index = {tuple(cell): i for i, cell in enumerate(template.cells.tolist())}
    place = np.array([index[tuple(cell)] for cell in tree.target.tolist()])
    bridges = _bridges(tree, template, parts, place)
    if bridges is None:
        return None
    groups, node = _groups(tree, set(bridges.values()))
    turns = [
        *(_crease_hinge(tree, template, parts, place, node, *item) for item in bridges.items()),
        *_old_hinges(tree, groups, node),
    ]
    final, order, sign = _rebuilt(tree, template, parts, place, groups, turns)
    path = _path(template, parts, candidate.path, final, turns, order, sign)
    if count_free_moves(hinge_system(final), path) < len(path):
        return None
    return replace(candidate, tree=final, path=path)


def _bridges(
    tree: FoldTree, template: Template, parts: Parts, place: NDArray[np.int64]
) -> dict[int, int] | None:
    """Edge that crosses to each part but the first; None where other edges cross too."""
    found: dict[int, int] = {}
    rims = {n: set(rim_of(template, parts, n)) for n in range(1, len(parts.above))}
    for number, edge in enumerate(tree.edges):
        a, b = int(place[edge.parent]), int(place[edge.child])
        if parts.part[a] == parts.part[b]:
            continue
        for one, other in ((a, b), (b, a)):
            part = int(parts.part[other])
            if edge.kind == "R" and part not in found and (one, other) in rims.get(part, ()):
                found[part] = number
                break
        else:
            return None
    return found if len(found) == len(parts.above) - 1 else None


def _groups(tree: FoldTree, opened: set[int]) -> tuple[list[list[int]], NDArray[np.int64]]:
    """Voxels that stay rigid once the `opened` edges turn, and the group of each voxel."""
    rigid: list[list[int]] = [[] for _ in range(len(tree.source))]
    for number, edge in enumerate(tree.edges):
        if edge.kind == "R" and number not in opened:
            rigid[edge.parent].append(edge.child)
            rigid[edge.child].append(edge.parent)
    node = np.full(len(tree.source), -1, dtype=np.int64)
    groups: list[list[int]] = []
    for start in range(len(tree.source)):
        if node[start] >= 0:
            continue
        node[start] = len(groups)
        group = [start]
        for u in group:
            for v in rigid[u]:
                if node[v] < 0:
                    node[v] = len(groups)
                    group.append(v)
        groups.append(sorted(group))
    return groups, node


def _old_hinges(
    tree: FoldTree, groups: list[list[int]], node: NDArray[np.int64]
) -> list[_HingeEnds]:
    """The hinges that the tree has already, between the nodes of the new one."""
    plates = [b for b, body in enumerate(tree.bodies) if body.edge is not None]
    plate = {b: len(groups) + k for k, b in enumerate(plates)}
    owner = tree.voxel_body
    turns = []
    for number, edge in enumerate(tree.edges):
        for h in edge.hinges:
            hinge = tree.hinges[h]
            ends = []
            for body in (hinge.parent, hinge.child):
                if body in plate:
                    ends.append(plate[body])
                else:
                    voxel = edge.parent if owner[edge.parent] == body else edge.child
                    ends.append(int(node[voxel]))
            turns.append(
                _HingeEnds(
                    number, h, ends[0], ends[1], hinge.point, hinge.direction, hinge.angle_deg
                )
            )
    return turns


def _crease_hinge(
    tree: FoldTree,
    template: Template,
    parts: Parts,
    place: NDArray[np.int64],
    node: NDArray[np.int64],
    part: int,
    edge: int,
) -> _HingeEnds:
    """The hinge of a crease in shape A."""
    crease = template.creases[parts.crease[part]]
    on_line, along = line_of(crease)
    u, v = tree.edges[edge].parent, tree.edges[edge].child
    if parts.part[place[u]] == part:
        u, v = v, u
    middle = np.where(along != 0, tree.target[u], on_line)
    back = tree.orientation[u].T
    x, y, z = (tree.source[u] + back @ (middle - tree.target[u])).tolist()
    axis = np.rint(back @ along).astype(int)
    i, j, k = np.abs(axis).tolist()
    angle = float(axis.sum() * crease.angle_deg)
    return _HingeEnds(edge, -1 - part, int(node[u]), int(node[v]), (x, y, z), (i, j, k), angle)


def _rebuilt(
    tree: FoldTree,
    template: Template,
    parts: Parts,
    place: NDArray[np.int64],
    groups: list[list[int]],
    turns: list[_HingeEnds],
) -> tuple[FoldTree, list[int], list[int]]:
    """The tree with all `turns` as hinges; the turn of each hinge, and its sign."""
    # The largest piece of the old root stays the root, so that only creases may change ends.
    kept = set(tree.bodies[0].voxels)
    root = max(range(len(groups)), key=lambda g: (len(kept & set(groups[g])), -g))
    number = {root: 0}
    queue = [root]
    order: list[int] = []
    sign: list[int] = []
    hinges: list[Hinge] = []
    for here in queue:
        for t, turn in enumerate(turns):
            if here not in (turn.near, turn.far):
                continue
            way, far = (1, turn.far) if turn.near == here else (-1, turn.near)
            if far in number:
                continue
            name = f"hinge-{len(hinges):02d}"
            angle = way * turn.angle_deg
            hinges.append(Hinge(name, number[here], len(number), turn.point, turn.direction, angle))
            number[far] = len(number)
            queue.append(far)
            order.append(t)
            sign.append(way)
    edges = list(tree.edges)
    renamed = {turns[t].hinge: h for h, t in enumerate(order)}
    for e, edge in enumerate(edges):
        edges[e] = replace(edge, hinges=tuple(renamed[h] for h in edge.hinges))
    for h, t in enumerate(order):
        if turns[t].hinge < 0:
            edge = edges[turns[t].edge]
            swap = (turns[t].near == queue[hinges[h].parent]) != (
                edge.parent in _members(groups, turns[t].near)
            )
            ends = (edge.child, edge.parent) if swap else (edge.parent, edge.child)
            edges[turns[t].edge] = Edge(ends[0], ends[1], "S", (h,))
    plate_edge = [body.edge for body in tree.bodies if body.edge is not None]
    bodies = []
    for b, at in enumerate(queue):
        if at < len(groups):
            bodies.append(Body(f"body-{b:02d}", tuple(groups[at])))
        else:
            bodies.append(Body(f"body-{b:02d}", (), plate_edge[at - len(groups)]))
    turned = np.rint(parts.poses[parts.part[place], :3, :3]).astype(np.int32)
    orientation = np.einsum("nij,njk->nik", turned, tree.orientation).astype(np.int32)
    target = parts.landed(template.cells)[place]
    first = groups[root][0]
    final = FoldTree(
        template=folded_template(template),
        source=tree.source,
        target=target,
        orientation=orientation,
        fill=tree.fill,
        edges=tuple(edges),
        bodies=tuple(bodies),
        hinges=tuple(hinges),
        root_rotation=orientation[first],
        root_translation=(target[first] - orientation[first] @ tree.source[first]).astype(np.int32),
        energy=dict(tree.energy),
        octants=tree.octants,
    )
    return final, order, sign


def _members(groups: list[list[int]], node: int) -> list[int]:
    """Voxels of a node; a link plate has none."""
    return groups[node] if node < len(groups) else []


def _path(
    template: Template,
    parts: Parts,
    path: NDArray[np.int32],
    final: FoldTree,
    turns: list[_HingeEnds],
    order: list[int],
    sign: list[int],
) -> NDArray[np.int32]:
    """The old path in the new numbers, and the creases at its end."""
    at = {turns[t].hinge: h for h, t in enumerate(order)}
    rows = []
    for hinge, quarter in np.asarray(path, dtype=int).reshape(-1, 2).tolist():
        rows.append((at[hinge], sign[at[hinge]] * quarter))
    for crease in range(len(template.creases)):
        h = at[-1 - parts.crease.index(crease)]
        rows.append((h, round(final.hinges[h].angle_deg / 90.0)))
    return np.array(rows, dtype=np.int32).reshape(-1, 2)
