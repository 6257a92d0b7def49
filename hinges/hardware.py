"""Loose pins: filament, rods and screws that a maker puts in after printing."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, radians
from typing import Final, Literal

from .clearance import Clearance
from .errors import HingeError
from .fit import at_least
from .pins import Owned, Pin, Ring, Roof, ring
from .shapes import Point, Shape, Turned, cylinder, regular
from .train import Train

__all__ = ["SCREWS", "FilamentPin", "LoosePin", "RodPin", "Screw", "ScrewPin"]


@dataclass(frozen=True)
class Screw:
    """Sizes of a metric machine screw and its nut, in mm.

    Attributes
    ----------
    clear, tap : float
        Diameters of the hole that it passes (ISO 273, medium) and that it cuts its thread in.
    cap, cap_height : float
        Cylinder head, ISO 4762.
    sunk : float
        Diameter of the 90° countersunk head, ISO 7046.
    nut, nut_height : float
        Across the flats, ISO 4032.
    """

    name: str
    diameter: float
    clear: float
    tap: float
    cap: float
    cap_height: float
    sunk: float
    nut: float
    nut_height: float


SCREWS: Final[dict[str, Screw]] = {
    screw.name: screw
    for screw in (
        Screw("M2", 2.0, 2.4, 1.7, 3.8, 2.0, 3.8, 4.0, 1.6),
        Screw("M2.5", 2.5, 2.9, 2.15, 4.5, 2.5, 4.7, 5.0, 2.0),
        Screw("M3", 3.0, 3.4, 2.6, 5.5, 3.0, 5.5, 5.5, 2.4),
    )
}
"""The screws that hinges of this size are pinned with."""


def loose_rings(train: Train, radius: float, room: float) -> tuple[Ring, ...]:
    """Both ends of the bores of the knuckles that are not the holder's."""
    return tuple(
        Ring(z, radius, (1.0, 0.0), room)
        for span in train.spans
        if span.owner != train.holder
        for z in (span.start, span.end)
    )


@dataclass(frozen=True)
class LoosePin(Pin):
    """A plain round pin pushed through all knuckles: tight in the holder's, free in the others'.

    Parameters
    ----------
    diameter : float
        In mm.
    grip, slip : float
        Added to the radius of the bore in mm: `grip` in the holder's knuckles, `slip` in the
        others'.
    heads : bool
        Countersink both ends, for a filament whose ends are melted into heads.
    """

    diameter: float
    grip: float = 0.05
    slip: float = 0.15
    heads: bool = False

    def __post_init__(self) -> None:
        """Refuse what is no pin."""
        if self.diameter <= 0.0 or self.slip < self.grip:
            raise HingeError(
                f"loose pin: diameter {self.diameter:g} mm must be above 0 and slip {self.slip:g} "
                f"mm not below grip {self.grip:g} mm"
            )

    _HEAD = 0.6

    def _bore(self, train: Train, owner: int) -> float:
        return 0.5 * self.diameter + (self.grip if owner == train.holder else self.slip)

    def reach(self, train: Train, roof: Roof) -> float:
        """Largest radius in mm that the pin takes out of a barrel."""
        wide = (0.5 * self.diameter + self.slip) * roof.factor
        return max(wide, 0.5 * self.diameter + self.slip + self._HEAD) if self.heads else wide

    def thinnest_barrel(self, clearance: Clearance, wall: float, knuckles: int) -> float:
        """Smallest barrel radius in mm that leaves `wall` around a teardrop bore."""
        del clearance, knuckles
        wide = (0.5 * self.diameter + self.slip) * Roof("teardrop").factor
        return max(wide, 0.5 * self.diameter + self.slip + self._HEAD * self.heads) + wall

    def check(self, train: Train, wall: float, roof: Roof) -> None:
        """Refuse a train that this pin cannot hold.

        Raises
        ------
        FitError
            If a wall is too thin or the child can slide off.
        """
        self._check_common(train, wall, roof)
        if not self.heads:
            at_least(
                "retention",
                "the number of knuckles on a plain loose pin",
                len(train.spans),
                3,
                "use 3 knuckles or more, heads=True, or a screw",
                "",
            )

    def knuckles(self, train: Train, chamfer: float) -> tuple[Owned, ...]:
        """Turn every knuckle with its round bore."""
        made: list[Owned] = []
        last = len(train.spans) - 1
        for index, span in enumerate(train.spans):
            bore = self._bore(train, span.owner)
            ends: list[list[Point]] = []
            for outer, face, inward in (
                (index == 0, span.start, 1.0),
                (index == last, span.end, -1.0),
            ):
                if outer and self.heads:
                    ends.append([(bore, face + inward * self._HEAD), (bore + self._HEAD, face)])
                else:
                    ends.append([(bore, face)])
            made.append((span.owner, ring(train, span, chamfer, *ends)))
        return tuple(made)

    def bores(self, train: Train, roof: Roof) -> tuple[Owned, ...]:
        """Give the roofs over the bores."""
        return tuple(
            (span.owner, over)
            for span in train.spans
            for over in roof.over(self._bore(train, span.owner), span)
        )

    def access(self, train: Train, edge: float) -> tuple[Shape, ...]:
        """Clear both bodies from the ends of the train to the ends of the edge."""
        wide = 0.5 * self.diameter + self.slip + (self._HEAD if self.heads else 0.0)
        return tuple(
            cylinder(wide, *sorted(ends))
            for ends in ((train.start, -edge), (train.end, edge))
            if abs(ends[1] - ends[0]) > 1e-6
        )

    def rings(self, train: Train) -> tuple[Ring, ...]:
        """Both ends of every bore; the pin's room on both sides counts."""
        return loose_rings(train, 0.5 * self.diameter, self.grip + self.slip)

    def hardware(self, train: Train) -> tuple[Shape, ...]:
        """Draw the pin."""
        return (cylinder(0.5 * self.diameter, train.start, train.end),)


