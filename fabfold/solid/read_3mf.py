"""3MF: what is to be printed, as slicers and CAD programs mean it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import ModelError
from fabfold.solid.package_3mf import BuildItem, MeshObject, ModelPart, Package, open_package
from fabfold.solid.raw import RawMesh, head_of, no_faces, what_is_it
from fabfold.solid.slicer_settings import Painter, part_roles, slicer_colours
from fabfold.solid.words import were

__all__ = ["MAX_TRIANGLES_EXPANDED", "read_3mf"]

#: Triangles once all components are expanded, and how often objects may be used in all.
MAX_TRIANGLES_EXPANDED, MAX_USES = 6_000_000, 200_000
#: Objects that are no material: helpers of slicers and CAD programs.
_HELPERS = ("support", "solidsupport", "other", "surface")
#: Units of a 3MF file, in short.
_UNITS = {
    "micron": "µm",
    "millimeter": "mm",
    "centimeter": "cm",
    "meter": "m",
    "inch": "in",
    "foot": "ft",
}
#: An object's address: the part that it is in, and its number.
_Address = tuple[str, int]


@dataclass
class _Pile:
    """Placed meshes, of material or of what is taken away."""

    vertices: list[NDArray[np.float64]] = field(default_factory=list)
    faces: list[NDArray[np.int64]] = field(default_factory=list)
    colours: list[NDArray[np.uint8] | None] = field(default_factory=list)
    count: int = 0

    def add(
        self,
        vertices: NDArray[np.float64],
        faces: NDArray[np.int64],
        colours: NDArray[np.uint8] | None,
    ) -> None:
        self.vertices.append(vertices)
        self.faces.append(faces + self.count)
        self.colours.append(colours)
        self.count += len(vertices)

    def mesh(self) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        return np.concatenate(self.vertices), np.concatenate(self.faces)

    def shades(self) -> NDArray[np.uint8] | None:
        if all(shade is None for shade in self.colours):
            return None
        white = [
            np.full((len(faces), 3), 255, dtype=np.uint8) if shade is None else shade
            for shade, faces in zip(self.colours, self.faces, strict=True)
        ]
        return np.concatenate(white)


def read_3mf(path: Path, wanted: str = "") -> RawMesh:
    """Read what a 3MF file prints, each mesh placed by its transforms.

    Parameters
    ----------
    path : Path
        A file that is not empty.
    wanted : str
        Name, or number from 1, of the one object to take; empty takes all that are printed.

    Returns
    -------
    RawMesh
        All meshes in one, with colours of material groups or of a slicer's paint. Parts that a
        slicer takes away stand in `negative`. What is no material (supports, modifiers, objects
        that are not printed) is left out, and told.

    Raises
    ------
    ModelError
        If the file is damaged, needs an extension that we do not read, expands beyond
        :data:`MAX_TRIANGLES_EXPANDED`, has no such object, or prints nothing with triangles.
    """
    head = head_of(path)
    if head[:2] != b"PK":
        raise ModelError(
            f"{path.name} is not a 3MF file but {what_is_it(head)}; export the model as 3MF"
        )
    return _Reader(open_package(path)).read(wanted)


class _Reader:
    def __init__(self, package: Package) -> None:
        self._package = package
        self._file = package.name
        self._roles = part_roles(package)
        self._painter = Painter(slicer_colours(package))
        self._solid, self._negative = _Pile(), _Pile()
        self._meshes: dict[_Address, tuple[NDArray[np.float64], NDArray[np.int64]]] = {}
        self._shades: dict[_Address, NDArray[np.uint8] | None] = {}
        self._dropped = 0
        self._left_out: list[str] = []

    def read(self, wanted: str) -> RawMesh:
        root = self._package.part()
        printed = [item for item in root.items if item.printable]
        notes: list[str] = []
        if skipped := len(root.items) - len(printed):
            notes.append(f"{were(skipped, 'object')} left out: marked as not to be printed")
        material = [item for item in printed if self._object(item).kind not in _HELPERS]
        if helpers := len(printed) - len(material):
            notes.append(f"{were(helpers, 'object')} left out: supports or helpers, no material")
        names = [self._name(item) for item in material]
        if wanted:
            material = [material[self._choose(names, wanted)]]
        self._bound(material)
        for item in material:
            self._place(item)
        if not self._solid.faces:
            raise no_faces(self._file)
        notes += self._told()
        vertices, faces = self._solid.mesh()
        return RawMesh(
            vertices,
            faces,
            tuple(notes),
            float32=True,
            colours=self._solid.shades(),
            negative=self._negative.mesh() if self._negative.faces else None,
            objects=() if wanted else tuple(names),
            unit=_UNITS.get(root.unit, root.unit),
        )

    def _told(self) -> list[str]:
        notes = []
        if self._left_out:
            notes.append(
                f"{were(len(self._left_out), 'part')} left out, which change how it is printed and "
                f"not its shape ({', '.join(self._left_out[:3])})"
            )
        if self._dropped:
            notes.append(f"{were(self._dropped, 'triangle')} dropped: two of its corners are one")
        return notes

    def _part(self, path: str) -> ModelPart:
        return self._package.part(path)

    def _object(self, item: BuildItem) -> MeshObject:
        return self._at((item.path, item.id))

    def _at(self, address: _Address) -> MeshObject:
        path, number = address
        found = self._part(path).objects.get(number)
        if found is None:
            where = f" in {path}" if path else ""
            raise ModelError(
                f"{self._file}: object {number}{where} is used, but it is not there; export or "
                "save it again"
            )
        return found

    def _name(self, item: BuildItem) -> str:
        return (
            self._roles.names.get(item.id) or self._object(item).name or f"object {item.id}"
        ).strip()

    def _choose(self, names: list[str], wanted: str) -> int:
        listed = ", ".join(f"{number}: {name}" for number, name in enumerate(names, start=1))
        if wanted.isdigit() and 0 < int(wanted) <= len(names):
            return int(wanted) - 1
        if names.count(wanted) == 1:
            return names.index(wanted)
        why = "several objects have that name" if wanted in names else "there is no such object"
        raise ModelError(f"{self._file}, --object {wanted}: {why}; choose one of {listed}")

    # Size before anything is expanded -------------------------------------------------------------

    def _children(self, address: _Address) -> list[_Address]:
        return [(part.path or address[0], part.id) for part in self._at(address).components]

    def _bound(self, items: list[BuildItem]) -> None:
        """Count triangles and uses of objects from the leaves up, without expanding anything."""
        counts: dict[_Address, tuple[int, int]] = {}
        for item in items:
            # Without recursion: thousands of levels are a way to break a reader.
            stack: list[tuple[_Address, bool]] = [((item.path, item.id), False)]
            open_now: set[_Address] = set()
            while stack:
                address, seen = stack.pop()
                if seen:
                    open_now.discard(address)
                    below = [counts[child] for child in self._children(address)]
                    triangles = len(self._at(address).triangles) + sum(t for t, _ in below)
                    counts[address] = (triangles, 1 + sum(uses for _, uses in below))
                elif address not in counts:
                    if address in open_now:
                        raise ModelError(
                            f"{self._file}: object {address[1]} is made of itself; export the "
                            "model again"
                        )
                    open_now.add(address)
                    stack.append((address, True))
                    for child in self._children(address):
                        if child in open_now:
                            raise ModelError(
                                f"{self._file}: object {child[1]} is made of itself; export the "
                                "model again"
                            )
                        if child not in counts:
                            stack.append((child, False))
        triangles = sum(counts[(item.path, item.id)][0] for item in items)
        uses = sum(counts[(item.path, item.id)][1] for item in items)
        if triangles > MAX_TRIANGLES_EXPANDED:
            raise ModelError(
                f"{self._file} has {_many(triangles)} triangles once its components are expanded, "
                f"and {MAX_TRIANGLES_EXPANDED:,} are the most; export a coarser model"
            )
        if uses > MAX_USES:
            raise ModelError(
                f"{self._file} uses its objects {_many(uses)} times, and {MAX_USES:,} are the "
                "most; export the model as one mesh"
            )

    # Expanding ------------------------------------------------------------------------------------

    def _place(self, item: BuildItem) -> None:
        whole = self._roles.parts.get(item.id, {})
        ranges = self._roles.ranges.get(item.id, ())
        stack: list[tuple[_Address, NDArray[np.float64], str]] = [
            ((item.path, item.id), item.place, "solid")
        ]
        while stack:
            address, place, role = stack.pop()
            thing = self._at(address)
            if thing.kind in _HELPERS:
                self._left_out.append(thing.name or thing.kind)
                continue
            if thing.triangles:
                for first, last, own in ranges or ((0, len(thing.triangles) - 1, role),):
                    self._add(address, place, own, first, last)
            # Reversed, so that parts come in the order of the file.
            for component in reversed(thing.components):
                below = (component.path or address[0], component.id)
                own = whole.get(component.id, role)
                stack.append((below, place @ component.place, own))

    def _add(
        self, address: _Address, place: NDArray[np.float64], role: str, first: int, last: int
    ) -> None:
        if role not in ("solid", "negative"):
            self._left_out.append(role)
            return
        vertices, faces = self._mesh(address)
        shades = self._colours(address)
        some = np.zeros(len(faces), dtype=bool)
        some[first : last + 1] = True
        broken = (faces == np.roll(faces, 1, axis=1)).any(axis=1)
        self._dropped += int((broken & some).sum())
        some &= ~broken
        if not some.any():
            return
        faces = faces[some]
        if np.linalg.det(place[:3, :3]) < 0:
            faces = faces[:, ::-1]
        pile = self._solid if role == "solid" else self._negative
        moved = vertices @ place[:3, :3].T + place[:3, 3]
        pile.add(moved, faces, None if shades is None else shades[some])

    def _mesh(self, address: _Address) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Arrays of a mesh object, made once."""
        if address not in self._meshes:
            thing = self._at(address)
            vertices = np.array(thing.vertices, dtype=np.float64).reshape(-1, 3)
            try:
                faces = np.array(thing.triangles, dtype=np.int64).reshape(-1, 3)
            except OverflowError:
                raise ModelError(
                    f"{self._file}: a triangle of object {address[1]} names a vertex that is not "
                    f"there, it has {len(vertices)}; export the model again"
                ) from None
            outside = ((faces < 0) | (faces >= len(vertices))).any(axis=1)
            if outside.any():
                raise ModelError(
                    f"{self._file}: triangle {int(np.argmax(outside))} (counted from 0) of object "
                    f"{address[1]} names a vertex that is not there, it has {len(vertices)}; "
                    "export the model again"
                )
            self._meshes[address] = vertices, faces
        return self._meshes[address]

    def _colours(self, address: _Address) -> NDArray[np.uint8] | None:
        """Colours of a mesh object's triangles; None where it has none."""
        if address not in self._shades:
            self._shades[address] = self._read_colours(self._at(address), address[0])
        return self._shades[address]

    def _read_colours(self, thing: MeshObject, path: str) -> NDArray[np.uint8] | None:
        groups = self._part(path).colours
        whole = _shade_of(groups, thing.property)
        if thing.paint:
            base = self._painter.base if whole is None else whole
            shades = np.tile(np.array(base, dtype=np.uint8), (len(thing.triangles), 1))
            for index, code in thing.paint.items():
                painted = self._painter.colour(code)
                if painted is not None:
                    shades[index] = painted
            return shades
        own = {index: _shade_of(groups, entry) for index, entry in thing.properties.items()}
        if whole is None and not any(shade is not None for shade in own.values()):
            return None
        base = (255, 255, 255) if whole is None else whole
        shades = np.tile(np.array(base, dtype=np.uint8), (len(thing.triangles), 1))
        for index, shade in own.items():
            if shade is not None:
                shades[index] = shade
        return shades


def _shade_of(
    groups: dict[int, list[tuple[int, int, int]]], entry: tuple[int, int]
) -> tuple[int, int, int] | None:
    group, index = entry
    shades = groups.get(group, [])
    return shades[index] if 0 <= index < len(shades) else None


def _many(count: int) -> str:
    """A number, or its size where it has very many digits."""
    return f"{count:,}" if count < 10**12 else f"over 10^{len(str(count)) - 1}"
