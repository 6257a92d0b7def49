"""The folding path as keyframes with its certificate: ``motion.json``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import KitError
from fabfold.tree.fold_tree import FoldTree

__all__ = ["Motion", "end_pose_error", "motion_of", "quarter_path"]


@dataclass(frozen=True)
class Motion:
    """A path from shape A to shape B, linear in the angles between keyframes.

    Attributes
    ----------
    hinges : tuple of str
        Names of the hinges, in the order of the columns of `angles_deg`.
    angles_deg : (k, h) float64 array
        The keyframes in degrees; the first is all zero (A), the last is B.
    moves : tuple of k tuples of int
        Columns that turn on the way to each keyframe; the first is empty.
    certificate : dict
        Empty until the path is certified on the real bodies; then ``geometry``, ``min_gap_mm``,
        ``moves`` (one ``{"min_gap_mm": ...}`` a move) and ``end_pose_error``.
    """

    hinges: tuple[str, ...]
    angles_deg: NDArray[np.float64]
    moves: tuple[tuple[int, ...], ...]
    certificate: dict[str, Any] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """The content of ``motion.json`` (format ``fabfold-motion``, version 1).

        Returns
        -------
        dict
            Keyframes with the names of the hinges, angles in degrees.
        """
        return {
            "format": "fabfold-motion",
            "version": 1,
            "hinges": list(self.hinges),
            "keyframes": [
                {
                    "angles_deg": [float(a) for a in angles],
                    "moves": [self.hinges[i] for i in moving],
                }
                for angles, moving in zip(self.angles_deg, self.moves, strict=True)
            ],
            "certificate": self.certificate,
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Motion:
        """Inverse of :meth:`to_json`.

        Parameters
        ----------
        data : mapping
            The content of ``motion.json``.

        Returns
        -------
        Motion
            The path and its certificate.

        Raises
        ------
        KitError
            If the data is not a ``fabfold-motion`` of version 1, or a field is missing.
        """
        if data.get("format") != "fabfold-motion" or data.get("version") != 1:
            raise KitError(
                f"motion.json: wants format fabfold-motion version 1, "
                f"found {data.get('format')!r} version {data.get('version')!r}"
            )
        try:
            names = tuple(data["hinges"])
            column = {name: i for i, name in enumerate(names)}
            frames = data["keyframes"]
            return cls(
                hinges=names,
                angles_deg=np.array([f["angles_deg"] for f in frames], dtype=float).reshape(
                    len(frames), len(names)
                ),
                moves=tuple(tuple(column[name] for name in f["moves"]) for f in frames),
                certificate=dict(data["certificate"]),
            )
        except (KeyError, TypeError, ValueError) as error:
            raise KitError(f"motion.json: field missing or malformed: {error!r}") from error


def motion_of(tree: FoldTree, path: NDArray[np.integer]) -> Motion:
    """Keyframes of a path: shape A, then one after each move.

    Parameters
    ----------
    tree : FoldTree
        What folds.
    path : (m, 2) integer array
        Hinge and signed quarter turns about the positive axis, as
        :meth:`fabfold.fold.lattice_foldability.LatticeFoldability.path` gives it.

    Returns
    -------
    Motion
        Without a certificate.

    Raises
    ------
    ValueError
        If the path does not end in shape B.
    """
    moves = np.asarray(path, dtype=int).reshape(-1, 2)
    sign = np.array([sum(hinge.direction) for hinge in tree.hinges], dtype=int)
    angles = np.zeros((len(moves) + 1, len(tree.hinges)))
    for row, (hinge, quarter) in enumerate(moves.tolist(), start=1):
        angles[row] = angles[row - 1]
        angles[row, hinge] += 90.0 * quarter * sign[hinge]
    short = np.flatnonzero(np.abs(angles[-1] - tree.fold_angles) > 1e-9)
    if len(short):
        hinge = int(short[0])
        raise ValueError(
            f"the path leaves {tree.hinges[hinge].name} at {angles[-1, hinge]:g}°, "
            f"shape B wants {tree.fold_angles[hinge]:g}°"
        )
    return Motion(
        hinges=tuple(hinge.name for hinge in tree.hinges),
        angles_deg=angles,
        moves=((), *((int(hinge),) for hinge in moves[:, 0])),
    )


def quarter_path(tree: FoldTree, motion: Motion) -> NDArray[np.int32] | None:
    """The path as quarter turns.

    Parameters
    ----------
    tree : FoldTree
        What folds.
    motion : Motion
        Its path.

    Returns
    -------
    (m, 2) int32 array or None
        Hinge, and signed quarter turns about its positive axis, one row a move; None for a path
        that stops between two states of the lattice.
    """
    rows = []
    for k in range(1, len(motion.angles_deg)):
        for hinge in motion.moves[k]:
            sign = sum(tree.hinges[hinge].direction)
            turn = (motion.angles_deg[k, hinge] - motion.angles_deg[k - 1, hinge]) / 90.0 * sign
            if abs(turn - round(turn)) > 1e-6:
                return None
            rows.append((hinge, round(turn)))
    return np.array(rows, dtype=np.int32).reshape(-1, 2)


def end_pose_error(tree: FoldTree, angles_deg: NDArray[np.float64]) -> float:
    """Greatest distance of a voxel's corner from its place in the template, in voxel sides.

    Parameters
    ----------
    tree : FoldTree
        What folds.
    angles_deg : (h,) float64 array
        Angles of the hinges at the end of the path, degrees.

    Returns
    -------
    float
        0.0 where every voxel is in its cell, the right way round.
    """
    whole = np.eye(4)
    whole[:3, :3] = tree.root_rotation
    whole[:3, 3] = tree.root_translation
    pose = (whole @ tree.body_poses(angles_deg))[tree.voxel_body]
    worst = 0.0
    for corner in np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, -1).T:
        here = np.einsum("nij,nj->ni", pose[:, :3, :3], tree.source + corner) + pose[:, :3, 3]
        there = tree.target + np.einsum("nij,j->ni", tree.orientation, corner)
        worst = max(worst, float(np.linalg.norm(here - there, axis=1).max(initial=0.0)))
    return worst
