"""Independent check of a finished tree by forward kinematics.

Nothing here is shared with the search but the data classes and ``FoldTree.body_poses``.
"""

from __future__ import annotations

import itertools
from collections import Counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fabfold.tree.fold_tree import FoldTree, Hinge

__all__ = ["check_tree"]


def check_tree(tree: FoldTree) -> list[str]:
    """Everything that is wrong with a tree, in words; an empty list when nothing is.

    Checked: distinct cells in A, and in B too but for pairs of voxels in different octants of one
    cell, whose hinges are single and lie in their own octants; target cells in the template; the
    edges span the voxels and join face neighbours; bodies are exactly the voxels that R edges
    join; hinges in order, on the lattice edge of the face that their voxels share; turns of 90,
    180 or 270 degrees that open the face; a double hinge joins parent, link plate and child in
    this order, on two edges; no voxel has two double hinges; forward kinematics carries every
    voxel to its target and orientation; no two hinges on one lattice edge segment and no two link
    plates on one lattice face in A or in B.

    Parameters
    ----------
    tree : FoldTree
        A tree from anywhere: a search, or a file.

    Returns
    -------
    list of str
        One sentence for each fault.
    """
    found = _shapes(tree)
    if found:
        return found
    # Later checks look things up by what earlier ones found sound.
    found = _cells(tree) + _edges(tree)
    if found:
        return found
    found = _bodies(tree) or _hinges(tree)
    if found:
        return found
    return (
        _kinematics(tree) + _senses(tree) + _segments(tree) + _plates(tree) + _sharing_hinges(tree)
    )


def _shapes(tree: FoldTree) -> list[str]:
    count = len(tree.source)
    wanted: dict[str, tuple[NDArray[Any], tuple[int, ...]]] = {
        "source": (tree.source, (count, 3)),
        "target": (tree.target, (count, 3)),
        "orientation": (tree.orientation, (count, 3, 3)),
        "fill": (tree.fill, (count,)),
    }
    if tree.octants is not None:
        wanted["octants"] = (tree.octants, (count,))
    return [
        f"{name} has shape {array.shape}, wanted {shape}"
        for name, (array, shape) in wanted.items()
        if array.shape != shape
    ]


def _repeated(cells: NDArray[np.int32]) -> list[tuple[int, ...]]:
    counts = Counter(tuple(cell) for cell in cells.tolist())
    return [cell for cell, times in counts.items() if times > 1]


def _cells(tree: FoldTree) -> list[str]:
    found = [f"two voxels share source cell {cell}" for cell in _repeated(tree.source)]
    found += _shared_cells(tree)
    template = {tuple(cell) for cell in tree.template.cells.tolist()}
    found += [
        f"voxel {i}: target cell {tuple(cell)} is outside template {tree.template.name!r}"
        for i, cell in enumerate(tree.target.tolist())
        if tuple(cell) not in template
    ]
    return found


def _corners(tree: FoldTree, voxel: int) -> set[tuple[int, ...]]:
    """The eighths that a voxel keeps to, by the corner of its cell in A, -1 and 1."""
    bits = 255 if tree.octants is None else int(tree.octants[voxel])
    sides = list(itertools.product((-1, 1), repeat=3))
    return {side for k, side in enumerate(sides) if bits >> k & 1}


def _shared_cells(tree: FoldTree) -> list[str]:
    """Voxels in one cell of B must be two, in different eighths of it."""
    together: dict[tuple[int, ...], list[int]] = {}
    for voxel, cell in enumerate(tree.target.tolist()):
        together.setdefault(tuple(cell), []).append(voxel)
    found = []
    for cell, voxels in together.items():
        if len(voxels) > 2:
            found.append(f"{len(voxels)} voxels share target cell {cell}")
        elif len(voxels) == 2:
            first, second = (
                {tuple((tree.orientation[v] @ corner).tolist()) for corner in _corners(tree, v)}
                for v in voxels
            )
            if first & second or not (first and second):
                found.append(
                    f"voxels {voxels[0]} and {voxels[1]} share target cell {cell}, and "
                    f"{len(first & second)} of its eighths"
                )
        elif len(_corners(tree, voxels[0])) < 8:
            found.append(f"voxel {voxels[0]} has eighths of a cell that nobody shares")
    return found


