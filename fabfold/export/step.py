"""STEP: the bodies as named solids in shape A, with true cylinders and cones at the hinges.

A body's mesh is thinned where it is sculpted, turned into faces (see
:mod:`fabfold.export.round_faces`), written as STEP text, read
back with the CAD kernel, and compared with the mesh. A body whose solid is not valid, or differs
from its mesh, is written again with flat faces only, and then triangle by triangle.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import GeometryError
from fabfold.export.body_brep import Brep, Face, brep_of
from fabfold.export.colours import body_colours, palette
from fabfold.export.rims import straightened
from fabfold.export.round_faces import round_regions, sculpted_triangles
from fabfold.export.steptext import FIRST_NUMBER, StepPart, StepSolid, step_file, step_part
from fabfold.export.surfaces import (
    Axis,
    Plane,
    Surface,
    flat_regions,
)
from fabfold.export.thin import thinned
from fabfold.export.weld import weld_rounded, without_needles
from fabfold.files import write_text
from fabfold.joinery.bodies import BodyMesh, Joinery
from fabfold.meshes import mesh_volume
from fabfold.progress import Progress, SilentProgress
from fabfold.solid.convert import to_manifold, to_mesh
from fabfold.tree.fold_tree import FoldTree

__all__ = ["StepFacts", "write_step"]

#: A solid's volume may differ from its mesh's by this share before it is written again.
VOLUME_SHARE = 0.01
#: Shorter edges are the last digits of single precision, which the CAD kernel cannot take; and
#: those that go too where it says that a face crosses itself, far below what anything prints.
_SHORTEST_MM, _SHORT_MM = 2e-5, 2e-3
#: Sculpted surfaces may be thinned to within this share of the voxel side, and to within this share
#: of the clearance: two bodies stay apart though both have moved.
THIN_SHARE, THIN_CLEARANCE = 0.0075, 0.25
#: What is tried in turn: the faces, the shortest edge that stays, and whether the mesh is
#: simplified so far as well, which takes triangles away whose corners lie on one line. Slivers may
#: cross themselves, thinned surfaces too, and round faces may be refused.
_LEVELS = (
    ("round, thinned", _SHORTEST_MM, False),
    ("round, thinned", _SHORTEST_MM, True),
    ("round, thinned", _SHORT_MM, True),
    ("round", _SHORT_MM, True),
    ("flat", _SHORT_MM, True),
    ("triangles", _SHORTEST_MM, True),
)


@dataclass(frozen=True)
class StepFacts:
    """What :func:`write_step` wrote.

    Attributes
    ----------
    solids : int
        Number of solids.
    faces : int
        Number of faces of all solids.
    round_faces : int
        Number of those on true cylinders and cones.
    plain : tuple of str
        Names of the bodies that could not be written with round faces.
    volume_mm3 : float
        Volume of all solids in mm³, as the CAD kernel measures it.
    """

    solids: int
    faces: int
    round_faces: int
    plain: tuple[str, ...]
    volume_mm3: float


def barrel_axes(joinery: Joinery, tree: FoldTree) -> list[list[Axis]]:
    """Lines on which barrels lie or come to rest: the lattice edges of each body's cells.

    Parameters
    ----------
    joinery : Joinery
        The printed bodies; it tells the voxel's side, the origin and the size of the hinges.
    tree : FoldTree
        The bodies and their voxels.

    Returns
    -------
    list of list of Axis
        The lines of each body, in mm, by index of the body.
    """
    origin = np.asarray(joinery.origin_mm, dtype=float)
    reach = 1.5 * (joinery.barrel_radius_mm + joinery.clearance_mm)
    found: list[list[Axis]] = []
    for body in tree.bodies:
        voxels = list(body.voxels)
        if not voxels and body.edge is not None:
            voxels = [tree.edges[body.edge].parent, tree.edges[body.edge].child]
        lines: set[tuple[float, ...]] = set()
        for cell in tree.source[voxels].tolist():
            for along in range(3):
                for side in (-0.5, 0.5):
                    for other in (-0.5, 0.5):
                        middle = [float(value) for value in cell]
                        middle[(along + 1) % 3] += side
                        middle[(along + 2) % 3] += other
                        lines.add((along, *middle))
        axes = []
        for direction, *point in sorted(lines):
            x, y, z = (origin + joinery.voxel_mm * np.array(point)).tolist()
            axes.append(Axis((x, y, z), int(direction), 0.5 * joinery.voxel_mm, reach))
        found.append(axes)
    return found


def write_step(
    path: Path,
    joinery: Joinery,
    tree: FoldTree | None = None,
    *,
    title: str | None = None,
    colours: NDArray[np.uint8] | None = None,
    progress: Progress | None = None,
    hardware: Sequence[StepSolid] = (),
    assembled: Path | None = None,
) -> StepFacts:
    """Write the bodies as solids, in mm, shape A; the same input gives the same bytes.

    Parameters
    ----------
    path : Path
        File to write, ending in ``.step``.
    joinery : Joinery
        The printed bodies in shape A.
    tree : FoldTree, optional
        The bodies and hinges; it tells where the hinges are. Without it every face is flat, and
        none is thinned.
    title : str, optional
        Name of the assembly; the file's stem by default.
    colours : (b, 3) uint8 array, optional
        Colour of each body, sRGB.
    progress : Progress, optional
        Is told which body is written.
    hardware : sequence of StepSolid
        What is put into the bodies, for `assembled`.
    assembled : Path, optional
        A second file, which holds the bodies and the hardware; it goes where there is none.

    Returns
    -------
    StepFacts
        What was written to `path`.

    Raises
    ------
    GeometryError
        If the CAD kernel finds no valid solid for a body, even from plain triangles.
    """
    from fabfold.version import __version__

    progress = progress or SilentProgress()
    if colours is None:
        colours = palette(len(joinery.bodies)) if tree is None else body_colours(tree)
    # Without the tree nothing tells barrels from sculpted surfaces, so nothing is thinned.
    bound_mm = min(THIN_SHARE * joinery.voxel_mm, THIN_CLEARANCE * joinery.clearance_mm)
    thin_mm = bound_mm if tree is not None else 0.0
    axes = barrel_axes(joinery, tree) if tree is not None else [[] for _ in joinery.bodies]
    application = f"fabfold {__version__}"
    parts: list[StepPart] = []
    faces: list[Face] = []
    plain, volume, following = [], 0.0, FIRST_NUMBER
    for index, body in enumerate(joinery.bodies):
        progress.update(index / len(joinery.bodies), body.name)
        red, green, blue = (int(value) for value in colours[index])
        sound = _sound_part(body, (red, green, blue), axes[index], thin_mm, following, application)
        parts.append(sound.part)
        faces += sound.faces
        volume += sound.volume_mm3
        following = sound.part.following
        if not sound.level.startswith("round"):
            plain.append(body.name)
    title = title or path.stem
    write_text(path, step_file(parts, title, application))
    solids = len(parts)
    if assembled is not None and hardware:
        for solid in hardware:
            parts.append(step_part(solid, parts[-1].following))
        assembled.parent.mkdir(exist_ok=True)
        write_text(assembled, step_file(parts, f"{title} assembled", application))
    elif assembled is not None:
        assembled.unlink(missing_ok=True)
    progress.update(1.0, f"{solids} solids")
    return StepFacts(
        solids=solids,
        faces=len(faces),
        round_faces=sum(not isinstance(face.surface, Plane) for face in faces),
        plain=tuple(plain),
        volume_mm3=volume,
    )


class _SoundPart(NamedTuple):
    """A body whose solid the CAD kernel finds valid."""

    part: StepPart
    faces: tuple[Face, ...]
    level: str
    volume_mm3: float


def _sound_part(
    body: BodyMesh,
    colour: tuple[int, int, int],
    axes: list[Axis],
    thin_mm: float,
    first: int,
    application: str,
) -> _SoundPart:
    """The best faces whose solid is valid and has the mesh's volume; entities from `first` on."""
    wanted = mesh_volume(body.vertices, body.faces)
    faults = []
    for level, shortest_mm, simplify in _LEVELS:
        try:
            mesh = (body.vertices, body.faces)
            if simplify:
                points, triangles = to_mesh(to_manifold(*mesh).simplify(shortest_mm))
                mesh = (points, triangles.astype(np.int32))
            brep = _brep(*without_needles(*mesh, shortest_mm), axes, level, thin_mm)
            part = step_part(StepSolid(body.name, brep, colour), first)
            valid, volume = _measured(step_file([part], body.name, application))
        except (ValueError, IndexError, GeometryError) as error:
            faults.append(f"{level}: {error}")
            continue
        if valid and abs(volume - wanted) <= VOLUME_SHARE * wanted:
            return _SoundPart(part, brep.faces, level, volume)
        faults.append(f"{level}: {'valid' if valid else 'not valid'}, {volume:.2f} mm³")
    raise GeometryError(
        f"{body.name}: no valid STEP solid of its {len(body.faces)} triangles and {wanted:.2f} mm³ "
        f"({'; '.join(faults)}); the STL and 3MF files are not affected"
    )


