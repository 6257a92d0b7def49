"""Which voxelizations are searched, and why those: benchmarks/voxel_choice.md.

    python benchmarks/voxel_choice.py [NAME ...] [--models DIR]
    python benchmarks/voxel_choice.py --trees [NAME ...]

Each model is cut twice in one process: once as the voxelizations of most fill come, once as those
of the least openness. With ``--trees`` many voxelizations of a model are searched, two seeds each,
and the energy of their trees is explained by what is known of the voxels before; the figures are
kept in ``voxel_choice.json``. Names as in ``energies.py``; models that are not there are left out.
The page is written where all are measured.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np
from runs import MODELS, SHARED

from fabfold.kit.box_closure import closing_rate, open_faces
from fabfold.kit.kit import Kit
from fabfold.progress import SilentProgress
from fabfold.search.seeds import Job, run_seed
from fabfold.search.voxelization_problems import VoxelizationProblems
from fabfold.solid.own_axes import own_axes
from fabfold.tree.bound import closed_share, visible_faces
from fabfold.voxels.grid_placement import grid_rotations
from fabfold.voxels.offsets import CellEnergy
from fabfold.voxels.refined_grid import unlike
from fabfold.voxels.refinement import PITCHES, Refinement
from fabfold.voxels.voxelize import MAX_LOSS, fill_shares, voxelize
from fabfold.wishes.wish_list import Wishes

PAGE = Path(__file__).resolve().parent / "voxel_choice.md"
KEPT = PAGE.with_suffix(".json")
NAMES = ("sample car", "sample duck", "sample rabbit", "bunny", "kitten", "dragon", "car")
#: Models whose voxelizations are searched, how many of them, and seeds of each.
TREES, VOXELIZATIONS, SEEDS = ("bunny", "kitten", "dragon"), 16, (1, 2)
#: What explains the energy: name and columns.
REASONS = (
    ("fill", ("fill",)),
    ("faces that must stay open", ("open",)),
    ("faces, space", ("open", "space")),
    ("faces, space, number of voxels", ("open", "space", "voxels")),
    ("openness: faces + space", ("openness",)),
)


def kit_of(name: str, models: Path) -> Kit:
    """The kit of a named model, nothing made yet; single hinges, which trees are searched with."""
    model = MODELS[name]
    source = model.where(models)
    assert source is not None
    return Kit.from_model(source, template=model.template, joints="S", workers=1)


def known(voxels: Any, kit: Kit) -> dict[str, float]:
    """What is known of voxels before they are searched."""
    least = (1.0 - closing_rate(kit.recipe, kit.template)(voxels)) * visible_faces(kit.template)
    space = len(voxels) - float(voxels.fill.sum())
    return {
        "voxels": len(voxels),
        "fill": float(voxels.fill.sum()),
        "open": least,
        "space": space,
        "openness": least + space,
        "lost": voxels.lost_volume,
    }


def row(name: str, models: Path) -> str:
    """The sizes that pay by fill and by openness, and processor seconds."""
    kit = kit_of(name, models)
    solid, template = kit.solid(), kit.template
    cells, seconds = [], []
    voxelize(solid, template, seed=1, placements=2, shortlist=1, results=1)  # compiles
    for judge in (None, open_faces(kit.recipe, template)):
        start = time.process_time()
        found = voxelize(solid, template, seed=1, open_faces=judge)
        seconds.append(time.process_time() - start)
        facts = sorted((known(v, kit) for v in found), key=lambda fact: fact["openness"])
        told = [
            f"{fact['voxels']}: {1 - fact['open'] / visible_faces(template):.3f} "
            f"({fact['openness']:.1f})"
            for fact in facts[:3]
        ]
        cells.append(", ".join(told))
    return f"| {name} | {cells[0]} | {cells[1]} | {seconds[0]:.1f} | {seconds[1]:.1f} |"


def many_voxels(kit: Kit) -> list[Any]:
    """Voxelizations of the two fullest sizes, as different as they come, by openness."""
    solid, template = kit.solid(), kit.template
    axes = own_axes(solid.vertices, solid.faces)
    solid = solid.in_axes(axes)
    search = Refinement(
        solid, axes, template, grid_rotations(100, 1, solid.vertices), CellEnergy(), 4
    )
    pitch, _ = search.pilot(0.1)
    assert pitch is not None
    pitches = pitch * 1.03 ** np.arange(-5, 3)
    ranked = search.rank(pitches, 0, 1, SilentProgress())
    turns = [item.rotation for item in ranked]
    taken = []
    for share in fill_shares(len(template))[:2]:
        here = search.with_share(share)
        items = here.rank_again(turns, pitches * share ** (-1 / 3))
        grids = [grid for item in items for grid in here.refine(item, PITCHES, False)]
        for grid in unlike(grids, [], len(grids))[::3]:
            voxels, _, _ = here.cut(grid)
            if voxels is not None and voxels.lost_volume < MAX_LOSS:
                taken.append(voxels)
    return sorted(taken, key=lambda voxels: known(voxels, kit)["openness"])


def trees_of(name: str, models: Path) -> list[dict[str, float]]:
    """Search voxelizations of a model that lie far apart in their openness."""
    kit = kit_of(name, models)
    found = many_voxels(kit)
    # Half of them the best, the others evenly down to the worst.
    half = VOXELIZATIONS // 2
    spread = np.linspace(half, len(found) - 1, half).astype(int)
    chosen = [found[k] for k in (*range(half), *spread)]
    problems = VoxelizationProblems(kit.recipe, kit.template, chosen, Wishes())
    rows = []
    for option in problems.plain:
        voxels = problems.options[option]
        job = problems.job(option, 1)
        if not isinstance(job, Job):
            continue
        results = [run_seed(job, seed, lambda _: None, lambda: False) for seed in SEEDS]
        best = [min(r.candidates, key=lambda c: c.energy["total"]) for r in results if r.candidates]
        if best:
            rows.append(
                known(voxels, kit)
                | {
                    "energy": float(np.mean([c.energy["total"] for c in best])),
                    "hinges": float(np.mean([len(c.tree.hinges) for c in best])),
                    "closed": float(np.mean([closed_share(c.tree) for c in best])),
                }
            )
            print(name, {k: round(v, 3) for k, v in rows[-1].items()}, flush=True)
    return rows


def explained(rows: dict[str, list[dict[str, float]]]) -> list[str]:
    """How much of the energy's differences, within each model, the reasons explain."""
    names = list(rows)
    model = np.array([names.index(name) for name in names for _ in rows[name]])
    flat = [fact for name in names for fact in rows[name]]

    def centred(column: str) -> Any:
        """A column less its mean over the voxelizations of the same model."""
        values = np.array([fact[column] for fact in flat])
        means = np.bincount(model, values) / np.bincount(model)
        return values - means[model]

    energy = centred("energy")
    lines = ["| what is known | energy for one more of each | explained |", "|---|---|--:|"]
    for told, columns in REASONS:
        matrix = np.column_stack([centred(column) for column in columns])
        slopes, *_ = np.linalg.lstsq(matrix, energy, rcond=None)
        share = 1.0 - ((energy - matrix @ slopes) ** 2).sum() / (energy**2).sum()
        slope = ", ".join(f"{value:+.2f}" for value in slopes)
        lines.append(f"| {told} | {slope} | {100 * share:.0f} % |")
    return lines


