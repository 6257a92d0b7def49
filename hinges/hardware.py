"""Loose pins: filament, rods and screws that are put in after printing."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, radians
from typing import Final, Literal

from .clearance import Clearance, number
from .exceptions import HingeError
from .fit import at_least, at_most
from .knuckles import KnuckleLayout
from .pins import BoreForm, ContactCircle, OwnedShape, Pin, turned_knuckle
from .shapes import Point, Shape, Turned, cylinder, regular

__all__ = ["SCREWS", "FilamentPin", "LoosePin", "RodPin", "Screw", "ScrewPin"]


@dataclass(frozen=True)
class Screw:
    """Sizes of a machine screw and its nut.

    Attributes
    ----------
    name : str
        Short name, such as "M3" or "#6-32".
    diameter : float
        Nominal diameter of the thread in mm.
    clear, tap : float
        Diameters in mm of the hole that it passes (ISO 273, medium; ASME B18.2.8, normal) and of
        the one that it cuts its thread in: the tap drill, 0.1 mm wider.
    cap, cap_height : float
        Diameter and height of the cylinder head in mm, ISO 4762; ASME B18.3.
    sunk : float
        Diameter of the countersunk head in mm, ISO 7046 (90°); ASME B18.6.3 (82°, which lies in
        the 90° pocket with its rim).
    nut, nut_height : float
        Size across the flats and height of the nut in mm, ISO 4032; ASME B18.6.3.
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
        Screw("M1.6", 1.6, 1.8, 1.35, 3.0, 1.6, 3.0, 3.2, 1.3),
        Screw("M2", 2.0, 2.4, 1.7, 3.8, 2.0, 3.8, 4.0, 1.6),
        Screw("M2.5", 2.5, 2.9, 2.15, 4.5, 2.5, 4.7, 5.0, 2.0),
        Screw("M3", 3.0, 3.4, 2.6, 5.5, 3.0, 5.5, 5.5, 2.4),
        Screw("M4", 4.0, 4.5, 3.4, 7.0, 4.0, 8.4, 7.0, 3.2),
        Screw("M5", 5.0, 5.5, 4.3, 8.5, 5.0, 9.3, 8.0, 4.7),
        Screw("#2-56", 2.18, 2.59, 1.88, 3.56, 2.18, 4.37, 4.76, 1.59),
        Screw("#4-40", 2.84, 3.25, 2.36, 4.65, 2.84, 5.72, 6.35, 2.38),
        Screw("#6-32", 3.51, 3.91, 2.81, 5.74, 3.51, 7.09, 7.94, 2.78),
        Screw("#8-32", 4.17, 4.57, 3.55, 6.86, 4.17, 8.43, 8.73, 3.18),
        Screw("#10-24", 4.83, 5.23, 3.9, 7.92, 4.83, 9.78, 9.53, 3.18),
        Screw("1/4-20", 6.35, 7.14, 5.2, 9.53, 6.35, 12.88, 11.11, 4.76),
    )
}
"""The screws that printed hinges are pinned with, by name."""


def _screw(name: str) -> Screw:
    """A screw by its name, or by that of its thread alone, such as "#6" or "1/4"."""
    found = [screw for screw in SCREWS.values() if name in (screw.name, screw.name.split("-")[0])]
    if not found:
        raise HingeError(f"screw {name!r} is unknown: use one of {', '.join(SCREWS)}")
    return found[0]


def loose_pin_contacts(
    layout: KnuckleLayout, radius: float, room: float
) -> tuple[ContactCircle, ...]:
    """Find the ends of the bores that a loose pin is free in.

    Parameters
    ----------
    layout : KnuckleLayout
        The knuckles of the axis.
    radius : float
        Radius of the pin in mm.
    room : float
        Distance in mm between pin and bore when it leans on the other side.

    Returns
    -------
    tuple of ContactCircle
        Two for each knuckle that is not the pin owner's.
    """
    return tuple(
        ContactCircle(z, radius, (1.0, 0.0), room)
        for knuckle in layout.knuckles
        if knuckle.owner != layout.pin_owner
        for z in (knuckle.start, knuckle.end)
    )


