"""What slicers add to a 3MF: parts that are no material, names, filaments and paint."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from fabfold.solid.package_3mf import Package

__all__ = ["Painter", "Roles", "part_roles", "slicer_colours"]

_BAMBU = "Metadata/model_settings.config"
_PRUSA = "Metadata/Slic3r_PE_model.config"
#: What parts of a slicer are: material, taken away, or something that leaves the shape alone.
_ROLES = {
    "normal_part": "solid",
    "modelpart": "solid",
    "negative_part": "negative",
    "negativevolume": "negative",
    "modifier_part": "modifier",
    "parametermodifier": "modifier",
    "support_enforcer": "support enforcer",
    "supportenforcer": "support enforcer",
    "support_blocker": "support blocker",
    "supportblocker": "support blocker",
}
#: Colours of filaments whose colour the file does not tell.
_FILAMENTS = (
    (255, 255, 255),
    (220, 50, 47),
    (38, 139, 210),
    (133, 153, 0),
    (181, 137, 0),
    (211, 54, 130),
    (42, 161, 152),
    (88, 110, 117),
)
Shade = tuple[int, int, int]


@dataclass
class Roles:
    """What the parts of objects are.

    Attributes
    ----------
    names : dict of int to str
        Names of objects by their numbers.
    parts : dict of int to dict of int to str
        By object and by the number of a component's object: ``solid``, ``negative`` or another.
    ranges : dict of int to list of (int, int, str)
        By object: first and last triangle of a part, and what it is.
    """

    names: dict[int, str] = field(default_factory=dict)
    parts: dict[int, dict[int, str]] = field(default_factory=dict)
    ranges: dict[int, list[tuple[int, int, str]]] = field(default_factory=dict)


def part_roles(package: Package) -> Roles:
    """Read what Bambu Studio, OrcaSlicer and PrusaSlicer say of the parts of objects.

    Parameters
    ----------
    package : Package
        The file.

    Returns
    -------
    Roles
        Empty where no slicer wrote the file.

    Raises
    ------
    ModelError
        If its XML is damaged.
    """
    roles = Roles()
    number, inside = 0, ""
    for tag, values in package.elements(_BAMBU):
        if tag == "object":
            number, inside = _whole(values.get("id")), "object"
        elif tag == "part":
            inside = "part"
            role = _ROLES.get(values.get("subtype", "normal_part").lower(), "solid")
            roles.parts.setdefault(number, {})[_whole(values.get("id"))] = role
        elif tag == "metadata" and inside == "object" and values.get("key") == "name":
            roles.names[number] = values.get("value", "")
        elif tag == "/part":
            inside = "object"
        elif tag == "/object":
            inside = ""
    first, last, role = 0, -1, "solid"
    for tag, values in package.elements(_PRUSA):
        if tag == "object":
            number = _whole(values.get("id"))
        elif tag == "volume":
            first, last = _whole(values.get("firstid")), _whole(values.get("lastid"), -1)
            role = "solid"
        elif tag == "metadata" and values.get("type") == "object":
            if values.get("key") == "name":
                roles.names[number] = values.get("value", "")
        elif tag == "metadata" and values.get("type") == "volume":
            if values.get("key") == "volume_type":
                role = _ROLES.get(values.get("value", "").lower(), "solid")
            elif values.get("key") == "modifier" and values.get("value") == "1":
                role = "modifier"
        elif tag == "/volume" and last >= first:
            roles.ranges.setdefault(number, []).append((first, last, role))
    return roles


def _whole(text: str | None, otherwise: int = 0) -> int:
    """A number of a slicer's settings; what is none there belongs to no part."""
    return int(text) if text is not None and text.isdecimal() else otherwise


def slicer_colours(package: Package) -> list[Shade]:
    """Colours of the filaments, first to last; empty where the file does not tell them.

    Parameters
    ----------
    package : Package
        The file.
    """
    text = package.text("Metadata/project_settings.config")
    if text is not None:
        try:
            listed = json.loads(text).get("filament_colour", [])
            return [_hex(str(entry)) for entry in listed]
        except (ValueError, AttributeError, TypeError, RecursionError):
            return []
    text = package.text("Metadata/Slic3r_PE.config") or b""
    found = {
        match[1].decode(): match[2].decode("ascii", "replace")
        for match in re.finditer(rb"(?m)^; (extruder_colour|filament_colour) = (.*)$", text)
    }
    line = found.get("extruder_colour", "")
    if not line.strip('"; '):
        line = found.get("filament_colour", "")
    return [_hex(entry) for entry in line.split(";")] if line else []


def _hex(text: str) -> Shade:
    try:
        red, green, blue = bytes.fromhex(text.strip(' "').lstrip("#")[:6])
    except ValueError:
        return _FILAMENTS[0]
    return (red, green, blue)


class Painter:
    """Turns what slicers write on a painted triangle into its colour.

    Parameters
    ----------
    filaments : sequence of (int, int, int)
        Colours of the filaments as far as they are known.

    Attributes
    ----------
    base : (int, int, int)
        Colour of what is not painted.

    Notes
    -----
    The code is a tree of four-bit nodes, written from its end. The two low bits of a node are the
    number of cut sides of a triangle. 0 is a leaf, whose two high bits are its filament (3: the
    nodes that follow count on from there); otherwise as many nodes follow as there are cut sides,
    and one more. (PrusaSlicer, ``TriangleSelector``; Bambu Studio and OrcaSlicer write the same.)
    """

    def __init__(self, filaments: Sequence[Shade]) -> None:
        self._filaments = list(filaments)
        self._known: dict[str, Shade | None] = {}
        self.base = self._filament(1)

    def _filament(self, number: int) -> Shade:
        if number <= len(self._filaments):
            return self._filaments[number - 1]
        return _FILAMENTS[(number - 1) % len(_FILAMENTS)]

    def colour(self, code: str) -> Shade | None:
        """Colour of most of a triangle; None where most is not painted, or the code is damaged.

        Parameters
        ----------
        code : str
            Hexadecimal digits.
        """
        if code not in self._known:
            self._known[code] = self._decode(code)
        return self._known[code]

    def _decode(self, code: str) -> Shade | None:
        shares: dict[int, float] = {}
        try:
            nodes = (int(digit, 16) for digit in reversed(code.strip()))
            self._node(nodes, 1.0, shares, 0)
        except (ValueError, StopIteration, RecursionError):
            return None
        state = max(shares, key=lambda key: (shares[key], -key))
        return self._filament(state) if state else None

    def _node(
        self, nodes: Iterator[int], share: float, shares: dict[int, float], depth: int
    ) -> None:
        node = next(nodes)
        cut = node & 3
        if depth > 60:
            raise ValueError("nested too deeply")
        if cut:
            for _ in range(cut + 1):
                self._node(nodes, share / (cut + 1), shares, depth + 1)
            return
        state = node >> 2
        if state == 3:
            while (more := next(nodes)) == 15:
                state += 15
            state += more
        shares[state] = shares.get(state, 0.0) + share
