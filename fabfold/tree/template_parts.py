"""The tree search in a template that folds once more along its creases.

Creases divide a template into parts (:mod:`fabfold.lattice.creases`), the panels of rigid origami.
The template is filled like any other. But two bodies in different parts may be joined across a
crease only, by one hinge for each crease, so that the crease can turn in the end. So the voxels are
shared out before the search. Each part gets a connected group of them. All joints between groups
are forbidden but one pair of voxels for each crease. These two stay rigid until the template is
filled.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import NoTreeError
from fabfold.lattice.creases import Parts, folded_template, line_of, parts_of, rim_of
from fabfold.lattice.rotations import FACES, ROTATION_INVERSE, ROTATION_PRODUCT, ROTATIONS, parity
from fabfold.lattice.template import Template
from fabfold.tree.problem import TreeProblem
from fabfold.tree.swept_cells import hinge_tables
from fabfold.tree.tables import cost_table

__all__ = ["restrict_to_parts"]

#: Energy of a voxel in a part that is not its own: far more than a whole tree has otherwise.
MISPLACED = 100.0
#: Random spanning trees of the voxels that are looked through for cuts.
_TREES = 4000
#: Groupings that are compared before one is taken.
_GROUPINGS = 24


@dataclass(frozen=True)
class _Cut:
    """A pair of voxels on the two sides of a crease.

    Attributes
    ----------
    part : int
        Part of the template that turns about the crease.
    above : int
        The voxel in the part that stays.
    below : int
        The voxel in the part that turns.
    face : int
        Face of `above` that `below` stands on, index in ``FACES``.
    poses : (k,) int32 array
        Poses that `above` may take.
    """

    part: int
    above: int
    below: int
    face: int
    poses: NDArray[np.int32]


def restrict_to_parts(problem: TreeProblem, seed: int, depth: NDArray[np.float64]) -> TreeProblem:
    """Share the voxels of a problem out among the parts of its template.

    Parameters
    ----------
    problem : TreeProblem
        Its template has creases.
    seed : int
        Another seed shares the voxels out in another way.
    depth : (n, 6) float64 array
        Mean ray depth of the voxels (Eq. 8): what counts are the faces that the folded shape
        shows, not those of the template.

    Returns
    -------
    TreeProblem
        Its trees fold into the template as it lies flat;
        :func:`fabfold.fold.crease_hinges.add_crease_hinges` adds the folds along the creases.

    Raises
    ------
    NoTreeError
        If no grouping of the voxels fits the parts.
    """
    parts = parts_of(problem.template)
    rng = np.random.default_rng(np.random.SeedSequence([seed, 5]))
    best: tuple[int, NDArray[np.int32], list[_Cut], NDArray[np.int32]] | None = None
    found = 0
    for _ in range(_TREES):
        grouping = _grouping(problem, parts, rng)
        if grouping is None:
            continue
        group, cuts, roots = grouping
        found += 1
        # Pairs that are torn apart for good; the fewer, the more is left to choose from.
        separated = _separated_faces(problem, group)
        if best is None or separated < best[0]:
            best = (separated, group, cuts, roots)
        if found == _GROUPINGS:
            break
    if best is None:
        sizes = " + ".join(str(int(n)) for n in np.bincount(parts.part))
        raise NoTreeError(
            f"{len(problem)} voxels: no way was found to cut them into connected groups for the "
            f"{len(parts.above)} parts of template {problem.template.name!r} ({sizes} cells), with "
            "room for a hinge on each fold; take another voxelization, or a template with more "
            "room"
        )
    return _restricted(problem, parts, best[1], best[2], best[3], depth)


def _separated_faces(problem: TreeProblem, group: NDArray[np.int32]) -> int:
    """Faces of voxels, out of those with a possible joint, behind which another group lies."""
    neighbour = problem.tables.neighbour
    joined = neighbour >= 0
    return int((joined & (group[neighbour] != group[:, None])).sum())


def _spanning(
    problem: TreeProblem, rng: np.random.Generator
) -> tuple[NDArray[np.int32], list[int], NDArray[np.int32]]:
    """Random spanning tree: parent of each voxel, an order from the root, face to the child."""
    neighbour = problem.tables.neighbour
    count = len(problem)
    parent = np.full(count, -1, dtype=np.int32)
    face = np.full(count, -1, dtype=np.int32)
    seen = np.zeros(count, dtype=bool)
    start = int(rng.integers(count))
    seen[start] = True
    order = [start]
    # Growing from a random voxel of the edge, mostly a new one, gives both stout and long groups.
    edge = [start]
    greed = rng.random()
    while edge:
        place = len(edge) - 1 if rng.random() < greed else int(rng.integers(len(edge)))
        u = edge[place]
        free = [f for f in range(6) if neighbour[u, f] >= 0 and not seen[neighbour[u, f]]]
        if not free:
            edge[place] = edge[-1]
            edge.pop()
            continue
        f = free[int(rng.integers(len(free)))]
        v = int(neighbour[u, f])
        seen[v] = True
        parent[v], face[v] = u, f
        order.append(v)
        edge.append(v)
    return parent, order, face


def _grouping(
    problem: TreeProblem, parts: Parts, rng: np.random.Generator
) -> tuple[NDArray[np.int32], list[_Cut], NDArray[np.int32]] | None:
    """Cut a random spanning tree into one group a part; None where that does not work out."""
    parent, order, face = _spanning(problem, rng)
    count = len(problem)
    flip = int(rng.integers(2))
    colour = (parity(problem.source) + flip) % 2
    capacity = np.zeros((len(parts.above), 2), dtype=int)
    np.add.at(capacity, (parts.part, parity(problem.template.cells)), 1)
    group = np.zeros(count, dtype=np.int32)
    alive = np.ones(count, dtype=bool)
    cuts: list[_Cut] = []
    for part in range(len(parts.above) - 1, 0, -1):
        size = np.zeros((count, 2), dtype=int)
        size[np.flatnonzero(alive), colour[alive]] = 1
        for v in reversed(order):
            if alive[v] and parent[v] >= 0 and alive[parent[v]]:
                size[parent[v]] += size[v]
        total = np.array([int((alive & (colour == c)).sum()) for c in (0, 1)])
        remaining = capacity[:part].sum(axis=0)
        options = []
        for v in range(count):
            u = int(parent[v])
            if not alive[v] or u < 0 or not alive[u]:
                continue
            for below in (True, False):
                inner = size[v] if below else total - size[v]
                if (inner <= capacity[part]).all() and (total - inner <= remaining).all():
                    options.append((v, below))
        if not options:
            return None
        v, below = options[int(rng.integers(len(options)))]
        u = int(parent[v])
        inside = np.zeros(count, dtype=bool)
        inside[v] = True
        for w in order:
            if parent[w] >= 0 and inside[parent[w]] and alive[w]:
                inside[w] = True
        members = alive & (inside if below else ~inside)
        group[members] = part
        alive &= ~members
        first, second, f = (u, v, int(face[v])) if below else (v, u, int(face[v]) ^ 1)
        poses = _poses(problem, parts, part, first, f, int(colour[first]))
        if len(poses) == 0:
            return None
        cuts.append(_Cut(part, first, second, f, poses))
    if any(group[cut.above] != parts.above[cut.part] for cut in cuts):
        return None
    always_rigid = problem.tables.always_rigid
    if (
        len(always_rigid)
        and (always_rigid & (group[problem.tables.neighbour] != group[:, None])).any()
    ):
        return None
    roots = _agreeing(problem, cuts)
    return None if len(roots) == 0 else (group, cuts, roots)


def _poses(
    problem: TreeProblem, parts: Parts, part: int, u: int, face: int, colour: int
) -> NDArray[np.int32]:
    """Poses of voxel `u` in which its neighbour across `face` is across the crease of `part`.

    The edge of their face that comes to lie on the crease must have room for a hinge.
    """
    tables, template = problem.tables, problem.template
    if not tables.allowed[u, face, 0]:
        return np.empty(0, np.int32)
    on_line, along = line_of(template.creases[parts.crease[part]])
    sides = hinge_tables().sides[face]
    found = []
    for a, b in rim_of(template, parts, part):
        if parity(template.cells[a]) != colour:
            continue
        across = template.cells[b] - template.cells[a]
        up = 2.0 * (on_line - template.cells[a]) - across
        up = np.rint(np.where(along != 0, 0.0, up)).astype(int)
        for rotation in range(24):
            matrix = ROTATIONS[rotation]
            if not np.array_equal(matrix @ FACES[face], across):
                continue
            for k in range(4):
                if tables.allowed[u, face, 1 + k] and np.array_equal(
                    matrix @ FACES[int(sides[k])], up
                ):
                    found.append(24 * a + rotation)
    return np.unique(np.array(found, dtype=np.int32))


def _agreeing(problem: TreeProblem, cuts: list[_Cut]) -> NDArray[np.int32]:
    """Poses of the first cut's voxel that leave every other cut a pose; (k, 2): voxel, pose.

    Rigid joints and half turns tie the rotation of a voxel to its cells in A and in the template,
    both modulo 2, once any voxel stands.
    """
    first = cuts[0]
    cells, source = problem.template.cells, problem.source
    kept = []
    for pose in first.poses.tolist():
        cell, rotation = divmod(pose, 24)
        matrix = ROTATIONS[rotation]
        for other in cuts[1:]:
            step = matrix @ (source[other.above] - source[first.above])
            for place in other.poses.tolist():
                odd = (cells[place // 24] - cells[cell] - step) % 2
                turn = ROTATIONS[ROTATION_PRODUCT[place % 24, ROTATION_INVERSE[rotation]]]
                # A half turn about z changes the parity of x and y; about none, of nothing.
                want = np.diag(np.where(odd.sum() == 0, 1, np.where(odd == 1, -1, 1)))
                if np.array_equal(turn, want):
                    break
            else:
                break
        else:
            kept.append((first.above, pose))
    return np.array(kept, dtype=np.int32).reshape(-1, 2)


def _restricted(
    problem: TreeProblem,
    parts: Parts,
    group: NDArray[np.int32],
    cuts: list[_Cut],
    roots: NDArray[np.int32],
    depth: NDArray[np.float64],
) -> TreeProblem:
    """The problem with the joints, poses and costs that a grouping of its voxels leaves."""
    tables, template = problem.tables, problem.template
    neighbour, allowed = tables.neighbour.copy(), tables.allowed.copy()
    separated = (neighbour >= 0) & (group[neighbour] != group[:, None])
    always_rigid = (
        tables.always_rigid.copy() if len(tables.always_rigid) else np.zeros_like(separated)
    )
    for cut in cuts:
        for v, f in ((cut.above, cut.face), (cut.below, cut.face ^ 1)):
            separated[v, f] = False
            allowed[v, f, 1:] = False
            always_rigid[v, f] = True
    neighbour[separated] = -1
    allowed[separated] = False
    # No joint leads from part to part, but for the rigid one at the places of the cuts.
    child_pose = tables.child_pose.copy()
    home = np.repeat(parts.part, 24)
    child_pose[(child_pose >= 0) & (home[child_pose] != home[:, None])] = -1
    for cut in cuts:
        there = tables.child_pose[cut.face, cut.poses, 0]
        child_pose[cut.face, cut.poses, 0] = there
        child_pose[cut.face ^ 1, there, 0] = cut.poses
    cost, expected_cost, shown = _shown_when_folded(problem, parts, depth)
    own = parts.part[None, :] == group[:, None]
    cost += np.where(np.repeat(own, 24, axis=1), 0.0, MISPLACED).astype(np.float32)
    for cut in cuts:
        here = np.full(cost.shape[1], MISPLACED, dtype=np.float32)
        here[cut.poses] = 0.0
        cost[cut.above] += here
    return replace(
        problem,
        tables=tables._replace(
            neighbour=neighbour,
            allowed=allowed,
            child_pose=child_pose,
            always_rigid=always_rigid,
            final_edge=_final_edge(template, parts),
            cost=cost,
            expected_cost=expected_cost,
            exposed=shown,
        ),
        roots=roots,
    )


def _final_edge(template: Template, parts: Parts) -> NDArray[np.int32]:
    """Lattice edges of the flat template that hinges may lie on, see ``Tables.final_edge``.

    Those that two parts share are left to the creases. Edges of two parts that only meet in the
    folded shape have one number, so that one of them carries a hinge at most.
    """
    folded = folded_template(template)
    inside = folded.inside_edges() if template.joints == "inside" else None
    number = np.arange(np.prod(2 * np.array(folded.shape) + 1), dtype=np.int32)
    number = number.reshape(2 * np.array(folded.shape) + 1)
    owner = np.full(2 * np.array(template.shape) + 1, -1, dtype=np.int32)
    final_edge = np.full(owner.shape, -1, dtype=np.int32)
    corners = [np.array([a, b]) for a in (-1, 1) for b in (-1, 1)]
    for cell, part in zip(template.cells, parts.part.tolist(), strict=True):
        pose = parts.poses[part]
        for axis in range(3):
            for corner in corners:
                edge = 2 * cell.astype(int)
                edge[[k for k in range(3) if k != axis]] += corner
                at = tuple((edge + 1).tolist())
                free = owner[at] in (-1, part)
                owner[at] = part
                turned = 2 * (pose[:3, :3] @ (edge / 2) + pose[:3, 3] + parts.shift)
                landed = tuple(np.rint(turned + 1).astype(int).tolist())
                if inside is not None:
                    free = free and bool(inside[landed])
                final_edge[at] = number[landed] if free else -1
    return final_edge


def _shown_when_folded(
    problem: TreeProblem, parts: Parts, depth: NDArray[np.float64]
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.uint8]]:
    """Costs of the poses with the faces that the folded shape shows, and these faces."""
    template = problem.template
    landed = parts.landed(template.cells)
    grid = np.zeros(landed.max(axis=0) + 3, dtype=bool)
    grid[tuple((landed + 1).T)] = True
    shown = np.zeros(len(landed), dtype=np.uint8)
    for f, step in enumerate(FACES):
        turned = np.rint(parts.poses[parts.part, :3, :3] @ step).astype(int)
        shown |= (~grid[tuple((landed + 1 + turned).T)]).astype(np.uint8) << f
    weight = problem.weights.surface
    before = cost_table(depth, problem.tables.exposed, weight, None)
    after = cost_table(depth, shown, weight, None)
    return (
        problem.tables.cost + (after[0] - before[0]),
        problem.tables.expected_cost + (after[1] - before[1]),
        shown,
    )
