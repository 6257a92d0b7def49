"""The pose in which a kit is printed in place: the model, the box, or one of the path between.

In any pose between two moves the kit is whole and every gap is proven, so all of them can be
printed. They differ in how many faces lie against each other with nothing but the gap between,
where powder packs and filament fuses, and in the room that they take in the printer.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fabfold.errors import RecipeError
from fabfold.fold.motion import Motion
from fabfold.joinery.bodies import Joinery
from fabfold.joinery.body_poses import poses_in_mm
from fabfold.joinery.booleans import evaluated
from fabfold.joinery.cells import solids_of
from fabfold.lattice.rotations import ROTATIONS
from fabfold.printing.profiles import Profile
from fabfold.printing.thickness import surface_area, surface_samples
from fabfold.tree.fold_tree import FoldTree

if TYPE_CHECKING:
    pass

__all__ = ["PrintPose", "posed_kit", "print_pose"]

Floats = NDArray[np.float64]

#: Surfaces nearer to each other than so many clearances have nothing but the gap between them.
_NARROW = 2.0
#: Points at which gaps are looked for, over all bodies.
_POINTS = 2_000
#: Two poses whose cost differs by less are alike: the earlier one is taken.
_ALIKE = 0.02


@dataclass(frozen=True)
class PrintPose:
    """A pose of the certified path, laid on the plate.

    Attributes
    ----------
    move : int
        After which move of the path; 0 is the model, the last one the box.
    name : str
        What to call it.
    poses_mm : (b, 4, 4) float64 array
        From shape A to the plate, mm.
    narrow_mm2 : float
        Surface of all bodies that has another body so near ahead that only the gap is between.
    under_mm2 : float
        The part of it that hangs over what is below it, hinges left out.
    size_mm : (3,) float64 array
        Extent as it lies, mm.
    """

    move: int
    name: str
    poses_mm: Floats
    narrow_mm2: float
    under_mm2: float
    size_mm: Floats

    @property
    def box_cm3(self) -> float:
        """Volume of the box around it, cm³."""
        return float(self.size_mm.prod()) / 1000.0

    @property
    def stays(self) -> bool:
        """Whether the bodies lie as in shape A."""
        return bool(np.allclose(self.poses_mm, np.eye(4)))

    @property
    def figures(self) -> str:
        """Its figures in a maker's words."""
        size = " × ".join(f"{side:.0f}" for side in self.size_mm)
        return (
            f"printed as {self.name}, {size} mm; {self.narrow_mm2 / 100:.0f} cm² of its surface "
            "have nothing but the gap before them"
        )


def posed_kit(joinery: Joinery, pose: PrintPose) -> Joinery:
    """The bodies as they are printed; parameters as of :func:`print_pose`."""
    bodies = tuple(
        replace(body, vertices=body.vertices @ place[:3, :3].T + place[:3, 3])
        for body, place in zip(joinery.bodies, pose.poses_mm, strict=True)
    )
    return joinery if pose.stays else replace(joinery, bodies=bodies)


def print_pose(
    tree: FoldTree, motion: Motion, joinery: Joinery, profile: Profile, asked: str
) -> PrintPose:
    """The pose that a recipe asks for.

    Parameters
    ----------
    tree : FoldTree
        The bodies and their hinges.
    motion : Motion
        The certified path.
    joinery : Joinery
        The printed bodies.
    profile : Profile
        Printer and material.
    asked : str
        "a" for the model as it came, "b" for the box, the number of a move, or "auto": the pose
        that fits the printer and has the least product of narrow surface and box volume; of a
        process that fuses gaps under faces, the one with the fewest of these first.

    Returns
    -------
    PrintPose
        With its figures; all but "a" lie on the side that is lowest, then best to print.

    Raises
    ------
    RecipeError
        If the path has no move of this number.
    """
    last = len(motion.angles_deg) - 1
    samples = _Samples(tree, joinery)

    def laid(move: int) -> PrintPose:
        return _laid(tree, motion, joinery, profile, samples, move)

    if asked == "auto":
        poses = [laid(move) for move in range(last + 1)]
        bed = np.sort(profile.bed_mm) if profile.bed_mm is not None else np.full(3, np.inf)
        able = [pose for pose in poses if (np.sort(pose.size_mm) <= bed).all()] or poses
        return min(able, key=lambda pose: _cost(pose, poses[0], profile))
    move = {"a": 0, "b": last}.get(asked, -1)
    if move < 0:
        move = int(asked)
    if move > last:
        raise RecipeError(f"--pose {move}: the path of this kit has {last} moves; give 0 to {last}")
    return laid(move)


def _cost(pose: PrintPose, first: PrintPose, profile: Profile) -> tuple[float, float, int]:
    narrow = (pose.narrow_mm2 + 1.0) / (first.narrow_mm2 + 1.0)
    product = narrow * pose.box_cm3 / first.box_cm3
    fused = 0.0 if profile.in_place else round(pose.under_mm2)
    return fused, round(product / _ALIKE), pose.move


