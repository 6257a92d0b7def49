"""How near the two bodies of a hinge come to one another as they turn, measured on their meshes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .exceptions import HingeError

if TYPE_CHECKING:
    import manifold3d as m3
    from build123d import Location

__all__ = ["TurnPose", "TurnSweep", "mesh_of_part", "single_sweep", "spread"]

#: How far a mesh may lie off its surface, in mm.
_TOLERANCE = 0.01
#: Gaps are looked for up to this where nothing else is said, in mm.
_FAR = 3.0
#: What two meshes may share without a collision, in mm³: they stand off their surfaces.
_NOTHING = 1e-3


@dataclass(frozen=True)
class TurnPose:
    """Two bodies at one angle.

    Attributes
    ----------
    angle : float
        In degrees.
    gap : float
        Smallest distance between them in mm, no further than was looked for; 0 where they touch
        or overlap.
    overlap : float
        Volume that they share, in mm³.
    """

    angle: float
    gap: float
    overlap: float


@dataclass(frozen=True)
class TurnSweep:
    """Two bodies at a row of angles.

    Attributes
    ----------
    poses : tuple of TurnPose
        In the order of the angles.
    """

    poses: tuple[TurnPose, ...]

    @property
    def gap(self) -> float:
        """The smallest gap of all poses, in mm."""
        return min(pose.gap for pose in self.poses)

    @property
    def worst(self) -> TurnPose:
        """The pose that overlaps most, or else has the smallest gap."""
        return max(self.poses, key=lambda pose: (pose.overlap, -pose.gap))


def mesh_of_part(part: Any) -> m3.Manifold:
    """Mesh of a part, each of its solids for itself.

    Parameters
    ----------
    part : Part or Solid
        The part.

    Returns
    -------
    manifold3d.Manifold
        Within a hundredth of a mm of its surfaces.

    Raises
    ------
    HingeError
        If its surface does not close.
    """
    import manifold3d as m3

    pieces = []
    for solid in part.solids():
        corners, triangles = solid.tessellate(_TOLERANCE, 0.2)
        points = np.array([tuple(corner) for corner in corners])
        # Faces are cut into triangles one by one: their common corners are the same point.
        _, first, back = np.unique(
            np.round(points, 6), axis=0, return_index=True, return_inverse=True
        )
        faces = back.reshape(-1)[np.array(triangles)]
        sound = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
        mesh = m3.Mesh(
            points[first].astype(np.float32), np.ascontiguousarray(faces[sound], dtype=np.uint32)
        )
        piece = m3.Manifold(mesh)
        if piece.status() != m3.Error.NoError or piece.is_empty():
            raise HingeError(
                "a body's surface does not close where it is cut into triangles: check it with "
                "is_valid, and move a size by a hundredth of a mm"
            )
        pieces.append(piece)
    return m3.Manifold.batch_boolean(pieces, m3.OpType.Add) if len(pieces) > 1 else pieces[0]


def _matrix(location: Location) -> NDArray[np.float64]:
    """The first three rows of a location."""
    transform = location.wrapped.Transformation()
    return np.array([[transform.Value(row, column) for column in range(1, 5)] for row in (1, 2, 3)])


def single_sweep(
    parent: Any,
    child: Any,
    frames: tuple[Location, Location],
    angles: Iterable[float],
    far: float = _FAR,
) -> TurnSweep:
    """Turn a child about a hinge's axis and measure its gap to the parent.

    Parameters
    ----------
    parent, child : Part or Solid
        The bodies, in any pose.
    frames : (Location, Location)
        The hinge's frame on the parent, and on the child, with which it turns.
    angles : iterable of float
        Angles to look at, in degrees.
    far : float
        Gaps are looked for up to this, in mm; the nearer, the quicker.

    Returns
    -------
    TurnSweep
        A pose for each angle.

    Raises
    ------
    HingeError
        If a body's surface does not close.
    """
    still, moving = (
        mesh_of_part(body).transform(_matrix(frame.inverse()))
        for body, frame in zip((parent, child), frames, strict=True)
    )
    return TurnSweep(
        tuple(_measured(still, moving.rotate((0.0, 0.0, angle)), angle, far) for angle in angles)
    )


def _measured(still: m3.Manifold, moved: m3.Manifold, angle: float, far: float) -> TurnPose:
    shared = float((still ^ moved).volume())
    if shared > _NOTHING:
        return TurnPose(float(angle), 0.0, shared)
    return TurnPose(float(angle), float(still.min_gap(moved, far)), 0.0)


def spread(low: float, high: float, step: float) -> Sequence[float]:
    """Angles from one to another, both among them.

    Parameters
    ----------
    low, high : float
        The first and the last, in degrees.
    step : float
        Largest distance between two, in degrees.

    Returns
    -------
    sequence of float
        At least two.
    """
    count = max(1, int(np.ceil((high - low) / step - 1e-9)))
    return [low + (high - low) * index / count for index in range(count + 1)]
