"""What became of the wishes of a recipe in the tree and in the printed bodies."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fabfold.joinery.bodies import Joinery
from fabfold.kit.stages import PlannedTree
from fabfold.voxels.region_cells import containing_voxels, to_lattice
from fabfold.voxels.voxel_model import Voxels
from fabfold.wishes.wish_list import Wishes

__all__ = ["printed_share", "wish_report"]


def printed_share(points: NDArray[np.float64], voxels: Voxels, joinery: Joinery) -> float:
    """Share of points of the model (k, 3) that lie in printed material.

    Hinge barrels that pass by on the folding path need grooves, and bodies stand apart by a gap:
    both can take a little even of a protected region.
    """
    from fabfold.solid.scan import scan_mesh

    holder = containing_voxels(voxels, points)
    held = points[holder >= 0]
    if not len(held):
        return 0.0
    at = np.array(joinery.origin_mm) + joinery.voxel_mm * to_lattice(voxels, held)
    step = joinery.voxel_mm / 80
    low = at.min(axis=0) - step
    size = np.ceil((at.max(axis=0) - low) / step).astype(int) + 1
    step *= max(1.0, float(np.cbrt(np.prod(size.astype(float)) / 20_000_000)))
    x, y, z = (np.ceil((at.max(axis=0) - low) / step).astype(int) + 1).tolist()
    index = tuple(np.floor((at - low) / step).astype(int).T)
    inside = np.zeros(len(at), dtype=bool)
    for body in joinery.bodies:
        apart = (body.vertices.min(axis=0) > at.max(axis=0)) | (
            body.vertices.max(axis=0) < at.min(axis=0)
        )
        if not apart.any():
            grid = scan_mesh((body.vertices - low) / step, body.faces, (x, y, z))
            inside |= np.asarray(grid)[index]
    return float(inside.mean())


def wish_report(
    wishes: Wishes, planned: PlannedTree, joinery: Joinery | None = None
) -> list[dict[str, Any]]:
    """What became of each wish in a tree and its bodies: figures and a line of text."""
    found = wishes.report(planned.voxels, planned.tree)
    if joinery is not None:
        entries = {entry["wish"]: entry for entry in found}
        for region in wishes.regions:
            points = np.concatenate(region.pieces)
            share = printed_share(points, planned.voxels, joinery)
            entry = entries[f"protect {region.text}"]
            entry["printed"] = round(share, 4)
            entry["text"] += f"; grooves and gaps leave {share:.1%} of it"
    return found
