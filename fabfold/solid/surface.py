"""Close a surface: drop stray triangles, wind all others alike, cap the holes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import ModelError
from fabfold.meshes import compact, face_areas, weld
from fabfold.solid.polygon import triangulate_loop
from fabfold.solid.sew import sew
from fabfold.solid.topology import Edges, Faces, Points, orient, patches, shells
from fabfold.solid.words import were

__all__ = ["OpenSurfaceError", "Shell", "close_surface"]

#: A patch whose caps would be larger than this share of its own area is a sheet, not a body.
CAP_SHARE = 0.6
#: Sheets are dropped if together they have at most this share of the whole area.
SHEET_SHARE = 0.15
#: A surface with a larger share of open edges than this is a soup of triangles.
SOUP_SHARE = 0.5
#: Faces with an area of less than this times the square of the longest side count as none.
NO_AREA = 1e-14


@dataclass(frozen=True)
class Shell:
    """One closed surface, as yet of either orientation.

    Attributes
    ----------
    vertices : (v, 3) float64 array
        Corner coordinates, all of them in use; the longest side of the model is about 1.
    faces : (f, 3) int64 array
        Three vertex indices for each triangle, wound alike.
    """

    vertices: Points
    faces: Faces


class OpenSurfaceError(Exception):
    """The surface is too open to be closed by capping holes; `args[0]` says why."""


def close_surface(name: str, vertices: Points, faces: Faces) -> tuple[list[Shell], list[str]]:
    """Make closed shells of a triangle mesh whose longest side is about 1.

    Parameters
    ----------
    name : str
        Name of the file, for messages.
    vertices : (v, 3) float64 array
        Corner coordinates; corners may be repeated.
    faces : (f, 3) int64 array
        Three vertex indices for each triangle, wound either way.

    Returns
    -------
    shells : list of Shell
        Each closed by itself; they may overlap, nest, and be inside out.
    notes : list of str
        Sentences for the maker that say what was done.

    Raises
    ------
    ModelError
        If the mesh is a soup of triangles.
    OpenSurfaceError
        If it is a surface, but too open to be capped.
    """
    notes: list[str] = []
    vertices, faces = weld(vertices, faces)
    if len(faces) and not Edges.of(faces).closed:
        faces, gap = sew(vertices, faces)
        # Less than this is rounding, and not worth a word.
        if gap > 1e-6:
            notes.append(f"cracks of up to {gap:.2g} of the model's length were sewn up")
    if len(faces) == 0:
        raise ModelError(f"{name} has no volume: all its triangles are points or lines")
    edges = Edges.of(faces)
    if edges.count.max() > 2:
        faces = _drop_repeated(faces, notes)
        edges = Edges.of(faces)
    if edges.closed:
        return _split(vertices, faces), notes
    if (edges.count == 1).sum() > SOUP_SHARE * len(edges.count):
        raise ModelError(
            f"{name} is not a closed surface: {int((edges.count == 1).sum())} of its "
            f"{len(edges.count)} edges have one face only, the {len(faces)} triangles are hardly "
            "joined; export the model as one closed solid"
        )
    faces = _drop_flat(vertices, faces, notes)
    faces, turned, one_sided = orient(vertices, faces)
    if turned:
        notes.append(f"{were(turned, 'triangle')} facing the wrong way and turned")
    if one_sided:
        raise OpenSurfaceError("part of the surface is one-sided")
    edges = Edges.of(faces)
    if edges.closed:
        return _split(vertices, faces), notes
    return _cap(vertices, faces, notes), notes


def _drop_repeated(faces: Faces, notes: list[str]) -> Faces:
    """Drop faces between the same three vertices: all but one, or all where that closes more."""
    _, first, index, count = np.unique(
        np.sort(faces, axis=1), axis=0, return_index=True, return_inverse=True, return_counts=True
    )
    if len(first) == len(faces):
        return faces
    once = faces[np.sort(first)]
    never = faces[count[index.ravel()] == 1]
    # Two equal faces are either written twice or are a wall inside the model.
    wall = len(never) > 0 and Edges.of(never).odd < Edges.of(once).odd
    kept = never if wall else once
    dropped = were(len(faces) - len(kept), "inner triangle" if wall else "repeated triangle")
    notes.append(f"{dropped} dropped" + (" (walls inside the model)" if wall else ""))
    return kept


def _drop_flat(vertices: Points, faces: Faces, notes: list[str]) -> Faces:
    """Drop faces without area where the surface is more closed for it."""
    flat = face_areas(vertices[faces]) < NO_AREA
    if flat.any() and not flat.all():
        rest = faces[~flat]
        if Edges.of(rest).odd < Edges.of(faces).odd:
            notes.append(f"{were(int(flat.sum()), 'triangle')} dropped for want of an area")
            return rest
    return faces


def _split(vertices: Points, faces: Faces) -> list[Shell]:
    label = shells(faces)
    order = np.argsort(label, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(label[order])) + 1)
    return [Shell(*compact(vertices, faces[part])) for part in parts]


def _cap(vertices: Points, faces: Faces, notes: list[str]) -> list[Shell]:
    """Cap the holes of every open patch; drop the patches that are mere sheets."""
    label = patches(faces)
    order = np.argsort(label, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(label[order])) + 1)
    areas = face_areas(vertices[faces])
    found: list[Shell] = []
    sheets, sheet_area, holes, cap_area = 0, 0.0, 0, 0.0
    for part in parts:
        own = faces[part]
        edges = Edges.of(own)
        if edges.closed:
            found.append(Shell(*compact(vertices, own)))
            continue
        loops = _loops(own, edges)
        caps = [loop[triangulate_loop(vertices[loop])] for loop in loops]
        cap = np.concatenate(caps)
        covered = float(face_areas(vertices[cap]).sum())
        if covered > CAP_SHARE * areas[part].sum():
            sheets += 1
            sheet_area += float(areas[part].sum())
            continue
        holes += len(loops)
        cap_area += covered
        found.append(Shell(*compact(vertices, np.concatenate([own, cap]))))
    share = sheet_area / float(areas.sum())
    if not found or share > SHEET_SHARE:
        raise OpenSurfaceError(
            f"{sheets} of its {len(parts)} surfaces are open sheets, {share:.0%} of the area"
        )
    if holes:
        covered = cap_area / float(areas.sum() + cap_area)
        notes.append(f"{were(holes, 'hole')} capped ({covered:.1%} of the surface)")
    if sheets:
        notes.append(
            f"{were(sheets, 'open sheet')} dropped for want of a thickness ({share:.1%} of the "
            "surface)"
        )
    return found


def _loops(faces: Faces, edges: Edges) -> list[NDArray[np.int64]]:
    """Rims of the holes of a patch as vertex loops, in the direction that a cap needs.

    A rim that passes a vertex twice is split there, so each loop is simple.
    """
    open_sides = edges.balance[edges.of_side] != 0
    starts = faces[open_sides]
    ends = np.roll(faces, -1, axis=1)[open_sides]
    following: dict[int, list[int]] = {}
    for start, end in zip(ends.tolist(), starts.tolist(), strict=True):
        following.setdefault(start, []).append(end)
    loops: list[NDArray[np.int64]] = []
    for seed in sorted(following):
        while following[seed]:
            trail = [seed]
            place = {seed: 0}
            while following.get(trail[-1]):
                step = following[trail[-1]].pop()
                if step in place:
                    at = place[step]
                    if len(trail) - at >= 3:
                        loops.append(np.array(trail[at:], dtype=np.int64))
                    for vertex in trail[at + 1 :]:
                        del place[vertex]
                    trail = trail[: at + 1]
                else:
                    place[step] = len(trail)
                    trail.append(step)
            if len(trail) > 1:
                raise OpenSurfaceError("the rim of a hole does not close")
    if not loops:
        raise OpenSurfaceError("the rims of its holes cannot be followed")
    return loops
