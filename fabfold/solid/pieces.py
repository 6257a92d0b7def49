"""What to do with loose pieces: move them to touch the body, drop them, or refuse the model."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import ModelError
from fabfold.solid.convert import to_mesh
from fabfold.solid.words import were

if TYPE_CHECKING:
    import manifold3d

__all__ = ["LOOSE_SHARE", "TOUCH_GAP", "largest_piece"]

#: A loose piece counts as small up to this share of the volume. Small pieces that cannot be
#: joined are dropped if together they have at most this share, too.
LOOSE_SHARE = 0.05
#: Small pieces nearer than this (longest side about 1) are moved to touch the body.
TOUCH_GAP = 0.005
#: Pieces nearer than this touch, in a point or along an edge.
TOUCHING = 1e-9


def largest_piece(
    name: str, united: manifold3d.Manifold, notes: list[str], scale: float = 1.0
) -> manifold3d.Manifold:
    """The largest piece of a solid, with small pieces joined to it or dropped.

    Parameters
    ----------
    name : str
        Name of the file, for messages.
    united : manifold3d.Manifold
        Longest side about 1, without cavities.
    notes : list of str
        Sentences for the maker; what was done is appended.
    scale : float
        Model units of a length of 1, for messages.

    Returns
    -------
    manifold3d.Manifold
        One piece, in the same place.

    Raises
    ------
    ModelError
        If there is a second piece of more than 5 % of the volume, or if the small pieces that
        hang free have more than 5 % together.
    """
    parts = sorted(united.decompose(), key=lambda part: -part.volume())
    if len(parts) == 1:
        return united
    volumes = np.array([part.volume() for part in parts])
    shares = volumes / volumes.sum()
    if shares[1] > LOOSE_SHARE:
        raise _too_many(name, parts, shares, scale)
    body, loose = _join(parts)
    if joined := len(parts) - 1 - len(loose):
        notes.append(
            f"{were(joined, 'piece')} free of the body by a hair (less than {TOUCH_GAP:.1%} of the "
            "model's length) and moved to touch it"
        )
    if loose:
        share = float(shares[loose].sum())
        if share > LOOSE_SHARE:
            raise _too_many(name, parts, shares, scale)
        notes.append(f"{were(len(loose), 'loose piece')} dropped ({share:.2%} of the volume)")
    return body


def _join(parts: list[manifold3d.Manifold]) -> tuple[manifold3d.Manifold, list[int]]:
    """The first part with all that come as near to it as TOUCH_GAP; the indices of the others.

    A part is moved to the one through which it is reached, and all are united at the end: each pair
    of neighbours is looked at once.
    """
    import manifold3d

    boxes = np.array([part.bounding_box() for part in parts]).reshape(-1, 2, 3)
    free = np.ones(len(parts), dtype=bool)
    free[0] = False
    moved = {0: parts[0]}
    reached = [0]
    for index in reached:  # grows while it is walked through
        low, high = boxes[index, 0] - TOUCH_GAP, boxes[index, 1] + TOUCH_GAP
        near = free & (boxes[:, 0] <= high).all(axis=1) & (boxes[:, 1] >= low).all(axis=1)
        for other in np.flatnonzero(near).tolist():
            if parts[index].min_gap(parts[other], TOUCH_GAP) >= TOUCH_GAP:
                continue
            part = _moved(parts[other], moved[index])
            if len((moved[index] + part).decompose()) == 1:
                moved[other] = part
                free[other] = False
                reached.append(other)
    if len(reached) == 1:
        return parts[0], np.flatnonzero(free).tolist()
    body = manifold3d.Manifold.batch_boolean(
        [moved[index] for index in reached], manifold3d.OpType.Add
    )
    return body, np.flatnonzero(free).tolist()


def _moved(part: manifold3d.Manifold, body: manifold3d.Manifold) -> manifold3d.Manifold:
    """A small part moved towards the body until it reaches half of TOUCH_GAP into it."""
    gap = _nearest(part, body)
    length = float(np.linalg.norm(gap))
    if length < TOUCHING:
        low, high = np.array(body.bounding_box()).reshape(2, 3)
        own_low, own_high = np.array(part.bounding_box()).reshape(2, 3)
        gap = (low + high) - (own_low + own_high)
        return part.translate((gap * (TOUCH_GAP / np.linalg.norm(gap))).tolist())
    return part.translate((gap * (1 + TOUCH_GAP / 2 / length)).tolist())


def _nearest(part: manifold3d.Manifold, body: manifold3d.Manifold) -> NDArray[np.float64]:
    """The shortest step from a corner of one to the surface of the other, pointing to the body."""
    import trimesh

    one, other = (trimesh.Trimesh(*to_mesh(shape), process=False) for shape in (part, body))
    there, _, _ = trimesh.proximity.closest_point(other, one.vertices)
    back, _, _ = trimesh.proximity.closest_point(one, other.vertices)
    steps = np.concatenate([there - one.vertices, other.vertices - back])
    nearest: NDArray[np.float64] = steps[int(np.linalg.norm(steps, axis=1).argmin())]
    return nearest


def _too_many(
    name: str, parts: list[manifold3d.Manifold], shares: NDArray[np.float64], scale: float
) -> ModelError:
    told = [f"{share:.0%}" for share in shares if share >= 0.005][:6]
    if len(parts) > len(told):
        told.append(f"{len(parts) - len(told)} smaller")
    gap = parts[0].min_gap(parts[1], 2.0)
    how = "touch in an edge or a corner only, which has no strength"
    if gap >= TOUCHING:
        how = f"stand apart, the two largest by {gap * scale:.3g} in the model's units"
    return ModelError(
        f"{name} is not one piece: it falls into {len(parts)} pieces that {how} "
        f"({', '.join(told)}; up to {LOOSE_SHARE:.0%} of the volume would be dropped); join them "
        "with struts in your modelling program, or export one of them"
    )
