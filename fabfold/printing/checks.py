"""Checks of the printed bodies against the limits of a printer and material.

What each figure can and cannot say is in ``docs/check.md``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import GeometryError
from fabfold.fold.motion import Motion
from fabfold.joinery.bodies import BodyMesh, Joinery
from fabfold.joinery.cells import as_manifold
from fabfold.meshes import face_areas, face_normals
from fabfold.printing.profiles import Profile
from fabfold.printing.thickness import ray_thickness
from fabfold.progress import Progress, SilentProgress
from fabfold.tree.fold_tree import FoldTree

if TYPE_CHECKING:
    import manifold3d

__all__ = ["Check", "check_bodies", "smallest_gap"]

#: Share of the surface that may be thinner than the profile's wall. Organic models that are cut by
#: planes end in knife edges, which print rounded and do no harm; whole blades do.
THIN_SHARE_LIMIT = 0.10
#: Points at which thickness is measured, over all bodies.
_THICKNESS_POINTS = 12_000
#: Facets of the round surfaces and single precision take this much off a gap at most.
GAP_TOLERANCE_MM = 0.002
#: Bodies may overlap by this much before it is more than rounding, mm³.
_OVERLAP_MM3 = 1e-3

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Check:
    """One check with what it found.

    Attributes
    ----------
    name : str
        What was looked at.
    figure : float
        What was found.
    limit : float or None
        What it is held against; None for information only.
    unit : str
        Unit of figure and limit.
    ok : bool
    note : str
        What it means, in a maker's words, and which body it is about.
    """

    name: str
    figure: float
    limit: float | None
    unit: str
    ok: bool
    note: str


class _Solid(NamedTuple):
    body: BodyMesh
    manifold: manifold3d.Manifold
    low: Floats
    high: Floats


def check_bodies(
    joinery: Joinery,
    tree: FoldTree,
    motion: Motion,
    profile: Profile,
    progress: Progress | None = None,
) -> list[Check]:
    """Check all bodies of a kit for printing.

    Parameters
    ----------
    joinery : Joinery
    tree : FoldTree
        Names the hinged pairs.
    motion : Motion
        Its last keyframe is the box, whose size is reported.
    profile : Profile
    progress : Progress, optional

    Returns
    -------
    list of Check
    """
    told = progress or SilentProgress()
    told.update(0.0, "reading the bodies")
    checks = _topology(joinery, told)
    try:
        solids = [
            _Solid(
                body,
                as_manifold(body.vertices, body.faces, body.name),
                body.vertices.min(axis=0),
                body.vertices.max(axis=0),
            )
            for body in joinery.bodies
        ]
    except GeometryError as error:
        # Nothing below can be measured on a mesh that is no solid.
        return [*checks, Check("bodies are solids", 1.0, 0.0, "bodies", False, str(error))]
    told.update(0.4, "gaps between bodies")
    checks += _gaps(joinery, tree, solids, profile)
    told.update(0.6, "walls")
    checks += _walls(joinery, solids, profile)
    told.update(0.9, "sizes and overhangs")
    checks += _sizes(joinery, tree, motion, profile)
    checks.append(_overhang(joinery, profile))
    told.update(1.0, f"{len(checks)} checks")
    return checks


def _worst(names: list[str], values: list[int]) -> str:
    """Names of the bodies with a value above zero."""
    bad = [f"{name} ({value})" for name, value in zip(names, values, strict=True) if value]
    return ", ".join(bad[:5]) + (f" and {len(bad) - 5} more" if len(bad) > 5 else "")


def _topology(joinery: Joinery, told: Progress) -> list[Check]:
    """What MeshLab says of each mesh: open edges, branching surfaces, pieces, crossings."""
    import pymeshlab

    names = [body.name for body in joinery.bodies]
    opened, branching, pieces, crossing = [], [], [], []
    for index, body in enumerate(joinery.bodies):
        told.update(0.4 * index / len(names), f"mesh of {body.name}")
        meshes = pymeshlab.MeshSet(verbose=False)
        meshes.add_mesh(
            pymeshlab.Mesh(
                np.ascontiguousarray(body.vertices, dtype=np.float64),
                np.ascontiguousarray(body.faces, dtype=np.int32),
            )
        )
        measures = meshes.get_topological_measures()
        opened.append(int(measures["boundary_edges"]))
        branching.append(
            int(measures["non_two_manifold_edges"]) + int(measures["non_two_manifold_vertices"])
        )
        pieces.append(int(measures["connected_components_number"]) - 1)
        meshes.compute_selection_by_self_intersections_per_face()
        crossing.append(int(meshes.current_mesh().selected_face_number()))
    count = len(names)

    def check(name: str, values: list[int], unit: str, fine: str) -> Check:
        bad = _worst(names, values)
        return Check(name, float(sum(values)), 0.0, unit, not bad, bad or fine)

    return [
        check("closed surfaces", opened, "open edges", f"all {count} meshes are watertight"),
        check(
            "two-manifold surfaces",
            branching,
            "edges and corners",
            "no edge or corner where more than two sheets meet",
        ),
        check(
            "one piece a body",
            pieces,
            "loose pieces",
            f"{count} bodies, {count} pieces: nothing falls out of the printer",
        ),
        check(
            "surfaces that cross themselves",
            crossing,
            "triangles",
            "slicers and CAD read every body as a plain solid",
        ),
    ]


def smallest_gap(
    first: manifold3d.Manifold, second: manifold3d.Manifold, reach_mm: float
) -> tuple[float, float]:
    """Gap and overlap of two solids.

    Parameters
    ----------
    first, second : manifold3d.Manifold
    reach_mm : float
        Gaps are looked for up to this.

    Returns
    -------
    gap : float
        Smallest distance of the two surfaces in mm, at most `reach_mm`; 0 if they overlap.
    overlap : float
        Common volume in mm³.
    """
    overlap = float((first ^ second).volume())
    gap = 0.0 if overlap > _OVERLAP_MM3 else float(first.min_gap(second, reach_mm))
    return gap, overlap


def _gaps(joinery: Joinery, tree: FoldTree, solids: list[_Solid], profile: Profile) -> list[Check]:
    reach = 2.0 * joinery.clearance_mm
    hinged = {(h.parent, h.child): h.name for h in tree.hinges}
    best, where, pairs, overlap, fused = reach, "", 0, 0.0, []
    for i, one in enumerate(solids):
        for j in range(i + 1, len(solids)):
            other = solids[j]
            if (one.low > other.high + reach).any() or (other.low > one.high + reach).any():
                continue
            pairs += 1
            gap, common = smallest_gap(one.manifold, other.manifold, reach)
            if common > _OVERLAP_MM3:
                overlap += common
                fused.append(f"{one.body.name} and {other.body.name}")
            if gap < best:
                best = gap
                where = f"{one.body.name} and {other.body.name}"
                if (i, j) in hinged:
                    where += f", at {hinged[i, j]}"
    if pairs == 0 or not where:
        note = f"no two bodies are nearer than {reach:g} mm"
    else:
        note = f"between {where}; {pairs} pairs of neighbours measured in shape A"
    if best < profile.min_gap_mm - GAP_TOLERANCE_MM:
        note += f"; {profile.process} may fuse it: give a --clearance-mm above {best:.2f}"
    return [
        Check(
            "smallest gap between bodies",
            best,
            profile.min_gap_mm,
            "mm",
            best >= profile.min_gap_mm - GAP_TOLERANCE_MM,
            note,
        ),
        Check(
            "bodies overlap",
            overlap,
            _OVERLAP_MM3,
            "mm³",
            overlap <= _OVERLAP_MM3,
            ", ".join(fused[:5]) or "no body reaches into another",
        ),
    ]


def _walls(joinery: Joinery, solids: list[_Solid], profile: Profile) -> list[Check]:
    # At 45 degrees the mouth of a recess is 0.414 clearances wider than the foot of its cone.
    ring = (
        joinery.barrel_radius_mm
        - joinery.pin_radius_mm
        - (np.sqrt(2.0) - 1.0) * joinery.clearance_mm
    )
    areas = np.array([_area(solid.body) for solid in solids])
    counts = np.maximum(30, np.rint(_THICKNESS_POINTS * areas / areas.sum())).astype(int)
    limit = profile.min_wall_mm
    thin = np.array(
        [
            ray_thickness(
                solid.manifold, solid.body.vertices, solid.body.faces, int(count), 4.0 * limit
            ).share_below(limit)
            for solid, count in zip(solids, counts, strict=True)
        ]
    )
    share = float((thin * areas).sum() / areas.sum())
    worst = int(np.argmax(thin))
    return [
        Check(
            "thinnest wall in a hinge",
            float(ring),
            limit,
            "mm",
            bool(ring >= limit - 1e-9),
            f"barrel of {joinery.barrel_radius_mm:g} mm radius around a recess for a pin of "
            f"{joinery.pin_radius_mm:g} mm radius; the same in every hinge",
        ),
        Check(
            "surface thinner than the printer's wall",
            100.0 * share,
            100.0 * THIN_SHARE_LIMIT,
            "%",
            share <= THIN_SHARE_LIMIT,
            f"share of the surface with less than {limit:g} mm of material behind it; the most on "
            f"{solids[worst].body.name} ({100 * thin[worst]:.0f} %). Knife edges where a plane "
            "cuts the model count too; they print rounded",
        ),
    ]


def _area(body: BodyMesh) -> float:
    return float(face_areas(body.vertices[body.faces]).sum())


def _sizes(joinery: Joinery, tree: FoldTree, motion: Motion, profile: Profile) -> list[Check]:
    volumes = [body.volume for body in joinery.bodies]
    least = int(np.argmin(volumes))
    extent = np.ptp(joinery.bodies[least].vertices, axis=0)
    smallest = joinery.bodies[least]
    voxels = len(tree.bodies[least].voxels)
    made_of = "a link plate" if tree.bodies[least].edge is not None else _plural(voxels, "voxel")
    # A cube of three walls: enough to clean, to find and to hold with tweezers.
    limit = (3.0 * profile.min_wall_mm) ** 3
    total = float(sum(volumes))
    box = joinery.voxel_mm * np.asarray(tree.template.shape, dtype=float)
    full = joinery.voxel_mm**3 * len(tree.template)
    checks = [
        Check(
            "smallest body",
            float(volumes[least]),
            limit,
            "mm³",
            bool(volumes[least] >= limit),
            f"{smallest.name}, {_size(extent)}, {made_of}",
        ),
        Check(
            "material",
            total / 1000.0,
            None,
            "cm³",
            True,
            f"{len(volumes)} bodies and {len(tree.hinges)} hinges; folds into {_size(box)} in "
            f"{len(motion.angles_deg) - 1} moves, {100 * total / full:.0f} % of it full",
        ),
    ]
    if profile.bed_mm is None:
        return checks
    low = np.min([body.vertices.min(axis=0) for body in joinery.bodies], axis=0)
    high = np.max([body.vertices.max(axis=0) for body in joinery.bodies], axis=0)
    spans: list[tuple[str, Floats]] = [("the closed kit", np.asarray(high - low, dtype=float))]
    if not profile.in_place:
        # Printed apart, the largest body decides.
        spans = [(body.name, np.ptp(body.vertices, axis=0)) for body in joinery.bodies]
    bed = np.sort(np.array(profile.bed_mm))
    name, span = max(spans, key=lambda item: float((np.sort(item[1]) / bed).max()))
    share = float((np.sort(span) / bed).max())
    checks.append(
        Check(
            "fits the printer",
            100.0 * share,
            100.0,
            "%",
            share <= 1.0,
            f"{name}, {_size(span)}, in a build volume of {_size(np.array(profile.bed_mm))}",
        )
    )
    return checks


def _plural(count: int, word: str) -> str:
    return f"{count} {word}" + ("" if count == 1 else "s")


def _size(extent: Floats) -> str:
    return " × ".join(f"{value:.0f}" for value in extent) + " mm"


def _overhang(joinery: Joinery, profile: Profile) -> Check:
    """Share of the surface that hangs over, in the best of six print directions."""
    if profile.max_overhang_deg is None:
        return Check(
            "overhang",
            0.0,
            None,
            "%",
            True,
            f"{profile.process} needs no support: powder or support material carries every face",
        )
    steepest = profile.max_overhang_deg

    per_body = np.array([_overhang_areas(body, steepest) for body in joinery.bodies])
    areas = np.array([_area(body) for body in joinery.bodies])
    whole = per_body.sum(axis=0) / areas.sum()
    laid = float(per_body.min(axis=1).sum() / areas.sum())
    worst = int(np.argmax(per_body.min(axis=1) / areas))
    up = ("+x", "-x", "+y", "-y", "+z", "-z")
    best = int(np.argmin(whole))
    return Check(
        "overhang",
        100.0 * laid,
        None,
        "%",
        True,
        f"share of the surface steeper than {steepest:g}° with every body laid its best way down; "
        f"the most on {joinery.bodies[worst].name}. All in one pose: {100 * whole[best]:.0f} % "
        f"with {up[best]} up. Supports may not stand in hinges",
    )


def _overhang_areas(body: BodyMesh, steepest_deg: float) -> Floats:
    """Area of the faces that hang over, by print direction +x, -x, +y, -y, +z, -z, mm²."""
    corners = body.vertices[body.faces]
    unit, area = face_normals(corners)
    hang = np.sin(np.radians(steepest_deg))
    found = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            down = -sign * unit[:, axis]
            # Faces that lie on the plate are carried by it.
            height = sign * corners[:, :, axis]
            lying = (height < height.min() + 0.05).all(axis=1)
            found.append(float(area[(down > hang + 1e-9) & ~lying].sum()))
    return np.array(found)
