"""3MF: what goes to the slicer, with a name and a colour for each body.

No one arrangement of objects is read as *one kit of named parts* by every slicer, so there are
three, called layouts:

``"kit"``
    One mesh object that holds every body is what gets printed. The bodies' triangle ranges and
    names stand in ``Metadata/Slic3r_PE_model.config``, so PrusaSlicer and SuperSlicer open it as
    one object of named parts, and any other slicer as one coloured object: nothing can be moved
    apart by mistake. Each body is in the file as an object of its own too, named and coloured,
    of type "other" and outside the build, for programs that look for parts.
``"assembly"``
    One mesh object a body and one build item that holds them all as components, in their places.
    This is how the 3MF core specification groups parts; Bambu Studio and OrcaSlicer open it as one
    object of named parts, each in its own colour where ``Application`` says
    :data:`fabfold.export.bambu.BAMBU`. PrusaSlicer does not: it takes the components apart into
    separate objects, and refuses those that do not touch the plate.
``"apart"``
    One mesh object and one build item a body: for bodies laid out on a plate.

References
----------
3MF Core Specification 1.3, sections 4 and 5.
"""

from __future__ import annotations

import io
import uuid
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import GeometryError
from fabfold.export.bambu import bambu_model, bambu_project
from fabfold.export.colours import palette
from fabfold.export.prusa import prusa_model, prusa_project
from fabfold.export.weld import printable_mesh
from fabfold.files import write_bytes
from fabfold.joinery.bodies import Joinery

__all__ = ["Layout", "posed", "write_3mf"]

#: Kinds of the files that may come with a model.
_CONTENT_TYPES = {"pdf": "application/pdf", "csv": "text/csv"}

#: How the bodies are grouped in the file; see the description above.
Layout = Literal["kit", "assembly", "apart"]

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
#: Decimal places of a millimetre that the file keeps.
_DECIMALS = 6
_NAMESPACE = "urn:fabfold:kit"
_RELATIONSHIP = "urn:fabfold:slicer-settings"
#: Bed that a file for Bambu Studio names where none is known, mm.
_BAMBU_BED_MM = (256.0, 256.0, 256.0)
_Mesh = tuple[NDArray[np.float32], NDArray[np.int32]]


def posed(joinery: Joinery, poses_mm: NDArray[np.float64]) -> Joinery:
    """The same bodies, each moved from its place in shape A.

    Parameters
    ----------
    joinery : Joinery
        The printed bodies in shape A.
    poses_mm : (b, 4, 4) float64 array
        Rigid transform of each body, mm.

    Returns
    -------
    Joinery
        The moved bodies, for a print pose or a plate.
    """
    bodies = tuple(
        replace(body, vertices=body.vertices @ pose[:3, :3].T + pose[:3, 3])
        for body, pose in zip(joinery.bodies, np.asarray(poses_mm, dtype=float), strict=True)
    )
    return replace(joinery, bodies=bodies)


