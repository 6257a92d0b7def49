"""3MF packages of named, coloured parts, in memory.

No one arrangement of objects is read as *one object of named parts* by every slicer, so there are
several, called layouts:

``"whole"``
    One mesh object that holds every part, with its triangle ranges and names in
    ``Metadata/Slic3r_PE_model.config``: PrusaSlicer and SuperSlicer open it as one object of named
    parts, and any other slicer as one coloured object.
``"kit"``
    The same, and each part is in the file as an object of its own too, named and coloured, of type
    "other" and outside the build, for programs that look for parts.
``"assembly"``
    One mesh object a part and one build item that holds them all as components, in their places.
    This is how the 3MF core specification groups parts; Bambu Studio and OrcaSlicer open it as one
    object of named parts, each in its own colour where ``Application`` says
    :data:`hinges.slicer_parts.BAMBU`. PrusaSlicer does not: it takes the components apart into
    separate objects, and refuses those that do not touch the plate.
``"apart"``
    One mesh object and one build item a part: for parts laid out on a plate.

References
----------
3MF Core Specification 1.3, sections 4 and 5; 3MF Materials and Properties Extension 1.2.
"""

from __future__ import annotations

import ctypes
import io
import uuid
import zipfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from .exceptions import HingeError
from .slicer_parts import bambu_model, bambu_project, prusa_model, prusa_project

__all__ = ["DECIMALS", "Layout", "PackagePart", "package_3mf"]

Layout = Literal["whole", "kit", "assembly", "apart"]
#: Decimal places of a millimetre that the file keeps.
DECIMALS = 6
#: Kinds of the files that may come with a model.
_CONTENT_TYPES = {"pdf": "application/pdf", "csv": "text/csv"}
#: Metadata names that the core specification knows; all others get a name space of their own.
_KNOWN = frozenset(
    {
        "Title",
        "Designer",
        "Description",
        "Copyright",
        "LicenseTerms",
        "Rating",
        "CreationDate",
        "ModificationDate",
        "Application",
    }
)
#: Bed that a file for Bambu Studio names where none is known, mm.
_BAMBU_BED_MM = (256.0, 256.0, 256.0)


@dataclass(frozen=True)
class PackagePart:
    """A part, ready to be written.

    Attributes
    ----------
    name : str
        Its name.
    vertices : (v, 3) float array
        Corners in mm, to be rounded to single precision.
    faces : (f, 3) int array
        Three corners of each triangle, counter-clockwise as seen from outside.
    colour : (int, int, int)
        sRGB, 0 to 255.
    """

    name: str
    vertices: NDArray[np.floating[Any]]
    faces: NDArray[np.integer[Any]]
    colour: tuple[int, int, int]


