"""All wishes of a recipe together, as the two inputs that the tree search takes.

These are an energy for each voxel at each pose (:meth:`Wishes.extra_cost`), and groups of voxels
that stay one body (:meth:`Wishes.protected`). What became of each wish in a tree is reported
afterwards. One module for each wish does the work: ``keep``, ``protect``, ``void`` and
``joints_inside``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fabfold.lattice.template import Template
from fabfold.solid.regions import Region
from fabfold.tree.fold_tree import FoldTree
from fabfold.tree.problem import TreeProblem
from fabfold.voxels.features import Features
from fabfold.voxels.voxel_model import Voxels
from fabfold.wishes.joints_inside import joints_inside_report
from fabfold.wishes.keep import Keep, KeptShare, add_keep_cost, keep_root_poses, kept_share
from fabfold.wishes.protect import ProtectedRegion, protect_report, protected_region
from fabfold.wishes.void import add_void_cost, void_report

__all__ = ["Wishes"]


@dataclass(frozen=True)
class Wishes:
    """All wishes of a recipe, sampled on its model.

    Attributes
    ----------
    keeps : tuple of Keep
        Parts of the surface that shall be seen on a side of the box.
    keep_weight : float
        Energy of one face's worth of kept area that is not where it shall be.
    regions : tuple of Region
        Regions that no cut may cross.
    void : float
        From -1, empty space at the surface, to 1, empty space inside; 0 says nothing.
    void_weight : float
        Energy of an empty cell in the wrong place at full `void`.
    """

    keeps: tuple[Keep, ...] = ()
    keep_weight: float = 0.3
    regions: tuple[Region, ...] = ()
    void: float = 0.0
    void_weight: float = 0.3

    def extra_cost(self, voxels: Voxels, template: Template) -> NDArray[np.float32] | None:
        """Energy that wishes add for each voxel at each pose.

        Parameters
        ----------
        voxels : Voxels
            The voxelization.
        template : Template
            The shape to fill.

        Returns
        -------
        (n, 24 m) float32 array or None
            By voxel and pose, ``24 * template cell + rotation``; None where no wish has a price.
        """
        if not (self.keeps and self.keep_weight) and not self.void:
            return None
        total = np.zeros((len(voxels), len(template), 24))
        for keep in self.keeps:
            add_keep_cost(total, keep, self.keep_weight, voxels, template)
        if self.void:
            add_void_cost(total, self.void, self.void_weight, voxels, template)
        return np.asarray(total.reshape(len(voxels), -1), dtype=np.float32)

    def protected(
        self, voxels: Voxels, features: Features, template: Template
    ) -> list[ProtectedRegion]:
        """The voxels that each protected region keeps together.

        Parameters
        ----------
        voxels : Voxels
            The voxelization.
        features : Features
            Its printable joints.
        template : Template
            The shape to fill.

        Returns
        -------
        list of ProtectedRegion
            One for each region.

        Raises
        ------
        NoTreeError
            If a region's voxels cannot be one printed piece, or fit the template nowhere.
        """
        return [protected_region(region, voxels, features, template) for region in self.regions]

    def with_roots(self, problem: TreeProblem, voxels: Voxels, template: Template) -> TreeProblem:
        """The problem with the root poses that kept parts want.

        Parameters
        ----------
        problem : TreeProblem
            A problem of `voxels` and `template`.
        voxels : Voxels
            The voxelization.
        template : Template
            The shape to fill.

        Returns
        -------
        TreeProblem
            The same one where nothing is kept, or it has roots already.

        Raises
        ------
        NoTreeError
            If the checkerboard colours rule every tree out.
        """
        if problem.roots is not None or not self.keeps:
            return problem
        colours = problem.colourings()
        if not self.keep_weight:
            return problem
        return replace(problem, roots=keep_root_poses(self.keeps, voxels, template, colours))

    def kept(self, voxels: Voxels, tree: FoldTree) -> list[KeptShare]:
        """How much of each kept part a tree shows where it was wished to be.

        Parameters
        ----------
        voxels : Voxels
            The voxelization that the tree joins.
        tree : FoldTree
            A tree of any search.

        Returns
        -------
        list of KeptShare
            One for each kept part.
        """
        return [kept_share(keep, voxels, tree) for keep in self.keeps]

    def report(self, voxels: Voxels, tree: FoldTree) -> list[dict[str, Any]]:
        """What became of each wish.

        Parameters
        ----------
        voxels : Voxels
            The voxelization that the tree joins.
        tree : FoldTree
            A tree of any search.

        Returns
        -------
        list of dict
            For each wish its words, its figures and a line of text (JSON-ready).
        """
        found: list[dict[str, Any]] = []
        for kept in self.kept(voxels, tree):
            figures = {"share": round(kept.share, 4), "voxels": kept.voxels, "of": kept.of}
            found.append({"wish": f"keep {kept.text}", **figures, "text": str(kept)})
        for region in self.regions:
            found.append(protect_report(region, voxels, tree))
        if self.void:
            found.append(void_report(tree))
        if tree.template.joints == "inside":
            found.append(joints_inside_report(tree))
        return found