class _Samples:
    """Points spread over the surfaces of all bodies, and what is near them in a pose."""

    def __init__(self, tree: FoldTree, joinery: Joinery) -> None:
        self._tree, self._joinery = tree, joinery
        self._solids = solids_of(joinery.bodies)
        areas = np.array([surface_area(body) for body in joinery.bodies])
        counts = np.maximum(30, np.rint(_POINTS * areas / areas.sum())).astype(int)
        self._points, self._normals, self._weights = [], [], []
        for body, area, count in zip(joinery.bodies, areas, counts, strict=True):
            points, normals = surface_samples(body.vertices, body.faces, int(count))
            self._points.append(points)
            self._normals.append(normals)
            self._weights.append(float(area / count))

    def narrow(self, poses: Floats, profile: Profile) -> tuple[float, Floats]:
        """Narrow surface in mm², and that of it that faces along each lattice direction, (6,).

        Directions are +x, -x, +y, -y, +z, -z of the pose's own frame; hinges are left out of these.
        """
        reach = _NARROW * self._joinery.gap_mm
        steep = np.sin(np.radians(profile.max_overhang_deg or 45.0))
        # Computed now: a ray that meets what is not computed yet computes it for itself.
        placed = [
            evaluated(solid.transform(pose[:3]))
            for solid, pose in zip(self._solids, poses, strict=True)
        ]
        boxes = np.array([np.reshape(solid.bounding_box(), (2, 3)) for solid in placed])
        whole, sides = 0.0, np.zeros(6)
        for index, pose in enumerate(poses):
            starts = self._points[index] @ pose[:3, :3].T + pose[:3, 3]
            normals = self._normals[index] @ pose[:3, :3].T
            open_to = starts + reach * normals
            low, high = np.minimum(starts, open_to), np.maximum(starts, open_to)
            hit = np.zeros(len(starts), dtype=bool)
            for other, (least, most) in enumerate(boxes):
                if other == index:
                    continue
                near = ~hit & ((low <= most) & (high >= least)).all(axis=1)
                for point in np.flatnonzero(near).tolist():
                    ray = tuple(starts[point]), tuple(open_to[point])
                    hit[point] = bool(placed[other].ray_cast(*ray))
            whole += self._weights[index] * float(hit.sum())
            plain = hit & ~self._at_hinge(index)
            along = np.concatenate([normals > steep, normals < -steep], axis=1)[
                :, [0, 3, 1, 4, 2, 5]
            ]
            sides += self._weights[index] * (plain[:, None] & along).sum(axis=0)
        return whole, sides

    def _at_hinge(self, body: int) -> NDArray[np.bool_]:
        """Points of a body that lie in one of its hinges: barrels and their grooves print."""
        joinery, points = self._joinery, self._points[body]
        reach = joinery.barrel_radius_mm + joinery.clearance_mm + 0.1
        found = np.zeros(len(points), dtype=bool)
        for hinge in self._tree.hinges:
            if body in (hinge.parent, hinge.child):
                axis = np.asarray(hinge.direction, dtype=float)
                at = np.asarray(joinery.origin_mm) + joinery.voxel_mm * np.asarray(hinge.point)
                away = points - at
                along = away @ axis
                across = np.linalg.norm(away - along[:, None] * axis, axis=1)
                found |= (across < reach) & (np.abs(along) < joinery.voxel_mm / 2)
        return found


def _laid(
    tree: FoldTree,
    motion: Motion,
    joinery: Joinery,
    profile: Profile,
    samples: _Samples,
    move: int,
) -> PrintPose:
    """A pose on the side that prints best; the model as it came."""
    last = len(motion.angles_deg) - 1
    poses = poses_in_mm(tree, joinery, motion.angles_deg[move])
    narrow, sides = samples.narrow(poses, profile)
    points = np.concatenate(
        [
            body.vertices @ pose[:3, :3].T + pose[:3, 3]
            for body, pose in zip(joinery.bodies, poses, strict=True)
        ]
    )
    extent = np.ptp(points, axis=0)
    turn, down = np.eye(3), 5
    if move:
        # Side of the pose that points down, in the order of :meth:`_Samples.narrow`.
        down = min(
            range(6), key=lambda side: (round(float(extent[side // 2]), 2), sides[side], side)
        )
        wanted = np.eye(3)[down // 2] * (1.0 if down % 2 == 0 else -1.0)
        turn = next(r.astype(float) for r in ROTATIONS if (r @ wanted == [0, 0, -1]).all())
    laid = np.tile(np.eye(4), (len(poses), 1, 1))
    laid[:, :3, :3] = turn @ poses[:, :3, :3]
    laid[:, :3, 3] = poses[:, :3, 3] @ turn.T
    name = {0: "the model", last: "the box"}.get(move, f"it is after move {move} of {last}")
    size = np.ptp(points @ turn.T, axis=0)
    return PrintPose(move, name, laid, round(narrow, 1), round(float(sides[down]), 1), size)
