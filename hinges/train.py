"""Where the knuckles stand along the axis."""

from __future__ import annotations

from dataclasses import dataclass

from .clearance import Clearance
from .errors import HingeError
from .shapes import Point, Turned

__all__ = ["Span", "Train", "groove", "lay_out"]


@dataclass(frozen=True)
class Span:
    """One knuckle: its owner (0 parent, 1 child, ...) and its two end planes (z, mm)."""

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
    clearance : Clearance
    """

    radius: float
    spans: tuple[Span, ...]
    clearance: Clearance

    @property
    def start(self) -> float:
        """Z of the first end plane in mm."""
        return self.spans[0].start

    @property
    def end(self) -> float:
        """Z of the last end plane in mm."""
        return self.spans[-1].end

    @property
    def reach(self) -> float:
        """Radius in mm of the groove that a barrel turns in."""
        return self.radius + self.clearance.radial

    def owned(self, owner: int) -> tuple[Span, ...]:
        """Knuckles of one owner."""
        return tuple(span for span in self.spans if span.owner == owner)


def lay_out(length: float, count: int, radius: float, clearance: Clearance, margin: float) -> Train:
    """Divide an edge among alternating knuckles of parent and child, the parent's first.

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

    Returns
    -------
    Train

    Raises
    ------
    HingeError
        If there are fewer than 2 knuckles or no room for them.
    """
    if count < 2:
        raise HingeError(f"a hinge needs at least 2 knuckles, {count} given")
    room = length - 2.0 * margin - (count - 1) * clearance.axial
    each = room / count
    if each <= 0.0:
        raise HingeError(
            f"{count} knuckles do not fit an edge of {length:g} mm with {margin:g} mm left free at "
            "each end: use fewer knuckles, a smaller barrel or a longer edge"
        )
    first = -0.5 * length + margin
    pitch = each + clearance.axial
    spans = tuple(Span(i % 2, first + i * pitch, first + i * pitch + each) for i in range(count))
    return Train(radius, spans, clearance)


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
    for index, span in enumerate(train.spans):
        own = span.owner == owner
        start, end, radius = span.start, span.end, core if own else train.reach
        before = train.spans[index - 1].owner if index else owner
        after = train.spans[index + 1].owner if index + 1 < len(train.spans) else owner
        if own:
            start -= axial if before == owner and index else 0.0
        else:
            start -= axial if before == owner else 0.5 * axial
            end += axial if after == owner else 0.5 * axial
        outline += [(radius, start), (radius, end)]
    corners: list[Point] = [(0.0, outline[0][1])]
    for corner in [*outline, (0.0, outline[-1][1])]:
        if corner != corners[-1]:
            corners.append(corner)
    return Turned(tuple(corners))