@dataclass(frozen=True)
class LoosePin(Pin):
    """A plain round pin pushed through all knuckles: tight in the pin owner's, free in the others'.

    Parameters
    ----------
    diameter : float
        Diameter of the pin in mm.
    grip, slip : float
        How much wider than the pin the bore is, in mm of its radius: `grip` in the pin owner's
        knuckles, `slip` in the others'. A grip below 0 is a bore that a thread cuts itself into.
    heads : bool
        Whether both ends are countersunk, for a filament whose ends are melted into heads.
    entry : {"both", "start", "end", "none"}
        Ends of the knuckles, by their place along z, beyond which the bodies are cleared so that
        the pin can go in; "none" leaves the bodies to their owner.
    pocket : float
        Radius in mm of the widest pocket that somebody cuts into the barrel later, such as for a
        screw's head; the barrel keeps its wall around it.
    """

    diameter: float
    grip: float = 0.05
    slip: float = 0.15
    heads: bool = False
    entry: Literal["both", "start", "end", "none"] = "both"
    pocket: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what is no pin."""
        if self.entry not in ("both", "start", "end", "none"):
            raise HingeError(f"loose pin: entry {self.entry!r}: use both, start, end or none")
        if self.diameter <= 0.0 or self.slip < self.grip:
            raise HingeError(
                f"loose pin: diameter {self.diameter:g} mm must be above 0 and slip {self.slip:g} "
                f"mm not below grip {self.grip:g} mm"
            )

    _HEAD = 0.6

    def _bore(self, layout: KnuckleLayout, owner: int) -> float:
        return 0.5 * self.diameter + (self.grip if owner == layout.pin_owner else self.slip)

    def largest_radius(self, layout: KnuckleLayout, bore_form: BoreForm) -> float:
        """Largest radius in mm that the pin takes out of a barrel."""
        wide = max((0.5 * self.diameter + self.slip) * bore_form.factor, self.pocket)
        return max(wide, 0.5 * self.diameter + self.slip + self._HEAD) if self.heads else wide

    def thinnest_barrel(self, clearance: Clearance, wall: float, knuckles: int) -> float:
        """Smallest barrel radius in mm that leaves `wall` around a teardrop bore."""
        del clearance, knuckles
        wide = max((0.5 * self.diameter + self.slip) * BoreForm("teardrop").factor, self.pocket)
        return max(wide, 0.5 * self.diameter + self.slip + self._HEAD * self.heads) + wall

    def check(self, layout: KnuckleLayout, wall: float, bore_form: BoreForm) -> None:
        """Refuse a layout that this pin cannot hold.

        Raises
        ------
        FitError
            If a wall is too thin or the child can slide off.
        """
        self._check_common(layout, wall, bore_form)
        if not self.heads:
            at_least(
                "retention",
                "the number of knuckles on a plain loose pin",
                len(layout.knuckles),
                3,
                "use 3 knuckles or more, heads=True, or a screw",
                "",
            )

    def knuckle_shapes(self, layout: KnuckleLayout, chamfer: float) -> tuple[OwnedShape, ...]:
        """Turn every knuckle with its round bore."""
        made: list[OwnedShape] = []
        last = len(layout.knuckles) - 1
        for index, knuckle in enumerate(layout.knuckles):
            bore = self._bore(layout, knuckle.owner)
            ends: list[list[Point]] = []
            for outer, face, inward in (
                (index == 0, knuckle.start, 1.0),
                (index == last, knuckle.end, -1.0),
            ):
                if outer and self.heads:
                    ends.append([(bore, face + inward * self._HEAD), (bore + self._HEAD, face)])
                else:
                    ends.append([(bore, face)])
            made.append((knuckle.owner, turned_knuckle(layout, knuckle, chamfer, *ends)))
        return tuple(made)

    def bore_cuts(self, layout: KnuckleLayout, bore_form: BoreForm) -> tuple[OwnedShape, ...]:
        """Give the roofs over the bores."""
        return tuple(
            (knuckle.owner, over)
            for knuckle in layout.knuckles
            for over in bore_form.roof(self._bore(layout, knuckle.owner), knuckle)
        )

    def insertion_cuts(self, layout: KnuckleLayout, edge: float) -> tuple[Shape, ...]:
        """Clear both bodies from the entry ends of the layout to the ends of the edge."""
        wide = 0.5 * self.diameter + self.slip + (self._HEAD if self.heads else 0.0)
        return tuple(
            cylinder(wide, *sorted(ends))
            for name, ends in (("start", (layout.start, -edge)), ("end", (layout.end, edge)))
            if self.entry in ("both", name) and abs(ends[1] - ends[0]) > 1e-6
        )

    def contact_circles(self, layout: KnuckleLayout) -> tuple[ContactCircle, ...]:
        """Both ends of every bore; the pin's room on both sides counts."""
        return loose_pin_contacts(layout, 0.5 * self.diameter, max(self.grip, 0.0) + self.slip)

    def hardware(self, layout: KnuckleLayout, bore_form: BoreForm) -> tuple[Shape, ...]:
        """Draw the pin."""
        del bore_form
        return (cylinder(0.5 * self.diameter, layout.start, layout.end),)


