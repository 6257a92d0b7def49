"""The parts of a 3MF package: what its XML says, bounded in size before it is believed.

lib3mf, which writes our own files, is strict where programs are not (a triangle with two equal
corners ends it), knows nothing of what slicers add, and cannot be interrupted while it expands what
is nested. So packages of others are parsed here, by expat, in pieces.
"""

from __future__ import annotations

import zipfile
import zlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import ModelError

__all__ = ["BuildItem", "Component", "MeshObject", "ModelPart", "Package", "open_package"]

_CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
_MATERIAL = "http://schemas.microsoft.com/3dmanufacturing/material/2015/02"
_PRODUCTION = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06"
_PRUSA = "http://schemas.slic3r.org/3mf/2017/06"
_ROOT = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"
#: Extensions that we read, or that change nothing of the shape.
_KNOWN = (
    _MATERIAL,
    _PRODUCTION,
    "http://schemas.microsoft.com/3dmanufacturing/trianglesets/2021/07",
)
#: What other extensions are called, by a word of their address.
_CALLED = {
    "beamlattice": "beam lattices",
    "securecontent": "encrypted content",
    "booleanoperations": "boolean operations",
    "volumetric": "volumetric content",
    "implicit": "implicit functions",
    "displacement": "displacement",
    "slice": "slices in place of meshes",
}
#: Bytes of XML in all, and of one part beside its size in the archive.
MAX_BYTES, MAX_RATIO = 2_000_000_000, 400
#: Files in a package.
MAX_FILES = 20_000
_PIECE = 1 << 20


@dataclass(frozen=True)
class Component:
    """An object used by another, or by the plate.

    Attributes
    ----------
    path : str
        Part of the package that the object is in; empty for the same.
    id : int
        The object's number there.
    place : (4, 4) float64 array
        Its transform.
    """

    path: str
    id: int
    place: NDArray[np.float64]


@dataclass(frozen=True)
class BuildItem(Component):
    """What is to be printed.

    Attributes
    ----------
    printable : bool
        Whether a slicer prints it.
    """

    printable: bool = True


@dataclass
class MeshObject:
    """An object: a mesh, or components.

    Attributes
    ----------
    id : int
        Its number in its part.
    name : str
        Its name, where it has one.
    kind : str
        ``model``, ``solidsupport``, ``support``, ``surface`` or ``other``.
    vertices : list of tuple of float
        Corners.
    triangles : list of tuple of int
        Three corners each.
    properties : dict of int to (int, int)
        Property group and index of those triangles that have their own.
    paint : dict of int to str
        What a slicer painted on a triangle, as it writes it.
    components : list of Component
        What it is made of, where it is no mesh.
    property : (int, int)
        Property group and index of the whole; 0 where it has none.
    """

    id: int
    name: str
    kind: str
    property: tuple[int, int]
    vertices: list[tuple[float, float, float]] = field(default_factory=list)
    triangles: list[tuple[int, int, int]] = field(default_factory=list)
    properties: dict[int, tuple[int, int]] = field(default_factory=dict)
    paint: dict[int, str] = field(default_factory=dict)
    components: list[Component] = field(default_factory=list)


@dataclass
class ModelPart:
    """One XML part of a package.

    Attributes
    ----------
    objects : dict of int to MeshObject
        By their numbers.
    items : list of BuildItem
        What the part prints.
    colours : dict of int to list of (int, int, int)
        sRGB of property groups.
    unit : str
        Of all lengths.
    """

    objects: dict[int, MeshObject] = field(default_factory=dict)
    items: list[BuildItem] = field(default_factory=list)
    colours: dict[int, list[tuple[int, int, int]]] = field(default_factory=dict)
    unit: str = "millimeter"