def _brep(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    axes: list[Axis],
    level: str,
    thin_mm: float,
) -> Brep:
    if level == "triangles":
        points, faces = weld_rounded(vertices, faces)
        vertices = points.astype(np.float64)
        labels = np.arange(len(faces), dtype=np.int32)
        surfaces: list[Surface] = []
        for corner in vertices[faces]:
            normal = np.cross(corner[1] - corner[0], corner[2] - corner[0])
            length = np.linalg.norm(normal)
            normal = normal / length if length > 0 else np.array([0.0, 0.0, 1.0])
            x, y, z = corner[0].tolist()
            surfaces.append(
                Plane((x, y, z), (float(normal[0]), float(normal[1]), float(normal[2])))
            )
        return brep_of(vertices, faces, labels, surfaces)
    labels, planes = flat_regions(vertices, faces)
    if thin_mm > 0 and level.endswith("thinned"):
        sculpted = sculpted_triangles(vertices, faces, labels, planes, axes)
        simpler = straightened(vertices, faces, labels, planes, sculpted, thin_mm)
        vertices, faces = thinned(*simpler, thin_mm, original=(vertices, faces))
        labels, planes = flat_regions(vertices, faces)
    surfaces = list(planes)
    if level.startswith("round"):
        labels, surfaces = round_regions(vertices, faces, labels, planes, axes)
    return brep_of(vertices, faces, labels, surfaces)


def _measured(text: str) -> tuple[bool, float]:
    """Whether the CAD kernel reads one valid solid, and its volume in mm³."""
    from OCP.BRepCheck import BRepCheck_Analyzer
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.IFSelect import IFSelect_ReturnStatus
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer

    reader = STEPControl_Reader()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "body.step"
        path.write_text(text, encoding="ascii")
        if reader.ReadFile(str(path)) != IFSelect_ReturnStatus.IFSelect_RetDone:
            return False, 0.0
        reader.TransferRoots()
    solids, volume = [], 0.0
    explorer = TopExp_Explorer(reader.OneShape(), TopAbs_ShapeEnum.TopAbs_SOLID)
    while explorer.More():
        solids.append(explorer.Current())
        measured = GProp_GProps()
        BRepGProp.VolumeProperties_s(solids[-1], measured)
        volume += measured.Mass()
        explorer.Next()
    return len(solids) == 1 and BRepCheck_Analyzer(solids[0]).IsValid(), volume
