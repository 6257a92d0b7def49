"""Several seeds on a cluster, and the best of them.

    python examples/06_seeds_on_a_cluster.py [FOLDER]

Every seed of a search is a task of its own, and Dask can run it on any machine. Here the cluster is
two processes on this one; with ``scheduler="tcp://HOST:8786"`` it is a room full of computers. The
answer is the same. Install it with ``pip install 'fabfold[cluster]'``.
"""

import sys
from pathlib import Path

import trimesh
from distributed import LocalCluster

from fabfold import Kit

SEEDS = (1, 2, 3)


def main(folder: str = "seeds") -> None:
    home = Path(folder)
    home.mkdir(parents=True, exist_ok=True)
    bar = home / "bar.stl"
    trimesh.creation.box((120.0, 20.0, 10.0)).export(bar)

    kits = {}
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        for seed in SEEDS:
            kit = Kit.from_model(
                bar,
                template="box-2x3x4",
                effort="quick",
                seed=seed,
                scheduler=cluster.scheduler_address,
            )
            best = kit.fit()[0]  # each seed of a recipe begins a round of four on the cluster
            print(
                f"seed {seed}: {len(best.tree.hinges)} hinges, "
                f"surface {best.energy['surface']:.2f}, energy {best.energy['total']:.2f}"
            )
            kits[best.energy["total"], seed] = kit

    # The lower the energy, the fewer the hinges and the smoother the box.
    _, seed = min(kits)
    kit = kits[min(kits)]
    kit.scheduler = None
    where = kit.export(home / f"bar-kit-{seed}")
    print(f"The kit of seed {seed} is in {where}.")


if __name__ == "__main__":
    main(*sys.argv[1:])
