"""Checks of a file as it lies, ours or not: whether a printer can make it, and move what moves."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import GeometryError, ModelError
from fabfold.joinery.bodies import BodyMesh
from fabfold.joinery.cells import solids_of
from fabfold.joinery.soundness import piece_of_vertices
from fabfold.meshes import centre_of_mass, compact, face_normals, mesh_volume, weld
from fabfold.printing.checks import Check
from fabfold.printing.escape_checks import check_escape
from fabfold.printing.gap_checks import check_gaps
from fabfold.printing.profiles import Profile
from fabfold.printing.standing import stands_over
from fabfold.printing.thickness import ray_thickness, surface_area
from fabfold.printing.topology_checks import check_topology
from fabfold.printing.wall_checks import thin_share
from fabfold.progress import Progress

if TYPE_CHECKING:
    import manifold3d

__all__ = ["check_file", "parts_of"]

Floats = NDArray[np.float64]

#: Gaps between parts are looked for up to this width, mm.
_REACH_MM = 2.0
#: Faces this near to the lowest point lie on the plate, mm.
_FLAT_MM = 0.05
#: Points at which walls are measured, over all parts, and how far a ray looks, in walls.
_POINTS, _LOOK = 6_000, 10.0
#: Share of the surface that is rim, not wall.
_RIM = 0.01
#: Parts that would be too many to measure every pair of.
_MOST_PARTS = 500


def parts_of(path: Path) -> tuple[list[BodyMesh], list[float]]:
    """The solids in a file, and the volumes of the closed pockets in them.

    Parameters
    ----------
    path : Path
        STL, OBJ, PLY, OFF, GLB, 3MF or STEP; mm.

    Returns
    -------
    parts : list of BodyMesh
        Pieces that hang together, the largest first, ``part-01`` and so on.
    pockets : list of float
        Volume in mm³ of every surface that is turned inside out.

    Raises
    ------
    ModelError
        If the file cannot be read, or holds too many pieces.
    """
    from fabfold.solid.load import read_mesh

    raw = read_mesh(path)
    points, faces = weld(raw.vertices, raw.faces, order="xyz")
    owner = piece_of_vertices(len(points), faces)[faces[:, 0]]
    names, first = np.unique(owner, return_index=True)
    if len(names) > _MOST_PARTS:
        raise ModelError(
            f"{path.name}: {len(names)} separate pieces are too many to measure the gaps between "
            f"(at most {_MOST_PARTS}); are the triangles joined at all?"
        )
    pieces = [compact(points, faces[owner == name]) for name in names[np.argsort(first)]]
    sized = [(mesh_volume(v, f), v, f.astype(np.int32)) for v, f in pieces]
    solid = sorted((item for item in sized if item[0] >= 0), key=lambda item: -item[0])
    if not solid:
        raise ModelError(f"{path.name}: every surface is turned inside out; flip the normals")
    parts = [BodyMesh(f"part-{i:02d}", v, f) for i, (_, v, f) in enumerate(solid, start=1)]
    return parts, [-volume for volume, _, _ in sized if volume < 0]


def check_file(path: Path, profile: Profile, progress: Progress) -> list[Check]:
    """Check a file for a printer, in the pose in which it lies, z up.

    Parameters
    ----------
    path : Path
        STL, OBJ, PLY, OFF, GLB, 3MF or STEP; mm.
    profile : Profile
        Limits of the printer and material.
    progress : Progress
        Hears what is being checked.

    Returns
    -------
    list of Check
        Each with its figure, limit, unit and verdict.

    Raises
    ------
    ModelError
        If the file cannot be read.
    """
    progress.update(0.0, f"reading {path.name}")
    parts, pockets = parts_of(path)
    checks = check_topology(parts, progress)
    checks = [check for check in checks if check.name != "one piece a body"]
    checks.append(_pockets(pockets, profile))
    try:
        solids = solids_of(parts)
    except GeometryError as error:
        # Nothing below can be measured on a mesh that is no solid.
        return [*checks, Check("parts are solids", 1.0, 0.0, "parts", False, str(error))]
    progress.update(0.3, "ways out")
    checks += check_escape(parts, profile, parts)
    progress.update(0.4, "gaps between parts")
    checks += check_gaps(parts, solids, profile, _REACH_MM)
    progress.update(0.6, "walls")
    checks.append(_thinnest(parts, solids, profile))
    checks.append(thin_share(parts, solids, profile))
    progress.update(0.9, "how it lies")
    checks += [
        _overhang(parts, profile),
        _contact(parts),
        _toppling(parts),
        _extent(parts, profile),
        _material(parts, profile),
    ]
    progress.update(1.0, f"{len(checks)} checks")
    return checks


def _pockets(pockets: Sequence[float], profile: Profile) -> Check:
    """Closed pockets: powder, resin or support that never comes out."""
    holds = profile.process in ("SLS", "MJF", "PolyJet", "SLA")
    told = ", ".join(f"{volume:.0f} mm³" for volume in sorted(pockets, reverse=True)[:5])
    note = "no pocket is closed on all sides"
    if pockets:
        note = f"{told}; " + (
            f"what {profile.process} leaves in them cannot be removed: open a way out of 5 mm"
            if holds
            else "air, which does no harm"
        )
    return Check(
        "closed pockets", float(len(pockets)), 0.0 if holds else None, "pockets",
        not (holds and pockets), note,
    )  # fmt: skip


def _thinnest(
    parts: Sequence[BodyMesh], solids: Sequence[manifold3d.Manifold], profile: Profile
) -> Check:
    """The thinnest wall, where two surfaces face away from each other, and its place."""
    areas = np.array([surface_area(part) for part in parts])
    counts = np.maximum(60, np.rint(_POINTS * areas / areas.sum())).astype(int)
    limit = profile.min_wall_mm
    walls, places, owners = [], [], []
    for index, (part, solid, count) in enumerate(zip(parts, solids, counts, strict=True)):
        found = ray_thickness(solid, part.vertices, part.faces, int(count), _LOOK * limit)
        walls.append(np.where(found.opposed, found.values, np.inf))
        places.append(found.points)
        owners.append(np.full(int(count), index))
    every = np.concatenate(walls)
    # A wall has some area; the very thinnest points are the rims of knife edges.
    weight = np.concatenate([np.full(c, area / c) for c, area in zip(counts, areas, strict=True)])
    order = np.argsort(every, kind="stable")
    at = int(order[np.searchsorted(np.cumsum(weight[order]), _RIM * areas.sum())])
    least, place = float(every[at]), np.concatenate(places)[at]
    name = parts[int(np.concatenate(owners)[at])].name
    if not np.isfinite(least):
        return Check(
            "thinnest wall", _LOOK * limit, limit, "mm", True,
            f"no wall is thinner than {_LOOK * limit:g} mm",
        )  # fmt: skip
    x, y, z = place
    return Check(
        "thinnest wall", least, limit, "mm", least >= 0.98 * limit,
        f"on {name}, at {x:.1f}, {y:.1f}, {z:.1f} mm",
    )  # fmt: skip


def _overhang(parts: Sequence[BodyMesh], profile: Profile) -> Check:
    """Area that hangs over as the parts lie."""
    if profile.max_overhang_deg is None:
        return Check("overhang", 0.0, None, "mm²", True, f"{profile.process} needs no support")
    hang = np.sin(np.radians(profile.max_overhang_deg))
    low = min(part.vertices[:, 2].min() for part in parts)
    area, worst, most = 0.0, "", 0.0
    for part in parts:
        corners = part.vertices[part.faces]
        unit, size = face_normals(corners)
        lying = (corners[..., 2] < low + _FLAT_MM).all(axis=1)
        found = float(size[(-unit[:, 2] > hang + 1e-9) & ~lying].sum())
        area += found
        if found > most:
            worst, most = part.name, found
    note = f"steeper than {profile.max_overhang_deg:g}° as it lies"
    note += f"; most on {worst}" if worst else ""
    return Check("overhang", area, None, "mm²", True, note)


def _lying_area(part: BodyMesh, low: float) -> float:
    corners = part.vertices[part.faces]
    unit, size = face_normals(corners)
    lying = (corners[..., 2] < low + _FLAT_MM).all(axis=1) & (unit[:, 2] < -0.999)
    return float(size[lying].sum())


def _contact(parts: Sequence[BodyMesh]) -> Check:
    """Contact with the plate, and parts that have none."""
    low = min(part.vertices[:, 2].min() for part in parts)
    areas = [_lying_area(part, float(low)) for part in parts]
    hanging = [part.name for part, area in zip(parts, areas, strict=True) if area <= 0.0]
    note = "every part lies on the plate"
    if hanging:
        note = f"{', '.join(hanging[:5])} begin in the air: they hang on support or on nothing"
    return Check("contact with the plate", sum(areas), None, "mm²", True, note)


def _toppling(parts: Sequence[BodyMesh]) -> Check:
    """Whether the centre of mass of all is over what touches the plate."""
    points = np.concatenate([part.vertices for part in parts])
    low = points[:, 2].min()
    centre = centre_of_mass(np.concatenate([part.vertices[part.faces] for part in parts]))
    stands = stands_over(centre, points[points[:, 2] < low + _FLAT_MM][:, :2])
    x, y = centre[:2]
    where = "over what touches the plate" if stands else "beside what touches it: add a brim"
    return Check(
        "stands by itself", float(stands), None, "", True,
        f"centre of mass at {x:.1f}, {y:.1f} mm, {where}",
    )  # fmt: skip


def _extent(parts: Sequence[BodyMesh], profile: Profile) -> Check:
    """Whether everything fits the build volume as it lies."""
    points = np.concatenate([part.vertices for part in parts])
    size = np.ptp(points, axis=0)
    text = " × ".join(f"{value:.1f}" for value in size) + " mm"
    if profile.bed_mm is None:
        return Check("size", float(size.max()), None, "mm", True, text)
    bed = np.array(profile.bed_mm)
    flat = min(max(size[0] / bed[0], size[1] / bed[1]), max(size[1] / bed[0], size[0] / bed[1]))
    share = float(max(flat, size[2] / bed[2]))
    room = " × ".join(f"{value:g}" for value in bed)
    note = f"{text} in a build volume of {room} mm"
    if share > 1.0:
        note += f"; scaled to {100 / share:.0f} % it fits"
    return Check("fits the printer", 100.0 * share, 100.0, "%", share <= 1.0, note)


def _material(parts: Sequence[BodyMesh], profile: Profile) -> Check:
    volume = sum(part.volume for part in parts) / 1000.0
    material = profile.material or "material"
    grams = volume * profile.density_g_cm3
    return Check(
        "material", volume, None, "cm³", True,
        f"{len(parts)} parts; {grams:.0f} g of {material} if solid",
    )  # fmt: skip
