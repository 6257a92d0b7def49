"""What carving brings: near misses of the tree search, planned with cores, built and proven.

    python benchmarks/carving.py VOXELS.npz --template box-4x4x4 [--trees 8] [--prove 3]

VOXELS.npz is a voxelization as a kit's ``stages`` folder keeps it. The search runs with whole cells
and every tree is noted that passes the closure test and that the planner does not fold, one of
twenty. Each is then planned with cores, and what must be carved is weighed; the first `--prove` of
those that can be carved are built and certified on the printed bodies.
"""

from __future__ import annotations

import argparse
import contextlib
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

VOXEL_MM, CLEARANCE_MM, GAP_MM = 20.0, 0.3, 0.25


@dataclass
class Recorder:
    """A judge that notes what it does not fold."""

    judge: Any
    wanted: int
    seen: int = 0
    missed: list[Any] = field(default_factory=list)

    def stuck_hinges(self, system: Any) -> Any:
        return self.judge.stuck_hinges(system)

    def estimate(self, system: Any, expansions: int, guide: Any = None) -> Any:
        found = self.judge.estimate(system, expansions, guide)
        if found.unresolved.any():
            self.seen += 1
            if self.seen % 20 == 1 and len(self.missed) < self.wanted:
                self.missed.append(system)
        return found

    def path(self, system: Any, guide: Any = None) -> Any:
        return self.judge.path(system, guide)


def near_misses(voxels: Any, template: str, count: int) -> list[Any]:
    """Hinge systems that pass the closure test and that the planner does not fold."""
    from fabfold.errors import NoFoldError, NoTreeError
    from fabfold.fold.lattice_foldability import LatticeFoldability
    from fabfold.lattice.shipped import load_template
    from fabfold.recipe.recipe_wishes import default_weights
    from fabfold.tree.effort import Effort
    from fabfold.tree.problem import from_features
    from fabfold.tree.solve import solve
    from fabfold.voxels.features import features

    problem = from_features(voxels, features(voxels), load_template(template), default_weights())
    judge = Recorder(LatticeFoldability(), count)
    for seed in range(20):
        with contextlib.suppress(NoFoldError, NoTreeError):
            solve(
                problem,
                seed,
                judge,
                Effort(restarts=3, starts=1, polish_each=0, polish_best=0),
                stop=lambda: len(judge.missed) >= count,
            )
        if len(judge.missed) >= count:
            break
    return judge.missed


def tree_of(system: Any) -> Any:
    """Fold tree of a hinge system of single hinges."""
    from fabfold.fold.system_kinematics import poses_at
    from fabfold.lattice.template import Template
    from fabfold.tree.fold_tree import Body, Edge, FoldTree, Hinge

    cells, owner = np.asarray(system.cells), np.asarray(system.body)
    index = {tuple(cell): i for i, cell in enumerate(cells.tolist())}
    faces = np.concatenate([np.eye(3, dtype=int), -np.eye(3, dtype=int)])
    near = [
        (i, index[tuple(cell)])
        for i in range(len(cells))
        for cell in (cells[i] + faces).tolist()
        if tuple(cell) in index
    ]
    edges, hinges = [], []
    reached: set[int] = set()
    for body in range(len(system.parent) + 1):
        mine = np.flatnonzero(owner == body).tolist()
        reached.add(mine[0])
        while not reached.issuperset(mine):
            i, j = next(
                (i, j)
                for i, j in near
                if i in reached and j not in reached and owner[j] == body
                if owner[i] == body
            )
            edges.append(Edge(i, j, "R"))
            reached.add(j)
    for h, parent in enumerate(system.parent.tolist()):
        middle, axis = system.point2[h] / 2.0, np.eye(3, dtype=int)[system.axis[h]]
        i, j = next(
            (i, j)
            for i, j in near
            if owner[i] == parent
            and owner[j] == h + 1
            and abs((cells[i] + cells[j]) / 2 - middle).sum() == 0.5
            and abs((cells[i] + cells[j]) / 2 - middle) @ axis == 0
        )
        x, y, z = middle.tolist()
        angle = 90.0 * int(system.turns[h])
        hinges.append(
            Hinge(f"hinge-{h:02d}", parent, h + 1, (x, y, z), tuple(axis.tolist()), angle)
        )
        edges.append(Edge(i, j, "S", (h,)))
    pose = poses_at(system, np.asarray(system.turns, dtype=float))[owner]
    target = np.rint(np.einsum("nij,nj->ni", pose[:, :3, :3], cells) + pose[:, :3, 3]).astype(int)
    shift = -target.min(axis=0)
    return FoldTree(
        template=Template("folded", (target + shift).astype(np.int32)),
        source=cells,
        target=(target + shift).astype(np.int32),
        orientation=np.rint(pose[:, :3, :3]).astype(np.int32),
        fill=np.ones(len(cells)),
        edges=tuple(edges),
        bodies=tuple(
            Body(f"body-{b:02d}", tuple(np.flatnonzero(owner == b).tolist()))
            for b in range(len(hinges) + 1)
        ),
        hinges=tuple(hinges),
        root_rotation=np.eye(3, dtype=np.int32),
        root_translation=shift.astype(np.int32),
        energy={"surface": 0.0, "count": 0.0, "total": 0.0},
    )


