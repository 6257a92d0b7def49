"""Wishes of ``--protect``: regions of the model that no cut may cross.

All voxels that hold a piece of a region stay one rigid body. That is a hard rule of the search:
:func:`rigid_pairs` gives the pairs of voxels that must stay rigid. Voxelizations in which the rule
cannot be kept are left out, and those that keep regions in few voxels are searched first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import NoSolutionError, NoTreeError
from fabfold.lattice.rotations import ROTATIONS
from fabfold.lattice.template import Template
from fabfold.solid.regions import Region
from fabfold.tree.fold_tree import FoldTree
from fabfold.voxels.features import Features
from fabfold.voxels.region_cells import containing_voxels
from fabfold.voxels.voxel_model import Voxels

__all__ = [
    "ProtectedRegion",
    "protect_report",
    "protected_region",
    "rank_by_cuts",
    "rigid_pairs",
]

#: Share of a protected piece that may lie in slivers beyond a cut.
SLIVERS = 0.01


@dataclass(frozen=True)
class ProtectedRegion:
    """A protected region in a voxelization.

    Attributes
    ----------
    text : str
        The region as it was written.
    groups : tuple of tuple of int
        Voxels that must stay one body, for each piece of the region; a piece within one voxel has
        a group of one.
    """

    text: str
    groups: tuple[tuple[int, ...], ...]


def protected_region(
    region: Region, voxels: Voxels, features: Features, template: Template
) -> ProtectedRegion:
    """The voxels that a protected region keeps together.

    Parameters
    ----------
    region : Region
        The region, sampled on its model.
    voxels : Voxels
        The voxelization.
    features : Features
        Its printable joints.
    template : Template
        The shape to fill.

    Returns
    -------
    ProtectedRegion
        Groups of voxels.

    Raises
    ------
    NoTreeError
        If the region's voxels cannot be one printed piece, or fit the template nowhere.
    """
    import networkx

    found = networkx.Graph()
    joinable = networkx.Graph()
    joinable.add_nodes_from(range(len(voxels)))
    joinable.add_edges_from(features.pairs[features.rigid].tolist())
    for points in region.pieces:
        holder = containing_voxels(voxels, points)
        inside = np.bincount(holder[holder >= 0], minlength=len(voxels))
        if not inside.any():
            continue
        order = np.argsort(-inside, kind="stable")
        held = np.cumsum(inside[order])
        # The fewest voxels that hold all of it but slivers.
        count = int(np.searchsorted(held, (1.0 - SLIVERS) * held[-1])) + 1
        group = sorted(order[:count].tolist())
        _check_joinable(region.text, group, joinable, voxels)
        networkx.add_path(found, group)
        found.add_node(group[0])
    groups = sorted(tuple(sorted(part)) for part in networkx.connected_components(found))
    for whole in groups:
        _check_fits(region.text, voxels.cells[list(whole)], template)
    return ProtectedRegion(region.text, tuple(groups))


def _check_joinable(text: str, group: list[int], joinable: Any, voxels: Voxels) -> None:
    """Refuse voxels that cannot be one printed piece; `joinable` is a graph of rigid joints."""
    import networkx

    parts = list(networkx.connected_components(joinable.subgraph(group)))
    if len(parts) > 1:
        least = min(parts, key=len)
        raise NoTreeError(
            f"protect {text}: its {len(group)} voxels cannot be printed as one piece, "
            f"{len(least)} of them (first: cell {voxels.cells[min(least)].tolist()}) touch the "
            "others by too little material; make the region smaller or larger, or place the grid "
            "by hand (--rotation, --origin, --pitch)"
        )


def _check_fits(text: str, cells: NDArray[np.int32], template: Template) -> None:
    """Refuse cells that fit the template in no rotation and at no place."""
    free = template.occupancy()
    for rotation in ROTATIONS:
        turned = cells @ rotation.T
        turned = turned - turned.min(axis=0)
        size = turned.max(axis=0) + 1
        for corner in np.ndindex(*np.maximum(np.array(free.shape) - size + 1, 0)):
            if free[tuple((turned + corner).T)].all():
                return
    extent = " x ".join(str(value) for value in np.ptp(cells, axis=0) + 1)
    raise NoTreeError(
        f"protect {text}: the {len(cells)} voxels that it keeps together ({extent}) fit template "
        f"{template.name!r} nowhere; make the region smaller, or take a larger template"
    )


def rigid_pairs(regions: Sequence[ProtectedRegion], features: Features) -> NDArray[np.bool_] | None:
    """Pairs of voxels that no cut may part.

    Parameters
    ----------
    regions : sequence of ProtectedRegion
        Protected regions in the voxelization of `features`.
    features : Features
        Printable joints of the voxelization.

    Returns
    -------
    (k,) bool array or None
        For each of the k pairs of `features`; None where there is no such pair.
    """
    found = np.zeros(len(features.pairs), dtype=bool)
    for region in regions:
        for group in region.groups:
            found |= np.isin(features.pairs, group).all(axis=1) & features.rigid
    return found if found.any() else None


def rank_by_cuts(
    regions: Sequence[Region], options: Sequence[tuple[Voxels, Features]], template: Template
) -> list[int]:
    """Voxelizations that a search can use; those with protected regions in few voxels first.

    Parameters
    ----------
    regions : sequence of Region
        Protected regions.
    options : sequence of (Voxels, Features)
        Voxelizations and their printable joints.
    template : Template
        The shape to fill.

    Returns
    -------
    list of int
        Indices of `options`.

    Raises
    ------
    NoTreeError
        The first one's reason, where none can be used.
    """
    price: list[tuple[int, int]] = []
    why: NoSolutionError | None = None
    for index, (voxels, found) in enumerate(options):
        try:
            held = [protected_region(region, voxels, found, template) for region in regions]
        except NoTreeError as error:
            why = why or error
            continue
        price.append((sum(len(g) - 1 for region in held for g in region.groups), index))
    if not price and why is not None:
        raise why
    return [index for _, index in sorted(price)]


def protect_report(region: Region, voxels: Voxels, tree: FoldTree) -> dict[str, Any]:
    """What became of a protected region in a tree.

    Parameters
    ----------
    region : Region
        The region, sampled on its model.
    voxels : Voxels
        The voxelization that the tree joins.
    tree : FoldTree
        A tree of any search.

    Returns
    -------
    dict
        The wish, the bodies that hold most of each piece, the least share of a piece that is in
        one body, and a line of text (JSON-ready).
    """
    body = tree.voxel_body
    names: list[str] = []
    shares: list[float] = []
    for points in region.pieces:
        holder = containing_voxels(voxels, points)
        counts = np.bincount(body[holder[holder >= 0]], minlength=len(tree.bodies))
        if counts.any():
            names.append(tree.bodies[int(counts.argmax())].name)
            shares.append(float(counts.max() / counts.sum()))
    share = min(shares, default=1.0)
    where = ", ".join(dict.fromkeys(names)) or "nothing that is printed"
    return {
        "wish": f"protect {region.text}",
        "bodies": names,
        "share": round(share, 4),
        "text": f"protect {region.text}: {share:.1%} of it whole, in {where}",
    }
