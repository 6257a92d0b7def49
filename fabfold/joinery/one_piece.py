"""Make one piece of what the cut left of a body: fragments out, hollows filled, struts in."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import GeometryError
from fabfold.joinery.sizes import strut_width
from fabfold.joinery.struts import grid_over, plan_struts, strut_solid
from fabfold.joinery.tally import FRAGMENT_SHARE, BuildTally

if TYPE_CHECKING:
    import manifold3d

__all__ = ["connect_pieces"]

#: Rounds of adding struts before a body is given up: a strut that is trimmed may fall short.
_STRUT_ROUNDS = 3


def connect_pieces(
    name: str,
    cells: NDArray[np.int32],
    strut_space: Callable[[], manifold3d.Manifold],
    material: manifold3d.Manifold,
    halves: list[manifold3d.Manifold],
    voxel_mm: float,
    tally: BuildTally,
) -> manifold3d.Manifold:
    """Material and hinge halves of a body as one connected solid, with struts where it needs them.

    Parameters
    ----------
    name : str
        Name of the body, for messages.
    cells : (m, 3) int32 array
        Cells of the body, lattice units.
    strut_space : callable
        Gives the solid, in mm, in which struts may run. It is called only when one is needed.
    material : manifold3d.Manifold
        What the cut left of the model in the body's cells, mm.
    halves : list of manifold3d.Manifold
        The body's halves of its hinges, mm.
    voxel_mm : float
        Side of a voxel in mm.
    tally : BuildTally
        Counts fragments, hollows and struts.

    Returns
    -------
    manifold3d.Manifold
        One piece, in mm.

    Raises
    ------
    GeometryError
        If no struts make one piece of it.
    """
    import manifold3d

    add = manifold3d.OpType.Add
    solid = manifold3d.Manifold.batch_boolean([material, *halves], add)
    grid = grid_over(cells, voxel_mm)
    fragment_mm3 = FRAGMENT_SHARE * voxel_mm**3
    brackets = [grid.sample(half) for half in halves]
    for _ in range(_STRUT_ROUNDS):
        pieces = _kept_pieces(solid, halves, fragment_mm3, tally)
        if not pieces:
            raise GeometryError(
                f"{name}: no piece of material above {fragment_mm3:.0f} mm³ and no hinge is left "
                f"in its {len(cells)} cells"
            )
        solid = manifold3d.Manifold.batch_boolean(pieces, add)
        samples = [grid.sample(piece) for piece in pieces]
        struts = plan_struts(grid, lambda: grid.sample(strut_space()), samples, brackets)
        if struts is None:
            raise GeometryError(
                f"{name}: parts of it lie apart in its cells ({len(pieces)} pieces), and grooves "
                "and hinges leave no way for a strut between them"
            )
        if not struts:
            break
        tally.struts += len(struts)
        if name not in tally.strutted:
            tally.strutted.append(name)
        space = strut_space()
        width = strut_width(voxel_mm)
        solids = [strut_solid(strut, width) ^ space for strut in struts]
        solid = manifold3d.Manifold.batch_boolean([solid, *solids], add)
    pieces = _kept_pieces(solid, halves, fragment_mm3, tally)
    if len(pieces) != 1:
        raise GeometryError(
            f"{name}: still {len(pieces)} pieces after struts were added; "
            "another tree or a larger voxel may do"
        )
    return pieces[0]


def _kept_pieces(
    solid: manifold3d.Manifold,
    halves: list[manifold3d.Manifold],
    fragment_mm3: float,
    tally: BuildTally,
) -> list[manifold3d.Manifold]:
    """Pieces without fragments and with closed hollows filled, the largest first.

    A hollow that nothing leads into would trap powder or resin; it shows as a piece of negative
    volume, which is left out. A small piece that holds a hinge is no fragment.
    """
    pieces = sorted(solid.decompose(), key=lambda piece: -piece.volume())
    hollows = [piece for piece in pieces if piece.volume() < 0.0]
    if hollows:
        tally.hollows += len(hollows)
        tally.filled_mm3 -= sum(piece.volume() for piece in hollows)
        import manifold3d

        full = [piece for piece in pieces if piece.volume() >= 0.0]
        # What floated in a hollow is now inside a full piece.
        merged = manifold3d.Manifold.batch_boolean(full, manifold3d.OpType.Add)
        pieces = sorted(merged.decompose(), key=lambda piece: -piece.volume())
    if len(pieces) == 1:
        return pieces
    kept = []
    for piece in pieces:
        small = piece.volume() < fragment_mm3
        if small and not any((piece ^ half).volume() > 1e-3 for half in halves):
            tally.fragments += 1
            tally.dropped_mm3 += piece.volume()
        else:
            kept.append(piece)
    return kept