def page(choice: list[str], rows: dict[str, list[dict[str, float]]]) -> str:
    """The page of both parts."""
    count = sum(map(len, rows.values()))
    lines = [
        "# Which voxelizations are searched",
        "",
        "Written by `python benchmarks/voxel_choice.py`.",
        "",
        "## Why those of the least openness",
        "",
        f"{count} voxelizations of {', '.join(rows)} (`--trees`), {len(SEEDS)} seeds each; single",
        "hinges. *Faces* is the number of faces of the box that must stay open with these voxels,",
        "whatever the joints; *space* is the number of cells less their material (Eq. 1);",
        "*explained* is the share of the energy's variance within each model.",
        "",
        *explained(rows),
        "",
        "## Which they are",
        "",
        "Of eight voxelizations those three of the least openness: number of voxels, the share to",
        "which they could close the box at most, and the openness in brackets (the lower the",
        "better; what is lost is not counted here). Left: voxelizations of most fill. Right: those",
        "that are searched. Processor seconds of cutting.",
        "",
        "| model | most fill | least openness | s | s |",
        "|---|---|---|--:|--:|",
        *choice,
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("names", nargs="*")
    parser.add_argument("--trees", action="store_true")
    parser.add_argument("--models", type=Path, default=SHARED)
    options = parser.parse_args()
    names = tuple(options.names) or (TREES if options.trees else NAMES)
    rows = json.loads(KEPT.read_text("utf-8")) if KEPT.is_file() else {}
    choice = []
    for name in names:
        if MODELS[name].where(options.models) is None:
            continue
        if options.trees:
            rows[name] = trees_of(name, options.models)
            KEPT.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
        else:
            choice.append(row(name, options.models))
            print(choice[-1], flush=True)
    if names == NAMES and rows:
        PAGE.write_text(page(choice, rows), encoding="utf-8")


if __name__ == "__main__":
    main()
