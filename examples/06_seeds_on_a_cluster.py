"""Several seeds on a cluster, and the best of them.

    python examples/06_seeds_on_a_cluster.py [FOLDER]

A search has many tasks that know nothing of each other, and Dask can run them on any machine. Here
the cluster is two processes on this one; with ``scheduler="tcp://HOST:8786"`` it is a room full of
computers. The result is the same. ``pip install 'fabfold[cluster]'`` installs what it needs.
"""

import sys
from pathlib import Path

import trimesh
from distributed import LocalCluster

from fabfold import Kit

SEEDS = (1, 2)


def main(folder: str = "seeds") -> None:
    home = Path(folder)
    home.mkdir(parents=True, exist_ok=True)
    beam = home / "beam.stl"
    trimesh.creation.box((90.0, 20.0, 20.0)).export(beam)

    # Workers with one thread each: a search keeps a process busy.
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        kits = [
            Kit.from_model(
                beam,
                template="box-3x3x4",
                effort="quick",
                rotation=(0, 0, 0),  # the same 36 voxels for all, see example 02
                origin=(0, 5, 5),
                pitch=10,
                seed=seed,
                scheduler=cluster.scheduler_address,
            )
            for seed in SEEDS
        ]
        for kit in kits:
            tree = kit.fold().tree
            print(
                f"seed {kit.recipe.seed}: {len(tree.source)} voxels, {len(tree.hinges)} hinges, "
                f"energy {tree.energy['total']:.3f}"
            )

        # The lower the energy, the fewer the hinges and the smoother the box.
        best = min(kits, key=lambda kit: kit.fold().tree.energy["total"])
        where = best.export(home / f"beam-kit-{best.recipe.seed}")
        print(f"The kit of seed {best.recipe.seed} is the best; it is in {where}.")


if __name__ == "__main__":
    main(*sys.argv[1:])
