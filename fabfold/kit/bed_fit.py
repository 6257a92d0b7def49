"""The largest kit of a tree that a printer's bed holds: ``--fit-bed``."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fabfold.printing.print_mode import PrintMode
from fabfold.tree.fold_tree import FoldTree

if TYPE_CHECKING:
    from fabfold.kit.kit import Kit

__all__ = ["fitting_voxel", "largest_voxel"]

#: What barrels stand out beyond the cells of a body, on both sides together, in voxel sides.
_BARRELS = 0.3


def largest_voxel(tree: FoldTree, mode: PrintMode) -> float | None:
    """Largest voxel at which what is printed in one piece fits the bed.

    Parameters
    ----------
    tree : FoldTree
        Its cells in shape A.
    mode : PrintMode
        Printed as one, the whole has to fit; printed apart, each body by itself.

    Returns
    -------
    float or None
        Side of a voxel, mm, rounded down to 0.1; None where the profile names no bed.
    """
    bed = mode.profile.bed_mm
    if bed is None:
        return None
    pieces = [list(body.voxels) for body in tree.bodies if body.voxels]
    if not mode.apart:
        pieces = [list(range(len(tree.source)))]
    room = np.array(bed, dtype=float)
    if mode.apart:
        from fabfold.apart.plates import RIM_MM

        room[:2] -= 2 * RIM_MM
    least = np.inf
    for voxels in pieces:
        cells = tree.source[voxels]
        extent = np.sort(np.ptp(cells, axis=0) + 1.0 + _BARRELS)
        least = min(least, float((np.sort(room) / extent).min()))
    return float(np.floor(10.0 * least + 1e-9) / 10.0)


def fitting_voxel(kit: Kit) -> float | None:
    """Size of a voxel with which a kit fits its printer's bed, where it does not yet.

    Parameters
    ----------
    kit : Kit
        It is searched, where that was not done: sizes of bodies are known by the tree.

    Returns
    -------
    float or None
        mm; None where the kit fits as it is.

    Raises
    ------
    RecipeError
        If a voxel that fits is too small for a hinge; it says which would do.
    NoTreeError, NoFoldError
        As :meth:`fabfold.kit.kit.Kit.fold`.
    """
    mode = kit.print_mode()
    most = largest_voxel(kit.fold().tree, mode)
    if most is None or most >= kit.recipe.voxel_mm:
        return None
    mode.require_hinge(most)
    return most