@dataclass(frozen=True)
class FilamentPin(LoosePin):
    """A piece of printing filament, 1.75 or 2.85 mm thick.

    Parameters
    ----------
    diameter : float
        Diameter of the filament: 1.75 or 2.85 mm.
    grip, slip, heads, entry, pocket
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
        Diameter of the rod in mm.
    grip, slip, heads, entry, pocket
        As for :class:`LoosePin`.
    """

    diameter: float = 2.0
    grip: float = 0.02
    slip: float = 0.12


@dataclass(frozen=True)
class ScrewPin(Pin):
    """A screw through all knuckles, held by a nut or by its own thread in the last.

    Parameters
    ----------
    size : str or Screw
        Its thread, a name of :data:`SCREWS`: M1.6 to M5, #2-56 to #10-24 and 1/4-20; "#6" is
        "#6-32". The sizes of any other as a :class:`Screw`.
    head : {"cylinder", "countersunk"}
        Form of its head.
    end : {"nut", "tap"}
        What holds it: a nut, or the thread that the screw cuts itself in the last knuckle.
    sunk : bool
        Whether head and nut lie in pockets of the barrel; otherwise they stand outside its ends.
    thread : float, optional
        Length in mm of the thread that the screw cuts at the far end of the last knuckle; before
        it the bore is wide. The whole knuckle when left out.
    """

    size: str | Screw = "M3"
    head: Literal["cylinder", "countersunk"] = "cylinder"
    end: Literal["nut", "tap"] = "tap"
    sunk: bool = False
    thread: float | None = None

    _ROOM = 0.15

    def __post_init__(self) -> None:
        """Refuse unknown sizes and forms."""
        _ = self.screw
        if self.thread is not None:
            if number(self.thread, "a screw's thread") <= 0.0:
                raise HingeError(f"screw pin: thread is {self.thread:g} mm: give a length above 0")
            if self.end != "tap":
                raise HingeError('screw pin: a nut holds the screw; give thread with end="tap"')
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
        return self.size if isinstance(self.size, Screw) else _screw(self.size)

    def _thread(self, layout: KnuckleLayout) -> float:
        """Length of the thread in the last knuckle in mm."""
        return layout.knuckles[-1].length if self.thread is None else self.thread

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

    def largest_radius(self, layout: KnuckleLayout, bore_form: BoreForm) -> float:
        """Largest radius in mm that the pin takes out of a barrel."""
        del layout
        return max(0.5 * self.screw.clear * bore_form.factor, self._pocket())

    def thinnest_barrel(self, clearance: Clearance, wall: float, knuckles: int) -> float:
        """Smallest barrel radius in mm that leaves `wall` around bores and pockets."""
        del clearance, knuckles
        wide = 0.5 * self.screw.clear * BoreForm("teardrop").factor
        return max(wide, self._pocket()) + wall

    def check(self, layout: KnuckleLayout, wall: float, bore_form: BoreForm) -> None:
        """Refuse a layout that this screw cannot hold.

        Raises
        ------
        FitError
            If a wall is too thin, or a pocket too deep for its knuckle.
        """
        self._check_common(layout, wall, bore_form)
        deep = max(self._head_depth(), self.screw.nut_height if self.end == "nut" else 0.0)
        if self.sunk:
            at_least(
                "web",
                "the material behind the pocket of head or nut",
                min(layout.knuckles[0].length, layout.knuckles[-1].length) - deep,
                wall,
                "use fewer knuckles, a longer edge, a smaller screw or sunk=False",
            )
        if self.end == "tap":
            at_least(
                "knuckle",
                f"the length of thread in the last knuckle for {self.screw.name}",
                self._thread(layout),
                1.5 * self.screw.diameter,
                "use fewer knuckles, a longer edge, or a nut"
                if self.thread is None
                else "use a longer thread, or a nut",
            )
            at_most(
                "knuckle",
                "the length of thread in the last knuckle",
                self._thread(layout),
                layout.knuckles[-1].length,
                "use a shorter thread, or leave it out for the whole knuckle",
            )

    def _head_depth(self) -> float:
        screw = self.screw
        if self.head == "cylinder":
            return screw.cap_height
        return 0.5 * (screw.sunk - screw.clear) + self._ROOM

    def knuckle_shapes(self, layout: KnuckleLayout, chamfer: float) -> tuple[OwnedShape, ...]:
        """Turn every knuckle with its bore and the pocket of the head."""
        made: list[OwnedShape] = []
        last = len(layout.knuckles) - 1
        clear = 0.5 * self.screw.clear
        for index, knuckle in enumerate(layout.knuckles):
            bore = 0.5 * self.screw.tap if index == last and self.end == "tap" else clear
            start: list[Point] = [(bore, knuckle.start)]
            if index == 0 and self.sunk:
                foot = knuckle.start + self._head_depth()
                wide = 0.5 * self.screw.cap + self._ROOM
                start = [(bore, foot), (wide, foot), (wide, knuckle.start)]
                if self.head == "countersunk":
                    wide = 0.5 * self.screw.sunk + self._ROOM
                    start = [(bore, knuckle.start + wide - bore), (wide, knuckle.start)]
            if bore < clear and self._thread(layout) < knuckle.length - 1e-9:
                foot = knuckle.end - self._thread(layout)
                start = [(bore, foot), (clear, foot), (clear, knuckle.start)]
            made.append(
                (
                    knuckle.owner,
                    turned_knuckle(layout, knuckle, chamfer, start, [(bore, knuckle.end)]),
                )
            )
        return tuple(made)

    def bore_cuts(self, layout: KnuckleLayout, bore_form: BoreForm) -> tuple[OwnedShape, ...]:
        """Give the roofs over the bores and the pocket of the nut."""
        made: list[OwnedShape] = []
        last = len(layout.knuckles) - 1
        for index, knuckle in enumerate(layout.knuckles):
            wide = knuckle
            if index == last and self.end == "tap":
                wide = replace(knuckle, end=knuckle.end - self._thread(layout))
            if wide.length > 1e-9:
                made += [
                    (knuckle.owner, over) for over in bore_form.roof(0.5 * self.screw.clear, wide)
                ]
        if self.sunk and self.end == "nut":
            knuckle = layout.knuckles[-1]
            flats = self.screw.nut + 2.0 * self._ROOM
            foot = knuckle.end - self.screw.nut_height
            first = bore_form.up[knuckle.owner]
            made.append((knuckle.owner, regular(6, flats, foot, knuckle.end + 0.01, first)))
        return tuple(made)

    def insertion_cuts(self, layout: KnuckleLayout, edge: float) -> tuple[Shape, ...]:
        """Clear both bodies for the head, and for the nut at the other end."""
        # Head and nut turn with one half, beside the bracket of the other.
        room = max(self._ROOM, layout.clearance.radial)
        over = 0.0 if self.sunk else layout.clearance.axial
        wide = 0.5 * (self.screw.cap if self.head == "cylinder" else self.screw.sunk) + room
        ends = [(wide, layout.start + over, -max(edge, -layout.start + self._proud(head=True)))]
        if self.end == "nut":
            far = max(edge, layout.end + self._proud(head=False))
            wide = max(self._nut_radius, 0.5 * self.screw.nut / cos(radians(30.0)) + room)
            ends.append((wide, layout.end - over, far))
        return tuple(
            cylinder(radius, *sorted((near, far)))
            for radius, near, far in ends
            if abs(far - near) > 1e-6
        )

    def _proud(self, *, head: bool) -> float:
        if self.sunk:
            return 0.0
        return (self.screw.cap_height if head else self.screw.nut_height) + self._ROOM

    def contact_circles(self, layout: KnuckleLayout) -> tuple[ContactCircle, ...]:
        """Both ends of every bore; the screw's room on both sides counts."""
        radius = 0.5 * self.screw.diameter
        return loose_pin_contacts(layout, radius, 2.0 * (0.5 * self.screw.clear - radius))

    def hardware(self, layout: KnuckleLayout, bore_form: BoreForm) -> tuple[Shape, ...]:
        """Draw the screw, and its nut as its pocket lies in the drawn pose."""
        screw = self.screw
        radius = 0.5 * screw.diameter
        base = layout.start
        # Where the screw cuts its own thread only its core is drawn.
        thread = layout.end - self._thread(layout)
        core = 0.5 * screw.tap if self.end == "tap" else radius
        shank: tuple[Point, ...] = ((radius, thread), (core, thread)) if core < radius else ()
        shank = (*shank, (core, layout.end), (0.0, layout.end))
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
            start = layout.end - (screw.nut_height if self.sunk else 0.0)
            turn = bore_form.up[0]
            drawn.append(regular(6, screw.nut, start, start + screw.nut_height, turn))
        return tuple(drawn)
