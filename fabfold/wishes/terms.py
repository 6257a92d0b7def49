"""What a maker may wish for beyond the paper's two energies.

Sides of the model that shall be seen on the box, regions that no cut may cross, and where the
empty space goes. All of it comes down to two inputs of the tree search: an energy for each voxel at
each pose, and pairs of voxels that stay one piece.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import NoSolutionError, NoTreeError
from fabfold.lattice.rotations import FACES, ROTATIONS
from fabfold.lattice.template import Template
from fabfold.solid.regions import Region, SurfaceSamples
from fabfold.tree.fold_tree import FoldTree
from fabfold.tree.problem import TreeProblem
from fabfold.voxels.features import Features
from fabfold.voxels.region_cells import containing_voxels
from fabfold.voxels.voxel_model import Voxels

__all__ = [
    "Keep",
    "Kept",
    "Uncut",
    "Wishes",
    "faces_shown",
    "hinges_outside",
    "rank_by_cuts",
    "uncut_pairs",
]

#: Share of a protected piece that may lie in slivers beyond a cut.
SLIVERS = 0.01


@dataclass(frozen=True)
class Keep:
    """A part of the model's surface that shall be seen on one side of the box.

    Attributes
    ----------
    text : str
        As it was written.
    area : SurfaceSamples
    side : int
        Side of the template, as an index of :data:`fabfold.lattice.rotations.FACES`.
    """

    text: str
    area: SurfaceSamples
    side: int

    def by_voxel(self, voxels: Voxels) -> tuple[NDArray[np.float64], float]:
        """Area of each voxel as seen from each of its faces in A, (n, 6), and the whole area.

        Both in faces of a voxel. A direction between two faces counts for each by the square of
        its cosine, so the shares of a sample add up to 1.
        """
        seen = np.maximum((self.area.outward @ voxels.rotation.T) @ FACES.T, 0.0) ** 2
        holder = containing_voxels(voxels, self.area.points)
        share = np.zeros((len(voxels), 6))
        held = holder >= 0
        unit = voxels.pitch**2
        np.add.at(share, holder[held], seen[held] * self.area.weight[held, None] / unit)
        return share, float(self.area.weight.sum()) / unit


@dataclass(frozen=True)
class Kept:
    """How much of a kept part is where it was wished to be.

    Attributes
    ----------
    text : str
    share : float
        Of the part's area, on that side of the box and facing outwards.
    voxels : int
        Voxels that show some of it there.
    of : int
        Voxels that hold some of it.
    """

    text: str
    share: float
    voxels: int
    of: int

    def __str__(self) -> str:
        return (
            f"keep {self.text}: {self.share:.0%} of its area is there, "
            f"{self.voxels} of {self.of} voxels"
        )


@dataclass(frozen=True)
class Uncut:
    """A protected region in a voxelization.

    Attributes
    ----------
    text : str
    groups : tuple of tuple of int
        Voxels that must stay one body, for each piece of the region; a piece within one voxel has
        a group of one.
    """

    text: str
    groups: tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class Wishes:
    """All wishes of a recipe, sampled on its model.

    Attributes
    ----------
    keeps : tuple of Keep
    keep_weight : float
        Energy of one face's worth of kept area that is not where it shall be.
    regions : tuple of Region
        That no cut may cross.
    void : float
        From -1, empty space at the surface, to 1, empty space inside; 0 says nothing.
    void_weight : float
        Energy of an empty cell in the wrong place at full `void`.
    """

    keeps: tuple[Keep, ...] = ()
    keep_weight: float = 0.3
    regions: tuple[Region, ...] = ()
    void: float = 0.0
    void_weight: float = field(default=0.3)

    def __bool__(self) -> bool:
        return bool(self.keeps or self.regions or self.void)

    def bias(self, voxels: Voxels, template: Template) -> NDArray[np.float32] | None:
        """Energy of each voxel at each pose, (n, 24 m); None where nothing is wished.

        A kept part costs `keep_weight` for each face's worth of it that is not shown, so 0 is the
        best there is. The energy of empty space is counted from a full template.
        """
        if not (self.keeps and self.keep_weight) and not self.void:
            return None
        shown, on_side = faces_shown(), _open(template)
        total = np.zeros((len(voxels), len(template), 24))
        for keep in self.keeps:
            share, _ = keep.by_voxel(voxels)
            # Face shown[r, f] of the voxel in A is face f of its cell in B.
            gain = share[:, shown[:, keep.side]]
            total += self.keep_weight * share.sum(axis=1)[:, None, None]
            total -= self.keep_weight * gain[:, None, :] * on_side[None, :, keep.side, None]
        if self.void:
            visible = on_side.any(axis=1)
            price = self.void_weight * np.where(visible, max(self.void, 0.0), max(-self.void, 0.0))
            # Material in a dear cell is worth what its emptiness would cost.
            total -= (voxels.fill[:, None] * price[None, :])[:, :, None]
        return np.asarray(total.reshape(len(voxels), -1), dtype=np.float32)

    def anchors(
        self, voxels: Voxels, template: Template, colours: Sequence[int]
    ) -> NDArray[np.int32] | None:
        """Where growing shall begin: voxels with much of the largest kept part, shown as wished.

        Half turns never change which axis of the model lies along which axis of the box. A search
        that began with a wrong one could not keep anything.

        Parameters
        ----------
        voxels, template
        colours : sequence of int
            Colours of the cells that voxels of source colour 0 can take.

        Returns
        -------
        (k, 2) int32 array or None
            Voxels and poses; None where there is nothing to keep.
        """
        shares = [keep.by_voxel(voxels)[0] for keep in self.keeps]
        if not shares or not self.keep_weight:
            return None
        first = int(np.argmax([share.sum() for share in shares]))
        share, side = shares[first], self.keeps[first].side
        if not share.any():
            return None
        shown, on_side = faces_shown(), _open(template)
        rotations = np.ones(24, dtype=bool)
        for other, keep in zip(shares, self.keeps, strict=True):
            # Any turn that shows the part's main axis on the right axis of the box will do.
            axis = int(other.sum(axis=0).reshape(3, 2).sum(axis=1).argmax())
            fits = shown[:, keep.side] >> 1 == axis
            rotations &= fits if (rotations & fits).any() else True
        cells = np.flatnonzero(on_side[:, side])
        odd = (voxels.cells.sum(axis=1) % 2, template.cells.sum(axis=1) % 2)
        found = []
        for rotation in np.flatnonzero(rotations).tolist():
            here = share[:, shown[rotation, side]]
            for voxel in np.flatnonzero(here >= 0.5 * share.max()).tolist():
                fitting = [c for c in cells if (odd[1][c] - odd[0][voxel]) % 2 in colours]
                found += [(voxel, 24 * cell + rotation) for cell in fitting]
        return np.array(found, dtype=np.int32).reshape(-1, 2) if found else None

    def kept(self, voxels: Voxels, tree: FoldTree) -> list[Kept]:
        """How much of each kept part a tree shows where it was wished to be."""
        cells = {tuple(cell): k for k, cell in enumerate(tree.template.cells.tolist())}
        where = np.array([cells[tuple(cell)] for cell in tree.target.tolist()])
        on_side = _open(tree.template)
        result = []
        for keep in self.keeps:
            share, whole = keep.by_voxel(voxels)
            # The direction in A that comes to face the side in B.
            seen = np.einsum("nji,j->ni", tree.orientation, FACES[keep.side])
            face = (seen @ FACES.T).argmax(axis=1)
            gain = share[np.arange(len(share)), face] * on_side[where, keep.side]
            result.append(
                Kept(
                    keep.text,
                    float(gain.sum() / whole),
                    int((gain > 0.01).sum()),
                    int((share.sum(axis=1) > 0.01).sum()),
                )
            )
        return result

    def uncut(self, voxels: Voxels, features: Features, template: Template) -> list[Uncut]:
        """The voxels that each protected region keeps together.

        Raises
        ------
        NoTreeError
            If a region's voxels cannot be one printed piece, or find no room in the template.
        """
        return [_uncut(region, voxels, features, template) for region in self.regions]

    def report(self, voxels: Voxels, tree: FoldTree) -> list[dict[str, Any]]:
        """What became of each wish: its words, its figures and a line of text (JSON-ready)."""
        found: list[dict[str, Any]] = []
        for kept in self.kept(voxels, tree):
            figures = {"share": round(kept.share, 4), "voxels": kept.voxels, "of": kept.of}
            found.append({"wish": f"keep {kept.text}", **figures, "text": str(kept)})
        for region in self.regions:
            found.append(_protected(region, voxels, tree))
        if self.void:
            found.append(_emptiness(tree))
        if tree.template.joints == "inside":
            outside = hinges_outside(tree)
            text = f"joints inside: {outside} of {len(tree.hinges)} hinges lie on the surface"
            found.append({"wish": "joints inside", "outside": outside, "text": text})
        return found

    def apply(self, problem: TreeProblem, voxels: Voxels, template: Template) -> TreeProblem:
        """The problem with the places where growing shall begin."""
        if problem.roots is not None or not self.keeps:
            return problem
        return replace(problem, roots=self.anchors(voxels, template, problem.colourings()))

    def content(self) -> list[Any]:
        """Everything that a search depends on (JSON-ready), empty where nothing is wished."""
        if not self:
            return []
        return [
            [[keep.text, keep.side] for keep in self.keeps],
            self.keep_weight,
            [region.text for region in self.regions],
            [self.void, self.void_weight],
        ]


def faces_shown() -> NDArray[np.int64]:
    """Face in A that a rotation turns towards each face in B, shape (24, 6)."""
    return np.array(
        [[int(np.flatnonzero((d @ r == FACES).all(axis=1))[0]) for d in FACES] for r in ROTATIONS]
    )


def hinges_outside(tree: FoldTree) -> int:
    """Hinges that the folded box shows: a cell around their edge is no cell of the template."""
    cells = {tuple(cell) for cell in tree.template.cells.tolist()}
    root = np.eye(4)
    root[:3, :3], root[:3, 3] = tree.root_rotation, tree.root_translation
    poses = root @ tree.body_poses(tree.fold_angles)
    outside = 0
    for hinge in tree.hinges:
        pose = poses[hinge.parent]
        middle = pose[:3, :3] @ np.array(hinge.point) + pose[:3, 3]
        along = np.abs(pose[:3, :3] @ np.array(hinge.direction)).round().astype(bool)
        one, other = np.eye(3)[~along] / 2
        around = [middle + a * one + b * other for a in (1, -1) for b in (1, -1)]
        outside += any(tuple(np.rint(c).astype(int).tolist()) not in cells for c in around)
    return outside


def _protected(region: Region, voxels: Voxels, tree: FoldTree) -> dict[str, Any]:
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


def _emptiness(tree: FoldTree) -> dict[str, Any]:
    on_side = _open(tree.template)
    visible = {
        tuple(cell)
        for cell, open_ in zip(
            tree.template.cells.tolist(), np.any(on_side, axis=1).tolist(), strict=True
        )
        if open_
    }
    full: dict[tuple[int, ...], float] = {}
    for cell, share in zip(tree.target.tolist(), tree.fill.tolist(), strict=True):
        full[tuple(cell)] = full.get(tuple(cell), 0.0) + share
    empty = [0.0, 0.0]
    for cell in tree.template.cells.tolist():
        empty[tuple(cell) in visible] += 1.0 - full.get(tuple(cell), 0.0)
    return {
        "wish": "void",
        "inside": round(empty[0], 3),
        "surface": round(empty[1], 3),
        "text": f"empty space: {empty[0]:.2f} cells inside the box, {empty[1]:.2f} at its surface",
    }


def _open(template: Template) -> NDArray[np.bool_]:
    """Which faces of each cell lie on the outside of the template, (m, 6)."""
    grid = template.occupancy(pad=1)
    return np.stack([~grid[tuple((template.cells + 1 + d).T)] for d in FACES], axis=1)


def uncut_pairs(groups: Sequence[Uncut], features: Features) -> NDArray[np.bool_] | None:
    """Pairs of `features` that no cut may part; None where there is none."""
    stiff = np.zeros(len(features.pairs), dtype=bool)
    for region in groups:
        for group in region.groups:
            stiff |= np.isin(features.pairs, group).all(axis=1) & features.rigid
    return stiff if stiff.any() else None


def _uncut(region: Region, voxels: Voxels, features: Features, template: Template) -> Uncut:
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
        _check_group(region.text, group, joinable, voxels)
        networkx.add_path(found, group)
        found.add_node(group[0])
    groups = sorted(tuple(sorted(part)) for part in networkx.connected_components(found))
    for whole in groups:
        _check_room(region.text, voxels.cells[list(whole)], template)
    return Uncut(region.text, tuple(groups))


def _check_group(text: str, group: list[int], joinable: Any, voxels: Voxels) -> None:
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


def _check_room(text: str, cells: NDArray[np.int32], template: Template) -> None:
    room = template.occupancy()
    for rotation in ROTATIONS:
        turned = cells @ rotation.T
        turned = turned - turned.min(axis=0)
        size = turned.max(axis=0) + 1
        for corner in np.ndindex(*np.maximum(np.array(room.shape) - size + 1, 0)):
            if room[tuple((turned + corner).T)].all():
                return
    extent = " x ".join(str(value) for value in np.ptp(cells, axis=0) + 1)
    raise NoTreeError(
        f"protect {text}: the {len(cells)} voxels that it keeps together ({extent}) fit template "
        f"{template.name!r} nowhere; make the region smaller, or take a larger template"
    )


def rank_by_cuts(
    wishes: Wishes, options: Sequence[tuple[Voxels, Features]], template: Template
) -> list[int]:
    """Voxelizations that a search can use; those with protected regions in few voxels first.

    Raises
    ------
    NoTreeError
        The first one's reason, where none can be used.
    """
    price: list[tuple[int, int]] = []
    why: NoSolutionError | None = None
    for index, (voxels, found) in enumerate(options):
        try:
            regions = wishes.uncut(voxels, found, template)
        except NoTreeError as error:
            why = why or error
            continue
        price.append((sum(len(g) - 1 for region in regions for g in region.groups), index))
    if not price and why is not None:
        raise why
    return [index for _, index in sorted(price)]
