"""Where the knuckles stand along the axis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .clearance import Clearance
from .errors import HingeError
from .shapes import Point, Turned

__all__ = ["Span", "Train", "groove", "lay_out"]


@dataclass(frozen=True)
class Span:
    """One knuckle: its owner (0 parent, 1 child or link, 2 ...) and its two end planes (z, mm)."""

    owner: int
    start: float
    end: float

    @property
    def length(self) -> float:
        """Length along the axis in mm."""
        return self.end - self.start


@dataclass(frozen=True)
class Train:
    """All knuckles of one axis, in order along z.

    Attributes
    ----------
    radius : float
        Of the barrels, in mm.
    spans : tuple of Span
        Neighbours have different owners and the axial clearance between them.
    clearance : Clearance
    holder : int
        The owner that carries printed pins, and grips a loose one.
    """

    radius: float
    spans: tuple[Span, ...]
    clearance: Clearance
    holder: int = 0

    @property
    def start(self) -> float:
        """First end plane along z in mm."""
        return self.spans[0].start

    @property
    def end(self) -> float:
        """Last end plane along z in mm."""
        return self.spans[-1].end

    @property
    def reach(self) -> float:
        """Radius in mm of the groove that a barrel turns in."""
        return self.radius + self.clearance.radial

    def owned(self, owner: int) -> tuple[Span, ...]:
        """Knuckles of one owner."""
        return tuple(span for span in self.spans if span.owner == owner)


def lay_out(
    length: float,
    count: int,
    radius: float,
    clearance: Clearance,
    margin: float,
    owners: Sequence[int] = (0, 1),
    holder: int = 0,
) -> Train:
    """Divide an edge among knuckles of equal length.

    Parameters
    ----------
    length : float
        Of the edge in mm; it is centred on z = 0.
    count : int
        Knuckles, at least 2. With an odd count the parent has one more.
    radius : float
        Barrel radius in mm.
    clearance : Clearance
        The axial value stands between neighbours.
    margin : float
        Left free at both ends of the edge, in mm.
    owners : sequence of int
        Repeated over the knuckles: parent and child in turn by default.
    holder : int
        The owner that carries printed pins, and grips a loose one.

    Returns
    -------
    Train

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
    each = room / count
    if each <= 0.0:
        raise HingeError(
            f"{count} knuckles do not fit an edge of {length:g} mm with {margin:g} mm left free at "
            "each end: use fewer knuckles, a smaller barrel or a longer edge"
        )
    first = -0.5 * length + margin
    pitch = each + clearance.axial
    spans = tuple(
        Span(owners[i % len(owners)], first + i * pitch, first + i * pitch + each)
        for i in range(count)
    )
    return Train(radius, spans, clearance, holder)


def groove(train: Train, owner: int, core: float) -> Turned:
    """What to cut out of the body of `owner` before its knuckles are added.

    The barrels of the others need their radius plus the radial clearance over their spans plus the
    axial clearance. Within its own spans the body gives up a core of radius `core`, so that no
    material of the body fills a recess or bore of the knuckle that takes its place.

    Parameters
    ----------
    train : Train
    owner : int
    core : float
        In mm, below the barrel radius.

    Returns
    -------
    Turned
        One stepped solid on the axis.
    """
    axial = train.clearance.axial
    outline: list[Point] = []
    last = len(train.spans) - 1
    for index, span in enumerate(train.spans):
        if span.owner == owner:
            outline += [(core, span.start), (core, span.end)]
            continue
        shared_before = index > 0 and train.spans[index - 1].owner != owner
        shared_after = index < last and train.spans[index + 1].owner != owner
        start = span.start - axial * (0.5 if shared_before else 1.0)
        end = span.end + axial * (0.5 if shared_after else 1.0)
        outline += [(train.reach, start), (train.reach, end)]
    corners: list[Point] = [(0.0, outline[0][1])]
    for corner in [*outline, (0.0, outline[-1][1])]:
        if corner[0] == corners[-1][0] and abs(corner[1] - corners[-1][1]) < 1e-9:
            continue
        if abs(corner[1] - corners[-1][1]) < 1e-9:  # one plane, whatever the rounding
            corner = (corner[0], corners[-1][1])  # noqa: PLW2901
        corners.append(corner)
    return Turned(tuple(corners))