class Package:
    """A 3MF archive whose parts are parsed when they are asked for.

    Parameters
    ----------
    path : Path
        The file.
    archive : zipfile.ZipFile
        Open for reading.

    Attributes
    ----------
    name : str
        Name of the file, for messages.
    root : str
        Name of the part that says what is printed.
    """

    def __init__(self, path: Path, archive: zipfile.ZipFile) -> None:
        self.name = path.name
        self._archive = archive
        self._parts: dict[str, ModelPart] = {}
        self._known = {info.filename.lower(): info for info in archive.infolist()}
        self._spent = 0
        if len(self._known) > MAX_FILES:
            raise ModelError(f"{self.name} holds over {MAX_FILES:,} files: not a model")
        self.root = self._root()

    def _root(self) -> str:
        found: list[str] = []

        def start(tag: str, values: dict[str, str]) -> None:
            if tag.endswith("Relationship") and values.get("Type") == _ROOT:
                found.append(values.get("Target", ""))

        if "_rels/.rels" in self._known:
            self._parse("_rels/.rels", start, None)
        return (found or ["3D/3dmodel.model"])[0].lstrip("/")

    def text(self, name: str) -> bytes | None:
        """Content of a small file of the package; None where there is none.

        Parameters
        ----------
        name : str
            Its path in the package.

        Raises
        ------
        ModelError
            If it is damaged, or much too large.
        """
        info = self._known.get(name.lower())
        return None if info is None else b"".join(self._pieces(info))

    def part(self, name: str = "") -> ModelPart:
        """A parsed part.

        Parameters
        ----------
        name : str
            Its path in the package; empty for the root.

        Raises
        ------
        ModelError
            If it is missing, damaged, too large, or needs what we do not read.
        """
        name = (name or self.root).lstrip("/")
        if name not in self._parts:
            reader = _PartReader(self.name, name)
            self._parse(name, reader.start, reader.end, reader.prefixes)
            self._parts[name] = reader.part
        return self._parts[name]

    def elements(self, name: str) -> list[tuple[str, dict[str, str]]]:
        """Tags of a small XML file in order, ends as ``/tag``; empty where it is not there."""
        found: list[tuple[str, dict[str, str]]] = []
        if name.lower() in self._known:
            self._parse(
                name,
                lambda tag, values: found.append((tag, dict(values))),
                lambda tag: found.append(("/" + tag, {})),
            )
        return found

    def _pieces(self, info: zipfile.ZipInfo) -> Any:
        wanted = info.file_size
        if wanted > 10_000_000 and wanted > MAX_RATIO * max(info.compress_size, 1):
            raise ModelError(
                f"{self.name}: {info.filename} says that it expands {MAX_RATIO} times and more: "
                "no model does"
            )
        try:
            with self._archive.open(info) as stream:
                while piece := stream.read(_PIECE):
                    self._spent += len(piece)
                    if self._spent > MAX_BYTES:
                        raise ModelError(
                            f"{self.name} expands to more than {MAX_BYTES / 1e9:g} GB; "
                            "export a coarser model"
                        )
                    yield piece
        except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as why:
            raise ModelError(
                f"{self.name} cannot be read as 3MF ({info.filename}: {str(why)[:100]}); "
                "export the model again"
            ) from why

    def _parse(
        self, name: str, start: Any, end: Any, prefixes: dict[str, str] | None = None
    ) -> None:
        info = self._known.get(name.lower())
        if info is None:
            raise ModelError(
                f"{self.name}: the part {name} is missing from the package; export or save it again"
            )
        parser = expat.ParserCreate(namespace_separator=" ")
        parser.buffer_text = True
        parser.StartElementHandler = start
        parser.EndElementHandler = end
        parser.StartDoctypeDeclHandler = self._refuse_doctype
        if prefixes is not None:
            parser.StartNamespaceDeclHandler = lambda prefix, uri: prefixes.__setitem__(
                prefix or "", uri or ""
            )
        try:
            for piece in self._pieces(info):
                parser.Parse(piece, False)
            parser.Parse(b"", True)
        except expat.ExpatError as why:
            raise ModelError(
                f"{self.name} cannot be read as 3MF ({name}, {why}); export the model again"
            ) from why
        except (KeyError, ValueError, OverflowError) as why:
            raise ModelError(
                f"{self.name} cannot be read as 3MF ({name}, line {parser.CurrentLineNumber}: "
                f"{type(why).__name__} {str(why)[:80]}); export the model again"
            ) from why

    def _refuse_doctype(self, *_: object) -> None:
        raise ModelError(f"{self.name} declares entities of its own, which no 3MF needs")