def write_3mf(
    path: Path,
    joinery: Joinery,
    *,
    title: str,
    metadata: Mapping[str, str] | None = None,
    colours: NDArray[np.uint8] | None = None,
    layout: Layout = "kit",
    thumbnail: bytes | None = None,
    keep_place: bool = False,
    coloured_parts: bool = False,
    settings: Callable[[list[int]], Mapping[str, str]] | None = None,
    auxiliaries: Mapping[str, bytes] | None = None,
) -> None:
    """Write the bodies as one 3MF file; the same input gives the same bytes.

    Parameters
    ----------
    path : Path
        File to write, ending in ``.3mf``.
    joinery : Joinery
        The bodies in the place where they are to be printed; see :func:`posed`.
    title : str
        Title of the file and name of the whole.
    metadata : mapping of str to str, optional
        Facts about the file, written as given. Names that the 3MF core specification does not know
        are put into the name space ``urn:fabfold:kit``. ``Application`` is ``fabfold`` unless
        given.
    colours : (b, 3) uint8 array, optional
        Colour of each body, sRGB.
    layout : {"kit", "assembly", "apart"}
        How the bodies are grouped; see the module's description.
    thumbnail : bytes, optional
        A PNG that file managers and slicers show for the file.
    keep_place : bool
        Whether the bodies stay where they are; otherwise they are moved so that all coordinates
        begin at 0.
    coloured_parts : bool
        With the layout "kit": whether PrusaSlicer, where it opens the file as a project, shows each
        body in its colour, as of an extruder of its own.
    settings : callable, optional
        Files of slicer settings by name, in place of the layout's own; it is given the number of
        each body's object.
    auxiliaries : mapping of str to bytes, optional
        Files that come with the model, by folder and name: Bambu Studio shows those in
        ``Assembly Guide``, ``Bill of Materials`` and ``Model Pictures``.

    Raises
    ------
    GeometryError
        If a body does not stay closed in the file's precision, or lib3mf finds it not manifold.
    """
    import lib3mf

    from fabfold.version import __version__
    from hinges.package import package_bytes

    if colours is None:
        colours = palette(len(joinery.bodies))
    meshes = [printable_mesh(body, _DECIMALS) for body in joinery.bodies]
    names = [body.name for body in joinery.bodies]
    facts = {"Title": title, "Application": f"fabfold {__version__}", **(metadata or {})}
    # UUIDs are made from the content's name, never drawn, so that two writes agree.
    space = uuid.uuid5(uuid.NAMESPACE_URL, f"{_NAMESPACE}/{title}")

    wrapper = lib3mf.get_wrapper()
    model = wrapper.CreateModel()
    model.SetUnit(lib3mf.ModelUnit.MilliMeter)
    model.SetLanguage("en-US")
    group = model.GetMetaDataGroup()
    for key in sorted(facts):
        group.AddMetaData("" if key in _KNOWN else _NAMESPACE, key, facts[key], "xs:string", True)
    materials = model.AddBaseMaterialGroup()
    paints = [
        materials.AddMaterial(name, wrapper.RGBAToColor(*(int(c) for c in colour), 255))
        for name, colour in zip(names, colours, strict=True)
    ]
    model.SetBuildUUID(str(uuid.uuid5(space, "build")))
    bodies = []
    for name, mesh, paint in zip(names, meshes, paints, strict=True):
        body = _add_mesh(lib3mf, model, name, mesh)
        body.SetObjectLevelProperty(materials.GetResourceID(), paint)
        body.SetUUID(str(uuid.uuid5(space, name)))
        bodies.append(body)
    built, attached = bodies, {}
    if layout == "kit":
        for body in bodies:
            # PrusaSlicer fails on objects of type "model" that are not built.
            body.SetType(lib3mf.ObjectType.Other)
        whole = _add_whole(lib3mf, model, title, meshes, materials.GetResourceID(), paints)
        ranges = [(name, len(faces)) for name, (_, faces) in zip(names, meshes, strict=True)]
        number = whole.GetModelResourceID()
        attached = {
            "Slic3r_PE_model.config": prusa_model(number, title, ranges, coloured=coloured_parts)
        }
        if coloured_parts:
            attached["Slic3r_PE.config"] = prusa_project(np.asarray(colours))
        built = [whole]
    elif layout == "assembly":
        whole = _add_assembly(wrapper, model, title, names, bodies, space)
        parts = [(b.GetModelResourceID(), name) for b, name in zip(bodies, names, strict=True)]
        attached = {
            "model_settings.config": bambu_model(whole.GetModelResourceID(), title, parts),
            "project_settings.config": bambu_project(_BAMBU_BED_MM, np.asarray(colours)),
        }
        built = [whole]
    if layout != "apart":
        built[0].SetUUID(str(uuid.uuid5(space, "kit")))
    if settings is not None:
        attached = dict(settings([body.GetModelResourceID() for body in bodies]))
    lowest = np.min([vertices.min(axis=0) for vertices, _ in meshes], axis=0)
    if keep_place:
        lowest = np.zeros(3)
    place = _translation(lib3mf, -np.round(lowest.astype(float), _DECIMALS))
    for index, entry in enumerate(built):
        item = model.AddBuildItem(entry, place)
        item.SetUUID(str(uuid.uuid5(space, f"item {index}")))
    _attach(model, attached, thumbnail, auxiliaries or {})
    writer = model.QueryWriter("3mf")
    writer.SetDecimalPrecision(_DECIMALS)
    write_bytes(path, _repacked(package_bytes(writer)))