def prove(voxels: Any, system: Any, path: Any) -> str:
    """Build and certify; what came out, in words."""
    from fabfold.errors import FabfoldError
    from fabfold.fold.motion import motion_of
    from fabfold.joinery.build import build_bodies
    from fabfold.proof.certify import certify

    tree = tree_of(system)
    motion = motion_of(tree, path)
    try:
        made = build_bodies(voxels, tree, motion, voxel_mm=VOXEL_MM, clearance_mm=CLEARANCE_MM)
        proof = certify(
            tree,
            motion,
            [(body.vertices, body.faces) for body in made.bodies],
            voxel_mm=VOXEL_MM,
            origin_mm=made.origin_mm,
            min_gap_mm=GAP_MM,
        )
    except FabfoldError as error:
        return f"refused: {error}"
    lost = made.rounded_skin_mm3 + made.rounded_inside_mm3
    share = 100.0 * lost / (lost + sum(body.volume for body in made.bodies))
    return (
        f"certified {proof['min_gap_mm']} mm; {made.rounded_cells} cells, "
        f"{made.rounded_skin_mm3:.0f} mm³ of surface and {made.rounded_inside_mm3:.0f} mm³ inside, "
        f"{share:.2f} % of the volume"
    )


def main() -> None:
    """Command line."""
    from fabfold.fold.carving_plan import carved_path
    from fabfold.fold.core_sweep import CORE_HALF_SIDE
    from fabfold.fold.lattice_foldability import LatticeFoldability
    from fabfold.fold.lattice_planner import find_path
    from fabfold.voxels.voxel_files import load_voxels

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("voxels", type=Path)
    parser.add_argument("--template", required=True)
    parser.add_argument("--trees", type=int, default=8)
    parser.add_argument("--prove", type=int, default=3)
    given = parser.parse_args()
    voxels = load_voxels(given.voxels)
    missed = near_misses(voxels, given.template, given.trees)
    planned = carved = proven = 0
    for number, system in enumerate(missed):
        start = time.process_time()
        if LatticeFoldability().path(system) is not None:
            print(f"{number}: folds with whole cells after a longer look")
            continue
        planned += find_path(system, carve=CORE_HALF_SIDE).path is not None
        best = carved_path(system, voxels.subvoxels)
        if best is None:
            print(f"{number}: no path of cores that spares the hinges")
            continue
        carved += 1
        path, carving = best
        words = (
            f"{number}: {len(carving.clashes)} clashes, {np.count_nonzero(carving.lost)} cells, "
            f"{carving.lost.sum():.2f} cells of volume, {time.process_time() - start:.1f} s"
        )
        if proven < given.prove:
            proven += 1
            words += "; " + prove(voxels, system, path)
        print(words, flush=True)
    print(f"{len(missed)} near misses: {planned} plan with cores, {carved} can be carved")


if __name__ == "__main__":
    main()
