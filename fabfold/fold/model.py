"""The folding path and its certificate: ``motion.json``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import KitError

__all__ = ["Motion"]


@dataclass(frozen=True)
class Motion:
    """A path from shape A to shape B, linear in the angles between keyframes.

    Attributes
    ----------
    hinges : tuple of str
        Names of the hinges, in the order of the columns of `angles_deg`.
    angles_deg : (k, h) float64 array
        The keyframes; the first is all zero (A), the last is B.
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
        """The content of ``motion.json`` (format ``fabfold-motion``, version 1)."""
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