def package_3mf(
    parts: Sequence[PackagePart],
    *,
    title: str,
    facts: Mapping[str, str],
    layout: Layout,
    owner: str = "hinges",
    filaments: bool = True,
    closed: bool = False,
    move: tuple[float, float, float] = (0.0, 0.0, 0.0),
    thumbnail: bytes | None = None,
    settings: Callable[[list[int]], Mapping[str, str]] | None = None,
    auxiliaries: Mapping[str, bytes] | None = None,
) -> bytes:
    """Write parts as one 3MF package; the same input gives the same bytes.

    Parameters
    ----------
    parts : sequence of PackagePart
        The parts in the place where they are to be printed, with names of their own.
    title : str
        Name of the whole.
    facts : mapping of str to str
        Metadata. Names that the 3MF core specification does not know are put into the name space
        ``urn:<owner>:kit``.
    layout : {"whole", "kit", "assembly", "apart"}
        How the parts are grouped; see the module's description.
    owner : str
        Who writes: part of name spaces and of the UUIDs that follow from names.
    filaments : bool
        Whether each part is printed in a filament of its own; its colour is then one of the 3MF
        materials extension, and else a base material's.
    closed : bool
        Whether to refuse meshes that are not manifold and oriented.
    move : (float, float, float)
        How far the parts are moved on the plate, mm.
    thumbnail : bytes, optional
        A PNG that file managers and slicers show for the file.
    settings : callable, optional
        Files of slicer settings by name, in place of the layout's own; it is given the number of
        each part's object.
    auxiliaries : mapping of str to bytes, optional
        Files that come with the model, by folder and name: Bambu Studio shows those in
        ``Assembly Guide``, ``Bill of Materials`` and ``Model Pictures``.

    Returns
    -------
    bytes
        The package.

    Raises
    ------
    HingeError
        If a mesh is not manifold and oriented, where that is asked for.
    """
    import lib3mf

    # UUIDs are made from the content's name, never drawn, so that two writes agree.
    namespace = f"urn:{owner}:kit"
    space = uuid.uuid5(uuid.NAMESPACE_URL, f"{namespace}/{title}")
    wrapper = lib3mf.get_wrapper()
    model = wrapper.CreateModel()
    model.SetUnit(lib3mf.ModelUnit.MilliMeter)
    model.SetLanguage("en-US")
    group = model.GetMetaDataGroup()
    for key in sorted(facts):
        group.AddMetaData("" if key in _KNOWN else namespace, key, facts[key], "xs:string", True)
    model.SetBuildUUID(str(uuid.uuid5(space, "build")))
    work = _Work(lib3mf, wrapper, model, closed)
    attached: dict[str, str] = {}
    colours = np.array([part.colour for part in parts], dtype=np.uint8)
    paints = None if filaments else work.paints(parts, filaments=False)
    bodies = [] if layout == "whole" else [work.mesh(part) for part in parts]
    for body, part in zip(bodies, parts, strict=False):
        body.SetUUID(str(uuid.uuid5(space, part.name)))
    built = bodies
    if layout in ("whole", "kit"):
        for body in bodies:
            # PrusaSlicer fails on objects of type "model" that are not built.
            body.SetType(lib3mf.ObjectType.Other)
        whole = work.mesh(_joined(parts, title))
        ranges = [(part.name, len(part.faces)) for part in parts]
        number = whole.GetModelResourceID()
        attached["Slic3r_PE_model.config"] = prusa_model(number, title, ranges, filaments=filaments)
        if filaments and layout == "kit":
            attached["Slic3r_PE.config"] = prusa_project(colours)
        built = [whole]
    elif layout == "assembly":
        whole = work.assembly(title, parts, bodies, space)
        numbered = [(b.GetModelResourceID(), p.name) for b, p in zip(bodies, parts, strict=True)]
        attached = {
            "model_settings.config": bambu_model(whole.GetModelResourceID(), title, numbered),
            "project_settings.config": bambu_project(_BAMBU_BED_MM, colours),
        }
        built = [whole]
    paints = work.paints(parts, filaments=True) if paints is None else paints
    for body, paint in zip(bodies, paints[1], strict=False):
        body.SetObjectLevelProperty(paints[0], paint)
    if layout in ("whole", "kit"):
        work.paint(built[0], parts, *paints)
    if layout != "apart":
        built[0].SetUUID(str(uuid.uuid5(space, "kit")))
    if settings is not None:
        attached = dict(settings([body.GetModelResourceID() for body in bodies]))
    place = _translation(lib3mf, move)
    for index, entry in enumerate(built):
        item = model.AddBuildItem(entry, place)
        item.SetUUID(str(uuid.uuid5(space, f"item {index}")))
    _attach(model, f"urn:{owner}:slicer-settings", attached, thumbnail, auxiliaries or {})
    writer = model.QueryWriter("3mf")
    writer.SetDecimalPrecision(DECIMALS)
    return _repacked(_written(writer))


