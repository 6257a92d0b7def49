"""What patience and guide bring the planner, on the trees that a polishing search asks about.

Usage: python benchmarks/planning.py [MODEL ...]   (default: sample:car sample:rabbit)
"""

from __future__ import annotations

import argparse
import json
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).parent
#: Name, and looks in turn until a path is found: patience, whether the search's guide leads it.
VARIANTS = (
    ("patience 400", ((400, False),)),
    ("patience 100", ((100, False),)),
    ("patience 40", ((40, False),)),
    ("patience 40, guided", ((40, True),)),
    ("patience 40, guided, then 100", ((40, True), (100, False))),
    ("patience 100, guided", ((100, True),)),
    ("patience 400, guided", ((400, True),)),
)


def asked(model: str, template: str, wanted: int, seed: int) -> list[Any]:
    """Hinge systems that phase B asks the planner about, with the steps it is given.

    Of the voxelizations that seeds take in turn, the first one of which a tree folds is polished.
    """
    from fabfold.errors import NoFoldError, NoTreeError
    from fabfold.fold.lattice_foldability import LatticeFoldability
    from fabfold.lattice.shipped import load_template
    from fabfold.recipe.recipe_wishes import default_weights
    from fabfold.samples.builtin import load_model
    from fabfold.search.voxelization_problems import search_order
    from fabfold.tree.effort import Effort
    from fabfold.tree.problem import from_features
    from fabfold.tree.solve import Statistics, solve
    from fabfold.voxels.features import features
    from fabfold.voxels.voxelize import voxelize

    target = load_template(template)
    found: list[Any] = []
    folds: list[Any] = []

    class Noting(LatticeFoldability):
        """Notes what is asked once a tree folds."""

        def estimate(self, system: Any, expansions: int, guide: Any = None) -> Any:
            if folds and guide is not None:
                found.append((system, guide))
            return super().estimate(system, expansions, guide)

    for voxels in search_order(voxelize(load_model(model), target, seed=1)):
        with suppress(NoFoldError, NoTreeError):
            solve(
                from_features(voxels, features(voxels), target, default_weights()),
                seed,
                Noting(),
                Effort(starts=1, polish_each=4000),
                Statistics(),
                folds.append,
                lambda: len(found) >= wanted,
            )
        if folds:
            break
    return found[:wanted]


def measure(systems: list[Any]) -> list[dict[str, Any]]:
    """Found paths and CPU milliseconds of each variant, the same systems in the same order."""
    from fabfold.fold.lattice_planner import find_path

    rows = []
    for name, looks in VARIANTS:
        find_path(systems[0][0], 10, 10, short=False)
        found = expansions = 0
        begin = time.process_time()
        for system, guide in systems:
            for patience, guided in looks:
                plan = find_path(
                    system, 2500, patience, short=False, guide=guide if guided else None
                )
                expansions += plan.expansions
                if plan.remaining == 0:
                    found += 1
                    break
        took = time.process_time() - begin
        rows.append(
            {
                "variant": name,
                "found": found,
                "of": len(systems),
                "ms": round(1e3 * took / len(systems), 2),
                "expansions": round(expansions / len(systems)),
            }
        )
    return rows


def main() -> None:
    """Measure the models and write ``planning.md`` and ``planning.json``."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("models", nargs="*", default=["sample:car", "sample:rabbit"])
    parser.add_argument("--template", default="box-4x4x4")
    parser.add_argument("--systems", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=HERE / "planning.md")
    given = parser.parse_args()
    lines = [
        "# Planning along a known path",
        "",
        "Trees that phase B asks about; CPU time of one process, mean of all trees. "
        "Guided: by the steps of the tree that was changed.",
        "",
        "| model | hinges | planner | paths found | expansions | ms a tree | against the first |",
        "|---|---|---|---|---|---|---|",
    ]
    results = {}
    for model in given.models:
        systems = asked(model, given.template, given.systems, given.seed)
        if not systems:
            print(f"{model}: nothing folded, so that nothing was asked; try another --seed")
            continue
        rows = results[Path(model).name] = measure(systems)
        hinges = float(np.mean([len(system.parent) for system, _ in systems]))
        for row in rows:
            share = row["ms"] / rows[0]["ms"]
            lines.append(
                f"| {Path(model).name} | {hinges:.0f} | {row['variant']} | {row['found']} of "
                f"{row['of']} | {row['expansions']} | {row['ms']} | {share:.2f} |"
            )
    text = "\n".join(lines) + "\n"
    print(text)
    given.out.write_text(text, encoding="utf-8")
    content = json.dumps(results, indent=1) + "\n"
    given.out.with_suffix(".json").write_text(content, encoding="utf-8")


if __name__ == "__main__":
    main()
