"""What it brings that two partly filled voxels may share a cell.

    python benchmarks/sharing.py VOXELS.npz --template box-4x4x4 [--seeds 8] [--prove]

The same seeds with and without sharing, a short search each. With ``--prove`` the best tree of
each seed that shares a cell is built and its path is certified on the bodies. Seconds are of the
processor.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fabfold.tree.candidate import Candidate
    from fabfold.voxels.voxel_model import Voxels


@dataclass(frozen=True)
class Run:
    """What one seed came to."""

    found: list[Candidate]
    seconds: float


def pairs(candidate: Candidate) -> int:
    """Cells of the box with two voxels."""
    target = candidate.tree.target.tolist()
    return len(target) - len({tuple(cell) for cell in target})


def searched(voxels: Voxels, template: str, share: bool, seeds: int) -> list[Run]:
    """A short search with each seed."""
    from fabfold.errors import NoSolutionError
    from fabfold.fold.lattice_foldability import LatticeFoldability
    from fabfold.lattice.shipped import load_template
    from fabfold.recipe.recipe_wishes import default_weights
    from fabfold.tree.effort import Effort
    from fabfold.tree.problem import from_features
    from fabfold.tree.solve import solve
    from fabfold.voxels.features import features

    problem = from_features(
        voxels, features(voxels), load_template(template), default_weights(), share=share
    )
    effort = Effort(polish_best=60, restarts=8, starts=2)
    runs = []
    for seed in range(seeds):
        start = time.process_time()
        try:
            found = solve(problem, seed, LatticeFoldability(), effort)
        except NoSolutionError:
            found = []
        runs.append(Run(found, time.process_time() - start))
    return runs


def proven(voxels: Voxels, candidate: Candidate) -> str:
    """The certified gap of the bodies of a tree, or why there is none."""
    from fabfold.errors import FabfoldError
    from fabfold.fold.motion import motion_of
    from fabfold.kit.stages import PlannedTree, build
    from fabfold.printing.print_mode import print_mode
    from fabfold.printing.profiles import load_profile
    from fabfold.progress import SilentProgress

    profile = load_profile("sla-tough").model_copy(update={"clearance_mm": 0.3, "min_gap_mm": 0.25})
    planned = PlannedTree(voxels, candidate.tree, motion_of(candidate.tree, candidate.path))
    try:
        mode = print_mode(profile, "in-place")
        made = build(planned, mode, 20.0, (), SilentProgress())
    except FabfoldError as error:
        return str(error)
    return f"{made.planned.motion.certificate['min_gap_mm']:.3f} mm"


def main() -> None:
    from fabfold.voxels.voxel_files import load_voxels

    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("voxels", nargs="+", type=Path, help="voxelizations (.npz)")
    parser.add_argument("--template", default="box-4x4x4")
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--prove", action="store_true")
    asked = parser.parse_args()
    print(
        "| voxels | share | seeds that fold | best energy | its hinges | cells shared | seconds |"
    )
    print("|---|---|---|---|---|---|---|")
    for path in asked.voxels:
        voxels = load_voxels(path)
        searched(voxels, asked.template, True, 1)  # compiled kernels are loaded
        for share in (False, True):
            runs = searched(voxels, asked.template, share, asked.seeds)
            best = min(
                (run.found[0] for run in runs if run.found),
                key=lambda candidate: candidate.energy["total"],
                default=None,
            )
            cells = [
                "no tree" if best is None else f"{best.energy['total']:.2f}",
                "" if best is None else str(len(best.tree.hinges)),
                " ".join(str(pairs(run.found[0])) for run in runs if run.found),
            ]
            print(
                f"| {path.stem} ({len(voxels)}) | {'yes' if share else 'no'} "
                f"| {sum(bool(run.found) for run in runs)} of {asked.seeds} | {cells[0]} "
                f"| {cells[1]} | {cells[2]} | {sum(run.seconds for run in runs):.0f} |",
                flush=True,
            )
            for seed, run in enumerate(runs if asked.prove else ()):
                sharing = [candidate for candidate in run.found if pairs(candidate)]
                if sharing:
                    print(f"seed {seed}, {pairs(sharing[0])} shared:", proven(voxels, sharing[0]))


if __name__ == "__main__":
    main()
