"""Play of the finished box: how far its faces wander and its seams open, every hinge being loose.

A hinge with clearance lets its child shift, tilt and turn a little
(:mod:`hinges.joint_play`); along a chain of hinges this adds up. A worst case of thirty hinges says
little, so the box is drawn at random many times: each hinge anywhere within its play, and then
moved as little as it takes until no two bodies press into each other where their cells meet. Play
is small against a voxel, so all of it is linear in the shifts and turns of the hinges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fabfold.joinery.bodies import Joinery
from fabfold.joinery.body_poses import poses_in_mm
from fabfold.joinery.box_faces import FaceMeeting, across, face_meetings
from fabfold.joinery.linkage import NUMBERS, Linkage
from fabfold.joinery.sizes import MIN_WALL_MM
from fabfold.lattice.rotations import FACES
from fabfold.tree.fold_tree import FoldTree
from hinges.hardware import LoosePin
from hinges.joint_play import Play
from hinges.mesh import single_hinge_play

__all__ = ["BoxPlay", "box_play"]

F64 = NDArray[np.float64]

#: Boxes that are drawn, and rounds of corrections until no faces press into each other.
_DRAWS, _ROUNDS = 120, 60
#: Corrections end where no bodies press into each other by more, mm.
_EXACT_MM = 0.02
#: Places on a meeting of two cells, in voxel sides from its middle, and half the side of the patch
#: that stands for each.
_PLACES, _PATCH = (-0.33, 0.0, 0.33), 0.16
#: Material deeper below a face than this is not reached, in voxel sides.
_DEEP = 0.3
#: Share of the draws within which a figure lies.
_SHARE = 95.0


@dataclass(frozen=True)
class BoxPlay:
    """What the play of all hinges does to the box; 19 of 20 boxes lie within.

    Attributes
    ----------
    wander_mm : float
        Furthest that a corner of an outer face leaves its plane when nothing holds the box, mm; the
        box as a whole is put where it fits best.
    seam_mm : float
        Widest seam between two outer faces side by side then, the gap that is meant included, mm.
    held_wander_mm, held_seam_mm : float
        The same with the box pressed together, so that what meets face to face does not part.
    press_mm : float
        How far two bodies still press into each other, or part, after the corrections, mm: how
        exact the figures are.
    """

    wander_mm: float
    seam_mm: float
    held_wander_mm: float
    held_seam_mm: float
    press_mm: float


def box_play(
    tree: FoldTree,
    joinery: Joinery,
    material: NDArray[np.bool_],
    angles_deg: F64,
    pin: LoosePin | None = None,
    *,
    seed: int = 1,
) -> BoxPlay:
    """Draw the box many times with every hinge within its play.

    A hinge's shift and tilt share its clearance: together they use at most all of it. Its angle
    is held, to within what closes the gap between its two bodies a voxel away.

    Parameters
    ----------
    tree : FoldTree
        Bodies and hinges. An axis of a double hinge counts as a single one.
    joinery : Joinery
        The printed bodies.
    material : (n, s, s, s) bool array
        Material of the voxels' cells in shape A: where bodies meet.
    angles_deg : (h,) float64 array
        Angles of all hinges in the box, degrees.
    pin : LoosePin, optional
        Pin that is pushed in after printing; None where pins are printed.
    seed : int
        Of the draws.

    Returns
    -------
    BoxPlay
        The same for the same arguments.
    """
    if not tree.hinges:
        return BoxPlay(0.0, joinery.gap_mm, 0.0, joinery.gap_mm, 0.0)
    poses = poses_in_mm(tree, joinery, angles_deg)
    linkage = Linkage(tree, joinery, poses)
    meetings = face_meetings(tree, joinery, poses)
    limits = _limits(tree, joinery, angles_deg, pin)
    rng = np.random.default_rng(seed)
    draws = _within(rng.uniform(-1.0, 1.0, (_DRAWS, NUMBERS * linkage.hinges)) * limits, limits)
    parting, gaps = _parting(meetings, material, linkage, joinery, poses)
    outside = _outside(tree, joinery, poses, linkage)
    figures: list[float] = []
    pressed = 0.0
    flush = gaps <= joinery.gap_mm + 1e-9
    for held in (False, True):
        most = np.where(flush & held, 0.0, np.inf)
        drawn = _let_go(draws, parting, -gaps, most, limits)
        open_ = drawn @ parting.T
        off = np.maximum(-gaps - open_, open_ - most).max(axis=1)
        pressed = max(pressed, float(np.percentile(off, _SHARE)))
        figures += _outer_figures(drawn, outside, joinery.gap_mm)
    wander, seam, held_wander, held_seam = figures
    return BoxPlay(wander, seam, held_wander, held_seam, round(max(pressed, 0.0), 3))


def _outer_figures(
    draws: F64, outside: tuple[tuple[F64, F64], F64, list[tuple[int, int, F64]]], gap: float
) -> list[float]:
    """Wander and seam of the outer faces, mm, within which most draws lie."""
    (points, motions), normals, seams = outside
    motion = _best_fit(points, np.einsum("dk,cik->dci", draws, motions))
    wander = np.abs(np.einsum("dci,ci->dc", motion, normals)).max(axis=1)
    opening = np.zeros(len(draws))
    for one, other, direction in seams:
        opening = np.maximum(opening, (motion[:, other] - motion[:, one]) @ direction)
    figures = (wander, opening + gap)
    return [round(float(np.percentile(figure, _SHARE)), 3) for figure in figures]


def _limits(tree: FoldTree, joinery: Joinery, angles_deg: F64, pin: LoosePin | None) -> F64:
    """Largest size of each of the numbers of all hinges, (6 h,): mm and radians."""
    made: dict[float, Play] = {}
    limits = []
    for angle in np.abs(angles_deg).tolist():
        if angle not in made:
            made[angle] = single_hinge_play(
                joinery.voxel_mm,
                joinery.clearance_mm,
                angle,
                knuckles=joinery.knuckles,
                barrel_radius_mm=joinery.barrel_radius_mm,
                pin_radius_mm=joinery.pin_radius_mm,
                gap_mm=joinery.gap_mm,
                wall_mm=MIN_WALL_MM,
                pin=pin,
            )
        one = made[angle]
        tilt = float(np.radians(one.tilt))
        turn = joinery.gap_mm / joinery.voxel_mm
        limits += [one.radial, one.radial, max(one.axial), tilt, tilt, turn]
    return np.array(limits)


def _within(draws: F64, limits: F64) -> F64:
    """Draws (d, 6 h) scaled down so that shift and tilt of a hinge share its clearance."""
    shaped = draws.reshape(len(draws), -1, NUMBERS).copy()
    used = np.abs(shaped / limits.reshape(-1, NUMBERS))
    across_ = np.hypot(used[..., 0], used[..., 1]) + np.hypot(used[..., 3], used[..., 4])
    shrink = np.maximum(across_, 1.0)[..., None]
    shaped[..., :2] /= shrink
    shaped[..., 3:5] /= shrink
    for column in (2, 5):
        most = limits.reshape(-1, NUMBERS)[:, column]
        shaped[..., column] = np.clip(shaped[..., column], -most, most)
    return np.asarray(shaped.reshape(draws.shape))


def _parting(
    meetings: list[FaceMeeting],
    material: NDArray[np.bool_],
    linkage: Linkage,
    joinery: Joinery,
    poses: F64,
) -> tuple[F64, F64]:
    """Rows (m, 6 h): how far bodies part where their cells meet, and the gaps there (m,), mm."""
    side = joinery.voxel_mm
    rows, gaps = [np.zeros(NUMBERS * linkage.hinges)], [0.0]
    for meeting in meetings:
        u, v = across(meeting.normal)
        one, other = meeting.bodies
        for i in _PLACES:
            for j in _PLACES:
                offset = i * u + j * v
                ways = (meeting.normal, -meeting.normal)
                depth = sum(
                    _depth(material[voxel], poses[body][:3, :3], way, offset)
                    for voxel, body, way in zip(meeting.voxels, meeting.bodies, ways, strict=True)
                )
                if depth > _DEEP:
                    continue
                point = meeting.middle + side * offset
                motion = linkage.motion(other, point) - linkage.motion(one, point)
                rows.append(meeting.normal @ motion)
                gaps.append(joinery.gap_mm + side * depth)
    return np.array(rows), np.array(gaps)


def _depth(cell: NDArray[np.bool_], pose: F64, way: F64, offset: F64) -> float:
    """How deep the first material of a patch lies below a face, voxel sides; 1 without any.

    Parameters
    ----------
    cell : (s, s, s) bool array
        Material of the cell in shape A.
    pose : (3, 3) float64 array
        How the cell is turned in the box.
    way, offset : (3,) float64 arrays
        Outward normal of the face, and the patch's place from its middle, in the box.
    """
    size = len(cell)
    outward, place = np.rint(pose.T @ way).astype(int), pose.T @ offset
    axis = int(np.abs(outward).argmax())
    index: list[slice] = []
    for k in range(3):
        low = round((place[k] - _PATCH + 0.5) * size)
        high = round((place[k] + _PATCH + 0.5) * size)
        index.append(slice(None) if k == axis else slice(max(low, 0), max(high, 1)))
    patch = cell[index[0], index[1], index[2]]
    layers = np.asarray(patch.any(axis=tuple(k for k in range(3) if k != axis)))
    filled = np.flatnonzero(layers[::-1] if outward[axis] > 0 else layers)
    return float(filled[0]) / size if len(filled) else 1.0


def _let_go(draws: F64, parting: F64, least: F64, most: F64, limits: F64) -> F64:
    """Move draws as little as it takes until all partings lie within their bounds (m,), mm.

    Projections in turn on every half space and on the play of the hinges; hinges that have much
    play give way more.
    """
    give = parting * limits**2
    size = np.einsum("mk,mk->m", parting, give)
    rows = np.flatnonzero(size > 1e-12)
    for _ in range(_ROUNDS):
        for row in rows.tolist():
            open_ = draws @ parting[row]
            off = np.clip(open_, least[row], most[row]) - open_
            if off.any():
                draws = draws + (off / size[row])[:, None] * give[row]
        draws = _within(draws, limits)
        open_ = draws @ parting.T
        if max((least - open_).max(), (open_ - most).max()) < _EXACT_MM:
            break
    return draws


def _outside(
    tree: FoldTree, joinery: Joinery, poses: F64, linkage: Linkage
) -> tuple[tuple[F64, F64], F64, list[tuple[int, int, F64]]]:
    """Corners of the outer faces of the box, in the frame of the root body.

    Returns ((points (c, 3), motions (c, 3, 6 h)), normals (c, 3), seams): a seam is two corners of
    faces of two bodies side by side, and the direction from the first face to the second.
    """
    origin, side = np.asarray(joinery.origin_mm), joinery.voxel_mm
    turn_back = tree.root_rotation.T.astype(float)
    filled = {tuple(cell): voxel for voxel, cell in enumerate(tree.target.tolist())}
    cells = tree.template.cells.tolist()
    outer = {tuple(cell): at for cell, at in zip(cells, tree.template.outer_faces(), strict=True)}
    points: list[F64] = []
    motions: list[F64] = []
    normals: list[F64] = []
    at: dict[tuple[int, int, tuple[float, ...]], int] = {}
    for voxel, body in enumerate(tree.voxel_body.tolist()):
        pose = poses[body]
        middle = pose[:3, :3] @ (origin + side * tree.source[voxel]) + pose[:3, 3]
        for face in np.flatnonzero(outer[tuple(tree.target[voxel].tolist())]).tolist():
            normal = turn_back @ FACES[face].astype(float)
            u, v = across(normal)
            for i, j in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
                point = middle + 0.5 * side * (normal + i * u + j * v)
                key = tuple(np.round(point / side, 3).tolist())
                at[voxel, face, key] = len(points)
                points.append(point)
                motions.append(linkage.motion(body, point))
                normals.append(normal)
    seams = []
    for (voxel, face, key), one in at.items():
        for direction in FACES.tolist():
            other = filled.get(tuple((tree.target[voxel] + direction).tolist()))
            if other is None or tree.voxel_body[other] == tree.voxel_body[voxel]:
                continue
            two = at.get((other, face, key))
            if two is not None:
                seams.append((one, two, turn_back @ np.array(direction, dtype=float)))
    return (np.array(points), np.array(motions)), np.array(normals), seams


def _best_fit(points: F64, motion: F64) -> F64:
    """Motions (d, c, 3) of points (c, 3) less those of the box as a whole."""
    centred = points - points.mean(axis=0)
    rigid = np.zeros((3 * len(points), 6))
    for axis in range(3):
        rigid[axis::3, axis] = 1.0
        rigid[:, 3 + axis] = np.cross(np.eye(3)[axis], centred).ravel()
    base, _ = np.linalg.qr(rigid)
    flat = motion.reshape(len(motion), -1)
    return np.asarray((flat - (flat @ base) @ base.T).reshape(motion.shape))