def _sharing_hinges(tree: FoldTree) -> list[str]:
    """Hinges of voxels that share a cell must lie beside two eighths of theirs."""
    found = []
    for number, edge in enumerate(tree.edges):
        for voxel in (edge.parent, edge.child):
            own = _corners(tree, voxel)
            if len(own) == 8:
                continue
            if edge.kind == "D":
                found.append(f"edge {number}: voxel {voxel} shares its cell and has a double hinge")
                continue
            for hinge in (tree.hinges[h] for h in edge.hinges):
                edge_at = np.rint(2 * (np.array(hinge.point) - tree.source[voxel])).astype(int)
                across = np.flatnonzero(edge_at)
                touched = {
                    corner
                    for corner in itertools.product((-1, 1), repeat=3)
                    if all(corner[a] == edge_at[a] for a in across)
                }
                if not touched <= own:
                    found.append(f"{hinge.name}: voxel {voxel} shares the eighths beside it")
    return found


def _edges(tree: FoldTree) -> list[str]:
    import networkx

    count = len(tree.source)
    found = []
    graph = networkx.Graph()
    graph.add_nodes_from(range(count))
    for number, edge in enumerate(tree.edges):
        if not (0 <= edge.parent < count and 0 <= edge.child < count):
            found.append(f"edge {number}: no such voxel")
            continue
        graph.add_edge(edge.parent, edge.child)
        if edge.kind not in ("R", "S", "D"):
            found.append(f"edge {number}: unknown type {edge.kind!r}")
        elif len(edge.hinges) != {"R": 0, "S": 1, "D": 2}[edge.kind]:
            found.append(f"edge {number}: type {edge.kind} with {len(edge.hinges)} hinges")
        if np.abs(tree.source[edge.parent] - tree.source[edge.child]).sum() != 1:
            found.append(f"edge {number}: voxels {edge.parent} and {edge.child} share no face in A")
    if len(tree.edges) != count - 1 or not networkx.is_connected(graph):
        found.append(
            f"the {len(tree.edges)} edges are no spanning tree of the {count} voxels "
            f"({networkx.number_connected_components(graph)} pieces)"
        )
    used = Counter(h for edge in tree.edges for h in edge.hinges)
    if used != Counter(range(len(tree.hinges))):
        found.append("the edges do not use every hinge exactly once")
    return found


def _bodies(tree: FoldTree) -> list[str]:
    import networkx

    found = []
    holders = Counter(v for body in tree.bodies for v in body.voxels)
    if holders != Counter(range(len(tree.source))):
        return ["the bodies do not hold every voxel exactly once"]
    graph = networkx.Graph()
    graph.add_nodes_from(range(len(tree.source)))
    graph.add_edges_from((e.parent, e.child) for e in tree.edges if e.kind == "R")
    rigid = {frozenset(piece) for piece in networkx.connected_components(graph)}
    for body in tree.bodies:
        if body.edge is None:
            if frozenset(body.voxels) not in rigid:
                found.append(f"{body.name}: its voxels are not what R edges join")
        elif body.voxels or not (
            0 <= body.edge < len(tree.edges) and tree.edges[body.edge].kind == "D"
        ):
            found.append(f"{body.name}: a link has no voxels and belongs to a D edge")
    links = Counter(body.edge for body in tree.bodies if body.edge is not None)
    wanted = Counter(number for number, edge in enumerate(tree.edges) if edge.kind == "D")
    if links != wanted:
        found.append("the links are not one for each D edge")
    names = [body.name for body in tree.bodies] + [hinge.name for hinge in tree.hinges]
    if len(set(names)) != len(names):
        found.append("names of bodies and hinges are not unique")
    return found


def _hinges(tree: FoldTree) -> list[str]:
    if len(tree.hinges) != len(tree.bodies) - 1:
        return [f"{len(tree.hinges)} hinges for {len(tree.bodies)} bodies"]
    found = []
    for index, hinge in enumerate(tree.hinges):
        if hinge.child != index + 1 or not 0 <= hinge.parent <= index:
            found.append(f"{hinge.name}: must carry body {index + 1}, its parent before it")
        if sorted(hinge.direction) != [0, 0, 1]:
            found.append(f"{hinge.name}: direction {hinge.direction} is not +x, +y or +z")
        if abs(hinge.angle_deg) not in (90.0, 180.0, 270.0):
            found.append(f"{hinge.name}: turn of {hinge.angle_deg}° is no quarter turn")
    if found:
        return found
    owner = tree.voxel_body
    for number, edge in enumerate(tree.edges):
        if edge.kind == "R":
            continue
        ends = [owner[edge.parent], owner[edge.child]]
        chain = [tree.hinges[h] for h in edge.hinges]
        joined = {hinge.parent for hinge in chain} | {hinge.child for hinge in chain}
        if not set(ends) <= joined:
            found.append(f"edge {number}: its hinges do not join the bodies of its voxels")
        found += _chain(tree, number, chain)
        p, c = tree.source[edge.parent], tree.source[edge.child]
        for hinge in chain:
            offset = np.array(hinge.point) - (p + c) / 2.0
            across = np.abs(offset)
            on_edge = (
                np.isclose(across.sum(), 0.5)
                and np.isclose(across.max(), 0.5)
                and abs(float(offset @ (c - p))) < 1e-9
            )
            flat = (
                np.array(hinge.direction) @ (c - p) == 0
                and abs(float(np.array(hinge.direction) @ offset)) < 1e-9
            )
            if not (on_edge and flat):
                found.append(
                    f"{hinge.name}: its axis is on no edge of the face between voxels "
                    f"{edge.parent} and {edge.child}"
                )
    return found


