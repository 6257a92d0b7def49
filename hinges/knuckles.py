"""Where the knuckles stand along the axis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .clearance import Clearance
from .exceptions import HingeError
from .shapes import Point, Turned

__all__ = ["Knuckle", "KnuckleLayout", "groove", "lay_out_knuckles"]


@dataclass(frozen=True)
class Knuckle:
    """One knuckle of a barrel.

    Attributes
    ----------
    owner : int
        Number of the body that it belongs to: 0 the parent, 1 the child or the link, 2 the child
        where both axes of a double hinge lie on one edge.
    start, end : float
        Its two end planes along the axis, z in mm.
    """

    owner: int
    start: float
    end: float

    @property
    def length(self) -> float:
        """Length along the axis in mm."""
        return self.end - self.start


@dataclass(frozen=True)
class KnuckleLayout:
    """All knuckles of one axis, in order along z.

    Attributes
    ----------
    radius : float
        Radius of the barrels in mm.
    knuckles : tuple of Knuckle
        Neighbours have different owners and the axial clearance between them.
    clearance : Clearance
        Room between the knuckles and what they turn in.
    pin_owner : int
        Number of the body that carries printed pins, and grips a loose one.
    """

    radius: float
    knuckles: tuple[Knuckle, ...]
    clearance: Clearance
    pin_owner: int = 0

    @property
    def start(self) -> float:
        """First end plane along z in mm."""
        return self.knuckles[0].start

    @property
    def end(self) -> float:
        """Last end plane along z in mm."""
        return self.knuckles[-1].end

    @property
    def groove_radius(self) -> float:
        """Radius in mm of the groove that a barrel turns in."""
        return self.radius + self.clearance.radial


def lay_out_knuckles(
    length: float,
    count: int,
    radius: float,
    clearance: Clearance,
    margin: float,
    owners: Sequence[int] = (0, 1),
    pin_owner: int = 0,
    ratio: float = 1.0,
) -> KnuckleLayout:
    """Divide an edge among knuckles.

    Parameters
    ----------
    length : float
        Length of the edge in mm; it is centred on z = 0.
    count : int
        Number of knuckles, at least 2. With an odd count the parent has one more than the child.
    radius : float
        Radius of the barrel in mm.
    clearance : Clearance
        Room between the parts; the axial value stands between neighbours.
    margin : float
        Length in mm left free at each end of the edge.
    owners : sequence of int
        Owners of the knuckles, repeated along the edge: parent and child in turn by default.
    pin_owner : int
        Number of the body that carries printed pins, and grips a loose one.
    ratio : float
        Length of a knuckle of the others against one of the first owner; 1 makes all equal.

    Returns
    -------
    KnuckleLayout
        The knuckles in order along z.

    Raises
    ------
    HingeError
        If there are fewer than 2 knuckles or no room for them.
    """
    if count < 2 or int(count) != count:
        raise HingeError(f"a hinge needs a whole number of at least 2 knuckles, {count} given")
    if radius <= 0.0 or length <= 0.0 or margin < 0.0:
        raise HingeError(
            f"edge length {length:g} mm and barrel radius {radius:g} mm must be above 0, and the "
            f"margin {margin:g} mm must not be negative"
        )
    room = length - 2.0 * margin - (count - 1) * clearance.axial
    if room <= 0.0:
        raise HingeError(
            f"{count} knuckles do not fit an edge of {length:g} mm with {margin:g} mm left free at "
            "each end: use fewer knuckles, a smaller barrel or a longer edge"
        )
    whose = [owners[i % len(owners)] for i in range(count)]
    shares = [1.0 if owner == owners[0] else ratio for owner in whose]
    each = room / sum(shares)
    knuckles = []
    done = 0.0  # Shares of the knuckles before.
    for i, (owner, share) in enumerate(zip(whose, shares, strict=True)):
        start = -0.5 * length + margin + done * each + i * clearance.axial
        knuckles.append(Knuckle(owner, start, start + share * each))
        done += share
    return KnuckleLayout(radius, tuple(knuckles), clearance, pin_owner)


def groove(layout: KnuckleLayout, owner: int, core: float) -> Turned:
    """Plan what to cut out of the body of `owner` before its knuckles are added.

    The barrels of the others need their radius plus the radial clearance over their lengths plus
    the axial clearance. Within its own knuckles the body gives up a core of radius `core`, so that
    no material of the body fills a recess or bore of the knuckle that takes its place.

    Parameters
    ----------
    layout : KnuckleLayout
        The knuckles of the axis.
    owner : int
        Number of the body that is cut.
    core : float
        Radius in mm, below that of the barrel; or that of the barrel, for a body that only touches
        its knuckles.

    Returns
    -------
    Turned
        One stepped solid on the axis.
    """
    axial = layout.clearance.axial
    outline: list[Point] = []
    last = len(layout.knuckles) - 1
    for index, knuckle in enumerate(layout.knuckles):
        if knuckle.owner == owner:
            outline += [(core, knuckle.start), (core, knuckle.end)]
            continue
        shared_before = index > 0 and layout.knuckles[index - 1].owner != owner
        shared_after = index < last and layout.knuckles[index + 1].owner != owner
        start = knuckle.start - axial * (0.5 if shared_before else 1.0)
        end = knuckle.end + axial * (0.5 if shared_after else 1.0)
        outline += [(layout.groove_radius, start), (layout.groove_radius, end)]
    corners: list[Point] = [(0.0, outline[0][1])]
    for corner in [*outline, (0.0, outline[-1][1])]:
        if corner[0] == corners[-1][0] and abs(corner[1] - corners[-1][1]) < 1e-9:
            continue
        if abs(corner[1] - corners[-1][1]) < 1e-9:  # one plane, whatever the rounding
            corner = (corner[0], corners[-1][1])  # noqa: PLW2901
        corners.append(corner)
    return Turned(tuple(corners))