@dataclass(frozen=True)
class FilamentPin(LoosePin):
    """A piece of printing filament, 1.75 or 2.85 mm thick.

    Parameters
    ----------
    diameter : float
        1.75 or 2.85 mm.
    grip, slip, heads
        As for :class:`LoosePin`.
    """

    diameter: float = 1.75

    def __post_init__(self) -> None:
        """Refuse a thickness that no filament has."""
        if self.diameter not in (1.75, 2.85):
            raise HingeError(
                f"filament pin: {self.diameter:g} mm is no filament; use 1.75 or 2.85, or a RodPin"
            )
        super().__post_init__()


@dataclass(frozen=True)
class RodPin(LoosePin):
    """A steel rod or wire; 0.02 mm of grip in drilled or reamed bores.

    Parameters
    ----------
    diameter : float
        In mm.
    grip, slip, heads
        As for :class:`LoosePin`.
    """

    diameter: float = 2.0
    grip: float = 0.02
    slip: float = 0.12


@dataclass(frozen=True)
class ScrewPin(Pin):
    """A metric screw through all knuckles, held by a nut or by its own thread in the last.

    Parameters
    ----------
    size : {"M2", "M2.5", "M3"}
    head : {"cylinder", "countersunk"}
    end : {"nut", "tap"}
        A nut, or the thread that the screw cuts itself in the last knuckle.
    sunk : bool
        Sink head and nut in pockets of the barrel; otherwise they stand outside its ends.
    """

    size: str = "M3"
    head: Literal["cylinder", "countersunk"] = "cylinder"
    end: Literal["nut", "tap"] = "tap"
    sunk: bool = False

    _ROOM = 0.15

    def __post_init__(self) -> None:
        """Refuse unknown sizes and forms."""
        if self.size not in SCREWS:
            raise HingeError(f"screw {self.size!r} is unknown: use one of {', '.join(SCREWS)}")
        if self.head not in ("cylinder", "countersunk") or self.end not in ("nut", "tap"):
            raise HingeError(
                f"screw pin: head {self.head!r} must be cylinder or countersunk and end "
                f"{self.end!r} nut or tap"
            )
        if self.head == "countersunk" and not self.sunk:
            raise HingeError("screw pin: a countersunk head needs sunk=True")

    @property
    def screw(self) -> Screw:
        """The sizes of the screw."""
        return SCREWS[self.size]

    @property
    def _nut_radius(self) -> float:
        return (0.5 * self.screw.nut + self._ROOM) / cos(radians(30.0))

    def _pocket(self) -> float:
        """Widest pocket radius in mm."""
        if not self.sunk:
            return 0.0
        wide = self.screw.cap if self.head == "cylinder" else self.screw.sunk
        nut = self._nut_radius if self.end == "nut" else 0.0
        return max(0.5 * wide + self._ROOM, nut)

    def reach(self, train: Train, roof: Roof) -> float:
        """Largest radius in mm that the pin takes out of a barrel."""
        del train
        return max(0.5 * self.screw.clear * roof.factor, self._pocket())

    def thinnest_barrel(self, clearance: Clearance, wall: float, knuckles: int) -> float:
        """Smallest barrel radius in mm that leaves `wall` around bores and pockets."""
        del clearance, knuckles
        wide = 0.5 * self.screw.clear * Roof("teardrop").factor
        return max(wide, self._pocket()) + wall

    def check(self, train: Train, wall: float, roof: Roof) -> None:
        """Refuse a train that this screw cannot hold.

        Raises
        ------
        FitError
            If a wall is too thin, or a pocket too deep for its knuckle.
        """
        self._check_common(train, wall, roof)
        deep = max(self._head_depth(), self.screw.nut_height if self.end == "nut" else 0.0)
        if self.sunk:
            at_least(
                "web",
                "the material behind the pocket of head or nut",
                min(train.spans[0].length, train.spans[-1].length) - deep,
                wall,
                "use fewer knuckles, a longer edge, a smaller screw or sunk=False",
            )
        if self.end == "tap":
            at_least(
                "knuckle",
                f"the length of thread in the last knuckle for {self.size}",
                train.spans[-1].length,
                1.5 * self.screw.diameter,
                "use fewer knuckles, a longer edge, or a nut",
            )

    def _head_depth(self) -> float:
        screw = self.screw
        if self.head == "cylinder":
            return screw.cap_height
        return 0.5 * (screw.sunk - screw.clear) + self._ROOM

    def knuckles(self, train: Train, chamfer: float) -> tuple[Owned, ...]:
        """Turn every knuckle with its bore and the pocket of the head."""
        made: list[Owned] = []
        last = len(train.spans) - 1
        clear = 0.5 * self.screw.clear
        for index, span in enumerate(train.spans):
            bore = 0.5 * self.screw.tap if index == last and self.end == "tap" else clear
            start: list[Point] = [(bore, span.start)]
            if index == 0 and self.sunk:
                foot = span.start + self._head_depth()
                wide = 0.5 * self.screw.cap + self._ROOM
                start = [(bore, foot), (wide, foot), (wide, span.start)]
                if self.head == "countersunk":
                    wide = 0.5 * self.screw.sunk + self._ROOM
                    start = [(bore, span.start + wide - bore), (wide, span.start)]
            made.append((span.owner, ring(train, span, chamfer, start, [(bore, span.end)])))
        return tuple(made)

    def bores(self, train: Train, roof: Roof) -> tuple[Owned, ...]:
        """Give the roofs over the bores and the pocket of the nut."""
        made: list[Owned] = []
        last = len(train.spans) - 1
        for index, span in enumerate(train.spans):
            if index < last or self.end == "nut":
                made += [(span.owner, over) for over in roof.over(0.5 * self.screw.clear, span)]
        if self.sunk and self.end == "nut":
            span = train.spans[-1]
            flats = self.screw.nut + 2.0 * self._ROOM
            foot = span.end - self.screw.nut_height
            first = roof.up[span.owner]
            made.append((span.owner, regular(6, flats, foot, span.end + 0.01, first)))
        return tuple(made)

    def access(self, train: Train, edge: float) -> tuple[Shape, ...]:
        """Clear both bodies for the head, and for the nut at the other end."""
        wide = 0.5 * (self.screw.cap if self.head == "cylinder" else self.screw.sunk) + self._ROOM
        ends = [(wide, train.start, -max(edge, -train.start + self._proud(head=True)))]
        if self.end == "nut":
            far = max(edge, train.end + self._proud(head=False))
            ends.append((self._nut_radius, train.end, far))
        return tuple(
            cylinder(radius, *sorted((near, far)))
            for radius, near, far in ends
            if abs(far - near) > 1e-6
        )

    def _proud(self, *, head: bool) -> float:
        if self.sunk:
            return 0.0
        return (self.screw.cap_height if head else self.screw.nut_height) + self._ROOM

    def rings(self, train: Train) -> tuple[Ring, ...]:
        """Both ends of every bore; the screw's room on both sides counts."""
        radius = 0.5 * self.screw.diameter
        return loose_rings(train, radius, 2.0 * (0.5 * self.screw.clear - radius))

    def hardware(self, train: Train) -> tuple[Shape, ...]:
        """Draw the screw, and its nut."""
        screw = self.screw
        radius = 0.5 * screw.diameter
        base = train.start
        # Where the screw cuts its own thread only its core is drawn.
        thread = train.spans[-1].start
        core = 0.5 * screw.tap if self.end == "tap" else radius
        shank: tuple[Point, ...] = ((radius, thread), (core, thread)) if core < radius else ()
        shank = (*shank, (core, train.end), (0.0, train.end))
        if self.head == "countersunk":
            slope = 0.5 * screw.sunk
            head: tuple[Point, ...] = (
                (0.0, base),
                (slope, base),
                (radius, base + slope - radius),
            )
        else:
            foot = base + (screw.cap_height if self.sunk else 0.0)
            top = foot - screw.cap_height
            cap = 0.5 * screw.cap
            head = ((0.0, top), (cap, top), (cap, foot), (radius, foot))
        outline = (*head, *shank)
        drawn: list[Shape] = [Turned(outline)]
        if self.end == "nut":
            start = train.end - (screw.nut_height if self.sunk else 0.0)
            drawn.append(regular(6, screw.nut, start, start + screw.nut_height, 0.0))
        return tuple(drawn)