def _chain(tree: FoldTree, number: int, chain: list[Hinge]) -> list[str]:
    """Order and lattice edges of the hinges of one edge."""
    edge = tree.edges[number]
    owner = tree.voxel_body
    bodies = [int(owner[edge.parent]), int(owner[edge.child])]
    if edge.kind == "D":
        link = next(i for i, body in enumerate(tree.bodies) if body.edge == number)
        bodies.insert(1, link)
    found = []
    if [(h.parent, h.child) for h in chain] != list(itertools.pairwise(bodies)):
        found.append(f"edge {number}: its hinges do not join parent, link and child in this order")
    if len({hinge.point for hinge in chain}) != len(chain):
        found.append(f"edge {number}: both axes of a double hinge lie on one edge")
    return found


def _senses(tree: FoldTree) -> list[str]:
    found = []
    for edge in tree.edges:
        p, c = tree.source[edge.parent], tree.source[edge.child]
        for hinge in (tree.hinges[h] for h in edge.hinges):
            out = np.array(hinge.point) - (p + c) / 2.0
            opening = np.cross((c - p).astype(float), out) @ np.array(hinge.direction)
            if opening * hinge.angle_deg < 0:
                found.append(f"{hinge.name}: its turn of {hinge.angle_deg:g}° runs into the face")
    return found


def _plates(tree: FoldTree) -> list[str]:
    found = []
    doubles = [edge for edge in tree.edges if edge.kind == "D"]
    held = Counter(voxel for edge in doubles for voxel in (edge.parent, edge.child))
    found += [f"voxel {voxel} has {n} double hinges" for voxel, n in held.items() if n > 1]
    poses = tree.body_poses(tree.fold_angles)
    seen: dict[tuple[int, ...], str] = {}
    for body, pose in zip(tree.bodies, poses, strict=True):
        if body.edge is None:
            continue
        edge = tree.edges[body.edge]
        middle = (tree.source[edge.parent] + tree.source[edge.child]) / 2.0
        key = tuple(np.rint(2 * (pose[:3, :3] @ middle + pose[:3, 3])).astype(int).tolist())
        if key in seen:
            found.append(f"{seen[key]} and {body.name} lie on one lattice face in B")
        seen[key] = body.name
    return found


def _kinematics(tree: FoldTree) -> list[str]:
    found = []
    root = np.eye(4)
    root[:3, :3] = tree.root_rotation
    root[:3, 3] = tree.root_translation
    poses = root @ tree.body_poses(tree.fold_angles)
    owner = tree.voxel_body
    for i, cell in enumerate(tree.source):
        pose = poses[owner[i]]
        landed = pose[:3, :3] @ cell + pose[:3, 3]
        if np.abs(landed - tree.target[i]).max() > 1e-6:
            found.append(
                f"voxel {i} folds to {np.round(landed, 3).tolist()}, "
                f"its target is {tree.target[i].tolist()}"
            )
        if np.abs(pose[:3, :3] - tree.orientation[i]).max() > 1e-6:
            found.append(f"voxel {i} folds to another orientation than its own")
    return found


def _segments(tree: FoldTree) -> list[str]:
    found = []
    poses = tree.body_poses(tree.fold_angles)
    still = np.tile(np.eye(4), (len(tree.bodies), 1, 1))
    for shape, carried in (("A", still), ("B", poses)):
        seen: dict[tuple[int, ...], str] = {}
        for hinge in tree.hinges:
            pose = carried[hinge.parent]
            # The middle of a unit edge tells its direction too: it alone is whole along the edge.
            middle = pose[:3, :3] @ np.array(hinge.point) + pose[:3, 3]
            key = tuple(np.rint(2 * middle).astype(int).tolist())
            if key in seen:
                found.append(
                    f"{seen[key]} and {hinge.name} lie on one lattice edge segment in {shape}"
                )
            seen[key] = hinge.name
    return found