def _attach(
    model: Any,
    settings: Mapping[str, str],
    thumbnail: bytes | None,
    auxiliaries: Mapping[str, bytes],
) -> None:
    """Put files of slicer settings, by name, a thumbnail and others into the package."""
    for ending, kind in _CONTENT_TYPES.items():
        if any(name.endswith(f".{ending}") for name in auxiliaries):
            model.AddCustomContentType(ending, kind)
    for name, content in auxiliaries.items():
        attachment = model.AddAttachment(f"/Auxiliaries/{name}", _RELATIONSHIP)
        attachment.ReadFromBuffer(content)
    if settings:
        model.AddCustomContentType("config", "text/xml")
    for file_name, text in settings.items():
        attachment = model.AddAttachment(f"/Metadata/{file_name}", _RELATIONSHIP)
        attachment.ReadFromBuffer(text.encode("utf-8"))
    if thumbnail is not None:
        model.CreatePackageThumbnailAttachment().ReadFromBuffer(thumbnail)


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


def _translation(lib3mf: Any, offset: NDArray[np.float64]) -> Any:
    """A transform of lib3mf that moves by an offset (3,) in mm."""
    transform = lib3mf.Transform()
    for row in range(3):
        transform.Fields[row][row] = 1.0
        transform.Fields[3][row] = float(offset[row])
    return transform


def _add_mesh(lib3mf: Any, model: Any, name: str, mesh: _Mesh) -> Any:
    """Add a named mesh object to the model."""
    vertices, faces = mesh
    target = model.AddMeshObject()
    target.SetName(name)
    points = np.ascontiguousarray(vertices, dtype="<f4")
    corners = np.ascontiguousarray(faces, dtype="<u4")
    target.SetGeometry(
        (lib3mf.Position * len(points)).from_buffer_copy(points.tobytes()),
        (lib3mf.Triangle * len(corners)).from_buffer_copy(corners.tobytes()),
    )
    if not target.IsManifoldAndOriented():
        raise GeometryError(
            f"{name}: lib3mf finds the mesh of {len(corners)} triangles not manifold and oriented; "
            f"make the kit with another seed"
        )
    return target


def _add_whole(
    lib3mf: Any, model: Any, title: str, meshes: list[_Mesh], materials: int, paints: list[int]
) -> Any:
    """Add one mesh object that holds all bodies, each in its colour."""
    starts = np.cumsum([0] + [len(vertices) for vertices, _ in meshes])
    vertices = np.concatenate([vertices for vertices, _ in meshes])
    faces = np.concatenate([faces + s for (_, faces), s in zip(meshes, starts, strict=False)])
    whole = _add_mesh(lib3mf, model, title, (vertices, faces))
    whole.SetObjectLevelProperty(materials, paints[0])
    painted = np.repeat(paints, [len(faces) for _, faces in meshes])
    record = np.empty((len(painted), 4), dtype="<u4")
    record[:, 0] = materials
    record[:, 1:] = painted[:, None]
    properties = (lib3mf.TriangleProperties * len(record)).from_buffer_copy(record.tobytes())
    whole.SetAllTriangleProperties(properties)
    return whole


def _add_assembly(
    wrapper: Any, model: Any, title: str, names: list[str], bodies: list[Any], space: uuid.UUID
) -> Any:
    """Add one object that holds all bodies as components, in their places."""
    whole = model.AddComponentsObject()
    whole.SetName(title)
    for name, body in zip(names, bodies, strict=True):
        component = whole.AddComponent(body, wrapper.GetIdentityTransform())
        component.SetUUID(str(uuid.uuid5(space, f"component {name}")))
    return whole
