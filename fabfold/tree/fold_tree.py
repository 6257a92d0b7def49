"""The finished joint tree, and its file ``tree.json``.

A :class:`FoldTree` has the voxels in A and B, the spanning tree of joints between them, and the
rigid bodies and hinges that follow. All later stages start from it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import KitError
from fabfold.lattice.rotations import rotation_about
from fabfold.lattice.template import Template

__all__ = ["Body", "Edge", "FoldTree", "Hinge"]


@dataclass(frozen=True)
class Edge:
    """One edge of the spanning tree of voxels.

    Attributes
    ----------
    parent, child : int
        The two voxels; they share a face in A.
    kind : str
        ``"R"`` rigid, ``"S"`` single hinge or ``"D"`` double hinge.
    hinges : tuple of int
        Indices into ``FoldTree.hinges``: none, one or two.
    """

    parent: int
    child: int
    kind: str
    hinges: tuple[int, ...] = ()


@dataclass(frozen=True)
class Body:
    """One rigid body: voxels joined by R edges, or the link plate of a D edge.

    Attributes
    ----------
    name : str
        Such as ``"body-00"`` or ``"link-00"``.
    voxels : tuple of int
        Numbers of its voxels; none for a link plate.
    edge : int or None
        For a link plate, the index of its D edge in ``FoldTree.edges``.
    """

    name: str
    voxels: tuple[int, ...]
    edge: int | None = None


@dataclass(frozen=True)
class Hinge:
    """One axis between two bodies, in lattice coordinates of shape A.

    Attributes
    ----------
    name : str
        Such as ``"hinge-00"``.
    parent, child : int
        Indices into ``FoldTree.bodies``.
    point : (3,) tuple of float
        Middle of the lattice edge that carries the hinge.
    direction : (3,) tuple of int
        Axis-aligned unit vector.
    angle_deg : float
        Right-handed fold angle from shape A to shape B, degrees.
    """

    name: str
    parent: int
    child: int
    point: tuple[float, float, float]
    direction: tuple[int, int, int]
    angle_deg: float


@dataclass(frozen=True)
class FoldTree:
    """Voxels joined by rigid joints and hinges so that A folds into B (``tree.json``).

    Attributes
    ----------
    template : Template
        The target shape.
    source, target : (n, 3) int32 arrays
        Cell of each voxel in A and in B.
    orientation : (n, 3, 3) int32 array
        Rotation of each voxel from A to B.
    fill : (n,) float64 array
        Share of each cell that is material.
    edges : tuple of Edge
        The n - 1 edges of the spanning tree; parent and child share a face in `source`.
    bodies : tuple of Body
        ``bodies[0]`` is the root; a body's parent comes before it.
    hinges : tuple of Hinge
        One a moving axis. Hinge ``i`` carries body ``i + 1``, and its parent comes before it. The
        direction is +x, +y or +z; the sign of the turn is in the angle.
    root_rotation : (3, 3) int32 array
        Rotation of the whole that carries the folded root body into the template.
    root_translation : (3,) int32 array
        Translation after that rotation, lattice units.
    energy : dict of str to float
        ``surface`` (Eq. 8), ``count`` (Eq. 9), ``total`` (weighted), and ``wishes`` where any
        were made.
    octants : (n,) uint8 array or None
        Where two voxels share a cell of B: the octants of its cell in A that each of them keeps to
        (bit ``4 x + 2 y + z``, see :mod:`fabfold.tree.sharing`), 255 for a voxel with a cell of
        its own. None where no voxel shares.
    """

    template: Template
    source: NDArray[np.int32]
    target: NDArray[np.int32]
    orientation: NDArray[np.int32]
    fill: NDArray[np.float64]
    edges: tuple[Edge, ...]
    bodies: tuple[Body, ...]
    hinges: tuple[Hinge, ...]
    root_rotation: NDArray[np.int32]
    root_translation: NDArray[np.int32]
    energy: dict[str, float]
    octants: NDArray[np.uint8] | None = None

    @property
    def joints(self) -> dict[str, int]:
        """Number of S and D joints."""
        return {kind: sum(edge.kind == kind for edge in self.edges) for kind in ("S", "D")}

    @property
    def fold_angles(self) -> NDArray[np.float64]:
        """Angle of every hinge in shape B, degrees, shape (h,)."""
        return np.array([hinge.angle_deg for hinge in self.hinges], dtype=float)

    @property
    def voxel_body(self) -> NDArray[np.int32]:
        """Index of the body of each voxel, shape (n,)."""
        owner = np.full(len(self.source), -1, dtype=np.int32)
        for index, body in enumerate(self.bodies):
            owner[list(body.voxels)] = index
        return owner

    def body_poses(self, angles_deg: NDArray[np.float64]) -> NDArray[np.float64]:
        """Forward kinematics, the root body held still.

        Parameters
        ----------
        angles_deg : (h,) float array
            Angle of every hinge in degrees; zeros are shape A.

        Returns
        -------
        (b, 4, 4) float64 array
            Rigid transform of each body from its place in A, lattice units.
        """
        poses = np.tile(np.eye(4), (len(self.bodies), 1, 1))
        for hinge, angle in zip(self.hinges, np.asarray(angles_deg, dtype=float), strict=True):
            turn = rotation_about(np.array(hinge.point), np.array(hinge.direction), float(angle))
            poses[hinge.child] = poses[hinge.parent] @ turn
        return poses

    def to_json(self, voxel_mm: float, origin_mm: tuple[float, float, float]) -> dict[str, Any]:
        """The content of ``tree.json`` (format ``fabfold-tree``, version 1).

        Parameters
        ----------
        voxel_mm : float
            Side of a voxel, mm.
        origin_mm : tuple of 3 float
            Centre of the cell (0, 0, 0) of shape A, mm.

        Returns
        -------
        dict
            JSON-ready.
        """
        names = [body.name for body in self.bodies]
        edges: list[dict[str, Any]] = []
        for edge in self.edges:
            entry: dict[str, Any] = {"parent": edge.parent, "child": edge.child, "type": edge.kind}
            if edge.hinges:
                entry["hinges"] = list(edge.hinges)
            edges.append(entry)
        bodies: list[dict[str, Any]] = []
        for body in self.bodies:
            entry = {"name": body.name, "voxels": list(body.voxels)}
            if body.edge is not None:
                entry["edge"] = body.edge
            bodies.append(entry)
        return {
            "format": "fabfold-tree",
            "version": 1,
            "voxel_mm": float(voxel_mm),
            "origin_mm": [float(value) for value in origin_mm],
            "template": {"name": self.template.name, "cells": self.template.cells.tolist()},
            "source": self.source.tolist(),
            "target": self.target.tolist(),
            "orientation": self.orientation.reshape(-1, 9).tolist(),
            "fill": [round(float(value), 6) for value in self.fill],
            "edges": edges,
            "bodies": bodies,
            "hinges": [
                {
                    "name": hinge.name,
                    "parent": names[hinge.parent],
                    "child": names[hinge.child],
                    "point": [float(value) for value in hinge.point],
                    "dir": list(hinge.direction),
                    "angle_deg": float(hinge.angle_deg),
                }
                for hinge in self.hinges
            ],
            "energy": {key: round(float(value), 6) for key, value in self.energy.items()},
            "joints": self.joints,
            "root_pose": {
                "rotation": self.root_rotation.reshape(9).tolist(),
                "translation": self.root_translation.tolist(),
            },
            **({} if self.octants is None else {"octants": self.octants.tolist()}),
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> FoldTree:
        """Inverse of :meth:`to_json`.

        Parameters
        ----------
        data : mapping
            The parsed content of a ``tree.json``.

        Returns
        -------
        FoldTree
            As it was written, but for the sizes in mm.

        Raises
        ------
        KitError
            If the data is not a ``fabfold-tree`` of version 1, or a field is missing.
        """
        if data.get("format") != "fabfold-tree" or data.get("version") != 1:
            raise KitError(
                f"tree.json: wants format fabfold-tree version 1, "
                f"found {data.get('format')!r} version {data.get('version')!r}"
            )
        try:
            index = {body["name"]: i for i, body in enumerate(data["bodies"])}
            return cls(
                template=Template(data["template"]["name"], np.array(data["template"]["cells"])),
                source=np.array(data["source"], dtype=np.int32).reshape(-1, 3),
                target=np.array(data["target"], dtype=np.int32).reshape(-1, 3),
                orientation=np.array(data["orientation"], dtype=np.int32).reshape(-1, 3, 3),
                fill=np.array(data["fill"], dtype=float),
                edges=tuple(
                    Edge(e["parent"], e["child"], e["type"], tuple(e.get("hinges", ())))
                    for e in data["edges"]
                ),
                bodies=tuple(
                    Body(b["name"], tuple(b["voxels"]), b.get("edge")) for b in data["bodies"]
                ),
                hinges=tuple(
                    Hinge(
                        h["name"],
                        index[h["parent"]],
                        index[h["child"]],
                        tuple(h["point"]),
                        tuple(h["dir"]),
                        float(h["angle_deg"]),
                    )
                    for h in data["hinges"]
                ),
                root_rotation=np.array(data["root_pose"]["rotation"], dtype=np.int32).reshape(3, 3),
                root_translation=np.array(data["root_pose"]["translation"], dtype=np.int32),
                energy=dict(data["energy"]),
                octants=(
                    np.array(data["octants"], dtype=np.uint8) if data.get("octants") else None
                ),
            )
        except (KeyError, TypeError, ValueError) as error:
            raise KitError(f"tree.json: field missing or malformed: {error!r}") from error