@dataclass(frozen=True)
class _Work:
    """A model of lib3mf under work."""

    lib3mf: Any
    wrapper: Any
    model: Any
    closed: bool

    def mesh(self, part: PackagePart) -> Any:
        """Add a named mesh object."""
        target = self.model.AddMeshObject()
        target.SetName(part.name)
        points = np.ascontiguousarray(part.vertices, dtype="<f4")
        corners = np.ascontiguousarray(part.faces, dtype="<u4")
        target.SetGeometry(
            (self.lib3mf.Position * len(points)).from_buffer_copy(points.tobytes()),
            (self.lib3mf.Triangle * len(corners)).from_buffer_copy(corners.tobytes()),
        )
        if self.closed and not target.IsManifoldAndOriented():
            raise HingeError(
                f"{part.name}: lib3mf finds the mesh of {len(corners)} triangles not manifold and "
                "oriented"
            )
        return target

    def paints(self, parts: Sequence[PackagePart], *, filaments: bool) -> tuple[int, list[int]]:
        """Add the colours of all parts: number of the group, and of each colour in it."""
        colours = [self.wrapper.RGBAToColor(*part.colour, 255) for part in parts]
        if filaments:
            palette = self.model.AddColorGroup()
            return palette.GetResourceID(), [palette.AddColor(colour) for colour in colours]
        materials = self.model.AddBaseMaterialGroup()
        made = [
            materials.AddMaterial(part.name, colour)
            for part, colour in zip(parts, colours, strict=True)
        ]
        return materials.GetResourceID(), made

    def paint(
        self, whole: Any, parts: Sequence[PackagePart], group: int, paints: list[int]
    ) -> None:
        """Give the triangles of each part of one mesh their colour."""
        painted = np.repeat(paints, [len(part.faces) for part in parts])
        record = np.empty((len(painted), 4), dtype="<u4")
        record[:, 0] = group
        record[:, 1:] = painted[:, None]
        kind = self.lib3mf.TriangleProperties * len(record)
        whole.SetAllTriangleProperties(kind.from_buffer_copy(record.tobytes()))

    def assembly(
        self, title: str, parts: Sequence[PackagePart], bodies: list[Any], space: uuid.UUID
    ) -> Any:
        """Add one object that holds all parts as components, in their places."""
        whole = self.model.AddComponentsObject()
        whole.SetName(title)
        for part, body in zip(parts, bodies, strict=True):
            component = whole.AddComponent(body, self.wrapper.GetIdentityTransform())
            component.SetUUID(str(uuid.uuid5(space, f"component {part.name}")))
        return whole


def _joined(parts: Sequence[PackagePart], title: str) -> PackagePart:
    """All parts as one, in their order."""
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    faces = [part.faces + start for part, start in zip(parts, starts, strict=False)]
    vertices = np.concatenate([part.vertices for part in parts])
    return PackagePart(title, vertices, np.concatenate(faces), parts[0].colour)


def _attach(
    model: Any,
    relationship: str,
    settings: Mapping[str, str],
    thumbnail: bytes | None,
    auxiliaries: Mapping[str, bytes],
) -> None:
    """Put files of slicer settings, by name, a thumbnail and others into the package."""
    for ending, kind in _CONTENT_TYPES.items():
        if any(name.endswith(f".{ending}") for name in auxiliaries):
            model.AddCustomContentType(ending, kind)
    for name, content in auxiliaries.items():
        attachment = model.AddAttachment(f"/Auxiliaries/{name}", relationship)
        attachment.ReadFromBuffer(content)
    if settings:
        model.AddCustomContentType("config", "text/xml")
    for file_name, text in settings.items():
        attachment = model.AddAttachment(f"/Metadata/{file_name}", relationship)
        attachment.ReadFromBuffer(text.encode("utf-8"))
    if thumbnail is not None:
        model.CreatePackageThumbnailAttachment().ReadFromBuffer(thumbnail)


def _translation(lib3mf: Any, offset: Sequence[float]) -> Any:
    """A transform of lib3mf that moves by an offset in mm."""
    transform = lib3mf.Transform()
    for row in range(3):
        transform.Fields[row][row] = 1.0
        transform.Fields[3][row] = float(offset[row])
    return transform


def _written(writer: Any) -> bytes:
    """What a writer of lib3mf writes.

    lib3mf ends the whole program where it cannot write to a file, on a full disk for one; so it
    writes to memory, and Python to the disk.
    """
    import lib3mf

    package = io.BytesIO()

    def write(address: int, count: int, _: int | None) -> None:
        package.write(ctypes.string_at(address, count))

    def seek(position: int, _: int | None) -> None:
        package.seek(position)

    writer.WriteToCallback(lib3mf.WriteCallback(write), lib3mf.SeekCallback(seek), 0)
    return package.getvalue()


def _repacked(package: bytes) -> bytes:
    """The same package with its content types first and valid dates (lib3mf writes month 0)."""
    result = io.BytesIO()
    with (
        zipfile.ZipFile(io.BytesIO(package)) as old,
        zipfile.ZipFile(result, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as new,
    ):
        for name in sorted(old.namelist(), key=lambda n: (n != "[Content_Types].xml", n)):
            entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 0
            new.writestr(entry, old.read(name))
    return result.getvalue()
