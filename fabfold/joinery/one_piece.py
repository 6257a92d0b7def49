"""Making one piece of what the cut left of a body: crumbs out, hollows filled, struts in."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import GeometryError
from fabfold.joinery.sizes import strut_width
from fabfold.joinery.struts import bar_solid, grid_of, plan_struts

if TYPE_CHECKING:
    import manifold3d

__all__ = ["CRUMB_SHARE", "MendTally", "one_piece"]

#: Loose pieces below this share of a full cell's volume are left out.
CRUMB_SHARE = 0.005
_STRUT_ROUNDS = 3


@dataclass
class MendTally:
    """What the stages of one kit took away and added."""

    carved_cells: int = 0
    carved_mm3: float = 0.0
    shared_cells: int = 0
    shared_mm3: float = 0.0
    dropped_mm3: float = 0.0
    crumbs: int = 0
    hollows: int = 0
    filled_mm3: float = 0.0
    links_cut: int = 0
    links_mm3: float = 0.0
    struts: int = 0
    strutted: list[str] = field(default_factory=list)


def one_piece(
    name: str,
    cells: NDArray[np.int32],
    free: Callable[[], manifold3d.Manifold],
    material: manifold3d.Manifold,
    halves: list[manifold3d.Manifold],
    voxel_mm: float,
    tally: MendTally,
) -> manifold3d.Manifold:
    """Material and hinge halves as one piece, with struts where it takes them.

    Parameters
    ----------
    name : str
        Of the body, for messages.
    cells : (m, 3) int32 array
        Of the body, lattice units.
    free : callable
        Gives the solid in which struts may run. Called only when one is needed.
    material : manifold3d.Manifold
    halves : list of manifold3d.Manifold
        The body's halves of its hinges.
    voxel_mm : float
    tally : MendTally
        Counts crumbs, hollows and struts.

    Raises
    ------
    GeometryError
        If no struts make one piece of it.
    """
    import manifold3d

    add = manifold3d.OpType.Add
    solid = manifold3d.Manifold.batch_boolean([material, *halves], add)
    grid = grid_of(cells, voxel_mm)
    crumb = CRUMB_SHARE * voxel_mm**3
    brackets = [grid.sample(half) for half in halves]
    for _ in range(_STRUT_ROUNDS):
        pieces = _kept_pieces(solid, halves, crumb, tally)
        if not pieces:
            raise GeometryError(
                f"{name}: no piece of material above {crumb:.0f} mm³ and no hinge is left in its "
                f"{len(cells)} cells"
            )
        solid = manifold3d.Manifold.batch_boolean(pieces, add)
        samples = [grid.sample(piece) for piece in pieces]
        bars = plan_struts(grid, lambda: grid.sample(free()), samples, brackets)
        if bars is None:
            raise GeometryError(
                f"{name}: parts of it lie apart in its cells ({len(pieces)} pieces), and grooves "
                "and hinges leave no way for a strut between them"
            )
        if not bars:
            break
        tally.struts += len(bars)
        if name not in tally.strutted:
            tally.strutted.append(name)
        room = free()
        width = strut_width(voxel_mm)
        solids = [bar_solid(bar, width) ^ room for bar in bars]
        solid = manifold3d.Manifold.batch_boolean([solid, *solids], add)
    pieces = _kept_pieces(solid, halves, crumb, tally)
    if len(pieces) != 1:
        raise GeometryError(
            f"{name}: still {len(pieces)} pieces after struts were added; "
            "another tree or a larger voxel may do"
        )
    return pieces[0]


def _kept_pieces(
    solid: manifold3d.Manifold, halves: list[manifold3d.Manifold], crumb: float, tally: MendTally
) -> list[manifold3d.Manifold]:
    """Pieces without crumbs and with closed hollows filled, the largest first.

    A hollow that nothing leads into would trap powder or resin; it shows as a piece of negative
    volume, which is left out. A small piece that holds a hinge is no crumb.
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
        small = piece.volume() < crumb
        if small and not any((piece ^ half).volume() > 1e-3 for half in halves):
            tally.crumbs += 1
            tally.dropped_mm3 += piece.volume()
        else:
            kept.append(piece)
    return kept
