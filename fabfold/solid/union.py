"""Make one body of closed shells: union, self-crossings, cavities."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fabfold.errors import ModelError
from fabfold.meshes import mesh_volume
from fabfold.solid.convert import decimated, from_mesh_set, to_manifold, to_mesh, to_mesh_set
from fabfold.solid.surface import Shell
from fabfold.solid.topology import Edges, Faces, Points
from fabfold.solid.words import were
from fabfold.solid.wrap import wrap

if TYPE_CHECKING:
    import manifold3d

__all__ = ["MAX_TRIANGLES", "unite"]

#: Denser meshes are decimated: a box of some hundred voxels shows nothing of the rest.
MAX_TRIANGLES = 200_000
#: A shell with less volume than this (longest side about 1) is flat.
NO_VOLUME = 1e-12
#: Self-crossings are resolved exactly up to this many triangles; denser meshes are decimated first.
CROSSING_LIMIT = 50_000
#: More crossing faces than this, if they are most of the mesh, take the exact way too long.
TANGLE_LIMIT = 1_000
#: Crossings that change the volume by less than this share are rounding, and left alone.
SAME_VOLUME = 1e-6


def unite(name: str, shells: Sequence[Shell], notes: list[str]) -> manifold3d.Manifold:
    """Union of closed shells: inside is where at least one shell, turned outwards, winds round.

    A shell that faces inwards inside another one bounds a cavity; closed cavities are filled.

    Parameters
    ----------
    name : str
        Name of the file, for messages.
    shells : sequence of Shell
        Closed surfaces of either orientation; the longest side of all together is about 1.
    notes : list of str
        Sentences for the maker; what was done is appended.

    Returns
    -------
    manifold3d.Manifold
        Perhaps of several pieces; without cavities.

    Raises
    ------
    ModelError
        If nothing with a volume is left.
    """
    import manifold3d

    volumes = [mesh_volume(shell.vertices, shell.faces) for shell in shells]
    solid = [k for k in range(len(shells)) if abs(volumes[k]) > NO_VOLUME]
    if not solid:
        raise _no_volume(name)
    if len(solid) < len(shells):
        notes.append(f"{were(len(shells) - len(solid), 'surface')} dropped for want of a volume")
    bodies: dict[int, manifold3d.Manifold] = {}
    crossing = 0
    for k in solid:
        faces = shells[k].faces if volumes[k] > 0 else shells[k].faces[:, ::-1]
        bodies[k], crossed = _sound(shells[k].vertices, faces)
        crossing += crossed
    if crossing:
        notes.append("the surface passes through itself; where it overlaps it counts as solid")
    inward = [k for k in solid if volumes[k] < 0]
    cavities = [
        k
        for k in inward
        if any(_contains(bodies[j], bodies[k]) for j in solid if volumes[j] > abs(volumes[k]))
    ]
    if turned := len(inward) - len(cavities):
        notes.append(
            "the model was inside out and was turned"
            if len(solid) == 1
            else f"{were(turned, 'shell')} inside out (of {len(solid)}) and turned"
        )
    rest = [bodies[k] for k in solid if k not in cavities]
    united = rest[0]
    if len(rest) > 1:
        united = manifold3d.Manifold.batch_boolean(rest, manifold3d.OpType.Add)
        notes.append(
            f"{were(len(rest), 'closed shell')} united; where they overlap they count as solid once"
        )
    united, hidden = _fill(united)
    if filled := len(cavities) + hidden:
        notes.append(
            f"{were(filled, 'closed cavity')} filled, since nobody sees inside and the hinges need "
            "the material"
        )
    if united.num_tri() == 0 or united.volume() < NO_VOLUME:
        raise _no_volume(name)
    return united


def _no_volume(name: str) -> ModelError:
    return ModelError(f"{name} is not a solid: its volume is zero; give its walls a thickness")


def _contains(outer: manifold3d.Manifold, inner: manifold3d.Manifold) -> bool:
    low, high = np.array(outer.bounding_box()).reshape(2, 3)
    own_low, own_high = np.array(inner.bounding_box()).reshape(2, 3)
    if (own_low < low).any() or (own_high > high).any():
        return False
    return bool((inner - outer).volume() < SAME_VOLUME * inner.volume())


def _fill(united: manifold3d.Manifold) -> tuple[manifold3d.Manifold, int]:
    """Fill the closed cavities of a body; how many there were."""
    import manifold3d

    parts = united.decompose()
    solid = [part for part in parts if part.volume() > NO_VOLUME]
    if len(solid) == len(parts):
        return united, 0
    hidden = sum(1 for part in parts if part.volume() < -NO_VOLUME)
    return manifold3d.Manifold.batch_boolean(solid, manifold3d.OpType.Add), hidden


def _sound(vertices: Points, faces: Faces) -> tuple[manifold3d.Manifold, bool]:
    """A manifold without self-crossings of one outward shell; whether there were any."""
    import manifold3d
    import pymeshlab

    body = to_manifold(vertices, faces)
    good = body.status() == manifold3d.Error.NoError
    tangled = False
    if good:
        if body.num_tri() > MAX_TRIANGLES:
            body = decimated(body, MAX_TRIANGLES)
            vertices, faces = to_mesh(body)
        # Where bodies share an edge, Manifold pairs its faces blindly: resolve these exactly.
        tangled = bool(Edges.of(faces).count.max() > 2)
        crossing = _crossing(vertices, faces)
        if not tangled and not crossing:
            return body, False
        if crossing > max(TANGLE_LIMIT, len(faces) // 2):
            return to_manifold(*wrap(vertices, faces)), True
        if body.num_tri() > CROSSING_LIMIT:
            vertices, faces = to_mesh(decimated(body, CROSSING_LIMIT))
    try:
        clear = to_manifold(*_union_with_itself(vertices, faces))
    except pymeshlab.PyMeshLabException:
        clear = to_manifold(*wrap(vertices, faces))
    if clear.status() != manifold3d.Error.NoError or clear.is_empty():
        clear = to_manifold(*wrap(vertices, faces))
    if good and abs(clear.volume() - body.volume()) < SAME_VOLUME * body.volume():
        return (clear if tangled else body), False
    return clear, True


def _crossing(vertices: Points, faces: Faces) -> int:
    """Number of faces that cross a face with which they share no vertex."""
    meshes = to_mesh_set(vertices, faces)
    meshes.compute_selection_by_self_intersections_per_face()
    return int(meshes.current_mesh().selected_face_number())


def _union_with_itself(vertices: Points, faces: Faces) -> tuple[Points, Faces]:
    """The region round which the surface winds at least once, by exact arrangement (CGAL)."""
    meshes = to_mesh_set(vertices, faces)
    meshes.generate_boolean_union(first_mesh=0, second_mesh=0)
    return from_mesh_set(meshes)
