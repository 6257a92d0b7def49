"""Link plates as bodies of their own, with grooves for the barrels that pass them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fabfold.errors import GeometryError
from fabfold.joinery.cutting import Cut, bounds, less, meeting
from fabfold.joinery.hinge_placement import Plate, knuckle_zone
from fabfold.joinery.one_piece import CRUMB_SHARE, MendTally
from fabfold.joinery.sizes import MIN_WALL_MM

if TYPE_CHECKING:
    import manifold3d

__all__ = ["link_body"]


def link_body(cut: Cut, tally: MendTally) -> manifold3d.Manifold:
    """The link of a double hinge as one connected solid, lattice origin at zero.

    Parameters
    ----------
    cut : Cut
        ``cut.index`` is the link's.
    tally : MendTally
        Counts what was cut from links.

    Raises
    ------
    GeometryError
        If a barrel or another link on its way cuts its knuckles off, or leaves less than a wall
        between them.
    """
    plate = cut.fitted.plates[cut.index]
    solid = plate.link
    low, high = (corner[None] / cut.voxel_mm for corner in bounds(solid))
    grooves = cut.grooves(low, high)
    pockets = cut.pockets(low, high)
    culprits = [cut.tree.hinges[h].name for h, tool in grooves if meeting([(h, tool)], solid)]
    culprits += [cut.tree.bodies[b].name for b, tool in pockets if meeting([(b, tool)], solid)]
    if not culprits:
        return solid
    whole = cut.half(solid, grooves, pockets)
    # Half a wall more on both sides: what then still hangs together has necks of a wall.
    narrow = less(whole, meeting(cut.grooves(low, high, MIN_WALL_MM / 2), whole))
    if not _joined(cut, plate, narrow):
        raise GeometryError(
            f"{cut.name}: {', '.join(dict.fromkeys(culprits))} cut it apart on the folding path, "
            f"or leave less than {MIN_WALL_MM:g} mm of it between its two hinges"
        )
    pieces = sorted(whole.decompose(), key=lambda piece: -piece.volume())
    for piece in pieces[1:]:
        if piece.volume() > CRUMB_SHARE * cut.voxel_mm**3:
            raise GeometryError(
                f"{cut.name}: {', '.join(dict.fromkeys(culprits))} cut a piece of "
                f"{piece.volume():.0f} mm³ off it on the folding path"
            )
        tally.crumbs += 1
        tally.dropped_mm3 += piece.volume()
    tally.links_cut += 1
    tally.links_mm3 += solid.volume() - pieces[0].volume()
    return pieces[0]


def _joined(cut: Cut, plate: Plate, solid: manifold3d.Manifold) -> bool:
    """Whether one piece of a link holds all of its knuckles."""
    zones = [knuckle_zone(cut.tree.hinges[h], cut.size, cut.voxel_mm) for h in plate.hinges]
    wanted = [(plate.link ^ zone).volume() for zone in zones]
    return any(
        all(
            (piece ^ zone).volume() > 0.9 * volume
            for zone, volume in zip(zones, wanted, strict=True)
        )
        for piece in solid.decompose()
    )