class _PartReader:
    """Fills a model part from the events of the parser."""

    def __init__(self, file: str, name: str) -> None:
        self.part = ModelPart()
        self._file, self._name = file, name
        self.prefixes: dict[str, str] = {}
        self._object: MeshObject | None = None
        self._group: list[tuple[int, int, int]] = []

    def start(self, tag: str, values: dict[str, str]) -> None:
        space, _, word = tag.rpartition(" ")
        if space == _MATERIAL:
            if word == "colorgroup":
                self._group = self.part.colours.setdefault(int(values["id"]), [])
            elif word == "color":
                self._group.append(_shade(values.get("color", "")))
            return
        thing = self._object
        if word == "vertex" and thing is not None:
            thing.vertices.append((float(values["x"]), float(values["y"]), float(values["z"])))
        elif word == "triangle" and thing is not None:
            self._triangle(thing, values)
        elif word == "object":
            whole = (int(values.get("pid", 0)), int(values.get("pindex", 0)))
            number = int(values["id"])
            self._object = MeshObject(
                number, values.get("name", ""), values.get("type", "model"), whole
            )
            self.part.objects[number] = self._object
        elif word == "component" and thing is not None:
            path = values.get(f"{_PRODUCTION} path", "")
            place = _affine(values.get("transform"))
            thing.components.append(Component(path, int(values["objectid"]), place))
        elif word == "item":
            path = values.get(f"{_PRODUCTION} path", "")
            printable = values.get("printable", values.get(f"{_PRUSA} printable", "1"))
            self.part.items.append(
                BuildItem(
                    path,
                    int(values["objectid"]),
                    _affine(values.get("transform")),
                    printable.strip().lower() not in ("0", "false"),
                )
            )
        elif word == "basematerials":
            self._group = self.part.colours.setdefault(int(values["id"]), [])
        elif word == "base":
            self._group.append(_shade(values.get("displaycolor", "")))
        elif word == "model":
            self.part.unit = values.get("unit", "millimeter")
            for prefix in values.get("requiredextensions", "").split():
                self._require(self.prefixes.get(prefix, prefix))

    def _require(self, address: str) -> None:
        """Refuse, by its name, an extension without which the shape is not what is meant."""
        if address in _KNOWN or address == _CORE:
            return
        words = [called for word, called in _CALLED.items() if word in address.lower()]
        what = words[0] if words else f"the extension {address}"
        raise ModelError(f"{self._file} needs {what}, which cannot be read; export plain meshes")

    @staticmethod
    def _triangle(thing: MeshObject, values: dict[str, str]) -> None:
        index = len(thing.triangles)
        thing.triangles.append((int(values["v1"]), int(values["v2"]), int(values["v3"])))
        if len(values) == 3:
            return
        if "p1" in values:
            group = int(values.get("pid", thing.property[0]))
            thing.properties[index] = (group, int(values["p1"]))
        paint = values.get("paint_color") or values.get(f"{_PRUSA} mmu_segmentation")
        if paint:
            thing.paint[index] = paint

    def end(self, tag: str) -> None:
        if tag.endswith(" object"):
            self._object = None


def _shade(text: str) -> tuple[int, int, int]:
    """``#RRGGBB`` or ``#RRGGBBAA``; white where it is none."""
    try:
        red, green, blue = bytes.fromhex(text.strip().lstrip("#")[:6])
    except ValueError:
        return (255, 255, 255)
    return (red, green, blue)


def _affine(text: str | None) -> NDArray[np.float64]:
    """The twelve numbers of a transform as a matrix for column vectors."""
    matrix = np.eye(4)
    if text:
        numbers = np.array([float(word) for word in text.split()])
        matrix[:3, :] = numbers.reshape(4, 3).T
    return matrix


def open_package(path: Path) -> Package:
    """Open a 3MF file.

    Parameters
    ----------
    path : Path
        A file that begins as an archive does.

    Returns
    -------
    Package
        Nothing of its parts is read yet.

    Raises
    ------
    ModelError
        If it is no archive, or a damaged one.
    """
    try:
        return Package(path, zipfile.ZipFile(path))
    except (zipfile.BadZipFile, ValueError, EOFError, NotImplementedError) as why:
        raise ModelError(
            f"{path.name} cannot be read as 3MF ({str(why)[:100]}); export the model again"
        ) from why
