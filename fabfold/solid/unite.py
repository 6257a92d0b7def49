"""Make one body of closed shells: union, self-crossings, cavities, loose pieces."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from fabfold.errors import ModelError
from fabfold.meshes import mesh_volume
from fabfold.solid.surface import Shell
from fabfold.solid.topology import Faces, Points

if TYPE_CHECKING:
    import manifold3d

__all__ = ["one_piece", "simplify", "to_manifold", "to_mesh", "unite"]

#: Pieces that hang free are dropped if together they have at most this share of the volume.
LOOSE_SHARE = 0.05
#: A shell with less volume than this (longest side 1) is flat.
NO_VOLUME = 1e-12
#: Self-crossings are resolved exactly up to this many triangles; denser meshes are thinned first.
CROSSING_LIMIT = 50_000


def to_manifold(vertices: Points, faces: Faces) -> manifold3d.Manifold:
    """A manifold3d object in double precision; its `status` tells whether it is one."""
    import manifold3d

    return manifold3d.Manifold(
        manifold3d.Mesh64(
            np.ascontiguousarray(vertices, dtype=np.float64),
            np.ascontiguousarray(faces, dtype=np.uint64),
        )
    )


def to_mesh(manifold: manifold3d.Manifold) -> tuple[Points, Faces]:
    """Vertices (v, 3) float64 and faces (f, 3) int64 of a manifold3d object."""
    mesh = manifold.to_mesh64()
    return (
        np.asarray(mesh.vert_properties, dtype=np.float64)[:, :3].copy(),
        np.asarray(mesh.tri_verts, dtype=np.int64),
    )


def simplify(manifold: manifold3d.Manifold, limit: int) -> manifold3d.Manifold:
    """Thin a mesh (longest side about 1) to at most `limit` triangles, tolerance by tolerance."""
    tolerance = 2e-5
    while manifold.num_tri() > limit and tolerance < 0.01:
        manifold = manifold.simplify(tolerance)
        tolerance *= 2
    return manifold


def unite(name: str, shells: Sequence[Shell], notes: list[str]) -> manifold3d.Manifold:
    """Union of closed shells: inside is where at least one shell, turned outwards, winds round.

    A shell that faces inwards inside another one bounds a cavity; closed cavities are filled.

    Parameters
    ----------
    name : str
        Name of the file, for messages.
    shells : sequence of Shell
    notes : list of str
        What was done is appended.

    Returns
    -------
    manifold3d.Manifold
        Perhaps of several pieces.

    Raises
    ------
    ModelError
        If nothing with a volume is left.
    """
    import manifold3d

    volumes = [mesh_volume(shell.vertices, shell.faces.astype(np.int32)) for shell in shells]
    solid = [k for k in range(len(shells)) if abs(volumes[k]) > NO_VOLUME]
    if not solid:
        raise ModelError(f"{name} is not a solid: its volume is zero; give its walls a thickness")
    if len(solid) < len(shells):
        notes.append(f"{len(shells) - len(solid)} surfaces without volume were dropped")
    bodies: dict[int, manifold3d.Manifold] = {}
    crossing = 0
    for k in solid:
        faces = shells[k].faces if volumes[k] > 0 else shells[k].faces[:, ::-1]
        bodies[k], crossed = _sound(shells[k].vertices, faces)
        crossing += crossed
    if crossing:
        notes.append("the surface passes through itself; the overlap counts as solid")
    inward = [k for k in solid if volumes[k] < 0]
    cavities = [
        k
        for k in inward
        if any(_contains(bodies[j], bodies[k]) for j in solid if volumes[j] > abs(volumes[k]))
    ]
    if len(inward) > len(cavities):
        notes.append(
            "the model was inside out and was turned"
            if len(solid) == 1
            else f"{len(inward) - len(cavities)} of {len(solid)} shells were inside out and were turned"
        )
    rest = [k for k in solid if k not in cavities]
    if len(rest) == 1:
        united = bodies[rest[0]]
    else:
        united = manifold3d.Manifold.batch_boolean(
            [bodies[k] for k in rest], manifold3d.OpType.Add
        )
        notes.append(
            f"{len(rest)} closed shells were united (inside is where at least one of them is)"
        )
    united, hidden = _fill(united)
    if cavities or hidden:
        count = len(cavities) + hidden
        notes.append(
            f"{count} closed {'cavity was' if count == 1 else 'cavities were'} filled: "
            "nobody sees inside, and hinges need the material"
        )
    if united.num_tri() == 0:
        raise ModelError(f"{name} is not a solid: its volume is zero; give its walls a thickness")
    return united


def _contains(outer: manifold3d.Manifold, inner: manifold3d.Manifold) -> bool:
    low, high = np.array(outer.bounding_box()).reshape(2, 3)
    own_low, own_high = np.array(inner.bounding_box()).reshape(2, 3)
    if (own_low < low).any() or (own_high > high).any():
        return False
    return bool((inner - outer).volume() < 1e-6 * inner.volume())


def _fill(united: manifold3d.Manifold) -> tuple[manifold3d.Manifold, int]:
    """Fill the closed cavities of a body; how many there were."""
    import manifold3d

    parts = united.decompose()
    solid = [part for part in parts if part.volume() > 0]
    if len(solid) == len(parts):
        return united, 0
    hidden = sum(1 for part in parts if part.volume() < -NO_VOLUME)
    return manifold3d.Manifold.batch_boolean(solid, manifold3d.OpType.Add), hidden


def _sound(vertices: Points, faces: Faces) -> tuple[manifold3d.Manifold, bool]:
    """A manifold without self-crossings of one outward shell; whether there were any."""
    import manifold3d

    body = to_manifold(vertices, faces)
    broken = body.status() != manifold3d.Error.NoError
    if not broken and not _crosses(vertices, faces):
        return body, False
    if not broken and body.num_tri() > CROSSING_LIMIT:
        vertices, faces = to_mesh(simplify(body, CROSSING_LIMIT))
    vertices, faces = _union_with_itself(vertices, faces)
    return to_manifold(vertices, faces), True


def _mesh_set(vertices: Points, faces: Faces) -> Any:
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(vertices, faces.astype(np.int32)))
    return meshes


def _crosses(vertices: Points, faces: Faces) -> bool:
    """Whether faces of the mesh that share no vertex cross each other."""
    meshes = _mesh_set(vertices, faces)
    meshes.compute_selection_by_self_intersections_per_face()
    return bool(meshes.current_mesh().selected_face_number() > 0)


def _union_with_itself(vertices: Points, faces: Faces) -> tuple[Points, Faces]:
    """The region round which the surface winds at least once, by exact arrangement (CGAL)."""
    meshes = _mesh_set(vertices, faces)
    meshes.generate_boolean_union(first_mesh=0, second_mesh=0)
    found = meshes.current_mesh()
    return (
        np.asarray(found.vertex_matrix(), dtype=np.float64),
        np.asarray(found.face_matrix(), dtype=np.int64),
    )


def one_piece(
    name: str, united: manifold3d.Manifold, notes: list[str]
) -> manifold3d.Manifold:
    """The largest piece, if the others are next to nothing.

    Raises
    ------
    ModelError
        If the other pieces have more than 5 % of the volume.
    """
    parts = sorted(united.decompose(), key=lambda part: -part.volume())
    if len(parts) == 1:
        return united
    volumes = np.array([part.volume() for part in parts])
    share = float(volumes[1:].sum() / volumes.sum())
    if share > LOOSE_SHARE:
        shares = ", ".join(f"{100 * volume / volumes.sum():.0f} %" for volume in volumes[:6])
        raise ModelError(
            f"{name} is not one piece: it falls into {len(parts)} that do not touch in a face "
            f"({shares}{', …' if len(parts) > 6 else ''} of the volume); join them with struts in "
            "your modelling program, or export one of them"
        )
    notes.append(
        f"{len(parts) - 1} loose {'piece' if len(parts) == 2 else 'pieces'} "
        f"({share:.2%} of the volume) {'was' if len(parts) == 2 else 'were'} dropped"
    )
    return parts[0]
