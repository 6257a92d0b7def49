"""The link plate of a double hinge as a body, with grooves for the barrels that pass it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fabfold.errors import GeometryError
from fabfold.joinery.booleans import bounds, effective_tools, subtract
from fabfold.joinery.cutting import BodyCutter
from fabfold.joinery.hinge_placement import LinkPlate, barrel_solid
from fabfold.joinery.sizes import MIN_WALL_MM
from fabfold.joinery.tally import FRAGMENT_SHARE, BuildTally

if TYPE_CHECKING:
    import manifold3d

__all__ = ["link_body"]


def link_body(cutter: BodyCutter, tally: BuildTally) -> manifold3d.Manifold:
    """The link of a double hinge as one connected solid.

    Parameters
    ----------
    cutter : BodyCutter
        The link, and all that passes it on the folding path.
    tally : BuildTally
        Counts what is cut from links.

    Returns
    -------
    manifold3d.Manifold
        In mm, lattice origin at zero.

    Raises
    ------
    GeometryError
        If a barrel or another link that passes cuts the knuckles off, or leaves less than a wall
        between them.
    """
    plate = cutter.hinges.plates[cutter.index]
    solid = plate.solid
    low, high = (corner[None] / cutter.voxel_mm for corner in bounds(solid))
    grooves = cutter.groove_tools(low, high)
    pockets = cutter.pocket_tools(low, high)
    tree = cutter.tree
    culprits = [tree.hinges[h].name for h, tool in grooves if effective_tools([(h, tool)], solid)]
    culprits += [tree.bodies[b].name for b, tool in pockets if effective_tools([(b, tool)], solid)]
    if not culprits:
        return solid
    whole = cutter.cut_half(solid, grooves, pockets)
    # Half a wall more on both sides: what is then still in one piece has necks of a wall.
    wide_grooves = cutter.groove_tools(low, high, MIN_WALL_MM / 2)
    narrow = subtract(whole, effective_tools(wide_grooves, whole))
    if not _holds_all_knuckles(cutter, plate, narrow):
        raise GeometryError(
            f"{cutter.name}: {', '.join(dict.fromkeys(culprits))} cut it apart on the folding "
            f"path, or leave less than {MIN_WALL_MM:g} mm of it between its two hinges"
        )
    pieces = sorted(whole.decompose(), key=lambda piece: -piece.volume())
    for piece in pieces[1:]:
        if piece.volume() > FRAGMENT_SHARE * cutter.voxel_mm**3:
            raise GeometryError(
                f"{cutter.name}: {', '.join(dict.fromkeys(culprits))} cut a piece of "
                f"{piece.volume():.0f} mm³ off it on the folding path"
            )
        tally.fragments += 1
        tally.dropped_mm3 += piece.volume()
    tally.links_cut += 1
    tally.links_mm3 += solid.volume() - pieces[0].volume()
    return pieces[0]


def _holds_all_knuckles(cutter: BodyCutter, plate: LinkPlate, solid: manifold3d.Manifold) -> bool:
    """Whether one piece of a link holds all of its knuckles."""
    barrels = [
        barrel_solid(cutter.tree.hinges[h], cutter.size, cutter.voxel_mm) for h in plate.hinges
    ]
    wanted = [(plate.solid ^ barrel).volume() for barrel in barrels]
    return any(
        all(
            (piece ^ barrel).volume() > 0.9 * volume
            for barrel, volume in zip(barrels, wanted, strict=True)
        )
        for piece in solid.decompose()
    )
